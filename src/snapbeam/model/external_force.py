"""An external force on the structure: a history in newtons that acts on one row of its coordinates."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.drive.force import ForceHistory
from snapbeam.model.quantity import STRUCTURE, check_fields, check_label, keep_shape, quantity
from snapbeam.model.reduced_model import ReducedModel, row_of_matrices
from snapbeam.util.validation import InputError, InputTypeError, shown

_Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class ExternalForce:
    """A force on the structure: m alpha'' + ... = h F(t), where h is one row.

    Parameters
    ----------
    history : ForceHistory
        Force F(t), N: harmonic, constant, a half sine, a burst, a chirp, noise, a ramp, a record, or a sum of such forces.
    location : float, optional
        Location of the force on a beam, over the length.
    shape : array_like of shape (N,), optional
        Row h of a structure given by matrices; its contact point by default.
    label : str, optional
        Name in place of the number of the force.

    See Also
    --------
    snapbeam.HarmonicForce, snapbeam.model.NoiseForce, snapbeam.RampForce, snapbeam.RecordedForce

    Examples
    --------
    >>> import snapbeam as sb
    >>> oscillator = sb.ReducedModel.from_matrices(
    ...     [[1.0]], [1.0], contact_shape=[1.0], damping_ratio=0.05, reference_frequency=0.5 / 3.141592653589793
    ... )
    >>> system = sb.System(
    ...     oscillator,
    ...     forces=[sb.ExternalForce(history=sb.HarmonicForce(frequency_ratio=1.0, amplitude=0.2))],
    ... )
    """

    history: ForceHistory
    location: float | None = quantity(
        "1", "location of the force over the length", default=None, optional=True, low=0.0, high=1.0,
        scope=STRUCTURE,
    )  # fmt: skip
    shape: Any = quantity(
        "1", "force on each coordinate per unit of the force", default=None, optional=True, kind=object, scope=STRUCTURE
    )
    label: str = field(default="", repr=False)

    noun: ClassVar[str] = "an external force"
    """Name in messages."""
    rate_dependent: ClassVar[bool] = False
    """True if the force depends on the velocity of the structure."""

    def __post_init__(self) -> None:
        if not isinstance(self.history, ForceHistory):
            raise InputTypeError(
                f"history = {shown(self.history)}: must be a force in newtons, such as HarmonicForce(frequency_ratio=1.0, amplitude=0.1)"
            )
        check_fields(self)
        check_label(self.label)
        keep_shape(self)

    @property
    def constant_part(self) -> float:
        """Part of the force that does not change in time, N."""
        return self.history.constant_part

    def row(self, model: ReducedModel) -> _Array:
        """Return h of a model, shape (N,).

        Raises
        ------
        InputError
            For a shape that does not fit the model, and for a beam without a location.
        """
        if model.beam is not None:
            if self.shape is not None or self.location is None:
                raise InputError(
                    f"force.location = {self.location}: a force on a beam acts at a location; give location "
                    "in (0, 1) and leave shape out"
                )
            return np.asarray(model.shape_at(self.location))
        if self.location is not None:
            raise InputError(
                f"force.location = {self.location:g}: a structure given by matrices has no length; give shape"
            )
        return row_of_matrices(model, self.shape)
