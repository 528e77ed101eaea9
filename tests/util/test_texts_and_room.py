"""Text that no file takes and folders that take no file: refused by name, before the work."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest
import xarray as xr

import snapbeam as sb

LONE = "b\udcff\ud800"


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (xr.Dataset(attrs={"operator": LONE}), r"attrs\['operator'\] = "),
        (xr.Dataset(attrs={LONE: "a"}), "attrs: key = "),
        (xr.Dataset(attrs={"names": ["a", LONE]}), r"attrs\['names'\] = "),
        (xr.Dataset({"gap": ("n", [1.0], {"units": LONE})}), r"gap.attrs\['units'\] = "),
        (xr.Dataset({LONE: ("n", [1.0])}), "name = "),
    ],
)
def test_attributes_that_are_no_text_are_refused_by_name(tmp_path, data, words):
    with pytest.raises(sb.InputError, match=f"{words}.*must be text that UTF-8 can encode"):
        sb.write_netcdf(data, tmp_path / "a.nc")
    assert os.listdir(tmp_path) == []


@pytest.mark.skipif(sys.platform != "linux", reason="arguments of any bytes, limits of a process")
@pytest.mark.parametrize(
    "words",
    [
        [b"simulate", b"--window", b"\xff", b"-o", b"a.nc"],
        [b"map", b"--initial-well", b"l\xff", b"-o", b"a.nc"],
    ],
)
def test_arguments_that_are_no_text_are_refused_by_name(tmp_path, words):
    command = [sys.executable, "-m", "snapbeam", *words]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, timeout=120)
    assert done.returncode == 2 and b"Traceback" not in done.stderr, done.stderr
    assert b"must be text that UTF-8 can encode" in done.stderr and os.listdir(tmp_path) == []


FULL = """
import resource, signal, sys
from snapbeam.util.files import check_writable
from snapbeam.util.validation import InputError
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))
try:
    check_writable(sys.argv[1])
except InputError as error:
    print(error)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="arguments of any bytes, limits of a process")
def test_a_folder_that_takes_no_content_is_refused(tmp_path):
    command = [sys.executable, "-c", FULL, str(tmp_path / "a.nc")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert "output = " in done.stdout and "cannot be written" in done.stdout, done.stderr
    assert os.listdir(tmp_path) == []
