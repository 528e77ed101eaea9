"""Noise within a band of frequencies."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.drive.base import Scale, Timed
from snapbeam.model.drive.components import SHARPEST, STEEPEST, Component, Tone, in_pieces, rising
from snapbeam.model.quantity import RUN, STRUCTURE, check_fields, quantity
from snapbeam.util.validation import InputError

_Array = NDArray[np.float64]
LINES = 32
"""Sines that the noise is made of, one in each equal part of the band, at a random place in it."""
_LOW_BITS = np.uint64(0xFFFFFFFF)


def seed_of_noise() -> Any:
    """The field ``seed`` of a random drive."""
    return quantity(
        "1", "seed of the noise", default=0, kind=int, low=0, high=2**31 - 1, scope=STRUCTURE, short="noise_seed"
    )


@dataclass(frozen=True, kw_only=True)
class NoiseInBand(Timed):
    """A sum of 32 sines, one in each equal part of a band; its kind gives the root mean square, of the rate (power 1) or of itself (0)."""

    low_ratio: float = quantity("1", "lower end of the band over the first natural frequency", low=0.0, scope=RUN)
    high_ratio: float = quantity("1", "upper end of the band over the first natural frequency", low=0.0, scope=RUN)
    seed: int = seed_of_noise()
    ramp_up_cycles: float = quantity("1", "cycles in which the drive rises", default=1.0, low=0.0, scope=RUN)
    discontinuities = ("risen",)
    _power: ClassVar[int] = 1

    def _rms(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        raise NotImplementedError

    def __post_init__(self) -> None:
        check_fields(self)
        if self.low_ratio >= self.high_ratio:
            raise InputError(f"low_ratio = {self.low_ratio:g}: must be less than high_ratio = {self.high_ratio:g}")

    def components(self, columns: Mapping[str, _Array], scale: Scale) -> list[Component]:
        """The tones in one window."""
        found, table = self.shape_numbers(columns, scale), self._sines()
        window = in_pieces((np.zeros(1), rising(found["risen"])), (found["risen"], {0: np.ones(1)}))
        rates = [found["low"] + place * (found["high"] - found["low"]) / LINES for place in table[:LINES]]
        return [
            Tone(found["strength"] / rate**self._power, rate, np.full(rate.size, phase), window=window)
            for rate, phase in zip(rates, table[LINES:], strict=True)
        ]

    def cycle(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """A period of the middle of the band."""
        return np.asarray(4.0 * math.pi / ((columns["low_ratio"] + columns["high_ratio"]) * scale.omega))

    def shape_numbers(self, columns: Mapping[str, _Array], scale: Scale) -> dict[str, _Array]:
        """The band in rad/s, the amplitude of each sine in m/s or N, the rise in s."""
        low, high = columns["low_ratio"] * scale.omega, columns["high_ratio"] * scale.omega
        return {
            "fastest": high,
            "low": low,
            "high": high,
            "strength": self._rms(columns, scale) * math.sqrt(2.0 / LINES),
            "risen": columns["ramp_up_cycles"] * self.cycle(columns, scale),
        }

    def bounds(self, columns: Mapping[str, _Array], scale: Scale) -> tuple[_Array, _Array]:
        """All sines at their heights at once."""
        found, p = self.shape_numbers(columns, scale), self._power
        highest, fastest = self._most(found, -p), self._most(found, 1 - p)
        return highest, fastest + highest * STEEPEST / found["risen"]

    def peak_acceleration(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """Bound of the acceleration: the sum of all amplitudes, plus the effect of the envelope."""
        found, p = self.shape_numbers(columns, scale), self._power
        highest, fastest, own = (self._most(found, k - p) for k in range(3))
        return np.asarray(own + (2.0 * STEEPEST * fastest + SHARPEST * highest / found["risen"]) / found["risen"])

    def _most(self, found: Mapping[str, _Array], power: int) -> _Array:
        """Sum of the amplitudes times a power of the rate, each at the end of its part of the band where that is highest."""
        parts = (np.arange(LINES) + (power > 0))[:, None] / LINES
        rates = found["low"] + parts * (found["high"] - found["low"])
        return np.asarray(found["strength"] * np.sum(rates**power, axis=0))

    def _sines(self) -> _Array:
        """Place of each sine in the band, in units of its part, then the phases."""
        counter = np.arange(2 * LINES, dtype=np.uint64)
        # a 32-bit integer mixed with its neighbours: every bit of seed and counter touches every bit of it
        mixed: NDArray[Any] = (np.uint64(self.seed * 2654435769) + counter * 2246822519 + 374761393) & _LOW_BITS
        mixed = ((mixed ^ (mixed >> 16)) * 2146121005) & _LOW_BITS
        mixed = ((mixed ^ (mixed >> 15)) * 2221713035) & _LOW_BITS
        shares = (mixed ^ (mixed >> 16)) / 4294967296.0
        return np.concatenate((np.arange(LINES) + shares[::2], 2.0 * math.pi * shares[1::2]))


@dataclass(frozen=True, kw_only=True)
class BandLimitedNoise(NoiseInBand):
    """Band-limited noise: the velocity is the sum of 32 sines of equal amplitude and random phases.

    The displacement of the tip is

        w_s(t) = w_0 + E(t) sum_j (a/omega_j) sin(omega_j t + phase_j),    a = V_rms b omega_1 sqrt(2/32),

    with one sine in each equal part of the band. A seed gives the same noise on every machine, which is new for about
    32 times the reciprocal of the bandwidth. E rises smoothly.

    Parameters
    ----------
    low_ratio, high_ratio : float
        The band, over the first natural frequency.
    velocity_rms : float
        Root mean square velocity over b omega_1.
    seed : int
        0 to 2^31 - 1.
    ramp_up_cycles : float
        Cycles of the middle of the band in which E rises.

    See Also
    --------
    snapbeam.RecordedAcceleration, snapbeam.RecordedMotion

    Examples
    --------
    >>> import snapbeam as sb
    >>> noise = sb.BandLimitedNoise(low_ratio=0.8, high_ratio=1.4, velocity_rms=0.1, seed=1)
    >>> striker = sb.Striker(drive=noise)
    """

    velocity_rms: float = quantity(
        "1", "root mean square velocity over b omega_1", low=0.0, closed="left", scope=RUN, symbol=r"V_\mathrm{rms}"
    )
    name = "band_limited_noise"

    def _rms(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        return np.asarray(columns["velocity_rms"] * scale.length * scale.omega)
