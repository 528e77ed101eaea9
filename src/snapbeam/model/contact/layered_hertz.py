"""A sphere on a thin soft layer that covers what it strikes: Hertz's contact and the layer, one after the other."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from snapbeam.model.contact.base import ContactLaw, hertzian_time
from snapbeam.model.contact.hertz import HertzContact, hertz_stiffness
from snapbeam.model.quantity import RUN, quantity
from snapbeam.util.validation import positive, within

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(48)


def _of_layer(law: Any, penetration: float) -> float:
    """Return d_l = s^3, where s is the root of s^3 + c s^4 = d, c = (k_l/k_c)^(2/3).

    Newton's iteration comes from above, where the left side is convex: within a fifth of the root at first and within
    1e-16 after six steps.
    """
    c = math.pow(law.layer_stiffness / law.stiffness, 2.0 / 3.0)
    s = min(math.pow(penetration, 1.0 / 3.0), math.pow(penetration / c, 0.25))
    for _ in range(7):
        s -= (s * s * s * (1.0 + c * s) - penetration) / (s * s * (3.0 + 4.0 * c * s))
    return s * s * s


@dataclass(frozen=True)
class LayeredHertz(ContactLaw):
    """Elastic Hertz contact in series with a layer.

    Both carry the force f, and their penetrations add up:

        d = d_c + d_l,    f = k_c d_c^(3/2) = k_l d_l^2.

    A layer thinner than the circle of contact, free to be compressed and bonded to a stiffer ground, is a bed of
    springs: k_l = pi R M/h with its confined modulus M = E (1 - nu)/[(1 + nu) (1 - 2 nu)] (K. L. Johnson, Contact
    Mechanics, 1985, section 5.8). A stiff layer leaves Hertz's law, a soft one the power 2.

    Parameters
    ----------
    stiffness : float
        k_c of the two bodies, N/m^1.5.
    layer_stiffness : float
        k_l, N/m^2.

    See Also
    --------
    snapbeam.HertzContact

    Examples
    --------
    >>> import snapbeam as sb
    >>> contact = sb.LayeredHertz(stiffness=1e9, layer_stiffness=1e6)
    """

    stiffness: float = hertz_stiffness()
    layer_stiffness: float = quantity("N/m^2", "stiffness of the layer", low=0.0, scope=RUN, symbol=r"k_\mathrm{l}")

    name = "layer"

    @staticmethod
    def force(law: Any, penetration: float) -> float:
        """k_l d_l^2."""
        part = _of_layer(law, penetration)
        return law.layer_stiffness * part * part

    @staticmethod
    def energy(law: Any, penetration: float) -> float:
        """f (2 d_c/5 + d_l/3)."""
        part = _of_layer(law, penetration)
        return law.layer_stiffness * part * part * (0.4 * (penetration - part) + part / 3.0)

    @staticmethod
    def slope(law: Any, penetration: float) -> float:
        """f/(2 d_c/3 + d_l/2): the compliances add up."""
        part = _of_layer(law, penetration)
        return law.layer_stiffness * part * part / ((penetration - part) / 1.5 + 0.5 * part)

    @classmethod
    def from_layer(
        cls, stiffness: float, radius: float, thickness: float, young_modulus: float, poisson_ratio: float
    ) -> LayeredHertz:
        """The law of a sphere of *radius* (m) on a layer of a *thickness* (m), *young_modulus* (Pa), *poisson_ratio*.

        Valid where the circle of contact, of radius sqrt(2 R d_l), is several times the thickness, d_l well below it,
        and the layer not incompressible (*poisson_ratio* below 0.45).
        """
        radius, thickness = positive("radius", radius, "m"), positive("thickness", thickness, "m")
        modulus = positive("young_modulus", young_modulus, "Pa")
        nu = within("poisson_ratio", poisson_ratio, -1.0, 0.45, closed="right")
        confined = modulus * (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu))
        return cls(stiffness=stiffness, layer_stiffness=math.pi * radius * confined / thickness)

    def max_penetration(self, mass: float, velocity: float) -> float:
        """Maximum penetration, m, of a free *mass* (kg) that arrives with *velocity* (m/s)."""
        from scipy.optimize import brentq

        if velocity == 0.0:
            return 0.0
        wanted, law = 0.5 * mass * velocity**2, self.numbers_type()(self.stiffness, self.layer_stiffness)
        most = HertzContact(self.stiffness).max_penetration(mass, velocity)
        most += (3.0 * wanted / self.layer_stiffness) ** (1.0 / 3.0)
        return float(brentq(lambda d: self.energy(law, d) - wanted, 1e-6 * most, most, xtol=1e-12 * most))

    def impact_duration(self, mass: float, velocity: float) -> float:
        """Duration, s, of a free impact at a velocity above 0: 2 int dd/v(d), by Gauss's rule in x, d = d_max (1 - x^2)."""
        velocity = positive("velocity", velocity, "m/s")
        law = self.numbers_type()(self.stiffness, self.layer_stiffness)
        most, total = self.max_penetration(mass, velocity), 0.0
        for node, weight in zip(0.5 * (1.0 + _NODES), 0.5 * _WEIGHTS, strict=True):
            left = velocity**2 - 2.0 * self.energy(law, most * (1.0 - node * node)) / mass
            total += float(weight * 2.0 * most * node / math.sqrt(max(left, 1e-300)))
        return 2.0 * total

    def time_scale(self, mass: float, velocity: float) -> float:
        """The duration, or that of Hertz's contact with the same maximum slope, which is less."""
        duration = self.impact_duration(mass, velocity)
        law = self.numbers_type()(self.stiffness, self.layer_stiffness)
        slope = self.slope(law, self.max_penetration(mass, velocity))
        return min(duration, hertzian_time(slope, mass))
