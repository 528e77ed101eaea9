"""Options of ``snapbeam track``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

__all__ = [
    "Background",
    "BeamThickness",
    "BlurLimit",
    "BucklingLevel",
    "Columns",
    "ContactColumn",
    "FixedMark",
    "Frame",
    "FrameRate",
    "Gamma",
    "Location",
    "Marker",
    "Objects",
    "Output",
    "Picture",
    "PixelSize",
    "Recording",
    "Region",
    "Report",
    "RestDisplacement",
    "RestFrames",
    "ScaleMarks",
    "Shaker",
    "Side",
    "Threshold",
    "TipDistance",
    "Video",
    "VideoEvery",
]

_CAMERA = "Camera"
_SCENE = "Scene"
_OUTPUT = "Output"


Recording = Annotated[
    Path,
    typer.Argument(
        help="Photron .cih/.cihx, .cine, .avi, .mp4, .mov, TIFF, .npy, .h5, or a folder of numbered images.",
        metavar="RECORDING",
    ),
]
FrameRate = Annotated[
    float | None,
    typer.Option(help="Frames per second, Hz; needed for videos and images.", rich_help_panel=_CAMERA),
]
PixelSize = Annotated[
    float | None,
    typer.Option(help="Metres per pixel, such as 12e-6; needed unless in the file.", rich_help_panel=_CAMERA),
]
Region = Annotated[
    str | None,
    typer.Option(help="Part of the frame to use.", metavar="ROW:ROW,COLUMN:COLUMN", rich_help_panel=_CAMERA),
]
Side = Annotated[
    str,
    typer.Option(
        help="Side of the beam the shaker stands on: below, above, left or right.",
        rich_help_panel=_SCENE,
    ),
]
Objects = Annotated[
    str,
    typer.Option(help="bright or dark against the background, or auto.", rich_help_panel=_SCENE),
]
Threshold = Annotated[
    float | None,
    typer.Option(help="Grey level to binarise at; Otsu's by default.", rich_help_panel=_SCENE),
]
ContactColumn = Annotated[
    float | None,
    typer.Option(help="Column of the contact; found from the tip by default.", rich_help_panel=_SCENE),
]
Shaker = Annotated[
    bool, typer.Option("--shaker/--no-shaker", help="Follow the shaker too.", rich_help_panel=_SCENE)
]
Marker = Annotated[
    bool,
    typer.Option("--marker/--no-marker", help="Look for a sticker on the shaker.", rich_help_panel=_SCENE),
]
TipDistance = Annotated[
    float | None,
    typer.Option(help="From the shaker's tip to the sticker's nearer edge, m.", rich_help_panel=_SCENE),
]
BeamThickness = Annotated[
    float | None,
    typer.Option(help="Thickness of the beam by gauge, m, to check by.", rich_help_panel=_SCENE),
]
Columns = Annotated[int, typer.Option(help="Columns to fit the beam's edge in.", rich_help_panel=_SCENE)]
BlurLimit = Annotated[
    float | None,
    typer.Option(help="Edge width, px, from which a frame is flagged as blurred.", rich_help_panel=_SCENE),
]
Gamma = Annotated[
    float,
    typer.Option(help="Exponent of grey level over light, to undo.", rich_help_panel=_CAMERA),
]
Background = Annotated[
    Path | None,
    typer.Option(
        help="Image of the scene without beam and shaker, to subtract.",
        metavar="FILE",
        rich_help_panel=_CAMERA,
    ),
]
FixedMark = Annotated[
    list[str] | None,
    typer.Option(
        help="Part of the region that shows something that stands still; the camera's drift against it is "
        "taken out. May be repeated.",
        metavar="ROW:ROW,COLUMN:COLUMN",
        rich_help_panel=_CAMERA,
    ),
]
ScaleMarks = Annotated[
    str | None,
    typer.Option(
        help="Pixel size from two marks a known distance apart, m: ROW,COLUMN:ROW,COLUMN=0.010.",
        metavar="MARKS",
        rich_help_panel=_CAMERA,
    ),
]
RestFrames = Annotated[
    str | None,
    typer.Option(
        help="Frames at rest: how many at the start, or FIRST:LAST+1; negative from the end.",
        metavar="N or A:B",
        rich_help_panel=_SCENE,
    ),
]
BucklingLevel = Annotated[
    float | None,
    typer.Option(help="b, m, to normalise by; millimetres only by default.", rich_help_panel=_SCENE),
]
Location = Annotated[
    float, typer.Option(help="x_s, location of the contact over length.", rich_help_panel=_SCENE)
]
RestDisplacement = Annotated[
    float | None,
    typer.Option(
        help="Displacement of the beam at rest, m; the well facing the shaker by default.",
        rich_help_panel=_SCENE,
    ),
]
Output = Annotated[
    Path,
    typer.Option("--output", "-o", help="NetCDF file to write.", metavar="FILE", rich_help_panel=_OUTPUT),
]
Picture = Annotated[
    Path | None,
    typer.Option(help="Picture of a frame with its edges.", metavar="FILE", rich_help_panel=_OUTPUT),
]
Frame = Annotated[int, typer.Option(help="Number of the frame in --picture.", rich_help_panel=_OUTPUT)]
Report = Annotated[
    Path | None,
    typer.Option(help="Picture of the quality over time.", metavar="FILE", rich_help_panel=_OUTPUT),
]
Video = Annotated[
    Path | None,
    typer.Option(help="Annotated video, .mp4, .mov or .avi.", metavar="FILE", rich_help_panel=_OUTPUT),
]
VideoEvery = Annotated[
    int, typer.Option(help="Show every so many-th frame in --video.", rich_help_panel=_OUTPUT)
]
