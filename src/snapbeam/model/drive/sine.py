"""The sinusoidal drive of the paper (Eq. 16)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.drive.base import Drive, Scale
from snapbeam.model.quantity import RUN, quantity

__all__ = ["Sine"]


_Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Sine(Drive):
    """Harmonic motion of the tip with the velocity amplitude V b omega_1 (Eq. 16).

    The displacement of the tip is

        w_s(t) = w_0 + (V b omega_1 / omega) sin(omega t + phase),    omega = Omega omega_1,

    with the buckling level b and the first natural frequency omega_1, both of the model in use.

    Parameters
    ----------
    frequency_ratio : float
        Excitation frequency over the first natural frequency, Omega, greater than 0.
    velocity_amplitude : float
        Velocity amplitude over b omega_1, V; 0 is a striker at rest.
    phase : float
        At the start, rad.

    Examples
    --------
    >>> import snapbeam as sb
    >>> striker = sb.Striker(drive=sb.Sine(frequency_ratio=1.21, velocity_amplitude=0.18))
    """

    frequency_ratio: float = quantity(
        "1", "excitation frequency over the first natural frequency", low=0.0, scope=RUN, symbol=r"\Omega"
    )
    velocity_amplitude: float = quantity(
        "1", "velocity amplitude over b omega_1", low=0.0, closed="left", scope=RUN, symbol="V"
    )
    phase: float = quantity(
        "rad", "phase of the drive at the start", default=0.0, low=-1e6, high=1e6, closed="both", scope=RUN,
        short="drive_phase",
    )  # fmt: skip

    name = "sine"
    harmonic = True
    number_names = ("omega", "amplitude")

    def numbers(self, columns: Mapping[str, _Array], scale: Scale) -> dict[str, _Array]:
        """Angular frequency (rad/s) and amplitude of the displacement (m)."""
        omega = columns["frequency_ratio"] * scale.omega
        return {
            "omega": omega,
            "amplitude": columns["velocity_amplitude"] * scale.length * scale.omega / omega,
        }

    def cycle(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """One period of the sine."""
        period: _Array = 2.0 * math.pi / (columns["frequency_ratio"] * scale.omega)
        return period

    def bounds(self, columns: Mapping[str, _Array], scale: Scale) -> tuple[_Array, _Array]:
        """Its amplitudes."""
        numbers = self.numbers(columns, scale)
        return numbers["amplitude"], numbers["amplitude"] * numbers["omega"]

    def peak_acceleration(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """A omega^2."""
        numbers = self.numbers(columns, scale)
        return np.asarray(numbers["amplitude"] * numbers["omega"] ** 2)
