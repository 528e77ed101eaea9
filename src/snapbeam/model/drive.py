"""The shaker: a tip that moves as prescribed and pushes the beam where they touch."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.core.validate import InputError, choice, finite_array, nonnegative, positive, within

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["RecordedDrive", "Shaker", "quasi_static_threshold"]


@dataclass(frozen=True, kw_only=True)
class Shaker:
    """A shaker whose tip has a sinusoidal velocity and starts in contact with the beam at rest (Eq. 16).

    With the buckling level b and the first natural frequency omega_1, both of the model in use, the
    tip moves as

        w_s(t) = w_b(x_s, 0) + (V b omega_1 / omega) sin(omega t),    omega = Omega omega_1.

    Parameters
    ----------
    frequency_ratio : float
        Excitation frequency over the first natural frequency, Omega, greater than 0.
    velocity_amplitude : float
        Velocity amplitude over b omega_1, V; 0 is a shaker at rest.
    location : float
        Position of the tip over the length of the beam, x_s, in (0, 1).
    side : {"below", "above"}
        Side of the beam the shaker pushes from.  ``"below"``: it pushes upward on the beam at rest in
        its lower well.  ``"above"`` is the mirror image, downward on the upper well.
    """

    frequency_ratio: float
    velocity_amplitude: float
    location: float = 1.0 / 2.1
    side: str = "below"

    def __post_init__(self) -> None:
        checked = {
            "frequency_ratio": positive("frequency_ratio", self.frequency_ratio),
            "velocity_amplitude": nonnegative("velocity_amplitude", self.velocity_amplitude),
            "location": within("location", self.location, 0.0, 1.0),
            "side": choice("side", self.side, ("below", "above")),
        }
        for name, value in checked.items():
            object.__setattr__(self, name, value)


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordedDrive:
    """A measured motion of the shaker in place of a sinusoidal one, its start-up transient included.

    The motion between samples is the cubic that matches displacement and velocity at both; the tip touches
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
        displacement = finite_array("displacement", self.displacement, 1)
        velocity = finite_array("velocity", self.velocity, 1)
        rate = positive("sampling_freq", self.sampling_freq, "Hz")
        if displacement.size < 4 or displacement.shape != velocity.shape:
            raise InputError(
                f"displacement of shape {displacement.shape}, velocity of shape {velocity.shape}: must be "
                "equal and hold at least 4 samples"
            )
        change = np.diff(displacement)
        mean = 0.5 * (velocity[1:] + velocity[:-1]) / rate
        worst = float(np.abs(change - mean).max())
        if worst > 0.1 * max(float(np.abs(change).max()), 1e-30):
            raise InputError(
                f"velocity: does not belong to displacement: over one interval they differ by {worst:.3g} m; "
                "resample both from one record"
            )
        checked = {
            "displacement": displacement,
            "velocity": velocity,
            "sampling_freq": rate,
            "frequency": positive("frequency", self.frequency, "Hz"),
            "location": within("location", self.location, 0.0, 1.0),
            "side": choice("side", self.side, ("below", "above")),
        }
        for name, value in checked.items():
            object.__setattr__(self, name, value)

    @classmethod
    def from_dataset(
        cls, dataset: xr.Dataset, *, location: float = 1.0 / 2.1, side: str = "below"
    ) -> RecordedDrive:
        """A drive from what :func:`snapbeam.lab.recorded_drive` returns, or from a file of it.

        *dataset* has ``displacement`` (m) and ``velocity`` (m/s) over an even ``time`` (s), and the nominal
        ``frequency`` (Hz) among its attributes.
        """
        missing = [name for name in ("time", "displacement", "velocity") if name not in dataset.variables]
        if missing or "frequency" not in dataset.attrs:
            raise InputError(
                f"dataset without {', '.join(missing) or 'attribute frequency'}: must be a recorded drive with "
                "time, displacement, velocity and frequency"
            )
        for name, unit in (("time", "s"), ("displacement", "m"), ("velocity", "m/s")):
            given = dataset[name].attrs.get("units", unit)
            if given != unit:
                raise InputError(f"{name} with units {given!r}: must be in {unit!r}")
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


def quasi_static_threshold(location: ArrayLike, frequency_ratio: ArrayLike) -> NDArray[np.float64]:
    """Velocity amplitude V_QS1 at which a slow shaker carries one mode over the unstable equilibrium.

    Eq. (21), V_QS1 = Omega phi_1(x_s)/phi_1(1/2) = Omega (1 - cos 2 pi x_s)/2: the shaker's highest
    position reaches the straight beam.

    Parameters
    ----------
    location : array_like
        x_s, each in (0, 1).
    frequency_ratio : array_like
        Omega, each greater than 0.  The two broadcast against each other.

    Returns
    -------
    array of the broadcast shape
    """
    x = finite_array("location", location)
    ratio = finite_array("frequency_ratio", frequency_ratio)
    if ((x <= 0.0) | (x >= 1.0)).any():
        bad = x[(x <= 0.0) | (x >= 1.0)].flat[0]
        raise InputError(f"location = {bad:g}: must lie in (0, 1)")
    if (ratio <= 0.0).any():
        raise InputError(f"frequency_ratio = {ratio[ratio <= 0.0].flat[0]:g}: must be greater than 0")
    threshold: NDArray[np.float64] = np.asarray(ratio * np.sin(np.pi * x) ** 2)
    return threshold
