"""What a laser vibrometer says about the shaker: steady sine, start-up transient, flaws of the record.

The paper accepts a test when the signal-to-noise ratio of the shaker's velocity exceeds 15 dB, and names the
start-up transient as a cause of disagreement with simulations (sections 2 and 4.1).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.findings import Diagnostic, doubtful
from snapbeam.core.validate import InputError, finite, positive, within
from snapbeam.lab.drive.lines import DriveLines, beside_lines, find_drive_lines, without_hum
from snapbeam.lab.drive.onset import find_onset, moves_outside, moving_part
from snapbeam.lab.drive.steady import robust_fit, settled_cycles, steady_fit, with_wander
from snapbeam.lab.plausibility.vibrometer import KINDS
from snapbeam.lab.signals.flaws import Clipping, Flaw, stuck_runs
from snapbeam.lab.signals.signal import SignalSamples, check_signal
from snapbeam.lab.signals.sine_fit import SineFit, spectral_peak

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["SNR_LIMIT", "DriveMeasurement", "StartUp", "measure_drive"]

_Array = NDArray[np.float64]
SNR_LIMIT = 15.0
_STEADY = 0.03  # share by which the cycles of a steady motion may stray


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
    ``flaws`` are samples (first, one past the last) that are no part of the motion, ``lines`` hum, which is taken
    out, and lines beside the sine; ``clipping`` the levels at which tops are cut off; ``diagnostics`` what makes the
    result doubtful.
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
        """Whether the steady motion is near enough to a sine: noise and distortion below the limit."""
        return self.steady.sinad > self.snr_limit

    @property
    def notes(self) -> tuple[str, ...]:
        """The diagnostics that make the result doubtful, in words."""
        return tuple(one.message for one in doubtful(self.diagnostics))

    @property
    def has_start(self) -> bool:
        """Whether the start-up is in the record and sound."""
        broken = KINDS["dropout_in_start"].code
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
    snr_limit: float = SNR_LIMIT,
    tolerance: float = 0.05,
) -> DriveMeasurement:
    """Measure the shaker's motion: find where it starts and settles, and fit the steady sine.

    Dropouts and tops that are cut off are found in what the sine leaves and kept out of the fit.

    Parameters
    ----------
    signal : xarray.DataArray
        Velocity [m/s] or displacement [m] of the shaker.
    frequency : float, optional
        The excitation frequency [Hz] as set, used as a guess; the highest peak of the spectrum if left out.
    amplitude : float, optional
        The amplitude as set, in the unit of the signal, to check by.
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
    stated = None if amplitude is None else positive("amplitude", amplitude)
    if np.ptp(samples.values) == 0.0:
        raise InputError(
            f"signal: no oscillation, it is {samples.values[0]:g} everywhere: nothing was recorded; look at the cable, "
            "or choose another channel (--channel)"
        )
    guess = spectral_peak(samples) if frequency is None else frequency
    first, last = moving_part(samples, guess)
    moving = _slice(samples, first, last)
    outside = moves_outside(samples, guess, first, last)
    span = moving.values.size / samples.sampling_frequency * guess
    if span < 8.0:
        raise InputError(
            f"signal: the shaker moves for {span:.1f} cycles of {guess:g} Hz: must be at least 8"
        )
    rough = robust_fit(_slice(moving, moving.values.size // 3, None), guess, 3)
    lines = find_drive_lines(samples, first, last, rough)
    if lines.hum:
        samples = without_hum(samples, lines)
        first, last = moving_part(samples, rough.frequency)
        moving = _slice(samples, first, last)
        rough = robust_fit(_slice(moving, moving.values.size // 3, None), rough.frequency, 3)
    onset, uncertainty = find_onset(samples, first, rough)
    start = float(samples.time[0]) if onset is None else onset
    period = 1.0 / rough.frequency
    stop = float(moving.time[-1]) + 1.0 / samples.sampling_frequency
    times, cycles = _cycle_phasors(samples, rough, start, stop)
    noise = rough.noise_rms * math.sqrt(2.0 / (period * samples.sampling_frequency))
    tol = max(tol, 4.0 * noise / rough.amplitude)
    settled, stray = settled_cycles(cycles, tol)
    margin = 1 if settled == 0 else max(2 * settled, 5)
    begin = start + min(settled + margin, max(settled, cycles.size // 2)) * period
    part = _between(samples, begin, stop - 0.25 * period)
    steady, flaws, clipping = steady_fit(part, rough.frequency)
    if steady.cycles < 5.0:
        raise InputError(f"signal: only {steady.cycles:.1f} cycles of steady motion: must be at least 5")
    shift = int(np.searchsorted(samples.time, part.time[0] - 0.25 / samples.sampling_frequency))
    everywhere = [Flaw(flaw.first + shift, flaw.last + shift) for flaw in flaws]
    steady, wander = with_wander(steady, times, cycles, everywhere, samples, begin)
    steady = beside_lines(steady, lines)
    startup = None
    amplitudes = np.abs(cycles)
    broken: list[Flaw] = []
    if onset is not None:
        startup = _start_up(onset, uncertainty, settled, period, amplitudes, steady.amplitude, tol)
        broken = _broken_start(samples, onset, onset + settled * period, steady, clipping)
    diagnostics = [
        *_flaw_findings(samples, everywhere, broken, clipping),
        *_doubts(steady, limit, wander, stray, frequency, stated),
        *_start_findings(startup, period),
        *_line_findings(lines, steady),
        *([KINDS["interrupted"].found(outside_ms=1e3 * outside)] if outside > 3.0 * period else []),
    ]
    return DriveMeasurement(
        steady=steady,
        startup=startup,
        stop=stop,
        snr_limit=limit,
        units=str(signal.attrs["units"]),
        flaws=(*broken, *everywhere),
        lines=lines,
        clipping=clipping,
        diagnostics=tuple(diagnostics),
        cycle_time=times,
        cycle_amplitude=amplitudes,
    )


def _start_up(
    onset: float,
    uncertainty: float,
    settled: int,
    period: float,
    amplitudes: _Array,
    steady: float,
    tol: float,
) -> StartUp:
    peak = float(amplitudes[: settled + 1].max() / steady - 1.0)
    return StartUp(
        onset=onset,
        onset_uncertainty=uncertainty,
        duration=settled * period,
        cycles=float(settled),
        overshoot=peak if peak > tol else 0.0,
        first_cycle_ratio=float(amplitudes[0] / steady),
        tolerance=tol,
    )


def _broken_start(
    samples: SignalSamples, onset: float, end: float, steady: SineFit, clipping: Clipping
) -> list[Flaw]:
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
    if jumps.size >= 2:
        found.append(Flaw(int(jumps[0]), int(jumps[-1]) + 2))
    elif jumps.size:
        found.append(Flaw(int(jumps[0]), int(jumps[0]) + 2))
    return [Flaw(flaw.first + first, flaw.last + first) for flaw in found]


def _flaw_findings(
    samples: SignalSamples, flaws: list[Flaw], broken: list[Flaw], clipping: Clipping
) -> list[Diagnostic]:
    told = []
    for name, some in (("dropout", flaws), ("dropout_in_start", broken)):
        if some:
            total = sum(flaw.last - flaw.first for flaw in some) / samples.sampling_frequency
            at = float(samples.time[some[0].first])
            told.append(KINDS[name].found(count=len(some), total_ms=1e3 * total, at=at))
    if clipping.found:
        told.append(KINDS["clipped"].found(share_percent=100.0 * clipping.share))
    return told


def _doubts(
    steady: SineFit,
    limit: float,
    wander: float,
    stray: float,
    frequency: float | None,
    stated: float | None,
) -> list[Diagnostic]:
    told = []
    noise = steady.noise_rms * math.sqrt(2.0 * steady.cycles / steady.samples) / steady.amplitude
    if wander > max(_STEADY, 3.0 * noise) or stray > 0.05:
        told.append(KINDS["unsteady"].found(stray_percent=100.0 * max(wander, stray)))
    if frequency is not None and abs(steady.frequency - frequency) > max(
        0.002 * frequency, 6.0 * steady.frequency_se
    ):
        told.append(KINDS["frequency"].found(found=steady.frequency, stated=frequency))
    if stated is not None and abs(steady.amplitude - stated) > max(0.05 * stated, 6.0 * steady.amplitude_se):
        share = 100.0 * (steady.amplitude / stated - 1.0)
        told.append(KINDS["amplitude"].found(found=steady.amplitude, stated=stated, share_percent=share))
    if steady.sinad <= limit:
        cause = "noisy" if steady.snr <= limit else "distorted"
        told.append(KINDS[cause].found(sinad_db=steady.sinad, limit_db=limit))
    return told


def _line_findings(lines: DriveLines, steady: SineFit) -> list[Diagnostic]:
    told = []
    for name, some in (("hum", lines.hum), ("second_line", lines.beside)):
        for line in some:
            share = 100.0 * line.amplitude / steady.amplitude
            told.append(KINDS[name].found(frequency=line.frequency, share_percent=share))
    return told


def _start_findings(startup: StartUp | None, period: float) -> list[Diagnostic]:
    if startup is None:
        return [KINDS["no_rest"].found()]
    if startup.onset_uncertainty > 0.05 * period:
        return [KINDS["slow_start"].found(uncertainty_ms=1e3 * startup.onset_uncertainty)]
    return []


def _slice(samples: SignalSamples, first: int, last: int | None) -> SignalSamples:
    return SignalSamples(samples.values[first:last], samples.time[first:last], samples.sampling_frequency)


def _between(samples: SignalSamples, start: float, stop: float) -> SignalSamples:
    inside = np.flatnonzero((samples.time >= start) & (samples.time < stop))
    if inside.size == 0:
        return _slice(samples, 0, 0)
    return _slice(samples, int(inside[0]), int(inside[-1]) + 1)


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
