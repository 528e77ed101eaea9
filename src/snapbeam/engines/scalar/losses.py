"""A kick by a contact that loses energy: exact at a fixed place, where the rate of penetration alone changes.

During a kick the places stand still and the velocities change.  Under a force max(0, F + C v) the rate v of
penetration obeys, with the tension's push a = c.k along the contact's row c and B = c.c,

    v' = -a - B max(0, F + C v),

one linear equation where the bodies press and another where they do not; once across is all that its solutions go.
The functions below are its flow over a *weight* of either sign, so that a symmetric composition stays symmetric.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from snapbeam.engines.scalar.compile import compiled

__all__ = ["Loss", "lossy_kick"]

# Nodes and weights of Gauss's rule of four points on [0, 1].
_NODES = (0.06943184420297371, 0.33000947820757187, 0.6699905217924281, 0.9305681557970262)
_WEIGHTS = (0.17392742256872692, 0.32607257743127307, 0.32607257743127307, 0.17392742256872692)
_SMALL = 0.05


class Loss(NamedTuple):
    """What a kick gave."""

    impulse: float
    lost: float
    """Energy, J: what the bodies gave to the contact beyond what it stores."""


@compiled
def _share(x):
    """(1 - exp(-x))/x."""
    return -math.expm1(-x) / x if x != 0.0 else 1.0


@compiled
def _second_share(x):
    """(1 - (1 - exp(-x))/x)/x, 1/2 at 0."""
    if abs(x) > _SMALL:
        return (1.0 - _share(x)) / x
    total = 1.0 / 362880.0
    total = 1.0 / 40320.0 - x * total
    total = 1.0 / 5040.0 - x * total
    total = 1.0 / 720.0 - x * total
    total = 1.0 / 120.0 - x * total
    total = 1.0 / 24.0 - x * total
    total = 1.0 / 6.0 - x * total
    return 0.5 - x * total


@compiled
def _pressing(force, damping, mobility, push, rate, span):
    """Impulse over a *span* in which the bodies press all the time, and the energy lost."""
    x = mobility * damping * span
    felt = force + damping * rate
    impulse = felt * span * _share(x) - damping * push * span * span * _second_share(x)
    driven, squares = push + mobility * force, 0.0
    for i in range(4):
        part = _NODES[i] * span
        fallen = mobility * damping * part
        v = rate * math.exp(-fallen) - driven * part * _share(fallen)
        squares += _WEIGHTS[i] * v * v
    return Loss(impulse, damping * squares * span)


@compiled
def lossy_kick(force, damping, mobility, push, rate, weight):
    """The impulse of a kick and what is lost in it.

    *force* F and *damping* C at the place, *mobility* B = c.c (1/kg), *push* a = c.k (m/s^2), *rate* v of penetration
    before the kick, *weight* in s.
    """
    felt = force + damping * rate
    if felt > 0.0:
        span, x = weight, 0.0
        # the force vanishes where exp(-B C t) = g/(F + C v + g), g = a/B, if it does within the span
        ratio = mobility * felt / push if push != 0.0 else 0.0
        if ratio > -1.0 and ratio != 0.0:
            x = math.log1p(ratio)
            falls = x / (mobility * damping) if damping > 0.0 else math.inf
            if falls / weight > 0.0 and falls / weight < 1.0:
                span = falls
        pressed = _pressing(force, damping, mobility, push, rate, span)
        rest = weight - span
        if rest == 0.0:
            return pressed
        # apart from there on, while the penetration is as it was: what the contact stores is not given back
        v = rate - push * span - mobility * pressed.impulse
        return Loss(pressed.impulse, pressed.lost - force * (v * rest - 0.5 * push * rest * rest))
    # apart; the rate changes by the push alone until the bodies press, if they do
    detect_contact_event = felt / (damping * push) if damping * push != 0.0 else math.inf
    span = weight
    if detect_contact_event / weight >= 0.0 and detect_contact_event / weight < 1.0:
        span = detect_contact_event
    lost = -force * (rate * span - 0.5 * push * span * span)
    rest = weight - span
    if rest == 0.0:
        return Loss(0.0, lost)
    pressed = _pressing(force, damping, mobility, push, rate - push * span, rest)
    return Loss(pressed.impulse, lost + pressed.lost)
