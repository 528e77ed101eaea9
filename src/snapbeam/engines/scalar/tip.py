"""The striker's tip as kernels see it: where it is, how it moves, and the law by which it touches."""

from __future__ import annotations

from typing import Any, NamedTuple

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from snapbeam.engines.scalar.compile import inlined, overloaded
from snapbeam.engines.scalar.joined import joined_motion, kind_acceleration, kind_motion
from snapbeam.engines.scalar.physics import shaker_motion, sincos

__all__ = ["Tip", "drive_rate", "numbers_of", "seen_from", "tip_acceleration", "tip_motion", "turned_motion"]


class Tip(NamedTuple):
    """A tip, seen from the side it pushes from: ``penetration = offset + motion - row . q``.

    The contact's row carries the sign of the side.
    """

    offset: float
    """Penetration of the tip at mid-stroke into the beam at rest."""
    law: Any
    """Numbers of the law of contact, a named tuple whose type says which law it is."""
    drive: Any
    """Numbers of the drive likewise; ``drive.omega`` is the rate of its argument, rad/s."""


@inlined
def seen_from(tip, well_sign, rest):
    """The tip as seen from the well *home*: +1 the one that rest is measured in, -1 the other."""
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
    return float(owner.acceleration(drive, memory, argument))


@overloaded(tip_acceleration)
def _tip_acceleration(drive, memory, argument):
    owner = drive.instance_class.owner
    if owner.harmonic:

        def harmonic(drive, memory, argument):
            sine, _ = sincos(argument)
            return -drive.omega * drive.omega * drive.amplitude * sine

        return harmonic
    if owner.parts:  # under Newton's law alone, which is refused beside what else moves
        return lambda drive, memory, argument: 0.0
    acceleration = kind_acceleration(owner)
    return lambda drive, memory, argument: acceleration(drive, memory, argument)


def turned_motion(
    drive: Any, memory: Any, argument: float, sine: float, cosine: float
) -> tuple[float, float]:
    """As :func:`tip_motion`, for a caller that knows the sine and cosine of the argument, or else the argument."""
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


def drive_rate(drive: Any) -> float:
    """Greatest angular frequency of a drive's motion, rad/s."""
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
