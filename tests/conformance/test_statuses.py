"""Runs that fail: a status that says why, no class, no numbers that look like results."""

from __future__ import annotations

import numpy as np
import pytest

from snapbeam.model.state import State
from snapbeam.util.status_codes import ResponseClass, RunStatus
from snapbeam.util.validation import InputError

NOT_GIVEN = (
    "min_displacement",
    "max_displacement",
    "min_midspan_displacement",
    "max_midspan_displacement",
    "peak_force",
    "contact_time_fraction",
    "early_stop_time",
)


def assert_unknown(statistics, at: int, status: RunStatus) -> None:
    assert statistics["status"][at] == status
    assert statistics["response_class"][at] == ResponseClass.UNKNOWN
    assert not statistics["final_well_proven"][at]
    for name in NOT_GIVEN:
        assert np.isnan(statistics[name][at]), name
    assert len(RunStatus(status).advice) > 20


def test_step_limit(integrate_ensemble, model_of) -> None:
    """A run that needs more steps than allowed is unknown; its neighbours are what they would be alone."""
    model, slow_and_fast = model_of(1), [0.05, 3.0]
    free = integrate_ensemble(model, frequency_ratio=slow_and_fast, velocity_amplitude=0.1, cycles=4)
    bound = integrate_ensemble(model, frequency_ratio=slow_and_fast, velocity_amplitude=0.1, cycles=4, max_steps=1500)
    assert_unknown(bound.statistics, 0, RunStatus.STEP_LIMIT)
    for name in free.accumulators_of_runs.dtype.names:
        np.testing.assert_array_equal(
            bound.accumulators_of_runs[name][1], free.accumulators_of_runs[name][1], err_msg=name
        )
    assert (free.statistics["status"] == RunStatus.OK).all()


@pytest.mark.parametrize("modes", [1, 8])
def test_not_finite(integrate_ensemble, model_of, modes) -> None:
    """A start beyond all numbers overflows, and is said to."""
    model = model_of(modes)
    start = State(amplitude=np.full(modes, 1e200), velocity=np.zeros(modes))
    lost = integrate_ensemble(model, None, cycles=2, start=start)
    assert_unknown(lost.statistics, 0, RunStatus.DIVERGED)
    again = integrate_ensemble(model, frequency_ratio=1.21, velocity_amplitude=[0.1, 0.2], cycles=2, start=start)
    assert_unknown(again.statistics, 1, RunStatus.DIVERGED)


def test_a_run_too_long_for_its_ticks_is_not_called_finished(integrate_ensemble, model_of) -> None:
    """10^7 cycles at Omega = 1e-5 in steps of 1e-5 s are more ticks than an integer holds."""
    given = {"frequency_ratio": 1e-5, "velocity_amplitude": 0.1, "cycles": 10**7, "step": 1e-5, "max_steps": 1000}
    try:
        status = integrate_ensemble(model_of(1), **given).statistics["status"][0]
    except InputError:
        return
    assert status != RunStatus.OK
