"""Files that a user gives cannot exhaust the machine: pipes, devices, large files and deep TOML keys are refused."""

from __future__ import annotations

import os

import pytest

from snapbeam import System
from snapbeam.model.parameter_file import load_config
from snapbeam.sweeps.measured_points import read_measured_points
from snapbeam.uncertainty.measurements import load_measurements
from snapbeam.util.input_files import input_bytes, parsed_toml
from snapbeam.util.validation import InputError

READERS = (load_config, System.load, read_measured_points, load_measurements)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes here")
@pytest.mark.parametrize("read", READERS)
def test_only_regular_files_are_read(read, tmp_path):
    pipe = tmp_path / "pipe.toml"
    os.mkfifo(pipe)
    for path in (pipe, "/dev/zero"):
        with pytest.raises(InputError, match="must be a regular file"):
            read(path)


def test_a_large_file_is_refused(tmp_path):
    path = tmp_path / "a.toml"
    path.write_bytes(b"#" * 1025)
    assert len(input_bytes("config", path, 1025)) == 1025
    with pytest.raises(InputError, match=r"config = .*a\.toml': must be at most 0\.000976562 MiB"):
        input_bytes("config", path, 1024)


def deep(parts: int) -> str:
    return ".".join("a" * parts)


@pytest.mark.parametrize(
    "text",
    [
        f"{deep(9)} = 1",
        f"[{deep(9)}]",
        f"[[{deep(9)}]]",
        deep(9).replace(".", " . ") + " = 1",
        deep(9).replace(".", "\t.") + " = 1",
        deep(9).replace("a", '"a"') + " = 1",
        deep(9).replace("a", "'.a'") + " = 1",
        f"x = {{{deep(9)} = 1}}",
        f'x = {{y = """a"""", {deep(9)} = 1}}',
        f"x = {{y = '''a''''', {deep(9)} = 1}}",
        f'x = {{y = """a\\"""", z = "\\\\", {deep(9)} = 1}}',
        f'x = {{y = "#", {deep(9)} = 1}}',
        f"x = {{y = '\\', {deep(9)} = 1}}",
    ],
)
def test_deep_keys_are_refused_before_they_are_parsed(text, monkeypatch):
    monkeypatch.setattr("tomllib.loads", lambda _: pytest.fail("it was parsed"))
    with pytest.raises(InputError, match="at most 8 parts"):
        parsed_toml(text, "config = 'a.toml'")


@pytest.mark.parametrize(
    ("text", "value"),
    [
        (f"{deep(8)} = 1", None),
        (f"x = '{deep(20)}'", deep(20)),
        (f'x = "{deep(20)}"', deep(20)),
        (f'x = """\n{deep(20)}"""', deep(20)),
        (f"x = 1 # {deep(20)}", 1),
        ("x = [" + "1.5, " * 20 + "]", [1.5] * 20),
    ],
)
def test_full_stops_in_values_and_comments_are_no_key(text, value):
    assert parsed_toml(text, "the file").get("x") == value


@pytest.mark.parametrize("text", ["[model\n", "x = " + "[" * 5000, "x = " + "1" * 5000])
def test_damaged_toml_is_refused_in_words(text):
    with pytest.raises(InputError, match=r"the file: (is no TOML|cannot be read)"):
        parsed_toml(text, "the file")
