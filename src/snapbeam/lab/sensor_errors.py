"""Errors of a vibrometer and its electronics that a sine fits without a trace: filters, crosstalk, saturation, units."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from snapbeam.lab.decay.poles import Line
from snapbeam.lab.diagnostics import KINDS_VIBROMETER
from snapbeam.lab.least_squares import sines, solve
from snapbeam.lab.signals import SignalSamples
from snapbeam.lab.sine_fit import SineFit
from snapbeam.util.diagnostics import Diagnostic

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
        design = np.column_stack([sines(time, [fit.frequency]), time - time.mean()])
        solution = solve(design, values)
        noise = float(np.std(values - design @ solution))
        noise *= noise_colour(values - design @ solution, samples.sampling_frequency, fit.frequency)
        halves.append((solution[1] - 1j * solution[2], noise * math.sqrt(2.0 / time.size)))
    (one, _), (other, error), (whole, sure) = halves
    size = abs(whole)
    if size < max(_SURE * sure, _LEAST * fit.amplitude):
        return None
    if abs(one - other) > max(_ALIKE * size, 3.0 * error):
        return None
    return Line(fit.frequency, float(size), float(np.angle(whole)))


# ----------------------------------------------------------------------------------------------------
# A signal that is no velocity: rectified or squared.


_ONE_SIDED = 0.8  # of the amplitude by which the mean may move


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


def with_loss(fit: SineFit, share: float, shift: float = 0.0) -> SineFit:
    """A sine whose amplitude is uncertain by *share* of it, and its frequency by *shift* of it."""
    return dataclasses.replace(
        fit,
        amplitude_se=math.hypot(fit.amplitude_se, share * fit.amplitude),
        frequency_se=math.hypot(fit.frequency_se, shift * fit.frequency),
    )


# ----------------------------------------------------------------------------------------------------
# Errors of electronics, each as a hypothesis: the chi-square it explains, against the limit of its degrees of freedom
# and against its alternatives.  Alternatives that are no errors, as a shaker's own harmonic, are among them.


FALSE_ALARM_RATE = 1e-3
"""Rate of false alarms of one detector on one record, for normal noise."""
_MATTERS = 0.004  # of the amplitude that an error must take, or move it by, to be of concern
_CURVE_ERROR = 0.05  # of its harmonics by which a curve may differ from a family's
_CHANGES = 0.02  # of the amplitude, or rad, by which a steady motion may change
_EXPLAINS = 0.75  # of the odd harmonics that a curve must explain
_TAIL = 4.0  # cycles after the start-up whose transient is no noise
_MAINS = (50.0, 60.0, 100.0, 120.0)


class Record(NamedTuple):
    """A record as detectors see it: its steady part, the sine fitted to it and what that leaves, and its cycles."""

    fit: SineFit
    part: SignalSamples
    left: _Array
    lines: tuple[float, ...]
    times: _Array
    cycles: NDArray[np.complex128]


class Hypothesis(NamedTuple):
    """One explanation of what a sine leaves: the chi-square it explains with so many degrees of freedom.

    ``kind`` is that of its diagnostic, empty where nothing is wrong; ``loss`` the share of the amplitude and ``shift``
    the share of the frequency that it puts in doubt.
    """

    kind: str
    gain: float
    freedom: int
    loss: float = 0.0
    shift: float = 0.0
    numbers: Mapping[str, float] = {}

    @property
    def score(self) -> float:
        """Chi-square beyond what noise explains at the stated rate of false alarms."""
        return self.gain - float(chi2.isf(FALSE_ALARM_RATE, self.freedom))


def find_errors(record: Record) -> list[Hypothesis]:
    """The best explanation of each detector, where it is an error that matters and not explained by chance.

    What another error leaves is no noise, so clocks and filters are judged where there is none.
    """
    told: list[Hypothesis] = []
    for detector in (_curves, _courses, _clocks, _filters):
        if detector in (_clocks, _filters) and told:
            break
        best = max(detector(record), key=lambda one: one.score, default=None)
        if best is not None and best.kind and best.score > 0.0 and max(best.loss, best.shift) > _MATTERS:
            told.append(best)
    return told


@functools.cache
def _families() -> dict[str, tuple[_Array, NDArray[np.complex128]]]:
    """Loss of amplitude, and odd harmonics 3 to 9 over the first, of an amplifier's curves by their parameter."""
    turn = 2.0 * np.pi * np.arange(720) / 720
    wave = np.cos(turn)[:, None]
    drive = np.geomspace(0.1, 3.0, 60)
    dead = np.geomspace(2e-3, 0.3, 60)
    share = np.linspace(0.4, 0.998, 80)
    lagging = np.empty((1440, share.size))
    at = np.zeros(share.size)
    for k in range(1440):
        at = at + np.clip(wave[k % 720] - at, -share * turn[1], share * turn[1])
        lagging[k] = at
    curves = {
        "saturated": np.hstack([np.tanh(drive * wave) / drive, np.arctan(drive * wave) / drive]),
        "crossover": np.sign(wave) * np.maximum(np.abs(wave) - dead, 0.0),
        "slew": lagging[720:],
    }
    found = {}
    for kind, values in curves.items():
        lines = np.fft.rfft(values, axis=0)[1:10:2] * (2.0 / 720)
        turned = lines * np.exp(-1j * np.angle(lines[0]) * np.arange(1, 10, 2)[:, None])
        found[kind] = 1.0 - np.abs(lines[0]), turned[1:] / np.abs(lines[0])
    return found


def _curves(record: Record) -> list[Hypothesis]:
    """Curves of an amplifier by the odd harmonics they make; a shaker's own third harmonic has any phase, and no fifth."""
    fit = record.fit
    at = np.arange(2, fit.harmonic_amplitude.size, 2)[:4]
    if at.size < 2:
        return []
    turned = fit.harmonic_phase[at] - (at + 1) * fit.harmonic_phase[0]
    seen = fit.harmonic_amplitude[at] / fit.amplitude * np.exp(1j * turned)
    noise = fit.noise_rms * math.sqrt(2.0 / fit.samples) / fit.amplitude
    variance = noise**2 + (_CURVE_ERROR * float(np.linalg.norm(seen))) ** 2
    total = float((np.abs(seen) ** 2).sum()) / variance
    third = 100.0 * abs(seen[0])
    told = [Hypothesis("", abs(seen[0]) ** 2 / variance, 2)]
    for kind, (loss, templates) in _families().items():
        left = (np.abs(seen[:, None] - templates[: at.size]) ** 2).sum(0) / variance
        best = int(np.argmin(left))
        lost = float(loss[best] / (1.0 - loss[best]))
        numbers = {"third_percent": third, "loss_percent": 100.0 * lost}
        explained = total - float(left[best])
        if explained > _EXPLAINS * total:
            told.append(Hypothesis(kind, explained, 1, lost, numbers=numbers))
    return told


def _filters(record: Record) -> list[Hypothesis]:
    """Filters behind the source of the noise, by the shape of its spectrum about the drive (Whittle's likelihood)."""
    rate, drive = record.part.sampling_frequency, record.fit.frequency
    left = record.left[min(round(_TAIL * rate / drive), record.left.size // 4) :]
    n = left.size
    freq = np.fft.rfftfreq(n, 1.0 / rate)
    power = np.abs(np.fft.rfft(left)) ** 2
    used = (freq > 2.5 * rate / n) & (freq < min(12.0 * drive, 0.4 * rate))
    for line in (*record.lines, *(drive * np.arange(1, 13))):
        used &= np.abs(freq - line) > 1.5 * rate / n
    freq, power = freq[used], power[used]
    if freq.size < 2 * _LINES or not power.min() > 0.0:
        return []
    # neighbours that differ in frequency by less than 1 % are averaged
    edges = np.unique(
        np.searchsorted(freq, freq[0] * 1.01 ** np.arange(math.log(freq[-1] / freq[0]) / 0.00996))
    )
    count = np.diff(np.append(edges, freq.size))
    freq, power = np.add.reduceat(freq, edges) / count, np.add.reduceat(power, edges) / count

    def misfit(response: _Array) -> float:
        """Twice the negative logarithm of the likelihood behind *response*, least over colours of the noise."""
        shape = colours * response
        level = (count * power / shape).sum(-1) / count.sum()
        return 2.0 * float(np.min(count.sum() * np.log(level) + (count * np.log(shape)).sum(-1)))

    slope, white = np.meshgrid(np.linspace(-2.0, 2.0, 9), [0.0, 0.1, 1.0, 10.0])
    colours = (freq / drive) ** -slope.reshape(-1, 1) + white.reshape(-1, 1)
    plain = misfit(np.ones_like(freq))
    told = [Hypothesis("", 0.0, 1)]
    for kind, corners in (
        ("high_pass", np.geomspace(0.02, 2.0, 24) * drive),
        ("low_pass", np.geomspace(0.5, 10.0, 16) * drive),
    ):
        for corner in corners:
            sign = 2.0 if kind == "high_pass" else -2.0
            loss = 1.0 - 1.0 / math.sqrt(1.0 + (drive / corner) ** -sign)
            kept = 1.0 / (1.0 + (freq / corner) ** -sign)
            numbers = {"corner": corner, "loss_percent": 100.0 * loss, "limit": 0.05 * drive}
            told.append(
                Hypothesis(
                    kind if sign > 0.0 else "", plain - misfit(kept), 2, loss / (1.0 - loss), numbers=numbers
                )
            )
    for centre in _MAINS:
        for quality in (1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 10.0, 15.0, 20.0, 30.0):
            off = quality * (freq / centre - centre / freq)
            own = quality * (drive / centre - centre / drive)
            loss = 1.0 - abs(own) / math.hypot(1.0, own)
            numbers = {"centre": centre, "loss_percent": 100.0 * loss}
            kept = np.maximum(off**2 / (1.0 + off**2), 1e-4)
            told.append(
                Hypothesis("notch", plain - misfit(kept), 2, loss / max(1.0 - loss, 1e-3), numbers=numbers)
            )
    return told


def _clocks(record: Record) -> list[Hypothesis]:
    """Samples lost at even distances: the phase rises evenly and jumps by whole samples."""
    fit, n = record.fit, record.left.size
    turn = 2.0 * np.pi * fit.frequency * record.part.time + fit.phase
    phase = -2.0 * record.left * np.sin(turn) / fit.amplitude
    sample = 2.0 * np.pi * fit.frequency / record.part.sampling_frequency
    power = np.abs(np.fft.rfft(phase * np.hanning(n))) ** 2 * (8.0 / 3.0)
    power[:8] = 0.0
    at = int(np.argmax(power))
    noise = max(float(np.median(power)) / math.log(2.0), 1e-300)
    if power[at] < math.log(n / FALSE_ALARM_RATE) * noise:
        return []
    told = [Hypothesis("", 2.0 * power[at] / noise, 3)]
    about = n / at
    for multiple in (1, 2, 3):
        middle = multiple * about
        reach = int(middle * middle / n) + 2
        for length in range(max(int(middle) - reach, 6), min(int(middle) + reach, n // 4) + 1):
            rows = n // length
            mean = phase[: rows * length].reshape(rows, length).mean(0)
            saw = np.fft.rfft((np.arange(length) + 0.5) / length - 0.5)
            match = np.fft.irfft(np.fft.rfft(mean - mean.mean()) * np.conj(saw), length)
            height = -float(match.min()) / (length / 12.0) / sample
            lost = round(height)
            if lost < 1 or abs(height - lost) > 0.2 * lost:
                continue
            gain = 12.0 * float(match.min()) ** 2 / length * rows * n / max(noise, 1e-300)
            share = lost / (length + lost)
            numbers = {"lost": lost, "every": length + lost, "share_percent": 100.0 * lost / length}
            told.append(Hypothesis("samples_lost", gain, 3, shift=share, numbers=numbers))
    return told


def _courses(record: Record) -> list[Hypothesis]:
    """Amplitude and phase over the steady part: constant, drifting, or bent as by a line too close to be parted."""
    inside = (record.times > record.fit.start) & (record.times < record.fit.stop)
    cycles, t = record.cycles[inside], record.times[inside]
    if t.size < 24 or not np.abs(cycles).min() > 0.0:
        return []
    basis = np.polynomial.legendre.legvander(2.0 * (t - t[0]) / (t[-1] - t[0]) - 1.0, 5)
    course = np.log(np.abs(cycles)), np.unwrap(np.angle(cycles))
    bends = [np.diff(one, 2) for one in course]
    noise = [1.4826 * float(np.median(np.abs(one - np.median(one)))) / math.sqrt(6.0) + 1e-9 for one in bends]
    found = [np.linalg.lstsq(basis, one, rcond=None)[0] for one in course]
    gain = [
        (coefficients * np.linalg.norm(basis, axis=0) / sd) ** 2
        for coefficients, sd in zip(found, noise, strict=True)
    ]
    found[0][0] = found[1][0] = found[1][1] = 0.0
    change, bend = (float(np.ptp(basis @ coefficients)) for coefficients in found)
    line = float(np.ptp(basis[:, :2] @ found[0][:2]))
    if max(change, bend) < _CHANGES:
        return []
    span = float(t[-1] - t[0]) * record.fit.frequency
    numbers = {"change_percent": 100.0 * change, "bend": bend}
    slow, close = float(gain[0][1:3].sum()), float(gain[0][1:].sum() + gain[1][2:].sum())
    return [
        Hypothesis("drifts", slow if line > 0.8 * change else 0.0, 2, 0.5 * change, numbers=numbers),
        Hypothesis(
            "beat",
            close if bend > _CHANGES else 0.0,
            9,
            0.5 * change,
            math.hypot(change, bend) / (2.0 * np.pi * span),
            numbers,
        ),
    ]


# ----------------------------------------------------------------------------------------------------
# Motions that no shaker makes, as of numbers in another unit.


_FASTEST = 3.0  # m/s
_HARDEST = 1500.0  # m/s^2
_FARTHEST = 0.05  # m
_G = 9.80665


_SAME_RATE = 5e-3  # by which two clocks may differ
_AGREE = 0.05  # by which two sensors may differ
_UNITS = {
    "one of the units is wrong by a power of ten": None,
    "g was read as m/s^2": 1.0 / _G,
    "m/s^2 was read as g": _G,
    "inches were read as centimetres": 2.54,
}


def beside_acceleration(fit: SineFit, units: str, acceleration: SineFit) -> list[Diagnostic]:
    """Diagnostics of a sine of displacement or velocity, against the acceleration of the same shaker."""
    clocks = acceleration.frequency / fit.frequency
    if abs(clocks - 1.0) > max(
        _SAME_RATE, 6.0 * (fit.frequency_se + acceleration.frequency_se) / fit.frequency
    ):
        return [
            KINDS_VIBROMETER["clocks"].found(own=fit.frequency, other=acceleration.frequency, ratio=clocks)
        ]
    omega = 2.0 * math.pi * fit.frequency
    ratio = acceleration.amplitude / (omega * fit.amplitude * (omega if units == "m" else 1.0))
    if abs(ratio - 1.0) < _AGREE:
        return []
    turned = omega if units == "m/s" else 1.0 / omega
    read = (
        "a displacement was read as a velocity" if units == "m/s" else "a velocity was read as a displacement"
    )
    causes = {read: turned} | _UNITS
    told = [
        cause
        for cause, factor in causes.items()
        if _tens(ratio / (factor or 1.0), cause == read or factor is None)
    ]
    words = (
        " or ".join(told) or "look at sensitivity (--sensitivity), units (--units) and channels (--channel)"
    )
    return [KINDS_VIBROMETER["acceleration"].found(told=words, ratio=ratio)]


def _tens(ratio: float, powers: bool) -> bool:
    """Return whether a ratio is 1, or any power of ten."""
    exponent = math.log10(ratio)
    return abs(exponent - (round(exponent) if powers else 0.0)) < math.log10(1.0 + _AGREE)


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
