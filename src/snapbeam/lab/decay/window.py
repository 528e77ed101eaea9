"""A record made ready for its modes: cut to the free decay, without drift and without lines that do not decay."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import CubicSpline
from scipy.ndimage import median_filter, uniform_filter1d
from scipy.optimize import isotonic_regression

from snapbeam.lab.decay.model import Cycles, hilbert_cycles, likely, noise_level, regress
from snapbeam.lab.decay.poles import Line, Pole, Stabilisation, find_drift, find_lines, find_poles, without_lines
from snapbeam.lab.diagnostics import KINDS_DECAY
from snapbeam.lab.sensor_errors import Hypothesis, best_of
from snapbeam.lab.signals import SignalSamples
from snapbeam.lab.sine_fit import falling_window, highest_peak, stuck_runs
from snapbeam.util.diagnostics import Diagnostic
from snapbeam.util.singular_values import lstsq, polyfit
from snapbeam.util.validation import InputError, finite

_Array = NDArray[np.float64]
_RISE = 0.3  # share of the greatest swing below which nothing is released yet
_PLATEAU = 0.012  # share by which maxima under a ceiling may fall
_SPAN = 4  # cycles whose least and greatest values are taken together
_FALLS = 0.4  # of the first tops by which the tops must fall
_LEVEL = 0.08  # of that by which the bottoms may change
_EXPLAINED = 2.0  # times the noise that the likeliest may leave; more is left by two modes that beat
_BETTER = 4.0  # times as much that the others must leave then
_MATTERS = 1e-4  # of the frequency, over the record
_SECOND = 2.0  # times the square of the softening that its next order may be, to a standard deviation
_LEVELS = np.geomspace(0.06, 0.65, 22)  # of the first amplitude at which a stop may stand
_TOLD = 16.0  # chi-square by which an explanation must better all others to be told
_LEAST_CYCLES = 8.0  # of a decay
ENERGY = 40.0  # of a pole over the noise, from which it is a mode
CLOSE = 0.25  # share within which modes are fitted together
_ASKED = 0.1  # share by which a mode may be off the frequency asked for
_PARTS = 8  # of a record whose noise is compared
_LEAST = 64  # lines of the spectrum of a part
_QUANTILE = 0.25  # of the lines of a part that hold noise alone, however many modes there are
_CERTAIN_NOISE_FALL = 5.0  # standard errors
_FALL = 0.2  # of the logarithm of the noise over the record


class Doubt(NamedTuple):
    """Share by which the frequency and the damping ratio are in doubt."""

    frequency: float = 0.0
    damping: float = 0.0


def find_release(samples: SignalSamples, frequency: float) -> int:
    """First sample of the free decay: where its swing, seen over a period, is the maximum.

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


def find_ceiling(samples: SignalSamples, frequency: float) -> int:
    """Detect clipping of the first cycles of a decay: the sample at which it ends, 0 without it.

    Either the record hits its maximum or minimum value in runs of equal samples, or the maxima of at least four
    cycles stay level, and flat, where the later ones fall.
    """
    values = samples.values
    width = max(4, round(samples.sampling_frequency / frequency))
    until = 0
    for extreme in (values.max(), values.min()):
        runs = [run for run in stuck_runs(values, 3) if values[run.first] == extreme]
        if len(runs) >= 2 and np.ptp(values) > 0.0:
            until = max(until, runs[-1].last)
    for sign in () if until else (1.0, -1.0):
        until = max(until, _plateau(sign * (values - np.median(values)), width))
    return min(until + width // 4, values.size) if until else 0


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


def find_jump(cycles: Cycles) -> tuple[float, float] | None:
    """Time [s] at which amplitude or phase of a mode jumps, and by what share; None if neither does.

    Straight lines through the logarithm of the amplitude and through the phase of six cycles on either side
    must differ there by more than eight standard errors and by more than eight percent (or 0.08 rad), and more
    than anywhere else; slow changes, as of two modes that beat, bend both sides alike.
    """
    n, span = cycles.time.size, 6
    if n < 2 * span + 2:
        return None
    log_a = np.log(cycles.amplitude)
    # cycles begin at whole samples, so they are not quite evenly spaced: their phase is told against time
    phase = cycles.phase - np.polyval(polyfit(cycles.time, cycles.phase, 1), cycles.time)
    x = np.arange(span, dtype=np.float64)
    steps = np.zeros((2, n))
    errors = np.full(n, math.inf)
    for k in range(span, n - span - 1):
        for row, series in enumerate((log_a, phase)):
            left = polyfit(x - span, series[k - span : k], 1)
            right = polyfit(x + 2.0, series[k + 2 : k + 2 + span], 1)
            steps[row, k] = np.polyval(right, 0.5) - np.polyval(left, 0.5)
        relative = cycles.noise / float(np.min(cycles.amplitude[k - span : k + span]))
        errors[k] = relative * math.sqrt(2.0 * (1.0 / span + 12.0 * (0.5 * span + 1.0) ** 2 / span**3))
    size = np.hypot(steps[0], steps[1])
    # what a smooth curve does to the same lines
    usual = 1.4826 * float(np.median(size[size > 0.0])) if (size > 0.0).any() else 0.0
    at = int(np.argmax(size))
    if size[at] < max(8.0 * errors[at], 0.08, 6.0 * usual):
        return None
    return float(cycles.time[at]), float(size[at])


def one_sided(samples: SignalSamples, frequency: float) -> bool:
    """Return whether only the maxima or only the minima decay, as in a rectified or squared signal."""
    width = round(_SPAN * samples.sampling_frequency / frequency)
    count = samples.values.size // width
    if count < 3:
        return False
    parts = samples.values[: count * width].reshape(count, width)
    tops, bottoms = parts.max(1), parts.min(1)
    for high, low in ((tops, bottoms), (-bottoms, -tops)):
        falls = float(high[0] - high[-1])
        if falls > _FALLS * float(high[0] - low[0]) and abs(float(low[0] - low[-1])) < _LEVEL * falls:
            return bool(float(np.ptp(low)) < 2.0 * _LEVEL * falls)
    return False


def touching(ratio: _Array) -> _Array:
    """Describing function of a stop on one side, of stiffness and damping alike, by amplitude over its distance."""
    angle = np.arccos(1.0 / np.maximum(ratio, 1.0))
    return np.asarray((angle - np.sin(angle) * np.cos(angle)) / math.pi)


def courses(cycles: Cycles, frequency: float) -> list[Hypothesis]:
    """Hypotheses about amplitude and phase of a decay; none for less than 14 cycles.

    The phase of the cycles is a line, the integrals of a^2 and a^4 (softening, a the amplitude of the cycles as it is;
    the second is held to the size that goes with the first) and, where the frequency creeps at a steady rate, t^2.
    The logarithm of the amplitude is a line, and the integral of a (drag) or 1/a (friction).  A stop adds to both
    the integral of its describing function.  ``loss`` is the change of the decay rate, and ``shift`` that of the frequency
    over the record, relative to those of the straight lines.
    """
    t = cycles.time - cycles.time[0]
    if t.size < 14:
        return []
    a = cycles.amplitude / cycles.amplitude.max()
    x = t / t[-1]
    weight = cycles.amplitude / max(cycles.noise, 1e-9 * float(cycles.amplitude.max()))
    turns = 2.0 * math.pi * frequency * float(t[-1])
    line, creep = [np.ones_like(x), x], [x * x]
    soft, drag, friction = (
        [cumulative_trapezoid(a**power, x, initial=0.0) for power in powers]
        for powers in ((2, 4), (1,), (-1,))
    )

    def left(aim: _Array, columns: list[_Array]) -> tuple[float, _Array]:
        """Chi-square that columns leave, and their coefficients; the last of four that soften is held small."""
        basis = np.column_stack([*line, *columns]) * weight[:, None]
        scale = np.linalg.norm(basis, axis=0)
        held = np.zeros((1, scale.size))
        found = np.zeros(scale.size)
        for _ in range(2 if columns[:2] == soft else 1):  # q s^2, q of some 0.7, is known only after s is
            if columns[:2] == soft:
                held[0, 3] = 1.0 / max(_SECOND * (found[2] / turns) ** 2 * turns, 1e-6)
            rows, aims = np.vstack([basis, held]) / scale, np.append(aim * weight, 0.0)
            found = lstsq(rows, aims, rcond=1e-12)
            misfit, found = float(((aims - rows @ found) ** 2).sum()), found / scale
        return misfit, found

    fall = np.log(a)
    plain, none = zip(*(left(aim, []) for aim in (cycles.phase, fall)), strict=True)
    law = min(left(fall, columns)[0] + cost for columns, cost in (([], 0.0), (drag, 6.0), (friction, 6.0)))
    told = []
    for kind, columns in (("", soft), ("frequency_drift", creep), ("frequency_drift", [*soft, *creep])):
        misfit, found = left(cycles.phase, columns)
        numbers = {"start": float(found[1]) / turns, "shares": len(columns)}
        share = 2.0 * float(found[-1]) / turns if kind else 0.0
        told.append(Hypothesis(kind, sum(plain) - law - misfit, len(columns), 0.0, share, numbers))
    for level in _LEVELS[_LEVELS > 1.5 * a[-1]]:
        stop = [cumulative_trapezoid(touching(a / level), x, initial=0.0)]
        damps, slows = left(fall, stop)
        misfit, found = left(cycles.phase, stop)
        if found[2] > 0.0 > slows[2]:
            last = np.flatnonzero(a > 0.9 * level)[-1]
            numbers = {"until": float(cycles.time[min(last + 1, t.size - 1)]), "level_percent": 100.0 * level}
            free = float(abs(slows[1] / none[1][1] - 1.0)), float(abs(found[1] / none[0][1] - 1.0))
            told.append(Hypothesis("touches", sum(plain) - damps - misfit, 3, *free, numbers))
    rest = sum(plain) - np.array([one.gain for one in told])
    unit = float(rest.min()) / (2.0 * t.size)
    if unit > _EXPLAINED**2 and rest[:3].min() < _BETTER * rest.min():
        return []
    return [one._replace(gain=one.gain / max(unit, 1.0)) for one in told]


def steadied(samples: SignalSamples, share: float) -> SignalSamples:
    """A record whose frequency drifts by *share* from its first sample to its last, on a clock that drifts alike.

    The clock runs as t + share t^2/(2 T), T the length; the frequency is that of the first sample then.
    """
    t = samples.time - samples.time[0]
    clock = t + 0.5 * share * t * t / t[-1]
    even = np.arange(int(clock[-1] * samples.sampling_frequency + 1e-9) + 1) / samples.sampling_frequency
    values = CubicSpline(clock, samples.values)(even)
    return SignalSamples(values, samples.time[0] + even, samples.sampling_frequency)


@dataclass(frozen=True)
class Decay:
    """The free part of a record, cleaned; what was taken out of it, and what was found on the way.

    ``doubt`` is what a stop or a creeping frequency, which ``samples`` are without, leave in doubt.
    """

    samples: SignalSamples
    lines: tuple[Line, ...]
    diagnostics: tuple[Diagnostic, ...]
    doubt: Doubt


def dominant(samples: SignalSamples, low: float = 0.0, high: float | None = None) -> float:
    """Frequency [Hz] of the strongest decaying sine; a window that rises from zero would hide what decays fast."""
    n = samples.values.size
    values = samples.values - samples.values.mean()
    window = falling_window(n)
    values = values - float((values * window).sum() / window.sum())
    freq = np.fft.rfftfreq(4 * n, 1.0 / samples.sampling_frequency)
    # what passes fewer than eight times is rather a drift
    slow = np.minimum(freq * n / samples.sampling_frequency / _LEAST_CYCLES, 1.0) ** 2
    spectrum = np.abs(np.fft.rfft(values * window, 4 * n)) * slow
    top = samples.sampling_frequency / 2.0 if high is None else high
    floor = 1e-14 * float(np.abs(samples.values).max() + 1e-300)
    return highest_peak(freq, spectrum, (low, top), 3.0 * samples.sampling_frequency / n, floor)


def prepared(samples: SignalSamples, start: float | None, stop: float | None, known: bool = False) -> Decay:
    """Cut a record to its free decay, from *start* to *stop* [s] as far as given, without what does not belong to it.

    *known*: the softening is known beforehand.
    """
    low = samples.time[0] if start is None else finite("start", start)
    high = samples.time[-1] if stop is None else finite("stop", stop)
    inside = (samples.time >= low) & (samples.time <= high)
    if inside.sum() < 64:
        raise InputError(
            f"start = {low:g}, stop = {high:g}: hold {inside.sum()} samples of the signal, which runs from "
            f"{samples.time[0]:g} to {samples.time[-1]:g} s: must hold at least 64"
        )
    part = samples.part(inside)
    diagnostics: list[Diagnostic] = []
    frequency = dominant(part)
    if start is None:
        first = find_release(part, frequency)
        if first:
            part = part.part(slice(first, None))
            diagnostics.append(KINDS_DECAY["release"].found(start=float(part.time[0])))
            frequency = dominant(part)
    cycles = frequency * part.values.size / part.sampling_frequency
    if cycles < _LEAST_CYCLES:
        raise InputError(f"signal spans {cycles:.1f} cycles of {frequency:g} Hz: must span at least 8")
    if one_sided(part, frequency):
        diagnostics.append(KINDS_DECAY["one_sided"].found(half_hz=0.5 * frequency))
    part, told = _below_ceiling(part, frequency)
    diagnostics += told
    rate = _decay_rate(part, frequency)
    lines = find_lines(part, rate)
    clean = without_lines(part, lines)
    largest = max(float(np.percentile(np.abs(clean.values - np.median(clean.values)), 99)), 1e-300)
    for line in lines:
        share = 100.0 * line.amplitude / largest
        diagnostics.append(KINDS_DECAY["hum"].found(frequency=line.frequency, amplitude_percent=share))
    frequency = dominant(clean)
    rate = _decay_rate(clean, frequency)
    drift, degree = find_drift(clean, frequency, rate)
    if degree:
        clean = clean._replace(values=clean.values - drift)
        share = 100.0 * float(np.ptp(drift)) / largest
        diagnostics.append(KINDS_DECAY["drift"].found(drift_percent=share, degree=degree))
        frequency = dominant(clean)
    clean, told = _undisturbed(clean, frequency)
    clean, doubt, more = _on_course(clean, frequency, known)
    return Decay(clean, tuple(lines), (*diagnostics, *told, *more), doubt)


def _below_ceiling(samples: SignalSamples, frequency: float) -> tuple[SignalSamples, list[Diagnostic]]:
    """The decay from where its tops are no longer cut off."""
    until = find_ceiling(samples, frequency)
    if not until:
        return samples, []
    left = frequency * (samples.values.size - until) / samples.sampling_frequency
    if left < 1.5 * _LEAST_CYCLES:
        return samples, [KINDS_DECAY["clipped_throughout"].found()]
    rest = samples.part(slice(until, None))
    return rest, [KINDS_DECAY["clipped"].found(until=float(rest.time[0]))]


def _cycles(samples: SignalSamples, frequency: float) -> Cycles | None:
    """Cycles of the strongest mode; None where too few stand out of the noise."""
    try:
        return hilbert_cycles(samples, frequency, noise_level(samples))
    except InputError:
        return None


def _decay_rate(samples: SignalSamples, frequency: float) -> float:
    """Approximate decay rate [1/s] of the strongest mode; 0 if unknown."""
    try:
        cycles = hilbert_cycles(samples, frequency, noise_level(samples))
        mode = regress(cycles, float(samples.time[0]), "1", "hilbert", soften=False)
    except InputError:
        return 0.0
    return max(2.0 * math.pi * mode.natural_frequency * mode.damping_ratio, 0.0)


def _on_course(
    samples: SignalSamples, frequency: float, known: bool
) -> tuple[SignalSamples, Doubt, list[Diagnostic]]:
    """The decay without what a stop or a creeping frequency does to it, and the doubt that is left."""
    cycles = _cycles(samples, frequency)
    told = [] if cycles is None else courses(cycles, frequency)
    best, usual = best_of(told)
    if cycles is None or best is None:
        return samples, Doubt(), []
    certain = best.score - usual > _TOLD
    if certain and best.kind == "touches":
        numbers = best.numbers
        kept = samples.part(slice(int(np.searchsorted(samples.time, numbers["until"])), None))
        diagnostic = KINDS_DECAY["touches"].found(None, "", **numbers)
        if np.count_nonzero(cycles.time > numbers["until"]) < 1.5 * _LEAST_CYCLES:
            return samples, Doubt(best.shift, best.loss), [diagnostic]
        again, doubt, more = _on_course(kept, frequency, known)
        return again, doubt, [diagnostic, *(one for one in more if one.code != diagnostic.code)]
    if certain and best.kind and abs(best.shift) > _MATTERS:
        share = best.shift * float((samples.time[-1] - samples.time[0]) / (cycles.time[-1] - cycles.time[0]))
        creeps = KINDS_DECAY["frequency_drift"].found(share_percent=100.0 * share)
        return steadied(samples, share), Doubt(abs(share)), [creeps]
    # a softening that a creep explains as well
    pair = [one for one in told if one.numbers.get("shares", 0) in (1, 2)]
    if len(pair) < 2 or known:
        return samples, Doubt(), []
    behind = best.gain - next(one.gain for one in pair if one.kind)
    apart = abs(pair[0].numbers["start"] - pair[1].numbers["start"])
    softens = all(one.numbers["start"] > 1.0 for one in pair if not one.kind)
    apart *= math.sqrt(likely(-behind, 5.0)) if softens else 1.0
    return samples, Doubt(apart), []


def _undisturbed(samples: SignalSamples, frequency: float) -> tuple[SignalSamples, list[Diagnostic]]:
    """The decay up to a jump of its amplitude or phase, or from it on where that is longer."""
    cycles = _cycles(samples, frequency)
    jump = None if cycles is None else find_jump(cycles)
    if jump is None:
        return samples, []
    at, percent = int(np.searchsorted(samples.time, jump[0])), 100.0 * jump[1]
    margin = int(2.5 * samples.sampling_frequency / frequency)
    before, after = at - margin, samples.values.size - at - margin
    least = 1.5 * _LEAST_CYCLES * samples.sampling_frequency / frequency
    early = before >= least and before >= 0.4 * after
    kept, side = (
        samples.part(slice(0, before) if early else slice(at + margin, None)),
        "before" if early else "after",
    )
    if max(before, after) < least:
        kept, side = samples, "about"
    return kept, [KINDS_DECAY["disturbed"].found(told=side, at=jump[0], jump_percent=percent)]


class Centres(NamedTuple):
    """Modes to identify: frequencies [Hz]; the poles they are, and those near and far that are not asked for.

    Poles are empty where one mode was asked for and none had to be sought.
    """

    wanted: list[float]
    own: list[Pole]
    near: list[Pole]
    far: list[Pole]
    diagram: Stabilisation | None
    told: list[Diagnostic]


def find_centres(decay: Decay, count: int, asked: list[float] | None) -> Centres:
    """The modes wanted, and the others that the record holds."""
    samples = decay.samples
    span = samples.duration
    sigma = noise_level(samples)
    if asked is None and count == 1:
        center = dominant(samples)
        if center * span < 8.0:
            raise InputError(
                f"signal spans {center * span:.1f} cycles of {center:g} Hz: must span at least 8"
            )
        _stands_out(samples, center, sigma)
        return Centres([center], [], [], [], None, [])
    poles, diagram = find_poles(samples, sigma)
    modes = [
        one
        for one in poles
        if one.energy > ENERGY and one.damping_ratio > -1e-3 and one.frequency * span >= 8.0
    ]
    told: list[Diagnostic] = []
    wanted: list[float] = []
    own: list[Pole] = []
    if asked is None:
        if len(modes) < count:
            names = ", ".join(f"{pole.frequency:.4g} Hz" for pole in modes) or "none"
            raise InputError(f"signal: no further mode stands out of the noise (found: {names})")
        own = modes[:count]
        wanted = [pole.frequency for pole in own]
    for frequency in asked or ():
        near = [pole for pole in modes if abs(pole.frequency / frequency - 1.0) < _ASKED]
        if near:
            own.append(max(near, key=lambda pole: pole.energy))
            wanted.append(own[-1].frequency)
            continue
        hum = [line for line in decay.lines if abs(line.frequency / frequency - 1.0) < 2.5 * _ASKED]
        if hum:
            found = KINDS_DECAY["hum_asked"].found(asked=frequency, frequency=hum[0].frequency)
            raise InputError(f"signal: {found.message}")
        center = dominant(samples, 0.8 * frequency, 1.2 * frequency)
        _stands_out(samples, center, sigma)
        wanted.append(center)
        told.append(KINDS_DECAY["off_asked"].found(asked=frequency, found=center))
    others = [pole for pole in modes if pole not in own]
    close = [pole for pole in others if any(abs(pole.frequency / f - 1.0) < CLOSE for f in wanted)]
    near = [pole for pole in close if pole.energy > 0.003 * max(one.energy for one in own or close)]
    far = [pole for pole in others if pole not in close]
    return Centres(wanted, own, near, far, diagram, told)


def unexplained(residual: NDArray[np.float64], sampling_frequency: float) -> bool:
    """Return whether a residual contains an oscillation that noise does not explain."""
    n = residual.size
    window = falling_window(n)
    power = np.abs(np.fft.rfft(residual * window)) ** 2
    freq = np.fft.rfftfreq(n, 1.0 / sampling_frequency)
    power[freq * n < 6.0 * sampling_frequency] = 0.0
    # noise may be of any colour: each line against its surroundings
    width = max(min(power.size // 8, 101), 9) | 1
    around = median_filter(power, width, mode="nearest") / math.log(2.0)
    return bool((power > 25.0 * np.maximum(around, 1e-300)).any())


def _stands_out(samples: SignalSamples, frequency: float, sigma: float) -> None:
    """Refuse a peak of the spectrum that noise alone could make."""
    n = samples.values.size
    span = n / samples.sampling_frequency
    window = falling_window(n)
    values = samples.values - float((samples.values * window).sum() / window.sum())
    spectrum = np.abs(np.fft.rfft(values * window, 4 * n)) ** 2
    freq = np.fft.rfftfreq(4 * n, 1.0 / samples.sampling_frequency)
    floor = sigma**2 * float(np.sum(window**2))
    if spectrum[np.abs(freq - frequency) <= 1.0 / span].max() < 20.0 * floor:
        raise InputError("signal: no further mode stands out of the noise (found: none)")


# Analysers multiply records of hammer tests by exp(-t/T) to make them end in nothing.  What is left is the free decay
# of a mode that is damped more, by 1/(T omega_0): no number of the decay itself tells.  But the noise of the sensor,
# which does not decay, was multiplied too.


class NoiseFall(NamedTuple):
    """The noise falls at a ``rate`` [1/s], by a ``factor`` over the record, ``even``ly or as a fade-out does."""

    rate: float
    factor: float
    even: bool


def noise_fall(rest: SignalSamples, frequency: float, decay_rate: float) -> NoiseFall | None:
    """At which rate the noise of a record falls; None if it does not, or not in every part.

    The level of the noise in each eighth of the record is that of the lower quartile of its spectrum, which modes
    left in it do not reach; its logarithm must fall by more than five standard errors, and nowhere rise.  Where it
    falls along no straight line, the rate is the mean one while the mode is seen.

    *rest* is what a fit leaves; *frequency* [Hz] and *decay_rate* [1/s] are those of the first mode, and noise is
    sought above one and a half times the frequency.
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
    slope, base = polyfit(t, y, 1)
    off = float(np.sqrt(np.mean((y - base - slope * t) ** 2)))
    fall = -float(slope) * rest.values.size / rest.sampling_frequency
    lever = math.sqrt(float(((t - t.mean()) ** 2).sum()))
    certain = -float(slope) > _CERTAIN_NOISE_FALL * max(error, off) / lever
    straight = off < max(2.5 * error, 0.08 * fall)
    if certain and straight and fall > _FALL:
        return NoiseFall(-float(slope), math.exp(fall), True)
    fall = float(y[0] - y[-1])
    off = float(np.sqrt(np.mean((y - isotonic_regression(y, increasing=False).x) ** 2)))
    # noise under a fade-out falls faster and faster; what is left of other modes falls slower and slower
    late = float(y[_PARTS // 2] - y[-1]) > float(y[0] - y[_PARTS // 2])
    if fall < max(_FALL, _CERTAIN_NOISE_FALL * 1.5 * error) or off > 2.0 * error or not late:
        return None
    seen = np.exp(-decay_rate * t)
    rate = float(polyfit(t, y, 1, w=seen)[0])
    return NoiseFall(max(-rate, 0.0), math.exp(fall), False)


def undone(samples: SignalSamples, constant: float) -> SignalSamples:
    """A record before it was multiplied by an exponential window of *constant* [s] from its first sample on."""
    values: NDArray[np.float64] = samples.values * np.exp((samples.time - samples.time[0]) / constant)
    return samples._replace(values=values)
