"""``snapbeam track``: displacement of beam and shaker from a high-speed recording."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from snapbeam.cli.console import add_json, cli_command, duration, file_line, out, progress
from snapbeam.lab.cli import options as lab
from snapbeam.lab.cli.options import option

if TYPE_CHECKING:
    from snapbeam.lab.camera import Recording
    from snapbeam.lab.tracking.settings import TrackingSettings


_CAMERA = "Camera"
_SCENE = "Scene"
_OUTPUT = lab.OUTPUT


@cli_command
def track(
    recording: Annotated[
        Path,
        typer.Argument(
            help="Photron .cih/.cihx, .cine, .avi, .mp4, .mov, TIFF, .npy, .h5, or a folder of numbered images.",
            metavar="RECORDING",
        ),
    ],
    frame_rate: Annotated[float | None, option("Frame rate, Hz; required for videos and images.", _CAMERA)] = None,
    pixel_size: Annotated[
        float | None, option("Pixel size, m, such as 12e-6; required if the file has none.", _CAMERA)
    ] = None,
    region: Annotated[str | None, option("Part of the frame to use.", _CAMERA, "ROW:ROW,COLUMN:COLUMN")] = None,
    side: Annotated[
        str, option("Side of the beam on which the shaker is: below, above, left or right.", _SCENE)
    ] = "below",
    objects: Annotated[
        str, option("Brightness of the objects against the background: bright, dark or auto.", _SCENE)
    ] = "auto",
    threshold: Annotated[
        float | None, option("Grey level of the binarisation threshold; Otsu's by default.", _SCENE)
    ] = None,
    contact_column: Annotated[
        float | None, option("Column of the contact; by default, that of the tip.", _SCENE)
    ] = None,
    shaker: Annotated[bool, option("Track the shaker too.", _SCENE, None, "--shaker/--no-shaker")] = True,
    marker: Annotated[bool, option("Look for a sticker on the shaker.", _SCENE, None, "--marker/--no-marker")] = True,
    tip_distance: Annotated[
        float | None, option("Distance from the tip of the shaker to the nearer edge of the sticker, m.", _SCENE)
    ] = None,
    beam_thickness: Annotated[
        float | None, option("Thickness of the beam by gauge, m, to check the pixel size.", _SCENE)
    ] = None,
    beam_thickness_error: Annotated[
        float | None, option("Standard error of --beam-thickness, m; 1 % by default.", _SCENE)
    ] = None,
    tip_diameter: Annotated[
        float | None,
        option("Diameter of the shaker's rod behind its tip by gauge, m, to check the pixel size.", _SCENE),
    ] = None,
    tip_diameter_error: Annotated[
        float | None, option("Standard error of --tip-diameter, m; 1 % by default.", _SCENE)
    ] = None,
    drive_amplitude: Annotated[
        float | None,
        option("Amplitude of the shaker's displacement by vibrometer, m, to check the pixel size.", _SCENE),
    ] = None,
    drive_amplitude_error: Annotated[
        float | None, option("Standard error of --drive-amplitude, m; 0.2 % by default.", _SCENE)
    ] = None,
    columns: Annotated[int, option("Number of columns in which the edge of the beam is fitted.", _SCENE)] = 24,
    blur_limit: Annotated[
        float | None, option("Edge width, px, above which a frame is flagged as blurred.", _SCENE)
    ] = None,
    gamma: Annotated[
        float, option("Gamma of the camera (exponent of grey level over light), to correct.", _CAMERA)
    ] = 1.0,
    background: Annotated[
        Path | None, option("Image of the scene without beam and shaker, to subtract.", _CAMERA, "FILE")
    ] = None,
    fixed_mark: Annotated[
        list[str] | None,
        option(
            "Part of the region with a stationary object; snapbeam subtracts the camera drift measured there. May be "
            "repeated.",
            _CAMERA, "ROW:ROW,COLUMN:COLUMN",
        ),
    ] = None,
    scale_marks: Annotated[
        str | None,
        option("Pixel size from two marks a known distance apart, m: ROW,COLUMN:ROW,COLUMN=0.010.", _CAMERA, "MARKS"),
    ] = None,
    rest_frames: Annotated[
        str | None,
        option(
            "Frames at rest: number at the start, or FIRST:LAST+1; negative numbers count from the end.",
            _SCENE, "N or A:B",
        ),
    ] = None,
    buckling_level: Annotated[
        float | None, option("Buckling level b, m, for normalised displacements; by default in mm only.", _SCENE)
    ] = None,
    location: Annotated[float, option("Location of the contact over the length (x_s).", _SCENE)] = 1 / 2.1,
    rest_displacement: Annotated[
        float | None,
        option("Displacement of the beam at rest, m; the well facing the shaker by default.", _SCENE),
    ] = None,
    output: Annotated[Path, option("NetCDF file to write.", _OUTPUT, "FILE", "--output", "-o")] = Path("track.nc"),
    operator: lab.Operator = None,
    picture: Annotated[
        Path | None, option("Figure of a frame with the fitted edges to write.", _OUTPUT, "FILE")
    ] = None,
    frame: Annotated[int, option("Number of the frame of --picture.", _OUTPUT)] = 0,
    report: Annotated[
        Path | None, option("Figure of the tracking quality over time to write.", _OUTPUT, "FILE")
    ] = None,
    video: Annotated[Path | None, option("Annotated video to write, .mp4, .mov or .avi.", _OUTPUT, "FILE")] = None,
    video_every: Annotated[int, option("Interval of the frames shown in --video.", _OUTPUT)] = 1,
    strict: lab.Strict = False,
) -> None:  # fmt: skip
    """Track beam and shaker in every frame of a high-speed recording.

    The command finds the beam, the shaker and a sticker on it, fits their edges to a fraction of a pixel, and writes the
    displacements with standard errors and flags to a NetCDF file.  Frames without a valid edge are NaN and have a flag.
    Diagnostics report doubtful results; with --strict they are errors.  If tracking fails or a
    scale is missing, the command writes a picture to the file of --picture, or beside --output.  It shows one frame with
    the objects at the threshold and the regions in which a beam was found.  The options of each region are printed.

    Example: snapbeam track test.cihx --pixel-size 12e-6 --buckling-level 0.335e-3 -o test.nc --picture
    frame.png --report quality.png
    """
    given = dict(locals())
    from snapbeam.util.netcdf import write_netcdf
    from snapbeam.util.validation import integer

    lab.check_files((".nc",), output=output)
    if picture is not None or report is not None:
        from snapbeam.plot.style import FIGURE_SUFFIXES

        lab.check_files(FIGURE_SUFFIXES, picture=picture, report=report)
    lab.check_files((".mp4", ".mov", ".avi"), video=video)
    if video is not None:
        from snapbeam.util.packages import needing

        with needing("--video", "lab,video"):
            import imageio_ffmpeg  # noqa: F401
    integer("frame", frame, 0)
    integer("video_every", video_every, 1)
    from snapbeam.lab.tracking.settings import TrackingSettings
    from snapbeam.lab.tracking.track import track as track_recording
    from snapbeam.lab.tracking.track import tracking_quality, tracking_report
    from snapbeam.util.diagnostics import diagnostics_of, refuse

    given |= {"background": None, "rest_frames": _rest(rest_frames)}
    given["fixed_marks"] = [lab.whole_numbers("fixed_mark", text, 4) for text in fixed_mark or ()]
    settings = TrackingSettings(**{field.name: given[field.name] for field in fields(TrackingSettings)})
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
        if operator is not None:
            dataset.attrs["operator"] = operator
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
    """Write the first look at a recording that cannot be opened or tracked beside the output, unless that is a figure."""
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
        outcome = f"; a beam is found with{regions}" if regions else "; no beam is found in any part of it"
        raise InputError(f"{error}; see the rows, columns and objects in {target}{outcome}") from error


def _picture(path: Path, recording: Recording) -> Any:
    """Image of the empty scene, cropped to the region of a recording."""
    from snapbeam.lab.image_sources import load_image
    from snapbeam.util.validation import InputError

    image = load_image(path)
    top, bottom, left, right = recording.region
    if image.shape == recording.shape:
        return image
    if image.shape[0] < bottom or image.shape[1] < right:
        raise InputError(f"background = {str(path)!r}: of shape {image.shape}, smaller than the recording's region")
    return image[top:bottom, left:right]
