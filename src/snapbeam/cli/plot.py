"""``snapbeam plot``: the picture of a map or a run that has been computed."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from snapbeam.cli import options as opt
from snapbeam.cli.console import door, file_line, out
from snapbeam.cli.info import open_result

__all__ = ["plot"]

_SLICE = "One point of an axis, the nearest there is"


@door
def plot(
    file: Annotated[Path, typer.Argument(help="NetCDF file of a map or a run.", metavar="FILE")],
    output: Annotated[
        Path, typer.Option("--output", "-o", help="Picture to write: .png, .pdf or .svg.", metavar="FILE")
    ],
    frequency_ratio: Annotated[float | None, opt.number_option("Omega.", _SLICE)] = None,
    velocity_amplitude: Annotated[float | None, opt.number_option("V.", _SLICE)] = None,
    location: Annotated[float | None, opt.number_option("x_s.", _SLICE)] = None,
    dots: opt.Dots = None,
    threshold_line: opt.ThresholdLine = False,
    window: opt.Window = None,
) -> None:
    """Draw a map or a run again: other format, measured dots, one slice of a map of three axes."""
    from snapbeam.cli.map import draw_map, read_overlay
    from snapbeam.cli.simulate import draw_run
    from snapbeam.core.files import check_writable
    from snapbeam.core.validate import InputError
    from snapbeam.figures.style import FIGURE_SUFFIXES

    check_writable(output, "output", FIGURE_SUFFIXES)
    dataset = open_result(file)
    if "time" in dataset.dims:
        draw_run(dataset, output, opt.parse_window(window))
    else:
        wanted = {
            "frequency_ratio": frequency_ratio,
            "velocity_amplitude": velocity_amplitude,
            "location": location,
        }
        chosen = {name: value for name, value in wanted.items() if value is not None}
        for name in chosen:
            if name not in dataset.dims:
                raise InputError(
                    f"{name}: is no axis of this map, whose axes are {', '.join(map(str, dataset.dims))}"
                )
        dataset = dataset.sel(chosen, method="nearest") if chosen else dataset
        attrs = dataset.attrs
        overlay = read_overlay(dots, attrs.get("reference_freq"), attrs.get("beam_buckling_level"))
        draw_map(dataset, output, overlay, threshold_line)
    out().print(f"Written: {file_line(output)}")
