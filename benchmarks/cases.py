"""What is integrated: the paper's beam, a few points of its plane, and the error measure e5."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
from numpy.typing import NDArray

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.simulation.dataset import joined
from snapbeam.solver import native
from snapbeam.solver.assemble import make_ensemble
from snapbeam.solver.ensemble import Ensemble
from snapbeam.solver.step_size import Plan, choose_base_step

__all__ = ["CONTACT", "ERROR_CYCLES", "POINTS", "REQUEST_POINTS", "Case", "model_of", "reference_plan"]

_Array = NDArray[np.float64]

CONTACT = sb.HertzContact(stiffness=4e8)
POINTS = ((1.21, 0.05), (1.21, 0.18), (1.625, 0.3))
"""(Omega, V) of the single runs: taps that stay in the well, a snap-through, and another well above it."""
REQUEST_POINTS = (*POINTS, (0.3, 0.2), (0.7, 0.4), (3.0, 0.5))
"""Where the error is measured against the request; (0.3, 0.2) is badly conditioned."""
ERROR_CYCLES = 5
_SAMPLES_PER_CYCLE = 20


@cache
def model_of(modes: int) -> sb.ReducedModel:
    """The paper's beam, reduced."""
    return sb.ReducedModel.from_beam(default_values.BEAM, modes=modes, damping_ratio=default_values.DAMPING_RATIO)


@dataclass(frozen=True)
class Case:
    """One run of the paper's beam."""

    modes: int
    frequency_ratio: float
    velocity_amplitude: float
    location: float = default_values.LOCATION

    @property
    def label(self) -> str:
        """As tables print it."""
        return f"({self.frequency_ratio:g}, {self.velocity_amplitude:g})"

    @property
    def model(self) -> sb.ReducedModel:
        """The reduced model."""
        return model_of(self.modes)

    @property
    def shaker(self) -> sb.Shaker:
        """The drive."""
        return sb.Shaker(
            frequency_ratio=self.frequency_ratio, velocity_amplitude=self.velocity_amplitude, location=self.location
        )

    @property
    def period(self) -> float:
        """Of the excitation, s."""
        return 1.0 / (self.frequency_ratio * self.model.reference_frequency)

    @cached_property
    def times(self) -> _Array:
        """Where e5 looks: 20 instants per cycle over the first five cycles, s."""
        return np.linspace(0.0, ERROR_CYCLES * self.period, ERROR_CYCLES * _SAMPLES_PER_CYCLE + 1)

    @cached_property
    def at_contact(self) -> _Array:
        """Row that takes modal coordinates q to the displacement of the contact point from rest, in b."""
        model = self.model
        shape: _Array = model.linear_modes.T @ model.shape_at(self.location) / model.length_scale
        return shape

    @property
    def at_rest(self) -> float:
        """Displacement of the contact point in the well that the run begins in, b."""
        model = self.model
        return float(model.well_amplitude @ model.shape_at(self.location) / model.length_scale)

    def system(self, factor: float = 1.0) -> sb.System:
        """What is run; the drive is multiplied by *factor*."""
        shaker = sb.Shaker(
            frequency_ratio=self.frequency_ratio,
            velocity_amplitude=self.velocity_amplitude * factor,
            location=self.location,
        )
        return sb.System(self.model, contacts=[sb.Contact(CONTACT, shaker)])

    def ensemble(self, plan: Plan, cycles: int, *, factor: float = 1.0, early_termination: bool = False) -> Ensemble:
        """This run, for an engine."""
        integration = sb.Integration(cycles=cycles, early_termination=early_termination)
        return make_ensemble(self.system(factor), integration, plan=plan)

    def displacement(self, plan: Plan, factor: float = 1.0) -> _Array:
        """Displacement of the contact point from rest, in b, at :attr:`times`, by snapbeam."""
        ensemble = self.ensemble(plan, ERROR_CYCLES, factor=factor)
        end = float(ensemble.runs["tick"][0] * ensemble.runs["end"][0])
        recorded = joined(list(native.record(ensemble, np.minimum(self.times, end), False)))
        alpha = ensemble.structure.amplitudes(recorded.q)
        shape = self.model.shape_at(self.location)
        return np.asarray(alpha @ shape / self.model.length_scale) - self.at_rest

    def default_plan(self, accuracy: str = "standard") -> Plan:
        """snapbeam's own choice of steps."""
        return choose_base_step(self.model, CONTACT, accuracy=accuracy)

    @cached_property
    def reference(self) -> _Array:
        """The converged solution that errors are measured against."""
        return self.displacement(reference_plan(self))

    @cached_property
    def conditioning(self) -> float:
        """Greatest change of w at the contact within five cycles by a relative change of V by 1e-13."""
        return float(np.abs(self.displacement(reference_plan(self), 1.0 + 1e-13) - self.reference).max())

    def error(self, displacement: _Array) -> float:
        """e5: greatest error of w at the contact over the first five cycles, in b."""
        difference = np.abs(displacement - self.reference)
        return float(difference.max()) if np.isfinite(difference).all() else math.inf


def reference_plan(case: Case) -> Plan:
    """Half the steps of the level "reference"."""
    return case.default_plan("reference").scaled(0.5)
