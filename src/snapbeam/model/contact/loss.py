"""Energy loss of a contact: exact conversion between coefficient of restitution and damping factor."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

from snapbeam.util.validation import choice, positive, within


class Preset(NamedTuple):
    """A published shortcut from a coefficient of restitution to a loss number D = chi v."""

    loss: Callable[[float], float]
    source: str


PRESETS: dict[str, Preset] = {
    "hunt-crossley": Preset(lambda e: 1.5 * (1.0 - e), "Hunt and Crossley, J. Appl. Mech. 42 (1975)"),
    "lankarani-nikravesh": Preset(lambda e: 0.75 * (1.0 - e * e), "Lankarani and Nikravesh, J. Mech. Des. 112 (1990)"),
    "gonthier": Preset(lambda e: (1.0 - e * e) / e, "Gonthier et al., Multibody Syst. Dyn. 11 (2004), leading term"),
    "flores": Preset(lambda e: 1.6 * (1.0 - e) / e, "Flores et al., Multibody Syst. Dyn. 25 (2011)"),
}
"""Published approximations by name; :func:`restitution_of_loss` gives the restitution that results."""

_SMALL = 1e-3


def _defect(e: float, d: float, t: float) -> float:
    """(1 + e) D - ln[(1 + D)/(1 - e D)], zero where e belongs to D; t = -ln(1 - e D) keeps its digits near e D = 1."""
    return (1.0 + e) * d - math.log1p(d) - t


def loss_number(restitution: float) -> float:
    """The loss number D = chi v for which a free mass leaves with *restitution* e in [1e-300, 1] times its speed v.

    Under a force F(d) (1 + chi d'), whatever F is, the approach and the departure are quadratures of v dv/(1 + chi v),
    which gives

        (1 + e) D = ln[(1 + D)/(1 - e D)].
    """
    from scipy.optimize import brentq

    e = within("restitution", restitution, 1e-300, 1.0, closed="both")
    if e == 1.0:
        return 0.0
    if 1.0 - e < _SMALL:
        # D = (3/2)(1 - e)(1 + (1 - e)/2 ...): the relation itself loses its digits there
        low, high = 1.4 * (1.0 - e), 1.6 * (1.0 - e)
        return float(brentq(lambda d: _expanded(e, d), low, high, xtol=1e-300, rtol=1e-15))
    # close to 1/e the defect falls to -inf; it is positive in between
    low, high = -math.log1p(-e * (1.0 - e)), 4.0 / e + 4.0
    t = float(brentq(lambda t: _defect(e, -math.expm1(-t) / e, t), low, high, xtol=1e-300, rtol=1e-15))
    return -math.expm1(-t) / e


def _expanded(e: float, d: float) -> float:
    """The defect over D^2, as a series in D: sum of [(-1)^n - e^n] D^(n-2)/n from n = 2 on."""
    return sum(((-1.0) ** n - e**n) * d ** (n - 2) / n for n in range(2, 14))


def restitution_of_loss(loss: float) -> float:
    """Coefficient of restitution of a free mass with loss number D = chi v, 0 or greater, exact."""
    from scipy.optimize import brentq

    d = within("loss", loss, 0.0, math.inf, closed="left")
    if d < 1e-8:  # the terms that are left out are below rounding
        return 1.0 - 2.0 * d / 3.0
    if d < 2.0 * _SMALL:
        return float(brentq(lambda e: _expanded(e, d), 1.0 - 2.0 * d, 1.0, xtol=1e-300, rtol=1e-15))
    high = -math.log1p(-d) if d < 1.0 - _SMALL else d + math.log1p(d) + 1.0
    low = 1e-300
    t = float(brentq(lambda t: _defect(-math.expm1(-t) / d, d, t), low, high, xtol=1e-300, rtol=1e-15))
    return -math.expm1(-t) / d


def preset_loss(restitution: float, speed: float, preset: str = "exact") -> float:
    """chi, s/m, for a wanted *restitution* at a *speed* (m/s): exact, or by a published shortcut."""
    speed = positive("speed", speed, "m/s")
    choice("preset", preset, ("exact", *PRESETS))
    if preset == "exact":
        return loss_number(restitution) / speed
    e = within("restitution", restitution, 0.0, 1.0, closed="right")
    return PRESETS[preset].loss(e) / speed
