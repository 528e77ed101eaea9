"""A base that moves: the ends of the beam are shaken together, across the beam."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.boundary_conditions import modes_between
from snapbeam.model.drive.base import DRIVES, Drive
from snapbeam.model.drive.chirp import SweptSine
from snapbeam.model.quantity import STRUCTURE, check_fields, quantity
from snapbeam.model.reduced_model import ReducedModel
from snapbeam.util.validation import InputError, instance

DIRECTIONS = ("up", "down")


@dataclass(frozen=True, kw_only=True)
class BaseExcitation:
    """The motion y(t) of both ends of the beam together, in its plane and across it.

    The beam is described in the frame of its ends, where every piece of it feels the inertial force
    -rho S y''(t) per length:

        m alpha'' + ... = -y''(t) rho S integral(phi) + phi(x_s) f.

    Displacements, velocities, energies and the work of the base (that of the inertial force) are those of that frame. A
    run begins at rest in it.

    Parameters
    ----------
    motion : Drive
        Motion y(t) with an acceleration, such as an :class:`~snapbeam.AccelerationSine`, a
        :class:`~snapbeam.BandLimitedNoise` or a :class:`~snapbeam.Burst`.
    direction : {"up", "down"}
        Well towards which y is positive: the upper or the lower one.
    striker_on_base : bool
        True if the mount of the striker moves with the base. Otherwise it stays in space, and the tip moves by -y(t) in
        the frame of the ends.

    Raises
    ------
    InputError
        For a motion without an acceleration.

    See Also
    --------
    snapbeam.Shock, snapbeam.AccelerationSine, snapbeam.RecordedAcceleration

    Examples
    --------
    >>> import snapbeam as sb
    >>> base = sb.BaseExcitation(
    ...     motion=sb.AccelerationSine(frequency_ratio=0.9, acceleration_amplitude=0.25), direction="up"
    ... )
    >>> base.striker_on_base
    True
    """

    motion: Drive
    direction: str = quantity(
        "1", "way in which the base's motion counts positive", default="up", kind=str, choices=DIRECTIONS,
        scope=STRUCTURE,
    )  # fmt: skip
    striker_on_base: bool = quantity(
        "1", "whether the striker is mounted on the base", default=True, kind=bool, scope=STRUCTURE
    )

    noun: ClassVar[str] = "a moving base"
    """Name in messages."""
    rate_dependent: ClassVar[bool] = False
    """True if the force depends on the velocity of the structure."""

    def __post_init__(self) -> None:
        instance("motion", self.motion, Drive, "a drive, such as AccelerationSine(frequency_ratio=1.2, ...)")
        check_fields(self)
        if not self.motion.can_excite_base():
            known = ", ".join(repr(name) for name, kind in DRIVES.items() if kind.can_excite_base())
            raise InputError(
                f"motion = {self.motion.name!r}: a base needs a motion with a known bound on its acceleration; must be "
                f"one of {known}"
            )
        if isinstance(self.motion, SweptSine) and not self.striker_on_base:
            raise InputError(
                "striker_on_base = False with a chirp: at the end of its sweep the displacement has a kink that the "
                "acceleration leaves out; let the base carry the striker, or use another motion"
            )


def rigid_mass(model: ReducedModel) -> NDArray[np.float64]:
    """rho S integral(phi_i), kg m^-0.5, or m r of given matrices, shape (N,): what a base accelerates."""
    beam = model.beam
    if beam is None:
        if model.base_shape is None:
            raise InputError(
                "base_excitation: needs the displacement of each coordinate per unit of the base's; give base_shape to "
                "ReducedModel.from_matrices"
            )
        return np.asarray(model.mass @ model.base_shape)
    modes = modes_between(beam.boundary, beam.length, beam.bending_stiffness, model.modes)
    return np.asarray(beam.mass_per_length * modes.integral)
