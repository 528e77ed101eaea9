"""A page that is made before it is asked for is given once, to who may have it, and is the page they would have got."""

from __future__ import annotations

import inspect
import re
import urllib.request
from types import SimpleNamespace

import pytest

import snapbeam.explorer.ready as ready_module
from snapbeam.explorer.limits import SESSIONS
from snapbeam.explorer.ready import Ready


class Session:
    """As Bokeh's, as far as it matters."""

    def __init__(self, token):
        self.token, self.blocked, self.connection_count = token, 0, 0

    def block_expiration(self):
        self.blocked += 1

    def unblock_expiration(self):
        self.blocked -= 1


class Loop:
    """Remembers what is to be done later."""

    def __init__(self):
        self.todo = []

    def call_later(self, delay, work, *arguments):
        self.todo.append((delay, work, arguments))

    def run(self):
        """Do what is there now."""
        todo, self.todo = self.todo, []
        for _, work, arguments in todo:
            found = work(*arguments)
            if inspect.iscoroutine(found):
                with pytest.raises(
                    StopIteration
                ):  # it awaits nothing that takes time; a browser's test has its own loop
                    found.send(None)


class Context:
    """Makes sessions."""

    def __init__(self):
        self.made = []

    async def create_session_if_needed(self, name, request, token):
        self.made.append((name, Session(token)))
        return self.made[-1][1]


@pytest.fixture
def ready():
    loop, context = Loop(), Context()
    shared = SimpleNamespace(pages=0, rests=lambda seconds: True)
    made = Ready(loop, context, shared)
    made.begin()
    loop.run()
    assert len(context.made) == 1
    return SimpleNamespace(ready=made, loop=loop, context=context, shared=shared)


def test_it_is_given_once_and_another_is_made(ready):
    first = ready.ready.take({})
    assert first is ready.context.made[0][1] and first.blocked == 1
    assert ready.ready.take({"token": [b"x"]}) is None
    ready.loop.run()
    second = ready.ready.take({})
    assert second is not None and second is not first
    names = [name for name, _ in ready.context.made]
    assert len(set(names)) == len(names), "nobody shares a page"


def test_who_wishes_something_has_a_page_made(ready):
    assert ready.ready.take({"at": [b"drive.frequency_ratio:1.0"]}) is None
    assert ready.ready.take({"theme": [b"dark"]}) is None, "the one that waits is light"
    ready.loop.run()
    assert ready.ready.take({"theme": [b"dark"]}) is not None, "the next is as the last that was asked for"


def test_an_old_one_is_not_given(ready, monkeypatch):
    monkeypatch.setattr(ready_module, "_FRESH", -1.0)
    assert ready.ready.take({}) is None


def test_it_ends_as_any_other_once_a_browser_has_come_or_none_has(ready, monkeypatch):
    taken = ready.ready.take({})
    ready.loop.run()
    assert taken.blocked == 1
    taken.connection_count = 1
    ready.loop.run()
    assert taken.blocked == 0
    monkeypatch.setattr(ready_module, "_TAKEN", -1.0)
    second = ready.ready.take({})
    ready.loop.run()
    assert second.blocked == 0


def test_nobody_waits_for_it_and_it_takes_nobodys_place(ready):
    ready.ready.take({})
    ready.shared.rests = lambda seconds: False  # somebody asks for runs
    ready.loop.run()
    assert len(ready.context.made) == 1
    ready.shared.rests = lambda seconds: True
    ready.shared.pages = SESSIONS - 1
    for _ in range(3):
        ready.loop.run()
    assert len(ready.context.made) == 1


def test_pages_of_a_server_are_told_apart(serve):
    url = serve("map.nc").url
    tokens = set()
    for _ in range(3):
        with urllib.request.urlopen(url, timeout=120) as answer:
            tokens |= set(re.findall(r'"token":"([^"]+)"', answer.read().decode()))
    assert len(tokens) == 3
