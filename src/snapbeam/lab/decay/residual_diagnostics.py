"""Residual of a decay fit, and its effect on the standard errors."""

from __future__ import annotations

import dataclasses
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid

from snapbeam.lab.decay.fit import FitResult
from snapbeam.lab.decay.model import Cycles, ModeEstimate, envelope
from snapbeam.lab.decay.window import Doubt
from snapbeam.lab.diagnostics import KINDS_DECAY, holding
from snapbeam.lab.least_squares import weighted_line, widened
from snapbeam.lab.signals import SignalSamples
from snapbeam.util.diagnostics import Diagnostic

_Array = NDArray[np.float64]
_RATIO = 1.6  # of what is left to what the noise explains, from which the fit is in doubt
_MATTERS = 0.003  # of the amplitude; what is left below that is of no matter
_HARDENS = 6.0  # standard errors
_RISE = 3e-4  # share of the frequency
_BAND = 2.56  # of an analyser: its sampling frequency over its highest line
_APART = 6.0  # standard errors by which two halves of a decay may differ


class Misfit(NamedTuple):
    """Residual near the first mode: relative to the noise (``ratio``), and to the amplitude (``share``)."""

    ratio: float
    share: float


def misfit_of(samples: SignalSamples, residual: _Array, modes: list[ModeEstimate]) -> Misfit:
    """Residual in a narrow band about the first mode, relative to the noise next to that band.

    The band is that of the decay itself, at least some lines of the spectrum wide.
    """
    first = modes[0]
    n = residual.size
    span = n / samples.sampling_frequency
    rate = first.damping_ratio * 2.0 * math.pi * first.natural_frequency
    half = max(5.0 / span, 3.0 * rate / (2.0 * math.pi))
    power = np.abs(np.fft.rfft(residual)) ** 2 / n
    freq = np.fft.rfftfreq(n, 1.0 / samples.sampling_frequency)
    away = np.abs(freq - first.natural_frequency)
    inside = away <= half
    beside = (away > half) & (away < max(12.0 * half, 0.5 * first.natural_frequency))
    beside &= freq > 0.3 * first.natural_frequency
    for mode in modes[1:]:
        width = max(5.0 / span, 2.0 * mode.damping_ratio * mode.natural_frequency)
        beside &= np.abs(freq - mode.natural_frequency) >= width
    beside &= np.abs(freq - 2.0 * first.natural_frequency) > half
    if beside.sum() < 8 or inside.sum() < 3:
        return Misfit(1.0, 0.0)
    noise = float(np.median(power[beside])) / math.log(2.0)
    left = float(power[inside].mean())
    floor = (1e-7 * first.amplitude) ** 2
    ratio = math.sqrt(left / max(noise, floor))
    # what is left as an amplitude over the time the mode lives
    alive = min(span, 0.5 / max(rate, 1e-9))
    excess = max(float(power[inside].sum()) - noise * float(inside.sum()), 0.0)
    share = math.sqrt(4.0 * excess / (alive * samples.sampling_frequency)) / first.amplitude
    return Misfit(ratio, share)


def judged(
    samples: SignalSamples, result: FitResult, cycles: Cycles, misfit: Misfit, soften: bool
) -> tuple[list[ModeEstimate], list[Diagnostic]]:
    """The modes with standard errors that hold what the fit leaves, and what is to be said of that."""
    told: list[Diagnostic] = []
    first = result.modes[0]
    rates, turns = _halves(cycles, first, float(samples.time[0]), soften)
    omega = 2.0 * math.pi * first.natural_frequency
    damping_apart = abs(rates[0]) / omega
    freq_apart = abs(turns[0]) / (2.0 * math.pi)
    worse_damping, worse_frequency = (abs(one[0]) / max(one[1], 1e-300) for one in (rates, turns))
    doubtful = misfit.ratio > _RATIO and misfit.share > _MATTERS
    if doubtful:
        told.append(KINDS_DECAY["misfit"].found(ratio=misfit.ratio, share_percent=100.0 * misfit.share))
    matters = damping_apart > 0.03 * first.damping_ratio or freq_apart > 3e-4 * first.natural_frequency
    if max(worse_damping, worse_frequency) > _APART and matters:
        told.append(KINDS_DECAY["parts_differ"].found(frequency_se=worse_frequency, damping_se=worse_damping))
        doubtful = True
    if not doubtful:
        return list(result.modes), told
    grown = max(misfit.ratio, 1.0)
    missed = misfit.share * first.damping_ratio
    raised = []
    for mode in result.modes:
        freq_se, damping_se = mode.natural_frequency_se * grown, mode.damping_ratio_se * grown
        if mode is first:
            freq_se = max(freq_se, freq_apart, missed * mode.natural_frequency)
            damping_se = max(damping_se, damping_apart, missed)
        raised.append(dataclasses.replace(mode, natural_frequency_se=freq_se, damping_ratio_se=damping_se))
    return raised, told


def _halves(
    cycles: Cycles, mode: ModeEstimate, start: float, soften: bool
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Differences of the rate of decay [1/s] and of the angular frequency [rad/s] between the halves of a decay.

    Each difference comes with its standard error; the changes that the fit explains are taken out first.
    """
    t = cycles.time - start
    if t.size < 12:
        return (0.0, math.inf), (0.0, math.inf)
    omega = 2.0 * math.pi * mode.natural_frequency
    rate = mode.damping_ratio * omega
    shape = envelope(mode.damping, t, rate)
    log_rest = np.log(cycles.amplitude) - np.log(shape)
    s = mode.softening * mode.amplitude**2 if soften else 0.0
    clock = t - s * cumulative_trapezoid(shape**2, t, initial=0.0)
    phase_rest = cycles.phase - omega * math.sqrt(1.0 - mode.damping_ratio**2) * clock
    weight = cycles.amplitude**2
    # halves of equal weight, so that both tell as much
    half = int(np.searchsorted(np.cumsum(weight), 0.5 * weight.sum()))
    half = min(max(half, 6), t.size - 6)
    out = []
    for series in (log_rest, phase_rest):
        slopes, errors = [], []
        for part in (slice(0, half), slice(half, t.size)):
            w, x, y = weight[part], t[part], series[part]
            middle, level, slope, lever = weighted_line(x, y, w)
            rest = y - level - slope * (x - middle)
            noise = max(cycles.noise**2, float((w * rest**2).sum()) / max(x.size - 2, 1))
            slopes.append(slope)
            errors.append(math.sqrt(noise / lever))
        out.append((slopes[1] - slopes[0], math.hypot(*errors)))
    return out[0], out[1]


def sampled_diagnostics(modes: tuple[ModeEstimate, ...], sampling_frequency: float) -> list[Diagnostic]:
    """Diagnostics for modes above the band that is free of aliasing."""
    limit = sampling_frequency / _BAND
    high = [mode.natural_frequency for mode in modes if mode.natural_frequency > limit]
    kind = KINDS_DECAY["above_band"]
    return [kind.found(frequency=one, limit_hz=limit, folded=sampling_frequency - one) for one in high]


def with_doubts(modes: tuple[ModeEstimate, ...], doubt: Doubt, added: float) -> tuple[ModeEstimate, ...]:
    """Modes whose errors hold a *doubt*, and a rate [1/s] *added* by a window."""
    first = modes[0].amplitude ** 2
    return tuple(
        widened(
            mode,
            natural_frequency=(doubt.frequency * mode.natural_frequency,),
            damping_ratio=(added / (2.0 * math.pi * mode.natural_frequency), max(doubt) * mode.damping_ratio),
            softening=(doubt.frequency / first if mode.softening_se > 0.0 else 0.0,),
        )
        for mode in modes
    )


def diagnostics_about(
    samples: SignalSamples, modes: tuple[ModeEstimate, ...], noise: float, soften: bool
) -> list[Diagnostic]:
    """Diagnostics from the numbers of one decay alone."""
    first = modes[0]
    left = math.exp(-first.damping_ratio * 2.0 * math.pi * first.natural_frequency * samples.duration)
    rise = -first.softening * first.amplitude**2 if soften else 0.0
    certain = -first.softening / first.softening_se if first.softening_se > 0.0 else 0.0
    hard = {"rise_percent": 100.0 * rise, "certain": certain, "half_hz": 0.5 * samples.sampling_frequency}
    return holding(
        KINDS_DECAY,
        ("short", left > 0.7, {"left_percent": 100.0 * left}),
        ("large", abs(rise) > 0.1, {"change_percent": 100.0 * abs(rise)}),
        ("hardening", certain > _HARDENS and rise > _RISE, hard),
        ("faint", first.amplitude < 5.0 * noise, {}),
        ("undamped", first.damping_ratio < 2.0 * first.damping_ratio_se, {}),
    )
