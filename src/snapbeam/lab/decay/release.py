"""Which part of a record is a free decay: from the release on, below the ceiling, until something disturbs it."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from snapbeam.lab.decay.cycles import Cycles
from snapbeam.lab.signals.flaws import stuck_runs
from snapbeam.lab.signals.signal import SignalSamples

__all__ = ["Ceiling", "Jump", "find_ceiling", "find_jump", "find_release"]

_Array = NDArray[np.float64]
_RISE = 0.3  # share of the greatest swing below which nothing is released yet
_PLATEAU = 0.012  # share by which maxima under a ceiling may fall


class Ceiling(NamedTuple):
    """Tops cut off up to the sample *until*."""

    until: int


class Jump(NamedTuple):
    """A cycle at which a decay jumps: its time [s], and by what share of the amplitude."""

    time: float
    share: float


def find_release(samples: SignalSamples, frequency: float) -> int:
    """First sample of the free decay: where its swing, seen over a period, is the greatest.

    0 where the record begins with it.  The swing is that of the rate of change, so that the deflection before
    a release, a constant, is none.
    """
    width = max(3, round(samples.sampling_frequency / frequency))
    if samples.values.size < 6 * width:
        return 0
    smooth = uniform_filter1d(samples.values, max(1, width // 8))
    rate = np.diff(smooth)
    # a release is a jump too, and must not outweigh the swing behind it
    loud = np.sort(np.abs(rate))[-max(rate.size // 4, 1) :]
    rate = np.clip(rate, -2.0 * float(np.median(loud)), 2.0 * float(np.median(loud)))
    total = np.concatenate([[0.0], np.cumsum(rate**2)])
    swing = np.sqrt((total[width:] - total[:-width]) / width)  # over a period from each sample on
    top = int(np.argmax(swing))
    if top < width // 2 or float(swing[: max(width // 4, 1)].max()) > 0.5 * swing[top]:
        return 0
    low = np.flatnonzero(swing[:top] < _RISE * swing[top])
    if not low.size:
        return 0
    rising = np.flatnonzero(swing[low[-1] : top + 1] >= 0.9 * swing[top])
    begin = int(low[-1] + rising[0])
    # the window may reach over the release: begin where the swing of the next eighth of a period is there too
    short = max(width // 4, 3)
    local = np.sqrt(uniform_filter1d(rate**2, short))
    inside = np.flatnonzero(local[begin : begin + width] > 0.35 * swing[top])
    return begin + (int(inside[0]) if inside.size else 0) + short


def find_ceiling(samples: SignalSamples, frequency: float) -> Ceiling | None:
    """Whether the first cycles of a decay are cut off, and until where.

    Either the record hits its greatest or least value in runs of equal samples, or the maxima of at least four
    cycles stay level, and flat, where the later ones fall.
    """
    values = samples.values
    width = max(4, round(samples.sampling_frequency / frequency))
    until = 0
    for extreme in (values.max(), values.min()):
        runs = [run for run in stuck_runs(values, 3) if values[run.first] == extreme]
        if len(runs) >= 2 and np.ptp(values) > 0.0:
            until = max(until, runs[-1].last)
    if until:
        return Ceiling(min(until + width // 4, values.size))
    for sign in (1.0, -1.0):
        until = max(until, _plateau(sign * (values - np.median(values)), width))
    return Ceiling(min(until + width // 4, values.size)) if until else None


def _plateau(values: _Array, width: int) -> int:
    """End of the cycles whose tops are level and flat; 0 if they are not."""
    count = values.size // width
    if count < 8:
        return 0
    cycles = values[: count * width].reshape(count, width)
    ordered = np.sort(cycles, axis=1)
    tops = ordered[:, -max(width // 12, 1) :].mean(1)  # the mean of the uppermost twelfth
    flat = (cycles > tops[:, None] - 0.04 * tops[0]).mean(1)
    level = np.abs(tops / tops[0] - 1.0) < _PLATEAU
    last = int(np.argmin(level)) if not level.all() else count
    if last < 4 or last > count - 2:
        return 0
    later = tops[last : last + 6]
    falls = later.size >= 2 and later[-1] < tops[0] * (1.0 - 2.0 * _PLATEAU)
    wide = float(np.median(flat[:last])) > 0.16  # 0.12 of a sine's cycle, smeared by the mean
    return last * width if falls and wide else 0


def find_jump(cycles: Cycles) -> Jump | None:
    """The cycle at which amplitude or phase of a mode jumps; None if neither does.

    Straight lines through the logarithm of the amplitude and through the phase of six cycles on either side
    must differ there by more than eight standard errors and by more than eight percent (or 0.08 rad), and more
    than anywhere else; slow changes, as of two modes that beat, bend both sides alike.
    """
    n, span = cycles.time.size, 6
    if n < 2 * span + 2:
        return None
    log_a = np.log(cycles.amplitude)
    # cycles begin at whole samples, so they are not quite evenly spaced: their phase is told against time
    phase = cycles.phase - np.polyval(np.polyfit(cycles.time, cycles.phase, 1), cycles.time)
    x = np.arange(span, dtype=np.float64)
    steps = np.zeros((2, n))
    errors = np.full(n, math.inf)
    for k in range(span, n - span - 1):
        for row, series in enumerate((log_a, phase)):
            left = np.polyfit(x - span, series[k - span : k], 1)
            right = (
                np.polyfit(x + 2.0, series[k + 2 : k + 2 + span][: x.size], 1) if k + 2 + span <= n else None
            )
            if right is None:
                continue
            steps[row, k] = np.polyval(right, 0.5) - np.polyval(left, 0.5)
        relative = cycles.noise / float(np.min(cycles.amplitude[k - span : k + span]))
        errors[k] = relative * math.sqrt(2.0 * (1.0 / span + 12.0 * (0.5 * span + 1.0) ** 2 / span**3))
    size = np.hypot(steps[0], steps[1])
    # what a smooth curve does to the same lines
    usual = 1.4826 * float(np.median(size[size > 0.0])) if (size > 0.0).any() else 0.0
    at = int(np.argmax(size))
    if size[at] < max(8.0 * errors[at], 0.08, 6.0 * usual):
        return None
    return Jump(float(cycles.time[at]), float(size[at]))
