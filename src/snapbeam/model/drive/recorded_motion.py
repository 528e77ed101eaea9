"""A measured motion of the tip in place of a formula."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.model.drive.base import Drive, Scale
from snapbeam.model.drive.components import Component, hermite, sampled
from snapbeam.model.drive.sampled import FileKeys, refuse_drift, require_unit
from snapbeam.model.quantity import check_fields, quantity
from snapbeam.util.validation import InputError, finite_array, instance, shown

if TYPE_CHECKING:
    import xarray as xr

_Array = NDArray[np.float64]
_SPEED_MARGIN = 1.5
"""Upper bound of the ratio of the speed of the interpolating cubic to the recorded speed."""


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordedMotion(FileKeys, Drive):
    """A measured motion of the tip, its start-up transient included.

    Between samples the motion is the cubic that matches displacement and velocity at both; the first displacement is
    taken as zero.

    Parameters
    ----------
    displacement, velocity : array_like of shape (samples,)
        Displacement (m) and velocity (m/s), positive towards the upper well. Over each interval the displacement
        changes by the velocities' mean, within a tenth of the maximum change.
    sampling_frequency : float
        Samples per second, Hz.
    frequency : float
        Nominal frequency of the excitation, Hz, which defines a cycle.

    See Also
    --------
    snapbeam.RecordedAcceleration, snapbeam.lab.recorded_drive

    Examples
    --------
    >>> import numpy as np
    >>> import snapbeam as sb
    >>> angle = 2.0 * np.pi * 100.0 * np.arange(2000) / 2e4
    >>> motion = sb.RecordedMotion(
    ...     displacement=5e-5 * np.sin(angle), velocity=5e-5 * 200.0 * np.pi * np.cos(angle),
    ...     sampling_frequency=2e4, frequency=100.0,
    ... )
    >>> striker = sb.Striker(drive=motion)
    """

    displacement: NDArray[np.float64] = quantity("m", "displacement of the tip, sampled", kind=object)
    velocity: NDArray[np.float64] = quantity("m/s", "velocity of the tip, sampled", kind=object)
    sampling_frequency: float = quantity("Hz", "samples per second", low=0.0)
    frequency: float = quantity("Hz", "nominal frequency of the excitation", low=0.0, short="drive_frequency")

    name = "recorded_motion"
    file_gives = ("displacement", "velocity", "sampling_frequency")
    recorded = True

    def __post_init__(self) -> None:
        check_fields(self)
        displacement, velocity = checked_record(self.displacement, self.velocity, self.sampling_frequency)
        object.__setattr__(self, "displacement", displacement)
        object.__setattr__(self, "velocity", velocity)

    @classmethod
    def from_dataset(cls, dataset: xr.Dataset) -> RecordedMotion:
        """Drive from the result of :func:`snapbeam.lab.recorded_drive`, or from its file.

        *dataset* has ``displacement`` (m) and ``velocity`` (m/s) over an even ``time`` (s), and the nominal
        ``frequency`` (Hz) among its attributes.
        """
        from snapbeam.util.datasets import xr

        instance("dataset", dataset, xr.Dataset, "an xarray.Dataset")
        missing = [name for name in ("time", "displacement", "velocity") if name not in dataset.variables]
        if missing or "frequency" not in dataset.attrs:
            raise InputError(
                f"dataset without {', '.join(missing) or 'attribute frequency'}: must be a recorded drive with "
                "time, displacement, velocity and frequency"
            )
        for name, unit in (("time", "s"), ("displacement", "m"), ("velocity", "m/s")):
            given = dataset[name].attrs.get("units", unit)
            if given != unit:
                raise InputError(f"{name} with units {shown(given)}: must be in {unit!r}")
        time = finite_array("time", dataset["time"].values, 1)
        if time.size < 4:
            raise InputError(f"time of {time.size} samples: must hold at least 4")
        interval = (time[-1] - time[0]) / (time.size - 1)
        if not interval > 0.0 or np.abs(np.diff(time) - interval).max() > 1e-6 * interval:
            raise InputError("time: must be evenly spaced and increasing")
        return cls(
            displacement=dataset["displacement"].values,
            velocity=dataset["velocity"].values,
            sampling_frequency=1.0 / interval,
            frequency=float(dataset.attrs["frequency"]),
        )

    @classmethod
    def _of_signal(cls, values: _Array, unit: str, rate: float, decided: bool, **fields: Any) -> RecordedMotion:
        """The cubic spline through displacements and its rate, or the integral of the one through velocities."""
        from scipy.interpolate import CubicSpline

        require_unit(unit, {"m": "a displacement", "m/s": "a velocity"})
        times = np.arange(values.size) / rate
        spline = CubicSpline(times, values)
        moved, speed = (values, spline(times, 1)) if unit == "m" else (spline.antiderivative()(times), values)
        change = abs(float(moved[-1] - moved[0]))
        if unit == "m/s" and not decided and change > 0.5 * float(np.ptp(moved)):
            refuse_drift(change, f"a mean velocity of {float(values.mean()):.3g} m/s")
        return cls(displacement=moved, velocity=speed, sampling_frequency=rate, **fields)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, RecordedMotion):
            return NotImplemented
        numbers = (self.sampling_frequency, self.frequency) == (other.sampling_frequency, other.frequency)
        return numbers and bool(
            np.array_equal(self.displacement, other.displacement) and np.array_equal(self.velocity, other.velocity)
        )

    def __hash__(self) -> int:
        return hash((self.sampling_frequency, self.frequency, self.displacement.tobytes(), self.velocity.tobytes()))

    @property
    def duration(self) -> float:
        """Length of the record, s."""
        return (self.displacement.size - 1) / self.sampling_frequency

    def numbers(self, columns: Mapping[str, _Array], scale: Scale) -> dict[str, _Array]:
        """The argument of a record makes one turn over the whole of it."""
        return {"omega": np.full(next(iter(columns.values())).size, 2.0 * math.pi / self.duration)}

    def cycle(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """One nominal period."""
        return np.full(next(iter(columns.values())).size, 1.0 / self.frequency)

    def frequencies(self, columns: Mapping[str, _Array], scale: Scale) -> None:
        """None: a record ends."""
        return

    def bounds(self, columns: Mapping[str, _Array], scale: Scale) -> tuple[_Array, _Array]:
        """Bounds of the recorded displacement and velocity, with a margin for motion between the samples."""
        runs = next(iter(columns.values())).size
        speed = _SPEED_MARGIN * float(np.abs(self.velocity).max())
        highest = float((self.displacement - self.displacement[0]).max()) + speed / self.sampling_frequency
        return np.full(runs, highest), np.full(runs, speed)

    def mirrored_bounds(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """Bound of the recorded displacement in the opposite direction."""
        runs = next(iter(columns.values())).size
        speed = _SPEED_MARGIN * float(np.abs(self.velocity).max())
        lowest = float((self.displacement - self.displacement[0]).min()) - speed / self.sampling_frequency
        return np.full(runs, -lowest)

    def components(self, columns: Mapping[str, _Array], scale: Scale) -> list[Component]:
        """The cubics between samples."""
        interval = 1.0 / self.sampling_frequency
        return [sampled(hermite(self.displacement - self.displacement[0], self.velocity, interval), interval)]


def checked_record(displacement: ArrayLike, velocity: ArrayLike, rate: float) -> tuple[_Array, _Array]:
    """Both as arrays, refused if they do not belong together."""
    moved = finite_array("displacement", displacement, 1)
    speed = finite_array("velocity", velocity, 1)
    if moved.size < 4 or moved.shape != speed.shape:
        raise InputError(
            f"displacement of shape {moved.shape}, velocity of shape {speed.shape}: must be "
            "equal and hold at least 4 samples"
        )
    change = np.diff(moved)
    mean = 0.5 * (speed[1:] + speed[:-1]) / rate
    worst = float(np.abs(change - mean).max())
    if worst > 0.1 * max(float(np.abs(change).max()), 1e-30):
        raise InputError(
            f"velocity: does not belong to displacement: over one interval they differ by {worst:.3g} m; "
            "resample both from one record"
        )
    return moved, speed
