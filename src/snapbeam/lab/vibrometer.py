"""Analysis of a laser vibrometer signal of the shaker: steady sine, start-up transient, signal errors.

The paper accepts a test when the signal-to-noise ratio of the shaker's velocity exceeds 15 dB, and names the
start-up transient as a cause of disagreement with simulations (sections 2 and 4.1).
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.lab.decay.poles import Line, without_lines
from snapbeam.lab.diagnostics import KINDS_VIBROMETER, holding
from snapbeam.lab.least_squares import covariance, phasors, sines, solve, widened
from snapbeam.lab.sensor_errors import (
    Record,
    beside_acceleration,
    beyond_shakers,
    find_crosstalk,
    find_errors,
    noise_colour,
    one_sided,
)
from snapbeam.lab.signals import SignalSamples, check_signal, make_signal, stretches
from snapbeam.lab.sine_fit import (
    Clipping,
    Flaw,
    SineFit,
    find_clipping,
    find_flaws,
    fit_sine,
    sound_samples,
    spectral_peak,
    stuck_runs,
)
from snapbeam.util.diagnostics import Diagnostic, diagnostics_of, doubtful
from snapbeam.util.singular_values import lstsq, polyfit
from snapbeam.util.validation import InputError, finite, positive, within

if TYPE_CHECKING:
    import xarray as xr


_PULLED = 1.8  # times the noise by which phases off a line are no chance
_SMOOTH = 0.6  # of twice the variance, which the square of steps has on average where parts are by chance
_IN_A_ROW = 5  # steady cycles that end a start-up
_Array = NDArray[np.float64]
_MOST = 4
_HARMONICS = 10
_ABOVE = 16.0  # times the power about it by which a line stands out
_LEAST = 0.005  # of the drive's amplitude
_HUM_ALIKE = 0.35  # of a hum's amplitude by which it may differ at rest
_SURE = 0.25  # of its amplitude to which a line must be known at rest
_NOISE_FLOOR = 1e-6
"""Minimum noise over the amplitude, which prevents rounding errors in the search for the onset."""
_DEGREES = (0, 1, 2, 3, 5)
_LONGEST = 4000  # samples that are fitted
SNR_LIMIT = 15.0
_STEADY = 0.03  # share by which the cycles of a steady motion may stray
_SAME_LINE = 0.02  # of the frequency by which the highest line may differ
_BRIDGED = 5  # frames
_LEAD = 0.1  # cycles by which a start may lie before its onset


def _late_fit(samples: SignalSamples, first: int, last: int, frequency: float) -> SineFit:
    """The sine of the last two thirds of a motion, twice fitted: the second time without its flaws."""
    part = samples.part(slice(first + (last - first) // 3, last))
    fit = fit_sine(part, frequency, 3)
    flaws = find_flaws(part, fit)
    keep = sound_samples(part.values.size, flaws)
    return fit if not flaws or keep.mean() < 0.5 else fit_sine(part, fit.frequency, 3, keep=keep)


def steady_fit(samples: SignalSamples, frequency: float) -> tuple[SineFit, list[Flaw], Clipping]:
    """The steady sine without dropouts and cut tops, these, and the levels at which tops are cut."""
    fit = fit_sine(samples, frequency)
    flaws: list[Flaw] = []
    for _ in range(3):
        found = find_flaws(samples, fit)
        keep = sound_samples(samples.values.size, found)
        if not found or keep.mean() < 0.5:
            break
        flaws, fit = found, fit_sine(samples, fit.frequency, keep=keep)
    clipping = find_clipping(samples, fit)
    if not clipping.found:
        return fit, flaws, clipping
    # what a sine leaves of cut tops is no flaw of another kind
    cut = clipping.touches(samples.values)
    keep = ~cut
    if keep.mean() < 0.25:
        return dataclasses.replace(fit, amplitude_se=0.5 * fit.amplitude), [], clipping
    inner = fit_sine(samples, fit.frequency, 1, keep=keep)
    whole = samples._replace(values=np.where(cut, inner.waveform(samples.time), samples.values))
    flaws = find_flaws(whole, inner, keep)
    keep &= sound_samples(keep.size, flaws)
    if flaws and keep.mean() > 0.25:
        inner = fit_sine(samples, fit.frequency, 1, keep=keep)
    doubt = max(inner.amplitude_se, 0.01 * inner.amplitude, 0.15 * abs(inner.amplitude - fit.amplitude))
    restored = dataclasses.replace(
        fit, amplitude=inner.amplitude, amplitude_se=doubt,
        phase=inner.phase, phase_se=max(inner.phase_se, fit.phase_se),
        offset=inner.offset, offset_se=max(inner.offset_se, 0.5 * abs(inner.offset - fit.offset)),
        frequency=inner.frequency, frequency_se=max(inner.frequency_se, fit.frequency_se),
        harmonic_amplitude=np.append(inner.harmonic_amplitude[:1], fit.harmonic_amplitude[1:]),
        harmonic_phase=np.append(inner.harmonic_phase[:1], fit.harmonic_phase[1:]),
    )  # fmt: skip
    return restored, flaws, clipping


def settled_cycles(cycles: NDArray[np.complex128], tol: float) -> tuple[int, float]:
    """Cycles of the start-up, and the share of cycles that stray from the steady sine after it."""
    settled = 0
    ok = np.ones(cycles.size, dtype=bool)
    for _ in range(3):
        late = cycles[max(settled, cycles.size // 3) :]
        reference = np.median(late.real) + 1j * np.median(late.imag)
        ok = np.abs(cycles / reference - 1.0) <= tol
        runs = np.convolve(ok, np.ones(_IN_A_ROW), mode="valid") > _IN_A_ROW - 0.5
        first = np.flatnonzero(runs[: max(cycles.size // 2, 1)])
        settled = int(first[0]) if first.size else cycles.size // 2
    return settled, float(np.mean(~ok[settled:])) if ok[settled:].size else 0.0


def with_wander(
    steady: SineFit,
    times: _Array,
    cycles: NDArray[np.complex128],
    flaws: list[Flaw],
    samples: SignalSamples,
    begin: float,
) -> tuple[SineFit, float]:
    """The sine with standard errors that hold its wandering, and by what share its parts stray."""
    used = (times >= begin) & (times < steady.stop)
    for flaw in flaws:
        low, high = samples.time[flaw.first], samples.time[min(flaw.last, samples.time.size - 1)]
        used &= (times < low - 1.0 / steady.frequency) | (times > high + 1.0 / steady.frequency)
    if used.sum() < 16:
        return steady, 0.0
    parts = [np.abs(part).mean() for part in np.array_split(cycles[used], 8)]
    spread = float(np.std(parts, ddof=1)) / math.sqrt(_counts(np.array(parts)))
    wander = float(np.std(np.abs(cycles[used]))) / steady.amplitude
    return dataclasses.replace(
        steady,
        amplitude_se=max(steady.amplitude_se, spread),
        frequency_se=max(steady.frequency_se, _pulling(times[used], cycles[used])),
    ), wander


def _pulling(times: _Array, cycles: NDArray[np.complex128]) -> float:
    """Standard error [Hz] of the mean of a frequency that wanders; 0 where phases stay on a line within their noise.

    The phase is averaged over eighths of the record, and the frequencies from one to the next scatter.
    """
    phase = np.unwrap(np.angle(cycles)) / (2.0 * math.pi)

    def off_line(x: _Array, y: _Array) -> _Array:
        return np.asarray(y - np.polyval(polyfit(x - x.mean(), y, 1), x - x.mean()))

    parts = np.array_split(np.arange(phase.size), 8)
    at, mean = (np.array([values[part].mean() for part in parts]) for values in (times, phase))
    lefts = [off_line(times[part], phase[part]) for part in parts]
    own = [float(np.std(left, ddof=2)) / math.sqrt(left.size) if left.size > 2 else math.inf for left in lefts]
    if float(np.sqrt(np.mean(off_line(at, mean) ** 2))) < _PULLED * float(np.sqrt(np.mean(np.square(own)))):
        return 0.0
    rates = np.diff(mean) / np.diff(at)
    return float(np.std(rates, ddof=1)) / math.sqrt(_counts(rates))


def _counts(parts: _Array) -> float:
    """Effective number of independent parts of a signal: all, or one if they vary smoothly.

    A slow change, as the beat of two lines too close to be parted, is no scatter that a mean evens out.
    """
    about = parts - parts.mean()
    total = float((about * about).sum())
    steps = float((np.diff(parts) ** 2).sum())
    return 1.0 if total > 0.0 and steps < _SMOOTH * total else float(parts.size)


class DriveLines(NamedTuple):
    """Lines that are there at rest as well (``hum``), and those ``beside`` the drive that are not, or may not be."""

    hum: tuple[Line, ...]
    beside: tuple[Line, ...]


def find_drive_lines(samples: SignalSamples, first: int, last: int, rough: SineFit) -> DriveLines:
    """Lines beside a drive and its harmonics, of more than half a percent of its amplitude.

    They are sought in what the sine leaves of the steady motion, from *first* to *last* sample, and their frequencies
    fitted together with its own.  Hum goes on with the same amplitude and phase through the rest before the start; a
    record without such a rest cannot tell it from a motion.
    """
    begin = first + (last - first) // 3
    part = samples.part(slice(begin, last))
    sound = sound_samples(part.values.size, find_flaws(part, rough))
    rest = slice(0, max(first - 3 * round(samples.sampling_frequency / rough.frequency), 0))
    own = [rough.frequency]
    for _ in range(_MOST):
        peak = _peak(_left(part, own, sound)[0], part.sampling_frequency, rough)
        if peak is None:
            break
        own = _refined(part, [*own, peak], sound)
        apart = min(abs(own[-1] - f) for f in own[:-1])
        if apart * part.values.size < 0.5 * part.sampling_frequency:
            return DriveLines((), ())  # two that cannot be parted are a motion that wanders
    found = own[1:]
    if not found:
        return DriveLines((), ())
    moving = phasors(_left(part, own, sound)[1])[1 : 1 + len(found)]
    still, error = _at_rest(samples, rest, found)
    hum: list[Line] = []
    beside: list[Line] = []
    for frequency, here, there, unsure in zip(found, moving, still, error, strict=True):
        line = Line(frequency, abs(here), float(np.angle(here)))
        alike = abs(here - there) < max(_HUM_ALIKE * abs(here), 4.0 * unsure)
        (hum if unsure < _SURE * abs(here) and alike else beside).append(line)
    return DriveLines(tuple(hum), tuple(line for line in beside if line.amplitude > 2.0 * _LEAST * rough.amplitude))


def beside_lines(steady: SineFit, lines: DriveLines) -> SineFit:
    """A sine whose standard errors hold what *lines* beside it may pull: a share 1/(pi df T) of their amplitude."""
    span = steady.stop - steady.start
    pull = math.hypot(
        0.0,
        *(line.amplitude / max(1.0, math.pi * abs(line.frequency - steady.frequency) * span) for line in lines.beside),
    )
    if pull == 0.0:
        return steady
    share = pull / steady.amplitude
    return widened(steady, amplitude=(pull,), phase=(share,), frequency=(share / span,))


def _left(part: SignalSamples, frequencies: list[float], sound: NDArray[np.bool_]) -> tuple[_Array, _Array]:
    """Residual of a signal after subtraction of lines, 0 at invalid samples, and the amplitudes of the lines."""
    harmonics = frequencies[0] * np.arange(2, _HARMONICS + 1)
    design = sines(part.time, np.append(frequencies, harmonics))
    solution = solve(design[sound], part.values[sound], 1e-12)
    left: _Array = np.asarray(part.values - design @ solution, dtype=np.float64)
    left[~sound] = 0.0
    return left, solution


def _peak(left: _Array, rate: float, rough: SineFit) -> float | None:
    """Frequency of the highest significant line of a spectrum, or None."""
    n = left.size
    window = np.hanning(n)
    spectrum = np.abs(np.fft.rfft(left * window)) * 2.0 / window.sum()
    freq = np.fft.rfftfreq(n, 1.0 / rate)
    step = rate / n
    spectrum[freq < 4.0 * step] = 0.0
    at = int(np.argmax(spectrum))
    near = (np.abs(freq - freq[at]) < 40.0 * step) & (np.abs(freq - freq[at]) > 4.0 * step)
    near &= freq > 4.0 * step
    if spectrum[at] < _LEAST * rough.amplitude or near.sum() < 16:
        return None
    about = float(np.median(spectrum[near] ** 2)) / math.log(2.0)
    # noise that falls or has a hill is higher at the line than about it
    away, power = np.log(freq[near] / freq[at]), np.log(spectrum[near] ** 2)
    course = np.polynomial.polynomial.polyfit(away, power, 2 if away.min() < 0.0 < away.max() else 1)
    about = max(about, math.exp(course[0] + np.euler_gamma))
    return float(freq[at]) if spectrum[at] ** 2 > _ABOVE * about else None


def _refined(part: SignalSamples, frequencies: list[float], sound: NDArray[np.bool_]) -> list[float]:
    """Frequencies of lines by least squares, amplitudes eliminated."""
    from scipy.optimize import least_squares

    step = part.sampling_frequency / part.values.size
    start = np.array(frequencies)

    solved = least_squares(
        lambda off: _left(part, (start + step * off).tolist(), sound)[0],
        np.zeros(start.size),
        bounds=(-1.5, 1.5),
        x_scale=0.1,
        diff_step=1e-3,
        max_nfev=15,
    )
    return [float(f) for f in start + step * solved.x]


def _at_rest(samples: SignalSamples, rest: slice, frequencies: list[float]) -> tuple[NDArray[np.complex128], _Array]:
    """Complex amplitudes of lines before the motion, and their standard errors; infinite without such a rest."""
    time, values = samples.time[rest], samples.values[rest]
    count = len(frequencies)
    if time.size < 8 * (2 * count + 1) or (time[-1] - time[0]) * min(frequencies) < 1.0:
        return np.zeros(count, dtype=np.complex128), np.full(count, math.inf)
    design = sines(time, frequencies)
    solution = solve(design, values, 1e-12)
    spread = float(np.std(values - design @ solution)) * np.sqrt(np.diag(covariance(design, 1e-12)))
    return phasors(solution), np.hypot(spread[1::2], spread[2::2])


# From the start on the motion is a sine whose amplitude and phase are polynomials of time, of degree 0 to 5;
# before it there is rest.  The likelihood of every instant follows from a linear least squares fit; degrees are
# weighed by the Bayesian information criterion, so a start that could be a jump or a ramp has the spread of
# both.


def _level(samples: SignalSamples, frequency: float, width: int) -> _Array:
    """Amplitude of the motion at *frequency* over a cycle from each sample on."""
    turn = np.exp(-2j * math.pi * frequency * (samples.time - samples.time[0]))
    total = np.concatenate(([0.0], np.cumsum((samples.values - np.median(samples.values)) * turn)))
    level: _Array = 2.0 * np.abs(total[width:] - total[:-width]) / width
    return level


def _moving(samples: SignalSamples, frequency: float, width: int) -> NDArray[np.bool_]:
    """Samples from which on a cycle oscillates at *frequency*, above 30 % of the level."""
    level = _level(samples, frequency, width)
    return np.asarray(level > 0.3 * np.quantile(level, 0.9))


def moving_part(samples: SignalSamples, frequency: float) -> tuple[int, int]:
    """First and last (exclusive) sample of the longest stretch that oscillates at *frequency*.

    Gaps of less than ten cycles are no end of the motion.
    """
    n = samples.values.size
    width = max(3, round(samples.sampling_frequency / frequency))
    if width >= n:
        return 0, n
    joined: list[tuple[int, int]] = []
    for first, last in stretches(_moving(samples, frequency, width)):
        if joined and first - joined[-1][1] < 10 * width:
            joined[-1] = (joined[-1][0], last)
        else:
            joined.append((first, last))
    start, stop = max(joined, key=lambda run: run[1] - run[0])
    return start, min(stop + width - 1, n)


def moves_outside(samples: SignalSamples, frequency: float, first: int, last: int) -> float:
    """Duration [s] of oscillation at *frequency* before *first* and after *last*."""
    width = max(3, round(samples.sampling_frequency / frequency))
    if width >= samples.values.size:
        return 0.0
    on = _moving(samples, frequency, width)
    on[max(first - width, 0) : last + width] = False
    return float(np.count_nonzero(on)) / samples.sampling_frequency


def find_onset(samples: SignalSamples, first: int, rough: SineFit) -> tuple[float | None, float]:
    """Time [s] the motion starts and its standard error; None where the record begins in motion.

    *first* is the first sample of the moving part, up to a few cycles off.
    """
    width = round(samples.sampling_frequency / rough.frequency)
    if first < max(8, width // 8):
        return None, 0.0
    early = _quiet_end(samples, first, rough, width)
    quiet = samples.values[: max(early, 8)]
    if early < 8 or float(np.std(quiet)) > 0.35 * rough.amplitude:
        return None, 0.0
    rest = _baseline(samples.time[: quiet.size], quiet)
    left = quiet - rest(samples.time[: quiet.size])
    noise = float(np.std(left)) * noise_colour(left, samples.sampling_frequency, rough.frequency)
    noise = max(noise, _NOISE_FLOOR * rough.amplitude)
    begin = max(early - 2 * width, 0)
    end = min(first + 2 * width, samples.values.size)
    every = max(1, (end - begin) // _LONGEST)
    time = samples.time[begin:end:every]
    values = samples.values[begin:end:every] - rest(time)
    if time.size < 16:
        return None, 0.0
    possible = (time >= samples.time[max(early - width, 0)]) & (time < time[-1] - 0.7 / rough.frequency)
    candidates = time[possible]
    coarse = candidates[:: max(1, candidates.size // 160)]
    scans = [_scan(time, values, coarse, rough.frequency, degree, noise) for degree in _DEGREES]
    step = float(coarse[1] - coarse[0]) if coarse.size > 1 else 1.0 / samples.sampling_frequency
    # once more about the best instants, sample by sample
    best = np.array([coarse[int(np.argmin(scan))] for scan in scans])
    near = (np.abs(candidates[:, None] - best) <= 2.0 * step).any(1)
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
    whole = sure > 2 * width
    noise = (1.4826 if whole else 1.0) * float(np.median(level[: sure if whole else max(first - width, 1)]))
    limit = max(3.0 * noise, 0.01 * rough.amplitude)
    below = np.flatnonzero(level[: max(first - width // 4, 1)] < limit)
    return int(below[-1]) if below.size else 0


def _scan(time: _Array, values: _Array, starts: _Array, frequency: float, degree: int, noise: float) -> _Array:
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


def _weighed(starts: _Array, scans: list[_Array], count: int, step: float, width: float) -> tuple[float, float]:
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
    penalty = 2.0 * (np.array(_DEGREES)[:, None] + 1) * math.log(count)
    table = (np.array(scans) - least) / unit + penalty
    share = np.exp(-0.5 * (table - table.min())) * spacing
    share /= share.sum()
    mean = float((share * starts).sum())
    spread = math.sqrt(float((share * (starts - mean) ** 2).sum()))
    return mean, math.hypot(1.25 * spread, 0.5 * step)  # a quarter more: the likelihood has many hills


@dataclass(frozen=True)
class StartUp:
    """Start-up transient of the shaker.

    ``onset`` [s] and its uncertainty; ``duration`` [s] and ``cycles`` until amplitude and phase stay within
    ``tolerance`` of the steady sine; ``overshoot``, the largest amplitude of a cycle over the steady one,
    less 1 (0 if none exceeds it by more than the tolerance); ``first_cycle_ratio``, the amplitude of the
    first cycle over the steady one.
    """

    onset: float
    onset_uncertainty: float
    duration: float
    cycles: float
    overshoot: float
    first_cycle_ratio: float
    tolerance: float

    @property
    def description(self) -> str:
        """The start-up in words."""
        first = f"first cycle {self.first_cycle_ratio:.3g} times the steady amplitude"
        text = f"starts at {self.onset:.6g} s; {first}"
        if self.duration == 0.0:
            return f"{text}; steady at once (within {self.tolerance:.0%})"
        over = f", overshoot {self.overshoot:.1%}" if self.overshoot > 0.0 else ", no overshoot"
        return f"{text}; steady within {self.tolerance:.0%} after {self.cycles:.0f} cycle(s){over}"


@dataclass(frozen=True)
class DriveMeasurement:
    """The measured motion of the shaker.

    ``steady`` is the sine fitted after the start-up; ``startup`` is None where the record begins in motion; ``stop``
    [s] is the end of motion or record; ``cycle_time`` [s] and ``cycle_amplitude`` follow the cycles; ``accepted``:
    ``steady.sinad`` exceeds ``snr_limit`` [dB]. ``flaws`` are samples (first, one past the last) outside the motion,
    ``lines`` hum, which is subtracted, and other lines; ``clipping`` has the clipping levels, ``diagnostics`` the
    diagnostics.

    Examples
    --------
    >>> from snapbeam import lab
    >>> velocity = lab.render_vibrometer(100.0, 7e-3, duration=0.5)  # 100 Hz, 7 mm/s
    >>> drive = lab.measure_drive(velocity, 100.0)
    >>> f"{drive.steady.frequency:.1f} Hz"
    '100.0 Hz'
    """

    steady: SineFit
    startup: StartUp | None
    stop: float
    snr_limit: float
    units: str
    flaws: tuple[Flaw, ...]
    lines: DriveLines
    clipping: Clipping
    diagnostics: tuple[Diagnostic, ...]
    cycle_time: _Array = field(repr=False)
    cycle_amplitude: _Array = field(repr=False)

    @property
    def accepted(self) -> bool:
        """True if the SINAD of the steady motion exceeds the limit."""
        return self.steady.sinad > self.snr_limit

    @property
    def notes(self) -> tuple[str, ...]:
        """The diagnostics that make the result doubtful, in words."""
        return tuple(one.message for one in doubtful(self.diagnostics))

    @property
    def has_start(self) -> bool:
        """True if the record contains a complete start-up without dropouts."""
        broken = KINDS_VIBROMETER["dropout_in_start"].code
        return self.startup is not None and all(one.code != broken for one in self.diagnostics)

    def summary(self) -> dict[str, Any]:
        """The figures as plain numbers and words, in SI, for a table or a JSON file."""
        fit = self.steady
        start = self.startup
        return {
            "accepted": self.accepted,
            "units": self.units,
            "frequency_hz": fit.frequency,
            "frequency_se_hz": fit.frequency_se,
            "amplitude": fit.amplitude,
            "amplitude_se": fit.amplitude_se,
            "phase_rad": fit.phase,
            "phase_se_rad": fit.phase_se,
            "offset": fit.offset,
            "distortion": fit.distortion,
            "distortion_floor": fit.distortion_floor,
            "snr_db": fit.snr,
            "sinad_db": fit.sinad,
            "snr_limit_db": self.snr_limit,
            "steady_from_s": fit.start,
            "steady_to_s": fit.stop,
            "onset_s": None if start is None else start.onset,
            "onset_uncertainty_s": None if start is None else start.onset_uncertainty,
            "startup_s": None if start is None else start.duration,
            "overshoot": None if start is None else start.overshoot,
            "first_cycle_ratio": None if start is None else start.first_cycle_ratio,
            "startup": "the record begins in motion" if start is None else start.description,
            "diagnostics": [one.plain() for one in self.diagnostics],
        }


def measure_drive(
    signal: xr.DataArray,
    frequency: float | None = None,
    *,
    amplitude: float | None = None,
    acceleration: xr.DataArray | None = None,
    snr_limit: float = SNR_LIMIT,
    tolerance: float = 0.05,
) -> DriveMeasurement:
    """Measure the shaker's motion: find where it starts and settles, and fit the steady sine.

    Dropouts and clipped samples, seen in the residual of the sine, are excluded.

    Parameters
    ----------
    signal : xarray.DataArray
        Velocity [m/s] or displacement [m] of the shaker.
    frequency : float, optional
        Set frequency [Hz], the initial guess; by default the highest peak.
    amplitude : float, optional
        Set amplitude, in the unit of the signal, for a check.
    acceleration : xarray.DataArray, optional
        Acceleration of the shaker in the same test [m/s^2], to check units and sampling rate.
    snr_limit : float
        Minimum ratio [dB] of the sine to noise and distortion; the paper's 15 dB.
    tolerance : float
        Maximum deviation of a steady cycle over the amplitude; at least four times the noise of one cycle.

    Examples
    --------
    >>> from snapbeam import lab
    >>> velocity = lab.render_vibrometer(100.0, 7e-3, duration=0.5)  # 100 Hz, 7 mm/s
    >>> drive = lab.measure_drive(velocity, 100.0)
    >>> f"{drive.steady.amplitude:.4f} m/s"
    '0.0070 m/s'
    """
    samples = check_signal(signal, ("m/s", "m"), "signal")
    limit = finite("snr_limit", snr_limit)
    tol = within("tolerance", tolerance, 0.0, 0.5)
    stated = 1.0 if amplitude is None else positive("amplitude", amplitude)
    if np.ptp(samples.values) == 0.0:
        raise InputError(
            f"signal: no oscillation, it is {samples.values[0]:g} everywhere: nothing was recorded; look at the cable, "
            "or choose another channel (--channel)"
        )
    guess = spectral_peak(samples) if frequency is None else positive("frequency", frequency, "Hz")
    first, last = moving_part(samples, guess)
    outside = moves_outside(samples, guess, first, last)
    span = (last - first) / samples.sampling_frequency * guess
    if span < 8.0:
        raise InputError(f"signal: the shaker moves for {span:.1f} cycles of {guess:g} Hz: must be at least 8")
    rough = _late_fit(samples, first, last, guess)
    lines = find_drive_lines(samples, first, last, rough)
    if lines.hum:
        samples = without_lines(samples, lines.hum)
        first, last = moving_part(samples, rough.frequency)
        rough = _late_fit(samples, first, last, rough.frequency)
    width = round(samples.sampling_frequency / rough.frequency)
    rest_end = max(_quiet_end(samples, first, rough, width) - width, 0) if first > width else 0
    crosstalk = find_crosstalk(samples, rest_end, rough)
    onset, uncertainty = find_onset(without_lines(samples, [crosstalk] if crosstalk else []), first, rough)
    start = float(samples.time[0]) if onset is None else onset
    period = 1.0 / rough.frequency
    stop = float(samples.time[last - 1]) + 1.0 / samples.sampling_frequency
    before = 0 if onset is None or crosstalk is not None else int((start - samples.time[0]) * rough.frequency)
    times, cycles = _cycle_phasors(samples, rough, start - before * period, stop)
    early, times, cycles = cycles[:before], times[before:], cycles[before:]
    noise = rough.noise_rms * math.sqrt(2.0 / (period * samples.sampling_frequency))
    tol = max(tol, 4.0 * noise / rough.amplitude)
    settled, stray = settled_cycles(cycles, tol)
    margin = 1 if settled == 0 else max(2 * settled, 5)
    begin = start + min(settled + margin, max(settled, cycles.size // 2)) * period
    part = samples.part(slice(*np.searchsorted(samples.time, (begin, stop - 0.25 * period)).tolist()))
    steady, flaws, clipping = steady_fit(part, rough.frequency)
    if steady.cycles < 5.0:
        raise InputError(f"signal: only {steady.cycles:.1f} cycles of steady motion: must be at least 5")
    shift = int(np.searchsorted(samples.time, part.time[0] - 0.25 / samples.sampling_frequency))
    everywhere = [Flaw(flaw.first + shift, flaw.last + shift) for flaw in flaws]
    steady, wander = with_wander(steady, times, cycles, everywhere, samples, begin)
    steady = beside_lines(steady, lines)
    left = part.values - steady.waveform(part.time)
    left[~sound_samples(left.size, flaws)] = 0.0
    others = tuple(line.frequency for line in (*lines.hum, *lines.beside))
    lead, at, end = np.searchsorted(samples.time, (start - _LEAD * period, start, stop)).tolist()
    whole = samples.part(slice(lead, end))
    still = samples.values[: at - round(period * samples.sampling_frequency)] if before else samples.values[:0]
    record = Record(steady, part, left, others, times, cycles, early, still, whole, at - lead, clipping.found)
    errors = find_errors(record)
    kinds = {one.kind for one in errors if one.matters}
    if kinds & {"samples_lost", "beat", "interpolated", "gain", "sign", "few_bits"}:
        lines = DriveLines(lines.hum, ())  # which make the lines beside
    if "few_bits" in kinds:
        clipping = Clipping(-math.inf, math.inf, 0.0, 0.0)  # whose levels are hit again and again
    for one in errors:
        steady = widened(steady, amplitude=(one.loss * steady.amplitude,), frequency=(one.shift * steady.frequency,))
        if one.kind == "low_pass":
            uncertainty = math.hypot(uncertainty, 1e-3 * one.numbers["delay_ms"])
        elif one.kind == "interpolated":
            uncertainty = math.hypot(uncertainty, period / one.numbers["each"])
        elif one.kind in ("gain", "sign"):
            uncertainty = math.hypot(uncertainty, start - float(samples.time[0]))
    if crosstalk is not None:
        steady = beside_lines(steady, DriveLines((), (crosstalk,)))
    mean_moves = one_sided(samples, rest_end, first, last, rough)
    startup = None
    amplitudes = np.abs(cycles)
    broken: list[Flaw] = []
    if onset is not None:
        peak = float(amplitudes[: settled + 1].max() / steady.amplitude - 1.0)
        startup = StartUp(
            onset=onset, onset_uncertainty=uncertainty, duration=settled * period, cycles=float(settled),
            overshoot=peak if peak > tol else 0.0, first_cycle_ratio=float(amplitudes[0] / steady.amplitude),
            tolerance=tol,
        )  # fmt: skip
        if "few_bits" not in kinds:
            broken = _broken_start(samples, onset, onset + settled * period, steady, clipping)
    scatter = steady.noise_rms * math.sqrt(2.0 * steady.cycles / steady.samples) / steady.amplitude
    strongest = guess if frequency is None or steady.sinad > 0.0 else spectral_peak(samples)

    def share(line: Line) -> float:
        return 100.0 * line.amplitude / steady.amplitude

    def lost(some: list[Flaw]) -> dict[str, float]:
        total = sum(flaw.last - flaw.first for flaw in some) / samples.sampling_frequency
        return {"count": len(some), "total_ms": 1e3 * total, "at": float(samples.time[some[0].first])}

    diagnostics = holding(
        KINDS_VIBROMETER,
        *((name, True, lost(some)) for name, some in (("dropout", everywhere), ("dropout_in_start", broken)) if some),
        ("clipped", clipping.found, {"share_percent": 100.0 * clipping.share}),
        (
            "unsteady",
            wander > max(_STEADY, 3.0 * scatter) or stray > 0.05,
            {"stray_percent": 100.0 * max(wander, stray)},
        ),
        (
            "frequency",
            frequency is not None and abs(steady.frequency - guess) > max(0.002 * guess, 6.0 * steady.frequency_se),
            {"found": steady.frequency, "stated": guess},
        ),
        (
            "amplitude",
            abs(steady.amplitude - stated) > max(0.05 * stated, 6.0 * steady.amplitude_se) and amplitude is not None,
            {"found": steady.amplitude, "stated": stated, "share_percent": 100.0 * (steady.amplitude / stated - 1.0)},
        ),
        (
            "noisy" if steady.snr <= limit else "distorted",
            steady.sinad <= limit,
            {"sinad_db": steady.sinad, "limit_db": limit},
        ),
        ("no_rest", startup is None, {}),
        ("slow_start", onset is not None and uncertainty > 0.05 * period, {"uncertainty_ms": 1e3 * uncertainty}),
        *(("hum", True, {"frequency": line.frequency, "share_percent": share(line)}) for line in lines.hum),
        *(("second_line", True, {"frequency": line.frequency, "share_percent": share(line)}) for line in lines.beside),
        *(("crosstalk", True, {"share_percent": share(line)}) for line in (crosstalk,) if line is not None),
        *((one.kind, one.matters, one.numbers) for one in errors),
        ("one_sided", mean_moves > 0.0, {"share": mean_moves}),
        (
            "not_there",
            abs(strongest - guess) >= max(_SAME_LINE * guess, 2.0 / samples.duration),
            {"stated": guess, "found": strongest},
        ),
        ("interrupted", outside > 3.0 * period, {"outside_ms": 1e3 * outside}),
    )
    units = str(signal.attrs["units"])
    diagnostics += beyond_shakers(steady, units)
    if acceleration is not None:
        other = check_signal(acceleration, "m/s^2", "acceleration")
        set_at = spectral_peak(other)
        fit = _late_fit(other, *moving_part(other, set_at), set_at)
        diagnostics += beside_acceleration(steady, units, fit)
    return DriveMeasurement(
        steady, startup, stop, limit, units, (*broken, *everywhere), lines, clipping,
        (*diagnostics_of(signal), *diagnostics), times, amplitudes,
    )  # fmt: skip


def _broken_start(samples: SignalSamples, onset: float, end: float, steady: SineFit, clipping: Clipping) -> list[Flaw]:
    """Values that stand still, or jump farther than the motion can, between the onset and the steady motion.

    The first quarter of a cycle may jump: a velocity can begin anywhere.
    """
    quarter = 0.25 / steady.frequency
    inside = np.flatnonzero((samples.time > onset + quarter) & (samples.time < end + 4.0 * quarter))
    if inside.size < 8:
        return []
    first = int(inside[0])
    values = samples.values[inside]
    fastest = 2.0 * math.pi * steady.frequency / samples.sampling_frequency * 2.5 * steady.amplitude
    steps = np.abs(np.diff(values))
    jumps = np.flatnonzero(steps > max(fastest, 0.3 * steady.amplitude) + 8.0 * steady.noise_rms)
    least = max(5, int(0.06 * samples.sampling_frequency / steady.frequency))
    cut = clipping.touches(values)
    found = [run for run in stuck_runs(values, least) if not cut[run.first]]
    if jumps.size:
        found.append(Flaw(int(jumps[0]), int(jumps[-1]) + 2))
    return [Flaw(flaw.first + first, flaw.last + first) for flaw in found]


def _cycle_phasors(samples: SignalSamples, fit: SineFit, start: float, stop: float) -> tuple[_Array, Any]:
    """Middle [s] and complex amplitude, turning with the fitted sine, of each whole cycle."""
    period = 1.0 / fit.frequency
    count = int((stop - start) * fit.frequency + 1e-6)
    design = sines(samples.time, [fit.frequency])
    index = np.floor((samples.time - start) * fit.frequency + 1e-9).astype(np.int64)
    borders = np.searchsorted(index, np.arange(count + 1))
    found = np.empty(count, dtype=np.complex128)
    for n in range(count):
        part = slice(borders[n], borders[n + 1])
        found[n : n + 1] = phasors(np.asarray(lstsq(design[part], samples.values[part]), dtype=np.float64))
    middle: _Array = start + (np.arange(count, dtype=np.float64) + 0.5) * period
    return middle, found


def displacement_from_velocity(velocity: xr.DataArray, measurement: DriveMeasurement | None = None) -> xr.DataArray:
    """Integrate the shaker's velocity to its displacement [m] without drift.

    The cubic spline of the velocity is integrated exactly. The drift from noise and offset is determined at rest (zero)
    and in steady motion (zero mean over a cycle) by a smoothing spline over about four cycles, and subtracted; the
    start-up transient is bridged. Dropouts and clipped samples are replaced by the steady sine. The mean position is
    assumed constant.

    Parameters
    ----------
    velocity : xarray.DataArray
        Velocity [m/s].
    measurement : DriveMeasurement, optional
        Result of :func:`measure_drive`; measured by default.

    Examples
    --------
    >>> from snapbeam import lab
    >>> velocity = lab.render_vibrometer(100.0, 7e-3, duration=0.5)  # 100 Hz, 7 mm/s
    >>> drive = lab.measure_drive(velocity, 100.0)
    >>> lab.displacement_from_velocity(velocity, drive).attrs["units"]
    'm'
    """
    from scipy.interpolate import CubicSpline, make_smoothing_spline

    samples = check_signal(velocity, "m/s", "velocity")
    drive = measurement or measure_drive(velocity)
    samples = mended(samples, drive)
    period = 1.0 / drive.steady.frequency
    time = samples.time
    quiet_until = time[0] if drive.startup is None else drive.startup.onset - drive.startup.onset_uncertainty
    spline = CubicSpline(time, samples.values - drive.steady.offset)
    position, integral = spline.antiderivative(1), spline.antiderivative(2)
    settled = drive.steady.start if drive.startup is None else drive.startup.onset + drive.startup.duration
    edges = [np.arange(settled, drive.steady.stop - period, period)]
    if quiet_until - time[0] > period:
        edges.append(np.arange(quiet_until - period, time[0], -period)[::-1])
    if time[-1] - drive.stop > 10.0 * period:
        edges.append(np.arange(drive.stop + 5.0 * period, time[-1] - period, period))
    edge = np.sort(np.concatenate(edges))
    mean = (integral(edge + period) - integral(edge)) / period
    scaled = (edge + 0.5 * period - time[0]) / period
    drift = make_smoothing_spline(scaled, mean, lam=(4.0 / (2.0 * math.pi)) ** 4)
    values = position(time) - drift((time - time[0]) / period)
    return make_signal(
        values,
        "m",
        samples.sampling_frequency,
        start=float(time[0]),
        name="shaker displacement",
        attrs={key: value for key, value in velocity.attrs.items() if key not in ("units", "long_name")},
    )


def mended(samples: SignalSamples, drive: DriveMeasurement) -> SignalSamples:
    """A record without hum, whose flaws and cut tops are replaced by the motion about them; the same without any.

    In steady motion that is the steady sine; in the start-up cut tops follow from a sine of changing amplitude
    through what is left of the two cycles about them.
    """
    samples = without_lines(samples, drive.lines.hum)
    if not drive.flaws and not drive.clipping.found:
        return samples
    values = samples.values.copy()
    bad = ~sound_samples(values.size, list(drive.flaws))
    cut = drive.clipping.touches(samples.values) & (samples.time < drive.stop)
    early = cut & (samples.time < drive.steady.start)
    if drive.startup is not None:
        early &= samples.time >= drive.startup.onset
    late = bad | (cut & (samples.time >= drive.steady.start))
    model = drive.steady.waveform(samples.time, harmonics=not drive.clipping.found)
    values[late] = model[late]
    for first, last in stretches(early):
        values[first:last] = _about(samples, drive, first, last, ~(cut | bad))
    return samples._replace(values=values)


def _about(
    samples: SignalSamples, drive: DriveMeasurement, first: int, last: int, sound: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """The motion between two samples, from the sound ones up to a cycle away since the start."""
    middle = 0.5 * (samples.time[first] + samples.time[last - 1])
    period = 1.0 / drive.steady.frequency
    since = samples.time - middle
    begin = -math.inf if drive.startup is None else drive.startup.onset - middle
    used = sound & (np.abs(since) < period) & (since >= begin)

    def design(t: NDArray[np.float64]) -> NDArray[np.float64]:
        turn = 2.0 * math.pi * t / period
        wave = np.stack([np.cos(turn), np.sin(turn)], axis=1)
        return np.concatenate([wave, wave * (t / period)[:, None]], axis=1)

    if np.count_nonzero(used) < 12:
        return samples.values[first:last]
    solution = lstsq(design(since[used]), samples.values[used] - drive.steady.offset)
    return drive.steady.offset + design(since[first:last]) @ solution


def shaker_signal(tracked: xr.Dataset) -> xr.DataArray:
    """The displacement of the shaker [m] in a tracked recording, at the middles of the exposures.

    Gaps of up to five frames are bridged by a cubic spline; of what longer gaps part the longest stretch is
    taken.  Only the sine and the start of the motion are read from it, which a few frames do not change.
    """
    from scipy.interpolate import CubicSpline

    if "shaker_displacement_mm" not in tracked or "time" not in tracked.coords:
        raise InputError("tracked: has no shaker_displacement_mm over time; it must come from track() with a shaker")
    values = tracked["shaker_displacement_mm"].values
    time = tracked["time"].values
    known = np.flatnonzero(np.isfinite(values))
    if known.size < 16:
        raise InputError(f"tracked: the shaker was found in {known.size} frame(s): must be at least 16")
    breaks = np.flatnonzero(np.diff(known) > _BRIDGED + 1)
    runs = np.split(known, breaks + 1)
    used = max(runs, key=len)
    whole = np.arange(used[0], used[-1] + 1)
    filled = CubicSpline(time[used], values[used])(time[whole])
    exposure = float(tracked.attrs.get("exposure", np.nan))
    middle = 0.5 * exposure if np.isfinite(exposure) else 0.0
    return make_signal(filled, "mm", time=time[whole] + middle, name="shaker seen by the camera")
