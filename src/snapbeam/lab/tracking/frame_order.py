"""Frames that are lost, or shown twice, located by the motion of striker and beam.

A frame that is lost makes both move two steps in one; a frame shown twice makes both stand still for one.  Some
frames before a place and as many after it are fitted with one polynomial over time, whose clock runs on evenly, jumps by
the frames that were lost, or stops for a frame.  The striker moves smoothly, so more frames tell more of it.  Where
the motion turns back, a cubic over few frames may be too stiff and a jump of the clock makes up for it: a place
counts only if no other fit, over more frames or of a higher degree, is good with the even clock alone.
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

__all__ = ["FrameOrder", "find_order", "without_repeats"]


_HALVES = (5, 8, 12)  # frames on either side of a place; of the beam the first
_DEGREES = (3, 5)
_MOST = 3  # frames lost at one place
_BETTER = 30.0  # chi-square by which a clock must be better than one that runs on evenly
_TOUCHING = 3.0  # times as much, where the tip may touch the beam
_SPREADS = 5.5  # standard deviations of chi-square that a fit may leave beyond its degrees of freedom
_APART = 2.0  # px of gap at which beam and tip move on their own
_LEAST_NOISE = 0.005  # px


class FrameOrder(NamedTuple):
    """Frames shown twice, the frames before which others are ``missing``, and how ``many`` at each.

    ``clock`` holds kinds and numbers of what the drive shows beside (:mod:`~snapbeam.lab.tracking.drive_clock`).
    """

    repeated: tuple[int, ...]
    missing: tuple[int, ...]
    many: tuple[int, ...]
    clock: tuple[tuple[str, dict[str, float]], ...] = ()


def find_order(row: Floats, shaker: Floats, penetration: Floats) -> FrameOrder:
    """Detect lost and repeated frames.

    Parameters
    ----------
    row, shaker
        Rows [px] of beam and shaker, NaN where unknown.
    penetration
        Of the tip into the beam [px].
    """
    if row.size < 4 * _HALVES[-1]:
        return FrameOrder((), (), ())
    followed = bool(np.isfinite(shaker).any())
    # a beam that may be struck changes its velocity; without a shaker nothing tells when
    beam = _better(row, penetration, _HALVES[0], _DEGREES[0], 0.0 if followed else 1.0 / _TOUCHING)
    gain = np.max(
        [
            beam + _better(shaker, penetration, half, degree, 1.0 / _TOUCHING)
            for half in _HALVES
            for degree in _DEGREES
        ],
        axis=0,
    )
    for values in (row, shaker):
        gain[_contradicted(values)] = 0.0
    best = gain.argmax(0)
    size = gain.max(0)
    repeated, missing, many = [], [], []
    while size.max() > _BETTER:
        at = int(size.argmax())
        if best[at] == 0:
            repeated.append(at)
        else:
            missing.append(at)
            many.append(int(best[at]))
        size[max(at - _HALVES[0] + 1, 0) : at + _HALVES[0]] = 0.0
    order = np.argsort(missing)
    return FrameOrder(
        tuple(sorted(repeated)), tuple(missing[k] for k in order), tuple(many[k] for k in order)
    )


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


def _better(values: Floats, penetration: Floats, half: int, degree: int, touching: float) -> Floats:
    """Chi-square by which each clock is better than an even one, before each frame.

    *touching* is the share of it that counts where the tip may touch the beam.
    """
    out = np.zeros((_MOST + 1, values.size))
    noise = _noise(values)
    if not math.isfinite(noise):
        return out
    views = np.lib.stride_tricks.sliding_window_view
    windows = views(values, 2 * half)
    left = np.stack([_left(windows, clock, degree) for clock in _clocks(half)]) / noise**2
    fits = _good(half, degree)
    better = np.where((left[0] > fits) & (left[1:] > fits), 0.0, left[0] - left[1:])
    with np.errstate(invalid="ignore"):
        flying = (views(penetration, 2 * half) < -_APART).all(1)
    better *= np.where(flying, 1.0, touching)
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
            left = np.stack([_left(windows, clock, degree) for clock in _clocks(half)]) / noise**2
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


def _left(windows: Floats, clock: Floats, degree: int) -> Floats:
    """Sum of squares that a polynomial over *clock* leaves of each window."""
    middle = (clock - clock.mean()) / clock.size
    basis = np.linalg.qr(np.vander(middle, degree + 1))[0]
    left: Floats = ((windows - (windows @ basis) @ basis.T) ** 2).sum(1)
    return left


def _noise(values: Floats) -> float:
    """Standard deviation of a row about a smooth motion, from its fourth differences."""
    bends = np.diff(values, 4)
    bends = bends[np.isfinite(bends)]
    if bends.size < 4 * _HALVES[0]:
        return math.nan
    return max(1.4826 * float(np.median(np.abs(bends))) / math.sqrt(70.0), _LEAST_NOISE)
