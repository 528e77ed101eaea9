"""Decay from cycle to cycle: the logarithmic decrement and the analytic signal (Hilbert transform).

Both give an amplitude and a phase for each cycle of a filtered mode, with known noise; two weighted linear
regressions, of log amplitude and of phase against the law of ``decay_model``, do the rest.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.validate import InputError
from snapbeam.lab.decay.model import ModeEstimate, law_priors
from snapbeam.lab.signals.signal import SignalSamples

__all__ = ["Cycles", "backbone", "hilbert_cycles", "noise_level", "peak_cycles", "regress"]

_Array = NDArray[np.float64]
_LOWEST = 4.0  # least amplitude of a usable cycle, in standard deviations of its noise


class Cycles(NamedTuple):
    """Amplitude and unwrapped phase at ``time``, one entry a cycle, and the noise of the amplitude."""

    time: _Array
    amplitude: _Array
    phase: _Array
    noise: float


def noise_level(samples: SignalSamples) -> float:
    """Standard deviation of white noise in a signal, from the top third of its spectrum (median power)."""
    values = (samples.values - samples.values.mean()) * np.hanning(samples.values.size)
    power = np.abs(np.fft.rfft(values)) ** 2 / np.sum(np.hanning(values.size) ** 2)
    top = power[2 * power.size // 3 : -1]
    return float(np.sqrt(np.median(top) / math.log(2.0)))


def _band(samples: SignalSamples, frequency: float) -> _Array:
    """The part of a signal between 0.5 and 1.5 times *frequency*, without phase shift."""
    from scipy.signal import butter, sosfiltfilt

    high = min(1.5 * frequency, 0.49 * samples.sampling_frequency)
    sections = butter(3, (0.5 * frequency, high), "bandpass", fs=samples.sampling_frequency, output="sos")
    pad = min(samples.values.size - 1, int(3 * samples.sampling_frequency / frequency))
    filtered: _Array = sosfiltfilt(sections, samples.values - samples.values.mean(), padlen=pad)
    return filtered


def hilbert_cycles(samples: SignalSamples, frequency: float, sigma: float) -> Cycles:
    """Amplitude and phase of each cycle from the analytic signal, averaged over one period of *frequency*.

    Three cycles at either end, which the filter and the transform distort, are left out.
    """
    from scipy.signal import hilbert

    n = samples.values.size
    width = samples.sampling_frequency / frequency
    turn = np.exp(-2j * math.pi * frequency * (samples.time - samples.time[0]))
    slow = hilbert(_band(samples, frequency)) * turn
    count = int((n - 1) / width)
    borders = np.round(np.arange(count + 1) * width).astype(np.int64)
    sums = np.concatenate(([0.0], np.cumsum(slow)))
    mean = (sums[borders[1:]] - sums[borders[:-1]]) / np.diff(borders)
    middle = samples.time[0] + (borders[1:] + borders[:-1] - 1) / (2.0 * samples.sampling_frequency)
    phase = np.unwrap(np.angle(mean)) + 2.0 * math.pi * frequency * (middle - samples.time[0])
    noise = sigma * math.sqrt(2.0 / width)
    return _usable(Cycles(middle[3:-3], np.abs(mean[3:-3]), phase[3:-3], noise))


def peak_cycles(samples: SignalSamples, frequency: float, sigma: float) -> Cycles:
    """Height and time of each maximum of the filtered mode, located by a parabola through three samples."""
    from scipy.signal import find_peaks

    y = _band(samples, frequency)
    period = samples.sampling_frequency / frequency
    at, _ = find_peaks(y, height=0.0, distance=max(1, int(0.7 * period)))
    at = at[(at > 3 * period) & (at < y.size - 3 * period)]
    if at.size < 4:
        raise InputError(f"signal: {at.size} peaks of {frequency:g} Hz: must have at least 4")
    a, b, c = y[at - 1], y[at], y[at + 1]
    bend = np.minimum(a - 2.0 * b + c, -1e-300)
    shift = np.clip(0.5 * (a - c) / bend, -0.5, 0.5)
    time = samples.time[0] + (at + shift) / samples.sampling_frequency
    height = b - 0.25 * (a - c) * shift
    turns = np.concatenate(([0.0], np.cumsum(np.round(np.diff(time) * frequency))))
    noise = sigma * math.sqrt(2.0 * frequency / samples.sampling_frequency)
    return _usable(Cycles(time, height, 2.0 * math.pi * turns, noise))


def _usable(cycles: Cycles) -> Cycles:
    low = np.flatnonzero(cycles.amplitude < _LOWEST * cycles.noise)
    end = int(low[0]) if low.size else cycles.time.size
    if end < 4:
        raise InputError(f"signal: {end} usable cycle(s) of the mode above the noise: must be at least 4")
    return Cycles(cycles.time[:end], cycles.amplitude[:end], cycles.phase[:end], cycles.noise)


def regress(cycles: Cycles, start: float, units: str, method: str, soften: bool = True) -> ModeEstimate:
    """Natural frequency, damping and softening from amplitudes and phases of cycles.

    ln a = ln a_0 - zeta omega_0 t + r s E^2 and phase = p + omega_d (t - s (1 - E^2)/(2 delta) - ...), s =
    kappa a_0^2, solved in turn; weights a^2, as the noise of both goes with 1/a.  What q and r may be is
    added to the standard errors.
    """
    prior = law_priors(units)
    center = _solve(cycles, start, prior["q"][0], prior["r"][0], soften)
    variance = center[3]
    for name in ("q", "r") if soften else ():
        q, r = (prior[key][0] + (prior[key][1] if key == name else 0.0) for key in ("q", "r"))
        moved = _solve(cycles, start, q, r, soften)
        change = moved[0] - center[0]
        variance = variance + change**2
    omega, delta, log_amplitude, s = center[0]
    freq_var, delta_var, amplitude_var, s_var = variance
    natural = math.hypot(omega, delta)
    amplitude = math.exp(log_amplitude)
    if not (omega > 0.0 and math.isfinite(amplitude)):
        raise InputError("signal: the cycles follow no decaying oscillation")
    return ModeEstimate(
        natural_frequencies=natural / (2.0 * math.pi),
        natural_frequencies_se=math.sqrt(freq_var) / (2.0 * math.pi),
        damping_ratio=delta / natural,
        damping_ratio_se=math.sqrt(delta_var) / natural,
        amplitude=amplitude,
        amplitude_se=amplitude * math.sqrt(amplitude_var),
        phase=center[1],
        softening=s / amplitude**2,
        softening_se=math.sqrt(s_var) / amplitude**2,
        method=method,
    )


def _solve(
    cycles: Cycles, start: float, q: float, r: float, soften: bool
) -> tuple[_Array, float, float, _Array]:
    """(omega_d, delta, ln a_0, s), phase at the start, the rate of decay, and the variances of the four."""
    t = cycles.time - start
    log_a = np.log(cycles.amplitude)
    line = np.column_stack((np.ones_like(t), -t))
    weight, s = cycles.amplitude**2, 0.0
    solution = np.zeros(2)
    for _ in range(6):
        # weights of the fitted amplitude: those of the noisy one would favour its upward errors
        bend = r * s * np.exp(-2.0 * max(solution[1], 0.0) * t)
        solution, gram = _weighted(line, log_a - bend, weight)
        weight = np.exp(2.0 * (line @ solution + bend))
        steep = max(abs(solution[1]), 1e-9)
        first = -np.expm1(-2.0 * steep * t) / (2.0 * steep)
        second = -np.expm1(-4.0 * steep * t) / (4.0 * steep)
        basis = np.column_stack([np.ones_like(t), t - q * s * s * second] + ([-first] if soften else []))
        angles, phase_gram = _weighted(basis, cycles.phase, weight)
        s = float(np.clip(angles[2] / angles[1], -0.5, 0.5)) if soften else 0.0
    expected = cycles.noise**2
    # where the residuals scatter more than the noise explains, they set the errors
    noise_a = max(expected, float(np.mean(weight * (log_a - bend - line @ solution) ** 2)))
    noise_p = max(expected, float(np.mean(weight * (cycles.phase - basis @ angles) ** 2)))
    s_var = phase_gram[2, 2] * noise_p / angles[1] ** 2 if soften else 0.0
    variance = np.array([phase_gram[1, 1] * noise_p, gram[1, 1] * noise_a, gram[0, 0] * noise_a, s_var])
    return np.array([angles[1], solution[1], solution[0], s]), float(angles[0]), float(solution[1]), variance


def _weighted(basis: _Array, target: _Array, weight: _Array) -> tuple[_Array, _Array]:
    """Weighted linear least squares: the solution, and its covariance for unit noise."""
    scale = np.linalg.norm(basis, axis=0)
    heavy = basis / scale * weight[:, None]
    gram = np.linalg.pinv(heavy.T @ (basis / scale)) / np.outer(scale, scale)
    return gram @ (scale * (heavy.T @ target)), gram


def backbone(cycles: Cycles, parts: int = 12) -> tuple[_Array, _Array, _Array]:
    """Amplitude, frequency [Hz] and its standard error over successive parts of the decay."""
    amplitude, freq, error = [], [], []
    for part in np.array_split(np.arange(cycles.time.size), max(1, min(parts, cycles.time.size // 3))):
        t, a, p = cycles.time[part], cycles.amplitude[part], cycles.phase[part]
        weight = a**2
        middle = float(np.sum(weight * t) / weight.sum())
        spread = float(np.sum(weight * (t - middle) ** 2))
        amplitude.append(math.sqrt(float(np.mean(a**2))))
        freq.append(float(np.sum(weight * (t - middle) * p)) / spread / (2.0 * math.pi))
        error.append(cycles.noise / math.sqrt(spread) / (2.0 * math.pi))
    return np.array(amplitude), np.array(freq), np.array(error)
