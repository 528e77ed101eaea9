"""What a run gives does not depend on the runs that are integrated with it."""

from __future__ import annotations

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.model.reduced_model import ReducedModel
from snapbeam.model.state import State
from snapbeam.util.status_codes import RunStatus


def part_of(given: dict, which: np.ndarray) -> dict:
    """The arguments of some of the runs."""
    return {name: value[which] if isinstance(value, np.ndarray) else value for name, value in given.items()}


def check_any_order_batch_and_threads(integrate_ensemble, model, given: dict, runs: int) -> None:
    whole = integrate_ensemble(model, **given, threads=2)
    for which, threads in (
        (np.arange(runs), 1),
        (np.arange(runs)[::-1], 3),
        (np.random.default_rng(3).permutation(runs)[: runs // 2], None),
        (np.array([0]), None),
        (np.array([runs // 2]), None),
        (np.array([runs - 1]), None),
    ):
        integrate_ensemble(model, **part_of(given, which), threads=threads).assert_is(whole, which)


@pytest.mark.parametrize(("modes", "runs", "cycles"), [(1, 60, 12), (8, 16, 5), (32, 10, 3), (40, 6, 1)])
def test_order_batch_and_threads(integrate_ensemble, model_of, draw, modes, runs, cycles) -> None:
    given = draw(runs, 11) | {"cycles": cycles}
    check_any_order_batch_and_threads(integrate_ensemble, model_of(modes), given, runs)


def test_order_batch_and_threads_of_every_law_and_drive(integrate_ensemble, model_of, draw, kind) -> None:
    model = model_of(kind.modes)
    check_any_order_batch_and_threads(integrate_ensemble, model, kind.given(model, draw(12, 12), 5), 12)


@pytest.mark.parametrize(("modes", "runs"), [(1, 5), (12, 4), (32, 3)])
def test_runs_that_end_at_the_same_step(integrate_ensemble, model_of, modes, runs) -> None:
    """Equal runs are equal, and none is left out where those integrated side by side end together."""
    given = {"frequency_ratio": np.full(runs, 1.3), "velocity_amplitude": np.full(runs, 0.25)}
    many = integrate_ensemble(model_of(modes), **given, cycles=3, threads=1)
    assert (many.statistics["status"] == RunStatus.OK).all()
    many.assert_is(many, np.zeros(runs, dtype=int))


def test_runs_of_different_contact_are_what_they_are_alone(model_of) -> None:
    """A stiffness that differs between the runs of one ensemble: the steps suit each run's own."""
    from snapbeam.solver import native
    from snapbeam.solver.assemble import make_ensemble

    stiffness = np.array([1e7, 4e8, 3e9])
    shaker = sb.Shaker(frequency_ratio=1.3, velocity_amplitude=0.25)
    integration = sb.Integration(cycles=3)
    whole = make_ensemble(
        sb.System(model_of(2), contacts=[sb.Contact(default_values.CONTACT, shaker)]),
        integration,
        {"contact.stiffness": stiffness},
    )
    accumulators_of_runs = native.run_ensemble(whole)
    assert len(set(accumulators_of_runs["steps"].tolist())) == 3
    for i, value in enumerate(stiffness):
        alone = make_ensemble(
            sb.System(model_of(2), contacts=[sb.Contact(sb.HertzContact(float(value)), shaker)]), integration
        )
        assert alone.runs["tick"][0] == whole.runs["tick"][i]
        assert alone.runs["contact_step"][0] == whole.runs["contact_step"][i]
        found = native.run_ensemble(alone)
        for name in accumulators_of_runs.dtype.names:
            np.testing.assert_array_equal(found[name][0], accumulators_of_runs[name][i], err_msg=name)


def test_cycles_beyond_the_last_do_not_change_the_first(integrate_ensemble, model_of) -> None:
    """Statistics that only accumulate are those of the longer run's beginning: time comes from ticks."""
    model = model_of(2)
    short, long = (integrate_ensemble(model, frequency_ratio=1.4, velocity_amplitude=0.02, cycles=c) for c in (5, 10))
    for name in ("time", "zero_crossings", "impacts", "steps", "contact_time", "total_impulse", "gross_work"):
        assert (long.accumulators_of_runs[name] >= short.accumulators_of_runs[name]).all(), name
    assert long.statistics["peak_force"] >= short.statistics["peak_force"]
    assert long.statistics["min_displacement"] <= short.statistics["min_displacement"]


def test_time_does_not_drift(integrate_ensemble) -> None:
    """Time comes from integers: after 10^5 cycles of a linear oscillator the run ends where it should."""
    oscillator = ReducedModel.from_matrices([[1.0]], [1.0], contact_shape=[1.0], reference_frequency=1.0)
    cycles = 100_000
    start = State(amplitude=np.zeros(1), velocity=np.ones(1))
    end = integrate_ensemble(oscillator, None, cycles=cycles, start=start, step=0.25)
    seconds = end.accumulators_of_runs["time"][0] * end.ensemble.runs["tick"][0]
    assert seconds == pytest.approx(cycles, rel=1e-15)
    assert end.accumulators_of_runs["energy"][0] == pytest.approx(0.5, rel=1e-9)
