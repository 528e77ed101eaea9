"""The striker: a tip that moves as prescribed and pushes the beam where they touch."""

from __future__ import annotations

from dataclasses import dataclass

from snapbeam.core.validate import InputTypeError, shown
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

    def __post_init__(self) -> None:
        if not isinstance(self.drive, Drive):
            raise InputTypeError(
                f"drive = {shown(self.drive)}: must be a drive, such as Sine(frequency_ratio=1.2, ...)"
            )
        check_fields(self)
