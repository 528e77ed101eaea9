"""Axial load: a change P(t) of the load beyond the one that the beam was reduced under adds P(t) (g + G q).

That is P more of both coefficients of the tension's acceleration.  It depends on position and time alone, so that kicks
stay as they are: P(t) of the kick is written into memory before it.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba.extending import overload

from snapbeam.solver.compilation import INLINE, inlined
from snapbeam.solver.excitation import part_motion
from snapbeam.solver.simd import WIDTH, fma, lanes_sum, load, splat
from snapbeam.solver.terms.interface import TermMemory


def _change(drive: Any, memory: Any, argument: float) -> float:
    """Axial load beyond the one that the beam was reduced under, N."""
    raise TypeError("_change runs in compiled code only")


@overload(_change, jit_options=INLINE)
def _change_of_kind(drive, memory, argument):
    own = part_motion(drive.instance_class.owner, "load")
    return lambda drive, memory, argument: own(drive, memory, argument)[0]


class AxialLoad(NamedTuple):
    """Place in memory."""

    change: int
    """P at the kick, N."""

    @staticmethod
    def build(structure: Any, drive: Any, size: int, padded: Any) -> list[TermMemory]:
        """Build the term if the motions include that of the axial load."""
        if not any(part == "load" for part, _ in drive.parts):
            return []
        return [TermMemory({}, {"change": np.zeros(WIDTH)}, {})]

    @staticmethod
    @inlined
    def update_forces(memory, size, term, drive, argument, q):
        """Write P(t) into memory."""
        memory[term.change] = _change(drive, memory, argument)

    @staticmethod
    @inlined
    def add_to_tension(memory, term, along_g, along_r):
        """P more along g and along G q."""
        change = memory[term.change]
        return along_g + change, along_r + change

    accumulator = "load_work"  # type: ignore[misc]
    work_description = "work done by the change of the axial load"  # type: ignore[misc]
    needs_tension_product = True  # type: ignore[misc]
    may_hide_onset = True  # type: ignore[misc]

    @staticmethod
    @inlined
    def kick_work(memory, size, term, weight, g, r, kick, p):
        """h P (g + G q).(p + h k / 2): in a kick, p changes linearly."""
        total, half = splat(0.0), 0.5 * weight
        for row in range(0, size, WIDTH):
            middle = fma(half, load(memory, kick + row), load(memory, p + row))
            total = fma(load(memory, g + row) + load(memory, r + row), middle, total)
        return weight * memory[term.change] * lanes_sum(total)
