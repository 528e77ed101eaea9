"""Errors of a vibrometer and its electronics that a sine fits without a trace: filters, crosstalk, saturation, units."""

from __future__ import annotations

import dataclasses
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.lab.decay.poles import Line
from snapbeam.lab.diagnostics import KINDS_VIBROMETER
from snapbeam.lab.signals import SignalSamples
from snapbeam.lab.sine_fit import SineFit
from snapbeam.util.diagnostics import Diagnostic

__all__ = [
    "LowPass",
    "beyond_shakers",
    "find_crosstalk",
    "find_low_pass",
    "noise_colour",
    "one_sided",
    "saturation_loss",
    "with_loss",
]


_Array = NDArray[np.float64]


# ----------------------------------------------------------------------------------------------------
# Noise that is not white: a low-pass filter in the chain, and noise that drifts.


_LINES = 32  # lines of a spectrum in a band, at least
_STEEP = 10.0  # dB over two octaves; 1/f noise falls by 6, a filter of first order and integrated noise by 12
_STEEPER = 16.0  # dB over two octaves that only a filter of second order takes
_FLAT = 3.5  # dB an octave that noise before a filter of first order may fall; integrated noise falls by 6
_FAR = 10.0  # times the drive's frequency; a filter above that changes the amplitude by less than 0.5 %


class LowPass(NamedTuple):
    """A low-pass filter seen in the noise: its ``corner`` [Hz] and its ``order``, at least."""

    corner: float
    order: int

    def loss(self, frequency: float) -> float:
        """Share of the amplitude at *frequency* [Hz] that the filter takes away."""
        return 1.0 - 1.0 / math.sqrt(1.0 + (frequency / self.corner) ** (2 * self.order))

    @property
    def delay(self) -> float:
        """Delay [s] of what passes."""
        return self.order / (2.0 * math.pi * self.corner)


def find_low_pass(residual: _Array, rate: float, frequency: float) -> LowPass | None:
    """A low-pass filter that is near enough to change the amplitude, or None.

    The noise of a laser, an amplifier or a converter is white or falls slowly with the frequency.  A filter behind
    it makes it fall steeply.  Noise that was integrated falls as behind a filter of first order, but at all
    frequencies: such a filter is told only where the noise below it is flat.

    Parameters
    ----------
    residual
        What the sine leaves of the steady motion.
    rate
        Samples per second [Hz].
    frequency
        Frequency of the drive [Hz].
    """
    n = residual.size
    power = np.abs(np.fft.rfft(residual * np.hanning(n))) ** 2
    freq = np.fft.rfftfreq(n, 1.0 / rate)
    centres, levels = [], []
    low = min(0.5 * frequency, _LINES * rate / n)
    while 2.0 * low < 0.4 * rate:
        band = (freq >= low) & (freq < 2.0 * low)
        if band.sum() >= _LINES:
            centres.append(math.sqrt(2.0) * low)
            levels.append(10.0 * math.log10(max(float(np.median(power[band])), 1e-300)))
        low *= 2.0
    falls = np.array(levels)
    steep = np.flatnonzero(falls[:-2] - falls[2:] > _STEEP)
    if not steep.size:
        return None
    start = int(steep[0])
    if (falls[:-2] - falls[2:]).max() < _STEEPER and (
        start == 0 or (falls[0] - falls[start]) / start > _FLAT
    ):
        return None  # as white noise that was integrated
    top = int(np.argmax(falls[: start + 1]))
    steepest = float((falls[:-1] - falls[1:]).max())
    k = top + int(np.flatnonzero(falls[top:] < falls[top] - 3.0)[0])
    share = (falls[k - 1] - (falls[top] - 3.0)) / (falls[k - 1] - falls[k])
    corner = centres[k - 1] * (centres[k] / centres[k - 1]) ** share
    return LowPass(corner, max(1, round(steepest / 6.0) - 1)) if corner < _FAR * frequency else None


def noise_colour(quiet: _Array, rate: float, frequency: float) -> float:
    """Noise about *frequency* [Hz] over the noise at all frequencies, at least 1; more for noise that drifts.

    An instant is found in the noise near the frequency of the motion, so it is that noise which limits it.
    """
    n = quiet.size
    power = np.abs(np.fft.rfft((quiet - quiet.mean()) * np.hanning(n))) ** 2
    freq = np.fft.rfftfreq(n, 1.0 / rate)
    near = (freq > 0.0) & (freq <= 3.0 * frequency)
    if near.sum() < 4 or not power[1:].mean() > 0.0:
        return 1.0
    ratio = float(power[near].mean() / power[1:].mean())
    return math.sqrt(ratio) if ratio > 1.0 + 4.0 / math.sqrt(near.sum()) else 1.0


# ----------------------------------------------------------------------------------------------------
# What is there at rest at the drive's own frequency: crosstalk of the amplifier, or a floor that moves.


_SURE = 6.0  # standard errors
_LEAST = 0.003  # of the drive's amplitude
_ALIKE = 0.4  # of its amplitude by which it may differ between the halves of the rest


def find_crosstalk(samples: SignalSamples, rest: int, fit: SineFit) -> Line | None:
    """A line at the drive's own frequency over the first *rest* samples, of the same amplitude and phase throughout."""
    period = samples.sampling_frequency / fit.frequency
    if rest < 4.0 * period:
        return None
    halves = []
    for part in (slice(0, rest // 2), slice(rest // 2, rest), slice(0, rest)):
        time, values = samples.time[part], samples.values[part]
        turn = 2.0 * math.pi * fit.frequency * time
        design = np.column_stack([np.ones_like(time), time - time.mean(), np.cos(turn), np.sin(turn)])
        solution = np.linalg.lstsq(design, values, rcond=None)[0]
        noise = float(np.std(values - design @ solution))
        noise *= noise_colour(values - design @ solution, samples.sampling_frequency, fit.frequency)
        halves.append((solution[2] - 1j * solution[3], noise * math.sqrt(2.0 / time.size)))
    (one, _), (other, error), (whole, sure) = halves
    size = abs(whole)
    if size < max(_SURE * sure, _LEAST * fit.amplitude):
        return None
    if abs(one - other) > max(_ALIKE * size, 3.0 * error):
        return None
    return Line(fit.frequency, float(size), float(np.angle(whole)))


# ----------------------------------------------------------------------------------------------------
# A signal that is no velocity: rectified or squared, or bent by an amplifier near its limit.


_ONE_SIDED = 0.8  # of the amplitude by which the mean may move
_THIRD = 0.004  # of the amplitude
_IN_LINE = 0.1  # rad
_STRONG = 0.03  # of the amplitude, third harmonic beside which saturation makes a fifth
_FIFTH = (
    0.3,
    3.0,
)  # times the square of the third harmonic; a hyperbolic tangent makes 1.2, an arc tangent 1.8
_TIMES = 3.0  # times the third harmonic that saturation takes from the first


def one_sided(samples: SignalSamples, rest: int, first: int, last: int, fit: SineFit) -> float:
    """Relative shift of the mean at the onset of the motion, over the amplitude; 0 if it is admissible.

    A shaker comes back, so the mean of its velocity is that at rest.  The mean of a rectified or squared one is not.
    """
    if rest < 8:
        return 0.0
    still = float(np.median(samples.values[:rest]))
    moved = float(samples.values[first + (last - first) // 3 : last].mean()) - still
    share = abs(moved) / fit.amplitude
    return share if share > _ONE_SIDED else 0.0


def saturation_loss(fit: SineFit) -> float:
    """Share of the amplitude that a saturating amplifier takes, as far as the third harmonic tells; 0 if it does not.

    To lowest order a symmetric saturation y - c y^3 takes three times as much from the first harmonic as it makes of
    the third, whose crests are then opposite to those of the first.  A strong third harmonic comes with a fifth of
    about its square; one without is the shaker's own.
    """
    amplitude, phase = fit.harmonic_amplitude, fit.harmonic_phase
    if amplitude.size < 3 or not amplitude[0] > 0.0:
        return 0.0
    third = float(amplitude[2] / amplitude[0])
    others = max(float(amplitude[k] / amplitude[0]) for k in range(1, amplitude.size) if k != 2)
    noise = fit.noise_rms * math.sqrt(2.0 / fit.samples) / fit.amplitude
    turned = math.remainder(float(phase[2]) - 3.0 * float(phase[0]) - math.pi, 2.0 * math.pi)
    told = third > max(_THIRD, 6.0 * noise, 2.0 * others) and abs(turned) < _IN_LINE + 3.0 * noise / third
    if (
        third > _STRONG and third**2 > 6.0 * noise and amplitude.size > 4
    ):  # else a shaker's own third harmonic
        fifth = float(amplitude[4] / amplitude[0]) * math.cos(float(phase[4]) - 5.0 * float(phase[0]))
        told = told and _FIFTH[0] * third**2 < fifth < _FIFTH[1] * third**2
    return _TIMES * third if told else 0.0


def with_loss(fit: SineFit, share: float) -> SineFit:
    """A sine whose amplitude is uncertain by *share* of it."""
    if share == 0.0:
        return fit
    return dataclasses.replace(fit, amplitude_se=math.hypot(fit.amplitude_se, share * fit.amplitude))


# ----------------------------------------------------------------------------------------------------
# Motions that no shaker makes, as of numbers in another unit.


_FASTEST = 3.0  # m/s
_HARDEST = 1500.0  # m/s^2
_FARTHEST = 0.05  # m
_G = 9.80665


def beyond_shakers(fit: SineFit, units: str) -> list[Diagnostic]:
    """Diagnostics for a sine beyond the speed, acceleration or stroke of electrodynamic shakers."""
    omega = 2.0 * math.pi * fit.frequency
    speed = fit.amplitude if units == "m/s" else omega * fit.amplitude
    hard, far = speed * omega, speed / omega
    beyond = [
        words
        for words, value, limit in (
            (f"{speed:.3g} m/s are above {_FASTEST:g} m/s", speed, _FASTEST),
            (f"{hard / _G:.3g} g are above {_HARDEST / _G:.3g} g", hard, _HARDEST),
            (f"{1e3 * far:.3g} mm are above {1e3 * _FARTHEST:g} mm", far, _FARTHEST),
        )
        if value > limit
    ]
    if not beyond:
        return []
    told = ", ".join(beyond)
    return [
        KINDS_VIBROMETER["beyond_shakers"].found(
            told=told, speed=speed, acceleration_g=hard / _G, travel_mm=1e3 * far
        )
    ]
