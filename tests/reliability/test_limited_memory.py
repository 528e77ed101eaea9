"""Commands under a limit of memory: one line that says so, and no file that is not whole."""

from __future__ import annotations

import os
import re
import subprocess
import sys

import pytest

from snapbeam.util import memory_limit

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="limits of a process")

COMMANDS = {
    "help": ["map", "--help"],
    "run": ["simulate", "--modes", "1", "--cycles", "5", "-o", "a.nc", "--plot", "a.png"],
    "equilibria": ["equilibria", "--modes", "2"],
    "table": ["info", "run.nc"],
}


def limited(words, megabytes, folder, **variables):
    """The program under a limit of its address space."""
    code = (
        "import resource, sys; from snapbeam.__main__ import main; n = int(sys.argv.pop(1)); "
        "resource.setrlimit(resource.RLIMIT_AS, (n, n)); sys.argv[0] = 'snapbeam'; main()"
    )
    return subprocess.run(
        [sys.executable, "-c", code, str(megabytes * 10**6), *words], cwd=folder, capture_output=True, text=True,
        timeout=120, env={**os.environ, "OPENBLAS_NUM_THREADS": "2", **variables},
    )  # fmt: skip


@pytest.mark.sampled(4)
@pytest.mark.parametrize(
    "megabytes", [170, 290, 420, *(pytest.param(size, marks=pytest.mark.slow) for size in (230, 340, 520, 720))]
)
@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_without_memory_says_so_in_one_line(command, megabytes, tmp_path):
    done = limited(COMMANDS[command], megabytes, tmp_path)
    if command == "run":  # needs from 530 to 700 MB
        assert done.returncode == (megabytes < 700)
        assert done.returncode or sorted(os.listdir(tmp_path)) == ["a.nc", "a.png"]
    if done.returncode == 2:  # there was memory enough to find that run.nc does not exist
        assert command == "table" and "no such file" in done.stderr
    elif done.returncode:
        assert done.returncode == 1 and done.stderr.count("\n") == 1, done.stderr
        said = re.search(r"^error: the memory is not sufficient.*limited to (\d+) MB", done.stderr)
        assert said and int(said[1]) == megabytes and "needs about " in done.stderr, done.stderr
    assert [name for name in os.listdir(tmp_path) if name not in ("a.nc", "a.png")] == []


@pytest.mark.slow
def test_the_memory_that_is_named_suffices(tmp_path):
    words = COMMANDS["run"]
    said = limited(words, 300, tmp_path).stderr
    named = int(re.search(r"needs about (\d+) MB", said)[1])
    done = limited(words, named, tmp_path)
    assert done.returncode == 0, done.stderr
    assert sorted(os.listdir(tmp_path)) == ["a.nc", "a.png"]


def test_the_need_grows_with_the_threads(monkeypatch):
    monkeypatch.setattr(memory_limit, "_cores", lambda: 8)
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "1")
    one = memory_limit.sufficient()
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "none")
    monkeypatch.setenv("OMP_NUM_THREADS", "5")
    assert memory_limit.sufficient() > one + 4 * 60 * 10**6


def test_without_a_limit_nothing_is_said_of_one(monkeypatch):
    monkeypatch.setattr(memory_limit, "limit", lambda: float("inf"))
    assert memory_limit.not_sufficient("a word") == "the memory is not sufficient (a word)"


@pytest.mark.parametrize(
    "name, loaded, room", [("linalg", "special", 100), ("special", "linalg", 100), ("special", "", 400)]
)
def test_either_loader_of_scipys_blas_needs_room_once(monkeypatch, name, loaded, room):
    """Without it the library tries for ever to get memory."""
    for each in ("linalg", "special"):
        monkeypatch.delitem(sys.modules, f"scipy.{each}", raising=False)
    monkeypatch.setattr(memory_limit, "_used", lambda: 0)
    monkeypatch.setattr(memory_limit, "_blas_threads", lambda: 2)
    monkeypatch.setattr(memory_limit, "limit", lambda: 100 * 10**6)
    with pytest.raises(MemoryError):
        memory_limit._Room().find_spec(f"scipy.{name}", None)
    if loaded:
        monkeypatch.setitem(sys.modules, f"scipy.{loaded}", sys)
    monkeypatch.setattr(memory_limit, "limit", lambda: room * 10**6)
    assert memory_limit._Room().find_spec(f"scipy.{name}", None) is None
