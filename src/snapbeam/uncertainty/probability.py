"""Probability maps: probabilities of snap-through and of each final well over any parameters."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy import special

from snapbeam.model.integration import Integration
from snapbeam.model.system import System
from snapbeam.sweeps.compute import CheckpointOptions
from snapbeam.sweeps.points import Points, points_of
from snapbeam.sweeps.setup import SweepSetup, sweep_setup, variable_attributes
from snapbeam.uncertainty.distributions import ParameterUncertainty
from snapbeam.uncertainty.monte_carlo import (
    OUTCOMES,
    Event,
    Trials,
    metres_key,
    number_statistic,
    outcome_named,
    trials_of,
)
from snapbeam.uncertainty.optimization import Objective
from snapbeam.util.diagnostics import counting
from snapbeam.util.proportions import proportion
from snapbeam.util.provenance import canonical_json
from snapbeam.util.validation import InputError, InputTypeError, checked, finite_array, integer, shown, within

if TYPE_CHECKING:
    import xarray as xr

_Array = NDArray[np.float64]
_Index = NDArray[np.int64]
Ask = Callable[[_Index, _Index], tuple[NDArray[np.bool_], NDArray[np.bool_]]]
"""Function of points and numbers of samples; returns outcomes, shape (outcomes, runs), and a mask of failed runs."""
TITLE = "probabilities of the response of a struck bistable beam"
OUTCOME = "outcome"


# How many runs each point of a probability map gets: more where its interval is wide, until all are narrow enough.


@dataclass(frozen=True, kw_only=True)
class SamplingPlan:
    """Allocation of runs to the points of a probability map.

    Parameters
    ----------
    half_width : float, optional
        Half width of the interval of *outcome* to reach at every point, in (0, 0.5); None: *initial_runs* runs for
        every point.
    outcome : str
        Outcome of the interval: ``"snap"``, ``"continuous"``, ``"first_well"``, ``"other_well"``, or a statistic beyond
        a value, such as ``"peak_force > 60 N"``.
    initial_runs : int
        First runs of every point, at least 8 where more follow.
    max_runs : int
        Maximum number of runs of a point.
    total_runs : int, optional
        Maximum number of runs of all points together; the widest intervals come first.
    confidence : float
        Confidence level of the intervals (Wilson's), in (0, 1).

    See Also
    --------
    snapbeam.uncertainty.probability_map

    Examples
    --------
    >>> import snapbeam as sb
    >>> plan = sb.uncertainty.SamplingPlan(half_width=0.1, initial_runs=16, max_runs=200)
    >>> plan.outcome
    'snap'
    """

    half_width: float | None = 0.05
    outcome: str = "snap"
    initial_runs: int = 32
    max_runs: int = 10_000
    total_runs: int | None = None
    confidence: float = 0.95

    def __post_init__(self) -> None:
        object.__setattr__(self, "outcome", outcome_named(self.outcome)[0])
        if self.half_width is not None:
            within("half_width", self.half_width, 0.0, 0.5)
        integer("initial_runs", self.initial_runs, 1 if self.half_width is None else 8, 10**7)
        integer("max_runs", self.max_runs, 1, 10**7)
        if self.half_width is not None and self.max_runs < self.initial_runs:
            raise InputError(
                f"max_runs = {self.max_runs} with initial_runs = {self.initial_runs}: must be at least that"
            )
        if self.total_runs is not None:
            integer("total_runs", self.total_runs, 1, 10**12)
        within("confidence", self.confidence, 0.0, 1.0)


@dataclass
class Counts:
    """Counts of outcomes at every point."""

    hits: _Index
    """Hits of each outcome, shape (outcomes, points)."""
    runs: _Index
    """Completed runs."""
    failed: _Index
    rounds: int = 0
    open: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, dtype=bool))
    """Points that have not reached the half width."""

    def limits(self, allocation: SamplingPlan, outcome: int) -> tuple[_Array, _Array, _Array]:
        """Probability of an outcome and its interval, at every point."""
        return proportion(self.hits[outcome], self.runs, allocation.confidence, self.failed)


def allocate(
    ask: Ask, points: int, allocation: SamplingPlan, tell: Callable[[int, int], object] | None = None,
    outcomes: Iterable[str] = OUTCOMES,
) -> Counts:  # fmt: skip
    """Spend runs on points until the interval of each is narrow enough.

    In every round each point that is too wide is given half of the runs that it seems to lack, at most as many as it
    has: the number of looks at the data stays small, and with it what stopping at a lucky one costs in coverage.
    Failed runs count as runs made, and widen the interval.
    """
    outcomes = list(outcomes)
    watched = outcomes.index(allocation.outcome)
    zeros = np.zeros(points, dtype=np.int64)
    counts = Counts(np.zeros((len(outcomes), points), dtype=np.int64), zeros.copy(), zeros.copy())
    wanted = np.full(points, allocation.initial_runs)
    made = 0
    while True:
        wanted = _affordable(counts, wanted, allocation, made, watched)
        if not wanted.any():
            break
        which = np.repeat(np.arange(points), wanted)
        begun = counts.runs + counts.failed
        numbers = np.concatenate([np.arange(b, b + w) for b, w in zip(begun, wanted, strict=True)])
        happened, failed = ask(which, numbers)
        good = ~failed
        np.add.at(counts.runs, which[good], 1)
        np.add.at(counts.failed, which[failed], 1)
        for row, each in zip(counts.hits, happened, strict=True):
            np.add.at(row, which[good & each], 1)
        counts.rounds += 1
        made += which.size
        wanted = _lacking(counts, allocation, watched)
        if tell is not None:
            tell(made, made + int(wanted.sum()))
    counts.open = _is_open(counts, allocation, watched)
    return counts


def _half_widths(counts: Counts, allocation: SamplingPlan, watched: int) -> _Array:
    _, low, high = counts.limits(allocation, watched)
    return np.asarray(0.5 * (high - low))


def _is_open(counts: Counts, allocation: SamplingPlan, watched: int) -> NDArray[np.bool_]:
    if allocation.half_width is None:
        return np.zeros(counts.runs.size, dtype=bool)
    return np.asarray(_half_widths(counts, allocation, watched) > allocation.half_width)


def _lacking(counts: Counts, allocation: SamplingPlan, watched: int) -> _Index:
    """Runs that each point is given next."""
    if allocation.half_width is None:
        return np.zeros_like(counts.runs)
    z = float(special.ndtri(0.5 * (1.0 + allocation.confidence)))
    made = counts.runs + counts.failed
    middle = (counts.hits[watched] + 0.5 * z * z) / (made + z * z)
    need = z * z * middle * (1.0 - middle) / allocation.half_width**2
    more = np.clip(np.ceil(0.5 * (need - made)), 8, np.maximum(made, 8)).astype(np.int64)
    more = np.minimum(more, allocation.max_runs - made)
    return np.where(_is_open(counts, allocation, watched), np.maximum(more, 0), 0)


def _affordable(counts: Counts, wanted: _Index, allocation: SamplingPlan, made: int, watched: int) -> _Index:
    """Runs within the total limit, points with the widest intervals first."""
    if allocation.total_runs is None or made + wanted.sum() <= allocation.total_runs:
        return wanted
    order = np.argsort(-_half_widths(counts, allocation, watched), kind="stable")
    left = allocation.total_runs - made
    granted = np.zeros_like(wanted)
    before = np.cumsum(wanted[order]) - wanted[order]
    granted[order] = np.clip(left - before, 0, wanted[order])
    return granted


@checked
def probability_map(
    system: System,
    axes: Mapping[str, Any] | xr.Dataset | Any,
    uncertainty: ParameterUncertainty | None = None,
    runs: SamplingPlan | int | None = None,
    *,
    outcomes: str | Iterable[str] = (),
    statistics: str | Iterable[str] = (),
    quantiles: float | Iterable[float] = (0.05, 0.5, 0.95),
    integration: Integration | None = None,
    checkpoint: str | os.PathLike[str] | CheckpointOptions | None = None,
    cluster: str | None = None,
    progress: Callable[[int, int], object] | bool | None = None,
) -> xr.Dataset:
    """Compute the probability of each outcome at every point under parameter uncertainty.

    Sample s is the same at every point. Points with the widest intervals get further runs until each interval has the
    requested width.

    Parameters
    ----------
    system : System
        The nominal system.
    axes : mapping of str to array_like, or xarray.Dataset, or pandas.DataFrame
        Points of the map, as in :func:`snapbeam.sweep`: a grid or a list. A sampled parameter is sampled around the
        value of the point.
    uncertainty : ParameterUncertainty
        Uncertain parameters and initial state.
    runs : SamplingPlan or int, optional
        Sampling plan, or the number of runs for every point; by default until the half width of the 95 % interval of
        P(snap) is 0.05 everywhere.
    outcomes : str or sequence of str
        Further outcomes, such as ``"peak_force > 60 N"``. A value without a unit is in that of the statistic; one of
        length or velocity is compared with the displacement or velocity of each sample.
    statistics : str or sequence of str
        Statistics of which mean and quantiles are computed, such as ``"harvested_power"``.
    quantiles : float or sequence of float
        Probabilities of the quantiles, increasing, in (0, 1).
    integration : Integration, optional
        Solver settings. Runs end early unless a statistic, which is of the whole run, is asked for.
    checkpoint : path or CheckpointOptions, optional
        Checkpoint folder; an existing one is resumed.
    cluster, progress
        Cluster and report, as in :func:`snapbeam.sweep`; the total of runs grows.

    Returns
    -------
    xarray.Dataset
        ``probability``, with ``_low`` and ``_high``, over the axes and ``outcome``: ``snap``, ``continuous``,
        ``first_well`` and ``other_well``, of which the last three add up to 1. ``hits``; ``runs`` and ``runs_failed``,
        which widen the intervals; ``reached``: the half width was reached. For each statistic its mean with Student's
        interval (``peak_force``, ``peak_force_low``, ``peak_force_high``), and over ``quantile``
        ``peak_force_quantile`` with the interval of order statistics, infinite where the runs are too few or one
        failed.

    Raises
    ------
    CheckpointError
        If the checkpoint is in use, cannot be written or is damaged beyond repair.

    See Also
    --------
    snapbeam.uncertainty.SamplingPlan, snapbeam.uncertainty.quantile_threshold, snapbeam.sweep

    Notes
    -----
    Stopping where the intervals are narrow keeps their coverage: over probabilities sampled from (0, 1) they hold the truth
    in 95 % of cases.  The share leans towards 0 and 1 by at most 0.006 at a half width of 0.05.

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> system = paper.struck_beam(frequency_ratio=1.2, velocity_amplitude=0.18)
    >>> uncertainty = sb.uncertainty.ParameterUncertainty(
    ...     of={"contact.stiffness": sb.uncertainty.LogNormal(0.2), "location": sb.uncertainty.Normal(0.005)}
    ... )
    >>> axes = {"velocity_amplitude": [0.02, 0.1, 0.2], "frequency_ratio": [1.0, 1.2]}
    >>> integration = sb.Integration(cycles=5)
    >>> ds = sb.uncertainty.probability_map(system, axes, uncertainty, 16, integration=integration)
    >>> ds.probability.sel(outcome="snap", frequency_ratio=1.2).values
    array([0., 0., 1.])
    """
    allocation = allocation_of(runs)
    asked, wanted = outcomes_of(outcomes, allocation), statistics_of(statistics)
    levels = levels_of(quantiles)
    needed = [*(each.statistic for each in asked.values()), *wanted]
    trials = trials_of(
        system, uncertainty, integration, checkpoint=checkpoint, cluster=cluster, statistics=needed
    )  # fmt: skip
    if trials.uncertainty.is_empty:
        raise InputError("uncertainty: nothing is uncertain, so every probability is 0 or 1; use sb.sweep")
    points = points_of(axes, trials.system)
    setup = sweep_setup(trials.system, points, trials.integration)
    counts, values = _counted(trials, points, allocation, asked, wanted, counting(progress, "probability map", "runs"))
    dataset = _dataset(setup, trials, counts, allocation, asked)
    return _with_statistics(dataset, points, values, counts, levels, allocation.confidence)


def _several(given: Any) -> list[Any]:
    given = given.tolist() if isinstance(given, np.ndarray) else given
    return [given] if isinstance(given, (str, Mapping)) or not isinstance(given, Iterable) else list(given)


def outcomes_of(given: Any, allocation: SamplingPlan) -> dict[str, Event]:
    """All outcomes of a map by name: those of every map, those *given*, and the one whose interval is used."""
    return OUTCOMES | dict(outcome_named(each, "outcomes") for each in (*_several(given), allocation.outcome))


def statistics_of(given: Any) -> list[str]:
    """Names of statistics that are numbers, each once."""
    return list(dict.fromkeys(number_statistic("statistics", each).name for each in _several(given)))


def levels_of(given: Any) -> tuple[float, ...]:
    """Probabilities of quantiles, increasing, each in (0, 1)."""
    found = tuple(
        within("quantiles", each, 0.0, 1.0) for each in np.atleast_1d(finite_array("quantiles", given)).ravel()
    )
    if not found or (np.diff(found) <= 0.0).any():
        raise InputError(f"quantiles = {shown(given)}: must be increasing numbers, at least one")
    return found


def allocation_of(runs: SamplingPlan | int | None) -> SamplingPlan:
    """Sampling plan from the argument *runs*."""
    if runs is None:
        return SamplingPlan()
    if isinstance(runs, SamplingPlan):
        return runs
    if isinstance(runs, (bool, np.bool_)) or not isinstance(runs, (int, np.integer)):
        raise InputTypeError(f"runs = {shown(runs)}: must be a number of runs a point, or a SamplingPlan")
    return SamplingPlan(half_width=None, initial_runs=int(runs), max_runs=max(int(runs), 1))


def _counted(
    trials: Trials,
    points: Points,
    allocation: SamplingPlan,
    outcomes: dict[str, Event],
    statistics: list[str],
    tell: Callable[[int, int], object] | None,
) -> tuple[Counts, dict[str, list[_Array]]]:
    """Count outcomes, and keep the values of statistics by point; those of runs that failed are left out."""
    told = [0, 0]
    values: dict[str, list[_Array]] = {name: [] for name in statistics}
    places: list[_Index] = []

    def ask(which: NDArray[np.int64], numbers: NDArray[np.int64]) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        def report(done: int, total: int) -> None:
            if tell is not None:
                tell(told[0] + done, max(told[1], told[0] + total))

        found = trials.statistics(points.take(which), numbers, report)
        told[0] += which.size
        failed = np.any([each.failed(found) for each in outcomes.values()], axis=0)
        places.append(which)
        for name, parts in values.items():
            parts.append(np.where(failed, np.nan, found[name] * found.get(metres_key(name), 1.0)))
        return np.stack([each.happened(found) for each in outcomes.values()]), failed

    def more(made: int, expected: int) -> None:
        told[:] = made, expected
        if tell is not None:
            tell(made, expected)

    counts = allocate(ask, points.size, allocation, more, outcomes)
    order = np.argsort(at := np.concatenate(places), kind="stable")
    ends = np.searchsorted(at[order], np.arange(1, points.size))
    return counts, {name: np.split(np.concatenate(parts)[order], ends) for name, parts in values.items()}


def _with_statistics(
    dataset: xr.Dataset,
    points: Points,
    found: dict[str, list[_Array]],
    counts: Counts,
    levels: tuple[float, ...],
    confidence: float,
) -> xr.Dataset:
    """Add the mean and the quantiles of statistics with their intervals; displacements and velocities in m and m/s."""
    if found:
        dataset["quantile"] = (
            ("quantile",),
            list(levels),
            {"units": "1", "long_name": "probability of not being more"},
        )
    for name, runs in found.items():
        labels = variable_attributes(name, metres=True)
        for ending, dims, words, wanted in (
            ("", points.dims, "mean", [Objective(quantity=name)]),
            (
                "_quantile",
                (*points.dims, "quantile"),
                "quantile",
                [Objective(quantity=name, quantile=q) for q in levels],
            ),
        ):
            table = []
            for own, made in zip(runs, counts.runs + counts.failed, strict=True):
                good = own[~np.isnan(own)]
                table.append([each.estimate(good, int(made) - good.size, confidence) for each in wanted])
            numbers = np.array(table)  # points, quantiles, value and limits
            for k, (limit, text) in enumerate((("", ""), ("_low", "lower limit: "), ("_high", "upper limit: "))):
                own = points.arranged(numbers[..., k] if ending else numbers[:, 0, k])
                dataset[f"{name}{ending}{limit}"] = (
                    dims,
                    own,
                    labels | {"long_name": f"{text}{words} of {labels['long_name']}"},
                )
    return dataset


def _reason(counts: Counts, allocation: SamplingPlan) -> str:
    """Reason why the sampling stopped."""
    still = int(counts.open.sum())
    if allocation.half_width is None:
        return f"{allocation.initial_runs} runs of every point, as given"
    if not still:
        return f"the interval of every point is as narrow as half_width = {allocation.half_width:g}"
    made = counts.runs + counts.failed
    full = int((made[counts.open] >= allocation.max_runs).sum())
    total = "" if full == still else f" and total_runs = {allocation.total_runs}"
    return f"the interval of {still} points is wider than half_width = {allocation.half_width:g}; " + (
        f"{full} have max_runs = {allocation.max_runs}{total}"
    )


def _dataset(
    setup: SweepSetup, trials: Trials, counts: Counts, allocation: SamplingPlan, outcomes: dict[str, Event]
) -> xr.Dataset:
    from snapbeam.util.datasets import xr

    points = setup.points
    drawn = dict(trials.uncertainty.describe())
    more: dict[str, Any] = {
        "uncertainty": canonical_json(drawn),
        "seed": trials.uncertainty.seed,
        "confidence": allocation.confidence,
        "watched_outcome": allocation.outcome,
        "rounds": counts.rounds,
        "runs_made": int(counts.runs.sum() + counts.failed.sum()),
        "termination_reason": _reason(counts, allocation),
    }
    if allocation.half_width is not None:
        more["half_width"] = allocation.half_width
    dataset = xr.Dataset(coords=setup.coordinates(), attrs=setup.attributes(TITLE, more))
    labels = {"long_name": "; ".join(f"{name}: {each.long_name}" for name, each in outcomes.items())}
    dataset[OUTCOME] = ((OUTCOME,), list(outcomes), labels)
    found = [counts.limits(allocation, i) for i in range(len(outcomes))]
    for k, (ending, text) in enumerate((("", ""), ("_low", "lower limit: "), ("_high", "upper limit: "))):
        table = np.stack([points.arranged(each[k]) for each in found], axis=-1)
        labels = {"units": "1", "long_name": f"{text}probability of an outcome"}
        dataset[f"probability{ending}"] = ((*points.dims, OUTCOME), table, labels)
    hits = np.stack([points.arranged(each) for each in counts.hits], axis=-1)
    labels = {"units": "1", "long_name": "runs with an outcome"}
    dataset["hits"] = ((*points.dims, OUTCOME), hits, labels)
    plain = {
        "runs": (counts.runs, "runs that came to an end"),
        "runs_failed": (counts.failed, "runs that failed; the intervals hold for whatever they might have done"),
        "reached": (~counts.open, "true where the interval has the requested width"),
    }
    for name, (values, text) in plain.items():
        dataset[name] = (points.dims, points.arranged(values), {"units": "1", "long_name": text})
    return dataset
