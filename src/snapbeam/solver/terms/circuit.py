"""A harvester's circuit: one state beside the modes, and what is lost in it.

With t the row of the coupling, scaled so that y^2/2 is the energy in the circuit, and lam its rate of loss,

    p' = ... + t y,     y' = -t.p - lam y.

The charge Q = y + t.q obeys Q' = -lam (Q - t.q), which contains no velocity.  y = Q - t.q is therefore constant in a kick,
as every force that depends on position alone.  In a flow, with sigma_j = zeta_j omega_j and omega_j of mode j,
Q - x.q - z.p decays as exp(-lam t), where

    x_j = lam t_j (lam - 2 sigma_j)/D_j,     z_j = -lam t_j/D_j,     D_j = lam^2 - 2 sigma_j lam + omega_j^2,

so that Q is exact too.  It stands in q of a mode of its own, which has no frequency and no velocity.  The loss, the integral of
lam y^2, adds up in the kicks.

A circuit without inertia has y = -rate t.p: a damping force, and as such a channel of the velocity block.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from snapbeam.solver.compilation import inlined
from snapbeam.solver.simd import WIDTH, broadcast_load, dot, fma, load
from snapbeam.solver.terms.force_of_time import absolute_product
from snapbeam.solver.terms.interface import TermMemory

_RATE, _Y, _CARRIED, _LOSS, _STORED = range(5)
"""Numbers of a run: rate of loss; y at the last kick; part of a flow; energy lost in the step so far, and in the accepted
one."""


class Circuit(NamedTuple):
    """A circuit with inertia."""

    row: int
    """t."""
    along_q: int
    """x, a row; along_p: z."""
    along_p: int
    state: int
    number: int
    """Number of the harvester, from 0."""
    own: int
    """Element of a row that holds Q."""

    @staticmethod
    def build(structure: Any, drive: Any, size: int, padded: Any) -> list[TermMemory]:
        """Build the terms of circuits with inertia."""
        unit = np.eye(structure.omega.size)
        return [
            TermMemory(
                {"row": padded(each.row)},
                {"along_q": np.zeros(size), "along_p": np.zeros(size), "state": np.zeros(WIDTH)},
                {"number": number, "own": int(np.flatnonzero(padded(unit[each.mode]))[0])},
            )
            for number, each in enumerate(structure.circuits)
            if each.mode is not None
        ]

    @staticmethod
    @inlined
    def begin_run(memory, size, term, rates, i, omega_squared, damping):
        """Write the rate of loss, x and z."""
        rate = rates[i, term.number]
        memory[term.state + _RATE] = rate
        for row in range(size):
            shifted = rate - 2.0 * memory[damping + row]
            share = rate * memory[term.row + row]
            if share != 0.0:
                share = share / (rate * shifted + memory[omega_squared + row])
            memory[term.along_q + row], memory[term.along_p + row] = share * shifted, -share

    @staticmethod
    @inlined
    def update_forces(memory, size, term, drive, argument, q):
        """y = Q - t.q."""
        memory[term.state + _Y] = memory[q + term.own] - dot(memory, size, term.row, q)

    @staticmethod
    @inlined
    def add_acceleration(memory, size, term, row, k):
        """k + y t."""
        return fma(broadcast_load(memory, term.state + _Y), load(memory, term.row + row), k)

    @staticmethod
    @inlined
    def add_potential_energy(memory, size, term, q, energy):
        """y^2/2."""
        y = memory[q + term.own] - dot(memory, size, term.row, q)
        return energy + 0.5 * y * y

    add_circuit_energy = add_potential_energy  # type: ignore[misc]

    @staticmethod
    @inlined
    def begin_kick(memory, term, weight, begins):
        """Add lam y^2 over a kick of *weight* seconds."""
        y, lost = memory[term.state + _Y], memory[term.state + _LOSS]
        memory[term.state + _LOSS] = (0.0 if begins else lost) + weight * memory[term.state + _RATE] * y * y

    @staticmethod
    @inlined
    def enter_flow(memory, size, term, length, at):
        """Q of the circuit alone decays by exp(-lam t)."""
        memory[at + term.own] = math.expm1(-memory[term.state + _RATE] * length)
        for row in range(1, 4):
            memory[at + row * size + term.own] = 0.0

    @staticmethod
    @inlined
    def before_flow(memory, size, term, flow, q, p):
        """Keep the part of x.q + z.p that decays."""
        share = dot(memory, size, term.along_q, q) + dot(memory, size, term.along_p, p)
        memory[term.state + _CARRIED] = (1.0 + memory[flow + term.own]) * share

    @staticmethod
    @inlined
    def after_flow(memory, size, term, q, p):
        """Q of the end."""
        share = dot(memory, size, term.along_q, q) + dot(memory, size, term.along_p, p)
        memory[q + term.own] += share - memory[term.state + _CARRIED]

    @staticmethod
    @inlined
    def carry_state(memory, size, term, source, q, length, u0, u1, u2, u3):
        """Q in the row *q* after *length* (s) in which a single mode was held at displacements *u0* ... of Gauss's rule.

        Q(0) stands in the row *source*.
        """
        rate = memory[term.state + _RATE]
        displacements, driven = (u0, u1, u2, u3), 0.0
        for i in range(4):
            driven += WEIGHTS[i] * math.exp(-rate * (1.0 - NODES[i]) * length) * displacements[i]
        decayed = math.exp(-rate * length) * memory[source + term.own]
        memory[q + term.own] = decayed + rate * length * memory[term.row] * driven

    may_hide_onset = True  # type: ignore[misc]
    bounds_by_energy = True  # type: ignore[misc]

    @staticmethod
    @inlined
    def add_to_speed_bound(memory, size, term, drive, omega, along, q, p, speed, horizon, bound):
        """Within a time tau the circuit changes c.p by no more than tau max|y| sum |c_j t_j|, and |y| <= *speed*."""
        return bound + absolute_product(memory, size, term.row, along) * speed * horizon

    @staticmethod
    @inlined
    def accumulate_loss(memory, size, term, accumulators, q, p, late):
        """Enter the loss of a step and y at its end, of which the share *late* is in the last quarter."""
        y = memory[q + term.own] - dot(memory, size, term.row, q)
        _accumulate(accumulators, term.number, memory[term.state + _STORED], y, late)

    @staticmethod
    @inlined
    def store_loss(memory, term):
        """Keep the loss of the step at hand."""
        memory[term.state + _STORED] = memory[term.state + _LOSS]

    @staticmethod
    @inlined
    def add_stored_loss(memory, term):
        """Add what was kept of a first part of the step."""
        memory[term.state + _LOSS] += memory[term.state + _STORED]

    @staticmethod
    @inlined
    def write_loss(memory, term, accumulators, values, sample, first, within):
        """Write the loss of the run so far, and that of the step at hand times *within*."""
        lost = accumulators.circuits[term.number, 0] + within * memory[term.state + _LOSS]
        values[sample, first + term.number] = lost


NODES = (0.06943184420297371, 0.33000947820757187, 0.6699905217924281, 0.9305681557970262)
"""Nodes and weights of Gauss's rule of four points on [0, 1]."""
WEIGHTS = (0.17392742256872692, 0.32607257743127307, 0.32607257743127307, 0.17392742256872692)


@inlined
def _accumulate(accumulators, number, lost, y, late):
    accumulators.circuits[number, 0] += lost
    accumulators.circuits[number, 1] += late * lost
    accumulators.circuits[number, 2] = max(accumulators.circuits[number, 2], abs(y))


class ResistiveCircuit(NamedTuple):
    """A circuit without inertia."""

    row: int
    state: int
    number: int

    @staticmethod
    def build(structure: Any, drive: Any, size: int, padded: Any) -> list[TermMemory]:
        """Build the terms of circuits without inertia."""
        return [
            TermMemory({"row": padded(each.row)}, {"state": np.zeros(WIDTH)}, {"number": number})
            for number, each in enumerate(structure.circuits)
            if each.mode is None
        ]

    @staticmethod
    @inlined
    def begin_run(memory, size, term, rates, i, omega_squared, damping):
        """Write the rate."""
        memory[term.state + _RATE] = rates[i, term.number]

    @staticmethod
    @inlined
    def begin_kick(memory, term, weight, begins):
        """Begin to add up the loss."""
        if begins:
            memory[term.state + _LOSS] = 0.0

    may_hide_onset = True  # type: ignore[misc]
    bounds_by_energy = True  # type: ignore[misc]

    @staticmethod
    @inlined
    def add_to_speed_bound(memory, size, term, drive, omega, along, q, p, speed, horizon, bound):
        """Add to the speed bound as for a circuit with inertia, with |y| <= rate |t| *speed*."""
        y = memory[term.state + _RATE] * math.sqrt(dot(memory, size, term.row, term.row)) * speed
        return bound + absolute_product(memory, size, term.row, along) * y * horizon

    @staticmethod
    @inlined
    def accumulate_loss(memory, size, term, accumulators, q, p, late):
        """Enter the loss of a step, and y at its end."""
        y = memory[term.state + _RATE] * dot(memory, size, term.row, p)
        _accumulate(accumulators, term.number, memory[term.state + _STORED], y, late)

    def channel(self, unknown: int) -> CircuitDamping:
        """Channel of the velocity block."""
        return CircuitDamping(self.state, unknown)

    store_loss = Circuit.store_loss  # type: ignore[misc]
    add_stored_loss = Circuit.add_stored_loss  # type: ignore[misc]
    write_loss = Circuit.write_loss  # type: ignore[misc]


class CircuitDamping(NamedTuple):
    """The force of a circuit without inertia, D = -rate t.p, as a channel of the velocity block."""

    state: int
    unknown: int

    @staticmethod
    @inlined
    def acts(memory, term, active):
        """True, at every kick."""
        return True

    @staticmethod
    @inlined
    def damping_forces(memory, term, v, d):
        """-rate v."""
        memory[d + term.unknown] = -memory[term.state + _RATE] * memory[v + term.unknown]

    @staticmethod
    @inlined
    def damping_coefficient(memory, term, coefficient):
        """The rate."""
        return memory[term.state + _RATE]

    @staticmethod
    @inlined
    def add_damping_rate(memory, term, mobility, count, v, change, weight, rate):
        """rate t.t."""
        return rate + memory[term.state + _RATE] * memory[mobility + (count + 1) * term.unknown]

    @staticmethod
    @inlined
    def end_kick(memory, term, v, impulse, work, path, weight):
        """The loss is what the force takes."""
        memory[term.state + _LOSS] -= memory[work + term.unknown]

    @staticmethod
    @inlined
    def damping_forces_of_state(memory, size, term, q, v, d):
        """-rate v."""
        memory[d + term.unknown] = -memory[term.state + _RATE] * memory[v + term.unknown]
