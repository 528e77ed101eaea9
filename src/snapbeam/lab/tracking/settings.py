"""How a recording is to be tracked: every choice in one frozen value, checked when it is made."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from snapbeam.core.validate import (
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
from snapbeam.lab.tracking.geometry import SIDES, Orientation

__all__ = ["TrackingSettings"]


@dataclass(frozen=True, kw_only=True, eq=False)
class TrackingSettings:
    """What a person knows of a recording, and how to look at it.

    Attributes
    ----------
    buckling_level
        b [m].  If given, displacements are also returned in units of b.
    location
        Location x_s/L of the contact, which sets the displacement of the beam at rest.
    rest_displacement
        Displacement of the beam [m] at rest, the one length a camera cannot know.
        Unless given, the well that faces the shaker: -(b/2)(1 - cos 2 pi x_s/L), of opposite sign for a
        shaker above; 0 without ``buckling_level``.
    rest_frames
        Frames in which the beam is at rest: how many at the start, or (first, one past the last), negative
        numbers counted from the end.  Unless given, the first half of those before it first departs from
        their mean by three standard errors.
    beam_thickness
        Thickness of the beam as measured with a gauge [m], to check what was found and the pixel size.
    side
        Side of the beam on which the shaker stands: "below", "above", "left" or "right".  Up (or right) is
        positive.
    objects
        "bright" or "dark" against the background, or "auto": unlike the rows beyond the beam.
    threshold
        Grey level for binarising; Otsu's from the sample unless given.
    background : array of shape (height, width), optional
        A picture of the scene without beam and shaker, to subtract.
    gamma
        Exponent of grey level over light, to be undone; 1 for a linear camera.
    shaker, marker
        Whether to follow the shaker, and whether to look for a sticker on it.
    tip_distance
        Distance from the shaker's tip to the nearer edge of its sticker [m]; found from the picture, or
        from the contact at rest, unless given.
    columns
        Columns in which the beam's edge is fitted.
    contact_column
        Column of the contact (or row, for a shaker at the left or right); found from the tip unless given.
    blur_limit
        Edge width [px] beyond which a frame is flagged as blurred; 2.5 times the usual plus 0.5 unless given.
    fixed_marks
        Parts of the picture, each (first row, last row + 1, first column, last column + 1), that show
        something which stands still; their motion is the camera's and is taken out.
    """

    buckling_level: float | None = None
    location: float = 0.5
    rest_displacement: float | None = None
    rest_frames: int | tuple[int, int] | None = None
    beam_thickness: float | None = None
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
        for name, unit in (("buckling_level", "m"), ("beam_thickness", "m"), ("blur_limit", "px")):
            self._keep(name, lambda value, name=name, unit=unit: positive(name, value, unit))
        for name in ("rest_displacement", "threshold"):
            self._keep(name, lambda value, name=name: finite(name, value))
        self._keep("tip_distance", lambda value: within("tip_distance", value, 0.0, 0.1, closed="left"))
        self._keep("location", lambda value: within("location", value, 0.0, 1.0))
        self._keep("gamma", lambda value: within("gamma", value, 0.1, 10.0))
        self._keep("columns", lambda value: integer("columns", value, 3, 1000))
        self._keep("background", lambda value: finite_array("background", value, 2))
        choice("side", self.side, SIDES)
        choice("objects", self.objects, ("auto", "bright", "dark"))
        for name in ("shaker", "marker"):
            flag(name, getattr(self, name))
        if isinstance(self.rest_frames, (tuple, list)):
            if len(self.rest_frames) != 2:
                raise InputError(f"rest_frames = {self.rest_frames!r}: must be a number or (first, last + 1)")
            pair = tuple(integer(f"rest_frames[{i}]", v, -(2**40)) for i, v in enumerate(self.rest_frames))
            object.__setattr__(self, "rest_frames", pair)
        else:
            self._keep("rest_frames", lambda value: integer("rest_frames", value, 1))
        if not isinstance(self.fixed_marks, (tuple, list)):
            raise InputTypeError(f"fixed_marks = {shown(self.fixed_marks)}: must be a list of marks")
        object.__setattr__(self, "fixed_marks", tuple(_mark(i, m) for i, m in enumerate(self.fixed_marks)))

    def _keep(self, name: str, check: Any) -> None:
        """Replace a value that was given by what *check* makes of it."""
        value = getattr(self, name)
        if value is not None:
            object.__setattr__(self, name, check(value))

    def changed(self, **changes: Any) -> TrackingSettings:
        """These settings with some changed, by name.

        Raises
        ------
        InputError
            For a name that is no setting.
        """
        for name in changes:
            choice("setting", name, tuple(field.name for field in dataclasses.fields(self)))
        return dataclasses.replace(self, **changes)

    def checked_for(self, shape: tuple[int, int], frames: int) -> TrackingSettings:
        """These settings, if they fit a recording of *frames* frames of *shape*.

        Raises
        ------
        InputError
            For a background of another shape, or frames, columns or marks outside the recording.
        """
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
            raise InputError(
                f"rest_frames = {self.rest_frames}: must be (first, last + 1) within the {frames} frames"
            )
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


def _mark(number: int, value: Any) -> tuple[int, ...]:
    if isinstance(value, (str, bytes)) or not hasattr(value, "__len__") or len(value) != 4:
        raise InputError(
            f"fixed_marks[{number}] = {value!r}: must be (first row, last row + 1, first column, last column + 1)"
        )
    return tuple(integer(f"fixed_marks[{number}][{i}]", one, 0) for i, one in enumerate(value))
