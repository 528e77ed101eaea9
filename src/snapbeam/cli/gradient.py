"""``snapbeam gradient``: derivatives of statistics by parameters, in the units in which these were given."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

from snapbeam.cli import parameter_options as opt
from snapbeam.cli.console import add_json, check_outputs, cli_command, draw_computed, print_written, write_result
from snapbeam.cli.parameter_options import ALL, configured, with_parameters
from snapbeam.cli.summary import statistic_value, unit_words
from snapbeam.util.validation import InputError

if TYPE_CHECKING:
    import xarray as xr

    from snapbeam.model.system import System

_PANEL = "Gradient"
_COLUMNS = ("statistic", "parameter", "derivative", "unit", "error", "way", "growth")


@cli_command
@with_parameters(*ALL)
def gradient(
    given: Any,
    file: Annotated[
        Path | None, typer.Argument(help="TOML parameter file, as --config; options override it.", metavar="FILE")
    ] = None,
    parameters: Annotated[
        str | None, opt.option("Parameters, of numbers that are not zero: name,name.", _PANEL, "NAMES")
    ] = None,
    statistic: Annotated[
        str, typer.Option(help="Statistics of a run: name,name.", rich_help_panel=_PANEL, metavar="NAMES")
    ] = "peak_midspan_displacement",
    output: Annotated[
        Path,
        opt.option("File to write: NetCDF (.nc), a table (.csv) or JSON (.json).", "Output", "FILE", "--output -o"),
    ] = Path("gradient.nc"),
    plot: opt.Plot = None,
    threads: opt.Threads = None,
) -> None:
    """Compute derivatives of statistics of a run by parameters, with their errors.

    A derivative is per unit of the parameter as the file gives it: per Hz, or per um of a gap of "20 um".  A class or a count has
    none: the reason is printed.  The growth is the change of the state at the end of the run, over the distance of the wells, per
    relative change of the parameter: a derivative holds for changes well below its reciprocal.

    Example: snapbeam gradient system.toml --parameters velocity_amplitude,location --statistic peak_force,impulse
    --cycles 5 -o gradient.nc --plot gradient.png
    """  # fmt: skip
    from snapbeam.model.parameters import in_table
    from snapbeam.uncertainty.gradients import gradient as compute

    if file is not None and given["config"] is not None:
        raise InputError(f"FILE = {str(file)!r} with --config: give one of the two")
    settings = configured(given | {"config": file or given["config"]})
    check_outputs(output, plot, (".nc", ".csv", ".json"), "statistic,")
    system = settings.system
    if parameters is None:
        own = in_table(system.parameters)
        known = [name for name, value in own.items() if isinstance(value, float) and value != 0.0]
        raise InputError(f"parameters (--parameters): must name one or more of {', '.join(known)}")
    names = [settings.full_name(name.strip()) for name in parameters.split(",")]
    statistics = [name.strip() for name in statistic.split(",")]
    found = compute(system, statistics, names, integration=settings.integration.replace(threads=threads))
    dataset = _in_given_units(found, system)
    results = {str(name): each.values for name, each in dataset.variables.items()}
    files = [write_result(dataset, output, results)]
    if plot is not None:
        files.append(draw_computed(dataset, plot, output if output.suffix.lower() == ".nc" else None))
    lines = [*_lines(dataset, system), *_table(dataset)]
    add_json(results=results, summary=lines, files=files)
    print_written(lines, files)


def _in_given_units(dataset: xr.Dataset, system: System) -> xr.Dataset:
    """Derivatives and values of parameters in the units of texts such as ``"20 um"``."""
    from snapbeam.util.units import conversion_factor, unit_in_text

    units, factors = [str(unit) for unit in dataset["unit"].values], np.ones(dataset.sizes["parameter"])
    for k, name in enumerate(dataset["parameter"].values):
        raw = system.as_given.get(str(name))
        given = unit_in_text(raw) if isinstance(raw, str) else ""
        factor = conversion_factor(given, units[k]) if given else None
        if factor is not None:
            units[k], factors[k] = given, factor
    value, derivative = dataset["nominal_value"], dataset["derivative"]
    return dataset.assign(
        nominal_value=value.copy(data=value.values / factors),
        derivative=derivative.copy(data=derivative.values * factors),
        unit=dataset["unit"].copy(data=np.array(units)),
    )


def _lines(dataset: xr.Dataset, system: System) -> list[str]:
    """Values of the statistics, and the reasons of those without a derivative."""
    lines = []
    for name, value, reason in zip(
        *(dataset[each].values for each in ("statistic", "value", "no_derivative")), strict=True
    ):
        lines.append(f"{name}: {reason}" if reason else f"{name} = {statistic_value(str(name), float(value), system)}")
    return lines


def _table(dataset: xr.Dataset) -> list[str]:
    """One line for each smooth statistic and parameter."""
    from snapbeam.solver.statistics import STATISTICS

    rows = [_COLUMNS]
    for one in (dataset.isel(statistic=k) for k in np.flatnonzero(dataset["no_derivative"].values == "")):
        statistic = STATISTICS[str(one["statistic"].values)]
        above = unit_words(statistic.unit, statistic.long_name)
        for name, unit, slope, error, way, growth in zip(
            *(one[each].values for each in ("parameter", "unit", "derivative", "relative_error", "method", "growth")),
            strict=True,
        ):
            per = f"{above}{'' if unit == '1' else f' per {unit}'}".strip()
            grown = f"{growth:.3g}" if np.isfinite(growth) else "-"
            rows.append((statistic.name, str(name), f"{slope:.5g}", per, f"{error:.1g}", str(way), grown))
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return ["  ".join(text.ljust(width) for text, width in zip(row, widths, strict=True)).rstrip() for row in rows]
