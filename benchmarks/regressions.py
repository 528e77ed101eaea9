"""Times to keep an eye on; pytest-benchmark saves them and compares with the last ones.

``python -m benchmarks regressions`` fails if a fastest time grew by more than a quarter since the last save.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from benchmarks.cases import Case
from benchmarks.ensemble import ensemble_of, sample
from snapbeam.model.early_termination import decidable_energy
from snapbeam.solver.cpu import driver as cpu_engine


@pytest.mark.parametrize("modes", [1, 8, 32, 128])
def test_single_run(benchmark: Any, modes: int) -> None:
    """50 cycles at (1.21, 0.18), statistics only."""
    case = Case(modes, 1.21, 0.18)
    ensemble = case.ensemble(case.default_plan(), 50)
    accumulators_of_runs = benchmark(cpu_engine.run_ensemble, ensemble, 1)
    assert accumulators_of_runs["steps"][0] > 0


def test_recorded_run(benchmark: Any) -> None:
    """20 cycles with 200 samples each and the energy balance."""
    case = Case(32, 1.21, 0.18)
    ensemble = case.ensemble(case.default_plan(), 20)
    times = np.linspace(0.0, float(ensemble.runs["tick"][0] * ensemble.runs["end"][0]), 4001)
    benchmark(lambda: list(cpu_engine.record(ensemble, times, False)))


@pytest.mark.parametrize("early", [False, True])
def test_ensemble(benchmark: Any, early: bool) -> None:
    """16 random points of the plane of Fig. 6, 50 cycles, one thread."""
    ensemble = ensemble_of(32, sample(16), early, 50)
    benchmark.pedantic(cpu_engine.run_ensemble, (ensemble, 1), rounds=5, warmup_rounds=1)


def test_decision_bound(benchmark: Any) -> None:
    """The bound of the early decision for 1000 runs at one place."""
    case = Case(32, 1.0, 0.3)
    highest = np.linspace(-1.0, 0.9, 1000) * float(case.model.length_scale or 1.0)
    benchmark(decidable_energy, case.model, np.full(1000, case.location), highest)
