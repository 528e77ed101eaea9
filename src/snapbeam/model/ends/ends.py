"""How the ends of a beam are held: rotational springs and the axial stiffness of the supports."""

from __future__ import annotations

from dataclasses import dataclass

from snapbeam.model.quantity import check_fields, quantity

__all__ = ["CLAMPED", "Ends"]


@dataclass(frozen=True, kw_only=True)
class Ends:
    """Ends that do not move sideways, each on a rotational spring.

    E I phi'' = k_left phi' at the left end and -k_right phi' at the right one.  The buckling modes under these
    conditions stay orthogonal in their slopes and, with the energy of the springs, in their curvatures, so that the
    reduced model keeps its form; mass, shapes and critical loads change.

    Supports that give way along the axis, with the stiffness K between them, share the stretching with the beam:
    gamma = (E S/(2 L))/(1 + E S/(K L)).

    Parameters
    ----------
    left, right : float, optional
        Rotational stiffness, N m/rad: 0 is a pinned end, and clamped is what nothing is given for.
    axial : float, optional
        K, N/m; rigid by default.
    """

    left: float | None = quantity(
        "N m/rad", "rotational stiffness of the left end", default=None, optional=True, low=0.0, closed="left",
        symbol=r"k_\theta", short="ends_left",
    )  # fmt: skip
    right: float | None = quantity(
        "N m/rad", "rotational stiffness of the right end", default=None, optional=True, low=0.0, closed="left",
        short="ends_right",
    )  # fmt: skip
    axial: float | None = quantity(
        "N/m", "axial stiffness of the supports", default=None, optional=True, low=0.0, short="ends_axial"
    )

    def __post_init__(self) -> None:
        check_fields(self)

    @property
    def turn(self) -> bool:
        """Whether an end gives way to rotation."""
        return self.left is not None or self.right is not None

    @property
    def are_alike(self) -> bool:
        """Whether both ends are held alike, so that modes are symmetric or antisymmetric."""
        return self.left == self.right

    @property
    def is_ideal(self) -> bool:
        """Whether both ends are clamped and rigid."""
        return not self.turn and self.axial is None


CLAMPED = Ends()
"""The paper's."""
