"""What unequal wells add to a march: a constant force on the far side of the mirror, and energies to go with it.

*uneven* is an :class:`Uneven` or None, by type: of a beam with equal wells nothing of this is compiled.
"""

from __future__ import annotations

from typing import NamedTuple

from snapbeam.solver.compilation import inlined
from snapbeam.solver.events import ContactKinematics
from snapbeam.solver.simd import WIDTH, fma, lanes_sum, load, splat, store

__all__ = [
    "Uneven",
    "about_level",
    "above_own_well",
    "add_potential_energy",
    "add_static_load",
    "at_center",
    "has_crossed_to_other_well",
    "pushed_along",
    "put",
    "second_well",
]


class Uneven(NamedTuple):
    """Where in memory the numbers of unequal wells are; see :class:`snapbeam.solver.structure.Uneven`."""

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
def add_static_load(memory, uneven, row, k):
    """An acceleration with the force at hand."""
    if uneven is None:
        return k
    return k + load(memory, uneven.here + row)


@inlined
def pushed_along(memory, size, uneven, contact, along):
    """The same along the contact's row."""
    if uneven is None:
        return along
    total = splat(0.0)
    for row in range(0, size, WIDTH):
        total = fma(load(memory, uneven.here + row), load(memory, contact + row), total)
    return along + lanes_sum(total)


@inlined
def put(memory, size, uneven, well_sign):
    """The force at hand, for the origin of q."""
    if uneven is None:
        return
    far = 1.0 if well_sign < 0.0 else 0.0
    for row in range(0, size, WIDTH):
        store(memory, uneven.here + row, far * load(memory, uneven.force + row))
    memory[uneven.here + size] = far * uneven.lift


@inlined
def add_potential_energy(memory, size, uneven, q, energy):
    """The energy above the first well, of that which linear modes and tension have about the origin at hand."""
    if uneven is None:
        return energy
    total = splat(0.0)
    for row in range(0, size, WIDTH):
        total = fma(load(memory, uneven.here + row), load(memory, q + row), total)
    return energy + (memory[uneven.here + size] - lanes_sum(total))


@inlined
def above_own_well(uneven, well_sign, energy):
    """The energy above the well that the beam is near."""
    if uneven is None:
        return energy
    return energy - uneven.depth if well_sign < 0.0 else energy


@inlined
def second_well(memory, size, uneven, well_sign, q, spare):
    """Where q is measured from the well that the beam is near: *q* itself, or *spare*."""
    if uneven is None:
        return q
    if well_sign > 0.0:
        return q
    for row in range(0, size, WIDTH):
        store(memory, spare + row, load(memory, q + row) - load(memory, uneven.second + row))
    return spare


@inlined
def about_level(uneven, seen):
    """What is seen, the centre from the height that divides the wells."""
    if uneven is None:
        return seen
    return ContactKinematics(seen.w, seen.wv, seen.d, seen.dv, seen.c - uneven.level, seen.cv)


@inlined
def at_center(uneven, center):
    """The displacement of the centre from the height that divides the wells."""
    if uneven is None:
        return center
    return center - uneven.level


@inlined
def has_crossed_to_other_well(uneven, center, well_sign, rest_center):
    """Whether the centre has come to the other side."""
    if uneven is None:
        return center * (well_sign * rest_center) < 0.0
    return (center - uneven.level) * well_sign > 0.0
