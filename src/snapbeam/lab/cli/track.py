"""``snapbeam track``: displacement of beam and shaker from a high-speed recording."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from snapbeam.cli.console import add_json, cli_command, duration, file_line, out, progress
from snapbeam.lab.cli import options as lab

if TYPE_CHECKING:
    from snapbeam.lab.camera import Recording
    from snapbeam.lab.tracking.settings import TrackingSettings


# ----------------------------------------------------------------------------------------------------
# Options of ``snapbeam track``.


_CAMERA = "Camera"
_SCENE = "Scene"
_OUTPUT = "Output"


RecordingFile = Annotated[
    Path,
    typer.Argument(
        help="Photron .cih/.cihx, .cine, .avi, .mp4, .mov, TIFF, .npy, .h5, or a folder of numbered images.",
        metavar="RECORDING",
    ),
]
FrameRate = Annotated[
    float | None,
    typer.Option(help="Frame rate, Hz; required for videos and images.", rich_help_panel=_CAMERA),
]
PixelSize = Annotated[
    float | None,
    typer.Option(
        help="Pixel size, m, such as 12e-6; required if the file has none.", rich_help_panel=_CAMERA
    ),
]
Region = Annotated[
    str | None,
    typer.Option(help="Part of the frame to use.", metavar="ROW:ROW,COLUMN:COLUMN", rich_help_panel=_CAMERA),
]
Side = Annotated[
    str,
    typer.Option(
        help="Side of the beam on which the shaker is: below, above, left or right.",
        rich_help_panel=_SCENE,
    ),
]
Objects = Annotated[
    str,
    typer.Option(
        help="Brightness of the objects against the background: bright, dark or auto.", rich_help_panel=_SCENE
    ),
]
Threshold = Annotated[
    float | None,
    typer.Option(help="Grey level of the binarisation threshold; Otsu's by default.", rich_help_panel=_SCENE),
]
ContactColumn = Annotated[
    float | None,
    typer.Option(help="Column of the contact; by default, that of the tip.", rich_help_panel=_SCENE),
]
Shaker = Annotated[
    bool, typer.Option("--shaker/--no-shaker", help="Track the shaker too.", rich_help_panel=_SCENE)
]
Marker = Annotated[
    bool,
    typer.Option("--marker/--no-marker", help="Look for a sticker on the shaker.", rich_help_panel=_SCENE),
]
TipDistance = Annotated[
    float | None,
    typer.Option(
        help="Distance from the tip of the shaker to the nearer edge of the sticker, m.",
        rich_help_panel=_SCENE,
    ),
]
BeamThickness = Annotated[
    float | None,
    typer.Option(help="Thickness of the beam by gauge, m, for a check.", rich_help_panel=_SCENE),
]
Columns = Annotated[
    int,
    typer.Option(help="Number of columns in which the edge of the beam is fitted.", rich_help_panel=_SCENE),
]
BlurLimit = Annotated[
    float | None,
    typer.Option(help="Edge width, px, above which a frame is flagged as blurred.", rich_help_panel=_SCENE),
]
Gamma = Annotated[
    float,
    typer.Option(
        help="Gamma of the camera (exponent of grey level over light), to correct.", rich_help_panel=_CAMERA
    ),
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
        help="Part of the region with a stationary object; snapbeam subtracts the camera drift measured "
        "there. May be repeated.",
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
        help="Frames at rest: number at the start, or FIRST:LAST+1; negative numbers count from the end.",
        metavar="N or A:B",
        rich_help_panel=_SCENE,
    ),
]
BucklingLevel = Annotated[
    float | None,
    typer.Option(
        help="Buckling level b, m, for normalised displacements; by default in mm only.",
        rich_help_panel=_SCENE,
    ),
]
Location = Annotated[
    float, typer.Option(help="Location of the contact over the length (x_s).", rich_help_panel=_SCENE)
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
    typer.Option(
        help="Figure of a frame with the fitted edges to write.", metavar="FILE", rich_help_panel=_OUTPUT
    ),
]
Frame = Annotated[int, typer.Option(help="Number of the frame of --picture.", rich_help_panel=_OUTPUT)]
Report = Annotated[
    Path | None,
    typer.Option(
        help="Figure of the tracking quality over time to write.", metavar="FILE", rich_help_panel=_OUTPUT
    ),
]
Video = Annotated[
    Path | None,
    typer.Option(
        help="Annotated video to write, .mp4, .mov or .avi.", metavar="FILE", rich_help_panel=_OUTPUT
    ),
]
VideoEvery = Annotated[
    int, typer.Option(help="Interval of the frames shown in --video.", rich_help_panel=_OUTPUT)
]


# ----------------------------------------------------------------------------------------------------


@cli_command
def track(
    recording: RecordingFile,
    frame_rate: FrameRate = None,
    pixel_size: PixelSize = None,
    region: Region = None,
    side: Side = "below",
    objects: Objects = "auto",
    threshold: Threshold = None,
    contact_column: ContactColumn = None,
    shaker: Shaker = True,
    marker: Marker = True,
    tip_distance: TipDistance = None,
    beam_thickness: BeamThickness = None,
    columns: Columns = 24,
    blur_limit: BlurLimit = None,
    gamma: Gamma = 1.0,
    background: Background = None,
    fixed_mark: FixedMark = None,
    scale_marks: ScaleMarks = None,
    rest_frames: RestFrames = None,
    buckling_level: BucklingLevel = None,
    location: Location = 1 / 2.1,
    rest_displacement: RestDisplacement = None,
    output: Output = Path("track.nc"),
    picture: Picture = None,
    frame: Frame = 0,
    report: Report = None,
    video: Video = None,
    video_every: VideoEvery = 1,
    strict: lab.Strict = False,
) -> None:
    """Track beam and shaker in every frame of a high-speed recording.

    The command finds the beam, the shaker and a sticker on it, fits their edges to a fraction of a pixel, and writes the
    displacements with standard errors and flags to a NetCDF file.  Frames without a valid edge are NaN and have a flag.
    Diagnostics report doubtful results; with --strict they are errors.  Where tracking fails, or a scale is missing, the
    command writes a first look, to the file of --picture or beside --output: a frame with the objects at the threshold
    and the regions in which it finds a beam, whose options it prints.

    Example: snapbeam track test.cihx --pixel-size 12e-6 --buckling-level 0.335e-3 -o test.nc --picture
    frame.png --report quality.png
    """
    from snapbeam.util.files import check_writable
    from snapbeam.util.netcdf import write_netcdf
    from snapbeam.util.validation import integer

    check_writable(output, "output", (".nc",))
    if picture is not None or report is not None:
        from snapbeam.plot.style import FIGURE_SUFFIXES

        for name, path in (("picture", picture), ("report", report)):
            if path is not None:
                check_writable(path, name, FIGURE_SUFFIXES)
    if video is not None:
        check_writable(video, "video", (".mp4", ".mov", ".avi"))
    integer("frame", frame, 0)
    integer("video_every", video_every, 1)
    from snapbeam.lab.tracking.settings import TrackingSettings
    from snapbeam.lab.tracking.track import track as track_recording
    from snapbeam.lab.tracking.track import tracking_quality, tracking_report
    from snapbeam.util.diagnostics import diagnostics_of, refuse

    settings = TrackingSettings(
        buckling_level=buckling_level, location=location, rest_displacement=rest_displacement,
        rest_frames=_rest(rest_frames), beam_thickness=beam_thickness, side=side, objects=objects,
        threshold=threshold, gamma=gamma, shaker=shaker, marker=marker, tip_distance=tip_distance, columns=columns,
        contact_column=contact_column, blur_limit=blur_limit,
        fixed_marks=[lab.whole_numbers("fixed_mark", text, 4) for text in fixed_mark or ()],  # type: ignore[misc]
    )  # fmt: skip
    part = None if region is None else lab.whole_numbers("region", region, 4)
    start = time.monotonic()
    look = (settings, frame, picture or output)
    with _first_look_at(recording, part, look):
        opened = _opened(recording, frame_rate, pixel_size, part, scale_marks)
    with opened:
        if picture is not None:
            integer("frame", frame, 0, len(opened) - 1)
        if background is not None:
            settings = settings.changed(background=_picture(background, opened))
        with progress(len(opened), "track", "frames") as tell, _first_look_at(recording, part, look):
            dataset = track_recording(opened, settings, progress=tell)
        elapsed = time.monotonic() - start
        files = []
        if picture is not None or report is not None:
            import matplotlib

            matplotlib.use("Agg")
            from snapbeam.lab.plot.tracking import plot_frame, plot_tracking_quality
            from snapbeam.plot.style import save_figure

            if picture is not None:
                files.append(save_figure(plot_frame(opened, dataset, frame), picture))
            if report is not None:
                files.append(save_figure(plot_tracking_quality(dataset), report))
        if strict:  # the pictures show what is wrong; the result is not written
            refuse(diagnostics_of(dataset), str(recording))
        write_netcdf(dataset, output)
        files.insert(0, output)
        if video is not None:
            from snapbeam.lab.plot.tracking import annotated_video

            with progress(len(opened), "video", "frames") as tell:
                files.append(annotated_video(opened, dataset, video, every=video_every, progress=tell))
    found = diagnostics_of(dataset)
    add_json(
        quality=tracking_quality(dataset), diagnostics=[asdict(diagnostic) for diagnostic in found],
        seconds=elapsed, files=files,
    )  # fmt: skip
    console = out()
    console.print(tracking_report(dataset, diagnostics=False), markup=False)
    lab.print_diagnostics(console, found)
    console.print(f"{len(opened) / elapsed:.0f} frames/s, {duration(elapsed)}")
    for path in files:
        console.print(f"wrote {file_line(path)}")


def _rest(text: str | None) -> int | tuple[int, int] | None:
    """Return the frames at rest from "20" or "-40:0"."""
    if text is None:
        return None
    if ":" in text:
        first, last = lab.whole_numbers("rest_frames", text, 2)
        return first, last
    return lab.whole_numbers("rest_frames", text, 1)[0]


def _opened(
    path: Path,
    frame_rate: float | None,
    pixel_size: float | None,
    region: tuple[int, ...] | None,
    scale_marks: str | None,
) -> Recording:
    """Open a recording, with the pixel size from two marks if they are given."""
    from snapbeam.lab.camera import open_recording, pixel_size_from_marks
    from snapbeam.util.validation import InputError

    part = None if region is None else (region[0], region[1], region[2], region[3])
    if scale_marks is None:
        return open_recording(path, frame_rate=frame_rate, pixel_size=pixel_size, region=part)
    if pixel_size is not None:
        raise InputError("pixel_size (--pixel-size) and scale_marks (--scale-marks): must be given only one")
    try:
        marks, length = scale_marks.split("=")
        first, second = (tuple(float(v) for v in mark.split(",")) for mark in marks.split(":"))
        distance = float(length)
        if len(first) != 2 or len(second) != 2:
            raise ValueError
    except ValueError:
        raise InputError(
            f"scale_marks = {scale_marks!r}: must read ROW,COLUMN:ROW,COLUMN=METRES, such as 10,20:10,420=0.010"
        ) from None
    with open_recording(path, frame_rate=frame_rate, pixel_size=1e-6, region=part) as once:
        size, error = pixel_size_from_marks(once, (first[0], first[1]), (second[0], second[1]), distance)
    out().print(f"pixel size {size * 1e6:.4f} +- {error * 1e6:.4f} um from the marks")
    return open_recording(path, frame_rate=frame_rate, pixel_size=size, region=part)


@contextmanager
def _first_look_at(
    path: Path, region: tuple[int, ...] | None, look: tuple[TrackingSettings, int, Path]
) -> Iterator[None]:
    """If a recording cannot be opened or tracked, write its first look beside the output unless that is a figure."""
    from snapbeam.lab.camera import open_recording
    from snapbeam.util.validation import InputError

    try:
        yield
    except InputError as error:
        from snapbeam.lab.tracking.first_look import first_look
        from snapbeam.util.files import check_writable

        settings, frame, target = look
        try:  # with any scale
            recording = open_recording(path, frame_rate=1.0, pixel_size=1e-5, region=region)  # type: ignore[arg-type]
        except InputError:
            raise error from None
        with recording:
            try:
                settings.checked_for(recording.shape, len(recording))
                found = first_look(recording, settings)
            except InputError:
                raise error from None
            import matplotlib

            matplotlib.use("Agg")
            from snapbeam.lab.plot.tracking import plot_first_look
            from snapbeam.plot.style import save_figure

            target = target.with_suffix(".png") if target.suffix == ".nc" else target
            check_writable(target, "picture")
            save_figure(plot_first_look(recording, found, settings, min(frame, len(recording) - 1)), target)
        regions = "".join(f"\n  {one}" for one in found.options.values())
        told = f"; a beam is found with{regions}" if regions else "; no beam is found in any part of it"
        raise InputError(f"{error}; see the rows, columns and objects in {target}{told}") from error


def _picture(path: Path, recording: Recording) -> Any:
    """Image of the empty scene, cropped to the region of a recording."""
    from snapbeam.lab.image_sources import load_image
    from snapbeam.util.validation import InputError

    image = load_image(path)
    top, bottom, left, right = recording.region
    if image.shape == recording.shape:
        return image
    if image.shape[0] < bottom or image.shape[1] < right:
        raise InputError(
            f"background = {str(path)!r}: of shape {image.shape}, smaller than the recording's region"
        )
    return image[top:bottom, left:right]
