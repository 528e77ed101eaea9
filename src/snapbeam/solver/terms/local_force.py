"""Local force: a law F(u, v) of one point, with u = u_0 + r.q its displacement or rotation and v = r.p the rate of that.

The conservative part F(u) is constant in a kick: it adds F r to the acceleration.  The damping part D(u, v) changes with
the velocity within the kick, as a channel of the velocity block (``cpu/terms/velocity_block.py``).
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numba.extending import overload

from snapbeam.solver.compilation import INLINE, inlined
from snapbeam.solver.contact_force import scalar_function
from snapbeam.solver.simd import WIDTH, broadcast_load, dot, fma, load
from snapbeam.solver.terms.force_of_time import absolute_product
from snapbeam.solver.terms.interface import TermMemory, speed_bound

_ORIGIN, _PLACE, _FORCE, _DAMPING, _WORK = range(5)
"""Numbers of a run: u at the origin of q; u, F and D at the last kick; work of D in a kick."""


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
def greatest_change(memory, extrema, count, law, u, reach):
    """The change of the force within *reach* of u, N; NaN where the law, or one of its extrema, is not known.

    A force is farthest from F(u) at an end of the interval or at one of the *count* extrema within it, whose places and forces
    are in *memory*.
    """
    here = _force(law, u)
    change = abs(_force(law, u + reach) - here) + abs(_force(law, u - reach) - here)
    for i in range(extrema + 2, extrema + 2 + 2 * count, 2):
        if abs(memory[i] - u) < reach:
            other = abs(memory[i + 1] - here)
            if change <= other or math.isnan(other):
                change = other
    known = memory[extrema] <= u - reach and u + reach <= memory[extrema + 1]
    return change if known else math.nan


@inlined
def _change_by_force(memory, size, term, omega, along, q, p, horizon):
    reach = horizon * speed_bound(memory, size, omega, term.row, q, p)
    u = memory[term.state + _ORIGIN] + dot(memory, size, term.row, q)
    change = greatest_change(memory, term.extrema, term.number, term.law, u, reach)
    return absolute_product(memory, size, term.row, along) * change * horizon


class LocalForceTerm(NamedTuple):
    """Places in memory, and the law."""

    row: int
    """r, a row."""
    extrema: int
    """Range in which the extrema of the force are known, and their places and forces."""
    state: int
    """State that a run stores."""
    number: int
    """Extrema of the force."""
    rest: float
    """u in the first well."""
    law: Any
    """Constants of the law; their type names its functions."""

    @staticmethod
    def build(structure: Any, drive: Any, size: int, padded: Any) -> list[TermMemory]:
        """Build the terms of local forces that depend on the displacement alone."""
        return _built(structure, padded, dissipative=False)

    @staticmethod
    @inlined
    def update_forces(memory, size, term, drive, argument, q):
        """Write u and F(u) into memory."""
        u = memory[term.state + _ORIGIN] + dot(memory, size, term.row, q)
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
    def add_potential_energy(memory, size, term, q, energy):
        """The potential energy of F."""
        return energy + _energy(term.law, memory[term.state + _ORIGIN] + dot(memory, size, term.row, q))

    may_hide_onset = True  # type: ignore[misc]

    @staticmethod
    @inlined
    def add_to_speed_bound(memory, size, term, drive, omega, along, q, p, speed, horizon, bound):
        """Within a time tau, F changes c.p by no more than tau max|F(u') - F(u)| sum |r_j c_j| beyond its present push."""
        return bound + _change_by_force(memory, size, term, omega, along, q, p, horizon)


class DampedLocalForceTerm(LocalForceTerm):
    """The same of a law with damping."""

    __slots__ = ()

    @staticmethod
    def build(structure: Any, drive: Any, size: int, padded: Any) -> list[TermMemory]:
        """Build the terms of local forces with damping."""
        return _built(structure, padded, dissipative=True)

    @staticmethod
    @inlined
    def add_to_speed_bound(memory, size, term, drive, omega, along, q, p, speed, horizon, bound):
        """Add the change by F, and by D: about tau |D| sum |r_j c_j|."""
        damping = absolute_product(memory, size, term.row, along) * abs(memory[term.state + _DAMPING])
        return bound + _change_by_force(memory, size, term, omega, along, q, p, horizon) + damping * horizon

    def channel(self, unknown: int) -> LocalDamping:
        """Channel of the velocity block for the damping part."""
        return LocalDamping(self.row, self.state, self.law, unknown)

    accumulator = "local_force_work"
    work_description = "work done by the damping part of a local force"

    @staticmethod
    @inlined
    def kick_work(memory, size, term, weight, g, r, kick, p):
        """The integral of D v."""
        return memory[term.state + _WORK]


class LocalDamping(NamedTuple):
    """The damping part of a local force, as a channel of the velocity block."""

    row: int
    state: int
    law: Any
    unknown: int

    @staticmethod
    @inlined
    def acts(memory, term, active):
        """True, at every kick."""
        return True

    @staticmethod
    @inlined
    def damping_forces(memory, term, v, d):
        """D(u, v)."""
        velocity = memory[v + term.unknown]
        memory[d + term.unknown] = _damping_force(term.law, memory[term.state + _PLACE], velocity)

    @staticmethod
    @inlined
    def add_damping_rate(memory, term, mobility, count, v, change, weight, rate):
        """r.r times the maximum of -dD/dv at both ends of the kick without D, and at rest if that is between."""
        u, before = memory[term.state + _PLACE], memory[v + term.unknown]
        after = before + memory[change + term.unknown] * weight
        fastest = max(_damping_coefficient(term.law, u, before), _damping_coefficient(term.law, u, after))
        if before * after <= 0.0:
            fastest = max(fastest, _damping_coefficient(term.law, u, 0.0))
        return rate + memory[mobility + (count + 1) * term.unknown] * fastest

    @staticmethod
    @inlined
    def end_kick(memory, term, v, impulse, work, path, weight):
        """Keep the work and the last force."""
        u, velocity = memory[term.state + _PLACE], memory[v + term.unknown]
        memory[term.state + _WORK] = memory[work + term.unknown]
        memory[term.state + _DAMPING] = _damping_force(term.law, u, velocity)

    @staticmethod
    @inlined
    def damping_forces_of_state(memory, size, term, q, v, d):
        """D(u, v) with u = u_0 + r.q."""
        u = memory[term.state + _ORIGIN] + dot(memory, size, term.row, q)
        memory[d + term.unknown] = _damping_force(term.law, u, memory[v + term.unknown])


def _built(structure: Any, padded: Any, dissipative: bool) -> list[TermMemory]:
    return [
        TermMemory(
            {"row": padded(each.row), "extrema": np.pad(each.extrema, (0, -each.extrema.size % WIDTH))},
            {"state": np.zeros(WIDTH)},
            {"number": each.extrema.size // 2 - 1, "rest": each.rest, "law": each.law},
        )
        for each in structure.local_forces
        if type(each.law).owner.dissipative == dissipative
    ]
