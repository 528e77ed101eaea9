"""Hertz's law with a loss that grows with the penetration."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from snapbeam.model.contact.base import ContactLaw
from snapbeam.model.contact.hertz import HertzContact, hertz_stiffness
from snapbeam.model.contact.loss import loss_number, preset_loss, restitution_of_loss
from snapbeam.model.quantity import RUN, quantity
from snapbeam.util.validation import positive


@dataclass(frozen=True)
class HuntCrossley(ContactLaw):
    """A sphere on a flat that loses energy, f = k_c d^(3/2) (1 + chi d') for a penetration d > 0, never pulling.

    A free mass that arrives with v leaves with e v, where D = chi v and

        (1 + e) D = ln[(1 + D)/(1 - e D)]

    exactly: the faster it arrives, the more it loses.  Hunt and Crossley, J. Appl. Mech. 42 (1975) 440-445.

    Parameters
    ----------
    stiffness : float
        Contact stiffness k_c, N/m^1.5.
    damping_factor : float
        chi, s/m; 0 is Hertz's law.

    See Also
    --------
    snapbeam.HertzContact, snapbeam.KelvinVoigt

    Examples
    --------
    >>> import snapbeam as sb
    >>> contact = sb.HuntCrossley.from_restitution(1e9, restitution=0.8, speed=0.1)
    >>> round(contact.restitution(0.1), 6)
    0.8
    """

    stiffness: float = hertz_stiffness()
    damping_factor: float = quantity(
        "s/m", "loss of the contact per speed of penetration", low=0.0, closed="left", scope=RUN, symbol=r"\chi",
        short="contact_damping_factor",
    )  # fmt: skip

    name = "hunt_crossley"
    rate_dependent = True

    # what is stored is Hertz's
    force = staticmethod(HertzContact.force)
    energy = staticmethod(HertzContact.energy)
    slope = staticmethod(HertzContact.slope)

    @staticmethod
    def damping_coefficient(law: Any, penetration: float) -> float:
        """The part that is lost, per speed: chi k_c d^(3/2)."""
        return law.damping_factor * law.stiffness * penetration * math.sqrt(penetration)

    @classmethod
    def from_restitution(
        cls, stiffness: float, restitution: float, speed: float, preset: str = "exact"
    ) -> HuntCrossley:
        """The law under which a free mass that arrives with *speed* (m/s) leaves with *restitution* times it.

        Parameters
        ----------
        stiffness : float
            k_c, N/m^1.5.
        restitution : float
            e, in (0, 1].
        speed : float
            m/s.
        preset : {"exact", "hunt-crossley", "lankarani-nikravesh", "gonthier", "flores"}
            A published approximation in place of the exact relation; :meth:`restitution` of the result shows
            what it really gives (for e = 0.5: 0.663, 0.725, 0.488 and 0.470).
        """
        return cls(stiffness, preset_loss(restitution, speed, preset))

    def restitution(self, speed: float) -> float:
        """Coefficient of restitution of a free mass that arrives with *speed* (m/s)."""
        return restitution_of_loss(self.damping_factor * positive("speed", speed, "m/s"))

    def speed_for(self, restitution: float) -> float:
        """Impact speed, m/s, for which the coefficient of restitution is *restitution*; infinite without loss."""
        return math.inf if self.damping_factor == 0.0 else loss_number(restitution) / self.damping_factor

    def impact_duration(self, mass: float, velocity: float) -> float:
        """Duration under Hertz's law, s: dissipation shortens the approach and lengthens the departure."""
        return HertzContact(self.stiffness).impact_duration(mass, velocity)

    def time_scale(self, mass: float, velocity: float) -> float:
        """Time, s, that the contact steps follow from: the duration."""
        return self.impact_duration(mass, velocity)
