"""The forces of the strikers beside the first one: accelerations that follow from place and time.

Striker j has the contact's row c_j, with the sign of its own side, and pushes the beam with f_j(d_j), where

    d_j = offset_j + motion_j(t) - c_j . q.

A force without loss is a kick like that of the tension, p' += sum_j c_j f_j: it stands in memory beside the first
striker's, is entered before each kick, and is part of the acceleration that a step keeps for the next.  A force with loss is
a channel of the velocity block.

*others* is an :class:`FurtherContacts` or None, by type: with one striker nothing of this is compiled.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from snapbeam.solver.compilation import called, inlined
from snapbeam.solver.cpu.terms.velocity_block import (
    IMPULSE_IN_KICK,
    LOST_IN_KICK,
    VELOCITY,
    enter_contact,
)
from snapbeam.solver.further_contacts import (
    DAMPED,
    DEEPEST,
    DEPTH,
    DEPTH1,
    FORCE,
    GROSS,
    HERE,
    IMPULSE,
    LAW,
    LOST,
    NUMBERS,
    OFFSET,
    RATE,
    RATE1,
    REST,
    SIGN,
    SLOPE,
    SURFACE,
    TOUCHED,
    TOUCHING,
    WORK,
    any_damped,
    count_of,
    damped_at,
    damping_of,
    energy_of,
    felt_at,
    force_of,
    memory_after_of,
    memory_place,
    motion_of,
    slope_of,
    with_memory_energy_of,
    yield_penetration_of,
)
from snapbeam.solver.simd import WIDTH, broadcast_load, dot, fma, load, store


class FurtherContacts(NamedTuple):
    """Memory offsets of the strikers after the first."""

    rows: int
    """Offset of the contact rows, one after the other."""
    numbers: int
    """Offset of the blocks of numbers."""
    kinds: Any
    """A value whose type says which laws they touch by."""
    indentations: Any
    """Elements of a row that hold their residual indentations, a tuple; None where no law has one."""

    @staticmethod
    @inlined
    def add_acceleration(memory, size, term, row, k):
        """An acceleration with what the other strikers add."""
        for j in range(count_of(term.kinds)):
            force = broadcast_load(memory, block(term, j) + FORCE)
            k = fma(force, load(memory, term.rows + j * size + row), k)
        return k


@inlined
def block(others, j):
    """Memory offset of the numbers of striker j."""
    return others.numbers + j * NUMBERS


@inlined
def penetration_of(memory, size, others, drive, argument, j, q):
    """Penetration of striker j, and the velocity of its tip."""
    at = block(others, j)
    motion, velocity = motion_of(drive, memory, argument, j, memory[at + SIGN])
    return memory[at + HERE] + motion - dot(memory, size, others.rows + j * size, q), velocity


@called
def _press(memory, size, others, drive, argument, q, weight, begins):
    for j in range(count_of(others.kinds)):
        at, force, velocity = block(others, j), 0.0, 0.0
        if begins:
            memory[at + IMPULSE], memory[at + WORK], memory[at + GROSS] = 0.0, 0.0, 0.0
            memory[at + LOST] = 0.0
        damping = 0.0
        if memory[at + TOUCHING] != 0.0:
            depth, velocity = penetration_of(memory, size, others, drive, argument, j, q)
            if damped_at(others.kinds, j):
                # at the very onset rounding leaves a penetration of either sign
                depth = max(depth, 0.0)
                damping = damping_of(others.kinds, memory, at + LAW, j, depth)
            force = force_of(others.kinds, memory, at + LAW, j, depth)
        if damped_at(others.kinds, j):
            enter_contact(memory, at + DAMPED, force, damping, velocity)
            continue
        memory[at + FORCE] = force
        memory[at + IMPULSE] += weight * force
        memory[at + WORK] += weight * force * velocity
        memory[at + GROSS] += weight * abs(force * velocity)


@inlined
def evaluate_contacts(memory, size, others, drive, argument, q, weight, begins):
    """Put the forces at a place and an argument of the drive at hand; add up what a kick of *weight* by them does.

    *begins*: with the first kick of a step.
    """
    if others is None:
        return
    _press(memory, size, others, drive, argument, q, weight, begins)


@called
def _accumulate_damped(memory, others, weight):
    for j in range(count_of(others.kinds)):
        if damped_at(others.kinds, j):
            at = block(others, j)
            impulse = memory[at + DAMPED + IMPULSE_IN_KICK]
            work = impulse * memory[at + DAMPED + VELOCITY]
            memory[at + IMPULSE] += impulse
            memory[at + WORK] += work
            memory[at + GROSS] += abs(work) if weight > 0.0 else -abs(work)
            memory[at + LOST] += memory[at + DAMPED + LOST_IN_KICK]


@inlined
def accumulate_damped_contacts(memory, others, weight):
    """Add up the impulses that the velocity block has given in a kick of *weight* seconds."""
    if others is None:
        return
    if any_damped(others.kinds):
        _accumulate_damped(memory, others, weight)


@called
def _add_damped(memory, size, others, depth, rate, k):
    for j in range(count_of(others.kinds)):
        at, row = block(others, j), others.rows + j * size
        if damped_at(others.kinds, j) and memory[at + TOUCHING] != 0.0:
            force = felt_at(others.kinds, memory, at + LAW, j, memory[at + depth], memory[at + rate])
            for i in range(0, size, WIDTH):
                store(memory, k + i, fma(force, load(memory, row + i), load(memory, k + i)))


@inlined
def add_damped_contacts(memory, size, others, k, k1):
    """Add the forces of contacts that lose energy at both ends of a step to the rows of its accelerations."""
    if others is None:
        return
    if any_damped(others.kinds):
        _add_damped(memory, size, others, DEPTH, RATE, k)
        _add_damped(memory, size, others, DEPTH1, RATE1, k1)


@inlined
def mirror_further_contacts(memory, others, well_sign):
    """Transform the positions of the further strikers to coordinates about the well *well_sign*."""
    if others is None:
        return
    for j in range(count_of(others.kinds)):
        at = block(others, j)
        memory[at + HERE] = memory[at + OFFSET] + (1.0 - well_sign) * memory[at + REST]
    lower_surfaces(memory, others, others.indentations)


@inlined
def lower_surfaces(memory, others, indentations):
    """Measure penetrations from the indented surfaces, once HERE is that of the intact ones."""
    if indentations is None:
        return
    for j in range(count_of(others.kinds)):
        at, place = block(others, j), memory_place(others.kinds, j)
        if place >= 0:
            memory[at + SURFACE] = memory[at + HERE]
            memory[at + HERE] -= memory[at + place]


@inlined
def read_indentations(memory, others, indentations, q):
    """Put the residual indentations of a state, the row *q*, among the laws' numbers."""
    if indentations is None:
        return
    for j in range(count_of(others.kinds)):
        if memory_place(others.kinds, j) >= 0:
            memory[block(others, j) + memory_place(others.kinds, j)] = memory[q + indentations[j]]


@inlined
def unload_further(memory, others, indentations, j, q, accumulators, outputs):
    """Let the surface under striker j yield if its contact unloads, as :func:`~snapbeam.solver.cpu.indentation.unload`."""
    if indentations is None:
        return
    at, place = block(others, j), memory_place(others.kinds, j)
    if place < 0 or memory[at + RATE] > 0.0:
        return
    after = memory_after_of(others.kinds, memory, at + LAW, j, memory[at + DEEPEST])
    growth = after - memory[at + place]
    if growth <= 0.0:
        return
    depth = memory[at + DEPTH]
    lost = energy_of(others.kinds, memory, at + LAW, j, depth)
    lost -= with_memory_energy_of(others.kinds, memory, at + LAW, j, after, depth - growth)
    memory[at + place], memory[q + indentations[j]] = after, after
    memory[at + HERE], memory[at + DEPTH] = memory[at + SURFACE] - after, depth - growth
    memory[at + DEEPEST] = yield_penetration_of(others.kinds, memory, at + LAW, j)
    accumulators.lost += lost
    if outputs is not None:
        accumulators.dissipated += lost


@inlined
def with_further_contact_work(memory, others, work):
    """Work of the first striker in a step with that of the others."""
    if others is None:
        return work
    for j in range(count_of(others.kinds)):
        work += memory[block(others, j) + WORK]
    return work


@inlined
def with_further_contact_gross_work(memory, others, gross):
    """The same, every part taken as positive."""
    if others is None:
        return gross
    for j in range(count_of(others.kinds)):
        gross += memory[block(others, j) + GROSS]
    return gross


@inlined
def with_further_contact_loss(memory, others, lost):
    """Energy lost in the first contact in a step with that of the others."""
    if others is None:
        return lost
    for j in range(count_of(others.kinds)):
        lost += memory[block(others, j) + LOST]
    return lost


@inlined
def with_further_contact_energy(memory, others, energy):
    """An energy with what the other contacts store."""
    if others is None:
        return energy
    for j in range(count_of(others.kinds)):
        at = block(others, j)
        energy += energy_of(others.kinds, memory, at + LAW, j, memory[at + DEPTH])
    return energy


# The tangent flow: a kick by f_j(d_j) along c_j changes by -f_j'(d_j) (c_j . dq) along c_j.


@inlined
def note_touching(memory, others):
    """Keep which strikers touch in the step that is about to be taken; its end may be an onset or a release."""
    if others is None:
        return
    for j in range(count_of(others.kinds)):
        memory[block(others, j) + TOUCHED] = memory[block(others, j) + TOUCHING]


@called
def _linearise(memory, size, others, drive, argument, q):
    for j in range(count_of(others.kinds)):
        at, force, slope = block(others, j), 0.0, 0.0
        if memory[at + TOUCHED] != 0.0:
            depth, _ = penetration_of(memory, size, others, drive, argument, j, q)
            force = force_of(others.kinds, memory, at + LAW, j, depth)
            slope = slope_of(others.kinds, memory, at + LAW, j, depth)
        memory[at + FORCE], memory[at + SLOPE] = force, slope


@inlined
def linearise_further_contacts(memory, size, others, drive, argument, q):
    """Enter forces and slopes at a kick of the step that is gone through again."""
    if others is None:
        return
    _linearise(memory, size, others, drive, argument, q)


@inlined
def kick_tangent_by_further_contacts(memory, size, others, weight, dq, dp):
    """Change a tangent's velocity by a kick of the other strikers."""
    if others is None:
        return
    for j in range(count_of(others.kinds)):
        slope, contact = memory[block(others, j) + SLOPE], others.rows + j * size
        if slope != 0.0:
            push = -weight * slope * dot(memory, size, contact, dq)
            for row in range(0, size, WIDTH):
                store(memory, dp + row, fma(push, load(memory, contact + row), load(memory, dp + row)))
