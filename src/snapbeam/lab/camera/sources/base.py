"""What the reader needs of a file format.

A source knows its ``shape`` (height, width), its ``numbers`` (the number of each frame in the original
numbering, so that a missing frame leaves a hole) and can ``read`` a run of frames.  Nothing is kept in memory
between calls but an open decoder.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.findings import Diagnostic

__all__ = ["FrameSource", "grey_of", "scaled_floats"]

_LUMA = np.array([0.299, 0.587, 0.114])


class FrameSource:
    """Frames of one file, folder or pattern.

    Attributes
    ----------
    shape, numbers, max_value
        (height, width); number of each frame; the largest grey level the file can hold.
    frame_rate, pixel_size, exposure
        [Hz], [m], [s], or None where the file does not say.
    frame_rate_question, pixel_size_hint
        What the file says that is not enough, for the refusal.
    diagnostics, edge_error
        What makes measurements doubtful, and the standard error [px] that the format adds to every edge.
    metadata
        What else the file says.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.shape = (0, 0)
        self.numbers: NDArray[np.int64] = np.empty(0, dtype=np.int64)
        self.max_value = 255
        self.frame_rate: float | None = None
        self.pixel_size: float | None = None
        self.exposure: float | None = None
        self.frame_rate_question = ""
        self.pixel_size_hint = ""
        self.diagnostics: tuple[Diagnostic, ...] = ()
        self.edge_error = 0.0
        self.metadata: dict[str, Any] = {}

    def read(self, start: int, stop: int, rows: tuple[int, int]) -> NDArray[np.integer]:
        """Frames *start* to *stop* of the rows from the first up to the second, integers (n, rows, width)."""
        raise NotImplementedError

    def close(self) -> None:
        """Release what is held open."""


def grey_of(colors: NDArray[Any]) -> NDArray[Any]:
    """Grey levels of pictures whose last axis is red, green, blue and perhaps opacity, of the same type."""
    grey = colors[..., :3].astype(np.float64) @ _LUMA
    return np.rint(grey).astype(colors.dtype) if colors.dtype.kind in "iu" else grey.astype(colors.dtype)


def scaled_floats(values: NDArray[np.floating], full: float) -> NDArray[np.uint16] | None:
    """Pictures of floating point numbers from 0 to *full* as whole levels up to 65535; None if outside."""
    if not np.isfinite(values).all() or values.min() < 0.0 or values.max() > full * (1.0 + 1e-9):
        return None
    levels: NDArray[np.uint16] = np.rint(values * (65535.0 / full)).clip(0, 65535).astype(np.uint16)
    return levels
