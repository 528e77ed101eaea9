"""``snapbeam track``: displacement of beam and shaker from a high-speed recording."""

from __future__ import annotations

import time
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from snapbeam.cli.common.console import answer, door, duration, file_line, out, progress
from snapbeam.cli.lab import options as lab
from snapbeam.cli.lab import track_options as asked

if TYPE_CHECKING:
    from snapbeam.lab.camera.recording import Recording

__all__ = ["track"]


@door
def track(
    recording: asked.Recording,
    frame_rate: asked.FrameRate = None,
    pixel_size: asked.PixelSize = None,
    region: asked.Region = None,
    side: asked.Side = "below",
    objects: asked.Objects = "auto",
    threshold: asked.Threshold = None,
    contact_column: asked.ContactColumn = None,
    shaker: asked.Shaker = True,
    marker: asked.Marker = True,
    tip_distance: asked.TipDistance = None,
    beam_thickness: asked.BeamThickness = None,
    columns: asked.Columns = 24,
    blur_limit: asked.BlurLimit = None,
    gamma: asked.Gamma = 1.0,
    background: asked.Background = None,
    fixed_mark: asked.FixedMark = None,
    scale_marks: asked.ScaleMarks = None,
    rest_frames: asked.RestFrames = None,
    buckling_level: asked.BucklingLevel = None,
    location: asked.Location = 1 / 2.1,
    rest_displacement: asked.RestDisplacement = None,
    output: asked.Output = Path("track.nc"),
    picture: asked.Picture = None,
    frame: asked.Frame = 0,
    report: asked.Report = None,
    video: asked.Video = None,
    video_every: asked.VideoEvery = 1,
    strict: lab.Strict = False,
) -> None:
    """Measure the displacement of beam and shaker in every frame of a high-speed recording.

    Finds the beam, the shaker and a sticker on it, fits their edges to a fraction of a pixel, and writes the
    displacements with standard errors and flags to a NetCDF file.  What could not be measured is flagged and
    left out, never filled in.  What makes the result doubtful is said, and under --strict refused.

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
    from snapbeam.core.findings import diagnostics_of, refuse
    from snapbeam.lab.tracking.quality import tracking_quality, tracking_report
    from snapbeam.lab.tracking.settings import TrackingSettings
    from snapbeam.lab.tracking.track import track as track_recording

    settings = TrackingSettings(
        buckling_level=buckling_level, location=location, rest_displacement=rest_displacement,
        rest_frames=_rest(rest_frames), beam_thickness=beam_thickness, side=side, objects=objects,
        threshold=threshold, gamma=gamma, shaker=shaker, marker=marker, tip_distance=tip_distance, columns=columns,
        contact_column=contact_column, blur_limit=blur_limit,
        fixed_marks=[lab.whole_numbers("fixed_mark", text, 4) for text in fixed_mark or ()],  # type: ignore[misc]
    )  # fmt: skip
    part = None if region is None else lab.whole_numbers("region", region, 4)
    start = time.monotonic()
    with _opened(recording, frame_rate, pixel_size, part, scale_marks) as opened:
        if picture is not None:
            integer("frame", frame, 0, len(opened) - 1)
        if background is not None:
            settings = settings.changed(background=_picture(background, opened))
        with progress(len(opened), "track", "frames") as tell:
            dataset = track_recording(opened, settings, progress=tell)
        elapsed = time.monotonic() - start
        files = []
        if picture is not None or report is not None:
            import matplotlib

            matplotlib.use("Agg")
            from snapbeam.figures.lab.tracking import plot_frame, plot_tracking_quality
            from snapbeam.figures.style import save_figure

            if picture is not None:
                files.append(save_figure(plot_frame(opened, dataset, frame), picture))
            if report is not None:
                files.append(save_figure(plot_tracking_quality(dataset), report))
        if strict:  # the pictures show what is wrong; the result is not written
            refuse(diagnostics_of(dataset), str(recording))
        write_netcdf(dataset, output)
        files.insert(0, output)
        if video is not None:
            from snapbeam.figures.lab.tracking_video import annotated_video

            with progress(len(opened), "video", "frames") as tell:
                files.append(annotated_video(opened, dataset, video, every=video_every, progress=tell))
    found = diagnostics_of(dataset)
    answer(
        quality=tracking_quality(dataset), diagnostics=[asdict(diagnostic) for diagnostic in found],
        seconds=elapsed, files=files,
    )  # fmt: skip
    console = out()
    console.print(tracking_report(dataset, diagnostics=False), markup=False)
    lab.tell_findings(console, found)
    console.print(f"{len(opened) / elapsed:.0f} frames/s, {duration(elapsed)}")
    for path in files:
        console.print(f"wrote {file_line(path)}")


def _rest(text: str | None) -> int | tuple[int, int] | None:
    """Frames at rest from "20" or "-40:0"."""
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
    """Open a recording, its pixel size taken from two marks if they are given."""
    from snapbeam.core.validate import InputError
    from snapbeam.lab.camera.marks import pixel_size_from_marks
    from snapbeam.lab.camera.recording import open_recording

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


def _picture(path: Path, recording: Recording) -> Any:
    """A picture of the empty scene, cut to the region of a recording."""
    from snapbeam.core.validate import InputError
    from snapbeam.lab.camera.sources.images import load_image

    image = load_image(path)
    top, bottom, left, right = recording.region
    if image.shape == recording.shape:
        return image
    if image.shape[0] < bottom or image.shape[1] < right:
        raise InputError(
            f"background = {str(path)!r}: of shape {image.shape}, smaller than the recording's region"
        )
    return image[top:bottom, left:right]
