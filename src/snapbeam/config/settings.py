"""What was given in a parameter file or on a command line: checked, completed from the paper, made into values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.config.check import checked_sections, contradictions, parsed_axis, with_section
from snapbeam.config.contact import MATERIALS, contact_of, contact_rivals, law_of
from snapbeam.config.parameters import lookup
from snapbeam.config.physical import PHYSICAL, checked_physical, physical_name, unit_of
from snapbeam.core.validate import InputError, instance, mapping
from snapbeam.model.galerkin.reduction import ReducedModel
from snapbeam.model.integration import CYCLES, Integration
from snapbeam.model.mapping import parts_from_mapping
from snapbeam.model.paper_values import BEAM, CONTACT, DAMPING_RATIO, LOCATION, MODES
from snapbeam.model.quantity import quantities
from snapbeam.model.striker.another import numbered
from snapbeam.model.system import System

__all__ = ["DEFAULT_AXES", "DEFAULT_DRIVE", "Config", "config_from_mapping", "override", "same_axis"]

_Array = NDArray[np.float64]
Sections = Mapping[str, Mapping[str, Any]]

DEFAULT_DRIVE = {"frequency_ratio": 1.21, "velocity_amplitude": 0.18}
DEFAULT_AXES = {"drive.frequency_ratio": "0.1:4:64", "drive.velocity_amplitude": "0.01:0.65:40"}
"""Of a map for which no axis is named."""
_AROUND, _STRIKING = ("base", "axial", "harvester"), ("contact", "striker", "drive")
# What stands for the same thing in a section: giving one set takes the other away.
_RIVALS: dict[str, list[tuple[set[str], set[str]]]] = {
    "beam": [({"buckling_level"}, {"axial_load"})],
    "contact": contact_rivals(),
    "drive": [({"frequency_ratio"}, {"frequency_hz"}), ({"velocity_amplitude"}, {"velocity_m_s"})],
    "striker": [({"location"}, {"location_m"})],
}


@dataclass(frozen=True)
class Config:
    """Parameters that were given, by section; the paper's stand where nothing is given.

    Attributes
    ----------
    given : mapping of str to mapping
        Checked values by section and name.
    """

    given: Sections = field(default_factory=dict)

    def section(self, name: str) -> dict[str, Any]:
        """What was given of a section."""
        return dict(self.given.get(name, {}))

    @cached_property
    def defaulted(self) -> tuple[str, ...]:
        """Names of what takes the value of the paper's beam although another beam was spoken of."""
        if not self.section("beam"):
            return ()
        found, swept = self._defaults(), self.axes() if self.section("axes") else {}
        return tuple(
            f"{section}.{name}"
            for section in ("beam", "model", "contact")
            for name in found[section]
            if name not in self.section(section) and name != "modes" and f"{section}.{name}" not in swept
        )

    def whole(self, axes: Mapping[str, Any] | None = None) -> Config:
        """Everything, what was not given too, as a file would hold it: to print, to keep, to start another file from.

        Parameters
        ----------
        axes : mapping of str to array_like, optional
            The axes by dotted name, in place of those that were given.
        """
        axes = self.axes() if axes is None and self.section("axes") else dict(axes or {})
        if self.model.length_scale is None:  # a beam that does not buckle makes no system
            sections = {name: self._defaults()[name] | self.section(name) for name in ("beam", "model")}
            sections |= {name: self.section(name) for name in ("ends", "imperfection") if self.section(name)}
        else:
            sections = {
                name: {key: value for key, value in values.items() if f"{name}.{key}" not in axes}
                for name, values in self.system.to_mapping().items()
            }
            sections.pop("start", None)
            if self.section("start"):
                sections["start"] = self.section("start")
        own = {name: getattr(self.integration, name) for name in quantities(Integration)}
        if own["cycles"] is None:
            own["cycles"] = CYCLES
        sections["run"] = {
            name: value for name, value in own.items() if value is not None and f"run.{name}" not in axes
        }
        if axes:
            whole_number = {name: lookup(name).quantity.kind is int for name in axes}
            sections["axes"] = {
                name: np.asarray(values, dtype=int if whole_number[name] else None).tolist()
                for name, values in axes.items()
            }
        return config_from_mapping(sections)

    def _defaults(self) -> dict[str, dict[str, Any]]:
        beam = {
            name: getattr(BEAM, name) for name in ("length", "thickness", "width", "density", "young_modulus")
        }
        own = self.section("beam")
        if not {"buckling_level", "axial_load"} & own.keys():
            beam["buckling_level"] = BEAM.buckling_level
        contact: dict[str, Any] = {}
        of_contact = self.section("contact")
        if (
            law_of(of_contact) in ("hertz", "hunt_crossley", "layer")
            and not {"stiffness", *MATERIALS} & of_contact.keys()
        ):
            contact = {"stiffness": CONTACT.stiffness}
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
            "striker": {} if "location_m" in self.section("striker") else {"location": LOCATION},
            "drive": drive,
        }

    @cached_property
    def system(self) -> System:
        """The system; what is not given is the paper's.  Refused (InputError) if values do not go together."""
        sections: dict[str, Any] = {
            name: values | self.section(name) for name, values in self._defaults().items()
        }
        optional = ("ends", "imperfection", *_AROUND)
        sections |= {name: self.section(name) for name in optional if self.section(name)}
        sections |= self._further
        if self._is_unstruck:
            for name in _STRIKING:
                del sections[name]
            return self._started(System.from_mapping(sections))
        sections["contact"] = contact_of(sections["contact"])
        if self._stands_still:
            sections["drive"] = {"type": "fixed"}
        sections["drive"].setdefault("type", "sine")
        later = {
            f"{section}.{name}": sections[section].pop(name)
            for section in ("drive", "striker")
            for name in [key for key in sections[section] if f"{section}.{key}" in PHYSICAL]
        }
        for physical, value in later.items():
            own = PHYSICAL[physical].parameter.partition(".")[2]
            sections[physical.partition(".")[0]].setdefault(own, _stand_in(own, value))
        system = System.from_mapping(sections)
        if later:
            system = system.replace(**{
                PHYSICAL[name].parameter: checked_physical(system, name, value, name.partition(".")[2])
                for name, value in later.items()
            })  # fmt: skip
        return self._started(system)

    @property
    def _further(self) -> dict[str, dict[str, Any]]:
        """The sections of strikers beside the first, complete."""
        found = {}
        for name in self.given:
            kind, number = numbered(name)
            if number > 1:
                found[name] = contact_of(self.section(name)) if kind == "contact" else self.section(name)
                if kind == "drive":
                    found[name].setdefault("type", "sine")
        return found

    @property
    def _is_unstruck(self) -> bool:
        """Whether a base or an axial load moves the beam, and nothing was said of a striker."""
        moved = self.section("base") or self.section("axial")
        return bool(moved) and not any(self.section(name) for name in _STRIKING)

    @property
    def _stands_still(self) -> bool:
        """Whether there is a striker beside a base or an axial load, of whose motion nothing was said."""
        return bool(self.section("base") or self.section("axial")) and not self.section("drive")

    def _started(self, system: System) -> System:
        """The system with the start that was given."""
        start = self.section("start")
        return (
            system.replace(**{f"start.{name}": value for name, value in start.items()}) if start else system
        )

    @property
    def model(self) -> ReducedModel:
        """The reduced model alone, of a beam that need not be buckled."""
        sections = {name: self._defaults()[name] | self.section(name) for name in ("beam", "model")}
        sections |= {name: self.section(name) for name in ("ends", "imperfection") if self.section(name)}
        found: ReducedModel = parts_from_mapping(sections)["model"]
        return found

    @cached_property
    def integration(self) -> Integration:
        """How runs are integrated."""
        return Integration(**self.section("run"))

    def axes(self, default: Mapping[str, str] | None = None) -> dict[str, _Array]:
        """The axes, by dotted name, those in physical units made into ratios; *default* if none is named.

        A single value makes an axis of one point.

        Raises
        ------
        InputError
            For values in physical units that are out of range.
        """
        given = self.section("axes") or dict(default or {})
        found: dict[str, Any] = {}
        for name, value in given.items():
            parsed = parsed_axis(name, value)
            if name in PHYSICAL:
                ratios = [checked_physical(self.system, name, each, name) for each in parsed.tolist()]
                found[PHYSICAL[name].parameter] = np.array(ratios)
            else:
                found[lookup(name).name] = parsed
        self._require_fixed_units(found)
        return found

    def _require_fixed_units(self, axes: Mapping[str, Any]) -> None:
        """Refuse numbers in Hz, m/s or m beside an axis that changes what they are a multiple of."""
        own = [name for name in PHYSICAL if name.partition(".")[2] in self.section(name.partition(".")[0])]
        for name in [*own, *(name for name in self.section("axes") if name in PHYSICAL)]:
            for axis, values in axes.items():
                if axis.partition(".")[0] not in ("beam", "ends", "imperfection", "model"):
                    continue
                there = [self.system.replace(**{axis: values[at].item()}) for at in (0, -1)]
                if any(abs(unit_of(each, name) / unit_of(self.system, name) - 1.0) > 1e-9 for each in there):
                    ratio = PHYSICAL[name].parameter
                    raise InputError(
                        f"{name}: is made into {ratio}, whose unit changes along {axis}; give {ratio}"
                    )

    def to_mapping(self) -> dict[str, dict[str, Any]]:
        """What was given, plain, as a file would hold it."""
        return {section: dict(values) for section, values in self.given.items() if values}


def _stand_in(name: str, value: Any) -> float:
    """A value that lets the system be made before the physical one is known."""
    return 1.0 if name == "frequency_ratio" else 0.0 if name == "velocity_amplitude" else 0.5


def config_from_mapping(sections: Mapping[str, Any], source: str = "") -> Config:
    """Check nested parameters, as a TOML file holds them.

    Parameters
    ----------
    sections : mapping of mapping
        Values by section and name.  Sections ``shaker`` and ``map``, as version 0.1 had them, are read too.
    source : str
        Where they come from, to stand before each refusal.

    Raises
    ------
    InputError
        One line for each thing that is wrong: unknown names, wrong kinds, wrong units.
    """
    instance("source", source, str, "text")
    found, lines = checked_sections(sections)
    config = Config(found)
    lines = lines or contradictions(found)
    if not lines:
        try:
            config.model  # noqa: B018
            if config.model.length_scale is not None:
                config.system  # noqa: B018
                config.axes()
            config.integration  # noqa: B018
        except InputError as error:
            lines = [with_section(str(error), found)]
    if lines:
        raise InputError("\n".join(f"{source}: {line}" if source else line for line in lines))
    return config


def override(config: Config, sections: Mapping[str, Mapping[str, Any]]) -> Config:
    """The parameters with others laid over them; what they contradict is taken away, None is left alone.

    A value takes an axis over the same parameter away.
    """
    instance("config", config, Config, "a Config")
    for name, own in mapping("sections", sections).items():
        mapping(str(name), own)
    merged: dict[str, dict[str, Any]] = {name: dict(values) for name, values in config.given.items()}
    for section, values in sections.items():
        own = {name: value for name, value in values.items() if value is not None}
        target = merged.setdefault(section, {})
        if section == "axes":
            for name in own:
                for same in same_axis(name):
                    target.pop(same, None)
        for one, other in [pair for both in _RIVALS.get(section, []) for pair in (both, both[::-1])]:
            if one & own.keys() and not other & own.keys():
                for name in other:
                    target.pop(name, None)
        target |= own
        if section != "axes":
            for name in own:
                for same in same_axis(f"{section}.{name}"):
                    merged.get("axes", {}).pop(same, None)
    return config_from_mapping(merged)


def same_axis(name: str) -> set[str]:
    """The dotted names, that in a physical unit among them, of what *name* stands for; none if it is unknown."""
    try:
        physical = physical_name(name)
        full = lookup(name).name if physical is None else PHYSICAL[physical].parameter
    except InputError:
        return set()
    return {full, *(key for key, row in PHYSICAL.items() if row.parameter == full)}
