"""Drives that do not repeat: their motion is a formula of the time since they began."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.drive.base import Drive, Scale

__all__ = ["HORIZON", "Timed"]

_Array = NDArray[np.float64]

HORIZON = 1 << 24
"""Cycles in which the argument of such a drive makes its one turn: more than a run may last."""


class Timed(Drive):
    """A drive whose motion depends on the time since it began; its displacement begins at zero, without a jump.

    Kernels get the argument omega t, where omega is so small that it never turns round; ``fastest`` bounds the angular
    frequency of what happens, rad/s.  A subclass brings :meth:`cycle`, :meth:`shape_numbers`, :meth:`bounds`, and
    ``motion`` and ``acceleration``.
    """

    repeats = False

    def shape_numbers(self, columns: Mapping[str, _Array], scale: Scale) -> dict[str, _Array]:
        """The numbers beside ``omega``."""
        raise NotImplementedError

    def numbers(self, columns: Mapping[str, _Array], scale: Scale) -> dict[str, _Array]:
        """The rate of the argument, and what the subclass needs."""
        return {"omega": 2.0 * math.pi / (HORIZON * self.cycle(columns, scale))} | self.shape_numbers(
            columns, scale
        )
