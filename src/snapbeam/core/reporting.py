"""Progress in a script or a notebook: one line that is written over."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

from snapbeam.core.validate import InputTypeError, shown

__all__ = ["counting", "sharing"]

_INTERVAL = 0.2
_Counts = Callable[[int, int], object]
_Shares = Callable[[float], object]


class _Line:
    """What is said, at most five times a second, on standard error."""

    def __init__(self, what: str) -> None:
        self.what = what
        self.start = self.last = time.monotonic()
        self.begun: float | None = None
        self.ended = False

    def say(self, share: float, words: str) -> None:
        now = time.monotonic()
        self.begun = now if self.begun is None else self.begun  # what was compiled before is not counted
        if self.ended or (now - self.last < _INTERVAL and share < 1.0):
            return
        self.ended = share >= 1.0
        self.last = now
        spent = now - self.begun
        left = f", {spent * (1.0 - share) / share:.0f} s left" if 0.0 < share < 1.0 and spent > 1.0 else ""
        end = "\n" if share >= 1.0 else ""
        sys.stderr.write(f"\r{self.what}: {words}{left}      {end}")
        sys.stderr.flush()


def counting(progress: _Counts | bool | None, what: str, noun: str = "points") -> _Counts | None:
    """What a computation reports ``(done, total)`` to; True stands for a line on standard error.

    Raises
    ------
    InputTypeError
        If *progress* can be called no more than it is True, False or None.
    """
    if progress is None or progress is False:
        return None
    if progress is True:
        line = _Line(what)
        return lambda done, total: line.say(done / max(total, 1), f"{done} of {total} {noun}")
    if not callable(progress):
        raise InputTypeError(
            f"progress = {shown(progress)}: must be True or callable, as progress(done, total)"
        )
    return progress


def sharing(progress: _Shares | bool | None, what: str) -> _Shares | None:
    """As :func:`counting`, of what is reported as a share."""
    if progress is None or progress is False:
        return None
    if progress is True:
        line = _Line(what)
        return lambda share: line.say(share, f"{100.0 * share:.0f} %")
    if not callable(progress):
        raise InputTypeError(f"progress = {shown(progress)}: must be True or callable, as progress(share)")
    own: _Shares = progress
    return own
