"""A record made ready for its modes: cut to the free decay, without drift and without lines that do not decay."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.findings import Diagnostic
from snapbeam.core.validate import InputError, finite
from snapbeam.lab.decay.cycles import hilbert_cycles, noise_level, regress
from snapbeam.lab.decay.drift import Line, find_drift, find_lines, without_lines
from snapbeam.lab.decay.release import find_ceiling, find_jump, find_release
from snapbeam.lab.decay.wandering import frequency_drift, steadied
from snapbeam.lab.plausibility.decay import KINDS
from snapbeam.lab.signals.signal import SignalSamples

__all__ = ["Decay", "dominant", "prepared"]

_Array = NDArray[np.float64]
_LEAST_CYCLES = 8.0


@dataclass(frozen=True)
class Decay:
    """The free part of a record, cleaned; what was taken out of it, and what was found on the way.

    ``drift`` is the share by which the frequency changes with time over it; ``samples`` are without.
    """

    samples: SignalSamples
    lines: tuple[Line, ...]
    diagnostics: tuple[Diagnostic, ...]
    drift: float


def dominant(samples: SignalSamples, low: float = 0.0, high: float | None = None) -> float:
    """Frequency [Hz] of the strongest decaying sine, under a window that is greatest at the start.

    A window that rises from zero would hide what decays fast.

    Raises
    ------
    InputError
        If the band holds no oscillation.
    """
    n = samples.values.size
    values = samples.values - samples.values.mean()
    window = np.cos(0.5 * math.pi * np.arange(n) / n) ** 2
    values = values - float((values * window).sum() / window.sum())
    freq = np.fft.rfftfreq(4 * n, 1.0 / samples.sampling_frequency)
    # what passes fewer than eight times is rather a drift
    slow = np.minimum(freq * n / samples.sampling_frequency / _LEAST_CYCLES, 1.0) ** 2
    spectrum = np.abs(np.fft.rfft(values * window, 4 * n)) * slow
    top = samples.sampling_frequency / 2.0 if high is None else high
    inside = np.flatnonzero((freq >= max(low, 3.0 * samples.sampling_frequency / n)) & (freq <= top))
    if inside.size == 0 or not spectrum[inside].max() > 1e-14 * float(np.abs(samples.values).max() + 1e-300):
        raise InputError(f"signal: no oscillation between {low:g} and {top:g} Hz")
    at = int(inside[np.argmax(spectrum[inside])])
    if 0 < at < spectrum.size - 1 and spectrum[at - 1] > 0.0 and spectrum[at + 1] > 0.0:
        a, b, c = np.log(spectrum[at - 1 : at + 2])
        bend = a - 2.0 * b + c
        return float(freq[at] + (0.5 * (a - c) / bend if bend < 0.0 else 0.0) * (freq[1] - freq[0]))
    return float(freq[at])


def prepared(samples: SignalSamples, start: float | None, stop: float | None) -> Decay:
    """Cut a record to its free decay and take out what does not belong to it.

    Parameters
    ----------
    samples
        The record.
    start, stop
        The part [s] that decays freely, as far as a person says so.

    Raises
    ------
    InputError
        If fewer than 64 samples or 8 cycles are left.
    """
    part = _cut(samples, start, stop)
    diagnostics: list[Diagnostic] = []
    frequency = dominant(part)
    if start is None:
        first = find_release(part, frequency)
        if first:
            part = _sliced(part, first, None)
            diagnostics.append(KINDS["release"].found(start=float(part.time[0])))
            frequency = dominant(part)
    _enough(part, frequency)
    part, told = _below_ceiling(part, frequency)
    diagnostics += told
    rate = _decay_rate(part, frequency)
    lines = find_lines(part, rate)
    clean = without_lines(part, lines)
    largest = max(float(np.percentile(np.abs(clean.values - np.median(clean.values)), 99)), 1e-300)
    for line in lines:
        diagnostics.append(
            KINDS["hum"].found(frequency=line.frequency, amplitude_percent=100.0 * line.amplitude / largest)
        )
    frequency = dominant(clean)
    rate = _decay_rate(clean, frequency)
    drift, degree = find_drift(clean, frequency, rate)
    if degree:
        clean = SignalSamples(clean.values - drift, clean.time, clean.sampling_frequency)
        diagnostics.append(
            KINDS["drift"].found(drift_percent=100.0 * float(np.ptp(drift)) / largest, degree=degree)
        )
        frequency = dominant(clean)
    clean, told = _undisturbed(clean, frequency)
    clean, share = _steady(clean, frequency)
    if share:
        told.append(KINDS["frequency_drift"].found(share_percent=100.0 * share))
    return Decay(clean, tuple(lines), (*diagnostics, *told), share)


def _cut(samples: SignalSamples, start: float | None, stop: float | None) -> SignalSamples:
    low = samples.time[0] if start is None else finite("start", start)
    high = samples.time[-1] if stop is None else finite("stop", stop)
    inside = (samples.time >= low) & (samples.time <= high)
    if inside.sum() < 64:
        raise InputError(
            f"start = {low:g}, stop = {high:g}: hold {inside.sum()} samples of the signal, which runs from "
            f"{samples.time[0]:g} to {samples.time[-1]:g} s: must hold at least 64"
        )
    return SignalSamples(samples.values[inside], samples.time[inside], samples.sampling_frequency)


def _sliced(samples: SignalSamples, first: int, last: int | None) -> SignalSamples:
    return SignalSamples(samples.values[first:last], samples.time[first:last], samples.sampling_frequency)


def _enough(samples: SignalSamples, frequency: float) -> None:
    cycles = frequency * samples.values.size / samples.sampling_frequency
    if cycles < _LEAST_CYCLES:
        raise InputError(f"signal spans {cycles:.1f} cycles of {frequency:g} Hz: must span at least 8")


def _below_ceiling(samples: SignalSamples, frequency: float) -> tuple[SignalSamples, list[Diagnostic]]:
    """The decay from where its tops are no longer cut off."""
    ceiling = find_ceiling(samples, frequency)
    if ceiling is None:
        return samples, []
    left = frequency * (samples.values.size - ceiling.until) / samples.sampling_frequency
    if left < 1.5 * _LEAST_CYCLES:
        return samples, [KINDS["clipped_throughout"].found()]
    rest = _sliced(samples, ceiling.until, None)
    return rest, [KINDS["clipped"].found(until=float(rest.time[0]))]


def _decay_rate(samples: SignalSamples, frequency: float) -> float:
    """A rough rate of decay [1/s] of the strongest mode, 0 where none can be told."""
    try:
        cycles = hilbert_cycles(samples, frequency, noise_level(samples))
        mode = regress(cycles, float(samples.time[0]), "1", "hilbert", soften=False)
    except InputError:
        return 0.0
    return max(2.0 * math.pi * mode.natural_frequencies * mode.damping_ratio, 0.0)


def _steady(samples: SignalSamples, frequency: float) -> tuple[SignalSamples, float]:
    """The decay on a clock that drifts as its frequency does, and by what share that is; 0 where it does not."""
    try:
        cycles = hilbert_cycles(samples, frequency, noise_level(samples))
    except InputError:
        return samples, 0.0
    within = frequency_drift(cycles, frequency)
    if not within:
        return samples, 0.0
    share = within * float((samples.time[-1] - samples.time[0]) / (cycles.time[-1] - cycles.time[0]))
    return steadied(samples, share), share


def _undisturbed(samples: SignalSamples, frequency: float) -> tuple[SignalSamples, list[Diagnostic]]:
    """The decay up to a jump of its amplitude or phase, or from it on where that is longer."""
    try:
        cycles = hilbert_cycles(samples, frequency, noise_level(samples))
    except InputError:
        return samples, []
    jump = find_jump(cycles)
    if jump is None:
        return samples, []
    at = int(np.searchsorted(samples.time, jump.time))
    margin = int(2.5 * samples.sampling_frequency / frequency)
    before, after = at - margin, samples.values.size - at - margin
    least = 1.5 * _LEAST_CYCLES * samples.sampling_frequency / frequency
    if max(before, after) < least:
        return samples, [
            KINDS["disturbed"].found(told="about", at=jump.time, jump_percent=100.0 * jump.share)
        ]
    early = before >= least and before >= 0.4 * after
    kept = _sliced(samples, 0, before) if early else _sliced(samples, at + margin, None)
    side = "before" if early else "after"
    return kept, [KINDS["disturbed"].found(told=side, at=jump.time, jump_percent=100.0 * jump.share)]
