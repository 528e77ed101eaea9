"""A force that grows with any power of the penetration."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from snapbeam.model.contact.base import ContactLaw, hertzian_time
from snapbeam.model.quantity import RUN, quantity
from snapbeam.util.validation import checked, positive, within

_MICROMETRE = 1e-6


@dataclass(frozen=True)
class PowerLaw(ContactLaw):
    """An elastic contact of any exponent, f = f_1 (d/1 um)^p for a penetration d > 0, which loses nothing.

    p = 1 is a spring, 3/2 Hertz's sphere, 2 a cone; a thin soft layer or a rough surface stiffens faster.

    Parameters
    ----------
    force_at_1um : float
        f_1, N.
    exponent : float
        p, in [1, 10].

    See Also
    --------
    snapbeam.HertzContact, snapbeam.KelvinVoigt

    Examples
    --------
    >>> import snapbeam as sb
    >>> contact = sb.PowerLaw.from_stiffness(1e13, exponent=2.0)
    """

    force_at_1um: float = quantity("N", "force at a penetration of one micrometre", low=0.0, scope=RUN, symbol="f_1")
    exponent: float = quantity(
        "1", "exponent of the contact law", low=1.0, high=10.0, closed="both", scope=RUN, symbol="p",
        short="contact_exponent",
    )  # fmt: skip

    name = "power"

    @staticmethod
    def force(law: Any, penetration: float) -> float:
        """f_1 (d/1 um)^p."""
        return law.force_at_1um * math.pow(1e6 * penetration, law.exponent)

    @staticmethod
    def energy(law: Any, penetration: float) -> float:
        """f d/(p + 1)."""
        force = law.force_at_1um * math.pow(1e6 * penetration, law.exponent)
        return force * penetration / (law.exponent + 1.0)

    @staticmethod
    def slope(law: Any, penetration: float) -> float:
        """f p/d."""
        power = math.pow(1e6 * penetration, law.exponent - 1.0)
        return 1e6 * law.force_at_1um * law.exponent * power

    @classmethod
    @checked
    def from_stiffness(cls, stiffness: float, exponent: float) -> PowerLaw:
        """The law f = k d^p of a *stiffness* k in N/m^p."""
        p = within("exponent", exponent, 1.0, 10.0, closed="both")
        return cls(positive("stiffness", stiffness, "N/m^p") * _MICROMETRE**p, p)

    def max_penetration(self, mass: float, velocity: float) -> float:
        """Maximum penetration, m, of a free *mass* (kg) that arrives with *velocity* (m/s): f d/(p + 1) = m v^2/2."""
        n = self.exponent + 1.0
        at_one = self.force_at_1um * _MICROMETRE
        return float(_MICROMETRE * (0.5 * n * mass * velocity**2 / at_one) ** (1.0 / n))

    def impact_duration(self, mass: float, velocity: float) -> float:
        """Duration, s, of a free impact at a velocity above 0: (2 d_max/v) B(1/n, 1/2)/n with n = p + 1."""
        velocity = positive("velocity", velocity, "m/s")
        n = self.exponent + 1.0
        beta = math.sqrt(math.pi) * math.gamma(1.0 / n) / math.gamma(1.0 / n + 0.5)
        return 2.0 * self.max_penetration(mass, velocity) / velocity * beta / n

    def time_scale(self, mass: float, velocity: float) -> float:
        """The duration, or, of an exponent above 3/2, that of Hertz's contact with the same maximum slope."""
        duration = self.impact_duration(mass, velocity)
        law = self.numbers_type()(self.force_at_1um, self.exponent)
        slope = self.slope(law, self.max_penetration(mass, velocity))
        return min(duration, hertzian_time(slope, mass))
