"""Checks of the system and the integration that a run is requested with."""

from __future__ import annotations

from typing import Any

import numpy as np

from snapbeam.model.drive.sine import Sine
from snapbeam.model.integration import Integration
from snapbeam.model.system import System
from snapbeam.util.validation import InputError, instance, or_default


def checked_request(system: Any, integration: Any) -> tuple[System, Integration]:
    """Check a system and an integration, None for the default settings."""
    instance("system", system, System, "a System")
    integration = or_default("integration", integration, Integration, "an Integration")
    require_motion(system)
    return system, integration


def require_motion(system: System, started: bool = False) -> None:
    """Refuse a system without excitation, force and initial state; *started* by a sweep that gives one."""
    parts = (system.contacts, system.moving, system.forces)
    if not started and system.initial_state is None and not any(parts):
        raise InputError("contacts = []: without a striker the beam needs an initial_state; give one, or a contact")


def cycle_of(system: System) -> float:
    """Return the period of the excitation in seconds; without an excitation, that of the first mode."""
    freq = system.model.reference_frequency
    if system.primary_excitation is None:
        return 1.0 / freq
    drive = system.primary_excitation[1]
    if isinstance(drive, Sine):
        return 1.0 / (freq * drive.frequency_ratio)
    columns = {name: np.array([value]) for name, value in drive.values().items()} or {"": np.zeros(1)}
    return float(drive.cycle(columns, system.scale)[0])
