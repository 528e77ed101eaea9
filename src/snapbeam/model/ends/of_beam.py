"""The buckling modes of a beam, whatever its ends."""

from __future__ import annotations

import math

from snapbeam.model.ends.ends import BoundaryConditions
from snapbeam.model.ends.modes import SpringModes
from snapbeam.model.galerkin.modes import BucklingModes

__all__ = ["Modes", "modes_between"]

Modes = BucklingModes | SpringModes


def modes_between(ends: BoundaryConditions, length: float, bending_stiffness: float, count: int) -> Modes:
    """The first *count* buckling modes of a beam of a length (m) and a bending stiffness (N m^2) between its ends."""
    if not ends.rotational_stiffness:
        return BucklingModes(length, count)
    unit = bending_stiffness / length
    left, right = (
        math.inf if each is None else each / unit
        for each in (ends.left_rotational_stiffness, ends.right_rotational_stiffness)
    )
    return SpringModes(length, count, left, right)
