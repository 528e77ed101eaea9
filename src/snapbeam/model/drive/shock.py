"""Shock pulses given by their acceleration: half-sine, haversine and trapezoid."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.drive.base import Scale, Timed
from snapbeam.model.drive.components import Component, Tone, in_pieces
from snapbeam.model.quantity import RUN, STRUCTURE, quantity
from snapbeam.util.validation import nonnegative, positive

_Array = NDArray[np.float64]

GRAVITY = 9.80665
"""Standard acceleration of gravity, m/s^2: 1 g."""
SHAPES = ("half_sine", "haversine", "trapezoid")


@dataclass(frozen=True, kw_only=True)
class Shock(Timed):
    """A shock by its acceleration: a half-sine, haversine or trapezoidal pulse, as IEC 60068-2-27 has them.

    With the peak A and the duration D the acceleration, for 0 < t < D, is

        half_sine   A sin(pi t/D)
        haversine   A (1 - cos(2 pi t/D))/2
        trapezoid   A t/r,  A,  A (D - t)/r,   with the rise time r at both ends

    and zero afterwards. The body then continues at the velocity 2 A D/pi, A D/2 or A (D - r). Use it as the motion of a
    base; displacements are in its frame. A cycle is a period of the first mode.

    Parameters
    ----------
    acceleration_g : float
        Peak acceleration A in g = 9.80665 m/s^2; :meth:`from_si` takes m/s^2.
    duration_ms : float
        Duration D, ms.
    shape : {"half_sine", "haversine", "trapezoid"}
        Half-sine by default.
    rise_fraction : float
        Rise time, and fall time, of a trapezoid over the duration; 0.1 by default.

    See Also
    --------
    snapbeam.HalfSine, snapbeam.BaseExcitation

    Examples
    --------
    >>> import snapbeam as sb
    >>> base = sb.BaseExcitation(motion=sb.Shock(acceleration_g=5000, duration_ms=0.2), direction="down")
    """

    acceleration_g: float = quantity(
        "g", "peak acceleration of the shock", low=0.0, closed="left", scope=RUN, symbol="A",
        short="shock_acceleration_g",
    )  # fmt: skip
    duration_ms: float = quantity(
        "ms", "duration of the shock", low=0.0, scope=RUN, symbol="D", short="shock_duration_ms"
    )
    shape: str = quantity(
        "1", "shape of the shock", default="half_sine", kind=str, choices=SHAPES, scope=STRUCTURE,
        short="shock_shape",
    )  # fmt: skip
    rise_fraction: float = quantity(
        "1", "rise time of a trapezoidal shock over its duration", default=0.1, low=0.0, high=0.5, closed="right",
        scope=RUN, short="shock_rise_fraction",
    )  # fmt: skip

    name = "shock"
    discontinuities = ("rise", "fall", "duration")

    @classmethod
    def from_si(
        cls, acceleration: float, duration: float, *, shape: str = "half_sine", rise_fraction: float = 0.1
    ) -> Shock:
        """Return a shock whose peak acceleration is given in m/s^2 and whose duration in s.

        Examples
        --------
        >>> import snapbeam as sb
        >>> round(sb.Shock.from_si(980.665, 11e-3).acceleration_g, 9)
        100.0
        """
        return cls(
            acceleration_g=nonnegative("acceleration", acceleration, "m/s^2") / GRAVITY,
            duration_ms=1e3 * positive("duration", duration, "s"),
            shape=shape,
            rise_fraction=rise_fraction,
        )

    def components(self, columns: Mapping[str, _Array], scale: Scale) -> list[Component]:
        """Twice the integral of the acceleration."""
        found = self.shape_numbers(columns, scale)
        a, d, r, fall = (found[name] for name in ("peak", "duration", "rise", "fall"))
        begin, window = np.zeros(1), in_pieces((np.zeros(1), {0: np.ones(1)}), (d, {}))
        if self.shape == "half_sine":  # a/w (t - sin(wt)/w)
            rate = math.pi / d
            way = in_pieces((begin, {1: a / rate}), (d, {0: a * d / rate, 1: 2.0 * a / rate}))
            return [way, Tone(-a / rate**2, rate, window=window)]
        if self.shape == "haversine":  # a/2 (t^2/2 - (1 - cos wt)/w^2)
            rate, half = 2.0 * math.pi / d, 0.5 * a
            way = in_pieces((begin, {0: -half / rate**2, 2: 0.5 * half}), (d, {0: 0.5 * half * d**2, 1: half * d}))
            return [way, Tone(half / rate**2, rate, np.full(d.size, 0.5 * math.pi), window=window)]
        u = fall - r
        there, speed = a * (r**2 / 6.0 + 0.5 * r * u + 0.5 * u**2), a * (0.5 * r + u)
        return [
            in_pieces(
                (begin, {3: a / (6.0 * r)}),
                (r, {0: a * r**2 / 6.0, 1: 0.5 * a * r, 2: 0.5 * a}),
                (fall, {0: there, 1: speed, 2: 0.5 * a, 3: -a / (6.0 * r)}),
                (d, {0: 0.5 * a * fall * d, 1: a * fall}),
            )
        ]

    def cycle(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """A period of the first mode."""
        return np.full(next(iter(columns.values())).size, 2.0 * math.pi / scale.omega)

    def shape_numbers(self, columns: Mapping[str, _Array], scale: Scale) -> dict[str, _Array]:
        """The peak in m/s^2; duration, end of the rise and begin of the fall in s."""
        peak, duration = GRAVITY * columns["acceleration_g"], 1e-3 * columns["duration_ms"]
        fastest, rise = math.pi / duration, 0.5 * duration
        if self.shape == "haversine":
            fastest = 2.0 * fastest
        if self.shape == "trapezoid":
            rise = columns["rise_fraction"] * duration
            fastest = 0.5 * math.pi / rise
        return {"fastest": fastest, "peak": peak, "duration": duration, "rise": rise, "fall": duration - rise}

    def bounds(self, columns: Mapping[str, _Array], scale: Scale) -> tuple[_Array, _Array]:
        """Bounds of displacement and velocity: the motion continues at its last velocity."""
        found = self.shape_numbers(columns, scale)
        mean = {"half_sine": 2.0 / math.pi, "haversine": 0.5}
        length = found["fall"] if self.shape == "trapezoid" else mean[self.shape] * found["duration"]
        speed = found["peak"] * length
        return np.where(speed > 0.0, np.inf, 0.0), speed

    def mirrored_bounds(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """Bound of the displacement in the opposite direction: zero."""
        return np.zeros(next(iter(columns.values())).size)

    def peak_acceleration(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """The peak."""
        return self.shape_numbers(columns, scale)["peak"]
