"""Parameters that were given, checked one by one: names, kinds, sizes and units."""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from snapbeam.config.axes import parse_axis
from snapbeam.config.contact import MATERIALS, WANTED
from snapbeam.config.parameters import Parameter, lookup, parameters, row_of
from snapbeam.config.physical import PHYSICAL, physical_name
from snapbeam.core.validate import InputError, finite, mapping, shown
from snapbeam.model.contact import LAWS
from snapbeam.model.drive import DRIVES
from snapbeam.model.paper_values import BEAM
from snapbeam.model.striker.another import numbered
from snapbeam.model.world import HARVESTERS, LOADS

__all__ = ["SECTIONS", "checked_sections", "contradictions", "parsed_axis", "with_section"]

SECTIONS = (
    "beam", "model", "ends", "imperfection", "contact", "striker", "drive", "base", "axial", "harvester", "start",
    "axes", "run",
)  # fmt: skip
_KINDS: dict[str, Mapping[str, type]] = {
    "drive": DRIVES,
    "base": {name: kind for name, kind in DRIVES.items() if kind.can_excite_base()},
    "axial": LOADS,
    "harvester": HARVESTERS,
}
"""What a section may be of, where its ``type`` says so."""
_OF_MAP = {"frequency_ratio": "drive", "velocity_amplitude": "drive", "location": "striker"}
"""Names that a section [map] of version 0.1 may hold, and the sections they belong to."""
_SYMBOLS = {
    "E": "young_modulus", "L": "length", "N": "modes", "Omega": "frequency_ratio", "P": "axial_load",
    "V": "velocity_amplitude", "b": "buckling_level", "e": "coefficient", "f1": "reference_frequency", "h": "thickness",
    "k_c": "stiffness", "kc": "stiffness", "omega": "frequency_ratio", "rho": "density", "x_s": "location",
    "xs": "location", "zeta": "damping_ratio",
}  # fmt: skip


def checked_sections(sections: Mapping[str, Any]) -> tuple[dict[str, dict[str, Any]], list[str]]:
    """What was given, by section and name, and a line for everything that is wrong."""
    lines: list[str] = []
    found: dict[str, dict[str, Any]] = {}
    for section, name, value, named in _entries(sections, lines):
        if section != "axes" and name in found.get(section, {}):
            message = f"{name}: is given in two sections"
        else:
            message = _checked(section, name, value, found)
        if message:
            lines.append(f"[{named}] {message}")
    return found, lines


def _entries(sections: Mapping[str, Any], lines: list[str]) -> list[tuple[str, str, Any, str]]:
    """Section, name and value of everything given, and the section it was given in; faults go to *lines*."""
    found = []
    mapping("sections", sections)
    shaker = sections.get("shaker")
    single = set(shaker) if isinstance(shaker, Mapping) else set()
    for section, values in sections.items():
        if numbered(str(section))[0] not in (*SECTIONS, "shaker", "map"):
            lines.append(f"[{section}]: unknown section{_nearest(str(section), list(SECTIONS))}")
        elif not isinstance(values, Mapping):
            lines.append(f"{section} = {shown(values)}: must be a section [{section}]")
        else:
            for name, value in values.items():
                if section == "map" and name not in _OF_MAP:
                    lines.append(f"[map] {name}: unknown key{_nearest(str(name), list(_OF_MAP))}")
                    continue
                place = _place(section, str(name), value)
                if section == "map" and name in single:
                    place = "axes", f"{_OF_MAP[name]}.{name}"  # of the map alone; the other is of single runs
                found.append((*place, value, section))
    return [(section, name, value, shown) for section, name, value, shown in found]


def _place(section: str, name: str, value: Any) -> tuple[str, str]:
    """Where something belongs.

    Version 0.1 had the striker and its drive in one section, axes by short names, and the reference frequency in [integration].
    """
    if section == "shaker":
        return ("drive" if name in ("frequency_ratio", "velocity_amplitude") else "striker"), name
    if section == "map":
        single = isinstance(value, (int, float)) and not isinstance(value, bool)
        return (_OF_MAP[name], name) if single else ("axes", f"{_OF_MAP[name]}.{name}")
    if section == "run" and name == "reference_frequency":
        return "model", name
    return section, name


def _known(section: str, found: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """Names that a section may hold."""
    kind, number = numbered(section)
    names = [row.name.partition(".")[2] for row in parameters().values() if row.section == kind]
    if number > 1:
        names = [name for name in names if row_of(f"{section}.{name}") is not None]
        return names + {"drive": ["type"], "contact": ["type"]}.get(kind, [])
    names += [name.partition(".")[2] for name in PHYSICAL if name.startswith(f"{section}.")]
    names += ["type"] if section in _KINDS else []
    return names + (["type", *MATERIALS, *WANTED] if section == "contact" else [])


def _checked(section: str, name: str, value: Any, found: dict[str, dict[str, Any]]) -> str:
    """Enter a value in *found*, or return what is wrong with it."""
    own = found.setdefault(section, {})
    if section == "axes":
        return _checked_axis(name, value, own)
    if section == "start":
        try:
            row: Parameter | None = lookup(f"start.{name}")
        except InputError:
            return f"{name}: unknown key; must be amplitude[i], velocity[i] or striker_position"
    else:
        known = _known(section, found)
        if name not in known and row_of(f"{section}.{name}") is None:
            return f"{name}: unknown key{_nearest(name, known)}"
        row = row_of(f"{section}.{name}")
    if row is None:
        message, checked = _special(section, name, value)
    else:
        message, checked = _by_row(row, name, value)
    if not message:
        own[name] = checked
    return message


def _by_row(row: Parameter, name: str, value: Any) -> tuple[str, Any]:
    item = row.quantity
    unit = "" if item.unit == "1" else f" in {item.unit}"
    if item.kind is float and not (name == "damping_ratio" and isinstance(value, (list, np.ndarray))):
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            return f"{name} = {shown(value)}: must be a number{unit}", None
        try:
            value = finite(name, value)
        except InputError:
            return f"{name} = {shown(value)}: must be a finite number{unit}", None
        message = _implausible(row, name, value)
        if message:
            return message, None
    elif item.kind is int and (isinstance(value, bool) or not isinstance(value, int)):
        return f"{name} = {shown(value)}: must be a whole number{unit}", None
    elif item.kind is str and not isinstance(value, str):
        return f"{name} = {shown(value)}: must be text", None
    elif item.kind is object or isinstance(value, (list, np.ndarray)):
        return _array(name, value)
    try:
        return "", item.check(name, value)
    except InputError as error:
        return str(error), None


def _implausible(row: Parameter, name: str, value: float) -> str:
    """What is said of a number so far from any beam that it must be in another unit; nothing of others."""
    item = row.quantity
    if not item.plausible or value == 0.0 or item.plausible[0] <= abs(value) <= item.plausible[1]:
        return ""
    low, high, meant = item.plausible
    allowed = f"{low:g} to {high:g}{'' if item.unit == '1' else ' ' + item.unit}"
    return f"{name} = {shown(value)}: must be {allowed}; is it given in {meant}?"


def _array(name: str, value: Any) -> tuple[str, Any]:
    try:
        return "", np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        return f"{name} = {shown(value)}: must be a list of numbers", None


def _is_sum(section: str, value: Any) -> bool:
    """Whether a kind is a sum of drives, such as ``"sine+burst"``, that the section may hold."""
    if not isinstance(value, str) or "+" not in value or value not in DRIVES:
        return False
    return numbered(section)[0] == "drive" or (section == "base" and DRIVES[value].can_excite_base())


def _special(section: str, name: str, value: Any) -> tuple[str, Any]:
    """What is in no row: the law, the drive's kind, materials, and physical units."""
    if name in ("type", "type"):
        known = LAWS if name == "type" else _KINDS[numbered(section)[0]]
        if value not in known and not _is_sum(section, value):
            return f"{name} = {value!r}: must be one of {', '.join(map(repr, known))}", None
        return "", value
    full = f"{section}.{name}"
    if full in PHYSICAL or name == "radius" or name in WANTED:
        unit = PHYSICAL[full].unit if full in PHYSICAL else "m"
        unit = WANTED[name][0] if name in WANTED else unit
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
            return f"{name} = {shown(value)}: must be a number in {unit}", None
        window = MATERIALS[name][2] if name in MATERIALS else None
        if window and not window[0] <= value <= window[1]:
            return (
                f"{name} = {shown(value)}: must be {window[0]:g} to {window[1]:g} m; is it given in {window[2]}?",
                None,
            )
        return "", float(value)
    pair = list(value) if isinstance(value, (list, tuple)) else None
    if pair is None or len(pair) != 2 or not all(isinstance(each, (int, float)) for each in pair):
        return f"{name} = {shown(value)}: must be a list of two numbers, of sphere and beam", None
    if name == "young_modulus" and any(0.0 < each < 1e3 for each in pair):
        return f"young_modulus = {shown(value)}: must be in Pa; is it given in GPa?", None
    return "", [float(each) for each in pair]


def _checked_axis(name: str, value: Any, own: dict[str, Any]) -> str:
    try:
        full = physical_name(name) or lookup(name).name
        rivals = {full, *(key for key, row in PHYSICAL.items() if row.parameter == full)}
        rivals |= {PHYSICAL[full].parameter} if full in PHYSICAL else set()
        twice = sorted(rivals & own.keys())
        if twice:
            return f"{name}: the same axis is given as {twice[0]}"
        parsed = parsed_axis(full, value)
        if full not in PHYSICAL:
            row, short = lookup(full), full.partition(".")[2]
            for point in (parsed[0], parsed[-1]) if row.quantity.kind is float else parsed:
                plain = point if isinstance(point, str) else point.item()
                row.quantity.check(short, plain)
                message = _implausible(row, short, plain) if isinstance(plain, float) else ""
                if message:
                    return message
    except InputError as error:
        return str(error)
    own[full] = value
    return ""


def parsed_axis(name: str, value: Any) -> Any:
    """The values of an axis: numbers, or words."""
    row = None if name in PHYSICAL else lookup(name)
    short = name.partition(".")[2] or name
    if row is not None and row.quantity.kind in (str, bool):
        words = value.split(",") if isinstance(value, str) else value
        return np.array([row.quantity.check(short, word) for word in words])
    return np.atleast_1d(parse_axis(short, value, whole=row is not None and row.quantity.kind is int))


def contradictions(found: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """What is wrong with values that are each in order."""
    contact = found.get("contact", {})
    given = [name for name in MATERIALS if name in contact]
    if given and "stiffness" in contact:
        return ["[contact] give stiffness, or radius, young_modulus and poisson_ratio, not both"]
    if 0 < len(given) < len(MATERIALS):
        return ["[contact] radius, young_modulus and poisson_ratio belong together; one is missing"]
    if "coefficient" in contact and "type" not in contact and (given or "stiffness" in contact):
        return ["[contact] give stiffness, of Hertz's law, or coefficient, of Newton's, not both"]
    for full, row in PHYSICAL.items():
        section, name, ratio = *full.split("."), row.parameter.partition(".")[2]
        if {name, ratio} <= found.get(section, {}).keys():
            return [f"[{section}] give {ratio} or {name}, not both"]
    beam = found.get("beam", {})
    length = beam.get("length", BEAM.length)
    axes = found.get("axes", {})
    for name in ("thickness", "width", "buckling_level"):
        values = [("beam", beam[name])] if name in beam else []
        if f"beam.{name}" in axes:
            values.append(("axes", parsed_axis(f"beam.{name}", axes[f"beam.{name}"])[-1]))
        for section, value in values:
            if value >= length:
                return [
                    f"[{section}] {name} = {value:g} m: must be less than length = {length:g} m; is it given in mm?"
                ]
    return []


def with_section(message: str, found: Mapping[str, Mapping[str, Any]]) -> str:
    """The refusal of a value with the section that it stands in."""
    name = message.partition(" ")[0].rstrip(":")
    for section, values in found.items():
        if name in values:
            return f"[{section}] {message}"
    return message


def _nearest(name: str, known: list[str]) -> str:
    close = [word for word in known if _SYMBOLS.get(name) == word or name.lower().startswith(word)]
    close = close or difflib.get_close_matches(name.lower(), known, 1)
    return f"; did you mean {close[0]!r}?" if close else f"; must be one of {', '.join(known)}"
