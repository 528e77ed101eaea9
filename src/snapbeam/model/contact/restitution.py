"""Newton's law of impact."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from snapbeam.model.contact.base import ContactLaw
from snapbeam.model.quantity import RUN, quantity

INSTEAD_OF_RESTITUTION = (
    "type = 'hertz', or 'hunt_crossley' with restitution and speed "
    "(HertzContact(stiffness), HuntCrossley.from_restitution(stiffness, restitution, speed))"
)
"""Laws of contact for what Newton's law cannot do, in messages."""


@dataclass(frozen=True)
class Restitution(ContactLaw):
    """Newton's law of impact: the velocity of separation is e times that of approach.

    The contact lasts no time. Its impulse is (1 + e) times the velocity of approach over the mobility of the two
    bodies, the sum of phi_i^2/m_i over the modes. That sum grows without a limit: results do not converge as modes are
    added. Ever faster impacts end in a held contact, until its force would have to pull.

    Parameters
    ----------
    coefficient : float
        Coefficient of restitution e, in [0, 1].

    See Also
    --------
    snapbeam.HuntCrossley

    Examples
    --------
    >>> import snapbeam as sb
    >>> contact = sb.Restitution(coefficient=0.9)
    """

    coefficient: float = quantity(
        "1", "coefficient of restitution", low=0.0, high=1.0, closed="both", scope=RUN, symbol="e",
        short="restitution_coefficient",
    )  # fmt: skip

    name = "restitution"
    impulsive = True

    @staticmethod
    def force(law: Any, penetration: float) -> float:
        """None: an impact is a jump."""
        return 0.0

    @staticmethod
    def energy(law: Any, penetration: float) -> float:
        """None is stored."""
        return 0.0

    @staticmethod
    def slope(law: Any, penetration: float) -> float:
        """None."""
        return 0.0
