"""Boundary conditions of a beam: rotational springs and the axial stiffness of the supports."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from snapbeam.model.buckling_modes import MAX_MODES, BucklingModes, SpringModes
from snapbeam.model.quantity import check_fields, quantity
from snapbeam.util.validation import integer


@dataclass(frozen=True, kw_only=True)
class BoundaryConditions:
    """Ends that do not move sideways, each on a rotational spring.

    E I phi'' = k_left phi' at the left end and -k_right phi' at the right one. The buckling modes stay orthogonal in
    their slopes and, with the energy of the springs, in their curvatures: the reduced model has the same form, with
    other masses, shapes and critical loads.

    Supports that give way along the axis, with the stiffness K between them, share the stretching with the beam:
    gamma = (E S/(2 L))/(1 + E S/(K L)).

    Parameters
    ----------
    left_rotational_stiffness, right_rotational_stiffness : float, optional
        Rotational stiffness, N m/rad: 0 is a pinned end, None (the default) a clamped one.
    axial_support_stiffness : float, optional
        Stiffness K, N/m; rigid by default.

    See Also
    --------
    snapbeam.Beam

    Examples
    --------
    >>> import snapbeam as sb
    >>> ends = sb.BoundaryConditions(left_rotational_stiffness=5.0, right_rotational_stiffness=5.0)
    >>> ends.is_clamped
    False
    """

    left_rotational_stiffness: float | None = quantity(
        "N m/rad", "rotational stiffness of the left end", default=None, optional=True, low=0.0, closed="left",
        symbol=r"k_\theta",
    )  # fmt: skip
    right_rotational_stiffness: float | None = quantity(
        "N m/rad", "rotational stiffness of the right end", default=None, optional=True, low=0.0, closed="left",
    )  # fmt: skip
    axial_support_stiffness: float | None = quantity(
        "N/m", "axial stiffness of the supports", default=None, optional=True, low=0.0
    )

    def __post_init__(self) -> None:
        check_fields(self)

    @property
    def is_elastic(self) -> bool:
        """True if an end can rotate, against a spring or freely."""
        return self.left_rotational_stiffness is not None or self.right_rotational_stiffness is not None

    @property
    def is_symmetric(self) -> bool:
        """True if both ends have the same rotational stiffness, so that modes are symmetric or antisymmetric."""
        return self.left_rotational_stiffness == self.right_rotational_stiffness

    @property
    def is_clamped(self) -> bool:
        """True if both ends are clamped and rigid."""
        return not self.is_elastic and self.axial_support_stiffness is None


CLAMPED = BoundaryConditions()
"""Boundary conditions of the paper: rigid clamps."""


# ----------------------------------------------------------------------------------------------------
# The buckling modes of a beam, whatever its ends.


Modes = BucklingModes | SpringModes


def modes_between(ends: BoundaryConditions, length: float, bending_stiffness: float, count: int) -> Modes:
    """The first *count* buckling modes of a beam of a length (m) and a bending stiffness (N m^2) between its ends."""
    return _modes_between(ends, length, bending_stiffness, integer("count", count, 1, MAX_MODES))


@lru_cache(maxsize=64)  # each step along a branch of equilibria asks for them several times
def _modes_between(ends: BoundaryConditions, length: float, bending_stiffness: float, count: int) -> Modes:
    if ends.is_elastic:
        unit = bending_stiffness / length
        left, right = (
            math.inf if each is None else each / unit
            for each in (ends.left_rotational_stiffness, ends.right_rotational_stiffness)
        )
        found: Modes = SpringModes(length, count, left, right)
    else:
        found = BucklingModes(length, count)
    for each in vars(found).values():
        if isinstance(each, np.ndarray):
            each.setflags(write=False)
    return found
