"""A sine that comes smoothly and goes smoothly."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.drive.base import Scale, Timed, sincos
from snapbeam.model.quantity import RUN, check_fields, quantity
from snapbeam.util.validation import InputError

__all__ = ["Burst"]


_Array = NDArray[np.float64]
_STEEPEST = 1.875
"""Greatest slope of x^3 (10 - 15 x + 6 x^2) on [0, 1]."""
_SHARPEST = 5.7736
"""Its greatest curvature, 10/sqrt(3)."""


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
        How far the tip withdraws in the cycle after the burst, over b: a beam released after so many cycles.

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
        "omega",
        "fastest",
        "rate",
        "amplitude",
        "duration_cycles",
        "ramp_up_cycles",
        "ramp_down_cycles",
        "retraction",
    )
    amplitudes = ("amplitude", "retraction")

    def __post_init__(self) -> None:
        check_fields(self)
        if self.ramp_up_cycles + self.ramp_down_cycles > self.duration_cycles * (1.0 + 1e-12):
            raise InputError(
                f"ramp_up_cycles = {self.ramp_up_cycles:g}, ramp_down_cycles = {self.ramp_down_cycles:g} with duration_cycles = {self.duration_cycles:g}: the ramps must together be at most duration_cycles"
            )

    def cycle(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """One period of the sine."""
        return np.asarray(2.0 * math.pi / (columns["frequency_ratio"] * scale.omega))

    def shape_numbers(self, columns: Mapping[str, _Array], scale: Scale) -> dict[str, _Array]:
        """Rates in rad/s, lengths in m, times in cycles."""
        rate = columns["frequency_ratio"] * scale.omega
        amplitude = columns["velocity_amplitude"] * scale.length * scale.omega / rate
        shape = {name: columns[name] for name in ("duration_cycles", "ramp_up_cycles", "ramp_down_cycles")}
        retreat = columns["retraction"] * scale.length
        return {"fastest": rate, "rate": rate, "amplitude": amplitude, "retraction": retreat} | shape

    def bounds(self, columns: Mapping[str, _Array], scale: Scale) -> tuple[_Array, _Array]:
        """The amplitude, and the speed with the steepest envelope."""
        found = self.shape_numbers(columns, scale)
        steep = _STEEPEST * found["rate"] / (2.0 * math.pi)
        shortest = np.minimum(found["ramp_up_cycles"], found["ramp_down_cycles"])
        speed = found["amplitude"] * (found["rate"] + steep / shortest) + found["retraction"] * steep
        return found["amplitude"], speed

    def peak_acceleration(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """That of the sine with the steepest and the sharpest envelope, and that of the retreat."""
        found = self.shape_numbers(columns, scale)
        per, rate = found["rate"] / (2.0 * math.pi), found["rate"]
        shortest = np.minimum(found["ramp_up_cycles"], found["ramp_down_cycles"])
        shape = rate**2 + 2.0 * rate * _STEEPEST * per / shortest + _SHARPEST * (per / shortest) ** 2
        return np.asarray(found["amplitude"] * shape + found["retraction"] * _SHARPEST * per**2)

    @staticmethod
    def motion(drive: Any, memory: Any, argument: float) -> tuple[float, float]:
        """E w and its derivative."""
        per = drive.rate / 6.283185307179586
        cycles = argument / drive.omega * per
        e, slope = 1.0, 0.0
        if cycles < drive.ramp_up_cycles:
            x = cycles / drive.ramp_up_cycles
            e = x * x * x * (10.0 + x * (6.0 * x - 15.0))
            slope = 30.0 * x * x * (1.0 - x) * (1.0 - x) * per / drive.ramp_up_cycles
        elif cycles >= drive.duration_cycles:
            e = 0.0
        elif cycles > drive.duration_cycles - drive.ramp_down_cycles:
            x = (drive.duration_cycles - cycles) / drive.ramp_down_cycles
            e = x * x * x * (10.0 + x * (6.0 * x - 15.0))
            slope = -30.0 * x * x * (1.0 - x) * (1.0 - x) * per / drive.ramp_down_cycles
        turn = 6.283185307179586 * (cycles - math.floor(cycles))
        sine, cosine = sincos(turn)
        a, away, speed = drive.amplitude, 0.0, 0.0
        if cycles > drive.duration_cycles:
            x = min(cycles - drive.duration_cycles, 1.0)
            away = drive.retraction * x * x * x * (10.0 + x * (6.0 * x - 15.0))
            speed = drive.retraction * 30.0 * x * x * (1.0 - x) * (1.0 - x) * per
        return a * e * sine - away, a * (slope * sine + e * drive.rate * cosine) - speed

    @staticmethod
    def acceleration(drive: Any, memory: Any, argument: float) -> float:
        """The second derivative."""
        per = drive.rate / 6.283185307179586
        cycles = argument / drive.omega * per
        e, slope, bend = 1.0, 0.0, 0.0
        x, over, turned = -1.0, 1.0, 1.0
        if cycles < drive.ramp_up_cycles:
            x, over = cycles / drive.ramp_up_cycles, drive.ramp_up_cycles
        elif cycles >= drive.duration_cycles:
            e = 0.0
        elif cycles > drive.duration_cycles - drive.ramp_down_cycles:
            x, over, turned = (
                (drive.duration_cycles - cycles) / drive.ramp_down_cycles,
                drive.ramp_down_cycles,
                -1.0,
            )
        if x >= 0.0:
            e = x * x * x * (10.0 + x * (6.0 * x - 15.0))
            slope = turned * 30.0 * x * x * (1.0 - x) * (1.0 - x) * per / over
            bend = 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x) * per * per / (over * over)
        turn = 6.283185307179586 * (cycles - math.floor(cycles))
        (sine, cosine), rate = sincos(turn), drive.rate
        away = 0.0
        if drive.duration_cycles < cycles < drive.duration_cycles + 1.0:
            y = cycles - drive.duration_cycles
            away = drive.retraction * 60.0 * y * (1.0 - y) * (1.0 - 2.0 * y) * per * per
        return drive.amplitude * ((bend - e * rate * rate) * sine + 2.0 * slope * rate * cosine) - away
