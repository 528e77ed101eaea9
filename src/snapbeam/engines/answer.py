"""What engines answer: the books of many runs, read as statistics in the units and signs of a map."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.codes import RunStatus
from snapbeam.engines.each import rows_for
from snapbeam.engines.ensemble import Ensemble
from snapbeam.engines.outcomes import (
    OTHER_IMPACTS,
    OTHER_IMPULSE,
    OTHER_PEAK,
    OTHER_WORK,
)
from snapbeam.model.decision import crossing_energy, decidable_energy, passed_heights

__all__ = ["Reading", "statistics_of"]

_MADE = 0.01
"""Of the gross work: energy out of nothing from which a run is not believed."""
_ROUNDED = 1e-6
"""Of the energies themselves, the same."""


@dataclass(frozen=True)
class Reading:
    """The books of an ensemble, and what it takes to read them."""

    ensemble: Ensemble
    accumulators: NDArray[Any]
    cycles: float

    @property
    def sign(self) -> float:
        """+1 for a striker below, -1 for one above."""
        return self.ensemble.structure.sign

    @property
    def length(self) -> float:
        """What displacements are normalised by, m."""
        return self.ensemble.scale.length

    @property
    def speed(self) -> float:
        """What velocities are normalised by, m/s."""
        return self.ensemble.scale.length * self.ensemble.scale.omega

    @property
    def first_side(self) -> NDArray[np.int64]:
        """Side of the centre that each run begins on."""
        return self.ensemble.first_side

    @cached_property
    def status(self) -> NDArray[np.int64]:
        """How each run ended; what ended with more energy than it was given is unbalanced.

        Damping, and a contact with losses, only take energy.
        """
        accumulators, status = self.accumulators, self.accumulators["status"]
        done = (status == RunStatus.OK) | (status == RunStatus.EARLY_STOP)
        with np.errstate(invalid="ignore"):  # runs that failed have no numbers
            given = accumulators["work"] + accumulators["base_work"] + accumulators["load_work"]
            made = accumulators["energy"] - accumulators["first_energy"] - given
        allowed = _MADE * accumulators["gross_work"]
        allowed = allowed + _ROUNDED * (np.abs(accumulators["energy"]) + np.abs(accumulators["first_energy"]))
        return np.where(done & (made > allowed), RunStatus.ENERGY_ERROR, status)

    @cached_property
    def good(self) -> NDArray[np.bool_]:
        """Runs whose class is known."""
        status = self.status
        return np.asarray((status == RunStatus.OK) | (status == RunStatus.EARLY_STOP))

    @cached_property
    def duration(self) -> NDArray[np.float64]:
        """Time marched, s."""
        return np.asarray(self.accumulators["time"] * self.ensemble.runs["tick"])

    def seen(self, column: str) -> NDArray[np.float64]:
        """A column, NaN where the run failed."""
        return np.where(self.good, self.accumulators[column], np.nan)

    @property
    def others(self) -> NDArray[np.float64]:
        """What is kept of each striker beside the first, shape (runs, strikers, kinds)."""
        if self.ensemble.others is None:
            return np.zeros((self.accumulators.size, 0, 4))
        return np.asarray(self.accumulators["others"])

    def one(self, column: int, number: int) -> NDArray[np.float64]:
        """A column of one of several strikers, the first being 1: its own is what the others leave of the whole."""
        others = self.others[:, :, column]
        if number > 1:
            found = others[:, number - 2]
        elif column == OTHER_PEAK:
            found = self.accumulators["peak_force"]
        else:
            whole = {OTHER_IMPACTS: "impacts", OTHER_IMPULSE: "total_impulse", OTHER_WORK: "work"}[column]
            found = self.accumulators[whole] - others.sum(axis=1)
        return np.asarray(found if column == OTHER_IMPACTS else np.where(self.good, found, np.nan))

    @property
    def peak_force(self) -> NDArray[np.float64]:
        """Of the law's force, the greatest of any striker; NaN where an impact lasts no time."""
        force = self.seen("peak_force")
        if self.ensemble.others is not None:
            return np.maximum(force, self.others[:, :, OTHER_PEAK].max(axis=1))
        if self.ensemble.law.impulsive:
            return np.where((force == 0.0) & (self.accumulators["impacts"] > 0), np.nan, force)
        return force

    @cached_property
    def final(self) -> NDArray[np.bool_]:
        """Runs that will provably stay in the well they ended in.

        Untouched, the beam only loses energy: with less than it takes to come back to the highest position the tip
        will ever have, or to pass the saddle, it never does.  Nothing is said of a well that the tip is in.
        """
        accumulators, ensemble = self.accumulators, self.ensemble
        model = ensemble.structure.model
        found = np.zeros(accumulators.size, dtype=bool)
        if not model.is_bistable:
            return found
        settled = self.good & (accumulators["energy"] < crossing_energy(model) - model.well_energy)
        if not (ensemble.highest > -np.inf).any():
            return np.asarray(settled)
        reach, level = np.maximum(ensemble.highest, 0.0), 0.0
        if ensemble.structure.uneven is not None:
            level = ensemble.structure.uneven.level
            reach = passed_heights(model, ensemble.location, ensemble.highest)
        away = settled & (accumulators["side"] > 0) & (accumulators["displacement"] > reach)
        away &= accumulators["center"] > level
        which = np.flatnonzero(away)
        if which.size:
            bound = decidable_energy(model, ensemble.location[which], ensemble.highest[which])
            found[which] = accumulators["energy"][which] < bound
        return found


def statistics_of(
    ensemble: Ensemble, accumulators_of_runs: NDArray[Any], cycles: float | None = None
) -> dict[str, NDArray[Any]]:
    """What an engine found, in the units and signs of a map; arrays of shape (runs,) by name.

    *cycles* is how long the runs lasted, if not as the ensemble says.
    """
    reading = Reading(ensemble, accumulators_of_runs, ensemble.cycles if cycles is None else cycles)
    found = {}
    strikers = 1 if ensemble.others is None else 1 + len(ensemble.others.laws)
    for name, row in rows_for(strikers).items():
        values = (
            row.value(reading)
            if row.update is None
            else row.value(reading, accumulators_of_runs[f"own_{name}"])
        )
        found[name] = np.asarray(values).astype(row.dtype)
    return found
