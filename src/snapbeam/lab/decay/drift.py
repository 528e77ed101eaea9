"""What moves in a record beside the decay: a zero that drifts, and lines that do not decay."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import fftconvolve

from snapbeam.core.validate import InputError
from snapbeam.lab.signals.signal import SignalSamples
from snapbeam.lab.signals.sine_fit import fit_sine

__all__ = ["Line", "find_drift", "find_lines", "without_lines"]

_Array = NDArray[np.float64]
_MAINS = (50.0, 60.0)
_MOST_LINES = 6
_PEAKS = 10  # of the spectrum that are looked at for a line
_HIGHEST_DEGREE = 6
_MATTERS = 0.03  # of the amplitude; a drift below that is let be


class Line(NamedTuple):
    """A sine that does not decay: frequency [Hz], amplitude, phase at time 0 of the record."""

    frequency: float
    amplitude: float
    phase: float

    def waveform(self, time: _Array) -> _Array:
        """The line at times [s]."""
        out: _Array = self.amplitude * np.cos(2.0 * math.pi * self.frequency * time + self.phase)
        return out


def find_drift(samples: SignalSamples, frequency: float, decay_rate: float) -> tuple[_Array, int]:
    """A polynomial that the mean motion follows, at every sample, and its degree; 0 if none is needed.

    The mean is that under a bell of two periods.  A softening mode shifts it in proportion to the square of
    its amplitude; what falls so is no drift.

    Parameters
    ----------
    samples
        The decay.
    frequency, decay_rate
        Of the mode [Hz, 1/s].
    """
    n = samples.values.size
    nothing: _Array = np.zeros(n)
    width = round(samples.sampling_frequency / frequency)
    if n < 10 * width:
        return nothing, 0
    bell = np.hanning(2 * width + 1)
    mean = fftconvolve(samples.values, bell / bell.sum(), mode="valid")[::width]
    at = np.arange(mean.size) * width + width
    fall = np.column_stack([np.ones(mean.size), np.exp(-2.0 * decay_rate * at / samples.sampling_frequency)])
    rest = mean - fall @ np.linalg.lstsq(fall, mean, rcond=None)[0]
    x = 2.0 * (at + 0.5) / n - 1.0
    largest = float(np.percentile(np.abs(samples.values - np.median(samples.values)), 99))
    best, chosen, solution = math.inf, 0, np.zeros(1)
    for degree in range(0, min(_HIGHEST_DEGREE, mean.size // 5) + 1):
        basis = np.polynomial.legendre.legvander(x, degree)
        found = np.linalg.lstsq(basis, rest, rcond=None)[0]
        left = float(np.mean((rest - basis @ found) ** 2)) + (1e-4 * largest) ** 2
        score = mean.size * math.log(left) + 2.0 * (degree + 1) * math.log(mean.size)
        if score < best - 6.0:
            best, chosen, solution = score, degree, found
    if chosen == 0:
        return nothing, 0
    whole = 2.0 * (np.arange(n) + 0.5) / n - 1.0
    drift = np.asarray(np.polynomial.legendre.legval(whole, solution), dtype=np.float64)
    if np.ptp(drift) < _MATTERS * largest:
        return nothing, 0
    return drift - drift.mean(), chosen


def find_lines(samples: SignalSamples, decay_rate: float) -> list[Line]:
    """Sines that do not decay, in the last third of a record, where the decay has died away most.

    A line must stand twelve decibels above its surroundings there, keep its amplitude over the two halves of
    that third, and, unless it is a multiple of mains frequency, do so where a mode of *decay_rate* [1/s] could not.
    """
    n = samples.values.size
    first = 2 * n // 3
    rest = SignalSamples(samples.values[first:].copy(), samples.time[first:], samples.sampling_frequency)
    found: list[Line] = []
    for _ in range(_MOST_LINES):
        line = _strongest(rest, decay_rate)
        if line is None:
            break
        found.append(line)
        rest = SignalSamples(rest.values - line.waveform(rest.time), rest.time, rest.sampling_frequency)
    return found


def _strongest(part: SignalSamples, decay_rate: float) -> Line | None:
    n = part.values.size
    values = part.values - part.values.mean()
    spectrum = np.abs(np.fft.rfft(values * np.hanning(n))) ** 2
    freq = np.fft.rfftfreq(n, 1.0 / part.sampling_frequency)
    span = n / part.sampling_frequency
    left = np.where(freq * span < 4.0, 0.0, spectrum)
    for _ in range(_PEAKS):
        at = int(np.argmax(left))
        left = np.where(np.abs(freq - freq[at]) < 4.0 / span, 0.0, left)
        near = (np.abs(freq - freq[at]) < 30.0 / span) & (np.abs(freq - freq[at]) > 4.0 / span)
        if near.sum() < 8 or spectrum[at] < 16.0 * float(np.median(spectrum[near])) / math.log(2.0):
            continue
        try:
            whole = fit_sine(part, float(freq[at]), 1)
            parts = [
                SignalSamples(part.values[cut], part.time[cut], part.sampling_frequency)
                for cut in (slice(0, n // 2), slice(n // 2, n))
            ]
            halves = [fit_sine(one, whole.frequency, 1, fixed=True) for one in parts]
        except InputError:
            continue
        ratio = halves[1].amplitude / halves[0].amplitude
        error = ratio * math.hypot(*(half.amplitude_se / half.amplitude for half in halves))
        mains = min(abs(whole.frequency / base - round(whole.frequency / base)) * base for base in _MAINS)
        multiple = mains < max(0.004 * whole.frequency, 3.0 * whole.frequency_se) and mains < 0.6
        decayed = math.exp(-decay_rate * 0.5 * span)
        level = abs(ratio - 1.0) < max(3.0 * error, 0.04) and error < 0.1
        if level and (multiple or ratio - decayed > max(6.0 * error, 0.15)):
            return Line(whole.frequency, whole.amplitude, whole.phase)
    return None


def without_lines(samples: SignalSamples, lines: list[Line]) -> SignalSamples:
    """A record less its lines."""
    values = samples.values
    for line in lines:
        values = values - line.waveform(samples.time)
    return SignalSamples(values, samples.time, samples.sampling_frequency)
