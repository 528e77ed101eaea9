"""Motions of a tip, a base and an axial load that are marched as one drive: each by its own kind, from one argument."""

from __future__ import annotations

import math
from typing import Any

from numba.extending import overload

from snapbeam.engines.scalar.compile import INLINE, inlined
from snapbeam.engines.scalar.contact import scalar_function
from snapbeam.engines.scalar.physics import sincos

__all__ = [
    "base_acceleration",
    "joined_motion",
    "kind_acceleration",
    "kind_motion",
    "load_change",
    "part_motion",
]

_TWO_PI = 2.0 * math.pi


@inlined
def _harmonic_motion(numbers, memory, argument):
    sine, cosine = sincos(argument)
    return numbers.amplitude * sine, numbers.amplitude * numbers.omega * cosine


@inlined
def _harmonic_acceleration(numbers, memory, argument):
    sine, _ = sincos(argument)
    return -numbers.omega * numbers.omega * numbers.amplitude * sine


@inlined
def _no_motion(drive, memory, argument):
    return 0.0, 0.0


@inlined
def _nothing(drive, memory, argument):
    return 0.0


def _reader(part: str, kind: Any, alone: bool) -> Any:
    """A function that takes the numbers of a part, and its argument, out of those of all."""
    names = ", ".join(f"drive.{part}_{name}" for name in kind.number_names)
    lines = ["def read(drive, argument):"]
    if alone:
        lines.append("    at = argument")
    else:
        lines.append(f"    at = argument / drive.omega * drive.{part}_omega + drive.{part}_phase")
        if kind.harmonic:
            lines.append("    at = at - two_pi * floor(at / two_pi)")
    lines.append(f"    return Numbers({names}), at")
    made: dict[str, Any] = {"Numbers": kind.numbers_type(), "two_pi": _TWO_PI, "floor": math.floor}
    exec("\n".join(lines), made)
    return inlined(made["read"])


def _of_kind(kind: Any, what: str) -> Any:
    """The motion or the acceleration of a kind of drive, as a function of its numbers, memory and its argument."""
    if kind.terms:
        return _summed(kind, what, len(kind.terms))
    if kind.harmonic:
        return _harmonic_motion if what == "motion" else _harmonic_acceleration
    return scalar_function(kind, what)


def _term_reader(kind: Any, i: int) -> Any:
    """A function that takes the numbers of term i, and its argument, out of those of a sum."""
    names = ", ".join(f"drive.t{i}_{name}" for name in kind.number_names)
    lines = ["def read(drive, argument):"]
    lines.append(f"    at = argument / drive.omega * drive.t{i}_omega + drive.t{i}_phase")
    if kind.harmonic:
        lines.append("    at = at - two_pi * floor(at / two_pi)")
    lines.append(f"    return Numbers({names}), at, drive.t{i}_start")
    made: dict[str, Any] = {"Numbers": kind.numbers_type(), "two_pi": _TWO_PI, "floor": math.floor}
    exec("\n".join(lines), made)
    return inlined(made["read"])


def _summed(kind: Any, what: str, count: int) -> Any:
    """The motion or the acceleration of the first *count* terms of a sum."""
    term = kind.terms[count - 1]
    read, own = _term_reader(term, count), _of_kind(term, what)
    if what == "motion":

        @inlined
        def moves(drive, memory, argument):
            numbers, at, start = read(drive, argument)
            w, speed = own(numbers, memory, at)
            return w - start, speed

        if count == 1:
            return moves
        others = _summed(kind, what, count - 1)

        @inlined
        def together(drive, memory, argument):
            one, other = moves(drive, memory, argument), others(drive, memory, argument)
            return one[0] + other[0], one[1] + other[1]

        return together

    @inlined
    def hastens(drive, memory, argument):
        numbers, at, _ = read(drive, argument)
        return own(numbers, memory, at)

    if count == 1:
        return hastens
    rest = _summed(kind, what, count - 1)

    @inlined
    def in_all(drive, memory, argument):
        return hastens(drive, memory, argument) + rest(drive, memory, argument)

    return in_all


def kind_motion(kind: Any) -> Any:
    """The motion of a kind of drive that is no sine: displacement (m) and velocity (m/s)."""
    return _of_kind(kind, "motion")


def kind_acceleration(kind: Any) -> Any:
    """Its acceleration, m/s^2."""
    return _of_kind(kind, "acceleration")


def _of_part(owner: Any, part: str, what: str) -> Any:
    """The motion or the acceleration of a part, as a function of the numbers of all; nothing if it does not move."""
    kinds = dict(owner.parts)
    if part not in kinds:
        return _no_motion if what == "motion" else _nothing
    kind = kinds[part]
    read = _reader(part, kind, owner.alone)
    own = _of_kind(kind, what)

    @inlined
    def of_part(drive, memory, argument):
        numbers, at = read(drive, argument)
        return own(numbers, memory, at)

    return of_part


def part_motion(owner: Any, part: str) -> Any:
    """A function of the numbers of all parts, memory and the argument: displacement (m) and velocity of one part."""
    return _of_part(owner, part, "motion")


def joined_motion(drive: Any, memory: Any, argument: float) -> tuple[float, float]:
    """Displacement of the tip from its mid-position, m, and its velocity, m/s, in the frame of the ends."""
    owner = type(drive).owner
    kinds = dict(owner.parts)
    moved, speed = 0.0, 0.0
    for part, share in (("tip", 1.0), ("base", getattr(drive, "base_follow", 0.0))):
        if part not in kinds:
            continue
        numbers, at = _reader(part, kinds[part], owner.alone).py_func(drive, argument)
        if kinds[part].harmonic:
            w = numbers.amplitude * math.sin(at), numbers.amplitude * numbers.omega * math.cos(at)
        else:
            w = kinds[part].motion(numbers, memory, at)
        moved, speed = moved + share * w[0], speed + share * w[1]
    return moved, speed


@overload(joined_motion, jit_options=INLINE)
def _joined_motion(drive, memory, argument):
    owner = drive.instance_class.owner
    tip, base = _of_part(owner, "tip", "motion"), _of_part(owner, "base", "motion")
    if "base_follow" not in drive.fields:
        return lambda drive, memory, argument: tip(drive, memory, argument)

    def both(drive, memory, argument):
        moved, speed = tip(drive, memory, argument)
        if drive.base_follow != 0.0:
            y, rate = base(drive, memory, argument)
            moved, speed = moved + drive.base_follow * y, speed + drive.base_follow * rate
        return moved, speed

    return both


def base_acceleration(drive: Any, memory: Any, argument: float) -> float:
    """Acceleration of the base in space, m/s^2, positive upwards."""
    raise TypeError("base_acceleration runs in compiled code only")


@overload(base_acceleration, jit_options=INLINE)
def _base_acceleration(drive, memory, argument):
    owner = drive.instance_class.owner
    if "base_sign" not in drive.fields:
        return lambda drive, memory, argument: 0.0
    own = _of_part(owner, "base", "acceleration")
    return lambda drive, memory, argument: drive.base_sign * own(drive, memory, argument)


def load_change(drive: Any, memory: Any, argument: float) -> float:
    """Axial load beyond the one that the beam was reduced under, N."""
    raise TypeError("load_change runs in compiled code only")


@overload(load_change, jit_options=INLINE)
def _load_change(drive, memory, argument):
    owner = drive.instance_class.owner
    if not any(part == "load" for part, _ in owner.parts):
        return lambda drive, memory, argument: 0.0
    own = _of_part(owner, "load", "motion")
    return lambda drive, memory, argument: own(drive, memory, argument)[0]
