"""Laws of contact as kernels see them: which functions belong to a law follows from the type of its numbers.

A law is a class in :mod:`snapbeam.model.contact` (or anybody's) with plain scalar functions; they are compiled here,
once, for whichever engine asks.  In Numba's simulator they run as they stand.
"""

from __future__ import annotations

import math
from functools import cache
from typing import Any

from snapbeam.solver.compilation import compiled, inlined, overloaded
from snapbeam.solver.interpolation import cubic, first_upcrossing, turning_point, update_extrema
from snapbeam.solver.simd import Lanes, select_less

_SMALLEST = 2.2250738585072014e-308
_ROUNDING = 1e-9


@cache
def scalar_function(kind: type, name: str) -> Any:
    """The scalar function *name* of a law or a drive, compiled into whatever calls it."""
    return inlined(getattr(kind, name))


def contact_force(law: Any, penetration: float) -> float:
    """The force on tip and beam, N; none when apart."""
    return type(law).owner.force(law, penetration) if penetration > 0.0 else 0.0


def contact_energy(law: Any, penetration: float) -> float:
    """Energy stored in the contact, J; none when apart."""
    return type(law).owner.energy(law, penetration) if penetration > 0.0 else 0.0


def contact_slope(law: Any, penetration: float) -> float:
    """Derivative of the force, N/m; none when apart."""
    return type(law).owner.slope(law, penetration) if penetration > 0.0 else 0.0


def _when_touching(kind: type, name: str) -> Any:
    function = scalar_function(kind, name)

    def implementation(law, penetration):
        if penetration > 0.0:
            return function(law, penetration)
        return 0.0

    return implementation


@overloaded(contact_force)
def _contact_force(law, penetration):
    if isinstance(penetration, Lanes):
        force = scalar_function(law.instance_class.owner, "force")
        return lambda law, penetration: select_less(0.0, penetration, force(law, penetration), 0.0)
    return _when_touching(law.instance_class.owner, "force")


@overloaded(contact_energy)
def _contact_energy(law, penetration):
    return _when_touching(law.instance_class.owner, "energy")


@overloaded(contact_slope)
def _contact_slope(law, penetration):
    return _when_touching(law.instance_class.owner, "slope")


def peak_force(law: Any, deepest: float) -> float:
    """Maximum force of a contact, N, from what a record of accumulators calls the deepest point of it.

    That is the maximum penetration, or, under a law whose impacts last no time or whose force is not maximum where
    the penetration is, the maximum force while the bodies stay together.
    """
    owner = type(law).owner
    return deepest if owner.impulsive or owner.rate_dependent else contact_force(law, deepest)


@overloaded(peak_force)
def _peak_force(law, deepest):
    owner = law.instance_class.owner
    if owner.impulsive or owner.rate_dependent:
        return lambda law, deepest: deepest
    return lambda law, deepest: contact_force(law, deepest)


def is_impulsive(law: Any) -> bool:
    """Return whether impacts under the law have zero duration."""
    return bool(type(law).owner.impulsive)


@overloaded(is_impulsive)
def _is_impulsive(law):
    impulsive = bool(law.instance_class.owner.impulsive)
    return lambda law: impulsive


def begins_with_jump(owner: Any) -> bool:
    """True of a law whose force, which is integrated, begins with a jump, so that it matters when exactly it begins."""
    return bool(owner.rate_dependent and not owner.properties.smooth)


def jumps(law: Any) -> bool:
    """:func:`begins_with_jump` of the law of these numbers."""
    return begins_with_jump(type(law).owner)


@overloaded(jumps)
def _jumps(law):
    found = begins_with_jump(law.instance_class.owner)
    return lambda law: found


def felt_force(law: Any, penetration: float, rate: float) -> float:
    """The force on tip and beam, N, at a penetration and its rate."""
    owner: Any = type(law).owner
    if not owner.rate_dependent or penetration <= 0.0:
        return contact_force(law, penetration)
    return max(0.0, float(owner.force(law, penetration) + owner.damping_coefficient(law, penetration) * rate))


@overloaded(felt_force)
def _felt_force(law, penetration, rate):
    owner = law.instance_class.owner
    if not owner.rate_dependent:
        return lambda law, penetration, rate: contact_force(law, penetration)
    force, damping = scalar_function(owner, "force"), scalar_function(owner, "damping_coefficient")

    def implementation(law, penetration, rate):
        if penetration > 0.0:
            return max(0.0, force(law, penetration) + damping(law, penetration) * rate)
        return 0.0

    return implementation


def damping_coefficient(law: Any, penetration: float) -> float:
    """Derivative of the force by the rate of the penetration, N s/m; 0 of a law without loss."""
    owner: Any = type(law).owner
    return float(owner.damping_coefficient(law, penetration)) if owner.rate_dependent else 0.0


@overloaded(damping_coefficient)
def _damping_coefficient(law, penetration):
    owner = law.instance_class.owner
    if not owner.rate_dependent:
        return lambda law, penetration: 0.0
    own = scalar_function(owner, "damping_coefficient")
    return lambda law, penetration: own(law, penetration)


def mark_of(law: Any, penetration: float, rate: float) -> float:
    """The penetration of a contact, of which a record of accumulators keeps the maximum, or the force of a law that loses energy.

    At the onset, where the penetration is zero, that force is its limit from the side of the contact.
    """
    if not type(law).owner.rate_dependent:
        return max(penetration, 0.0)
    return felt_force(law, _SMALLEST if penetration == 0.0 else penetration, rate)


@overloaded(mark_of)
def _mark_of(law, penetration, rate):
    if law.instance_class.owner.rate_dependent:
        return lambda law, penetration, rate: felt_force(
            law, _SMALLEST if penetration == 0.0 else penetration, rate
        )
    return lambda law, penetration, rate: max(penetration, 0.0)


_PARTS = 24
"""Equal parts of a step, at whose ends the force is evaluated."""


@compiled
def _peak_on_cubic(law, peak, d0, v0, d1, v1, length):
    c0, c1, c2, c3 = cubic(d0, v0, d1, v1, length)
    peak = max(peak, max(felt_force(law, d0, v0), felt_force(law, d1, v1)))
    for i in range(1, _PARTS):
        s = i / _PARTS
        d = c0 + s * (c1 + s * (c2 + s * c3))
        peak = max(peak, felt_force(law, d, (c1 + s * (2.0 * c2 + s * 3.0 * c3)) / length))
    return peak


def peak_in_step(law: Any, peak: float, d0: float, v0: float, d1: float, v1: float, length: float) -> float:
    """The maximum penetration of a contact so far, *peak*, or force (:func:`peak_force`), with a step in it.

    The cubic through penetration and rate at both ends is followed.
    """
    raise TypeError("peak_in_step runs in compiled code only")


@overloaded(peak_in_step)
def _peak_in_step(law, peak, d0, v0, d1, v1, length):
    if law.instance_class.owner.rate_dependent:
        return lambda law, peak, d0, v0, d1, v1, length: _peak_on_cubic(law, peak, d0, v0, d1, v1, length)
    return lambda law, peak, d0, v0, d1, v1, length: update_extrema(
        d0, max(peak, d1), d0, v0, d1, v1, length
    )[1]


def force_break(law: Any, d0: float, v0: float, d1: float, v1: float, length: float) -> float:
    """Fraction of a step in contact at which the force is not smooth, though the contact goes on; -1: none.

    The force of a law that loses energy vanishes or begins there; that of a law with memory passes to first loading, or
    from there to unloading.  Penetration and rate are those at the two ends, the cubic through them is followed.
    """
    raise TypeError("force_break runs in compiled code only")


@overloaded(force_break)
def _force_break(law, d0, v0, d1, v1, length):
    owner = law.instance_class.owner
    if owner.memory:
        return _break_of_memory
    if not owner.rate_dependent:
        return lambda law, d0, v0, d1, v1, length: -1.0
    force, damping = scalar_function(owner, "force"), scalar_function(owner, "damping_coefficient")

    def implementation(law, d0, v0, d1, v1, length):
        if d0 <= 0.0:
            return -1.0
        first = force(law, d0) + damping(law, d0) * v0
        low, high, last = 0.0, 1.0, -1.0
        if d1 > 0.0:
            last = force(law, d1) + damping(law, d1) * v1
        if first * last >= 0.0:
            return -1.0
        c0, c1, c2, c3 = cubic(d0, v0, d1, v1, length)
        for _ in range(40):
            s = 0.5 * (low + high)
            d = c0 + s * (c1 + s * (c2 + s * c3))
            felt = -1.0
            if d > 0.0:
                felt = force(law, d) + damping(law, d) * (c1 + s * (2.0 * c2 + s * 3.0 * c3)) / length
            if felt * first > 0.0:
                low = s
            else:
                high = s
        return high

    return implementation


def _break_of_memory(law, d0, v0, d1, v1, length):
    kink = yield_penetration(law)
    if d0 < kink or v0 <= 0.0:
        return first_upcrossing(d0 - kink, v0, d1 - kink, v1, length) if 0.0 < kink < math.inf else -1.0
    return turning_point(d0, v0, d1, v1, length)


def with_memory(law: Any, memory: float) -> Any:
    """The numbers of a law with the residual indentation *memory*, m; as they are of a law without one."""
    owner: Any = type(law).owner
    return law._replace(**{owner.memory: memory}) if owner.memory else law


@overloaded(with_memory)
def _with_memory(law, memory):
    owner = law.instance_class.owner
    if not owner.memory:
        return lambda law, memory: law
    numbers = law.instance_class
    # one tuple: Numba unpacks no other
    return lambda law, memory: numbers(*(law[:-1] + (memory,)))  # noqa: RUF005


def yield_penetration(law: Any) -> float:
    """Penetration beyond which the residual indentation increases, m; infinite of a law without one."""
    owner: Any = type(law).owner
    return float(owner.yield_penetration(law)) if owner.memory else math.inf


@overloaded(yield_penetration)
def _yield_penetration(law):
    owner = law.instance_class.owner
    if not owner.memory:
        return lambda law: math.inf
    own = scalar_function(owner, "yield_penetration")
    return lambda law: own(law)


def memory_after(law: Any, deepest: float) -> float:
    """Residual indentation of a contact that unloads from a maximum penetration, m: the present one, or more."""
    raise TypeError("memory_after runs in compiled code only")


@overloaded(memory_after)
def _memory_after(law, deepest):
    owner = law.instance_class.owner
    if not owner.memory:
        return lambda law, deepest: 0.0
    own = scalar_function(owner, "memory_after")

    def implementation(law, deepest):
        # within rounding of the change of branches nothing is left to yield
        if deepest > (1.0 + _ROUNDING) * yield_penetration(law):
            return own(law, deepest)
        return law[-1]

    return implementation


def released_at(law: Any, penetration: float, rate: float) -> float:
    """The way to the release, m: the penetration, or what is left of it until the force vanishes, roughly."""
    raise TypeError("released_at runs in compiled code only")


@overloaded(released_at)
def _released_at(law, penetration, rate):
    owner = law.instance_class.owner
    if not owner.rate_dependent:
        return lambda law, penetration, rate: penetration
    force, damping = scalar_function(owner, "force"), scalar_function(owner, "damping_coefficient")

    def implementation(law, penetration, rate):
        if penetration > 0.0 and rate < 0.0:
            felt = force(law, penetration) + damping(law, penetration) * rate
            left = damping(law, 0.0) * rate
            if felt > 0.0 and left < 0.0:
                return penetration * felt / (felt - left)
        return penetration

    return implementation
