"""What a recording shows, in turned pixels: the beam, the shaker, its sticker and its tip.

A scene is built whole by the survey and never changes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from snapbeam.lab.tracking.edges import Floats

__all__ = ["BeamView", "EdgeShape", "Fields", "NoiseShape", "Scene", "ShakerView", "Sticker", "TipOutline"]

_OUTLINE = 3.0  # widths of the edge, of its misfit, by which a tip in the beam's light may lie off
_UNEVEN = 0.02  # px
_MADE_UP = 0.15  # px; rows made between two of one field have a correlation of 2/3


@dataclass(frozen=True)
class BeamView:
    """The beam and the light on it.

    Attributes
    ----------
    threshold, bright
        Grey level that parts objects from the background, and which side of it objects are on.
    contrast, noise
        Step of grey levels at the beam's edge, and standard deviation of a pixel.
    saturated, hot_share
        Grey level at which pixels are saturated (infinite if none is), and the usual share of such pixels
        about the edges.
    edge_width, width_table
        Blur of the edges [px], and the table that turns fitted widths into true ones.
    thickness, thickness_error
        Rows from the far to the near edge, and the standard error.
    columns, contact_column
        Where the edge is fitted, and the column it is wanted at.
    groups, merged
        Columns that see the beam alone; if there are none, the columns about the contact, and ``merged`` says
        that the shaker may grow out of the beam there.
    fixtures
        (first row, one past the last) of bars that cross the picture and never move.
    """

    threshold: float
    bright: bool
    contrast: float
    noise: float
    saturated: float
    hot_share: float
    edge_width: float
    width_table: tuple[Floats, Floats]
    thickness: float
    thickness_error: float
    columns: NDArray[np.intp]
    contact_column: float
    groups: tuple[NDArray[np.intp], ...]
    merged: bool
    fixtures: tuple[tuple[int, int], ...]

    @property
    def sign(self) -> float:
        """+1 for objects brighter than the background, -1 for darker ones."""
        return 1.0 if self.bright else -1.0


@dataclass(frozen=True)
class Sticker:
    """A mark on the shaker: a band between two steps of opposite sign.

    ``thickness`` [px]; ``sign`` and ``contrast`` of its upper step; ``template`` is its profile, in which the
    upper edge stands at ``head``.
    """

    columns: NDArray[np.intp]
    thickness: float
    sign: float
    contrast: float
    template: Floats
    head: int


@dataclass(frozen=True)
class TipOutline:
    """Rows of the tip at ``columns``, counted from the shaker's reference, and the beam's contrast there."""

    columns: NDArray[np.intp]
    profile: Floats
    light: Floats


@dataclass(frozen=True)
class ShakerView:
    """The shaker: the ``rod`` of columns it covers, and what of it is followed.

    The reference row is the middle of the sticker, or without one the tip itself; ``tip_offset`` is the row
    of the tip at the contact counted from it and ``tip_error`` its standard error; ``tip_source`` says in
    words where that is known from; ``isolated`` that the sticker was all that could be seen of the shaker.
    """

    rod: tuple[int, int]
    sticker: Sticker | None
    outline: TipOutline
    tip_offset: float
    tip_error: float
    tip_source: str
    isolated: bool

    @property
    def mark(self) -> str:
        """What is followed: "sticker" or "tip"."""
        return "tip" if self.sticker is None else "sticker"

    @property
    def lowest(self) -> float:
        """Rows from the reference to the lowest pixel needed."""
        if self.sticker is not None:
            return self.sticker.thickness / 2.0
        return float(self.outline.profile.max()) if self.outline.profile.size else 0.0


@dataclass(frozen=True)
class EdgeShape:
    """The mean shape of the beam's edge over the sample, against what a linear camera would show.

    Attributes
    ----------
    misfit
        Root mean square of what the blurred step leaves of the mean edge, share of the contrast.
    gamma, gamma_se
        Exponent of grey level over light that makes the edge symmetric, and its standard error; NaN if the
        sample was too small to tell.
    shift
        Rows by which the fitted edge lies outside the one that is symmetric in light.
    clipped
        Share of saturated pixels in the middle of the beam.
    """

    misfit: float
    gamma: float
    gamma_se: float
    shift: float
    clipped: float


@dataclass(frozen=True)
class NoiseShape:
    """Correlation of a pixel's noise ``in_time`` with that of the next frame, ``along`` the beam with that of the next
    pixel, and ``across`` it; 0 where it is a sensor's own, or too little to tell."""

    in_time: float
    along: float
    across: float

    @property
    def lag(self) -> float:
        """Frames by which what was averaged over time lags behind."""
        return self.in_time / (1.0 - self.in_time)

    @property
    def factor(self) -> float:
        """By how much errors are larger than neighbouring columns seem to say, as their noise is alike."""
        return math.sqrt((1.0 + self.along) / (1.0 - self.along))

    @property
    def made_up(self) -> float:
        """Standard error [px] of an edge in rows that were made of their neighbours, 0.1 px at two rows of one."""
        return _MADE_UP * self.across


@dataclass(frozen=True)
class Fields:
    """Odd and even rows of a picture that lie ``apart`` by a share of the step from frame to frame, and the ``shift``
    [px] of every other frame; 0 where there is none."""

    apart: float
    shift: float

    @property
    def lag(self) -> float:
        """Frames by which a position may be of another instant than its frame's: fields are half a frame apart."""
        return 0.5 if self.apart > 0.0 else 0.0


@dataclass(frozen=True)
class Scene:
    """All that the survey found: the beam, the shaker if one is followed, the shape of the edges and of the noise.

    ``striker_in_view`` says that a shaker was seen that is not followed.
    """

    beam: BeamView
    shaker: ShakerView | None
    shape: EdgeShape
    noise: NoiseShape
    striker_in_view: bool

    @property
    def placed_error(self) -> float:
        """Standard error [px] of where the tip stands against the beam, the same in all frames.

        Never less than a fiftieth of a pixel: the tip is round and uneven.  A tip that is followed by its own
        outline is seen against the beam through the same lens: what the blurred step leaves of an edge is left
        there several times over.
        """
        if self.shaker is None:
            return 0.0
        lens = _UNEVEN
        if self.shaker.sticker is None and math.isfinite(self.shape.misfit):
            lens = max(_OUTLINE * self.shape.misfit * self.beam.edge_width, _UNEVEN)
        return math.hypot(self.shaker.tip_error, self.beam.thickness_error, lens)
