"""What a page may ask for, and what becomes of work that fails, takes too long or is not wanted; without a browser."""

from __future__ import annotations

import ast
import threading
from pathlib import Path

import numpy as np
import pytest

import snapbeam as sb

pytest.importorskip("panel")

from snapbeam.explorer.jobs import CYCLES, MODES, SAMPLES, Cancelled, Jobs, Token, check_run, sample_times

ROOM = Path(sb.__file__).parent / "explorer"


class Asked:
    """A job and what came of it."""

    def __init__(self, jobs: Jobs, work, token: Token | None = None, kind: str = "run") -> None:
        self.ended, self.answers = threading.Event(), []
        self.token = Token() if token is None else token

        def done(result, words):
            self.answers.append((result, words))
            self.ended.set()

        getattr(jobs, kind)(work, done, self.token)

    def answer(self):
        """What came of it, or a failure if nothing did."""
        assert self.ended.wait(60)
        return self.answers[0]


@pytest.fixture
def jobs():
    found = Jobs()
    yield found
    found.close()


def test_runs_beyond_the_limits_are_refused_by_name(system):
    check_run(system, sb.Integration(cycles=CYCLES))
    with pytest.raises(
        sb.InputError, match=rf"integration\.cycles = {CYCLES + 1}: a page may ask for at most {CYCLES}"
    ):
        check_run(system, sb.Integration(cycles=CYCLES + 1))
    with pytest.raises(sb.InputError, match=str(MODES)):
        check_run(system.replace(**{"model.modes": MODES + 1}), sb.Integration(cycles=1))
    assert sample_times(system, sb.Integration(cycles=30)) is None
    times = sample_times(system, sb.Integration(cycles=CYCLES))
    assert times.size == SAMPLES
    frequency = system.striker.drive.frequency_ratio * system.model.reference_frequency
    np.testing.assert_allclose(np.diff(times), CYCLES / frequency / (SAMPLES - 1), rtol=1e-6)


def test_work_that_fails_says_so_and_the_next_is_done(jobs):
    def refused(_):
        raise sb.InputError("thickness = 0: must be positive")

    def broken(_):
        raise ZeroDivisionError("inside")

    assert Asked(jobs, refused).answer() == (None, "thickness = 0: must be positive")
    result, words = Asked(jobs, broken).answer()
    assert result is None and "this failed, which it should not: ZeroDivisionError: inside" in words
    assert Asked(jobs, lambda _: 7).answer() == (7, "")


def test_a_run_that_takes_too_long_is_given_up_but_a_compile_is_not_counted(jobs):
    token = Token(seconds=30.0)
    token.begun -= 100.0  # as if the compile had taken that long
    token.check(0.1)
    token.begun -= 31.0
    with pytest.raises(sb.InputError, match="given up after 30 s"):
        token.check(0.2)

    def slow(token):
        token.check(0.1)
        token.begun -= 100.0
        token.check(0.2)

    assert Asked(jobs, slow, Token(seconds=30.0)).answer() == (
        None,
        "given up after 30 s, the longest that a page may ask for",
    )


def test_what_is_not_wanted_any_more_is_not_told(jobs):
    begun, go = threading.Event(), threading.Event()

    def waits(token):
        begun.set()
        assert go.wait(60)
        token.check(0.5)

    asked = Asked(jobs, waits)
    assert begun.wait(60)
    asked.token.cancel()
    go.set()
    assert Asked(jobs, lambda _: 1).answer() == (1, "")
    assert not asked.answers
    with pytest.raises(Cancelled):
        asked.token.check()


def test_a_window_waits_while_a_run_is_computed(jobs):
    """What a person waits for comes first: a window's next batch begins when no run is left."""
    begun, go, order = threading.Event(), threading.Event(), []

    def run(_):
        begun.set()
        assert go.wait(60)
        order.append("run")

    def window(token):
        with jobs.turn(token):
            order.append("window")

    first = Asked(jobs, run)
    assert begun.wait(60)
    second = Asked(jobs, window, kind="window")
    assert not second.ended.wait(0.3) and not order
    go.set()
    first.answer()
    second.answer()
    assert order == ["run", "window"]


def test_nothing_that_is_typed_can_become_code():
    """No module of the explorer evaluates text, starts programs, unpickles, or opens files by a name."""
    forbidden = {"eval", "exec", "compile", "__import__", "open", "popen", "Popen"}
    for path in sorted(ROOM.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call):
                name = node.func.id if isinstance(node.func, ast.Name) else getattr(node.func, "attr", "")
                module = getattr(getattr(node.func, "value", None), "id", "")
                if (path.name, module, name) == ("cli.py", "webbrowser", "open"):
                    continue  # of the command, at an address of its own
                assert name not in forbidden and (module, name) != ("os", "system"), f"{path.name}: {name}"
            if isinstance(node, (ast.Import, ast.ImportFrom)):
                named = {alias.name for alias in node.names} | {getattr(node, "module", None)}
                assert not named & {"pickle", "subprocess", "shelve", "marshal"}, path.name
