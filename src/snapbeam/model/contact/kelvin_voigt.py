"""A linear spring and damper between tip and beam."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from snapbeam.model.contact.base import ContactLaw
from snapbeam.model.quantity import RUN, quantity
from snapbeam.util.validation import positive, within


@dataclass(frozen=True)
class KelvinVoigt(ContactLaw):
    """A spring and a damper side by side, f = k d + c d' for a penetration d > 0, never pulling.

    With zeta = c/(2 sqrt(k m)), a free mass m leaves with the share e of its speed, at any speed, where

        e = exp(-2 zeta arccos(zeta)/sqrt(1 - zeta^2)),

    continued to zeta >= 1. It leaves when the force has gone; the remaining energy of the spring is dissipated. The
    force begins with a jump, c v.

    Parameters
    ----------
    linear_stiffness : float
        k, N/m.
    linear_damping : float
        c, N s/m; 0 is a spring alone.

    See Also
    --------
    snapbeam.HuntCrossley, snapbeam.PowerLaw

    Examples
    --------
    >>> import snapbeam as sb
    >>> contact = sb.KelvinVoigt(linear_stiffness=1e6, linear_damping=2.0)
    """

    linear_stiffness: float = quantity(
        "N/m",
        "stiffness of the spring in the contact",
        low=0.0,
        scope=RUN,
        symbol="k",
        short="contact_linear_stiffness",
    )
    linear_damping: float = quantity(
        "N s/m",
        "damping coefficient of the contact",
        low=0.0,
        closed="left",
        scope=RUN,
        symbol="c",
        short="contact_linear_damping",
    )

    name = "kelvin_voigt"
    rate_dependent = True

    @staticmethod
    def force(law: Any, penetration: float) -> float:
        """The spring's part, k d."""
        return law.linear_stiffness * penetration

    @staticmethod
    def damping_coefficient(law: Any, penetration: float) -> float:
        """The damper, c."""
        return law.linear_damping

    @staticmethod
    def energy(law: Any, penetration: float) -> float:
        """k d^2 / 2."""
        return 0.5 * law.linear_stiffness * penetration * penetration

    @staticmethod
    def slope(law: Any, penetration: float) -> float:
        """k."""
        return law.linear_stiffness

    @classmethod
    def from_restitution(cls, linear_stiffness: float, restitution: float, mass: float) -> KelvinVoigt:
        """Law with the coefficient of restitution *restitution* (in (0, 1]) for a free *mass* (kg).

        Of a beam the mass that counts is the one met at the contact, ``model.contact_mass(location)``.
        """
        from scipy.optimize import brentq

        e = within("restitution", restitution, 0.0, 1.0, closed="right")
        linear_stiffness, mass = (positive("linear_stiffness", linear_stiffness, "N/m"), positive("mass", mass, "kg"))
        if e == 1.0:
            return cls(linear_stiffness, 0.0)
        # it falls with zeta, without an end
        high = 2.0
        while _restitution(high) > e:
            high *= 2.0
        zeta = brentq(lambda z: _restitution(z) - e, 0.0, high, xtol=1e-300, rtol=1e-15)
        return cls(linear_stiffness, 2.0 * float(zeta) * math.sqrt(linear_stiffness * mass))

    def restitution(self, mass: float) -> float:
        """Coefficient of restitution of a free *mass* (kg), at any speed."""
        mass = positive("mass", mass, "kg")
        return _restitution(self.linear_damping / (2.0 * math.sqrt(self.linear_stiffness * mass)))

    def impact_duration(self, mass: float, velocity: float) -> float:
        """Half a period of the undamped mass on its spring, s, shorter if the damper stops it."""
        half = math.pi * math.sqrt(mass / self.linear_stiffness)
        if self.linear_damping == 0.0:
            return half
        return min(half, 4.0 * math.pi * mass / self.linear_damping)

    def time_scale(self, mass: float, velocity: float) -> float:
        """Time, s, that the contact steps follow from: the duration."""
        return self.impact_duration(mass, velocity)


def _restitution(zeta: float) -> float:
    """e of a damping ratio: exp(-2 zeta theta / sin theta) with cos theta = zeta."""
    if abs(zeta - 1.0) < 1e-7:
        return math.exp(-2.0 * zeta * (1.0 - (zeta - 1.0) / 3.0))
    if zeta < 1.0:
        return math.exp(-2.0 * zeta * math.acos(zeta) / math.sqrt(1.0 - zeta * zeta))
    return math.exp(-2.0 * zeta * math.acosh(zeta) / math.sqrt(zeta * zeta - 1.0))
