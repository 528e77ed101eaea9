"""Hertz's law of contact between a sphere and a flat, both elastic."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from snapbeam.model.contact.base import ContactLaw
from snapbeam.model.quantity import RUN, quantity
from snapbeam.util.validation import InputError, InputTypeError, nonnegative, positive, shown, within

# Duration of a Hertzian impact of a free mass over (greatest penetration)/(approach velocity):
# 2 * integral of (1 - u^(5/2))^(-1/2) over (0, 1) = (4/5) B(2/5, 1/2) = 2.94328
_DURATION = 0.8 * math.sqrt(math.pi) * math.gamma(0.4) / math.gamma(0.9)


def hertz_stiffness() -> Any:
    """Return the field of the contact stiffness k_c."""
    return quantity(
        "N/m^1.5", "contact stiffness", low=0.0, scope=RUN, symbol="k_c", short="contact_stiffness",
        plausible=(1.0, 1e15, "N/mm^1.5"),
    )  # fmt: skip


@dataclass(frozen=True)
class HertzContact(ContactLaw):
    """Hertz's law of a sphere on a flat, f = k_c d^(3/2) for a penetration d > 0 (Eqs. 17-18).

    The law stores energy, (2/5) k_c d^(5/2), and dissipates none.

    Parameters
    ----------
    stiffness : float
        Contact stiffness k_c, N/m^1.5.

    See Also
    --------
    snapbeam.HuntCrossley, snapbeam.LayeredHertz, snapbeam.model.hertz_stress

    Examples
    --------
    >>> import snapbeam as sb
    >>> contact = sb.HertzContact.from_materials(radius=4e-3, young_modulus=(210e9, 210e9), poisson_ratio=(0.3, 0.3))
    >>> f"{contact.stiffness:.3g} N/m^1.5"
    '9.73e+09 N/m^1.5'
    """

    stiffness: float = hertz_stiffness()

    name = "hertz"

    @staticmethod
    def force(law: Any, penetration: float) -> float:
        """f = k_c d^(3/2) (Eq. 17)."""
        return law.stiffness * penetration * math.sqrt(penetration)

    @staticmethod
    def energy(law: Any, penetration: float) -> float:
        """(2/5) k_c d^(5/2), the integral of Eq. (17)."""
        return 0.4 * law.stiffness * penetration * penetration * math.sqrt(penetration)

    @staticmethod
    def slope(law: Any, penetration: float) -> float:
        """(3/2) k_c d^(1/2)."""
        return 1.5 * law.stiffness * math.sqrt(penetration)

    @classmethod
    def from_materials(
        cls, radius: float, young_modulus: tuple[float, float], poisson_ratio: tuple[float, float]
    ) -> HertzContact:
        """Contact of a sphere with a flat, both elastic.

            k_c = (4/3) sqrt(R) / [(1 - nu_1^2)/E_1 + (1 - nu_2^2)/E_2]

        Parameters
        ----------
        radius : float
            Radius R of the sphere, m.
        young_modulus : pair of float
            Young's moduli E_1, E_2 of the sphere and of the flat, Pa.
        poisson_ratio : pair of float
            Poisson ratios nu_1, nu_2, each in (-1, 0.5].
        """
        radius = positive("radius", radius, "m")
        moduli = [positive(f"young_modulus[{i}]", e, "Pa") for i, e in _pair("young_modulus", young_modulus)]
        ratios = [
            within(f"poisson_ratio[{i}]", nu, -1.0, 0.5, closed="right")
            for i, nu in _pair("poisson_ratio", poisson_ratio)
        ]
        compliance = sum((1.0 - nu**2) / e for nu, e in zip(ratios, moduli, strict=True))
        return cls(stiffness=4.0 / 3.0 * math.sqrt(radius) / compliance)

    def max_penetration(self, mass: float, velocity: float) -> float:
        """Maximum penetration, m, when a free *mass* (kg) meets a rigid wall at a *velocity* (m/s).

        All the kinetic energy is in the contact: (2/5) k_c d^(5/2) = m v^2 / 2.
        """
        mass = positive("mass", mass, "kg")
        velocity = nonnegative("velocity", velocity, "m/s")
        try:
            found = float((1.25 * mass * velocity**2 / self.stiffness) ** 0.4)
        except OverflowError:
            found = math.inf
        if not math.isfinite(found):
            raise InputError(f"mass = {mass:g} kg, velocity = {velocity:g} m/s: are beyond what a number holds")
        return found

    def impact_duration(self, mass: float, velocity: float) -> float:
        """Duration, s, of the impact of a free *mass* (kg) that arrives with a *velocity* (m/s).

        2.94328 d_max / v: the integral of the motion through the contact, (4/5) B(2/5, 1/2) d_max / v.
        """
        velocity = positive("velocity", velocity, "m/s")
        return _DURATION * self.max_penetration(mass, velocity) / velocity

    def time_scale(self, mass: float, velocity: float) -> float:
        """Time, s, that the contact steps follow from: the duration."""
        return self.impact_duration(mass, velocity)


def _pair(name: str, value: tuple[float, float]) -> list[tuple[int, float]]:
    try:
        items = list(value)
    except TypeError:
        raise InputTypeError(f"{name} = {shown(value)}: must be two numbers, of the sphere and the flat") from None
    if len(items) != 2:
        raise InputError(f"{name} = {shown(value)}: must be two numbers, of the sphere and the flat")
    return list(enumerate(items))
