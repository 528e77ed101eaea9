"""A harvester's circuit: one state variable beside the modes, exact within each kick.

With t the coupling's row scaled so that y^2/2 is the energy in the circuit, lam its rate of loss and K the acceleration
of a kick, at a fixed place

    p' = K + t y,     y' = -t.p - lam y.

Along t that is a linear equation for s = t.p and y alone, s' = t.K + (t.t) y, whose solution over a kick is summed as a
series (steps are no longer than 1/lam).  A circuit without inertia has y = -rate s.  Free flows leave y as it is: it is
the velocity of one more mode, of frequency 0.

*circuit* is a :class:`Circuit` or None, by type.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from snapbeam.solver.compilation import inlined
from snapbeam.solver.cpu.terms.velocity_block import IMPULSE, TWICE, WORK, V, value_of
from snapbeam.solver.simd import WIDTH, fma, lanes_sum, load, splat, store, vabs
from snapbeam.solver.terms.interface import may_hide_onset

__all__ = [
    "NODES",
    "WEIGHTS",
    "Circuit",
    "CircuitDamping",
    "CircuitIncrement",
    "accumulate_circuit",
    "apply_tap",
    "circuit_acceleration_rows",
    "circuit_increment",
    "circuit_speed_bound",
    "lean_kick",
    "missed_onset",
    "no_circuit_increment",
    "put_rate",
    "tap_of",
    "validity_horizon",
    "without_circuit",
]


_TERMS = 15
# Nodes and weights of Gauss's rule of four points on [0, 1].
NODES = (0.06943184420297371, 0.33000947820757187, 0.6699905217924281, 0.9305681557970262)
WEIGHTS = (0.17392742256872692, 0.32607257743127307, 0.32607257743127307, 0.17392742256872692)


class Circuit(NamedTuple):
    """Where in memory the circuit is."""

    coupling: int
    """t, a row."""
    rate: int
    """Where the rate of loss stands, 1/s; of a circuit without inertia what y is of -s."""
    own: Any
    """Which element of a row is y; None of a circuit without inertia."""


class CircuitIncrement(NamedTuple):
    """What a kick does to the circuit."""

    impulse: float
    """Integral of y."""
    y: float
    """At the end."""
    energy: float
    """Lost in the circuit so far in this step, J."""
    twice: float
    """Integral of the integral of y."""


class CircuitDamping(NamedTuple):
    """The same coupling as a channel of the velocity block: t y along t, and -t.p - lam y for y, the velocity of its own mode.

    Without inertia -rate t.p along t.
    """

    circuit: Circuit
    unknown: int

    @staticmethod
    @inlined
    def damping_forces(memory, term, v, d):
        """Both right-hand sides."""
        _couple(memory, term.circuit.own, memory[term.circuit.rate], v + term.unknown, d + term.unknown)

    @staticmethod
    @inlined
    def add_damping_rate(memory, term, mobility, count, v, change, weight, rate):
        """lam and the rate of exchange |t|; without inertia t.t times the rate."""
        square, own = memory[mobility + (count + 1) * term.unknown], memory[term.circuit.rate]
        if term.circuit.own is None:
            return rate + own * square
        return rate + own + math.sqrt(square)

    @staticmethod
    @inlined
    def end_kick(memory, term, v, impulse, work, path, weight):
        """Nothing to keep: :func:`circuit_increment` reads the arrays."""

    @staticmethod
    @inlined
    def damping_forces_of_state(memory, size, term, q, v, d):
        """Along t; the circuit's own change matters to no displacement."""
        _couple(memory, term.circuit.own, memory[term.circuit.rate], v + term.unknown, d + term.unknown)


@inlined
def _couple(memory, own, rate, v, d):
    if own is None:
        memory[d] = -rate * memory[v]
    else:
        memory[d], memory[d + 1] = memory[v + 1], -memory[v] - rate * memory[v + 1]


@inlined
def circuit_increment(memory, block, i, circuit, before):
    """The changes of a kick that a velocity block has solved; *i* is the number of the circuit's first row, or None."""
    if i is None:
        return before
    return _increment_of_block(memory, block, i, circuit.own, memory[circuit.rate], before)


@inlined
def _increment_of_block(memory, block, i, own, rate, before):
    impulse, twice = value_of(memory, block, IMPULSE, i), value_of(memory, block, TWICE, i)
    lost = -value_of(memory, block, WORK, i)
    if own is None:
        return CircuitIncrement(impulse, -rate * value_of(memory, block, V, i), before.energy + lost, twice)
    lost -= value_of(memory, block, WORK, i + 1)
    return CircuitIncrement(impulse, value_of(memory, block, V, i + 1), before.energy + lost, twice)


@inlined
def put_rate(memory, circuit, rate):
    """Enter a run's rate of loss."""
    if circuit is None:
        return
    memory[circuit.rate] = rate


@inlined
def without_circuit(memory, circuit, p, energy):
    """The modal *energy* without the energy that a circuit with inertia stores."""
    if circuit is None:
        return energy
    return _without_element(memory, circuit.own, p, energy)


@inlined
def _without_element(memory, own, p, energy):
    if own is None:
        return energy
    return energy - 0.5 * memory[p + own] * memory[p + own]


@inlined
def no_circuit_increment():
    """Of a step that has not begun."""
    return CircuitIncrement(0.0, 0.0, 0.0, 0.0)


@inlined
def _flow(s, y, push, size, rate, weight, energy):
    """The exact flow over *weight*: the series of y in time, term by term."""
    ds, dy = push + size * y, -s - rate * y
    impulse, twice, end = y * weight, 0.5 * y * weight * weight, y
    # y at the four nodes, summed with the terms
    y0, y1, y2, y3 = y, y, y, y
    n0, n1, n2, n3 = NODES
    power, a0, a1, a2, a3 = 1.0, 1.0, 1.0, 1.0, 1.0
    for k in range(1, _TERMS):
        power *= weight / k
        a0, a1, a2, a3 = a0 * n0, a1 * n1, a2 * n2, a3 * n3
        term = dy * power
        end += term
        impulse += term * weight / (k + 1)
        twice += term * weight * weight / ((k + 1) * (k + 2))
        y0, y1, y2, y3 = y0 + term * a0, y1 + term * a1, y2 + term * a2, y3 + term * a3
        ds, dy = size * dy, -ds - rate * dy
    w0, w1, w2, w3 = WEIGHTS
    squares = w0 * y0 * y0 + w1 * y1 * y1 + w2 * y2 * y2 + w3 * y3 * y3
    return CircuitIncrement(impulse, end, energy + rate * squares * weight, twice)


@inlined
def _resistive_flow(s, push, size, rate, weight, energy):
    """The same of a circuit without inertia: y = -rate s, s' = push - size rate s."""
    lam = size * rate
    impulse, twice, end = s * weight, 0.5 * s * weight * weight, s
    s0, s1, s2, s3 = s, s, s, s
    n0, n1, n2, n3 = NODES
    power, a0, a1, a2, a3, ds = 1.0, 1.0, 1.0, 1.0, 1.0, push - lam * s
    for k in range(1, _TERMS):
        power *= weight / k
        a0, a1, a2, a3 = a0 * n0, a1 * n1, a2 * n2, a3 * n3
        term = ds * power
        end += term
        impulse += term * weight / (k + 1)
        twice += term * weight * weight / ((k + 1) * (k + 2))
        s0, s1, s2, s3 = s0 + term * a0, s1 + term * a1, s2 + term * a2, s3 + term * a3
        ds = -lam * ds
    w0, w1, w2, w3 = WEIGHTS
    squares = w0 * s0 * s0 + w1 * s1 * s1 + w2 * s2 * s2 + w3 * s3 * s3
    return CircuitIncrement(-rate * impulse, -rate * end, energy + rate * squares * weight, -rate * twice)


@inlined
def tap_of(memory, size, circuit, own, p, kick, weight, tap):
    """What a kick of *weight* does, p before it and *kick* the row of its acceleration."""
    along, push, square = splat(0.0), splat(0.0), splat(0.0)
    for row in range(0, size, WIDTH):
        t = load(memory, circuit.coupling + row)
        along = fma(t, load(memory, p + row), along)
        push = fma(t, load(memory, kick + row), push)
        square = fma(t, t, square)
    s, k, n, rate = lanes_sum(along), lanes_sum(push), lanes_sum(square), memory[circuit.rate]
    if own is None:
        return _resistive_flow(s, k, n, rate, weight, tap.energy)
    return _flow(s, memory[p + own], k, n, rate, weight, tap.energy)


@inlined
def lean_kick(memory, size, circuit, kick, weight, tap):
    """Add to the row of the kick what makes half of it times its weight the mean of what the circuit does to p."""
    if weight == 0.0:
        return
    mean = 2.0 * tap.twice / (weight * weight)
    for row in range(0, size, WIDTH):
        k = load(memory, kick + row)
        store(memory, kick + row, fma(mean, load(memory, circuit.coupling + row), k))


@inlined
def apply_tap(memory, size, circuit, own, p, p_to, tap):
    """p_to = p with the circuit's impulse, y at its end."""
    for row in range(0, size, WIDTH):
        value = fma(tap.impulse, load(memory, circuit.coupling + row), load(memory, p + row))
        store(memory, p_to + row, value)
    if own is not None:
        memory[p_to + own] = tap.y


@inlined
def _state(memory, size, circuit, own, p):
    """y of p."""
    if own is not None:
        return memory[p + own]
    along = splat(0.0)
    for row in range(0, size, WIDTH):
        along = fma(load(memory, circuit.coupling + row), load(memory, p + row), along)
    return -memory[circuit.rate] * lanes_sum(along)


@inlined
def circuit_acceleration_rows(memory, size, circuit, spare, step):
    """Where the accelerations of a free step's ends stand, the circuit's part included: in *spare*, if there is one."""
    if circuit is None:
        return step.k, step.k1
    y, y1 = (
        _state(memory, size, circuit, circuit.own, step.p),
        _state(memory, size, circuit, circuit.own, step.p1),
    )
    for row in range(0, size, WIDTH):
        t = load(memory, circuit.coupling + row)
        store(memory, spare + row, fma(y, t, load(memory, step.k + row)))
        store(memory, spare + size + row, fma(y1, t, load(memory, step.k1 + row)))
    return spare, spare + size


@inlined
def circuit_speed_bound(memory, size, omega, circuit, along, q, p, bound, horizon):
    """A speed that c.q cannot exceed within a time, c the row *along*; *bound* is that of the linear flow alone.

    The energy of linear modes and circuit together, Y^2/2 = (sum p^2 + omega^2 q^2 + y^2)/2, only falls, so that
    c.p <= |c| Y.  What the circuit adds to c.p is the integral of sum c_j t_j cos(omega_j s) y, no more than
    sum |c_j t_j| |y| times the horizon, with |y| <= Y, or rate |t| Y without inertia.
    """
    if circuit is None:
        return bound
    energy, square, length, gain = splat(0.0), splat(0.0), splat(0.0), splat(0.0)
    for row in range(0, size, WIDTH):
        v, oq = load(memory, p + row), load(memory, omega + row) * load(memory, q + row)
        c, t = load(memory, along + row), load(memory, circuit.coupling + row)
        energy = fma(v, v, fma(oq, oq, energy))
        length, square = fma(c, c, length), fma(t, t, square)
        gain = fma(vabs(c), vabs(t), gain)
    most = math.sqrt(lanes_sum(energy))
    y = most
    if circuit.own is None:
        y = memory[circuit.rate] * math.sqrt(lanes_sum(square)) * most
    return min(bound + lanes_sum(gain) * y * horizon, math.sqrt(lanes_sum(length)) * most)


@inlined
def validity_horizon(circuit, horizon):
    """For how long the bound of a free flight is valid: a circuit stiffens the beam, and its state changes soon."""
    if circuit is None:
        return horizon
    return 0.25 * horizon


@inlined
def missed_onset(circuit, terms, event, depth, depth1):
    """Whether a free step ended in the contact unseen: the tension changed more than was foreseen."""
    if circuit is None and not may_hide_onset(terms):
        return False
    return not event and depth1 > 0.0 and depth <= 0.0


@inlined
def accumulate_circuit(memory, layout, circuit, p, accumulators, tap, late):
    """Enter what a step lost in the circuit in the statistics, and its maximum y.

    *late* is the share of the step that lies in the last quarter of the run.
    """
    if circuit is None:
        return
    accumulators.circuit_energy += tap.energy
    accumulators.circuit_energy_last_quarter += late * tap.energy
    accumulators.peak_circuit = max(
        accumulators.peak_circuit, abs(_state(memory, layout.size, circuit, circuit.own, p))
    )
