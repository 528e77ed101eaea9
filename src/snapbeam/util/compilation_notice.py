"""Compilation of kernels: a message in scripts and notebooks."""

from __future__ import annotations

import logging
import sys

_LOG = logging.getLogger("snapbeam")


class _Notice(logging.Handler):
    """Write warnings and the message of a compilation to standard error if nothing else handles the log."""

    def emit(self, record: logging.LogRecord) -> None:
        others = [each for each in (*_LOG.handlers, *logging.getLogger().handlers) if each is not self]
        text = record.getMessage()
        if not others and (record.levelno >= logging.WARNING or text.startswith("compiling ")):
            sys.stderr.write(f"snapbeam: {text}\n")
            sys.stderr.flush()


def announce_compilation() -> None:
    """Let the first run of a kernel report why it takes longer, unless the program has handlers of its own."""
    if not any(isinstance(each, _Notice) for each in _LOG.handlers):
        _LOG.addHandler(_Notice(logging.INFO))
        if _LOG.level == logging.NOTSET:
            _LOG.setLevel(logging.INFO)
