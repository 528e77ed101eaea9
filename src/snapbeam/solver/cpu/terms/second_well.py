"""Unequal wells: a constant force about the second well, and the energies that belong to it.

*unequal_wells* is an :class:`UnequalWells` or None, by type: of a beam with equal wells nothing of this is compiled.
"""

from __future__ import annotations

from typing import NamedTuple

from snapbeam.solver.compilation import inlined
from snapbeam.solver.simd import WIDTH, fma, lanes_sum, load, splat, store
from snapbeam.solver.step_control import ContactKinematics

__all__ = [
    "UnequalWells",
    "about_level",
    "above_own_well",
    "add_potential_energy",
    "add_static_load",
    "at_center",
    "has_crossed_to_other_well",
    "pushed_along",
    "put",
    "relative_to_nearest_well",
    "towards_well",
]


class UnequalWells(NamedTuple):
    """Where in memory the numbers of unequal wells are; see :class:`snapbeam.solver.structure.UnequalWells`."""

    force: int
    """The force on the far side, a row of the structure."""
    second: int
    """The second well about the origin there."""
    here: int
    """The force at hand: zeros on this side."""
    lift: float
    depth: float
    level: float


@inlined
def add_static_load(memory, unequal_wells, row, k):
    """An acceleration with the force at hand."""
    if unequal_wells is None:
        return k
    return k + load(memory, unequal_wells.here + row)


@inlined
def pushed_along(memory, size, unequal_wells, contact, along):
    """The same along the contact's row."""
    if unequal_wells is None:
        return along
    total = splat(0.0)
    for row in range(0, size, WIDTH):
        total = fma(load(memory, unequal_wells.here + row), load(memory, contact + row), total)
    return along + lanes_sum(total)


@inlined
def put(memory, size, unequal_wells, well_sign):
    """The force at hand, for the origin of q."""
    if unequal_wells is None:
        return
    far = 1.0 if well_sign < 0.0 else 0.0
    for row in range(0, size, WIDTH):
        store(memory, unequal_wells.here + row, far * load(memory, unequal_wells.force + row))
    memory[unequal_wells.here + size] = far * unequal_wells.lift


@inlined
def add_potential_energy(memory, size, unequal_wells, q, energy):
    """The energy above the first well, of that which linear modes and tension have about the origin at hand."""
    if unequal_wells is None:
        return energy
    total = splat(0.0)
    for row in range(0, size, WIDTH):
        total = fma(load(memory, unequal_wells.here + row), load(memory, q + row), total)
    return energy + (memory[unequal_wells.here + size] - lanes_sum(total))


@inlined
def above_own_well(unequal_wells, well_sign, energy):
    """The energy above the well that the beam is near."""
    if unequal_wells is None:
        return energy
    return energy - unequal_wells.depth if well_sign < 0.0 else energy


@inlined
def relative_to_nearest_well(memory, size, unequal_wells, well_sign, q, spare):
    """Where q is measured from the well that the beam is near: *q* itself, or *spare*."""
    if unequal_wells is None:
        return q
    if well_sign > 0.0:
        return q
    for row in range(0, size, WIDTH):
        store(memory, spare + row, load(memory, q + row) - load(memory, unequal_wells.second + row))
    return spare


@inlined
def towards_well(memory, unequal_wells, omega_squared, q, near, row, k):
    """An acceleration that belongs to *q*, for the energy of *near*: with the linear force of the difference."""
    if unequal_wells is None:
        return k
    shift = load(memory, near + row) - load(memory, q + row)
    return fma(load(memory, omega_squared + row), shift, k)


@inlined
def about_level(unequal_wells, seen):
    """What is seen, the centre from the height that divides the wells."""
    if unequal_wells is None:
        return seen
    return ContactKinematics(seen.w, seen.wv, seen.d, seen.dv, seen.c - unequal_wells.level, seen.cv)


@inlined
def at_center(unequal_wells, center):
    """The displacement of the centre from the height that divides the wells."""
    if unequal_wells is None:
        return center
    return center - unequal_wells.level


@inlined
def has_crossed_to_other_well(unequal_wells, center, well_sign, rest_center):
    """Whether the centre has come to the other side."""
    if unequal_wells is None:
        return center * (well_sign * rest_center) < 0.0
    return (center - unequal_wells.level) * well_sign > 0.0
