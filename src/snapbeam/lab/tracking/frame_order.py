"""Frames that are lost, shown twice or exchanged, and jumps of the picture, located by the motion of striker and beam.

A frame that is lost makes both move two steps in one; a frame shown twice makes both stand still for one.  Some
frames before a place and as many after it are fitted with one polynomial over time, whose clock runs on evenly, jumps
by the frames that were lost, stops for a frame, or shows two in the wrong order; or the rows of both jump there, alike
where the camera was knocked.  The striker moves smoothly, so more frames tell more of it.  With an even clock the
motion may also bend faster, or change its velocity about the place as a body does that is struck or starts; a place
counts only if no such motion, and no fit over more frames, explains it as well.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.lab.tracking.edges import Floats
from snapbeam.lab.tracking.measure import TrackedRows
from snapbeam.lab.tracking.settings import FrameFlag
from snapbeam.util.singular_values import lstsq

_HALVES = (5, 8, 12)  # frames on either side of a place; of the beam the first
_DEGREES = (3, 5)
_BENDS = 7  # degree of a motion over many frames with an even clock
_STRUCK = np.arange(-2.0, 2.1, 0.5)  # frames about a place, at which a body may be struck
_MOST = 3  # frames lost at one place
_EXCHANGED, _STEP = _MOST + 1, _MOST + 2  # rows of gains after those of frames shown twice and lost
_SAME = 5.0  # standard errors by which two steps may differ and be one
_BETTER = 50.0  # chi-square by which a clock must be better than one that runs on evenly
_FURTHER = 15.0  # the same, in a recording in which one place is known
_SURER = 15.0  # chi-square by which a jump of the rows must explain more than a clock, which has no size of its own
_PIXELS = 0.3  # that a jump is at least
_PARAMETER = 3.0  # chi-square that a parameter more of the motion must explain
_SPREADS = 5.5  # standard deviations of chi-square that a fit may leave beyond its degrees of freedom
_LEAST_NOISE = 0.005  # px


class FrameOrder(NamedTuple):
    """Frames shown twice, the frames before which others are ``missing``, and how ``many`` at each.

    ``clock`` holds kinds and numbers of what else is wrong, by the drive (:mod:`~snapbeam.lab.tracking.drive_clock`) or
    by the motion about a place.
    """

    repeated: tuple[int, ...]
    missing: tuple[int, ...]
    many: tuple[int, ...]
    clock: tuple[tuple[str, dict[str, float]], ...] = ()


def find_order(row: Floats, shaker: Floats) -> FrameOrder:
    """Detect lost, repeated and exchanged frames and jumps from the rows [px] of beam and shaker, NaN where unknown."""
    if row.size < 4 * _HALVES[-1]:
        return FrameOrder((), (), ())
    beam = _better(row, _HALVES[0])
    striker = [_better(shaker, half) for half in _HALVES]
    # a jump of the striker alone, whose edge is found elsewhere where it touches, looks as a lost frame
    own = np.where(beam > 0.0, 0.0, 1.0)[:_STEP]
    gain = np.max(
        [beam + one - np.vstack([own * np.maximum(one[_STEP], 0.0), np.zeros_like(row)]) for one in striker], axis=0
    )
    # of a body alone an edge may be found elsewhere; a jump of the picture or of the time shows in both
    most = np.max([one[_STEP] for one in striker], axis=0)
    gain[_STEP] = np.where(np.minimum(beam[_STEP], most) > _FURTHER, gain[_STEP] - _SURER, 0.0)
    for values in (row, shaker):
        gain[_contradicted(values)] = 0.0
    best = gain.argmax(0)
    size = gain.max(0)
    places: dict[int, list[int]] = {}
    while size.max() > (_FURTHER if places.keys() - {_STEP} else _BETTER):
        at = int(size.argmax())
        places.setdefault(int(best[at]), []).append(at)
        size[max(at - _HALVES[0] + 1, 0) : at + _HALVES[0]] = 0.0
    missing = sorted((at, count) for count in range(1, _MOST + 1) for at in places.get(count, []))
    clock: list[tuple[str, dict[str, float]]] = []
    if _EXCHANGED in places:
        swapped = places[_EXCHANGED]
        clock.append(("frames_exchanged", {"frames": len(swapped), "first": min(swapped) - 1}))
    for at in sorted(places.get(_STEP, [])):
        half = _HALVES[int(np.argmax([one[_STEP, at] for one in striker]))]
        (first, error), (second, other) = _step(row, at, _HALVES[0]), _step(shaker, at, half)
        alike = abs(first - second) < _SAME * math.hypot(error, other)
        if min(abs(first), abs(second)) > _PIXELS and alike:
            clock.append(("knocked", {"first": at, "size": abs(second)}))
        elif max(abs(first), abs(second)) > _PIXELS:
            clock.append(("jump", {"first": at, "beam": first, "striker": second}))
    lost = tuple(at for at, _ in missing), tuple(count for _, count in missing)
    return FrameOrder(tuple(sorted(places.get(0, []))), *lost, tuple(clock))


def without_repeats(rows: TrackedRows, order: FrameOrder) -> TrackedRows:
    """The rows without those of frames shown twice, which are flagged as lost."""
    if not order.repeated:
        return rows
    again = np.isin(np.arange(rows.row.size), order.repeated)
    names = ("row", "error", "slope", "shaker", "shaker_error")
    changed: dict[str, Any] = {name: np.where(again, np.nan, getattr(rows, name)) for name in names}
    flags = np.where(again, rows.flags | np.uint16(FrameFlag.DROPPED), rows.flags)
    return dataclasses.replace(rows, flags=flags, confidence=np.where(again, 0.0, rows.confidence), **changed)


def _better(values: Floats, half: int) -> Floats:
    """Chi-square by which each clock is better than an even one, before each frame.

    With the even one the motion may also turn faster (a higher degree), or change its velocity about the place as a
    body does that is struck or starts; each parameter more costs :data:`_PARAMETER`.
    """
    out = np.zeros((_STEP + 1, values.size))
    noise = _noise(values)
    if not math.isfinite(noise):
        return out
    windows = np.lib.stride_tricks.sliding_window_view(values, 2 * half)
    even = np.arange(2.0 * half)
    fits = _good(half, _DEGREES[0])

    def least(designs: Sequence[Floats]) -> Floats:
        costs = [_PARAMETER * (design.shape[1] - _DEGREES[0] - 1) for design in designs]
        left = [_left(windows, one) / noise**2 + cost for one, cost in zip(designs, costs, strict=True)]
        return np.min(left, axis=0)

    smooth, *others = zip(*(_designs(half, degree) for degree in _DEGREES), strict=True)
    left = np.stack([least(designs) for designs in others])
    struck = [np.maximum(even - half + 0.5 - at, 0.0) for at in _STRUCK]
    bends = [_powers(even, _BENDS)] * (half > _HALVES[0])
    best = least([*smooth, *bends, *(np.column_stack([smooth[0], hinge]) for hinge in struck)])
    better = np.where((best > fits) & (left > fits), 0.0, best - left)
    out[:, half : half + better.shape[1]] = np.where(np.isfinite(better), better, 0.0)
    return out


def _contradicted(values: Floats) -> NDArray[np.bool_]:
    """Clocks with which a fit before each frame is not good, and is with the even one."""
    out = np.zeros((_STEP + 1, values.size), dtype=bool)
    noise = _noise(values)
    if not math.isfinite(noise):
        return out
    for half in _HALVES:
        windows = np.lib.stride_tricks.sliding_window_view(values, 2 * half)
        for degree in _DEGREES:
            left = np.stack([_left(windows, design) for design in _designs(half, degree)]) / noise**2
            fits = _good(half, degree)
            with np.errstate(invalid="ignore"):
                out[:, half : half + left.shape[1]] |= (left[0] <= fits) & (left[1:] > fits)
    return out


def _good(half: int, degree: int) -> float:
    """Chi-square up to which a fit is good."""
    freedom = 2.0 * half - degree - 1.0
    return freedom + _SPREADS * math.sqrt(2.0 * freedom)


def _designs(half: int, degree: int) -> list[Floats]:
    """Motions about a place: with an even clock, a frame shown twice, up to three lost, two exchanged, and a jump."""
    even = np.arange(2.0 * half) - half + 0.5
    twice, turned = even.copy(), even.copy()
    twice[half] = even[half - 1]
    turned[half - 1 : half + 1] = even[[half, half - 1]]
    after = even > 0.0
    late = [even + count * after for count in range(1, _MOST + 1)]
    designs = [_powers(clock, degree) for clock in (even, twice, *late, turned)]
    return [*designs, np.column_stack([designs[0], after])]


def _step(values: Floats, at: int, half: int) -> tuple[float, float]:
    """Jump [px] of a row at a frame, and its standard error."""
    weights = lstsq(_designs(half, _DEGREES[0])[-1], np.eye(2 * half))[-1]
    return float(weights @ values[at - half : at + half]), _noise(values) * float(np.linalg.norm(weights))


def _powers(clock: Floats, degree: int) -> Floats:
    return np.vander((clock - clock.mean()) / clock.size, degree + 1)


def _left(windows: Floats, design: Floats) -> Floats:
    """Sum of squares that the columns of *design* leave of each window."""
    basis = np.linalg.qr(design)[0]
    return np.asarray(((windows - (windows @ basis) @ basis.T) ** 2).sum(1))


def _noise(values: Floats) -> float:
    """Standard deviation of a row about a smooth motion, from its fourth differences."""
    bends = np.diff(values, 4)
    bends = bends[np.isfinite(bends)]
    if bends.size < 4 * _HALVES[0]:
        return math.nan
    # the quarter, which many frames out of order do not move; of normal noise it is 0.3186
    return max(float(np.percentile(np.abs(bends), 25.0)) / 0.3186 / math.sqrt(70.0), _LEAST_NOISE)
