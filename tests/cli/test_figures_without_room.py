"""Figures and animations for which the disk has no room: refused before the work; if they fail after it, nothing is lost."""

from __future__ import annotations

import errno
import os
import re
import shlex
import shutil
import tempfile

import pytest
from typer.testing import CliRunner

import snapbeam as sb
from snapbeam.cli.app import app
from snapbeam.cli.console import _LEAST_SIZES

RUN = ["simulate", "--modes", "1", "--cycles", "3"]
BACKBONE = ["dynamics", "backbone-curve", "--modes", "1", "--max-points", "4"]


def with_free(monkeypatch, free):
    kind = type(shutil.disk_usage("."))
    monkeypatch.setattr(shutil, "disk_usage", lambda _: kind(10**9, 10**9 - free, free))


def said(done):
    return " ".join(done.output.split())


@pytest.mark.parametrize("name", ["a.png", "a.pdf", "a.svg", "a.gif", "a.mp4"])
def test_a_figure_without_room_is_refused_before_the_run(name, monkeypatch, tmp_path):
    def computed(*_, **__):
        raise AssertionError("computed before the room was asked for")

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sb, "simulate", computed)
    with_free(monkeypatch, 7_000)
    option = "--animate" if name.endswith(("gif", "mp4")) else "--plot"
    done = CliRunner().invoke(app, [*RUN, option, name])
    if "needs the extra" in said(done) or "install" in said(done):
        pytest.skip("no writer of videos")
    assert done.exit_code == 2 and f"{option[2:]} = '{name}': needs some" in said(done), done.output
    assert os.listdir(tmp_path) == []


def test_files_of_one_disk_need_room_together(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    with_free(monkeypatch, 36_000)
    done = CliRunner().invoke(app, [*RUN, "--plot", "a.png", "--samples", "20", "-o", "a.nc"])
    assert done.exit_code == 2 and "on the same disk" in said(done), done.output
    with_free(monkeypatch, 40_000)
    done = CliRunner().invoke(app, [*RUN, "--plot", "a.png", "--samples", "20", "-o", "a.nc"])
    assert done.exit_code == 0, done.output


def test_other_commands_ask_for_room_too(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    with_free(monkeypatch, 9_000)
    for words in (
        BACKBONE,
        ["map", "--modes", "1"],
        ["equilibria", "--force-displacement", "--modes", "1"],
        ["threshold", "--modes", "1"],
    ):
        done = CliRunner().invoke(app, [*words, "--plot", "a.png"])
        assert done.exit_code == 2 and "plot = 'a.png': needs some 0.035 MB" in said(done), done.output


@pytest.mark.slow
def test_no_figure_is_smaller_than_its_estimate(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    for suffix in (".png", ".pdf", ".svg"):
        CliRunner().invoke(app, [*RUN, "--plot", f"a{suffix}"])
        CliRunner().invoke(app, [*BACKBONE, "--plot", f"b{suffix}", "-o", f"{suffix[1:]}.nc"])
        for name in "ab":
            assert os.path.getsize(f"{name}{suffix}") > 1.3 * _LEAST_SIZES[suffix]


@pytest.fixture
def full(monkeypatch, tmp_path):
    """Every figure and animation fails as on a full disk."""

    def failed(*_, **__):
        raise OSError(errno.ENOSPC, "No space left on device", "a.png")

    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "elsewhere"))
    with monkeypatch.context() as patched:
        patched.setattr("snapbeam.plot.style.save_figure", failed)
        patched.setattr("snapbeam.plot.animation.animate_run", failed)
        yield patched


@pytest.mark.sampled(2)
@pytest.mark.parametrize("words", [RUN, BACKBONE], ids=["run", "curve"])
def test_a_figure_that_fails_leaves_the_numbers(full, words, tmp_path):
    done = CliRunner().invoke(app, [*words, "--plot", "a.png", "-o", "it is.nc"])
    assert done.exit_code == 1 and "No space left on device" in said(done), done.output
    assert os.listdir("../elsewhere") == []
    command = re.search(r"The numbers are in 'it is.nc'; draw them with: (.*)$", said(done))[1]
    full.undo()
    os.chdir(tmp_path / "here")
    assert CliRunner().invoke(app, shlex.split(command)[1:]).exit_code == 0
    assert sorted(os.listdir()) == ["a.png", "it is.nc"]


@pytest.mark.sampled(2)
@pytest.mark.parametrize("option", ["--plot", "--animate"])
def test_numbers_that_are_in_no_file_are_saved(full, option, tmp_path):
    name = "a.png" if option == "--plot" else "a.gif"
    done = CliRunner().invoke(app, [*RUN, option, name, "--window", "1:2"])
    assert done.exit_code == 1, done.output
    (file,) = (tmp_path / "elsewhere").iterdir()
    assert sb.load(file).summary.status == sb.RunStatus.OK
    command = re.search(r"draw them with: (.*)$", said(done))[1]
    assert str(file) in command and ("1:2" in command or "(1.0, 2.0)" in command)
    full.undo()
    os.chdir(tmp_path / "here")
    if option == "--plot":
        assert CliRunner().invoke(app, shlex.split(command)[1:]).exit_code == 0
        assert os.listdir() == ["a.png"]
    else:
        drawn = []
        full.setattr("snapbeam.plot.animation.write_frames", lambda frames, path, **_: drawn.append(path))
        python, option, code = shlex.split(command)
        assert (python, option) == ("python", "-c")
        exec(code)
        assert [str(path) for path in drawn] == ["a.gif"]


def test_a_figure_that_is_refused_leaves_the_numbers(full, tmp_path):
    full.undo()
    os.chdir(tmp_path / "here")
    done = CliRunner().invoke(app, [*RUN, "--plot", "a.png", "-o", "a.nc", "--window", "50:60"])
    if done.exit_code:
        assert done.exit_code == 2 and "The numbers are in 'a.nc'" in said(done), done.output
        assert "draw them with" not in said(done)
    assert os.path.exists("a.nc")
