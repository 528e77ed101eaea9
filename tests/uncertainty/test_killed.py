"""Killed twenty times with SIGKILL: a probability map, a design and a sensitivity lose nothing, to the last bit."""

from __future__ import annotations

import multiprocessing
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from small import small_system

import snapbeam as sb

KILLS, CHUNK = 20, 2
HOW = sb.Integration(cycles=20, threads=1)
SPREAD = sb.uncertainty.ParameterUncertainty(
    of={"velocity_amplitude": sb.uncertainty.Normal(0.05, relative=True)}, phase=True, displacement=3e-6
)
WIDE = sb.uncertainty.ParameterUncertainty(
    of={"location": sb.uncertainty.Normal(0.01), "contact.stiffness": sb.uncertainty.LogNormal(0.2)}, phase=True
)


def probability(store):
    axes = {"frequency_ratio": [0.8, 1.4], "velocity_amplitude": np.linspace(0.06, 0.3, 6)}
    runs = sb.uncertainty.SamplingPlan(half_width=0.08, initial_runs=16, max_runs=160)
    return sb.uncertainty.probability_map(small_system(), axes, SPREAD, runs, integration=HOW, checkpoint=store)


def optimum(store):
    effort = sb.uncertainty.OptimizerSettings(
        generations=6, population=6, samples=16, validation_samples=100, candidates=3
    )
    variables = {"velocity_amplitude": (0.05, 0.4), "location": (0.3, 0.5)}
    limit = sb.uncertainty.Constraint(quantity="snap", lower=0.8)
    return sb.uncertainty.optimize_design(
        small_system(), variables, "speed", limit, SPREAD, effort, integration=HOW, checkpoint=store
    )


def tornado(store):
    return sb.uncertainty.sensitivity(small_system(), "peak_force", WIDE, samples=80, integration=HOW, checkpoint=store)


def kept(store: Path) -> int:
    """Bytes of all that is kept."""
    total = 0
    for file in store.rglob("*"):
        try:
            total += file.stat().st_size
        except FileNotFoundError:
            continue
    return total


def kill_while_it_works(make: Callable[[object], object], store: Path, draw: np.random.Generator) -> bool:
    """Whether a process that asks was killed, once it had kept more several times and a little later."""
    seen = {kept(store)}
    child = multiprocessing.get_context("fork").Process(
        target=lambda: make(sb.CheckpointOptions(store, points_per_task=CHUNK))
    )
    child.start()
    until, wanted = time.monotonic() + 300.0, int(draw.integers(6, 12))
    while child.is_alive() and len(seen) < wanted and time.monotonic() < until:
        time.sleep(0.0005)
        seen.add(kept(store))
    time.sleep(draw.uniform(0.0, 0.002))
    running = child.is_alive()
    child.kill()
    child.join()
    return running and child.exitcode == -9


@pytest.mark.slow
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="processes are forked")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
@pytest.mark.parametrize("make", [probability, optimum, tornado])
def test_nothing_is_lost_when_killed(make, tmp_path) -> None:
    whole = make(None)
    store, draw = tmp_path / "store", np.random.default_rng(3)
    kills = sum(kill_while_it_works(make, store, draw) for _ in range(KILLS))
    assert kills == KILLS, "each time it was at work"
    tally = sb.SweepReport()
    again = make(sb.CheckpointOptions(store, points_per_task=CHUNK, report=tally))
    assert again.equals(whole)
    assert tally.resumed >= KILLS, "what was done before each kill is read again"
    print(make.__name__, kills, "kills;", tally)
    after = sb.SweepReport()
    assert make(sb.CheckpointOptions(store, points_per_task=CHUNK, report=after)).equals(whole) and after.runs == 0
