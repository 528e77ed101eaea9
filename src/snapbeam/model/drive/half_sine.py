"""A half-sine pulse of the tip."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.drive.base import Scale, Timed, displacement_ratio
from snapbeam.model.drive.components import Component, half_tone
from snapbeam.model.quantity import RUN, quantity

_Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class HalfSine(Timed):
    """Half-sine shock: the tip moves out and back once and stays at its mid-position.

    The displacement of the tip is

        w_s(t) = w_0 + A sin(pi t/T)  for t < T.

    A cycle is a period of the first mode.

    Parameters
    ----------
    displacement_amplitude : float
        A over the buckling level b.
    duration : float
        T over the period of the first mode.

    See Also
    --------
    snapbeam.Shock, snapbeam.Burst

    Examples
    --------
    >>> import snapbeam as sb
    >>> striker = sb.Striker(drive=sb.HalfSine(displacement_amplitude=0.5, duration=0.5))
    """

    displacement_amplitude: float = displacement_ratio()
    duration: float = quantity(
        "1", "duration of the shock over the period of the first mode", low=0.0, scope=RUN, short="shock_duration"
    )

    name = "half_sine"
    discontinuities = ("duration",)

    def components(self, columns: Mapping[str, _Array], scale: Scale) -> list[Component]:
        """Half a tone."""
        found = self.shape_numbers(columns, scale)
        return half_tone(found["amplitude"], found["duration"])

    def cycle(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """A period of the first mode."""
        return np.full(columns["duration"].size, 2.0 * math.pi / scale.omega)

    def shape_numbers(self, columns: Mapping[str, _Array], scale: Scale) -> dict[str, _Array]:
        """The amplitude in m, the duration in s."""
        duration = columns["duration"] * self.cycle(columns, scale)
        amplitude = columns["displacement_amplitude"] * scale.length
        return {"fastest": math.pi / duration, "amplitude": amplitude, "duration": duration}

    def bounds(self, columns: Mapping[str, _Array], scale: Scale) -> tuple[_Array, _Array]:
        """Amplitudes of displacement and velocity."""
        found = self.shape_numbers(columns, scale)
        return found["amplitude"], found["amplitude"] * found["fastest"]
