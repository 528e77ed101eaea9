"""An annotated video of a tracked recording."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.files import atomic_path, check_writable
from snapbeam.core.validate import InputError, integer, positive
from snapbeam.figures.animation import write_mp4
from snapbeam.figures.lab.tracking import flag_words, found_edges
from snapbeam.lab.tracking.quality import check_tracked

if TYPE_CHECKING:
    import xarray as xr

    from snapbeam.lab.camera.recording import Recording

__all__ = ["annotated_video"]

_STRIP = 96  # height of the waveform under the picture, pixels


def annotated_video(
    recording: Recording,
    dataset: xr.Dataset,
    path: str | os.PathLike[str],
    *,
    play_rate: float = 25.0,
    every: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> Path:
    """Write a video of a recording with the found edges drawn in, time and flags, and the waveform below.

    Parameters
    ----------
    recording, dataset
        An open recording and what :func:`snapbeam.lab.track` made of it.
    path
        File to write, ``.mp4``, ``.mov`` or ``.avi`` (H.264).
    play_rate
        Frames shown per second [Hz]; below 5 Hz each is written several times.
    every
        Show every so many-th frame.
    progress
        Called with (frames done, frames in all).
    """
    try:
        import cv2  # noqa: F401
        import imageio_ffmpeg  # noqa: F401
    except ImportError as error:
        raise InputError(
            f"path = {str(path)!r}: a video needs {error.name} (pip install 'snapbeam[lab,video]')"
        ) from error
    target = check_writable(path, "path", (".mp4", ".mov", ".avi"))
    rate = positive("play_rate", play_rate, "Hz")
    every = integer("every", every, 1)
    dataset = check_tracked(dataset)
    if int(recording.numbers[-1]) + 1 != dataset.sizes["time"]:
        raise InputError(
            f"dataset of {dataset.sizes['time']} frames: {recording.path} ends with frame "
            f"{recording.numbers[-1]}"
        )
    low, high = (float(level) for level in np.percentile(recording.frame(0), (0.2, 99.8)))
    canvas = _Canvas(recording.shape, dataset, low, max(high, low + 1.0))

    def pictures() -> Iterator[NDArray[np.uint8]]:
        done = 0
        for batch in recording.batches(32):
            for picture in batch:
                if done % every == 0:
                    yield canvas.draw(picture, int(recording.numbers[done]))
                done += 1
            if progress is not None:
                progress(done, len(recording))

    with atomic_path(target) as temporary:
        write_mp4(pictures(), temporary, rate)
    return target


class _Canvas:
    """Draws one picture after another at a size that can be watched."""

    def __init__(self, shape: tuple[int, int], dataset: xr.Dataset, low: float, high: float) -> None:
        self.shape, self.dataset, self.low, self.high = shape, dataset, low, high
        self.scale = int(np.clip(np.ceil(480 / max(shape)), 1, 8))
        width = max(shape[1] * self.scale, 320)
        height = shape[0] * self.scale + 24 + _STRIP
        self.size = (width + width % 2, height + height % 2)
        self.strip = self._waveform()

    def _waveform(self) -> NDArray[np.uint8]:
        import cv2

        strip = np.full((_STRIP, self.size[0], 3), 255, dtype=np.uint8)
        names = [("displacement_mm", (0, 0, 0)), ("shaker_displacement_mm", (176, 58, 39))]
        values = [self.dataset[name].values for name, _ in names if name in self.dataset]
        both = np.concatenate(values)
        low, high = (np.nanmin(both), np.nanmax(both)) if np.isfinite(both).any() else (0.0, 1.0)
        span = max(float(high - low), 1e-9)
        x = np.linspace(4, self.size[0] - 5, values[0].size)
        for line, (_, color) in zip(values, names, strict=False):
            y = 8.0 + (_STRIP - 16.0) * (high - line) / span
            for stretch in np.split(np.arange(line.size), np.flatnonzero(~np.isfinite(line))):
                stretch = stretch[np.isfinite(line[stretch])]
                if stretch.size > 1:
                    points = np.stack([x[stretch], y[stretch]], axis=1) * 16.0
                    cv2.polylines(strip, [np.rint(points).astype(np.int32)], False, color, 1, cv2.LINE_AA, 4)
        return strip

    def draw(self, picture: NDArray[np.integer], index: int) -> NDArray[np.uint8]:
        """One picture of the video, (height, width, 3), red green blue."""
        import cv2

        grey = np.clip((picture - self.low) * (255.0 / (self.high - self.low)), 0, 255).astype(np.uint8)
        large = cv2.resize(grey, None, fx=self.scale, fy=self.scale, interpolation=cv2.INTER_NEAREST)
        image = np.full((self.size[1], self.size[0], 3), 255, dtype=np.uint8)
        image[24 : 24 + large.shape[0], : large.shape[1]] = large[..., None]
        for _, color, _, rows, columns in found_edges(self.dataset, index, self.shape):
            ends = (np.stack([columns, rows], axis=1) + 0.5) * self.scale + (0, 24)
            rgb = tuple(int(color[i : i + 2], 16) for i in (1, 3, 5))
            first, last = np.rint(ends * 16.0).astype(int).tolist()
            cv2.line(image, first, last, rgb, 2, cv2.LINE_AA, 4)
        time = 1e3 * float(self.dataset["time"][index])
        words = flag_words(int(self.dataset["flags"][index]))
        text = f"frame {index}  {time:.2f} ms  {words}"
        cv2.putText(image, text, (4, 17), cv2.FONT_HERSHEY_SIMPLEX, 0.45, (0, 0, 0), 1, cv2.LINE_AA)
        top = 24 + large.shape[0]
        image[top : top + _STRIP] = self.strip
        x = round(4 + (self.size[0] - 9) * index / max(self.dataset.sizes["time"] - 1, 1))
        cv2.line(image, (x, top + 2), (x, top + _STRIP - 3), (86, 180, 233), 2)
        return image
