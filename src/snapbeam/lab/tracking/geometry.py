"""Rows and columns: the turn that brings the shaker below the beam, and windows of pixels about an edge.

All tracking is done in one orientation: the beam crosses the picture from left to right, the shaker stands
below it and rows count downwards.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from snapbeam.lab.tracking.edges import Floats

__all__ = ["HALF", "HOT", "SIDES", "Orientation", "gather", "spread_columns"]

SIDES = ("below", "above", "left", "right")
HALF = 6  # half height of the fit windows, pixels
HOT = 0.25  # share of saturated pixels, beyond the usual, from which an edge is not trusted


@dataclass(frozen=True)
class Orientation:
    """The side of the beam on which the shaker stands, and the turn that brings it below."""

    side: str
    shape: tuple[int, int]

    @property
    def sign(self) -> float:
        """+1 where the shaker pushes in the positive direction (up or right), -1 where against it."""
        return 1.0 if self.side in ("below", "left") else -1.0

    def turn(self, frames: NDArray) -> NDArray:
        """Frames (n, height, width) with the shaker below."""
        if self.side in ("left", "right"):
            frames = frames.transpose(0, 2, 1)
        return frames[:, ::-1] if self.side in ("above", "left") else frames

    def back(self, rows: Floats, columns: Floats) -> tuple[Floats, Floats]:
        """(rows, columns) of the picture as recorded, from those of the turned one."""
        if self.side == "below":
            return rows, columns
        if self.side == "above":
            return self.shape[0] - 1.0 - rows, columns
        return columns, (self.shape[1] - 1.0 - rows if self.side == "left" else rows)


def gather(
    frames: NDArray[np.floating], rows: NDArray, columns: NDArray[np.intp], half: int
) -> tuple[Floats, NDArray[np.bool_]]:
    """Windows of 2 half + 1 rows about *rows* (n, columns), and which of them lie inside the frame."""
    centre = np.where(np.isfinite(rows), np.rint(rows), -1e6).astype(np.int64)
    inside = (centre >= half) & (centre < frames.shape[1] - half)
    index = np.clip(centre, half, frames.shape[1] - 1 - half)[..., None] + np.arange(-half, half + 1)
    picked = frames[np.arange(frames.shape[0])[:, None, None], index, columns[None, :, None]]
    return picked.astype(np.float64), inside


def spread_columns(low: int, high: int, count: int) -> NDArray[np.intp]:
    """Up to *count* different columns from *low* to *high*, both included, evenly spread."""
    return np.unique(np.rint(np.linspace(low, high, min(count, max(high - low + 1, 1)))).astype(np.intp))
