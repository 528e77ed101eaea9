"""Unequal wells: a constant force about the second well, and the energies that belong to it.

With B the side force and a the first well, -a is the origin of q on the far side.  There the same linear modes and the
same tension hold exactly, and the force 2 V^T B is left over.  The second well itself is near that origin
(``structure.py: UnequalWells`` computes the numbers).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from snapbeam.solver.compilation import inlined
from snapbeam.solver.simd import WIDTH, fma, lanes_sum, load, splat, store
from snapbeam.solver.terms.interface import TermMemory


class SecondWell(NamedTuple):
    """Places in memory and numbers of unequal wells."""

    force: int
    """2 V^T B, a row."""
    second: int
    """The second well about the origin on the far side, a row."""
    present: int
    """The force about the present origin, a row: zeros in the first well; after it the energy of that origin."""
    lift: float
    """Energy of the origin on the far side above the first well, J."""
    depth: float
    """Energy of the second well above the first, J."""
    level: float
    """Displacement of the centre that divides the wells, m."""

    @staticmethod
    def build(structure: Any, drive: Any, size: int, padded: Any) -> list[TermMemory]:
        """Build the term if the wells are not mirror images."""
        wells = structure.unequal_wells
        if wells is None:
            return []
        return [
            TermMemory(
                {"force": padded(wells.force), "second": padded(wells.second)},
                {"present": np.zeros(size + WIDTH)},
                {"lift": wells.lift, "depth": wells.depth, "level": wells.level},
            )
        ]

    @staticmethod
    @inlined
    def enter_well(memory, size, term, well_sign):
        """Write the force about the origin of q, and the energy of that origin."""
        far = 1.0 if well_sign < 0.0 else 0.0
        for row in range(0, size, WIDTH):
            store(memory, term.present + row, far * load(memory, term.force + row))
        memory[term.present + size] = far * term.lift

    @staticmethod
    @inlined
    def add_acceleration(memory, size, term, row, k):
        """The acceleration is the force: modal masses are 1."""
        return k + load(memory, term.present + row)

    @staticmethod
    @inlined
    def add_potential_energy(memory, size, term, q, energy):
        """The energy of the origin, less force times displacement."""
        total = splat(0.0)
        for row in range(0, size, WIDTH):
            total = fma(load(memory, term.present + row), load(memory, q + row), total)
        return energy + (memory[term.present + size] - lanes_sum(total))

    @staticmethod
    @inlined
    def relative_to_nearest_well(memory, size, term, well_sign, spare, q):
        """q less the second well."""
        if well_sign > 0.0:
            return q
        for row in range(0, size, WIDTH):
            store(memory, spare + row, load(memory, q + row) - load(memory, term.second + row))
        return spare

    @staticmethod
    @inlined
    def acceleration_about_nearest_well(memory, term, omega_squared, q, near, row, k):
        """k + omega^2 (near - q)."""
        shift = load(memory, near + row) - load(memory, q + row)
        return fma(load(memory, omega_squared + row), shift, k)

    @staticmethod
    @inlined
    def center_from_barrier(term, center):
        """The wells are divided at a level."""
        return center - term.level

    @staticmethod
    @inlined
    def has_crossed(term, center, well_sign, crossed):
        """Past the level, by the sign of the well: rests of both wells may lie on one side of 0."""
        return (center - term.level) * well_sign > 0.0
