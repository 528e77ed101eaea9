"""Motion of a striker, a base, an axial load or a force at one instant, from the numbers of its drive."""

from __future__ import annotations

import math
from typing import Any


def tip_motion(drive: Any, memory: Any, argument: float) -> tuple[float, float]:
    """Displacement of the tip from its mid-position, m, and its velocity, m/s, in the frame of the ends."""
    owner: Any = type(drive).owner
    if owner.harmonic:
        return drive.amplitude * math.sin(argument), drive.amplitude * drive.omega * math.cos(argument)
    if not owner.parts:
        moved: tuple[float, float] = owner.motion(drive, memory, argument)
        return moved
    w, speed = 0.0, 0.0
    for part, share in (("tip", 1.0), ("base", getattr(drive, "base_follow", 0.0))):
        kind = dict(owner.parts).get(part)
        if kind is None:
            continue
        numbers = kind.numbers_type()(*(getattr(drive, f"{part}_{name}") for name in kind.number_names))
        at = argument
        if not owner.alone:
            at = argument / drive.omega * getattr(drive, f"{part}_omega") + getattr(drive, f"{part}_phase")
        own = tip_motion(numbers, memory, at)
        w, speed = w + share * own[0], speed + share * own[1]
    return w, speed
