"""Work that a page asks for, beside the page: newest first, cancelled when it is asked for anew.

Kernels let go of Python's lock, so that threads are enough.  A job hears that it is cancelled where it reports its
progress; a window's next batch waits while a run, which a person waits for, is computed.
"""

from __future__ import annotations

import logging
import threading
import time
import traceback
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from snapbeam import InputError, CheckpointError

__all__ = ["Cancelled", "Jobs", "Token"]

_LOG = logging.getLogger("snapbeam.explorer")


class Cancelled(Exception):
    """The work is not wanted any more."""


@dataclass(eq=False)
class Token:
    """By which a job is told to stop, and stops itself when its time is up.

    The time before its first report, in which an engine may be compiled, is not counted.
    """

    seconds: float = float("inf")
    begun: float = field(default_factory=time.monotonic)
    event: threading.Event = field(default_factory=threading.Event)
    reported: bool = False

    def begin(self) -> None:
        """The work begins."""
        self.begun, self.reported = time.monotonic(), False

    def cancel(self) -> None:
        """Stop it at its next report."""
        self.event.set()

    @property
    def cancelled(self) -> bool:
        """Whether it was told to stop."""
        return self.event.is_set()

    def check(self, *report: Any) -> None:
        """Go on, or not.

        Raises
        ------
        Cancelled
            If it was told to stop.
        InputError
            If it has taken longer than a page may ask for.
        """
        if self.event.is_set():
            raise Cancelled
        if report and not self.reported:
            self.begun, self.reported = time.monotonic(), True
        if time.monotonic() - self.begun > self.seconds:
            raise InputError(f"given up after {self.seconds:g} s, the longest that a page may ask for")


class Jobs:
    """Threads that the pages of one server share."""

    def __init__(self, runs: int = 2, windows: int = 8) -> None:
        self._runs = ThreadPoolExecutor(runs, "snapbeam-run")
        self._windows = ThreadPoolExecutor(windows, "snapbeam-window")
        self._exports = ThreadPoolExecutor(1, "snapbeam-export")
        self._waiting = 0
        self._free = threading.Condition()
        self._turns = threading.Condition()
        self._queue: list[object] = []

    def run(self, work: Callable[[Token], Any], done: Callable[[Any, str], None], token: Token) -> None:
        """Do *work* at once; then ``done(result, words)``, one of the two empty, on the thread that did it."""
        with self._free:
            self._waiting += 1

        def guarded() -> None:
            try:
                _guarded(work, done, token)
            finally:
                with self._free:
                    self._waiting -= 1
                    self._free.notify_all()

        self._runs.submit(guarded)

    def window(self, work: Callable[[Token], Any], done: Callable[[Any, str], None], token: Token) -> None:
        """Do *work* when nothing more urgent is to be done."""
        self._windows.submit(_guarded, work, done, token)

    def export(self, work: Callable[[Token], Any], done: Callable[[Any, str], None], token: Token) -> None:
        """Make a file, one at a time."""
        self._exports.submit(_guarded, work, done, token)

    def give_way(self, token: Token) -> None:
        """Wait while a run is computed."""
        with self._free:
            while self._waiting and not token.cancelled:
                self._free.wait(0.1)
        token.check()

    @contextmanager
    def turn(self, token: Token) -> Iterator[None]:
        """The turn of one batch of a window: windows of several pages take turns, first come, first served.

        Raises
        ------
        Cancelled
            If the window was told to stop while it waited.
        """
        ticket = object()
        with self._turns:
            self._queue.append(ticket)
        try:
            with self._turns:
                while self._queue[0] is not ticket and not token.cancelled:
                    self._turns.wait(0.1)
            self.give_way(token)
            yield
        finally:
            with self._turns:
                self._queue.remove(ticket)
                self._turns.notify_all()

    def close(self) -> None:
        """Take no more work, and drop what has not begun."""
        self._runs.shutdown(wait=False, cancel_futures=True)
        self._windows.shutdown(wait=False, cancel_futures=True)
        self._exports.shutdown(wait=False, cancel_futures=True)


def _guarded(work: Callable[[Token], Any], done: Callable[[Any, str], None], token: Token) -> None:
    token.begin()
    result, words = None, ""
    try:
        token.check()
        result = work(token)
    except Cancelled:
        return
    except (InputError, CheckpointError, OSError) as error:
        words = str(error) or type(error).__name__
    except MemoryError:
        words = "there is not enough memory for this"
    except Exception as error:  # a page says what went wrong and lives on
        _LOG.error("%s", traceback.format_exc())
        words = f"this failed, which it should not: {type(error).__name__}: {error}"
    if not token.cancelled:
        done(result, words)
