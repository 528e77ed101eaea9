"""A tip that flies, or presses, at a constant speed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.drive.base import Scale, Timed
from snapbeam.model.drive.components import Component, in_pieces
from snapbeam.model.quantity import RUN, quantity

_Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class ConstantVelocity(Timed):
    """A constant velocity towards the beam, w_s(t) = w_0 + v t, v = speed b omega_1.

    Of a striker with a mass and no spring, that is a body thrown at the beam; without a mass it is a slow press, or a
    fast one, that never stops.  A cycle is a period of the first mode.

    Parameters
    ----------
    speed : float
        Velocity over b omega_1, at least 0.

    See Also
    --------
    snapbeam.FixedStop, snapbeam.Striker

    Examples
    --------
    >>> import snapbeam as sb
    >>> striker = sb.Striker(drive=sb.ConstantVelocity(speed=0.1))
    """

    speed: float = quantity(
        "1", "speed of the striker over b omega_1", low=0.0, closed="left", scope=RUN, short="striker_speed"
    )

    name = "constant_velocity"

    def components(self, columns: Mapping[str, _Array], scale: Scale) -> list[Component]:
        """v t."""
        return [in_pieces((np.zeros(1), {1: self.shape_numbers(columns, scale)["speed"]}))]

    def cycle(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """A period of the first mode."""
        return np.full(columns["speed"].size, 2.0 * math.pi / scale.omega)

    def shape_numbers(self, columns: Mapping[str, _Array], scale: Scale) -> dict[str, _Array]:
        """The speed in m/s."""
        nothing = np.zeros(columns["speed"].size)
        return {"fastest": nothing, "speed": columns["speed"] * scale.length * scale.omega}

    def bounds(self, columns: Mapping[str, _Array], scale: Scale) -> tuple[_Array, _Array]:
        """Bounds of displacement and velocity: the displacement is unbounded."""
        speed = columns["speed"] * scale.length * scale.omega
        return np.where(speed > 0.0, np.inf, 0.0), speed
