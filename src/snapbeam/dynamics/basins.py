"""Basins of attraction on a plane of states: the verified attractor that each state goes to, or undecided."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import ndimage, special, stats

from snapbeam.dynamics.attractors import UNDECIDED, Attractors, Cloud
from snapbeam.dynamics.flow import Flow
from snapbeam.dynamics.periodic_orbits import state_of
from snapbeam.dynamics.results import coordinate_names, fixed_parameters, labelled, reported
from snapbeam.dynamics.stroboscope import Stroboscope, settling_periods
from snapbeam.model.state import State
from snapbeam.util.diagnostics import Diagnostic, tell, to_json
from snapbeam.util.proportions import proportion
from snapbeam.util.validation import InputError, InputTypeError, axis, checked, instance, integer, shown

if TYPE_CHECKING:
    import xarray as xr

_Array = NDArray[np.float64]
_SIGMAS = 3.0
_AMONG = 8
"""Looks in a row at which a state must lie among the points of a chaotic attractor."""
_MANY = 0.05
"""Share of undecided states from which on a warning is given."""
_SAMPLE = 300
"""Number of states without a neighbour of another label that are integrated at half the step too."""
_SENSITIVE = 0.01
"""Share of labels that change with the step from which on a warning is given."""
_CONFIDENCE = 0.95


@checked
def basins_of_attraction(
    attractors: Attractors,
    grid: Mapping[str, ArrayLike],
    *,
    fixed_coordinates: State | ArrayLike | None = None,
    periods: int | None = None,
    every: int = 10,
    progress: Callable[[int, int], object] | bool | None = None,
) -> xr.Dataset:
    """Compute the attractor that each state of a plane goes to.

    A state goes to a periodic attractor once it is in a ball about one of its points in which the flow contracts
    (:class:`~snapbeam.dynamics.attractors.Ball`). It goes to a chaotic attractor if it is among its points at eight
    consecutive checks and at the end. All other states are undecided after *periods*, -1; more than 5 % of them give a
    warning. The tip's mid-position is fixed in space.

    Near a fractal border the error of the integration changes labels. Every state with a neighbour of another label,
    and 300 random others, are integrated at half the step too. ``sensitive`` marks changed labels; ``sensitive_share``
    is their share of the plane, with its 95 % interval (Wilson, for the sampled part); above 1 % it gives a warning.

    Parameters
    ----------
    attractors : Attractors
        Result of :func:`find_attractors`.
    grid : mapping of str to array_like
        Two coordinates with their values, such as ``{"amplitude[1]": ..., "velocity[1]": ...}``, strictly increasing.
    fixed_coordinates : State or array_like of shape (d,), optional
        The other coordinates; by default those of a beam at rest in the well of the start.
    periods : int, optional
        Maximum number of periods of the drive. By default 16 time constants of the slowest decay, in [200, 20,000]:
        that of the slowest mode, min(zeta_j omega_j), or of a slower perturbation of a periodic attractor.
    every : int
        Periods between two checks.
    progress : callable or bool, optional
        Report of periods, as in :func:`snapbeam.sweep`.

    Returns
    -------
    xarray.Dataset
        ``basin`` over the two coordinates, the number of the attractor; ``captured_after``, in periods; ``sensitive``:
        1 changed, 0 unchanged, -1 not tested. Attributes: ``undecided``, the share of undecided states;
        ``termination_reason``; ``sensitive_share``, ``sensitive_share_low`` and ``sensitive_share_high``.

    See Also
    --------
    snapbeam.dynamics.find_attractors, snapbeam.dynamics.basin_entropy, snapbeam.plot.plot_basins

    Examples
    --------
    >>> import snapbeam as sb
    >>> system = sb.paper.struck_beam(frequency_ratio=1.6, velocity_amplitude=0.03, damping_ratio=0.05)
    >>> found = sb.dynamics.find_attractors(system, 12)
    >>> grid = {"amplitude[1]": [-1.2, 0.0, 1.2], "velocity[1]": [-0.5, 0.5]}
    >>> sb.dynamics.basins_of_attraction(found, grid).basin.shape
    (3, 2)
    """
    instance("attractors", attractors, Attractors, "Attractors, as sb.dynamics.find_attractors gives")
    flow = attractors.flow
    step = integer("every", every, 1, 10**4)
    rates = [-each.exponent for each in attractors.attractors if each.orbit is not None]
    total, rule = settling_periods(flow, periods, rates, name="periods", low=1)
    names, columns, rows = _plane(flow, grid, fixed_coordinates)
    label, after = _labelled(attractors, flow, rows, total, step, reported(progress, "basins", "periods"))
    dataset = _dataset(attractors, names, columns, label, after, total)
    dataset.attrs["termination_reason"] = (
        f"{total} periods ({rule})" if (label == UNDECIDED).any() else "every state is decided"
    )
    if isinstance(flow, Stroboscope):
        tested, interior = _tested(dataset["basin"].values)
        finer, _ = _labelled(attractors, flow.with_half_step, rows[tested], total, step, reported(False, "", ""))
        _add_sensitivity(dataset, tested, interior, finer != label[tested])
    told = _diagnostics(dataset, attractors)
    dataset.attrs["diagnostics"] = to_json(told)
    tell(told)
    return dataset


def _diagnostics(dataset: xr.Dataset, attractors: Attractors) -> tuple[Diagnostic, ...]:
    share, periods, found = float(dataset.attrs["undecided"]), int(dataset.attrs["periods"]), []
    if share > _MANY:
        message = (
            f"basins: {100 * share:.3g} % of the states are undecided after {periods} periods; increase periods, or search "
            f"for further attractors with more states (the search had {attractors.labels.size})"
        )
        numbers = {"undecided": share, "periods": float(periods)}
        found.append(Diagnostic("dynamics.basins_undecided", message, numbers))
    names = ("sensitive_share", "sensitive_share_low", "sensitive_share_high")
    numbers = {name: float(dataset.attrs.get(name, 0.0)) for name in names}
    share, low, high = numbers.values()
    if share > _SENSITIVE:
        assert isinstance(attractors.flow, Stroboscope)
        remedy = "at this accuracy only shares and entropies are reliable, not single labels"
        if attractors.flow.integration.accuracy != "reference":
            remedy = (
                "find the attractors with integration = Integration(accuracy='reference') (--accuracy reference) for a "
                "smaller error"
            )
        message = (
            f"basins: the labels of {100 * share:.2g} % of the states ({100 * low:.2g} to {100 * high:.2g} % at 95 %) "
            "change if the step is halved, so near are they to a border; the variable sensitive marks those that were "
            f"found; {remedy}"
        )
        found.append(Diagnostic("dynamics.basins_sensitive", message, numbers))
    return tuple(found)


def _tested(labels: NDArray[np.int64]) -> tuple[NDArray[np.int64], int]:
    """Indices of the states to integrate at half the step, those inside of basins last, and the number of states inside."""
    size = (3,) * labels.ndim
    border = (ndimage.maximum_filter(labels, size) != ndimage.minimum_filter(labels, size)).ravel()
    inside = np.flatnonzero(~border)
    chosen = np.random.Generator(np.random.Philox(_SAMPLE)).permutation(inside)[:_SAMPLE]
    return np.concatenate((np.flatnonzero(border), np.sort(chosen))), inside.size


def _add_sensitivity(dataset: xr.Dataset, tested: NDArray[np.int64], inside: int, changed: NDArray[np.bool_]) -> None:
    """Add the labels that change at half the step, and their share of the plane with its interval."""
    basin = dataset["basin"]
    flags = np.full(basin.size, -1, dtype=np.int8)
    flags[tested] = changed
    words = {
        "units": "1", "long_name": "whether the label changes at half the step", "flag_values": np.array([-1, 0, 1], np.int8),
        "flag_meanings": "not_tested same_label other_label",
    }  # fmt: skip
    dataset["sensitive"] = (basin.dims, flags.reshape(basin.shape), words)
    border = basin.size - inside
    sampled, hits = tested.size - border, int(changed[border:].sum())
    shares: tuple[Any, ...] = (hits / max(inside, 1),) * 3
    if sampled < inside:
        shares = proportion(hits, sampled, _CONFIDENCE)
    for name, share in zip(("", "_low", "_high"), shares, strict=True):
        dataset.attrs[f"sensitive_share{name}"] = (int(changed[:border].sum()) + float(share) * inside) / basin.size


def _plane(
    flow: Flow, grid: Mapping[str, ArrayLike], rest: State | ArrayLike | None
) -> tuple[list[str], list[_Array], _Array]:
    known = coordinate_names(flow)
    if not isinstance(grid, Mapping) or len(grid) != 2:
        raise InputTypeError(f"grid = {shown(grid)}: must map two coordinates to their values")
    for name in grid:
        if name not in known:
            raise InputError(f"grid {name}: is not a coordinate; must be one of {', '.join(known[:4])}, ...")
    names = list(grid)
    columns = [axis(name, grid[name], -np.inf, np.inf) for name in names]
    if rest is None and not isinstance(flow, Stroboscope):
        base = np.zeros(flow.dimension)
    else:
        base = state_of(flow, "fixed_coordinates", rest)
    rows = np.repeat(base[None], columns[0].size * columns[1].size, axis=0)
    rows[:, [known.index(name) for name in names]] = np.stack(np.meshgrid(*columns, indexing="ij"), -1).reshape(-1, 2)
    return names, columns, rows


def _labelled(
    found: Attractors, flow: Flow, rows: _Array, total: int, step: int, progress: Callable[[int, int], object]
) -> tuple[NDArray[np.int64], _Array]:
    label, after = np.full(len(rows), UNDECIDED), np.full(len(rows), np.nan)
    among = np.zeros((len(found.attractors), len(rows)), dtype=np.int64)
    open_, x, done = np.arange(len(rows)), rows, 0
    while done < total and open_.size:
        ahead = min(step, total - done)
        x = flow.advance(x, ahead).states
        done += ahead
        taken = np.zeros(open_.size, dtype=bool)
        for number, each in enumerate(found.attractors):
            captures = each.trapping_region
            if isinstance(captures, Cloud):
                inside = captures.holds(x)
                among[number, open_] = np.where(inside, among[number, open_] + 1, 0)
                if done < total:
                    continue
                inside &= among[number, open_] >= _AMONG
            else:
                held = [ball.holds(x) for ball in captures if ball.radius > 0.0]
                inside = np.any([np.zeros(open_.size, dtype=bool), *held], axis=0)
            inside &= ~taken
            label[open_[inside]], after[open_[inside]] = number, done
            taken |= inside
        lost = ~np.isfinite(x).all(axis=1)
        open_, x = open_[~taken & ~lost], x[~taken & ~lost]
        progress(done, total)
    if done < total:
        progress(total, total)
    return label, after


def _dataset(
    found: Attractors, names: list[str], columns: list[_Array], label: NDArray[np.int64], after: _Array, total: int
) -> xr.Dataset:
    shape = tuple(column.size for column in columns)
    kinds = [f"period_{each.period}" if each.orbit else "chaotic" for each in found.attractors]
    words = {"units": "1", "long_name": "number of the attractor that a state goes to; -1: undecided",
             "flag_values": np.arange(-1, len(kinds)), "flag_meanings": " ".join(["undecided", *kinds])}  # fmt: skip
    places = [coordinate_names(found.flow).index(name) for name in names]
    coords = {
        name: (name, column, {"units": "1", "long_name": _long_name(name)})
        for name, column in zip(names, columns, strict=True)
    }
    attrs = {"title": "basins of attraction", "periods": total, "undecided": float((label == UNDECIDED).mean())}
    points = found.every_point[..., places]
    variables = {
        "basin": (names, label.reshape(shape), words),
        "captured_after": (names, after.reshape(shape), "periods until certain"),
        "attractor_points": (("attractor", "point", "coordinate"), points, "attractors there"),
    }
    return labelled(variables, coords, fixed_parameters(found.flow) | attrs)


def _long_name(name: str) -> str:
    if name.startswith("amplitude"):
        return f"amplitude of buckling mode {name[10:-1]} over that of the well"
    if name.startswith("velocity"):
        return f"velocity of buckling mode {name[9:-1]} over omega_1 times the amplitude of the well"
    return name


# How rough the borders between outcomes are, and how safe the inside is: measures of any array of labels.


class BasinEntropy(NamedTuple):
    """Basin entropy: uncertainty of the outcome in boxes of a grid, over the decided points."""

    basin: float
    """Mean over the boxes of the entropy of the labels within, S_b; NaN if no point is decided."""
    boundary: float
    """Mean over the boxes that hold more than one label, S_bb; NaN where none does."""
    boxes: int
    """Boxes with at least one decided point."""
    boundary_boxes: int
    basin_error: float
    """Standard error of S_b from counting, as if boxes were independent; moving or refining the grid moves it too."""
    boundary_error: float
    """The same of S_bb; NaN with fewer than two boxes."""
    undecided: float
    """Share of the points that are undecided; the means above leave them out."""
    basin_bounds: tuple[float, float]
    """S_b of all points is within these, whichever of the labels present the undecided points have."""
    boundary_bounds: tuple[float, float]
    """The same of S_bb; NaN where no box can hold a border."""

    @property
    def is_fractal(self) -> bool:
        """True if S_bb exceeds ln 2 by three standard errors: sufficient, not necessary, for a fractal boundary."""
        return bool(self.boundary_bounds[0] - _SIGMAS * self.boundary_error > np.log(2.0))


def _labels(labels: ArrayLike) -> NDArray[np.int64]:
    try:
        array = np.asarray(labels)
    except ValueError:
        raise InputError("labels: must be an array, not a list of unequal lengths") from None
    except Exception as error:  # of an object that cannot be one
        raise InputTypeError(f"labels = {shown(labels)}: must be an array of labels ({error})") from None
    if array.dtype.kind not in "iub":
        raise InputTypeError(f"labels of {array.dtype}: must be whole numbers")
    if array.ndim < 1 or array.size < 2:
        raise InputError(f"labels of shape {array.shape}: must be a grid of at least two points")
    return array.astype(np.int64)


@checked
def basin_entropy(labels: ArrayLike, box: int = 5) -> BasinEntropy:
    """Basin entropy and boundary basin entropy (Daza et al., Sci. Rep. 6 (2016) 31416).

    In each box of *box* points a side, with shares p_j of the labels, the entropy is S = -sum p_j ln p_j. S_b is its
    mean over all boxes, S_bb over those that hold a border. Undecided points are left out, except of the bounds.

    Parameters
    ----------
    labels : array_like of int
        Grid of any dimension of basins or classes; negative: undecided.
    box : int
        Points along a side; incomplete boxes are ignored.

    See Also
    --------
    snapbeam.dynamics.uncertainty_exponent, snapbeam.dynamics.dynamical_integrity

    Examples
    --------
    >>> import numpy as np
    >>> import snapbeam as sb
    >>> halves = np.repeat([[0, 1]], 10, axis=0).repeat(5, axis=1)  # two basins with a straight border
    >>> sb.dynamics.basin_entropy(halves, 5).basin
    0.0
    """
    grid = _labels(labels)
    side = integer("box", box, 2, min(grid.shape))
    cut = grid[tuple(slice(0, n - n % side) for n in grid.shape)]
    shape = [part for n in cut.shape for part in (n // side, side)]
    boxes = cut.reshape(shape).transpose(*range(0, 2 * cut.ndim, 2), *range(1, 2 * cut.ndim, 2))
    boxes = boxes.reshape(-1, side**cut.ndim)
    kinds = np.unique(boxes[boxes >= 0])
    counts = (
        np.stack([(boxes == kind).sum(axis=1) for kind in kinds], axis=1) if kinds.size else np.zeros((len(boxes), 1))
    )
    decided = counts.sum(axis=1)
    lost = boxes.shape[1] - decided
    entropy = _entropy(counts)
    mixed = (counts > 0).sum(axis=1) > 1
    (basin, basin_error), (boundary, boundary_error) = _mean(entropy[decided > 0]), _mean(entropy[mixed])
    least, most, border = _extremes(counts, lost)
    if kinds.size:
        outer = float(least.mean()), float(most.mean())
        inner = (
            _border_bounds(least[mixed], border[~mixed & (lost > 0)], False),
            _border_bounds(most[mixed], most[~mixed & (lost > 0)], True),
        )
    else:
        outer = inner = float("nan"), float("nan")
    return BasinEntropy(
        basin, boundary, int((decided > 0).sum()), int(mixed.sum()), basin_error, boundary_error,
        float((boxes < 0).mean()), outer, inner,
    )  # fmt: skip


def _entropy(counts: NDArray[Any]) -> _Array:
    """Entropy of rows of counts; 0 where all are 0."""
    return np.asarray(special.entr(counts / np.maximum(counts.sum(axis=1, keepdims=True), 1.0)).sum(axis=1))


def _extremes(counts: NDArray[Any], lost: NDArray[Any]) -> tuple[_Array, _Array, _Array]:
    """Minimum and maximum entropy of boxes whose *lost* points have any of the labels, and that of one differing point."""
    ordered = np.sort(counts.astype(np.float64), axis=1)
    low = ordered.copy()
    low[:, -1] += lost  # the entropy is least if all of them join the most frequent label
    high = ordered.copy()
    # it is greatest if they raise the rarest labels to one level
    for i in range(1, high.shape[1] + 1):
        before = ordered[:, :i].sum(axis=1)
        level = (before + lost) / i
        fits = (level >= ordered[:, i - 1]) & ((level <= ordered[:, i]) if i < high.shape[1] else True) & (lost > 0)
        high[fits, :i] = level[fits, None]
    total = counts.sum(axis=1) + lost
    one = np.stack([np.ones_like(total, dtype=np.float64), np.maximum(total - 1.0, 0.0)], axis=1)
    return _entropy(low), _entropy(high), _entropy(one)


def _border_bounds(certain: _Array, possible: _Array, greatest: bool) -> float:
    """Extreme of the mean over boxes that hold a border and any of those that may hold one."""
    possible = np.sort(possible)[:: -1 if greatest else 1]
    if greatest:
        possible = possible[possible > 0.0]
    sums = np.append(0.0, np.cumsum(possible)) + certain.sum()
    sizes = np.arange(possible.size + 1) + certain.size
    means = sums[sizes > 0] / sizes[sizes > 0]
    if not means.size:
        return float("nan")
    return float(means.max() if greatest else means.min())


def _mean(values: _Array) -> tuple[float, float]:
    """Mean and its standard error; NaN where there is none."""
    if values.size < 2:
        return (float(values[0]) if values.size else float("nan")), float("nan")
    return float(values.mean()), float(values.std(ddof=1) / np.sqrt(values.size))


class UncertaintyExponent(NamedTuple):
    """Uncertainty exponent alpha of the fraction of uncertain points, f ~ epsilon^alpha."""

    exponent: float
    """alpha; the dimension of the border is that of the grid less alpha."""
    error: float
    """Standard error of the straight line; NaN with two sizes."""
    size: _Array
    """epsilon, in cells."""
    share: _Array
    """f(epsilon): of the decided points, those with a decided neighbour of another label."""
    undecided: float
    """Share of the points that are undecided; the values above leave them out."""
    bounds: tuple[float, float]
    """alpha of all points is within these, whichever labels the undecided points have."""


@checked
def uncertainty_exponent(labels: ArrayLike, sizes: ArrayLike | None = None) -> UncertaintyExponent:
    """The uncertainty exponent of the borders on a grid (Grebogi et al., Phys. Lett. A 99 (1983) 415).

    A point is uncertain at epsilon if a point that many cells away along an axis has another label.

    Parameters
    ----------
    labels : array_like of int
        A negative label is undecided.
    sizes : array_like of int, optional
        epsilon in cells; powers of two up to an eighth of the shortest side by default.

    See Also
    --------
    snapbeam.dynamics.basins_of_attraction, snapbeam.dynamics.basin_entropy

    Examples
    --------
    >>> import numpy as np
    >>> import snapbeam as sb
    >>> labels = (np.arange(256)[:, None] < np.arange(256)).astype(int)  # two basins with a straight border
    >>> abs(sb.dynamics.uncertainty_exponent(labels).exponent - 1.0) < 0.1
    True
    """
    grid = _labels(labels)
    most = min(grid.shape) // 2 if grid.ndim else 0
    if sizes is None:
        sizes = [2**i for i in range(20) if 2**i <= max(min(grid.shape) // 8, 2)]
    steps = [integer("sizes", size, 1, most) for size in np.atleast_1d(sizes).tolist()]
    if len(set(steps)) < 2:
        raise InputError(f"sizes = {steps}: must be at least two different ones")
    shares, low, high = np.array([_uncertain(grid, step) for step in steps]).T
    if not (shares > 0.0).all():
        raise InputError("labels: no border is met at some of the sizes, so that there is no exponent")
    away = np.log(steps)
    line = stats.linregress(away, np.log(shares))
    error = float(line.stderr) if len(steps) > 2 else float("nan")
    weight = away - away.mean()
    weight = weight / (weight @ weight)
    with np.errstate(divide="ignore"):
        below, above = np.log(low), np.log(high)
    used = weight != 0.0
    bounds = tuple(
        float(np.sum(weight[used] * np.where(weight[used] > 0.0, rising[used], falling[used])))
        for rising, falling in ((below, above), (above, below))
    )
    return UncertaintyExponent(
        float(line.slope), error, np.array(steps, dtype=float), shares, float((grid < 0).mean()), (bounds[0], bounds[1])
    )


def _uncertain(grid: NDArray[np.int64], step: int) -> tuple[float, float, float]:
    """Share of the decided points, that far from the rim, that have another label that far away; bounds of that of all."""
    inner = grid[tuple(slice(step, n - step) for n in grid.shape)]
    other, unknown = np.zeros(inner.shape, dtype=bool), inner < 0
    for along in range(grid.ndim):
        for shift in (-step, step):
            window = [slice(step, n - step) for n in grid.shape]
            window[along] = slice(step + shift, grid.shape[along] - step + shift)
            there = grid[tuple(window)]
            other |= (there != inner) & (there >= 0) & (inner >= 0)
            unknown |= there < 0
    decided = int((inner >= 0).sum())
    return float(other.sum()) / max(decided, 1), float(other.mean()), float((other | unknown).mean())


class Integrity(NamedTuple):
    """Integrity measures of a basin in a window; lengths in units of the grid's axes with their weights."""

    global_measure: float
    """GIM: share of the window that it fills."""
    local_measure: float
    """LIM: distance from the attractor to the nearest other point or rim; NaN if no attractor is given."""
    factor: float
    """IF: radius of the largest circle within it."""
    center: tuple[int, ...]
    """Centre of that circle."""
    undecided: float
    """Share of the window that is undecided; it counts as outside, so that every measure is a lower bound."""


@checked
def dynamical_integrity(
    labels: ArrayLike, label: int, attractor: tuple[int, ...] | None = None, spacing: ArrayLike | None = None
) -> Integrity:
    """Global and local integrity measure and integrity factor of one basin in a window.

    Definitions: Soliman and Thompson (J. Sound Vib. 135 (1989) 453) and Rega and Lenci (Nonlinear Anal. 63 (2005) 902).
    The rim of the window counts as a border, undecided points as outside the basin.

    Parameters
    ----------
    labels : array_like of int
        Basins over a grid of any dimension; negative: undecided.
    label : int
        Label of the basin.
    attractor : tuple of int, optional
        Indices of the grid point nearest to its attractor.
    spacing : array_like, optional
        Distance between points along each axis; 1 by default.

    See Also
    --------
    snapbeam.dynamics.basins_of_attraction, snapbeam.dynamics.basin_entropy

    Examples
    --------
    >>> import numpy as np
    >>> import snapbeam as sb
    >>> labels = np.ones((21, 21), dtype=int)
    >>> labels[5:16, 5:16] = 0  # a basin of 11 x 11 states
    >>> sb.dynamics.dynamical_integrity(labels, 0, attractor=(10, 10)).local_measure
    6.0
    """
    grid = _labels(labels)
    inside = np.pad(grid == integer("label", label, -(2**31), 2**31), 1)
    steps = np.ones(grid.ndim) if spacing is None else np.asarray(spacing, dtype=float)
    if steps.shape != (grid.ndim,) or not (steps > 0.0).all():
        raise InputError(f"spacing = {shown(spacing)}: must be a number greater than 0 for each of {grid.ndim} axes")
    away = ndimage.distance_transform_edt(inside, sampling=steps)
    away = away[(slice(1, -1),) * grid.ndim]
    center = tuple(int(i) for i in np.unravel_index(int(np.argmax(away)), grid.shape))
    local = float("nan")
    if attractor is not None:
        if len(attractor) != grid.ndim or any(not 0 <= i < n for i, n in zip(attractor, grid.shape, strict=True)):
            raise InputError(f"attractor = {shown(attractor)}: must be indices of a point of the grid {grid.shape}")
        local = float(away[tuple(attractor)])
    return Integrity(float((grid == int(label)).mean()), local, float(away.max()), center, float((grid < 0).mean()))
