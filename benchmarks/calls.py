"""Calls as a user makes them: processor time of an import, a command, one run, a prepared system, a sweep of one point; threads."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import snapbeam as sb
from benchmarks.cases import CONTACT, model_of
from benchmarks.ensemble import ensemble_of, sample
from benchmarks.report import save, table
from benchmarks.timing import measure
from snapbeam.solver import native

__all__ = ["run"]

_MODES = 8
_COMMAND = [sys.executable, "-m", "snapbeam"]


def _of_process(arguments: list[str], folder: str, repeats: int) -> float:
    """Processor time, s, of the fastest of some processes, after one that is not counted."""
    found, environment = [], {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
    for _ in range(repeats + 1):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run(arguments, cwd=folder, env=environment, check=True, capture_output=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        found.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return min(found[1:])


def _threads(count: int, quick: bool) -> float:
    """Wall-clock time with one thread over that with *count*, in turns."""
    ensemble = ensemble_of(1, sample(200 if quick else 4000), False)
    found: dict[int, list[float]] = {1: [], count: []}
    for _ in range(1 if quick else 5):
        for threads, walls in found.items():
            begun = time.perf_counter()
            native.run_ensemble(ensemble, threads)
            walls.append(time.perf_counter() - begun)
    return min(found[1]) / min(found[count])


def run(folder: Path, quick: bool) -> None:
    """Measure and write ``calls``."""
    repeats = 2 if quick else 15
    shaker = sb.Shaker(frequency_ratio=1.21, velocity_amplitude=0.18)
    system = sb.System(model_of(_MODES), contacts=[sb.Contact(CONTACT, shaker)])
    speeds = iter(np.linspace(0.1, 0.2, 10_000))

    def simulate(cycles: int) -> Callable[[], object]:
        return lambda: sb.simulate(
            system.replace(**{"drive.velocity_amplitude": float(next(speeds))}), sb.Integration(cycles=cycles)
        )

    def sweep() -> object:
        return sb.sweep(
            system, {"drive.velocity_amplitude": [float(next(speeds))]}, sb.Integration(cycles=1), progress=False
        )

    seconds: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as place:
        seconds["import snapbeam"] = _of_process([sys.executable, "-c", "import snapbeam"], place, repeats)
        seconds["python alone"] = _of_process([sys.executable, "-c", "pass"], place, repeats)
        seconds["snapbeam --help"] = _of_process([*_COMMAND, "--help"], place, repeats)
        stored = ["simulate", "-o", "run.nc", "--plot", "run.png", "--force"]
        seconds["snapbeam simulate -o run.nc --plot run.png"] = _of_process(
            [*_COMMAND, *stored], place, min(repeats, 5)
        )
    for cycles in (1, 20, 200):
        name = f"simulate with other numbers, {cycles} cycles, {_MODES} modes"
        seconds[name] = measure(simulate(cycles), 10 * repeats).seconds
    seconds[f"sweep of one point, 1 cycle, {_MODES} modes"] = measure(sweep, 10 * repeats).seconds
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    speedup = _threads(cores, quick)
    rows = [[name, f"{1e3 * value:.3g} ms"] for name, value in seconds.items()]
    rows.append([f"{cores} threads over one, N = 1, 4000 runs, wall clock", f"{speedup:.3g}"])
    text = table(("call", "processor time"), rows)
    save(folder, "calls", quick, {"seconds": seconds, "threads": cores, "speedup": speedup}, text)
