"""``snapbeam design``: the best place, frequency and amplitude under limits that hold with a stated probability."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from snapbeam.cli.common import options as opt
from snapbeam.cli.common.console import answer, door, duration, progress
from snapbeam.cli.design.asked import File, Output, PlanOnly, Store, Yes, agreed, finish, read, taken

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["design"]


@door
def design(
    file: File,
    output: Annotated[Path, Output] = Path("design.nc"),
    plot: opt.Plot = None,
    store: Store = None,
    plan: PlanOnly = False,
    yes: Yes = False,
    threads: opt.Threads = None,
) -> None:
    """Find where and how to strike so that limits hold with a stated probability and goals are least.

    The file has [spread] beside the sections of any parameter file, and in [design] the goals, with
    [design.variables] (name = [low, high]), [[design.limits]] and [design.effort].

    Example: snapbeam design switch.toml -o design.nc --plot design.png --checkpoint design.store
    """
    from snapbeam.cli.common.results import check_pictures
    from snapbeam.core.files import check_writable
    from snapbeam.design.optimum.design import optimize_design
    from snapbeam.design.plan import estimate_cost as plan_of
    from snapbeam.figures.design import plot_designs

    settings, spread, asked = read(file, "design")
    check_writable(output, "output", (".nc",))
    check_pictures(("plot", plot))
    variables, goals, limits, effort = _question(asked)
    how = settings.integration.replace(threads=threads)
    arguments = (settings.system, variables, goals, limits, spread, effort)
    cost = plan_of(optimize_design, *arguments, integration=how, trial=10.0 if plan else 2.0)
    if not agreed(cost, yes, plan):
        return
    begun = time.monotonic()
    with progress(None, "design", "generations") as report:
        dataset = optimize_design(*arguments, integration=how, checkpoint=store, progress=report)
    answer(
        designs={
            str(name): each.values for name, each in dataset.data_vars.items() if "tried" not in each.dims
        }
    )
    finish(dataset, output, plot, plot_designs, _lines(dataset, time.monotonic() - begun))


def _question(asked: dict[str, Any]) -> tuple[Any, Any, Any, Any]:
    """Variables, goals, limits and effort of the section."""
    from snapbeam.core.validate import InputError
    from snapbeam.design.optimum.design import OptimizerSettings
    from snapbeam.design.optimum.measures import Objective, Constraint

    known = ("goals", "variables", "limits", "effort")
    for name in asked:
        if name not in known:
            raise InputError(f"design.{name}: unknown; must be one of {', '.join(known)}")
    for name in ("goals", "variables"):
        if not asked.get(name):
            raise InputError(f"design.{name}: is needed")
    listed = asked["goals"] if isinstance(asked["goals"], list) else [asked["goals"]]
    goals = [
        Objective(quantity=each) if isinstance(each, str) else taken(Objective, each, "design.goals")
        for each in listed
    ]
    limits = [taken(Constraint, each, "design.limits") for each in asked.get("limits", [])]
    return (
        asked["variables"],
        goals,
        limits,
        taken(OptimizerSettings, asked.get("effort", {}), "design.effort"),
    )


def _lines(dataset: xr.Dataset, elapsed: float) -> list[str]:
    runs, count = int(dataset.attrs["runs_made"]), dataset.sizes["design"]
    lines = [f"{runs} runs of {dataset.sizes['tried']} designs in {duration(elapsed)}"]
    words = str(dataset["holds"].attrs["flag_meanings"]).split()
    share = 100.0 * float(dataset.attrs["confidence"])
    for i in range(min(count, 12)):
        one = dataset.isel(design=i)
        names = [name for name in map(str, one.data_vars) if not name.startswith("tried_")]
        chosen = [name for name in names if "parameter" in one[name].attrs]
        lines.append(", ".join(f"{name} = {float(one[name]):.5g}" for name in chosen))
        for name in map(str, one.data_vars):
            if f"{name}_low" not in one:
                continue
            low, high, unit = float(one[f"{name}_low"]), float(one[f"{name}_high"]), one[name].attrs["units"]
            kind, _, of = name.partition("_")
            head = f"kept: {of}" if kind == "kept" else of
            lines.append(
                f"  {head} {float(one[name]):.4g} ({low:.4g} to {high:.4g} at {share:g} %)"
                f"{'' if unit == '1' else ' ' + unit}"
            )
        lines.append(f"  limits on fresh draws: {words[int(one['holds'])]}")
    return lines
