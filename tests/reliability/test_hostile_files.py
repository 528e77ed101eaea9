"""Files that others made: pipes, devices, sizes that fill the memory, descriptions that are right only in their hash."""

from __future__ import annotations

import json
import os
import shutil
import struct
import sys
import tracemalloc

import h5py
import numpy as np
import pytest
from google_crc32c import value as crc32c
from small_map import swept

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.util.provenance import parameter_hash
from snapbeam.util.validation import InputError

GIB = 2**30
posix = pytest.mark.skipif(sys.platform == "win32", reason="pipes and sparse files are POSIX here")


@pytest.fixture(scope="module")
def finished(tmp_path_factory, small):
    """A checkpoint of four tasks."""
    path = tmp_path_factory.mktemp("finished") / "store"
    swept(**small, path=path, points_per_task=6)
    return path


@pytest.fixture
def store(finished, tmp_path):
    """A copy of the checkpoint, to be damaged."""
    return shutil.copytree(finished, tmp_path / "store")


@pytest.fixture
def at_most():
    """Call a function, which may raise an error; its memory must stay below a limit."""

    def call(mebibytes, function, *arguments):
        tracemalloc.start()
        try:
            return function(*arguments)
        finally:
            peak = tracemalloc.get_traced_memory()[1]
            tracemalloc.stop()
            assert peak < mebibytes * 2**20

    return call


def frame(size, *, says_size):
    """A Zstandard frame of zeros: 4 bytes for each 128 KiB of contents."""
    header = struct.pack("<IBQ", 0xFD2FB528, 0xE0, size) if says_size else struct.pack("<IBB", 0xFD2FB528, 0, 0x58)
    block = 2**17
    blocks = [((block << 3) | (1 << 1)).to_bytes(3, "little") + b"\0"] * (size // block)
    last = blocks[-1]
    blocks[-1] = bytes([last[0] | 1]) + last[1:]
    data = header + b"".join(blocks)
    return data + struct.pack("<I", crc32c(data))


CHUNKS = {
    "zeros of 1 GiB": lambda file: file.write_bytes(frame(GIB, says_size=True)),
    "zeros of unstated size": lambda file: file.write_bytes(frame(GIB, says_size=False)),
    "a sparse file of 1 GiB": lambda file: os.truncate(file, GIB),
}


@pytest.mark.slow
@posix
@pytest.mark.parametrize("which", [1, 3])  # the last task is shorter than a chunk
@pytest.mark.parametrize("name", list(CHUNKS))
def test_chunks_that_fill_the_memory(store, small, at_most, tried, name, which):
    """Damaged for whoever reads the checkpoint; computed again by whoever resumes it."""
    file = store / f"runs.zarr/base/numbers/c.{which}.0"
    CHUNKS[name](file)
    found = at_most(100, sb.read_checkpoint, store)
    assert found.attrs["points_done"] == 20 - (6 if which == 1 else 2)
    report = sb.SweepReport()
    at_most(100, lambda: swept(**small, path=store, report=report))
    assert report.damaged == [("base", which)] and report.computed == 1
    assert sb.read_checkpoint(store).attrs["points_done"] == 20
    tried("hostile files of a checkpoint")


@pytest.mark.parametrize("change", [{"codecs": [{"name": "bytes"}]}, {"shape": [10**9, 8]}, {"data_type": "string"}])
def test_foreign_descriptions_of_arrays_are_not_used(store, tried, change):
    file = store / "runs.zarr/base/numbers/zarr.json"
    file.write_text(json.dumps(json.loads(file.read_text(encoding="utf-8")) | change), encoding="utf-8")
    assert sb.read_checkpoint(store).attrs["points_done"] == 20
    tried("hostile files of a checkpoint")


@posix
@pytest.mark.parametrize("name", ["map.json", "tasks.jsonl", "lock", "runs.zarr/base/integers/c.2.0", "more"])
def test_pipes_in_a_checkpoint(store, small, tried, name):
    (store / name).unlink(missing_ok=True)
    os.mkfifo(store / name)
    words = "link or not a plain file|not the folder of a sweep|cannot be checked|cannot be written"
    for call in (lambda: sb.read_checkpoint(store), lambda: swept(**small, path=store)):
        with pytest.raises((InputError, sb.CheckpointError), match=words):
            call()
    tried("hostile files of a checkpoint")


@posix
def test_a_task_log_that_fills_the_memory(store, small, tried):
    os.truncate(store / "tasks.jsonl", 2 * GIB)
    for call in (lambda: sb.read_checkpoint(store), lambda: swept(**small, path=store)):
        with pytest.raises(InputError, match="larger than 1 GiB"):
            call()
    tried("hostile files of a checkpoint")


def changed(place, value):
    """A change of one value of a description."""

    def change(held):
        *path, last = place
        inside = held
        for name in path:
            inside = inside[name]
        inside[last] = value

    return change


RATIO, VELOCITY = "drive.frequency_ratio", "drive.velocity_amplitude"
DESCRIPTIONS = {
    "no parameters": changed(["parameters"], {}),
    "a system that is a list": changed(["parameters", "system"], [1, 2]),
    "a system of numbers": changed(["parameters", "system"], {"beam": 3}),
    "an integration that is a number": changed(["parameters", "integration"], 7),
    "unknown settings": changed(["parameters", "integration"], {"a": 1}),
    "points that are a list": changed(["parameters", "points"], [1]),
    "points of words": changed(["parameters", "points", RATIO], ["a", "b"]),
    "ragged points": changed(["parameters", "points", RATIO], [[1.0], [1.0, 2.0]]),
    "no axes": changed(["axes"], 3),
    "unknown axes": changed(["axes"], ["a", {}]),
    "earlier sweeps that are a number": changed(["grown"], 3),
    "earlier sweeps without axes": changed(["grown"], [{"points": {}}]),
    "an earlier sweep of other points": changed(
        ["grown"], [{"axes": [RATIO, VELOCITY], "points": {RATIO: [7.0], VELOCITY: [9.0]}}]
    ),
    "an earlier sweep of one point many times": changed(
        ["grown"], [{"axes": [RATIO, VELOCITY], "points": {RATIO: [0.8] * 10**4, VELOCITY: [0.05] * 10**4}}]
    ),
    "tasks of no size": changed(["points_per_task"], 10**30),
    "repeats that are a word": changed(["parameters", "replicates"], "many"),
    "a million modes": changed(["parameters", "system", "model", "modes"], 10**6),
    "lists in lists": changed(["parameters", "system", "beam"], json.loads("[" * 400 + "]" * 400)),
}


@pytest.mark.parametrize("name", list(DESCRIPTIONS))
def test_descriptions_with_a_right_hash(store, small, at_most, tried, name):
    """The hash finds damage; whoever writes a description can compute it."""
    file = store / "map.json"
    held = json.loads(file.read_text(encoding="utf-8"))
    DESCRIPTIONS[name](held)
    held["parameter_hash"] = parameter_hash(held["parameters"])
    file.write_text(json.dumps(held), encoding="utf-8")
    with pytest.raises((InputError, sb.CheckpointError)):
        at_most(300, sb.read_checkpoint, store)
    try:
        at_most(300, lambda: swept(**small, path=store))
    except (InputError, sb.CheckpointError):
        tried("hostile descriptions of a checkpoint refused")
    else:
        assert name in ("no axes", "unknown axes")  # not needed by who gives them in the request


def test_a_checkpoint_of_too_many_points(store, tried):
    """20,000 numbers describe 10^8 points."""
    file = store / "map.json"
    held = json.loads(file.read_text(encoding="utf-8"))
    held["parameters"]["points"] = {name: np.linspace(0.1, 0.6, 10_000).tolist() for name in (RATIO, VELOCITY)}
    held["parameter_hash"] = parameter_hash(held["parameters"])
    file.write_text(json.dumps(held), encoding="utf-8")
    with pytest.raises(InputError, match=r"100000000 points would take 65\.2 GiB"):
        sb.read_checkpoint(store)
    tried("hostile descriptions of a checkpoint refused")


# ----------------------------------------------------------------------------------------------------


def fill(file):
    """A variable of 64 GiB of fill values."""
    file.create_dataset("a", (2**16, 2**17), "f8", chunks=(2**8, 2**8))


def compressed(file):
    """A variable of 6 GiB, of which a part is written: 1 kB for each MiB."""
    made = file.create_dataset("a", (6 * 2**10, 2**17), "f8", chunks=(1, 2**17), compression="gzip")
    made[:4] = 0.0


def axis(file):
    """A coordinate, which is read when the file is opened."""
    scale = file.create_dataset("time", (2**34,), "f4", chunks=(2**20,))
    scale.make_scale("time")


def group(file):
    """A variable of a group."""
    fill(file.create_group("impacts"))


def texts(file):
    """A million texts."""
    file.create_dataset("a", (10**6,), h5py.string_dtype(), chunks=(2**16,))


@pytest.mark.parametrize("make", [fill, compressed, axis, group, texts], ids=lambda make: make.__name__)
def test_hdf5_files_that_fill_the_memory(tmp_path, at_most, tried, make):
    """Refused as a run."""
    path = tmp_path / "x.nc"
    with h5py.File(path, "w") as file:
        make(file)
    assert path.stat().st_size < 10**6
    with pytest.raises(InputError, match=r"GiB of memory|has more than 100000 texts"):
        at_most(100, sb.load, path)
    tried("NetCDF files that would fill the memory")


def test_the_limit_follows_the_size_of_the_file(tmp_path, monkeypatch):
    """Stored numbers are read however many they are."""
    monkeypatch.setattr("snapbeam.util.input_files.LARGEST_CONTENT", 1000)
    system = sb.System(
        sb.ReducedModel.from_beam(default_values.BEAM, modes=1),
        contacts=[sb.Contact(default_values.CONTACT, sb.Shaker(frequency_ratio=1.0, velocity_amplitude=0.3))],
    )  # fmt: skip
    run = sb.simulate(system, sb.Integration(cycles=1))
    run.save(tmp_path / "run.nc")
    assert sb.load(tmp_path / "run.nc").dataset.nbytes > 1000


# ----------------------------------------------------------------------------------------------------


@posix
@pytest.mark.parametrize("kind", ["pipe", "device"])
@pytest.mark.parametrize("suffix", [".toml", ".csv", ".nc"])
def test_only_regular_files_are_read(tmp_path, tried, kind, suffix):
    """Where a path is read: a pipe would be waited for without end, /dev/zero is read without end."""
    from snapbeam.model.parameter_file import load_config

    path = tmp_path / f"x{suffix}"
    os.mkfifo(path) if kind == "pipe" else path.symlink_to("/dev/zero")
    for call in (load_config, sb.load, sb.System.load):
        with pytest.raises(InputError):
            call(path)
        tried("pipes and devices in place of files")
