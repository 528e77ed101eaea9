"""Buckling modes of a clamped-clamped beam in closed form (Eqs. 4-9)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.model.equilibria import landscape_of
from snapbeam.model.matrix_pairs import eigenpairs, fixed_coordinates, is_positive_definite, is_sparse, symmetric
from snapbeam.util.diagnostics import Diagnostic, tell
from snapbeam.util.singular_values import svd
from snapbeam.util.validation import InputError, finite_array, integer, nonnegative, positive, shown, within

MAX_MODES = 256
"""Largest number of modes offered; the closed forms themselves know no limit."""

_Array = NDArray[np.float64]


def wavenumbers(count: int, length: float) -> _Array:
    """Wavenumbers k_i of the first *count* buckling modes, 1/m, ascending (Eq. 7).

    Odd i (symmetric): k_i L = (i + 1) pi.  Even i (antisymmetric): z = k_i L / 2 is the i/2-th positive
    root of tan z = z, found by Newton's method on z - m pi - arctan z, whose slope lies between 0.95
    and 1, so that it converges from z = (m + 1/2) pi for every m.

    Parameters
    ----------
    count : int
        Number of modes, 1 to 256.
    length : float
        Length L of the beam, m.

    Returns
    -------
    array of shape (count,)
    """
    count = integer("count", count, 1, MAX_MODES)
    length = positive("length", length, "m")
    index = np.arange(1, count + 1)
    z = 0.5 * (index + 1) * math.pi
    root = np.arange(1, count // 2 + 1)
    even = (root + 0.5) * math.pi
    for _ in range(6):
        even -= (even - root * math.pi - np.arctan(even)) * (1.0 + even**-2)
    z[1::2] = even
    return np.asarray(2.0 * z / length)


class _Evaluation(NamedTuple):
    """Terms of shape, slope and curvature; the modes are along the first axis."""

    xi: _Array
    k: _Array
    even: NDArray[np.bool_]
    sine: _Array
    cosine: _Array
    factor: _Array
    amplitude: _Array


def _on_beam(x: ArrayLike, length: float) -> _Array:
    """Positions from 0 to *length*, m."""
    position = finite_array("x", x)
    if position.size and (position.min() < 0.0 or position.max() > length):
        bad = position.min() if position.min() < 0.0 else position.max()
        raise InputError(f"x = {bad:g}: must lie in [0, {length:g}] m, on the beam")
    return position


class BucklingModes:
    """The first buckling modes phi_i of a clamped-clamped beam, normalised by Eq. (9).

    The slopes are orthonormal, integral of phi_i' phi_j' = delta_ij, which makes the integrals of
    phi_i''^2 equal to k_i^2 and gives every mode the amplitude sqrt(2) / (k_i sqrt(L)).  With the
    distance xi = x - L/2 from the centre,

        phi_i = sqrt(2)/(k_i sqrt(L)) [1 - (-1)^((i+1)/2) cos k_i xi]               i odd
        phi_i = sqrt(2)/(k_i sqrt(L)) [-2 xi/L + sin(k_i xi)/sin(k_i L/2)]          i even

    which are Eqs. (4)-(8) written about the centre, where the even modes are then exactly 0.

    Parameters
    ----------
    length : float
        Length L of the beam, m.
    count : int
        Number of modes N, 1 to 256.

    Attributes
    ----------
    wavenumber : array of shape (N,)
        k_i, 1/m.
    parity : array of int, shape (N,)
        +1 for the symmetric (odd) modes, -1 for the antisymmetric (even) ones.
    """

    def __init__(self, length: float, count: int) -> None:
        self.length = positive("length", length, "m")
        self.count = integer("count", count, 1, MAX_MODES)
        self.wavenumber = wavenumbers(self.count, self.length)
        index = np.arange(1, self.count + 1)
        self.parity = np.where(index % 2 == 1, 1, -1)
        self._amplitude = math.sqrt(2.0 / self.length) / self.wavenumber
        # factor of the trigonometric part: -(-1)^((i+1)/2) and 1/sin(k_i L/2)
        self._factor = np.where((index // 2) % 2 == 0, 1.0, -1.0)
        self._factor[1::2] = 1.0 / np.sin(0.5 * self.wavenumber[1::2] * self.length)

    @property
    def integral(self) -> _Array:
        """Integrals of phi_i over the length, m^1.5, shape (N,); exactly 0 for the antisymmetric modes."""
        return np.where(self.parity > 0, self._amplitude * self.length, 0.0)

    def shape(self, x: ArrayLike) -> _Array:
        """Mode shapes phi_i at the positions *x* (m, 0 to L); shape (N, *x.shape), in m^0.5."""
        at = self._at(x)
        rigid = np.where(at.even, -2.0 * at.xi / self.length, 1.0)
        return np.asarray(at.amplitude * (rigid + at.factor * np.where(at.even, at.sine, at.cosine)))

    def slope(self, x: ArrayLike) -> _Array:
        """Slopes phi_i' at the positions *x* (m, 0 to L); shape (N, *x.shape), in m^-0.5."""
        at = self._at(x)
        rigid = np.where(at.even, -2.0 / self.length, 0.0)
        waves = at.factor * at.k * np.where(at.even, at.cosine, -at.sine)
        return np.asarray(at.amplitude * (rigid + waves))

    def curvature(self, x: ArrayLike) -> _Array:
        """Curvatures phi_i'' at the positions *x* (m, 0 to L); shape (N, *x.shape), in m^-1.5."""
        at = self._at(x)
        return np.asarray(-at.amplitude * at.factor * at.k**2 * np.where(at.even, at.sine, at.cosine))

    def _at(self, x: ArrayLike) -> _Evaluation:
        position = _on_beam(x, self.length)
        xi = position[np.newaxis] - 0.5 * self.length
        column = (-1, *(1,) * position.ndim)
        k = self.wavenumber.reshape(column)
        return _Evaluation(
            xi=xi,
            k=k,
            even=(self.parity < 0).reshape(column),
            sine=np.sin(k * xi),
            cosine=np.cos(k * xi),
            factor=self._factor.reshape(column),
            amplitude=self._amplitude.reshape(column),
        )


# ----------------------------------------------------------------------------------------------------
# Buckling modes of a beam whose ends turn on rotational springs.


_HALVINGS = 200
_NODES = 16
"""Gauss-Legendre nodes in each panel; a half wave of the last mode has two panels."""


def _mixed(stiffness: float) -> tuple[float, float]:
    """Weights of phi'' and of phi' in the condition at an end, from its stiffness over E I/L."""
    return (0.0, 1.0) if math.isinf(stiffness) else (1.0 / (1.0 + stiffness), stiffness / (1.0 + stiffness))


def _conditions(z: float, left: float, right: float) -> _Array:
    """Matrix of the conditions on phi = a (cos z x - 1) + b sin z x + c x: phi(1) = 0, and both end moments."""
    (bent0, turned0), (bent1, turned1) = _mixed(left), _mixed(right)
    cosine, sine = math.cos(z), math.sin(z)
    return np.array(
        [
            [cosine - 1.0, sine, 1.0],
            [bent0 * z * z, turned0 * z, turned0],
            [-bent1 * z * z * cosine - turned1 * z * sine, -bent1 * z * z * sine + turned1 * z * cosine, turned1],
        ]
    )


def _balance(z: float, left: float, right: float) -> float:
    m = _conditions(z, left, right)
    return float(
        m[0, 0] * (m[1, 1] * m[2, 2] - m[1, 2] * m[2, 1])
        - m[0, 1] * (m[1, 0] * m[2, 2] - m[1, 2] * m[2, 0])
        + m[0, 2] * (m[1, 0] * m[2, 1] - m[1, 1] * m[2, 0])
    )


def spring_wavenumbers(count: int, left: float, right: float) -> _Array:
    """k_i L of the first *count* buckling modes, ascending.

    *left* and *right* are the stiffnesses over E I/L.  A stiffer end raises every one of them, from i pi of pinned ends
    to that of clamped ones, which is at most (i + 1) pi: one root lies in each of these intervals.
    """
    clamped = wavenumbers(count, 1.0)
    sign = math.copysign(1.0, _balance(0.5, left, right))
    found = np.empty(count)
    for i in range(count):
        low, high = (i + 1) * math.pi, float(clamped[i])
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            if middle in (low, high):
                break
            if sign * _balance(middle, left, right) > 0.0:
                low = middle
            else:
                high = middle
        found[i] = 0.5 * (low + high)
        sign = -sign
    return found


class SpringModes:
    """Buckling modes between springs, as :class:`~snapbeam.model.buckling_modes.BucklingModes` are between clamps.

    Slopes are orthonormal, and the curvatures with the springs' energy have the integrals k_i^2.  Every mode rises from
    the left end.  Between equal springs the modes are written about the centre, so that the antisymmetric ones are
    exactly 0 there.  *left* and *right* are rotational stiffnesses over E I/L, infinite for a clamp.
    """

    def __init__(self, length: float, count: int, left: float, right: float) -> None:
        self.length, self.count = length, count
        self.wavenumber = spring_wavenumbers(count, left, right) / length
        alike = left == right
        index = np.arange(1, count + 1)
        self.parity = np.where(index % 2 == 1, 1, -1) if alike else np.zeros(count, dtype=np.int_)
        z = self.wavenumber * length
        if alike:
            # cos z (x - 1/2) - cos(z/2), and sin z (x - 1/2) - (2 x - 1) sin(z/2)
            symmetric = self.parity > 0
            rigid = np.where(symmetric, -np.cos(0.5 * z), 0.0)
            tilt = np.where(symmetric, 0.0, -2.0 * np.sin(0.5 * z))
            cosine, sine = np.where(symmetric, 1.0, 0.0), np.where(symmetric, 0.0, 1.0)
            self._center = 0.5
        else:
            vectors = np.array([_null(_conditions(each, left, right)) for each in z])
            cosine, sine, tilt = vectors.T
            rigid = -cosine
            self._center = 0.0
        self._parts = np.stack((rigid, tilt, cosine, sine))
        nodes, weights = self._panels
        norm = np.sqrt(np.sum(weights * self._at(nodes, 1) ** 2, axis=1))
        rises = np.sign(self._at(0.05 * length / index, 0).diagonal())
        self._parts = self._parts * (rises / norm)

    @cached_property
    def _panels(self) -> tuple[_Array, _Array]:
        nodes, weights = np.polynomial.legendre.leggauss(_NODES)
        edges = np.linspace(0.0, self.length, 2 * (self.count + 1) + 1)
        half = 0.5 * np.diff(edges)
        x = np.clip(edges[:-1, None] + half[:, None] * (1.0 + nodes), 0.0, self.length).ravel()
        return x, (half[:, None] * weights).ravel()

    @cached_property
    def overlap(self) -> _Array:
        """Integrals of phi_i phi_j, m^2, shape (N, N); exactly 0 across parities."""
        x, weights = self._panels
        shapes = self._at(x, 0)
        found: _Array = (shapes * weights) @ shapes.T
        return np.where(np.multiply.outer(self.parity, self.parity) < 0, 0.0, 0.5 * (found + found.T))

    @property
    def integral(self) -> _Array:
        """Integrals of phi_i over the length, m^1.5, shape (N,); exactly 0 for antisymmetric modes."""
        x, weights = self._panels
        return np.where(self.parity < 0, 0.0, self._at(x, 0) @ weights)

    def shape(self, x: ArrayLike) -> _Array:
        """Mode shapes phi_i at the positions *x* (m, 0 to L); shape (N, *x.shape), in m^0.5."""
        return self._at(_on_beam(x, self.length), 0)

    def slope(self, x: ArrayLike) -> _Array:
        """Slopes phi_i' likewise, in m^-0.5."""
        return self._at(_on_beam(x, self.length), 1)

    def curvature(self, x: ArrayLike) -> _Array:
        """Curvatures phi_i'' likewise, in m^-1.5."""
        return self._at(_on_beam(x, self.length), 2)

    def _at(self, x: ArrayLike, derivative: int) -> _Array:
        position = np.asarray(x, dtype=np.float64)
        column = (-1, *(1,) * position.ndim)
        rigid, tilt, cosine, sine = (part.reshape(column) for part in self._parts)
        k = self.wavenumber.reshape(column)
        away = position[np.newaxis] - self._center * self.length
        c, s = np.cos(k * away), np.sin(k * away)
        if derivative == 0:
            return np.asarray(rigid + tilt * away / self.length + cosine * c + sine * s)
        if derivative == 1:
            return np.asarray(tilt / self.length + k * (sine * c - cosine * s))
        return np.asarray(-(k**2) * (cosine * c + sine * s))


def _null(matrix: _Array) -> _Array:
    scaled = matrix / np.abs(matrix).max(axis=1, keepdims=True)
    vector: _Array = svd(scaled)[2][-1]
    return vector


# ----------------------------------------------------------------------------------------------------
# Checks of a structure given by its matrices.


_MINUTE = 4000  # coordinates whose dense eigenvalue problem takes about a minute
_BALANCE = 1e-8  # largest residual force at an equilibrium, relative to its two parts


@dataclass(frozen=True, kw_only=True)
class StructureMatrices:
    """Matrices of a structure as the user gave them; see ``ReducedModel.from_matrices``."""

    mass: ArrayLike
    stiffness: ArrayLike
    contact_shape: ArrayLike
    midspan_shape: ArrayLike | None
    nonlinear_stiffness: float
    well_amplitude: ArrayLike | None
    length_scale: float
    damping_ratio: ArrayLike | None
    reference_frequency: float | None
    damping: ArrayLike | None = None
    transverse_force: ArrayLike | None = None
    base_shape: ArrayLike | None = None
    elongation_matrix: ArrayLike | None = None
    patch_shape: ArrayLike | None = None
    modes: int | None = None


def damping_ratios(value: ArrayLike, count: int) -> _Array:
    """One damping ratio a mode, each in [0, 1), from a number or *count* numbers."""
    array = finite_array("damping_ratio", value)
    if array.ndim == 0:
        within("damping_ratio", float(array), 0.0, 1.0, closed="left")
    else:
        _require_shape("damping_ratio", array, (count,), "a number or one for each mode")
        for i, ratio in enumerate(array):
            within(f"damping_ratio[{i}]", float(ratio), 0.0, 1.0, closed="left")
    return np.array(np.broadcast_to(array, (count,)))


def checked_structure(given: StructureMatrices) -> dict[str, Any]:
    """Fields of a reduced model for a structure; raises an ``InputError`` with the reason."""
    mass, stiffness = _pair(given)
    count = mass.shape[0]
    rows: dict[str, _Array | None] = {"contact_shape": _shape("contact_shape", given.contact_shape, count)}
    for name in ("midspan_shape", "base_shape", "patch_shape"):
        value = getattr(given, name)
        rows[name] = None if value is None else _shape(name, value, count)
    for name in ("transverse_force", "well_amplitude"):
        value = getattr(given, name)
        if value is not None:
            value = finite_array(name, value)
            _require_shape(name, value, (count,), "one number for each coordinate")
        rows[name] = value
    gamma = nonnegative("nonlinear_stiffness", given.nonlinear_stiffness)
    elongation: Any = None
    if given.elongation_matrix is not None:
        elongation = _matrix("elongation_matrix", given.elongation_matrix)
        _require_shape("elongation_matrix", elongation, (count, count), "as large as the mass matrix")
        elongation = symmetric("elongation_matrix", elongation)
        if gamma == 0.0:
            raise InputError("elongation_matrix with nonlinear_stiffness = 0: has no effect; give nonlinear_stiffness")
    if rows["transverse_force"] is not None and not rows["transverse_force"].any():
        rows["transverse_force"] = None
    if rows["well_amplitude"] is not None and rows["transverse_force"] is not None:
        raise InputError("well_amplitude with transverse_force: leave it out, the equilibria follow from the force")

    ratio, damping = None, None
    if given.damping is None:
        ratio = finite_array("damping_ratio", 0.0 if given.damping_ratio is None else given.damping_ratio)
    elif given.damping_ratio is not None:
        raise InputError(
            f"damping with damping_ratio = {shown(given.damping_ratio)}: must be one of the two; leave one out"
        )
    else:
        damping = _matrix("damping", given.damping)
        _require_shape("damping", damping, (count, count), "as large as the mass matrix")
        damping = symmetric("damping", damping)
    fixed = fixed_coordinates(stiffness, mass)
    if fixed.any():
        _tell_fixed(fixed, stiffness)
        free = np.flatnonzero(~fixed)
        _release(rows, fixed, mass)
        mass = mass[free][:, free]
        stiffness = stiffness[free] if stiffness.ndim == 1 else stiffness[free][:, free]
        elongation = None if elongation is None else elongation[free][:, free]
        damping = None if damping is None else damping[free][:, free]
        if ratio is not None and ratio.shape == (count,):
            ratio = ratio[: free.size]  # the others are those of the fixed coordinates
        count = free.size
    _require_mass(mass)
    if rows["base_shape"] is not None:
        _tell_multiplied(rows["base_shape"], mass)
    if given.modes is not None:
        modes = integer("modes", given.modes, 1, min(MAX_MODES, count))
        if rows["well_amplitude"] is not None and rows["well_amplitude"].any():
            raise InputError(
                "well_amplitude with modes: the lowest modes of the unstressed structure do not contain it; leave modes out"
            )
        rows["well_amplitude"] = None
        if stiffness.ndim == 1:
            stiffness = np.diag(stiffness)
        stiffness, basis = eigenpairs(stiffness, mass, count=modes)
        if rows["base_shape"] is not None:
            rows["base_shape"] = mass @ rows["base_shape"]  # back by the inverse of the modal mass, which is 1
        rows = {name: None if row is None else basis.T @ row for name, row in rows.items()}
        if gamma > 0.0:
            elongation = basis.T @ (basis if elongation is None else elongation @ basis)
        damping = None if damping is None else basis.T @ (damping @ basis)
        mass, count = np.eye(modes), modes
    if elongation is not None:
        elongation = _stretching(_dense(elongation))
    if damping is not None:
        damping = _losing(_dense(damping))
    contact_shape, force = rows["contact_shape"], rows["transverse_force"]
    assert contact_shape is not None
    midspan_shape = contact_shape.copy() if rows["midspan_shape"] is None else rows["midspan_shape"]
    if force is None:
        equilibrium = _equilibrium(rows["well_amplitude"], stiffness, gamma, midspan_shape, elongation)
    else:
        equilibrium = landscape_of(stiffness, gamma, force, midspan_shape, elongation).lower.amplitude
    reference = given.reference_frequency
    return {
        "mass": mass,
        "stiffness": stiffness,
        "nonlinear_stiffness": gamma,
        "well_amplitude": equilibrium,
        "transverse_force": force,
        "length_scale": positive("length_scale", given.length_scale, "m"),
        "given_damping_ratio": None if ratio is None else damping_ratios(ratio, count),
        "damping": damping,
        "midspan_shape": midspan_shape,
        "contact_shape": contact_shape,
        "base_shape": rows["base_shape"],
        "elongation_matrix": elongation,
        "patch_shape": rows["patch_shape"],
        "given_reference_frequency": None if reference is None else positive("reference_frequency", reference, "Hz"),
    }


def _pair(given: StructureMatrices) -> tuple[Any, Any]:
    """Mass and stiffness, both sparse only if they were given so and only some of their modes are needed."""
    mass, stiffness = _matrix("mass", given.mass), _matrix("stiffness", given.stiffness)
    if mass.ndim != 2 or mass.shape[0] != mass.shape[1] or mass.size == 0:
        raise InputError(f"mass of shape {mass.shape}: must be a square matrix (N, N)")
    count = mass.shape[0]
    if stiffness.ndim == 2:
        _require_shape("stiffness", stiffness, (count, count), "as large as the mass matrix")
    else:
        _require_shape("stiffness", stiffness, (count,), "a diagonal (N,) or a matrix (N, N)")
    sparse = is_sparse(mass) and is_sparse(stiffness)
    if count >= _MINUTE and sparse and given.modes is None:
        raise InputError(
            f"mass of shape {mass.shape}: sparse matrices of {_MINUTE} coordinates or more need modes, the number of lowest "
            f"modes to keep, 1 to {MAX_MODES}"
        )
    if count >= _MINUTE and not sparse:
        seconds = 60.0 * (count / _MINUTE) ** 3
        tell(
            [
                Diagnostic(
                    "large-matrices",
                    f"mass of shape {mass.shape}: its natural frequencies take about {seconds / 60.0:.0f} min; give sparse "
                    "matrices and modes, the number of lowest modes to keep",
                    {"seconds": seconds},
                )
            ]
        )
    if not sparse or given.modes is None:
        mass, stiffness = _dense(mass), _dense(stiffness)
    return symmetric("mass", mass), stiffness if stiffness.ndim == 1 else symmetric("stiffness", stiffness)


def _matrix(name: str, value: Any) -> Any:
    """A finite array, or a sparse one by rows."""
    if not is_sparse(value):
        return finite_array(name, value)
    from scipy.sparse import csr_array

    matrix = csr_array(value)
    return csr_array((finite_array(name, matrix.data), matrix.indices, matrix.indptr), shape=matrix.shape)


def _dense(matrix: Any) -> Any:
    """A sparse matrix of SciPy as an array; anything else as it is."""
    return matrix.toarray() if is_sparse(matrix) else matrix


def _require_mass(mass: Any) -> None:
    if is_positive_definite(mass):
        return
    lowest = "" if is_sparse(mass) else f", but its lowest eigenvalue is {np.linalg.eigvalsh(mass)[0]:g}"
    raise InputError(
        f"mass: must be positive definite{lowest}; leave out fixed coordinates, and condense those without mass"
    )


def _tell_fixed(fixed: NDArray[np.bool_], stiffness: Any) -> None:
    where = np.flatnonzero(fixed)
    largest = float((stiffness if stiffness.ndim == 1 else stiffness.diagonal())[where].max())
    listed = ", ".join(str(i) for i in where[:8]) + (", ..." if where.size > 8 else "")
    tell(
        [
            Diagnostic(
                "fixed-coordinates",
                f"stiffness: penalties up to {largest:.3g} on its diagonal fix the coordinates {listed}; snapbeam removes "
                f"them, and the model has {fixed.size - where.size} coordinates",
                {"removed": where.size, "penalty": largest},
            )
        ]
    )


def _release(rows: dict[str, _Array | None], fixed: NDArray[np.bool_], mass: Any) -> None:
    """Leave the fixed coordinates out of every row; a base that moves them acts on the others through the mass."""
    base, well, contact = rows["base_shape"], rows["well_amplitude"], rows["contact_shape"]
    if well is not None and well[fixed].any():
        raise InputError("well_amplitude: must be 0 in the coordinates that a penalty in the stiffness fixes")
    if contact is not None and not contact[~fixed].any():
        raise InputError(
            "contact_shape: must not be zeros only in the coordinates that no penalty in the stiffness fixes"
        )
    for name, row in rows.items():
        rows[name] = None if row is None else row[~fixed]
    if base is not None and base[fixed].any():
        free = np.flatnonzero(~fixed)
        across = mass[free][:, np.flatnonzero(fixed)] @ base[fixed]
        rows["base_shape"] = base[free] + _solved(mass[free][:, free], across)


def _solved(mass: Any, right: _Array) -> _Array:
    if is_sparse(mass):
        from scipy.sparse.linalg import spsolve

        return np.asarray(spsolve(mass.tocsc(), right))
    return np.linalg.solve(mass, right)


def _tell_multiplied(base: _Array, mass: Any) -> None:
    """Warn of a base_shape m r where r moves each coordinate by 0 or 1, but m r does not."""

    def is_rigid(row: _Array) -> bool:
        size = np.abs(row)
        return bool(size.any() and (np.minimum(size, np.abs(size - 1.0)) < 1e-6).all() and size.max() > 0.5)

    if is_rigid(base):
        return
    moved = _solved(mass, base)
    if is_rigid(moved):
        message = (
            f"base_shape of {base.size} numbers up to {np.abs(base).max():g}: is the mass matrix times a motion of each coordinate "
            "by 0 or 1, and is multiplied by the mass matrix once more; give that motion, without the mass matrix"
        )
        tell([Diagnostic("multiplied-base-shape", message, {"largest": float(np.abs(base).max())})])


def _stretching(matrix: _Array) -> _Array:
    eigenvalue = np.linalg.eigvalsh(matrix)
    if eigenvalue[0] < -1e-12 * max(abs(float(eigenvalue[-1])), 1e-300) or not matrix.any():
        raise InputError(
            f"elongation_matrix: its lowest eigenvalue is {eigenvalue[0]:g}; must be at least 0, and the greatest greater "
            "than 0; give the geometric stiffness matrix of a unit tension"
        )
    return matrix


def _losing(matrix: _Array) -> _Array:
    eigenvalue = np.linalg.eigvalsh(matrix)
    if eigenvalue[0] < -1e-12 * max(float(eigenvalue[-1]), 0.0):
        raise InputError(
            f"damping: its lowest eigenvalue is {eigenvalue[0]:g}; must be at least 0, so that no motion gains energy"
        )
    return np.asarray(0.5 * matrix + 0.5 * matrix.T)


def _equilibrium(
    a: _Array | None, stiffness: _Array, gamma: float, midspan_shape: _Array, elongation: _Array | None = None
) -> _Array:
    if a is None or not a.any():
        return np.zeros(midspan_shape.size)
    given = f"well_amplitude = {a.tolist()}"
    if gamma == 0.0:
        raise InputError(f"{given}: must be zero unless nonlinear_stiffness is greater than 0")
    bent = stiffness * a if stiffness.ndim == 1 else stiffness @ a
    pulled = a if elongation is None else elongation @ a
    stretched = gamma * (a @ pulled) * pulled
    residual = float(np.abs(bent + stretched).max())
    if residual > _BALANCE * max(float(np.abs(bent).max()), float(np.abs(stretched).max())):
        raise InputError(f"{given}: must satisfy K0 a + gamma (a . a) a = 0, but leaves {residual:g}")
    lift = float(midspan_shape @ a)
    if lift >= 0.0:
        raise InputError(f"{given}: must be the lower well, but displaces the centre by {lift:g}, not downward")
    return a


def _shape(name: str, value: ArrayLike, count: int) -> _Array:
    array = finite_array(name, value)
    _require_shape(name, array, (count,), "one number for each coordinate")
    if not array.any():
        raise InputError(f"{name} = {array.tolist()}: must not be all zeros")
    return array


def _require_shape(name: str, array: _Array, shape: tuple[int, ...], meaning: str) -> None:
    if array.shape != shape:
        raise InputError(f"{name} of shape {array.shape}: must have the shape {shape}, {meaning}")
