"""A tip that does not move."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.drive.base import Drive, Scale

_Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class FixedStop(Drive):
    """Fixed stop, without motion.  A cycle is a period of the first mode.

    See Also
    --------
    snapbeam.Striker, snapbeam.ConstantVelocity

    Examples
    --------
    >>> import snapbeam as sb
    >>> stop = sb.Striker(drive=sb.FixedStop(), gap=1e-4)
    """

    name = "fixed"
    harmonic = True

    def numbers(self, columns: Mapping[str, _Array], scale: Scale) -> dict[str, _Array]:
        """The first natural frequency and no amplitude."""
        runs = next(iter(columns.values())).size
        return {"omega": np.full(runs, scale.omega), "amplitude": np.zeros(runs)}

    def cycle(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """A period of the first mode."""
        return np.full(next(iter(columns.values())).size, 2.0 * math.pi / scale.omega)

    def frequencies(self, columns: Mapping[str, _Array], scale: Scale) -> list[_Array]:
        """None: it repeats after any time."""
        return []

    def bounds(self, columns: Mapping[str, _Array], scale: Scale) -> tuple[_Array, _Array]:
        """Bounds of displacement and velocity: zero."""
        nothing = np.zeros(next(iter(columns.values())).size)
        return nothing, nothing
