"""Files of signals that reach for other files."""

from __future__ import annotations

import h5py
import numpy as np
import pytest

from snapbeam.lab.signal_files import read_signal
from snapbeam.util.validation import InputError


@pytest.mark.parametrize("kind", ["external", "virtual"])
def test_hdf5_files_that_read_other_files_are_refused(tmp_path, tried, kind):
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
    tried("files that reach for other files")
    with pytest.raises(InputError, match="has its numbers in another file"):
        read_signal(tmp_path / "signal.h5")
