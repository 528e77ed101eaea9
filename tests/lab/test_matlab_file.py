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
