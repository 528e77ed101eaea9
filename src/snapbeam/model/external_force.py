"""An external force on the structure: a history in newtons that acts on one row of its coordinates."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.drive.base import Drive, Scale, Timed
from snapbeam.model.drive.components import Component, Tone, half_tone, hermite, sampled
from snapbeam.model.drive.sampled import FileKeys, Sampled, require_unit
from snapbeam.model.quantity import RUN, STRUCTURE, check_fields, check_label, keep_shape, quantity
from snapbeam.model.reduced_model import ReducedModel, row_of_matrices
from snapbeam.util.validation import InputError, InputTypeError, shown

_Array = NDArray[np.float64]

FORCES: dict[str, type[Drive]] = {}
"""Every history of a force, by the name it has in parameter files."""


class ForceHistory(Drive):
    """A force as a function of time, N: a drive whose displacement is the force.

    ``constant_part`` is the part of it that lasts, under which a run begins at rest; ``peak_acceleration`` returns the
    maximum of the force, N.
    """

    registry: ClassVar[dict[str, type[Drive]]] = FORCES
    hooks = (*Drive.hooks, "shape_numbers", "constant_part")
    required: ClassVar[tuple[str, ...]] = ("cycle", "peak_acceleration")

    @property
    def constant_part(self) -> float:
        """Part of the force that does not change in time, N; 0 of a record."""
        return 0.0

    @classmethod
    def can_excite_base(cls) -> bool:
        """A force moves no base."""
        return False


@dataclass(frozen=True, kw_only=True)
class HarmonicForce(ForceHistory):
    """A harmonic force about a mean, F(t) = F_0 + F_1 sin(omega t + phase).

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
    snapbeam.ExternalForce, snapbeam.ConstantForce

    Examples
    --------
    >>> import snapbeam as sb
    >>> force = sb.ExternalForce(history=sb.HarmonicForce(frequency_ratio=0.9, amplitude=0.1), location=0.5)
    """

    frequency_ratio: float = quantity(
        "1", "frequency of the force over the first natural frequency", low=0.0, scope=RUN,
        short="force_frequency_ratio", symbol=r"\Omega",
    )  # fmt: skip
    amplitude: float = quantity(
        "N", "amplitude of the force", low=0.0, closed="left", scope=RUN, short="force_amplitude", symbol="F_1"
    )
    mean: float = quantity("N", "mean of the force", default=0.0, scope=RUN, short="force_mean", symbol="F_0")
    phase: float = quantity(
        "rad", "phase of the force at the start", default=0.0, low=-1e6, high=1e6, closed="both", scope=RUN,
        short="force_phase",
    )  # fmt: skip
    name = "harmonic_force"

    @property
    def constant_part(self) -> float:
        """F_0, N."""
        return self.mean

    def numbers(self, columns: Mapping[str, _Array], scale: Scale) -> dict[str, _Array]:
        """Angular frequency (rad/s), amplitude and mean (N)."""
        omega = columns["frequency_ratio"] * scale.omega
        return {"omega": omega, "amplitude": columns["amplitude"], "mean": columns["mean"]}

    def cycle(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """One period of the sine."""
        return np.asarray(2.0 * math.pi / (columns["frequency_ratio"] * scale.omega))

    def components(self, columns: Mapping[str, _Array], scale: Scale) -> list[Component]:
        """A tone about the mean."""
        return [Tone(columns["amplitude"], columns["frequency_ratio"] * scale.omega, columns["phase"], columns["mean"])]

    def peak_acceleration(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """Maximum force, N."""
        return np.asarray(columns["amplitude"] + np.abs(columns["mean"]))


@dataclass(frozen=True, kw_only=True)
class ConstantForce(ForceHistory, Timed):
    """A constant force, such as the weight of a free mass.

    A constant force on a structure that can rest under it is better given as the *transverse_force* of its model: runs
    then begin at rest under that force.  A cycle is a period of the first mode.

    Parameters
    ----------
    force : float
        N.

    See Also
    --------
    snapbeam.ExternalForce, snapbeam.HarmonicForce

    Examples
    --------
    >>> import snapbeam as sb
    >>> weight = sb.ExternalForce(history=sb.ConstantForce(force=-9.81e-3))
    """

    force: float = quantity("N", "constant force", scope=RUN, short="constant_force")
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

    def peak_acceleration(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """Peak force, N."""
        return np.abs(columns["force"])


@dataclass(frozen=True, kw_only=True)
class HalfSineForce(ForceHistory, Timed):
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

    peak: float = quantity("N", "peak force of the blow", scope=RUN, short="blow_peak", symbol="F_p")
    duration: float = quantity(
        "1", "duration of the blow over the period of the first mode", low=0.0, scope=RUN, short="blow_duration"
    )
    name = "half_sine_force"
    discontinuities = ("duration",)

    def cycle(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """A period of the first mode."""
        return np.full(columns["duration"].size, 2.0 * math.pi / scale.omega)

    def shape_numbers(self, columns: Mapping[str, _Array], scale: Scale) -> dict[str, _Array]:
        """The peak in N, the duration in s."""
        duration = columns["duration"] * self.cycle(columns, scale)
        return {"fastest": math.pi / duration, "amplitude": columns["peak"], "duration": duration}

    def components(self, columns: Mapping[str, _Array], scale: Scale) -> list[Component]:
        """Half a tone."""
        found = self.shape_numbers(columns, scale)
        return half_tone(found["amplitude"], found["duration"])

    def peak_acceleration(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """Peak force, N."""
        return np.abs(columns["peak"])


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

    def peak_acceleration(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """A bound on the spline: between two samples it is at most both, and 4/27 of an interval times each slope."""
        most = np.abs(self.record).max() + 8.0 / 27.0 * np.abs(self._rates).max() / self.sampling_frequency
        return np.full(next(iter(columns.values())).size, float(most))

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


@dataclass(frozen=True, kw_only=True, eq=False)
class ExternalForce:
    """A force on the structure: m alpha'' + ... = h F(t), where h is one row.

    Parameters
    ----------
    history : ForceHistory
        Force F(t): a :class:`~snapbeam.HarmonicForce`, :class:`~snapbeam.ConstantForce`,
        :class:`~snapbeam.model.HalfSineForce` or :class:`~snapbeam.RecordedForce`.
    location : float, optional
        Location of the force on a beam, over the length.
    shape : array_like of shape (N,), optional
        Row h of a structure given by matrices; its contact point by default.
    label : str, optional
        Name in place of the number of the force.

    See Also
    --------
    snapbeam.ConstantForce, snapbeam.HarmonicForce, snapbeam.model.HalfSineForce, snapbeam.RecordedForce

    Examples
    --------
    >>> import snapbeam as sb
    >>> oscillator = sb.ReducedModel.from_matrices(
    ...     [[1.0]], [1.0], contact_shape=[1.0], damping_ratio=0.05, reference_frequency=0.5 / 3.141592653589793
    ... )
    >>> system = sb.System(
    ...     oscillator,
    ...     forces=[sb.ExternalForce(history=sb.HarmonicForce(frequency_ratio=1.0, amplitude=0.2))],
    ... )
    """

    history: ForceHistory
    location: float | None = quantity(
        "1", "location of the force over the length", default=None, optional=True, low=0.0, high=1.0,
        scope=STRUCTURE,
    )  # fmt: skip
    shape: Any = quantity(
        "1", "force on each coordinate per unit of the force", default=None, optional=True, kind=object, scope=STRUCTURE
    )
    label: str = field(default="", repr=False)

    noun: ClassVar[str] = "an external force"
    """Name in messages."""
    rate_dependent: ClassVar[bool] = False
    """True if the force depends on the velocity of the structure."""

    def __post_init__(self) -> None:
        if not isinstance(self.history, ForceHistory):
            raise InputTypeError(
                f"history = {shown(self.history)}: must be a force in newtons; use a HarmonicForce, a ConstantForce, "
                "a HalfSineForce or a RecordedForce"
            )
        check_fields(self)
        check_label(self.label)
        keep_shape(self)

    @property
    def constant_part(self) -> float:
        """Part of the force that does not change in time, N."""
        return self.history.constant_part

    def row(self, model: ReducedModel) -> _Array:
        """Return h of a model, shape (N,).

        Raises
        ------
        InputError
            For a shape that does not fit the model, and for a beam without a location.
        """
        if model.beam is not None:
            if self.shape is not None or self.location is None:
                raise InputError(
                    f"force.location = {self.location}: a force on a beam acts at a location; give location "
                    "in (0, 1) and leave shape out"
                )
            return np.asarray(model.shape_at(self.location))
        if self.location is not None:
            raise InputError(
                f"force.location = {self.location:g}: a structure given by matrices has no length; give shape"
            )
        return row_of_matrices(model, self.shape)
