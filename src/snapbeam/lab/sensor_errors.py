"""Errors of a vibrometer and its electronics that a sine fits without a trace: filters, crosstalk, saturation, units."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import BSpline
from scipy.signal import bilinear, butter, lfilter
from scipy.signal.windows import tukey
from scipy.special import logsumexp
from scipy.stats import chi2, norm

from snapbeam.lab.decay.poles import Line
from snapbeam.lab.diagnostics import KINDS_VIBROMETER
from snapbeam.lab.least_squares import sines, solve
from snapbeam.lab.signals import SignalSamples
from snapbeam.lab.sine_fit import SineFit
from snapbeam.util.diagnostics import Diagnostic
from snapbeam.util.singular_values import lstsq

_Array = NDArray[np.float64]
_SURE = 6.0  # standard errors
_LEAST = 0.003  # of the drive's amplitude
_ALIKE = 0.4  # of its amplitude by which it may differ between the halves of the rest
_ONE_SIDED = 0.8  # of the amplitude by which the mean may move
FALSE_ALARM_RATE = 1e-3
"""Rate of false alarms of one detector on one record, for normal noise."""
_LINES = 32  # lines of a spectrum, at least
_MATTERS = 0.004  # of the amplitude that an error must take, or move it by, to be of concern
_SHIFTS = 5e-4  # of the frequency
_HIDDEN = 0.1  # of the amplitude, above which an error does not go by with little evidence
_AHEAD = 10.0  # chi-square by which an error must better what is none
_CURVE_ERROR = 0.05  # of its harmonics by which a curve may differ from a family's
_COURSE = 8  # cycles of a course, at least
_CHANGES = 0.02  # of the amplitude, or rad, by which a steady motion may change
_EXPLAINS = 0.75  # of the odd harmonics that a curve must explain
_START = 20.0  # cycles of the start that a filter shapes
_CONTRADICTS = 40.0  # chi-square of what a start or a drive that no model describes to the noise leaves
_HOLE = 0.2  # of what a start shows of a notch, which noise without its hole may contradict
_SPREADS = 2.0  # standard deviations of chi-square that a start leaves by chance
_PASSES = 0.05  # of the drive that a filter must let pass for it to be seen at all
_BETWEEN = 0.02  # of a start, which filters between those that are tried leave
_CERTAIN = 20.0  # logarithm of the odds that noise or start alone may give
_BELIEVED = 0.25  # of the chi-square of a start, for starts are of more kinds than those that are modelled
_RARE = 0.02  # probability of a loss, up to which a standard error need not hold it
_WHITE = 0.2  # probability of white noise
_UNSEEN = 0.2  # of the standard error, up to which a filter that nothing shows is not thought of
_CONSTANT = 4  # cycles on either side of a jump
_FADES = (8.0, 30.0)  # rates of starts that are not over, over the length
_TAIL = 4.0  # cycles after the start-up whose transient is no noise
_MAINS = (50.0, 60.0, 100.0, 120.0)
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
    if size < max(_SURE * sure, _LEAST * fit.amplitude) or abs(one - other) > max(_ALIKE * size, 3.0 * error):
        return None
    return Line(fit.frequency, float(size), float(np.angle(whole)))


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


class Record(NamedTuple):
    """A record as detectors see it: its steady part, the sine fitted to it and what that leaves, and its cycles.

    ``early`` are the cycles before its start, ``rest`` its samples there, ``moving`` those from ``lead`` before it on.
    """

    fit: SineFit
    part: SignalSamples
    left: _Array
    lines: tuple[float, ...]
    times: _Array
    cycles: NDArray[np.complex128]
    early: NDArray[np.complex128]
    rest: _Array
    moving: SignalSamples
    lead: int
    clipped: bool


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

    @property
    def matters(self) -> bool:
        """True if it is an error that is to be told, and not only in the standard errors."""
        return bool(self.kind) and (self.loss > _MATTERS or self.shift > _SHIFTS)


def best_of(found: list[Hypothesis]) -> tuple[Hypothesis | None, float]:
    """The best hypothesis, and the score of the best of those by which nothing is wrong, at least 0."""
    usual = max([0.0, *(one.score for one in found if not one.kind)])
    return max(found, key=lambda one: one.score, default=None), usual


def find_errors(record: Record) -> list[Hypothesis]:
    """The best explanation of each detector, where it is not explained by chance; of a clipped record its converter's.

    What an error leaves is no noise and no clean course, so later groups of detectors are asked where the ones before
    found nothing that matters.
    """
    slow = np.asarray(np.polynomial.legendre.legvander(np.linspace(-1.0, 1.0, record.left.size), 3), dtype=np.float64)
    drift = slow @ solve(slow, record.left)
    # a zero that drifts is no noise; a drift of noise alone is left, for what it is taken out of is no longer that noise
    if float(drift @ drift) > float(chi2.isf(FALSE_ALARM_RATE, 4)) * record.fit.noise_rms**2:
        record = record._replace(left=record.left - drift)
    told: list[Hypothesis] = []
    for group in (
        (_converters, _jumps), (_curves, _courses), (_clocks, _jitter), (_filters,), (_hidden_filters,)
    ):  # fmt: skip
        if any(one.matters for one in told) or (record.clipped and group[0] is not _converters):
            break
        for detector in group:
            found = detector(record)
            best, usual = best_of(found)
            if best is None:
                continue
            if max(best.loss, best.shift) > 0.0 and best.score > (usual + _AHEAD if best.kind else 0.0):
                told.append(best)
                continue
            # an error that explains nearly as much is not told, but may be there; a large one would show elsewhere
            near = [one for one in found if one.score > max(best.score - _AHEAD, 0.0)]
            near = [one for one in near if one.loss < _HIDDEN or not one.kind]
            loss, shift = (max((getattr(one, name) for one in near), default=0.0) for name in ("loss", "shift"))
            if max(loss, shift) > 0.0:
                told.append(Hypothesis("", best.score, 1, loss, shift))
    return told


def _converters(record: Record) -> list[Hypothesis]:
    """Few levels, and samples put in between: no analogue noise has equal steps or three samples on a line."""
    values, amplitude = record.part.values, record.fit.amplitude
    levels = np.unique(np.round(values / (1e-6 * amplitude)))
    steps = amplitude / (1e-6 * amplitude * float(np.median(np.diff(levels)))) if levels.size > 1 else 0.0
    if levels.size < 0.02 * values.size and steps > 0.0:
        numbers = {"levels": float(levels.size), "steps": steps}
        return [Hypothesis("few_bits", math.inf, 1, 0.25 * steps**-1.5, numbers=numbers)]
    tiny = 1e-9 * amplitude
    for order in (1, 2):
        bent = np.abs(np.diff(values, order)) > tiny
        share = float(bent.mean()) / order
        if (np.lib.stride_tricks.sliding_window_view(bent, 3).all(1)).any():
            continue  # as flanks of a limited slew rate between round tops
        each = share * record.part.sampling_frequency / record.fit.frequency
        if share < 0.5 / order and each > 2.0:
            lost = 1.0 - float(np.sinc(1.0 / each)) ** order
            numbers = {"each": each, "loss_percent": 100.0 * lost}
            return [Hypothesis("interpolated", math.inf, 1, lost / (1.0 - lost), numbers=numbers)]
    return []


def _jumps(record: Record) -> list[Hypothesis]:
    """Gain or sign switched: the amplitude is constant over cycles before one of them, and another constant after it."""
    course = np.concatenate([record.early, record.cycles])
    if course.size < 4 * _CONSTANT:
        return []
    late = np.diff(record.cycles[record.cycles.size // 2 :], 2)
    # the fit may turn a little faster than its parts
    turns = float(np.median(np.angle(course[1:] * np.conj(course[:-1]))[record.early.size :]))
    course = course * np.exp(-1j * turns * np.arange(course.size))
    sd = float(np.median(np.abs(late))) / math.sqrt(6.0 * math.log(4.0)) + 1e-6 * record.fit.amplitude
    parts = np.lib.stride_tricks.sliding_window_view(course, _CONSTANT)
    mean = parts.mean(1)
    spread = np.ptp(np.abs(parts), axis=1) + np.ptp(np.unwrap(np.angle(parts)), axis=1) * np.abs(mean)
    before, after = mean[: -_CONSTANT - 1], mean[_CONSTANT + 1 :]
    jump = np.abs(after - before)
    constant = np.maximum(spread[: -_CONSTANT - 1], spread[_CONSTANT + 1 :]) < 0.15 * jump + 6.0 * sd
    size = np.minimum(np.abs(before), np.abs(after)), np.maximum(np.abs(before), np.abs(after))
    turned = np.abs(np.angle(after / np.where(before == 0.0, 1.0, before)))
    kinds = {"gain": turned < 0.2, "sign": (turned > np.pi - 0.2) & (size[0] > 0.5 * size[1])}
    seen = constant & (size[0] > np.maximum(8.0 * sd, 0.03 * size[1]))
    seen &= jump > np.maximum(12.0 * sd, 0.05 * size[1])
    told = []
    for kind, alike in kinds.items():
        at = np.flatnonzero(seen & alike)
        if at.size:
            k = int(at[np.argmax(jump[at])])
            off = [abs(abs(one) / record.fit.amplitude - 1.0) for one in (before[k], after[k])]
            time = float(record.times[0] + (k + _CONSTANT - record.early.size) / record.fit.frequency)
            numbers = {"at": time, "ratio": float(abs(after[k]) / abs(before[k]))}
            gain = 0.5 * _CONSTANT * float(jump[k]) ** 2 / sd**2
            starts = kind == "gain" and numbers["ratio"] > 1.0 and k + _CONSTANT - record.early.size < _START
            if not starts or _at_once(record, time):
                told.append(Hypothesis(kind, gain, 3, max(*off, 0.01), numbers=numbers))
    return told


def _at_once(record: Record, at: float) -> bool:
    """True if an amplitude changes from sample to sample about a time [s], as behind a switch, and rises over no part of a cycle.

    A shaker's start that pauses rises again as its control lets it.
    """
    drive = record.fit.frequency
    inside = np.abs(record.moving.time - at - 0.5 / drive) < 2.0 / drive
    cycles, values = (record.moving.time[inside] - at) * drive, record.moving.values[inside]
    if cycles.size < 16:
        return True
    waves = sines(cycles, [1.0, 2.0, 3.0])

    def left(length: float, middles: _Array) -> _Array:
        rests = []
        for middle in middles:
            late = np.clip((cycles - middle) / length + 0.5, 0.0, 1.0)[:, None]
            design = np.hstack([waves * (1.0 - late), waves[:, 1:] * late])
            rest = values - design @ solve(design, values)
            rests.append(float(rest @ rest))
        return np.array(rests)

    one = drive / record.moving.sampling_frequency
    middles = np.arange(-0.5, 1.5, max(1.0 / 40.0, one))
    about = middles[int(np.argmin(left(one / 2.0, middles)))]
    step = float(left(one / 2.0, about + np.arange(-1.0 / 40.0, 1.0 / 40.0 + one, one)).min())
    noise = step / max(cycles.size - 13, 1) + 1e-12 * record.fit.amplitude**2
    return step - min(left(length, middles).min() for length in (0.25, 0.5, 1.0, 1.5, 2.0)) < -_AHEAD * noise


@functools.cache
def _families() -> dict[str, tuple[_Array, NDArray[np.complex128]]]:
    """Loss of amplitude, and odd harmonics 3 to 9 over the first, of an amplifier's curves by their parameter."""
    turn = 2.0 * np.pi * np.arange(720) / 720
    wave = np.cos(turn)[:, None]
    drive = np.geomspace(0.1, 3.0, 60)
    dead = np.geomspace(2e-3, 0.3, 60)
    share = np.linspace(0.4, 0.998, 80)
    width = np.geomspace(2e-3, 0.15, 60)
    lagging, played = np.zeros((1440, share.size)), np.zeros((1440, width.size))
    for k in range(1440):
        now = wave[k % 720]
        lagging[k] = lagging[k - 1] + np.clip(now - lagging[k - 1], -share * turn[1], share * turn[1])
        played[k] = np.clip(played[k - 1], now - width, now + width)
    curves = {
        "saturated": np.hstack([np.tanh(drive * wave) / drive, np.arctan(drive * wave) / drive]),
        "crossover": np.sign(wave) * np.maximum(np.abs(wave) - dead, 0.0),
        "slew": lagging[720:],
        "hysteresis": played[720:],
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
    noise = _noise_at(record, fit.frequency * np.asarray(at + 1, dtype=np.float64)) / fit.amplitude
    third = 100.0 * abs(seen[0])
    own = abs(seen[0]) ** 2 / (float(noise[0]) ** 2 + (_CURVE_ERROR * float(np.linalg.norm(seen))) ** 2)
    told = [Hypothesis("", own, 2)]
    # the third harmonic is that of the curve, or the shaker has one of its own
    for skipped, freedom in ((0, 1), (1, 5)):
        part = seen[skipped:]
        variance = noise[skipped:] ** 2 + (_CURVE_ERROR * float(np.linalg.norm(part))) ** 2
        total = float((np.abs(part) ** 2 / variance).sum())
        for kind, (loss, templates) in _families().items():
            left = (np.abs(part[:, None] - templates[skipped : at.size]) ** 2 / variance[:, None]).sum(0)
            best = int(np.argmin(left))
            lost = float(loss[best] / (1.0 - loss[best]))
            numbers = {"third_percent": third, "loss_percent": 100.0 * lost}
            explained = total - float(left[best])
            if explained > _EXPLAINS * total:
                told.append(Hypothesis(kind, explained + own * skipped, freedom, lost, numbers=numbers))
    return told


def _noise_at(record: Record, frequencies: _Array) -> _Array:
    """Standard error of an amplitude at each frequency [Hz], from the residual about it."""
    n, rate = record.left.size, record.part.sampling_frequency
    power = np.abs(np.fft.rfft(record.left)) ** 2
    away = np.abs(np.arange(power.size) - (frequencies * n / rate)[:, None])
    near = (away > 2.0) & (away < 25.0)
    return np.asarray(np.sqrt(2.0 * (near * power).sum(1) / near.sum(1)) * math.sqrt(2.0) / n)


class _Filter(NamedTuple):
    """A filter of the electronics: numerator and denominator in i f/f_0, and f_0 [Hz]."""

    kind: str
    above: tuple[float, ...]
    below: tuple[float, ...]
    centre: float

    def response(self, frequency: ArrayLike) -> NDArray[np.complex128]:
        """Complex response at frequencies [Hz]."""
        turn = 1j * np.asarray(frequency) / self.centre
        return np.asarray(np.polyval(self.above, turn) / np.polyval(self.below, turn))

    def passed(self, waves: _Array, rate: float) -> _Array:
        """All that it makes of columns sampled at a rate [Hz]."""
        above, below = bilinear(self.above, self.below, rate / (2.0 * math.pi * self.centre))
        return np.asarray(lfilter(above, below, waves, axis=0))


def _candidates(drive: float) -> Iterator[_Filter]:
    """Filters that may lie in the chain: high-pass of first order, low-pass of the first four, notch at mains."""
    for corner in np.geomspace(0.02, 2.0, 24) * drive:
        yield _Filter("high_pass", (1.0, 0.0), (1.0, 1.0), float(corner))
    for order in (1, 2, 4):
        below = butter(order, 1.0, analog=True)[1]
        for corner in np.geomspace(0.5, 10.0, 16) * drive:
            yield _Filter("low_pass", (1.0,), tuple(below), float(corner))
    for centre in _MAINS:
        for quality in np.geomspace(1.0, 30.0, 24) if 0.6 < drive / centre < 1.6 else ():
            yield _Filter("notch", (1.0, 0.0, 1.0), (1.0, 1.0 / quality, 1.0), centre)


def _filters(record: Record) -> list[Hypothesis]:
    """Filters, by the spectrum of the noise about the drive and by what they make of the start of the motion.

    A high-pass is told only where the noise shows it, whatever it explains of the start: the suspension of a shaker and the
    control of its amplitude leave tails as filters do.  It is then one of the ``_hidden_filters``.  A notch is told where the
    noise shows it, or the start whatever its shape is.
    """
    drive = record.fit.frequency
    noise = _noise_misfit(record)
    plain = float(noise(None).min())
    # behind a notch at its own frequency the drive is gone but for the change of its amplitude, and it is there
    candidates = [one for one in _candidates(drive) if abs(one.response(drive)) > _PASSES]
    start, certain = _start_gains(record, candidates)
    limit = float(chi2.isf(FALSE_ALARM_RATE, 2))
    told = [Hypothesis("", 0.0, 1)]
    for one, gain in zip(candidates, start, strict=True):
        kept = max(float(abs(one.response(drive))), 1e-3)
        order = len(one.below) - 1
        numbers = {
            "corner": one.centre,
            "centre": one.centre,
            "loss_percent": 100.0 * (1.0 - kept),
            "limit": 0.05 * drive,
            "wanted": 20.0 * drive,
            "delay_ms": 1e3 * order / (2.0 * math.pi * one.centre),
        }
        shown = plain - float(noise(one).min())
        # a notch rings where its noise has a hole
        seen = shown > (-_HOLE * max(gain, 0.0) if one.kind == "notch" else -_CONTRADICTS)
        gain = shown + max(gain, -_CONTRADICTS) if seen else min(shown, 0.0)
        # what the start alone shows may be the shaker's own: it is not told
        own = shown < limit and (one.kind == "high_pass" or (one.kind == "notch" and certain < _CONTRADICTS))
        # of a high-pass nothing but what noise and start do not exclude (_hidden_filters)
        loss = 0.0 if own and one.kind == "high_pass" else 1.0 / kept - 1.0
        told.append(Hypothesis("" if own else one.kind, gain, 2, loss, numbers=numbers))
    return told


def _hidden_filters(record: Record) -> list[Hypothesis]:
    """The loss by a high-pass that noise and start do not exclude: in the standard error, and no doubt.

    It is the root of the mean square of what a filter takes, each as probable as noise and start make it, for as many
    records behind one as others, and at least such that no loss of some probability is rarer by the standard error.  The colour of the noise is any of those tried, so what noise behind a filter shows, white
    most of all, has little weight where it takes the one colour that the filter makes look so.  What no filter explains of a
    start excuses one, for it is of a kind that is not modelled.
    """
    if not record.early.size:
        return []
    drive = record.fit.frequency
    filters = [one for one in _candidates(drive) if one.kind == "high_pass"]
    misfit = _noise_misfit(record)
    noise = np.array([_weight(misfit(one)) for one in (None, *filters)])
    start, unexplained, freedom = _free_start(record, filters)
    excused = min(float(start.min()), 0.0) + max(unexplained - _SPREADS * math.sqrt(2.0 * freedom), 0.0)
    against = np.maximum(start, excused) - max(0.0, excused)
    odds = sum(np.clip(one, -_CERTAIN, _CERTAIN) for one in (noise[1:] - noise[0], -0.5 * _BELIEVED * against))
    odds = np.exp(odds) / len(filters)
    loss = np.array([1.0 / abs(one.response(drive)) - 1.0 for one in filters])
    odds /= 1.0 + odds.sum()
    share = odds * loss**2
    beyond = odds[::-1].cumsum()[::-1]
    held = loss[beyond > _RARE] / np.maximum(norm.isf(0.5 * beyond[beyond > _RARE]), 1.0)
    taken = max(math.sqrt(float(share.sum())), float(held.max(initial=0.0)))
    if taken < _UNSEEN * record.fit.amplitude_se / record.fit.amplitude:
        return []
    most = int(np.argmax(share))
    numbers = {"corner": filters[most].centre, "limit": 0.05 * drive, "taken_percent": 100.0 * taken}
    numbers["loss_percent"] = 100.0 * float(loss[most] / (1.0 + loss[most]))
    return [Hypothesis("high_pass_possible", math.inf, 1, taken, numbers=numbers)]


def _weight(misfit: _Array) -> float:
    """Logarithm of the likelihood of noise, by its misfit with each colour, the first of which is white."""
    weights = np.full(misfit.size, (1.0 - _WHITE) / max(misfit.size - 1, 1))
    weights[0] = _WHITE
    return float(logsumexp(-0.5 * misfit, b=weights)) if misfit.size > 1 else 0.0


def _free_start(record: Record, filters: list[_Filter]) -> tuple[_Array, float, int]:
    """Chi-square by which filters fit the first cycles worse than none, what the best leaves beyond noise, and the freedom.

    The motion behind each is a sine of any amplitude and phase that change over a cycle: its start at once, the tail behind
    a filter is no such sine.  It starts within a few samples of the onset, for those that a late one leaves out are all that a
    filter has seen before.  Noise is what the same sine leaves of the end of the record.
    """
    fit, moving = record.fit, record.moving
    every = max(int(moving.sampling_frequency / (40.0 * fit.frequency)), 1)
    ahead = record.lead // every
    begin = record.lead - ahead * every
    size = min(int(_START * moving.sampling_frequency / fit.frequency), moving.values.size - begin) // every
    first, last = (
        (part - fit.offset).reshape(size, every).mean(1)
        for part in (moving.values[begin : begin + size * every], moving.values[-size * every :])
    )
    rate = moving.sampling_frequency / every
    cycles = np.arange(size) * fit.frequency / rate
    knots = np.arange(math.ceil(cycles[-1]) + 1.0)
    inside = np.minimum(cycles, knots[-1] - 1e-9)
    course = BSpline.design_matrix(inside, np.pad(knots, 3, mode="edge"), 3).toarray()
    turn = np.exp(2j * math.pi * cycles)[:, None]
    waves = np.hstack([course * turn, turn**2, turn**3])
    # what it does within the sample in which it starts
    columns = np.hstack([waves.real, waves.imag, np.eye(size, 1)])
    freedom = size - columns.shape[1] - 1
    if freedom < 100:
        return np.zeros(len(filters)), 0.0, 1

    def left(values: _Array, one: _Filter | None, starts: range = range(1)) -> float:
        passed = columns if one is None else one.passed(columns, rate)
        rests = []
        for late in starts:
            design = np.vstack([np.zeros((late, columns.shape[1])), passed[: size - late]])
            own = np.linalg.qr(np.hstack([design, np.ones((size, 1))]))[0]
            rest = values - own @ (own.T @ values)
            rests.append(float(rest @ rest))
        return min(rests)

    starts = range(ahead + 2)
    plain = left(first, None, starts)
    colour = noise_colour(record.left, moving.sampling_frequency, fit.frequency) ** 2
    unit = colour * max(left(last, None) / freedom, 1e-12 * fit.amplitude**2)
    worse = (np.array([left(first, one, starts) for one in filters]) - plain) / unit
    return worse, max(plain / unit - freedom / colour + min(float(worse.min()), 0.0), 0.0), freedom


def _noise_misfit(record: Record) -> Callable[[_Filter | None], _Array]:
    """Twice the negative logarithm of Whittle's likelihood of the noise behind a response, for each of its colours.

    It is that of the noise beside the motion and of the noise at rest, of one colour and any strengths.  The first is white.
    """
    rate, drive = record.part.sampling_frequency, record.fit.frequency
    left = record.left[min(round(_TAIL * rate / drive), record.left.size // 4) :]
    n = left.size
    # a start that is not over is no noise
    wave = np.exp(2j * math.pi * drive / rate * np.arange(n)[:, None] - np.linspace(0.0, 1.0, n)[:, None] * _FADES)
    late = np.hstack([wave.real, wave.imag])
    found = (_noise_lines(record, one) for one in (left - late @ solve(late, left), record.rest))
    spectra = [one for one in found if one is not None]
    if not spectra:
        return lambda one: np.zeros(1)  # a computed signal has no noise that a filter shapes
    colours = [_colours(freq / drive) for freq, *_ in spectra]
    falling = colours[0][:, 0] >= colours[0][:, -1]
    weighed = [(count / one, np.log(one) @ count) for one, (_, _, count, _) in zip(colours, spectra, strict=True)]

    def misfit(one: _Filter | None) -> _Array:
        total = np.zeros(falling.size)
        for (freq, power, count, lines), (weights, shapes) in zip(spectra, weighed, strict=True):
            kept = np.ones_like(freq) if one is None else np.maximum(np.abs(one.response(freq)) ** 2, 1e-4)
            likely = count.sum() * np.log(weights @ (power / kept) / count.sum()) + shapes + count @ np.log(kept)
            total += 2.0 / lines * likely
        if one is not None and one.kind == "low_pass":
            total[~falling] = np.inf  # noise that rises and is filtered again would explain any hill
        return total

    return misfit


def _noise_lines(record: Record, noise: _Array) -> tuple[_Array, _Array, _Array, float] | None:
    """Frequencies, power and number of the lines of a noise, those of the motion left out, and lines over independent ones.

    None where there are too few.
    """
    rate, drive, n = record.part.sampling_frequency, record.fit.frequency, noise.size
    if n < 2 * _LINES:
        return None
    freq = np.fft.rfftfreq(n, 1.0 / rate)
    # without a taper, steep noise leaks from high frequencies over all lines
    taper = tukey(n, 0.6)
    lines = n * float((taper**4).sum()) / float((taper**2).sum()) ** 2
    power = np.abs(np.fft.rfft((noise - noise.mean()) * taper)) ** 2
    used = (freq > 2.5 * rate / n) & (freq < min(12.0 * drive, 0.4 * rate))
    for line in (*record.lines, *(drive * np.arange(1, 13))):
        used &= np.abs(freq - line) > 1.5 * rate / n
    freq, power = freq[used], power[used]
    if freq.size < 2 * _LINES or not power.min() > 1e-18 * n * record.fit.amplitude**2:
        return None
    # neighbours that differ in frequency by less than 1 % are averaged
    steps = np.arange(math.log(freq[-1] / freq[0]) / 0.00996)
    edges = np.unique(np.searchsorted(freq, freq[0] * 1.01**steps))
    count = np.diff(np.append(edges, freq.size))
    return np.add.reduceat(freq, edges) / count, np.add.reduceat(power, edges) / count, count, lines


def _colours(freq: _Array) -> _Array:
    """Power of noise of many colours, the first of which is white, over frequency in that of the drive."""
    slope, white = np.meshgrid(np.linspace(-2.0, 2.0, 65), [0.0, *np.geomspace(0.03, 30.0, 13)])
    straight = freq ** -slope.reshape(-1, 1) + white.reshape(-1, 1)
    slope, knee = np.meshgrid([0.5, 1.0], np.geomspace(0.03, 3.0, 17))
    bent = (freq**2 + knee.reshape(-1, 1) ** 2) ** (-0.5 * slope.reshape(-1, 1))
    # a resonance of the bench
    height, width, centre = np.meshgrid([1.0, 3.0, 10.0], [0.25, 0.5, 1.0], np.geomspace(0.1, 12.0, 24))
    away = np.log(freq / centre.reshape(-1, 1)) / width.reshape(-1, 1)
    humps = 1.0 + height.reshape(-1, 1) * np.exp(-0.5 * away**2)
    return np.vstack([np.ones_like(freq), straight, bent, humps])


def _start_gains(record: Record, filters: list[_Filter]) -> tuple[list[float], float]:
    """Chi-square that filters explain of the first cycles, as a shaker's exponential start-up behind each.

    A low-pass makes a start alike to a gentle one, so it is not judged by it.  With it, what the best notch explains
    whatever the shape of the start is.
    """
    fit, moving = record.fit, record.moving.part(slice(record.lead, None))
    every = max(int(moving.sampling_frequency / (40.0 * fit.frequency)), 1)
    count = min(int(_START * moving.sampling_frequency / fit.frequency), moving.values.size)
    time = moving.time[:count:every] - moving.time[0]
    if not record.early.size or time.size < 200:
        return [0.0] * len(filters), 0.0
    aim = moving.values[:count:every] - fit.offset
    turn = np.exp(2j * math.pi * fit.frequency * time)
    waves = [turn * np.exp(-time * rate) for rate in (0.0, 8.0, 40.0, 200.0)] + [turn**2, turn**3]
    columns = np.column_stack([part for wave in waves for part in (wave.real, wave.imag)])
    rate, slow = moving.sampling_frequency / every, np.column_stack([np.ones_like(time), time])

    def residual(one: _Filter | None) -> tuple[_Array, _Array]:
        design = np.hstack([columns if one is None else one.passed(columns, rate), slow])
        return design, aim - design @ solve(design, aim, 1e-10)

    def left(one: _Filter | None) -> float:
        rest = residual(one)[1][2:]
        return float(rest @ rest)

    def left_of_any(one: _Filter | None) -> float:
        """The least that a start of another shape leaves."""
        design, rest = residual(one)
        base = np.linalg.qr(design)[0]
        waves = _envelopes(fit.frequency * time)[..., None] * np.stack([turn.real, turn.imag], -1)[:, None]
        waves = waves.reshape(time.size, -1)
        waves = waves.copy() if one is None else one.passed(waves, rate)
        waves -= base @ (base.T @ waves)
        pairs = waves.reshape(time.size, -1, 2)
        gram, along = np.einsum("tki,tkj->kij", pairs, pairs), np.einsum("tki,t->ki", pairs, rest)
        gram += 1e-9 * time.size * np.eye(2)
        return float(rest[2:] @ rest[2:] - (along * np.linalg.solve(gram, along[..., None])[..., 0]).sum(1).max())

    plain = left(None)
    rests = np.array([plain if one.kind == "low_pass" else left(one) for one in filters])
    noise = time.size * max(fit.noise_rms, 1e-6 * fit.amplitude) ** 2
    gains: _Array = (plain - rests) * (time.size / noise)
    # a start that a filter does not explain to the noise is of another kind, and speaks for none
    unexplained = 2.0 * math.sqrt(2.0 / time.size) * noise + _BETWEEN * max(plain - noise, 0.0)
    gains = np.where(rests - noise < unexplained, gains, np.minimum(gains, 0.0))
    # only a notch rings long at another frequency, and what nothing explains is no noise
    notch = np.array([one.kind == "notch" for one in filters])
    certain = 0.0
    if notch.any():
        gains = np.where(notch, (plain - rests) * time.size / max(noise, float(rests.min())), gains)
        least = left_of_any(filters[int(np.argmin(np.where(notch, rests, np.inf)))])
        certain = (left_of_any(None) - least) * time.size / max(noise, least)
    # noise that drifts looks as the tail behind a high-pass
    slow_noise = noise_colour(record.left, record.part.sampling_frequency, fit.frequency) ** 2
    scale = [slow_noise if one.kind == "high_pass" else 1.0 for one in filters]
    return np.asarray(gains / scale).tolist(), certain


def _envelopes(cycles: _Array) -> _Array:
    """Starts of a shaker other than exponentials: linear, gentle and overshooting ones of many lengths, as columns."""
    found = []
    for length in np.geomspace(1.0, _START, 12):
        along = np.minimum(cycles / length, 1.0)
        found += [along, np.cos(np.pi * along)]
        for damping in (0.2, 0.4, 0.8):
            swing = np.pi * cycles / length
            found += [np.exp(-damping * swing) * np.cos(swing - late) for late in (0.0, math.atan(damping))]
    return np.column_stack(found)


def _clocks(record: Record) -> list[Hypothesis]:
    """Samples lost at even distances: the phase rises evenly and jumps by whole samples."""
    fit, n = record.fit, record.left.size
    turn = 2.0 * np.pi * fit.frequency * record.part.time + fit.phase
    stepped = _in_step(record)
    if stepped and max(stepped, key=lambda one: one.score).kind:
        return stepped
    phase = -2.0 * record.left * np.sin(turn) / fit.amplitude
    sample = 2.0 * np.pi * fit.frequency / record.part.sampling_frequency
    power = np.abs(np.fft.rfft(phase * np.hanning(n))) ** 2 * (8.0 / 3.0)
    power[:8] = 0.0
    at = int(np.argmax(power))
    noise = max(float(np.median(power)) / math.log(2.0), 1e-300)
    if power[at] < math.log(n / FALSE_ALARM_RATE) * noise:
        return stepped
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


def _in_step(record: Record) -> list[Hypothesis]:
    """Samples lost in step with the drive: the mean cycle jumps by as many samples, between all of its harmonics."""
    fit, rate = record.fit, record.part.sampling_frequency
    size = round(rate / fit.frequency)
    if abs(rate / fit.frequency - size) * fit.cycles > 0.5:
        return []
    rows = record.left.size // size
    mean = record.left[: rows * size].reshape(rows, size).mean(0)
    time = record.part.time[:size]
    turn = 2.0 * np.pi * (fit.frequency * time) * np.arange(1, fit.harmonic_amplitude.size + 1)[:, None]
    slope = -(fit.harmonic_amplitude * np.sin(turn + fit.harmonic_phase[:, None]).T).T
    fast = (slope * np.arange(1, slope.shape[0] + 1)[:, None]).sum(0) * 2.0 * np.pi / size
    own = sines(time, fit.frequency * np.arange(1, slope.shape[0] + 1))
    variance = fit.noise_rms**2 / rows
    told = [Hypothesis("", 0.0, 1)]
    for parts in (1, 2, 3, 4, 5):
        # (n + parts j/size) samples have gone by; their share that the fit took as a frequency is left out
        saw = np.mod(np.arange(size) * parts / size, 1.0) - 0.5
        waves = np.column_stack([-np.roll(saw, k) * fast for k in range(math.ceil(size / parts))])
        waves -= own @ lstsq(own, waves)
        strength = (waves * waves).sum(0)
        height = waves.T @ mean / strength
        gain = height**2 * strength / variance
        best = int(np.argmax(gain))
        if abs(height[best] - 1.0) < 0.25:
            numbers = {"lost": 1.0, "every": size / parts + 1.0, "share_percent": 100.0 * parts / size}
            shift = parts / (size + parts)
            told.append(Hypothesis("samples_lost", float(gain[best]), 5, shift, shift, numbers))
        else:
            told.append(Hypothesis("", float(gain[best]), 5))
    return told


def _jitter(record: Record) -> list[Hypothesis]:
    """Jitter of the sampling clock: noise that is strongest where the motion is fastest, at twice its frequency."""
    fit, n = record.fit, record.left.size
    turn = 2.0 * np.pi * fit.frequency * record.part.time + fit.phase
    power = record.left**2 - float((record.left**2).mean())
    lines = [2.0 * fit.frequency + k * fit.frequency * 0.5 / max(fit.cycles, 1.0) for k in range(8, 40)]
    about = np.abs(np.exp(-2j * np.pi * np.outer(lines, record.part.time)) @ power) ** 2
    seen = complex(np.exp(-2j * turn) @ power)
    noise = max(float(np.mean(about)), 1e-300)
    jitter = -4.0 * seen.real / n / fit.amplitude**2
    if jitter <= 0.0:
        return []
    loss = 0.5 * jitter
    jitter_us = 1e6 * math.sqrt(jitter) / (2.0 * math.pi * fit.frequency)
    numbers = {"jitter_us": jitter_us, "loss_percent": 100.0 * loss}
    return [
        Hypothesis("jitter", 2.0 * seen.real**2 / noise, 1, loss, numbers=numbers),
        Hypothesis("", 2.0 * seen.imag**2 / noise, 1),
    ]


def _courses(record: Record) -> list[Hypothesis]:
    """Amplitude and phase over the steady part: constant, drifting, or bent as by a line too close to be parted."""
    inside = (record.times > record.fit.start) & (record.times < record.fit.stop)
    cycles, t = record.cycles[inside], record.times[inside]
    if t.size < _COURSE or not np.abs(cycles).min() > 0.0:
        return []
    degree = min(5, t.size // 3)
    basis = np.polynomial.legendre.legvander(2.0 * (t - t[0]) / (t[-1] - t[0]) - 1.0, degree)
    course = np.log(np.abs(cycles)), np.unwrap(np.angle(cycles))
    bends = [np.diff(one, 2) for one in course]
    noise = [1.4826 * float(np.median(np.abs(one - np.median(one)))) / math.sqrt(6.0) + 1e-9 for one in bends]
    # of few cycles the scatter may be small by chance
    white = record.fit.noise_rms / record.fit.amplitude * math.sqrt(2.0 * t.size / record.fit.samples)
    noise = [max(one, white) for one in noise]
    found = [lstsq(basis, one) for one in course]
    size = np.linalg.norm(basis, axis=0)
    gain = [(coefficients * size / sd) ** 2 for coefficients, sd in zip(found, noise, strict=True)]
    found[0][0] = found[1][0] = found[1][1] = 0.0
    change, bend = (float(np.ptp(basis @ coefficients)) for coefficients in found)
    smooth = float(np.ptp(basis[:, :4] @ found[0][:4]))  # a drift, or a start-up that is not over
    kinds = ("drifts", "beat", "clock_drifts") if max(change, bend) > _CHANGES else ("", "", "")
    span = float(t[-1] - t[0]) * record.fit.frequency
    numbers = {"change_percent": 100.0 * change, "bend": bend}
    turned = 6.0 * float(np.abs(found[1][2:4]).sum()) / (2.0 * np.pi * span)
    slow = float(gain[0][1:4].sum()) if smooth > 0.8 * change else 0.0
    close = float(gain[0][1:].sum() + gain[1][2:].sum()) if bend > _CHANGES and change > 0.1 * bend else 0.0
    pulled = math.hypot(change, bend) / (2.0 * np.pi * span)
    clock = numbers | {"share_percent": 200.0 * turned}
    return [
        Hypothesis(kinds[0], slow, 3, 0.5 * change, numbers=numbers),
        Hypothesis(kinds[1], close, 2 * degree - 1, 0.5 * change, pulled, numbers),
        Hypothesis(kinds[2], float(gain[1][2:4].sum()), 2, 0.0, turned, clock),
    ]


def beside_acceleration(fit: SineFit, units: str, acceleration: SineFit) -> list[Diagnostic]:
    """Diagnostics of a sine of displacement or velocity, against the acceleration of the same shaker."""
    clocks = acceleration.frequency / fit.frequency
    unsure = 6.0 * (fit.frequency_se + acceleration.frequency_se) / fit.frequency
    if abs(clocks - 1.0) > max(_SAME_RATE, unsure):
        numbers = {"own": fit.frequency, "other": acceleration.frequency, "ratio": clocks}
        return [KINDS_VIBROMETER["clocks"].found(None, "", **numbers)]
    omega = 2.0 * math.pi * fit.frequency
    ratio = acceleration.amplitude / (omega * fit.amplitude * (omega if units == "m" else 1.0))
    if abs(ratio - 1.0) < _AGREE:
        return []
    read = "a velocity was read as a displacement", 1.0 / omega
    if units == "m/s":
        read = "a displacement was read as a velocity", omega
    told = []
    for cause, factor in (read, *_UNITS.items()):
        exponent = math.log10(ratio / (factor or 1.0))
        tens = round(exponent) if cause == read[0] or factor is None else 0.0
        if abs(exponent - tens) < math.log10(1.0 + _AGREE):
            told.append(cause)
    words = " or ".join(told) or "look at sensitivity (--sensitivity), units (--units) and channels (--channel)"
    return [KINDS_VIBROMETER["acceleration"].found(told=words, ratio=ratio)]


def beyond_shakers(fit: SineFit, units: str) -> list[Diagnostic]:
    """Diagnostics for a sine beyond the speed, acceleration or stroke of electrodynamic shakers."""
    omega = 2.0 * math.pi * fit.frequency
    speed = fit.amplitude if units == "m/s" else omega * fit.amplitude
    hard, far = speed * omega, speed / omega
    limits = {
        f"{speed:.3g} m/s are above {_FASTEST:g} m/s": speed > _FASTEST,
        f"{hard / _G:.3g} g are above {_HARDEST / _G:.3g} g": hard > _HARDEST,
        f"{1e3 * far:.3g} mm are above {1e3 * _FARTHEST:g} mm": far > _FARTHEST,
    }
    if not any(limits.values()):
        return []
    told = ", ".join(words for words, beyond in limits.items() if beyond)
    numbers = {"speed": speed, "acceleration_g": hard / _G, "travel_mm": 1e3 * far}
    return [KINDS_VIBROMETER["beyond_shakers"].found(None, told, **numbers)]
