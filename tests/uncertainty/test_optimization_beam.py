"""The optimum on the beam itself: against as many random designs, on fresh draws, and the quasi-static one."""

from __future__ import annotations

import numpy as np
import pytest
from small import small_system

import snapbeam as sb

TOLERANCE = {"velocity_amplitude": sb.uncertainty.Normal(0.02, relative=True)}
BOUNDS = {"location": (0.1, 0.5), "frequency_ratio": (0.5, 2.0), "velocity_amplitude": (0.02, 0.5)}
LIMIT = sb.uncertainty.Constraint(quantity="snap", lower=0.8)
HOW = sb.Integration(cycles=3, threads=1)
DESIGNS = 2000


@pytest.mark.slow
def test_better_than_as_many_random_designs_of_a_beam() -> None:
    """The least speed of the tip that snaps one mode with P of 0.8: 20 of 20 seeds, each limit on fresh draws."""
    wins = kept = 0
    for seed in range(20):
        effort = sb.uncertainty.OptimizerSettings(
            generations=DESIGNS // 40, population=40, samples=8, validation_samples=400, seed=seed
        )
        spread = sb.uncertainty.ParameterUncertainty(of=TOLERANCE, phase=True, seed=seed)
        arguments = (small_system(), BOUNDS, "speed", LIMIT, spread)
        ds = sb.uncertainty.optimize_design(*arguments, effort, integration=HOW)
        assert ds.sizes["tried"] <= DESIGNS  # the search ends where it makes no progress
        problem = sb.uncertainty.design_problem(*arguments, samples=8, integration=HOW)
        low, high = np.array(list(problem.bounds.values())).T
        x = np.random.default_rng(1000 + seed).uniform(low, high, (DESIGNS, 3))
        goals, violation, _ = problem.evaluate(x)
        best = float(goals[violation == 0.0, 0].min())
        found = float(ds["objective_speed"][0])
        wins += found < best
        kept += int(ds["constraints_satisfied"][0]) > 0 and float(ds["satisfied_snap"][0]) >= 0.8
        print(seed, f"found {found:.5f} random {best:.5f} kept {float(ds['satisfied_snap'][0]):.3f}", flush=True)
    assert wins == 20 and kept == 20


@pytest.mark.parametrize("place", [0.25, 0.4])
def test_the_quasi_static_threshold_is_the_optimum(place: float) -> None:
    """One mode at Omega = 0.02: the least V that snaps nearly always is V_QS1(x_s), at more places than one."""
    spread = sb.uncertainty.ParameterUncertainty(of={"velocity_amplitude": sb.uncertainty.Normal(0.001, relative=True)})
    effort = sb.uncertainty.OptimizerSettings(
        generations=10, population=6, samples=8, validation_samples=40, candidates=3
    )
    ds = sb.uncertainty.optimize_design(
        small_system(frequency_ratio=0.02, location=place), {"velocity_amplitude": (0.005, 0.03)},
        "velocity_amplitude", sb.uncertainty.Constraint(quantity="snap", lower=0.8), spread, effort,
        integration=sb.Integration(cycles=1, threads=1),
    )  # fmt: skip
    expected = float(sb.model.quasi_static_threshold(place, 0.02))
    assert float(ds["velocity_amplitude"][0]) == pytest.approx(expected, rel=0.04)
