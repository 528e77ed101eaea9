"""How the CPU engine shares the runs of an ensemble out."""

from __future__ import annotations

import numpy as np
import pytest

from snapbeam.solver.cpu.driver import _CHUNK_STEPS, _chunks


@pytest.mark.parametrize("runs", [1, 2, 3, 7, 40, 1000, 20_000])
@pytest.mark.parametrize("threads", [1, 2, 16])
def test_every_run_is_in_one_task_and_every_thread_has_some(runs: int, threads: int) -> None:
    work = np.random.default_rng(runs).uniform(1e3, 4e4, runs)
    chunks = _chunks(work, threads)
    np.testing.assert_array_equal(np.sort(np.concatenate(chunks)), np.arange(runs))
    sums = np.array([work[chunk].sum() for chunk in chunks])
    assert (sums > 0.0).all()
    assert sums.max() <= _CHUNK_STEPS + 2.0 * work.max()
    # longest first
    assert (np.diff(np.concatenate([work[chunk] for chunk in chunks])) <= 0.0).all()
    if threads > 1 and runs >= 16 * threads:
        assert len(chunks) >= 2 * threads
    if threads == 1 and work.sum() < _CHUNK_STEPS:
        assert len(chunks) == 1
