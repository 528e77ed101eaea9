"""The striker: a tip that moves as prescribed and pushes the beam where they touch."""

from __future__ import annotations

import math
from dataclasses import dataclass

from snapbeam.core.validate import InputError, InputTypeError, shown
from snapbeam.model.drive.base import Drive
from snapbeam.model.quantity import RUN, STRUCTURE, check_fields, quantity

__all__ = ["SIDES", "Striker"]

SIDES = ("below", "above")


@dataclass(frozen=True, kw_only=True)
class Striker:
    """A tip at one place of the beam, on one side of it, and how it moves.

    Parameters
    ----------
    drive : Drive
        Motion about the mid-position, such as a :class:`~snapbeam.Sine`.
    location : float
        Position of the tip over the length of the beam, x_s, in (0, 1).
    side : {"below", "above"}
        Side of the beam the tip pushes from.  ``"below"``: it pushes upward on the beam at rest in
        its lower well.  ``"above"`` is the mirror image, downward on the upper well.
    gap : float, optional
        Distance, m, between the mid-position and the beam at rest in the well that a run begins in; negative
        presses.  By default the tip touches the beam at the start, wherever the beam then is.
    mass : float, optional
        Mass of the striker, kg; infinite by default: the tip moves as its drive says, whatever it strikes.  With a
        mass the drive is the motion that the tip has as long as nothing touches it, and the contact force moves the
        body from it: m_s x'' + c_s x' + k_s x = -f.
    suspension_stiffness : float
        Stiffness k_s of its suspension, N/m; 0 is a free flying mass.
    suspension_damping : float
        Damper c_s of its suspension, N s/m, below critical; a coil of force factor K on a resistance R adds K^2/R.
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
        "N s/m", "damper of the striker's suspension", default=0.0, low=0.0, closed="left",
        symbol=r"c_\mathrm{s}", short="striker_suspension_damping",
    )  # fmt: skip

    def __post_init__(self) -> None:
        if not isinstance(self.drive, Drive):
            raise InputTypeError(
                f"drive = {shown(self.drive)}: must be a drive, such as Sine(frequency_ratio=1.2, ...)"
            )
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
                f"suspension_damping = {self.suspension_damping:g} N s/m: must be less than {critical:g} N s/m, critical for its mass and "
                "spring; a stiffer spring lets it be greater"
            )

    @property
    def damping_ratio(self) -> float:
        """Of the suspension, c_s/(2 sqrt(k_s m_s)); infinite for a damper without a spring."""
        if self.mass is None or self.suspension_damping == 0.0:
            return 0.0
        return (
            self.suspension_damping / (2.0 * math.sqrt(self.suspension_stiffness * self.mass))
            if self.suspension_stiffness > 0.0
            else math.inf
        )
