"""Runs that take long: integrated once, heard when interrupted, and saying how far they are."""

from __future__ import annotations

import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.solver.cpu import driver

SYSTEM = sb.System(
    sb.ReducedModel.from_beam(default_values.BEAM, modes=2),
    contacts=[sb.Contact(default_values.CONTACT, sb.Shaker(frequency_ratio=1.21, velocity_amplitude=0.02))],
)


def test_one_integration_a_run(monkeypatch) -> None:
    """Samples, impacts and statistics come from the same integrate_ensemble."""
    steps = []
    record = driver.record

    def counted(*arguments, **options):
        for piece in record(*arguments, **options):
            steps.append(int(piece.accumulators_of_runs["steps"][0]))
            yield piece

    def never(*_, **__):
        raise AssertionError("a run is recorded, not integrated beside it")

    monkeypatch.setattr(driver, "record", counted)
    monkeypatch.setattr(driver, "run_ensemble", never)
    run = sb.simulate(SYSTEM, sb.Integration(cycles=50))
    assert run.summary.impacts > 0 and run.dataset.sizes["time"] > 5000
    # pieces follow each other: no step is taken twice
    assert steps == sorted(steps) and len(steps) < 10


def test_a_run_in_pieces_is_the_run(monkeypatch) -> None:
    """However its recording is cut, to the last bit."""
    whole = sb.simulate(SYSTEM, sb.Integration(cycles=20))
    monkeypatch.setattr(driver, "_SLICE_STEPS", 700)
    monkeypatch.setattr(driver, "_SLICE_BYTES", 2**16)
    cut = sb.simulate(SYSTEM, sb.Integration(cycles=20))
    np.testing.assert_equal(dict(cut.summary), dict(whole.summary))
    for name in whole.dataset.variables:
        np.testing.assert_array_equal(cut.dataset[name], whole.dataset[name], err_msg=str(name))
    for name in whole.impacts.variables:
        np.testing.assert_array_equal(cut.impacts[name], whole.impacts[name], err_msg=str(name))
    np.testing.assert_array_equal(cut.final_state.amplitude, whole.final_state.amplitude)


def test_progress(monkeypatch) -> None:
    monkeypatch.setattr(driver, "_SLICE_STEPS", 300)
    seen: list[float] = []
    sb.simulate(SYSTEM, sb.Integration(cycles=50), sample_times=[0.0], progress=seen.append)
    assert len(seen) > 5
    assert seen == sorted(seen) and 0.0 < seen[0] < 0.5 < seen[-1] <= 1.0


PROGRAM = """
import snapbeam as sb
from snapbeam.model import default_values
system = sb.System(
    sb.ReducedModel.from_beam(default_values.BEAM, modes=32),
    contacts=[sb.Contact(default_values.CONTACT, sb.Shaker(frequency_ratio=1.21, velocity_amplitude=0.02))],
)
sb.simulate(system, sb.Integration(cycles=1), sample_times=[0.0])
print("ready", flush=True)
{call}
"""
CALLS = {
    "simulate": "sb.simulate(system, sb.Integration(cycles=10**6), sample_times=[0.0])",
    "simulate, recorded": "sb.simulate(system, sb.Integration(cycles=10_000), sample_times=None)",
    "advance": "sb.advance(system, periods=10**4)",
}


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="interrupts are POSIX signals here")
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow if name == "simulate" else ()) for name in CALLS]
)
def test_an_interrupt_ends_a_run_of_minutes(name: str) -> None:
    process = subprocess.Popen(
        [sys.executable, "-c", PROGRAM.format(call=CALLS[name])], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        text=True,
    )  # fmt: skip
    try:
        assert process.stdout.readline() == "ready\n"
        time.sleep(1.0)
        process.send_signal(signal.SIGINT)
        _, messages = process.communicate(timeout=600)
    finally:
        process.kill()
        process.wait()
    assert process.returncode != 0 and "KeyboardInterrupt" in messages
