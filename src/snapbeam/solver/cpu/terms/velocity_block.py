"""Forces that depend on velocities, together: one equation for the velocities along their rows within a kick.

At fixed displacements, with K the acceleration of a kick by all other forces and D_i the force along the row r_i,

    p' = K + sum_i D_i(v) r_i,    v_i = r_i.p,

the velocities along the rows obey an equation for themselves alone,

    v' = a + M D(v),    a_i = r_i.K,    M_ij = r_i.r_j.

The classical Runge-Kutta method, in parts that resolve D, gives the impulses, integrals of D_i, which act along the rows.
One force alone that is linear in v is integrated exactly.
One after the other, such forces would leave an error of first order in the length of the step.

A *channel* is a named tuple with ``unknown``, the number of its first row, and the operations below as static methods.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from snapbeam.solver.compilation import called, inlined
from snapbeam.solver.simd import WIDTH, dot, fma, load, store
from snapbeam.solver.terms.interface import operation

_FEWEST_PARTS, _MOST_PARTS = 4, 256
_PARTS_PER_DECAY = 8.0
"""Parts of a kick, over the time in which the damping alone halts the motion along the rows."""
_V, _PUSH, _STAGE, _FORCE, _SUM, _POWER, _IMPULSE, _TWICE, _WORK, _PATH = range(10)
"""Arrays of one number for each row: v, a, v and D of a part, their sums; then integrals over the kick: of D, of that
integral, of D v and of v."""


_LINEAR = 1e-9
"""Relative deviation of a force from linear within a kick, at most."""
_FACTORIALS = tuple(1.0 / math.factorial(k + 3) for k in range(15, -1, -1))
"""1 / (k + 3)! from k = 15 down."""


class VelocityBlock(NamedTuple):
    """Places in memory of the forces of one structure that depend on velocities."""

    rows: Any
    """A tuple of places."""
    channels: Any
    """A tuple of channels, in the order of their rows."""
    numbers: int
    """M, then the arrays."""
    first: Any
    """Place of the numbers of the first contact; None if its force does not depend on the velocity."""


def numbers_of_block(count: int) -> int:
    """Length in memory of the numbers of a block of *count* rows, in whole registers."""
    return -(-count * (count + _PATH + 1) // WIDTH) * WIDTH


# Operations of channels.


@operation(threaded=0)
def damping_forces(memory: Any, terms: Any, v: int, d: int) -> Any:
    """Write D of the velocities in the array *v* into the array *d*."""
    raise TypeError("operations of channels run in compiled code only")


@operation()
def add_damping_rate(
    memory: Any, terms: Any, mobility: int, count: int, v: int, change: int, weight: float, rate: Any
) -> Any:
    """Add the rate, 1/s, at which the channel alone changes its velocity, at most within the kick.

    *mobility* is the place of M of *count* rows; over the kick all other forces change the velocities by *weight* times the
    array *change*.
    """
    raise TypeError("operations of channels run in compiled code only")


@operation()
def acts(memory: Any, terms: Any, active: bool) -> Any:
    """True if the channel has a force at the kick at hand, else *active*."""
    raise TypeError("operations of channels run in compiled code only")


@operation()
def damping_coefficient(memory: Any, terms: Any, coefficient: float) -> Any:
    """C, N s/m, of a channel whose force is linear within a kick: D = D_0 - C (v - v_0)."""
    raise TypeError("operations of channels run in compiled code only")


@operation(threaded=0)
def end_kick(memory: Any, terms: Any, v: int, impulse: int, work: int, path: int, weight: float) -> Any:
    """Keep the results of a kick: arrays of the velocity at its end and of the integrals of D, D v and v."""
    raise TypeError("operations of channels run in compiled code only")


@operation(threaded=0)
def damping_forces_of_state(memory: Any, size: int, terms: Any, q: int, v: int, d: int) -> Any:
    """Write D of a free state into the array *d*: displacements in the row *q*, velocities in the array *v*."""
    raise TypeError("operations of channels run in compiled code only")


# A contact that loses energy: D = max(0, F + C (V - v)) with the striker's velocity V.


ELASTIC, DAMPING, VELOCITY, IMPULSE_IN_KICK, LOST_IN_KICK = range(5)
"""Numbers of a contact: F, N; C, N s/m; V, m/s; of a kick the impulse, N s, and the energy lost, J."""


class ContactDamping(NamedTuple):
    """The force of one contact; F = C = 0 while it is open."""

    numbers: int
    unknown: int

    @staticmethod
    @inlined
    def acts(memory, term, active):
        """True if the contact is closed."""
        return active or memory[term.numbers + ELASTIC] != 0.0 or memory[term.numbers + DAMPING] != 0.0

    @staticmethod
    @inlined
    def damping_forces(memory, term, v, d):
        """The force of the contact, N."""
        at = term.numbers
        rate = memory[at + VELOCITY] - memory[v + term.unknown]
        memory[d + term.unknown] = max(0.0, memory[at + ELASTIC] + memory[at + DAMPING] * rate)

    @staticmethod
    @inlined
    def damping_coefficient(memory, term, coefficient):
        """C, while the contact pushes."""
        return memory[term.numbers + DAMPING]

    @staticmethod
    @inlined
    def add_damping_rate(memory, term, mobility, count, v, change, weight, rate):
        """C c.c."""
        return rate + memory[term.numbers + DAMPING] * memory[mobility + (count + 1) * term.unknown]

    @staticmethod
    @inlined
    def end_kick(memory, term, v, impulse, work, path, weight):
        """The energy that the bodies give beyond F times the change of penetration, integral of (D - F) (V - v)."""
        at, i = term.numbers, term.unknown
        given, closed = memory[impulse + i], memory[at + VELOCITY] * weight - memory[path + i]
        memory[at + IMPULSE_IN_KICK] = given
        memory[at + LOST_IN_KICK] = (
            given * memory[at + VELOCITY] - memory[work + i] - memory[at + ELASTIC] * closed
        )

    @staticmethod
    @inlined
    def damping_forces_of_state(memory, size, term, q, v, d):
        """None: in free flight the contact is open."""
        memory[d + term.unknown] = 0.0


@inlined
def _array(block, which):
    count = len(block.rows)
    return block.numbers + count * (count + which)


@inlined
def enter_contact(memory, at, elastic, damping, velocity):
    """Enter F, C and V of a contact."""
    memory[at + ELASTIC], memory[at + DAMPING], memory[at + VELOCITY] = elastic, damping, velocity


@inlined
def open_first_contact(memory, block):
    """Set the force of the first contact in a kick to zero."""
    if block is None:
        return
    _open(memory, block.first)


@inlined
def _open(memory, first):
    if first is None:
        return
    memory[first + ELASTIC], memory[first + DAMPING] = 0.0, 0.0


@called
def _enter_mobilities(memory, size, block):
    count = len(block.rows)
    for i in range(count):
        for j in range(count):
            memory[block.numbers + i * count + j] = dot(memory, size, block.rows[i], block.rows[j])


@inlined
def prepare_velocity_block(memory, size, block):
    """Write M into memory; rows stay the same in a run."""
    if block is None:
        return
    _enter_mobilities(memory, size, block)


@inlined
def _advance(memory, count, mobility, v, change, force, weight, result):
    """result = v + weight (a + M D)."""
    for i in range(count):
        total = memory[change + i]
        for j in range(count):
            total += memory[mobility + i * count + j] * memory[force + j]
        memory[result + i] = memory[v + i] + weight * total


@inlined
def _third_phi(x):
    """Sum of (-x)^k / (k + 3)!, to the last digit for |x| <= 1."""
    total = 0.0
    for factor in _FACTORIALS:
        total = fma(-x, total, factor)
    return total


@inlined
def _integrate_exactly(memory, block, weight):
    """Integrate a single force that is linear in v; False if it is not, or faster than the kick.

    With x = C M w:  D' = -C (a + M D),  I = integral of D = w D_0 phi_1 - w^2 C a phi_2,  and the integral of
    (w - t) D = w^2 D_0 phi_2 - w^3 C a phi_3,  where  phi_1 = 1 - x phi_2,  phi_2 = 1/2 - x phi_3.
    """
    v, change, force = _array(block, _V), _array(block, _PUSH), _array(block, _FORCE)
    damping, mobility = damping_coefficient(memory, block.channels, math.nan), memory[block.numbers]
    x = damping * mobility * weight
    if not abs(x) <= 1.0:
        return False
    damping_forces(memory, block.channels, v, force)
    v0, a, d0 = memory[v], memory[change], memory[force]
    phi3 = _third_phi(x)
    phi2 = 0.5 - x * phi3
    push = weight * damping * a
    impulse = weight * (d0 * (1.0 - x * phi2) - push * phi2)
    twice = weight * weight * (d0 * phi2 - push * phi3)
    end = v0 + weight * a + mobility * impulse
    memory[v] = end
    damping_forces(memory, block.channels, v, force)
    if not abs(memory[force] - d0 + damping * (end - v0)) <= _LINEAR * (abs(d0) + damping * abs(end - v0)):
        memory[v] = v0
        return False
    memory[_array(block, _IMPULSE)], memory[_array(block, _TWICE)] = impulse, twice
    memory[_array(block, _PATH)] = v0 * weight + 0.5 * a * weight * weight + mobility * twice
    memory[_array(block, _WORK)] = (
        v0 * impulse + a * (weight * impulse - twice) + 0.5 * mobility * impulse * impulse
    )
    return True


@called
def _integrate(memory, block, weight):
    """Integrate the velocities over a kick of *weight* seconds, and D, D v and v."""
    count, mobility, channels = len(block.rows), block.numbers, block.channels
    v, change, stage, force = (
        _array(block, _V),
        _array(block, _PUSH),
        _array(block, _STAGE),
        _array(block, _FORCE),
    )
    total, power = _array(block, _SUM), _array(block, _POWER)
    impulse, twice, work, path = (
        _array(block, _IMPULSE), _array(block, _TWICE), _array(block, _WORK), _array(block, _PATH)
    )  # fmt: skip
    if count == 1 and _integrate_exactly(memory, block, weight):
        end_kick(memory, channels, v, impulse, work, path, weight)
        return
    for i in range(count):
        memory[impulse + i], memory[twice + i], memory[work + i] = 0.0, 0.0, 0.0
        # of v without D; D is added at the end
        memory[path + i] = memory[v + i] * weight + 0.5 * memory[change + i] * weight * weight
    rate = add_damping_rate(memory, channels, mobility, count, v, change, weight, 0.0)
    parts = _FEWEST_PARTS + int(min(_PARTS_PER_DECAY * rate * abs(weight), 1e6))
    parts = min(parts, _MOST_PARTS)
    h = weight / parts
    for _ in range(parts):
        damping_forces(memory, channels, v, force)
        for i in range(count):
            d = memory[force + i]
            memory[total + i], memory[power + i] = d, d * memory[v + i]
            memory[twice + i] += h * memory[impulse + i] + h * h / 6.0 * d
        for _half in range(2):
            _advance(memory, count, mobility, v, change, force, 0.5 * h, stage)
            damping_forces(memory, channels, stage, force)
            for i in range(count):
                d = memory[force + i]
                memory[total + i] += 2.0 * d
                memory[power + i] += 2.0 * d * memory[stage + i]
                memory[twice + i] += h * h / 6.0 * d
        _advance(memory, count, mobility, v, change, force, h, stage)
        damping_forces(memory, channels, stage, force)
        for i in range(count):
            d = memory[force + i]
            memory[power + i] += d * memory[stage + i]
            memory[force + i] = (memory[total + i] + d) / 6.0
            memory[impulse + i] += h * memory[force + i]
            memory[work + i] += h / 6.0 * memory[power + i]
        _advance(memory, count, mobility, v, change, force, h, stage)
        for i in range(count):
            memory[v + i] = memory[stage + i]
    for i in range(count):
        for j in range(count):
            memory[path + i] += memory[mobility + i * count + j] * memory[twice + j]
    end_kick(memory, channels, v, impulse, work, path, weight)


@inlined
def solve_velocity_block(memory, size, block, weight, kick, p):
    """Compute the impulses of a kick of *weight* seconds in which a channel acts.

    The row *kick* is the acceleration by all other forces.  It receives what makes half of it times the weight the mean of the
    effect of D on p.
    """
    v, change, twice = _array(block, _V), _array(block, _PUSH), _array(block, _TWICE)
    for i in range(len(block.rows)):
        memory[v + i] = dot(memory, size, block.rows[i], p)
        memory[change + i] = dot(memory, size, block.rows[i], kick)
    _integrate(memory, block, weight)
    if weight != 0.0:
        for i in range(len(block.rows)):
            _add_row(memory, size, 2.0 * memory[twice + i] / (weight * weight), block.rows[i], kick)


@inlined
def _add_row(memory, size, factor, row, to):
    for at in range(0, size, WIDTH):
        store(memory, to + at, fma(factor, load(memory, row + at), load(memory, to + at)))


@inlined
def rest_in_kick(memory, block):
    """The results of a kick in which no channel acts."""
    v, impulse, work, path = (
        _array(block, _V), _array(block, _IMPULSE), _array(block, _WORK), _array(block, _PATH)
    )  # fmt: skip
    for i in range(len(block.rows)):
        memory[impulse + i], memory[work + i], memory[path + i] = 0.0, 0.0, 0.0
    end_kick(memory, block.channels, v, impulse, work, path, 0.0)


@inlined
def add_impulses(memory, size, block, p, p_to):
    """p_to = p with the impulses of a kick."""
    impulse = _array(block, _IMPULSE)
    for at in range(0, size, WIDTH):
        store(memory, p_to + at, load(memory, p + at))
    for i in range(len(block.rows)):
        _add_row(memory, size, memory[impulse + i], block.rows[i], p_to)


@called
def add_velocity_dependent(memory, size, block, q, p, k):
    """Add the velocity-dependent forces of a free state to the row of accelerations *k*."""
    v, force = _array(block, _V), _array(block, _FORCE)
    for i in range(len(block.rows)):
        memory[v + i] = dot(memory, size, block.rows[i], p)
    damping_forces_of_state(memory, size, block.channels, q, v, force)
    for i in range(len(block.rows)):
        _add_row(memory, size, memory[force + i], block.rows[i], k)


@called
def keep_velocities(memory, size, block, weight, q, p):
    """The results of *weight* seconds in which a constraint keeps the velocities."""
    v, force = _array(block, _V), _array(block, _FORCE)
    impulse, work, path = _array(block, _IMPULSE), _array(block, _WORK), _array(block, _PATH)
    for i in range(len(block.rows)):
        memory[v + i] = dot(memory, size, block.rows[i], p)
    damping_forces_of_state(memory, size, block.channels, q, v, force)
    for i in range(len(block.rows)):
        memory[impulse + i], memory[path + i] = weight * memory[force + i], weight * memory[v + i]
        memory[work + i] = memory[impulse + i] * memory[v + i]
    end_kick(memory, block.channels, v, impulse, work, path, weight)
