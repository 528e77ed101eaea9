"""Stored data of the paper are read as every other file: no link leads out of it."""

from __future__ import annotations

import h5py
import numpy as np
import pytest

from snapbeam.paper.store import load_results
from snapbeam.util.validation import InputError


def test_a_link_to_another_file_is_refused(tmp_path):
    with h5py.File(tmp_path / "other.nc", "w") as file:
        file["numbers"] = np.arange(8.0)
    with h5py.File(tmp_path / "results.nc", "w") as file:
        file["deep/out"] = h5py.ExternalLink(str(tmp_path / "other.nc"), "/numbers")
    with pytest.raises(InputError, match="link"):
        load_results(tmp_path / "results.nc")
