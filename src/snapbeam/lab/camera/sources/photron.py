"""Photron recordings: a header with its .mraw."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.lab.camera.photron.header import CameraHeader, check_pixels
from snapbeam.lab.camera.photron.pixels import read_mraw
from snapbeam.lab.camera.sources.base import FrameSource
from snapbeam.lab.plausibility.recording import KINDS

__all__ = ["PhotronSource", "take_header"]

_EVEN = 0.02  # share by which the kinds of pixels under a mosaic may differ and count as one


def take_header(source: FrameSource, header: CameraHeader) -> None:
    """Give a source what a header says of times and scales."""
    source.frame_rate = header.timing.frame_rate
    source.frame_rate_question = header.timing.question
    source.pixel_size = header.pixel_size
    source.pixel_size_hint = header.scale_hint
    source.exposure = header.timing.exposure
    source.diagnostics = header.diagnostics
    source.metadata = {
        "format": "Photron mraw"
        if not header.image_suffix
        else f"Photron header of {header.image_suffix} images",
        "camera": header.camera,
        "comment": header.comment,
        "record_rate": header.timing.record_rate,
        "skip": header.timing.skip,
        "stored_bits": header.stored_bits,
        "effective_bits": header.effective_bits,
    }


class PhotronSource(FrameSource):
    """A .cih or .cihx header with its .mraw."""

    def __init__(self, header: CameraHeader) -> None:
        super().__init__(header.path)
        self.header = header
        self._gains: NDArray[np.float64] | None = None
        check_pixels(header)
        self.shape = (header.height, header.width)
        self.numbers = np.arange(header.frame_count)
        self.max_value = header.max_value
        take_header(self, header)
        if header.raw_colors:
            self._gains, spread = _mosaic(self.read(0, 1, (0, self.shape[0]))[0])
            if self._gains is not None:
                self.diagnostics += (KINDS["mosaic"].found(spread_percent=100.0 * spread),)

    def read(self, start: int, stop: int, rows: tuple[int, int]) -> NDArray[np.integer]:
        frames = read_mraw(self.header, start, stop, rows)
        if self._gains is None:
            return frames
        full = np.tile(self._gains, (self.shape[0] // 2 + 1, self.shape[1] // 2 + 1))
        part = full[rows[0] : rows[1], : self.shape[1]]
        return np.rint(np.minimum(frames * part, self.max_value)).astype(frames.dtype)


def _mosaic(frame: NDArray[Any]) -> tuple[NDArray[np.float64] | None, float]:
    """Gains (2, 2) that bring the four kinds of pixels to one mean, and how far apart they are.

    None for pixels that are all of one kind.
    """
    height, width = (size - size % 2 for size in frame.shape)
    kinds = frame[:height, :width].astype(np.float64).reshape(height // 2, 2, width // 2, 2).mean((0, 2))
    if not kinds.min() > 0.0:
        return None, 0.0
    spread = float(kinds.max() / kinds.min() - 1.0)
    return (kinds.max() / kinds if spread > _EVEN else None), spread
