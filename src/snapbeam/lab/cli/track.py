"""``snapbeam track``: displacement of beam and shaker from a high-speed recording."""

from __future__ import annotations

import inspect
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from snapbeam.cli.console import add_json, cli_command, duration, file_line, given_options, out, progress
from snapbeam.lab.cli import options as lab
from snapbeam.lab.cli.options import option

if TYPE_CHECKING:
    from snapbeam.lab.camera import Recording
    from snapbeam.lab.tracking.settings import TrackingSettings


_CAMERA = "Camera"
_SCENE = "Scene"
_OUTPUT = lab.OUTPUT


def _option(name: str, kind: Any, default: Any, about: str = "", *more: Any) -> inspect.Parameter:
    """A keyword of the command: an option with its text, panel, placeholder and names, or of a kind with its own."""
    kind = Annotated[kind, option(about, *more)] if about else kind
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=kind)


_REAL, _TEXT, _FILE = float | None, str | None, Path | None
_OPTIONS = (
    _option("settings", _FILE, None,
            "TOML file with the sections [camera] and [tracking], such as snapbeam look writes; other options go first.",
            _CAMERA, "FILE"),
    _option("frame_rate", _REAL, None, "Frame rate, Hz; required for videos and images.", _CAMERA),
    _option("pixel_size", _REAL, None, "Pixel size, m, such as 12e-6; required if the file has none.", _CAMERA),
    _option("region", _TEXT, None, "Part of the frame to use.", _CAMERA, "ROW:ROW,COLUMN:COLUMN"),
    _option("frames", _TEXT, None, "Frames to use; the first is at time zero.", _CAMERA, "FIRST:LAST+1"),
    _option("side", str, "below", "Side of the beam on which the shaker is: below, above, left or right.", _SCENE),
    _option("objects", str, "auto", "Brightness of the objects against the background: bright, dark or auto.", _SCENE),
    _option("threshold", _REAL, None, "Grey level of the binarisation threshold; Otsu's by default.", _SCENE),
    _option("contact_column", _REAL, None, "Column of the contact; by default, that of the tip.", _SCENE),
    _option("shaker", bool, True, "Track the shaker too.", _SCENE, None, "--shaker/--no-shaker"),
    _option("marker", bool, True, "Look for a sticker on the shaker.", _SCENE, None, "--marker/--no-marker"),
    _option("tip_distance", _REAL, None,
            "Distance from the tip of the shaker to the nearer edge of the sticker, m.", _SCENE),
    _option("beam_thickness", _REAL, None, "Thickness of the beam by gauge, m, to check the pixel size.", _SCENE),
    _option("beam_thickness_error", _REAL, None, "Standard error of --beam-thickness, m; 1 % by default.", _SCENE),
    _option("tip_diameter", _REAL, None,
            "Diameter of the shaker's rod behind its tip by gauge, m, to check the pixel size.", _SCENE),
    _option("tip_diameter_error", _REAL, None, "Standard error of --tip-diameter, m; 1 % by default.", _SCENE),
    _option("drive_amplitude", _REAL, None,
            "Amplitude of the shaker's displacement by vibrometer, m, to check the pixel size.", _SCENE),
    _option("drive_amplitude_error", _REAL, None, "Standard error of --drive-amplitude, m; 0.2 % by default.", _SCENE),
    _option("columns", int, 24, "Number of columns in which the edge of the beam is fitted.", _SCENE),
    _option("blur_limit", _REAL, None, "Edge width, px, above which a frame is flagged as blurred.", _SCENE),
    _option("gamma", float, 1.0, "Gamma of the camera (exponent of grey level over light), to correct.", _CAMERA),
    _option("background", _FILE, None, "Image of the scene without beam and shaker, to subtract.", _CAMERA, "FILE"),
    _option("fixed_mark", list[str] | None, None,
            "Part of the region with a stationary object; snapbeam subtracts the camera drift measured there. "
            "May be repeated.", _CAMERA, "ROW:ROW,COLUMN:COLUMN"),
    _option("scale_marks", _TEXT, None,
            "Pixel size from two marks a known distance apart, m: ROW,COLUMN:ROW,COLUMN=0.010.", _CAMERA, "MARKS"),
    _option("rest_frames", _TEXT, None,
            "Frames at rest: number at the start, or FIRST:LAST+1; negative numbers count from the "
            "end.", _SCENE, "N or A:B"),
    _option("buckling_level", _REAL, None,
            "Buckling level b, m, for normalised displacements; by default in mm only.", _SCENE),
    _option("location", float, 1 / 2.1, "Location of the contact over the length (x_s).", _SCENE),
    _option("rest_displacement", _REAL, None,
            "Displacement of the beam at rest, m; the well facing the shaker by default.", _SCENE),
    _option("output", Path, Path("track.nc"), "NetCDF file to write.", _OUTPUT, "FILE", "--output", "-o"),
    _option("operator", lab.Operator, None),
    _option("picture", _FILE, None, "Figure of a frame with the fitted edges to write.", _OUTPUT, "FILE"),
    _option("frame", int, 0, "Number of the frame of --picture.", _OUTPUT),
    _option("report", _FILE, None, "Figure of the tracking quality over time to write.", _OUTPUT, "FILE"),
    _option("video", _FILE, None, "Annotated video to write, .mp4, .mov or .avi.", _OUTPUT, "FILE"),
    _option("video_every", int, 1, "Interval of the frames shown in --video.", _OUTPUT),
    _option("strict", lab.Strict, False),
)  # fmt: skip


def _with_options(command: Callable[..., None]) -> Callable[..., None]:
    first = inspect.Parameter("recording", inspect.Parameter.KEYWORD_ONLY, annotation=lab.RecordingFile)
    command.__signature__ = inspect.Signature([first, *_OPTIONS])  # type: ignore[attr-defined]
    return command


@cli_command
@_with_options
def track(
    recording: Path, *, output: Path, picture: Path | None, report: Path | None, video: Path | None, frame: int,
    video_every: int, settings: Path | None, frame_rate: float | None, pixel_size: float | None, region: str | None,
    frames: str | None, scale_marks: str | None, fixed_mark: list[str] | None, rest_frames: str | None,
    background: Path | None, operator: str | None, strict: bool, **scene: Any,
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
    from snapbeam.lab.batch import read_settings
    from snapbeam.lab.tracking.settings import TrackingSettings
    from snapbeam.lab.tracking.track import track as track_recording
    from snapbeam.lab.tracking.track import tracking_quality, tracking_report
    from snapbeam.util.diagnostics import diagnostics_of, refuse

    scene["rest_frames"] = lab.rest_of(rest_frames)
    scene["fixed_marks"] = [lab.whole_numbers("fixed_mark", text, 4) for text in fixed_mark or ()] or None
    part = None if region is None else lab.whole_numbers("region", region, 4)
    used = None if frames is None else lab.whole_numbers("frames", frames, 2)
    camera = {"frame_rate": frame_rate, "pixel_size": pixel_size, "region": part, "frames": used}
    names = given_options() | {"fixed_marks"}
    given = {name: value for name, value in scene.items() if name in names}
    sections = read_settings(settings, {"camera": camera, "tracking": given})
    left = {name: value for name, value in scene.items() if value is not None}
    wanted = TrackingSettings().changed(**left | sections["tracking"])
    start = time.monotonic()
    look = (wanted, frame, picture or output)
    if scale_marks is not None and pixel_size is None:  # the option goes before the file
        sections["camera"].pop("pixel_size", None)
    with _first_look_at(recording, sections["camera"], look):
        opened = _opened(recording, sections["camera"], scale_marks)
    with opened:
        if picture is not None:
            integer("frame", frame, 0, len(opened) - 1)
        if background is not None:
            wanted = wanted.changed(background=_picture(background, opened))
        with progress(len(opened), "track", "frames") as tell, _first_look_at(recording, sections["camera"], look):
            dataset = track_recording(opened, wanted, progress=tell)
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


def _opened(path: Path, camera: dict[str, Any], scale_marks: str | None) -> Recording:
    """Open a recording, with the pixel size from two marks if they are given."""
    from snapbeam.lab.camera import open_recording, pixel_size_from_marks
    from snapbeam.util.validation import InputError

    if scale_marks is None:
        return open_recording(path, **camera)
    if "pixel_size" in camera:
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
    with open_recording(path, **camera, pixel_size=1e-6) as once:
        size, error = pixel_size_from_marks(once, (first[0], first[1]), (second[0], second[1]), distance)
    out().print(f"pixel size {size * 1e6:.4f} +- {error * 1e6:.4f} um from the marks")
    return open_recording(path, **camera, pixel_size=size)


@contextmanager
def _first_look_at(path: Path, camera: dict[str, Any], look: tuple[TrackingSettings, int, Path]) -> Iterator[None]:
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
            recording = open_recording(path, **camera | {"frame_rate": 1.0, "pixel_size": 1e-5})
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
