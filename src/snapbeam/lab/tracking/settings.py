"""Settings of the tracking, in one frozen and checked object."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntFlag
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.lab.tracking.edges import EdgeFit, Floats, edge_noise, fit_edges
from snapbeam.util.validation import (
    InputError,
    InputTypeError,
    choice,
    finite,
    finite_array,
    flag,
    integer,
    positive,
    shown,
    within,
)

# ----------------------------------------------------------------------------------------------------
# Rows and columns: the turn that brings the shaker below the beam, and windows of pixels about an edge.
#
# All tracking is done in one orientation: the beam crosses the picture from left to right, the shaker stands
# below it and rows count downwards.


RULERS = {"beam_thickness": 0.01, "tip_diameter": 0.01, "drive_amplitude": 0.002}
"""Lengths that check the pixel size, and their relative standard errors where none is given."""

SIDES = ("below", "above", "left", "right")
HALF = 6  # half height of the fit windows, pixels
HOT = 0.25  # share of saturated pixels, beyond the usual, from which an edge is not trusted


@dataclass(frozen=True)
class Orientation:
    """Side of the beam on which the shaker is, and the rotation that brings it below."""

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


def edges_about(
    frames: NDArray[np.floating], rows: NDArray, columns: NDArray[np.intp], half: int, width: float, sign: float
) -> tuple[Floats, NDArray[np.bool_], EdgeFit, Floats]:
    """Windows about *rows*, which lie inside the frame, the edges fitted in them, and the rows of these."""
    windows, inside = gather(frames, rows, columns, half)
    fit = fit_edges(windows, width, sign=sign)
    return windows, inside, fit, np.rint(rows) + fit.position


def spread_columns(low: int, high: int, count: int) -> NDArray[np.intp]:
    """Up to *count* different columns from *low* to *high*, both included, evenly spread."""
    return np.unique(np.rint(np.linspace(low, high, min(count, max(high - low + 1, 1)))).astype(np.intp))


# ----------------------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True, eq=False)
class TrackingSettings:
    """Settings of the tracking of a recording: geometry of the scene, thresholds, reference frames.

    Attributes
    ----------
    buckling_level
        Buckling level b [m], for displacements in units of b.
    location
        Location x_s/L of the contact.
    rest_displacement
        Displacement of the beam [m] at rest. By default the well that faces the shaker: -(b/2)(1 - cos 2 pi x_s/L), of
        opposite sign for a shaker above; 0 without ``buckling_level``.
    rest_frames
        Frames at rest: their number at the start, or (first, one past the last), negative from the end. By default the
        first half of those before it departs from their mean by three standard errors.
    beam_thickness, tip_diameter, drive_amplitude
        Lengths that check the pixel size [m]: thickness of the beam and diameter of the shaker's rod by gauge,
        amplitude of the shaker's steady displacement by vibrometer.
    beam_thickness_error, tip_diameter_error, drive_amplitude_error
        Standard errors of these [m]; by default 1 %, 1 % and 0.2 %.
    side
        Side of the shaker: "below", "above", "left" or "right". Up (or right) is positive.
    objects
        "bright" or "dark" against the background, or "auto".
    threshold
        Grey level for binarising; Otsu's by default.
    background : array of shape (height, width), optional
        Picture of the scene without beam and shaker, to subtract.
    gamma
        Exponent of grey level over light; 1 for a linear camera.
    shaker, marker
        True to follow the shaker, and to look for its sticker.
    tip_distance
        Distance from the tip to the nearer edge of its sticker [m]; found by default.
    columns
        Columns in which the edge is fitted.
    contact_column
        Column (or row) of the contact; found from the tip by default.
    blur_limit
        Edge width [px] of a blurred frame; by default 2.5 times the usual plus 0.5.
    fixed_marks
        Parts of the picture with stationary objects, (first row, last row + 1, first column, last column + 1) each; the
        motion of the camera there is subtracted.

    Examples
    --------
    >>> from snapbeam import lab
    >>> settings = lab.TrackingSettings(buckling_level=0.335e-3, location=1 / 2.1)
    >>> settings.side
    'below'
    """

    buckling_level: float | None = None
    location: float = 0.5
    rest_displacement: float | None = None
    rest_frames: int | tuple[int, int] | None = None
    beam_thickness: float | None = None
    beam_thickness_error: float | None = None
    tip_diameter: float | None = None
    tip_diameter_error: float | None = None
    drive_amplitude: float | None = None
    drive_amplitude_error: float | None = None
    side: str = "below"
    objects: str = "auto"
    threshold: float | None = None
    background: ArrayLike | None = None
    gamma: float = 1.0
    shaker: bool = True
    marker: bool = True
    tip_distance: float | None = None
    columns: int = 24
    contact_column: float | None = None
    blur_limit: float | None = None
    fixed_marks: Sequence[tuple[int, int, int, int]] = ()

    def __post_init__(self) -> None:
        lengths = [f"{name}{more}" for name in RULERS for more in ("", "_error")]
        checks: list[tuple[str, Any, tuple[Any, ...]]] = [
            *((name, positive, ("m",)) for name in ("buckling_level", *lengths)),
            ("blur_limit", positive, ("px",)),
            *((name, finite, ()) for name in ("rest_displacement", "threshold")),
            ("tip_distance", partial(within, closed="left"), (0.0, 0.1)),
            ("location", within, (0.0, 1.0)),
            ("gamma", within, (0.1, 10.0)),
            ("columns", integer, (3, 1000)),
            ("background", finite_array, (2,)),
            ("side", choice, (SIDES,)),
            ("objects", choice, (("auto", "bright", "dark"),)),
            ("shaker", flag, ()),
            ("marker", flag, ()),
            ("rest_frames", _rest_frames, ()),
        ]
        for name, check, allowed in checks:
            if getattr(self, name) is not None or check in (choice, flag):
                object.__setattr__(self, name, check(name, getattr(self, name), *allowed))
        if not isinstance(self.fixed_marks, (tuple, list)):
            raise InputTypeError(f"fixed_marks = {shown(self.fixed_marks)}: must be a list of marks")
        object.__setattr__(self, "fixed_marks", tuple(_mark(i, m) for i, m in enumerate(self.fixed_marks)))

    def changed(self, **changes: Any) -> TrackingSettings:
        """Copy of the settings with some changed, by name."""
        for name in changes:
            choice("setting", name, tuple(field.name for field in dataclasses.fields(self)))
        return dataclasses.replace(self, **changes)

    def checked_for(self, shape: tuple[int, int], frames: int) -> TrackingSettings:
        """Settings, checked for a recording of *frames* frames of *shape*."""
        if self.background is not None and np.shape(self.background) != shape:
            raise InputError(
                f"background of shape {np.shape(self.background)}: must be of shape {shape}, that of the region"
            )
        if self.contact_column is not None:
            across = shape[1] if self.side in ("below", "above") else shape[0]
            within("contact_column", self.contact_column, 0.0, across - 1.0, closed="both", unit="px")
        for i, (top, bottom, left, right) in enumerate(self.fixed_marks):
            if not (0 <= top < bottom <= shape[0] and 0 <= left < right <= shape[1]):
                raise InputError(
                    f"fixed_marks[{i}] = {(top, bottom, left, right)}: must lie in the region of {shape} pixels"
                )
        self.rest_range(frames)
        return self

    def rest_range(self, frames: int) -> tuple[int, int] | None:
        """First frame at rest and one past the last, if they were given."""
        if self.rest_frames is None:
            return None
        if isinstance(self.rest_frames, int):
            return 0, integer("rest_frames", self.rest_frames, 1, frames)
        first, stop = (value + frames if value < 0 else value for value in self.rest_frames)
        if self.rest_frames[1] == 0:
            stop = frames
        if not 0 <= first < stop <= frames:
            raise InputError(f"rest_frames = {self.rest_frames}: must be (first, last + 1) within the {frames} frames")
        return first, stop

    @property
    def rest(self) -> float:
        """Displacement of the beam at rest [m]."""
        if self.rest_displacement is not None:
            return self.rest_displacement
        if self.buckling_level is None:
            return 0.0
        sign = Orientation(self.side, (1, 1)).sign
        return -sign * self.buckling_level * 0.5 * (1.0 - math.cos(2.0 * math.pi * self.location))


def _rest_frames(name: str, value: Any) -> int | tuple[int, ...]:
    if not isinstance(value, (tuple, list)):
        return integer(name, value, 1)
    if len(value) != 2:
        raise InputError(f"{name} = {value!r}: must be a number or (first, last + 1)")
    return tuple(integer(f"{name}[{i}]", one, -(2**40)) for i, one in enumerate(value))


def _mark(number: int, value: Any) -> tuple[int, ...]:
    if isinstance(value, (str, bytes)) or not hasattr(value, "__len__") or len(value) != 4:
        raise InputError(
            f"fixed_marks[{number}] = {value!r}: must be (first row, last row + 1, first column, last column + 1)"
        )
    return tuple(integer(f"fixed_marks[{number}][{i}]", one, 0) for i, one in enumerate(value))


# ----------------------------------------------------------------------------------------------------
# What a recording shows, in turned pixels: the beam, the shaker, its sticker and its tip.
#
# A scene is built whole by the survey and never changes.


_OUTLINE = 3.0  # widths of the edge, of its misfit, by which a tip in the beam's light may lie off
_UNEVEN = 0.02  # px
_MADE_UP = 0.15  # px; rows made between two of one field have a correlation of 2/3


@dataclass(frozen=True)
class BeamView:
    """The beam and the light on it.

    Objects are on the ``bright`` or dark side of the grey level ``threshold``; ``contrast`` is the step at the beam's
    edge, ``noise`` the standard deviation of a pixel, ``saturated`` the level at which pixels are (infinite if none is)
    and ``hot_share`` the usual share of such pixels about the edges.  ``width_table`` turns fitted widths of edges into
    true ones, ``thickness`` is in rows.  The edge is fitted in ``columns`` and wanted at ``contact_column``; ``groups``
    of columns see the beam alone, or are those about the contact, and ``merged`` says that the shaker may grow out of
    the beam there.  ``fixtures`` are rows (first, one past the last) of bars that never move.
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

    @property
    def half(self) -> int:
        """Half height of windows that hold one edge of the beam."""
        return int(np.clip(self.thickness // 2, 2, HALF))


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

    The reference row is the middle of the sticker, or without one the tip itself; ``tip_offset`` is the row of the
    tip at the contact counted from it and ``tip_error`` its standard error; ``tip_source`` says in words where that
    is known from; ``isolated`` that the sticker was all that could be seen of the shaker; ``certain`` that the tip is
    no sticker, by its distance or since its body has no gap down to the border. ``width`` [px] is that of the rod
    behind the tip, and its standard error; NaN where it is not seen.  ``loose`` [px] is by how much the sticker moves
    against the tip, standard deviation; ``turn`` the tangent of the angle by which the camera is turned against rod
    and beam; ``cut`` that a border of the picture cuts the rod, whose middle is not seen.
    """

    rod: tuple[int, int]
    sticker: Sticker | None
    outline: TipOutline
    tip_offset: float
    tip_error: float
    tip_source: str
    isolated: bool
    certain: bool
    width: tuple[float, float]
    loose: float
    turn: float
    cut: bool

    @property
    def mark(self) -> str:
        """Tracked object: "sticker" or "tip"."""
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

    ``misfit`` is the root mean square of what the blurred step leaves of it, share of the contrast; ``gamma`` the
    exponent of grey level over light that makes it symmetric, NaN if the sample is too small; ``shift`` the rows by
    which the fitted edge lies outside that one, ``open`` their standard deviation over the curves that are not excluded
    where none is told; ``clipped`` the share of saturated pixels in the middle of the beam.
    """

    misfit: float
    gamma: float
    gamma_se: float
    shift: float
    open: float
    clipped: float


@dataclass(frozen=True)
class NoiseShape:
    """Correlations of noise with the next pixel in time, ``along`` the beam and ``across`` it; 0 where not told.

    ``rows`` is the standard deviation of what all pixels of a row along the beam have in common, in grey levels, and
    ``fixed_rows`` of the part of it that is the same in every frame.
    """

    in_time: float
    along: float
    across: float
    rows: float
    fixed_rows: float

    @property
    def lag(self) -> float:
        """Frames by which what was averaged over time lags behind."""
        return self.in_time / (1.0 - self.in_time)

    @property
    def factor(self) -> float:
        """Factor between the true errors and those from neighbouring columns, because their noise is correlated."""
        return math.sqrt((1.0 + self.along) / (1.0 - self.along))

    @property
    def made_up(self) -> float:
        """Standard error [px] of an edge in rows that were made of their neighbours, 0.1 px at two rows of one."""
        return _MADE_UP * self.across


@dataclass(frozen=True)
class VideoFields:
    """Signs of interlaced video: differences between odd and even rows.

    The rows lie ``apart`` by a share of the step from frame to frame; ``shift`` [px] is that of every other frame.
    Both are 0 where there is no difference.
    """

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
    def straight(self) -> float:
        """Length across the beam over that along the rows of a picture that is turned."""
        return 1.0 if self.shaker is None else 1.0 / math.sqrt(1.0 + self.shaker.turn**2)

    @property
    def row_errors(self) -> tuple[float, float]:
        """Standard error [px] of an edge by what all pixels of a row have in common, and by the fixed part of it."""
        rows = (self.noise.rows, self.noise.fixed_rows)
        first, second = (edge_noise(self.beam.edge_width, one, self.beam.contrast) if one else 0.0 for one in rows)
        return first, second

    @property
    def placed_error(self) -> float:
        """Standard error [px] of where the tip stands against the beam, the same in all frames.

        At least a fiftieth of a pixel: the tip is round and uneven.  A tip that is followed by its own outline is seen
        through the beam's lens: what the blurred step leaves of an edge is left there several times over.
        """
        if self.shaker is None:
            return 0.0
        lens = _UNEVEN
        if self.shaker.sticker is None and math.isfinite(self.shape.misfit):
            lens = max(_OUTLINE * self.shape.misfit * self.beam.edge_width, _UNEVEN)
        return math.hypot(self.shaker.tip_error, self.beam.thickness_error, lens)


# ----------------------------------------------------------------------------------------------------
# What can be wrong with a frame, as codes with advice.


class FrameFlag(IntFlag):
    """Reasons why a frame gave no measurement, or one to be careful with; several may hold at once.

    A position that could not be measured is NaN and its frame carries the reason.  ``BLUR`` alone leaves the
    position in place: it is the mean over a long exposure.

    Examples
    --------
    >>> from snapbeam import lab
    >>> [each.name for each in lab.FrameFlag][:2]
    ['GAP', 'BLUR']
    """

    OK = 0
    GAP = 1
    BLUR = 2
    DROPPED = 4
    GLARE = 8
    MERGED = 16
    LOW_CONTRAST = 32
    OUT_OF_REGION = 64
    JUMP = 128
    DISTORTED = 256

    @property
    def words(self) -> str:
        """The flags in small letters, with commas between; "measured" if there is none."""
        return ", ".join(str(flag.name).lower().replace("_", " ") for flag in self) or "measured"

    @property
    def advice(self) -> str:
        """Cause and remedy of each flag."""
        return "; ".join(text for flag, text in _ADVICE.items() if flag in self) or "measured"


_ADVICE = {
    FrameFlag.GAP: "an edge was not found; look at the frame (--picture, --frame), narrow region (--region) or set "
    "threshold (--threshold)",
    FrameFlag.BLUR: "the edges are much wider than usual; shorten the exposure or refocus (blur_limit, --blur-limit, "
    "moves the limit)",
    FrameFlag.DROPPED: "the camera lost the frame: it is absent, blank or a repeat of the one before",
    FrameFlag.GLARE: "light saturates the edge; turn the lamp or choose other columns (contact_column, "
    "--contact-column)",
    FrameFlag.MERGED: "beam and shaker touch and the shaker shows no edge of its own; put a sticker on it",
    FrameFlag.LOW_CONTRAST: "the edge is too faint; add light or set objects (--objects) and threshold (--threshold)",
    FrameFlag.OUT_OF_REGION: "the object left the region; make region (--region) taller",
    FrameFlag.JUMP: "the position leaves its neighbours for a frame or few and comes back: something else was taken "
    "for the object; look at the frame (--picture, --frame)",
    FrameFlag.DISTORTED: "the beam looks thicker or thinner than usual, or its edge is no step: light or another "
    "object lies on it; look at the frame (--picture, --frame)",
}
