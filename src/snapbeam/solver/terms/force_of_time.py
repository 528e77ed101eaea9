"""Forces of time along a row: F(t) accelerates the modes by F(t) r.

They depend on time alone, so that kicks stay as they are: F(t) of the kick is written into memory before it.
"""

from __future__ import annotations

from typing import NamedTuple

from snapbeam.solver.compilation import inlined
from snapbeam.solver.simd import WIDTH, broadcast_load, fma, lanes_sum, load, splat


@inlined
def absolute_product(memory, size, row, along):
    """The sum of the absolute values of the products of two rows."""
    total = 0.0
    for i in range(size):
        total += abs(memory[row + i] * memory[along + i])
    return total


class ForceOfTime(NamedTuple):
    """Places in memory, and which of several."""

    row: int
    """r, a row."""
    coefficient: int
    """F at the kick."""
    number: int = 0

    @staticmethod
    @inlined
    def add_acceleration(memory, size, term, row, k):
        """k + F r."""
        return fma(broadcast_load(memory, term.coefficient), load(memory, term.row + row), k)

    @staticmethod
    @inlined
    def kick_work(memory, size, term, weight, g, r, kick, p):
        """h F r.(p + h k / 2): in a kick, p changes linearly."""
        total, half = splat(0.0), 0.5 * weight
        for row in range(0, size, WIDTH):
            middle = fma(half, load(memory, kick + row), load(memory, p + row))
            total = fma(load(memory, term.row + row), middle, total)
        return weight * memory[term.coefficient] * lanes_sum(total)
