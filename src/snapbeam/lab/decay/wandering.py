"""A natural frequency that changes with time, as with temperature, told from one that changes with amplitude."""

from __future__ import annotations

import math

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import CubicSpline

from snapbeam.lab.decay.cycles import Cycles
from snapbeam.lab.signals.signal import SignalSamples

__all__ = ["frequency_drift", "steadied"]

_CERTAIN = 7.0  # standard errors
_EXPLAINED = 2.0  # times the noise that a drift may leave
_MATTERS = 1e-4  # of the frequency, over the record
_SECOND = 2.0  # times the square of the softening that its next order may be, to a standard deviation


def frequency_drift(cycles: Cycles, frequency: float) -> float:
    """By what share a frequency changes over a decay with time alone; 0 if by no more than its error.

    The phase of the cycles is a line, the integrals of a^2 and a^4 (softening, a the amplitude of the cycles as it is;
    the second is held to the size that goes with the first) and, where the frequency drifts at a steady rate, t^2: a
    drift goes on where little amplitude is left.

    Parameters
    ----------
    cycles
        The first mode, cycle by cycle.
    frequency
        Of the mode [Hz].
    """
    t = cycles.time - cycles.time[0]
    if t.size < 24:
        return 0.0
    square = (cycles.amplitude / cycles.amplitude.max()) ** 2
    x = t / t[-1]
    first, second = (cumulative_trapezoid(square**power, x, initial=0.0) for power in (1, 2))
    weight = cycles.amplitude / max(cycles.noise, 1e-9 * float(cycles.amplitude.max()))
    turns = 2.0 * math.pi * frequency * float(t[-1])
    basis = np.column_stack([np.ones_like(x), x, first, second, x * x]) * weight[:, None]
    scale = np.linalg.norm(basis, axis=0)
    softens = 0.0
    for _ in range(2):  # q s^2, q of some 0.7, is known only after s is
        held = np.zeros(5)
        held[3] = 1.0 / max(_SECOND * softens**2 * turns, 1e-6)
        rows = np.vstack([basis, np.diag(held)[3:4]]) / scale
        aims = np.append(cycles.phase * weight, 0.0)
        found = np.linalg.lstsq(rows, aims, rcond=1e-12)[0] / scale
        softens = float(found[2]) / turns
    left = (cycles.phase - np.column_stack([np.ones_like(x), x, first, second, x * x]) @ found) * weight
    inverse = np.linalg.pinv(rows.T @ rows, rcond=1e-12)
    unit = math.sqrt(float(left @ left) / max(t.size - 5, 1))
    if unit > _EXPLAINED:  # two modes that beat, a jump: no drift is all that is the matter
        return 0.0
    error = max(unit, 1.0) * math.sqrt(float(inverse[-1, -1])) / float(scale[-1])
    share = 2.0 * float(found[-1]) / turns
    return share if abs(found[-1]) > _CERTAIN * error and abs(share) > _MATTERS else 0.0


def steadied(samples: SignalSamples, share: float) -> SignalSamples:
    """A record whose frequency drifts by *share* from its first sample to its last, on a clock that drifts alike.

    The clock runs as t + share t^2/(2 T), T the length; the frequency is that of the first sample then.
    """
    t = samples.time - samples.time[0]
    clock = t + 0.5 * share * t * t / t[-1]
    even = np.arange(int(clock[-1] * samples.sampling_frequency + 1e-9) + 1) / samples.sampling_frequency
    values = CubicSpline(clock, samples.values)(even)
    return SignalSamples(values, samples.time[0] + even, samples.sampling_frequency)
