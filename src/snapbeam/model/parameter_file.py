"""Parameters from a file or the command line: checks, defaults of the paper, conversion to objects."""

from __future__ import annotations

import difflib
import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from numpy.typing import NDArray

from snapbeam.model.contact.hertz import HertzContact
from snapbeam.model.contact.hunt_crossley import HuntCrossley
from snapbeam.model.default_values import BEAM, CONTACT, DAMPING_RATIO, LOCATION, MODES
from snapbeam.model.drive.force import FORCES
from snapbeam.model.harvester import WIRINGS
from snapbeam.model.integration import CYCLES, Integration
from snapbeam.model.mapping import OF_MATRICES, START, flattened, labels_of, parts_from_mapping, read_file, resolved
from snapbeam.model.modal_convergence import converged_modes, error_of_auto
from snapbeam.model.parameter_axes import axis_that_changes_unit, checked_physical, parse_axis, unit_of
from snapbeam.model.parameters import (
    PHYSICAL,
    Parameter,
    kind_of,
    kinds_of,
    lookup,
    named_in,
    parameters,
    physical_hint,
    physical_names,
    ratio_of,
    refuse_well_axis,
    row_of,
)
from snapbeam.model.parameters import SECTIONS as SYSTEM_SECTIONS
from snapbeam.model.potential import Potential
from snapbeam.model.quantity import check_label, numbered, quantities, split_name
from snapbeam.model.reduced_model import ReducedModel
from snapbeam.model.state import State
from snapbeam.model.striker import Striker
from snapbeam.model.system import System, told_as
from snapbeam.util.files import atomic_path, check_writable
from snapbeam.util.input_files import read_toml
from snapbeam.util.units import number_in_unit
from snapbeam.util.validation import InputError, file_path, finite, instance, mapping, require_texts, shown

# ----------------------------------------------------------------------------------------------------
# Which law of contact was meant, and the numbers that follow from materials or from a wanted restitution.


MATERIALS = {
    "radius": ("m", "radius of the sphere", (1e-7, 1.0, "mm")),
    "young_modulus": ("Pa", "Young's moduli of sphere and beam", None),
    "poisson_ratio": ("1", "Poisson ratios of sphere and beam", None),
}
"""Material parameters from which a Hertzian stiffness follows: unit, long name and plausible range."""
WANTED = {
    "restitution": ("1", "share of its speed that a free mass keeps, from which the loss follows"),
    "speed": ("m/s", "at which it keeps that share"),
}
"""Parameters from which a damping factor follows: unit and long name."""
_TELLING = {
    "coefficient": "restitution", "damping_factor": "hunt_crossley", "restitution": "hunt_crossley", "speed": "hunt_crossley",
    "layer_stiffness": "layer", "loading_stiffness": "elastic_plastic", "unloading_stiffness": "elastic_plastic",
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
    """The section of a system, complete: the paper's stiffness where none was given, a loss from a restitution."""
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
            raise InputError("[contact] restitution and speed make the loss of type = 'hunt_crossley'; give no other")
        values["damping_factor"] = HuntCrossley.from_restitution(
            values["stiffness"], wanted["restitution"], wanted["speed"]
        ).damping_factor
    return values


def contact_rivals() -> list[tuple[set[str], set[str]]]:
    """Sets of parameters that exclude each other: a value of one set replaces those of the other."""
    sphere, lossy = {"stiffness", *MATERIALS}, {"damping_factor", *WANTED}
    spring, power = {"linear_stiffness", "linear_damping"}, {"force_at_1um", "exponent"}
    pairs = [({"stiffness"}, set(MATERIALS)), ({"damping_factor"}, set(WANTED))]
    pairs.append(({"layer_stiffness"}, lossy))
    groups = [{"coefficient"}, sphere | lossy | {"layer_stiffness"}, spring, power]
    pairs += [(one, other) for i, one in enumerate(groups) for other in groups[i + 1 :]]
    return pairs


# ----------------------------------------------------------------------------------------------------
# Parameters that were given, checked one by one: names, kinds, sizes and units.


SECTIONS = (*SYSTEM_SECTIONS, "sweep", "integration")
_OF_OTHER_COMMANDS = ("uncertainty", "probability", "design")
"""Sections that a file may contain for other commands, which check them."""
_OF_RUNS = ("sweep", "integration")
"""Sections that describe no system."""
_SYMBOLS = {
    "E": "young_modulus", "L": "length", "N": "modes", "Omega": "frequency_ratio", "P": "axial_load",
    "V": "velocity_amplitude", "b": "buckling_level", "e": "coefficient", "f1": "reference_frequency", "h": "thickness",
    "k_c": "stiffness", "kc": "stiffness", "omega": "frequency_ratio", "rho": "density", "x_s": "location",
    "xs": "location", "zeta": "damping_ratio",
}  # fmt: skip


_MOST_FAULTS = 30
"""Faults of a file that are listed."""


def checked_sections(
    sections: Mapping[str, Any], folder: str | os.PathLike[str] = "."
) -> tuple[dict[str, dict[str, Any]], list[str]]:
    """Return the checked values by section and name, and one message for each fault; files of records are in *folder*."""
    lines: list[str] = []
    found: dict[str, dict[str, Any]] = {}
    flat = flattened(mapping("sections", sections))
    for section, values in flat.items():
        if len(lines) > _MOST_FAULTS:
            break
        if section == "extends":
            if values != "paper":
                lines.append(
                    f'extends = {shown(values)}: must be "paper" or a parameter file, such as "beam.toml"; leave it out for '
                    "a beam of your own"
                )
        elif section in _OF_OTHER_COMMANDS and isinstance(values, Mapping):
            continue
        elif numbered(str(section))[0] not in SECTIONS:
            known = [*SECTIONS, *_OF_OTHER_COMMANDS]
            lines.append(f"[{section}]: unknown section{_nearest(str(section), known)}")
        elif not isinstance(values, Mapping):
            lines.append(f"{section} = {shown(values)}: must be a section [{section}]")
        else:
            if "file" in values and section not in _OF_RUNS:
                try:
                    values = read_file(str(section), values, folder)
                except InputError as error:
                    lines.append(str(error))
                    continue
            for name, value in values.items():
                if message := _checked(section, str(name), value, found, flat):
                    lines.append(f"[{section}] {message}")
                if len(lines) > _MOST_FAULTS:
                    break
    if len(lines) > _MOST_FAULTS:
        lines[_MOST_FAULTS:] = [f"more than {_MOST_FAULTS} faults: these are the first"]
    return found, lines


def _known(section: str, values: Mapping[str, Any]) -> list[str]:
    """Names that a section may hold, those of its type if that is given."""
    kind = numbered(section)[0]
    if kind == "model" and "mass" in values:
        return [*OF_MATRICES]
    rows = [row for row in parameters().values() if row.section == kind]
    rows = [row for row in rows if not _is_of_other_type(row, values)]
    names = [split_name(row.name)[1] for row in rows]
    names += ["type"] if kinds_of(kind) else []
    names += ["label"] if kind in ("contact", "force") else []
    names += [*MATERIALS, *WANTED] if kind == "contact" else []
    names += ["wiring"] if kind == "harvester" and values.get("type", "patches") == "patches" else []
    return names + [split_name(full)[1] for full in physical_names(f"{section}.{name}" for name in names)]


def _is_of_other_type(row: Parameter, values: Mapping[str, Any]) -> bool:
    """Return whether a parameter belongs to other types of a section than that of its values; sums have those of all."""
    kind = values.get("type")
    known = isinstance(kind, str) and "+" not in kind and kind in kinds_of(row.section)
    return known and bool(row.kinds) and kind not in row.kinds


def _checked(section: str, name: str, value: Any, found: dict[str, dict[str, Any]], flat: Mapping[str, Any]) -> str:
    """Enter a value in *found*, or return what is wrong with it."""
    own = found.setdefault(section, {})
    if section == "sweep":
        return _checked_axis(name, value, own, flat)
    if section == "initial_state" and name in START and "amplitude" in flat[section]:
        row: Parameter | None = None
    elif section == "initial_state":
        try:
            row = lookup(f"initial_state.{name}")
        except InputError:
            return f"{name}: unknown key; must be initial_well, amplitude[i], velocity[i] or striker_position"
    else:
        known = _known(section, flat[section])
        row = row_of(ratio_of(f"{section}.{name}"))
        if name not in known and (row is None or _is_of_other_type(row, flat[section])):
            what = "unknown key" if row is None else f"is not a key of type {flat[section]['type']!r}"
            return f"{name}: {what}{_nearest(name, known)}"
        row = row_of(f"{section}.{name}")
    if name == "capacitance" and "wiring" in flat[section]:  # of each patch
        message, checked = _each_with_unit(name, value, "F")
    elif row is None:
        message, checked = _special(section, name, value)
    else:
        message, checked = _by_row(row, name, value)
    if not message:
        own[name] = checked
    return message


def _by_row(row: Parameter, name: str, value: Any) -> tuple[str, Any]:
    item = row.quantity
    unit = "" if item.unit == "1" else f" in {item.unit}"
    message, value = _from_text(name, value, item.unit) if item.kind is float else ("", value)
    if message:
        message += physical_hint(row.name)
        return message, None
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
    elif row.name == "model.modes" and error_of_auto(value) is not None:
        return "", value.strip()
    elif item.kind is int and (isinstance(value, bool) or not isinstance(value, int)):
        return f"{name} = {shown(value)}: must be a whole number{unit}", None
    elif item.kind is str and not isinstance(value, str):
        return f"{name} = {shown(value)}: must be text", None
    elif item.parse is None and (item.kind is object or isinstance(value, (list, np.ndarray))):
        return _array(name, value)
    try:
        return "", item.check(name, value)
    except InputError as error:
        return str(error), None


def _from_text(name: str, value: Any, unit: str) -> tuple[str, Any]:
    """A number that is given as text with a unit, in *unit*; anything else as it is."""
    if not isinstance(value, str):
        return "", value
    try:
        number = number_in_unit(value, unit)
    except InputError as error:
        return f"{name} = {shown(value)}: {error}", None
    return "", value if number is None else number


def _implausible(row: Parameter, name: str, value: float) -> str:
    """Error message for a value outside the plausible range, probably in another unit; otherwise empty."""
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


def _special(section: str, name: str, value: Any) -> tuple[str, Any]:
    """Check an entry without a row in the table: law, drive type, materials, physical units."""
    if name == "type":
        known = kinds_of(numbered(section)[0])
        if kind_of(numbered(section)[0], value) is None:
            return f"{name} = {shown(value)}: must be one of {', '.join(map(repr, known))}", None
        return "", value
    if section in ("model", "initial_state"):
        return _array(name, value)
    if name == "wiring":
        return ("", value) if value in WIRINGS else (f"{name} = {shown(value)}: must be {' or '.join(WIRINGS)}", None)
    if name == "label":
        try:
            check_label(value)
        except InputError as error:
            return str(error), None
        return "", value
    full = f"{section}.{name}"
    if full in PHYSICAL or name == "radius" or name in WANTED:
        unit = PHYSICAL[full].unit if full in PHYSICAL else "m"
        unit = WANTED[name][0] if name in WANTED else unit
        message, value = _from_text(name, value, unit)
        if message:
            return message, None
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
            return f"{name} = {shown(value)}: must be a number in {unit}", None
        window = MATERIALS[name][2] if name in MATERIALS else None
        if window and not window[0] <= value <= window[1]:
            return (
                f"{name} = {shown(value)}: must be {window[0]:g} to {window[1]:g} m; is it given in {window[2]}?",
                None,
            )
        return "", float(value)
    message, pair = _each_with_unit(name, value, MATERIALS[name][0])
    if message:
        return message, None
    if len(pair) != 2:
        return f"{name} = {shown(value)}: must be a list of two numbers, of sphere and beam", None
    if name == "young_modulus" and any(0.0 < each < 1e3 for each in pair):
        return f"young_modulus = {shown(value)}: must be in Pa; is it given in GPa?", None
    return "", [float(each) for each in pair]


def _each_with_unit(name: str, value: Any, unit: str) -> tuple[str, Any]:
    """A list of numbers, each of which may have a unit."""
    found = [_from_text(name, each, unit) for each in value] if isinstance(value, (list, tuple)) else []
    for message, number in found:
        if message or not isinstance(number, (int, float)):
            return message or f"{name} = {shown(value)}: must be a list of numbers", None
    if not found:
        return f"{name} = {shown(value)}: must be a list of numbers", None
    return "", [float(number) for _, number in found]


def _full_name(name: str, sections: Mapping[str, Any]) -> str:
    """The dotted name of a parameter that is given by its last part, by number 1 or by a label, among sections."""
    return lookup(named_in(resolved(name, labels_of(sections)), sections)).name


def _checked_axis(name: str, value: Any, own: dict[str, Any], flat: Mapping[str, Any]) -> str:
    try:
        full = _full_name(name, flat)
        twice = sorted(same_axis(full) & own.keys())
        if twice:
            return f"{name}: the same axis is given as {twice[0]}"
        parsed = parsed_axis(full, value)
        if full not in PHYSICAL:
            row, short = lookup(full), split_name(full)[1]
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
    row, short = lookup(name), split_name(name)[1] or name
    refuse_well_axis(row)
    if row.quantity.kind in (str, bool):
        words = value.split(",") if isinstance(value, str) else value
        return np.array([row.quantity.check(short, word) for word in words])
    return np.atleast_1d(parse_axis(short, value, whole=row.quantity.kind is int, unit=row.quantity.unit))


def contradictions(found: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """Error messages for contradictions between values that are each valid."""
    if "mass" in found.get("model", {}) and "beam" in found:
        return ["[beam]: leave it out of a file with the matrices of [model]"]
    contact = found.get("contact", {})
    given = [name for name in MATERIALS if name in contact]
    if given and "stiffness" in contact:
        return ["[contact] give stiffness, or radius, young_modulus and poisson_ratio, not both"]
    if 0 < len(given) < len(MATERIALS):
        return ["[contact] radius, young_modulus and poisson_ratio belong together; one is missing"]
    if "coefficient" in contact and "type" not in contact and (given or "stiffness" in contact):
        return ["[contact] give stiffness, of Hertz's law, or coefficient, of Newton's, not both"]
    for full, row in PHYSICAL.items():
        (section, name), ratio = split_name(full), split_name(row.parameter)[1]
        if {name, ratio} <= found.get(section, {}).keys():
            return [f"[{section}] give {ratio} or {name}, not both"]
    beam = found.get("beam", {})
    length = beam.get("length", BEAM.length)
    axes = found.get("sweep", {})
    for name in ("thickness", "width", "buckling_level"):
        values = [("beam", beam[name])] if name in beam else []
        if f"beam.{name}" in axes:
            values.append(("sweep", parsed_axis(f"beam.{name}", axes[f"beam.{name}"])[-1]))
        for section, value in values:
            if value >= length:
                return [
                    f"[{section}] {name} = {value:g} m: must be less than length = {length:g} m; is it given in mm?"
                ]
    return []


def with_section(message: str, found: Mapping[str, Mapping[str, Any]]) -> str:
    """Error message of a value with its section."""
    name = message.partition(" ")[0].rstrip(":")
    for section, values in found.items():
        if name in values:
            return f"[{section}] {message}"
    return message


def _nearest(name: str, known: list[str]) -> str:
    close = [word for word in known if _SYMBOLS.get(name) == word or name.lower().startswith(word)]
    close = close or difflib.get_close_matches(name.lower(), known, 1)
    return f"; did you mean {close[0]!r}?" if close else f"; must be one of {', '.join(known)}"


# ----------------------------------------------------------------------------------------------------


_Array = NDArray[np.float64]
Sections = Mapping[str, Mapping[str, Any]]

DEFAULT_DRIVE = {"frequency_ratio": 1.21, "velocity_amplitude": 0.18}
DEFAULT_AXES = {"drive.frequency_ratio": "0.1:4:64", "drive.velocity_amplitude": "0.01:0.65:40"}
"""Default axes of a map."""
_AROUND, _STRIKING = (("base_excitation", "axial_load", "force", "harvester"), ("contact", "drive"))
_FIRST_MODES = 2
"""Number of modes of the first model from which that of ``modes = "auto"`` follows."""
_CONVERTED = {"radius", "file", *WANTED, *(field for _, field in map(split_name, PHYSICAL))}
"""Names of a parameter file that a system does not have."""
# What stands for the same thing in a section: giving one set takes the other away.
_RIVALS: dict[str, list[tuple[set[str], set[str]]]] = {
    "beam": [({"buckling_level"}, {"axial_load"})],
    "contact": contact_rivals(),
}
for _name, _row in PHYSICAL.items():
    _section, _own = split_name(_name)
    _RIVALS.setdefault(numbered(_section)[0], []).append(({split_name(_row.parameter)[1]}, {_own}))


@dataclass(frozen=True)
class Config:
    """Parameters that were given, by section.

    Attributes
    ----------
    given : mapping of str to mapping
        Checked values by section and name.
    extends_paper : bool
        True if the paper's values complete what is not given.  If False, a missing value is refused.
    as_given : mapping of str
        Texts with units, and numbers in physical units, by dotted name.
    """

    given: Sections = field(default_factory=dict)
    extends_paper: bool = True
    as_given: Mapping[str, Any] = field(default_factory=dict, compare=False, repr=False)

    @property
    def extension(self) -> dict[str, Any]:
        """The line ``extends = "paper"`` of a file, if the paper's values complete these."""
        return {"extends": "paper"} if self.extends_paper else {}

    @property
    def is_of_matrices(self) -> bool:
        """True if the model is given by matrices, without a beam."""
        return "mass" in self.section("model")

    def section(self, name: str) -> dict[str, Any]:
        """Values given in a section."""
        return dict(self.given.get(name, {}))

    def full_name(self, name: str) -> str:
        """The dotted name of a parameter that is given by its last part or by the label of a contact or force.

        Raises
        ------
        InputError
            If there is none: the message names the nearest.
        """
        found = resolved(name, labels_of(self.given))
        section, field = split_name(found)
        of_file = ("type", "label", *((*MATERIALS, *WANTED) if numbered(section)[0] == "contact" else ()))
        return found if field in of_file else _full_name(name, self.given)

    def of_option(self, name: str) -> str:
        """The dotted name that an option of the striker or its drive has, in a system without a striker.

        ``--frequency-hz`` is then the frequency of the one excitation that has one, such as that of the base.
        """
        if split_name(name)[0] not in _STRIKING or any(self.section(part) for part in _STRIKING):
            return name
        found = named_in(split_name(name)[1], self.given)
        return found if split_name(found)[1] else name

    def _with_axes(self, name: str) -> dict[str, Any]:
        """Values given in a section; a key that has only an axis takes the first value of the axis."""
        found, known = self.section(name), parameters()
        kind = law_of(found) if numbered(name)[0] == "contact" else found.get("type", "sine")
        for axis, values in self.section("sweep").items():
            section, key = split_name(ratio_of(lookup(axis).name))
            if section != name or key in found:
                continue
            if axis in PHYSICAL:
                own = split_name(axis)[1] in found or (self.extends_paper and name in _STRIKING)
                if not own:
                    found[key] = _stand_in(key, 0.0)
                continue
            row = known.get(f"{numbered(name)[0]}.{key}")
            if row is None or (row.default is None and (not row.kinds or kind in row.kinds)):
                found[key] = parsed_axis(axis, values)[0].item()
        return found

    @cached_property
    def defaulted(self) -> tuple[str, ...]:
        """Names of values that were not given: those of the paper's beam for another beam, else the default drive."""
        if not self.section("beam") and not self.is_of_matrices:
            return ()
        found, swept = self._defaults(), self.axes() if self.section("sweep") else {}
        driven = not (self._is_unstruck or self._stands_still)
        sections = ("beam", "model", "contact") if self.extends_paper else ("drive",) if driven else ()
        return tuple(
            f"{section}.{name}"
            for section in sections
            for name in found.get(section, ())
            if name not in {*self.section(section), "modes", "location"} and f"{section}.{name}" not in swept
        )

    def whole(self, axes: Mapping[str, Any] | None = None) -> Config:
        """All values, defaults included, in the layout of a parameter file.

        Parameters
        ----------
        axes : mapping of str to array_like, optional
            The axes by dotted name, in place of those that were given.
        """
        axes = self.axes() if axes is None and self.section("sweep") else dict(axes or {})
        swept = {*map(ratio_of, axes)}
        if self.model.length_scale is None:  # a beam that does not buckle makes no system
            sections = {name: self._defaults()[name] | self.section(name) for name in ("beam", "model")}
            sections |= {name: self.section(name) for name in ("boundary", "imperfection") if self.section(name)}
        else:
            sections = {
                name: {k: v for k, v in values.items() if v is not None and f"{name}.{k}" not in swept}
                for name, values in self.system.to_mapping().items()
            }
            sections.pop("initial_state", None)
            if self.section("initial_state"):
                sections["initial_state"] = self.section("initial_state")
        own = {name: getattr(self.integration, name) for name in quantities(Integration)}
        if own["cycles"] is None:
            own["cycles"] = CYCLES
        sections["integration"] = {
            name: value for name, value in own.items() if value is not None and f"integration.{name}" not in axes
        }
        if axes:
            whole_number = {name: lookup(name).quantity.kind is int for name in axes}
            sections["sweep"] = {
                name: np.asarray(values, dtype=int if whole_number[name] else None).tolist()
                for name, values in axes.items()
            }
        return config_from_mapping(sections)

    def _defaults(self) -> dict[str, dict[str, Any]]:
        """Values by section of what need not be given."""
        found = self._of_paper()
        if self.is_of_matrices:
            del found["beam"]
            found["model"] = {}
        if self.extends_paper:
            return found
        own = {"model": {"modes": MODES} if found["model"] else {}, "drive": found["drive"]}
        return {section: own.get(section, {}) for section in found}

    def _require(self, *sections: str) -> None:
        """Refuse values of *sections* that only the paper's beam has."""
        if self.extends_paper:
            return
        lines, of_paper = [], self._of_paper()
        for section in sections:
            given = self._with_axes(section).keys()
            if self.is_of_matrices and section in ("beam", "model"):
                continue
            missing = [name for name in of_paper[section] if name not in given and name != "modes"]
            if missing:
                lines.append(f"[{section}] {', '.join(missing)}: missing")
        if lines:
            raise InputError(
                f'{"; ".join(lines)}; give what is missing, or write extends = "paper" at the top of the file to '
                "take the values of the paper"
            )

    def _of_paper(self) -> dict[str, dict[str, Any]]:
        beam = {name: getattr(BEAM, name) for name in ("length", "thickness", "width", "density", "young_modulus")}
        own = self.section("beam") if self.extends_paper else self._with_axes("beam")
        if not {"buckling_level", "axial_load"} & own.keys():
            beam["buckling_level"] = BEAM.buckling_level
        contact: dict[str, Any] = {}
        of_contact = self.section("contact")
        if (
            law_of(of_contact) in ("hertz", "hunt_crossley", "layer")
            and not {"stiffness", *MATERIALS} & of_contact.keys()
        ):
            contact = {"stiffness": CONTACT.stiffness}
        if "location_m" not in of_contact and not self.is_of_matrices:
            contact["location"] = LOCATION
        drive = dict(DEFAULT_DRIVE)
        given = self.section("drive")
        if given.get("type", "sine") != "sine":
            drive = {}
        for physical, name in (("frequency_hz", "frequency_ratio"), ("velocity_m_s", "velocity_amplitude")):
            if physical in given:
                drive.pop(name, None)
        return {
            "beam": beam,
            "model": {"modes": MODES, "damping_ratio": DAMPING_RATIO},
            "contact": contact,
            "drive": drive,
        }

    @cached_property
    def system(self) -> System:
        """The system; what is not given is the paper's.  Refused (InputError) if values do not go together."""
        self._require("beam", "model", *(() if self._is_unstruck else ("contact",)))
        sections: dict[str, Any] = {
            name: values | (self._with_axes(name) if self._may_be_axis(name) else self.section(name))
            for name, values in self._defaults().items()
        }
        sections |= {name: self.section(name) for name in ("boundary", "imperfection") if self.section(name)}
        sections |= {name: self._with_axes(name) for name in self._around}
        sections |= self._further
        if self._is_unstruck:
            for name in _STRIKING:
                del sections[name]
        else:
            sections["contact"] = contact_of(sections["contact"])
            if self._stands_still:
                sections["drive"] = {"type": "fixed"}
            sections["drive"].setdefault("type", "sine")
        later = _without_units(sections)
        system = System.from_mapping(sections)
        if later:
            system = system.replace(**{
                PHYSICAL[name].parameter: checked_physical(system, name, value, split_name(name)[1])
                for name, value in later.items()
            })  # fmt: skip
        return told_as(self._started(system), self.as_given)

    def _may_be_axis(self, section: str) -> bool:
        """Return whether a required value of a section may be given by an axis only."""
        return section in _STRIKING or not self.extends_paper

    @property
    def _further(self) -> dict[str, dict[str, Any]]:
        """The sections of further contacts and their drives, complete."""
        found = {}
        for name in self.given:
            kind, number = numbered(name)
            if number > 1 and kind in _STRIKING:
                own = self._with_axes(name)
                has_law = own.keys() - {*quantities(Striker), "label"}
                found[name] = contact_of(own) if kind == "contact" and has_law else own
                if kind == "drive":
                    found[name].setdefault("type", "sine")
        return found

    @property
    def _around(self) -> list[str]:
        """Sections of excitations other than strikers."""
        return [name for name, values in self.given.items() if numbered(name)[0] in _AROUND and values]

    @property
    def _is_unstruck(self) -> bool:
        """True if there is no striker: none was given, and that of the paper is not added."""
        added = self.extends_paper and not self._is_moved
        return not added and not any(self._with_axes(name) for name in _STRIKING)

    @property
    def _stands_still(self) -> bool:
        """True if a striker next to a base excitation, an axial load or a force has no drive."""
        return self._is_moved and not self.section("drive")

    @property
    def _is_moved(self) -> bool:
        return any(
            name in ("base_excitation", "axial_load") or self.section(name).get("type") in FORCES
            for name in self._around
        )

    @property
    def is_complete(self) -> bool:
        """True if the values describe the same system without the defaults of the paper."""
        try:
            return bool(Config(self.given, extends_paper=False).system == self.system)
        except InputError:
            return False

    @property
    def is_static(self) -> bool:
        """True if the file describes only a beam and forces on it, without the damping that a motion needs."""
        kinds = {numbered(name)[0] for name in self.given}
        damped = {"damping_ratio", "damping"} & self.section("model").keys() and self._around
        return (
            not self.extends_paper and not damped and not kinds - {"beam", "model", "boundary", "imperfection", "force"}
        )

    def _with_number_of_modes(self) -> Config:
        """The parameters with the number of modes that ``modes = "auto"`` asks for."""
        error = error_of_auto(self.section("model").get("modes"))
        if error is None:
            return self

        def given(modes: int) -> Config:
            return Config(
                {**self.given, "model": self.section("model") | {"modes": modes}}, self.extends_paper, self.as_given
            )

        return given(converged_modes(given(_FIRST_MODES).static_system, error))

    def _started(self, system: System) -> System:
        """The system with the start that was given."""
        start = self.section("initial_state")
        if "amplitude" in start:
            return system.replace(initial_state=State(**start))
        return system.replace(**{f"initial_state.{name}": value for name, value in start.items()}) if start else system

    @property
    def model(self) -> ReducedModel:
        """The reduced model alone, of a beam that need not be buckled."""
        found: ReducedModel = self._parts()["model"]
        return found

    @property
    def potential(self) -> Potential:
        """Potential energy of the model with the forces that were given, of a beam that need not be buckled."""
        parts = self._parts(*(name for name in self._around if numbered(name)[0] == "force"))
        return Potential.of(parts["model"], parts["forces"])

    @property
    def static_system(self) -> System:
        """The model with the forces that were given, for questions about its equilibria."""
        return System(**self._parts(*(name for name in self._around if numbered(name)[0] == "force")))

    @property
    def free_system(self) -> System:
        """The model with its forces and harvesters, for questions about free motion."""
        return System(**self._parts(*(name for name in self._around if numbered(name)[0] in ("force", "harvester"))))

    @property
    def exciting(self) -> list[str]:
        """Sections of what a free motion is without: excitations and strikers."""
        kept = ("force", "harvester")
        return [name for name in (*self._around, *_STRIKING) if numbered(name)[0] not in kept and self.section(name)]

    def _parts(self, *forces: str) -> dict[str, Any]:
        self._require("beam")
        sections = {
            name: values | (self._with_axes(name) if self._may_be_axis(name) else self.section(name))
            for name, values in self._defaults().items()
            if name in ("beam", "model")
        }
        if "damping" not in sections["model"]:
            sections["model"].setdefault("damping_ratio", DAMPING_RATIO)  # has no effect without motion
        sections |= {name: self.section(name) for name in ("boundary", "imperfection") if self.section(name)}
        sections |= {name: self._with_axes(name) for name in forces if self.section(name)}
        later = _without_units(sections)
        parts = parts_from_mapping(sections)
        places = {name: value for name, value in later.items() if PHYSICAL[name].unit == "m"}
        if places:  # what acts at rest does not depend on frequencies
            parts["forces"] = System(**parts).replace(**places).forces
        return parts

    @cached_property
    def integration(self) -> Integration:
        """Solver settings."""
        return Integration(**self.section("integration"))

    def axes(self, default: Mapping[str, str] | None = None) -> dict[str, _Array]:
        """The axes, by dotted name, in the units in which they were given; *default* if none is named.

        If an axis changes the structure, and with it what a ratio of 1 is, single values in physical units become axes of
        one point.

        Raises
        ------
        InputError
            For values in physical units that are out of range.
        """
        given = self.section("sweep") or dict(default or {})
        found = {lookup(name).name: parsed_axis(name, value) for name, value in given.items()}
        for name in [each for each in found if each in PHYSICAL]:
            for value in found[name].tolist():
                checked_physical(self.system, name, value, name)
        for name in PHYSICAL:
            section, field = split_name(name)
            if field in self.section(section) and axis_that_changes_unit(self.system, name, found) is not None:
                found[name] = np.array([self.section(section)[field]])
        return found

    def to_mapping(self) -> dict[str, dict[str, Any]]:
        """The given values as a nested dictionary, in the layout of a file."""
        return {section: dict(values) for section, values in self.given.items() if values}


def _without_units(sections: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """Take values in physical units out of sections, which get ratios in their place, and return them by dotted name."""
    found = {}
    for section, values in sections.items():
        for full in (f"{section}.{name}" for name in [*values]):
            if full in PHYSICAL:
                found[full] = values.pop(split_name(full)[1])
                ratio = split_name(PHYSICAL[full].parameter)[1]
                values.setdefault(ratio, _stand_in(ratio, found[full]))
    return found


def _stand_in(name: str, value: Any) -> float:
    """A value that lets the system be made before the physical one is known."""
    name = name.rstrip("_1234")  # of a term of a sum
    if name.endswith("_ratio"):
        return 2.0 if name in ("high_ratio", "stop_ratio") else 1.0
    return 0.5 if name == "location" else 0.0


def config_from_mapping(
    sections: Mapping[str, Any], source: str = "", *, complete: bool = True, folder: str | os.PathLike[str] = "."
) -> Config:
    """Check nested parameters, as a TOML file holds them.

    Parameters
    ----------
    sections : mapping of mapping
        Values by section and name.  The paper's values complete them if they contain ``extends = "paper"`` or no section
        of a system.  Sections of commands such as ``probability`` are left out.
    source : str
        Source of the values, the prefix of each error message.
    complete : bool
        True if the values must describe a system.  If False, each value is checked, but others may complete them.
    folder : path
        Folder of the files of records that are named.

    Raises
    ------
    InputError
        One line for each thing that is wrong: unknown names, wrong kinds, wrong units.
    """
    instance("source", source, str, "text")
    found, lines = checked_sections(sections, folder)
    extends = "extends" in sections or not set(found) - set(_OF_RUNS)
    config = Config(found, extends, _as_given(found, flattened(sections)))
    lines = lines or contradictions(found)
    if not lines and complete:
        try:
            config = config._with_number_of_modes()
            config.potential  # noqa: B018
            if config.model.length_scale is not None and not config.is_static:
                config.system  # noqa: B018
                config.axes()
            config.integration  # noqa: B018
        except InputError as error:
            lines = [with_section(str(error), found)]
    if lines:
        raise InputError("\n".join(f"{source}: {line}" if source else line for line in lines))
    return config


def _as_given(found: Sections, flat: Mapping[str, Any]) -> dict[str, Any]:
    """Numbers of a system that were given as text or in physical units, as they were given, by dotted name."""
    given = {}
    for section, values in found.items():
        for name, value in values.items() if section not in _OF_RUNS else ():
            raw, full = flat[section].get(name), f"{section}.{name}"
            if isinstance(value, float) and (isinstance(raw, str) or full in PHYSICAL):
                given[full] = raw
    return given


def numbers_as_given(system: System) -> dict[str, float]:
    """Numbers of a system in the units in which they were given, by dotted name, where they still are its values."""
    found, sections = {}, system.to_mapping()
    for full, raw in system.as_given.items():
        # a material, from which another parameter was computed, is no parameter
        own = sections.get(split_name(full)[0], {}).get(split_name(ratio_of(full))[1])
        if own is None:
            continue
        unit = PHYSICAL[full].unit if full in PHYSICAL else lookup(full).quantity.unit
        number = number_in_unit(raw, unit) if isinstance(raw, str) else raw
        if number is not None:
            value = number / unit_of(system, full) if full in PHYSICAL else number
            if value == own:
                found[full] = number
    return found


def sections_as_given(system: System) -> dict[str, dict[str, Any]]:
    """The sections of a system with the units in which its values were given, as far as they make the same system."""
    plain = system.to_mapping()
    if not system.as_given:
        return plain
    sections = {name: dict(values) for name, values in plain.items()}
    for full in numbers_as_given(system):
        (section, name), raw, key = split_name(full), system.as_given[full], split_name(ratio_of(full))[1]
        own = sections[section]
        sections[section] = {name if each == key else each: raw if each == key else own[each] for each in own}
    try:
        written = {name: {k: v for k, v in own.items() if v is not None} for name, own in sections.items()}
        return sections if config_from_mapping(written).system == system else plain
    except InputError:  # of a part that a parameter file does not describe so
        return plain


def override(config: Config, sections: Mapping[str, Mapping[str, Any]], source: str = "") -> Config:
    """The parameters with others laid over them; what they contradict is taken away, None is left alone.

    A value takes an axis over the same parameter away.  Values that stay keep the unit of their text.  Refusals begin with *source*.
    """
    instance("config", config, Config, "a Config")
    for name, own in mapping("sections", sections).items():
        mapping(str(name), own)
    found = config_from_mapping(_merged(config.given, sections) | config.extension, source)
    parts = {full: split_name(full) for full in config.as_given}
    same = [full for full, (part, name) in parts.items() if found.section(part).get(name) == config.section(part)[name]]
    return replace(found, as_given={**found.as_given, **{full: config.as_given[full] for full in same}})


def _merged(given: Sections, sections: Sections) -> dict[str, dict[str, Any]]:
    """Sections with others laid over them; what they contradict is taken away, None is left alone."""
    merged: dict[str, dict[str, Any]] = {name: dict(values) for name, values in given.items()}
    for section, values in sections.items():
        own = {name: value for name, value in values.items() if value is not None}
        target = merged.setdefault(section, {})
        if section == "sweep":
            for name in own:
                for same in same_axis(name):
                    target.pop(same, None)
        for one, other in [pair for both in _RIVALS.get(numbered(section)[0], []) for pair in (both, both[::-1])]:
            if one & own.keys() and not other & own.keys():
                for name in other:
                    target.pop(name, None)
        target |= own
        if section != "sweep":
            for name in own:
                for same in same_axis(f"{section}.{name}"):
                    merged.get("sweep", {}).pop(same, None)
    return merged


def same_axis(name: str) -> set[str]:
    """Dotted names of *name*, those in physical units included; empty if it is unknown."""
    try:
        full = ratio_of(lookup(name).name)
    except InputError:
        return set()
    return {full, *physical_names([full])}


# ----------------------------------------------------------------------------------------------------
# Reading and writing parameter files.


def load_config(path: str | os.PathLike[str], *, complete: bool = True) -> Config:
    """Read a parameter file; unless it must be *complete*, options may add what a system needs."""
    file = file_path("config", path)
    return config_from_mapping(read_parameter_file("config", file), file.name, complete=complete, folder=file.parent)


def read_parameter_file(name: str, path: str | os.PathLike[str]) -> dict[str, Any]:
    """Read the sections of a parameter file, over those of the file that its line ``extends = "beam.toml"`` names.

    The path is relative to the folder of the file that contains it.  A section of another type replaces that of the extended
    file.
    """
    return _extended(name, file_path(name, path), ())


def _extended(name: str, file: Path, above: tuple[Path, ...]) -> dict[str, Any]:
    sections = read_toml(name, file)
    base = sections.get("extends")
    if not isinstance(base, str) or not base.endswith(".toml"):
        return sections
    above = (*above, file.resolve())
    target = file.parent / base
    if target.resolve() in above:
        chain = ", ".join(each.name for each in above)
        raise InputError(f"extends = {shown(base)} of {file.name}: the files extend each other: {chain}")
    below = flattened(_extended(f"extends of {file.name}", target, above))
    own = flattened({section: values for section, values in sections.items() if section != "extends"})
    for values in below.values():
        if isinstance(values, dict) and isinstance(values.get("file"), str):
            values["file"] = str((target.parent / values["file"]).absolute())
    for section, values in own.items():
        other = below.get(section)
        if (
            isinstance(values, dict)
            and isinstance(other, dict)
            and values.get("type", other.get("type")) != other.get("type")
        ):
            striker = {*quantities(Striker), "label"} if numbered(section)[0] == "contact" else set()
            below[section] = {key: value for key, value in other.items() if key in striker}
    tables = {section: values for section, values in below.items() if isinstance(values, dict)}
    laid = {section: values for section, values in own.items() if isinstance(values, dict)}
    return below | own | _merged(tables, laid)


def system_of_file(path: str | os.PathLike[str]) -> System:
    """The system of a parameter file, or of a file that :meth:`~snapbeam.System.save` wrote."""
    sections = read_parameter_file("path", path)
    if _is_saved_system(sections):
        return System.from_mapping(sections)
    file = file_path("path", path)
    return config_from_mapping(sections, file.name, folder=file.parent).system


def _is_saved_system(sections: Mapping[str, Any]) -> bool:
    """Return whether the sections are only those of a system, as :meth:`~snapbeam.System.save` writes."""
    sections = flattened(sections)
    contacts = [name for name in sections if numbered(name)[0] == "contact"]
    return all(
        numbered(section)[0] in SYSTEM_SECTIONS and isinstance(values, Mapping) and not values.keys() & _CONVERTED
        and not any(_has_unit(section, *item) for item in values.items())
        for section, values in sections.items()
    ) and all("type" in sections[name] for name in contacts)  # fmt: skip


def _has_unit(section: str, name: str, value: Any) -> bool:
    """True for a number that is given as text."""
    row = row_of(f"{section}.{name}") if isinstance(value, str) else None
    return row is not None and row.quantity.kind is float


def dump_config(config: Config, path: str | os.PathLike[str], comment: str = "") -> None:
    """Write what was given to a parameter file, whole or not at all, each key with what it means.

    Parameters
    ----------
    config : Config
    path : path
        Ends in ``.toml``.
    comment : str
        Comment lines at the top.
    """
    target = check_writable(path, "path", (".toml",))
    with atomic_path(target) as temporary:
        temporary.write_text(config_text(config, comment), encoding="utf-8")


def config_text(config: Config, comment: str = "") -> str:
    """Text of a parameter file with the given values."""
    instance("config", config, Config, "a Config")
    require_texts("comment", instance("comment", comment, str, "text"))
    lines = [f"# {line}" for line in comment.splitlines()]
    if config.extends_paper and config.given and not config.is_complete:
        lines += ["# what this file leaves out is as in the paper", 'extends = "paper"']
    sections = config.to_mapping()
    if "contact.2" in sections:  # each drive in the table of its contact
        striking = {name: sections.pop(name) for name in list(sections) if numbered(name)[0] in _STRIKING}
        for name in sorted(striking, key=lambda name: (numbered(name)[1], name)):
            sections.setdefault(name.replace("drive", "contact"), {})
            sections[name] = striking[name]
    for section, values in sections.items():
        lines += [""] if lines else []
        kind = numbered(section)[0]
        if kind == "drive" and "contact.2" in sections:
            lines.append("[contact.drive]")
        else:
            lines.append(f"[[{kind}]]" if f"{kind}.2" in sections else f"[{kind}]")
        for name, value in values.items():
            row = row_of(f"{numbered(section)[0]}.{name}")
            physical = PHYSICAL.get(f"{section}.{name}")
            if row is not None:
                unit = "" if row.quantity.unit == "1" else f", {row.quantity.unit}"
                lines.append(f"# {row.quantity.long_name}{unit}")
            elif physical is not None:
                lines.append(f"# {physical.words}, {physical.unit}")
            lines.append(tomli_w.dumps({name: _plain(value)}).rstrip("\n"))
    return "\n".join(lines) + "\n"


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, (np.ndarray, np.generic)) else value
