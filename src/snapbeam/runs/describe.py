"""Systems and integrations as attributes of files: every parameter by name."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from snapbeam.config.parameters import lookup
from snapbeam.core.provenance import array_hash, made_by
from snapbeam.engines.plan import Plan
from snapbeam.model.integration import Integration
from snapbeam.model.quantity import quantities
from snapbeam.model.striker.another import numbered
from snapbeam.model.system import System

__all__ = ["CONVENTIONS", "attributes_of", "describe_system"]

CONVENTIONS = "CF-1.11"
_LONGEST = 1024
"""Numbers of an array that an attribute may hold."""


def describe_system(system: System, plan: Plan) -> dict[str, Any]:
    """The parameters of a system but those of its drive and striker, and its steps, as attributes."""
    model = system.model
    damping = model.damping_ratio
    attrs: dict[str, Any] = {
        "modes": model.modes,
        "damping_ratio": float(damping[0]) if np.all(damping == damping[0]) else damping.tolist(),
        "length_scale": model.length_scale,
        "reference_frequency": model.reference_frequency,
        "step": plan.step,
        "order": plan.order,
        "longest_contact_step": plan.step / 2**plan.coarsest,
        "shortest_contact_step": plan.step / 2**plan.finest,
    }
    if system.contact is not None:
        attrs["contact_law"] = system.contact.name
        attrs |= _short(system.contact)
    if model.beam is not None:
        attrs |= {name: float(value) for name, value in _short(model.beam).items()}
        attrs |= _short(model.beam.boundary)
    if model.imperfection is not None:
        attrs |= _short(model.imperfection)
    sections = system.to_mapping() if system.has_environment else {}
    for section in ("base", "axial", "harvester"):
        for name, value in sections.get(section, {}).items():
            short = f"{section}_kind" if name == "type" else lookup(f"{section}.{name}").short
            attrs[short] = int(value) if isinstance(value, bool) else value
    return attrs | _of_others(system)


def _of_others(system: System) -> dict[str, Any]:
    """What is said of the strikers beside the first."""
    attrs: dict[str, Any] = {"strikers": 1 + len(system.further_contacts)} if system.further_contacts else {}
    for section, values in system.to_mapping().items() if system.further_contacts else ():
        number = numbered(section)[1]
        if number > 1:
            attrs |= {
                f"{name}_striker_{number}"
                if name in ("type", "type")
                else lookup(f"{section}.{name}").short: value
                for name, value in values.items()
            }
    return attrs


def _short(part: Any) -> dict[str, Any]:
    """The quantities of a part by the names they have in datasets."""
    return {
        item.short or name: getattr(part, name)
        for name, item in quantities(type(part)).items()
        if isinstance(getattr(part, name), (float, int, str))
    }


def attributes_of(
    title: str,
    system: System,
    integration: Integration,
    plan: Plan,
    more: dict[str, Any],
    points: Any = None,
) -> dict[str, Any]:
    """The attributes of a file: a title, every parameter, what made it, and the hash of all of it.

    *points* tell one sweep from another.
    """
    attrs: dict[str, Any] = {"Conventions": CONVENTIONS, "title": title}
    attrs |= describe_system(system, plan) | more
    own = _plain(integration)
    attrs["system_hash"] = system.hash
    attrs["system"] = json.dumps(_short_arrays(system.to_mapping()), sort_keys=True)
    attrs["integration"] = json.dumps(own, sort_keys=True)
    identity = {"system": system.hash, "integration": own, "more": more}
    return attrs | made_by(identity if points is None else identity | {"points": points})


def _short_arrays(value: Any) -> Any:
    """Plain values; an array too long for an attribute is named by its hash."""
    if isinstance(value, np.ndarray):
        if value.size > _LONGEST:
            return {"shape": list(value.shape), "sha256": array_hash(value)}
        return value.tolist()
    if isinstance(value, dict):
        return {key: _short_arrays(item) for key, item in value.items()}
    return value


def _plain(integration: Integration) -> dict[str, Any]:
    return {name: getattr(integration, name) for name in quantities(Integration) if name != "threads"}
