"""Sines: by the velocity amplitude as in the paper (Eq. 16), by displacement or by acceleration."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.drive.base import (
    Drive,
    Scale,
    acceleration_ratio,
    displacement_ratio,
    excitation_ratio,
    velocity_ratio,
)
from snapbeam.model.quantity import RUN, quantity
from snapbeam.util.diagnostics import Diagnostic

if TYPE_CHECKING:
    from snapbeam.model.reduced_model import ReducedModel

_Array = NDArray[np.float64]
_LARGEST_RATIO = 20.0
"""Ratios from which on a number is probably given in Hz or mm/s."""


def _phase() -> Any:
    return quantity(
        "rad", "phase of the drive at the start", default=0.0, low=-1e6, high=1e6, closed="both", scope=RUN,
        short="drive_phase",
    )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class HarmonicMotion(Drive):
    """A sine, whose amplitude (m, N) its kind gives."""

    frequency_ratio: float = excitation_ratio()
    harmonic = True

    def _amplitude(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        raise NotImplementedError

    def numbers(self, columns: Mapping[str, _Array], scale: Scale) -> dict[str, _Array]:
        """Angular frequency (rad/s) and amplitude of the displacement (m)."""
        return {"omega": columns["frequency_ratio"] * scale.omega, "amplitude": self._amplitude(columns, scale)}

    def cycle(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """One period of the sine."""
        return np.asarray(2.0 * math.pi / (columns["frequency_ratio"] * scale.omega))

    def bounds(self, columns: Mapping[str, _Array], scale: Scale) -> tuple[_Array, _Array]:
        """Amplitudes of displacement and velocity."""
        numbers = self.numbers(columns, scale)
        return numbers["amplitude"], numbers["amplitude"] * numbers["omega"]

    def peak_acceleration(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """A omega^2."""
        numbers = self.numbers(columns, scale)
        return np.asarray(numbers["amplitude"] * numbers["omega"] ** 2)


@dataclass(frozen=True, kw_only=True)
class Sine(HarmonicMotion):
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
        Phase at the start, rad.

    See Also
    --------
    snapbeam.DisplacementSine, snapbeam.AccelerationSine, snapbeam.Shaker

    Examples
    --------
    >>> import snapbeam as sb
    >>> striker = sb.Striker(drive=sb.Sine(frequency_ratio=1.21, velocity_amplitude=0.18))
    """

    velocity_amplitude: float = velocity_ratio()
    phase: float = _phase()

    name = "sine"

    def _amplitude(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        return np.asarray(
            columns["velocity_amplitude"] * scale.length * scale.omega / (columns["frequency_ratio"] * scale.omega)
        )

    def diagnostics(self, section: str, model: ReducedModel) -> list[Diagnostic]:
        """Values that look like another unit."""
        found = []
        if self.frequency_ratio >= _LARGEST_RATIO:
            found.append(
                Diagnostic(
                    "ratio-like-hertz",
                    f"{section}.frequency_ratio = {self.frequency_ratio:g}: a ratio to the first natural frequency "
                    f"({model.reference_frequency:.4g} Hz); is it given in Hz?",
                    {"frequency_ratio": self.frequency_ratio},
                )
            )
        if self.velocity_amplitude >= _LARGEST_RATIO:
            found.append(
                Diagnostic(
                    "amplitude-like-speed",
                    f"{section}.velocity_amplitude = {self.velocity_amplitude:g}: a ratio to b omega_1; is it given in mm/s?",
                    {"velocity_amplitude": self.velocity_amplitude},
                )
            )
        return found


@dataclass(frozen=True, kw_only=True)
class DisplacementSine(HarmonicMotion):
    """A sine of the tip by its displacement, w_s(t) = w_0 + A sin(omega t + phase).

    Parameters
    ----------
    frequency_ratio : float
        Omega.
    displacement_amplitude : float
        A over the buckling level b.
    phase : float
        Phase at the start, rad.

    See Also
    --------
    snapbeam.Sine, snapbeam.AccelerationSine

    Examples
    --------
    >>> import snapbeam as sb
    >>> striker = sb.Striker(drive=sb.DisplacementSine(frequency_ratio=1.2, displacement_amplitude=0.15))
    """

    displacement_amplitude: float = displacement_ratio()
    phase: float = _phase()
    name = "displacement_sine"

    def _amplitude(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        return np.asarray(columns["displacement_amplitude"] * scale.length)


@dataclass(frozen=True, kw_only=True)
class AccelerationSine(HarmonicMotion):
    """A sine of the tip by its acceleration, whose amplitude is a: A = a/omega^2.

    Parameters
    ----------
    frequency_ratio : float
        Omega.
    acceleration_amplitude : float
        a over b omega_1^2.
    phase : float
        Phase at the start, rad.

    See Also
    --------
    snapbeam.Sine, snapbeam.DisplacementSine, snapbeam.RecordedAcceleration

    Examples
    --------
    >>> import snapbeam as sb
    >>> base = sb.BaseExcitation(motion=sb.AccelerationSine(frequency_ratio=0.9, acceleration_amplitude=0.25))
    """

    acceleration_amplitude: float = acceleration_ratio()
    phase: float = _phase()
    name = "acceleration_sine"

    def _amplitude(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        return np.asarray(columns["acceleration_amplitude"] * scale.length / columns["frequency_ratio"] ** 2)
