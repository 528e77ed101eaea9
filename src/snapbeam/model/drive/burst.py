"""A sine that comes smoothly and goes smoothly."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.drive.base import Scale, Timed, sincos, smooth_rise
from snapbeam.model.drive.components import Component, Tone, in_pieces, rising
from snapbeam.model.quantity import RUN, check_fields, quantity
from snapbeam.util.validation import InputError

_Array = NDArray[np.float64]
_STEEPEST = 1.875
"""Maximum slope of x^3 (10 - 15 x + 6 x^2) on [0, 1]."""
_SHARPEST = 5.7736
"""Maximum curvature of that polynomial, 10/sqrt(3)."""


@dataclass(frozen=True, kw_only=True)
class Burst(Timed):
    """Sine burst: the envelope rises from 0 to 1, stays at 1, and falls to 0.

    The displacement of the tip is

        w_s(t) = w_0 + E(t) (V b omega_1/omega) sin(omega t),

    with E = x^3 (10 - 15 x + 6 x^2) of the fraction x of the rise or of the fall: displacement, velocity and
    acceleration have no jump.  Afterwards the tip stays at its mid-position or, with *retraction*, leaves the beam.
    A burst longer than the run is a start-up.

    Parameters
    ----------
    frequency_ratio, velocity_amplitude : float
        Omega and V, as of a :class:`~snapbeam.Sine`.
    duration_cycles : float
        Cycles from the beginning of the rise to the end of the fall.
    ramp_up_cycles, ramp_down_cycles : float
        Cycles that they take, each greater than 0, together at most *duration_cycles*.
    retraction : float
        Withdrawal of the tip in the cycle after the burst, over b; it releases the beam.

    Examples
    --------
    >>> import snapbeam as sb
    >>> striker = sb.Striker(drive=sb.Burst(frequency_ratio=1.2, velocity_amplitude=0.1, duration_cycles=20.0))
    """

    frequency_ratio: float = quantity(
        "1", "excitation frequency over the first natural frequency", low=0.0, scope=RUN, symbol=r"\Omega"
    )
    velocity_amplitude: float = quantity(
        "1", "velocity amplitude over b omega_1", low=0.0, closed="left", scope=RUN, symbol="V"
    )
    duration_cycles: float = quantity("1", "cycles of the burst", low=0.0, scope=RUN)
    ramp_up_cycles: float = quantity("1", "cycles in which the drive rises", default=1.0, low=0.0, scope=RUN)
    ramp_down_cycles: float = quantity(
        "1", "cycles in which the drive falls", default=1.0, low=0.0, scope=RUN
    )
    retraction: float = quantity(
        "1", "distance that the tip withdraws after the burst, over b", default=0.0, low=0.0, closed="left", scope=RUN,
    )  # fmt: skip

    name = "burst"
    number_names = (
        "omega", "fastest", "rate", "amplitude", "retraction", "risen", "falling", "ended", "retracted"
    )  # fmt: skip
    discontinuities = ("risen", "falling", "ended", "retracted")
    amplitudes = ("amplitude", "retraction")

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
        amplitude = columns["velocity_amplitude"] * scale.length * scale.omega / rate
        cycle, ended = self.cycle(columns, scale), columns["duration_cycles"]
        times = {
            "risen": columns["ramp_up_cycles"], "falling": ended - columns["ramp_down_cycles"], "ended": ended,
            "retracted": ended + 1.0,
        }  # fmt: skip
        retreat = columns["retraction"] * scale.length
        return {"fastest": rate, "rate": rate, "amplitude": amplitude, "retraction": retreat} | {
            name: value * cycle for name, value in times.items()
        }

    def bounds(self, columns: Mapping[str, _Array], scale: Scale) -> tuple[_Array, _Array]:
        """The amplitude, and the speed with the steepest envelope."""
        found = self.shape_numbers(columns, scale)
        steepest = _STEEPEST / np.minimum(found["risen"], found["ended"] - found["falling"])
        speed = found["amplitude"] * (found["rate"] + steepest)
        speed = speed + found["retraction"] * _STEEPEST / (found["retracted"] - found["ended"])
        return found["amplitude"], speed

    def mirrored_bounds(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """The amplitude and the retraction."""
        found = self.shape_numbers(columns, scale)
        return np.asarray(found["amplitude"] + found["retraction"])

    def peak_acceleration(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """Bound of the acceleration: the sine with the steepest envelope, plus the retraction."""
        found = self.shape_numbers(columns, scale)
        rate, shortest = found["rate"], np.minimum(found["risen"], found["ended"] - found["falling"])
        shape = rate**2 + 2.0 * rate * _STEEPEST / shortest + _SHARPEST / shortest**2
        retreat = found["retraction"] * _SHARPEST / (found["retracted"] - found["ended"]) ** 2
        return np.asarray(found["amplitude"] * shape + retreat)

    @staticmethod
    def motion(drive: Any, memory: Any, argument: float) -> tuple[float, float]:
        """E w and its derivative."""
        t = argument / drive.omega
        e, slope, _ = _envelope(drive, t)
        away, speed, _ = _retreat(drive, t)
        sine, cosine = _turn(drive, t)
        return drive.amplitude * e * sine - away, drive.amplitude * (
            slope * sine + e * drive.rate * cosine
        ) - speed

    @staticmethod
    def acceleration(drive: Any, memory: Any, argument: float) -> float:
        """The second derivative."""
        t, rate = argument / drive.omega, drive.rate
        e, slope, bend = _envelope(drive, t)
        _, _, away = _retreat(drive, t)
        sine, cosine = _turn(drive, t)
        return drive.amplitude * ((bend - e * rate * rate) * sine + 2.0 * slope * rate * cosine) - away


def _envelope(drive: Any, t: float) -> tuple[float, float, float]:
    """E and its first two derivatives."""
    if t < drive.risen:
        e, slope, bend = smooth_rise(t / drive.risen)
        return e, slope / drive.risen, bend / (drive.risen * drive.risen)
    if t >= drive.ended:
        return 0.0, 0.0, 0.0
    if t > drive.falling:
        over = drive.ended - drive.falling
        e, slope, bend = smooth_rise((drive.ended - t) / over)
        return e, -slope / over, bend / (over * over)
    return 1.0, 0.0, 0.0


def _retreat(drive: Any, t: float) -> tuple[float, float, float]:
    """Distance by which the tip has withdrawn and its first two derivatives."""
    if t <= drive.ended:
        return 0.0, 0.0, 0.0
    over = drive.retracted - drive.ended
    e, slope, bend = smooth_rise(min((t - drive.ended) / over, 1.0))
    return drive.retraction * e, drive.retraction * slope / over, drive.retraction * bend / (over * over)


def _turn(drive: Any, t: float) -> tuple[float, float]:
    """Sine and cosine of the phase, of which whole turns are left out."""
    cycles = t * drive.rate / 6.283185307179586
    return sincos(6.283185307179586 * (cycles - math.floor(cycles)))
