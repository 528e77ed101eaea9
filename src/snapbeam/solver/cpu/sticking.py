"""A single mode held where the tip is: the force that this takes, and what all forces do over a time.

The tip prescribes displacement and velocity, so that every other force is known, those of further strikers and the
velocity-dependent ones too.  The state of a circuit with inertia follows from the known displacement.
"""

from __future__ import annotations

from snapbeam.solver.compilation import compiled, inlined
from snapbeam.solver.cpu.mode_lanes import kick_row
from snapbeam.solver.cpu.state import form_acceleration
from snapbeam.solver.cpu.step import StepIncrement
from snapbeam.solver.cpu.terms.further_contacts import (
    evaluate_contacts,
    with_further_contact_gross_work,
    with_further_contact_work,
)
from snapbeam.solver.cpu.terms.velocity_block import add_velocity_dependent, keep_velocities
from snapbeam.solver.excitation import tip_acceleration, tip_motion
from snapbeam.solver.terms.circuit import NODES
from snapbeam.solver.terms.interface import add_work, begin_kick, carry_state, has_state, no_external_work

PANELS = 8
"""Panels of a step: in each, the force is integrated by Simpson's rule and checked for a release."""


@inlined
def _held_displacement(memory, layout, tip, phase, elapsed):
    """q of the mode *elapsed* (s) after *phase*."""
    motion, _ = tip_motion(tip.drive, memory, phase + tip.drive.omega * elapsed)
    return (tip.offset + motion) / memory[layout.contact]


@compiled
def hold(memory, blocks, layout, tip, phase, elapsed, source, q, p, k):
    """Put the mode where the tip is *elapsed* (s) after *phase*; returns the contact force that this takes, g.q and q.Gq.

    The row *source* is that of the displacements at *phase*, with the states of circuits.  With the tip's acceleration
    a_s, c q'' = a_s and q'' = a - 2 zeta omega p - omega^2 q + c f, where a is by all other forces.
    """
    size, c = layout.size, memory[layout.contact]
    if has_state(layout.terms):
        carry_state(
            memory, size, layout.terms, source, q, elapsed,
            _held_displacement(memory, layout, tip, phase, NODES[0] * elapsed),
            _held_displacement(memory, layout, tip, phase, NODES[1] * elapsed),
            _held_displacement(memory, layout, tip, phase, NODES[2] * elapsed),
            _held_displacement(memory, layout, tip, phase, NODES[3] * elapsed),
        )  # fmt: skip
    there, kick = phase + tip.drive.omega * elapsed, kick_row(layout)
    motion, velocity = tip_motion(tip.drive, memory, there)
    memory[q], memory[p] = (tip.offset + motion) / c, velocity / c
    gq, qr = form_acceleration(memory, blocks, layout, tip.drive, there, q, k)
    for row in range(size):
        memory[kick + row] = memory[k + row]
    _add_velocity_dependent(memory, size, layout.velocity_block, q, p, kick)
    wanted = tip_acceleration(tip.drive, memory, there) / c
    free = memory[kick] - 2.0 * memory[layout.damping] * memory[p] - memory[layout.omega_squared] * memory[q]
    return (wanted - free) / c, gq, qr


@inlined
def _add_velocity_dependent(memory, size, velocity_block, q, p, kick):
    if velocity_block is None:
        return
    add_velocity_dependent(memory, size, velocity_block, q, p, kick)


@inlined
def constraint_force(memory, blocks, layout, run, tip, phase, elapsed, source):
    """The force alone; the mode is put into the spare rows."""
    spare, size = run.spare, layout.size
    force, _, _ = hold(
        memory, blocks, layout, tip, phase, elapsed, source, spare, spare + size, spare + 2 * size
    )
    return force


@inlined
def _work_at_velocity(memory, layout, velocity_block, weight, begins, q, p, external):
    """Add the works and losses of the terms over *weight* seconds at the velocities p, which no kick changes."""
    size, terms, kick = layout.size, layout.terms, kick_row(layout)
    begin_kick(memory, terms, weight, begins)
    for row in range(size):
        memory[kick + row] = 0.0
    if velocity_block is not None:
        keep_velocities(memory, size, velocity_block, weight, q, p)
    return add_work(memory, size, terms, weight, layout.g, layout.work + 9 * size, kick, p, external)


@compiled
def held_for(memory, blocks, layout, run, tip, phase, source, length):
    """Impulses and works of all forces over *length* from *phase* on, and the maximum of the first striker's force."""
    size, q, damping, omega = layout.size, run.spare, memory[layout.damping], tip.drive.omega
    p, c = q + size, memory[layout.contact]
    impulse, work, gross, dissipated, peak = 0.0, 0.0, 0.0, 0.0, 0.0
    gq, qr, external = 0.0, 0.0, no_external_work(layout.terms)
    for i in range(2 * PANELS + 1):
        weight = 4.0 if i % 2 == 1 else 2.0
        if i == 0 or i == 2 * PANELS:
            weight = 1.0
        weight *= length / (6.0 * PANELS)
        elapsed = i * length / (2 * PANELS)
        force, gq, qr = hold(memory, blocks, layout, tip, phase, elapsed, source, q, p, q + 2 * size)
        speed = memory[p] * c
        impulse += weight * force
        work += weight * force * speed
        gross += weight * abs(force * speed)
        dissipated += weight * 2.0 * damping * memory[p] * memory[p]
        peak = max(peak, force)
        evaluate_contacts(memory, size, layout.others, tip.drive, phase + omega * elapsed, q, weight, i == 0)
        external = _work_at_velocity(memory, layout, layout.velocity_block, weight, i == 0, q, p, external)
    work = with_further_contact_work(memory, layout.others, work)
    gross = with_further_contact_gross_work(memory, layout.others, gross)
    return StepIncrement(gq, qr, impulse, work, gross, 0.0, dissipated, external), peak
