"""The modes of a decay fitted: those that lie close at once, what is not asked for taken out, laws of damping tried."""

from __future__ import annotations

import math

import numpy as np

from snapbeam.lab.decay.fit import FitResult, FitSettings, explain, fit_decay
from snapbeam.lab.decay.model import (
    Cycles,
    DampingLaw,
    ModeEstimate,
    find_law,
    hilbert_cycles,
    noise_level,
    peak_cycles,
    regress,
)
from snapbeam.lab.decay.poles import Line, Pole, Stabilisation, find_poles, thinned, without_lines, without_poles
from snapbeam.lab.decay.residual_diagnostics import misfit_of
from snapbeam.lab.decay.window import CLOSE, ENERGY, Centres, Decay
from snapbeam.lab.diagnostics import KINDS_DECAY
from snapbeam.lab.least_squares import widened
from snapbeam.lab.signals import SignalSamples
from snapbeam.lab.sine_fit import fit_sine
from snapbeam.util.diagnostics import Diagnostic
from snapbeam.util.singular_values import polyfit
from snapbeam.util.validation import InputError

_MISFIT = 1.7  # times the noise that a fit may leave near the first mode
_CANCEL = 1.0  # of the range of a record that the amplitude of a mode may reach; more is cancelled by another
_MANY = 12_000  # samples from which a record is thinned before it is fitted


def fit_modes(
    decay: Decay, centres: Centres, settings: FitSettings
) -> tuple[SignalSamples, FitResult, Cycles, list[Diagnostic], Stabilisation | None]:
    """The modes fitted, those that lie close together and, in a short record, all of them, at once.

    Modes that are not asked for are taken out first if they lie far away, and fitted beside if they do not.
    """
    clean = without_poles(decay.samples, centres.far, [*centres.own, *centres.near])
    groups = [centres.wanted]
    if clean.values.size >= _MANY and len(centres.wanted) > 1:
        groups = _groups(centres.wanted)
    diagram = centres.diagram
    told: list[Diagnostic] = []
    first: tuple[SignalSamples, FitResult, Cycles] | None = None
    found: dict[float, ModeEstimate] = {}
    for group in groups:
        mine = [pole for pole in centres.own if pole.frequency in group]
        others = [pole for pole in centres.own if pole not in mine]
        beside = [pole for pole in centres.near if any(abs(pole.frequency / f - 1.0) < CLOSE for f in group)]
        away = [pole for pole in centres.near if pole not in beside]
        part = without_poles(clean, [*others, *away] if len(groups) > 1 else away, [*mine, *beside])
        # a long record at fourteen samples or more to the shortest period
        factor = int(part.sampling_frequency / (14.0 * max([*group, *(pole.frequency for pole in beside)])))
        if part.values.size >= _MANY and factor >= 2:
            part = thinned(part, max(min(factor, part.values.size // 3000), 1))
        result, cycles, more, diagram = _group_fit(part, group, mine, beside, settings, diagram)
        part, result = _lines_again(decay, part, result, settings)
        told += more
        found |= dict(zip(group, result.modes, strict=False))
        first = first or (part, result, cycles)
    assert first is not None
    samples, result, cycles = first
    modes = [found[f] for f in centres.wanted] + [mode for mode in result.modes if mode not in found.values()]
    return samples, result._replace(modes=modes), cycles, told, diagram


def _groups(frequencies: list[float]) -> list[list[float]]:
    """Frequencies that lie close together, the first one's group first."""
    groups: list[list[float]] = []
    for f in frequencies:
        near = next((group for group in groups if any(abs(f / g - 1.0) < CLOSE for g in group)), None)
        if near is None:
            groups.append([f])
        else:
            near.append(f)
    return groups


def _lines_again(
    decay: Decay, samples: SignalSamples, result: FitResult, settings: FitSettings
) -> tuple[SignalSamples, FitResult]:
    """The fit once more, lines that do not decay fitted to what the modes left; as it was without such lines."""
    if not decay.lines:
        return samples, result
    rest = samples._replace(values=result.residual)
    for line in decay.lines:
        if line.frequency > 0.45 * samples.sampling_frequency:
            continue
        try:
            left = fit_sine(rest, line.frequency, 1, fixed=True)
        except InputError:
            continue
        rest = without_lines(rest, [Line(left.frequency, left.amplitude, left.phase)])
    change = rest.values - result.residual
    better, mode = samples._replace(values=samples.values + change), result.modes[0]
    law = None if mode.law == "viscous" else DampingLaw(mode.law, mode.law_strength, mode.law_strength_se)
    return better, fit_decay(better, result.modes, settings, law)


def _group_fit(
    samples: SignalSamples,
    centres: list[float],
    own: list[Pole],
    beside: list[Pole],
    settings: FitSettings,
    diagram: Stabilisation | None,
) -> tuple[FitResult, Cycles, list[Diagnostic], Stabilisation | None]:
    """Modes fitted together; where they leave more than noise, a second law of damping or a close mode."""
    start = float(samples.time[0])
    guesses, cycles = _guesses(samples, centres, own, settings.units, settings.soften)
    apart = [pole for pole in beside if _apart(samples, pole, guesses)]
    made: tuple[FitResult, float, float, list[Diagnostic]] | None = None
    for some in ([], apart) if apart else ([],):
        if some and made is not None and made[0].modes[0].law != "viscous" and made[1] < _MISFIT:
            apart = []
            break  # a law of damping explains what looked like modes
        start_from = [*guesses, *(_of_pole(pole) for pole in some)]
        result = fit_decay(samples, start_from, settings)
        largest = max(mode.amplitude for mode in result.modes)
        if made is not None and largest > _CANCEL * float(np.ptp(samples.values)):
            apart = []
            break
        alone = _own_cycles(samples, result, cycles)
        rate = 2.0 * math.pi * result.modes[0].natural_frequency * result.modes[0].damping_ratio
        law, doubt = find_law(alone, start, rate)
        left = misfit_of(samples, result.residual, result.modes).ratio
        told: list[Diagnostic] = []
        if law is not None:
            result, left, told = _with_law(samples, result, left, settings, law)
        made = result, left, doubt, told
    assert made is not None
    result, left, doubt, told = made
    guesses = [*guesses, *(_of_pole(pole) for pole in apart)]
    if left > _MISFIT and len(guesses) < 8:
        near = [pole for pole in beside if pole not in apart]
        better, diagram = _with_close_mode(samples, result, near, settings, diagram)
        if better is not None:
            result = better
            first = better.modes[0].natural_frequency
            second = min((mode.natural_frequency for mode in better.modes[1:]), key=lambda f: abs(f - first))
            told = [KINDS_DECAY["close_modes"].found(first=first, second=second)]
    if result.modes[0].law == "viscous":
        result.modes[0] = widened(result.modes[0], damping_ratio=(doubt * result.modes[0].damping_ratio,))
    return result, _own_cycles(samples, result, cycles), told, diagram


def _apart(samples: SignalSamples, pole: Pole, modes: list[ModeEstimate]) -> bool:
    """Return whether a pole is too far from all modes to be a side pole of a softening mode."""
    widths = ((mode.natural_frequency, max(2.0 * mode.damping_ratio, 0.06)) for mode in modes)
    least = 8.0 / samples.duration
    return all(abs(pole.frequency - f) > max(least, width * f) for f, width in widths)


def _with_law(
    samples: SignalSamples, result: FitResult, left: float, settings: FitSettings, law: DampingLaw
) -> tuple[FitResult, float, list[Diagnostic]]:
    """The fit with a second law of damping where that is told apart and leaves less; else as it was."""
    try:
        other = fit_decay(samples, result.modes, settings, law)
    except InputError:
        return result, left, []
    first = other.modes[0]
    rest = misfit_of(samples, other.residual, other.modes).ratio
    told_apart = first.law_strength > 3.0 * first.law_strength_se
    if not told_apart or other.noise_rms >= 0.999 * result.noise_rms or rest >= max(0.8 * left, _MISFIT):
        return result, left, []
    strength, error = first.law_strength, first.law_strength_se
    return other, rest, [KINDS_DECAY["damping_law"].found(told=first.law, strength=strength, error=error)]


def _of_pole(pole: Pole) -> ModeEstimate:
    """A guess of a mode from its pole."""
    nan = math.nan
    zeta = max(pole.damping_ratio, 1e-5)
    return ModeEstimate(pole.frequency, nan, zeta, nan, pole.amplitude, nan, 0.0, 0.0, 0.0, "pencil")


def _guesses(
    samples: SignalSamples, centres: list[float], poles: list[Pole], units: str, soften: bool
) -> tuple[list[ModeEstimate], Cycles]:
    """Each mode by its cycles, or by its pole where too few stand out; and the cycles of the first."""
    sigma = noise_level(samples)
    rest = samples
    found: list[ModeEstimate] = []
    kept: Cycles | None = None
    for center in centres:
        try:
            estimate, cycles = mode_by_cycles(rest, center, sigma, units, "hilbert", soften and not found)
        except InputError:
            pole = next((one for one in poles if one.frequency == center), None)
            if pole is None or kept is None:
                raise
            estimate, cycles = _of_pole(pole), kept
        kept = kept or cycles
        found.append(estimate)
        if len(centres) > 1:
            rest = samples._replace(values=explain(samples, found, units, soften).residual)
    assert kept is not None
    return found, kept


def mode_by_cycles(
    rest: SignalSamples, center: float, sigma: float, units: str, method: str, soften: bool
) -> tuple[ModeEstimate, Cycles]:
    """A mode by its cycles, once more about its own mean frequency."""
    maker = peak_cycles if method == "log_decrement" else hilbert_cycles
    start = float(rest.time[0])
    cycles = maker(rest, center, sigma)
    estimate = regress(cycles, start, units, method, soften)
    mean = float(polyfit(cycles.time, cycles.phase, 1, w=cycles.amplitude)[0] / (2.0 * math.pi))
    if 0.8 * center < mean < 1.2 * center:
        cycles = maker(rest, mean, sigma)
        estimate = regress(cycles, start, units, method, soften)
    return estimate, cycles


def _own_cycles(samples: SignalSamples, result: FitResult, otherwise: Cycles) -> Cycles:
    """The first mode's cycles with the other modes taken out."""
    first = result.modes[0]
    if len(result.modes) == 1:
        return otherwise
    try:
        alone = samples._replace(values=result.alone)
        return hilbert_cycles(alone, first.natural_frequency, noise_level(samples))
    except InputError:
        return otherwise


def _with_close_mode(
    samples: SignalSamples,
    result: FitResult,
    near: list[Pole],
    settings: FitSettings,
    diagram: Stabilisation | None,
) -> tuple[FitResult | None, Stabilisation | None]:
    """The fit with one mode more, close to the first, if the pencil sees one and it explains what is left."""
    first = result.modes[0].natural_frequency
    if len(near) < 2:
        poles, fresh = find_poles(samples, noise_level(samples))
        diagram = diagram or fresh
        near = [one for one in poles if one.energy > ENERGY and one.damping_ratio > -1e-3]
        near = [one for one in near if abs(one.frequency / first - 1.0) < CLOSE]
    if len(near) < 2:
        return None, diagram
    others = [mode for mode in result.modes[1:] if abs(mode.natural_frequency / first - 1.0) > CLOSE]
    pair = [_of_pole(pole) for pole in near[:2]]
    try:
        better = fit_decay(samples, [pair[0], *others, pair[1]], FitSettings(settings.units, False, None))
    except InputError:
        return None, diagram
    return (better if better.noise_rms < 0.9 * result.noise_rms else None), diagram
