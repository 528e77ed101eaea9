"""A tracked waveform as a measurement: what a beam would have done, sample by sample, as far as that can be known."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.config.physical import unit_of
from snapbeam.core.findings import DiagnosticWarning
from snapbeam.core.kinds import checked
from snapbeam.core.validate import InputError, InputTypeError, choice, finite_array, positive, shown
from snapbeam.model.integration import Integration
from snapbeam.model.system import System
from snapbeam.runs.simulate import simulate
from snapbeam.runs.tolerance import perturbation_growth

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Waveform"]

_Array = NDArray[np.float64]
_TINY = 1e-13
"""Relative change of the drive whose response is measured."""
_LOST = 1e3
"""Standard errors of a run that fails, at every sample."""
_SEEN = {"contact": "displacement_at_striker", "center": "midspan_displacement"}


@dataclass(frozen=True, eq=False, kw_only=True)
class Waveform:
    """A measured motion of a struck beam, to be given to :func:`snapbeam.posterior`.

    It counts up to its **horizon**: the time until which the response to a relative change of the drive by
    *drive_error* stays below the standard error.  Beyond it nothing that is measured says anything of the beam.

    Parameters
    ----------
    system : System
        The nominal system: beam, contact, and the striker with a sinusoidal drive, whose frequency and speed are held
        in Hz and m/s whatever the beam.
    time : array_like of shape (samples,)
        s since the drive began, ascending.
    displacement : array_like of shape (samples,)
        m, from the straight beam; NaN where nothing was found.
    standard_error : float
        Of a sample, m.  Errors are taken as independent: thin samples that are not.
    at : {"contact", "center"}
        Where it was measured.
    drive_error : float
        Relative error of what is known of the drive's amplitude.
    """

    system: System
    time: ArrayLike
    displacement: ArrayLike
    standard_error: float
    at: str = "contact"
    drive_error: float = 1e-4

    def __post_init__(self) -> None:
        if not isinstance(self.system, System):
            raise InputTypeError(f"system = {shown(self.system)}: must be a System")
        striker = self.system.striker
        if striker is None or not striker.drive.harmonic or not hasattr(striker.drive, "velocity_amplitude"):
            raise InputError("system: must have a striker with a sine of given velocity")
        if self.system.model.beam is None:
            raise InputError("system: must be that of a beam; a model of matrices has no parameters to find")
        time = finite_array("time", self.time, 1)
        if time.size < 2 or time[0] < 0.0 or (np.diff(time) <= 0.0).any():
            raise InputError("time: must hold two instants at least, ascending, none before 0")
        try:
            seen = np.array(self.displacement, dtype=np.float64)
        except (TypeError, ValueError, OverflowError):
            raise InputTypeError(
                f"displacement = {shown(self.displacement)}: must be an array of numbers"
            ) from None
        if seen.shape != time.shape or np.isinf(seen).any() or not np.isfinite(seen).any():
            raise InputError(f"displacement of shape {seen.shape}: must hold a number, or NaN, for each time")
        positive("standard_error", self.standard_error, "m")
        positive("drive_error", self.drive_error)
        choice("at", self.at, tuple(_SEEN))
        object.__setattr__(self, "time", time)
        object.__setattr__(self, "displacement", seen)

    @classmethod
    @checked
    def from_dataset(
        cls, dataset: xr.Dataset, system: System, standard_error: float, *, at: str = "contact", **more: Any
    ) -> Waveform:
        """That of a tracked or simulated run, whose displacements are over the system's own buckling level.

        *standard_error* is in m; *more* are other arguments.
        """
        choice("at", at, tuple(_SEEN))
        if _SEEN[at] not in dataset:
            raise InputError(f"dataset: has no {_SEEN[at]}")
        seen = dataset[_SEEN[at]].values * system.scale.length
        if "valid" in dataset:
            seen = np.where(dataset["valid"].values.astype(bool), seen, np.nan)
        return cls(
            system=system, time=dataset["time"].values, displacement=seen, standard_error=standard_error, at=at, **more
        )  # fmt: skip

    @property
    def period(self) -> float:
        """Of the drive, s."""
        assert self.system.striker is not None
        ratio = float(self.system.striker.drive.frequency_ratio)  # type: ignore[attr-defined]
        return 1.0 / (ratio * unit_of(self.system, "drive.frequency_hz"))

    @cached_property
    def horizon(self) -> float:
        """Up to when it counts, s.  Refused (InputError) if that is before its second sample."""
        cycles = int(np.ceil(np.asarray(self.time)[-1] / self.period - 1e-9)) or 1
        with _untold():
            change = perturbation_growth(self.system, Integration(cycles=cycles))
        moved = change["separation"].values * self.system.scale.length * (self.drive_error / _TINY)
        late = np.flatnonzero(moved > self.standard_error)
        until = float(change["time"][late[0] - 1]) if late.size and late[0] else float(change["time"][-1])
        if (late.size and late[0] == 0) or until < np.asarray(self.time)[1]:
            raise InputError(
                f"standard_error = {self.standard_error:g} m: with drive_error = {self.drive_error:g} nothing of the "
                "waveform can be known so well"
            )
        return until

    @cached_property
    def used(self) -> NDArray[np.bool_]:
        """Samples that count."""
        return np.isfinite(np.asarray(self.displacement)) & (np.asarray(self.time) <= self.horizon)

    def misfit(self, values: Mapping[str, Any]) -> _Array:
        """(model - measured)/standard error of every sample that counts, of the system with other parameters.

        *values* are by dotted name; the drive keeps its Hz and m/s.
        """
        times = np.asarray(self.time)[self.used]
        seen = np.asarray(self.displacement)[self.used]
        with _untold():
            system = self.system.replace(**values)
            drive = {}
            for ratio, unit in (("frequency_ratio", "frequency_hz"), ("velocity_amplitude", "velocity_m_s")):
                own = getattr(self.system.striker.drive, ratio)  # type: ignore[union-attr]
                there = unit_of(self.system, f"drive.{unit}") / unit_of(system, f"drive.{unit}")
                drive[f"drive.{ratio}"] = own * there
            system = system.replace(**drive)
            cycles = int(np.ceil(times[-1] / self.period - 1e-9)) or 1
            last = cycles * self.period * (1.0 - 1e-9)
            run = simulate(system, Integration(cycles=cycles), sample_times=np.minimum(times, last))
        found = run.dataset[_SEEN[self.at]].values * system.scale.length
        off = (found - seen) / self.standard_error
        return np.where(np.isfinite(off), off, _LOST)


@contextmanager
def _untold() -> Iterator[None]:
    """What is doubtful of a system was said when it was made; not of each of its neighbours."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DiagnosticWarning)
        yield
