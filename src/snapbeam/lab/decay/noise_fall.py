"""Noise that falls with the decay: what an exponential window leaves behind.

Analysers multiply records of hammer tests by exp(-t/T) to make them end in nothing.  What is left is the free decay
of a mode that is damped more, by 1/(T omega_0): no number of the decay itself tells.  But the noise of the sensor,
which does not decay, was multiplied too.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.lab.signals.signal import SignalSamples

__all__ = ["NoiseFall", "noise_fall", "undone"]

_PARTS = 8
_LEAST = 64  # lines of the spectrum of a part
_QUANTILE = 0.25  # of these lines that hold noise alone, however many modes there are
_CERTAIN = 5.0  # standard errors
_FALL = 0.2  # of the logarithm of the noise over the record


class NoiseFall(NamedTuple):
    """The noise falls as exp(-``rate`` t) [1/s], by a ``factor`` over the record."""

    rate: float
    factor: float


def noise_fall(rest: SignalSamples, frequency: float) -> NoiseFall | None:
    """At which rate the noise of a record falls; None if it does not, or not as an exponential does.

    The level of the noise in each eighth of the record is that of the lower quartile of its spectrum, which modes
    left in it do not reach; a straight line must describe its logarithm, and fall by more than five standard errors.

    Parameters
    ----------
    rest
        What a fit leaves of a decay.
    frequency
        Of the first mode [Hz]; noise is sought above one and a half times it.
    """
    size = rest.values.size // _PARTS
    freq = np.fft.rfftfreq(size, 1.0 / rest.sampling_frequency)
    inside = freq > 1.5 * frequency
    count = int(np.count_nonzero(inside))
    if count < _LEAST:
        return None
    parts = rest.values[: size * _PARTS].reshape(_PARTS, size)
    power = np.abs(np.fft.rfft(parts * np.hanning(size), axis=1))[:, inside] ** 2
    level = np.quantile(power, _QUANTILE, axis=1)
    floor = (1e-9 * float(np.abs(rest.values).max())) ** 2
    if not level.min() > floor * size:
        return None
    y = 0.5 * np.log(level)
    t = (np.arange(_PARTS) + 0.5) * size / rest.sampling_frequency
    # a quantile q of the exponential distribution that a periodogram has, with lines that share a window of Hann
    spread = -math.sqrt(_QUANTILE / (1.0 - _QUANTILE)) / math.log(1.0 - _QUANTILE)
    error = 0.5 * spread * math.sqrt(1.5 / count)
    slope, base = np.polyfit(t, y, 1)
    off = float(np.sqrt(np.mean((y - base - slope * t) ** 2)))
    fall = -float(slope) * rest.values.size / rest.sampling_frequency
    certain = -float(slope) > _CERTAIN * max(error, off) / math.sqrt(float(((t - t.mean()) ** 2).sum()))
    straight = off < max(2.5 * error, 0.08 * fall)
    return NoiseFall(-float(slope), math.exp(fall)) if certain and straight and fall > _FALL else None


def undone(samples: SignalSamples, constant: float) -> SignalSamples:
    """A record before it was multiplied by an exponential window of *constant* [s] from its first sample on."""
    values: NDArray[np.float64] = samples.values * np.exp((samples.time - samples.time[0]) / constant)
    return SignalSamples(values, samples.time, samples.sampling_frequency)
