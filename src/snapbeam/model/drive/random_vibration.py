"""Random vibration: a stationary Gaussian acceleration by its power spectral density."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.model.drive.components import RISE
from snapbeam.model.drive.noise import seed_of_noise
from snapbeam.model.drive.sampled_acceleration import SampledAcceleration
from snapbeam.model.drive.shock import GRAVITY
from snapbeam.model.quantity import RUN, STRUCTURE, check_fields, quantity
from snapbeam.util.units import number_in_unit
from snapbeam.util.validation import InputError, shown

if TYPE_CHECKING:
    from snapbeam.model.reduced_model import ReducedModel
    from snapbeam.util.diagnostics import Diagnostic

_Array = NDArray[np.float64]
_Points = tuple[tuple[float, float], ...]

SPECTRA: dict[str, _Points] = {
    # figures of MIL-STD-810G (2008), method 514.6: annex C, US highway truck; annex E, general minimum integrity
    "MIL-STD-810G 514.6C-1 vertical": ((10.0, 0.015), (40.0, 0.015), (500.0, 0.00015)),
    "MIL-STD-810G 514.6C-1 transverse": (
        (10.0, 0.00013), (20.0, 0.00065), (30.0, 0.00065), (78.0, 0.00002), (79.0, 0.00019), (120.0, 0.00019),
        (500.0, 0.00001),
    ),
    "MIL-STD-810G 514.6C-1 longitudinal": (
        (10.0, 0.0065), (20.0, 0.0065), (120.0, 0.0002), (121.0, 0.003), (200.0, 0.003), (240.0, 0.0015),
        (340.0, 0.00003), (500.0, 0.00015),
    ),
    "MIL-STD-810G 514.6E-1": ((20.0, 0.04), (1000.0, 0.04), (2000.0, 0.01)),
    # Navy Manufacturing Screening Program (1979): 3 dB/octave up to 80 Hz and down from 350 Hz
    "NAVMAT P-9492": ((20.0, 0.01), (80.0, 0.04), (350.0, 0.04), (2000.0, 0.007)),
}  # fmt: skip
"""Break points, Hz and g^2/Hz, by the number of the standard and its figure."""
_SAMPLES_PER_PERIOD = 8
"""Samples in the shortest period: the cubic spline through them keeps 99.9 % of the amplitude there."""
_MOST_SAMPLES = 1 << 22
_UNITS = (("Hz", 1.0), ("m^2/s^3", GRAVITY**-2))
"""Units of a frequency and of a density, by pint, and their sizes."""


def break_points(name: str, value: Any) -> _Points:
    """Pairs of Hz and g^2/Hz: from such pairs, with or without units, or from the name of a spectrum."""
    if isinstance(value, str):
        if value not in SPECTRA:
            raise InputError(
                f"{name} = {shown(value)}: must be one of {', '.join(map(repr, SPECTRA))}, or break points"
            )
        return SPECTRA[value]
    form = "must be at least two pairs of frequency (Hz) and density (g^2/Hz), such as [[20, 0.04], [2000, 0.04]]"
    pairs = value.tolist() if isinstance(value, np.ndarray) else value
    if not isinstance(pairs, Sequence) or len(pairs) < 2:
        raise InputError(f"{name} = {shown(value)}: {form}")
    found = []
    for pair in pairs:
        if isinstance(pair, str) or not isinstance(pair, Sequence) or len(pair) != 2:
            raise InputError(f"{name}: {shown(pair)} is no pair; {form}")
        found.append(tuple(_number(name, *each) for each in zip(pair, _UNITS, strict=True)))
    points = np.array(found)
    if not (points > 0.0).all():
        raise InputError(f"{name}: {found[int(np.argmin(points.min(axis=1)))]}: both numbers must be greater than 0")
    if not (np.diff(points[:, 0]) > 0.0).all():
        at = int(np.argmin(np.diff(points[:, 0])))
        raise InputError(f"{name}: {found[at + 1][0]:g} Hz after {found[at][0]:g} Hz: frequencies must increase")
    return tuple((float(f), float(g)) for f, g in found)


def _number(name: str, value: Any, unit: tuple[str, float]) -> float:
    """A number in Hz or g^2/Hz, given as such or as text with a unit."""
    own, size = unit
    try:
        number = float(value)
    except (TypeError, ValueError):
        try:
            stated = number_in_unit(value, own) if isinstance(value, str) else None
        except InputError as error:
            raise InputError(f"{name}: {shown(value)}: {error}") from None
        number = math.nan if stated is None else stated * size
    if not math.isfinite(number):
        raise InputError(f"{name}: {shown(value)}: must be a finite number in {'Hz' if own == 'Hz' else 'g^2/Hz'}")
    return number


def mean_square(points: _Points, low: ArrayLike, high: ArrayLike) -> _Array:
    """Integral of a density with straight lines between its break points on logarithmic axes, from *low* to *high*.

    On a segment g (f/f_0)^n the integral is g f_0 ((f/f_0)^(n+1) - 1)/(n + 1), and g f_0 ln(f/f_0) for n = -1; outside the
    break points the density is zero.
    """
    f0, g0 = np.array(points).T
    order = np.diff(np.log(g0)) / np.diff(np.log(f0)) + 1.0

    def up_to(f: _Array) -> _Array:
        rise = np.clip(np.log(f[..., None] / f0[:-1]), 0.0, np.diff(np.log(f0)))
        slope = np.where(order == 0.0, 1.0, order)
        return np.sum(g0[:-1] * f0[:-1] * np.where(order == 0.0, rise, np.expm1(slope * rise) / slope), axis=-1)

    lowest = f0[0]
    return np.asarray(
        up_to(np.maximum(np.asarray(high, float), lowest)) - up_to(np.maximum(np.asarray(low, float), lowest))
    )


@dataclass(frozen=True, kw_only=True)
class RandomVibration(SampledAcceleration):
    """A stationary Gaussian acceleration by its one-sided power spectral density.

    With independent normal numbers A_k and B_k of variance 1 the acceleration is

        a(t) = sum_k s_k (A_k cos(2 pi f_k t) + B_k sin(2 pi f_k t)),

    with s_k^2 the integral of the density around f_k, and f_k in steps of less than half the reciprocal of the duration. With *ramp_up_s* the displacement rises
    smoothly, and the acceleration is its second derivative. A seed gives the same motion in every run. A cycle is a
    period of the first mode; a run must end before the duration does.

    Parameters
    ----------
    psd : array_like of shape (points, 2), or str
        Break points, Hz and g^2/Hz, with straight lines between them on logarithmic axes and nothing outside; or the
        name of a spectrum of a standard, such as ``"MIL-STD-810G 514.6E-1"``.
    duration_s : float
        Duration, s.
    rms_g : float, optional
        Root mean square acceleration, g, to scale the density to.
    seed : int
        0 to 2^31 - 1.
    ramp_up_s : float
        Time in which the motion rises, s; 0 by default.

    Raises
    ------
    InputError
        For bad values and for more than 4 million samples, eight in the shortest period.

    Examples
    --------
    >>> import snapbeam as sb
    >>> motion = sb.RecordedAcceleration.from_psd("MIL-STD-810G 514.6E-1", duration_s=0.5, seed=1)
    >>> round(motion.rms_g, 2)
    7.69
    >>> base = sb.BaseExcitation(motion=motion)
    """

    psd: Any = quantity(
        "g^2/Hz", "power spectral density of the acceleration, break points", kind=object, parse=break_points
    )
    duration_s: float = quantity("s", "duration of the random vibration", low=0.0)
    rms_g: float = quantity(
        "g", "root mean square acceleration", default=None, optional=True, low=0.0, closed="left", scope=RUN
    )
    seed: int = seed_of_noise()
    ramp_up_s: float = quantity(
        "s", "time in which the random vibration rises", default=0.0, low=0.0, closed="left", scope=STRUCTURE
    )

    name = "random_vibration"
    file_keys = ("columns", "unit")
    file_gives = ("psd",)

    def __post_init__(self) -> None:
        check_fields(self)
        size = self.duration_s * self.sampling_frequency
        if not 16 <= size <= _MOST_SAMPLES:
            low, high = (each / self.sampling_frequency for each in (16, _MOST_SAMPLES))
            raise InputError(
                f"duration_s = {self.duration_s:g} s: must be {low:.3g} to {high:.4g} s for a density up to "
                f"{self.psd[-1][0]:g} Hz"
            )
        if self.ramp_up_s >= self.duration_s:
            raise InputError(f"ramp_up_s = {self.ramp_up_s:g} s: must be less than duration_s = {self.duration_s:g} s")
        if self.rms_g is None:
            object.__setattr__(self, "rms_g", self._rms_of_psd)

    @classmethod
    def from_file(
        cls, file: Any, *, columns: Sequence[str] | None = None, unit: str | None = None, **fields: Any
    ) -> RandomVibration:
        r"""Return a random vibration whose break points are in two columns of a text table.

        Parameters
        ----------
        file : path
        columns : pair of str, optional
            Names of the columns of the frequencies and of the density; the first two by default.
        unit : str, optional
            Unit of the density where the header of its column does not state it; g^2/Hz by default.
        **fields
            Other fields, such as *duration_s*.

        Examples
        --------
        >>> from pathlib import Path
        >>> from snapbeam.model.drive.random_vibration import RandomVibration
        >>> _ = Path("psd.csv").write_text("frequency (Hz),psd (g^2/Hz)\n20,0.04\n2000,0.04\n")
        >>> RandomVibration.from_file("psd.csv", duration_s=1.0).psd
        ((20.0, 0.04), (2000.0, 0.04))
        """
        from snapbeam.parts import signal_files

        (f, hertz), (g, stated) = signal_files().read_columns(
            file, columns, ("Hz", unit or "g^2/Hz"), are_stated=unit is not None
        )
        points = [(f"{x!r} {hertz}", f"{y!r} {stated}") for x, y in zip(f, g, strict=True)]
        try:
            return cls(psd=points, **fields)
        except InputError as error:
            raise InputError(f"file = {str(file)!r}: {error}") from error

    @cached_property
    def _rms_of_psd(self) -> float:
        return math.sqrt(float(mean_square(self.psd, 0.0, math.inf)))

    @property
    def sampling_frequency(self) -> float:
        """Samples per second, Hz."""
        return float(_SAMPLES_PER_PERIOD * self.psd[-1][0])

    def gain(self, columns: Mapping[str, _Array]) -> _Array:
        """Root mean square over that of the density."""
        return np.asarray(columns["rms_g"] / self._rms_of_psd)

    @cached_property
    def _drawn(self) -> tuple[_Array, _Array]:
        """Acceleration, m/s^2, and velocity at the samples."""
        from scipy.fft import irfft, next_fast_len

        rate = self.sampling_frequency
        count = math.ceil(self.duration_s * rate) + 1
        whole = next_fast_len(2 * count, real=True)
        step = rate / whole
        line = np.arange(1, whole // 2)
        f = step * line
        size = GRAVITY * np.sqrt(mean_square(self.psd, f - 0.5 * step, f + 0.5 * step))
        normal = np.random.default_rng(self.seed).standard_normal((2, line.size))
        a = np.zeros(whole // 2 + 1, dtype=complex)
        a[line] = 0.5 * whole * size * (normal[0] - 1j * normal[1])
        spin = 2j * np.pi * f
        v, x = a.copy(), a.copy()
        v[line] /= spin
        x[line] /= spin**2
        acceleration, velocity, moved = (irfft(each, whole)[:count] for each in (a, v, x))
        if self.ramp_up_s > 0.0:
            t = np.minimum(np.arange(count) / rate / self.ramp_up_s, 1.0)
            e, slope, bend = (np.polynomial.Polynomial(RISE).deriv(k)(t) for k in range(3))
            slope, bend = slope / self.ramp_up_s, bend / self.ramp_up_s**2
            acceleration = e * acceleration + 2.0 * slope * velocity + bend * moved
            velocity = e * velocity + slope * moved
        return acceleration, velocity

    @property
    def record(self) -> _Array:
        """Samples of the acceleration before :attr:`rms_g` scales them, m/s^2."""
        return self._drawn[0]

    @property
    def _stationary(self) -> slice:
        """Samples after the rise."""
        return slice(math.ceil(self.ramp_up_s * self.sampling_frequency), None)

    def _density(self, frequency: _Array) -> _Array:
        """Straight lines between the break points on logarithmic axes, scaled to the root mean square."""
        f, g = np.log(np.array(self.psd)).T
        with np.errstate(divide="ignore"):
            found = np.exp(np.interp(np.log(frequency), f, g, -np.inf, -np.inf))
        return np.asarray(found * (self.rms_g / self._rms_of_psd) ** 2)

    def _initial_velocity(self, gained: _Array, mean: float) -> float:
        """Initial velocity of the sum, for a displacement that does not drift, by least squares."""
        return float(np.mean(self._drawn[1] - gained))

    def diagnostics(self, section: str, model: ReducedModel) -> list[Diagnostic]:
        """No diagnostics, since the motion has no offset."""
        return []
