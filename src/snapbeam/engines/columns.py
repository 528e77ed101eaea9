"""Which column of the kernels' arrays holds what."""

from __future__ import annotations

from enum import IntEnum

__all__ = ["Counts", "Numbers", "Reals", "Ticks"]


class Counts(IntEnum):
    """Integers that a run keeps."""

    STATUS = 0
    TIME = 1
    """Ticks marched."""
    TOUCHING = 2
    ONSET = 3
    """Tick at which the present contact began."""
    SIDE = 4
    """Sign of the centre displacement, -1 in the well the run began in."""
    CROSSINGS = 5
    CROSSINGS_LAST_QUARTER = 6
    IMPACTS = 7
    STEPS = 8
    SAMPLES = 9


class Numbers(IntEnum):
    """Floats that a run keeps, in SI units, seen from the shaker's side."""

    LAST_CROSSING = 0
    MIN_DISPLACEMENT = 1
    MAX_DISPLACEMENT = 2
    MIN_CENTER = 3
    MAX_CENTER = 4
    PEAK_FORCE = 5
    CONTACT_TIME = 6
    WORK = 7
    GROSS_WORK = 8
    DISSIPATED = 9
    ENERGY = 10
    DEEPEST = 11
    """Greatest penetration of the present contact."""
    IMPULSE = 12
    """Impulse of the present contact."""
    DECIDED_AT = 13


class Reals(IntEnum):
    """Floats that describe a run, in SI units, seen from the shaker's side."""

    OFFSET = 0
    """Penetration of the shaker at mid-stroke into a beam at rest."""
    AMPLITUDE = 1
    OMEGA = 2
    STIFFNESS = 3
    REST_CONTACT = 4
    REST_CENTER = 5
    TICK = 6
    DECIDE_ENERGY = 7
    DECIDE_REACH = 8


class Ticks(IntEnum):
    """Integers that describe a run."""

    STEP = 0
    PERIOD = 1
    END = 2
    LAST_QUARTER = 3
    DECIDE_CROSSINGS = 4
    CONTACT_ROW = 5
    START_ROW = 6
