"""An axial load that changes in time: parametric excitation, or a slow way through a quasi-static switch."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from snapbeam.model.drive.force import ForceHistory
from snapbeam.util.validation import instance


@dataclass(frozen=True, kw_only=True)
class AxialLoadModulation:
    """An axial load P(t) = P + motion(t), P that under which the beam was reduced.

    The linear stiffness of the beam then is E I k_i^2 - P(t). In addition to the tension, m alpha'' + ... =
    (P(t) - P) alpha.  The work of the change is that on the shortening alpha . alpha / 2 of the span.

    Parameters
    ----------
    motion : ForceHistory
        Change of the load, N, such as a :class:`~snapbeam.HarmonicForce`, a :class:`~snapbeam.RampForce` or their sum.

    See Also
    --------
    snapbeam.HarmonicForce, snapbeam.RampForce

    Examples
    --------
    >>> import snapbeam as sb
    >>> load = sb.AxialLoadModulation(motion=sb.HarmonicForce(frequency_ratio=2.0, amplitude=3.0))
    >>> load.motion.amplitude
    3.0
    """

    motion: ForceHistory

    noun: ClassVar[str] = "a changing axial load"
    """Name in messages."""
    rate_dependent: ClassVar[bool] = False
    """True if the force depends on the velocity of the structure."""

    def __post_init__(self) -> None:
        instance(
            "motion", self.motion, ForceHistory, "a force, such as HarmonicForce(frequency_ratio=2.0, amplitude=...)"
        )
