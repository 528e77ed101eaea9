"""Base excitation: in the frame of the ends, an acceleration a(t) of the base accelerates the modes by a(t) b.

With phi the assumed modes and V the linear modes, b = -V^T (integral of rho A phi dx), one number for each mode
(``structure.base_load``).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba.extending import overload

from snapbeam.solver.compilation import INLINE, inlined
from snapbeam.solver.excitation import part_acceleration
from snapbeam.solver.simd import WIDTH
from snapbeam.solver.terms.force_of_time import ForceOfTime, absolute_product
from snapbeam.solver.terms.interface import TermMemory


def _acceleration(drive: Any, memory: Any, argument: float) -> float:
    """Acceleration of the base in space, m/s^2, positive upwards."""
    raise TypeError("_acceleration runs in compiled code only")


@overload(_acceleration, jit_options=INLINE)
def _acceleration_of_kind(drive, memory, argument):
    own = part_acceleration(drive.instance_class.owner, "base")
    return lambda drive, memory, argument: drive.base_sign * own(drive, memory, argument)


class BaseExcitationTerm(ForceOfTime):
    """The base: its acceleration a, m/s^2, and the row b."""

    __slots__ = ()

    @staticmethod
    def build(structure: Any, drive: Any, size: int, padded: Any) -> list[TermMemory]:
        """Build the term if the motions include that of the base."""
        if not any(part == "base" for part, _ in drive.parts):
            return []
        return [TermMemory({"row": padded(structure.base_load)}, {"coefficient": np.zeros(WIDTH)}, {})]

    @staticmethod
    @inlined
    def update_forces(memory, size, term, drive, argument, q):
        """Write a(t) into memory."""
        memory[term.coefficient] = _acceleration(drive, memory, argument)

    @staticmethod
    @inlined
    def add_to_speed_bound(memory, size, term, drive, omega, along, q, p, speed, horizon, bound):
        """Within a time tau the base changes c.p by no more than tau max|a| sum |b_j c_j|."""
        return bound + absolute_product(memory, size, term.row, along) * drive.base_hardest * horizon

    accumulator = "base_work"
    work_description = "work done by the base, in its frame"
