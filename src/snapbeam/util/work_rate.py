"""The rate of a computation, for estimates of the remaining time."""

from __future__ import annotations

import sys
import time
from typing import Any

_TIMERS: list[Any] = []


class WorkRate:
    """Rate of the later half of the work that was done since the first report.

    The compilation of kernels in this process is left out.  Of a delay elsewhere, such as a compilation in the workers
    of a cluster, the rate is free once as much was done after it as before.
    """

    def __init__(self) -> None:
        self._first = 0.0
        self._marks: list[tuple[float, float]] = []

    def report(self, done: float) -> None:
        """Add how much is done; less than before begins again."""
        now = time.monotonic() - compile_seconds()
        if not self._marks or done < self._marks[-1][1]:
            self._first, self._marks = done, []
        self._marks.append((now, done))
        while len(self._marks) > 2 and self._marks[1][1] <= 0.5 * (self._first + done):
            del self._marks[0]

    @property
    def per_second(self) -> float | None:
        """Work done per second; None before the second report."""
        if not self._marks or self._marks[-1][1] <= self._marks[0][1]:
            return None
        (begin, before), (end, done) = self._marks[0], self._marks[-1]
        return (done - before) / max(end - begin, 1e-9)


def compile_seconds() -> float:
    """Seconds of compilation in this process since the first call of this function."""
    event = sys.modules.get("numba.core.event")
    if event is None:
        return 0.0
    if not _TIMERS:
        timer = event.TimingListener()
        event.register("numba:compile", timer)
        _TIMERS.append(timer)
    timer = _TIMERS[0]
    return float(timer.duration) if timer.done else 0.0
