"""Sine fit by least squares: amplitude, frequency and phase with standard errors, harmonics and noise.

The model is that of the four-parameter fit of IEEE Std 1057, offset + A cos(2 pi f t + phase), extended by
harmonics so that distortion does not count as noise.  Gauss-Newton in the frequency, linear least squares in
the rest.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.lab.least_squares import covariance, sines, solve
from snapbeam.lab.signals import SignalSamples, check_signal, stretches
from snapbeam.util.validation import InputError, integer, positive

if TYPE_CHECKING:
    import xarray as xr


_Array = NDArray[np.float64]
_MIN_CYCLES = 2.0
_FLAT = 0.105  # share of a cycle within 3 % of its extreme from which a top is flat; 0.078 for a sine
_NEAR = 0.03


@dataclass(frozen=True)
class SineFit:
    """A sine fitted to a signal: offset + amplitude cos(2 pi frequency t + phase) and its harmonics.

    ``amplitude``, ``offset`` and ``noise_rms`` are in the unit of the signal, ``frequency`` in Hz, ``phase``
    in radians at time 0 of the signal, in (-pi, pi]; ``*_se`` are standard errors.  ``harmonic_amplitude[k]``
    and ``harmonic_phase[k]`` belong to the multiple k + 1, the first being the sine itself.

    Examples
    --------
    >>> from snapbeam import lab
    >>> velocity = lab.render_vibrometer(100.0, 7e-3, duration=0.5)  # 100 Hz, 7 mm/s
    >>> drive = lab.measure_drive(velocity, 100.0)
    >>> f"{1e3 * drive.steady.amplitude:.2f} mm/s"
    '6.99 mm/s'
    """

    amplitude: float
    amplitude_se: float
    frequency: float
    frequency_se: float
    phase: float
    phase_se: float
    offset: float
    offset_se: float
    noise_rms: float
    harmonic_amplitude: _Array = field(repr=False)
    harmonic_phase: _Array = field(repr=False)
    start: float
    stop: float
    samples: int

    @property
    def cycles(self) -> float:
        """Cycles the fit spans."""
        return (self.stop - self.start) * self.frequency

    @property
    def distortion(self) -> float:
        """Total harmonic distortion: root sum square of the harmonics over the amplitude of the sine."""
        return float(np.sqrt(np.sum(self.harmonic_amplitude[1:] ** 2)) / self.amplitude)

    @property
    def distortion_floor(self) -> float:
        """The distortion that noise alone would show."""
        count = self.harmonic_amplitude.size - 1
        return float(np.sqrt(count * 4.0 / self.samples) * self.noise_rms / self.amplitude)

    @property
    def snr(self) -> float:
        """Signal-to-noise ratio [dB]: power of the sine over that of the noise, harmonics left out."""
        return _decibel(self.amplitude**2 / 2.0, self.noise_rms**2)

    @property
    def sinad(self) -> float:
        """Signal to noise and distortion [dB]: power of the sine over all else but the offset."""
        harmonics = float(np.sum(self.harmonic_amplitude[1:] ** 2)) / 2.0
        return _decibel(self.amplitude**2 / 2.0, self.noise_rms**2 + harmonics)

    def phase_at(self, time: float) -> float:
        """Phase [rad] at a time [s], not reduced to one turn."""
        return 2.0 * math.pi * self.frequency * time + self.phase

    def waveform(self, time: ArrayLike, *, harmonics: bool = True) -> _Array:
        """The fitted signal at times [s], with or without its harmonics."""
        t = np.asarray(time, dtype=np.float64)
        total = np.full(t.shape, self.offset)
        for k in range(self.harmonic_amplitude.size if harmonics else 1):
            turn = 2.0 * math.pi * self.frequency * (k + 1) * t
            total = total + self.harmonic_amplitude[k] * np.cos(turn + self.harmonic_phase[k])
        return total


def _decibel(power: float, other: float) -> float:
    return 10.0 * math.log10(power / other) if other > 0.0 else math.inf


def spectral_peak(samples: SignalSamples, low: float = 0.0, high: float | None = None) -> float:
    """Frequency [Hz] of the highest peak of the spectrum (Hann window, parabola through its logarithm)."""
    y = samples.values - samples.values.mean()
    n = y.size
    spectrum = np.abs(np.fft.rfft(y * np.hanning(n), 4 * n))
    freq = np.fft.rfftfreq(4 * n, 1.0 / samples.sampling_frequency)
    top = samples.sampling_frequency / 2 if high is None else high
    return highest_peak(freq, spectrum, (low, top), samples.sampling_frequency / n)


def highest_peak(
    freq: NDArray[Any], spectrum: _Array, band: tuple[float, float], lowest: float, floor: float = 0.0
) -> float:
    """Frequency [Hz] of the highest peak in a band, from *lowest* on, by a parabola through logarithms."""
    inside = np.flatnonzero((freq >= max(band[0], lowest)) & (freq <= band[1]))
    if inside.size == 0 or not spectrum[inside].max() > floor:
        raise InputError(f"signal: no oscillation between {band[0]:g} and {band[1]:g} Hz")
    at = int(inside[np.argmax(spectrum[inside])])
    shift = 0.0
    if 0 < at < spectrum.size - 1 and spectrum[at - 1] > 0.0 and spectrum[at + 1] > 0.0:
        a, b, c = np.log(spectrum[at - 1 : at + 2])
        bend = a - 2.0 * b + c
        shift = 0.5 * (a - c) / bend if bend < 0.0 else 0.0
    return float(freq[at] + shift * (freq[1] - freq[0]))


def falling_window(size: int) -> _Array:
    """Half of a Hann window, whose maximum is the first sample."""
    return np.asarray(np.cos(0.5 * math.pi * np.arange(size) / size) ** 2, dtype=np.float64)


def white_variance(
    residual: _Array, sampling_frequency: float, frequency: float, fitted: ArrayLike, free: int
) -> float:
    """Variance of the white noise that is as strong as *residual* near *frequency* [Hz].

    The mean of the periodogram over the 25 lines on either side, without the lines within two of a *fitted*
    frequency [Hz], where the fit has taken noise out; the whole residual if that leaves fewer than 16.
    *free* is the number of fitted parameters.  Standard errors of a narrow-band fit follow the noise near
    its frequency, whatever the noise does elsewhere.
    """
    n = residual.size
    power = np.abs(np.fft.rfft(residual)) ** 2 / n
    center = frequency * n / sampling_frequency
    line = np.arange(power.size)
    near = (np.abs(line - center) <= 25.0) & (line > 1) & (2 * line < n - 1)
    for other in np.atleast_1d(np.asarray(fitted, dtype=np.float64)) * n / sampling_frequency:
        near &= np.abs(line - other) > 2.0
    if near.sum() < 16:
        return float(residual @ residual / max(n - free, 1))
    mean, robust = float(power[near].mean()), float(np.median(power[near])) / math.log(2.0)
    return robust if mean > 3.0 * robust else mean  # a line beside is no noise


def fit_sine(
    samples: xr.DataArray | SignalSamples,
    frequency: float | None = None,
    harmonics: int = 10,
    *,
    fixed: bool = False,
    keep: NDArray[np.bool_] | None = None,
) -> SineFit:
    """Fit a sine, its harmonics and an offset to a signal.

    Parameters
    ----------
    samples : xarray.DataArray
        Signal, or its samples from :func:`~snapbeam.lab.signals.check_signal`.
    frequency : float, optional
        Initial guess [Hz]; by default the highest peak of the spectrum.
    harmonics : int
        Multiples to fit, the sine included, up to 0.95 of the Nyquist frequency.
    fixed : bool
        True if *frequency* is known and not fitted.
    keep : bool array, optional
        Samples to use; all by default.

    Returns
    -------
    SineFit
        The fit, with least-squares standard errors from the noise near the frequency, white over about 50 lines.

    Notes
    -----
    IEEE Std 1057-2017, Annex B; the standard errors reach the bound of Rife and Boorstyn, IEEE Trans. Inf.
    Theory 20 (1974), 591.

    Examples
    --------
    >>> from snapbeam import lab
    >>> velocity = lab.render_vibrometer(100.0, 7e-3, duration=0.5)  # 100 Hz, 7 mm/s
    >>> fit = lab.fit_sine(velocity.isel(time=slice(5000, None)), 100.0)
    >>> f"{fit.frequency:.1f} Hz"
    '100.0 Hz'
    """
    if not isinstance(samples, SignalSamples):
        samples = check_signal(samples)
    y, time, rate = samples
    guess = spectral_peak(samples) if frequency is None else positive("frequency", frequency, "Hz")
    n = y.size
    used = np.ones(n, dtype=bool) if keep is None else np.asarray(keep, dtype=bool)
    if np.count_nonzero(used) < 0.2 * n:
        raise InputError(f"signal: only {np.count_nonzero(used)} of {n} samples are sound")
    span = n / rate
    if guess >= rate / 2:
        raise InputError(f"frequency = {guess:g} Hz: must lie below half the sampling rate, {rate / 2:g} Hz")
    if guess * span < _MIN_CYCLES:
        raise InputError(f"signal spans {guess * span:.2f} cycles of {guess:g} Hz: must span at least 2")
    count = max(1, min(integer("harmonics", harmonics, 1, 100), int(0.95 * rate / 2 / guess), (n - 4) // 8))
    middle = float(time[0] + (n - 1) / (2 * rate))
    t = time - middle
    where, target = t[used], y[used]
    omega, multiple = 2.0 * math.pi * guess, np.arange(1, count + 1)

    def fitted(omega: float) -> tuple[_Array, _Array, _Array]:
        """Design, solution, and derivative of the fitted signal with respect to omega."""
        design = sines(where, omega / (2.0 * math.pi) * multiple)
        solution = solve(design, target)
        turned = np.zeros_like(solution)
        turned[1::2], turned[2::2] = multiple * solution[2::2], -multiple * solution[1::2]
        return design, solution, where * (design @ turned)

    for _ in range(0 if fixed else 30):
        design, solution, slope = fitted(omega)
        step = solve(np.column_stack((design, slope)), target - design @ solution)[-1]
        limit = math.pi / span
        omega += float(np.clip(step, -limit, limit))
        if abs(omega / (2.0 * math.pi) - guess) > 2.0 / span:
            raise InputError(f"signal: no steady sine near {guess:g} Hz; its frequency or amplitude may change")
        if abs(step) < 1e-11 * omega:
            break
    design, solution, slope = fitted(omega)
    residual = np.zeros(n)
    residual[used] = (target - design @ solution) * math.sqrt(n / target.size)
    full = design if fixed else np.column_stack((design, slope * (2.0 * math.pi)))
    free = full.shape[1]
    freq = omega / (2.0 * math.pi)
    variance = white_variance(residual, rate, freq, freq * np.arange(count + 1), free)
    spread = covariance(full) * variance
    cosine, sine = solution[1::2], solution[2::2]
    amplitudes = np.hypot(cosine, sine)
    if not amplitudes[0] > 0.0:
        raise InputError("signal: no oscillation found")
    # gradients with respect to (offset, cos, sin, ..., frequency), phase = atan2(-sin, cos) at the middle
    a = np.zeros(free)
    a[1:3] = cosine[0] / amplitudes[0], sine[0] / amplitudes[0]
    p = np.zeros(free)
    p[1:3] = sine[0] / amplitudes[0] ** 2, -cosine[0] / amplitudes[0] ** 2
    if not fixed:
        p[-1] = -2.0 * math.pi * middle
    phases = np.arctan2(-sine, cosine) - multiple * omega * middle
    return SineFit(
        amplitude=float(amplitudes[0]),
        amplitude_se=float(np.sqrt(a @ spread @ a)),
        frequency=freq,
        frequency_se=0.0 if fixed else float(np.sqrt(spread[-1, -1])),
        phase=_wrap(float(phases[0])),
        phase_se=float(np.sqrt(p @ spread @ p)),
        offset=float(solution[0]),
        offset_se=float(np.sqrt(spread[0, 0])),
        noise_rms=float(np.sqrt(residual @ residual / max(n - free, 1))),
        harmonic_amplitude=amplitudes,
        harmonic_phase=np.array([_wrap(float(phase)) for phase in phases]),
        start=float(time[0]),
        stop=float(time[0] + n / rate),
        samples=n,
    )


def _wrap(angle: float) -> float:
    return math.pi - (math.pi - angle) % (2.0 * math.pi)


class Flaw(NamedTuple):
    """Samples *first* to *last* (one past) that are no part of the motion."""

    first: int
    last: int


class Clipping(NamedTuple):
    """Levels at which tops are cut off, infinite where they are not, and the share of the cycle cut.

    Samples nearer than ``reach`` to a level may be cut.
    """

    low: float
    high: float
    share: float
    reach: float

    @property
    def found(self) -> bool:
        """True if any maximum or minimum is clipped."""
        return math.isfinite(self.low) or math.isfinite(self.high)

    def touches(self, values: _Array) -> NDArray[np.bool_]:
        """Which of *values* may have been cut."""
        cut: NDArray[np.bool_] = (values > self.high - self.reach) | (values < self.low + self.reach)
        return cut


def find_flaws(samples: SignalSamples, fit: SineFit, measured: NDArray[np.bool_] | None = None) -> list[Flaw]:
    """Stretches in which a record leaves its steady sine by far more than its noise does.

    More than eight robust standard deviations and a twentieth of the amplitude; samples less than half a cycle
    apart belong to one flaw, and a flaw reaches as far as three standard deviations do.  Where not all samples
    were *measured*, the noise is that of those that were.
    """
    rest = samples.values - fit.waveform(samples.time)
    known = rest if measured is None else rest[measured]
    sigma = 1.4826 * float(np.median(np.abs(known - np.median(known))))
    far = np.abs(rest) > max(8.0 * sigma, 0.05 * fit.amplitude)
    # one sample in thousands strays by chance where the noise is not normal; a flaw is more, or farther out
    single = far & ~np.roll(far, 1) & ~np.roll(far, -1) & (np.abs(rest) < max(12.0 * sigma, 0.1 * fit.amplitude))
    at = np.flatnonzero(far & ~single)
    if not at.size:
        return []
    half = 0.5 * samples.sampling_frequency / fit.frequency
    groups = np.split(at, np.flatnonzero(np.diff(at) > half) + 1)
    quiet = np.flatnonzero(np.abs(rest) <= 3.0 * sigma)
    before = [int(quiet[quiet < group[0]].max(initial=0)) for group in groups]
    after = [int(quiet[quiet > group[-1]].min(initial=rest.size - 1)) for group in groups]
    return [Flaw(first, last + 1) for first, last in zip(before, after, strict=True)]


def sound_samples(size: int, flaws: list[Flaw]) -> NDArray[np.bool_]:
    """Which samples lie in no flaw."""
    sound = np.ones(size, dtype=bool)
    for flaw in flaws:
        sound[flaw.first : flaw.last] = False
    return sound


def find_clipping(samples: SignalSamples, fit: SineFit) -> Clipping:
    """Find clipped tops: flatter than those of a sine in the mean cycle, or levels that are hit exactly many times."""
    turn = np.mod(fit.frequency * samples.time + fit.phase / (2.0 * math.pi), 1.0)
    bins = int(np.clip(samples.values.size // 20, 16, 128))
    index = np.minimum((turn * bins).astype(int), bins - 1)
    count = np.bincount(index, minlength=bins)
    if count.min() < 4:
        return _exact(samples.values)
    mean = np.bincount(index, samples.values, minlength=bins) / count
    low, high = (float(level) for level in np.quantile(mean, (0.01, 0.99)))
    half = 0.5 * (high - low)
    noise = fit.noise_rms / math.sqrt(float(count.min()))
    if noise > 0.01 * half:
        return _exact(samples.values)
    near = _NEAR * half + 1.5 * noise
    variance = np.bincount(index, samples.values**2, minlength=bins) / count - mean**2
    single = math.sqrt(max(float(np.median(variance)), 0.0))  # noise of a sample, behind the cut or before it
    share = [float((mean > high - near).mean()), float((mean < low + near).mean())]
    flat = _FLAT + 0.02 * min(noise / (0.01 * half), 1.0)
    cut = Clipping(
        low if share[1] > flat else -math.inf,
        high if share[0] > flat else math.inf,
        sum(one for one in share if one > flat),
        0.04 * half + 3.0 * single,
    )
    return cut if cut.found else _exact(samples.values)


def _exact(values: _Array) -> Clipping:
    """Levels that many neighbouring samples share to the last digit with the extreme."""
    found = []
    for extreme, nothing in ((float(values.min()), -math.inf), (float(values.max()), math.inf)):
        hit = values == extreme
        told = (hit[1:] & hit[:-1]).mean() > 0.01 and np.ptp(values) > 0.0
        found.append((extreme, float(hit.mean())) if told else (nothing, 0.0))
    (low, below), (high, above) = found
    return Clipping(low, high, below + above, 0.02 * float(np.ptp(values)))


def stuck_runs(values: _Array, least: int) -> list[Flaw]:
    """Runs of at least so many samples that are equal to the last digit."""
    equal = stretches(np.diff(values) == 0.0)
    return [Flaw(first, last + 1) for first, last in equal if last - first + 1 >= least]
