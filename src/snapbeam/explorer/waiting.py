"""What a page says while one waits: for how long so far, and that the engine is being compiled."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable

__all__ = ["Compiling", "Waiting"]

_FIRST = 700
"""Milliseconds after which a wait is worth a word."""
_AGAIN = 1000


class Compiling(logging.Handler):
    """Hears in the package's log that code is being compiled.

    Attributes
    ----------
    words : str
        What was said of it; empty if nothing is compiled.
    """

    def __init__(self) -> None:
        super().__init__(logging.INFO)
        self.words = ""
        self._log = logging.getLogger("snapbeam")
        self._before = self._log.level
        self._log.addHandler(self)
        if self._log.getEffectiveLevel() > logging.INFO:
            self._log.setLevel(logging.INFO)

    def emit(self, record: logging.LogRecord) -> None:
        """Hear one line."""
        text = record.getMessage()
        if text.startswith("compiling"):
            self.words = text

    def over(self) -> None:
        """Something was computed: what it needed is compiled."""
        self.words = ""

    def close(self) -> None:
        """Hear no more."""
        self._log.removeHandler(self)
        self._log.setLevel(self._before)
        super().close()


class Waiting:
    """The waits of one page.

    Parameters
    ----------
    heard : Compiling
    later : callable
        ``later(work, milliseconds)``: do something on the page's own thread a little later.
    """

    def __init__(self, heard: Compiling, later: Callable[[Callable[[], None], int], object]) -> None:
        self._heard, self._later = heard, later
        self._asked: dict[int, object] = {}

    def begin(self, which: int, tell: Callable[[float, str], None]) -> object:
        """Call ``tell(seconds, words)`` every second until *which* ends, or begins anew; returns what stands for it."""
        begun, mark = time.monotonic(), object()
        self._asked[which] = mark

        def look() -> None:
            if self._asked.get(which) is mark:
                tell(time.monotonic() - begun, self._heard.words)
                self._later(look, _AGAIN)

        self._later(look, _FIRST)
        return mark

    def waits(self, which: int, mark: object) -> bool:
        """Whether the wait that :meth:`begin` gave *mark* for goes on."""
        return self._asked.get(which) is mark

    def end(self, which: int, computed: bool = True) -> None:
        """There is something to see, or, if nothing was *computed*, no more to wait for."""
        if self._asked.pop(which, None) is not None and computed:
            self._heard.over()
