"""Regions of a recording in which a beam can be tracked, for the picture and the advice where tracking failed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from snapbeam.lab.camera import Recording
from snapbeam.lab.tracking.settings import Orientation, TrackingSettings
from snapbeam.lab.tracking.survey import longest_stretch, otsu, survey
from snapbeam.util.validation import InputError

_FRAMES = 16
_SPECKLE = 7  # px over which dark spots of a textured surface are filled
_MARGIN = 8  # rows
_CROSSES = 0.3  # share of the columns that a beam crosses


class FirstLook(NamedTuple):
    """Binarisation ``level``, whether objects are ``bright``, and ``options`` of each region (in the full frame)."""

    level: float
    bright: bool
    options: dict[tuple[int, int, int, int], str]


def first_look(recording: Recording, settings: TrackingSettings) -> FirstLook:
    """Regions with one object that crosses them, and the options of ``snapbeam track`` with which it is found there.

    Dark spots of a textured surface are filled before the objects are separated; the threshold given for such a region
    lies between the background and these spots.
    """
    turn = Orientation(settings.side, recording.shape)
    chosen = np.unique(np.linspace(0, len(recording) - 1, min(len(recording), _FRAMES)).astype(int))
    frames = turn.turn(np.stack([recording.frame(int(k)) for k in chosen])).astype(np.float32)
    smooth = ndimage.uniform_filter(frames, size=(0, 3, 3))
    level = otsu(smooth) if settings.threshold is None else settings.threshold
    bright = bool(np.median(smooth) < level) if settings.objects == "auto" else settings.objects == "bright"
    sign = 1.0 if bright else -1.0
    filled = ndimage.grey_closing(sign * smooth, size=(1, _SPECKLE, _SPECKLE))
    solid = filled > (otsu(filled) if settings.threshold is None else sign * level)
    found: dict[tuple[int, int, int, int], str] = {}
    labels, count = ndimage.label(solid.mean(0) > 0.2)
    for rows, columns in ndimage.find_objects(labels, count):
        top, bottom = max(rows.start - _MARGIN, 0), min(rows.stop + _MARGIN, solid.shape[1])
        part = solid[:, top:bottom, columns]
        edges = np.diff(part.astype(np.int8), axis=1, prepend=0)
        first, last = longest_stretch(((edges == 1).sum(1) == 1).mean(0) > 0.8)
        left, right = columns.start + first, columns.start + last
        if right - left < max(_CROSSES * solid.shape[2], 16):
            continue
        band = np.flatnonzero(part[:, :, first:last].mean((0, 2)) > 0.2)
        top, bottom = max(top + band[0] - _MARGIN, 0), min(top + band[-1] + 1 + _MARGIN, solid.shape[1])
        inner = smooth[:, top:bottom, left:right]
        around, body = _levels(sign * inner, solid[:, top:bottom, left:right])
        threshold = settings.threshold
        if threshold is None and around < body < sign * otsu(inner):
            threshold = float(f"{sign * 0.5 * (around + body):.3g}")
        option = _tried(frames[:, top:bottom, left:right], settings.changed(threshold=threshold), recording)
        if option is None:
            continue
        ends_of_rows, ends_of_columns = turn.back(np.array([top, bottom - 1.0]), np.array([left, right - 1.0]))
        first, last, left, right = (
            int(end) + start
            for ends, start in ((ends_of_rows, recording.region[0]), (ends_of_columns, recording.region[2]))
            for end in (ends.min(), ends.max() + 1)
        )
        given = f" --threshold {threshold:g}" if threshold is not None else ""
        found[first, last, left, right] = f"--region {first}:{last},{left}:{right}{given}{option}"
    return FirstLook(level, bright, found)


def _levels(inner: NDArray[np.floating], solid: NDArray[np.bool_]) -> tuple[float, float]:
    """Level above nearly all of the background, and below nearly all spots of the object, away from its border."""
    body = ndimage.binary_erosion(solid, np.ones((1, 5, 5)))
    beyond = ~ndimage.binary_dilation(solid, np.ones((1, 5, 5)))
    if not body.any() or not beyond.any():
        return 0.0, 0.0
    return float(np.percentile(inner[beyond], 99.0)), float(np.percentile(inner[body], 1.0))


def _tried(frames: NDArray[np.floating], settings: TrackingSettings, recording: Recording) -> str | None:
    """Options with which the beam is found in turned frames of a region; None if it is not."""
    ways = {"": settings.shaker} if not settings.shaker else {"": True, " --no-shaker": False}
    for option, shaker in ways.items():
        try:
            survey(
                frames,
                settings.changed(shaker=shaker, contact_column=None),
                saturated=float(recording.max_value),
                pixel_size=recording.pixel_size,
                head=1,
            )
        except InputError:
            continue
        return option
    return None
