"""A motion given by its measured acceleration."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.model.drive.sampled import FileKeys, refuse_drift, require_unit
from snapbeam.model.drive.sampled_acceleration import SampledAcceleration
from snapbeam.model.drive.shock import GRAVITY
from snapbeam.model.quantity import quantity
from snapbeam.util.validation import finite_array

if TYPE_CHECKING:
    from snapbeam.model.drive.random_vibration import RandomVibration

_Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordedAcceleration(FileKeys, SampledAcceleration):
    """A motion by its measured acceleration, such as that of a shaken base.

    Between samples the acceleration is a cubic spline; velocity and displacement are its exact integrals. The velocity
    has zero mean, so that the motion ends where it began. Low frequencies, such as an offset of the sensor, become
    large displacements: filter them out for a striker, or for a base under a striker in space. A cycle is a period of
    the first mode. A run must end before the record does.

    Parameters
    ----------
    record : array_like of shape (samples,)
        Acceleration, m/s^2, from the start of the run. :meth:`from_g` takes g, :meth:`from_file` a file,
        :meth:`from_psd` a spectrum.
    sampling_frequency : float
        Samples per second, Hz.

    See Also
    --------
    snapbeam.RecordedMotion, snapbeam.BaseExcitation

    Examples
    --------
    >>> import numpy as np
    >>> import snapbeam as sb
    >>> time = np.arange(2000) / 1e4  # s
    >>> record = 0.3 * np.sin(2.0 * np.pi * 80.0 * time)  # g
    >>> motion = sb.RecordedAcceleration.from_g(record, sampling_frequency=1e4)
    >>> base = sb.BaseExcitation(motion=motion)
    """

    record: _Array = quantity("m/s^2", "acceleration, sampled", kind=object)
    sampling_frequency: float = quantity("Hz", "samples per second", low=0.0)

    name = "recorded_acceleration"

    @classmethod
    def from_g(cls, record: ArrayLike, sampling_frequency: float) -> RecordedAcceleration:
        """Return a motion whose acceleration is given in g = 9.80665 m/s^2."""
        return cls(record=GRAVITY * finite_array("record", record, 1), sampling_frequency=sampling_frequency)

    @classmethod
    def _of_signal(cls, values: _Array, unit: str, rate: float, decided: bool, **fields: Any) -> RecordedAcceleration:
        require_unit(unit, {"m/s^2": "an acceleration"})
        made = cls(record=values, sampling_frequency=rate, **fields)
        if made.drift > 0.0 and not decided:
            refuse_drift(made.drift, f"an offset of {float(np.median(values)):.3g} m/s^2")
        return made

    @classmethod
    def from_psd(cls, psd: Any, duration_s: float, **options: Any) -> RandomVibration:
        """Return a random vibration by its power spectral density, a :class:`RandomVibration` with its *options*."""
        from snapbeam.model.drive.random_vibration import RandomVibration  # later: the order of DRIVES

        return RandomVibration(psd=psd, duration_s=duration_s, **options)
