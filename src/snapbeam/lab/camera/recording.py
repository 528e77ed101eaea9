"""One lazy reader for every kind of high-speed recording."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.findings import Diagnostic
from snapbeam.core.validate import InputError, InputTypeError, file_path, integer, positive, shown
from snapbeam.lab.camera.sources.base import FrameSource
from snapbeam.lab.camera.sources.opening import open_source
from snapbeam.lab.plausibility.recording import KINDS

__all__ = ["Recording", "open_recording"]

_LARGEST_PIXEL = 0.01  # m


class Recording:
    """Frames of a camera on demand, with the scales that turn them into metres and seconds.

    Made by :func:`open_recording`.  Frames are read when asked for and not kept, so the memory used does not
    grow with the length of the recording.  Use it as a context manager, or call :meth:`close`.

    Attributes
    ----------
    path
        The file, folder or pattern it was opened from.
    shape
        (height, width) of a frame in the region, pixels.
    region
        (first row, last row + 1, first column, last column + 1) in the full frame.
    numbers
        Number of each frame counted from the first, int (frames,); a hole is a missing frame.
    frame_rate, pixel_size
        Frames per second [Hz] and metres per pixel, from the file or the user.
    exposure
        Shutter time [s], or ``None`` where it is not known.
    max_value
        Grey level at which a pixel is saturated.
    metadata
        What else the file says.
    diagnostics
        What in the file makes measurements in it doubtful.
    edge_error
        Standard error [px] that the way the file stores pictures adds to every edge.
    """

    def __init__(
        self,
        path: Path,
        source: FrameSource,
        frame_rate: float,
        pixel_size: float,
        region: tuple[int, int, int, int],
        diagnostics: tuple[Diagnostic, ...] = (),
    ) -> None:
        if not isinstance(source, FrameSource):
            raise InputTypeError(
                f"source = {shown(source)}: must be a source of frames; open_recording opens a file"
            )
        if not isinstance(region, (tuple, list)) or len(region) != 4:
            raise InputError(f"region = {shown(region)}: must be four numbers")
        self.path = path
        self._source = source
        self.frame_rate = frame_rate
        self.pixel_size = pixel_size
        self.region = region
        self.shape = (region[1] - region[0], region[3] - region[2])
        self.numbers = source.numbers
        self.exposure = source.exposure
        self.max_value = source.max_value
        self.metadata: dict[str, Any] = dict(source.metadata)
        self.diagnostics = diagnostics
        self.edge_error = source.edge_error

    def __len__(self) -> int:
        return int(self.numbers.size)

    @property
    def time_step(self) -> float:
        """Time between neighbouring frame numbers, 1/frame_rate [s]."""
        return 1.0 / self.frame_rate

    @property
    def time(self) -> NDArray[np.float64]:
        """Time of each frame [s], float (frames,), zero at the first."""
        return self.numbers / self.frame_rate

    def frame(self, index: int) -> NDArray[np.integer]:
        """One frame of the region, integers (height, width)."""
        index = integer("index", index, 0, len(self) - 1)
        return self._read(index, index + 1)[0]

    def batches(
        self, size: int = 64, *, start: int = 0, stop: int | None = None
    ) -> Iterator[NDArray[np.integer]]:
        """Runs of up to *size* frames in order, integers (frames, height, width)."""
        size = integer("size", size, 1)
        start = integer("start", start, 0, len(self))
        stop = len(self) if stop is None else integer("stop", stop, start, len(self))
        for first in range(start, stop, size):
            yield self._read(first, min(first + size, stop))

    def __iter__(self) -> Iterator[NDArray[np.integer]]:
        for batch in self.batches(16):
            yield from batch

    def _read(self, start: int, stop: int) -> NDArray[np.integer]:
        top, bottom, left, right = self.region
        return self._source.read(start, stop, (top, bottom))[:, :, left:right]

    def close(self) -> None:
        """Close the file."""
        self._source.close()

    def __enter__(self) -> Recording:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        return (
            f"Recording({str(self.path)!r}, {len(self)} frames of {self.shape[0]} x {self.shape[1]} pixels, "
            f"{self.frame_rate:g} Hz, {self.pixel_size * 1e6:g} um per pixel)"
        )


def _region(value: tuple[int, int, int, int] | None, shape: tuple[int, int]) -> tuple[int, int, int, int]:
    if value is None:
        return (0, shape[0], 0, shape[1])
    if len(value) != 4:
        raise InputError(
            f"region = {shown(value)}: must be (first row, last row + 1, first column, last column + 1)"
        )
    top = integer("region[0]", value[0], 0, shape[0] - 1)
    bottom = integer("region[1]", value[1], top + 1, shape[0])
    left = integer("region[2]", value[2], 0, shape[1] - 1)
    return (top, bottom, left, integer("region[3]", value[3], left + 1, shape[1]))


def _rate_findings(source: FrameSource, given: float | None) -> tuple[Diagnostic, ...]:
    """What to say of a frame rate that was given although the file says something."""
    if given is None:
        return ()
    if source.frame_rate_question:
        return (KINDS["contradiction"].found(given=given),)
    stated = source.frame_rate
    if stated is not None and abs(given / stated - 1.0) > 1e-3:
        return (KINDS["rate_given"].found(given=given, stated=stated),)
    return ()


def open_recording(
    path: str | Path,
    *,
    frame_rate: float | None = None,
    pixel_size: float | None = None,
    region: tuple[int, int, int, int] | None = None,
) -> Recording:
    """Open a high-speed recording for reading frame by frame.

    Parameters
    ----------
    path
        A Photron header (.cih, .cihx) or its .mraw; a video (.avi, .mp4, .mov, .mkv); Phantom's .cine; a TIFF
        stack; an array (.npy, or .h5, ``"file.h5::name"`` where it holds several); a folder of numbered images
        or a pattern such as ``"run3/img_*.png"``.
    frame_rate
        Frames per second [Hz] of what is in the file.  Overrides the file.  A video must be given it: the
        rate in a video file is how fast it plays.  A Photron header gives record rate over skipped frames,
        and must be given it too where its fields contradict each other.
    pixel_size
        Metres per pixel in the plane of the beam.  Overrides the file.  Photron (.cihx) and ImageJ files may
        hold it; nearly always it is measured with a scale in view.
    region
        (first row, last row + 1, first column, last column + 1), the part of the frame to read.

    Raises
    ------
    InputError
        If the file is malformed, or if frame rate or pixel size stand neither in the file nor in the call:
        they are never guessed.
    """
    path = file_path("path", path)
    source = open_source(path)
    try:
        given = None if frame_rate is None else positive("frame_rate", frame_rate, "Hz")
        size = source.pixel_size if pixel_size is None else positive("pixel_size", pixel_size, "m")
        rate = source.frame_rate if given is None else given
        if rate is None:
            played = source.metadata.get("playback_rate")
            hint = f"; it plays at {played:g} Hz, which need not be how it was recorded" if played else ""
            why = source.frame_rate_question or (
                f"the frame rate is not in the file{hint}; give frame_rate (--frame-rate) in Hz"
            )
            raise InputError(f"{path}: {why}")
        if size is None:
            hint = f"; {source.pixel_size_hint}" if source.pixel_size_hint else ""
            raise InputError(
                f"{path}: the pixel size is not in the file{hint}; give pixel_size (--pixel-size) in m"
            )
        if size > _LARGEST_PIXEL:
            raise InputError(
                f"pixel_size (--pixel-size) = {size:g}: a pixel of {size:g} m; must be at most {_LARGEST_PIXEL:g} m, "
                "in metres, such as 12e-6 for 12 um"
            )
        diagnostics = (*source.diagnostics, *_rate_findings(source, given))
        return Recording(path, source, rate, size, _region(region, source.shape), diagnostics)
    except BaseException:
        source.close()
        raise
