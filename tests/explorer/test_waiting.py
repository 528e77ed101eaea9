"""A page says for how long one has waited; without a browser."""

from __future__ import annotations

import pytest

pytest.importorskip("panel")

from snapbeam.explorer.jobs import Waiting


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


def test_a_wait_is_told_every_second_until_it_ends():
    clock, told = Clock(), []
    waiting = Waiting(clock.later)
    mark = waiting.begin(0, told.append)
    clock.tick()
    clock.tick()
    assert told[1] >= told[0] >= 0.0 and waiting.waits(0, mark)
    waiting.end(0)
    clock.tick()
    assert len(told) == 2 and not clock.work and not waiting.waits(0, mark)


def test_a_wait_that_begins_anew_is_told_once():
    clock, told = Clock(), []
    waiting = Waiting(clock.later)
    for name in ("first", "second"):
        waiting.begin(0, lambda seconds, name=name: told.append(name))
    clock.tick()
    assert told == ["second"] and len(clock.work) == 1
