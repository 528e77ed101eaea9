"""Where the velocity of a drive jumps, as at the end of a shock: no step may go across, or it loses its order.

A drive names the times of its jumps (:attr:`~snapbeam.model.drive.base.Drive.edges`).  Of one that does not, as the
paper's, nothing of this is compiled.
"""

from __future__ import annotations

import math
from typing import Any

from numba.extending import overload

from snapbeam.engines.scalar.compile import INLINE_HERE, inlined

__all__ = ["edge_times", "up_to_edge"]

_TWO_PI = 2.0 * math.pi
_MARGIN = 2
"""Ticks on either side of a jump, between which one step goes across it: far less than any error of a run."""


def _terms_of(kind: Any, prefix: str) -> list[str]:
    """The times of the jumps, s since the whole drive began, as formulas of its numbers."""
    parts = [(f"{prefix}{part}_", each, kind.alone) for part, each in kind.parts]
    parts += [(f"{prefix}t{i}_", each, False) for i, each in enumerate(kind.terms, 1)]
    found = [f"drive.{prefix}{name}" for name in kind.edges]
    for own, each, alone in parts:
        begun = "" if alone else f" - drive.{own}phase / drive.{own}omega"
        found += [f"{time}{begun}" for time in _terms_of(each, own)]
    return found


def edge_times(kind: Any) -> Any:
    """A function of the numbers of a drive: the times at which its velocity jumps, s since it began, a tuple.

    None if there are none.
    """
    terms = _terms_of(kind, "")
    if not terms:
        return None
    made: dict[str, Any] = {}
    exec(f"def times(drive):\n    return ({', '.join(terms)},)", made)
    return inlined(made["times"])


def up_to_edge(drive: Any, phase: float, period: int, t: int, limit: int) -> int:
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
    raise TypeError("up_to_edge runs in compiled code only")


@overload(up_to_edge, jit_options=INLINE_HERE)
def _up_to_edge(drive, phase, period, t, limit):
    times = edge_times(drive.instance_class.owner)
    if times is None:
        return lambda drive, phase, period, t, limit: limit

    def implementation(drive, phase, period, t, limit):
        for time in times(drive):
            ticks = (time * drive.omega - phase) / _TWO_PI * period
            if ticks > t - _MARGIN and ticks < limit + _MARGIN:
                before, behind = int(ticks) - _MARGIN, int(ticks) + 1 + _MARGIN
                if before > t:
                    limit = min(limit, before)
                elif behind > t:
                    limit = min(limit, behind)
        return limit

    return implementation
