"""The sum of two sines."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.drive.base import Scale, Timed
from snapbeam.model.drive.components import Component, Tone
from snapbeam.model.quantity import RUN, quantity

_Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class TwoTone(Timed):
    """Two-tone excitation: a sine and a second one, a harmonic or any other tone.

    The displacement of the tip is

        w_s(t) = w_0 + (V b omega_1/omega) sin(omega t) + A_2 [sin(omega_2 t + phase_2) - sin(phase_2)],

    with A_2 = V_2 b omega_1/omega_2.  A cycle is a period of the first sine.

    Parameters
    ----------
    frequency_ratio, velocity_amplitude : float
        Omega and V of the first.
    second_ratio, second_amplitude : float
        Omega and V of the second.
    second_phase : float
        Its phase at the start, rad.

    See Also
    --------
    snapbeam.Sine, snapbeam.SumDrive

    Examples
    --------
    >>> import snapbeam as sb
    >>> drive = sb.TwoTone(frequency_ratio=1.2, velocity_amplitude=0.1, second_ratio=1.8, second_amplitude=0.02)
    """

    frequency_ratio: float = quantity(
        "1", "excitation frequency over the first natural frequency", low=0.0, scope=RUN, symbol=r"\Omega"
    )
    velocity_amplitude: float = quantity(
        "1", "velocity amplitude over b omega_1", low=0.0, closed="left", scope=RUN, symbol="V"
    )
    second_ratio: float = quantity("1", "frequency ratio of the second sine", low=0.0, scope=RUN)
    second_amplitude: float = quantity(
        "1", "velocity amplitude of the second sine over b omega_1", low=0.0, closed="left", scope=RUN
    )
    second_phase: float = quantity(
        "rad", "phase of the second sine at the start", default=0.0, low=-1e6, high=1e6, closed="both", scope=RUN
    )

    name = "two_tone"

    def components(self, columns: Mapping[str, _Array], scale: Scale) -> list[Component]:
        """Two tones; the second begins at zero."""
        found = self.shape_numbers(columns, scale)
        a, phase = found["second_amplitude"], found["second_phase"]
        return [Tone(found["amplitude"], found["rate"]), Tone(a, found["second_rate"], phase, -a * np.sin(phase))]

    def cycle(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """One period of the first."""
        return np.asarray(2.0 * math.pi / (columns["frequency_ratio"] * scale.omega))

    def shape_numbers(self, columns: Mapping[str, _Array], scale: Scale) -> dict[str, _Array]:
        """Rates in rad/s, amplitudes in m."""
        rates = columns["frequency_ratio"] * scale.omega, columns["second_ratio"] * scale.omega
        speed = scale.length * scale.omega
        return {
            "fastest": np.maximum(*rates),
            "rate": rates[0],
            "amplitude": columns["velocity_amplitude"] * speed / rates[0],
            "second_rate": rates[1],
            "second_amplitude": columns["second_amplitude"] * speed / rates[1],
            "second_phase": columns["second_phase"],
        }

    def frequencies(self, columns: Mapping[str, _Array], scale: Scale) -> list[_Array]:
        """Frequencies of the two sines."""
        return [columns["frequency_ratio"] * scale.omega, columns["second_ratio"] * scale.omega]

    def bounds(self, columns: Mapping[str, _Array], scale: Scale) -> tuple[_Array, _Array]:
        """Both at their heights at once."""
        found = self.shape_numbers(columns, scale)
        a, b = found["amplitude"], found["second_amplitude"]
        return a + b * (1.0 - np.sin(found["second_phase"])), a * found["rate"] + b * found["second_rate"]

    def mirrored_bounds(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """Both at their depths at once."""
        found = self.shape_numbers(columns, scale)
        return np.asarray(found["amplitude"] + found["second_amplitude"] * (1.0 + np.sin(found["second_phase"])))

    def peak_acceleration(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """Both at their hardest at once."""
        found = self.shape_numbers(columns, scale)
        first = found["amplitude"] * found["rate"] ** 2
        return np.asarray(first + found["second_amplitude"] * found["second_rate"] ** 2)
