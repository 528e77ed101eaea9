"""How likely a struck beam snaps, and where it ends, over any parameters, under its tolerances."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.kinds import checked
from snapbeam.core.provenance import canonical_json
from snapbeam.core.reporting import counting
from snapbeam.core.validate import InputError, InputTypeError, shown
from snapbeam.design.events import OUTCOMES, reached
from snapbeam.design.probability.allocation import SamplingPlan, Counts, allocate
from snapbeam.design.spread import ParameterUncertainty
from snapbeam.design.trials import Trials, trials_of
from snapbeam.model.integration import Integration
from snapbeam.model.system import System
from snapbeam.sweeps.points import Points, points_of
from snapbeam.sweeps.setup import SweepSetup, sweep_setup
from snapbeam.sweeps.stored import CheckpointOptions

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["allocation_of", "probability_map"]

TITLE = "probabilities of the response of a struck bistable beam"
OUTCOME = "outcome"


@checked
def probability_map(
    system: System,
    axes: Mapping[str, Any] | xr.Dataset | Any,
    uncertainty: ParameterUncertainty | None = None,
    runs: SamplingPlan | int | None = None,
    *,
    integration: Integration | None = None,
    checkpoint: str | os.PathLike[str] | CheckpointOptions | None = None,
    cluster: str | None = None,
    progress: Callable[[int, int], object] | bool | None = None,
) -> xr.Dataset:
    """How likely each outcome is at every point, over systems, drives and starts that differ by their tolerances.

    Draw s is the same at every point.  Runs are spent where the interval is widest, until each is as narrow as asked.

    Parameters
    ----------
    system : System
        The nominal one.
    axes : mapping of str to array_like, or xarray.Dataset, or pandas.DataFrame
        As of :func:`snapbeam.sweep`: a grid, or a list of points.  A parameter that is drawn too is drawn about the
        value of the point.
    uncertainty : Spread
        What differs.
    runs : Allocation or int, optional
        How runs are spent, or the same number of runs for every point; by default until the half width of the 95 %
        interval of P(snap) is 0.05 everywhere.
    integration : Integration, optional
        Runs end once their class is certain, whatever it says.
    checkpoint : path or Keeping, optional
        Folder that keeps the runs; one that exists is resumed.
    cluster, progress
        As of :func:`snapbeam.sweep`; progress is told of runs, of which the total grows.

    Returns
    -------
    xarray.Dataset
        ``probability`` with ``probability_low`` and ``probability_high`` over the axes and ``outcome``: ``snap``,
        ``continuous``, ``first_well`` and ``other_well``, of which the last three add up to 1.  ``hits``; ``runs`` and
        ``runs_failed``, which widen the intervals; ``reached``, whether the half width was.

    Raises
    ------
    InputError
        For bad input, a spread in which nothing differs, and for a store that holds something else.
    CheckpointError
        If the store is in use, cannot be written or is damaged beyond repair.

    Notes
    -----
    The intervals are those of a fixed number of runs.  Stopping where they are narrow costs them nothing that is
    seen: over probabilities drawn from (0, 1) they hold the truth in 95 % of cases.  The share itself leans towards
    0 and 1 by at most 0.006 at a half width of 0.05.

    Examples
    --------
    >>> spread = sb.Spread(of={"beam.thickness": sb.Normal(0.01, relative=True)}, phase=True)  # doctest: +SKIP
    >>> ds = sb.probability_map(system, {"velocity_amplitude": v, "location": x}, spread)  # doctest: +SKIP
    """
    allocation = allocation_of(runs)
    trials = trials_of(system, uncertainty, integration, store=checkpoint, cluster=cluster)
    if trials.spread.is_empty:
        raise InputError("spread: nothing differs, so every probability is 0 or 1; use sb.sweep")
    points = axes if isinstance(axes, Points) else points_of(axes)
    setup = sweep_setup(trials.system, points, trials.integration)
    counts = _counted(trials, points, allocation, counting(progress, "probability map", "runs"))
    return _dataset(setup, trials, counts, allocation)


def allocation_of(runs: SamplingPlan | int | None) -> SamplingPlan:
    """How runs are spent, from what was given.

    Raises
    ------
    InputTypeError
    """
    if runs is None:
        return SamplingPlan()
    if isinstance(runs, SamplingPlan):
        return runs
    if isinstance(runs, (bool, np.bool_)) or not isinstance(runs, (int, np.integer)):
        raise InputTypeError(f"runs = {shown(runs)}: must be a number of runs a point, or an Allocation")
    return SamplingPlan(half_width=None, initial_runs=int(runs), max_runs=max(int(runs), 1))


def _counted(
    trials: Trials,
    points: Points,
    allocation: SamplingPlan,
    tell: Callable[[int, int], object] | None,
) -> Counts:
    told = [0, 0]

    def ask(
        which: NDArray[np.int64], numbers: NDArray[np.int64]
    ) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        def report(done: int, total: int) -> None:
            if tell is not None:
                tell(told[0] + done, max(told[1], told[0] + total))

        found = trials.statistics(points.take(which), numbers, report)
        told[0] += which.size
        return np.stack([each.happened(found) for each in OUTCOMES.values()]), ~reached(found)

    def more(made: int, expected: int) -> None:
        told[:] = made, expected
        if tell is not None:
            tell(made, expected)

    return allocate(ask, points.size, allocation, more)


def _dataset(setup: SweepSetup, trials: Trials, counts: Counts, allocation: SamplingPlan) -> xr.Dataset:
    import xarray as xr

    points = setup.points
    drawn = dict(trials.spread.describe())
    more: dict[str, Any] = {
        "uncertainty": canonical_json(drawn),
        "seed": trials.spread.seed,
        "confidence": allocation.confidence,
        "interval": allocation.interval,
        "watched_outcome": allocation.outcome,
        "rounds": counts.rounds,
        "runs_made": int(counts.runs.sum() + counts.failed.sum()),
    }
    if allocation.half_width is not None:
        more["half_width"] = allocation.half_width
    dataset = xr.Dataset(coords=setup.coordinates(), attrs=setup.attributes(TITLE, more))
    words = {"long_name": "; ".join(f"{name}: {each.words}" for name, each in OUTCOMES.items())}
    dataset[OUTCOME] = ((OUTCOME,), list(OUTCOMES), words)
    found = [counts.limits(allocation, i) for i in range(len(OUTCOMES))]
    for k, (ending, text) in enumerate((("", ""), ("_low", "lower limit: "), ("_high", "upper limit: "))):
        table = np.stack([points.arranged(each[k]) for each in found], axis=-1)
        labels = {"units": "1", "long_name": f"{text}probability of an outcome"}
        dataset[f"probability{ending}"] = ((*points.dims, OUTCOME), table, labels)
    hits = np.stack([points.arranged(each) for each in counts.hits], axis=-1)
    labels = {"units": "1", "long_name": "runs with an outcome"}
    dataset["hits"] = ((*points.dims, OUTCOME), hits, labels)
    plain = {
        "runs": (counts.runs, "runs that came to an end"),
        "runs_failed": (
            counts.failed,
            "runs that failed; the intervals hold for whatever they might have done",
        ),
        "reached": (~counts.open, "whether the interval is as narrow as asked"),
    }
    for name, (values, text) in plain.items():
        dataset[name] = (points.dims, points.arranged(values), {"units": "1", "long_name": text})
    return dataset
