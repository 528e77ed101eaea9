"""How finely to step: the default from the model and the contact, and what a user asks for instead."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from snapbeam.core.validate import choice, positive
from snapbeam.model.contact import ContactLaw
from snapbeam.model.galerkin.reduction import ReducedModel
from snapbeam.model.integration import ACCURACIES

__all__ = ["Plan", "plan_steps"]

# Free flight.  A step is short enough either for the fastest mode (radians per step) or, since the linear
# flow is exact, for the rate at which the tension detunes the modes (radians per step).
_FASTEST = 0.2
_DETUNING = 0.0248
_FREE_SHARE = 1.0 / 16.0
"""Of the reference period, for a structure without stiffness."""
# Contact: longest step over the duration of an impact at the speed 0.2 b omega_1, and how many halvings below
# it the shortest step is, by order.
_CONTACT_SHARE = 1.0 / 6.0
_CONTACT_SPEED = 0.2
_HALVINGS = {4: 2, 6: 6}
# Level "reference": how many times shorter, and how far the fastest mode may turn in a flight step, rad.
_SHORTER = 6.0
_FREE_TURN = 4.0
_MOST_HALVINGS = 5
_CONTACT_TURN = math.pi
"""Of the fastest mode in the longest contact step, rad: the contact moves every mode, and beyond half a turn
its kicks come in step with the fastest ones."""


class Plan(NamedTuple):
    """Order of the composition and lengths of its steps."""

    order: int
    step: float
    """Flight step, s."""
    coarsest: int
    """Halvings of the flight step that make the longest contact step."""
    finest: int
    """Halvings of the flight step that make the shortest contact step."""


def _detuning_rate(model: ReducedModel) -> float:
    """Greatest rate, rad/s, at which a change of tension as large as the well's own detunes a mode."""
    stretch = float(model.equilibrium @ model.equilibrium)
    moving = model.omega > 0.0
    if stretch == 0.0 or not moving.any():
        return 0.0
    per_mode = np.diag(model.tension_matrix)[moving] / model.omega[moving]
    return float(model.tension_stiffness * stretch * per_mode.max())


def plan_steps(
    model: ReducedModel,
    contact: ContactLaw | None,
    *,
    step: float | None = None,
    accuracy: str = "map",
) -> Plan:
    """The steps of a run: short enough for the modes or their detuning, and for an impact.

    Parameters
    ----------
    model, contact
        What is struck, and how.  Where does not matter: the steps suit the lightest point of the beam, so
        that every run of a map is stepped alike.
    step : float, optional
        Flight step in seconds, instead of the default; contact steps scale with it.
    accuracy : {"map", "reference"}
        ``"map"``: order 4.  ``"reference"``: order 6, and steps six times shorter or, with many modes, shorter
        still in flight, to check others with.
    """
    choice("accuracy", accuracy, ACCURACIES)
    fastest, detuning = float(model.omega.max()), _detuning_rate(model)
    limits = [_FASTEST / fastest if fastest > 0.0 else math.inf]
    limits.append(_DETUNING / detuning if detuning > 0.0 else 0.0 if fastest > 0.0 else math.inf)
    flight = max(limits)
    if math.isinf(flight):
        flight = _FREE_SHARE / model.reference_freq
    impact = flight
    duration = 0.0
    if contact is not None and not contact.impulsive:
        mass = model.lightest_contact_mass
        speed = _CONTACT_SPEED * (model.length_scale or 1.0) * 2.0 * math.pi * model.reference_freq
        duration = contact.impact_duration(mass, speed)
    if duration > 0.0:
        impact = _CONTACT_SHARE * duration
        flight = min(flight, impact * 2**_MOST_HALVINGS)
        if fastest > 0.0:
            impact = min(impact, _CONTACT_TURN / fastest)
    coarsest = max(0, math.ceil(math.log2(flight / impact)))
    order = 4 if accuracy == "map" else 6
    if accuracy == "reference":
        flight /= _SHORTER
        while fastest * flight > _FREE_TURN:
            flight, coarsest = 0.5 * flight, max(0, coarsest - 1)
    if step is not None:
        flight = positive("step", step, "s")
    return Plan(order, flight, coarsest, coarsest + _HALVINGS[order])
