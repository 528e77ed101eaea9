"""Forces as functions of time, in newtons: external forces on the structure, and changes of the axial load."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.drive.base import SUMS, Drive, Scale, Timed
from snapbeam.model.drive.burst import EnvelopedSine
from snapbeam.model.drive.chirp import SweptSine
from snapbeam.model.drive.components import STEEPEST, Component, Tone, hermite, in_pieces, rising, sampled
from snapbeam.model.drive.half_sine import HalfSinePulse, duration_of_pulse
from snapbeam.model.drive.noise import NoiseInBand
from snapbeam.model.drive.sampled import FileKeys, Sampled, require_unit
from snapbeam.model.drive.sine import HarmonicMotion
from snapbeam.model.quantity import RUN, quantity
from snapbeam.util.validation import NamedTable

_Array = NDArray[np.float64]

FORCES: dict[str, type[Drive]] = NamedTable(lambda name: SUMS["named"](name, FORCES))
"""Every force by the name it has in parameter files; one such as ``harmonic_force+ramp_force`` is found too, though not listed."""


class ForceHistory(Drive):
    """A force as a function of time, N: a drive whose displacement is the force.

    ``constant_part`` is the part of it that lasts, under which a run begins at rest if it acts on the structure.
    """

    registry: ClassVar[dict[str, type[Drive]]] = FORCES
    hooks = (*Drive.hooks, "shape_numbers", "constant_part")
    required: ClassVar[tuple[str, ...]] = ("cycle", "bounds")

    @property
    def constant_part(self) -> float:
        """Part of the force that does not change in time, N; 0 of a record."""
        return 0.0

    @classmethod
    def can_excite_base(cls) -> bool:
        """A force moves no base."""
        return False


def force_amplitude() -> Any:
    """Return the field of the amplitude of a force."""
    return quantity("N", "amplitude", low=0.0, closed="left", scope=RUN, symbol="F_1")


@dataclass(frozen=True, kw_only=True)
class HarmonicForce(ForceHistory, HarmonicMotion):
    """A harmonic force about a mean, F(t) = F_0 + F_1 sin(omega t + phase).

    As an axial load it is parametric excitation; the principal resonance of the first mode lies near 2 omega_1.

    Parameters
    ----------
    frequency_ratio : float
        omega over omega_1.
    amplitude : float
        F_1, N.
    mean : float
        F_0, N.
    phase : float
        Phase at the start, rad; pi/2 gives a cosine.

    See Also
    --------
    snapbeam.ExternalForce, snapbeam.AxialLoadModulation, snapbeam.ConstantForce

    Examples
    --------
    >>> import snapbeam as sb
    >>> force = sb.ExternalForce(history=sb.HarmonicForce(frequency_ratio=0.9, amplitude=0.1), location=0.5)
    """

    amplitude: float = force_amplitude()
    mean: float = quantity("N", "mean", default=0.0, scope=RUN, symbol="F_0")
    phase: float = quantity("rad", "phase at the start", default=0.0, low=-1e6, high=1e6, closed="both", scope=RUN)
    name = "harmonic_force"

    @property
    def constant_part(self) -> float:
        """F_0, N."""
        return self.mean

    def _amplitude(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        return columns["amplitude"]

    def numbers(self, columns: Mapping[str, _Array], scale: Scale) -> dict[str, _Array]:
        """Angular frequency (rad/s), amplitude and mean (N)."""
        return super().numbers(columns, scale) | {"mean": columns["mean"]}

    def bounds(self, columns: Mapping[str, _Array], scale: Scale) -> tuple[_Array, _Array]:
        """Maximum of the force, N, and of its rate, N/s."""
        highest, fastest = super().bounds(columns, scale)
        return highest + np.abs(columns["mean"]), fastest


@dataclass(frozen=True, kw_only=True)
class ConstantForce(ForceHistory, Timed):
    """A constant force, such as the weight of a free mass.

    A constant force on a structure that can rest under it is better given as the *transverse_force* of its model: runs
    then begin at rest under that force.  A cycle is a period of the first mode.

    Parameters
    ----------
    force : float
        Force F, N.

    See Also
    --------
    snapbeam.ExternalForce, snapbeam.HarmonicForce

    Examples
    --------
    >>> import snapbeam as sb
    >>> weight = sb.ExternalForce(history=sb.ConstantForce(force=-9.81e-3))
    """

    force: float = quantity("N", "constant force", scope=RUN)
    name = "constant_force"

    @property
    def constant_part(self) -> float:
        """The force, N."""
        return self.force

    def components(self, columns: Mapping[str, _Array], scale: Scale) -> list[Component]:
        """A mean."""
        nothing = np.zeros(columns["force"].size)
        return [Tone(nothing, nothing, 0.0, columns["force"])]

    def cycle(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """A period of the first mode."""
        return np.full(columns["force"].size, 2.0 * math.pi / scale.omega)

    def frequencies(self, columns: Mapping[str, _Array], scale: Scale) -> list[_Array]:
        """None: it repeats after any time."""
        return []

    def shape_numbers(self, columns: Mapping[str, _Array], scale: Scale) -> dict[str, _Array]:
        """The force, which never changes."""
        return {"fastest": np.zeros(columns["force"].size), "force": columns["force"]}

    def bounds(self, columns: Mapping[str, _Array], scale: Scale) -> tuple[_Array, _Array]:
        """The force, N."""
        return np.abs(columns["force"]), np.zeros(columns["force"].size)


@dataclass(frozen=True, kw_only=True)
class HalfSineForce(ForceHistory, HalfSinePulse):
    """A blow, as of an impact hammer: F(t) = F_p sin(pi t/T) for t < T, and 0 after it.

    A cycle is a period of the first mode.

    Parameters
    ----------
    peak : float
        F_p, N, of either sign.
    duration : float
        T over the period of the first mode.

    See Also
    --------
    snapbeam.ExternalForce, snapbeam.RecordedForce, snapbeam.HalfSine

    Examples
    --------
    >>> import snapbeam as sb
    >>> blow = sb.ExternalForce(history=sb.model.HalfSineForce(peak=2.0, duration=0.05), location=0.3)
    """

    peak: float = quantity("N", "peak", scope=RUN, symbol="F_p")
    name = "half_sine_force"

    def _amplitude(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        return columns["peak"]


@dataclass(frozen=True, kw_only=True)
class BurstForce(ForceHistory, EnvelopedSine):
    """A burst of a harmonic force, F(t) = E(t) F_1 sin(omega t), with the envelope E of a :class:`~snapbeam.Burst`.

    Parameters
    ----------
    frequency_ratio : float
        omega over omega_1.
    amplitude : float
        F_1, N.
    duration_cycles, ramp_up_cycles, ramp_down_cycles
        Length, rise and fall of the envelope, as of a :class:`~snapbeam.Burst`.

    See Also
    --------
    snapbeam.Burst, snapbeam.ExternalForce

    Examples
    --------
    >>> import snapbeam as sb
    >>> burst = sb.model.BurstForce(frequency_ratio=0.9, amplitude=0.2, duration_cycles=20.0)
    >>> force = sb.ExternalForce(history=burst, location=0.5)
    """

    amplitude: float = force_amplitude()
    name = "burst_force"

    def _amplitude(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        return columns["amplitude"]


@dataclass(frozen=True, kw_only=True)
class ChirpForce(ForceHistory, SweptSine):
    """A force of constant amplitude whose frequency is swept, F(t) = F_1 sin(integral of omega).

    Parameters
    ----------
    start_ratio, stop_ratio, sweep_cycles, sweep_type
        Frequencies, duration and kind of the sweep, as of a :class:`~snapbeam.Chirp`.
    amplitude : float
        F_1, N.

    See Also
    --------
    snapbeam.Chirp, snapbeam.ExternalForce

    Examples
    --------
    >>> import snapbeam as sb
    >>> sweep = sb.model.ChirpForce(start_ratio=0.5, stop_ratio=2.0, amplitude=0.1, sweep_cycles=100.0)
    >>> force = sb.ExternalForce(history=sweep, location=0.5)
    """

    amplitude: float = force_amplitude()
    name = "chirp_force"
    _power = 0

    def _size(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        return columns["amplitude"]


@dataclass(frozen=True, kw_only=True)
class NoiseForce(ForceHistory, NoiseInBand):
    """A random force in a band: the sum of 32 sines of equal amplitude, as of a :class:`~snapbeam.BandLimitedNoise`.

    Parameters
    ----------
    low_ratio, high_ratio, seed, ramp_up_cycles
        Band, seed and rise, as of a :class:`~snapbeam.BandLimitedNoise`.
    rms : float
        Root mean square of the force, N.

    See Also
    --------
    snapbeam.BandLimitedNoise, snapbeam.RecordedForce, snapbeam.ExternalForce

    Examples
    --------
    >>> import snapbeam as sb
    >>> noise = sb.model.NoiseForce(low_ratio=0.5, high_ratio=2.0, rms=0.05, seed=1)
    >>> force = sb.ExternalForce(history=noise, location=0.5)
    """

    rms: float = quantity("N", "root mean square", low=0.0, closed="left", scope=RUN, symbol=r"F_\mathrm{rms}")
    name = "noise_force"
    _power = 0

    def _rms(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        return columns["rms"]


@dataclass(frozen=True, kw_only=True)
class RampForce(ForceHistory, Timed):
    """A force that rises smoothly from 0 to a change and stays, x^3 (10 - 15 x + 6 x^2) of the share x of its way.

    A long ramp of the axial load is quasi-static: a beam below the critical load unbuckles, and buckles again to the side
    that an imperfection favours.  A cycle is a period of the first mode.

    Parameters
    ----------
    change : float
        N, of either sign.
    duration : float
        Time of the rise over the period of the first mode.
    hold_periods : float
        Periods of the first mode at the change, after which the force goes back in *duration*; 1e9 by default.

    See Also
    --------
    snapbeam.AxialLoadModulation, snapbeam.ExternalForce

    Examples
    --------
    >>> import snapbeam as sb
    >>> load = sb.AxialLoadModulation(motion=sb.RampForce(change=2.0, duration=5.0))
    """

    change: float = quantity("N", "change", scope=RUN)
    duration: float = duration_of_pulse()
    hold_periods: float = quantity(
        "1", "periods of the first mode at the change", default=1e9, low=0.0, closed="left", scope=RUN
    )
    name = "ramp_force"

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


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordedForce(FileKeys, ForceHistory, Sampled):
    """A sampled force: any history.  Between samples it is the cubic spline through all of them.

    A cycle is a period of the first mode.  A run must end before the record does.

    Parameters
    ----------
    record : array_like of shape (samples,)
        N, the first sample at the start of the run; :meth:`from_file` reads a file.
    sampling_frequency : float
        Samples per second, Hz.

    See Also
    --------
    snapbeam.ExternalForce

    Examples
    --------
    >>> import numpy as np
    >>> import snapbeam as sb
    >>> record = 0.1 * np.sin(2.0 * np.pi * 80.0 * np.arange(2000) / 1e4)
    >>> force = sb.ExternalForce(history=sb.RecordedForce(record=record, sampling_frequency=1e4), location=0.5)
    """

    record: NDArray[np.float64] = quantity("N", "force, sampled", kind=object)
    sampling_frequency: float = quantity("Hz", "samples per second of the force", low=0.0)
    name = "recorded_force"

    @classmethod
    def _of_signal(cls, values: _Array, unit: str, rate: float, decided: bool, **fields: Any) -> RecordedForce:
        require_unit(unit, {"N": "a force"})
        return cls(record=values, sampling_frequency=rate, **fields)

    def bounds(self, columns: Mapping[str, _Array], scale: Scale) -> tuple[_Array, _Array]:
        """Bounds on the spline: between two samples it is at most both, and 4/27 of an interval times each slope.

        Its slope is at most 3/2 of the mean slope and both slopes at the ends.
        """
        size = next(iter(columns.values())).size
        steepest = np.abs(self._rates).max()
        most = np.abs(self.record).max() + 8.0 / 27.0 * steepest / self.sampling_frequency
        rate = 1.5 * np.abs(np.diff(self.record)).max() * self.sampling_frequency + 2.0 * steepest
        return np.full(size, float(most)), np.full(size, float(rate))

    def components(self, columns: Mapping[str, _Array], scale: Scale) -> list[Component]:
        """The cubics between samples."""
        interval = 1.0 / self.sampling_frequency
        return [sampled(hermite(self.record, self._rates, interval), interval)]

    @cached_property
    def _rates(self) -> _Array:
        """Slope of the cubic spline at the samples, N/s."""
        from scipy.interpolate import CubicSpline

        times = np.arange(self.record.size) / self.sampling_frequency
        return np.asarray(CubicSpline(times, self.record)(times, 1))
