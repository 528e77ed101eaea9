"""What every law of contact says of itself, and the laws by name."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Any, ClassVar

from snapbeam.model.quantity import check_fields, numbers_type

__all__ = ["LAWS", "ContactLaw", "LawProperties", "hertzian_time"]


LAWS: dict[str, type[ContactLaw]] = {}
"""Every law by the name it has in parameter files."""
_HERTZ_TURN = 4.03026
"""Of Hertz's contact, how far it turns in an impact at the rate of its greatest slope: (4/5) B(2/5, 1/2) sqrt(15/8)."""


def hertzian_time(slope: float, mass: float) -> float:
    """How long an impact under Hertz's law lasts whose greatest *slope* (N/m) a *mass* (kg) meets, s.

    A force that begins softly and becomes steep is resolved by this, not by the longer time that it lasts.
    """
    return _HERTZ_TURN * math.sqrt(mass / slope) if slope > 0.0 else math.inf


@dataclass(frozen=True)
class LawProperties:
    """What a law of contact leaves intact; what it does not is refused, or switched off, where it is needed."""

    mirror: bool = True
    """The mirror image of a run is a run."""
    energy_bound: bool = True
    """Untouched, the beam's energy only falls: what early decision rests on."""
    smooth: bool = True
    """The force is continuous where contact begins and ends, so that the tangent flow is plain."""
    tangent: bool = True
    """Small changes of the state can be carried along."""


class ContactLaw:
    """A law of contact between the striker's tip and the beam: a frozen dataclass in a file of its own.

    Its fields are quantities of scope *run*, each a positive number or zero.  Its physics are scalar functions of
    numbers that every engine compiles for itself; ``law`` stands for the numbers, by the names of the fields:

    - ``force(law, penetration)``: force on both, N, for a penetration > 0 (m);
    - ``energy(law, penetration)``: energy stored in the contact, J, whose derivative is the force;
    - ``slope(law, penetration)``: derivative of the force, N/m, for the tangent flow.

    A law that loses energy (``rate_dependent``) has ``damping(law, penetration)`` besides, N s/m: its force is
    max(0, force + damping times the rate of penetration).

    They are written with ``+``, ``-``, ``*``, ``/`` and :mod:`math` alone, and never allocate.
    """

    name: ClassVar[str] = ""
    """In parameter files and attributes."""
    properties: ClassVar[LawProperties] = LawProperties()
    impulsive: ClassVar[bool] = False
    """Whether an impact lasts no time: a jump of the velocity instead of a force."""
    rate_dependent: ClassVar[bool] = False
    """Whether the force depends on the rate of penetration too."""
    vectorizable: ClassVar[bool] = False
    """Whether its force is plain arithmetic and square roots, without branches, so that eight are computed at once."""
    max_modes: ClassVar[int | None] = None
    """Modes of a model that may be struck under this law."""

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        if cls.name:
            LAWS[cls.name] = cls

    def __post_init__(self) -> None:
        check_fields(self)

    @staticmethod
    def damping_coefficient(law: Any, penetration: float) -> float:
        """Force per rate of penetration, N s/m; none is lost."""
        return 0.0

    @classmethod
    def numbers_type(cls) -> Any:
        """The named tuple of the law's numbers, as kernels see them; an attribute of the class, ``Numbers``."""
        fields = dataclasses.fields(cls)  # type: ignore[arg-type]
        return numbers_type(cls, (item.name for item in fields))

    @property
    def is_dissipative(self) -> bool:
        """Whether contacts under it may lose energy."""
        return self.impulsive or self.rate_dependent

    def impact_duration(self, mass: float, velocity: float) -> float:
        """Duration, s, of the impact of a free *mass* (kg) that arrives with *velocity* (m/s); 0 if none is known."""
        return 0.0

    def time_scale(self, mass: float, velocity: float) -> float:
        """Time, s, that steps in contact are planned by: the duration, or less where the force acts in a part of it."""
        return self.impact_duration(mass, velocity)
