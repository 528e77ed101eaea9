"""Velocity jumps of a drive, such as the end of a shock: steps must not cross them, or they lose their order.

A drive names the times of its jumps (:attr:`~snapbeam.model.drive.base.Drive.discontinuities`).  Of one that does not, as the
paper's, nothing of this is compiled.  Steps end a few ticks before a jump and after it.  The step between is taken in
two parts, of which one ends at the jump and the other begins there.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from numba.extending import overload

from snapbeam.solver.compilation import INLINE_HERE, inlined

_TWO_PI = 2.0 * math.pi
_MARGIN = 2
"""Ticks on either side of a jump, between which one step goes across it."""
APART = 8e-15
"""Distance from a jump, rad, at which both parts of a step evaluate the motion, beyond rounding."""


class Jump(NamedTuple):
    """A time at which a velocity jumps."""

    time: str
    """The number that holds it, s since what jumps began."""
    begun: tuple[tuple[str, str], ...]
    """Names of phase and rate of the argument of each motion in a combination, for the order of the jumps."""


def jumps_of(kind: Any, prefix: str = "") -> list[Jump]:
    """The times at which the velocity of a drive jumps, as numbers of it, those of its parts and terms included."""
    parts = [(f"{prefix}{part}_", each, kind.alone) for part, each in kind.parts]
    parts += [(f"{prefix}t{i}_", each, False) for i, each in enumerate(kind.terms, 1)]
    found = [Jump(f"{prefix}{name}", ()) for name in kind.discontinuities]
    for own, each, alone in parts:
        begun = () if alone else ((f"{own}phase", f"{own}omega"),)
        found += [Jump(jump.time, jump.begun + begun) for jump in jumps_of(each, own)]
    return found


def _time_of(jump: Jump, fields: tuple[str, ...]) -> Any:
    """A function of the numbers of a drive: when it jumps, s since the whole of it began."""
    at = fields.index(jump.time)

    @inlined
    def own(drive):
        return drive[at]

    for phase, omega in jump.begun:
        own = _later(own, fields.index(phase), fields.index(omega))
    return own


def _later(own: Any, phase: int, omega: int) -> Any:
    @inlined
    def later(drive):
        return own(drive) - drive[phase] / drive[omega]

    return later


@inlined
def _ticks(time, omega, phase, period):
    """The tick of a jump, not a whole number."""
    return (time * omega - phase) / _TWO_PI * period


def _within(jumps: list[Jump], fields: tuple[str, ...]) -> Any:
    """A function that finds the first jump within some ticks."""
    time, rest = _time_of(jumps[0], fields), _within(jumps[1:], fields) if len(jumps) > 1 else None

    @inlined
    def one(drive, phase, period, t, ticks):
        after = _ticks(time(drive), drive.omega, phase, period) - t
        return after if 0.0 < after < ticks else -1.0

    if rest is None:
        return one

    @inlined
    def all_of_them(drive, phase, period, t, ticks):
        first, other = one(drive, phase, period, t, ticks), rest(drive, phase, period, t, ticks)
        return first if other < 0.0 or 0.0 < first < other else other

    return all_of_them


def _limited(jumps: list[Jump], fields: tuple[str, ...]) -> Any:
    """A function that ends a step at the first border of any jump."""
    time, rest = _time_of(jumps[0], fields), _limited(jumps[1:], fields) if len(jumps) > 1 else None

    @inlined
    def one(drive, phase, period, t, limit):
        ticks = _ticks(time(drive), drive.omega, phase, period)
        if ticks > t - _MARGIN and ticks < limit + _MARGIN:
            before, behind = int(ticks) - _MARGIN, int(ticks) + 1 + _MARGIN
            if before > t:
                return min(limit, before)
            if behind > t:
                return min(limit, behind)
        return limit

    if rest is None:
        return one

    @inlined
    def all_of_them(drive, phase, period, t, limit):
        return rest(drive, phase, period, t, one(drive, phase, period, t, limit))

    return all_of_them


def up_to_discontinuity(drive: Any, phase: float, period: int, t: int, limit: int) -> int:
    """The tick at which a step from tick *t* ends at the latest: *limit*, or a border of a jump before it.

    Parameters
    ----------
    drive : numbers of a drive
    phase : float
        Its argument at tick 0.
    period : int
        Ticks in which the argument makes a turn.
    t, limit : int
        Ticks.
    """
    raise TypeError("up_to_discontinuity runs in compiled code only")


@overload(up_to_discontinuity, jit_options=INLINE_HERE)
def _up_to_discontinuity(drive, phase, period, t, limit):
    jumps = jumps_of(drive.instance_class.owner)
    if not jumps:
        return lambda drive, phase, period, t, limit: limit
    limited = _limited(jumps, tuple(drive.fields))
    return lambda drive, phase, period, t, limit: limited(drive, phase, period, t, limit)


def discontinuity_within(drive: Any, phase: float, period: int, t: int, ticks: float) -> float:
    """Number of ticks after tick *t* to the first jump of the drive within *ticks*; -1 if there is none.

    Other parameters are those of :func:`up_to_discontinuity`.
    """
    raise TypeError("discontinuity_within runs in compiled code only")


@overload(discontinuity_within, jit_options=INLINE_HERE)
def _discontinuity_within(drive, phase, period, t, ticks):
    jumps = jumps_of(drive.instance_class.owner)
    if not jumps:
        return lambda drive, phase, period, t, ticks: -1.0
    within = _within(jumps, tuple(drive.fields))
    return lambda drive, phase, period, t, ticks: within(drive, phase, period, t, ticks)
