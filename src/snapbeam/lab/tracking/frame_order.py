"""Frames that are lost, or shown twice, located by the motion of striker and beam.

A frame that is lost makes both move two steps in one; a frame shown twice makes both stand still for one.  Five
frames before a place and five after it are fitted with one cubic over time, whose clock runs on evenly, jumps by
the frames that were lost, or stops for a frame.
"""

from __future__ import annotations

import dataclasses
import math
from typing import NamedTuple

import numpy as np

from snapbeam.lab.tracking.edges import Floats
from snapbeam.lab.tracking.measure import TrackedRows
from snapbeam.lab.tracking.settings import FrameFlag

__all__ = ["FrameOrder", "find_order", "without_repeats"]


_HALF = 5  # frames on either side of a place
_DEGREE = 3
_MOST = 3  # frames lost at one place
_BETTER = 36.0  # chi-square by which a clock must be better than one that runs on evenly
_TOUCHING = 3.0  # times as much, where the tip may touch the beam
_FITS = 25.0  # chi-square, of six degrees of freedom, that a fit may leave
_APART = 2.0  # px of gap at which beam and tip move on their own
_LEAST_NOISE = 0.005  # px


class FrameOrder(NamedTuple):
    """Frames shown twice, the frames before which others are ``missing``, and how ``many`` at each."""

    repeated: tuple[int, ...]
    missing: tuple[int, ...]
    many: tuple[int, ...]


def find_order(row: Floats, shaker: Floats, penetration: Floats) -> FrameOrder:
    """Where frames are lost or shown twice.

    Parameters
    ----------
    row, shaker
        Rows [px] of beam and shaker, NaN where unknown.
    penetration
        Of the tip into the beam [px].
    """
    length = 2 * _HALF
    if row.size < 4 * length:
        return FrameOrder((), (), ())
    views = np.lib.stride_tricks.sliding_window_view
    with np.errstate(invalid="ignore"):
        flying = (views(penetration, length) < -_APART).all(1)
    clocks = _clocks()
    gain = np.zeros((clocks.shape[0] - 1, row.size - length + 1))
    followed = np.isfinite(shaker).any()
    for values, own in ((shaker, False), (row, True)):
        noise = _noise(values)
        if not math.isfinite(noise):
            continue
        windows = views(values, length)
        left = np.stack([_left(windows, clock) for clock in clocks]) / noise**2
        better = np.where((left[0] > _FITS) & (left[1:] > _FITS), 0.0, left[0] - left[1:])
        better = np.where(np.isfinite(better), better, 0.0)
        # a beam that may be struck changes its velocity; without a shaker nothing tells when
        better[:, ~flying] = better[:, ~flying] / _TOUCHING if not own or not followed else 0.0
        gain += better
    best = gain.argmax(0)
    size = gain.max(0)
    repeated, missing, many = [], [], []
    while size.max() > _BETTER:
        at = int(size.argmax())
        if best[at] == 0:
            repeated.append(at + _HALF)
        else:
            missing.append(at + _HALF)
            many.append(int(best[at]))
        size[max(at - _HALF + 1, 0) : at + _HALF] = 0.0
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


def _clocks() -> Floats:
    """Times of the ten frames: even, with the sixth as the fifth, and with up to three lost before the sixth."""
    even = np.arange(2.0 * _HALF) - _HALF + 0.5
    twice = even.copy()
    twice[_HALF] = even[_HALF - 1]
    late = [even + count * (np.arange(2 * _HALF) >= _HALF) for count in range(1, _MOST + 1)]
    return np.stack([even, twice, *late])


def _left(windows: Floats, clock: Floats) -> Floats:
    """Sum of squares that a cubic over *clock* leaves of each window."""
    basis = np.linalg.qr(np.vander(clock - clock.mean(), _DEGREE + 1))[0]
    left: Floats = ((windows - (windows @ basis) @ basis.T) ** 2).sum(1)
    return left


def _noise(values: Floats) -> float:
    """Standard deviation of a row about a smooth motion, from its fourth differences."""
    bends = np.diff(values, 4)
    bends = bends[np.isfinite(bends)]
    if bends.size < 4 * _HALF:
        return math.nan
    return max(1.4826 * float(np.median(np.abs(bends))) / math.sqrt(70.0), _LEAST_NOISE)
