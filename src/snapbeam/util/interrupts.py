"""Ctrl-C, termination and a closed terminal: the program ends with a sentence and a status.

Only the program installs the handler; the library leaves the signals of a process as they are.  Calls of HDF5 hold them
back: an exception inside its callbacks is lost, or ends the process with a segmentation fault.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import TYPE_CHECKING, Any, NoReturn

if TYPE_CHECKING:  # each takes milliseconds, in which a signal ends the program without a word
    from pathlib import Path

WORDS = "interrupted; no file was left half written"
_SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
_GRACE = 0.5
"""Seconds that the main thread has to react, before the program ends if it holds signals back."""
_LONGEST = 5.0
"""Seconds after which the program ends if the main thread has not reacted, as in a call of a library that does not end."""


class _Held:
    """Signals that wait for the end of a block, and the incomplete files to remove if the program cannot wait."""

    def __init__(self) -> None:
        self.handlers: dict[int, Callable[[int, FrameType | None], object]] = {}
        self.waiting: list[int] = []
        self.incomplete: set[Path] = set()


class _State:
    number = 0
    """The signal that arrived."""
    in_command = False
    """True while a command runs, which closes its files and reports finished work when it is interrupted."""
    heard = threading.Event()
    held: _Held | None = None


def install() -> None:
    """Handle the signals that the process was not told to ignore, as a background job and ``nohup`` are."""
    for number in _SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _stop)
    with suppress(OSError, RuntimeError):  # without a pipe or a thread the main thread alone reacts
        reader, writer = os.pipe()
        os.set_blocking(writer, False)
        threading.Thread(target=_watch, args=(reader,), name="interrupts", daemon=True).start()
        signal.set_wakeup_fd(writer, warn_on_full_buffer=False)


@contextmanager
def during_command() -> Iterator[None]:
    """Let an interrupt raise ``KeyboardInterrupt`` in the block; outside, it ends the program at once."""
    _State.in_command = True
    try:
        yield
    finally:
        _State.in_command = False


@contextmanager
def held_back() -> Iterator[set[Path]]:
    """Hold signals with a handler back in the block; :func:`raise_held` and the end of the block handle them.

    Gives the set of incomplete files, which are removed if the program ends in the block.
    """
    if _State.held is not None or threading.current_thread() is not threading.main_thread():
        yield set() if _State.held is None else _State.held.incomplete
        return
    held = _State.held = _Held()
    try:
        for number in _SIGNALS:
            handler = signal.getsignal(number)
            if callable(handler):
                held.handlers[number] = handler
                signal.signal(number, lambda number, _: held.waiting.append(number))
        yield held.incomplete
    finally:
        _State.held = None
        for number, handler in held.handlers.items():
            signal.signal(number, handler)
        _handle(held)


def raise_held() -> None:
    """Handle a deferred signal, at a point of the block where an exception may be raised."""
    if _State.held is not None and threading.current_thread() is threading.main_thread():
        _handle(_State.held)


def _handle(held: _Held) -> None:
    if held.waiting:
        number = held.waiting[0]
        held.waiting.clear()
        held.handlers[number](number, None)


def end(code: Any) -> None:
    """End an interrupted program with the status of the signal; threads that still compute are not awaited."""
    if _State.number and code:
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError):  # a closed terminal
                stream.flush()
        os._exit(128 + _State.number)


def _stop(number: int, frame: FrameType | None) -> None:
    """Handle a signal: the second one, and one while nothing needs to be closed, ends the program at once."""
    again, _State.number = _State.number, number
    _State.heard.set()
    if again or not _State.in_command:
        _leave(number)
    raise KeyboardInterrupt


def _watch(reader: int) -> None:
    """End a program whose main thread writes a large file or is in a call that does not end.

    It reacts to a signal only after seconds, or never.  A call of a library that keeps the interpreter's lock keeps this
    thread waiting too.
    """
    while data := os.read(reader, 1):
        if data[0] not in _SIGNALS:
            continue
        since = time.monotonic()
        while not _State.heard.wait(_GRACE):
            late = time.monotonic() - since >= _LONGEST
            if late or _State.held is not None:
                _leave(data[0])
        _State.heard.clear()  # the next signal must be heard too, while the program closes its files


def _leave(number: int) -> NoReturn:
    for path in [] if _State.held is None else list(_State.held.incomplete):
        with suppress(OSError):
            path.unlink(missing_ok=True)
    with suppress(OSError):  # a closed terminal
        os.write(2, f"{WORDS}\n".encode())
    os._exit(128 + number)
