"""``snapbeam plot``: plot a stored result."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from snapbeam.cli import parameter_options as opt
from snapbeam.cli.console import add_json, check_pictures, cli_command, draw, file_line, open_result, out, read_overlay
from snapbeam.util.validation import InputError

if TYPE_CHECKING:
    import xarray as xr

_SLICE = "Slice of a map, at the nearest grid value"
_OVER = ("lower_threshold", "threshold", "probability", "lifetime", "response_class")
"""Variables over the axes of a sweep; the first of a file tells its axes."""


@cli_command
def plot(
    file: Annotated[
        Path, typer.Argument(help="NetCDF file of a map, a run, or the result of an analysis.", metavar="FILE")
    ],
    output: Annotated[
        Path, typer.Option("--output", "-o", help="Figure file to write: .png, .pdf or .svg.", metavar="FILE")
    ],
    variable: Annotated[
        str | None,
        typer.Option(
            help="Variable or plot, such as a statistic of a map or phase_portrait of a run; an unknown name lists all.",
            metavar="NAME",
        ),
    ] = None,
    frequency_ratio: Annotated[float | None, opt.number_option("Frequency ratio Omega.", _SLICE)] = None,
    velocity_amplitude: Annotated[float | None, opt.number_option("Velocity amplitude V.", _SLICE)] = None,
    location: Annotated[float | None, opt.number_option("Location x_s.", _SLICE)] = None,
    at: Annotated[
        list[str] | None,
        opt.option("Value of any axis, such as beam.thickness=4e-4; repeat for further axes.", _SLICE, "NAME=VALUE"),
    ] = None,
    over: opt.CurvesOver = None,
    measurements: opt.Measurements = None,
    quasi_static_line: opt.QuasiStaticLine = False,
    window: opt.Window = None,
) -> None:
    """Plot a stored result: in another format, another variable, with measured responses, or a slice of a map."""
    from snapbeam.plot.dataset import figures_of

    check_pictures(("output", output))
    dataset = open_result(file)
    wanted = {"frequency_ratio": frequency_ratio, "velocity_amplitude": velocity_amplitude, "location": location}
    dataset = _sliced(dataset, wanted, at or [])
    kind, figures = figures_of(dataset)
    figure = next(iter(figures), None) if variable is None else variable
    options: dict[str, Any] = {}
    if measurements is not None or quasi_static_line:
        if figure != "response_class":
            raise InputError(
                "measurements and quasi_static_line are drawn over the response classes of a map, not over "
                f"{figure!r} (file: {kind}); leave them out"
            )
        attrs = dataset.attrs
        overlay = read_overlay(measurements, attrs.get("reference_frequency"), attrs.get("beam_buckling_level"))
        options = {"measurements": overlay, "quasi_static_line": quasi_static_line}
    if over is not None and ("response_class" not in dataset or figure == "response_class"):
        raise InputError(f"over = {over!r}: curves are of a statistic of a map, not of {figure!r}; give --variable")
    if window is not None:
        if figure != "run":
            raise InputError(
                f"window = {window!r}: belongs to the figure 'run' of a run, not to {figure!r} (file: {kind}); leave it out"
            )
        options = {"window": opt.parse_window(window)}
    if over is not None:
        options = {"over": over}
    draw(dataset, output, variable, **options)
    add_json(files=[output])
    out().print(f"Written: {file_line(output)}")


def _sliced(dataset: xr.Dataset, wanted: dict[str, float | None], at: list[str]) -> xr.Dataset:
    """The map at the points that were named, the nearest there are."""
    chosen = {name: value for name, value in wanted.items() if value is not None}
    chosen |= dict(opt.coordinate_on_axis(dataset, "at", text) for text in at)
    over = next((dataset[name].dims for name in _OVER if name in dataset), ())
    for name in chosen:
        if name not in over:
            raise InputError(
                f"{name}: is not an axis of this file; its axes: {', '.join(map(str, over)) or 'none'}; leave it out"
            )
    return dataset.sel(chosen, method="nearest") if chosen else dataset
