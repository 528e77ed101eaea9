"""Elastic-plastic contact: a bilinear law with hysteresis, whose residual indentation is a part of the state."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from snapbeam.model.contact.base import ContactLaw
from snapbeam.model.quantity import RUN, quantity
from snapbeam.util.validation import InputError


@dataclass(frozen=True)
class ElasticPlasticContact(ContactLaw):
    """Bilinear elastic-plastic contact that leaves an indentation D in the surface.

    With the penetration d > 0 measured from the indented surface, the force is

        f = min[k_1 (d + D), k_2 d]:

    k_1 on first loading, k_2 on unloading and reloading, up to d = D k_1/(k_2 - k_1). Unloading from a maximum
    penetration d_m beyond this point leaves D' = (d_m + D) (1 - k_1/k_2). A free mass leaves an intact surface with
    sqrt(k_1/k_2) times its speed; when it returns at most as fast, the contact is elastic. Walton and Braun, J. Rheol.
    30 (1986) 949-980.

    Parameters
    ----------
    loading_stiffness : float
        k_1 on first loading, N/m.
    unloading_stiffness : float
        k_2 on unloading and reloading, N/m, at least k_1.

    See Also
    --------
    snapbeam.HertzContact, snapbeam.HuntCrossley

    Examples
    --------
    >>> import snapbeam as sb
    >>> contact = sb.ElasticPlasticContact(loading_stiffness=1e6, unloading_stiffness=4e6)
    >>> contact.restitution
    0.5
    """

    loading_stiffness: float = quantity(
        "N/m", "contact stiffness on first loading", low=0.0, scope=RUN, symbol="k_1", short="contact_loading_stiffness"
    )
    unloading_stiffness: float = quantity(
        "N/m",
        "contact stiffness on unloading and reloading",
        low=0.0,
        scope=RUN,
        symbol="k_2",
        short="contact_unloading_stiffness",
    )

    name = "elastic_plastic"
    memory = "indentation"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.unloading_stiffness < self.loading_stiffness:
            raise InputError(
                f"unloading_stiffness = {self.unloading_stiffness:g} N/m: must be at least the loading_stiffness, "
                f"{self.loading_stiffness:g} N/m"
            )

    @staticmethod
    def force(law: Any, penetration: float) -> float:
        """min[k_1 (d + D), k_2 d]."""
        first = law.loading_stiffness * (penetration + law.indentation)
        return min(first, law.unloading_stiffness * penetration)

    @staticmethod
    def energy(law: Any, penetration: float) -> float:
        """Integral of the force: on first loading with the work that unloading will not give back."""
        k_1, k_2, left = law.loading_stiffness, law.unloading_stiffness, law.indentation
        if k_2 * penetration <= k_1 * (penetration + left):
            return 0.5 * k_2 * penetration * penetration
        # the triangle under the first branch, less the part of it beyond the second
        whole = penetration + left
        return 0.5 * (k_1 * whole * whole - k_1 * k_2 * left * left / (k_2 - k_1))

    @staticmethod
    def slope(law: Any, penetration: float) -> float:
        """k_1 on first loading, k_2 below."""
        k_1, k_2 = law.loading_stiffness, law.unloading_stiffness
        return k_2 if k_2 * penetration <= k_1 * (penetration + law.indentation) else k_1

    @staticmethod
    def yield_penetration(law: Any) -> float:
        """D k_1/(k_2 - k_1), where first loading begins."""
        stiffer = law.unloading_stiffness - law.loading_stiffness
        return law.indentation * law.loading_stiffness / stiffer if stiffer > 0.0 else math.inf

    @staticmethod
    def memory_after(law: Any, deepest: float) -> float:
        """D' = (d_m + D) (1 - k_1/k_2)."""
        return (deepest + law.indentation) * (1.0 - law.loading_stiffness / law.unloading_stiffness)

    @property
    def restitution(self) -> float:
        """Coefficient of restitution of a free mass at the first impact, at any speed."""
        return math.sqrt(self.loading_stiffness / self.unloading_stiffness)

    def impact_duration(self, mass: float, velocity: float) -> float:
        """Duration of the first impact of a free *mass* (kg), s: a quarter of a period on each branch."""
        quarters = math.sqrt(mass / self.loading_stiffness) + math.sqrt(mass / self.unloading_stiffness)
        return 0.5 * math.pi * quarters

    def time_scale(self, mass: float, velocity: float) -> float:
        """Half a period on the branch of unloading, s, from which the contact steps follow."""
        return math.pi * math.sqrt(mass / self.unloading_stiffness)
