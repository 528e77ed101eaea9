"""A sine whose frequency is swept from one value to another."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.drive.base import Scale, Timed, velocity_ratio
from snapbeam.model.drive.components import Component, Sweep
from snapbeam.model.quantity import RUN, STRUCTURE, quantity

_Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Chirp(Timed):
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
        V.
    sweep_cycles : float
        Duration over the first period 2 pi/(start_ratio omega_1), which is a cycle.
    sweep_type : {"linear", "log"}
        Linear or logarithmic increase of the frequency in time.

    See Also
    --------
    snapbeam.Sine, snapbeam.dynamics.hysteresis

    Examples
    --------
    >>> import snapbeam as sb
    >>> chirp = sb.Chirp(start_ratio=0.5, stop_ratio=2.0, velocity_amplitude=0.1, sweep_cycles=200.0)
    >>> striker = sb.Striker(drive=chirp)
    """

    start_ratio: float = quantity("1", "frequency ratio at the start of the sweep", low=0.0, scope=RUN)
    stop_ratio: float = quantity("1", "frequency ratio at the end of the sweep", low=0.0, scope=RUN)
    velocity_amplitude: float = velocity_ratio()
    sweep_cycles: float = quantity("1", "duration of the sweep, in its first period", low=0.0, scope=RUN)
    sweep_type: str = quantity(
        "1", "how the frequency changes in time", default="linear", kind=str, choices=("linear", "log"), scope=STRUCTURE,
    )  # fmt: skip

    name = "chirp"
    discontinuities = ("duration",)

    def components(self, columns: Mapping[str, _Array], scale: Scale) -> list[Component]:
        """One sweep."""
        found = self.shape_numbers(columns, scale)
        return [Sweep(found["speed"], found["first"], found["last"], found["duration"], self.sweep_type == "log")]

    def cycle(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """The first period."""
        return np.asarray(2.0 * math.pi / (columns["start_ratio"] * scale.omega))

    def shape_numbers(self, columns: Mapping[str, _Array], scale: Scale) -> dict[str, _Array]:
        """Frequencies in rad/s, the velocity amplitude in m/s, the duration in s."""
        first, last = columns["start_ratio"] * scale.omega, columns["stop_ratio"] * scale.omega
        return {
            "fastest": np.maximum(first, last),
            "first": first,
            "last": last,
            "speed": columns["velocity_amplitude"] * scale.length * scale.omega,
            "duration": columns["sweep_cycles"] * self.cycle(columns, scale),
        }

    def bounds(self, columns: Mapping[str, _Array], scale: Scale) -> tuple[_Array, _Array]:
        """Amplitude of the slowest sine, and the velocity amplitude plus the effect of its change."""
        found = self.shape_numbers(columns, scale)
        slowest = np.minimum(found["first"], found["last"])
        highest = found["speed"] / slowest
        linear = np.abs(found["last"] - found["first"]) / found["duration"] / slowest
        relative = np.abs(np.log(found["last"] / found["first"])) / found["duration"]
        return highest, found["speed"] + highest * np.maximum(linear, relative)

    def peak_acceleration(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """Bound of the acceleration: the fastest sine, plus the effect of the frequency change."""
        found = self.shape_numbers(columns, scale)
        slowest, fastest = np.minimum(found["first"], found["last"]), found["fastest"]
        linear = np.abs(found["last"] - found["first"]) / found["duration"]
        logarithmic = np.abs(np.log(found["last"] / found["first"])) / found["duration"] * fastest
        change = np.maximum(linear, logarithmic) / slowest
        return np.asarray(found["speed"] * (fastest + 3.0 * change + 3.0 * change**2 / slowest))
