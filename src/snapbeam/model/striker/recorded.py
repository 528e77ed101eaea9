"""A striker that moves as it was measured to move."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.validate import InputError, finite_array, instance, shown
from snapbeam.model.drive.recorded import Recorded
from snapbeam.model.striker.striker import Striker

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["RecordedDrive"]


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordedDrive:
    """A measured motion of the shaker in place of a sinusoidal one, its start-up transient included.

    It is short for ``Striker(drive=Recorded(...), location=..., side=...)``.  The motion between samples is the cubic
    that matches displacement and velocity at both; the tip touches
    the resting beam at the first sample, whose displacement is taken as zero.

    Parameters
    ----------
    displacement, velocity : array_like of shape (samples,)
        Displacement (m) and velocity (m/s), positive towards the beam's upper well; they must belong
        together: over each interval the displacement changes by the velocities' mean, within a tenth
        of the greatest change.
    sampling_freq : float
        Samples per second, Hz.
    frequency : float
        Nominal frequency of the excitation, Hz: what a cycle is.
    location : float
        Position of the tip over the length of the beam, x_s, in (0, 1).
    side : {"below", "above"}
        Side of the beam the shaker pushes from.
    """

    displacement: NDArray[np.float64]
    velocity: NDArray[np.float64]
    sampling_freq: float
    frequency: float
    location: float = 1.0 / 2.1
    side: str = "below"

    def __post_init__(self) -> None:
        striker = self.striker()
        for name in ("displacement", "velocity", "sampling_freq", "frequency"):
            object.__setattr__(self, name, getattr(striker.drive, name))
        for name in ("location", "side"):
            object.__setattr__(self, name, getattr(striker, name))

    def striker(self) -> Striker:
        """The striker that it is."""
        drive = Recorded(
            displacement=self.displacement,
            velocity=self.velocity,
            sampling_freq=self.sampling_freq,
            frequency=self.frequency,
        )
        return Striker(drive=drive, location=self.location, side=self.side)

    @classmethod
    def from_dataset(
        cls, dataset: xr.Dataset, *, location: float = 1.0 / 2.1, side: str = "below"
    ) -> RecordedDrive:
        """A drive from what :func:`snapbeam.lab.recorded_drive` returns, or from a file of it.

        *dataset* has ``displacement`` (m) and ``velocity`` (m/s) over an even ``time`` (s), and the nominal
        ``frequency`` (Hz) among its attributes.
        """
        import xarray as xr

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
            sampling_freq=1.0 / interval,
            frequency=float(dataset.attrs["frequency"]),
            location=location,
            side=side,
        )

    @property
    def duration(self) -> float:
        """Length of the record, s."""
        return (self.displacement.size - 1) / self.sampling_freq
