"""Signals and recordings that would fill the memory or never end are refused."""

from __future__ import annotations

import os
import sys
import tracemalloc

import h5py
import pytest

from snapbeam import lab
from snapbeam.lab.image_sources import load_image, open_source
from snapbeam.lab.photron import read_fields
from snapbeam.sweeps.measured_points import read_measured_points
from snapbeam.util.validation import InputError


@pytest.mark.parametrize("suffix", [".h5", ".mat"])
def test_signals_that_fill_the_memory(tmp_path, suffix):
    path = tmp_path / f"x{suffix}"
    with h5py.File(path, "w") as file:
        file.create_dataset("a", (2**33,), "f8", chunks=(2**20,)).attrs["units"] = "m/s"
    tracemalloc.start()
    try:
        with pytest.raises(InputError, match="would take 64 GiB of memory"):
            lab.read_channels(path, 1e3)
        assert tracemalloc.get_traced_memory()[1] < 100 * 2**20
    finally:
        tracemalloc.stop()


@pytest.mark.skipif(sys.platform == "win32", reason="named pipes and devices are those of POSIX")
@pytest.mark.parametrize("kind", ["pipe", "device"])
@pytest.mark.parametrize("suffix", [".csv", ".wav", ".npy", ".cih", ".cihx", ".mraw", ".tif", ".mp4"])
def test_only_regular_files_are_read(tmp_path, kind, suffix):
    """A pipe would be waited for without end, /dev/zero is read without end."""
    path = tmp_path / f"x{suffix}"
    os.mkfifo(path) if kind == "pipe" else path.symlink_to("/dev/zero")
    for call in (open_source, load_image, read_fields, lab.read_channels, read_measured_points):
        with pytest.raises(InputError):
            call(path)
