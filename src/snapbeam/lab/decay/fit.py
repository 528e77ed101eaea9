"""Decay by nonlinear least squares: all modes at once, amplitudes eliminated, priors on the law.

The nonlinear unknowns of a mode are its frequency, damping ratio and softening; amplitudes, phases, the mean
shift and the second harmonic of a softening mode are linear and solved for inside (variable projection, Golub
and Pereyra, SIAM J. Numer. Anal. 10, 1973).  lmfit does the iteration and the covariance.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid

from snapbeam.lab.decay.model import DampingLaw, ModeEstimate, envelope, law_priors
from snapbeam.lab.least_squares import covariance, solve
from snapbeam.lab.signals import SignalSamples
from snapbeam.lab.sine_fit import white_variance
from snapbeam.util.packages import needing
from snapbeam.util.validation import InputError

_VISCOUS = DampingLaw()
_SLOW = 4  # degree of the polynomial that is fitted beside the modes

_Array = NDArray[np.float64]


class FitResult(NamedTuple):
    """Modes, what they leave, and the noise: near the first mode (of ``explain``: the last) and overall.

    ``alone`` is the record with all modes but the first taken out.
    """

    modes: list[ModeEstimate]
    residual: _Array
    alone: _Array
    noise_near: float
    noise_rms: float


class FitSettings(NamedTuple):
    """Unit of the signal, which tells displacement from velocity, and whether frequencies may depend on amplitude.

    ``known`` are the softening kappa of the first mode and its standard deviation, known beforehand.
    """

    units: str
    soften: bool
    known: tuple[float, float] | None


def fit_decay(
    samples: SignalSamples, guesses: list[ModeEstimate], settings: FitSettings, law: DampingLaw = _VISCOUS
) -> FitResult:
    """Fit decaying modes to a signal, starting from *guesses* (the first is the one that softens most).

    *law* is that by which the first mode is damped; its strength is fitted too, of a free form it is held.
    """
    units, soften, known = settings
    with needing("the fit of a decay", "lab"):
        import lmfit

    prior = law_priors(units)
    parameters = lmfit.Parameters()
    for i, guess in enumerate(guesses):
        freq = guess.natural_frequency
        parameters.add(f"f{i}", freq, min=0.5 * freq, max=1.5 * freq)
        parameters.add(f"z{i}", max(guess.damping_ratio, 1e-6), min=1e-9, max=0.5)
        if soften:
            start = guess.softening * guesses[0].amplitude ** 2
            parameters.add(f"s{i}", float(np.clip(start, -0.4, 0.4)), min=-0.5, max=0.5)
    if soften:
        for name, (mean, _) in prior.items():
            parameters.add(name, mean)
    named = law.name in ("dry", "quadratic")
    if named:
        parameters.add("h", law.strength, min=0.0, max=100.0)
    trifle = 1e-12 * float(np.abs(samples.values).max())
    sigma = max(explain(samples, guesses, units, soften).noise_near, trifle)

    def residual(value: dict[str, float]) -> _Array:
        _, solution, rest = _solved(samples, value, len(guesses), soften, law)
        parts = [rest / sigma]
        if soften:
            parts.append(np.array([(value[k] - m) / sd for k, (m, sd) in prior.items()]))
            if known is not None:
                square = float(solution[1] ** 2 + solution[2] ** 2)
                parts.append(np.array([(value["s0"] / square - known[0]) / known[1]]))
        return np.concatenate(parts)

    search = lmfit.Minimizer(lambda p: residual(p.valuesdict()), parameters, scale_covar=False, calc_covar=False)
    value = dict(search.leastsq(xtol=1e-9, ftol=1e-9).params.valuesdict())
    design, solution, rest = _solved(samples, value, len(guesses), soften, law)
    fitted = [value[f"f{i}"] for i in range(len(guesses))]
    free = design.shape[1] + len(parameters)
    near = [noise_near(samples.sampling_frequency, rest, f, fitted, free) for f in fitted]
    sigma = max(near[0], trifle)
    error = _errors(residual, value)
    linear = sigma * np.sqrt(np.diag(covariance(design, 1e-12)))
    modes = []
    columns = _columns(len(guesses), soften)
    for i in range(len(guesses)):
        c, s = solution[columns[i]], solution[columns[i] + 1]
        amplitude = math.hypot(c, s)
        stretch = near[i] / near[0] if near[0] > 0.0 else 1.0
        first = math.hypot(solution[1], solution[2])
        modes.append(
            ModeEstimate(
                natural_frequency=value[f"f{i}"],
                natural_frequency_se=error[f"f{i}"] * stretch,
                damping_ratio=value[f"z{i}"],
                damping_ratio_se=error[f"z{i}"] * stretch,
                amplitude=amplitude,
                amplitude_se=float(linear[columns[i]]) * stretch,
                phase=math.atan2(-s, c),
                softening=value[f"s{i}"] / first**2 if soften else 0.0,
                softening_se=error[f"s{i}"] * stretch / first**2 if soften else 0.0,
                method="fit",
                damping=_VISCOUS if i else law._replace(strength=value["h"], strength_se=error["h"]) if named else law,
            )
        )
    rms = math.sqrt(float(rest @ rest) / max(rest.size - free, 1))
    alone = _alone(design, solution, rest, columns)
    return FitResult(modes, rest, alone, near[0], rms)


def explain(samples: SignalSamples, modes: list[ModeEstimate], units: str, soften: bool) -> FitResult:
    """Fit amplitudes and phases of given modes to a signal, with all other parameters fixed."""
    first = modes[0].amplitude ** 2
    value = {name: mean for name, (mean, _) in law_priors(units).items()}
    for i, mode in enumerate(modes):
        value |= {f"f{i}": mode.natural_frequency, f"z{i}": mode.damping_ratio, f"s{i}": mode.softening * first}
    design, solution, rest = _solved(samples, value, len(modes), soften, modes[0].damping)
    free = design.shape[1] + 3 * len(modes)
    frequencies = [mode.natural_frequency for mode in modes]
    near = noise_near(samples.sampling_frequency, rest, frequencies[-1], frequencies, free)
    alone = _alone(design, solution, rest, _columns(len(modes), soften))
    return FitResult(modes, rest, alone, near, math.sqrt(float(rest @ rest) / max(rest.size - free, 1)))


def noise_near(rate: float, rest: _Array, frequency: float, fitted: list[float], free: int) -> float:
    """Standard deviation of the noise near a frequency [Hz], the fitted modes and their second harmonics left out."""
    return math.sqrt(white_variance(rest, rate, frequency, [0.0, *fitted, *(2.0 * f for f in fitted)], free))


def _errors(residual: Callable[[dict[str, float]], _Array], value: dict[str, float]) -> dict[str, float]:
    """Standard errors from the Jacobian at the minimum, by central differences."""
    columns = []
    for name, center in value.items():
        step = {"f": 1e-7 * center, "z": 1e-4 * center, "h": 1e-4}.get(name[0], 1e-5)
        sides = [residual({**value, name: center + sign * step}) for sign in (1.0, -1.0)]
        columns.append((sides[0] - sides[1]) / (2.0 * step))
    jacobian = np.column_stack(columns)
    if not np.isfinite(jacobian).all() or not jacobian.any(axis=0).all():
        raise InputError("signal: the fit of decaying modes found no minimum; fewer modes may be there")
    return dict(zip(value, np.sqrt(np.diag(covariance(jacobian, 1e-14))), strict=True))


def _columns(count: int, soften: bool) -> list[int]:
    """First column of each mode in the design: cosine, sine, and for the first the mean shift and 2 theta."""
    return [1 + 2 * i + (3 if soften and i > 0 else 0) for i in range(count)]


def _solved(
    samples: SignalSamples, value: dict[str, float], count: int, soften: bool, law: DampingLaw
) -> tuple[_Array, _Array, _Array]:
    """The design of modes, the amplitudes that fit best, and what they leave."""
    design = _design(samples.time - samples.time[0], value, count, soften, law)
    solution = solve(design, samples.values, 1e-12)
    return design, solution, samples.values - design @ solution


def _design(t: _Array, value: dict[str, float], count: int, soften: bool, law: DampingLaw) -> _Array:
    columns = [np.ones_like(t)]
    omega0 = 2.0 * math.pi * value["f0"]
    delta0 = value["z0"] * omega0
    own, fall, first, second = _first_envelope(t, delta0, law._replace(strength=value.get("h", law.strength)))
    for i in range(count):
        omega = 2.0 * math.pi * value[f"f{i}"]
        zeta = value[f"z{i}"]
        shape = own if i == 0 else np.exp(-zeta * omega * t)
        clock = t
        if soften:
            s = value[f"s{i}"]
            clock = t - s * first - (value["q"] * s * s * second if i == 0 else 0.0)
            if i == 0:
                shape = shape * (1.0 + value["r"] * s * fall)
        turn = np.exp(1j * (omega * math.sqrt(1.0 - zeta * zeta)) * clock)
        columns += [shape * turn.real, shape * turn.imag]
        if soften and i == 0:
            double = turn * turn
            columns += [fall, fall * double.real, fall * double.imag]
    # whatever else moves slowly must not be told by the rate at which the mean shift of a softening mode falls
    slow = np.polynomial.legendre.legvander(2.0 * (t - t[0]) / (t[-1] - t[0]) - 1.0, _SLOW)
    return np.column_stack([*columns, *slow[:, 1:].T])


def _first_envelope(t: _Array, decay_rate: float, law: DampingLaw) -> tuple[_Array, _Array, _Array, _Array]:
    """Envelope E of the first mode, E^2, and the integrals of E^2 and E^4 from the start."""
    if law.name == "viscous":
        own = np.exp(-decay_rate * t)
        fall = own * own
        steep = max(decay_rate, 1e-12)
        return own, fall, (1.0 - fall) / (2.0 * steep), (1.0 - fall**2) / (4.0 * steep)
    own = envelope(law, t, decay_rate)
    fall = own * own
    first = cumulative_trapezoid(fall, t, initial=0.0)
    return own, fall, first, cumulative_trapezoid(fall * fall, t, initial=0.0)


def _alone(design: _Array, solution: _Array, rest: _Array, columns: list[int]) -> _Array:
    """Signal after subtraction of all modes but the first."""
    first = np.ones(solution.size, dtype=bool)
    for column in columns[1:]:
        first[column : column + 2] = False
    return np.asarray(rest + design[:, first] @ solution[first], dtype=np.float64)
