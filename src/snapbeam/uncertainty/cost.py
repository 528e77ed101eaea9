"""Cost of a computation, estimated before it starts: runs, time on this machine, memory and disk."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.integration import Integration
from snapbeam.sweeps.points import Columns, PointList, points_of
from snapbeam.sweeps.sweep import sweep
from snapbeam.uncertainty.monte_carlo import Trials, outcome_named, trials_of
from snapbeam.uncertainty.optimization import OptimizerSettings, design_problem, optimize_design
from snapbeam.uncertainty.probability import SamplingPlan, allocation_of, outcomes_of, probability_map, statistics_of
from snapbeam.uncertainty.quantiles import QuantileSearchSettings, quantile_threshold
from snapbeam.util.proportions import proportion
from snapbeam.util.validation import InputError, checked, within

LONG = 600.0
"""Seconds from which a computation counts as long."""
_RUN_BYTES = 700
"""Memory of a run until its round is done."""
_KEPT_BYTES = 320
"""Disk space of a run in a checkpoint."""
_GOLDEN = 0.6180339887498949
_BATCH = 32
_LONGEST, _MOST_RUNS = 600.0, 100_000
"""Maximum of the seconds and of the runs of a trial."""
Point = Callable[[NDArray[np.float64]], Columns]


@dataclass(frozen=True)
class CostEstimate:
    """Estimated cost of a computation.

    Attributes
    ----------
    runs, max_runs : int
        Estimated number of runs, and the maximum.
    seconds : float
        Seconds on this machine with the given threads.
    memory, disk : float
        Bytes, the second in a checkpoint.
    trial_runs : int
        Runs of the trial.

    See Also
    --------
    snapbeam.uncertainty.estimate_cost

    Examples
    --------
    >>> import snapbeam as sb
    >>> print(sb.uncertainty.CostEstimate(6400, 20_000, 90.0, 4.4e6, 2e6, trial_runs=512))
    about 6400 runs (at most 20000), 1 min 30 s on this machine, 4 MiB of memory, 1.9 MiB in a checkpoint; estimated from 512 runs
    """

    runs: int
    max_runs: int
    seconds: float
    memory: float
    disk: float
    trial_runs: int

    @property
    def is_long(self) -> bool:
        """True if the estimate exceeds ten minutes."""
        return self.seconds > LONG

    def __str__(self) -> str:
        hours, rest = divmod(round(self.seconds), 3600)
        text = f"{hours} h {rest // 60} min" if hours else f"{rest // 60} min {rest % 60} s"
        most = "" if self.max_runs == self.runs else f" (at most {self.max_runs})"
        return (
            f"about {self.runs} runs{most}, {text} on this machine, {self.memory / 2**20:.0f} MiB of memory, "
            f"{self.disk / 2**20:.1f} MiB in a checkpoint; estimated from {self.trial_runs} runs"
        )


@checked
def estimate_cost(question: Callable[..., Any], *arguments: Any, trial: float = 10.0, **options: Any) -> CostEstimate:
    """Estimate the cost of a computation from a trial of some seconds.

    Parameters
    ----------
    question : callable
        :func:`snapbeam.sweep`, :func:`snapbeam.uncertainty.probability_map`, :func:`snapbeam.uncertainty.quantile_threshold` or
        :func:`snapbeam.uncertainty.optimize_design`.
    *arguments, **options
        Its arguments; nothing is written to a checkpoint.
    trial : float
        Seconds that the trial may take after its first batch; at most 600.  The trial also stops at 100,000 runs.

    See Also
    --------
    snapbeam.uncertainty.CostEstimate

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> system = paper.struck_beam(frequency_ratio=1.2, velocity_amplitude=0.18)
    >>> uncertainty = sb.uncertainty.ParameterUncertainty(
    ...     of={"contact.stiffness": sb.uncertainty.LogNormal(0.2), "location": sb.uncertainty.Normal(0.005)}
    ... )
    >>> estimate = sb.uncertainty.estimate_cost(
    ...     sb.uncertainty.probability_map, system, {"velocity_amplitude": [0.1, 0.2]}, uncertainty, 16,
    ...     integration=sb.Integration(cycles=5), trial=0.1,
    ... )
    >>> estimate.runs, estimate.seconds > 0.0
    (32, True)
    """
    within("trial", trial, 0.0, _LONGEST, closed="right", unit="s")
    known: dict[Any, Callable[..., CostEstimate]] = {
        sweep: _of_sweep, probability_map: _of_probability, quantile_threshold: _of_threshold, optimize_design: _of_design
    }  # fmt: skip
    if question not in known:
        raise InputError("question: must be sweep, probability_map, quantile_threshold or optimize_design")
    return known[question](trial, *arguments, **options)


def _of_sweep(
    trial: float, system: Any, axes: Any, integration: Integration | None = None, **options: Any
) -> CostEstimate:
    points = points_of(axes, system)
    repeats = options.get("replicates") or 0
    each = 1 + int(getattr(repeats, "count", repeats))
    early = bool(integration is not None and integration.early_termination)
    trials = trials_of(system, None, integration, early=early)
    made, seconds, _ = _trial(trials, lambda u: points.take((u * points.size).astype(np.int64)), trial)
    return _cost(points.size * each, points.size * each, seconds / made, made)


def _of_probability(
    trial: float, system: Any, axes: Any, uncertainty: Any = None, runs: Any = None, **options: Any
) -> CostEstimate:
    allocation = allocation_of(runs)
    event = outcome_named(allocation.outcome)[1]
    asked = outcomes_of(options.get("outcomes", ()), allocation).values()
    needed = [*(each.statistic for each in asked), *statistics_of(options.get("statistics", ()))]
    trials = trials_of(system, uncertainty, options.get("integration"), statistics=needed)
    points = points_of(axes, system)
    where: list[NDArray[np.int64]] = []

    def point(ranks: NDArray[np.float64]) -> Columns:
        where.append((ranks * points.size).astype(np.int64))
        return points.take(where[-1])

    made, seconds, found = _trial(trials, point, trial)
    happened = event.happened(found)
    expected = _expected(allocation, np.concatenate(where), happened, points.size)
    most = points.size * (allocation.initial_runs if allocation.half_width is None else allocation.max_runs)
    if allocation.half_width is not None:
        most = min(most, points.size * _needed(0.5, allocation))
    if allocation.total_runs is not None:
        expected, most = min(expected, allocation.total_runs), min(most, allocation.total_runs)
    return _cost(expected, most, seconds / made, made)


def _needed(share: float, allocation: SamplingPlan) -> int:
    """Runs after which a probability is known as narrowly as requested."""
    assert allocation.half_width is not None
    n = allocation.initial_runs
    while n < allocation.max_runs:
        _, low, high = proportion(share * n, n, allocation.confidence)
        if 0.5 * float(high - low) <= allocation.half_width:
            break
        n = int(n * 1.05) + 1
    return min(n, allocation.max_runs)


def _expected(allocation: SamplingPlan, where: NDArray[np.int64], happened: NDArray[np.bool_], points: int) -> int:
    """Runs of a map, from few runs at few points: those with both outcomes need more."""
    if allocation.half_width is None:
        return points * allocation.initial_runs
    sure, unsure = _needed(0.01, allocation), _needed(0.3, allocation)
    several = [hits for hits in (happened[where == one] for one in np.unique(where)) if hits.size > 1]
    share = float(np.mean([0.0 < hits.mean() < 1.0 for hits in several])) if several else 1.0
    return round(points * ((1.0 - share) * sure + share * unsure))


def _of_threshold(
    trial: float, system: Any, parameter: str, bounds: Any, axes: Any = None, uncertainty: Any = None,
    options: Any = None, **more: Any,
) -> CostEstimate:  # fmt: skip
    options = QuantileSearchSettings() if options is None else options
    statistics = [outcome_named(options.outcome)[1].statistic]
    trials = trials_of(system, uncertainty, more.get("integration"), statistics=statistics)
    points = points_of(axes, system) if axes else None
    low, high = bounds

    def point(ranks: NDArray[np.float64]) -> Columns:
        own = {} if points is None else points.take((ranks * points.size).astype(np.int64))
        return own | _column(parameter, low + (high - low) * np.modf(ranks * 7919.0)[0])

    made, seconds, _ = _trial(trials, point, trial)
    total = options.runs * (1 if points is None else points.size)
    return _cost(total, total, seconds / made, made)


def _column(parameter: str, values: NDArray[np.float64]) -> Columns:
    """The column of a parameter."""
    from snapbeam.util.datasets import xr

    found = points_of(xr.Dataset({parameter: ("point", values)}))
    assert isinstance(found, PointList)
    return found.columns


def _of_design(
    trial: float, system: Any, variables: Any, objectives: Any, constraints: Any, uncertainty: Any,
    settings: Any = None, **options: Any,
) -> CostEstimate:  # fmt: skip
    settings = OptimizerSettings() if settings is None else settings
    parts = system, variables, objectives, constraints, uncertainty
    problem = design_problem(*parts, samples=settings.samples, integration=options.get("integration"))
    bounds = np.array(list(problem.bounds.values()))

    def point(ranks: NDArray[np.float64]) -> Columns:
        spread_out = np.modf(ranks[:, None] * (1.0 + 7919.0 * np.arange(len(bounds))))[0]
        table = bounds[:, 0] + (bounds[:, 1] - bounds[:, 0]) * spread_out
        return {name: table[:, j] for j, name in enumerate(problem.bounds)}

    made, seconds, _ = _trial(problem.trials, point, trial)
    # of designs far from the limits only a quarter of the runs is made
    expected = round(settings.max_runs * 0.6)
    return _cost(expected, settings.max_runs, seconds / made, made)


def _trial(trials: Trials, point: Point, limit: float) -> tuple[int, float, dict[str, NDArray[Any]]]:
    """Runs in growing batches until the time is spent; the first batch, in which models are reduced and a user's laws compiled, is not timed."""
    size, begun, made, spent = _BATCH, 0, 0, 0.0
    parts: list[dict[str, NDArray[Any]]] = []
    while spent < limit and made < _MOST_RUNS:
        numbers = np.arange(begun, begun + size)
        ranks = np.modf((numbers // 4) * _GOLDEN)[0]  # four samples a point
        clock = time.perf_counter()
        parts.append(trials.statistics(point(ranks), numbers))
        clock = time.perf_counter() - clock
        begun += size
        if len(parts) > 1:
            made, spent = made + size, spent + clock
            if clock < 0.25 * limit:
                size *= 2
            if spent + clock > 1.5 * limit:
                break
    return made, spent, {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _cost(runs: int, most: int, each: float, made: int) -> CostEstimate:
    return CostEstimate(runs, most, runs * each, runs * float(_RUN_BYTES), runs * float(_KEPT_BYTES), made)
