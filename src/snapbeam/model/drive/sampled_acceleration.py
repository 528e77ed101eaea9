"""Motions given by samples of their acceleration."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.drive.base import Scale
from snapbeam.model.drive.components import Component, hermite, sampled
from snapbeam.model.drive.sampled import Sampled
from snapbeam.model.drive.shock import GRAVITY
from snapbeam.util.diagnostics import Diagnostic
from snapbeam.util.validation import integer, within

if TYPE_CHECKING:
    import xarray as xr

    from snapbeam.model.reduced_model import ReducedModel

_Array = NDArray[np.float64]
_LONGEST_DRIFT = 1.0
"""Displacement by an offset of the record, over the length scale, up to which it is plausible."""


class SampledAcceleration(Sampled):
    """A motion by samples of its acceleration, m/s^2: the cubic spline through all of them, times a gain, and its integrals."""

    def gain(self, columns: Mapping[str, _Array]) -> _Array:
        """Factor on the samples, shape (runs,)."""
        return np.ones(next(iter(columns.values())).size)

    @cached_property
    def _rows(self) -> _Array:
        """Acceleration, its rate, velocity and displacement at the samples, shape (samples, 4)."""
        from scipy.interpolate import CubicSpline

        times = np.arange(self.record.size) / self.sampling_frequency
        spline = CubicSpline(times, self.record)
        velocity = spline.antiderivative()
        moved = spline.antiderivative(2)
        gained = velocity(times)
        start = self._initial_velocity(gained, float(moved(times[-1])) / times[-1])
        return np.column_stack((self.record, spline(times, 1), gained + start, moved(times) + start * times))

    def _initial_velocity(self, gained: _Array, mean: float) -> float:
        """Velocity at the start, m/s, of a motion that gains these velocities, *mean* on average: their mean is zero."""
        return -mean

    @property
    def drift(self) -> float:
        """Range of the parabola through the displacement that an offset of the acceleration leaves, m; 0 without one.

        An offset a leaves a T^2/8 over a record of T, and is in the median of every quarter of it.  A shock, whose mean is
        no offset, has medians of zero, and those of noise differ in sign.
        """
        moved = self._rows[:, 3]
        times = np.linspace(-1.0, 1.0, moved.size)
        drift = float(np.ptp(np.polynomial.Polynomial.fit(times, moved, 2)(times)))
        medians = [float(np.median(part)) for part in np.array_split(self.record, 4)]
        of_offset = max(min(medians), -max(medians), 0.0) * self.duration**2 / 8.0
        return drift if drift > 0.5 * float(np.ptp(moved)) and of_offset > 0.5 * drift else 0.0

    def components(self, columns: Mapping[str, _Array], scale: Scale) -> list[Component]:
        """Twice the integrals of the cubics between samples."""
        rows, interval = self._rows, 1.0 / self.sampling_frequency
        cubics = hermite(rows[:, 0], rows[:, 1], interval)
        found = np.zeros((len(cubics), 6))
        found[:, 0], found[:, 1] = rows[:-1, 3], rows[:-1, 2]
        found[:, 2:] = cubics[:, :4] / np.array([2.0, 6.0, 12.0, 20.0])
        return [sampled(found, interval, self.gain(columns))]

    def peak_acceleration(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """A bound on the spline: between two samples it is at most both, and 4/27 of an interval times each slope."""
        most = np.abs(self._rows).max(axis=0)
        peak = float(most[0] + 8.0 / 27.0 * most[1] / self.sampling_frequency)
        return self.gain(columns) * peak

    def bounds(self, columns: Mapping[str, _Array], scale: Scale) -> tuple[_Array, _Array]:
        """Bounds of displacement and speed: the samples, plus the possible change within half an interval."""
        return self._bound(columns, scale, 1.0)

    def mirrored_bounds(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """The bound on the displacement to the other side."""
        return self._bound(columns, scale, -1.0)[0]

    def _bound(self, columns: Mapping[str, _Array], scale: Scale, sign: float) -> tuple[_Array, _Array]:
        half = 0.5 / self.sampling_frequency
        gain = self.gain(columns)
        speed = gain * np.abs(self._rows[:, 2]).max() + half * self.peak_acceleration(columns, scale)
        return gain * float((sign * self._rows[:, 3]).max()) + half * speed, speed

    @property
    def _stationary(self) -> slice:
        """Samples of which a spectrum is estimated."""
        return slice(None)

    def estimated_psd(self, segments: int = 32, confidence: float = 0.95) -> xr.Dataset:
        """Estimate the power spectral density of the acceleration by Welch's method, with an interval at each frequency.

        The segments overlap by half, under a Hann window.  The estimate over the true density is chi square over its
        degrees of freedom, 2 K/(1 + 2 c (K - 1)/K) of K overlapped segments, where c is the square of the correlation of
        the window with itself half a segment later (P. D. Welch, 1967).

        Parameters
        ----------
        segments : int
            Number of segments without overlap, from 2; more of them narrow the interval and widen the lines.
        confidence : float
            Probability with which an interval contains the true density, in (0, 1).

        Returns
        -------
        xarray.Dataset
            ``psd``, ``psd_low`` and ``psd_high`` (g^2/Hz) over ``frequency`` (Hz), of a random vibration with the density
            ``psd_target`` that it was drawn from; attribute ``rms_g``.

        Examples
        --------
        >>> import snapbeam as sb
        >>> motion = sb.RecordedAcceleration.from_psd([(20, 0.04), (200, 0.04)], duration_s=5.0)
        >>> list(motion.estimated_psd().data_vars)
        ['psd', 'psd_low', 'psd_high', 'psd_target']
        """
        from scipy.signal import get_window, welch
        from scipy.stats import chi2

        from snapbeam.util.datasets import xr

        gain = self.gain({name: np.array([value]) for name, value in self.values().items()})[0]
        values = gain * self.record[self._stationary] / GRAVITY
        count = values.size // integer("segments", segments, 2, values.size // 16) // 2 * 2
        within("confidence", confidence, 0.0, 1.0)
        window = get_window("hann", count)
        frequency, psd = welch(values, self.sampling_frequency, window, detrend=False)
        k = 2 * (values.size // count) - 1
        c = float(np.sum(window[: count // 2] * window[count // 2 :]) / np.sum(window**2)) ** 2
        freedom = 2.0 * k / (1.0 + 2.0 * c * (k - 1) / k)
        tails = chi2.ppf([0.5 + 0.5 * confidence, 0.5 - 0.5 * confidence], freedom) / freedom
        words = {
            "psd": "acceleration power spectral density, estimate",
            "psd_low": f"lower end of the {100 * confidence:g} % interval",
            "psd_high": f"upper end of the {100 * confidence:g} % interval",
            "psd_target": "given power spectral density",
        }
        found = dict(zip(words, (psd, psd / tails[0], psd / tails[1], self._density(frequency)), strict=True))
        return xr.Dataset(
            {
                name: ("frequency", each, {"units": "g^2/Hz", "long_name": words[name]})
                for name, each in found.items()
                if each is not None
            },
            {"frequency": ("frequency", frequency, {"units": "Hz", "long_name": "frequency"})},
            {"rms_g": float(np.sqrt(np.mean(values**2))), "degrees_of_freedom": freedom},
        )

    def _density(self, frequency: _Array) -> _Array | None:
        """The density that the samples were drawn from, g^2/Hz; None of a record."""
        return None

    def diagnostics(self, section: str, model: ReducedModel) -> list[Diagnostic]:
        """A drift of the displacement by an offset of the record."""
        drift = self.drift
        if model.length_scale is None or drift <= _LONGEST_DRIFT * model.length_scale:
            return []
        offset = float(np.median(self.record))
        return [
            Diagnostic(
                "drifting-record",
                f"{section}.record: its acceleration has an offset of {offset:.3g} m/s^2 ({offset / GRAVITY:.2g} g), by which "
                f"its displacement drifts by {drift:.3g} m ({drift / model.length_scale:.3g} times the length scale) within "
                f"{self.duration:.4g} s; subtract the offset, record - numpy.median(record), or filter the record by a "
                "high-pass below the lowest frequency that matters",
                {"drift": drift, "drift_over_length_scale": drift / model.length_scale, "offset": offset},
            )
        ]
