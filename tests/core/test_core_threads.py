"""Threads of the core, and their stop: also run under ThreadSanitizer."""

from __future__ import annotations

import numpy as np
import pytest
from core_systems import arrays, crowded, struck

from snapbeam import _core

POINTS = {"drive.frequency_ratio": np.linspace(1.0, 1.5, 24)}


@pytest.mark.parametrize("layout", ["runs", "thread"])
@pytest.mark.parametrize("made", [struck, crowded], ids=["struck", "crowded"])
def test_threads_share_the_runs(made, layout):
    found = []
    for threads in (1, 4):
        given = arrays(made(2), 3, POINTS)
        _core.integrate(given.problem, given.batch, layout, "", threads, lambda done, runs: None)
        found.append(given.batch["statistics"])
    assert np.array_equal(*found, equal_nan=True)


@pytest.mark.parametrize("layout", ["runs", "thread"])
def test_a_stop_ends_all(layout):
    given, heard = arrays(struck(2), 1_000_000, POINTS), []

    def progress(done, runs):
        heard.append((done, runs))
        if len(heard) == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        _core.integrate(given.problem, given.batch, layout, "", 4, progress)
    assert len(heard) == 2 and heard[0] == (0, 24)
    statuses = given.batch["statistics"][:, 0]
    assert (statuses[statuses >= 0.0] == 2.0).all()  # running
