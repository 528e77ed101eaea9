"""Text of strangers in messages: control characters escaped, lengths bounded, by one function."""

from __future__ import annotations

import pickle
import subprocess
import sys

import pytest
import xarray as xr

import snapbeam as sb
from snapbeam.model.parameter_file import checked_sections
from snapbeam.util.validation import printable

HOSTILE = "a\x1b[2J\x9b31m\x07\u202eb\udcff"
ESCAPED = r"a\x1b[2J\x9b31m\x07\u202eb\udcff"


def test_characters_that_control_a_terminal_are_escaped():
    assert printable(HOSTILE) == ESCAPED
    assert printable("µ ω\tä\n日本") == "µ ω\tä\n日本"
    assert len(printable("x" * 10**6)) == 8000


@pytest.mark.parametrize("kind", [sb.InputError, sb.InputTypeError])
def test_errors_of_input_escape_what_they_name(kind):
    error = pickle.loads(pickle.dumps(kind(f"{HOSTILE}: {'y' * 10**6}")))
    assert str(error).startswith(ESCAPED) and len(str(error)) < 10_000


@pytest.mark.parametrize(
    "sections",
    [{"beam": dict.fromkeys(map("key{}".format, range(50_000)), 1)}, {f"section{i}": {} for i in range(50_000)}],
)
def test_the_first_faults_of_many_are_listed(sections):
    _, lines = checked_sections(sections)
    assert len(lines) == 31 and lines[-1] == "more than 30 faults: these are the first"


@pytest.mark.slow
def test_info_shows_attributes_and_names_as_text(tmp_path):
    about = "b\x1b]0;title\x07[/bold][red]"
    data = xr.Dataset({"x[red]": ("n", [1.0], {"long_name": about, "units": "[/]"})}, attrs={"key[/]\x9b": about})
    sb.write_netcdf(data, tmp_path / "a[bold]\x1b.nc")
    command = [sys.executable, "-m", "snapbeam", "info", "a[bold]\x1b.nc"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert "\x1b" not in done.stdout and "\x07" not in done.stdout and "\x9b" not in done.stdout
    assert r"b\x1b]0;title\x07[/bold][red]" in done.stdout and r"a[bold]\x1b.nc" in done.stdout
    assert r"key[/]\x9b" in done.stdout and "x[red]" in done.stdout


@pytest.mark.slow
def test_a_missing_file_with_a_hostile_name(tmp_path):
    command = [sys.executable, "-m", "snapbeam", "info", "no\x1b[31m.nc"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert done.returncode == 2 and "\x1b" not in done.stderr and r"no\x1b[31m.nc" in done.stderr.replace("\\\\", "\\")
