"""Ctrl-C, termination and a closed terminal: the program ends with a sentence and a status.

Only the program installs the handler; the library leaves the signals of a process as they are.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Any, NoReturn

__all__ = ["WORDS", "during_command", "end", "install"]


WORDS = "interrupted; no file was left half written"
_SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
_GRACE = 0.5
"""Seconds that the main thread has to react, before it is asked whether it is compiling."""


class _State:
    number = 0
    """The signal that arrived."""
    in_command = False
    """Whether a command runs, which closes its files and reports what is finished when it is interrupted."""
    heard = threading.Event()


def install() -> None:
    """Handle the signals that the process was not told to ignore, as a background job and ``nohup`` are."""
    for number in _SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _stop)
    reader, writer = os.pipe()
    os.set_blocking(writer, False)
    signal.set_wakeup_fd(writer, warn_on_full_buffer=False)
    threading.Thread(target=_watch, args=(reader,), name="interrupts", daemon=True).start()


@contextmanager
def during_command() -> Iterator[None]:
    """Let an interrupt raise ``KeyboardInterrupt`` in the block; outside, it ends the program at once."""
    _State.in_command = True
    try:
        yield
    finally:
        _State.in_command = False


def end(code: Any) -> None:
    """End an interrupted program with the status of the signal; threads that still compile are not awaited."""
    if _State.number and code:
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError):  # a closed terminal
                stream.flush()
        os._exit(128 + _State.number)


def _stop(number: int, frame: FrameType | None) -> None:
    """Handle a signal: the second one, and one while nothing needs to be closed, ends the program at once."""
    again, _State.number = _State.number, number
    _State.heard.set()
    if again or not _State.in_command or _compiles(frame):
        _leave(number)
    raise KeyboardInterrupt


def _watch(reader: int) -> None:
    """End a program whose main thread compiles: it reacts to a signal only after seconds."""
    while data := os.read(reader, 1):
        while data[0] in _SIGNALS and not _State.heard.wait(_GRACE):
            if _compiles(sys._current_frames().get(threading.main_thread().ident or 0)):
                _leave(data[0])


def _compiles(frame: FrameType | None) -> bool:
    while frame is not None:
        if str(frame.f_globals.get("__name__")).partition(".")[0] in ("numba", "llvmlite"):
            return True
        frame = frame.f_back
    return False


def _leave(number: int) -> NoReturn:
    with suppress(OSError):  # a closed terminal
        os.write(2, f"{WORDS}\n".encode())
    os._exit(128 + number)
