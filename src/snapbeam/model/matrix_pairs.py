"""Stiffness and mass matrices: symmetry, coordinates fixed by a penalty, and eigenvalues with a decision on rigid modes."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.util.diagnostics import Diagnostic, Severity, tell
from snapbeam.util.validation import InputError

_Array = NDArray[np.float64]
_EPS = float(np.finfo(np.float64).eps)
_ROUNDING = 1e-10
"""Asymmetry taken for rounding, over the scale of the two rows."""
_SINGLE = float(np.finfo(np.float32).eps)
"""Asymmetry taken for the rounding of single precision."""
_PENALTY = 1e12
"""Minimum ratio of a penalty to every other stiffness, and of the squares of their frequencies."""
_HUGE = 1e14
"""Minimum penalty: the stiffness of a rigid mode may be rounding, far below those of the other modes."""
_WEAK = 1e-8
"""Coupling K_ij^2/(K_ii K_jj) below which a penalty holds its coordinate."""


def is_sparse(matrix: Any) -> bool:
    """True for a sparse matrix of SciPy; an array is told without the import, which takes a seventh of a second."""
    if isinstance(matrix, np.ndarray):
        return False
    from scipy.sparse import issparse

    return bool(issparse(matrix))


def coupled_blocks(coupled: NDArray[np.bool_]) -> tuple[NDArray[np.intp], NDArray[np.int32]]:
    """Order that places coordinates that are coupled, directly or through others, side by side, and sizes of these blocks.

    *coupled* has the shape (N, N), either triangle counts; blocks and their coordinates keep the order of the coordinates.
    """
    reached, before = coupled | coupled.T | np.eye(len(coupled), dtype=bool), 0
    while (count := int(np.count_nonzero(reached))) > before:
        before, links = count, reached.astype(np.float32)  # products of numbers are faster than those of bool
        reached = links @ links > 0.0
    first = reached.argmax(axis=1)
    return np.argsort(first, kind="stable"), np.unique(first, return_counts=True)[1].astype(np.int32)


def symmetric(name: str, matrix: Any) -> Any:
    """The symmetric part of a dense or sparse matrix that is symmetric to single precision.

    The asymmetry of an entry is measured by the largest entries of its row and its column, so that a penalty hides no
    other entry.

    Raises
    ------
    InputError
        For a larger asymmetry, or one triangle without the other.
    """
    size, apart = abs(matrix), abs(matrix - matrix.T)
    if not apart.max() > 0.0:
        return matrix
    largest = np.asarray(_largest(size)).ravel()
    largest = np.maximum(largest, np.asarray(_largest(size.T)).ravel())
    weight = 1.0 / np.sqrt(np.where(largest > 0.0, largest, 1.0))
    if is_sparse(matrix):
        from scipy.sparse import coo_array

        found = coo_array(apart)
        rows, columns = found.coords
        scaled = found.data * weight[rows] * weight[columns]
        at = int(np.argmax(scaled))
        i, j, worst = int(rows[at]), int(columns[at]), float(scaled[at])
    else:
        dense = apart * weight[:, None] * weight
        i, j = (int(n) for n in np.unravel_index(np.argmax(dense), dense.shape))
        worst = float(dense[i, j])
    if worst > _SINGLE:
        i, j = min(i, j), max(i, j)
        upper, lower = (bool(abs(each(size, k)).max() > 0.0) for each, k in _halves(matrix))
        advice = (
            "check the order of the degrees of freedom in the export"
            if upper and lower
            else f"only the {'upper' if upper else 'lower'} triangle is given; give A + A.T - np.diag(A.diagonal()) of this A"
        )
        raise InputError(
            f"{name}[{i}, {j}] = {float(matrix[i, j])!r}, {name}[{j}, {i}] = {float(matrix[j, i])!r}: must be symmetric; "
            f"{advice}"
        )
    if worst > _ROUNDING:
        tell(
            [
                Diagnostic(
                    "matrix-symmetrised",
                    f"{name}: is symmetric to single precision only ({worst:.2g} of its entries); snapbeam uses its "
                    "symmetric part",
                    {"asymmetry": worst},
                    Severity.INFO,
                )
            ]
        )
    return 0.5 * (matrix + matrix.T)


def _largest(matrix: Any) -> Any:
    found = matrix.max(axis=1)
    return found.toarray() if is_sparse(found) else found


def _halves(matrix: Any) -> list[tuple[Any, int]]:
    if not is_sparse(matrix):
        return [(np.triu, 1), (np.tril, -1)]
    from scipy.sparse import tril, triu

    return [(triu, 1), (tril, -1)]


def fixed_coordinates(stiffness: Any, mass: Any) -> NDArray[np.bool_]:
    """Mask of the coordinates that a penalty on the diagonal of the stiffness holds.

    A penalty is at least 1e14 and 1e12 times every other stiffness, gives its coordinate at least 1e12 times the square of every
    other frequency K_ii/M_ii, and is hardly coupled to the other coordinates.
    """
    own, inertia = _diagonal(stiffness), np.asarray(mass.diagonal(), dtype=np.float64)
    fixed = np.zeros(own.size, dtype=bool)
    order = np.argsort(own, kind="stable")
    below = np.maximum.accumulate(np.abs(own[order]))[:-1]
    with np.errstate(divide="ignore", invalid="ignore"):
        jump = np.where(below > 0.0, own[order][1:] / below, 0.0)
        square = np.where(inertia > 0.0, own / inertia, np.inf)
    gaps = np.flatnonzero((jump >= _PENALTY) & (own[order][1:] >= _HUGE))
    if not gaps.size:
        return fixed
    fixed[order[gaps[0] + 1 :]] = True
    fixed &= square >= _PENALTY * np.abs(square[~fixed]).max()
    if stiffness.ndim == 2:
        rest = np.flatnonzero(~fixed)
        for i in np.flatnonzero(fixed):
            row = stiffness[[i]].toarray() if is_sparse(stiffness) else stiffness[[i]]
            across = np.abs(row.ravel()[rest])
            fixed[i] = (across**2 <= _WEAK * own[i] * np.maximum(np.abs(own[rest]), across)).all()
    return fixed


def _diagonal(stiffness: Any) -> _Array:
    return np.asarray(stiffness if stiffness.ndim == 1 else stiffness.diagonal(), dtype=np.float64)


# ----------------------------------------------------------------------------------------------------
# Eigenvalues.


_DOUBT = 1e6 * _EPS
"""Size of an eigenvalue over the largest: below it, rounding takes more than six digits of an eigenvalue of the whole
matrix."""
_SPREAD = 32.0 * _EPS
"""Error of a Rayleigh quotient, over the root of the sum of the squares of its terms: they round independently."""
_APART = 100.0
"""Minimum ratio of the first eigenvalue that is not 0 to the error of those taken for 0."""
_BESIDE = 10.0
"""Minimum ratio of an eigenvalue that is not 0 to its error."""
_INEXACT = 1e-2
"""Error of an eigenvalue, over the eigenvalue, that is reported."""
_SMALL = 800
"""Number of connected coordinates up to which the dense solver is faster."""
_MORE = 8
_STEPS = 3


class Eigenpairs(NamedTuple):
    """Eigenvalues (n,) ascending, rad^2/s^2, exactly 0 for rigid modes, and mass-normalised columns (N, n)."""

    value: _Array
    vectors: _Array


def eigenpairs(stiffness: Any, mass: Any, magnitude: Any = None, count: int | None = None) -> Eigenpairs:
    """Solve K x = lambda M x for all eigenvalues or the *count* lowest, and decide which of them are 0.

    Coordinates that nothing connects are solved apart, so that each part has a scale of its own.  Small eigenvalues of
    a part come from inverse iteration.  With the terms t_ij = x_i K_ij x_j of its Rayleigh quotient, an eigenvalue has
    the error eps min(sum |t_ij|, 32 sqrt(sum t_ij^2))/(x . M x).  (Rigid modes of 30 pairs, meshes of 50 to 5000
    elements and random ones of 5 to 800 coordinates, had at most a quarter of the first and a sixth of the second.)  An
    eigenvalue is 0 if it is below its error, and if the first one that is not 0 is 100 times as large as that error; an
    error is raised if rounding hides it.  *magnitude* is the sum of the moduli of the terms that the stiffness is the
    sum of, |K| by default.
    """
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    magnitude = abs(stiffness) if magnitude is None else magnitude
    number, label = connected_components(csr_array(stiffness != 0) + csr_array(mass != 0), directed=False)
    order = np.argsort(label, kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(label[order])) + 1)
    sparse = is_sparse(stiffness)
    parts: list[tuple[NDArray[np.intp], _Array, _Array]] = []
    for index in groups:
        if number == 1:
            k, m, size = stiffness, mass, magnitude
        else:
            k, m, size = (each[index][:, index] for each in (stiffness, mass, magnitude))
        asked = index.size if count is None else min(count + _MORE, index.size)
        if sparse and (index.size <= _SMALL or asked > index.size // 2):
            k, m, size = k.toarray(), m.toarray(), size.toarray()
        value, vectors = _lowest(k, m, asked) if is_sparse(k) else _all(k, m)
        parts.append((index, _decided(value, vectors, m, size), vectors))
    value = np.concatenate([each for _, each, _ in parts])
    kept = np.argsort(value, kind="stable")[:count]
    vectors = np.zeros((order.size, kept.size))
    start = 0
    for index, own, columns in parts:
        at = np.flatnonzero((kept >= start) & (kept < start + own.size))
        vectors[np.ix_(index, at)] = columns[:, kept[at] - start]
        start += own.size
    return Eigenpairs(value[kept], vectors)


def _all(stiffness: _Array, mass: _Array) -> tuple[_Array, _Array]:
    """Every eigenvalue of a dense pair; the small ones by inverse iteration, again for those small among them."""
    import scipy.linalg

    if stiffness.shape == (1, 1):
        root = np.sqrt(mass[0])
        return stiffness[0] / root**2, 1.0 / root[:, None]
    value, vectors = scipy.linalg.eigh(stiffness, mass)
    top = float(np.abs(value).max())
    low = np.abs(value) <= _DOUBT * top
    while low.any():
        shifted = stiffness + (value.size * _EPS * top) * mass
        scale = 1.0 / np.sqrt(np.where(np.diag(shifted) > 0.0, np.diag(shifted), np.diag(mass)))
        if not np.isfinite(scale).all():
            break
        factors = scipy.linalg.lu_factor(scale[:, None] * shifted * scale)
        columns = vectors[:, low]
        for _ in range(_STEPS):
            columns = scale[:, None] * scipy.linalg.lu_solve(factors, scale[:, None] * (mass @ columns))
            columns /= np.sqrt(np.sum(columns * (mass @ columns), axis=0))
        value[low], vectors[:, low] = _projected(stiffness, mass, columns)
        rest = vectors[:, ~low]
        vectors[:, ~low] = rest - vectors[:, low] @ (vectors[:, low].T @ (mass @ rest))
        top, before = float(np.abs(value[low]).max()), int(low.sum())
        low &= np.abs(value) <= _DOUBT * top
        if int(low.sum()) == before:
            break
    return value, vectors


def _projected(stiffness: Any, mass: Any, columns: _Array) -> tuple[_Array, _Array]:
    """Eigenvalues and vectors in the span of *columns*."""
    import scipy.linalg

    one, two = columns.T @ (stiffness @ columns), columns.T @ (mass @ columns)
    value, turn = scipy.linalg.eigh(0.5 * (one + one.T), 0.5 * (two + two.T))
    return value, columns @ turn


def _lowest(stiffness: Any, mass: Any, count: int) -> tuple[_Array, _Array]:
    """The lowest eigenvalues of a sparse pair, by the Lanczos method on the inverse; none is missed."""
    from scipy.sparse import csc_array, diags_array
    from scipy.sparse.linalg import LinearOperator, eigsh

    root = 1.0 / np.sqrt(mass.diagonal())
    scale = diags_array(root)
    k, m = csc_array(scale @ stiffness @ scale), csc_array(scale @ mass @ scale)
    start = np.random.default_rng(0).normal(size=k.shape[0])

    def nearest(at: float, factors: Any, number: int) -> _Array:
        inverse = LinearOperator(k.shape, matvec=factors.solve, dtype=np.float64)
        found: _Array = eigsh(k, k=number, M=m, sigma=at, OPinv=inverse, v0=start, which="LA")[1]
        return found

    below = -_EPS * float(np.abs(k.diagonal()).max())
    factors = _factors(k, m, below)
    unstable = min(_negative(factors), count)
    columns = np.zeros((k.shape[0], 0))
    if unstable < count:
        columns = nearest(below, factors, count - unstable)  # the lowest above
    if unstable > 0:
        while _negative(factors) != 0:
            below *= 10.0
            factors = _factors(k, m, below)
        columns = np.hstack((nearest(below, factors, unstable), columns))
    value, columns = _projected(k, m, columns)
    gap = np.diff(value[max(count - _MORE, 1) - 1 :])
    last = max(count - _MORE, 1) - 1 + int(np.argmax(gap))
    found = _negative(_factors(k, m, 0.5 * float(value[last] + value[last + 1])))
    if found != last + 1:
        raise InputError(
            f"modes: {found} natural frequencies lie where the Lanczos method found {last + 1}; give another number of modes"
        )
    return value[: last + 1], root[:, None] * columns[:, : last + 1]


def _factors(stiffness: Any, mass: Any, at: float) -> Any:
    from scipy.sparse import csc_array
    from scipy.sparse.linalg import splu

    return splu(
        csc_array(stiffness - at * mass),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )


def _negative(factors: Any) -> int:
    """Number of negative eigenvalues, by Sylvester's law of inertia: pivots are those of the diagonal."""
    if not np.array_equal(factors.perm_r, factors.perm_c):
        raise InputError("stiffness: has a singular leading part; reorder the coordinates, or give a dense matrix")
    return int((factors.U.diagonal() < 0.0).sum())


def is_positive_definite(matrix: Any) -> bool:
    """Return whether a symmetric matrix, dense or sparse, has only positive eigenvalues."""
    if is_sparse(matrix):
        from scipy.sparse import diags_array

        diagonal = matrix.diagonal()
        if not (diagonal > 0.0).all():
            return False
        scale = diags_array(1.0 / np.sqrt(diagonal))
        try:
            return _negative(_factors(scale @ matrix @ scale, scale @ scale, 0.0)) == 0
        except RuntimeError:  # singular
            return False
    try:
        np.linalg.cholesky(matrix)
    except np.linalg.LinAlgError:
        return False
    return True


def _decided(value: _Array, vectors: _Array, mass: Any, magnitude: Any) -> _Array:
    """The eigenvalues of connected coordinates with 0 for rigid modes."""
    size = np.abs(vectors)
    normal = np.sum(vectors * (mass @ vectors), axis=0)
    scale = np.sum(size * (magnitude @ size), axis=0) / normal
    top = float((magnitude.diagonal() / mass.diagonal()).max())
    noise = 4.0 * _EPS * top
    spread = np.sqrt(np.sum(size**2 * (magnitude**2 @ size**2), axis=0)) / normal
    error = np.minimum(_EPS * scale, _SPREAD * spread) + (
        vectors.shape[0] * noise * _EPS if vectors.shape[0] > 1 else 0.0
    )
    rigid = np.abs(value) <= error
    own = np.where(rigid, 0.0, value)
    elastic = np.abs(own[~rigid])
    lost = ~rigid & (np.abs(own) < _BESIDE * error)
    if vectors.shape[0] > 1:
        lost |= ~rigid & (scale <= noise)
        if rigid.any() and elastic.size and elastic.min() < _APART * error[rigid].max():
            lost |= rigid
    if lost.any():
        at = int(np.flatnonzero(lost)[0])
        raise InputError(
            f"stiffness: whether its eigenvalue {value[at]:.3g} 1/s^2 is 0 cannot be decided, because rounding of the "
            f"matrix is {max(float(error[at]), noise if scale[at] <= noise else 0.0):.2g} 1/s^2; use a coarser mesh, and "
            "set entries that are only rounding to 0"
        )
    share = float(np.max(error[~rigid] / elastic, initial=0.0))
    if share > _INEXACT:
        tell(
            [
                Diagnostic(
                    "frequency-rounded",
                    f"stiffness: rounding of its entries changes a natural frequency by up to {50.0 * share:.2g} %; use a "
                    "coarser mesh",
                    {"relative_error": 0.5 * share},
                )
            ]
        )
    return own
