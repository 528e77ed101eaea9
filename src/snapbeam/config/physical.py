"""Frequencies in Hz, velocities in m/s and places in m, where a person thinks so: made into ratios at the door."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from snapbeam.core.validate import InputError
from snapbeam.model.system import System

__all__ = ["PHYSICAL", "Physical", "from_physical", "to_physical"]


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


def _unit_of(system: System, parameter: str) -> float:
    """What one of a ratio is, SI."""
    scale = system.scale
    if parameter == "drive.frequency_ratio":
        return scale.omega / (2.0 * math.pi)
    if parameter == "drive.velocity_amplitude":
        return scale.length * scale.omega
    if system.model.beam is None:
        raise InputError("striker.location_m: a structure given by matrices has no length; give location")
    return system.model.beam.length


def from_physical(system: System, name: str, value: ArrayLike) -> Any:
    """Ratios from values in the physical unit of *name*."""
    return np.asarray(value, dtype=np.float64) / _unit_of(system, PHYSICAL[name].parameter)


def to_physical(system: System, name: str, value: ArrayLike) -> Any:
    """Values in the physical unit of *name* from ratios."""
    return np.asarray(value, dtype=np.float64) * _unit_of(system, PHYSICAL[name].parameter)
