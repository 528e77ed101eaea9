"""``snapbeam track``: displacement of beam and shaker from a high-speed recording."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import typer

from snapbeam.cli.console import door, duration, file_line, out, progress

__all__ = ["track"]

_CAMERA = "Camera"
_SCENE = "Scene"
_OUTPUT = "Output"


def _numbers(name: str, text: str | None, count: int) -> tuple[int, ...] | None:
    from snapbeam.core.validate import InputError

    if text is None:
        return None
    try:
        values = tuple(int(part) for part in text.replace(":", ",").split(","))
    except ValueError:
        values = ()
    if len(values) != count:
        raise InputError(f"{name} = {text!r}: must be {count} whole numbers, such as 0:160,20:84")
    return values


@door
def track(
    recording: Annotated[
        Path,
        typer.Argument(
            help="Photron .cih/.cihx, .avi, .mp4, .mov, a TIFF stack, or a folder of numbered images.",
            metavar="RECORDING",
        ),
    ],
    frame_rate: Annotated[
        float | None,
        typer.Option(help="Frames per second, Hz; needed for videos and images.", rich_help_panel=_CAMERA),
    ] = None,
    pixel_size: Annotated[
        float | None,
        typer.Option(
            help="Metres per pixel, such as 12e-6; needed unless in the file.", rich_help_panel=_CAMERA
        ),
    ] = None,
    region: Annotated[
        str | None,
        typer.Option(
            help="Part of the frame to use.", metavar="ROW:ROW,COLUMN:COLUMN", rich_help_panel=_CAMERA
        ),
    ] = None,
    side: Annotated[
        str,
        typer.Option(
            help="Side of the beam the shaker stands on: below, above, left or right.",
            rich_help_panel=_SCENE,
        ),
    ] = "below",
    objects: Annotated[
        str,
        typer.Option(help="bright or dark against the background, or auto.", rich_help_panel=_SCENE),
    ] = "auto",
    threshold: Annotated[
        float | None,
        typer.Option(help="Grey level to binarise at; Otsu's by default.", rich_help_panel=_SCENE),
    ] = None,
    contact_column: Annotated[
        float | None,
        typer.Option(help="Column of the contact; found from the tip by default.", rich_help_panel=_SCENE),
    ] = None,
    shaker: Annotated[
        bool, typer.Option("--shaker/--no-shaker", help="Follow the shaker too.", rich_help_panel=_SCENE)
    ] = True,
    buckling_level: Annotated[
        float | None,
        typer.Option(help="b, m, to normalise by; millimetres only by default.", rich_help_panel=_SCENE),
    ] = None,
    location: Annotated[
        float, typer.Option(help="x_s, location of the contact over length.", rich_help_panel=_SCENE)
    ] = 1 / 2.1,
    rest_displacement: Annotated[
        float | None,
        typer.Option(
            help="Displacement of the beam at rest, m; the well facing the shaker by default.",
            rich_help_panel=_SCENE,
        ),
    ] = None,
    output: Annotated[
        Path,
        typer.Option("--output", "-o", help="NetCDF file to write.", metavar="FILE", rich_help_panel=_OUTPUT),
    ] = Path("track.nc"),
    picture: Annotated[
        Path | None,
        typer.Option(help="Picture of a frame with its edges.", metavar="FILE", rich_help_panel=_OUTPUT),
    ] = None,
    frame: Annotated[
        int, typer.Option(help="Number of the frame in --picture.", rich_help_panel=_OUTPUT)
    ] = 0,
    report: Annotated[
        Path | None,
        typer.Option(help="Picture of the quality over time.", metavar="FILE", rich_help_panel=_OUTPUT),
    ] = None,
    video: Annotated[
        Path | None,
        typer.Option(help="Annotated video, .mp4, .mov or .avi.", metavar="FILE", rich_help_panel=_OUTPUT),
    ] = None,
    video_every: Annotated[
        int, typer.Option(help="Show every so many-th frame in --video.", rich_help_panel=_OUTPUT)
    ] = 1,
) -> None:
    """Measure the displacement of beam and shaker in every frame of a high-speed recording.

    Finds the beam, the shaker and a sticker on it, fits their edges to a fraction of a pixel, and writes the
    displacements with standard errors and flags to a NetCDF file.  What could not be measured is flagged and
    left out, never filled in.

    Example: snapbeam track test.cihx --pixel-size 12e-6 --buckling-level 0.335e-3 -o test.nc --picture
    frame.png --report quality.png
    """
    from snapbeam.core.files import check_writable
    from snapbeam.core.netcdf import write_netcdf
    from snapbeam.core.validate import integer

    check_writable(output, "output", (".nc",))
    if picture is not None or report is not None:
        from snapbeam.figures.style import FIGURE_SUFFIXES

        for name, path in (("picture", picture), ("report", report)):
            if path is not None:
                check_writable(path, name, FIGURE_SUFFIXES)
    if video is not None:
        check_writable(video, "video", (".mp4", ".mov", ".avi"))
    integer("frame", frame, 0)
    integer("video_every", video_every, 1)
    from snapbeam.lab.camera.recording import open_recording
    from snapbeam.lab.tracking.quality import tracking_report
    from snapbeam.lab.tracking.track import track as track_recording

    part = _numbers("region", region, 4)
    start = time.monotonic()
    with open_recording(
        recording,
        frame_rate=frame_rate,
        pixel_size=pixel_size,
        region=None if part is None else (part[0], part[1], part[2], part[3]),
    ) as opened:
        if picture is not None:
            integer("frame", frame, 0, len(opened) - 1)
        with progress(len(opened), "track", "frames") as tell:
            dataset = track_recording(
                opened,
                buckling_level=buckling_level,
                location=location,
                rest_displacement=rest_displacement,
                side=side,
                objects=objects,
                threshold=threshold,
                shaker=shaker,
                contact_column=contact_column,
                progress=tell,
            )
        elapsed = time.monotonic() - start
        write_netcdf(dataset, output)
        files = [output]
        if picture is not None or report is not None:
            import matplotlib

            matplotlib.use("Agg")
            from snapbeam.figures.style import save_figure
            from snapbeam.figures.tracking import plot_frame, plot_tracking_quality

            if picture is not None:
                files.append(save_figure(plot_frame(opened, dataset, frame), picture))
            if report is not None:
                files.append(save_figure(plot_tracking_quality(dataset), report))
        if video is not None:
            from snapbeam.figures.tracking_video import annotated_video

            with progress(len(opened), "video", "frames") as tell:
                files.append(annotated_video(opened, dataset, video, every=video_every, progress=tell))
    console = out()
    console.print(tracking_report(dataset), markup=False)
    console.print(f"{len(opened) / elapsed:.0f} frames/s, {duration(elapsed)}")
    for path in files:
        console.print(f"wrote {file_line(path)}")
