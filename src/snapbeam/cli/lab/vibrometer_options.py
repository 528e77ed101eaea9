"""Options of ``snapbeam vibrometer``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from snapbeam.cli.common import options as opt

__all__ = [
    "Amplitude",
    "AmplitudeFrom",
    "Camera",
    "DriveOutput",
    "DriveSamplingFreq",
    "Frequency",
    "Near",
    "Polarity",
    "SnrLimit",
]


Frequency = Annotated[
    float | None, opt.number_option("Excitation frequency as set, Hz, as a guess.", "Drive")
]
SnrLimit = Annotated[
    float | None, opt.number_option("Least ratio of sine to all else, dB, to accept (15).", "Drive")
]
Camera = Annotated[
    Path | None,
    typer.Option(
        help="NetCDF file of the tracked recording of the same test, to align with.",
        metavar="FILE",
        rich_help_panel="Drive",
    ),
]
Polarity = Annotated[
    int | None,
    typer.Option(
        help="1 or -1: whether vibrometer and camera count the same direction as positive; found from the start.",
        rich_help_panel="Drive",
    ),
]
Near = Annotated[
    float | None,
    opt.number_option("Delay of the camera's clock, s, known to half a cycle, as from a trigger.", "Drive"),
]
Amplitude = Annotated[float | None, opt.number_option("Amplitude as set, m/s (or m), to check by.", "Drive")]
AmplitudeFrom = Annotated[
    str, typer.Option(help="vibrometer or camera: whose amplitude the drive has.", rich_help_panel="Drive")
]
DriveOutput = Annotated[
    Path | None,
    typer.Option(
        help="NetCDF file of the drive, drift-free and resampled, to write.",
        metavar="FILE",
        rich_help_panel="Output",
    ),
]
DriveSamplingFreq = Annotated[
    float | None, opt.number_option("Samples per second of --drive-output, Hz (100000).", "Output")
]
