"""Common parts of the lab commands: options of signal files, and diagnostics."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.markup import escape

from snapbeam.cli import parameter_options as opt
from snapbeam.cli.console import file_line, out
from snapbeam.model.quantity import countable

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from snapbeam.lab.map_comparison import MapComparison
    from snapbeam.sweeps.measured_points import MeasuredPoints
    from snapbeam.util.diagnostics import Diagnostic


_SIGNAL = "Signal"
OUTPUT = "Output"


def option(about: str, panel: str, metavar: str | None = None, *names: str) -> Any:
    """Option of a command."""
    return typer.Option(*names, help=about, rich_help_panel=panel, metavar=metavar)


RecordingFile = Annotated[
    Path,
    typer.Argument(
        help="Photron .cih/.cihx, .cine, .avi, .mp4, .mov, TIFF, .npy, .h5, or a folder of numbered images.",
        metavar="RECORDING",
    ),
]
SignalFile = Annotated[
    Path,
    typer.Argument(
        help="Text table, WAV, UFF-58, TDMS, LVM, MATLAB, HDF5 or NumPy file of a time series.", metavar="SIGNAL"
    ),
]
Channel = Annotated[str | None, option("Name of the channel, or its number from 0.", _SIGNAL, "NAME")]
Units = Annotated[str | None, option("Unit of the values if the file has none, such as mm/s.", _SIGNAL)]
Sensitivity = Annotated[
    str | None,
    option(
        "Sensitivity of the sensor, per volt or per full scale (FS) of a sound file: '125 mm/s/V', '100 mV/g', '0.5 m/s/FS'.",
        _SIGNAL,
    ),
]
SamplingFreq = Annotated[float | None, opt.number_option("Sampling frequency, Hz, if the file has none.", _SIGNAL)]
Columns = Annotated[
    str | None,
    option(
        "Names and units of the columns of a table without a header: 'time [s],velocity [mm/s]'.",
        _SIGNAL,
        "NAME [UNIT],...",
    ),
]
Operator = Annotated[str | None, option("Name of the person who measured, for the result.", OUTPUT, "NAME")]
Strict = Annotated[bool, option("Treat warnings as errors: write no result.", OUTPUT, None, "--strict")]


def check_files(suffixes: tuple[str, ...], begin: str = "", **paths: Path | None) -> None:
    """Refuse paths of options that cannot be written, or whose suffix is not one of *suffixes*."""
    from snapbeam.util.files import check_writable

    for name, path in paths.items():
        if path is not None:
            check_writable(path, name, suffixes, begin)


def save_plot(figure: Figure, path: Path) -> None:
    """Write a figure, and print its path."""
    from snapbeam.plot.style import save_figure

    save_figure(figure, path)
    out().print(f"Written: {file_line(path)}")


def open_signal(
    path: Path,
    channel: str | None,
    units: str | None,
    sensitivity: str | None,
    sampling_frequency: float | None,
    columns: str | None = None,
) -> xr.DataArray:
    """Read a signal; a channel given as a whole number is counted, unless one has that name."""
    from snapbeam.lab.signal_files import read_channels, read_signal

    chosen: str | int | None = channel
    if channel is not None and countable(channel):
        names = [entry["name"] for entry in read_channels(path, sampling_frequency, columns)]
        chosen = channel if channel in names else int(channel)
    return read_signal(
        path, chosen, units=units, sensitivity=sensitivity, sampling_frequency=sampling_frequency, columns=columns
    )


def map_comparison(dataset: xr.Dataset, measured: Path) -> tuple[MeasuredPoints, MapComparison]:
    """Compare a table of measured responses with a map, in the units of its beam."""
    from snapbeam.lab.map_comparison import compare_measured_points
    from snapbeam.sweeps.measured_points import read_measured_points

    first, level = dataset.attrs.get("reference_frequency"), dataset.attrs.get("beam_buckling_level")
    points = read_measured_points(measured, reference_frequency=first, buckling_level=level)
    return points, compare_measured_points(points, dataset)


def print_notes(result: MapComparison) -> None:
    """Print the points of a comparison that do not count, and its diagnostics."""
    for note in result.notes:
        out().print(f"[yellow]note[/] {note}")
    print_diagnostics(out(), result.diagnostics)


def print_diagnostics(console: Console, diagnostics: Iterable[Diagnostic]) -> None:
    """Print diagnostics with their codes, the most severe first."""
    order = {"error": 0, "warning": 1, "info": 2}
    style = {"error": "bold red", "warning": "yellow", "info": "dim"}
    for one in sorted(diagnostics, key=lambda diagnostic: order[diagnostic.severity.value]):
        kind = one.severity.value
        console.print(f"[{style[kind]}]{kind}[/] {escape(f'[{one.code}]')} {escape(one.message)}")


def whole_numbers(name: str, text: str, count: int) -> tuple[int, ...]:
    """Return *count* whole numbers separated by colons and commas, such as ``0:160,20:84``."""
    from snapbeam.util.validation import InputError

    try:
        values = tuple(int(part) for part in text.replace(":", ",").split(","))
    except ValueError:
        values = ()
    if len(values) != count:
        example = ("0", "0:20", "", "0:160,20:84")[count - 1] if count <= 4 else ""
        raise InputError(f"{name} = {text!r}: must be {count} whole numbers, such as {example}")
    return values


def rest_of(text: str | None) -> int | tuple[int, int] | None:
    """Return the frames at rest from "20" or "-40:0"."""
    if text is None:
        return None
    if ":" in text:
        first, last = whole_numbers("rest_frames", text, 2)
        return first, last
    return whole_numbers("rest_frames", text, 1)[0]


def numbers(name: str, text: str | None) -> tuple[float, ...]:
    """Return numbers separated by commas; none if there is no text."""
    from snapbeam.util.validation import InputError

    if text is None:
        return ()
    try:
        return tuple(float(part) for part in text.split(","))
    except ValueError:
        raise InputError(f"{name} = {text!r}: must be numbers separated by commas") from None
