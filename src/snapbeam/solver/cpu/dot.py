"""The scalar product of two rows."""

from __future__ import annotations

from snapbeam.solver.compilation import inlined
from snapbeam.solver.simd import WIDTH, fma, lanes_sum, load, splat

__all__ = ["dot"]


@inlined
def dot(memory, size, a, b):
    """a.b over a row."""
    total = splat(0.0)
    for row in range(0, size, WIDTH):
        total = fma(load(memory, a + row), load(memory, b + row), total)
    return lanes_sum(total)
