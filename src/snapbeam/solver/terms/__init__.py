"""Forces and couplings beside linear modes and tension: one file each.

:mod:`~snapbeam.solver.terms.interface` says what a term can provide.  This file alone lists them.
"""

from __future__ import annotations

from typing import Any

from snapbeam.solver.terms.axial_load import AxialLoad
from snapbeam.solver.terms.base_excitation import BaseExcitationTerm
from snapbeam.solver.terms.circuit import Circuit, ResistiveCircuit
from snapbeam.solver.terms.external_force import ExternalForceTerm
from snapbeam.solver.terms.local_force import DampedLocalForceTerm, LocalForceTerm
from snapbeam.solver.terms.second_well import SecondWell

__all__ = ["TERMS_AFTER_CONTACTS", "TERMS_BEFORE_CONTACTS", "WORKS"]


TERMS_BEFORE_CONTACTS: tuple[Any, ...] = (SecondWell,)
"""Terms whose accelerations are added before those of the further contacts: sums keep their order, and so their bits."""
TERMS_AFTER_CONTACTS: tuple[Any, ...] = (
    BaseExcitationTerm,
    ExternalForceTerm,
    AxialLoad,
    LocalForceTerm,
    DampedLocalForceTerm,
    Circuit,
    ResistiveCircuit,
)

WORKS: dict[str, str] = {
    term.accumulator: term.work_description
    for term in (*TERMS_BEFORE_CONTACTS, *TERMS_AFTER_CONTACTS)
    if hasattr(term, "kick_work")
}
"""Statistics that take the works of terms, and what they are."""
