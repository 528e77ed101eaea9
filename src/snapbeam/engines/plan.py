"""How finely to step: the default from the model and the contact, and what a user asks for instead."""

from __future__ import annotations

import math
from typing import NamedTuple

from snapbeam.core.validate import choice, positive
from snapbeam.engines.measure import flight_step
from snapbeam.model.contact import ContactLaw
from snapbeam.model.galerkin.reduction import ReducedModel
from snapbeam.model.integration import ACCURACIES

__all__ = ["Plan", "choose_base_step"]

# Free flight: the error allowed a step, as it is measured on the structure, by level of accuracy.
_LIMIT = {"standard": 2.5e-7, "reference": 2e-11}
_LIMIT_OF_HITS = {"standard": 1e-9, "reference": 1e-13}
"""Where impacts last no time: no contact steps share the error, and there is one mode only."""
_ORDER = {"standard": 4, "reference": 6}
_FREE_TURN = 4.0
"""Of the fastest mode in a flight step of level "reference", rad."""
_MOST_DECAY = 1.8
"""Of the mode that decays fastest, in a flight step."""
# Contact: longest step over the time of an impact at the speed 0.2 b omega_1, by level, and how many
# halvings below it the shortest step is, by order.
_CONTACT_SHARE = {"standard": 1.0 / 8.0, "reference": 1.0 / 32.0}
_CONTACT_SPEED = 0.2
_HALVINGS = {4: 4, 6: 10}
_MOST_HALVINGS = {"standard": 5, "reference": 7}
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


def choose_base_step(
    model: ReducedModel,
    contact: ContactLaw | None,
    *,
    step: float | None = None,
    accuracy: str = "standard",
) -> Plan:
    """The steps of a run: short enough in flight, as measured on the model itself, and for an impact.

    Parameters
    ----------
    model, contact
        What is struck, and how.  Where does not matter: the steps suit the lightest point of the beam, so
        that every run of a map is stepped alike.
    step : float, optional
        Flight step in seconds, instead of the default; contact steps scale with it.
    accuracy : {"standard", "reference"}
        ``"standard"``: order 4, and errors of about a thousandth of the buckling level where a run is well conditioned.
        ``"reference"``: order 6, and errors a hundred thousand times smaller.
    """
    choice("accuracy", accuracy, ACCURACIES)
    order = _ORDER[accuracy]
    fastest = float(model.omega.max())
    limits = _LIMIT_OF_HITS if contact is not None and contact.impulsive else _LIMIT
    flight = flight_step(model, order, limits[accuracy])
    if accuracy == "reference" and fastest * flight > _FREE_TURN:
        flight = _FREE_TURN / fastest
    decay = float((model.damping_ratio * model.omega).max())
    if decay * flight > _MOST_DECAY:
        flight = _MOST_DECAY / decay
    impact = flight
    duration = 0.0
    if contact is not None and not contact.impulsive:
        mass = model.lightest_contact_mass
        speed = _CONTACT_SPEED * (model.length_scale or 1.0) * 2.0 * math.pi * model.reference_frequency
        duration = contact.time_scale(mass, speed)
    if duration > 0.0:
        impact = _CONTACT_SHARE[accuracy] * duration
        flight = min(flight, impact * 2 ** _MOST_HALVINGS[accuracy])
        if fastest > 0.0:
            impact = min(impact, _CONTACT_TURN / fastest)
    coarsest = max(0, math.ceil(math.log2(flight / impact)))
    if step is not None:
        flight = positive("step", step, "s")
    return Plan(order, flight, coarsest, coarsest + _HALVINGS[order])
