"""An axial load that changes in time: parametric excitation, or a slow way through a quasi-static switch."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.drive.base import Drive, Scale, Timed
from snapbeam.model.drive.components import STEEPEST, Component, in_pieces, rising
from snapbeam.model.quantity import RUN, quantity
from snapbeam.util.validation import instance

_Array = NDArray[np.float64]

LOADS: dict[str, type[Drive]] = {}
"""Every way in which a load changes, by the name it has in parameter files."""


class LoadMotion(Drive):
    """Change of the axial load about the value of the beam, N: a drive whose displacement is a force."""

    registry: ClassVar[dict[str, type[Drive]]] = LOADS


@dataclass(frozen=True, kw_only=True)
class HarmonicLoad(LoadMotion):
    """Parametric excitation, P(t) = P + P_1 sin(omega t + phase).

    Parameters
    ----------
    frequency_ratio : float
        omega over omega_1; the principal parametric resonance of the first mode lies near 2.
    amplitude : float
        P_1, N.
    phase : float
        Phase at the start, rad.

    See Also
    --------
    snapbeam.AxialLoadModulation, snapbeam.LoadRamp

    Examples
    --------
    >>> import snapbeam as sb
    >>> load = sb.AxialLoadModulation(motion=sb.HarmonicLoad(frequency_ratio=2.0, amplitude=3.0))
    """

    frequency_ratio: float = quantity(
        "1", "frequency of the axial load over the first natural frequency", low=0.0, scope=RUN,
        short="load_frequency_ratio", symbol=r"\Omega",
    )  # fmt: skip
    amplitude: float = quantity(
        "N", "amplitude of the axial load", low=0.0, closed="left", scope=RUN, short="load_amplitude", symbol="P_1"
    )
    phase: float = quantity(
        "rad", "phase of the axial load at the start", default=0.0, low=-1e6, high=1e6, closed="both", scope=RUN,
        short="load_phase",
    )  # fmt: skip
    name = "sine"
    harmonic = True

    def numbers(self, columns: Mapping[str, _Array], scale: Scale) -> dict[str, _Array]:
        """Angular frequency (rad/s) and amplitude (N)."""
        return {"omega": columns["frequency_ratio"] * scale.omega, "amplitude": columns["amplitude"]}

    def cycle(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """One period of the sine."""
        return np.asarray(2.0 * math.pi / (columns["frequency_ratio"] * scale.omega))

    def bounds(self, columns: Mapping[str, _Array], scale: Scale) -> tuple[_Array, _Array]:
        """Amplitudes of load and load rate, N and N/s."""
        return columns["amplitude"], columns["amplitude"] * columns["frequency_ratio"] * scale.omega


@dataclass(frozen=True, kw_only=True)
class LoadRamp(LoadMotion, Timed):
    """A load that changes smoothly from P to P + change and stays, x^3 (10 - 15 x + 6 x^2) of the share x of its way.

    A long ramp is quasi-static: a beam below the critical load unbuckles, and buckles again to the side that an
    imperfection favours.

    Parameters
    ----------
    change : float
        N, of either sign.
    duration : float
        Periods of the first mode that the change takes.
    hold_periods : float
        Periods of the first mode at P + change, after which the load goes back in *duration*; 1e9 by default.

    See Also
    --------
    snapbeam.AxialLoadModulation, snapbeam.HarmonicLoad

    Examples
    --------
    >>> import snapbeam as sb
    >>> load = sb.AxialLoadModulation(motion=sb.LoadRamp(change=2.0, duration=5.0))
    """

    change: float = quantity("N", "change of the axial load", scope=RUN, short="load_change")
    duration: float = quantity(
        "1", "periods of the first mode in which the axial load changes", low=0.0, scope=RUN, short="load_duration"
    )
    hold_periods: float = quantity(
        "1", "periods of the first mode for which the axial load stays changed", default=1e9, low=0.0, closed="left",
        scope=RUN, short="load_hold",
    )  # fmt: skip
    name = "ramp"

    def cycle(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """A period of the first mode."""
        return np.full(columns["change"].size, 2.0 * math.pi / scale.omega)

    def shape_numbers(self, columns: Mapping[str, _Array], scale: Scale) -> dict[str, _Array]:
        """The change in N, times in s."""
        cycle = self.cycle(columns, scale)
        duration = columns["duration"] * cycle
        return {
            "fastest": math.pi / duration,
            "change": columns["change"],
            "duration": duration,
            "hold_periods": columns["hold_periods"] * cycle,
        }

    def components(self, columns: Mapping[str, _Array], scale: Scale) -> list[Component]:
        """The way there, the stay, and the way back."""
        found = self.shape_numbers(columns, scale)
        duration, back = found["duration"], found["duration"] + found["hold_periods"]
        return [
            in_pieces(
                (np.zeros(1), rising(duration)), (duration, {0: np.ones(1)}), (back, rising(duration, back=True)),
                (back + duration, {}), gain=found["change"],
            )
        ]  # fmt: skip

    def bounds(self, columns: Mapping[str, _Array], scale: Scale) -> tuple[_Array, _Array]:
        """Maximum change, N, and maximum rate, N/s."""
        found = self.shape_numbers(columns, scale)
        return np.maximum(found["change"], 0.0), STEEPEST * np.abs(found["change"]) / found["duration"]

    def mirrored_bounds(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """Maximum decrease, N."""
        return np.maximum(-columns["change"], 0.0)


@dataclass(frozen=True, kw_only=True)
class AxialLoadModulation:
    """An axial load P(t) = P + motion(t), P that under which the beam was reduced.

    The linear stiffness of the beam then is E I k_i^2 - P(t). In addition to the tension, m alpha'' + ... =
    (P(t) - P) alpha.  The work of the change is that on the shortening alpha . alpha / 2 of the span.

    Parameters
    ----------
    motion : LoadMotion
        :class:`~snapbeam.HarmonicLoad` or :class:`~snapbeam.LoadRamp`.

    See Also
    --------
    snapbeam.HarmonicLoad, snapbeam.LoadRamp

    Examples
    --------
    >>> import snapbeam as sb
    >>> load = sb.AxialLoadModulation(motion=sb.HarmonicLoad(frequency_ratio=2.0, amplitude=3.0))
    >>> load.motion.amplitude
    3.0
    """

    motion: Drive

    noun: ClassVar[str] = "a changing axial load"
    """Name in messages."""
    rate_dependent: ClassVar[bool] = False
    """True if the force depends on the velocity of the structure."""

    def __post_init__(self) -> None:
        instance("motion", self.motion, LoadMotion, "a HarmonicLoad(frequency_ratio=2.0, amplitude=...) or a LoadRamp")
