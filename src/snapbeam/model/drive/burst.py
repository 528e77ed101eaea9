"""A sine that comes smoothly and goes smoothly."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.drive.base import Scale, Timed, excitation_ratio, velocity_ratio
from snapbeam.model.drive.components import SHARPEST, STEEPEST, Component, Tone, in_pieces, rising
from snapbeam.model.quantity import RUN, check_fields, quantity
from snapbeam.util.validation import InputError

_Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class EnvelopedSine(Timed):
    """A sine whose envelope rises from 0 to 1 and falls to 0; its kind gives the amplitude (m, N) and the withdrawal after it."""

    frequency_ratio: float = excitation_ratio()
    duration_cycles: float = quantity("1", "cycles of the burst", low=0.0, scope=RUN)
    ramp_up_cycles: float = quantity("1", "cycles in which the drive rises", default=1.0, low=0.0, scope=RUN)
    ramp_down_cycles: float = quantity("1", "cycles in which the drive falls", default=1.0, low=0.0, scope=RUN)
    discontinuities = ("risen", "falling", "ended", "retracted")

    def _amplitude(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        raise NotImplementedError

    def _retraction(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        return np.zeros(columns["frequency_ratio"].size)

    def __post_init__(self) -> None:
        check_fields(self)
        if self.ramp_up_cycles + self.ramp_down_cycles > self.duration_cycles * (1.0 + 1e-12):
            raise InputError(
                f"ramp_up_cycles = {self.ramp_up_cycles:g}, ramp_down_cycles = {self.ramp_down_cycles:g} with duration_cycles = {self.duration_cycles:g}: the ramps must together be at most duration_cycles"
            )

    def components(self, columns: Mapping[str, _Array], scale: Scale) -> list[Component]:
        """A tone in a window, and the way back."""
        found = self.shape_numbers(columns, scale)
        risen, falling, ended, retracted = (found[name] for name in self.discontinuities)
        window = in_pieces(
            (np.zeros(1), rising(risen)),
            (risen, {0: np.ones(1)}),
            (falling, rising(ended - falling, back=True)),
            (ended, {}),
        )
        away = in_pieces(
            (np.zeros(1), {}),
            (ended, rising(retracted - ended)),
            (retracted, {0: np.ones(1)}),
            gain=-found["retraction"],
        )
        return [Tone(found["amplitude"], found["rate"], window=window), away]

    def cycle(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """One period of the sine."""
        return np.asarray(2.0 * math.pi / (columns["frequency_ratio"] * scale.omega))

    def shape_numbers(self, columns: Mapping[str, _Array], scale: Scale) -> dict[str, _Array]:
        """Rates in rad/s, lengths in m, ends of the ramps and of the retraction in s."""
        rate = columns["frequency_ratio"] * scale.omega
        amplitude, retreat = self._amplitude(columns, scale), self._retraction(columns, scale)
        cycle, ended = self.cycle(columns, scale), columns["duration_cycles"]
        times = {
            "risen": columns["ramp_up_cycles"], "falling": ended - columns["ramp_down_cycles"], "ended": ended,
            "retracted": ended + 1.0,
        }  # fmt: skip
        return {"fastest": rate, "rate": rate, "amplitude": amplitude, "retraction": retreat} | {
            name: value * cycle for name, value in times.items()
        }

    def bounds(self, columns: Mapping[str, _Array], scale: Scale) -> tuple[_Array, _Array]:
        """The amplitude, and the speed with the steepest envelope."""
        found = self.shape_numbers(columns, scale)
        steepest = STEEPEST / np.minimum(found["risen"], found["ended"] - found["falling"])
        speed = found["amplitude"] * (found["rate"] + steepest)
        speed = speed + found["retraction"] * STEEPEST / (found["retracted"] - found["ended"])
        return found["amplitude"], speed

    def mirrored_bounds(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """The amplitude and the retraction."""
        found = self.shape_numbers(columns, scale)
        return np.asarray(found["amplitude"] + found["retraction"])

    def peak_acceleration(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """Bound of the acceleration: the sine with the steepest envelope, plus the retraction."""
        found = self.shape_numbers(columns, scale)
        rate, shortest = found["rate"], np.minimum(found["risen"], found["ended"] - found["falling"])
        shape = rate**2 + 2.0 * rate * STEEPEST / shortest + SHARPEST / shortest**2
        retreat = found["retraction"] * SHARPEST / (found["retracted"] - found["ended"]) ** 2
        return np.asarray(found["amplitude"] * shape + retreat)


@dataclass(frozen=True, kw_only=True)
class Burst(EnvelopedSine):
    """Sine burst: the envelope rises from 0 to 1, stays at 1, and falls to 0.

    The displacement of the tip is

        w_s(t) = w_0 + E(t) (V b omega_1/omega) sin(omega t),

    with E = x^3 (10 - 15 x + 6 x^2) of the fraction x of the rise or fall, without jumps up to the acceleration.
    Afterwards the tip stays at its mid-position or, with *retraction*, leaves the beam. A burst longer than the run is
    a start-up.

    Parameters
    ----------
    frequency_ratio, velocity_amplitude : float
        Omega and V, as of a :class:`~snapbeam.Sine`.
    duration_cycles : float
        Cycles from the beginning of the rise to the end of the fall.
    ramp_up_cycles, ramp_down_cycles : float
        Cycles of rise and fall, each greater than 0, together at most *duration_cycles*.
    retraction : float
        Withdrawal of the tip in the cycle after the burst, over b; it releases the beam.

    See Also
    --------
    snapbeam.Sine, snapbeam.HalfSine

    Examples
    --------
    >>> import snapbeam as sb
    >>> striker = sb.Striker(drive=sb.Burst(frequency_ratio=1.2, velocity_amplitude=0.1, duration_cycles=20.0))
    """

    velocity_amplitude: float = velocity_ratio()
    retraction: float = quantity(
        "1", "distance that the tip withdraws after the burst, over b", default=0.0, low=0.0, closed="left", scope=RUN,
    )  # fmt: skip
    name = "burst"

    def _amplitude(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        return np.asarray(columns["velocity_amplitude"] * scale.length / columns["frequency_ratio"])

    def _retraction(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        return np.asarray(columns["retraction"] * scale.length)
