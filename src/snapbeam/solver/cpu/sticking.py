"""A single mode held where the tip is: the force that this takes, and what all forces do over a time.

The tip prescribes displacement and velocity, so that every other force is known, those of further strikers and the
velocity-dependent ones too.  Only the state y of a circuit with inertia evolves, by y' = -t.p - lam y with a known p.
"""

from __future__ import annotations

import math

from snapbeam.solver.compilation import compiled, inlined
from snapbeam.solver.cpu.mode_lanes import kick_row
from snapbeam.solver.cpu.state import form_acceleration
from snapbeam.solver.cpu.step import StepIncrement
from snapbeam.solver.cpu.terms.circuit import NODES, WEIGHTS, CircuitIncrement
from snapbeam.solver.cpu.terms.further_contacts import (
    evaluate_contacts,
    with_further_contact_gross_work,
    with_further_contact_work,
)
from snapbeam.solver.excitation import tip_acceleration, tip_motion
from snapbeam.solver.terms.interface import (
    add_velocity_dependent,
    add_work,
    begin_exchange,
    depends_on_velocity,
    no_external_work,
)

__all__ = ["PANELS", "constraint_force", "held_for", "hold"]


PANELS = 8
"""Of a step: the force is integrated over each by Simpson's rule, and checked for a release."""


@inlined
def _circuit_state(memory, layout, circuit, tip, phase, elapsed, source):
    """State y of the circuit *elapsed* (s) after *phase*, when it stood in the row *source*; 0 without a circuit."""
    if circuit is None:
        return 0.0
    return _state_of(memory, layout, circuit, circuit.own, tip, phase, elapsed, source)


@inlined
def _state_of(memory, layout, circuit, own, tip, phase, elapsed, source):
    drive, rate = tip.drive, memory[circuit.rate]
    along = memory[circuit.coupling] / memory[layout.contact]
    if own is None:
        _, velocity = tip_motion(drive, memory, phase + drive.omega * elapsed)
        return -rate * along * velocity
    integral = 0.0
    for i in range(4):
        _, velocity = tip_motion(drive, memory, phase + drive.omega * (NODES[i] * elapsed))
        integral += WEIGHTS[i] * math.exp(-rate * (1.0 - NODES[i]) * elapsed) * velocity
    return math.exp(-rate * elapsed) * memory[source + own] - along * elapsed * integral


@inlined
def _put_circuit(memory, circuit, p, kick, y):
    """Enter the state of the circuit in the row p and its force in the row *kick*."""
    if circuit is None:
        return
    memory[kick] += y * memory[circuit.coupling]
    _put_state(memory, circuit.own, p, y)


@inlined
def _put_state(memory, own, p, y):
    if own is None:
        return
    memory[p + own] = y


@inlined
def _circuit_loss(memory, circuit, p, y):
    """Power lost in the circuit, W."""
    if circuit is None:
        return 0.0
    return _loss_of(memory, circuit, circuit.own, p, y)


@inlined
def _loss_of(memory, circuit, own, p, y):
    if own is None:
        return -y * memory[circuit.coupling] * memory[p]
    return memory[circuit.rate] * y * y


@compiled
def hold(memory, blocks, layout, tip, phase, elapsed, source, q, p, k):
    """Put the mode where the tip is *elapsed* (s) after *phase*; returns the contact force that this takes, g.q and q.Gq.

    The row *source* is that of the velocities at *phase*, with the state of the circuit.  With the tip's acceleration
    a_s, c q'' = a_s and q'' = a - 2 zeta omega p - omega^2 q + c f, where a is by all other forces.
    """
    y = _circuit_state(memory, layout, layout.circuit, tip, phase, elapsed, source)
    there, kick = phase + tip.drive.omega * elapsed, kick_row(layout)
    motion, velocity = tip_motion(tip.drive, memory, there)
    c = memory[layout.contact]
    for row in range(layout.size):
        memory[q + row] = 0.0
        memory[p + row] = 0.0
    memory[q] = (tip.offset + motion) / c
    memory[p] = velocity / c
    gq, qr = form_acceleration(memory, blocks, layout, tip.drive, there, q, k)
    for row in range(layout.size):
        memory[kick + row] = memory[k + row]
    add_velocity_dependent(memory, layout.size, layout.terms, q, p, kick)
    _put_circuit(memory, layout.circuit, p, kick, y)
    wanted = tip_acceleration(tip.drive, memory, there) / c
    free = memory[kick] - 2.0 * memory[layout.damping] * memory[p] - memory[layout.omega_squared] * memory[q]
    return (wanted - free) / c, gq, qr


@inlined
def constraint_force(memory, blocks, layout, run, tip, phase, elapsed, source):
    """The force alone; the mode is put into the spare rows."""
    spare, size = run.spare, layout.size
    force, _, _ = hold(
        memory, blocks, layout, tip, phase, elapsed, source, spare, spare + size, spare + 2 * size
    )
    return force


@inlined
def _work_at_velocity(memory, layout, weight, q, p, external):
    """Add the works of the terms over *weight* seconds at the velocities p, which no kick changes."""
    size, terms, kick = layout.size, layout.terms, kick_row(layout)
    for row in range(size):
        memory[kick + row] = 0.0
    if depends_on_velocity(terms):
        # all other forces balance the one that depends on the velocity
        add_velocity_dependent(memory, size, terms, q, p, kick)
        for row in range(size):
            memory[kick + row] = -memory[kick + row]
        begin_exchange(memory, size, terms, weight, kick, p)
    return add_work(memory, size, terms, weight, layout.g, layout.work + 9 * size, kick, p, external)


@compiled
def held_for(memory, blocks, layout, run, tip, phase, source, length):
    """What all forces do over *length* from *phase* on, and the maximum of the first striker's."""
    size, q, damping, omega = layout.size, run.spare, memory[layout.damping], tip.drive.omega
    p, c, loss = q + size, memory[layout.contact], 0.0
    impulse, work, gross, dissipated, peak = 0.0, 0.0, 0.0, 0.0, 0.0
    gq, qr, y, external = 0.0, 0.0, 0.0, no_external_work(layout.terms)
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
        external = _work_at_velocity(memory, layout, weight, q, p, external)
        y = _circuit_state(memory, layout, layout.circuit, tip, phase, elapsed, source)
        loss += weight * _circuit_loss(memory, layout.circuit, p, y)
    work = with_further_contact_work(memory, layout.others, work)
    gross = with_further_contact_gross_work(memory, layout.others, gross)
    circuit = CircuitIncrement(0.0, y, loss, 0.0)
    return StepIncrement(gq, qr, impulse, work, gross, 0.0, dissipated, external, circuit), peak
