"""What surrounds a beam, held against the rest of a system: mixtures that are refused, with the way out."""

from __future__ import annotations

from typing import Any

from snapbeam.core.validate import InputError, InputTypeError, shown
from snapbeam.model.drive import RecordedMotion
from snapbeam.model.world.base import BaseExcitation, rigid_mass
from snapbeam.model.world.harvester import Harvester
from snapbeam.model.world.load import AxialLoadModulation

__all__ = ["check_world"]

_A = {
    "base": "a Base(motion=AccelerationSine(...))",
    "axial": "an AxialLoadModulation(motion=HarmonicLoad(...))",
    "harvester": "a Piezo(...) or a Coil(...)",
}


def check_world(system: Any) -> None:
    """Refuse surroundings that are none, or that do not go with the rest of a :class:`~snapbeam.System`."""
    base, load, harvester = system.base_excitation, system.axial_load, system.harvester
    for name, part, kind in (
        ("base", base, BaseExcitation),
        ("axial", load, AxialLoadModulation),
        ("harvester", harvester, Harvester),
    ):
        if part is not None and not isinstance(part, kind):
            raise InputTypeError(f"{name} = {shown(part)}: must be {_A[name]}")
    if base is not None:
        rigid_mass(system.model)
    if harvester is not None:
        harvester.row(system.model)
    if base is None and load is None and harvester is None:
        return
    words = "a harvester" if harvester is not None else "a changing axial load"
    words = "a moving base" if base is not None else words
    contact, striker = system.contact, system.striker
    if contact is not None and contact.impulsive:
        raise InputError(
            f"contact = {contact!r} with {words}: the carried phase of Newton's law knows the tip's force alone; use a "
            "HertzContact, or a HuntCrossley with the same restitution"
        )
    if contact is not None and contact.rate_dependent and harvester is not None:
        raise InputError(
            f"contact = {shown(contact)} with a harvester: two things that depend on the velocity at once; use a "
            "HertzContact or a PowerLaw, and let damping_ratio stand for the loss"
        )
    if (
        striker is not None
        and isinstance(striker.drive, RecordedMotion)
        and (base is not None or load is not None)
    ):
        raise InputError(
            f"drive = 'recorded' with {words}: a record has a clock of its own; drive the striker by a formula, or let "
            "it stand still"
        )
    if load is not None and system.model.beam is None:
        raise InputError(
            "axial: changes the axial load of a beam; a structure given by matrices has its load in its stiffness"
        )
