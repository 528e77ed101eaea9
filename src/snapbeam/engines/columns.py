"""What describes one run of an ensemble to an engine: a record by name, SI units, seen from the striker's side."""

from __future__ import annotations

from typing import Any

import numpy as np

__all__ = ["RUN"]

_REALS = (
    "offset",  # penetration of the tip at mid-stroke into the beam at rest
    "tip_speed",  # greatest speed of the tip, ever
    "phase",  # argument of the drive at the start, rad
    "rest_contact",  # displacement of the contact point and of the centre in the well that q is counted from
    "rest_center",
    "tick",  # s
    "decide_energy",  # energy above the well below which a beam in the far well stays there; -inf: never decide
    "decide_reach",  # highest future position of the tip, or 0 if that is higher
    "contact_time",  # s since the present contact began; negative: apart; NaN: the penetration decides
    "lowest",  # height of a flight that is too low to be seen, m
    "circuit_rate",  # of a harvester's circuit, 1/s
    "home",  # +1 if q and p are counted from the first well, -1 from the other
)
_INTEGERS = (
    "step",  # ticks of a flight step
    "period",  # ticks in which the drive's argument makes one turn
    "landing",  # ticks from one state that is handed out to the next; the whole run if none is
    "end",
    "last_quarter",
    "decide_crossings",  # crossings in the last quarter beyond which it is continuous; -1: never decide
    "coarsest",  # halvings of the flight step that make the longest contact step
    "finest",  # and the shortest
    "contact_row",
    "start_row",
)

RUN: np.dtype[Any] = np.dtype(
    [(name, np.float64) for name in _REALS] + [(name, np.int64) for name in _INTEGERS], align=True
)
