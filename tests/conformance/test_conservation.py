"""What damping and the shaker do not take or give, stays."""

from __future__ import annotations

import math

import numpy as np
import pytest

from snapbeam.model.early_termination import RESERVE
from snapbeam.model.state import State
from snapbeam.util.status_codes import RunStatus

REGULAR = [(1.4, 0.02), (0.1, 0.05)]
ELSEWHERE = [(1.21, 0.18), (1.625, 0.3), (3.0, 0.5), (0.5, 0.4)]


def energy_errors(integrate_ensemble, model, share: float, cycles: list[int]) -> tuple[list[float], list[int]]:
    """Relative error of an energy, at first a *share* of the barrier, after so many cycles; and crossings."""
    energy = share * (model.saddle_energy - model.well_energy)
    velocity = model.linear_modes[:, 0] * math.sqrt(2.0 * energy)
    if model.modes > 3:
        velocity = velocity + model.linear_modes[:, 3] * math.sqrt(0.02 * energy)
    start = State(amplitude=model.well_amplitude, velocity=velocity)
    first = float(model.kinetic_energy(velocity))
    ends = [integrate_ensemble(model, None, cycles=count, start=start) for count in cycles]
    assert all(end.accumulators_of_runs["status"][0] == RunStatus.OK for end in ends)
    errors = [abs(float(end.accumulators_of_runs["energy"][0]) / first - 1.0) for end in ends]
    return errors, [int(end.accumulators_of_runs["zero_crossings"][0]) for end in ends]


@pytest.mark.parametrize(
    ("modes", "cycles", "share", "bound"),
    [
        (1, 100_000, 0.5, 3e-7),
        pytest.param(32, 10_000, 0.5, 3e-7, marks=pytest.mark.slow),
        pytest.param(1, 100_000, 0.1, 3e-7, marks=pytest.mark.slow),
        pytest.param(32, 10_000, 0.1, 3e-7, marks=pytest.mark.slow),
    ],
)
def test_no_drift_within_a_well(integrate_ensemble, model_of, modes, cycles, share, bound) -> None:
    """Measured: at most 7e-8 from the first hundred cycles to the last, without a trend."""
    errors, crossings = energy_errors(integrate_ensemble, model_of(modes, 0.0), share, [100, cycles // 10, cycles])
    assert crossings == [0, 0, 0]
    assert max(errors) < bound


@pytest.mark.parametrize("modes", [1, 8, 32])
def test_energy_of_a_random_motion_stays_within_the_reserve_of_decisions(integrate_ensemble, model_of, modes) -> None:
    """Motion in every mode up to the fastest, far more than an impact gives them: measured, 5e-4 of the barrier."""
    model = model_of(modes, 0.0)
    barrier = model.saddle_energy - model.well_energy
    velocity = model.linear_modes @ np.random.default_rng(0).standard_normal(modes)
    velocity *= math.sqrt(barrier / float(model.kinetic_energy(velocity)))
    for share in (0.1, 0.9):
        start = State(amplitude=model.well_amplitude, velocity=math.sqrt(share) * velocity)
        for cycles in (3, 30, 100):
            end = integrate_ensemble(model, None, cycles=cycles, start=start)
            assert abs(float(end.accumulators_of_runs["energy"][0]) / barrier - share) < 0.5 * RESERVE


@pytest.mark.parametrize(("modes", "cycles", "measured"), [(1, 1000, 1.4e-4), (32, 300, 5e-4)])
def test_drift_between_the_wells(integrate_ensemble, model_of, modes, cycles, measured) -> None:
    """A passage over the barrier, where the linear flow changes wells, costs a few parts in 10^7 (N = 1) or
    10^6 (N = 32) of the energy; far less than damping takes in a cycle, 6e-2.
    """
    (error,), (crossings,) = energy_errors(integrate_ensemble, model_of(modes, 0.0), 1.5, [cycles])
    assert crossings > 0.9 * cycles
    assert error < 4.0 * measured


@pytest.mark.parametrize("modes", [1, 8, 32])
def test_undamped_beam_gains_the_work_of_the_shaker(integrate_ensemble, model_of, modes) -> None:
    """Measured, of the gross work: 1e-5 on regular runs, 1.5e-4 for N = 32, whose highest modes keep every
    error when nothing damps them; elsewhere at most 7e-4.
    """
    ratio, velocity = np.array(REGULAR + ELSEWHERE).T
    end = integrate_ensemble(model_of(modes, 0.0), frequency_ratio=ratio, velocity_amplitude=velocity, cycles=8)
    missing = end.accumulators_of_runs["energy"] - end.accumulators_of_runs["work"]
    share = np.abs(missing) / end.accumulators_of_runs["gross_work"]
    assert (end.accumulators_of_runs["impacts"] > 3).all()
    assert (share[: len(REGULAR)] < (5e-4 if modes == 32 else 1e-4)).all(), share
    assert (share < 1.5e-3).all(), share
