"""What is said while one waits: the seconds, and that the engine is compiled; without a browser but for the last."""

from __future__ import annotations

import logging

import pytest

pytest.importorskip("panel")

from snapbeam.explorer.jobs import Compiling, Waiting


class Clock:
    """Work that is to be done later, done when a test says so."""

    def __init__(self) -> None:
        self.work: list = []

    def later(self, work, milliseconds: int) -> None:
        assert milliseconds > 0
        self.work.append(work)

    def tick(self) -> None:
        due, self.work = self.work, []
        for each in due:
            each()


@pytest.fixture
def heard():
    found = Compiling()
    yield found
    found.close()


def test_a_wait_is_told_every_second_until_it_ends(heard):
    clock, told = Clock(), []
    waiting = Waiting(heard, clock.later)
    waiting.begin(0, lambda seconds, words: told.append((seconds, words)))
    clock.tick()
    logging.getLogger("snapbeam").info("compiling integrate, once on this machine")
    clock.tick()
    assert [words for _, words in told] == ["", "compiling integrate, once on this machine"]
    assert told[1][0] >= told[0][0] >= 0.0
    waiting.end(0)
    assert heard.words == "", "what was computed is compiled"
    clock.tick()
    assert len(told) == 2 and not clock.work


def test_a_wait_that_begins_anew_is_told_once(heard):
    clock, told = Clock(), []
    waiting = Waiting(heard, clock.later)
    for name in ("first", "second"):
        waiting.begin(0, lambda seconds, words, name=name: told.append(name))
    clock.tick()
    assert told == ["second"] and len(clock.work) == 1
    heard.words = "compiling"
    waiting.end(0, computed=False)
    assert heard.words == "compiling", "nothing was computed: it goes on"


def test_the_log_is_left_as_it_was():
    log = logging.getLogger("snapbeam")
    before = log.level, list(log.handlers)
    Compiling().close()
    assert (log.level, log.handlers) == before


@pytest.mark.slow
def test_the_first_run_of_a_machine_says_that_it_compiles(tab, serve, small_map, tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    page = tab(serve("map.nc").url)
    page.click(float(small_map.frequency_ratio[5]), float(small_map.velocity_amplitude[9]))
    page.wait(lambda: "compiling" in page.head() and " s " in page.head(), "words for the compile")
    page.wait(lambda: "bitwise identical" in page.notes(), "the run")
    assert "compiling" not in page.head()
