"""What the files of these commands hold: a system as any parameter file, its spread, and what is asked of it."""

from __future__ import annotations

import time
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from snapbeam.cli import parameter_options as opt
from snapbeam.cli.console import answer, door, duration, file_line, notes, out, progress

if TYPE_CHECKING:
    import xarray as xr

    from snapbeam.model.parameter_file import Config
    from snapbeam.uncertainty.cost import CostEstimate
    from snapbeam.uncertainty.distributions import ParameterUncertainty

__all__ = [
    "File",
    "Output",
    "PlanOnly",
    "Store",
    "Yes",
    "agreed",
    "design",
    "finish",
    "probability",
    "read",
    "taken",
]


File = Annotated[
    Path, typer.Argument(help="TOML file of the system, its spread and the question.", metavar="FILE")
]
Store = Annotated[
    Path | None,
    typer.Option(
        help="Folder that keeps the runs; one that exists is resumed.",
        rich_help_panel="Output",
        metavar="DIR",
    ),
]
Yes = Annotated[
    bool,
    typer.Option(
        "--yes", "-y", help="Compute without being asked, however long it takes.", rich_help_panel="Cost"
    ),
]
PlanOnly = Annotated[
    bool,
    typer.Option(
        "--estimate-cost",
        help="Say what it costs, from a trial of ten seconds, and stop.",
        rich_help_panel="Cost",
    ),
]
Output = typer.Option(
    "--output", "-o", help="NetCDF file to write.", rich_help_panel="Output", metavar="FILE"
)


def read(file: Path, section: str) -> tuple[Config, ParameterUncertainty, dict[str, Any]]:
    """The system, its spread and the section of the question.

    Raises
    ------
    InputError
        If the file cannot be read, has no spread or no such section, or holds what nothing knows.
    """
    from snapbeam.model.parameter_file import config_from_mapping
    from snapbeam.uncertainty.distributions import spread_from_mapping
    from snapbeam.util.validation import InputError

    try:
        sections = tomllib.loads(file.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise InputError(f"file = {str(file)!r}: cannot be read as TOML, {error}") from None
    if "spread" not in sections:
        raise InputError(
            f"{file.name}: has no [spread], which says what differs; without one use snapbeam map"
        )
    spread = spread_from_mapping(sections.pop("spread"))
    question = sections.pop(section, {})
    for other in ("probability", "design"):
        sections.pop(other, None)
    if not isinstance(question, dict):
        raise InputError(f"{file.name}: [{section}] must be a section")
    return config_from_mapping(sections, file.name), spread, question


def taken(kind: Any, table: dict[str, Any], where: str) -> Any:
    """A frozen value from a table; names that it does not have are refused."""
    import dataclasses

    from snapbeam.util.validation import InputError

    known = [each.name for each in dataclasses.fields(kind)]
    for name in table:
        if name not in known:
            raise InputError(f"{where}.{name}: unknown; must be one of {', '.join(known)}")
    try:
        return kind(**table)
    except TypeError as error:
        raise InputError(f"{where}: {error}") from None


def agreed(cost: CostEstimate, yes: bool, stop: bool) -> bool:
    """Tell what a computation costs, and ask where it is long and somebody is there to answer."""
    import sys

    notes().print(f"{cost}", markup=False)
    answer(
        plan={
            "runs": cost.runs,
            "runs_most": cost.max_runs,
            "seconds": cost.seconds,
            "disk_bytes": cost.disk,
        }
    )
    if stop:
        return False
    if cost.is_long and not yes and sys.stdin.isatty():
        return typer.confirm("This takes more than ten minutes. Compute it?")
    return True


def finish(dataset: xr.Dataset, output: Path, plot: Path | None, drawn: Any, lines: list[str]) -> None:
    """Write the results, draw them, and say what they are."""
    from snapbeam.cli.console import write_map

    files = [write_map(dataset, output)]
    if plot is not None:
        import matplotlib

        matplotlib.use("Agg")
        from snapbeam.plot.style import save_figure

        files.append(save_figure(drawn(dataset), plot))
    answer(words=lines, files=files)
    out().print(*lines, *(f"Written: {file_line(path)}" for path in files), sep="\n")


# ----------------------------------------------------------------------------------------------------
# ``snapbeam design``: the best place, frequency and amplitude under limits that hold with a stated probability.


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
    from snapbeam.cli.console import check_pictures
    from snapbeam.plot.uncertainty import plot_designs
    from snapbeam.uncertainty.cost import estimate_cost as plan_of
    from snapbeam.uncertainty.optimization import optimize_design
    from snapbeam.util.files import check_writable

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
    from snapbeam.uncertainty.optimization import Constraint, Objective, OptimizerSettings
    from snapbeam.util.validation import InputError

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


# ----------------------------------------------------------------------------------------------------
# ``snapbeam probability``: how likely each outcome is, over any parameters, under tolerances.


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
    from snapbeam.cli.console import check_pictures
    from snapbeam.model.parameter_file import DEFAULT_AXES
    from snapbeam.plot.uncertainty import plot_probability
    from snapbeam.uncertainty.cost import estimate_cost as plan_of
    from snapbeam.uncertainty.probability import SamplingPlan, probability_map
    from snapbeam.util.files import check_writable

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
        _lines_probability(dataset, time.monotonic() - begun),
    )


def _lines_probability(dataset: xr.Dataset, elapsed: float) -> list[str]:
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
