"""Files with headers of great length, and files that refer to other files."""

from __future__ import annotations

import time

import h5py
import numpy as np
import pytest

from snapbeam.lab.camera import open_recording
from snapbeam.lab.signal_files import read_signal
from snapbeam.lab.signal_formats import header_values, split_unit
from snapbeam.util.validation import InputError


@pytest.mark.parametrize("kind", ["external", "virtual"])
def test_hdf5_files_that_read_other_files_are_refused(tmp_path, kind):
    """Storage elsewhere, or a view of another file, would make any file of the machine a signal."""
    secret = tmp_path / "secret"
    np.arange(8.0).tofile(secret)
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["signal"] = np.arange(8.0)
    with h5py.File(tmp_path / "signal.h5", "w") as file:
        if kind == "external":
            made = file.create_dataset("signal", (8,), "f8", external=[(str(secret), 0, 64)])
        else:
            layout = h5py.VirtualLayout((8,), "f8")
            layout[:] = h5py.VirtualSource(str(tmp_path / "other.h5"), "signal", (8,))
            made = file.create_virtual_dataset("signal", layout)
            made = file["signal"]
        made.attrs["units"] = "m/s"
        made.attrs["sampling_rate"] = 100.0
    with pytest.raises(InputError, match="has its numbers in another file"):
        read_signal(tmp_path / "signal.h5")


def test_recordings_in_other_files_are_refused(tmp_path):
    secret = tmp_path / "secret"
    secret.write_bytes(bytes(4 * 64 * 64))
    with h5py.File(tmp_path / "stack.h5", "w") as file:
        file.create_dataset("frames", (4, 64, 64), "u1", external=[(str(secret), 0, 4 * 64 * 64)])
    with pytest.raises(InputError, match="in another file"):
        open_recording(tmp_path / "stack.h5", frame_rate=1e4, pixel_size=1e-5)


def test_long_headers_are_no_trap():
    """The patterns that take a header apart need a time that goes with the square of its length."""
    start = time.process_time()
    assert split_unit("[" * 60_000) == ("[" * 60_000, None)
    assert header_values(["a" * 60_000 + ":", " " * 60_000, "rate: 5"]) == {"rate": "5"}
    assert time.process_time() - start < 1.0
