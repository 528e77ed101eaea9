"""Base excitation and axial load: forces on every mode that follow from time.

In the frame of the ends an acceleration a(t) of the base is the modal acceleration a(t) b; a change dP(t) of the axial
load is dP(t) (g + G q), that is dP more of both that the tension pulls with.  Both depend on position and time alone,
so that kicks stay what they were: a(t) and dP(t) at hand stand in memory, and are entered before each kick.

*forced* is a :class:`TimeDependentForces` or None, by type: without a base and a load nothing of this is compiled.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from numba.extending import overload

from snapbeam.solver.compilation import INLINE_HERE, inlined
from snapbeam.solver.excitation import base_acceleration, load_change
from snapbeam.solver.simd import WIDTH, broadcast_load, fma, lanes_sum, load, splat

__all__ = [
    "ExternalWork",
    "TimeDependentForces",
    "add_base_acceleration",
    "changed_load",
    "enter_forces",
    "extra_speed",
    "no_external_work",
    "shaken_along",
    "worked",
]


class TimeDependentForces(NamedTuple):
    """Where in memory the forces stand."""

    base_load: int
    """What an acceleration of the base does to p, a row of the structure."""
    now: int
    """Acceleration of the base (m/s^2) and change of the axial load (N) at hand."""
    kick: int
    """Room for the acceleration of a kick."""


class ExternalWork(NamedTuple):
    """Work on the beam within a step, J, of the base and of the axial load, and the size of its parts."""

    base: float
    load: float
    gross: float


@inlined
def no_external_work():
    """Of a step that has not begun."""
    return ExternalWork(0.0, 0.0, 0.0)


def enter_forces(forced: Any, memory: Any, drive: Any, argument: float) -> None:
    """Put the forces at an argument of the drive at hand."""
    raise TypeError("enter_forces runs in compiled code only")


@overload(enter_forces, jit_options=INLINE_HERE)
def _enter_forces(forced, memory, drive, argument):
    if not hasattr(forced, "fields"):
        return lambda forced, memory, drive, argument: None

    def implementation(forced, memory, drive, argument):
        memory[forced.now] = base_acceleration(drive, memory, argument)
        memory[forced.now + 1] = load_change(drive, memory, argument)

    return implementation


@inlined
def changed_load(memory, forced, along_g, along_r):
    """How much of g and of r the tension pulls with, the change of the axial load included."""
    if forced is None:
        return along_g, along_r
    change = memory[forced.now + 1]
    return along_g + change, along_r + change


@inlined
def add_base_acceleration(memory, forced, row, k):
    """An acceleration with what the base adds."""
    if forced is None:
        return k
    return fma(broadcast_load(memory, forced.now), load(memory, forced.base_load + row), k)


@inlined
def shaken_along(memory, size, forced, contact, along):
    """The same along the contact's row."""
    if forced is None:
        return along
    total = splat(0.0)
    for row in range(0, size, WIDTH):
        total = fma(load(memory, forced.base_load + row), load(memory, contact + row), total)
    return along + memory[forced.now] * lanes_sum(total)


def extra_speed(forced: Any, memory: Any, size: int, drive: Any, along: int, horizon: float) -> float:
    """A speed along a row that the base cannot give within a time."""
    raise TypeError("extra_speed runs in compiled code only")


@overload(extra_speed, jit_options=INLINE_HERE)
def _extra_speed(forced, memory, size, drive, along, horizon):
    if not hasattr(forced, "fields") or "base_hardest" not in drive.fields:
        return lambda forced, memory, size, drive, along, horizon: 0.0

    def implementation(forced, memory, size, drive, along, horizon):
        total = 0.0
        for row in range(size):
            total += abs(memory[forced.base_load + row] * memory[along + row])
        return total * drive.base_hardest * horizon

    return implementation


@inlined
def worked(memory, size, forced, weight, g, r, kick, p, given):
    """Work of a kick by the base and by the load, exact: of each force times p at the kick's middle.

    *kick* is the row of the whole acceleration of the kick, contact included.
    """
    shaking, change = memory[forced.now], memory[forced.now + 1]
    base, load_work, half = splat(0.0), splat(0.0), 0.5 * weight
    for row in range(0, size, WIDTH):
        middle = fma(half, load(memory, kick + row), load(memory, p + row))
        base = fma(load(memory, forced.base_load + row), middle, base)
        load_work = fma(load(memory, g + row) + load(memory, r + row), middle, load_work)
    of_base, of_load = weight * shaking * lanes_sum(base), weight * change * lanes_sum(load_work)
    return ExternalWork(given.base + of_base, given.load + of_load, given.gross + abs(of_base) + abs(of_load))
