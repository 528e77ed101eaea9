"""Signals during calls of HDF5: held back, handled where an exception may be raised, and no incomplete file is left."""

from __future__ import annotations

import os
import signal
import sys
import threading

import numpy as np
import pytest
import xarray as xr

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.simulation.simulate import even_instants
from snapbeam.util import netcdf
from snapbeam.util.interrupts import held_back, raise_held

posix = pytest.mark.skipif(sys.platform == "win32", reason="interrupts are POSIX signals here")


@pytest.fixture(autouse=True)
def own_handlers():
    """Python's own handler, whatever shell or test came before."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@posix
def test_signals_wait_for_a_place_where_they_may_be_handled():
    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt), held_back():
        signal.raise_signal(signal.SIGINT)
        with held_back():
            pass
        reached = True
        raise_held()
        reached = False
    assert reached and signal.getsignal(signal.SIGINT) is before
    with pytest.raises(KeyboardInterrupt), held_back():
        signal.raise_signal(signal.SIGINT)
        reached = "the end of the block"
    assert reached == "the end of the block" and signal.getsignal(signal.SIGINT) is before
    raise_held()


@posix
def test_handlers_of_a_user_are_called_once():
    heard = []
    before = signal.signal(signal.SIGTERM, lambda number, _: heard.append(number))
    try:
        with held_back():
            signal.raise_signal(signal.SIGTERM)
            assert heard == []
            raise_held()
            assert heard == [signal.SIGTERM]
            raise_held()
    finally:
        signal.signal(signal.SIGTERM, before)
    assert heard == [signal.SIGTERM]


def test_a_thread_leaves_the_signals_alone():
    before, seen = signal.getsignal(signal.SIGINT), []

    def work():
        with held_back():
            seen.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert seen == [before]


def written(path):
    sb.write_netcdf({None: xr.Dataset({"a": ("x", np.arange(1e5))}), "b": xr.Dataset({"c": 1.0})}, path)


def streamed(path):
    sb.simulate_to_file(system(), sb.Integration(cycles=40), path=path)


def swept(path):
    axes = {"drive.frequency_ratio": [1.0, 1.2], "drive.velocity_amplitude": [0.1, 0.2]}
    sb.sweep(system(), axes, sb.Integration(cycles=2), checkpoint=path.parent / "store", output=path)


def saved(path):
    sb.simulate(system(), sb.Integration(cycles=2)).save(path)


def system():
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=1)
    return sb.System(
        model, contacts=[sb.Contact(default_values.CONTACT, sb.Shaker(frequency_ratio=1.2, velocity_amplitude=0.18))]
    )


@pytest.mark.slow
@posix
@pytest.mark.parametrize("method", ["write", "seek", "truncate", "close"])
@pytest.mark.parametrize("write", [written, streamed, swept, saved], ids=lambda write: write.__name__)
def test_a_signal_in_each_callback_of_hdf5(tmp_path, monkeypatch, write, method):
    """From Python too, where Ctrl-C raises an exception wherever it is."""
    target, calls = tmp_path / "st.nc", []
    own = getattr(netcdf.DiskStream, method)

    def interrupted(self, *arguments):
        calls.append(method)
        os.kill(os.getpid(), signal.SIGINT)
        return own(self, *arguments)

    monkeypatch.setattr(netcdf.DiskStream, method, interrupted)
    with pytest.raises(KeyboardInterrupt):
        write(target)
    assert calls
    left = [name for name in os.listdir(tmp_path) if name.startswith(".")]
    assert left == []
    monkeypatch.undo()
    write(target)
    assert xr.open_dataset(target, engine="h5netcdf").sizes


LARGEST = 2**16
"""Instants searched, or numbers written, after a stop: one part of a record or one chunk of the file."""


@posix
@pytest.mark.parametrize(("place", "before"), [("searched", 100_000), ("written", 10), ("written", 300_000)])
def test_work_after_a_stop_of_a_streamed_run_is_one_part(tmp_path, monkeypatch, place, before):
    """A run of 2·10⁷ instants was searched whole, and each piece of it written whole, before a signal was heard."""
    import h5netcdf

    search, write, done, later = np.searchsorted, h5netcdf.Variable.__setitem__, [], []

    def counted(call, size):
        (done if sum(done) <= before else later).append(size)
        if sum(done) > before and not later:
            signal.raise_signal(signal.SIGINT)
        return call()

    if place == "searched":
        monkeypatch.setattr(np, "searchsorted", lambda a, v, **how: counted(lambda: search(a, v, **how), np.size(v)))
    else:
        monkeypatch.setattr(
            h5netcdf.Variable, "__setitem__", lambda *given: counted(lambda: write(*given), np.size(given[2]))
        )
    system_of_many = sb.System(sb.ReducedModel.from_beam(default_values.BEAM, modes=8), contacts=system().contacts)
    with pytest.raises(KeyboardInterrupt):
        sb.simulate_to_file(system_of_many, sb.Integration(cycles=1000), path=tmp_path / "st.nc")
    assert sum(done) > before and done[-1] + sum(later) <= LARGEST
    assert os.listdir(tmp_path) == []


@posix
def test_a_stop_while_room_is_reserved(tmp_path):
    with netcdf.DiskStream(tmp_path / "st.nc") as stream, pytest.raises(KeyboardInterrupt), held_back():
        signal.raise_signal(signal.SIGINT)
        stream.reserve(2**26)
    assert (tmp_path / "st.nc").stat().st_size <= 2**20


@pytest.mark.parametrize("count", [1, 2, 3, 1000, 2**22, 2**22 + 1, 9_000_001])
@pytest.mark.parametrize("end", [1.0, 0.1, 1e-3 / 3, 12345.678])
def test_instants_by_blocks(end, count):
    assert np.array_equal(even_instants(end, count), np.linspace(0.0, end, count))
