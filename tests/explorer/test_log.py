"""The log of the server: errors, and not the tabs that are closed."""

from __future__ import annotations

import logging

import pytest

pytest.importorskip("panel")

from bokeh.server.connection import ServerConnection
from tornado.websocket import WebSocketClosedError

from snapbeam.explorer.server import _lives_on


def _record(message, work):
    try:
        work()
    except Exception as error:
        return logging.LogRecord("x", logging.ERROR, "", 1, message, (), (type(error), error, error.__traceback__))
    raise AssertionError("work must fail")


def _fail(error):
    raise error


def test_a_closed_tab_is_no_error_and_an_error_is_one():
    connection = object.__new__(ServerConnection)
    connection._session = None
    assert not _lives_on(_record("error handling message", lambda: connection.session))
    assert not _lives_on(_record("Task exception", lambda: _fail(WebSocketClosedError())))
    assert _lives_on(_record("error handling message", lambda: _fail(AssertionError("of this package"))))
    assert _lives_on(_record("error handling message", lambda: _fail(ValueError("x"))))
    plain = logging.LogRecord("x", logging.WARNING, "", 1, "Failed sending message as connection was closed", (), None)
    assert not _lives_on(plain)
