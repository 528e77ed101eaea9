"""Functions over modes, each written out for the shape that it is called with."""

from __future__ import annotations

from functools import cache
from typing import Any

from numba.extending import overload

from snapbeam.engines.cpu.few import places as at
from snapbeam.engines.cpu.few.text import TEXTS, Modes, made
from snapbeam.engines.scalar.compile import INLINE_HERE, inlined

__all__ = [
    "at_hand",
    "bounds",
    "propagate_free",
    "groups_of",
    "modal_energy",
    "modes_of",
    "signals",
    "take",
    "tension",
]


@cache
def _function(name: str, shape: Any) -> Any:
    """A function over the modes of a shape, compiled into whatever calls it."""
    return inlined(made(name, TEXTS[name](Modes(shape.blocks, shape.flows))))


def take(m: Any, shape: Any, stages: Any, gamma: float, any_touching: bool, touching: Any, law: Any) -> Any:
    """A step of every lane, from Q, P and K to Q1, P1 and K1; returns impulse, work and gross work of the contact.

    *touching* is the mask of those in contact.
    """
    raise TypeError("take runs in compiled code only")


@overload(take, jit_options=INLINE_HERE)
def _take_of(m, shape, stages, gamma, any_touching, touching, law):
    written = _function("take", shape.instance_class)
    return lambda m, shape, stages, gamma, any_touching, touching, law: written(
        m, shape, stages, gamma, any_touching, touching, law
    )


def signals(m: Any, shape: Any, q: int, p: int) -> Any:
    """Displacement of the contact point and of the centre from rest and their rates: c.q, c.p, e.q, e.p."""
    raise TypeError("signals runs in compiled code only")


@overload(signals, jit_options=INLINE_HERE)
def _signals_of(m, shape, q, p):
    written = _function("signals", shape.instance_class)
    return lambda m, shape, q, p: written(m, shape, q, p)


def tension(m: Any, shape: Any, gamma: float, which: Any, q: int) -> Any:
    """g.q and q.Gq; the tension's acceleration goes to K where the mask *which* is true."""
    raise TypeError("tension runs in compiled code only")


@overload(tension, jit_options=INLINE_HERE)
def _tension_of(m, shape, gamma, which, q):
    written = _function("tension", shape.instance_class)
    return lambda m, shape, gamma, which, q: written(m, shape, gamma, which, q)


def bounds(m: Any, shape: Any) -> Any:
    """Of contact point and centre: a speed that the linear flow cannot exceed, and what the tension accelerates by."""
    raise TypeError("bounds runs in compiled code only")


@overload(bounds, jit_options=INLINE_HERE)
def _bounds_of(m, shape):
    written = _function("bounds", shape.instance_class)
    return lambda m, shape: written(m, shape)


def modal_energy(m: Any, shape: Any, q: int, p: int) -> Any:
    """Quadratic part of the energy, and the part of it in modes that count as high."""
    raise TypeError("modal_energy runs in compiled code only")


@overload(modal_energy, jit_options=INLINE_HERE)
def _energy_of(m, shape, q, p):
    written = _function("modal_energy", shape.instance_class)
    return lambda m, shape, q, p: written(m, shape, q, p)


def propagate_free(m: Any, shape: Any, look: int, which: Any, with_center: bool, most: int) -> Any:
    """A free step in pieces, noted from *look* on; returns what the penetration cannot exceed after the start."""
    raise TypeError("glide runs in compiled code only")


@overload(propagate_free, jit_options=INLINE_HERE)
def _glide_of(m, shape, look, which, with_center, most):
    written = _function("glide", shape.instance_class)
    return lambda m, shape, look, which, with_center, most: written(m, shape, look, which, with_center, most)


def modes_of(shape: Any) -> int:
    """How many modes there are."""
    return sum(type(shape).blocks)


@overload(modes_of, jit_options=INLINE_HERE)
def _modes_of(shape):
    count = sum(shape.instance_class.blocks)
    return lambda shape: count


def at_hand(m: Any, shape: Any, place: int, lane: int) -> None:
    """Have the flows and turns of the prepared step at *place* at hand in a lane."""
    raise TypeError("at_hand runs in compiled code only")


@overload(at_hand, jit_options=INLINE_HERE)
def _at_hand_of(m, shape, place, lane):
    written = _function("at_hand", shape.instance_class)
    return lambda m, shape, place, lane: written(m, shape, place, lane)


def groups_of(shape: Any) -> int:
    """Groups of eight pairs of a mode and a distinct flow."""
    kind = type(shape)
    return at.groups(sum(kind.blocks), (kind.flows + 1) // 2)


@overload(groups_of, jit_options=INLINE_HERE)
def _groups_of(shape):
    kind = shape.instance_class
    count = at.groups(sum(kind.blocks), (kind.flows + 1) // 2)
    return lambda shape: count
