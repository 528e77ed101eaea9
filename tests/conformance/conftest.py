"""The core, asked through the door that maps use."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray
from start_up import start_up

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.solver import native
from snapbeam.solver.assemble import make_ensemble
from snapbeam.solver.ensemble import Ensemble
from snapbeam.solver.statistics import statistics_of


@dataclass(frozen=True)
class EnsembleResult:
    """What an engine answered."""

    ensemble: Ensemble
    accumulators_of_runs: NDArray[Any]

    @property
    def statistics(self) -> dict[str, NDArray[Any]]:
        return statistics_of(self.ensemble, self.accumulators_of_runs)

    def assert_is(self, other: EnsembleResult, which: Any = slice(None)) -> None:
        """Every column is that of the runs *which* of another ensemble, to the last bit."""
        for name in self.accumulators_of_runs.dtype.names:
            np.testing.assert_array_equal(
                self.accumulators_of_runs[name], other.accumulators_of_runs[name][which], err_msg=name
            )


class EnsembleIntegrator:
    """The core, called with the parameters of its runs, which broadcast.

    Without a law of contact nothing strikes, and there is one run.
    """

    def __call__(
        self,
        model: sb.ReducedModel,
        contact: sb.ContactLaw | None = default_values.CONTACT,
        *,
        frequency_ratio: ArrayLike = 1.0,
        velocity_amplitude: ArrayLike = 0.0,
        location: ArrayLike = default_values.LOCATION,
        side: str = "below",
        drive: sb.Drive | None = None,
        start: sb.State | None = None,
        threads: int | None = None,
        **integration: Any,
    ) -> EnsembleResult:
        # a limit that is reached during the integration; one that is always reached is refused before
        limit = integration.pop("max_steps", None)
        how = sb.Integration(**({"cycles": 1} | integration))
        if contact is None:
            ensemble = make_ensemble(sb.System(model, initial_state=start), how)
            return EnsembleResult(ensemble, native.run_ensemble(ensemble, threads, None))
        own = {"drive.frequency_ratio": frequency_ratio, "drive.velocity_amplitude": velocity_amplitude}
        striker = sb.Striker(
            drive=sb.Sine(frequency_ratio=1.0, velocity_amplitude=0.0) if drive is None else drive, side=side
        )
        given = (own if drive is None else {}) | {"contact.location": location}
        columns = np.broadcast_arrays(*map(np.atleast_1d, given.values()))
        points = {name: np.array(column, dtype=float) for name, column in zip(given, columns, strict=True)}
        system = sb.System(model, contacts=[sb.Contact(contact, striker)], initial_state=start)
        ensemble = make_ensemble(system, how, points)
        if limit is not None:
            ensemble = dataclasses.replace(ensemble, max_steps=limit)
        return EnsembleResult(ensemble, native.run_ensemble(ensemble, threads, None))


@pytest.fixture(scope="session")
def integrate_ensemble() -> EnsembleIntegrator:
    """The engine under test."""
    return EnsembleIntegrator()


@pytest.fixture(scope="session")
def model_of():
    """The paper's beam on N modes, by N and damping ratio."""
    return cache(
        lambda modes, damping_ratio=0.005: sb.ReducedModel.from_beam(default_values.BEAM, modes, damping_ratio)
    )


@dataclass(frozen=True)
class Kind:
    """What may strike, and how: modes, a law of contact, and whether the drive is a record."""

    modes: int
    contact: sb.ContactLaw
    recorded: bool = False

    def given(self, model: sb.ReducedModel, columns: dict[str, Any], cycles: int) -> dict[str, Any]:
        """Arguments of an ensemble: random runs, of a record those of its location."""
        if not self.recorded:
            return {"contact": self.contact, "cycles": cycles} | columns
        own = {"contact": self.contact, "cycles": cycles, "drive": start_up(model, cycles=cycles)}
        return own | {"location": columns["location"]}


KINDS = {
    "hertz": Kind(8, default_values.CONTACT),
    "restitution": Kind(1, sb.Restitution(0.6)),
    "plastic": Kind(1, sb.Restitution(0.0)),
    "hunt-crossley": Kind(8, sb.HuntCrossley.from_restitution(4e8, 0.6, 0.05)),
    "kelvin-voigt": Kind(3, sb.KelvinVoigt(2e6, 20.0)),
    "power": Kind(3, sb.PowerLaw.from_stiffness(4e11, 2.0)),
    "recorded": Kind(4, default_values.CONTACT, recorded=True),
    "recorded restitution": Kind(1, sb.Restitution(0.8), recorded=True),
}
"""Every law of contact and every drive there is: what is asked of one is asked of all."""


@pytest.fixture(scope="session", params=list(KINDS))
def kind(request: pytest.FixtureRequest) -> Kind:
    return KINDS[request.param]


@pytest.fixture(scope="session")
def draw():
    """Random excitations: frequency ratio, velocity amplitude and location, by their number and a seed."""

    def columns(count: int, seed: int) -> dict[str, NDArray[np.float64]]:
        rng = np.random.default_rng(seed)
        return {
            "frequency_ratio": rng.uniform(0.3, 4.0, count),
            "velocity_amplitude": rng.uniform(0.01, 0.65, count),
            "location": rng.choice([0.25, 0.35, 0.42, default_values.LOCATION, 0.5, 0.6], count),
        }

    return columns
