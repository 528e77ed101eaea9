"""Outputs with names of any bytes, and outputs that cannot be written: a result is written, or refused before the work."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys

import pytest
from commands import run_commands

import snapbeam as sb
from snapbeam.util.files import check_writable
from snapbeam.util.provenance import command_line
from snapbeam.util.validation import InputError

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="names of any bytes, pipes with a name")

RUN = ["simulate", "--modes", "1", "--cycles", "3", "--quiet"]
MAP = ["map", "--modes", "1", "--cycles", "3", "--frequency-ratio", "1:1.2:2", "--velocity-amplitude", "0.1:0.2:2"]


def command(folder, *words):
    """Run a command, whose words may be bytes, in a process that is ended if it waits."""
    program = [sys.executable, "-m", "snapbeam", *words]
    return subprocess.run(program, cwd=folder, capture_output=True, timeout=300)


NAMED = [
    ([*RUN, "-o"], b"r\xe9sultat\xff.nc"),
    ([*RUN, "--plot"], b"\xff.pdf"),
    ([*MAP, "-o", "map.nc", "--checkpoint"], b"store\xff"),
]
ALSO_NAMED = [
    ([*RUN, "--stream", "-o"], b"s\xff.nc"),
    ([*RUN, "--plot"], b"\xff.svg"),
    ([*RUN, "--json"], b"\xff.json"),
    ([*MAP, "--log", "map.log", "-o"], b"m\xff.nc"),
    ([*MAP, "-o", "other.nc", "--log"], b"\xff.log"),
]


@pytest.mark.parametrize("named", [NAMED, ALSO_NAMED], ids=len)
@pytest.mark.slow
def test_names_of_any_bytes(tmp_path, tmp_path_factory, named):
    lines = [[*words, name] for words, name in named]
    modules = ("xarray", "dask.array", "h5netcdf", "pint", "snapbeam.cli.map", "snapbeam.plot.run")
    answers = run_commands(tmp_path, tmp_path_factory.mktemp("answers"), lines, modules=modules)
    for (words, name), done in zip(named, answers, strict=True):
        assert done.returncode == 0, done.stderr.decode("utf-8", "replace")
        if b"log" not in name:  # of a map that takes no time
            assert name in os.listdir(os.fsencode(tmp_path))
        if name.endswith(b".nc") and words[0] == "simulate":
            found = sb.load(os.fsdecode(os.path.join(os.fsencode(tmp_path), name)))
            assert r"\xff.nc" in found.dataset.attrs["command"] and found.summary.impacts >= 0


@pytest.mark.sampled(2)
@pytest.mark.parametrize("place", [b"a.json", b"-"])
def test_a_name_of_any_bytes_in_json(tmp_path, place):
    done = command(tmp_path, *RUN, "-o", b"\xff.nc", "--json", place)
    assert done.returncode == 0, done.stderr.decode("utf-8", "replace")
    text = done.stdout if place == b"-" else (tmp_path / "a.json").read_bytes()
    found = json.loads(text)["files"]
    assert found == ["\udcff.nc"] and os.path.exists(os.path.join(tmp_path, found[0]))


def test_a_command_is_text_whatever_its_bytes():
    argv = ["snapbeam", "--plot=/secret/gr\udcfc\udcdf.pdf", "müde.nc", "\udcff"]
    assert command_line(argv) == r"snapbeam --plot=gr\xfc\xdf.pdf müde.nc \xff"
    assert command_line(argv).encode("utf-8")


@pytest.mark.parametrize("kind", ["pipe", "pipe behind a link", "device", "socket"])
def test_only_regular_files_are_written(tmp_path, monkeypatch, kind):
    target = tmp_path / "out.nc"
    if kind == "device":
        target.symlink_to("/dev/null")
    elif kind == "socket":
        with socket.socket(socket.AF_UNIX) as opened:
            monkeypatch.chdir(tmp_path)  # the name of a socket is short
            opened.bind(target.name)
    else:
        made = target if kind == "pipe" else tmp_path / "made"
        os.mkfifo(made)
        if kind != "pipe":
            target.symlink_to(made)
    for appended in (False, True):
        with pytest.raises(InputError, match="must be a regular file"):
            check_writable(target, appended=appended)


@pytest.mark.slow
def test_commands_refuse_a_pipe_before_the_work(tmp_path, tmp_path_factory):
    lines = [
        [*RUN, "-o", "pipe.nc"],
        [*RUN, "--stream", "-o", "pipe.nc"],
        [*RUN, "--plot", "pipe.png"],
        [*RUN, "--animate", "pipe.gif"],
        [*RUN, "--json", "pipe.json"],
        [*MAP, "-o", "pipe.nc"],
        [*MAP, "--log", "pipe.log"],
        [*MAP, "-o", "map.nc", "--checkpoint", "pipe.store"],
    ]
    pipes = sorted({words[-1] for words in lines})
    for pipe in pipes:
        os.mkfifo(tmp_path / pipe)
    for done in run_commands(tmp_path, tmp_path_factory.mktemp("answers"), lines):
        assert done.returncode in (1, 2) and b"Traceback" not in done.stderr, done.stderr
        assert b"pipe" in done.stderr
    assert sorted(os.listdir(tmp_path)) == pipes


def test_the_standard_output_is_no_file(tmp_path):
    done = command(tmp_path, *RUN, "--json", "-")
    assert done.returncode == 0 and done.stdout.startswith(b"{")
