"""Classes: parity of the crossings, and runs that end early because theirs is certain."""

from __future__ import annotations

import numpy as np
import pytest

from snapbeam.util.status_codes import ResponseClass, RunStatus


def compare(integrate_ensemble, model, given, cycles: int) -> tuple[int, set[int]]:
    """Check runs with and without early decisions; returns how many were decided, and the classes."""
    full = integrate_ensemble(model, **given, cycles=cycles).statistics
    early = integrate_ensemble(model, **given, cycles=cycles, early_termination=True).statistics
    assert (full["status"] == RunStatus.OK).all()
    np.testing.assert_array_equal(early["response_class"], full["response_class"])

    odd = full["zero_crossings"] % 2 == 1
    continuous = full["response_class"] == ResponseClass.CONTINUOUS
    np.testing.assert_array_equal(full["final_well"] == 1, odd)
    np.testing.assert_array_equal(
        (full["response_class"] == ResponseClass.TRANSIENT_2) & ~continuous, odd & ~continuous
    )
    np.testing.assert_array_equal(full["response_class"] == ResponseClass.INTRAWELL, full["zero_crossings"] == 0)
    np.testing.assert_array_equal(continuous, full["zero_crossings_last_quarter"] * 20 > cycles)

    decided = early["status"] == RunStatus.EARLY_STOP
    np.testing.assert_array_equal(np.isfinite(early["early_stop_time"]), decided)
    for name in full:
        np.testing.assert_array_equal(early[name][~decided], full[name][~decided], err_msg=name)
    second = decided & (full["response_class"] == ResponseClass.TRANSIENT_2)
    np.testing.assert_array_equal(early["zero_crossings"][second], full["zero_crossings"][second])
    np.testing.assert_array_equal(full["final_well"][second], 1)
    return int(decided.sum()), set(full["response_class"].tolist())


@pytest.mark.parametrize(("modes", "runs", "cycles"), [(1, 1500, 20), (2, 300, 20), (8, 120, 16), (32, 40, 12)])
def test_early_terminations(integrate_ensemble, model_of, draw, modes, runs, cycles) -> None:
    decided, classes = compare(integrate_ensemble, model_of(modes), draw(runs, 100 + modes), cycles)
    assert decided > runs // 20
    if runs > 100:
        assert classes == {0, 1, 2, 3}


def test_early_termination_of_every_law_and_drive(integrate_ensemble, model_of, draw, kind) -> None:
    """Newton's impacts decide early too; what a run decides never changes its class."""
    model, cycles = model_of(kind.modes), 16
    given = kind.given(model, draw(60, 300), cycles)
    given.pop("cycles")
    compare(integrate_ensemble, model, given, cycles)


@pytest.mark.slow
@pytest.mark.parametrize(("modes", "runs", "cycles"), [(1, 5000, 100), (8, 800, 60), (32, 300, 60)])
def test_many_early_terminations(integrate_ensemble, model_of, draw, modes, runs, cycles) -> None:
    decided, classes = compare(integrate_ensemble, model_of(modes), draw(runs, 200 + modes), cycles)
    assert decided > runs // 10
    assert classes == {0, 1, 2, 3}
