"""When a shaker starts: the likeliest instant, with an interval that is honest for gentle starts.

From the start on the motion is a sine whose amplitude and phase are polynomials of time, of degree 0 to 5;
before it there is rest.  The likelihood of every instant follows from a linear least squares fit; degrees are
weighed by the Bayesian information criterion, so a start that could be a jump or a ramp has the spread of
both.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from snapbeam.lab.signals.signal import SignalSamples
from snapbeam.lab.signals.sine_fit import SineFit

__all__ = ["find_onset", "moves_outside", "moving_part"]

_Array = NDArray[np.float64]
_NOISE_FLOOR = 1e-6
"""Of the amplitude: a record without noise is taken to have this much, or the sums that find its start
would lose it to rounding."""
_DEGREES = (0, 1, 2, 3, 5)
_LONGEST = 4000  # samples that are fitted


def _level(samples: SignalSamples, frequency: float, width: int) -> _Array:
    """Amplitude of the motion at *frequency* over a cycle from each sample on."""
    turn = np.exp(-2j * math.pi * frequency * (samples.time - samples.time[0]))
    total = np.concatenate(([0.0], np.cumsum((samples.values - np.median(samples.values)) * turn)))
    level: _Array = 2.0 * np.abs(total[width:] - total[:-width]) / width
    return level


def moving_part(samples: SignalSamples, frequency: float) -> tuple[int, int]:
    """First and last (exclusive) sample of the longest stretch that oscillates at *frequency*.

    Gaps of less than ten cycles are no end of the motion.
    """
    n = samples.values.size
    width = max(3, round(samples.sampling_frequency / frequency))
    if width >= n:
        return 0, n
    level = _level(samples, frequency, width)
    on = level > 0.3 * np.quantile(level, 0.9)
    bounds = np.flatnonzero(np.diff(np.concatenate(([0], on.astype(np.int8), [0])))).reshape(-1, 2)
    joined = [bounds[0].tolist()]
    for first, last in bounds[1:].tolist():
        if first - joined[-1][1] < 10 * width:
            joined[-1][1] = last
        else:
            joined.append([first, last])
    start, stop = max(joined, key=lambda run: run[1] - run[0])
    return int(start), min(int(stop) + width - 1, n)


def moves_outside(samples: SignalSamples, frequency: float, first: int, last: int) -> float:
    """How long [s] the record oscillates at *frequency* before *first* and after *last*, by a third as much."""
    width = max(3, round(samples.sampling_frequency / frequency))
    if width >= samples.values.size:
        return 0.0
    level = _level(samples, frequency, width)
    on = level > 0.3 * np.quantile(level, 0.9)
    on[max(first - width, 0) : last + width] = False
    return float(np.count_nonzero(on)) / samples.sampling_frequency


def find_onset(samples: SignalSamples, first: int, rough: SineFit) -> tuple[float | None, float]:
    """Time [s] the motion starts and its standard error; None where the record begins in motion.

    Parameters
    ----------
    samples
        The record.
    first
        First sample of the moving part, up to a few cycles off.
    rough
        The steady sine.
    """
    width = round(samples.sampling_frequency / rough.frequency)
    if first < max(8, width // 8):
        return None, 0.0
    early = _quiet_end(samples, first, rough, width)
    quiet = samples.values[: max(early, 8)]
    if early < 8 or float(np.std(quiet)) > 0.35 * rough.amplitude:
        return None, 0.0
    rest = _baseline(samples.time[: quiet.size], quiet)
    noise = max(float(np.std(quiet - rest(samples.time[: quiet.size]))), _NOISE_FLOOR * rough.amplitude)
    begin = max(early - 2 * width, 0)
    end = min(first + 2 * width, samples.values.size)
    every = max(1, (end - begin) // _LONGEST)
    time = samples.time[begin:end:every]
    values = samples.values[begin:end:every] - rest(time)
    if time.size < 16:
        return None, 0.0
    candidates = time[
        (time >= samples.time[max(early - width, 0)]) & (time < time[-1] - 0.7 / rough.frequency)
    ]
    coarse = candidates[:: max(1, candidates.size // 160)]
    scans = [_scan(time, values, coarse, rough.frequency, degree, noise) for degree in _DEGREES]
    step = float(coarse[1] - coarse[0]) if coarse.size > 1 else 1.0 / samples.sampling_frequency
    # once more about the best instants, sample by sample
    best = {float(coarse[int(np.argmin(scan))]) for scan in scans}
    near = np.zeros(candidates.size, dtype=bool)
    for at in best:
        near |= np.abs(candidates - at) <= 2.0 * step
    fine = np.union1d(coarse, candidates[near])
    scans = [_scan(time, values, fine, rough.frequency, degree, noise) for degree in _DEGREES]
    return _weighed(fine, scans, values.size, every / samples.sampling_frequency, width / every)


def _baseline(time: _Array, quiet: _Array) -> np.polynomial.Polynomial:
    """The level at rest, or a straight line where it drifts by more than its noise explains."""
    level = np.polynomial.Polynomial([float(np.median(quiet))])
    if quiet.size < 32:
        return level
    line = np.polynomial.Polynomial.fit(time, quiet, 1)
    left = float(np.std(quiet - line(time)))
    drift = abs(float(line(time[-1]) - line(time[0])))
    return line if drift > 6.0 * left * math.sqrt(12.0 / quiet.size) + 1e-300 else level


def _quiet_end(samples: SignalSamples, first: int, rough: SineFit, width: int) -> int:
    """The last sample before the motion rises out of the noise, at least a cycle before *first*."""
    level = _level(samples, rough.frequency, width)
    sure = max(first - 30 * width, 1)
    noise = (
        1.4826 * float(np.median(level[:sure]))
        if sure > 2 * width
        else float(np.median(level[: max(first - width, 1)]))
    )
    limit = max(3.0 * noise, 0.01 * rough.amplitude)
    below = np.flatnonzero(level[: max(first - width // 4, 1)] < limit)
    return int(below[-1]) if below.size else 0


def _scan(
    time: _Array, values: _Array, starts: _Array, frequency: float, degree: int, noise: float
) -> _Array:
    """Chi-square of a motion that starts at each of *starts*."""
    total = float(values @ values)
    out = np.empty(starts.size)
    omega = 2.0 * math.pi * frequency
    span = float(time[-1] - starts[0])
    for k, start in enumerate(starts):
        after = time >= start - 1e-12
        moved = values[after]
        since = time[after] - start
        turn = np.exp(1j * omega * since)
        powers = (since[:, None] / span) ** np.arange(degree + 1)
        columns = [turn.real[:, None] * powers, turn.imag[:, None] * powers]
        for harmonic in (2, 3):  # distortion is no sign of a start
            higher = turn**harmonic
            columns += [higher.real[:, None] * powers[:, :2], higher.imag[:, None] * powers[:, :2]]
        design = np.concatenate(columns, axis=1)
        gram = design.T @ design
        gram[np.diag_indices_from(gram)] *= 1.0 + 1e-10
        right = design.T @ moved
        explained = float(right @ np.linalg.solve(gram, right))
        out[k] = (total - explained) / noise**2
    return out


def _weighed(
    starts: _Array, scans: list[_Array], count: int, step: float, width: float
) -> tuple[float, float]:
    """Mean instant and its standard error over all instants and degrees.

    What no degree explains is no noise: it is alike over a quarter of a cycle of *width* samples, so it counts
    as so many times fewer samples.
    """
    freedom = max(count - 8, 1)
    least = min(float(scan.min()) for scan in scans)
    unit = max(1.0, least / freedom)
    if unit > 1.0 + 4.0 * math.sqrt(2.0 / freedom):
        unit *= max(0.25 * width, 1.0)
    spacing = np.gradient(starts) if starts.size > 1 else np.ones(1)
    weights = []
    for degree, scan in zip(_DEGREES, scans, strict=True):
        score = (scan - least) / unit + 2.0 * (degree + 1) * math.log(count)
        weights.append(score)
    table = np.array(weights)
    share = np.exp(-0.5 * (table - table.min())) * spacing
    share /= share.sum()
    mean = float((share * starts).sum())
    spread = math.sqrt(float((share * (starts - mean) ** 2).sum()))
    return mean, math.hypot(1.25 * spread, 0.5 * step)  # a quarter more: the likelihood has many hills
