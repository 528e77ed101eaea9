"""Base excitation: in the frame of the ends, an acceleration a(t) of the base accelerates the modes by a(t) b.

With phi the assumed modes and V the linear modes, b = -V^T (integral of rho A phi dx), one number for each mode
(``structure.base_load``).  The acceleration depends on time alone, so that kicks stay as they are: a(t) of the kick is
written into memory before it.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba.extending import overload

from snapbeam.solver.compilation import INLINE, inlined
from snapbeam.solver.excitation import part_acceleration
from snapbeam.solver.simd import WIDTH, broadcast_load, fma, lanes_sum, load, splat
from snapbeam.solver.terms.interface import TermMemory

__all__ = ["BaseExcitation", "absolute_product"]


def _acceleration(drive: Any, memory: Any, argument: float) -> float:
    """Acceleration of the base in space, m/s^2, positive upwards."""
    raise TypeError("_acceleration runs in compiled code only")


@overload(_acceleration, jit_options=INLINE)
def _acceleration_of_kind(drive, memory, argument):
    own = part_acceleration(drive.instance_class.owner, "base")
    return lambda drive, memory, argument: drive.base_sign * own(drive, memory, argument)


@inlined
def absolute_product(memory, size, row, along):
    """The sum of the sizes of the products of two rows."""
    total = 0.0
    for i in range(size):
        total += abs(memory[row + i] * memory[along + i])
    return total


class BaseExcitation(NamedTuple):
    """Places in memory, and which of several."""

    row: int
    """b, a row."""
    acceleration: int
    """a at the kick, m/s^2."""
    number: int = 0
    """0: there is one base."""

    @staticmethod
    def build(structure: Any, drive: Any, size: int, padded: Any) -> list[TermMemory]:
        """Of a drive whose motions include the base's."""
        if not any(part == "base" for part, _ in drive.parts):
            return []
        return [TermMemory({"row": padded(structure.base_load)}, {"acceleration": np.zeros(WIDTH)}, {})]

    @staticmethod
    @inlined
    def update_forces(memory, size, term, drive, argument, q):
        """Write a(t) into memory."""
        memory[term.acceleration] = _acceleration(drive, memory, argument)

    @staticmethod
    @inlined
    def add_acceleration(memory, size, term, row, k):
        """k + a b."""
        return fma(broadcast_load(memory, term.acceleration), load(memory, term.row + row), k)

    @staticmethod
    @inlined
    def add_acceleration_along(memory, size, term, contact, along):
        """c.k + a c.b."""
        total = splat(0.0)
        for row in range(0, size, WIDTH):
            total = fma(load(memory, term.row + row), load(memory, contact + row), total)
        return along + memory[term.acceleration] * lanes_sum(total)

    @staticmethod
    @inlined
    def add_to_speed_bound(memory, size, term, drive, along, q, p, energy, horizon, bound):
        """Within a time tau the base changes c.p by no more than tau max|a| sum |b_j c_j|."""
        return bound + absolute_product(memory, size, term.row, along) * drive.base_hardest * horizon

    accumulator = "base_work"  # type: ignore[misc]
    work_description = "work done by the base, in its frame"  # type: ignore[misc]

    @staticmethod
    @inlined
    def kick_work(memory, size, term, weight, g, r, kick, p):
        """h a b.(p + h k / 2): in a kick, p changes linearly."""
        total, half = splat(0.0), 0.5 * weight
        for row in range(0, size, WIDTH):
            middle = fma(half, load(memory, kick + row), load(memory, p + row))
            total = fma(load(memory, term.row + row), middle, total)
        return weight * memory[term.acceleration] * lanes_sum(total)
