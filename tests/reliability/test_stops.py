"""Ctrl-C at random instants in ensembles, recorded and streamed runs: they end, and what comes next has the same bits."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time

import numpy as np
import pytest
import xarray as xr

import snapbeam as sb
from snapbeam.model import default_values

KINDS = ("ensemble", "recorded", "streamed")


def begin(kind, folder, cycles):
    """A computation; with 10,000 cycles it takes longer than any delay."""
    modes = 1 if kind == "ensemble" else 8
    shaker = sb.Shaker(frequency_ratio=1.2, velocity_amplitude=0.2)
    system = sb.System(
        sb.ReducedModel.from_beam(default_values.BEAM, modes=modes),
        contacts=[sb.Contact(default_values.CONTACT, shaker)],
    )
    how = sb.Integration(cycles=cycles)
    if kind == "ensemble":
        return sb.sweep(system, {"drive.frequency_ratio": np.linspace(1.0, 1.4, 12)}, how)
    if kind == "recorded":
        return sb.simulate(system, how)
    sb.simulate_to_file(system, how, path=folder / "run.nc")
    return sb.load(folder / "run.nc")


def values(found):
    table = found if isinstance(found, xr.Dataset) else found.to_dataframe()
    return {name: np.asarray(table[name]) for name in table if np.asarray(table[name]).dtype.kind == "f"}


@pytest.mark.sampled(3)
@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("stops", [2, pytest.param(70, marks=pytest.mark.slow)])
def test_stopped_at_random_instants(kind, stops, tmp_path, tried):
    rng, late = np.random.default_rng(KINDS.index(kind)), []
    before = values(begin(kind, tmp_path, 2))
    (tmp_path / "run.nc").unlink(missing_ok=True)
    threads = threading.active_count()
    for _ in range(stops):
        sent = []

        def interrupt(sent=sent):
            sent.append(time.monotonic())
            os.kill(os.getpid(), signal.SIGINT)

        timer = threading.Timer(rng.uniform(0.0, 0.4), interrupt)
        with pytest.raises(KeyboardInterrupt):
            timer.start()
            begin(kind, tmp_path, 10_000 if kind == "recorded" else 100_000)
        late.append(time.monotonic() - sent[0])
        timer.join()
        assert list(tmp_path.iterdir()) == [] and threading.active_count() == threads
    tried(f"stops of {kind} runs, the slowest after {1e3 * max(late):.0f} ms", stops)
    after = values(begin(kind, tmp_path, 2))
    assert before.keys() == after.keys() and all(
        np.array_equal(before[name], after[name], equal_nan=True) for name in before
    )
