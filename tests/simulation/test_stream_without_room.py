"""A run that is written piece by piece to a disk that fills: it ends at the last whole piece, which is kept."""

from __future__ import annotations

import os
import subprocess
import sys
import tracemalloc

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.util.files import NoRoomError
from snapbeam.util.netcdf import DiskStream


class SmallDisk:
    """A file on a disk with *room* bytes, which takes what fits of each write."""

    def __init__(self, file, room):
        self.file, self.room = file, room

    def write(self, data):
        left = self.room - self.file.tell()
        if left <= 0:
            raise OSError(28, "No space left on device")
        return self.file.write(data[:left])

    def __getattr__(self, name):
        return getattr(self.file, name)


@pytest.fixture
def system():
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=1)
    striker = sb.Shaker(frequency_ratio=1.2, velocity_amplitude=0.18)
    return sb.System(model, contacts=[sb.Contact(default_values.CONTACT, striker)])


def limited(monkeypatch, room):
    own = DiskStream.__init__

    def small(self, path):
        own(self, path)
        self._file = SmallDisk(self._file, room)

    monkeypatch.setattr(DiskStream, "__init__", small)


def in_pieces(monkeypatch):
    """Pieces of some thousand samples, so that a short run has many."""
    from snapbeam.solver import native

    monkeypatch.setattr(native, "_SAMPLES", 4096)


@pytest.mark.slow
def test_a_run_ends_at_the_last_whole_piece(tmp_path, monkeypatch, system):
    in_pieces(monkeypatch)
    settings = sb.Integration(cycles=300, early_termination=False)
    whole = tmp_path / "whole.nc"
    sb.simulate_to_file(system, settings, path=whole)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "none"))
    with monkeypatch.context() as patch:
        limited(patch, int(0.5 * whole.stat().st_size) + 2**22)
        with pytest.raises(NoRoomError, match=r"whole up to there.*final_state"):
            sb.simulate_to_file(system, settings, path=tmp_path / "part.nc")
    assert sorted(os.listdir(tmp_path)) == ["part.nc", "whole.nc"]
    run, part = sb.load(whole), sb.load(tmp_path / "part.nc")
    count = part.dataset.sizes["time"]
    assert 4096 < count < run.dataset.sizes["time"] and part.summary.status == sb.RunStatus.INTERRUPTED
    for name, variable in part.dataset.data_vars.items():
        np.testing.assert_array_equal(variable.values, run.dataset[name].isel(time=slice(count)).values, str(name))
    rest = system.replace(initial_state=part.final_state)
    more = sb.simulate(rest, sb.Integration(cycles=3, early_termination=False))
    begun = more.dataset["midspan_displacement"].values[0]
    assert begun == pytest.approx(part.dataset["midspan_displacement"].values[-1], abs=0.05)


def test_no_room_for_the_first_piece(tmp_path, monkeypatch, system):
    limited(monkeypatch, 20_000)
    kept = tmp_path / "kept"
    kept.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(kept))
    (tmp_path / "disk").mkdir()
    with pytest.raises(NoRoomError, match="it was written to"):
        sb.simulate_to_file(system, sb.Integration(cycles=20), path=tmp_path / "disk" / "run.nc")
    assert os.listdir(tmp_path / "disk") == [] and len(os.listdir(kept)) == 1
    assert sb.load(next(kept.iterdir())).dataset.sizes["time"] > 100


LIMITED = """
import resource, sys
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[1]), int(sys.argv[1])))
from snapbeam.cli import main
from snapbeam.solver import native
native._SAMPLES = 4096
sys.argv = ["snapbeam", "simulate", "--modes", "1", "--cycles", "20000", "--set", "integration.early_termination=false",
            "--stream", "-o", "run.nc", "--quiet"]
main()
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="limits of POSIX")
@pytest.mark.parametrize(("limit", "kept"), [(6 * 2**20, True), (100_000, False)])
def test_a_limit_of_the_size_of_files(tmp_path, limit, kept):
    done = subprocess.run(
        [sys.executable, "-c", LIMITED, str(limit)], cwd=tmp_path, capture_output=True, text=True, timeout=300,
        env=os.environ | {"TMPDIR": str(tmp_path)},
    )  # fmt: skip
    assert done.returncode == 1 and "Traceback" not in done.stderr, done.stderr
    assert ("the disk is full" if kept else "File too large") in done.stderr
    assert os.listdir(tmp_path) == (["run.nc"] if kept else [])
    if kept:
        part = sb.load(tmp_path / "run.nc")
        assert part.final_state is not None and np.isfinite(part.dataset["midspan_displacement"]).all()


def test_memory_holds_only_what_the_disk_does_not(tmp_path):
    """The stream is a file of any content and order of writes, whatever part of it the disk takes."""
    rng = np.random.default_rng(6)
    for room in (0, 1, 70_000, 400_000, 2**30):
        with DiskStream(tmp_path / "a") as stream:
            stream._file = SmallDisk(stream._file, room)
            expected = bytearray()
            for _ in range(60):
                at, data = int(rng.integers(0, 500_000)), rng.bytes(int(rng.integers(1, 90_000)))
                stream.seek(at)
                assert stream.write(data) == len(data)
                expected.extend(bytes(max(0, at + len(data) - len(expected))))
                expected[at : at + len(data)] = data
                if rng.random() < 0.1:
                    stream.reserve(100_000)
                if rng.random() < 0.1:
                    end = int(rng.integers(0, 600_000))
                    stream.truncate(end)
                    del expected[end:]
                    expected.extend(bytes(end - len(expected)))
            stream.seek(0)
            assert stream.read() == bytes(expected)
            stream.settle()
            with (tmp_path / "b").open("wb") as file:
                stream.copy(file)
        assert (tmp_path / "b").read_bytes() == bytes(expected)
        assert (tmp_path / "a").stat().st_size == len(expected) or room < 2**30
    tracemalloc.start()
    with DiskStream(tmp_path / "large") as stream:
        stream.write(bytes(20 * 2**20))
        stream._file = SmallDisk(stream._file, 0)
        tracemalloc.reset_peak()
        before = tracemalloc.get_traced_memory()[0]
        stream.write(b"end")
        assert stream.trouble is not None and tracemalloc.get_traced_memory()[1] - before < 2**20
    tracemalloc.stop()
