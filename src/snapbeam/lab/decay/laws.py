"""How damping depends on amplitude: viscous alone, or with dry friction or quadratic drag beside it.

The amplitude a of a free oscillation falls as da/dt = -delta a - c - q a^2, of which one of c and q is taken
to act beside the viscous delta.  Over the viscous fall e = exp(-delta t) that is

    dry:        a/a_0 = (1 + h) e - h,               h = c/(delta a_0),
    quadratic:  a/a_0 = e/(1 + h (1 - e)),           h = q a_0/delta,

so h is the strength of the other law at the start, over the viscous one.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from snapbeam.lab.decay.cycles import Cycles

__all__ = ["LAWS", "DampingLaw", "envelope", "find_law"]

_Array = NDArray[np.float64]
LAWS = ("viscous", "dry", "quadratic")
_CERTAIN = 30.0  # chi-square by which a second law must better the fit
_MATTERS = 0.03  # change of the viscous rate from which it matters


class DampingLaw(NamedTuple):
    """A law of damping: its name, its strength h over the viscous one at the start, and the standard error.

    ``decay_rate`` [1/s] is the viscous rate, with its standard error.
    """

    name: str
    strength: float
    strength_se: float
    decay_rate: float
    decay_rate_se: float


def envelope(law: str, time: _Array, decay_rate: float, strength: float) -> _Array:
    """Amplitude over that at time 0; dry friction ends at zero."""
    fall = np.exp(-decay_rate * time)
    if law == "quadratic":
        return np.asarray(fall / (1.0 + strength * (1.0 - fall)))
    if law == "dry":
        return np.asarray(np.maximum((1.0 + strength) * fall - strength, 1e-9))
    return np.asarray(fall)


def find_law(cycles: Cycles, start: float, decay_rate: float) -> DampingLaw | None:
    """The second law of damping that the amplitude of each cycle shows; None if viscous damping says it all.

    Parameters
    ----------
    cycles
        Amplitude of each cycle with its noise.
    start
        Time [s] at which the decay begins.
    decay_rate
        A guess of the viscous rate [1/s].
    """
    t = cycles.time - start
    if t.size < 10:
        return None
    first = float(cycles.amplitude[0]) * math.exp(decay_rate * float(t[0]))
    noise = max(cycles.noise, 1e-6 * first)

    def fitted(law: str, guess: list[float]) -> tuple[_Array, float, _Array]:
        def miss(p: _Array) -> _Array:
            strength = float(p[2]) if p.size > 2 else 0.0
            return (math.exp(p[0]) * envelope(law, t, math.exp(p[1]), strength) - cycles.amplitude) / noise

        lower = [-np.inf, -np.inf, 0.0][: len(guess)]
        found = least_squares(
            miss, guess, bounds=(lower, [np.inf] * len(guess)), x_scale=[0.1, 0.3, 0.3][: len(guess)]
        )
        gram = found.jac.T @ found.jac
        spread = np.sqrt(np.maximum(np.diag(np.linalg.pinv(gram)), 0.0))
        return found.x, 2.0 * float(found.cost), spread

    rate = max(decay_rate, 1e-6)
    plain, chi, _ = fitted("viscous", [math.log(first), math.log(rate)])
    best: DampingLaw | None = None
    least = chi
    for law in LAWS[1:]:
        p, better, spread = fitted(law, [math.log(first), math.log(0.7 * rate), 0.5])
        unit = max(1.0, better / max(t.size - 3, 1))
        changed = abs(math.exp(p[1] - plain[1]) - 1.0)
        if (
            better < least
            and (chi - better) / unit > _CERTAIN
            and changed > _MATTERS
            and p[2] > 4.0 * spread[2] * math.sqrt(unit)
        ):
            least = better
            value = math.exp(p[1])
            best = DampingLaw(
                law,
                float(p[2]),
                float(spread[2]) * math.sqrt(unit),
                value,
                value * float(spread[1]) * math.sqrt(unit),
            )
    return best
