"""Compilation of kernels: a message in scripts and notebooks, and the seconds that it takes."""

from __future__ import annotations

import logging
import sys
from typing import Any

__all__ = ["announce_compilation", "compile_seconds"]


_LOG = logging.getLogger("snapbeam")
_TIMERS: list[Any] = []


class _Notice(logging.Handler):
    """Write the message of a compilation to standard error if nothing else handles the log."""

    def emit(self, record: logging.LogRecord) -> None:
        others = [each for each in (*_LOG.handlers, *logging.getLogger().handlers) if each is not self]
        text = record.getMessage()
        if not others and text.startswith("compiling "):
            sys.stderr.write(f"snapbeam: {text}\n")
            sys.stderr.flush()


def announce_compilation() -> None:
    """Let the first run of a kernel report why it takes longer, unless the program has handlers of its own."""
    if not any(isinstance(each, _Notice) for each in _LOG.handlers):
        _LOG.addHandler(_Notice(logging.INFO))
        if _LOG.level == logging.NOTSET:
            _LOG.setLevel(logging.INFO)


def compile_seconds() -> float:
    """Seconds of compilation since the first call of this function; estimates of the remaining time leave them out."""
    event = sys.modules.get("numba.core.event")
    if event is None:
        return 0.0
    if not _TIMERS:
        timer = event.TimingListener()
        event.register("numba:compile", timer)
        _TIMERS.append(timer)
    timer = _TIMERS[0]
    return float(timer.duration) if timer.done else 0.0
