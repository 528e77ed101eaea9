"""Lifetimes of chaotic snapping, and how it ends: many initial conditions at every point of a sweep."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats

from snapbeam.dynamics.flow import InitialConditions, held_in_space, starts_of
from snapbeam.dynamics.results import in_unit
from snapbeam.model.integration import Integration
from snapbeam.model.state import State
from snapbeam.model.system import System
from snapbeam.simulation.save import code_flags
from snapbeam.solver.assemble import cycles_of, run_columns
from snapbeam.sweeps.compute import CheckpointOptions, compute_table
from snapbeam.sweeps.points import Columns, PointList
from snapbeam.sweeps.setup import Progress, SweepSetup, sweep_setup
from snapbeam.sweeps.tasks import PointWork, ResultTable
from snapbeam.util.diagnostics import counting
from snapbeam.util.proportions import proportion
from snapbeam.util.status_codes import RunStatus
from snapbeam.util.validation import InputError, checked, instance, integer, nonnegative, or_default, shown, within

if TYPE_CHECKING:
    import xarray as xr

_Array = NDArray[np.float64]
_JEFFREYS = 0.5
_REFUSED = 0.01
"""Goodness below which a later delay is tried."""
_PER_START = ("status", "zero_crossings", "late_crossings", "well", "final")
"""Whole numbers kept of each run: how it ended, crossings in all and in the last quarter, +1 for the well opposite to
the first one and -1 for that, and whether that end is proved."""
TITLE = "lifetimes of the snapping of a struck bistable beam"
CYCLES = 1000
"""Default number of cycles of a run."""
WELLS = ("first", "other")


# After a delay t0 a transient that forgets its past ends at a constant rate kappa = 1/tau: the share that lasts longer
# than t is exp(-(t - t0)/tau).  The rate is estimated from d ends in a total time at risk E by kappa = d/E (Lawless,
# Statistical Models and Methods for Lifetime Data, 2nd ed., 2003, section 4.1).


_FEWEST, _TRIALS = 8, 40
"""Ends that are left at least, beside half of them; delays that are tried at most, about."""


@dataclass(frozen=True, kw_only=True)
class LifetimeSettings:
    """Settings of the estimate of lifetimes.

    Parameters
    ----------
    delay : float, optional
        Delay t0, cycles, before which ends are not counted: by default the first end from which a test does not refuse
        the exponential at 1 %, at most half of them.
    settling_cycles : float
        Cycles, more than 0, without a zero crossing after which snap-through has ended; a later one censors a run.
    confidence : float
        Confidence level of the intervals, in (0, 1).

    See Also
    --------
    snapbeam.dynamics.lifetime_map

    Examples
    --------
    >>> import snapbeam as sb
    >>> sb.dynamics.LifetimeSettings(settling_cycles=20, confidence=0.9).settling_cycles
    20
    """

    delay: float | None = None
    settling_cycles: float = 50.0
    confidence: float = 0.95

    def __post_init__(self) -> None:
        if self.delay is not None:
            nonnegative("delay", self.delay, "cycles")
        if not nonnegative("settling_cycles", self.settling_cycles, "cycles") > 0.0:
            raise InputError(f"settling_cycles = {shown(self.settling_cycles)}: must be greater than 0 cycles")
        within("confidence", self.confidence, 0.0, 1.0)


class LifetimeFit(NamedTuple):
    """An exponential law of lifetimes; arrays of the shape of the batch."""

    lifetime: _Array
    """tau; NaN without an end."""
    low: _Array
    high: _Array
    """Interval of tau; infinite where the ends do not bound it."""
    delay: _Array
    """t0; NaN where nothing ended."""
    ended: NDArray[np.int64]
    """Ends that count."""
    lasting: NDArray[np.int64]
    """Runs that outlived the observation."""
    goodness: _Array
    """Probability of so great a distance from an exponential (Kolmogorov and Smirnov); NaN if fewer than three."""


def fit_lifetime(
    time: ArrayLike, ended: ArrayLike, delay: float | None = None, confidence: float = 0.95
) -> LifetimeFit:
    """Fit exp(-(t - t0)/tau) to times of runs, of which some, not *ended*, are only known to be longer; NaN: no run.

    Without a given *delay*, t0 is the first end from which on the exponential is not refused at 1 % (at most half of
    the ends are left out; if it is refused still, t0 is the first end).  If every run ended, 2 d kappa E is distributed
    as chi squared; with censored times the rate has the posterior of Jeffreys' prior, gamma(d + 1/2, E).
    """
    times, ends = np.broadcast_arrays(np.asarray(time, dtype=np.float64), np.asarray(ended, dtype=bool))
    if times.ndim == 0:
        raise InputError("time: must have at least one dimension, of runs")
    if (times < 0.0).any() or np.isinf(times).any():
        raise InputError("time: must be at least 0 and finite, or NaN where there is no run")
    share = within("confidence", confidence, 0.0, 1.0)
    batch = times.shape[:-1]
    times, ends = times.reshape(-1, times.shape[-1]), ends.reshape(-1, times.shape[-1])
    rows = [_fit_one(t[~np.isnan(t)], e[~np.isnan(t)], delay) for t, e in zip(times, ends, strict=True)]
    begun, count, lasting, exposure, goodness = (np.array(column) for column in zip(*rows, strict=True))
    shape = np.where(lasting == 0, count, count + _JEFFREYS)
    tail = 0.5 * (1.0 - share)
    with np.errstate(divide="ignore", invalid="ignore"):
        tau = np.where(count > 0, exposure / count, np.nan)
        high = np.where(count > 0, exposure / stats.gamma.ppf(tail, np.maximum(shape, 1e-9)), np.inf)
        low = exposure / stats.gamma.ppf(1.0 - tail, np.maximum(shape, 1e-9))
    unknown = exposure <= 0.0
    low, high, tau = (np.where(unknown, other, each) for each, other in ((low, 0.0), (high, np.inf), (tau, np.nan)))
    found: list[Any] = [tau, low, high, begun, count.astype(np.int64), lasting.astype(np.int64), goodness]
    return LifetimeFit(*(each.reshape(batch) for each in found))


def _fit_one(times: _Array, ends: NDArray[np.bool_], delay: float | None) -> tuple[float, ...]:
    """Delay, ends, lasting, time at risk, and goodness."""
    if delay is not None:
        kept = times >= delay
        return (delay, *_from(times[kept] - delay, ends[kept]))
    if not ends.any():
        return np.nan, 0, times.size, float(times.sum()), np.nan
    moments = np.sort(times[ends])
    most = moments.size - max(_FEWEST, moments.size // 2)
    found: tuple[float, ...] = ()
    for dropped in range(0, max(most, 0) + 1, max(1, moments.size // _TRIALS)):
        begun = float(moments[dropped])
        kept = times >= begun
        first = int(np.flatnonzero(ends & (times == begun))[0])
        kept[first] = False
        tried = (begun, *_from(times[kept] - begun, ends[kept]))
        found = found or tried
        if not tried[4] < _REFUSED:
            return tried
    return found


def _from(times: _Array, ends: NDArray[np.bool_]) -> tuple[float, ...]:
    """Fit as :func:`_fit_one`, for times that are counted from the delay."""
    order = np.argsort(times, kind="stable")
    times, ends = times[order], ends[order]
    exposure, count = float(times.sum()), int(ends.sum())
    # the ends in the time that all runs together were at risk come as those of a Poisson process
    at_risk = np.arange(times.size, 0, -1)
    spent = np.cumsum(at_risk * np.diff(times, prepend=0.0))
    marks = spent[ends] / exposure if exposure > 0.0 else np.empty(0)
    lasting = int(times.size - count)
    if lasting == 0:
        marks = marks[:-1]
    goodness = float(stats.kstest(marks, "uniform", method="exact").pvalue) if marks.size >= 2 else np.nan
    return count, lasting, exposure, goodness


@dataclass(frozen=True, eq=False)
class LifetimeWork(PointWork):
    """The points of a sweep, each run from many starts."""

    initial_conditions: InitialConditions = field(default_factory=InitialConditions)

    @cached_property
    def integers(self) -> tuple[str, ...]:
        """Names of the columns of whole numbers."""
        return tuple(f"{name}_{s}" for name in _PER_START for s in range(self.initial_conditions.count))

    @cached_property
    def numbers(self) -> tuple[str, ...]:
        """Names of the columns of real numbers."""
        return tuple(f"last_snap_{s}" for s in range(self.initial_conditions.count))

    @property
    def runs_per_point(self) -> int:
        """Runs that a point takes."""
        return self.initial_conditions.count

    @cached_property
    def parameters(self) -> dict[str, Any]:
        """Everything the numbers depend on, plain."""
        kept = list(_PER_START)
        return self.setup.identity() | {"lifetimes": kept, "starts": self.initial_conditions.describe()}

    def compute(self, points: Columns, threads: int | None = None, progress: Progress | None = None) -> ResultTable:
        """Integrate every run of *points*."""
        size, count = next(iter(points.values())).size, self.initial_conditions.count
        integers = np.zeros((len(_PER_START), count, size), dtype=np.int32)
        numbers = np.full((count, size), np.nan)
        cycle = np.empty(size)
        for system, _, which, own in self.setup.groups(points):
            columns = {name: values for name, values in own.items() if not name.startswith("initial_state.")}
            cycle[which] = cycles_of(system, run_columns(system, columns))
        side = -1 if self.setup.system.striker is None or self.setup.system.striker.side == "below" else 1
        for s in range(count):

            def report(done: int, _: int, s: int = s) -> None:
                if progress is not None:
                    progress((s * size + done) // count, size)

            def start(system: System, state: State | None, own: Columns, s: int = s) -> State:
                return self.initial_conditions.state(system, s, state, own.get("contact.location"))

            # how long it goes on is what is asked
            found = self.setup.integrate(points, threads, report, start=start, endless=True)
            integers[0, s], integers[1, s] = found["status"], found["zero_crossings"]
            integers[2, s] = found["zero_crossings_last_quarter"]
            integers[3, s] = np.where(found["final_well"] == side, -1, 1)
            integers[4, s] = found["final_well_proven"]
            numbers[s] = found["last_zero_crossing"] / cycle
        return ResultTable(integers.reshape(-1, size).T.copy(), numbers.T.copy())

    def unfinished(self, size: int, status: RunStatus = RunStatus.NOT_RUN) -> ResultTable:
        """Rows of points that were not computed."""
        integers = np.zeros((size, len(self.integers)), dtype=np.int32)
        integers[:, : self.initial_conditions.count] = status
        return ResultTable(integers, np.full((size, len(self.numbers)), np.nan))

    def columns(self, table: ResultTable) -> dict[str, NDArray[Any]]:
        """Stored results by name, arrays of shape (points, starts)."""
        count = self.initial_conditions.count
        found: dict[str, NDArray[Any]] = {
            name: table.integers[:, i * count : (i + 1) * count] for i, name in enumerate(_PER_START)
        }
        return found | {"last_snap": table.numbers}


START, WELL, AFTER = "start", "well", "after"
_REACHED = (int(RunStatus.OK), int(RunStatus.EARLY_STOP))


@checked
def lifetime_map(
    system: System,
    axes: Mapping[str, Any] | xr.Dataset | Any = None,
    integration: Integration | None = None,
    *,
    initial_conditions: InitialConditions | int = 32,
    settings: LifetimeSettings | None = None,
    after: ArrayLike | None = None,
    checkpoint: str | os.PathLike[str] | CheckpointOptions | None = None,
    cluster: str | None = None,
    progress: Callable[[int, int], object] | bool | None = None,
) -> xr.Dataset:
    """Compute the lifetime of snap-through and the probability of each final well, over any parameters.

    Every point is run from many initial conditions, with the tip's mid-position fixed in space. Snap-through lasts
    until the last zero crossing of mid-span. The survivors exp(-(t - delay)/lifetime) are fitted to the runs that ended
    and to those that did not (:func:`~snapbeam.dynamics.lifetimes.fit_lifetime`).

    Parameters
    ----------
    system : System
        System to run.
    axes : optional
        Parameters and values, as in :func:`snapbeam.sweep`; the system itself by default.
    integration : Integration, optional
        Solver settings, 1000 cycles by default. Runs always end early.
    initial_conditions : InitialConditions or int
        Starts of each point.
    settings : LifetimeSettings, optional
        Delay, settling cycles and confidence.
    after : array_like of int, optional
        Cycles n for the probability that a run still snaps then; by default an eighth, a quarter and a half of the
        cycles, and all less ``settling_cycles``.
    checkpoint, cluster, progress
        Folder, cluster and report, as in :func:`snapbeam.sweep`.

    Returns
    -------
    xarray.Dataset
        Variables over the axes, times in cycles: ``lifetime``, ``delay``, ``goodness`` (probability of so great a
        distance from an exponential), ``runs_ended``, ``runs_snapping``, ``runs_never`` (never crossed),
        ``runs_failed``; ``end_probability`` over ``well``; ``snapping_probability`` over ``after``; intervals ``_low``
        and ``_high``. For every ``start``: ``last_snap``, ``well`` at the end, ``final_well_proven``, ``status``.

    Raises
    ------
    CheckpointError
        If the checkpoint is in use, cannot be written or is damaged beyond repair.

    See Also
    --------
    snapbeam.dynamics.LifetimeSettings, snapbeam.plot.plot_lifetimes, snapbeam.plot.plot_survival

    Examples
    --------
    >>> import snapbeam as sb
    >>> system = sb.paper.struck_beam(frequency_ratio=1.6, velocity_amplitude=0.03, damping_ratio=0.05)
    >>> ds = sb.dynamics.lifetime_map(
    ...     system,
    ...     {"drive.velocity_amplitude": [0.1, 0.2]},
    ...     sb.Integration(cycles=20),
    ...     initial_conditions=4,
    ...     settings=sb.dynamics.LifetimeSettings(settling_cycles=5),
    ... )
    >>> ds.lifetime.dims
    ('velocity_amplitude',)
    """
    instance("system", system, System, "a System")
    require_excitation(system)
    integration = or_default("integration", integration, Integration, "an Integration")
    settings = or_default("settings", settings, LifetimeSettings, "a LifetimeSettings")
    cycles = CYCLES if integration.cycles is None else integration.cycles
    cycles_after = _after(after, cycles, settings)
    integration = integration.replace(cycles=cycles, early_termination=True)
    held = held_in_space(system)
    setup = sweep_setup(held, PointList(_own_point(held)) if axes is None else axes, integration)
    work = LifetimeWork(setup, None, starts_of(initial_conditions))
    keeping = checkpoint if isinstance(checkpoint, CheckpointOptions) else CheckpointOptions(checkpoint)
    table, made = compute_table(work, keeping, cluster=cluster, progress=counting(progress, "lifetimes"))
    dataset = _runs(work, table, made)
    return _single(setup, refit(dataset, settings, cycles_after))


def require_excitation(system: System) -> None:
    """Refuse a system that nothing drives."""
    if not system.moving:
        raise InputError(
            "contacts = []: a beam that nothing strikes or shakes does not go on snapping; give a striker, a "
            "base_excitation, an axial_load or a force that changes with time"
        )


def _after(after: ArrayLike | None, cycles: int, settings: LifetimeSettings) -> NDArray[np.int64]:
    observed = cycles - settings.settling_cycles
    if observed <= 0.0:
        raise InputError(
            f"cycles = {cycles} with settling_cycles = {settings.settling_cycles:g}: must be more than settling_cycles"
        )
    if after is None:
        after = sorted({int(part) for part in (cycles / 8, cycles / 4, cycles / 2, observed) if part <= observed})
    found = [integer(f"after[{i}]", each, 0, int(observed)) for i, each in enumerate(np.atleast_1d(after).tolist())]
    if not found or (np.diff(found) <= 0).any():
        raise InputError(f"after = {found}: must be increasing whole numbers of cycles")
    return np.array(found, dtype=np.int64)


def _own_point(system: System) -> dict[str, NDArray[np.float64]]:
    """One parameter of the system with its own value: a sweep of one point."""
    if system.striker is not None:
        return {"contact.location": np.array([system.striker.location])}
    section, drive = system.moving[0]
    name, value = next(iter(drive.values().items()))
    return {f"{section}.{name}": np.array([value])}


def _single(setup: SweepSetup, dataset: xr.Dataset) -> xr.Dataset:
    own = tuple(_own_point(setup.system))
    one = isinstance(setup.points, PointList) and tuple(setup.points.columns) == own
    return dataset.isel(point=0) if one and setup.points.size == 1 else dataset


def _runs(work: LifetimeWork, table: ResultTable, made: dict[str, Any]) -> xr.Dataset:
    """Dataset with the stored results of every run."""
    from snapbeam.util.datasets import xr

    setup, points = work.setup, work.setup.points
    more = made | {
        f"starts_{name}": int(value) if isinstance(value, bool) else value
        for name, value in work.initial_conditions.describe().items()
    }
    attrs = setup.attributes(TITLE, more)
    dataset = xr.Dataset(coords=setup.coordinates(), attrs=attrs)
    dims = (*points.dims, START)
    kept = work.columns(table)
    failed = ~np.isin(kept["status"], _REACHED)
    last, well = np.where(failed, np.nan, kept["last_snap"]), np.where(failed, 0, kept["well"])
    sides = {"flag_values": np.array([-1, 0, 1], dtype=np.int8), "flag_meanings": "first unknown other"}
    columns: dict[str, tuple[Any, str, str, dict[str, Any]]] = {
        "last_snap": (last, "float64", "cycle of the last crossing; NaN: never, or not known", {}),
        "snaps": (kept["zero_crossings"], "int32", "crossings of the centre", {}),
        "late_snaps": (kept["late_crossings"], "int32", "crossings in the last quarter of the run", {}),
        "end_well": (well, "int8", "well that the run ended about", sides),
        "final_well_proven": (kept["final"] != 0, "bool", "whether the run provably ends there", {}),
        "status": (kept["status"], "int8", "status of the run", code_flags(RunStatus)),
    }
    for name, (values, kind, words, labels) in columns.items():
        dataset[name] = (dims, points.arranged(values.astype(kind)), in_unit("1", words) | labels)
    return dataset


def refit(dataset: xr.Dataset, settings: LifetimeSettings | None = None, after: ArrayLike | None = None) -> xr.Dataset:
    """The lifetimes and probabilities of a lifetime map again, with other settings.

    Parameters
    ----------
    dataset : xarray.Dataset
        Result of :func:`lifetime_map`.
    settings : LifetimeSettings, optional
    after : array_like of int, optional
        Numbers of cycles, as in :func:`lifetime_map`; those of the dataset by default.

    Returns
    -------
    xarray.Dataset
    """
    if "last_snap" not in dataset or START not in dataset["last_snap"].dims:
        raise InputError("dataset: holds no lifetimes of starts")
    settings = LifetimeSettings() if settings is None else settings
    cycles = float(dataset.attrs["cycles"])
    if after is None:
        after = dataset[AFTER].values if AFTER in dataset.coords else None
    cycles_after = _after(after, int(cycles), settings)
    result = dataset.drop_dims([name for name in (AFTER, WELL) if name in dataset.dims])
    runs = result.transpose(..., START)
    dims = runs["last_snap"].dims[:-1]
    last, status = runs["last_snap"].values, runs["status"].values
    good = np.isin(status, _REACHED)
    snapped = good & np.isfinite(last)
    # what ended early provably snaps no more
    settled = runs["final_well_proven"].values.astype(bool) | (status == int(RunStatus.EARLY_STOP))
    observed = cycles - settings.settling_cycles
    lasting = snapped & ~settled & (last > observed)
    time = np.where(snapped, np.where(lasting, np.minimum(last, observed), last), np.nan)
    fit = fit_lifetime(time, snapped & ~lasting, settings.delay, settings.confidence)
    words: dict[str, tuple[Any, str]] = {
        "lifetime": (fit.lifetime, "lifetime of snapping, in cycles"),
        "lifetime_low": (fit.low, "lower limit of the lifetime"),
        "lifetime_high": (fit.high, "upper limit of the lifetime"),
        "delay": (fit.delay, "delay before runs end, in cycles"),
        "goodness": (fit.goodness, "probability of so great a distance from an exponential"),
        "runs_ended": (fit.ended, "runs that say how often snapping ends"),
        "runs_snapping": (lasting.sum(axis=-1), "runs that still snapped at the end"),
        "runs_never": ((good & ~snapped).sum(axis=-1), "runs that never snapped"),
        "runs_failed": ((~good).sum(axis=-1), "runs that failed"),
    }
    for name, (values, text) in words.items():
        result[name] = (dims, values, in_unit("1", text))

    def enter(name: str, dim: str, hits: list[NDArray[np.int64]], words: str) -> None:
        table = np.stack(hits, axis=-1)
        parts = proportion(table, np.broadcast_to(good.sum(axis=-1)[..., None], table.shape), settings.confidence)
        for ending, values, text in zip(
            ("", "_low", "_high"), parts, ("", "lower limit: ", "upper limit: "), strict=True
        ):
            result[f"{name}{ending}"] = ((*dims, dim), values, in_unit("1", f"{text}{words}"))

    ended, well = good & ~lasting, runs["end_well"].values
    result[WELL] = ((WELL,), list(WELLS), {"long_name": "well that a run ends about"})
    hits = [(ended & (well == side)).sum(axis=-1) for side in (-1, 1)]
    enter("end_probability", WELL, hits, "probability of ending in a well")
    result[AFTER] = ((AFTER,), cycles_after, in_unit("1", "cycles"))
    hits = [(good & (time > cycle)).sum(axis=-1) + (lasting & (time == cycle)).sum(axis=-1) for cycle in cycles_after]
    enter("snapping_probability", AFTER, hits, "probability of snapping on after so many cycles")
    result.attrs |= {"settling_cycles": settings.settling_cycles, "confidence": settings.confidence}
    return result
