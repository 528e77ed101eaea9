"""Frequencies in Hz, velocities in m/s and places in m, where a person thinks so: made into ratios at the door."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from numpy.typing import ArrayLike

from snapbeam.config.parameters import lookup
from snapbeam.core.validate import InputError, choice, finite_array, instance
from snapbeam.model.system import System

__all__ = [
    "PHYSICAL",
    "Physical",
    "checked_physical",
    "from_physical",
    "physical_name",
    "to_physical",
    "unit_of",
]


@dataclass(frozen=True)
class Physical:
    """A parameter in its physical unit."""

    parameter: str
    """Dotted name of the ratio."""
    unit: str
    words: str


PHYSICAL: dict[str, Physical] = {
    "drive.frequency_hz": Physical("drive.frequency_ratio", "Hz", "excitation frequency"),
    "drive.velocity_m_s": Physical("drive.velocity_amplitude", "m/s", "velocity amplitude of the striker"),
    "striker.location_m": Physical("striker.location", "m", "distance of the striker from the left clamp"),
}
"""What may be given instead of a ratio, by dotted name."""


def physical_name(name: str) -> str | None:
    """The dotted name of a parameter in its physical unit, by itself or by its last part; None if it is none."""
    instance("name", name, str, "text")
    found = [full for full in PHYSICAL if name in (full, full.partition(".")[2])]
    return found[0] if found else None


def unit_of(system: System, name: str) -> float:
    """What a ratio of 1 is in the physical unit of *name*."""
    scale, parameter = system.scale, PHYSICAL[name].parameter
    if parameter == "drive.frequency_ratio":
        return scale.omega / (2.0 * math.pi)
    if parameter == "drive.velocity_amplitude":
        return scale.length * scale.omega
    if system.model.beam is None:
        raise InputError("striker.location_m: a structure given by matrices has no length; give location")
    return system.model.beam.length


def _unit(system: System, name: str) -> float:
    instance("system", system, System, "a System")
    return unit_of(system, choice("name", name, tuple(PHYSICAL)))


def from_physical(system: System, name: str, value: ArrayLike) -> Any:
    """Ratios from values in the physical unit of *name*."""
    unit = _unit(system, name)
    return finite_array(name, value) / unit


def checked_physical(system: System, name: str, value: float, shown: str) -> float:
    """The ratio that a value in the physical unit of *name* is, refused, with the name *shown*, where it cannot be.

    Raises
    ------
    InputError
        If the ratio is out of its range; the message says both.
    """
    ratio, row = float(from_physical(system, name, value)), lookup(PHYSICAL[name].parameter)
    short = row.name.partition(".")[2]
    try:
        row.quantity.check(short, ratio)
    except InputError as error:
        must = str(error).partition(": ")[2]
        unit = PHYSICAL[name].unit
        raise InputError(f"{shown} = {value:g} {unit}: is {short} = {ratio:.6g}, which {must}") from None
    return ratio


def to_physical(system: System, name: str, value: ArrayLike) -> Any:
    """Values in the physical unit of *name* from ratios."""
    unit = _unit(system, name)
    return finite_array(name, value) * unit
