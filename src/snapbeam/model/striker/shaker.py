"""The paper's shaker: a striker with a sinusoidal drive, written down in four numbers."""

from __future__ import annotations

from dataclasses import dataclass

from snapbeam.model.drive.sine import Sine
from snapbeam.model.striker.striker import Striker

__all__ = ["Shaker"]


@dataclass(frozen=True, kw_only=True)
class Shaker:
    """A shaker whose tip has a sinusoidal velocity and starts in contact with the beam at rest (Eq. 16).

    With the buckling level b and the first natural frequency omega_1, both of the model in use, the
    tip moves as

        w_s(t) = w_b(x_s, 0) + (V b omega_1 / omega) sin(omega t),    omega = Omega omega_1.

    It is short for ``Striker(drive=Sine(frequency_ratio=..., velocity_amplitude=...), location=..., side=...)``.

    Parameters
    ----------
    frequency_ratio : float
        Excitation frequency over the first natural frequency, Omega, greater than 0.
    velocity_amplitude : float
        Velocity amplitude over b omega_1, V; 0 is a shaker at rest.
    location : float
        Position of the tip over the length of the beam, x_s, in (0, 1).
    side : {"below", "above"}
        Side of the beam the shaker pushes from.  ``"below"``: it pushes upward on the beam at rest in
        its lower well.  ``"above"`` is the mirror image, downward on the upper well.
    """

    frequency_ratio: float
    velocity_amplitude: float
    location: float = 1.0 / 2.1
    side: str = "below"

    def __post_init__(self) -> None:
        striker = self.striker()
        for name in ("frequency_ratio", "velocity_amplitude"):
            object.__setattr__(self, name, getattr(striker.drive, name))
        for name in ("location", "side"):
            object.__setattr__(self, name, getattr(striker, name))

    def striker(self) -> Striker:
        """The striker that it is."""
        drive = Sine(frequency_ratio=self.frequency_ratio, velocity_amplitude=self.velocity_amplitude)
        return Striker(drive=drive, location=self.location, side=self.side)
