"""The CPU engine's driver: threads that take runs from a queue."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.codes import RunStatus
from snapbeam.engines.columns import Counts, Numbers, Reals
from snapbeam.engines.cpu.march import march_many
from snapbeam.engines.cpu.rows import Layout
from snapbeam.engines.ensemble import Ensemble
from snapbeam.engines.scalar.composition import Stages, in_memory, slot_length
from snapbeam.engines.scalar.decisions import PIECES, Outputs
from snapbeam.engines.scalar.lanes import WIDTH

__all__ = ["record", "run_ensemble", "usable_cores"]

_Array = NDArray[np.float64]
_CHUNK_STEPS = 3_000_000
"""Flight steps per task at most: a second or so, so that progress is smooth and Ctrl-C prompt."""
_CHUNKS = 4
"""Tasks per thread at least, of _FEW runs each at least, so that the threads end together."""
_FEW = 4
_ALIGNMENT = 64


def usable_cores() -> int:
    """Cores that this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:
        return os.cpu_count() or 1


def _memory(ensemble: Ensemble) -> tuple[_Array, tuple[Layout, Layout], Stages]:
    """A copy of the structure's rows with room for two runs, aligned to whole registers, and where is what."""
    packed, plan, drive = ensemble.packed, ensemble.plan, ensemble.drive_table
    size, first = packed.layout.size, packed.layout
    work = 10 * size + (plan.finest + 3) * slot_length(plan.order, size) + 8 * size
    second = first._replace(
        g=first.work + work, contact=first.work + work + size, work=first.work + work + 2 * size
    )
    stages, weights = in_memory(plan.order, second.work + work)
    first_drive = stages.flow + weights.size
    raw = np.zeros(first_drive + drive.size + _ALIGNMENT // 8)
    skipped = (-raw.ctypes.data % _ALIGNMENT) // 8
    memory: _Array = raw[skipped : skipped + first_drive + drive.size]
    memory[: first.work] = packed.memory
    memory[second.g : second.g + size] = memory[first.g : first.g + size]
    memory[stages.flow : first_drive] = weights
    memory[first_drive:] = drive
    samples, interval = drive.size // 2, ensemble.drive_interval
    first = first._replace(drive=first_drive, drive_samples=samples, drive_interval=interval)
    second = second._replace(drive=first_drive, drive_samples=samples, drive_interval=interval)
    return memory, (first, second), stages


def _nothing(size: int) -> Outputs:
    return Outputs(np.empty(0), np.empty((0, size)), np.empty((0, 6)), np.empty((0, 4)), False)


def _empty(runs: int) -> tuple[NDArray[np.int64], _Array]:
    counts = np.zeros((runs, len(Counts)), dtype=np.int64)
    counts[:, Counts.STATUS] = RunStatus.NOT_RUN
    numbers = np.zeros((runs, len(Numbers)))
    numbers[:, Numbers.LAST_CROSSING] = np.nan
    numbers[:, Numbers.DECIDED_AT] = np.nan
    return counts, numbers


def _march(
    ensemble: Ensemble,
    counts: NDArray[np.int64],
    numbers: _Array,
    which: NDArray[np.int64],
    outputs: Outputs,
) -> None:
    """March the runs *which* in this thread by the law of impact that the ensemble has."""
    march: Any = march_many
    if ensemble.restitution:
        from snapbeam.engines.cpu.restitution import march_restitution_many as march
    packed, plan = ensemble.packed, ensemble.plan
    memory, layouts, stages = _memory(ensemble)
    fastest = max(float(packed.model.omega.max()), float(ensemble.reals[:, Reals.OMEGA].max()))
    pieces = 2 * max(8, math.ceil(PIECES * fastest * plan.step / (2.0 * math.pi)) + 1)
    march(
        memory,
        packed.blocks,
        layouts,
        stages,
        ensemble.contact_rows,
        ensemble.starts,
        ensemble.reals,
        ensemble.ticks,
        plan.coarsest,
        plan.finest,
        ensemble.max_steps,
        counts,
        numbers,
        which,
        np.empty((pieces + 1, 4)),
        np.empty(pieces * 4 * WIDTH),
        outputs,
    )


def _chunks(work: _Array, threads: int) -> list[NDArray[np.int64]]:
    """The runs of each task, longest first: tasks of so little *work* that every thread gets several."""
    order = np.argsort(-work, kind="stable")
    share = work.sum() / max(1.0, min(threads * _CHUNKS, work.size / _FEW))
    most = _CHUNK_STEPS if threads == 1 else min(_CHUNK_STEPS, share)
    cuts = np.unique(np.cumsum(work[order]) // most, return_index=True)[1][1:]
    return np.split(order, cuts)


def run_ensemble(
    ensemble: Ensemble, threads: int | None = None, progress: Callable[[int, int], object] | None = None
) -> tuple[NDArray[np.int64], _Array]:
    """March every run of an ensemble.

    Runs are handed out longest first, a chunk at a time; what a run gives does not depend on which thread
    marched it or on what it was marched with.

    Returns
    -------
    counts : int64 array of shape (runs, len(Counts))
    numbers : float64 array of shape (runs, len(Numbers))
    """
    packed = ensemble.packed
    counts, numbers = _empty(ensemble.size)
    threads = threads or usable_cores()

    def march_chunk(which: NDArray[np.int64]) -> int:
        _march(ensemble, counts, numbers, which, _nothing(packed.layout.size))
        return which.size

    done = 0
    with ThreadPoolExecutor(threads) as pool:
        pending: set[Future[int]] = {
            pool.submit(march_chunk, chunk) for chunk in _chunks(ensemble.work, threads)
        }
        try:
            while pending:
                finished, pending = wait(pending, return_when=FIRST_COMPLETED)
                done += sum(future.result() for future in finished)
                if progress is not None:
                    progress(done, ensemble.size)
        except BaseException:
            pool.shutdown(wait=True, cancel_futures=True)
            raise
    return counts, numbers


def record(
    ensemble: Ensemble, run: int, times: _Array, impacts: int, ledger: bool
) -> tuple[NDArray[np.int64], _Array, Outputs]:
    """March one run and write down what happens at *times* and in its first *impacts* impacts."""
    size = ensemble.packed.layout.size
    outputs = Outputs(
        times,
        np.full((times.size, size), np.nan),
        np.full((times.size, 6), np.nan),
        np.full((impacts, 4), np.nan),
        ledger,
    )
    all_counts, all_numbers = _empty(ensemble.size)
    _march(ensemble, all_counts, all_numbers, np.array([run]), outputs)
    return all_counts[run], all_numbers[run], outputs
