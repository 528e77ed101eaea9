"""Frames that are lost, or shown twice, located by the motion of striker and beam.

A frame that is lost makes both move two steps in one; a frame shown twice makes both stand still for one.  Some
frames before a place and as many after it are fitted with one polynomial over time, whose clock runs on evenly, jumps
by the frames that were lost, or stops for a frame.  The striker moves smoothly, so more frames tell more of it.  With
an even clock the motion may also bend faster, or change its velocity about the place as a body does that is struck or
starts; a place counts only if no such motion, and no fit over more frames, explains it as well.
"""

from __future__ import annotations

import dataclasses
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.lab.tracking.edges import Floats
from snapbeam.lab.tracking.measure import TrackedRows
from snapbeam.lab.tracking.settings import FrameFlag

_HALVES = (5, 8, 12)  # frames on either side of a place; of the beam the first
_DEGREES = (3, 5)
_BENDS = 7  # degree of a motion over many frames with an even clock
_STRUCK = np.arange(-2.0, 2.1, 0.5)  # frames about a place, at which a body may be struck
_MOST = 3  # frames lost at one place
_BETTER = 50.0  # chi-square by which a clock must be better than one that runs on evenly
_FURTHER = 15.0  # the same, in a recording in which one place is known
_PARAMETER = 3.0  # chi-square that a parameter more of the motion must explain
_SPREADS = 5.5  # standard deviations of chi-square that a fit may leave beyond its degrees of freedom
_LEAST_NOISE = 0.005  # px


class FrameOrder(NamedTuple):
    """Frames shown twice, the frames before which others are ``missing``, and how ``many`` at each.

    ``clock`` holds kinds and numbers of what the drive shows beside (:mod:`~snapbeam.lab.tracking.drive_clock`).
    """

    repeated: tuple[int, ...]
    missing: tuple[int, ...]
    many: tuple[int, ...]
    clock: tuple[tuple[str, dict[str, float]], ...] = ()


def find_order(row: Floats, shaker: Floats) -> FrameOrder:
    """Detect lost and repeated frames from the rows [px] of beam and shaker, NaN where unknown."""
    if row.size < 4 * _HALVES[-1]:
        return FrameOrder((), (), ())
    beam = _better(row, _HALVES[0])
    gain = np.max([beam + _better(shaker, half) for half in _HALVES], axis=0)
    for values in (row, shaker):
        gain[_contradicted(values)] = 0.0
    best = gain.argmax(0)
    size = gain.max(0)
    repeated: list[int] = []
    missing: list[int] = []
    many: list[int] = []
    while size.max() > (_FURTHER if repeated or missing else _BETTER):
        at = int(size.argmax())
        if best[at] == 0:
            repeated.append(at)
        else:
            missing.append(at)
            many.append(int(best[at]))
        size[max(at - _HALVES[0] + 1, 0) : at + _HALVES[0]] = 0.0
    order = np.argsort(missing)
    return FrameOrder(tuple(sorted(repeated)), tuple(missing[k] for k in order), tuple(many[k] for k in order))


def without_repeats(rows: TrackedRows, order: FrameOrder) -> TrackedRows:
    """The rows without those of frames shown twice, which are flagged as lost."""
    if not order.repeated:
        return rows
    at = list(order.repeated)
    changed = {}
    for name in ("row", "error", "slope", "shaker", "shaker_error"):
        changed[name] = getattr(rows, name).copy()
        changed[name][at] = np.nan
    flags, confidence = rows.flags.copy(), rows.confidence.copy()
    flags[at] |= np.uint16(FrameFlag.DROPPED)
    confidence[at] = 0.0
    return dataclasses.replace(rows, flags=flags, confidence=confidence, **changed)


def _better(values: Floats, half: int) -> Floats:
    """Chi-square by which each clock is better than an even one, before each frame.

    With the even one the motion may also turn faster (a higher degree), or change its velocity about the place as a
    body does that is struck or starts; each parameter more costs :data:`_PARAMETER`.
    """
    out = np.zeros((_MOST + 1, values.size))
    noise = _noise(values)
    if not math.isfinite(noise):
        return out
    windows = np.lib.stride_tricks.sliding_window_view(values, 2 * half)
    even, *others = _clocks(half)
    fits = _good(half, _DEGREES[0])

    def least(designs: list[Floats]) -> Floats:
        costs = [_PARAMETER * (design.shape[1] - _DEGREES[0] - 1) for design in designs]
        left = [_left(windows, one) / noise**2 + cost for one, cost in zip(designs, costs, strict=True)]
        return np.min(left, axis=0)

    left = np.stack([least([_powers(clock, degree) for degree in _DEGREES]) for clock in others])
    struck = [np.maximum(even - at, 0.0) for at in _STRUCK]
    smooth = [_powers(even, degree) for degree in _DEGREES]
    smooth += [_powers(even, _BENDS)] * (half > _HALVES[0])
    best = least([*smooth, *(np.column_stack([smooth[0], hinge]) for hinge in struck)])
    better = np.where((best > fits) & (left > fits), 0.0, best - left)
    out[:, half : half + better.shape[1]] = np.where(np.isfinite(better), better, 0.0)
    return out


def _contradicted(values: Floats) -> NDArray[np.bool_]:
    """Clocks with which a fit before each frame is not good, and is with the even one."""
    out = np.zeros((_MOST + 1, values.size), dtype=bool)
    noise = _noise(values)
    if not math.isfinite(noise):
        return out
    for half in _HALVES:
        windows = np.lib.stride_tricks.sliding_window_view(values, 2 * half)
        for degree in _DEGREES:
            left = np.stack([_left(windows, _powers(clock, degree)) for clock in _clocks(half)]) / noise**2
            fits = _good(half, degree)
            with np.errstate(invalid="ignore"):
                out[:, half : half + left.shape[1]] |= (left[0] <= fits) & (left[1:] > fits)
    return out


def _good(half: int, degree: int) -> float:
    """Chi-square up to which a fit is good."""
    freedom = 2.0 * half - degree - 1.0
    return freedom + _SPREADS * math.sqrt(2.0 * freedom)


def _clocks(half: int) -> Floats:
    """Times of the frames: even, with the first after the middle as the one before, with up to three lost there."""
    even = np.arange(2.0 * half) - half + 0.5
    twice = even.copy()
    twice[half] = even[half - 1]
    late = [even + count * (np.arange(2 * half) >= half) for count in range(1, _MOST + 1)]
    return np.stack([even, twice, *late])


def _powers(clock: Floats, degree: int) -> Floats:
    return np.vander((clock - clock.mean()) / clock.size, degree + 1)


def _left(windows: Floats, design: Floats) -> Floats:
    """Sum of squares that the columns of *design* leave of each window."""
    basis = np.linalg.qr(design)[0]
    left: Floats = ((windows - (windows @ basis) @ basis.T) ** 2).sum(1)
    return left


def _noise(values: Floats) -> float:
    """Standard deviation of a row about a smooth motion, from its fourth differences."""
    bends = np.diff(values, 4)
    bends = bends[np.isfinite(bends)]
    if bends.size < 4 * _HALVES[0]:
        return math.nan
    # the quarter, which many frames out of order do not move; of normal noise it is 0.3186
    return max(float(np.percentile(np.abs(bends), 25.0)) / 0.3186 / math.sqrt(70.0), _LEAST_NOISE)
