"""Combinations of parts that the solver cannot integrate: refused with the way out before anything is computed."""

from __future__ import annotations

from snapbeam.model.drive.combined import MOST_STRIKERS
from snapbeam.model.quantity import section_of
from snapbeam.model.system import System
from snapbeam.util.validation import InputError, shown

__all__ = ["check_integrable"]

_RECORD = "a recording has its own time axis; use a drive given by a formula, or a FixedStop"


def check_integrable(system: System) -> None:
    """Refuse a system that the solver cannot integrate.

    Raises
    ------
    InputError
    """
    contacts, surroundings = system.contacts, system.surroundings
    if sum(each.has_excitation_row for each in surroundings) > 1:
        raise InputError(
            "forces: the solver has one row of excitation, for a base excitation or one external force; leave the others "
            "out, or make a force along one row of their sum"
        )
    if len(system.harvesters) > 1:
        raise InputError(
            f"harvesters: {len(system.harvesters)} circuits; must be at most 1 in a run; leave the others out"
        )
    if len(contacts) > MOST_STRIKERS:
        raise InputError(
            f"contacts: {len(contacts)}; must be at most {MOST_STRIKERS} in a run; leave some out"
        )
    beside = "several strikers" if len(contacts) > 1 else surroundings[0].noun if surroundings else ""
    for number, each in enumerate(contacts, 1):
        section, law, striker = section_of("contact", number), each.law, each.striker
        if law.impulsive and len(contacts) > 1:
            raise InputError(
                f"{section} = {law!r} with several strikers: sticking under Newton's law includes one tip only; use a "
                "HertzContact, or a HuntCrossley with the same restitution"
            )
        if number > 1 and law.rate_dependent:
            raise InputError(
                f"{section} = {law!r}: two forces that depend on the velocity have no exact kick together; of several "
                "contacts the first alone may lose energy, the others take a HertzContact or a PowerLaw"
            )
        if number > 1 and striker.mass is not None:
            raise InputError(
                f"{section}.mass = {striker.mass:g}: of several strikers the first alone may be a body, since the "
                "reduced structure contains one body; leave the mass out, or make this one the first"
            )
        if striker.drive.samples().size and (len(contacts) > 1 or len(system.moving) > 1):
            raise InputError(
                f"{section_of('drive', number)} = {striker.drive.name!r} with {beside}: {_RECORD}"
            )
    rate_dependent = [
        f"{section_of('contact', number)} = {shown(each.law)}"
        for number, each in enumerate(contacts, 1)
        if each.law.rate_dependent
    ]
    several = [*rate_dependent, *(shown(each) for each in surroundings if each.rate_dependent)]
    if len(several) > 1:
        raise InputError(
            f"{' with '.join(several)}: the solver has one velocity-dependent force; leave the others out, or let "
            "damping_ratio stand for the loss"
        )
