"""The striker's tip as kernels see it: where it is, how it moves, and the law by which it touches."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from llvmlite import ir
from numba import types
from numba.extending import intrinsic, overload

from snapbeam.model.drive.base import SCALAR
from snapbeam.model.drive.base import sincos as drive_sincos
from snapbeam.model.drive.combined import parts_of
from snapbeam.model.drive.noise import LINES, sums_of_sines
from snapbeam.solver.compilation import INLINE, INLINE_HERE, called, inlined, overloaded
from snapbeam.solver.contact_force import scalar_function
from snapbeam.solver.physics import shaker_motion, sincos
from snapbeam.solver.simd import WIDTH, fma, lanes_sum, load, splat

_TWO_PI = 2.0 * math.pi


# Motions of a tip, a base and an axial load that are integrated as one drive: each by its own kind, from one argument.


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


_registered: set[Any] = set()


def _register_shared() -> None:
    """Have Numba compile the functions that motions share, those of drives that came later included."""
    for each in SCALAR:
        if each not in _registered:
            _registered.add(each)
            overload(each, jit_options=INLINE_HERE, strict=False)(lambda *types, own=each: own)


def _of_kind(kind: Any, what: str) -> Any:
    """The motion or the acceleration of a kind of drive, as a function of its numbers, memory and its argument."""
    _register_shared()
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
    """Acceleration of a drive by type, m/s^2."""
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


def part_acceleration(owner: Any, part: str) -> Any:
    """The same of its acceleration, m/s^2."""
    return _of_part(owner, part, "acceleration")


def motion_by_number(owner: Any, kind: str) -> Any:
    """A function of numbers, memory, the argument and j: displacement and velocity of the part *kind* j, if it moves."""
    return _by_number({j: part_motion(owner, part) for j, part in parts_of(owner, kind).items()}, _no_motion)


def acceleration_by_number(owner: Any, kind: str) -> Any:
    """The same of the acceleration, or of a force."""
    parts = parts_of(owner, kind)
    return _by_number({j: part_acceleration(owner, part) for j, part in parts.items()}, _nothing)


def bound_by_number(owner: Any, kind: str) -> Any:
    """The same of the bound on the acceleration, or on a force."""
    parts = parts_of(owner, kind)
    return _by_number({j: _number(owner, f"{part}_hardest") for j, part in parts.items()}, _nothing)


def _number(owner: Any, name: str) -> Any:
    """A function that reads one number of a drive."""
    at = owner.number_names.index(name)

    @inlined
    def read(drive, memory, argument):
        return drive[at]

    return read


def _by_number(functions: dict[int, Any], other: Any) -> Any:
    """A function that calls the one of its last parameter, chosen as the integration goes, or else *other*."""
    if not functions:

        @inlined
        def none(drive, memory, argument, number):
            return other(drive, memory, argument)

        return none
    (first, own), *later = functions.items()
    rest = _by_number(dict(later), other)

    @inlined
    def chosen(drive, memory, argument, number):
        if number == first:
            return own(drive, memory, argument)
        return rest(drive, memory, argument, number)

    return chosen


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


class Tip(NamedTuple):
    """A tip, positive as it pushes: ``penetration = offset + motion - row . q``.

    The contact's row carries the sign of the side.
    """

    offset: float
    """Penetration of the tip at mid-stroke into the beam at rest."""
    law: Any
    """Numbers of the law of contact, a named tuple whose type says which law it is."""
    drive: Any
    """Numbers of the drive likewise; ``drive.omega`` is the rate of its argument, rad/s."""


@inlined
def tip_about_well(tip, well_sign, rest):
    """The tip in coordinates about the well *well_sign*: +1 the one that *rest* is measured in, -1 the other."""
    return Tip(tip.offset + (1.0 - well_sign) * rest, tip.law, tip.drive)


def tip_motion(drive: Any, memory: Any, argument: float) -> tuple[float, float]:
    """Displacement of the tip from its mid-position, m, and its velocity, m/s."""
    if type(drive).owner.harmonic:
        sine, cosine = sincos.py_func(argument)
        motion: tuple[float, float] = shaker_motion.py_func(drive.amplitude, drive.omega, sine, cosine)
        return motion
    owner: Any = type(drive).owner
    if owner.parts:
        return joined_motion(drive, memory, argument)
    moved: tuple[float, float] = owner.motion(drive, memory, argument)
    return moved


@overloaded(tip_motion)
def _tip_motion(drive, memory, argument):
    owner = drive.instance_class.owner
    if owner.harmonic:

        def harmonic(drive, memory, argument):
            sine, cosine = sincos(argument)
            return shaker_motion(drive.amplitude, drive.omega, sine, cosine)

        return harmonic
    if owner.parts:
        return lambda drive, memory, argument: joined_motion(drive, memory, argument)
    motion = kind_motion(owner)
    return lambda drive, memory, argument: motion(drive, memory, argument)


def tip_acceleration(drive: Any, memory: Any, argument: float) -> float:
    """Acceleration of the tip, m/s^2."""
    if type(drive).owner.harmonic:
        sine, _ = sincos.py_func(argument)
        return float(-drive.omega * drive.omega * drive.amplitude * sine)
    owner: Any = type(drive).owner
    if owner.parts:
        raise TypeError("accelerations of joined motions are known in compiled code only")
    return float(owner.acceleration(drive, memory, argument))


@overloaded(tip_acceleration)
def _tip_acceleration(drive, memory, argument):
    owner = drive.instance_class.owner
    if owner.harmonic:

        def harmonic(drive, memory, argument):
            sine, _ = sincos(argument)
            return -drive.omega * drive.omega * drive.amplitude * sine

        return harmonic
    if owner.parts:
        tip, base = _of_part(owner, "tip", "acceleration"), _of_part(owner, "base", "acceleration")
        if "base_follow" not in drive.fields:
            return lambda drive, memory, argument: tip(drive, memory, argument)
        return lambda drive, memory, argument: (
            tip(drive, memory, argument) + drive.base_follow * base(drive, memory, argument)
        )
    acceleration = kind_acceleration(owner)
    return lambda drive, memory, argument: acceleration(drive, memory, argument)


def turned_motion(
    drive: Any, memory: Any, argument: float, sine: float, cosine: float
) -> tuple[float, float]:
    """Motion as :func:`tip_motion`, from sine and cosine of the argument, or from the argument."""
    if type(drive).owner.harmonic:
        motion: tuple[float, float] = shaker_motion.py_func(drive.amplitude, drive.omega, sine, cosine)
        return motion
    return tip_motion(drive, memory, argument)


@overloaded(turned_motion)
def _turned_motion(drive, memory, argument, sine, cosine):
    if drive.instance_class.owner.harmonic:
        return lambda drive, memory, argument, sine, cosine: shaker_motion(
            drive.amplitude, drive.omega, sine, cosine
        )
    if drive.instance_class.owner.parts:
        return lambda drive, memory, argument, sine, cosine: joined_motion(drive, memory, argument)
    motion = kind_motion(drive.instance_class.owner)
    return lambda drive, memory, argument, sine, cosine: motion(drive, memory, argument)


@called
def _sums_in_registers(memory, table, t, low, width):
    displacement, velocity, acceleration = splat(0.0), splat(0.0), splat(0.0)
    for row in range(table, table + LINES, WIDTH):
        rate = fma(width, load(memory, row), splat(low))
        sine, cosine = sincos(fma(t, rate, load(memory, row + LINES)))
        displacement = displacement + sine / rate
        velocity = velocity + cosine
        acceleration = acceleration - sine * rate
    return lanes_sum(displacement), lanes_sum(velocity), lanes_sum(acceleration)


@overload(drive_sincos, jit_options=INLINE_HERE)
def _sincos(angle):
    return lambda angle: sincos(angle)


@overload(sums_of_sines, jit_options=INLINE_HERE)
def _sums_of_sines(memory, table, t, low, width):
    return lambda memory, table, t, low, width: _sums_in_registers(memory, table, t, low, width)


def drive_rate(drive: Any) -> float:
    """Maximum angular frequency of a drive's motion, rad/s."""
    return float(drive.fastest if "fastest" in drive._fields else drive.omega)


@overloaded(drive_rate)
def _drive_rate(drive):
    if "fastest" in drive.fields:
        return lambda drive: drive.fastest
    return lambda drive: drive.omega


def numbers_of(template: Any, table: Any, row: int) -> Any:
    """The numbers in a row of a table as the named tuple that *template* is one of."""
    return type(template)(*(float(value) for value in table[row]))


@intrinsic
def _read_numbers(typingctx: Any, template: Any, table: Any, row: Any) -> Any:
    count = len(template)

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        array = context.make_array(signature.args[1])(context, builder, args[1])
        width = builder.extract_value(array.strides, 0)
        start = builder.ptrtoint(array.data, width.type)
        start = builder.add(start, builder.mul(args[2], width))
        pointer = builder.inttoptr(start, ir.DoubleType().as_pointer())
        values = [builder.load(builder.gep(pointer, [ir.Constant(width.type, j)])) for j in range(count)]
        return context.make_tuple(builder, signature.return_type, values)

    return template(template, table, types.intp), codegen


@overloaded(numbers_of)
def _numbers_of(template, table, row):
    return lambda template, table, row: _read_numbers(template, table, row)
