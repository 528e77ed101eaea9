"""Iterations end: at tolerances of 0, 1e-16 and huge ones each is refused, or says when it stopped and why."""

from __future__ import annotations

import numpy as np
import pytest
from small import small_system

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.uncertainty import cost
from snapbeam.uncertainty.measurements import Measurements
from snapbeam.uncertainty.probability import SamplingPlan, _reason, allocate
from snapbeam.uncertainty.quantiles import local_crossing

TOLERANCES = (0.0, 1e-16, 1e300)
SPREAD = sb.uncertainty.ParameterUncertainty(of={"velocity_amplitude": sb.uncertainty.Normal(0.02, relative=True)})
SHORT = sb.Integration(cycles=1, threads=1)


def allocated(half_width: float) -> str:
    """Coins of equal chances at three points."""
    plan = SamplingPlan(half_width=half_width, initial_runs=8, max_runs=200)

    def ask(which, numbers):
        return np.random.default_rng(3).random((4, which.size)) < 0.5, np.zeros(which.size, dtype=bool)

    counts = allocate(ask, 3, plan)
    assert counts.rounds < 30 and (counts.runs <= 200).all()
    return _reason(counts, plan)


def trial(seconds: float) -> str:
    found = sb.uncertainty.estimate_cost(
        sb.uncertainty.probability_map, small_system(), {"frequency_ratio": [1.0, 1.2]}, SPREAD, 8,
        integration=SHORT, trial=seconds,
    )  # fmt: skip
    return f"estimated from {found.trial_runs} runs"


def beam_of(relative: float) -> str:
    beam = default_values.BEAM
    measured = Measurements(straight_frequencies=(100.0,), straight_frequencies_se=(1.0,))
    return sb.uncertainty.estimate_posterior(
        measured, beam, {"thickness": relative}, modes=2, samples=200
    ).termination_reason


def designed(confidence: float) -> str:
    sb.uncertainty.OptimizerSettings(confidence=confidence)
    return "settings"


ITERATIONS = {"probability map": allocated, "trial of a cost": trial, "posterior": beam_of, "design": designed}


@pytest.mark.parametrize(
    "value", [TOLERANCES[0], *(pytest.param(value, marks=pytest.mark.slow) for value in TOLERANCES[1:])]
)
@pytest.mark.parametrize("name", ITERATIONS)
def test_every_iteration_ends_and_says_why(name: str, value: float) -> None:
    try:
        reason = ITERATIONS[name](value)
    except sb.InputError as error:
        reason = str(error)
        assert "must be" in reason or "prior" in reason
    assert reason
    if value == 0.0:
        assert "must be" in reason


def test_reasons_of_a_probability_map() -> None:
    assert "every point is as narrow" in allocated(0.4)
    assert "3 points is wider" in allocated(1e-6) and "max_runs = 200" in allocated(1e-6)


def test_a_trial_stops_at_its_maximum_of_runs(monkeypatch) -> None:
    """Runs that take no time would fill the memory before the seconds are over."""
    monkeypatch.setattr(cost, "_MOST_RUNS", 64)
    assert trial(600.0) in ("estimated from 64 runs", "estimated from 96 runs")


def test_a_curve_that_does_not_converge_gives_no_threshold(monkeypatch) -> None:
    draw = np.random.default_rng(1)
    values = draw.random(200)
    hits = draw.random(200) < 1.0 / (1.0 + np.exp(-20.0 * (values - 0.5)))
    assert local_crossing(values, hits, 0.5, 0.3, 0.7) == pytest.approx(0.5, abs=0.06)
    from snapbeam.uncertainty import quantiles

    monkeypatch.setattr(quantiles, "_STEPS", 1)
    assert np.isnan(local_crossing(values, hits, 0.5, 0.3, 0.7))
