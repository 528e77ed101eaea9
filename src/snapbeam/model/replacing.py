"""A system's neighbours: parts made anew with parameters changed by dotted name."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np

from snapbeam.core.validate import InputError
from snapbeam.model.ends import CLAMPED
from snapbeam.model.galerkin.reduction import ReducedModel
from snapbeam.model.imperfection import Imperfection
from snapbeam.model.mapping import SECTIONS
from snapbeam.model.quantity import quantities
from snapbeam.model.start import started
from snapbeam.model.state import State
from snapbeam.model.striker.another import ContactPair, numbered

__all__ = ["replaced"]

_OF_MODEL = ("modes", "damping_ratio", "reference_frequency")


def replaced(parts: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """The parts of a system (model, contact, striker, start) with *changes*, by dotted name or whole part."""
    whole: dict[str, Any] = {}
    inside: dict[str, dict[str, Any]] = {}
    for name, value in changes.items():
        section, dot, field = name.partition(".")
        if numbered(section)[0] not in SECTIONS:
            raise InputError(f"{name}: no parameter of a system; its sections are {', '.join(SECTIONS)}")
        if dot:
            inside.setdefault(section, {})[field] = value
        else:
            whole[section] = value
    found = dict(parts)
    for name in ("model", "contact", "striker", "base", "axial", "harvester", "start"):
        if name in whole:
            found[name] = whole[name]
    of_beam = inside.get("beam", {})
    if "ends" in whole or "ends" in inside:
        of_beam = of_beam | {"ends": _ends(found["model"], whole, inside.get("ends", {}))}
    found["model"] = _model(found["model"], whole.get("beam"), of_beam, inside.get("model", {}))
    if "imperfection" in whole or "imperfection" in inside:
        given = whole.get("imperfection", found["model"].imperfection)
        found["model"] = _with_imperfection(found["model"], given, inside.get("imperfection", {}))
    if "contact" in inside:
        found["contact"] = _changed(found["contact"], "contact", inside["contact"])
    if "drive" in whole:
        found["striker"] = dataclasses.replace(_there(found["striker"], "striker"), drive=whole["drive"])
    if "drive" in inside:
        striker = _there(found["striker"], "drive")
        drive = _changed(striker.drive, "drive", inside["drive"])
        found["striker"] = dataclasses.replace(striker, drive=drive)
    if "striker" in inside:
        found["striker"] = _changed(found["striker"], "striker", inside["striker"])
    found["others"] = _others(found.get("others", ()), whole, inside)
    for name in ("base", "axial"):
        if name in inside:
            found[name] = _around(found.get(name), name, inside[name])
    if "harvester" in inside:
        found["harvester"] = _changed(found.get("harvester"), "harvester", inside["harvester"])
    start, model = found["start"], found["model"]
    if isinstance(start, State) and "start" not in whole and start.modes != model.modes:
        found["start"] = start.with_modes(model.modes)
    if "start" in inside:
        found["start"] = started(found["model"], found["striker"], found["start"], inside["start"])
    return found


def _others(
    others: tuple[ContactPair, ...], whole: Mapping[str, Any], inside: Mapping[str, Mapping[str, Any]]
) -> tuple[ContactPair, ...]:
    """The strikers beside the first one, changed by dotted name or whole part."""
    for name in (*whole, *inside):
        if numbered(name)[1] > 1 + len(others):
            raise InputError(f"{name}: this system has {1 + len(others)} strikers")
    made = []
    for number, each in enumerate(others, 2):
        striker, contact = (
            whole.get(f"striker_{number}", each.striker),
            whole.get(f"contact_{number}", each.contact),
        )
        drive = whole.get(f"drive_{number}", striker.drive)
        if f"drive_{number}" in inside:
            drive = _changed(drive, f"drive_{number}", inside[f"drive_{number}"])
        own = {"drive": drive} if drive is not striker.drive else {}
        if own:
            striker = dataclasses.replace(striker, **own)
        if f"striker_{number}" in inside:
            striker = _changed(striker, f"striker_{number}", inside[f"striker_{number}"])
        if f"contact_{number}" in inside:
            contact = _changed(contact, f"contact_{number}", inside[f"contact_{number}"])
        made.append(ContactPair(striker, contact))
    return tuple(made)


def _there(part: Any, section: str) -> Any:
    if part is None:
        raise InputError(f"{section}: this system has none")
    return part


def _changed(part: Any, section: str, values: Mapping[str, Any]) -> Any:
    """A frozen part with some of its quantities changed."""
    known = quantities(type(_there(part, section)))
    for name in values:
        if name not in known:
            raise InputError(
                f"{section}.{name}: no parameter of this system; must be one of {', '.join(known)}"
            )
    return dataclasses.replace(part, **values)


def _around(part: Any, section: str, values: Mapping[str, Any]) -> Any:
    """A base or a load with some of its own quantities changed, or of its motion's."""
    own = quantities(type(_there(part, section)))
    of_motion = {name: value for name, value in values.items() if name not in own}
    if of_motion:
        part = dataclasses.replace(part, motion=_changed(part.motion, section, of_motion))
    return dataclasses.replace(part, **{name: value for name, value in values.items() if name in own})


def _ends(model: ReducedModel, whole: Mapping[str, Any], values: Mapping[str, Any]) -> Any:
    if model.beam is None:
        raise InputError("ends: this model was given by matrices, it has no beam")
    ends = whole.get("ends", whole.get("beam", model.beam).ends)
    ends = CLAMPED if ends is None else ends
    return _changed(ends, "ends", values) if values else ends


def _with_imperfection(
    model: ReducedModel, imperfection: Imperfection | None, values: Mapping[str, Any]
) -> ReducedModel:
    """The model of the same beam with another imperfection; of a perfect one *values* are all that it then has."""
    if model.beam is None:
        raise InputError(
            "imperfection: this model was given by matrices, it has no beam; give its transverse_force"
        )
    if values:
        changed = _changed(Imperfection() if imperfection is None else imperfection, "imperfection", values)
        imperfection = changed
    damping: Any = model.damping_ratio
    return ReducedModel.from_beam(
        model.beam, model.modes, damping, model.given_reference_frequency, imperfection=imperfection
    )


def _model(
    model: ReducedModel, beam: Any, of_beam: Mapping[str, Any], of_model: Mapping[str, Any]
) -> ReducedModel:
    if beam is None and not of_beam and not of_model:
        return model
    for name in of_model:
        if name not in _OF_MODEL or (name == "modes" and model.beam is None):
            raise InputError(f"model.{name}: cannot be changed; must be one of {', '.join(_OF_MODEL)}")
    if model.beam is None:
        if beam is not None or of_beam:
            raise InputError("beam: this model was given by matrices, it has no beam")
        given = {
            "damping_ratio": of_model.get("damping_ratio", model.damping_ratio),
            "reference_frequency": of_model.get("reference_frequency", model.given_reference_frequency),
        }
        names = ("mass", "stiffness", "contact_shape", "midspan_shape", "nonlinear_stiffness", "equilibrium")
        rest = {name: getattr(model, name) for name in names}
        if model.transverse_force is not None:
            rest = {name: value for name, value in rest.items() if name != "equilibrium"}
            rest["transverse_force"] = model.transverse_force
        return ReducedModel.from_matrices(**rest, length_scale=model.length_scale or 1.0, **given)
    known = [item.name for item in dataclasses.fields(model.beam) if item.init]
    for name in of_beam:
        if name not in known:
            raise InputError(f"beam.{name}: no parameter of a beam; must be one of {', '.join(known)}")
    damping: Any = model.damping_ratio
    if np.all(damping == damping[0]):
        damping = float(damping[0])
    changed = {
        "modes": model.modes,
        "damping_ratio": damping,
        "reference_frequency": model.given_reference_frequency,
        "imperfection": model.imperfection,
    } | dict(of_model)
    return ReducedModel.from_beam((model.beam if beam is None else beam).replace(**of_beam), **changed)
