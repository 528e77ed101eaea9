"""The one table of parameters: dotted name, unit, limits, words, default and scope of everything that can be set.

It is gathered from where the values are defined (:mod:`snapbeam.model.quantity`); parameter files, the command line,
axes of sweeps, labels of pictures and attributes of files read it here.
"""

from __future__ import annotations

import dataclasses
import difflib
import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from snapbeam.model.base_excitation import BaseExcitation
from snapbeam.model.beam import Beam
from snapbeam.model.boundary_conditions import BoundaryConditions
from snapbeam.model.contact.base import LAWS
from snapbeam.model.drive.base import DRIVES, Drive
from snapbeam.model.drive.force import FORCES
from snapbeam.model.drive.shock import GRAVITY
from snapbeam.model.external_force import ExternalForce
from snapbeam.model.harvester import HARVESTERS
from snapbeam.model.imperfection import Imperfection
from snapbeam.model.integration import Integration
from snapbeam.model.local_force import LOCAL_FORCES
from snapbeam.model.quantity import NUMBERED, RUN, ParameterField, numbered, quantities, section_of, split_name
from snapbeam.model.reduced_model import MODEL_QUANTITIES
from snapbeam.model.state import START_NAME, checked_initial_well
from snapbeam.model.striker import Striker
from snapbeam.util.validation import InputError, shown

SECTIONS = (
    "beam", "model", "boundary", "imperfection", "contact", "drive", "base_excitation", "axial_load", "force",
    "harvester", "initial_state",
)  # fmt: skip
"""Sections of a system, in their order."""


_NONE = dataclasses.MISSING
_POWER = re.compile(r"\^([\d.]+)")


@dataclass(frozen=True)
class Parameter:
    """One row of the table.

    Attributes
    ----------
    name : str
        Dotted name, ``section.name``.
    short : str
        Name of the dimension or the attribute that holds it in a dataset.
    quantity : ParameterField
        Unit, limits, words, symbol and scope.
    default : object
        Value if nothing is given; None if it follows from others, is needed or has none.
    kinds : tuple of str
        Laws of contact, or drives, that have it; empty for the other sections.
    """

    name: str
    short: str
    quantity: ParameterField
    default: Any = None
    kinds: tuple[str, ...] = ()

    @property
    def section(self) -> str:
        """Section of the parameter."""
        return numbered(split_name(self.name)[0])[0]

    @property
    def is_run(self) -> bool:
        """True if the parameter can differ between the runs of one ensemble."""
        return self.quantity.scope == RUN

    @property
    def label(self) -> str:
        """Words, symbol and unit, for an axis of a picture."""
        words = self.quantity.long_name[:1].upper() + self.quantity.long_name[1:]
        symbol = f" ${self.quantity.symbol}$" if self.quantity.symbol else ""
        raised = _POWER.sub(r"$^{\1}$", self.quantity.unit)
        unit = "" if raised == "1" else f" ({raised})"
        return f"{words}{symbol}{unit}"

    @property
    def limits(self) -> str:
        """Allowed values, as text."""
        item = self.quantity
        if item.choices:
            return " or ".join(item.choices)
        if item.kind is bool:
            return "true or false"
        if item.kind is object:
            return ""
        if math.isinf(item.low) and math.isinf(item.high):
            return "any"
        left = "[" if item.closed in ("left", "both") or item.kind is int else "("
        right = "]" if item.closed in ("right", "both") or (item.kind is int and item.high < math.inf) else ")"
        return f"{left}{item.low:g}, {item.high:g}{right}"


def _rows() -> Iterable[Parameter]:
    own: tuple[tuple[str, type], ...] = (
        ("beam", Beam),
        ("boundary", BoundaryConditions),
        ("imperfection", Imperfection),
        ("contact", Striker),
        ("integration", Integration),
    )
    for section, part in own:
        yield from _of_class(section, part)
    for row in _of_class("base_excitation", BaseExcitation):
        yield dataclasses.replace(row, short=f"base_excitation_{row.short}")
    for row in _of_class("force", ExternalForce):
        yield dataclasses.replace(row, short=f"force_{row.short}", kinds=tuple(FORCES))
    for name, (item, default) in MODEL_QUANTITIES.items():
        yield Parameter(f"model.{name}", item.short or name, item, default)
    yield Parameter("initial_state.initial_well", "initial_well", _INITIAL_WELL, None)
    for section in ("contact", "drive", *_AROUND):
        for kind_name, kind in kinds_of(section).items():
            for row in _of_class(section, kind):
                row = _around(row, kind) if section in _AROUND else row
                yield dataclasses.replace(row, kinds=(kind_name,))


_INITIAL_WELL = ParameterField("1", "well that runs begin in", kind=object, optional=True, parse=checked_initial_well)


def kind_of(section: str, name: object) -> Any:
    """Return the class that the key ``type`` of a section names, a sum of drives such as ``"sine+burst"`` too, or None."""
    if section in _OF_SUMS and isinstance(name, str) and "+" in name:
        found = _OF_SUMS[section].get(name)
        return found if found is not None and (section == "force" or found.can_excite_base()) else None
    known = kinds_of(section)
    return known[name] if isinstance(name, str) and name in known else None


def kinds_of(section: str) -> Mapping[str, Any]:
    """The classes that a section can describe, by the word that its key ``type`` has; none of a section without it."""
    if section == "base_excitation":
        return {name: kind for name, kind in DRIVES.items() if kind.can_excite_base()}
    known: dict[str, Mapping[str, Any]] = {
        "contact": LAWS,
        "drive": DRIVES,
        "axial_load": FORCES,
        "force": {**FORCES, **LOCAL_FORCES},
        "harvester": HARVESTERS,
    }
    return known.get(section, {})


_OF_SUMS: dict[str, Any] = {"base_excitation": DRIVES, "force": FORCES}
"""Drives of the sections that take only some of them, or others too."""
_AROUND = {"base_excitation": "the base", "axial_load": "the axial load", "force": "the force", "harvester": ""}
"""Sections of base, axial load, forces and harvesters, with the words that the names of their motions end with."""


def _around(row: Parameter, kind: type) -> Parameter:
    """Parameter of base, axial load or a force, with a name distinct from that of the striker."""
    section, name = split_name(row.name)
    words, plain = row.quantity.long_name, row.short.removeprefix("force_")
    if issubclass(kind, Drive):
        words, plain = f"{words}{',' * (' over ' in words)} of {_AROUND[section]}", name
    return dataclasses.replace(
        row, short=f"{section}_{plain}", quantity=dataclasses.replace(row.quantity, long_name=words)
    )


def _of_class(section: str, kind: type) -> Iterable[Parameter]:
    defaults = {item.name: item.default for item in dataclasses.fields(kind)}
    for name, item in quantities(kind).items():
        default = defaults[name]
        yield Parameter(f"{section}.{name}", item.short or name, item, None if default is _NONE else default)


_REGISTERED: tuple[Mapping[str, type], ...] = (LAWS, DRIVES, FORCES, LOCAL_FORCES, HARVESTERS)


def parameters() -> dict[str, Parameter]:
    """Every parameter by its dotted name, those of registered laws and drives included."""
    return dict(_known())


def _known() -> dict[str, Parameter]:
    """The table of :func:`parameters`, which nobody may change."""
    return _table(tuple(tuple(known.items()) for known in _REGISTERED))


@lru_cache(maxsize=4)
def _table(registered: tuple[tuple[tuple[str, type], ...], ...]) -> dict[str, Parameter]:
    """The table while what is *registered* stays as it is."""
    table: dict[str, Parameter] = {}
    for row in _rows():
        if row.name in table:
            row = dataclasses.replace(row, kinds=(*table[row.name].kinds, *row.kinds))
        table[row.name] = row
    order = (*SECTIONS, "integration")
    return dict(sorted(table.items(), key=lambda item: order.index(item[1].section)))


_OF_NUMBER = re.compile(r"(.+)_(contact|force|harvester)_([1-9][0-9]*)")
_OF_TERM = re.compile(r"(.+)_([1-4])")
_MOVED = ("drive", "base_excitation", "axial_load", "force")
"""Sections whose motion may be a sum."""


def row_of(name: str) -> Parameter | None:
    """The row of a dotted name, of a second contact or force too (``contact.2.gap``); None if there is none."""
    table, (section, field) = _known(), split_name(name)
    kind, number = numbered(section)
    row = table.get(f"{kind}.{field}")
    found = _OF_TERM.fullmatch(field)
    if row is None and found is not None and kind in _MOVED:
        row = table.get(f"{kind}.{found[1]}")
        if row is not None:
            words = f"{row.quantity.long_name}, of term {found[2]}"
            own = dataclasses.replace(row.quantity, long_name=words)
            row = dataclasses.replace(row, name=name, short=f"{row.short}_{found[2]}", quantity=own)
    if number == 1 or row is None:
        return row
    of = "contact" if kind == "drive" else kind
    words = f"{row.quantity.long_name}, of {of} {number}"
    quantity = dataclasses.replace(row.quantity, long_name=words)
    return dataclasses.replace(row, name=name, short=f"{row.short}_{of}_{number}", quantity=quantity)


def _by_short(name: str, shorts: Mapping[str, str]) -> Parameter | None:
    """The row of a further contact or force, or of a term of a sum, by the name that datasets use."""
    found = _OF_NUMBER.fullmatch(name)
    plain = name if found is None else found[1]
    term = _OF_TERM.fullmatch(plain)
    if plain in shorts:
        section, field = split_name(shorts[plain])
    elif term is not None and term[1] in shorts:
        section, field = split_name(shorts[term[1]])
        field = f"{field}_{term[2]}"
    else:
        return None
    return row_of(f"{section_of(section, 1 if found is None else int(found[3]))}.{field}")


def short_names() -> dict[str, str]:
    """Dotted names by the names that datasets use."""
    return {row.short: name for name, row in _known().items()}


def in_table(values: Mapping[str, Any]) -> dict[str, Any]:
    """Values of the parameters of the table, without those of a structure that is given by its matrices."""
    return {name: value for name, value in values.items() if row_of(name) is not None}


def lookup(name: str) -> Parameter:
    """The row of a parameter, by its dotted name or by the name that datasets use, in its physical unit too.

    ``drive.frequency_hz`` and ``frequency_hz`` are rows of their own, whose values are made into ratios.
    ``initial_state.amplitude[i]`` and ``initial_state.velocity[i]`` apply to every mode i.
    """
    if not isinstance(name, str):
        raise InputError(f"parameter {shown(name)}: must be a name, such as 'drive.frequency_ratio'")
    row = _row_in_unit(name) if name in PHYSICAL else row_of(name)
    if row is not None:
        return row
    found = START_NAME.fullmatch(name.removeprefix("initial_state."))
    if found is not None:
        of, mode = found[1], found[2]
        over = "that of the well" if of == "amplitude" else "omega_1 times the amplitude of the well"
        words = f"{of} of buckling mode {mode} at the start, over {over}"
        return Parameter(
            f"initial_state.{of}[{mode}]", f"initial_state_{of}_{mode}", ParameterField("1", words, scope=RUN)
        )
    if name in ("initial_state.striker_position", "initial_state_striker_position"):
        words = "mid-position of the striker's tip in space"
        return Parameter(
            "initial_state.striker_position", "initial_state_striker_position", ParameterField("m", words, scope=RUN)
        )
    shorts, table = short_names(), _known()
    if name in shorts:
        return table[shorts[name]]
    row = _by_short(name, shorts)
    if row is not None:
        return row
    named = [full for full in PHYSICAL if name in (split_name(full)[1], _row_in_unit(full).short)]
    if named:
        return _row_in_unit(named[0])
    tails: dict[str, list[str]] = {}
    for full in (each for each in table if split_name(each)[0] not in _AROUND):
        tails.setdefault(split_name(full)[1], []).append(full)
    if len(tails.get(name, [])) == 1:
        return table[tails[name][0]]
    close = difflib.get_close_matches(name, [*table, *shorts, *PHYSICAL], 3)
    hint = f"; did you mean {' or '.join(map(repr, close))}?" if close else f"; see {', '.join(list(table)[:6])}, ..."
    raise InputError(f"{name}: is not a parameter{hint}")


def refuse_well_axis(row: Parameter) -> None:
    """Refuse the initial well as an axis (InputError)."""
    if row.short == "initial_well":
        raise InputError("initial_well: cannot be an axis; compute one map from each well")


# ----------------------------------------------------------------------------------------------------
# Parameters in physical units: frequencies in Hz, velocities in m/s, locations in m, which are made into ratios.


@dataclass(frozen=True)
class Physical:
    """A parameter in its physical unit."""

    parameter: str
    """Dotted name of the ratio."""
    unit: str
    words: str

    def unit_of(self, length: float, omega: float) -> float:
        """Value of a normalised parameter of 1, from the length scale (m) and omega_1 (rad/s); not for a location."""
        return {
            "Hz": omega / (2.0 * math.pi),
            "m/s": length * omega,
            "um": 1e6 * length,
            "g": length * omega**2 / GRAVITY,
        }[self.unit]


_IN_UNITS = {
    "frequency_ratio": ("frequency_hz", "Hz", "frequency"),
    "start_ratio": ("start_hz", "Hz", "frequency at the start of the sweep"),
    "stop_ratio": ("stop_hz", "Hz", "frequency at the end of the sweep"),
    "low_ratio": ("low_hz", "Hz", "lower limit of the band"),
    "high_ratio": ("high_hz", "Hz", "upper limit of the band"),
    "velocity_amplitude": ("velocity_m_s", "m/s", "velocity amplitude"),
    "velocity_rms": ("velocity_rms_m_s", "m/s", "root-mean-square velocity"),
    "speed": ("speed_m_s", "m/s", "speed"),
    "displacement_amplitude": ("displacement_um", "um", "displacement amplitude"),
    "acceleration_amplitude": ("amplitude_g", "g", "acceleration amplitude"),
    "retraction": ("retraction_um", "um", "withdrawal after the burst"),
    "location": ("location_m", "m", "distance from the left end"),
}
"""Name in the physical unit, unit and words of each ratio, by its field."""


def physical_hint(name: str) -> str:
    """The words that tell which parameter takes the physical unit of a ratio; empty for another parameter."""
    found = _IN_UNITS.get(name.rpartition(".")[2])
    return f"; {found[0]} takes a value in {found[1]}" if found else ""


_OWNERS = {
    "drive": "the striker",
    "contact": "the striker",
    "base_excitation": "the base",
    "axial_load": "the axial load",
    "force": "the force",
    "harvester": "the coil",
}
_MAX_NUMBER = 9
"""Number of the last contact or force that has parameters in physical units."""


def _in_units() -> Iterable[tuple[str, Physical]]:
    for row in parameters().values():
        section, field = split_name(row.name)
        if field not in _IN_UNITS or section not in _OWNERS or row.quantity.unit != "1":
            continue
        own, unit, words = _IN_UNITS[field]
        of = f"excitation {words}" if row.name == "drive.frequency_ratio" else f"{words} of {_OWNERS[section]}"
        for number in range(1, 1 + (_MAX_NUMBER if section in NUMBERED else 1)):
            name = section_of(section, number)
            text = of if number == 1 else f"{of} {number}"
            yield f"{name}.{own}", Physical(f"{name}.{field}", unit, text)
        if section in _MOVED:  # the terms of a sum
            for term in "1234":
                yield f"{section}.{own}_{term}", Physical(f"{section}.{field}_{term}", unit, f"{of}, of term {term}")


PHYSICAL: dict[str, Physical] = dict(_in_units())
"""Physical quantities that can replace a normalised parameter, by dotted name; one unit for each."""


def ratio_of(name: str) -> str:
    """The dotted name of the ratio that a parameter in its physical unit is made into; of another the name itself."""
    return PHYSICAL[name].parameter if name in PHYSICAL else name


def _row_in_unit(name: str) -> Parameter:
    """The row of a parameter in its physical unit."""
    physical, field = PHYSICAL[name], split_name(name)[1]
    ratio = row_of(physical.parameter)
    assert ratio is not None
    item = ratio.quantity
    own = dataclasses.replace(
        item, unit=physical.unit, long_name=physical.words, symbol="", high=math.inf, plausible=None
    )
    short = ratio.short.replace(split_name(physical.parameter)[1], field)
    return dataclasses.replace(ratio, name=name, short=short, quantity=own)


def physical_names(names: Iterable[str]) -> list[str]:
    """The names of :data:`PHYSICAL` whose ratio is among *names*."""
    chosen = set(names)
    return [name for name, row in PHYSICAL.items() if row.parameter in chosen]


def named_in(name: str, sections: Mapping[str, Any]) -> str:
    """The dotted name of a parameter that is given by its last part, among the sections of one system.

    A name that several of its sections have, or none, is returned as it is: :func:`lookup` decides.
    """
    if "." in name:
        return name
    full = []
    for section, values in sections.items():
        kind = numbered(section)[0]
        row = row_of(ratio_of(f"{section}.{name}")) if kind in (*SECTIONS, "integration") else None
        typed = values.get("type") if isinstance(values, Mapping) else None
        if row is not None and (not row.kinds or typed is None or typed in row.kinds):
            full.append(f"{section}.{name}")
    return full[0] if len(full) == 1 else name
