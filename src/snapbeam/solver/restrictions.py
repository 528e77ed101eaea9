"""Combinations of parts that the solver cannot integrate: refused with the way out before anything is computed."""

from __future__ import annotations

import os

from snapbeam.model.contact.restitution import INSTEAD_OF_RESTITUTION
from snapbeam.model.quantity import section_of
from snapbeam.model.system import System
from snapbeam.solver.statistics import updated
from snapbeam.util.diagnostics import Diagnostic, Severity, tell
from snapbeam.util.validation import InputError

_MOBILITY = (
    "{}: the mass that an impulse at a point meets falls to zero as modes are added, so that results under Newton's law belong to "
    "modes = {}"
)


def is_native(engine: str) -> bool:
    """Return whether the native core integrates: by name, or for tests by the variable SNAPBEAM_ENGINE."""
    return engine == "native" or (engine in ("auto", "cpu") and os.environ.get("SNAPBEAM_ENGINE") == "native")


def has_tangent_flow(engine: str) -> bool:
    """Return whether an engine integrates tangents; those of the others are differences between neighbouring runs."""
    return engine != "python" and not is_native(engine)


def check_integrable(system: System, engine: str = "auto") -> None:
    """Refuse a system that the solver cannot integrate, and a statistic that it cannot update.

    Raises
    ------
    InputError
    """
    used = "native" if is_native(engine) else engine
    if used in ("native", "python") and updated():
        raise InputError(
            f"statistic {updated()[0].name!r}: is updated after every step, which engine = {used!r} does not do; use engine = 'cpu', "
            "or take it out with unregister_statistic"
        )
    if system.model.damping is not None and used not in ("native", "python"):
        raise InputError(
            f"damping: a damping matrix is not integrated by engine = {engine!r}; use engine = 'native'"
        )
    contacts = system.contacts
    for number, each in enumerate(contacts, 1):
        section, law = section_of("contact", number), each.law
        missing = type(law).missing_hooks()
        if missing and used not in ("native", "python"):
            raise InputError(
                f"{section}.law = {law!r}: has no {' and no '.join(missing)}, which engine = {engine!r} needs; write them as static "
                "methods of (law, penetration): the integral of the force (J) and its derivative (N/m), or use engine = 'native'"
            )
        if law.impulsive and used == "native" and system.model.modes > 1:
            tell(
                [
                    Diagnostic(
                        "impulse-of-many-modes",
                        _MOBILITY.format(section, system.model.modes),
                        {},
                        Severity.INFO,
                    )
                ]
            )
        if law.impulsive and engine == "python":
            raise InputError(
                f"{section}.law = {law!r}: an impact of no duration is not integrated by engine = 'python'; use engine = 'cpu', or "
                f"{INSTEAD_OF_RESTITUTION}"
            )
        if law.impulsive and used != "native" and (system.model.modes > 1 or each.striker.mass is not None):
            raise InputError(
                f"{section} = {law!r} with modes = {system.model.modes}: Newton's law of several modes, and of a striker with a mass, is "
                f"integrated by engine = 'native'; use that, or one mode and a striker without mass, or {INSTEAD_OF_RESTITUTION}"
            )
        if law.impulsive and len(contacts) > 1 and used != "native":
            raise InputError(
                f"{section} = {law!r} with several strikers: sticking under Newton's law includes one tip only; use "
                f"{INSTEAD_OF_RESTITUTION}"
            )
