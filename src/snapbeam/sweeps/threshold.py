"""Thresholds of the interwell response along one parameter, and quantities of maps."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.model.integration import Integration
from snapbeam.model.parameters import lookup, ratio_of
from snapbeam.model.system import System
from snapbeam.simulation.simulate import simulate
from snapbeam.sweeps.compute import CheckpointOptions, compute_sweep
from snapbeam.sweeps.points import Grid
from snapbeam.sweeps.setup import Progress, SweepSetup, sweep_setup
from snapbeam.util.diagnostics import counting
from snapbeam.util.status_codes import ResponseClass, RunStatus
from snapbeam.util.validation import InputError, shown

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "Difference", "Notch", "class_fraction", "compare_maps", "interwell_threshold", "is_interwell", "threshold",
    "threshold_notch",
]  # fmt: skip


_OUTCOMES = (
    "band_found",
    "no_interwell_in_range",
    "lowest_value_is_interwell",
    "highest_run_is_intrawell",
    "undecided",
    "not_searched",
)
"""Meanings of the values 0 to 5 of the variable ``outcome``."""


def threshold(
    system: System,
    parameter: str,
    values: ArrayLike,
    axes: Mapping[str, ArrayLike] | None = None,
    integration: Integration | None = None,
    *,
    progress: Progress | bool | None = None,
) -> xr.Dataset:
    """Find the threshold of the interwell response along one parameter, over any other parameters, as a band.

    The boundary is fractal in places: interwell values may lie below intrawell values. The result therefore has two
    curves, exact on the grid: the lowest interwell value, and the value from which every run is interwell.

    A run that leaves the displacements of a local force, as in pull-in to an electrode, counts as interwell if it does
    so at ``accuracy="reference"`` too (``pull_in``); another ``DIVERGED`` run has failed. The dynamic pull-in voltage
    is a threshold over ``force.voltage`` with ``initial_well="unforced"``.

    Parameters
    ----------
    system : System
        Nominal system.
    parameter : str
        Real parameter to raise, such as ``"velocity_amplitude"`` or ``"force.voltage"``.
    values : array_like
        Values of that parameter, strictly increasing, in its unit.
    axes : mapping of str to array_like, optional
        Axes of the threshold, as in :func:`snapbeam.sweep`; none by default.
    integration : Integration, optional
        Solver settings. Runs always end early.
    progress : callable or bool, optional
        Report of runs, as in :func:`snapbeam.sweep`.

    Returns
    -------
    xarray.Dataset
        Variables over the axes:

        - ``lower_threshold``: lowest value with an interwell run; NaN if no run is interwell.
        - ``upper_threshold``: lowest value from which every run with a response class is interwell; NaN if the
          highest such run is intrawell.
        - ``last_intrawell``: highest value with an intrawell run below ``lower_threshold``.
        - ``failed_runs``: number of runs without a response class.  Such a run is neither interwell nor
          intrawell.
        - ``lower_threshold_min``, ``upper_threshold_max``: lower limit of the first curve if every failed run were
          interwell, and upper limit of the second if every failed run were intrawell.  They differ from the
          curves only where a failed run leaves the threshold open; NaN where no value of the range is the limit.
        - ``outcome``: one of the flags ``band_found``, ``no_interwell_in_range``, ``lowest_value_is_interwell``,
          ``highest_run_is_intrawell``, ``undecided`` (no run is known to be interwell, but runs failed) and
          ``not_searched`` (no run has a response class).

        Over the axes and the values: ``response_class`` and ``status`` of every run; without axes also the extremes of
        the centre's displacement.

    Raises
    ------
    InputError
        If the parameter is no real number, or there are fewer than two values.

    See Also
    --------
    snapbeam.sweep, snapbeam.uncertainty.quantile_threshold, snapbeam.plot.plot_threshold

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> system = paper.struck_beam(frequency_ratio=1.2, velocity_amplitude=0.18)
    >>> found = sb.threshold(
    ...     system, "drive.velocity_amplitude", [0.02, 0.08, 0.14, 0.2],
    ...     {"drive.frequency_ratio": [1.0, 1.2]}, sb.Integration(cycles=20),
    ... )
    >>> found["lower_threshold"].dims
    ('frequency_ratio',)
    """
    row = system.parameter(parameter) if isinstance(system, System) else lookup(parameter)
    if row.quantity.kind is not float:
        raise InputError(f"parameter = {shown(parameter)}: must be a real number, such as velocity_amplitude")
    axes = {} if axes is None else axes
    if not isinstance(axes, Mapping):
        raise InputError(f"axes = {shown(axes)}: must map parameters to arrays of values")
    try:
        count = 0 if isinstance(values, (str, bytes)) else len(values)  # type: ignore[arg-type]
    except TypeError:  # of what has no length
        count = 0
    if count < 2:
        raise InputError(f"{parameter}: must be an array of at least two values to choose from")
    asked = Integration() if integration is None else integration
    if not isinstance(asked, Integration):
        raise InputError(f"integration = {shown(integration)}: must be an Integration")
    setup = sweep_setup(system, {**axes, row.name: values}, asked.replace(early_termination=True))
    computed = compute_sweep(setup, CheckpointOptions(), progress=counting(progress, "threshold", "runs"))
    along = row.name if row.name in setup.points.axes else ratio_of(row.name)
    return _dataset(setup, along, computed)


def _dataset(setup: SweepSetup, along: str, computed: xr.Dataset) -> xr.Dataset:
    """Reduce the response classes of a whole grid to thresholds."""
    from snapbeam.util.datasets import xr

    assert isinstance(setup.points, Grid)
    row = lookup(along)
    values = setup.points.axes[along]
    dims = tuple(lookup(name).short for name in setup.points.axes if name != along)
    whole = (*dims, row.short)
    response = computed["response_class"].transpose(*whole).values
    pulled_in = np.zeros_like(response, dtype=bool)
    if any(law.is_limited() for law in setup.system.local_forces):
        ended = np.argwhere(computed["status"].transpose(*whole).values == RunStatus.DIVERGED)
        axes = dict(setup.points.axes)
        axes[along] = axes.pop(along)  # the last, as of the statuses
        for at in ended:
            point = {name: own[i].item() for (name, own), i in zip(axes.items(), at, strict=True)}
            pulled_in[tuple(at)] = _pulls_in(*setup.neighbour(point))
    rows = _thresholds(np.where(pulled_in, ResponseClass.TRANSIENT_2, response))
    attrs = setup.attributes("threshold of the interwell response of a struck bistable beam")
    attrs.pop("early_termination")
    attrs |= {"parameter": row.short, "runs": int(response.size), "pull_in_runs": int(pulled_in.sum())}
    dataset = xr.Dataset(coords=setup.coordinates(), attrs=attrs)
    words = row.quantity.long_name
    symbol = f" {row.quantity.symbol}" if row.quantity.symbol else ""
    padded = np.append(values, np.nan)
    for name, text in (
        ("lower_threshold", f"lower threshold of the interwell response: {words}{symbol}"),
        ("upper_threshold", f"{words}{symbol} above which all runs are interwell"),
        ("last_intrawell", f"highest {words}{symbol} run below that without snap-through"),
        ("lower_threshold_min", f"lowest {words}{symbol} that may be interwell, failed runs included"),
        ("upper_threshold_max", f"{words}{symbol} above which no run failed or is intrawell"),
    ):
        dataset[name] = (dims, padded[rows[name]], {"units": row.quantity.unit, "long_name": text})
    failed = {"units": "1", "long_name": "runs without a response class"}
    dataset["failed_runs"] = (dims, rows["failed_runs"], failed)
    flags = {"flag_values": np.arange(len(_OUTCOMES), dtype=np.int8), "flag_meanings": " ".join(_OUTCOMES)}
    labels = {"units": "1", "long_name": "kind of result"} | flags
    dataset["outcome"] = (dims, rows["outcome"].astype(np.int8), labels)
    dataset["pull_in"] = (whole, pulled_in, {"units": "1", "long_name": "run that leaves the displacements of a force"})
    extremes = () if dims else ("min_midspan_displacement", "max_midspan_displacement")
    for name in ("response_class", "status", *extremes):
        dataset[name] = (whole, computed[name].transpose(*whole).values, computed[name].attrs)
    return dataset


def _pulls_in(system: System, integration: Integration) -> bool:
    """Return whether a run leaves the displacements of a local force, at the accuracy of reference too."""
    how = integration.replace(step=None, accuracy="reference", early_termination=False)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            run = simulate(system, how).dataset
    except InputError:  # it begins outside of them
        return False
    time, q, p = (run[name].values[-2:] for name in ("time", "modal_amplitude", "modal_velocity"))
    later = q[-1] + 2.0 * (time[-1] - time[0]) * p[-1]
    diverged = str(run.attrs["status"]).startswith(RunStatus.DIVERGED.name)
    return diverged and bool(np.isfinite(later).all()) and not system.unloaded_potential.holds(later)


def _thresholds(response: NDArray[np.int8]) -> dict[str, NDArray[Any]]:
    """Return the rows of the thresholds of columns of response classes, the rows along the last axis.

    A row equal to the number of rows means that no row of the column is the threshold.
    """
    interwell, intrawell = response >= ResponseClass.TRANSIENT_1, response == ResponseClass.INTRAWELL
    failed = ~(interwell | intrawell)
    count = response.shape[-1]
    first, first_min = _lowest(interwell), _lowest(interwell | failed)
    always = _lowest(interwell & _above_all(intrawell))
    always_max = _lowest(interwell & _above_all(intrawell | failed))
    below = intrawell & (np.arange(count) < first[..., None])
    outcome = np.select(
        [failed.all(axis=-1), (first == count) & failed.any(axis=-1), first == count, first == 0, always == count],
        [5, 4, 1, 2, 3],
        0,
    )
    return {
        "lower_threshold": first,
        "upper_threshold": always,
        "last_intrawell": np.where(below.any(axis=-1), count - 1 - _lowest(below[..., ::-1]), count),
        "lower_threshold_min": first_min,
        "upper_threshold_max": always_max,
        "failed_runs": failed.sum(axis=-1),
        "outcome": outcome,
    }


def _lowest(chosen: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return the lowest chosen row of each column; the number of rows if none is chosen."""
    return np.where(chosen.any(axis=-1), chosen.argmax(axis=-1), chosen.shape[-1])


def _above_all(chosen: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return whether no chosen row of the column lies at a row or above it."""
    later: NDArray[np.bool_] = np.logical_or.accumulate(chosen[..., ::-1], axis=-1)[..., ::-1]
    return ~later


# ----------------------------------------------------------------------------------------------------
# Quantities of maps: thresholds, notches, class fractions and differences.


_Array = NDArray[np.float64]


def is_interwell(response: NDArray[np.int8]) -> NDArray[np.bool_]:
    """Return which responses snapped through at least once."""
    return np.asarray(response >= ResponseClass.TRANSIENT_1)


def interwell_threshold(ds: xr.Dataset, amplitude: str = "velocity_amplitude") -> _Array:
    """Return the smallest interwell amplitude at each point of the other axis of a map.

    The threshold is NaN where no run is interwell, and where a failed run at a smaller amplitude leaves it open.
    Points that were never started (status ``NOT_RUN``) are left out.
    """
    response = ds["response_class"].transpose(..., amplitude)
    if response.ndim != 2:
        raise InputError(
            f"map over {response.dims}: must have {amplitude!r} and one more axis; select one value of the others"
        )
    snapped = is_interwell(response.values)
    failed = response.values == ResponseClass.UNKNOWN
    if "status" in ds:
        failed &= ds["status"].transpose(*response.dims).values != RunStatus.NOT_RUN
    values = ds[amplitude].values.astype(float)
    lowest = np.argmax(snapped, axis=1)
    known = snapped.any(axis=1) & (np.argmax(snapped | failed, axis=1) == lowest)
    return np.where(known, values[lowest], np.nan)


@dataclass(frozen=True)
class Notch:
    """Local minimum of a threshold: position, height, and the interval within one step of the height."""

    position: float
    height: float
    low: float
    high: float


def threshold_notch(x: _Array, threshold: _Array, step: float, window: tuple[float, float]) -> Notch:
    """Return the deepest local minimum of a threshold curve inside a window.

    The position is the middle of the interval around the lowest point in which the curve is within one *step* of the
    amplitude axis; this interval is the uncertainty of the position.
    """
    inside = (x >= window[0]) & (x <= window[1]) & np.isfinite(threshold)
    if not inside.any():
        raise InputError(f"window = {window}: must contain a point of the threshold")
    at = int(np.flatnonzero(inside)[np.argmin(threshold[inside])])
    limit = threshold[at] + 1.0001 * step
    first = last = at
    while first > 0 and threshold[first - 1] <= limit:
        first -= 1
    while last < x.size - 1 and threshold[last + 1] <= limit:
        last += 1
    return Notch(float(0.5 * (x[first] + x[last])), float(threshold[at]), float(x[first]), float(x[last]))


def class_fraction(response: NDArray[np.int8], kind: ResponseClass, where: NDArray[np.bool_] | None = None) -> float:
    """Return the fraction of the points, or of those selected by *where*, in a class; NaN without points."""
    points = response if where is None else response[where]
    return float(np.mean(points == kind)) if points.size else float("nan")


@dataclass(frozen=True)
class Difference:
    """Differences between two maps over the same grid.

    ``changed``: fraction of points with another class.  ``snapped``: fraction of points where only one response is
    interwell.  ``at_border``: fraction of the changed points that have a neighbour of another class in the first map.
    ``share``: maximum change of a class fraction.  ``threshold``: ratio of the mean thresholds, second over first.
    ``unknown``: fraction of points whose class is unknown in at least one map; all other numbers leave them out.
    They are NaN if no point is known in both maps.
    """

    changed: float
    snapped: float
    at_border: float
    share: float
    threshold: float
    unknown: float


def compare_maps(first: xr.Dataset, second: xr.Dataset) -> Difference:
    """Compare the classes of two maps over the same grid, at the points whose class is known in both."""
    a, b = first["response_class"].values, second["response_class"].values
    if a.shape != b.shape or a.ndim != 2:
        raise InputError(f"maps of shapes {a.shape} and {b.shape}: must have the same grid with two axes")
    known = (a != ResponseClass.UNKNOWN) & (b != ResponseClass.UNKNOWN)
    changed = known & (a != b)
    border = np.zeros_like(changed)
    for axis in (0, 1):
        lower = [slice(None)] * 2
        upper = [slice(None)] * 2
        lower[axis], upper[axis] = slice(None, -1), slice(1, None)
        step = (np.diff(a, axis=axis) != 0) & known[tuple(lower)] & known[tuple(upper)]
        border[tuple(lower)] |= step
        border[tuple(upper)] |= step
    shares = [abs(class_fraction(a, kind, known) - class_fraction(b, kind, known)) for kind in ResponseClass]
    curves = [interwell_threshold(ds) for ds in (first, second)]
    both = np.isfinite(curves[0]) & np.isfinite(curves[1])
    return Difference(
        changed=float(changed[known].mean()) if known.any() else float("nan"),
        snapped=float((is_interwell(a) != is_interwell(b))[known].mean()) if known.any() else float("nan"),
        at_border=float(border[changed].mean()) if changed.any() else float("nan"),
        share=max(shares),
        threshold=float(curves[1][both].mean() / curves[0][both].mean()) if both.any() else float("nan"),
        unknown=float(1.0 - known.mean()),
    )
