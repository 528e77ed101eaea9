"""Parts of a system to and from sections of plain values, as parameter files hold them."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np

from snapbeam.model.axial_load import LOADS, AxialLoadModulation
from snapbeam.model.base_excitation import BaseExcitation
from snapbeam.model.beam import Beam
from snapbeam.model.boundary_conditions import CLAMPED, BoundaryConditions
from snapbeam.model.contact.base import LAWS, ContactLaw
from snapbeam.model.drive.base import DRIVES, Drive
from snapbeam.model.external_force import FORCES, ExternalForce
from snapbeam.model.harvester import HARVESTERS
from snapbeam.model.imperfection import Imperfection
from snapbeam.model.local_force import LOCAL_FORCES
from snapbeam.model.quantity import quantities
from snapbeam.model.reduced_model import ReducedModel
from snapbeam.model.state import State
from snapbeam.model.striker import OF_FIRST_STRIKER, ContactPair, Striker, numbered
from snapbeam.util.validation import InputError, mapping, shown

__all__ = ["SECTIONS", "parts_from_mapping", "parts_to_mapping", "replaced"]


SECTIONS = (
    "beam",
    "model",
    "boundary",
    "imperfection",
    "contact",
    "striker",
    "drive",
    "base_excitation",
    "axial_load",
    "external_force",
    "local_force",
    "harvester",
    "initial_state",
)
"""Sections of a system, in their order."""

_MATRICES = (
    "mass", "stiffness", "contact_shape", "midspan_shape", "nonlinear_stiffness", "well_amplitude", "length_scale",
)  # fmt: skip
_OPTIONAL = ("base_shape", "elongation_matrix", "patch_shape")
_START = (
    "amplitude",
    "velocity",
    "phase",
    "striker_position",
    "contact_time",
    "striker_shift",
    "striker_rate",
    "circuit",
)


def parts_to_mapping(system: Any) -> dict[str, dict[str, Any]]:
    """The parts of a :class:`~snapbeam.System` as sections; what is None is left out."""
    model: ReducedModel = system.model
    contact: ContactLaw | None = system.contact
    striker: Striker | None = system.striker
    start: State | None = system.initial_state
    sections: dict[str, dict[str, Any]] = {}
    section: dict[str, Any] = {}
    damping = model.damping_ratio
    uniform = bool(np.all(damping == damping[0]))
    if model.beam is not None:
        beam = model.beam
        derived = {"buckling_level", "axial_load"} - {beam.given}
        own = {name: getattr(beam, name) for name in quantities(Beam) if name not in derived}
        sections["beam"] = {name: value for name, value in own.items() if value is not None}
        section["modes"] = model.modes
        if not beam.boundary.is_clamped:
            sections["boundary"] = _fields(beam.boundary)
        if model.imperfection is not None:
            own = {name: getattr(model.imperfection, name) for name in quantities(Imperfection)}
            sections["imperfection"] = {name: value for name, value in own.items() if value is not None}
    else:
        section |= {name: getattr(model, name) for name in _MATRICES}
        if model.transverse_force is not None:
            section.pop("well_amplitude")  # follows from the force
            section["transverse_force"] = model.transverse_force
        section |= {name: getattr(model, name) for name in _OPTIONAL if getattr(model, name) is not None}
    section["damping_ratio"] = float(damping[0]) if uniform else np.array(damping)
    if model.given_reference_frequency is not None:
        section["reference_frequency"] = model.given_reference_frequency
    sections["model"] = section
    if contact is not None:
        sections["contact"] = {"type": contact.name} | _fields(contact)
    if striker is not None:
        # without a mass there is no suspension
        left_out = ("suspension_stiffness", "suspension_damping") if striker.mass is None else ()
        own = {name: getattr(striker, name) for name in quantities(Striker) if name not in left_out}
        sections["striker"] = {name: value for name, value in own.items() if value is not None}
        sections["drive"] = {"type": striker.drive.name} | _fields(striker.drive)
    for number, each in enumerate(system.further_contacts, 2):
        sections[f"contact_{number}"] = {"type": each.contact.name} | _fields(each.contact)
        own = {
            name: getattr(each.striker, name) for name in quantities(Striker) if name not in OF_FIRST_STRIKER
        }
        sections[f"striker_{number}"] = {name: value for name, value in own.items() if value is not None}
        sections[f"drive_{number}"] = {"type": each.striker.drive.name} | _fields(each.striker.drive)
    if system.base_excitation is not None:
        own = {name: getattr(system.base_excitation, name) for name in quantities(BaseExcitation)}
        sections["base_excitation"] = (
            {"type": system.base_excitation.motion.name} | own | _fields(system.base_excitation.motion)
        )
    if system.axial_load is not None:
        sections["axial_load"] = {"type": system.axial_load.motion.name} | _fields(system.axial_load.motion)
    if system.external_force is not None:
        own = {name: getattr(system.external_force, name) for name in quantities(ExternalForce)}
        own = {name: value for name, value in own.items() if value is not None}
        history = system.external_force.history
        sections["external_force"] = {"type": history.name} | own | _fields(history)
    if system.local_force is not None:
        sections["local_force"] = {"type": system.local_force.name} | _fields(system.local_force)
    if system.harvester is not None:
        sections["harvester"] = {"type": system.harvester.name} | _fields(system.harvester)
    if start is not None:
        values = {name: getattr(start, name) for name in _START}
        if start.contact_time.size == 1:
            values["contact_time"] = start.contact_time[..., 0]
        sections["initial_state"] = {
            name: value if np.ndim(value) else float(value)
            for name, value in values.items()
            if not np.isnan(value).all()
        }
    return sections


def _fields(part: Any) -> dict[str, Any]:
    found = {item.name: getattr(part, item.name) for item in dataclasses.fields(part)}
    return {name: value for name, value in found.items() if value is not None}


def parts_from_mapping(sections: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """The parts that sections describe."""
    mapping("sections", sections)
    for name, values in sections.items():
        if numbered(name)[0] not in SECTIONS:
            raise InputError(f"[{name}]: unknown section; must be one of {', '.join(SECTIONS)}")
        if not isinstance(values, Mapping):
            raise InputError(f"{name} = {shown(values)}: must be a section [{name}]")
    parts: dict[str, Any] = {"model": _model(sections)}
    if "contact" in sections:
        parts["contact"] = _chosen(sections["contact"], "contact", "type", LAWS)
    if "striker" in sections or "drive" in sections:
        drive: Drive = _chosen(sections.get("drive", {}), "drive", "type", DRIVES)
        own = dict(sections.get("striker", {}))
        _only(own, "striker", list(quantities(Striker)))
        parts["striker"] = Striker(drive=drive, **own)
    parts["further_contacts"] = _others(sections, parts.get("contact"))
    if "base_excitation" in sections:
        own = dict(sections["base_excitation"])
        around = {name: own.pop(name) for name in quantities(BaseExcitation) if name in own}
        parts["base_excitation"] = BaseExcitation(
            motion=_chosen(own, "base_excitation", "type", DRIVES), **around
        )
    if "axial_load" in sections:
        parts["axial_load"] = AxialLoadModulation(
            motion=_chosen(sections["axial_load"], "axial_load", "type", LOADS)
        )
    if "external_force" in sections:
        own = dict(sections["external_force"])
        of_force = {name: own.pop(name) for name in quantities(ExternalForce) if name in own}
        parts["external_force"] = ExternalForce(
            history=_chosen(own, "external_force", "type", FORCES), **of_force
        )
    if "local_force" in sections:
        parts["local_force"] = _chosen(sections["local_force"], "local_force", "type", LOCAL_FORCES)
    if "harvester" in sections:
        parts["harvester"] = _chosen(sections["harvester"], "harvester", "type", HARVESTERS)
    if "initial_state" in sections:
        values = dict(sections["initial_state"])
        _only(values, "initial_state", list(_START))
        _needed(values, "initial_state", State)
        parts["initial_state"] = State(**values)
    return parts


def _others(sections: Mapping[str, Mapping[str, Any]], contact: Any) -> tuple[ContactPair, ...]:
    """The strikers beside the first: sections striker_2, drive_2 and contact_2 (without it the first one's law)."""
    numbers = sorted({numbered(name)[1] for name in sections} - {1})
    if numbers != list(range(2, 2 + len(numbers))):
        raise InputError(f"[striker_{numbers[-1]}]: there is no striker before it; number them 2, 3, ...")
    found = []
    for number in numbers:
        names = {kind: f"{kind}_{number}" for kind in ("striker", "drive", "contact")}
        own = dict(sections.get(names["striker"], {}))
        _only(own, names["striker"], list(quantities(Striker)))
        drive = _chosen(sections.get(names["drive"], {"type": "fixed"}), names["drive"], "type", DRIVES)
        law = contact
        if names["contact"] in sections:
            law = _chosen(sections[names["contact"]], names["contact"], "type", LAWS)
        found.append(ContactPair(Striker(drive=drive, **own), law))
    return tuple(found)


def _model(sections: Mapping[str, Mapping[str, Any]]) -> ReducedModel:
    own = dict(sections.get("model", {}))
    if "beam" in sections:
        values = dict(sections["beam"])
        _only(values, "beam", list(quantities(Beam)))
        _only(own, "model", ["modes", "damping_ratio", "reference_frequency"])
        _needed(values, "beam", Beam)
        uneven = dict(sections.get("imperfection", {}))
        _only(uneven, "imperfection", list(quantities(Imperfection)))
        held = dict(sections.get("boundary", {}))
        _only(held, "boundary", list(quantities(BoundaryConditions)))
        return ReducedModel.from_beam(
            Beam(**values, boundary=BoundaryConditions(**held)), **own, imperfection=Imperfection(**uneven)
        )
    if "boundary" in sections:
        raise InputError(
            "[boundary]: belong to a beam; a structure given by matrices has them in its matrices"
        )
    if "imperfection" in sections:
        raise InputError(
            "[imperfection]: belongs to a beam; give the transverse_force of a structure given by matrices"
        )
    _only(own, "model", [*_MATRICES, *_OPTIONAL, "transverse_force", "damping_ratio", "reference_frequency"])
    for name in ("mass", "stiffness", "contact_shape"):
        if name not in own:
            raise InputError(f"[model] {name} is missing: give it, or a section [beam]")
    return ReducedModel.from_matrices(**own)


def _chosen(values: Mapping[str, Any], section: str, key: str, known: Mapping[str, Any]) -> Any:
    own = dict(values)
    name = own.pop(key, None)
    if not isinstance(name, str) or name not in known:
        raise InputError(f"[{section}] {key} = {shown(name)}: must be one of {', '.join(map(repr, known))}")
    kind = known[name]
    _only(own, section, [item.name for item in dataclasses.fields(kind)])
    _needed(own, section, kind, f" for {key} = {shown(name)}")
    return kind(**own)


def _needed(values: Mapping[str, Any], section: str, kind: Any, why: str = "") -> None:
    """Refuse values that leave out what has no default."""
    missing = [
        item.name
        for item in dataclasses.fields(kind)
        if item.init and item.default is dataclasses.MISSING and item.name not in values
    ]
    if missing:
        raise InputError(f"[{section}] {', '.join(missing)}: missing{why}")


def _only(values: Mapping[str, Any], section: str, known: list[str]) -> None:
    for name in values:
        if name not in known:
            raise InputError(f"[{section}] {name}: unknown key; must be one of {', '.join(known)}")


# ----------------------------------------------------------------------------------------------------
# Systems with some parameters replaced, by dotted name.


_OF_MODEL = ("modes", "damping_ratio", "reference_frequency")


def replaced(parts: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """The parts of a system (model, contact, striker, start) with *changes*, by dotted name or whole part."""
    whole: dict[str, Any] = {}
    inside: dict[str, dict[str, Any]] = {}
    for name, value in changes.items():
        section, dot, field = name.partition(".")
        if numbered(section)[0] not in SECTIONS:
            raise InputError(
                f"{name}: is not a parameter of a system; its sections are {', '.join(SECTIONS)}"
            )
        if dot:
            inside.setdefault(section, {})[field] = value
        else:
            whole[section] = value
    found = dict(parts)
    for name in (
        "model",
        "contact",
        "striker",
        "base_excitation",
        "axial_load",
        "external_force",
        "local_force",
        "harvester",
        "initial_state",
    ):
        if name in whole:
            found[name] = whole[name]
    of_beam = inside.get("beam", {})
    if "boundary" in whole or "boundary" in inside:
        of_beam = of_beam | {"boundary": _ends(found["model"], whole, inside.get("boundary", {}))}
    found["model"] = _model_replacing(found["model"], whole.get("beam"), of_beam, inside.get("model", {}))
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
    found["further_contacts"] = _others_replacing(found.get("further_contacts", ()), whole, inside)
    for name in ("base_excitation", "axial_load", "external_force"):
        if name in inside:
            found[name] = _around(found.get(name), name, inside[name])
    for name in ("local_force", "harvester"):
        if name in inside:
            found[name] = _changed(found.get(name), name, inside[name])
    start, model = found["initial_state"], found["model"]
    if isinstance(start, State) and "initial_state" not in whole and start.modes != model.modes:
        found["initial_state"] = start.with_modes(model.modes)
    return found


def _others_replacing(
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
                f"{section}.{name}: is not a parameter of this system; must be one of {', '.join(known)}"
            )
    return dataclasses.replace(part, **values)


def _around(part: Any, section: str, values: Mapping[str, Any]) -> Any:
    """A base, a load or a force with some of its own quantities changed, or of its motion's."""
    own = quantities(type(_there(part, section)))
    of_motion = {name: value for name, value in values.items() if name not in own}
    if of_motion:
        moves = "history" if section == "external_force" else "motion"
        part = dataclasses.replace(part, **{moves: _changed(getattr(part, moves), section, of_motion)})
    return dataclasses.replace(part, **{name: value for name, value in values.items() if name in own})


def _ends(model: ReducedModel, whole: Mapping[str, Any], values: Mapping[str, Any]) -> Any:
    if model.beam is None:
        raise InputError("boundary: this model was given by matrices, it has no beam")
    ends = whole.get("boundary", whole.get("beam", model.beam).boundary)
    ends = CLAMPED if ends is None else ends
    return _changed(ends, "boundary", values) if values else ends


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


def _model_replacing(
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
        names = (
            "mass",
            "stiffness",
            "contact_shape",
            "midspan_shape",
            "nonlinear_stiffness",
            "well_amplitude",
            *_OPTIONAL,
        )
        rest = {name: getattr(model, name) for name in names}
        if model.transverse_force is not None:
            rest = {name: value for name, value in rest.items() if name != "well_amplitude"}
            rest["transverse_force"] = model.transverse_force
        return ReducedModel.from_matrices(**rest, length_scale=model.length_scale or 1.0, **given)
    known = [item.name for item in dataclasses.fields(model.beam) if item.init]
    for name in of_beam:
        if name not in known:
            raise InputError(f"beam.{name}: is not a parameter of a beam; must be one of {', '.join(known)}")
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
