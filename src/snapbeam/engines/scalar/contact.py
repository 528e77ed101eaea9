"""Laws of contact as kernels see them: which functions belong to a law follows from the type of its numbers.

A law is a class in :mod:`snapbeam.model.contact` (or anybody's) with plain scalar functions; they are compiled here,
once, for whichever engine asks.  In Numba's simulator they run as they stand.
"""

from __future__ import annotations

from functools import cache
from typing import Any

from numba.extending import overload

from snapbeam.engines.scalar.compile import INLINE, inlined

__all__ = [
    "contact_energy",
    "contact_force",
    "contact_slope",
    "is_impulsive",
    "peak_force",
    "scalar_function",
]


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


@overload(contact_force, jit_options=INLINE)
def _contact_force(law, penetration):
    return _when_touching(law.instance_class.owner, "force")


@overload(contact_energy, jit_options=INLINE)
def _contact_energy(law, penetration):
    return _when_touching(law.instance_class.owner, "energy")


@overload(contact_slope, jit_options=INLINE)
def _contact_slope(law, penetration):
    return _when_touching(law.instance_class.owner, "slope")


def peak_force(law: Any, deepest: float) -> float:
    """Greatest force of a contact, N, from what a book calls the deepest point of it.

    That is the greatest penetration, or, under a law whose impacts last no time, the greatest force while the bodies
    stay together.
    """
    return deepest if type(law).owner.impulsive else contact_force(law, deepest)


@overload(peak_force, jit_options=INLINE)
def _peak_force(law, deepest):
    if law.instance_class.owner.impulsive:
        return lambda law, deepest: deepest
    return lambda law, deepest: contact_force(law, deepest)


def is_impulsive(law: Any) -> bool:
    """Whether impacts under the law last no time."""
    return bool(type(law).owner.impulsive)


@overload(is_impulsive, jit_options=INLINE)
def _is_impulsive(law):
    impulsive = bool(law.instance_class.owner.impulsive)
    return lambda law: impulsive
