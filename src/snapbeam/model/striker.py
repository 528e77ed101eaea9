"""The striker: a tip that moves as prescribed and pushes the beam where they touch."""

from __future__ import annotations

import math
from dataclasses import dataclass

from snapbeam.model.contact.base import ContactLaw
from snapbeam.model.drive.base import Drive
from snapbeam.model.drive.sine import Sine
from snapbeam.model.quantity import RUN, STRUCTURE, check_fields, check_label, quantity
from snapbeam.util.validation import InputError, instance

SIDES = ("below", "above")


@dataclass(frozen=True, kw_only=True)
class Striker:
    """Striker: a tip at one location, on one side of the beam, with its motion.

    Parameters
    ----------
    drive : Drive
        Motion about the mid-position, such as a :class:`~snapbeam.Sine`.
    location : float
        Position of the tip over the length of the beam, x_s, in (0, 1).
    side : {"below", "above"}
        Side of the beam: ``"below"`` pushes upward on the beam at rest in its lower well, ``"above"`` is the mirror
        image.
    gap : float, optional
        Distance, m, between the mid-position and the beam at rest in the well that the first striker pushes away from;
        negative presses. By default the tip touches the beam at the start.
    mass : float, optional
        Mass of the striker, kg; infinite by default: the tip follows its drive. With a mass the contact force moves the
        body from that motion: m_s x'' + c_s x' + k_s x = -f.
    suspension_stiffness : float
        Stiffness k_s of its suspension, N/m; 0 is a free flying mass.
    suspension_damping : float
        Damper c_s of its suspension, N s/m, below critical.

    See Also
    --------
    snapbeam.Shaker, snapbeam.Contact

    Examples
    --------
    >>> import snapbeam as sb
    >>> striker = sb.Striker(
    ...     drive=sb.Sine(frequency_ratio=1.21, velocity_amplitude=0.18), location=0.4, side="above", gap=2e-5
    ... )
    """

    drive: Drive
    location: float = quantity(
        "1", "location of the striker over the length", default=1.0 / 2.1, low=0.0, high=1.0, scope=RUN,
        symbol=r"x_\mathrm{s}",
    )  # fmt: skip
    side: str = quantity(
        "1", "side that the striker pushes from", default="below", kind=str, choices=SIDES, scope=STRUCTURE
    )
    gap: float | None = quantity(
        "m", "distance between the mid-position of the tip and the beam at rest", default=None, optional=True,
        scope=RUN, symbol="g", short="striker_gap", plausible=(0.0, 1.0, "mm"),
    )  # fmt: skip

    mass: float | None = quantity(
        "kg", "mass of the striker", default=None, optional=True, low=0.0, symbol=r"m_\mathrm{s}", short="striker_mass",
        plausible=(1e-15, 1e4, "g"),
    )  # fmt: skip
    suspension_stiffness: float = quantity(
        "N/m", "stiffness of the striker's suspension", default=0.0, low=0.0, closed="left",
        symbol=r"k_\mathrm{s}", short="striker_suspension_stiffness",
    )  # fmt: skip
    suspension_damping: float = quantity(
        "N s/m", "damping coefficient of the striker's suspension", default=0.0, low=0.0, closed="left",
        symbol=r"c_\mathrm{s}", short="striker_suspension_damping",
    )  # fmt: skip

    def __post_init__(self) -> None:
        instance("drive", self.drive, Drive, "a drive, such as Sine(frequency_ratio=1.2, ...)")
        check_fields(self)
        if self.mass is None:
            for name in ("suspension_stiffness", "suspension_damping"):
                if getattr(self, name) != 0.0:
                    raise InputError(
                        f"{name} = {getattr(self, name):g}: a striker without a mass moves as prescribed; give its mass"
                    )
        elif self.damping_ratio >= 1.0:
            critical = 2.0 * math.sqrt(self.suspension_stiffness * self.mass)
            raise InputError(
                f"suspension_damping = {self.suspension_damping:g} N s/m: must be less than {critical:g} N s/m, the "
                "critical damping; increase suspension_stiffness or decrease suspension_damping"
            )

    @property
    def damping_ratio(self) -> float:
        """Damping ratio of the suspension, c_s/(2 sqrt(k_s m_s)); infinite for a damper without a spring."""
        if self.mass is None or self.suspension_damping == 0.0:
            return 0.0
        return (
            self.suspension_damping / (2.0 * math.sqrt(self.suspension_stiffness * self.mass))
            if self.suspension_stiffness > 0.0
            else math.inf
        )


# ----------------------------------------------------------------------------------------------------
# The paper's shaker: a striker with a sinusoidal drive, written down in four numbers.


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
    location, side
        Location of the tip and its side of the beam, as of a :class:`Striker`.

    See Also
    --------
    snapbeam.Striker, snapbeam.Sine

    Examples
    --------
    >>> import snapbeam as sb
    >>> shaker = sb.Shaker(frequency_ratio=1.21, velocity_amplitude=0.18, location=1 / 2.1)
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


# ----------------------------------------------------------------------------------------------------
# A contact: a striker and the law by which it touches.


@dataclass(frozen=True)
class Contact:
    """A striker and the law of its contact with the structure.

    Parameters
    ----------
    law : ContactLaw
        Law of the force between tip and structure.
    striker : Striker or Shaker
        Striker; without a gap its tip touches the beam at rest in the well that the first striker pushes away from.
    label : str, optional
        Name in place of the number of the contact: ``"stop"`` in ``contact.stop.gap``.

    See Also
    --------
    snapbeam.ContactLaw, snapbeam.Striker

    Examples
    --------
    >>> import snapbeam as sb
    >>> stop = sb.Contact(
    ...     sb.HertzContact(1e9), sb.Striker(drive=sb.FixedStop(), location=0.3, side="above", gap=5e-5), label="stop"
    ... )
    """

    law: ContactLaw
    striker: Striker
    label: str = ""

    def __post_init__(self) -> None:
        if isinstance(self.striker, Shaker):
            object.__setattr__(self, "striker", self.striker.striker())
        instance("striker", self.striker, Striker, "a Striker or a Shaker")
        instance("law", self.law, ContactLaw, "a law of contact, such as HertzContact(stiffness)")
        check_label(self.label)
