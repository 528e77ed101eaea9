"""Ensembles integrated by the CUDA engine in Numba's simulator, in a process of its own.

The simulator is chosen when Numba is first imported, so it needs another process; there every thread of a
block is a Python thread, and a step takes a tenth of a second: a few modes, a few dozen steps.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any, NamedTuple

from numpy.typing import NDArray

from snapbeam.solver.cuda.driver import Options
from snapbeam.solver.ensemble import Ensemble

__all__ = ["Job", "march_in_simulator"]


class Job(NamedTuple):
    """An ensemble, how the engine is to integrate it, and the steps of every slice (None: one slice)."""

    ensemble: Ensemble
    options: Options = Options(most_blocks=1, fewest_threads=1)
    slice_steps: int | None = None


def march_in_simulator(
    jobs: list[Job], timeout: float = 300.0
) -> list[tuple[NDArray[Any], list[tuple[int, int]]]]:
    """Books of every job, and the calls of its progress."""
    with tempfile.TemporaryDirectory() as folder:
        asked, answered = Path(folder, "jobs"), Path(folder, "results")
        asked.write_bytes(pickle.dumps([tuple(job) for job in jobs]))
        subprocess.run(
            [sys.executable, __file__, str(asked), str(answered)],
            env=os.environ | {"NUMBA_ENABLE_CUDASIM": "1"},
            check=True,
            timeout=timeout,
        )
        return pickle.loads(answered.read_bytes())


def _answer(asked: Path, answered: Path) -> None:
    from snapbeam.solver.cuda import driver as cuda_engine

    sys.setswitchinterval(1e-5)
    results = []
    for ensemble, options, slice_steps in pickle.loads(asked.read_bytes()):
        calls: list[tuple[int, int]] = []
        steps = slice_steps or 10**6
        cuda_engine.SLICE_STEPS = (steps, steps)
        books = cuda_engine.run_ensemble(
            ensemble,
            progress=lambda done, total, calls=calls: calls.append((done, total)),
            options=options._replace(first_budget=steps),
        )
        results.append((books, calls))
    answered.write_bytes(pickle.dumps(results))


if __name__ == "__main__":
    _answer(Path(sys.argv[1]), Path(sys.argv[2]))
