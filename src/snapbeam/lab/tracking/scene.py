"""What a recording shows: where the beam, the shaker's tip and its sticker are, and how to look there.

All work is done in one orientation: the beam crosses the picture from left to right, the shaker stands below
it and rows count downwards.  Other set-ups are turned into it by :class:`Orientation`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.lab.tracking.edges import Floats

__all__ = ["Orientation", "Runs", "Scene", "ShakerRows", "gather", "spread_columns"]

SIDES = ("below", "above", "left", "right")
HALF = 6  # half height of the fit windows, pixels
HOT = 0.25  # share of saturated pixels in its windows beyond which an edge is not trusted


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


@dataclass
class Scene:
    """What the survey found, in turned pixels.

    ``groups`` are columns that see only the beam (or, if there are none, the columns about the contact);
    ``rod`` the columns covered by the shaker.  The shaker's reference row is the middle of its sticker, or
    without one the tip itself; ``tip_profile`` are the rows of the tip at ``tip_columns`` and ``tip_offset``
    the row of the tip at the contact, both counted from that reference; ``tip_light`` is the contrast of the
    beam in those columns.
    """

    threshold: float
    bright: bool
    contrast: float
    noise: float
    saturated: float
    edge_width: float
    thickness: float
    beam_columns: NDArray[np.intp]
    contact_column: float
    groups: list[NDArray[np.intp]]
    rod: tuple[int, int] | None = None
    width_table: tuple[Floats, Floats] | None = None
    marker_columns: NDArray[np.intp] | None = None
    marker_thickness: float = np.nan
    marker_sign: float = 1.0
    marker_contrast: float = np.nan
    template: Floats | None = None
    template_head: int = 0
    tip_columns: NDArray[np.intp] = field(default_factory=lambda: np.empty(0, dtype=np.intp))
    tip_profile: Floats = field(default_factory=lambda: np.empty(0))
    tip_light: Floats = field(default_factory=lambda: np.empty(0))
    tip_offset: float = np.nan
    tip_source: str = "no shaker"

    @property
    def sign(self) -> float:
        """+1 for objects brighter than the background, -1 for darker ones."""
        return 1.0 if self.bright else -1.0


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


class ShakerRows(NamedTuple):
    """Row of the shaker's reference in each frame, its standard error, and the quality of the edges."""

    row: Floats
    error: Floats
    share: Floats
    contrast: Floats
    width: Floats
    merged: NDArray[np.bool_]
    saturated: Floats


@dataclass
class Runs:
    """First object from the far side in each column of each frame, (frames, columns), and what follows it."""

    start: NDArray[np.intp]
    end: NDArray[np.intp]
    found: NDArray[np.bool_]
    after: NDArray[np.intp]  # first row of the next object
    follows: NDArray[np.bool_]
