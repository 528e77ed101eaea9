"""A great many short runs of one mode: memory that grows with their number alone, progress, and an end at once."""

from __future__ import annotations

import signal
import threading
import time
import tracemalloc
from _thread import interrupt_main
from itertools import pairwise

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model.default_values import BEAM, CONTACT
from snapbeam.solver.assemble import make_ensemble
from snapbeam.solver.cpu import driver
from snapbeam.util.status_codes import RunStatus

MOST_BYTES = 700
"""Of a run, at most: its numbers, its book, and what is held while the runs are put in order."""


@pytest.fixture(autouse=True)
def eight_runs_in_a_register(monkeypatch):
    monkeypatch.setattr(driver, "FEWEST_STEPS", 0.0)


def many(runs, cycles=10):
    """Runs of one mode over the plane of Fig. 6."""
    generator = np.random.default_rng(0)
    striker = sb.Striker(drive=sb.Sine(frequency_ratio=1.0, velocity_amplitude=0.2))
    system = sb.System(
        sb.ReducedModel.from_beam(BEAM, modes=1, damping_ratio=0.005), contacts=[sb.Contact(CONTACT, striker)]
    )
    points = {
        "drive.frequency_ratio": generator.uniform(0.1, 4.0, runs),
        "drive.velocity_amplitude": generator.uniform(0.02, 0.65, runs),
    }
    return make_ensemble(system, sb.Integration(cycles=cycles), points)


def marched(runs):
    """Bytes a run at the peak, what was told of progress, and the books."""
    told = []
    driver.run_ensemble(many(8), 2)  # compiles, which is several times slower while memory is traced
    tracemalloc.start()
    try:
        made = many(runs)
        accumulators_of_runs = driver.run_ensemble(made, 2, lambda done, total: told.append((done, total)))
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    return peak / runs, told, accumulators_of_runs


def assert_marched(runs, told, accumulators_of_runs):
    assert (accumulators_of_runs["status"] == RunStatus.OK).all()
    assert (accumulators_of_runs["time"] > 0).all()
    assert told[0] == (0, runs)
    assert told[-1] == (runs, runs)
    assert all(before[0] <= after[0] for before, after in pairwise(told))


@pytest.mark.slow
def test_memory_of_a_run_does_not_depend_on_their_number():
    marched(100)  # what is compiled and measured once
    few, _, _ = marched(10_000)
    more, told, accumulators_of_runs = marched(20_000)
    assert_marched(20_000, told, accumulators_of_runs)
    assert more < 1.05 * few
    assert more < MOST_BYTES


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_an_interrupt_ends_them_at_once():
    """One that comes in the midst of runs that would take half a minute at least, none of which ends before."""
    driver.run_ensemble(many(16, cycles=1), 2)
    made, sent, over = many(256, cycles=100_000), [], threading.Event()

    def interrupt():
        # again after a while: one that falls into the clearing away of garbage is swallowed by Python
        wait = 0.5
        while not over.wait(wait):
            sent.append(time.process_time())
            interrupt_main()
            wait = 5.0

    sender = threading.Thread(target=interrupt, daemon=True)
    # a process that was started in the background is deaf to it
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        sender.start()
        with pytest.raises(KeyboardInterrupt):
            driver.run_ensemble(made, 2)
        ended = time.process_time()
    finally:
        over.set()
        sender.join()
        signal.signal(signal.SIGINT, before)
    # processor time: a fifth of a second to hear it, and to end two threads
    assert ended - sent[-1] < 3.0 and len(sent) < 10


@pytest.mark.slow
def test_ten_million_runs():
    size = 10_000_000
    bytes_a_run, told, accumulators_of_runs = marched(size)
    assert_marched(size, told, accumulators_of_runs)
    assert len(told) > 100
    assert bytes_a_run < MOST_BYTES
