"""A sine whose frequency is swept from one value to another."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.drive.base import Scale, Timed, acceleration_ratio, velocity_ratio
from snapbeam.model.drive.components import Component, Sweep
from snapbeam.model.quantity import RUN, STRUCTURE, quantity

_Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class SweptSine(Timed):
    """A sine of changing frequency; its kind gives the amplitude of itself (power 0), of its rate (1) or of its acceleration (2)."""

    start_ratio: float = quantity("1", "frequency ratio at the start of the sweep", low=0.0, scope=RUN)
    stop_ratio: float = quantity("1", "frequency ratio at the end of the sweep", low=0.0, scope=RUN)
    sweep_cycles: float = quantity("1", "duration of the sweep, in its first period", low=0.0, scope=RUN)
    sweep_type: str = quantity(
        "1", "how the frequency changes in time", default="linear", kind=str, choices=("linear", "log"), scope=STRUCTURE,
    )  # fmt: skip
    discontinuities = ("duration",)
    _power: ClassVar[int] = 1

    def _size(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        raise NotImplementedError

    def components(self, columns: Mapping[str, _Array], scale: Scale) -> list[Component]:
        """One sweep."""
        found = self.shape_numbers(columns, scale)
        numbers = (found["size"], found["first"], found["last"], found["duration"])
        return [Sweep(*numbers, self.sweep_type == "log", self._power)]

    def cycle(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """The first period."""
        return np.asarray(2.0 * math.pi / (columns["start_ratio"] * scale.omega))

    def shape_numbers(self, columns: Mapping[str, _Array], scale: Scale) -> dict[str, _Array]:
        """Frequencies in rad/s, the amplitude, the duration in s."""
        first, last = columns["start_ratio"] * scale.omega, columns["stop_ratio"] * scale.omega
        return {
            "fastest": np.maximum(first, last),
            "first": first,
            "last": last,
            "size": self._size(columns, scale),
            "duration": columns["sweep_cycles"] * self.cycle(columns, scale),
        }

    def _most(self, columns: Mapping[str, _Array], scale: Scale) -> tuple[_Array, _Array, _Array, _Array]:
        """Maximum of size w^(k - power) for k = 0, 1, 2, and of abs(w')/w."""
        found, p = self.shape_numbers(columns, scale), self._power
        slowest, fastest = np.minimum(found["first"], found["last"]), found["fastest"]
        change = np.maximum((fastest - slowest) / slowest, np.log(fastest / slowest)) / found["duration"]
        value, rate, bend = (found["size"] * (fastest if k > p else slowest) ** float(k - p) for k in range(3))
        return value, rate, bend, change

    def bounds(self, columns: Mapping[str, _Array], scale: Scale) -> tuple[_Array, _Array]:
        """Bounds of the value and of its rate: those of the sine, plus the effect of the falling amplitude."""
        value, rate, _, change = self._most(columns, scale)
        return value, rate + self._power * value * change

    def peak_acceleration(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """Bound of the acceleration: the fastest sine, plus the effect of the frequency change."""
        value, rate, bend, change = self._most(columns, scale)
        p = self._power
        return np.asarray(bend + (2 * p + 1) * rate * change + p * (p + 2) * value * change**2)


@dataclass(frozen=True, kw_only=True)
class Chirp(SweptSine):
    """Sweep of the excitation frequency from one ratio to another at constant velocity amplitude.

    The displacement of the tip is

        w_s(t) = w_0 + (V b omega_1/omega(t)) sin(integral of omega).

    The frequency or its logarithm is linear in time. After the sweep it stays at its last value; there the velocity has
    a small jump.

    Parameters
    ----------
    start_ratio, stop_ratio : float
        Omega at the beginning and at the end, either may be the greater.
    velocity_amplitude : float
        V over the sweep, as of a :class:`Sine`.
    sweep_cycles : float
        Duration over the first period 2 pi/(start_ratio omega_1), which is a cycle.
    sweep_type : {"linear", "log"}
        Linear or logarithmic increase of the frequency in time.

    See Also
    --------
    snapbeam.Sine, snapbeam.model.AccelerationChirp, snapbeam.dynamics.hysteresis

    Examples
    --------
    >>> import snapbeam as sb
    >>> chirp = sb.Chirp(start_ratio=0.5, stop_ratio=2.0, velocity_amplitude=0.1, sweep_cycles=200.0)
    >>> striker = sb.Striker(drive=chirp)
    """

    velocity_amplitude: float = velocity_ratio()
    name = "chirp"

    def _size(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        return np.asarray(columns["velocity_amplitude"] * scale.length * scale.omega)


@dataclass(frozen=True, kw_only=True)
class AccelerationChirp(SweptSine):
    """Sweep of the excitation frequency at constant acceleration amplitude, as shakers are controlled.

    The displacement of the tip, or of the base, is a sin(integral of omega)/omega(t)^2.

    Parameters
    ----------
    start_ratio, stop_ratio, sweep_cycles, sweep_type
        Frequencies, duration and kind of the sweep, as of a :class:`~snapbeam.Chirp`.
    acceleration_amplitude : float
        a over b omega_1^2.

    See Also
    --------
    snapbeam.Chirp, snapbeam.AccelerationSine

    Examples
    --------
    >>> import snapbeam as sb
    >>> sweep = sb.model.AccelerationChirp(
    ...     start_ratio=0.5, stop_ratio=2.0, acceleration_amplitude=0.05, sweep_cycles=200.0, sweep_type="log"
    ... )
    >>> base = sb.BaseExcitation(motion=sweep)
    """

    acceleration_amplitude: float = acceleration_ratio()
    name = "acceleration_chirp"
    _power = 2

    def _size(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        return np.asarray(columns["acceleration_amplitude"] * scale.length * scale.omega**2)
