"""Which law of contact was meant, and the numbers that follow from materials or from a wanted restitution."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from snapbeam.core.validate import InputError
from snapbeam.model.contact import HertzContact, HuntCrossley
from snapbeam.model.paper_values import CONTACT

__all__ = ["MATERIALS", "WANTED", "contact_of", "contact_rivals", "law_of"]

MATERIALS = {
    "radius": ("m", "radius of the sphere", (1e-9, 10.0, "mm")),
    "young_modulus": ("Pa", "Young's moduli of sphere and beam", None),
    "poisson_ratio": ("1", "Poisson ratios of sphere and beam", None),
}
"""What a Hertzian stiffness may follow from: unit, words and plausible sizes."""
WANTED = {
    "restitution": ("1", "share of its speed that a free mass keeps, from which the loss follows"),
    "speed": ("m/s", "at which it keeps that share"),
}
"""What a loss may follow from: unit and words."""
_TELLING = {
    "coefficient": "restitution", "damping_factor": "hunt_crossley", "restitution": "hunt_crossley", "speed": "hunt_crossley",
    "layer_stiffness": "layer",
    "linear_stiffness": "kelvin_voigt", "linear_damping": "kelvin_voigt", "force_at_1um": "power", "exponent": "power",
}  # fmt: skip
"""Names that one law alone has."""
_SPHERES = ("hertz", "hunt_crossley", "layer")


def law_of(values: Mapping[str, Any]) -> str:
    """The law that is named, or that has the names that were given."""
    if "type" in values:
        return str(values["type"])
    told = [law for name, law in _TELLING.items() if name in values]
    return told[0] if told else "hertz"


def contact_of(given: Mapping[str, Any]) -> dict[str, Any]:
    """The section of a system, complete: the paper's stiffness where none was given, a loss from a restitution.

    Raises
    ------
    InputError
    """
    values = dict(given)
    law = values["type"] = law_of(values)
    materials = {name: values.pop(name) for name in MATERIALS if name in values}
    if materials:
        moduli, ratios = tuple(materials["young_modulus"]), tuple(materials["poisson_ratio"])
        values["stiffness"] = HertzContact.from_materials(materials["radius"], moduli, ratios).stiffness
    if law in _SPHERES:
        values.setdefault("stiffness", CONTACT.stiffness)
    wanted = {name: values.pop(name) for name in WANTED if name in values}
    if wanted:
        if len(wanted) < len(WANTED):
            raise InputError("[contact] restitution and speed belong together; one is missing")
        if "damping_factor" in values or law != "hunt_crossley":
            raise InputError(
                "[contact] restitution and speed make the loss of type = 'hunt_crossley'; give no other"
            )
        values["damping_factor"] = HuntCrossley.from_restitution(
            values["stiffness"], wanted["restitution"], wanted["speed"]
        ).damping_factor
    return values


def contact_rivals() -> list[tuple[set[str], set[str]]]:
    """What stands for the same thing: giving one set takes the other away."""
    sphere, lossy = {"stiffness", *MATERIALS}, {"damping_factor", *WANTED}
    spring, power = {"linear_stiffness", "linear_damping"}, {"force_at_1um", "exponent"}
    pairs = [({"stiffness"}, set(MATERIALS)), ({"damping_factor"}, set(WANTED))]
    pairs.append(({"layer_stiffness"}, lossy))
    groups = [{"coefficient"}, sphere | lossy | {"layer_stiffness"}, spring, power]
    pairs += [(one, other) for i, one in enumerate(groups) for other in groups[i + 1 :]]
    return pairs
