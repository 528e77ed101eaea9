"""A half-sine pulse of the tip."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.drive.base import Scale, Timed, displacement_ratio
from snapbeam.model.drive.components import Component, Tone, in_pieces
from snapbeam.model.quantity import RUN, quantity

_Array = NDArray[np.float64]


def duration_of_pulse() -> Any:
    """Return the field of a duration over the period of the first mode."""
    text = "duration over the period of the first mode"
    return quantity("1", text, low=0.0, scope=RUN, short="shock_duration")


@dataclass(frozen=True, kw_only=True)
class HalfSinePulse(Timed):
    """A half sine, whose amplitude (m, N) its kind gives."""

    duration: float = duration_of_pulse()
    discontinuities = ("duration",)

    def _amplitude(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        raise NotImplementedError

    def components(self, columns: Mapping[str, _Array], scale: Scale) -> list[Component]:
        """A sin(pi t/T) for t < T, and 0 after it."""
        found = self.shape_numbers(columns, scale)
        ended = found["duration"]
        window = in_pieces((np.zeros(1), {0: np.ones(1)}), (ended, {}))
        return [Tone(found["amplitude"], math.pi / ended, window=window)]

    def cycle(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """A period of the first mode."""
        return np.full(columns["duration"].size, 2.0 * math.pi / scale.omega)

    def shape_numbers(self, columns: Mapping[str, _Array], scale: Scale) -> dict[str, _Array]:
        """The amplitude in m or N, the duration in s."""
        duration = columns["duration"] * self.cycle(columns, scale)
        amplitude = self._amplitude(columns, scale)
        return {"fastest": math.pi / duration, "amplitude": amplitude, "duration": duration}

    def bounds(self, columns: Mapping[str, _Array], scale: Scale) -> tuple[_Array, _Array]:
        """Amplitudes of the half sine and of its rate."""
        found = self.shape_numbers(columns, scale)
        highest = np.abs(found["amplitude"])
        return highest, highest * found["fastest"]


@dataclass(frozen=True, kw_only=True)
class HalfSine(HalfSinePulse):
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
    name = "half_sine"

    def _amplitude(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        return np.asarray(columns["displacement_amplitude"] * scale.length)
