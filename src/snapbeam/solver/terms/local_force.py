"""Local force: a law F(u, v) of one point, with u = u_0 + r.q its displacement or rotation and v = r.p the rate of that.

The conservative part F(u) is constant in a kick: it adds F r to the acceleration.  The damping part D(u, v) changes with
the velocity within the kick.  At a fixed u, and with a = r.k the acceleration by all other forces along r, v obeys

    v' = a + (r.r) D(u, v),

an equation for v alone.  Its solution over the kick, by the classical Runge-Kutta method in parts that resolve D, gives
the impulse, integral of D, which acts along r.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numba.extending import overload

from snapbeam.solver.compilation import INLINE, called, inlined
from snapbeam.solver.contact_force import scalar_function
from snapbeam.solver.simd import WIDTH, broadcast_load, fma, lanes_sum, load, splat, store
from snapbeam.solver.terms.interface import TermMemory

__all__ = ["DampedLocalForce", "LocalForce"]


_ORIGIN, _PLACE, _FORCE, _DAMPING, _IMPULSE, _WORK = range(6)
"""What a run keeps: u at the origin of q; u, F and D at the last kick; impulse and work of D in a kick."""
_FEWEST_PARTS, _MOST_PARTS = 4, 256
_PARTS_PER_DECAY = 8.0
"""Parts of a kick, over the time in which the damping alone halts the point."""


def _of_law(name: str) -> Any:
    """A function f(law, ...) that calls the function *name* of a law's class."""

    def stub(law: Any, u: float) -> float:
        raise TypeError("laws of local forces run in compiled code only")

    @overload(stub, jit_options=INLINE)
    def chosen(law, u):
        own = scalar_function(law.instance_class.owner, name)
        return lambda law, u: own(law, u)

    return stub


def _of_law_and_velocity(name: str) -> Any:
    """The same of a function of the velocity too."""

    def stub(law: Any, u: float, v: float) -> float:
        raise TypeError("laws of local forces run in compiled code only")

    @overload(stub, jit_options=INLINE)
    def chosen(law, u, v):
        own = scalar_function(law.instance_class.owner, name)
        return lambda law, u, v: own(law, u, v)

    return stub


def _force(law: Any, u: float) -> float:
    """The conservative force; NaN outside of the range of the law, which ends the run."""
    raise TypeError("laws of local forces run in compiled code only")


@overload(_force, jit_options=INLINE)
def _force_in_range(law, u):
    owner = law.instance_class.owner
    own = scalar_function(owner, "force")
    if not owner.is_limited():
        return lambda law, u: own(law, u)
    ends = scalar_function(owner, "displacement_range")

    def limited(law, u):
        low, high = ends(law)
        if low < u < high:
            return own(law, u)
        return math.nan

    return limited


_energy = _of_law("energy")
_damping_force, _damping_coefficient = (
    _of_law_and_velocity("damping_force"),
    _of_law_and_velocity("damping_coefficient"),
)


@inlined
def _product(memory, size, one, other):
    total = splat(0.0)
    for row in range(0, size, WIDTH):
        total = fma(load(memory, one + row), load(memory, other + row), total)
    return lanes_sum(total)


@called
def _damping_kick(law, u, v, push, mobility, weight):
    """Impulse of D over a kick, the integral of the impulse so far, and the work of D."""
    fastest = max(_damping_coefficient(law, u, v), _damping_coefficient(law, u, v + push * weight))
    if v * (v + push * weight) <= 0.0:
        fastest = max(fastest, _damping_coefficient(law, u, 0.0))
    count = _FEWEST_PARTS + int(min(_PARTS_PER_DECAY * mobility * fastest * abs(weight), 1e6))
    count = min(count, _MOST_PARTS)
    h = weight / count
    impulse, twice, work = 0.0, 0.0, 0.0
    for _ in range(count):
        f1 = _damping_force(law, u, v)
        v2 = v + 0.5 * h * (push + mobility * f1)
        f2 = _damping_force(law, u, v2)
        v3 = v + 0.5 * h * (push + mobility * f2)
        f3 = _damping_force(law, u, v3)
        v4 = v + h * (push + mobility * f3)
        f4 = _damping_force(law, u, v4)
        part = h / 6.0 * (f1 + 2.0 * (f2 + f3) + f4)
        twice += h * impulse + h * h / 6.0 * (f1 + f2 + f3)
        work += h / 6.0 * (f1 * v + 2.0 * (f2 * v2 + f3 * v3) + f4 * v4)
        impulse += part
        v += h * push + mobility * part
    return impulse, twice, work


class LocalForce(NamedTuple):
    """Places in memory, and the law."""

    row: int
    """r, a row."""
    state: int
    """What a run keeps."""
    rest: float
    """u in the first well."""
    law: Any
    """Constants of the law; their type names its functions."""

    @staticmethod
    def build(structure: Any, drive: Any, size: int, padded: Any) -> list[TermMemory]:
        """Of the local forces whose laws depend on the displacement alone."""
        return _built(structure, padded, dissipative=False)

    @staticmethod
    @inlined
    def update_forces(memory, size, term, drive, argument, q):
        """Write u and F(u) into memory."""
        u = memory[term.state + _ORIGIN] + _product(memory, size, term.row, q)
        memory[term.state + _PLACE] = u
        memory[term.state + _FORCE] = _force(term.law, u)

    @staticmethod
    @inlined
    def enter_well(memory, size, term, well_sign):
        """The origin is the first well or its mirror image."""
        memory[term.state + _ORIGIN] = well_sign * term.rest

    @staticmethod
    @inlined
    def add_acceleration(memory, size, term, row, k):
        """k + F r."""
        return fma(broadcast_load(memory, term.state + _FORCE), load(memory, term.row + row), k)

    @staticmethod
    @inlined
    def add_acceleration_along(memory, size, term, contact, along):
        """c.k + F c.r."""
        return along + memory[term.state + _FORCE] * _product(memory, size, term.row, contact)

    @staticmethod
    @inlined
    def add_potential_energy(memory, size, term, q, energy):
        """The potential energy of F."""
        return energy + _energy(term.law, memory[term.state + _ORIGIN] + _product(memory, size, term.row, q))

    may_hide_onset = True  # type: ignore[misc]


class DampedLocalForce(LocalForce):
    """The same of a law with damping."""

    __slots__ = ()

    @staticmethod
    def build(structure: Any, drive: Any, size: int, padded: Any) -> list[TermMemory]:
        """Of the local forces whose laws have a damping part."""
        return _built(structure, padded, dissipative=True)

    @staticmethod
    @inlined
    def begin_exchange(memory, size, term, weight, kick, p):
        """Compute the impulse of D in a kick; *kick*, the acceleration without it, receives its mean effect on p."""
        along, push = _product(memory, size, term.row, p), _product(memory, size, term.row, kick)
        mobility = _product(memory, size, term.row, term.row)
        u = memory[term.state + _PLACE]
        impulse, twice, work = _damping_kick(term.law, u, along, push, mobility, weight)
        memory[term.state + _IMPULSE], memory[term.state + _WORK] = impulse, work
        memory[term.state + _DAMPING] = _damping_force(
            term.law, u, along + push * weight + mobility * impulse
        )
        if weight != 0.0:
            mean = 2.0 * twice / (weight * weight)
            for row in range(0, size, WIDTH):
                store(memory, kick + row, fma(mean, load(memory, term.row + row), load(memory, kick + row)))

    @staticmethod
    @inlined
    def end_exchange(memory, size, term, p, p_to):
        """p_to = p with the impulse of D."""
        for row in range(0, size, WIDTH):
            impulse = broadcast_load(memory, term.state + _IMPULSE)
            store(memory, p_to + row, fma(impulse, load(memory, term.row + row), load(memory, p + row)))

    @staticmethod
    @inlined
    def add_velocity_dependent(memory, size, term, q, p, k):
        """Add D r to the row k."""
        u = memory[term.state + _ORIGIN] + _product(memory, size, term.row, q)
        force = _damping_force(term.law, u, _product(memory, size, term.row, p))
        for row in range(0, size, WIDTH):
            store(memory, k + row, fma(force, load(memory, term.row + row), load(memory, k + row)))

    @staticmethod
    @inlined
    def add_to_speed_bound(memory, size, term, drive, along, horizon, bound):
        """Within a time tau, D changes c.p by about tau |D| sum |r_j c_j|."""
        total = 0.0
        for row in range(size):
            total += abs(memory[term.row + row] * memory[along + row])
        return bound + total * abs(memory[term.state + _DAMPING]) * horizon

    accumulator = "local_force_work"
    work_description = "work done by the damping part of a local force"

    @staticmethod
    @inlined
    def kick_work(memory, size, term, weight, g, r, kick, p):
        """The integral of D v."""
        return memory[term.state + _WORK]


def _built(structure: Any, padded: Any, dissipative: bool) -> list[TermMemory]:
    return [
        TermMemory(
            {"row": padded(each.row)}, {"state": np.zeros(WIDTH)}, {"rest": each.rest, "law": each.law}
        )
        for each in structure.local_forces
        if type(each.law).owner.dissipative == dissipative
    ]
