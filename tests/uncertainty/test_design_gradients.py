"""Gradients of a search for designs: against differences of runs, in the search, and where there are none."""

from __future__ import annotations

import numpy as np
import pytest
from small import small_system

import snapbeam as sb

U = sb.uncertainty
SPREAD = U.ParameterUncertainty(
    of={
        "velocity_amplitude": U.Normal(0.02, relative=True),
        "contact.stiffness": U.LogNormal(0.1),
        "location": U.Normal(0.003),
    }
)
VARIABLES = {"velocity_amplitude": (0.005, 0.06), "frequency_ratio": (0.6, 1.6), "location": (0.2, 0.5)}
SIX = ((1, 0.75), (2, -0.15), (3, 1.0 / 60.0))
"""Weights of central differences of order six."""


def problem(objective, *constraints, accuracy: str = "standard", samples: int = 8):
    how = sb.Integration(cycles=2, threads=1, accuracy=accuracy)
    return U.design_problem(
        small_system(2), VARIABLES, objective, list(constraints), SPREAD, samples=samples, integration=how
    )


@pytest.mark.parametrize("quantile", [None, 0.7])
def test_against_differences_of_runs(quantile: float | None) -> None:
    """Runs of the search itself at level "reference", by differences of order six: 1e-6."""
    goal = U.Objective(quantity="striker_work", quantile=quantile, maximize=True)
    force = U.Constraint(quantity="peak_force", upper=0.7, probability=0.2)
    speed = U.Constraint(quantity="rms_velocity", lower="1 mm/s", probability=0.2)
    stroke = U.Constraint(quantity="stroke", upper="0.2 mm")
    made = problem(goal, force, speed, stroke, accuracy="reference")
    design = np.array([0.031, 1.07, 0.41])
    values, slopes = made.slopes(design)
    # the run that is followed stays the same nearby
    one = int(np.argsort(made.runs_of(design[None], np.arange(8))[0]["striker_work"])[5])

    def exact(x: np.ndarray) -> np.ndarray:
        found = made.runs_of(x[None], np.arange(8))[0]
        work = found["striker_work"]
        speed_of_tip = x[0] * made.trials.system.scale.length
        return np.array([-(work.mean() if quantile is None else work[one]), 0.2e-3 - speed_of_tip / x[1]])

    found = np.empty((2, 3))
    for j, step in enumerate(1e-4 * design):
        move = step * np.eye(3)[j]
        found[:, j] = sum(w * (exact(design + k * move) - exact(design - k * move)) for k, w in SIX) / step
    assert values[0] == pytest.approx(exact(design)[0], rel=1e-6)
    np.testing.assert_allclose(slopes[0], found[0], rtol=1e-6, atol=1e-6 * abs(values[0]))
    np.testing.assert_allclose(0.2e-3 * slopes[3], found[1], rtol=1e-6, atol=1e-15)
    assert values.shape == (4,) and slopes.shape == (4, 3)


def test_the_slack_is_that_of_the_run_that_is_needed_last() -> None:
    """It is positive where the search counts the constraint as satisfied, and its change is that of this slack."""
    limit = U.Constraint(quantity="peak_force", upper=0.5, probability=0.5)
    made = problem("striker_work", limit, samples=24)
    for v in np.linspace(0.01, 0.05, 9):
        design = np.array([v, 1.07, 0.41])
        slack, slopes = (each[1] for each in made.slopes(design))
        assert (slack >= 0.0) == (made.judge(design[None])[0].violation[0] == 0.0)
    ends = [made.slopes(design + side * 1e-5 * np.eye(3)[0])[0][1] for side in (1.0, -1.0)]
    assert slopes[0] == pytest.approx((ends[0] - ends[1]) / 2e-5, rel=1e-3)


def test_the_search_ends_with_gradients() -> None:
    """From the same generations the design is better, and satisfies its constraint on the same samples."""
    goal = U.Objective(quantity="rms_velocity", maximize=True)
    limit = U.Constraint(quantity="peak_force", upper=0.5, probability=0.5)
    effort = U.OptimizerSettings(
        generations=3, population=8, samples=12, validation_samples=40, candidates=1, refinements=0
    )
    ds = U.optimize_design(
        small_system(2), VARIABLES, goal, limit, SPREAD, effort, integration=sb.Integration(cycles=3, threads=1)
    )
    tried = np.where(ds["violation"].values == 0.0, ds["tried_objective_rms_velocity"].values, -np.inf)
    assert ds.sizes["tried"] == 3 * 8 + 1 and tried[-1] > 1.05 * tried[:-1].max()
    assert "gradients of" in ds.attrs["termination_reason"]


@pytest.mark.parametrize(
    ("objective", "words"),
    [("snap", "snap changes by jumps"), ("impacts", "impacts is a class or a count"), ("cycles_to_settle", "by jumps")],
)
def test_why_there_are_none(objective: str, words: str) -> None:
    assert words in problem(objective).not_smooth
    assert words in problem("striker_work", U.Constraint(quantity=objective, lower=0.5)).not_smooth
    assert not problem("striker_work", U.Constraint(quantity="stroke", upper=1.0)).not_smooth


@pytest.mark.sampled(3)
@pytest.mark.parametrize("name", ["beam.thickness", "beam.buckling_level", "model.damping_ratio"])
def test_a_variable_of_the_structure(name: str) -> None:
    """It changes the modes and the scales by which constraints are measured: differences of order six of the runs."""
    system = small_system(2)
    value = float(system.get(name))
    speed = U.Constraint(quantity="rms_velocity", lower="1 mm/s", probability=0.2)
    made = U.design_problem(
        system, {name: (0.8 * value, 1.2 * value)}, "striker_work", [speed], SPREAD, samples=8,
        integration=sb.Integration(cycles=2, threads=1, accuracy="reference"),
    )  # fmt: skip
    design = np.array([value])
    values, slopes = made.slopes(design)
    needed = values[1]
    found = made.runs_of(design[None], np.arange(8))[0]
    speeds = found["rms_velocity"] * found["velocity_scale"]
    one = int(np.abs((speeds - 1e-3) / 1e-3 - needed).argmin())

    def exact(x: float) -> np.ndarray:
        of_runs = made.runs_of(np.array([[x]]), np.arange(8))[0]
        speed_of_run = (of_runs["rms_velocity"] * of_runs["velocity_scale"])[one]
        return np.array([of_runs["striker_work"].mean(), (speed_of_run - 1e-3) / 1e-3])

    step = 1e-4 * value
    by_runs = sum(w * (exact(value + k * step) - exact(value - k * step)) for k, w in SIX) / step
    assert values == pytest.approx(exact(value), rel=1e-5)
    np.testing.assert_allclose(slopes[:, 0], by_runs, rtol=2e-5, atol=2e-5 * np.abs(values).max() / value)


def test_what_the_core_cannot_differentiate() -> None:
    made = U.design_problem(
        small_system(1), {"drive.velocity_amplitude": (0.02, 0.04)}, "striker_work", [], SPREAD, samples=8,
        integration=sb.Integration(cycles=1, threads=1, engine="python"),
    )  # fmt: skip
    assert not made.not_smooth and made.slopes(np.array([0.03])) is None
