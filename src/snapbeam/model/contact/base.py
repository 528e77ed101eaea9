"""Base class of contact laws, and the laws by name."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np

from snapbeam.model.extension import check_names, check_pair
from snapbeam.model.quantity import check_fields, numbers_type
from snapbeam.util.validation import InputError, nonnegative, positive, within

LAWS: dict[str, type[ContactLaw]] = {}
"""Every law by the name it has in parameter files."""
_GAUSS = tuple((0.5 * (x + 1.0), 0.5 * w) for x, w in zip(*(each.tolist() for each in np.polynomial.legendre.leggauss(24)), strict=True))  # fmt: skip
"""Nodes and weights of Gauss's rule on [0, 1]."""
_HERTZ_PHASE = 4.03026
"""Phase of a linear oscillator with the maximum slope of an impact under Hertz's law: (4/5) B(2/5, 1/2) sqrt(15/8)."""


_LEAST, _MOST = 1e-30, 1e30


def hertzian_time(slope: float, mass: float) -> float:
    """Duration of an impact of *mass* (kg) under Hertz's law with a maximum *slope* of the force (N/m), s.

    A force that begins softly and becomes steep is resolved by this, not by the longer time that it lasts.
    """
    return _HERTZ_PHASE * math.sqrt(mass / slope) if slope > 0.0 else math.inf


def _of_impact(function: Callable[[Any, float, float], float]) -> Callable[[Any, float, float], float]:
    """Refuse a mass or a velocity of an impact that is none, before the formula of any law.

    Masses and velocities beyond 1e30 and below 1e-30 are refused too: their energies leave the range of numbers.
    """

    @functools.wraps(function)
    def checked(self: Any, mass: float, velocity: float) -> float:
        positive("mass", mass, "kg"), nonnegative("velocity", velocity, "m/s")
        mass = within("mass", mass, _LEAST, _MOST, closed="both", unit="kg")
        if velocity != 0.0:
            velocity = within("velocity", velocity, _LEAST, _MOST, closed="both", unit="m/s")
        return function(self, mass, float(velocity))

    return checked


class ContactLaw:
    """A law of contact between the striker's tip and the beam: a frozen dataclass in a file of its own.

    Its fields are quantities of scope *run*, each a positive number or zero. Its physics are scalar functions; ``law``
    contains the numbers, by the names of the fields:

    - ``force(law, penetration)``: force on both, N, for a penetration > 0 (m);
    - ``energy(law, penetration)``: energy stored in the contact, J, whose derivative is the force;
    - ``slope(law, penetration)``: derivative of the force, N/m, for tangents and for the length of contact steps.

    ``engine = "python"`` needs ``force`` alone, in any Python; energy and slope then follow numerically.

    A law that loses energy (``rate_dependent`` = True) also has ``damping_coefficient(law, penetration)``, N s/m: its
    force is max(0, force + damping coefficient times the rate of penetration).

    A law with a state of its own (``memory``, the name of a residual indentation D, m, the last number) measures the
    penetration from the indented surface, and also has

    - ``yield_penetration(law)``: penetration beyond which D increases, m;
    - ``memory_after(law, deepest)``: D of a contact that unloads from a maximum penetration beyond it.

    They use ``+``, ``-``, ``*``, ``/`` and :mod:`math` alone, and never allocate. Names of your own begin with an
    underscore; others are refused when the class is defined.

    See Also
    --------
    snapbeam.HertzContact, snapbeam.Contact, snapbeam.quantity

    Examples
    --------
    >>> import snapbeam as sb
    >>> law = sb.HertzContact(1e9)
    >>> isinstance(law, sb.ContactLaw), law.is_dissipative
    (True, False)
    >>> f"{law.impact_duration(mass=1e-3, velocity=0.1):.2e} s"
    '8.08e-05 s'
    """

    hooks: ClassVar[tuple[str, ...]] = (
        "name", "force", "energy", "slope", "rate_dependent", "damping_coefficient", "memory", "yield_penetration",
        "memory_after", "impact_duration", "time_scale",
    )  # fmt: skip
    """Names that are read of a law of one's own."""
    name: ClassVar[str] = ""
    """Name in parameter files and attributes."""
    impulsive: ClassVar[bool] = False
    """True if an impact has zero duration: a jump of the velocity instead of a force."""
    rate_dependent: ClassVar[bool] = False
    """True if the force also depends on the rate of penetration."""
    memory: ClassVar[str] = ""
    """Name of a residual indentation that is a part of the state; it is the last of the law's numbers."""

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        if cls.name and not cls.impulsive:
            wanted = ["force", *(["energy", "slope", "yield_penetration", "memory_after"] if cls.memory else [])]
            missing = [each for each in wanted if not hasattr(cls, each)]
            if missing:
                raise InputError(
                    f"contact law {cls.name!r}: has no {' and no '.join(missing)}; write them as static methods of "
                    "(law, penetration): the force (N), its integral (J) and its derivative (N/m)"
                )
        check_names(cls)
        for name in ("impact_duration", "max_penetration", "time_scale"):
            if name in vars(cls):
                setattr(cls, name, _of_impact(vars(cls)[name]))
        if cls.name:
            check_pair(cls, "rate_dependent", ContactLaw, ["damping_coefficient"])
            check_pair(cls, "memory", ContactLaw, ["yield_penetration", "memory_after"])
            LAWS[cls.name] = cls

    def __post_init__(self) -> None:
        check_fields(self)

    @staticmethod
    def energy(law: Any, penetration: float) -> float:
        """Energy stored in the contact, J: the integral of the force, by Gauss's rule."""
        own: Any = type(law).owner
        # d = x^2 times the penetration, for forces that begin with a root
        return float(penetration * sum(2.0 * x * w * own.force(law, penetration * x * x) for x, w in _GAUSS))

    @staticmethod
    def slope(law: Any, penetration: float) -> float:
        """Derivative of the force, N/m, by a central difference."""
        own: Any = type(law).owner
        h = 1e-5 * penetration
        return (own.force(law, penetration + h) - own.force(law, penetration - h)) / (2.0 * h) if h > 0.0 else 0.0

    @staticmethod
    def damping_coefficient(law: Any, penetration: float) -> float:
        """Force per rate of penetration, N s/m; none is lost."""
        return 0.0

    @classmethod
    def missing_hooks(cls) -> list[str]:
        """Hooks that the law leaves to numerical defaults."""
        return [hook for hook in ("energy", "slope") if getattr(cls, hook) is getattr(ContactLaw, hook)]

    @classmethod
    def numbers_type(cls) -> Any:
        """The named tuple of the law's numbers, as its functions get them; an attribute of the class, ``Numbers``."""
        fields = [item.name for item in dataclasses.fields(cls)]  # type: ignore[arg-type]
        return numbers_type(cls, (*fields, cls.memory) if cls.memory else fields)

    @property
    def is_dissipative(self) -> bool:
        """True if contacts under the law can dissipate energy."""
        return self.impulsive or self.rate_dependent or bool(self.memory)

    @_of_impact
    def impact_duration(self, mass: float, velocity: float) -> float:
        """Duration, s, of the impact of a free *mass* (kg) that arrives with *velocity* (m/s); 0 if it is never stopped.

        Duration for the force without dissipation: 2 times the integral of 1/sqrt(v^2 - 2 E/m) over the
        penetration, from 0 to the maximum, where the energy E of the law is m v^2/2.
        """
        depth = self._greatest_penetration(mass, velocity)
        if depth == 0.0:
            return 0.0
        law: Any = type(self)
        numbers, energy = self.numbers(), law.energy
        # penetration = depth sin(angle): the integrand is smooth at both ends
        nodes, weights = np.polynomial.legendre.leggauss(64)
        angle, total = 0.25 * math.pi * (nodes + 1.0), 0.0
        for at, weight in zip(angle.tolist(), weights.tolist(), strict=True):
            left = velocity**2 - 2.0 * energy(numbers, depth * math.sin(at)) / mass
            total += weight * math.cos(at) / math.sqrt(left) if left > 0.0 else 0.0
        return 0.5 * math.pi * depth * total

    @_of_impact
    def time_scale(self, mass: float, velocity: float) -> float:
        """Time, s, that the contact steps follow from: the duration, or less if the force acts in a part of it."""
        depth = self._greatest_penetration(mass, velocity)
        law: Any = type(self)
        numbers = self.numbers()
        steepest = (
            max((law.slope(numbers, depth * i / 64.0) for i in range(1, 65)), default=0.0) if depth > 0.0 else 0.0
        )
        return min(self.impact_duration(mass, velocity), hertzian_time(steepest, mass))

    def numbers(self, memory: float = 0.0) -> Any:
        """The law's numbers, for its scalar functions; *memory* is the residual indentation of a law that has one, m."""
        own = [getattr(self, item.name) for item in dataclasses.fields(self)]  # type: ignore[arg-type]
        return self.numbers_type()(*own, *([memory] if self.memory else []))

    def _greatest_penetration(self, mass: float, velocity: float) -> float:
        """Penetration, m, at which a free mass stops; 0 if the force does not stop it within a metre."""
        from scipy.optimize import brentq

        law: Any = type(self)
        numbers, energy, arrives = self.numbers(), law.energy, 0.5 * mass * velocity**2
        high = 1e-12
        while energy(numbers, high) < arrives:
            high *= 2.0
            if high > 1.0:
                return 0.0
        if not math.isfinite(energy(numbers, high)):
            raise InputError(
                f"{law.__name__}.energy at a penetration of {high:g} m = {energy(numbers, high)}: must be a finite number of J; correct "
                f"{'force' if 'energy' in law.missing_hooks() else 'energy'}, or give time_scale(self, mass, velocity)"
            )
        return float(brentq(lambda depth: energy(numbers, depth) - arrives, 0.0, high, xtol=1e-15 * high))
