"""Results of a decay identification, and the amplitude-frequency law of a softening mode.

With linear damping the action of a free oscillation falls as exp(-2 zeta omega_0 t).  A mode about a well
of a bistable beam softens: at amplitude a its frequency is

    f(a) = f_0 (1 - kappa a^2 - q kappa^2 a^4),
    a(t) = a_0 E (1 + r kappa a_0^2 E^2),    E = exp(-zeta omega_0 t),

and kappa = 0.75/b^2 for the displacement of one mode with two wells at -b and b.  The exact orbits of that
oscillator give q = 17/12 and r = 1/3 with a measured by the square root of the action (r = -2/3 for the
velocity); a real beam has other values of the same size.  So both are fitted with a prior, wide enough to
hold 0 as well, and what is not known about them is in the standard errors.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import combinations
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid
from scipy.optimize import brentq
from scipy.special import ndtr

from snapbeam.lab.decay.poles import Line, Stabilisation, damped_waves
from snapbeam.lab.least_squares import phasors, weighted_line
from snapbeam.lab.signals import SignalSamples, check_signal
from snapbeam.util.diagnostics import Diagnostic, doubtful
from snapbeam.util.singular_values import lstsq, pinv, polyfit
from snapbeam.util.validation import InputError, nonnegative, positive

if TYPE_CHECKING:
    import xarray as xr


_Array = NDArray[np.float64]
_LOWEST = 4.0  # least amplitude of a usable cycle, in standard deviations of its noise
_CERTAIN = 30.0  # chi-square by which a second law must better the fit
_MOST = 0.45  # of the viscous rate that laws which are not told may put in doubt; more is no damping
_ODDS = 8.0  # chi-square at which an explanation is as likely as none: its parameter, and that it is rare
_BEYOND = ((2.0, 0.0455), (5.0, 0.01))  # standard errors, and the probability beyond that may be left to no law
_FEW = 4  # amplitudes below which a record tells nothing of its law
_SHARE = 0.9  # of the probability of all forms, that one of the list must have
_SMOOTH = 8  # degree of the polynomial that a residual of amplitudes is tested with
# logarithms of how much rarer than viscous damping alone dry friction or drag and free forms are, and of the same of
# free forms that fall with amplitude, over those that rise: what falls is mostly dry friction
_RARE, _RARER, _RAREST = 3.0, 2.0, 8.0
_SIZE = 2.0  # of the viscous rate: a term of a form at the start, to a standard deviation
_POWERS = (0.25, 0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 3.0)
_SCALES = (0.1, 0.15, 0.25, 0.4, 0.6, 1.0)
_LEAST_DAMPING = 0.02  # of that at zero amplitude, which a curve may reach
CURVE = np.exp(-np.linspace(0.0, 16.0, 400))
"""Amplitudes, over that at the start, at which the curve of a free form is held."""
_MATTERS = 0.03  # change of the viscous rate from which it matters
SHAPES = ("symmetric", "antisymmetric", "unclear")
_IN_PHASE = 0.7  # cosine of the angle between two sensors from which a mode is told
_ALIKE = 0.2  # amplitude of one sensor over the other's below which it is not


class DampingLaw(NamedTuple):
    """A law of damping: its name, its strength h over the constant part at the start, and the standard error.

    Of a free form ``curve`` is the damping ratio over that at zero amplitude, at the amplitudes of ``CURVE``.
    """

    name: str = "viscous"
    strength: float = 0.0
    strength_se: float = 0.0
    curve: _Array | None = None


@dataclass(frozen=True)
class ModeEstimate:
    """One mode of a free decay, as one method sees it.

    ``natural_frequency`` [Hz] at zero amplitude and ``damping_ratio``, with standard errors; ``amplitude`` at
    the start of the analysed part, in the unit of the signal; ``softening`` kappa in f = natural_frequency (1 -
    kappa a^2), per squared unit of the signal, where a is the amplitude of the first mode.  ``damping`` is its
    law of damping; the damping ratio is that of zero amplitude, without dry friction.
    """

    natural_frequency: float
    natural_frequency_se: float
    damping_ratio: float
    damping_ratio_se: float
    amplitude: float
    amplitude_se: float
    phase: float
    softening: float
    softening_se: float
    method: str
    damping: DampingLaw = field(default=DampingLaw(), compare=False)


@dataclass(frozen=True)
class DecayFit:
    """The modes of a free decay, strongest first, with what is needed to judge and to draw the result.

    ``snr`` [dB] is that of the first mode at the start; ``backbone_amplitude`` and ``backbone_frequency`` [Hz],
    with ``backbone_frequency_se``, are the amplitude and frequency of the first mode over successive parts of
    the decay; ``envelope_time``, ``envelope`` its amplitude cycle by cycle; ``residual_whiteness`` the
    noise near the first mode over the noise elsewhere; ``misfit`` what the fit leaves at the first mode over
    what the noise about it explains, 1 if the model says it all.  ``lines`` are sines that do not decay, taken
    out; ``poles`` the stabilisation diagram, where one was needed; ``diagnostics`` what makes the result doubtful.
    """

    modes: tuple[ModeEstimate, ...]
    noise_rms: float
    snr: float
    start: float
    stop: float
    units: str
    residual_whiteness: float
    misfit: float
    lines: tuple[Line, ...]
    poles: Stabilisation | None = field(repr=False)
    diagnostics: tuple[Diagnostic, ...]
    backbone_amplitude: _Array = field(repr=False)
    backbone_frequency: _Array = field(repr=False)
    backbone_frequency_se: _Array = field(repr=False)
    envelope_time: _Array = field(repr=False)
    envelope: _Array = field(repr=False)

    @property
    def notes(self) -> tuple[str, ...]:
        """The diagnostics that make the result doubtful, in words."""
        return tuple(one.message for one in doubtful(self.diagnostics))

    @property
    def natural_frequency(self) -> float:
        """Natural frequency of the first mode at zero amplitude [Hz]."""
        return self.modes[0].natural_frequency

    @property
    def damping_ratio(self) -> float:
        """Damping ratio of the first mode."""
        return self.modes[0].damping_ratio

    def summary(self) -> dict[str, Any]:
        """The figures as plain numbers and words, for a table or a JSON file."""
        stems = ("natural_frequency", "damping_ratio", "amplitude", "softening")
        names = [name for stem in stems for name in (stem, f"{stem}_se")]
        return {
            "method": self.modes[0].method,
            "units": self.units,
            "modes": [
                {
                    "law": mode.damping.name,
                    "law_strength": mode.damping.strength,
                    "law_strength_se": mode.damping.strength_se,
                    **{name: float(getattr(mode, name)) for name in names},
                }
                for mode in self.modes
            ],
            "noise_rms": self.noise_rms,
            "snr_db": self.snr,
            "start_s": self.start,
            "stop_s": self.stop,
            "residual_whiteness": self.residual_whiteness,
            "misfit": self.misfit,
            "lines_hz": [line.frequency for line in self.lines],
            "diagnostics": [one.plain() for one in self.diagnostics],
        }


def law_priors(units: str) -> dict[str, tuple[float, float]]:
    """Mean and standard deviation of q and r for a displacement, or for a velocity or acceleration."""
    if units in ("m/s", "m/s^2"):
        return {"q": (0.7, 0.7), "r": (-1.0 / 3.0, 1.0 / 3.0)}
    return {"q": (0.7, 0.7), "r": (1.0 / 6.0, 1.0 / 6.0)}


# Logarithmic decrement and analytic signal (Hilbert transform) give an amplitude and a phase for each cycle of a
# filtered mode, with known noise; two weighted linear regressions against the law above do the rest.


class Cycles(NamedTuple):
    """Amplitude and unwrapped phase at ``time``, one entry a cycle, and the noise of the amplitude."""

    time: _Array
    amplitude: _Array
    phase: _Array
    noise: float


def noise_level(samples: SignalSamples) -> float:
    """Standard deviation of white noise in a signal, from the top third of its spectrum (median power)."""
    values = (samples.values - samples.values.mean()) * np.hanning(samples.values.size)
    power = np.abs(np.fft.rfft(values)) ** 2 / np.sum(np.hanning(values.size) ** 2)
    top = power[2 * power.size // 3 : -1]
    return float(np.sqrt(np.median(top) / math.log(2.0)))


def _band(samples: SignalSamples, frequency: float) -> _Array:
    """The part of a signal between 0.5 and 1.5 times *frequency*, without phase shift."""
    from scipy.signal import butter, sosfiltfilt

    high = min(1.5 * frequency, 0.49 * samples.sampling_frequency)
    sections = butter(3, (0.5 * frequency, high), "bandpass", fs=samples.sampling_frequency, output="sos")
    pad = min(samples.values.size - 1, int(3 * samples.sampling_frequency / frequency))
    return np.asarray(sosfiltfilt(sections, samples.values - samples.values.mean(), padlen=pad), dtype=np.float64)


def hilbert_cycles(samples: SignalSamples, frequency: float, sigma: float) -> Cycles:
    """Amplitude and phase of each cycle from the analytic signal, averaged over one period of *frequency*.

    Three cycles at either end, which the filter and the transform distort, are left out.
    """
    from scipy.signal import hilbert

    n = samples.values.size
    width = samples.sampling_frequency / frequency
    turn = np.exp(-2j * math.pi * frequency * (samples.time - samples.time[0]))
    slow = hilbert(_band(samples, frequency)) * turn
    count = int((n - 1) / width)
    borders = np.round(np.arange(count + 1) * width).astype(np.int64)
    sums = np.concatenate(([0.0], np.cumsum(slow)))
    mean = (sums[borders[1:]] - sums[borders[:-1]]) / np.diff(borders)
    middle = samples.time[0] + (borders[1:] + borders[:-1] - 1) / (2.0 * samples.sampling_frequency)
    phase = np.unwrap(np.angle(mean)) + 2.0 * math.pi * frequency * (middle - samples.time[0])
    noise = sigma * math.sqrt(2.0 / width)
    return _usable(Cycles(middle[3:-3], np.abs(mean[3:-3]), phase[3:-3], noise))


def local_amplitudes(samples: SignalSamples, cycles: Cycles, sigma: float) -> Cycles:
    """Every other cycle, its amplitude by a sine over two periods, which changes evenly, its mean and second harmonic.

    No filter distorts them; other modes must be out of *samples*, with white noise of standard deviation *sigma*.
    """
    rate = np.polyder(polyfit(cycles.time, cycles.phase, 3, w=cycles.amplitude))
    period = float(np.diff(cycles.time).mean())
    cycles = cycles._replace(**{name: getattr(cycles, name)[::2] for name in ("time", "amplitude", "phase")})
    edges = np.searchsorted(samples.time, [cycles.time - period, cycles.time + period])
    amplitude, unit = np.empty_like(cycles.time), np.empty_like(cycles.time)
    for k, (first, last) in enumerate(edges.T):
        since = samples.time[first:last] - cycles.time[k]
        turn = np.exp(1j * np.polyval(rate, cycles.time[k]) * since)
        waves = np.column_stack([turn, turn * (since / period), turn**2])
        design = np.hstack([waves.real, waves.imag, np.ones((since.size, 1))])
        inverse = pinv(design.T @ design)
        found = inverse @ (design.T @ samples.values[first:last])
        amplitude[k], unit[k] = math.hypot(found[0], found[3]), 0.5 * (inverse[0, 0] + inverse[3, 3])
    noise = sigma * math.sqrt(float(unit.mean()))
    # noise at right angles to a phasor lengthens it
    return cycles._replace(amplitude=np.maximum(amplitude - noise**2 / (2.0 * amplitude), noise), noise=noise)


def peak_cycles(samples: SignalSamples, frequency: float, sigma: float) -> Cycles:
    """Height and time of each maximum of the filtered mode, located by a parabola through three samples."""
    from scipy.signal import find_peaks

    y = _band(samples, frequency)
    period = samples.sampling_frequency / frequency
    at, _ = find_peaks(y, height=0.0, distance=max(1, int(0.7 * period)))
    at = at[(at > 3 * period) & (at < y.size - 3 * period)]
    if at.size < 4:
        raise InputError(f"signal: {at.size} peaks of {frequency:g} Hz: must have at least 4")
    a, b, c = y[at - 1], y[at], y[at + 1]
    bend = np.minimum(a - 2.0 * b + c, -1e-300)
    shift = np.clip(0.5 * (a - c) / bend, -0.5, 0.5)
    time = samples.time[0] + (at + shift) / samples.sampling_frequency
    height = b - 0.25 * (a - c) * shift
    turns = np.concatenate(([0.0], np.cumsum(np.round(np.diff(time) * frequency))))
    noise = sigma * math.sqrt(2.0 * frequency / samples.sampling_frequency)
    return _usable(Cycles(time, height, 2.0 * math.pi * turns, noise))


def _usable(cycles: Cycles) -> Cycles:
    low = np.flatnonzero(cycles.amplitude < _LOWEST * cycles.noise)
    end = int(low[0]) if low.size else cycles.time.size
    if end < 4:
        raise InputError(f"signal: {end} usable cycle(s) of the mode above the noise: must be at least 4")
    return Cycles(cycles.time[:end], cycles.amplitude[:end], cycles.phase[:end], cycles.noise)


def regress(cycles: Cycles, start: float, units: str, method: str, soften: bool = True) -> ModeEstimate:
    """Natural frequency, damping and softening from amplitudes and phases of cycles.

    ln a = ln a_0 - zeta omega_0 t + r s E^2 and phase = p + omega_d (t - s (1 - E^2)/(2 delta) - ...), s =
    kappa a_0^2, solved in turn; weights a^2, as the noise of both goes with 1/a.  What q and r may be is
    added to the standard errors.
    """
    prior = law_priors(units)
    center = _solve(cycles, start, prior["q"][0], prior["r"][0], soften)
    variance = center[3]
    for name in ("q", "r") if soften else ():
        q, r = (prior[key][0] + (prior[key][1] if key == name else 0.0) for key in ("q", "r"))
        moved = _solve(cycles, start, q, r, soften)
        change = moved[0] - center[0]
        variance = variance + change**2
    omega, delta, log_amplitude, s = center[0]
    freq_var, delta_var, amplitude_var, s_var = variance
    natural = math.hypot(omega, delta)
    amplitude = math.exp(log_amplitude)
    if not (omega > 0.0 and math.isfinite(amplitude)):
        raise InputError("signal: the cycles follow no decaying oscillation")
    return ModeEstimate(
        natural_frequency=natural / (2.0 * math.pi),
        natural_frequency_se=math.sqrt(freq_var) / (2.0 * math.pi),
        damping_ratio=delta / natural,
        damping_ratio_se=math.sqrt(delta_var) / natural,
        amplitude=amplitude,
        amplitude_se=amplitude * math.sqrt(amplitude_var),
        phase=center[1],
        softening=s / amplitude**2,
        softening_se=math.sqrt(s_var) / amplitude**2,
        method=method,
    )


def _solve(cycles: Cycles, start: float, q: float, r: float, soften: bool) -> tuple[_Array, float, float, _Array]:
    """(omega_d, delta, ln a_0, s), phase at the start, the rate of decay, and the variances of the four."""
    t = cycles.time - start
    log_a = np.log(cycles.amplitude)
    line = np.column_stack((np.ones_like(t), -t))
    weight, s = cycles.amplitude**2, 0.0
    solution = np.zeros(2)
    for _ in range(6):
        # weights of the fitted amplitude: those of the noisy one would favour its upward errors
        bend = r * s * np.exp(-2.0 * max(solution[1], 0.0) * t)
        solution, gram = _weighted(line, log_a - bend, weight)
        weight = np.exp(2.0 * (line @ solution + bend))
        steep = max(abs(solution[1]), 1e-9)
        first = -np.expm1(-2.0 * steep * t) / (2.0 * steep)
        second = -np.expm1(-4.0 * steep * t) / (4.0 * steep)
        basis = np.column_stack([np.ones_like(t), t - q * s * s * second] + ([-first] if soften else []))
        angles, phase_gram = _weighted(basis, cycles.phase, weight)
        s = float(np.clip(angles[2] / angles[1], -0.5, 0.5)) if soften else 0.0
    expected = cycles.noise**2
    # where the residuals scatter more than the noise explains, they set the errors
    noise_a = max(expected, float(np.mean(weight * (log_a - bend - line @ solution) ** 2)))
    noise_p = max(expected, float(np.mean(weight * (cycles.phase - basis @ angles) ** 2)))
    s_var = phase_gram[2, 2] * noise_p / angles[1] ** 2 if soften else 0.0
    variance = np.array([phase_gram[1, 1] * noise_p, gram[1, 1] * noise_a, gram[0, 0] * noise_a, s_var])
    return np.array([angles[1], solution[1], solution[0], s]), float(angles[0]), float(solution[1]), variance


def _weighted(basis: _Array, target: _Array, weight: _Array) -> tuple[_Array, _Array]:
    """Weighted linear least squares: the solution, and its covariance for unit noise."""
    scale = np.linalg.norm(basis, axis=0)
    heavy = basis / scale * weight[:, None]
    gram = pinv(heavy.T @ (basis / scale)) / np.outer(scale, scale)
    return gram @ (scale * (heavy.T @ target)), gram


def backbone(cycles: Cycles, parts: int = 12) -> tuple[_Array, _Array, _Array]:
    """Amplitude, frequency [Hz] and its standard error over successive parts of the decay."""
    amplitude, freq, error = [], [], []
    for part in np.array_split(np.arange(cycles.time.size), max(1, min(parts, cycles.time.size // 3))):
        t, a, p = cycles.time[part], cycles.amplitude[part], cycles.phase[part]
        slope, lever = weighted_line(t, p, a**2)[2:]
        amplitude.append(math.sqrt(float(np.mean(a**2))))
        freq.append(slope / (2.0 * math.pi))
        error.append(cycles.noise / math.sqrt(lever) / (2.0 * math.pi))
    return np.array(amplitude), np.array(freq), np.array(error)


# The amplitude a of a free oscillation falls as d ln a/dt = -omega zeta(a).  Beside the constant, zeta has one of the
# terms c/a (dry friction) and c a (quadratic drag), or a free form: a monotone curve of amplitude.  With
# e = exp(-delta t) the fall by the constant part delta, and h the other part over it at the start,
#
#     dry:        a/a_0 = (1 + h) e - h,
#     quadratic:  a/a_0 = e/(1 + h (1 - e)).
#
# Over the measured amplitudes, smoothed, ln a is linear in all unknowns.  So each form is a linear regression with
# normal priors on the size of its terms, and its probability follows in closed form.


def envelope(law: DampingLaw, time: _Array, decay_rate: float) -> _Array:
    """Amplitude over that at time 0; dry friction ends at zero."""
    if law.curve is not None:
        clock = cumulative_trapezoid(1.0 / law.curve, -np.log(CURVE), initial=0.0)
        return np.asarray(np.exp(np.interp(decay_rate * time, clock, np.log(CURVE))))
    fall = np.exp(-decay_rate * time)
    if law.name == "quadratic":
        return np.asarray(fall / (1.0 + law.strength * (1.0 - fall)))
    if law.name == "dry":
        return np.asarray(np.maximum((1.0 + law.strength) * fall - law.strength, 1e-9))
    return np.asarray(fall)


def likely(gain: float, odds: float = _ODDS) -> float:
    """Probability of an explanation that betters the usual one by so much chi-square, even at *odds*."""
    return 1.0 / (1.0 + math.exp(min(0.5 * (odds - gain), 700.0)))


class _Form(NamedTuple):
    """Terms of zeta(a) beside the constant one, and the regression: coefficients, their covariance, log probability."""

    terms: tuple[int, ...]
    found: _Array
    spread: _Array
    weight: float


def _terms(x: _Array) -> _Array:
    """Terms of zeta over amplitude x, 1 at the start: of dry friction, of drag, and curves that rise ever later."""
    rising = [x**power for power in _POWERS]
    levelling = [
        np.expm1(-((x / scale) ** power)) / math.expm1(-(scale**-power)) for scale in _SCALES for power in (1.0, 2.0)
    ]
    return np.column_stack([1.0 / x, x, *rising, *levelling])


def find_law(
    cycles: Cycles, start: float, decay_rate: float, bend: tuple[float, float]
) -> tuple[DampingLaw, float, float]:
    """The law of damping that the amplitude of each cycle shows, its doubt, and what it leaves over the noise.

    The doubt is half the reach about the damping ratio at zero amplitude, over that ratio, that holds all forms but 4.55 %
    of their probability, or a fifth of that which holds all but 1 %: how far a curve may turn below the amplitudes of
    the record.  *start* [s] is where the decay begins, *decay_rate* [1/s] a guess
    of the viscous rate, *bend* the change of ln a by softening at the start and its standard deviation.
    """
    t = cycles.time - start
    if t.size < _FEW:
        return DampingLaw(), _MOST, 1.0
    rate = max(decay_rate, 1e-6)
    clock, level = rate * t, np.log(cycles.amplitude)
    first = float(level[0] + clock[0])
    smooth = np.polyval(polyfit(clock, level - first, 3, w=cycles.amplitude), clock)
    for _ in range(4):
        x = np.exp(np.minimum(smooth, 0.3))
        slopes = cumulative_trapezoid(_terms(x), clock, axis=0, initial=0.0)
        design = np.column_stack([np.ones_like(t), x**2, -clock, -slopes])
        weight = x * math.exp(first) / max(cycles.noise, 1e-6 * math.exp(first))
        forms, unit = _regressions(design, level - first, weight, bend)
        best = max(forms, key=lambda one: one.weight)
        smooth = design[:, [0, 1, 2, *(3 + k for k in best.terms)]] @ best.found
        # from the first cycle back to the start, over whose amplitude all amplitudes are
        back = 0.0
        for _ in range(2):
            middle = np.exp(smooth[:1] + 0.5 * back)
            back = float(clock[0] * (best.found[2] + _terms(middle)[0, list(best.terms)] @ best.found[3:]))
        first += float(smooth[0]) + back
        smooth = smooth - (smooth[0] + back)
    plain = forms[0]
    named = {"viscous": plain, "dry": forms[1], "quadratic": forms[2]}
    free = forms[3:]
    name = max(named, key=lambda name: named[name].weight)
    usual = named[name]
    weights = np.exp([one.weight - best.weight for one in forms])
    zero = np.array([one.found[2] for one in forms])
    within = np.array([one.spread[2] for one in forms])

    def probable(value: float, own: float) -> float:
        def beyond(reach: float) -> float:
            return float(weights @ (ndtr((value - reach - zero) / within) + ndtr((zero - value - reach) / within)))

        most = float((np.abs(zero - value) + 6.0 * within).max())
        reach = max(
            brentq(lambda reach, rare=rare: beyond(reach) / weights.sum() - rare, 0.0, most, xtol=1e-6) / errors
            for errors, rare in _BEYOND
        )
        return math.sqrt(max(reach**2 - own**2, 0.0)) / value

    certain = best.weight - plain.weight > 0.5 * _CERTAIN
    if certain and math.exp(usual.weight - best.weight) < _SHARE * weights.sum():
        mean = float(weights @ zero / weights.sum())
        grid = _terms(CURVE)
        curve = sum(
            w * (one.found[2] + grid[:, list(one.terms)] @ one.found[3:])
            for w, one in zip(weights[3:], free, strict=True)
        ) / float(weights[3:].sum())
        curve = np.maximum(curve / mean, _LEAST_DAMPING)
        return DampingLaw("free", float(curve[0] - 1.0), 0.0, curve), probable(mean, 0.0), unit
    changed = abs(usual.found[2] / plain.found[2] - 1.0)
    if not certain or name == "viscous" or changed < _MATTERS:
        return DampingLaw(), min(probable(float(plain.found[2]), float(plain.spread[2])), _MOST), unit
    strength = float(usual.found[3] / usual.found[2])
    error = float(usual.spread[3] / usual.found[2])
    return DampingLaw(name, strength, error), probable(float(usual.found[2]), float(usual.spread[2])), unit


def _regressions(design: _Array, aim: _Array, weight: _Array, bend: tuple[float, float]) -> tuple[list[_Form], float]:
    """Regressions of all forms, the first three of viscous, dry and quadratic damping, and what they leave over the noise.

    What any smooth curve of time explains better is no noise, and widens all.
    """
    heavy, right = design * weight[:, None], aim * weight
    gram, moment, total = heavy.T @ heavy, heavy.T @ right, float(right @ right)
    rising = range(2, design.shape[1] - 3)
    groups: list[list[tuple[int, ...]]] = [[()], [(0,), (1,), *((k,) for k in rising)], list(combinations(rising, 2))]
    share = np.cumsum(weight**2) / float(weight @ weight)
    curves = np.polynomial.legendre.legvander(2.0 * share - 1.0, _SMOOTH) * weight[:, None]
    onto = np.linalg.qr(curves)[0].T
    smooth, heavy_smooth = onto @ right, onto @ heavy
    unit, scatter = 1.0, 1.0
    forms: list[_Form] = []
    for _ in range(2):
        forms, least = [], (math.inf, 0.0)
        for size, sets in enumerate(groups):
            used = np.array([[0, 1, 2, *(3 + term for term in terms)] for terms in sets])
            spread = np.array([1e3, max(bend[1], 1e-6), 3.0, *([_SIZE] * size)])
            mean = np.array([0.0, bend[0], 0.0, *([0.0] * size)])
            parts = gram[used[:, :, None], used[:, None, :]]
            precision = parts / unit + np.diag(spread**-2)
            inverse = np.linalg.inv(precision)
            found = np.einsum("kij,kj->ki", inverse, moment[used] / unit + mean / spread**2)
            chi = total - 2.0 * (moment[used] * found).sum(1) + np.einsum("ki,kij,kj->k", found, parts, found)
            k = int(np.argmin(chi))
            if chi[k] < least[0]:
                gone = smooth - heavy_smooth[:, used[k]] @ found[k]
                least = float(chi[k]), float(gone @ gone)
            extra = found[:, 3:]
            sound = (found[:, 2] > 0.0) & ((extra >= 0.0).all(1) | ((extra <= 0.0).all(1) & (used[:, -1] > 3)))
            evidence = -0.5 * (chi / unit + (((found - mean) / spread) ** 2).sum(1))
            evidence -= 0.5 * np.linalg.slogdet(precision)[1] + float(np.log(spread).sum())
            rare = _RARER + math.log(2.0 * len(sets))
            evidence -= np.where(used[:, -1] > 4, rare, _RARE) if size else 0.0
            evidence -= _RAREST * (extra < 0.0).any(1)
            own = np.sqrt(np.maximum(np.diagonal(inverse, axis1=1, axis2=2), 0.0))
            evidence[~sound & (size > 0)] = -math.inf
            forms += [_Form(*one) for one in zip(sets, found, own, evidence.tolist(), strict=True)]
        scatter = least[0] / max(aim.size - 5, 1)
        unit = max(1.0, scatter, least[1] / (_SMOOTH + 1.0))
    return forms, scatter


def mode_shapes(first: xr.DataArray, second: xr.DataArray, fit: DecayFit) -> tuple[str, ...]:
    """Shape of each mode of *fit*: "symmetric", "antisymmetric" or "unclear".

    Both sensors record one decay at mirrored places of the beam, such as a quarter and three quarters of its length,
    positive in one direction: a symmetric mode moves them alike.

    Parameters
    ----------
    first, second : xarray.DataArray
        The two records, of one length and rate.
    fit : DecayFit
        Result of :func:`snapbeam.lab.identify_decay` for the first signal.

    Examples
    --------
    >>> import numpy as np
    >>> from snapbeam import lab
    >>> time = np.arange(20000) / 10e3
    >>> noise = 1e-7 * np.random.default_rng(0).standard_normal(time.size)
    >>> decay = 1e-4 * np.exp(-0.005 * 2 * np.pi * 80 * time) * np.cos(2 * np.pi * 80 * time) + noise
    >>> signal = lab.make_signal(decay, "m", 10e3)
    >>> fit = lab.identify_decay(signal)
    >>> lab.mode_shapes(signal, signal, fit)  # here twice the same signal
    ('symmetric',)
    """
    one, two = check_signal(first, (), "first"), check_signal(second, (), "second")
    rates = one.sampling_frequency / two.sampling_frequency
    if one.values.size != two.values.size or abs(rates - 1.0) > 1e-9:
        raise InputError(
            f"second: {two.values.size} samples at {two.sampling_frequency:g} Hz, first has {one.values.size} at "
            f"{one.sampling_frequency:g} Hz: must be one recording"
        )
    amplitudes = [_complex_amplitudes(samples, fit) for samples in (one, two)]
    out = []
    for a, b in zip(*amplitudes, strict=True):
        size = min(abs(a), abs(b)) / max(abs(a), abs(b))
        angle = (a.conjugate() * b).real / (abs(a) * abs(b))
        told = size > _ALIKE and abs(angle) > _IN_PHASE
        out.append(SHAPES[2] if not told else SHAPES[0] if angle > 0.0 else SHAPES[1])
    return tuple(out)


def _complex_amplitudes(samples: SignalSamples, fit: DecayFit) -> list[complex]:
    """Amplitude and phase of each mode in a record, by linear least squares."""
    inside = (samples.time >= fit.start - 1e-12) & (samples.time <= fit.stop + 1e-12)
    t, y = samples.time[inside] - fit.start, samples.values[inside]
    design = damped_waves(t, [(mode.natural_frequency, mode.damping_ratio) for mode in fit.modes])
    return phasors(np.asarray(lstsq(design, y), dtype=np.float64)).tolist()


# The paper tests both and finds 81.3 and 80.5 Hz (section 2).


@dataclass(frozen=True)
class WellComparison:
    """The natural frequencies [Hz] of the two wells, their difference, and whether they agree."""

    lower: float
    upper: float
    difference: float
    difference_se: float | None
    relative: float

    @property
    def agree(self) -> bool | None:
        """True if the difference is within two standard errors; None if standard errors are missing."""
        return None if self.difference_se is None else abs(self.difference) <= 2.0 * self.difference_se

    @property
    def statement(self) -> str:
        """The comparison in words."""
        text = (
            f"wells at {self.lower:.5g} and {self.upper:.5g} Hz differ by {abs(self.difference):.3g} Hz "
            f"({abs(self.relative):.2%} of their mean)"
        )
        if self.difference_se is not None:
            text += f", standard error {self.difference_se:.2g} Hz"
        if self.agree:
            return text + ": equal within two standard errors"
        return text + ": the symmetric model has one frequency for both and cannot show this difference"


def compare_wells(
    lower: DecayFit | float, upper: DecayFit | float, lower_se: float | None = None, upper_se: float | None = None
) -> WellComparison:
    """Compare the first natural frequency about the two wells.

    Parameters
    ----------
    lower, upper : DecayFit or float
        Decays about either well, or their frequencies [Hz].
    lower_se, upper_se : float, optional
        Standard errors of frequencies given as numbers.

    Examples
    --------
    >>> from snapbeam import lab
    >>> wells = lab.compare_wells(84.0, 86.0, 0.2, 0.2)  # Hz
    >>> f"{wells.difference:.1f} +- {wells.difference_se:.1f} Hz"
    '-2.0 +- 0.3 Hz'
    """
    values, errors = [], []
    for name, well, se in (("lower", lower, lower_se), ("upper", upper, upper_se)):
        if isinstance(well, DecayFit):
            values.append(well.natural_frequency)
            errors.append(well.modes[0].natural_frequency_se)
        else:
            values.append(positive(name, well, "Hz"))
            errors.append(math.nan if se is None else nonnegative(f"{name}_se", se, "Hz"))
    difference = values[0] - values[1]
    error = math.hypot(*errors)
    return WellComparison(
        lower=values[0],
        upper=values[1],
        difference=difference,
        difference_se=error if math.isfinite(error) else None,
        relative=difference / (0.5 * (values[0] + values[1])),
    )
