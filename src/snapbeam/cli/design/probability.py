"""``snapbeam probability``: how likely each outcome is, over any parameters, under tolerances."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from snapbeam.cli.common import options as opt
from snapbeam.cli.common.console import answer, door, duration, progress
from snapbeam.cli.design.asked import File, Output, PlanOnly, Store, Yes, agreed, finish, read, taken

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["probability"]


@door
def probability(
    file: File,
    output: Annotated[Path, Output] = Path("probability.nc"),
    plot: opt.Plot = None,
    store: Store = None,
    plan: PlanOnly = False,
    yes: Yes = False,
    threads: opt.Threads = None,
) -> None:
    """Map how likely a struck beam snaps and where it ends, when systems, drives and starts differ by their tolerances.

    The file has [spread] beside the sections of any parameter file, the axes in [sweep], and in [probability] how
    narrow the intervals are to be.

    Example: snapbeam probability switch.toml -o probability.nc --plot probability.png
    """
    from snapbeam.cli.common.results import check_pictures
    from snapbeam.config import DEFAULT_AXES
    from snapbeam.core.files import check_writable
    from snapbeam.design.plan import estimate_cost as plan_of
    from snapbeam.design.probability.allocation import SamplingPlan
    from snapbeam.design.probability.probability_map import probability_map
    from snapbeam.figures.design import plot_probability

    settings, spread, asked = read(file, "probability")
    check_writable(output, "output", (".nc",))
    check_pictures(("plot", plot))
    runs: Any = asked["runs"] if set(asked) == {"runs"} else taken(SamplingPlan, asked, "probability")
    axes = settings.axes(DEFAULT_AXES)
    how = settings.integration.replace(threads=threads)
    cost = plan_of(
        probability_map, settings.system, axes, spread, runs, integration=how, trial=10.0 if plan else 2.0
    )
    if not agreed(cost, yes, plan):
        return
    begun = time.monotonic()
    with progress(None, "probability map", "runs") as report:
        dataset = probability_map(
            settings.system, axes, spread, runs, integration=how, checkpoint=store, progress=report
        )
    small = {name: dataset[name].values for name in ("probability", "probability_low", "probability_high", "runs")
             if dataset[name].size <= 4000}  # fmt: skip
    answer(found=small)
    outcome = str(dataset.attrs["watched_outcome"])
    finish(
        dataset,
        output,
        plot,
        lambda ds: plot_probability(ds, outcome),
        _lines(dataset, time.monotonic() - begun),
    )


def _lines(dataset: xr.Dataset, elapsed: float) -> list[str]:
    runs, points = int(dataset.attrs["runs_made"]), int(dataset["runs"].size)
    lines = [f"{runs} runs at {points} points in {duration(elapsed)}"]
    for name in dataset["outcome"].values:
        one = dataset.sel(outcome=name)
        sure = int((one["probability_low"] > 0.95).sum())
        never = int((one["probability_high"] < 0.05).sum())
        lines.append(f"{name}: above 0.95 for certain at {sure} points, below 0.05 at {never}")
    if not bool(dataset["reached"].all()):
        lines.append(f"not as narrow as asked at {int((~dataset['reached']).sum())} points")
    failed = int(dataset["runs_failed"].sum())
    return (
        [*lines, f"{failed} runs failed; the intervals hold for whatever they might have done"]
        if failed
        else lines
    )
