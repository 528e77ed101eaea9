"""Parts of a system to and from sections of plain values, as parameter files hold them."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from snapbeam.model.axial_load import AxialLoadModulation
from snapbeam.model.base_excitation import BaseExcitation
from snapbeam.model.beam import Beam
from snapbeam.model.boundary_conditions import CLAMPED, BoundaryConditions
from snapbeam.model.drive.force import FORCES
from snapbeam.model.external_force import ExternalForce
from snapbeam.model.harvester import PiezoelectricHarvester, PiezoelectricPatches
from snapbeam.model.imperfection import Imperfection
from snapbeam.model.parameters import SECTIONS, kind_of, kinds_of, row_of
from snapbeam.model.quantity import NUMBERED, numbered, quantities, section_of, split_name
from snapbeam.model.reduced_model import ReducedModel
from snapbeam.model.state import State
from snapbeam.model.striker import Contact, Striker
from snapbeam.util.validation import InputError, InputTypeError, finite_array, mapping, shown

_MATRICES = (
    "mass", "stiffness", "contact_shape", "midspan_shape", "nonlinear_stiffness", "well_amplitude", "length_scale",
)  # fmt: skip
_OPTIONAL = ("base_shape", "elongation_matrix", "patch_shape", "damping")
OF_MATRICES = (*_MATRICES, *_OPTIONAL, "transverse_force", "damping_ratio", "reference_frequency")
"""Keys of the section of a model given by matrices."""
START = (
    "amplitude", "velocity", "phase", "striker_position", "contact_time", "striker_shift", "striker_rate", "indentation",
    "circuit",
)  # fmt: skip
"""Keys of a whole initial state."""


def parts_to_mapping(system: Any) -> dict[str, dict[str, Any]]:
    """The parts of a :class:`~snapbeam.System` as sections; what is None is left out."""
    model: ReducedModel = system.model
    start: State | None = system.initial_state
    sections: dict[str, dict[str, Any]] = {}
    section: dict[str, Any] = {}
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
    if model.damping is None:
        ratio = model.damping_ratio
        section["damping_ratio"] = float(ratio[0]) if np.all(ratio == ratio[0]) else np.array(ratio)
    if model.given_reference_frequency is not None:
        section["reference_frequency"] = model.given_reference_frequency
    sections["model"] = section
    for number, each in enumerate(system.contacts, 1):
        striker = _fields(each.striker)
        drive = striker.pop("drive")
        if each.striker.mass is None:  # without a mass there is no suspension
            del striker["suspension_stiffness"], striker["suspension_damping"]
        labelled = {"label": each.label} if each.label else {}
        sections[section_of("contact", number)] = _described(each.law) | striker | labelled
        sections[section_of("drive", number)] = _described(drive)
    for name in _MOVED:
        if getattr(system, name) is not None:
            sections[name] = _described(getattr(system, name))
    for kind in ("force", "harvester"):
        for number, each in enumerate(getattr(system, _TUPLES[kind]), 1):
            sections[section_of(kind, number)] = _described(each)
    if start is not None:
        values = {name: getattr(start, name) for name in START}
        if start.contact_time.size == 1:
            values["contact_time"] = start.contact_time[..., 0]
        # of several strikers or circuits, those without a number of their own are at rest
        sections["initial_state"] = {
            name: np.nan_to_num(value) if np.ndim(value) else float(value)
            for name, value in values.items()
            if not np.isnan(value).all()
        }
    if system.initial_well is not None:
        sections["initial_state"] = {"initial_well": system.initial_well}
    return sections


def _described(part: Any) -> dict[str, Any]:
    """The section of a part: its type, or that of its motion, and the fields of both."""
    values = _fields(part)
    motion = values.pop("history", values.pop("motion", None))
    if motion is None:
        return {"type": part.name} | values
    return {"type": motion.name} | values | _fields(motion)


def _fields(part: Any) -> dict[str, Any]:
    found = {item.name: getattr(part, item.name) for item in dataclasses.fields(part)}
    return {name: value for name, value in found.items() if value is not None and (name, value) != ("label", "")}


def parts_from_mapping(sections: Mapping[str, Any]) -> dict[str, Any]:
    """The parts that sections describe."""
    sections = flattened(mapping("sections", sections))
    for name, values in sections.items():
        if numbered(name)[0] not in SECTIONS:
            raise InputError(f"[{name}]: unknown section; must be one of {', '.join(SECTIONS)}")
        if not isinstance(values, Mapping):
            raise InputError(f"{name} = {shown(values)}: must be a section [{name}]")
    contacts: list[Contact] = []
    for section, values in _numbered_sections(sections, "contact", "drive"):
        moving = section.replace("contact", "drive")
        drive = _chosen(sections.get(moving, {"type": "fixed"}), moving)
        own = dict(values)
        striker = Striker(drive=drive, **_taken(own, quantities(Striker)))
        label = own.pop("label", "")
        # a further contact of which no law is given has that of the first
        law = contacts[0].law if contacts and not own else _chosen(own, section)
        contacts.append(Contact(law, striker, label))
    parts: dict[str, Any] = {"model": _model(sections), "contacts": tuple(contacts)}
    for name, kind in _MOVED.items():
        if name in sections:
            parts[name] = _moved(kind, "motion", sections[name], name)
    parts["forces"] = tuple(_force(section, values) for section, values in _numbered_sections(sections, "force"))
    made = [_harvesters(values, section) for section, values in _numbered_sections(sections, "harvester")]
    # what patches in series have beside the first follows all, whose numbers stay
    parts["harvesters"] = (*(first for first, *_ in made), *(each for _, *rest in made for each in rest))
    if "initial_state" in sections:
        values = dict(sections["initial_state"])
        _only(values, "initial_state", ["initial_well", *START])
        if "initial_well" in values:
            parts["initial_well"] = values.pop("initial_well")
        if values or "initial_well" not in parts:
            _needed(values, "initial_state", State)
            parts["initial_state"] = State(**values)
    return parts


def _harvesters(values: Mapping[str, Any], section: str) -> list[Any]:
    """The harvesters of a section: more than one of patches that it wires in series."""
    if values.get("type") != PiezoelectricPatches.name or "wiring" not in values:
        return [_chosen(values, section)]
    own = dict(values)
    rows, each = (np.atleast_1d(finite_array(f"[{section}] {name}", own.pop(name, ()))) for name in _OF_PATCHES)
    if rows.ndim != 2 or rows.shape[1] != 3 or each.shape != rows.shape[:1]:
        raise InputError(
            f"[{section}] patches, capacitance: must be rows of three numbers, and one number for each row"
        )
    _only(own, section, ["type", "wiring", "resistance"])
    _needed(own | dict.fromkeys(_OF_PATCHES), section, PiezoelectricPatches)
    patches = [
        PiezoelectricHarvester(patch_start=a, patch_end=b, moment_per_volt=m, capacitance=c, resistance=1.0)
        for (a, b, m), c in zip(rows.tolist(), each.tolist(), strict=True)
    ]
    return list(PiezoelectricPatches.wired(patches, own["wiring"], resistance=own["resistance"]))


def _force(section: str, values: Mapping[str, Any]) -> Any:
    if values.get("type") not in FORCES:
        return _chosen(values, section)
    return _moved(ExternalForce, "history", values, section)


def _moved(kind: Any, motion: str, values: Mapping[str, Any], section: str) -> Any:
    """A part with a motion, whose section names the type of that."""
    own = dict(values)
    rest = _taken(own, [item.name for item in dataclasses.fields(kind)])
    return kind(**{motion: _chosen(own, section)}, **rest)


def _taken(values: dict[str, Any], names: Any) -> dict[str, Any]:
    """Remove and return those of *values* that have one of the names."""
    return {name: values.pop(name) for name in names if name in values}


def _numbered_sections(sections: Mapping[str, Any], *kinds: str) -> list[tuple[str, Mapping[str, Any]]]:
    """The sections of the first of some kinds, in order; of the others there may be none."""
    numbers = sorted({numbered(name)[1] for name in sections if numbered(name)[0] in kinds})
    if numbers != list(range(1, 1 + len(numbers))):
        raise InputError(f"[{section_of(kinds[0], numbers[-1])}]: there is none before it; number them 1, 2, 3, ...")
    return [(name := section_of(kinds[0], number), sections.get(name, {})) for number in numbers]


def flattened(sections: Mapping[str, Any]) -> dict[str, Any]:
    """Sections by name, ``contact``, ``contact.2``, ..., of those in which arrays of tables stand, as in a TOML file.

    The drive of a contact may stand in its table.
    """
    found: dict[str, Any] = {}
    for kind, given in sections.items():
        tables = given if kind in NUMBERED and isinstance(given, (list, tuple)) else [given]
        if not tables:
            raise InputError(f"{kind} = []: must be a table, or an array of at least one table [[{kind}]]")
        for number, values in enumerate(tables, 1):
            section = section_of(kind, number)
            if kind == "contact" and isinstance(values, Mapping) and isinstance(values.get("drive"), Mapping):
                moving = section_of("drive", number)
                if moving in found or moving in sections:
                    raise InputError(f"[{section}] drive: is also given in [{moving}]; leave one out")
                found[moving] = values["drive"]
                values = {name: value for name, value in values.items() if name != "drive"}
            found[section] = values
    return found


def nested(sections: Mapping[str, Any]) -> dict[str, Any]:
    """Sections with arrays of tables for what there is several of, the drive of each contact in its table."""
    found: dict[str, Any] = {}
    for section, values in sections.items():
        kind, _ = numbered(section)
        several = section_of(kind, 2) in sections or (kind == "drive" and "contact.2" in sections)
        if not several:
            found[section] = values
        elif kind != "drive":
            table = dict(values)
            moving = section.replace("contact", "drive")
            if kind == "contact" and moving in sections:
                table["drive"] = sections[moving]
            found.setdefault(kind, []).append(table)
    return found


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
        raise InputError("[boundary]: belong to a beam; a structure given by matrices has them in its matrices")
    if "imperfection" in sections:
        raise InputError(
            "[imperfection]: belongs to a beam; give the transverse_force of a structure given by matrices"
        )
    _only(own, "model", [*OF_MATRICES])
    for name in ("mass", "stiffness", "contact_shape"):
        if name not in own:
            raise InputError(f"[model] {name} is missing: give it, or a section [beam]")
    return ReducedModel.from_matrices(**own)


def _chosen(values: Mapping[str, Any], section: str) -> Any:
    """The part whose kind the key ``type`` of its section names."""
    if "file" in values:
        values = read_file(section, values)
    own, known = dict(values), kinds_of(numbered(section)[0])
    name = own.pop("type", None)
    kind = kind_of(numbered(section)[0], name)
    if kind is None:
        raise InputError(f"[{section}] type = {shown(name)}: must be one of {', '.join(map(repr, known))}")
    _only(own, section, [item.name for item in dataclasses.fields(kind)])
    _needed(own, section, kind, f" for type = {shown(name)}")
    return kind(**own)


def read_file(section: str, values: Mapping[str, Any], folder: str | os.PathLike[str] = ".") -> dict[str, Any]:
    """The values of a section with the record of its ``file``, relative to *folder*, in place of the keys of files."""
    kinds = kinds_of(numbered(section)[0])
    kind = kinds.get(str(values.get("type")))
    if kind is None or not hasattr(kind, "from_file"):
        known = " or ".join(repr(name) for name, each in kinds.items() if hasattr(each, "from_file"))
        must = f"a key of type = {known}" if known else "left out"
        raise InputError(f"[{section}] file = {shown(values['file'])}: must be {must}")
    rest = dict(values)
    file = rest.pop("file")
    if not isinstance(file, (str, os.PathLike)):
        raise InputError(f"[{section}] file = {shown(file)}: must be a path")
    fields = [item.name for item in dataclasses.fields(kind) if item.name not in kind.file_gives]
    twice = [name for name in kind.file_gives if name in rest and name not in kind.file_keys]
    if twice:
        raise InputError(f"[{section}] {twice[0]}: is in the file {shown(file)}; leave one out")
    own = _taken(rest, [*fields, *kind.file_keys])
    _needed(own | dict.fromkeys(kind.file_gives), section, kind, f" for type = {shown(rest['type'])}")
    try:
        return rest | _fields(kind.from_file(Path(folder) / file, **own))
    except InputError as error:
        raise InputError(f"[{section}] {error}") from error


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


_OF_PATCHES = ("patches", "capacitance")
_MOVED = {"base_excitation": BaseExcitation, "axial_load": AxialLoadModulation}
"""Parts with a motion, by the section of a system."""
_TUPLES = {"contact": "contacts", "force": "forces", "harvester": "harvesters"}
"""Parts of a system that are tuples, by the section of one of them."""
PARTS = ("model", "base_excitation", "axial_load", "initial_state", "initial_well", *_TUPLES.values())


def resolved(name: str, labels: Mapping[str, Sequence[str]]) -> str:
    """The dotted name by number of a parameter that is given by number 1 or by the label of a contact or force.

    *labels* are those of the parts in their order, by the section of the first.
    """
    kind, _, rest = name.partition(".")
    if kind not in NUMBERED or not rest:
        return name
    own = list(labels["contact" if kind == "drive" else kind])
    # a label may have dots: the longest that the name begins with, before a field if there is one
    named = [each for each in own if each and (rest == each or rest.startswith(f"{each}."))]
    given, dot, field = rest.partition(".")
    if named:
        given = max(named, key=lambda each: (rest != each, len(each)))
        dot, field = rest[len(given) : len(given) + 1], rest[len(given) + 1 :]
    if not dot and given != "1" and given.isdigit():
        return name
    if not dot and (given in ("law", "striker", "label") or row_of(name) is not None):
        return name  # a field of the first, whatever the labels are
    if given == "1" or given in own:
        number = 1 if given == "1" else 1 + own.index(given)
        return section_of(kind, number) + dot + field
    if dot and not given.isdigit():
        known = ", ".join([*map(str, range(1, 1 + len(own))), *filter(None, own)])
        raise InputError(f"{name}: this system has no {kind} {given!r}; must be one of {known or 'none'}")
    return name


def labels_of(sections: Mapping[str, Any]) -> dict[str, list[str]]:
    """The labels of the parts in flat sections, as :func:`resolved` takes them."""
    found: dict[str, list[str]] = {}
    for kind in _TUPLES:
        numbers = [numbered(name)[1] for name in sections if numbered(name)[0] == kind]
        own = [sections.get(section_of(kind, number), {}) for number in range(1, 1 + max(numbers, default=0))]
        found[kind] = [str(each.get("label", "")) if isinstance(each, Mapping) else "" for each in own]
    return found


def replaced(parts: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """The parts of a system (model, contacts, forces, ...) with *changes*, by dotted name or whole part."""
    whole: dict[str, Any] = {}
    inside: dict[str, dict[str, Any]] = {}
    for name, value in changes.items():
        section, field = split_name(name)
        if numbered(section)[0] not in (*SECTIONS, *PARTS):
            raise InputError(f"{name}: is not a parameter of a system; its sections are {', '.join(SECTIONS)}")
        if field:
            inside.setdefault(section, {})[field] = value
        else:
            whole[section] = value
    found = dict(parts) | {name: whole[name] for name in PARTS if name in whole}
    for name, other in (("initial_state", "initial_well"), ("initial_well", "initial_state")):
        if whole.get(name) is not None and other not in whole:  # a new start replaces the other one
            found[other] = None
    for kind, name in _TUPLES.items():
        count = len(sequence_of(name, found[name]))
        for section in (*whole, *inside):
            of, number = numbered(section)
            if of in (kind, "drive" if kind == "contact" else kind) and number > count:
                raise InputError(f"{section}: this system has {count or 'no'} {name if count != 1 else kind}")
    of_beam = inside.get("beam", {})
    if "boundary" in whole or "boundary" in inside:
        of_beam = of_beam | {"boundary": _ends(found["model"], whole, inside.get("boundary", {}))}
    found["model"] = _model_replacing(found["model"], whole.get("beam"), of_beam, inside.get("model", {}))
    if "imperfection" in whole or "imperfection" in inside:
        given = whole.get("imperfection", found["model"].imperfection)
        found["model"] = _with_imperfection(found["model"], given, inside.get("imperfection", {}))
    found["contacts"] = tuple(
        _contact_replacing(each, number, whole, inside)
        for number, each in enumerate(sequence_of("contacts", found["contacts"]), 1)
    )
    for name in ("base_excitation", "axial_load"):
        if name in inside:
            found[name] = _around(found.get(name), name, inside[name])
    for kind in ("force", "harvester"):
        made = []
        for number, each in enumerate(sequence_of(_TUPLES[kind], found[_TUPLES[kind]]), 1):
            section = section_of(kind, number)
            made.append(_around(whole.get(section, each), section, inside.get(section, {})))
        found[_TUPLES[kind]] = tuple(made)
    start, model = found["initial_state"], found["model"]
    if isinstance(start, State) and "initial_state" not in whole and start.modes != model.modes:
        found["initial_state"] = start.with_modes(model.modes)
    return found


def sequence_of(name: str, value: Any) -> tuple[Any, ...]:
    """A list or tuple, as a tuple."""
    if not isinstance(value, (list, tuple)):
        raise InputTypeError(f"{name} = {shown(value)}: must be a list or tuple, such as [{name[:-1]}]")
    return tuple(value)


def _contact_replacing(
    contact: Any, number: int, whole: Mapping[str, Any], inside: Mapping[str, Mapping[str, Any]]
) -> Any:
    """A contact with its law, striker or drive changed, by dotted name or whole part."""
    section, moving = section_of("contact", number), section_of("drive", number)
    contact = whole.get(section, contact)
    if moving not in whole and moving not in inside and section not in inside:
        return contact
    values = dict(inside.get(section, {}))
    whole_parts = {name: values.pop(name, getattr(contact, name)) for name in ("law", "striker", "label")}
    contact = Contact(**whole_parts)
    law, striker = contact.law, contact.striker
    drive = whole.get(moving, striker.drive)
    if moving in inside:
        drive = _changed(drive, moving, inside[moving])
    if drive is not striker.drive:
        striker = dataclasses.replace(striker, drive=drive)
    of_striker = _taken(values, quantities(Striker))
    if of_striker:
        striker = dataclasses.replace(striker, **of_striker)
    if values:
        law = _changed(law, section, values, list(quantities(Striker)))
    return Contact(law, striker, contact.label)


def _changed(part: Any, section: str, values: Mapping[str, Any], others: list[str] | None = None) -> Any:
    """A frozen part with some of its quantities changed."""
    if part is None:
        raise InputError(f"{section}: this system has none")
    known = [*quantities(type(part)), *(others or [])]
    for name in values:
        if name not in known:
            raise InputError(f"{section}.{name}: is not a parameter of this system; must be one of {', '.join(known)}")
    return dataclasses.replace(part, **values)


def _around(part: Any, section: str, values: Mapping[str, Any]) -> Any:
    """A base, a load, a force or a harvester with some of its own quantities changed, or of its motion's."""
    own = {} if part is None else quantities(type(part))
    moves = next((name for name in ("history", "motion") if hasattr(part, name)), "")
    of_motion = {name: value for name, value in values.items() if name not in own} if moves else {}
    if of_motion:
        part = dataclasses.replace(part, **{moves: _changed(getattr(part, moves), section, of_motion)})
    rest = {name: value for name, value in values.items() if name not in of_motion}
    return _changed(part, section, rest) if rest else part


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
        raise InputError("imperfection: this model was given by matrices, it has no beam; give its transverse_force")
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
        if model.damping is not None and "damping_ratio" in of_model:
            raise InputError(
                f"model.damping_ratio = {shown(of_model['damping_ratio'])}: cannot be changed, the model has a damping matrix"
            )
        given = {
            "damping_ratio": of_model.get("damping_ratio", model.given_damping_ratio),
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
