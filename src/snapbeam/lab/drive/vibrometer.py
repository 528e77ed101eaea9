"""What a laser vibrometer says about the shaker: steady sine, start-up transient, displacement.

The paper accepts a test when the signal-to-noise ratio of the shaker's velocity exceeds 15 dB, and names the
start-up transient as a cause of disagreement with simulations (sections 2 and 4.1).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.validate import InputError, finite, within
from snapbeam.lab.signals.signal import SignalSamples, check_signal, make_signal
from snapbeam.lab.signals.sine_fit import SineFit, fit_sine, spectral_peak

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["DriveMeasurement", "StartUp", "displacement_from_velocity", "measure_drive"]

_Array = NDArray[np.float64]
_NOISE_FLOOR = 1e-6
"""Of the amplitude: a record without noise is taken to have this much, or the sums that find its start
would lose it to rounding."""
SNR_LIMIT = 15.0


@dataclass(frozen=True)
class StartUp:
    """How the shaker started.

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

    ``steady`` is the sine fitted after the start-up; ``startup`` is None where the record begins in motion;
    ``stop`` [s] is the end of the motion or of the record; ``cycle_time`` [s] and ``cycle_amplitude`` follow
    the amplitude cycle by cycle; ``accepted`` says whether ``steady.sinad`` exceeds ``snr_limit`` [dB].
    """

    steady: SineFit
    startup: StartUp | None
    stop: float
    snr_limit: float
    units: str
    notes: tuple[str, ...]
    cycle_time: _Array = field(repr=False)
    cycle_amplitude: _Array = field(repr=False)

    @property
    def accepted(self) -> bool:
        """Whether the steady motion is near enough to a sine: noise and distortion below the limit."""
        return self.steady.sinad > self.snr_limit

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
            "notes": list(self.notes),
        }


def measure_drive(
    signal: xr.DataArray,
    frequency: float | None = None,
    *,
    snr_limit: float = SNR_LIMIT,
    tolerance: float = 0.05,
) -> DriveMeasurement:
    """Measure the shaker's motion: find where it starts and settles, and fit the steady sine.

    Parameters
    ----------
    signal : xarray.DataArray
        Velocity [m/s] or displacement [m] of the shaker.
    frequency : float, optional
        The excitation frequency [Hz] as set, used as a guess; the highest peak of the spectrum if left out.
    snr_limit : float
        Least ratio [dB] of the sine to noise and distortion of an acceptable test; the paper's 15 dB.
    tolerance : float
        How near to the steady sine a cycle must be, as a share of its amplitude, to count as steady.  Raised
        to four times the noise of one cycle's amplitude where that is more.

    Raises
    ------
    InputError
        If the signal is no such signal, or holds fewer than five cycles of steady motion.
    """
    samples = check_signal(signal, ("m/s", "m"), "signal")
    limit = finite("snr_limit", snr_limit)
    tol = within("tolerance", tolerance, 0.0, 0.5)
    guess = spectral_peak(samples) if frequency is None else frequency
    first, last = _moving_part(samples, guess)
    moving = _slice(samples, first, last)
    span = moving.values.size / samples.sampling_freq * guess
    if span < 8.0:
        raise InputError(
            f"signal: the shaker moves for {span:.1f} cycles of {guess:g} Hz: must be at least 8"
        )
    rough = fit_sine(_slice(moving, moving.values.size // 3, None), guess, 3)
    notes = []

    onset, uncertainty = _onset(samples, first, rough)
    start = samples.time[0] if onset is None else onset
    period = 1.0 / rough.frequency
    stop = float(moving.time[-1]) + 1.0 / samples.sampling_freq
    times, cycles = _cycle_phasors(samples, rough, start, stop)
    noise = rough.noise_rms * math.sqrt(2.0 / (period * samples.sampling_freq))
    tol = max(tol, 4.0 * noise / rough.amplitude)
    settled = 0
    for _ in range(3):
        reference = np.median(cycles[max(settled, cycles.size // 3) :].real) + 1j * np.median(
            cycles[max(settled, cycles.size // 3) :].imag
        )
        off = np.flatnonzero(np.abs(cycles / reference - 1.0) > tol)
        early = off[off < cycles.size // 2]
        settled = int(early[-1]) + 1 if early.size else 0
    late = off[off >= cycles.size // 2]
    if late.size > 0.05 * cycles.size:
        notes.append(f"{late.size} of {cycles.size} cycles stray from the steady sine late in the record")
    margin = 0 if settled == 0 else max(2 * settled, 5)
    begin = start + min(settled + margin, max(settled, cycles.size // 2)) * period
    steady = fit_sine(_between(samples, begin, stop - 0.25 * period), rough.frequency)
    if steady.cycles < 5.0:
        raise InputError(f"signal: only {steady.cycles:.1f} cycles of steady motion: must be at least 5")
    amplitudes = np.abs(cycles)
    startup = None
    if onset is not None:
        peak = float(amplitudes[: settled + 1].max() / steady.amplitude - 1.0)
        startup = StartUp(
            onset=onset,
            onset_uncertainty=uncertainty,
            duration=settled * period,
            cycles=float(settled),
            overshoot=peak if peak > tol else 0.0,
            first_cycle_ratio=float(amplitudes[0] / steady.amplitude),
            tolerance=tol,
        )
    if steady.sinad <= limit:
        cause = "noise" if steady.snr <= limit else "distortion"
        notes.append(f"sine to noise and distortion {steady.sinad:.1f} dB, not above {limit:g} dB: {cause}")
    return DriveMeasurement(
        steady=steady,
        startup=startup,
        stop=stop,
        snr_limit=limit,
        units=str(signal.attrs["units"]),
        notes=tuple(notes),
        cycle_time=times,
        cycle_amplitude=amplitudes,
    )


def displacement_from_velocity(
    velocity: xr.DataArray, measurement: DriveMeasurement | None = None
) -> xr.DataArray:
    """Integrate the shaker's velocity to its displacement [m] without drift.

    The velocity's cubic spline is integrated exactly.  What noise and offset add is a slow drift; it is found
    where the truth is known, at rest (zero) and in steady motion (zero mean over a cycle), as a smoothing
    spline that follows nothing faster than about four cycles, and subtracted.  The start-up transient is
    bridged, so it keeps its shape.  The shaker's suspension is taken to hold its mean position.

    Parameters
    ----------
    velocity : xarray.DataArray
        Velocity [m/s].
    measurement : DriveMeasurement, optional
        That of this velocity; measured here if left out.

    Raises
    ------
    InputError
        As :func:`measure_drive`.
    """
    from scipy.interpolate import CubicSpline, make_smoothing_spline

    samples = check_signal(velocity, "m/s", "velocity")
    drive = measurement or measure_drive(velocity)
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
        samples.sampling_freq,
        start=float(time[0]),
        name="shaker displacement",
        attrs={key: value for key, value in velocity.attrs.items() if key not in ("units", "long_name")},
    )


def _slice(samples: SignalSamples, first: int, last: int | None) -> SignalSamples:
    return SignalSamples(samples.values[first:last], samples.time[first:last], samples.sampling_freq)


def _between(samples: SignalSamples, start: float, stop: float) -> SignalSamples:
    inside = np.flatnonzero((samples.time >= start) & (samples.time < stop))
    if inside.size == 0:
        return _slice(samples, 0, 0)
    return _slice(samples, int(inside[0]), int(inside[-1]) + 1)


def _moving_part(samples: SignalSamples, frequency: float) -> tuple[int, int]:
    """First and last (exclusive) sample of the longest stretch that oscillates at *frequency*."""
    n = samples.values.size
    width = max(3, round(samples.sampling_freq / frequency))
    if width >= n:
        return 0, n
    turn = np.exp(-2j * math.pi * frequency * (samples.time - samples.time[0]))
    total = np.concatenate(([0.0], np.cumsum((samples.values - np.median(samples.values)) * turn)))
    level = np.abs(total[width:] - total[:-width]) / width
    on = level > 0.3 * np.quantile(level, 0.9)
    bounds = np.flatnonzero(np.diff(np.concatenate(([0], on.astype(np.int8), [0]))))
    runs = bounds.reshape(-1, 2)
    longest = runs[np.argmax(runs[:, 1] - runs[:, 0])]
    return int(longest[0]), min(int(longest[1]) + width - 1, n)


def _onset(samples: SignalSamples, first: int, rough: SineFit) -> tuple[float | None, float]:
    """Time the motion starts, the likeliest change of variance; None where the record begins in motion."""
    width = round(samples.sampling_freq / rough.frequency)
    quiet = samples.values[:first]
    if quiet.size < max(8, width // 8):
        return None, 0.0
    rest = float(np.median(quiet))
    noise = max(float(np.std(quiet)), _NOISE_FLOOR * rough.amplitude)
    level = rough.amplitude / math.sqrt(2.0)
    if noise > 0.5 * level:
        return None, 0.0
    begin, end = max(quiet.size - width, 0), min(first + 2 * width, samples.values.size)
    square = (samples.values[begin:end] - rest) ** 2
    gain = 0.5 * square * (1.0 / noise**2 - 1.0 / level**2) - math.log(level / noise)
    after = np.concatenate((np.cumsum(gain[::-1])[::-1], [0.0]))
    at = begin + int(np.argmax(after))
    hidden = min(noise / rough.amplitude, 1.0)
    uncertainty = (1.0 + hidden * width / (2.0 * math.pi)) / samples.sampling_freq
    return float(samples.time[min(at, samples.time.size - 1)]), uncertainty


def _cycle_phasors(samples: SignalSamples, fit: SineFit, start: float, stop: float) -> tuple[_Array, Any]:
    """Middle [s] and complex amplitude, turning with the fitted sine, of each whole cycle."""
    period = 1.0 / fit.frequency
    count = int((stop - start) * fit.frequency + 1e-6)
    turn = 2.0 * math.pi * fit.frequency * samples.time
    design = np.column_stack((np.ones_like(turn), np.cos(turn), np.sin(turn)))
    index = np.floor((samples.time - start) * fit.frequency + 1e-9).astype(np.int64)
    borders = np.searchsorted(index, np.arange(count + 1))
    phasors = np.empty(count, dtype=np.complex128)
    for n in range(count):
        part = slice(borders[n], borders[n + 1])
        _, c, s = np.linalg.lstsq(design[part], samples.values[part], rcond=None)[0]
        phasors[n] = c - 1j * s
    middle: _Array = start + (np.arange(count, dtype=np.float64) + 0.5) * period
    return middle, phasors
