"""``snapbeam threshold``: the lowest value of a parameter that makes the beam snap through."""

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
    draw_computed,
    duration,
    print_written,
    progress,
    write_map,
)
from snapbeam.cli.parameter_options import ALL, AXES, configured, with_parameters
from snapbeam.cli.summary import coordinate_text, initial_well_lines, status_lines, value_text
from snapbeam.util.status_codes import wells_of
from snapbeam.util.validation import InputError

if TYPE_CHECKING:
    import xarray as xr

    from snapbeam.model.parameter_file import Config

_VALUES = "0.005:0.64:128"


@cli_command
@with_parameters(*ALL, axes=AXES)
def threshold(
    given: Any,
    parameter: Annotated[
        str, typer.Option(help="Parameter to raise (velocity_amplitude).", rich_help_panel="Threshold")
    ] = "velocity_amplitude",
    values: Annotated[
        str | None, opt.option("Values of the parameter to choose from, start:stop:count.", "Threshold", "VALUES")
    ] = None,
    output: opt.Output = Path("threshold.nc"),
    plot: opt.Plot = None,
    threads: opt.Threads = None,
) -> None:
    """Find the interwell threshold, as a band, over frequency ratio, location or any parameters.

    The boundary is fractal in places, so the file contains two curves: the lowest amplitude with an interwell response,
    and the amplitude above which every response is interwell.  snapbeam runs every point of the grid.

    Example: snapbeam threshold --modes 1,32 --frequency-ratio 0.1:4:64 --velocity-amplitude 0.005:0.64:128
    -o threshold.nc --plot threshold.png
    """
    settings = configured(given, lambda config, _: _axes_of(config, parameter, values))
    check_outputs(output, plot)
    axes = _axes_of(settings, parameter, values)
    name, chosen = axes.popitem()

    from snapbeam.plot.units import in_units
    from snapbeam.sweeps.threshold import threshold as find

    system = settings.system
    start = time.monotonic()
    with progress(None, "threshold", "runs") as report:
        dataset = find(system, name, chosen, axes, settings.integration.replace(threads=threads), progress=report)
    elapsed = time.monotonic() - start
    files = [write_map(dataset, output)]
    if plot is not None:
        files.append(draw_computed(dataset, plot, output))
    told = in_units(dataset)
    names = (
        "lower_threshold", "upper_threshold", "lower_threshold_min", "upper_threshold_max", "failed_runs",
    )  # fmt: skip
    add_json(
        parameter=told.attrs["parameter"],
        unit=told[told.attrs["parameter"]].attrs.get("units", "1"),
        initial_well=dataset.attrs.get("initial_well"),
        axes={str(each): told[each].values for each in told["lower_threshold"].dims},
        **{each: told[each].values for each in names},
        outcome=np.array(_kinds(dataset))[dataset["outcome"].values],
        runs=dataset.attrs["runs"], seconds=elapsed, files=files,
    )  # fmt: skip
    print_written(_summary(told, elapsed), files)


def _axes_of(settings: Config, parameter: str, text: str | None) -> dict[str, Any]:
    """The axes of a search, those of the structure first, and the values to choose from."""
    from snapbeam.model.parameter_file import parsed_axis, same_axis
    from snapbeam.model.parameters import lookup, ratio_of

    axes: dict[str, Any] = settings.axes()
    name = settings.full_name(parameter)
    given = [each for each in axes if each in same_axis(name)]
    values = axes.pop(given[0]) if given else None
    if text is not None:
        if given:
            raise InputError(f"values, {parameter}: its values are given twice; give them once")
        values = parsed_axis(name, text)
    if values is None:
        if name != "drive.velocity_amplitude":
            raise InputError(f"{parameter}: give the values to choose from, as --values start:stop:count")
        values = parsed_axis(name, _VALUES)
    over_frequency = ratio_of(name) == "drive.velocity_amplitude" and not axes.keys() - {"model.modes"}
    if over_frequency and not settings.section("drive").keys() & {"frequency_ratio", "frequency_hz"}:
        axes["drive.frequency_ratio"] = parsed_axis("drive.frequency_ratio", "0.1:4:64")
    name = given[0] if given else name
    return dict(sorted(axes.items(), key=lambda item: lookup(item[0]).is_run)) | {name: values}


def _summary(dataset: xr.Dataset, elapsed: float) -> list[str]:
    lines = [f"{dataset.attrs['runs']} runs in {duration(elapsed)}", *initial_well_lines(dataset)]
    parameter = dataset.attrs["parameter"]
    first = dataset["lower_threshold"]
    if not first.ndim:  # one threshold
        return lines + _curve(dataset, parameter, None, {}) + status_lines(dataset)
    across = str(first.dims[-1])
    for at in np.ndindex(first.shape[:-1]):
        chosen = dict(zip(map(str, first.dims[:-1]), at, strict=True))
        lines += _curve(dataset.isel(chosen), parameter, across, chosen)
    return lines + status_lines(dataset)


def _kinds(dataset: xr.Dataset) -> list[str]:
    """Return the meanings of the values of ``outcome``, in their order."""
    return str(dataset["outcome"].attrs["flag_meanings"]).split()


def _curve(curve: xr.Dataset, parameter: str, across: str | None, chosen: dict[str, int]) -> list[str]:
    """Return the lines that describe one curve."""
    first, always = curve["lower_threshold"], curve["upper_threshold"]
    from snapbeam.plot.axes import is_geometric

    one = wells_of(curve.attrs) == 1
    word = "snap-through" if one else "interwell response"
    named = [coordinate_text(curve, name, curve[name].item()) for name in chosen]
    if "modes" in curve.attrs and "modes" not in chosen:
        named.append(coordinate_text(curve, "modes", int(curve.attrs["modes"])))
    head = f"{', '.join(named)}: " if named else ""
    if bool(first.isnull().all()):
        line = f"{head}no {word} found"
    else:
        line = f"{head}lowest threshold {coordinate_text(curve, parameter, float(first.min()))}"
        if across is not None:
            at = first.isel({across: int(np.nanargmin(first.values))})
            line += f" at {coordinate_text(curve, across, at[across].item())}"
        width = always - first
        if bool(width.notnull().any()):
            of = f" over {int(width.notnull().sum())} points" if bool(width.isnull().any()) else ""
            values = curve[parameter].values
            steps = value_text(curve, parameter, float(np.max(np.diff(values))), 2)
            if is_geometric(values):
                steps = f"a factor of {values[1] / values[0]:.3g}"
            wide = value_text(curve, parameter, float(width.mean()), 2)
            line += f"; band {wide} wide{'' if across is None else ' on average'}{of}, in steps of {steps}"
    lines = [line]
    for kind, text in (
        ("no_interwell_in_range", f"no {word} in range: extend the values of {parameter}"),
        ("undecided", f"undecided: no {'snap-through' if one else 'run is interwell'}, but runs failed"),
        ("not_searched", "not searched: no run has a response class"),
    ):
        count = int((curve["outcome"] == _kinds(curve).index(kind)).sum())
        if count:
            lines.append(f"  {text}, at {count} of {first.size} points")
    open_above = int((first.notnull() & always.isnull()).sum())
    if open_above:
        lines.append(
            f"  highest run {'does not snap through' if one else 'is intrawell'}, at {open_above} of {first.size} points"
        )
    lower = first.notnull() & (curve["lower_threshold_min"] < first)
    if bool(lower.any()):
        lowest = float(curve["lower_threshold_min"].where(lower).min())
        lines.append(
            f"  failed runs leave the threshold open, down to {coordinate_text(curve, parameter, lowest)}, "
            f"at {int(lower.sum())} of {first.size} points"
        )
    higher = always.notnull() & ~(curve["upper_threshold_max"] == always)
    if bool(higher.any()):
        lines.append(f"  failed runs leave the top of the band open, at {int(higher.sum())} of {first.size} points")
    return lines
