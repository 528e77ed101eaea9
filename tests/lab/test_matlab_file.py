"""MATLAB files whose damage ends the process that reads them: refused by name."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from scipy.io import savemat

from snapbeam.lab import matlab_file, read_channels
from snapbeam.util.validation import InputError

VELOCITY = np.arange(5.0)


@pytest.fixture
def path(tmp_path):
    place = tmp_path / "structure.mat"
    savemat(place, {"s": {"time": np.arange(5.0) / 1e3, "v": VELOCITY, "units": "m/s"}})
    return place


def test_a_structure_is_read(path):
    (channel,) = read_channels(path)
    assert (channel["name"], channel["unit_str"]) == ("s/v", "m/s")
    assert np.array_equal(channel["data"], VELOCITY)


@pytest.mark.parametrize("at, byte", [(144, 5), (232, 5), (264, 0), (329, 255)])
def test_damage_that_crashes_the_reader(path, at, byte):
    """The bytes are tags of the elements: their kinds and lengths."""
    content = bytearray(path.read_bytes())
    content[at] = byte
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"structure\.mat"):
        read_channels(path)


def test_a_reader_that_crashes_is_named(path, monkeypatch):
    crash = [sys.executable, "-c", "import os; os.abort()"]
    run = subprocess.run
    monkeypatch.setattr(matlab_file.subprocess, "run", lambda command, **options: run(crash, **options))
    with pytest.raises(InputError, match=r"structure\.mat: is damaged: its reader crashed"):
        read_channels(path)


def test_a_reader_that_does_not_end(path, monkeypatch):
    endless = [sys.executable, "-c", "while True: pass"]
    run = subprocess.run
    monkeypatch.setattr(matlab_file.subprocess, "run", lambda command, **options: run(endless, **options))
    monkeypatch.setattr(matlab_file, "_LONGEST", 0.5)
    with pytest.raises(InputError, match=r"structure\.mat: is damaged: its reader did not end"):
        read_channels(path)


@pytest.mark.skipif(sys.platform == "win32", reason="limits of a process")
@pytest.mark.slow
@pytest.mark.parametrize("rows, columns", [(-22, 1), (-1, 22)])
def test_sizes_of_version_4_that_lead_back(tmp_path, rows, columns):
    """The header of 20 bytes and the name of 2 are followed by -22 bytes, which SciPy reads without end."""
    place = tmp_path / "four.mat"
    place.write_bytes(np.array([50, rows, columns, 0, 2], "<i4").tobytes() + b"a" + bytes(101))
    with pytest.raises(InputError, match=r"four\.mat: is damaged: its reader did not end within 7 s of processor time"):
        read_channels(place)


@pytest.mark.parametrize("kind, fields", [(1, b""), (2, b"\x05\0\x04\0\x20\0\0\0\x01\0\0\0\0\0\0\0")])
def test_cells_and_structures_of_billions_of_elements(tmp_path, kind, fields):
    """A structure without a field takes none of the file."""

    def element(tag, content):
        return np.array([tag, len(content)], "<u4").tobytes() + content + bytes(-len(content) % 8)

    flags, shape = np.array([kind, 0], "<u4").tobytes(), np.array([2**31 - 1, 1], "<i4").tobytes()
    matrix = element(6, flags) + element(5, shape) + element(1, b"a") + fields
    place = tmp_path / "many.mat"
    place.write_bytes(b"MATLAB 5.0 MAT-file".ljust(124, b"\0") + b"\0\x01IM" + element(14, matrix))
    with pytest.raises(InputError, match=r"many\.mat.*would take 16 GiB of memory"):
        read_channels(place)
