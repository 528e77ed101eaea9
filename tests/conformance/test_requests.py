"""Tolerances asked at random are kept: against runs of far finer steps, and against bouncing.py for Newton's law.

``pytest tests/conformance/test_requests.py -m slow -s --seed 7 --draws 500`` draws others and prints what the
documentation says of them.
"""

from __future__ import annotations

import warnings
from typing import NamedTuple

import numpy as np
import pytest
from bouncing import Bouncer

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.solver.step_size import choose_base_step

FINER = 16.0
"""Steps of level "reference" over those of the run that is taken for the truth."""


class KernelOutput(NamedTuple):
    """What came of one request."""

    tolerance: float
    estimate: float
    error: float
    """True error up to the horizon that the run promises."""
    reached: bool
    words: str


def request_of(rng: np.random.Generator) -> KernelOutput:
    """One request, kept or not."""
    tolerance = float(10.0 ** rng.uniform(-9.0, -2.0))
    ratio, velocity = float(rng.uniform(0.1, 4.0)), float(rng.uniform(0.02, 0.65))
    location, cycles = float(rng.uniform(0.15, 0.5)), int(rng.integers(1, 5))
    newton = bool(rng.uniform() < 0.3)
    modes = 1 if newton else int(rng.choice([1, 2, 3, 5, 8]))
    coefficient = float(rng.choice([0.0, 0.3, 0.7, 1.0, rng.uniform()]))
    contact = sb.Restitution(coefficient) if newton else default_values.CONTACT
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes, damping_ratio=0.005)
    shaker = sb.Shaker(frequency_ratio=ratio, velocity_amplitude=velocity, location=location)
    system = sb.System(model, contacts=[sb.Contact(contact, shaker)])
    end = cycles / (ratio * model.reference_frequency)
    times = np.linspace(0.0, end, 200 * cycles + 1)[1:] * (1.0 - 1e-12)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # not reached: the accuracy says so, and up to where
        run = sb.simulate(system, sb.Integration(cycles=cycles, tolerance=tolerance), sample_times=times)
    found = np.stack((run.dataset.displacement_at_striker.values, run.dataset.midspan_displacement.values), axis=1)
    if newton:
        truth = Bouncer(ratio, velocity, coefficient, location).run(times).displacement[:, None]
        found = found[:, :1]
    else:
        whole = sb.Integration(cycles=cycles, accuracy="reference")
        step = choose_base_step(model, contact, accuracy="reference").step / FINER
        finest = sb.simulate(system, whole.replace(step=step), sample_times=times).dataset
        truth = np.stack((finest.displacement_at_striker.values, finest.midspan_displacement.values), axis=1)
    assert run.accuracy is not None
    promised = times <= run.accuracy.predictability_horizon
    error = float(np.abs(found - truth)[promised].max()) if promised.any() else 0.0
    law = f"e {coefficient:.2f}" if newton else f"{modes} modes"
    words = f"{law}, Omega {ratio:.3f}, V {velocity:.3f}, x {location:.3f}, {cycles} cycles"
    return KernelOutput(tolerance, run.accuracy.estimated_error, error, run.accuracy.reached, words)


def judge(results: list[KernelOutput]) -> None:
    """No request broken, and the estimate a bound; the figures are printed."""
    broken = [each for each in results if each.error > each.tolerance]
    below = [each for each in results if each.error > each.estimate + 1e-13]
    print(f"{len(broken)} of {len(results)} broken: {broken}")
    print(f"{len(below)} estimates below the error: {below}")
    print(f"not reached: {sum(not each.reached for each in results)}")
    assert not broken
    assert len(below) <= 0.05 * len(results)


@pytest.mark.slow
def test_many_requests(request: pytest.FixtureRequest) -> None:
    rng = np.random.default_rng(int(request.config.getoption("--seed")))
    judge([request_of(rng) for _ in range(int(request.config.getoption("--draws")))])
