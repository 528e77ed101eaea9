"""The steady sine of a shaker's record: without its flaws, and with errors that hold its wandering."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
from numpy.typing import NDArray

from snapbeam.lab.signals.flaws import Clipping, Flaw, find_clipping, find_flaws, sound_samples
from snapbeam.lab.signals.signal import SignalSamples
from snapbeam.lab.signals.sine_fit import SineFit, fit_sine

__all__ = ["robust_fit", "settled_cycles", "steady_fit", "with_wander"]

_Array = NDArray[np.float64]
_PULLED = 1.8  # times the noise by which phases off a line are no chance
_SMOOTH = 0.6  # of twice the variance, which the square of steps has on average where parts are by chance
_IN_A_ROW = 5  # steady cycles that end a start-up


def robust_fit(samples: SignalSamples, frequency: float, harmonics: int) -> SineFit:
    """A sine fitted to what is sound of a record: twice, the second time without its flaws."""
    fit = fit_sine(samples, frequency, harmonics)
    flaws = find_flaws(samples, fit)
    if not flaws:
        return fit
    keep = sound_samples(samples.values.size, flaws)
    return fit if keep.mean() < 0.5 else fit_sine(samples, fit.frequency, harmonics, keep=keep)


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
    whole = SignalSamples(
        np.where(cut, inner.waveform(samples.time), samples.values), samples.time, samples.sampling_frequency
    )
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
    parts = np.array_split(np.arange(phase.size), 8)
    at = np.array([times[part].mean() for part in parts])
    mean = np.array([phase[part].mean() for part in parts])
    own = []
    for part in parts:
        left = phase[part] - np.polyval(np.polyfit(times[part] - times[part].mean(), phase[part], 1),
                                        times[part] - times[part].mean())  # fmt: skip
        own.append(float(np.std(left, ddof=2)) / math.sqrt(part.size) if part.size > 2 else math.inf)
    off = mean - np.polyval(np.polyfit(at, mean, 1), at)
    if float(np.sqrt(np.mean(off**2))) < _PULLED * float(np.sqrt(np.mean(np.square(own)))):
        return 0.0
    rates = np.diff(mean) / np.diff(at)
    return float(np.std(rates, ddof=1)) / math.sqrt(_counts(rates))


def _counts(parts: _Array) -> float:
    """How many of the parts of a record count for their mean: all, or one where they follow each other smoothly.

    A slow change, as the beat of two lines too close to be parted, is no scatter that a mean evens out.
    """
    about = parts - parts.mean()
    total = float((about * about).sum())
    steps = float((np.diff(parts) ** 2).sum())
    return 1.0 if total > 0.0 and steps < _SMOOTH * total else float(parts.size)
