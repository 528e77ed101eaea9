"""Combinations of parts that the solver cannot integrate: refused with the way out before anything is computed."""

from __future__ import annotations

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


def check_integrable(system: System, engine: str = "auto") -> None:
    """Refuse a system that the solver cannot integrate, and a statistic that it cannot update.

    Raises
    ------
    InputError
    """
    if engine in ("python", "cuda") and updated():
        raise InputError(
            f"statistic {updated()[0].name!r}: is updated after every step, which engine = {engine!r} does not do; use engine = 'native', "
            "or take it out with unregister_statistic"
        )
    if engine == "cuda":
        from snapbeam.solver.channels import LAWS

        for each in (*(contact.law for contact in system.contacts), *system.local_forces):
            if type(each) not in LAWS:
                raise InputError(
                    f"{type(each).__name__}: a law of one's own is a function of this computer, which a GPU does not call; use "
                    "engine = 'native'"
                )
    for number, each in enumerate(system.contacts, 1):
        section, law = section_of("contact", number), each.law
        if not law.impulsive:
            continue
        if engine == "python":
            raise InputError(
                f"{section}.law = {law!r}: an impact of no duration is not integrated by engine = 'python'; use engine = 'native', or "
                f"{INSTEAD_OF_RESTITUTION}"
            )
        if system.model.modes > 1:
            words = _MOBILITY.format(section, system.model.modes)
            tell([Diagnostic("impulse-of-many-modes", words, {}, Severity.INFO)])
