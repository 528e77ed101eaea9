"""Strikers beside the first one: several strike one beam, each with its own place, side, law and drive."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from snapbeam.core.validate import InputError, InputTypeError, shown
from snapbeam.model.contact import ContactLaw
from snapbeam.model.drive import RecordedMotion
from snapbeam.model.drive.joined import MOST_STRIKERS
from snapbeam.model.striker.shaker import Shaker
from snapbeam.model.striker.striker import Striker

__all__ = ["ContactPair", "check_others", "numbered", "parted"]

_NUMBERED = re.compile(r"(striker|drive|contact)_([2-9])")


@dataclass(frozen=True)
class ContactPair:
    """A striker beside the first one, and the law by which it touches.

    Parameters
    ----------
    striker : Striker
        Without a gap its tip touches the beam at rest in the well that the first striker pushes away from.
    contact : ContactLaw
    """

    striker: Striker
    contact: ContactLaw


def numbered(section: str) -> tuple[str, int]:
    """The kind of a section and the number of its striker: ``drive_2`` is the drive of the second; 1 of any other."""
    found = _NUMBERED.fullmatch(section)
    return (section, 1) if found is None else (found[1], int(found[2]))


def parted(striker: Any, contact: Any, others: tuple[ContactPair, ...]) -> dict[str, Any]:
    """The first striker and its law, and the others with theirs, of a sequence of strikers.

    Raises
    ------
    InputError
        For laws that are neither one for all nor one each, and for a sequence beside *others*.
    """
    if not isinstance(striker, (list, tuple)) or not striker:
        raise InputError(
            f"contact = {shown(contact)}: laws in a sequence belong to strikers in a sequence, one each"
        )
    if others:
        raise InputError("others: the sequence striker = [...] says all of them; leave others out")
    laws: Sequence[Any] = contact if isinstance(contact, (list, tuple)) else [contact] * len(striker)
    if len(laws) != len(striker):
        raise InputError(
            f"contact: {len(laws)} laws for {len(striker)} strikers; give one law for all, or one each"
        )
    made = [each.striker() if isinstance(each, Shaker) else each for each in striker]
    rest = tuple(ContactPair(*pair) for pair in zip(made[1:], laws[1:], strict=True))
    return {"striker": made[0], "contact": laws[0], "others": rest}


def check_others(system: Any) -> None:
    """Refuse strikers beside the first that are none, or that do not go with the rest of a system."""
    others = system.further_contacts
    if not isinstance(others, tuple) or not all(isinstance(each, ContactPair) for each in others):
        raise InputTypeError(f"others = {shown(others)}: must be a tuple of Another; or give striker = [...]")
    if not others:
        return
    if system.striker is None:
        raise InputError("others: strikers beside a first one; give striker = [...]")
    if len(others) >= MOST_STRIKERS:
        raise InputError(f"striker: {len(others) + 1} strikers; must be at most {MOST_STRIKERS}")
    if system.contact is not None and system.contact.impulsive:
        raise InputError(
            f"contact = {system.contact!r} with several strikers: Newton's law knows one wall; use a HertzContact, or "
            "a HuntCrossley of the same restitution for the first striker"
        )
    if isinstance(system.striker.drive, RecordedMotion):
        raise InputError(
            "drive = 'recorded' with several strikers: a record has a clock of its own; drive them by formulas"
        )
    for number, each in enumerate(others, 2):
        _check_one(number, each)


def _check_one(number: int, another: ContactPair) -> None:
    striker, contact = another.striker, another.contact
    if not isinstance(striker, Striker):
        raise InputTypeError(f"striker {number} = {shown(striker)}: must be a Striker or a Shaker")
    if not isinstance(contact, ContactLaw):
        raise InputTypeError(
            f"contact {number} = {shown(contact)}: must be a law of contact, such as HertzContact(stiffness)"
        )
    if contact.impulsive or contact.rate_dependent:
        raise InputError(
            f"contact_{number} = {contact!r}: two forces that depend on the velocity have no exact kick together; of "
            "several strikers the first alone may lose energy, the others take a HertzContact or a PowerLaw"
        )
    if striker.mass is not None:
        raise InputError(
            f"striker_{number}.mass = {striker.mass:g}: of several strikers the first alone may be a body; leave the "
            "mass out, or make this one the first"
        )
    if isinstance(striker.drive, RecordedMotion):
        raise InputError(
            f"drive_{number} = 'recorded': a record has a clock of its own; drive it by a formula, or let it be still"
        )
