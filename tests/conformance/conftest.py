"""One contract for every engine: the questions below are asked of each through the door that maps use."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray
from snapbeam.runs.response import statistics_of

from snapbeam import paper
from snapbeam.core.validate import InputError
from snapbeam.engines.ensemble import Ensemble, Start, make_ensemble
from snapbeam.engines.plan import plan_steps
from snapbeam.engines.registry import ENGINES, resolve
from snapbeam.model.contact import HertzContact
from snapbeam.model.reduction import ReducedModel


@dataclass(frozen=True)
class Marched:
    """What an engine answered."""

    ensemble: Ensemble
    counts: NDArray[np.int64]
    numbers: NDArray[np.float64]
    cycles: int

    @property
    def statistics(self) -> dict[str, NDArray[Any]]:
        return statistics_of(self.ensemble, self.counts, self.numbers, self.cycles)


class March:
    """An engine by name, called with the parameters of its runs, which broadcast."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.run = resolve(name)[1]

    def __call__(
        self,
        model: ReducedModel,
        contact: HertzContact | None = paper.CONTACT,
        *,
        frequency_ratio: ArrayLike = 1.0,
        velocity_amplitude: ArrayLike = 0.0,
        location: ArrayLike = paper.LOCATION,
        side: str = "below",
        cycles: int = 1,
        step: float | None = None,
        accuracy: str = "map",
        early_decision: bool = False,
        start: Start | None = None,
        max_steps: int = 10**10,
        threads: int | None = None,
    ) -> Marched:
        columns = np.broadcast_arrays(*map(np.atleast_1d, (frequency_ratio, velocity_amplitude, location)))
        names = ("frequency_ratio", "velocity_amplitude", "location")
        ensemble = make_ensemble(
            model,
            contact,
            plan_steps(model, contact, step=step, accuracy=accuracy),
            **{name: np.array(column, dtype=float) for name, column in zip(names, columns, strict=True)},
            side=side,
            cycles=cycles,
            reference_freq=model.reference_freq,
            early_decision=early_decision,
            start=start,
            max_steps=max_steps,
        )
        return Marched(ensemble, *self.run(ensemble, threads, None), cycles)


@pytest.fixture(scope="session", params=[name for name in ENGINES if name != "auto"])
def march(request: pytest.FixtureRequest) -> March:
    """The engine under test; skipped where the machine lacks what it needs."""
    try:
        return March(request.param)
    except InputError as refusal:
        pytest.skip(str(refusal))


@pytest.fixture(scope="session")
def model_of():
    """The paper's beam on N modes, by N and damping ratio."""
    return cache(lambda modes, damping_ratio=0.005: ReducedModel.from_beam(paper.BEAM, modes, damping_ratio))


@pytest.fixture(scope="session")
def draw():
    """Random excitations: frequency ratio, velocity amplitude and location, by their number and a seed."""

    def columns(count: int, seed: int) -> dict[str, NDArray[np.float64]]:
        rng = np.random.default_rng(seed)
        return {
            "frequency_ratio": rng.uniform(0.3, 4.0, count),
            "velocity_amplitude": rng.uniform(0.01, 0.65, count),
            "location": rng.choice([0.25, 0.35, 0.42, paper.LOCATION, 0.5, 0.6], count),
        }

    return columns
