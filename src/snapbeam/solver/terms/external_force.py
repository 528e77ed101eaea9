"""External force: F(t) along a row h accelerates the modes by F(t) V^T h (``structure.force_rows``)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba.extending import overload

from snapbeam.solver.compilation import INLINE, inlined
from snapbeam.solver.excitation import acceleration_by_number, bound_by_number
from snapbeam.solver.simd import WIDTH
from snapbeam.solver.terms.force_of_time import ForceOfTime, absolute_product
from snapbeam.solver.terms.interface import TermMemory


def _force(drive: Any, memory: Any, argument: float, number: int) -> float:
    """External force of a number, N."""
    raise TypeError("_force runs in compiled code only")


@overload(_force, jit_options=INLINE)
def _force_of_kind(drive, memory, argument, number):
    own = acceleration_by_number(drive.instance_class.owner, "force")
    return lambda drive, memory, argument, number: own(drive, memory, argument, number)


def _greatest_force(drive: Any, memory: Any, number: int) -> float:
    """Bound on the external force of a number, N."""
    raise TypeError("_greatest_force runs in compiled code only")


@overload(_greatest_force, jit_options=INLINE)
def _greatest_force_of_kind(drive, memory, number):
    own = bound_by_number(drive.instance_class.owner, "force")
    return lambda drive, memory, number: own(drive, memory, 0.0, number)


class ExternalForceTerm(ForceOfTime):
    """A force F, N, along the row V^T h."""

    __slots__ = ()

    @staticmethod
    def build(structure: Any, drive: Any, size: int, padded: Any) -> list[TermMemory]:
        """Build a term for every external force, in their order."""
        return [
            TermMemory({"row": padded(row)}, {"coefficient": np.zeros(WIDTH)}, {"number": i})
            for i, row in enumerate(structure.force_rows)
        ]

    @staticmethod
    @inlined
    def update_forces(memory, size, term, drive, argument, q):
        """Write F(t) into memory."""
        memory[term.coefficient] = _force(drive, memory, argument, term.number)

    @staticmethod
    @inlined
    def add_to_speed_bound(memory, size, term, drive, omega, along, q, p, speed, horizon, bound):
        """Add to the speed bound as for a base, with max|F|."""
        greatest = _greatest_force(drive, memory, term.number)
        return bound + absolute_product(memory, size, term.row, along) * greatest * horizon

    accumulator = "force_work"
    work_description = "work done by external forces"
