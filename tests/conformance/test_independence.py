"""What a run gives does not depend on what it is marched with."""

from __future__ import annotations

import numpy as np
import pytest

from snapbeam.core.codes import RunStatus
from snapbeam.engines.columns import Counts, Numbers, Reals
from snapbeam.engines.ensemble import Start
from snapbeam.model.reduction import ReducedModel


@pytest.mark.parametrize(("modes", "runs", "cycles"), [(1, 60, 12), (8, 16, 5), (32, 10, 3), (40, 6, 1)])
def test_order_batch_and_threads(march, model_of, draw, modes, runs, cycles) -> None:
    model, given = model_of(modes), draw(runs, 11)
    whole = march(model, **given, cycles=cycles, threads=2)

    def check(which: np.ndarray, threads: int | None = None) -> None:
        part = march(
            model, **{name: column[which] for name, column in given.items()}, cycles=cycles, threads=threads
        )
        np.testing.assert_array_equal(part.counts, whole.counts[which])
        np.testing.assert_array_equal(part.numbers, whole.numbers[which])

    check(np.arange(runs), threads=1)
    check(np.arange(runs)[::-1], threads=3)
    check(np.random.default_rng(3).permutation(runs)[: runs // 2])
    for alone in (0, runs // 2, runs - 1):
        check(np.array([alone]))


@pytest.mark.parametrize(("modes", "runs"), [(1, 5), (12, 4), (32, 3)])
def test_runs_that_end_at_the_same_step(march, model_of, modes, runs) -> None:
    """Equal runs are equal, and none is left out where those marched side by side end together."""
    given = {"frequency_ratio": np.full(runs, 1.3), "velocity_amplitude": np.full(runs, 0.25)}
    many = march(model_of(modes), **given, cycles=3, threads=1)
    assert (many.statistics["status"] == RunStatus.OK).all()
    np.testing.assert_array_equal(many.counts, np.tile(many.counts[:1], (runs, 1)))
    np.testing.assert_array_equal(many.numbers, np.tile(many.numbers[:1], (runs, 1)))


def test_cycles_beyond_the_last_do_not_change_the_first(march, model_of) -> None:
    """Statistics that only accumulate are those of the longer run's beginning: time comes from ticks."""
    model = model_of(2)
    short, long = (march(model, frequency_ratio=1.4, velocity_amplitude=0.02, cycles=c) for c in (5, 10))
    assert (long.counts >= short.counts).all()
    assert long.statistics["peak_force"] >= short.statistics["peak_force"]
    assert long.statistics["min_displacement"] <= short.statistics["min_displacement"]


def test_time_does_not_drift(march) -> None:
    """Time comes from integers: after 10^5 cycles of a linear oscillator the run ends where it should."""
    oscillator = ReducedModel.from_matrices([[1.0]], [1.0], contact_shape=[1.0], reference_freq=1.0)
    cycles = 100_000
    end = march(oscillator, None, cycles=cycles, start=Start(np.zeros(1), np.ones(1)), step=0.3)
    seconds = end.counts[0, Counts.TIME] * end.ensemble.reals[0, Reals.TICK]
    assert seconds == pytest.approx(cycles, rel=1e-15)
    assert end.numbers[0, Numbers.ENERGY] == pytest.approx(0.5, rel=1e-9)
