"""``snapbeam probability`` and ``snapbeam design``: response probabilities and robust designs under uncertainty."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

from snapbeam.cli import parameter_options as opt
from snapbeam.cli.console import (
    add_json,
    check_outputs,
    cli_command,
    count_text,
    draw_computed,
    duration,
    notes,
    print_written,
    progress,
    write_map,
)
from snapbeam.cli.summary import coordinate_text, initial_well_lines, statistic_text, value_text
from snapbeam.util.validation import InputError

if TYPE_CHECKING:
    import xarray as xr

    from snapbeam.model.parameter_file import Config
    from snapbeam.model.system import System
    from snapbeam.uncertainty.cost import CostEstimate
    from snapbeam.uncertainty.distributions import ParameterUncertainty

File = Annotated[
    Path, typer.Argument(help="TOML parameter file with [uncertainty] and the section of the command.", metavar="FILE")
]
Yes = Annotated[
    bool, typer.Option("--yes", "-y", help="Compute without asking for confirmation.", rich_help_panel="Cost")
]
EstimateCost = Annotated[
    bool,
    opt.option("Print the estimated cost, from a trial of ten seconds, and stop.", "Cost", flags="--estimate-cost"),
]


def read(file: Path, section: str, law: list[str] | None = None) -> tuple[Config, ParameterUncertainty, dict[str, Any]]:
    """The system, its parameter uncertainty and the section of the command.

    Raises
    ------
    InputError
        If the file cannot be read, has no section [uncertainty], or has an unknown section or name.
    """
    from snapbeam.model.parameter_file import config_from_mapping, read_parameter_file
    from snapbeam.uncertainty.distributions import uncertainty_from_mapping

    opt.import_laws(law)
    sections = read_parameter_file("file", file)
    if "uncertainty" not in sections:
        raise InputError(
            f"{file.name}: has no section [uncertainty]; add one, or use snapbeam map for a system without uncertainty"
        )
    config = config_from_mapping(sections, file.name, folder=file.parent)
    uncertainty = uncertainty_from_mapping(sections["uncertainty"], "uncertainty", config.full_name)
    question = sections.get(section, {})
    if not isinstance(question, dict):
        raise InputError(f"{file.name}: [{section}] must be a section")
    return config, uncertainty, question


def taken(kind: Any, table: dict[str, Any], where: str, further: str = "") -> Any:
    """An instance of a dataclass from a table of its fields; unknown names raise an error, which names *further* ones."""
    import dataclasses

    known = [each.name for each in dataclasses.fields(kind) if each.init]
    for name in table:
        if name not in known:
            told = [*known, *filter(None, [further])]
            instead = getattr(kind, "instead", {}).get(name, "")
            raise InputError(f"{where}.{name}: unknown; must be one of {', '.join(told)}{instead and '; ' + instead}")
    try:
        return kind(**table)
    except TypeError as error:
        raise InputError(f"{where}: {error}") from None


def agreed(cost: CostEstimate, yes: bool, stop: bool) -> bool:
    """Print the estimated cost; on a terminal, ask for confirmation of a long computation."""
    import sys

    notes().print(f"{cost}", markup=False)
    add_json(
        estimated_cost={"runs": cost.runs, "max_runs": cost.max_runs, "seconds": cost.seconds, "disk_bytes": cost.disk}
    )
    if stop:
        return False
    if cost.is_long and not yes and sys.stdin.isatty():
        return typer.confirm("This takes more than ten minutes. Compute it?")
    return True


def _compute(
    question: Any, words: tuple[str, str], arguments: tuple[Any, ...], settings: Config, estimate_cost: bool, yes: bool,
    threads: int | None, checkpoint: Path | None, **options: Any,
) -> tuple[xr.Dataset, float] | None:  # fmt: skip
    """The result of a computation and its time, s; None if only its cost is wanted or the user does not agree."""
    from snapbeam.uncertainty.cost import estimate_cost as cost_of

    how = settings.integration.replace(threads=threads)
    notes().print(f"trial runs of the {words[0]}, to estimate its cost", markup=False)
    cost = cost_of(question, *arguments, integration=how, trial=10.0 if estimate_cost else 2.0, **options)
    if not agreed(cost, yes, estimate_cost):
        return None
    begun = time.monotonic()
    with progress(None, *words) as report:
        dataset = question(*arguments, integration=how, checkpoint=checkpoint, progress=report, **options)
    return dataset, time.monotonic() - begun


def finish(dataset: xr.Dataset, output: Path, plot: Path | None, lines: list[str], variable: str | None = None) -> None:
    """Write and plot the results and print a summary."""
    files = [write_map(dataset, output)]
    if plot is not None:
        files.append(draw_computed(dataset, plot, output, variable))
    add_json(summary=lines, files=files)
    print_written(lines, files)


# ----------------------------------------------------------------------------------------------------
# ``snapbeam design``: optimal location, frequency and amplitude under chance constraints.


@cli_command
def design(
    file: File,
    output: opt.Output = Path("design.nc"),
    plot: opt.Plot = None,
    checkpoint: opt.CheckpointFolder = None,
    estimate_cost: EstimateCost = False,
    yes: Yes = False,
    law: opt.Law = None,
    threads: opt.Threads = None,
) -> None:
    """Optimise the excitation, under constraints that hold with a stated probability.

    The TOML file has the sections of a parameter file, [uncertainty], and [design] with the objectives,
    [design.variables] (name = [low, high]), [[design.constraints]] and [design.settings].

    Example: snapbeam design switch.toml -o design.nc --plot design.png --checkpoint design.checkpoint
    """
    from snapbeam.uncertainty.optimization import optimize_design

    settings, uncertainty, asked = read(file, "design", law)
    check_outputs(output, plot)
    variables, objectives, constraints, optimizer = _question(asked)
    arguments = (settings.system, variables, objectives, constraints, uncertainty, optimizer)
    words = ("design", "generations")
    found = _compute(optimize_design, words, arguments, settings, estimate_cost, yes, threads, checkpoint)
    if found is None:
        return
    dataset, elapsed = found
    add_json(designs={str(name): each.values for name, each in dataset.data_vars.items() if "tried" not in each.dims})
    finish(dataset, output, plot, _lines(dataset, elapsed))


def _question(asked: dict[str, Any]) -> tuple[Any, Any, Any, Any]:
    """Variables, objectives, constraints and settings of the section."""
    from snapbeam.uncertainty.optimization import Constraint, Objective, OptimizerSettings

    known = ("objectives", "variables", "constraints", "settings")
    for name in asked:
        if name not in known:
            raise InputError(f"design.{name}: unknown; must be one of {', '.join(known)}")
    for name in ("objectives", "variables"):
        if not asked.get(name):
            raise InputError(f"design.{name}: is needed")
    given = asked["objectives"]
    listed = given if isinstance(given, list) else [given]
    objectives = [
        Objective(quantity=each) if isinstance(each, str) else taken(Objective, each, "design.objectives")
        for each in listed
    ]
    constraints = [taken(Constraint, each, "design.constraints") for each in asked.get("constraints", [])]
    return (
        asked["variables"],
        objectives,
        constraints,
        taken(OptimizerSettings, asked.get("settings", {}), "design.settings"),
    )


def _lines(dataset: xr.Dataset, elapsed: float) -> list[str]:
    runs, count = int(dataset.attrs["runs_made"]), dataset.sizes["design"]
    lines = [f"{runs} runs of {dataset.sizes['tried']} designs in {duration(elapsed)}", *initial_well_lines(dataset)]

    words = str(dataset["constraints_satisfied"].attrs["flag_meanings"]).split()
    share = 100.0 * float(dataset.attrs["confidence"])
    for i in range(min(count, 12)):
        one = dataset.isel(design=i)
        names = [name for name in map(str, one.data_vars) if not name.startswith("tried_")]
        chosen = [name for name in names if "parameter" in one[name].attrs]
        lines.append(", ".join(coordinate_text(one, name, float(one[name])) for name in chosen))
        for name in map(str, one.data_vars):
            if f"{name}_low" not in one:
                continue
            kind, _, of = name.partition("_")
            ends = [value_text(one, name, float(one[f"{name}{end}"])) for end in ("_low", "_high")]
            value = statistic_text(one, name, float(one[name]))
            value = f"satisfied: {of.replace('_', ' ')} {value.rpartition(': ')[2]}" if kind == "satisfied" else value
            lines.append(f"  {value} ({' to '.join(ends)} at {share:g} %)")
            if kind == "satisfied":
                lines.append(f"  {_distance(one, of)}")
        lines.append(f"  constraints on validation samples: {words[int(one['constraints_satisfied'])]}")
    lines.append(f"stopped: {dataset.attrs['termination_reason']}")
    return lines


def _distance(one: xr.Dataset, label: str) -> str:
    """The distance of a design from a constraint, as text."""
    distance = one[f"distance_{label}"]
    value, unit = float(distance), str(distance.attrs["units"])
    size = f"{abs(value):.3g}{'' if unit == '1' else ' ' + unit}"
    if unit != "1" or float(one[f"required_{label}"]) == 1.0:
        return f"distance from the limit: {size}{', violated' if value < 0.0 else ''}"
    return f"{size} {'above' if value >= 0.0 else 'below'} the required fraction {float(one[f'required_{label}']):.4g}"


# ----------------------------------------------------------------------------------------------------
# ``snapbeam probability``: probability of each outcome over any parameters.


@cli_command
def probability(
    file: File,
    output: opt.Output = Path("probability.nc"),
    plot: opt.Plot = None,
    checkpoint: opt.CheckpointFolder = None,
    estimate_cost: EstimateCost = False,
    yes: Yes = False,
    law: opt.Law = None,
    threads: opt.Threads = None,
    outcome: Annotated[
        list[str] | None,
        opt.option(
            "Statistic beyond a value, such as 'peak_force > 60 N', whose probability is wanted too; the first is drawn. "
            "Repeat for further ones.",
            "Output",
            "TEXT",
        ),
    ] = None,
    statistic: Annotated[
        list[str] | None,
        opt.option(
            "Statistic whose mean and quantiles are wanted, such as harvested_power; repeat for further ones.",
            "Output",
            "NAME",
        ),
    ] = None,
) -> None:
    """Map the probability of snap-through, final wells and statistics beyond values, under parameter uncertainty.

    The TOML file has the sections of a parameter file, [uncertainty], the axes in [sweep], and in [probability] the
    sampling plan, outcomes, statistics and quantiles.

    Example: snapbeam probability switch.toml --outcome 'peak_force > 60 N' -o probability.nc --plot probability.png
    """
    from snapbeam.plot.units import in_units
    from snapbeam.uncertainty.monte_carlo import outcome_named
    from snapbeam.uncertainty.probability import SamplingPlan, probability_map

    settings, uncertainty, asked = read(file, "probability", law)
    check_outputs(output, plot)
    options: dict[str, Any] = {
        name: asked.pop(name) for name in ("outcomes", "statistics", "quantiles") if name in asked
    }
    options |= {"outcomes": outcome} if outcome else {}
    options |= {"statistics": statistic} if statistic else {}
    count = asked.pop("runs", None)
    if asked or count is None:
        plan = taken(SamplingPlan, asked, "probability", "outcomes, statistics, quantiles, runs; axes are in [sweep]")
        if count is not None:
            raise InputError(f"probability.runs = {count!r}: give either runs or {', '.join(asked)}")
    runs: Any = plan if count is None else count
    axes = settings.axes() or _default_axes(settings.system)
    if plot is not None and not 1 <= sum(np.size(each) > 1 for each in axes.values()) <= 2:
        raise InputError(
            "plot: probabilities are drawn over one or two axes of more than one value; name them in [sweep]"
        )
    arguments = (settings.system, axes, uncertainty, runs)
    words = ("probability map", "runs")
    found = _compute(probability_map, words, arguments, settings, estimate_cost, yes, threads, checkpoint, **options)
    if found is None:
        return
    dataset, elapsed = found
    small = {str(name): each.values for name, each in dataset.variables.items()
             if name not in dataset["runs"].dims and each.size <= 4000}  # fmt: skip
    told = in_units(dataset)
    add_json(results=small, axes={str(dim): told[dim].values for dim in told["runs"].dims if dim in told.coords})
    asked_for = options.get("outcomes") if "outcome" not in asked else None
    drawn = outcome_named(asked_for[0])[0] if asked_for else str(dataset.attrs["watched_outcome"])
    finish(dataset, output, plot, _lines_probability(told, elapsed), drawn)


def _default_axes(system: System) -> dict[str, Any]:
    """Axes of a map if none is named: the paper's plane of a struck beam; the one point of another system."""
    from snapbeam.model.parameter_file import DEFAULT_AXES, parsed_axis
    from snapbeam.model.parameters import in_table, lookup

    if DEFAULT_AXES.keys() <= system.parameters.keys():
        return {name: parsed_axis(name, text) for name, text in DEFAULT_AXES.items()}
    numbers = [
        name for name, each in in_table(system.parameters).items() if isinstance(each, float) and lookup(name).is_run
    ]
    if not numbers:
        raise InputError("[contact]: missing, as is any other excitation; add one, and name the axes in [sweep]")
    return {numbers[0]: np.array([system.get(numbers[0])])}


_MOST_PRINTED = 24
"""Points up to which the command prints the probability of each."""


def _intervals(one: xr.Dataset, name: str = "probability") -> list[str]:
    """Value and interval of a variable at each point; the range of all, where there are many points."""
    found = one[name]
    if found.size > _MOST_PRINTED:
        low, high = (value_text(one, name, float(each)) for each in (found.min(), found.max()))
        return [f"  {name.replace('_', ' ')} from {low} to {high}; each point is in the file"]
    lines = []
    for at in np.ndindex(found.shape):
        point = one.isel(dict(zip(found.dims, at, strict=True)))
        values = {dim: point[dim].values.item() for dim in found.dims if dim in point.coords}
        where = ", ".join(coordinate_text(one, str(dim), value) for dim, value in values.items())
        ends = [float(point[f"{name}{end}"]) for end in ("", "_low", "_high")]
        middle, low, high = (value_text(one, name, each) if np.isfinite(each) else "unbounded" for each in ends)
        whole = int(point["runs"]) > 1 and not int(point["runs_failed"]) and "unbounded" not in middle
        same = whole and high == "unbounded" and not name.endswith("quantile")
        lines.append(
            f"  {where or name}: {middle} ({'no interval: all runs give this' if same else f'{low} to {high}'})"
        )
    return lines


def _lines_probability(dataset: xr.Dataset, elapsed: float) -> list[str]:
    from snapbeam.uncertainty.monte_carlo import outcome_named

    runs, points = int(dataset.attrs["runs_made"]), int(dataset["runs"].size)
    lines = [
        f"{count_text(runs, 'runs')} at {count_text(points)} in {duration(elapsed)}", *initial_well_lines(dataset)
    ]  # fmt: skip
    for name in dataset["outcome"].values:
        one = dataset.sel(outcome=name)
        sure = int((one["probability_low"] > 0.95).sum())
        never = int((one["probability_high"] < 0.05).sum())
        event = outcome_named(str(name))[1]
        words = event.long_name if event.statistic else f"{name} ({event.long_name})"
        lines.append(f"{words}: lower limit above 0.95 at {count_text(sure)}, upper limit below 0.05 at {never}")
        lines += _intervals(one)
    for name in [str(name)[: -len("_quantile")] for name in dataset.data_vars if str(name).endswith("_quantile")]:
        lines += [f"{dataset[name].attrs['long_name']}:", *_intervals(dataset, name)]
        for level in dataset["quantile"].values:
            one = dataset.sel(quantile=level)
            lines += [f"{level:g} {one[f'{name}_quantile'].attrs['long_name']}:", *_intervals(one, f"{name}_quantile")]
    if not bool(dataset["reached"].all()):
        lines.append(f"interval wider than requested at {count_text(int((~dataset['reached']).sum()))}")
    lines.append(f"stopped: {dataset.attrs['termination_reason']}")
    failed = int(dataset["runs_failed"].sum())
    return (
        [*lines, f"{failed} runs failed; the intervals include every possible outcome of these runs"]
        if failed
        else lines
    )
