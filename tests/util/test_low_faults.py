"""Inputs at the edge of what is allowed: an error of input that names them, and no other error."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model.imperfection import perfect_equilibria
from snapbeam.util.status_codes import wells_of


@pytest.mark.parametrize("wells", [np.zeros(0), [1, 2], "two", 3, np.nan, 1.5, np.array(["1"])])
def test_an_attribute_that_counts_no_wells(wells):
    with pytest.raises(sb.InputError, match=r"attribute wells = .*must be 1 or 2"):
        wells_of({"wells": wells})


def test_attributes_that_count_wells():
    assert [wells_of({}), wells_of({"wells": np.int64(1)}), wells_of({"wells": np.array([2])})] == [2, 1, 2]


@pytest.mark.parametrize(("kappa", "gamma"), [(-1e200, 1e-200), (-1e180, 1.0), (-1.0, 5e-324)])
def test_equilibria_beyond_the_range_of_numbers(kappa, gamma):
    with pytest.raises(sb.InputError, match="the equilibria are no finite numbers"):
        perfect_equilibria(np.array([kappa]), gamma)


def test_equilibria_inside_the_range_of_numbers():
    lowest = perfect_equilibria(np.array([-4.0]), 2.0)[0]
    assert lowest.energy == -2.0 and abs(lowest.amplitude[0]) == np.sqrt(2.0)


def test_a_video_whose_codec_is_not_known(tmp_path):
    pytest.importorskip("av")
    lab = pytest.importorskip("snapbeam.lab")

    path = lab.write_video(tmp_path / "a.avi", np.zeros((3, 32, 32), np.uint8))
    data = path.read_bytes()
    assert data.count(b"FFV1")
    path.write_bytes(data.replace(b"FFV1", b"ZZZ9"))
    with pytest.raises(sb.InputError, match="codec that is not known here"):
        lab.open_recording(path, frame_rate=1e4, pixel_size=1e-5)


def test_output_in_ascii(tmp_path):
    environment = os.environ | {"PYTHONIOENCODING": "ascii", "PYTHONUTF8": "0"}
    done = subprocess.run(
        [sys.executable, "-m", "snapbeam", "equilibria"],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        timeout=120,
    )
    assert done.returncode == 0 and b"Traceback" not in done.stderr, done.stderr
    assert rb"\xb5" in done.stdout
