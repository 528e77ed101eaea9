"""Files of maps that would fill the memory or never end are refused by the explorer."""

from __future__ import annotations

import os
import sys

import h5py
import pytest

pytest.importorskip("panel")

from snapbeam.explorer.maps import opened
from snapbeam.util.validation import InputError


def test_a_map_that_fills_the_memory(tmp_path):
    path = tmp_path / "x.nc"
    with h5py.File(path, "w") as file:
        file.create_dataset("response_class", (2**33,), "f8", chunks=(2**20,))
    with pytest.raises(InputError, match="GiB of memory"):
        opened(path)


@pytest.mark.skipif(sys.platform == "win32", reason="named pipes and devices are those of POSIX")
@pytest.mark.parametrize("kind", ["pipe", "device"])
def test_only_regular_files_are_read(tmp_path, kind):
    path = tmp_path / "x.nc"
    os.mkfifo(path) if kind == "pipe" else path.symlink_to("/dev/zero")
    with pytest.raises(InputError):
        opened(path)
