"""Text that no file takes and folders that take no file: refused by name, before the work."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys

import pytest
import xarray as xr
from typer.testing import CliRunner

import snapbeam as sb
from snapbeam.cli.app import app
from snapbeam.model import default_values
from snapbeam.util.diagnostics import DiagnosticWarning
from snapbeam.util.files import missing_room

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
    [[b"simulate", b"--window", b"\xff", b"-o", b"a.nc"], [b"map", b"--initial-well", b"l\xff", b"-o", b"a.nc"]],
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


@pytest.fixture
def nearly_full(monkeypatch):
    """A disk that says that it has 40 kB."""
    kind = type(shutil.disk_usage("."))
    monkeypatch.setattr(shutil, "disk_usage", lambda _: kind(10**9, 10**9 - 40_000, 40_000))


@pytest.mark.parametrize(
    "words",
    [
        ["simulate", "--modes", "1", "--cycles", "200", "-o", "a.nc"],
        ["map", "--modes", "1", "--frequency-ratio", "0.3:2:60", "--velocity-amplitude", "0.1:0.2:60", "-o", "a.nc"],
    ],
    ids=["run", "map"],
)
def test_an_output_for_which_there_is_no_room_is_refused_first(nearly_full, tmp_path, monkeypatch, words):
    def computed(*_, **__):
        raise AssertionError("computed before the room was asked for")

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sb, "simulate", computed)
    monkeypatch.setattr("snapbeam.sweeps.compute._computed", computed)
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 2 and isinstance(done.exception, SystemExit), done.output
    said = " ".join(done.output.split())
    assert "output = 'a.nc': needs some" in said and "the disk has 0.04 MB" in said
    assert os.listdir(tmp_path) == []


def struck():
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=1)
    shaker = sb.Shaker(frequency_ratio=1.0, velocity_amplitude=0.3)
    return sb.System(model, contacts=[sb.Contact(default_values.CONTACT, shaker)])


def test_a_map_without_a_file_needs_no_room(nearly_full):
    found = sb.sweep(struck(), {"velocity_amplitude": [0.1, 0.2]}, sb.Integration(cycles=1))
    assert found.sizes["velocity_amplitude"] == 2


def test_a_streamed_run_says_that_it_will_be_stopped(nearly_full, tmp_path):
    words = r"path = .*needs some .*the run will be stopped where the disk is full"
    with pytest.warns(DiagnosticWarning, match=words):
        sb.simulate_to_file(struck(), sb.Integration(cycles=100), path=tmp_path / "a.nc")


def test_room_is_enough(tmp_path):
    assert missing_room(tmp_path / "folder" / "a.nc", 10) == ""
    assert "needs some 1e+18 MB" in missing_room(tmp_path / "folder" / "a.nc", 1e24)
