"""The rate of a computation, for estimates of the remaining time."""

from __future__ import annotations

import time

_LEAST = 1.0
"""Seconds that a rate is measured over, if the work takes as long."""


class WorkRate:
    """Rate of the later half of the work that was done since the first report.

    Of a delay, as at the start of the workers of a cluster, the rate is free once as much was done after it as before.
    Work that comes in bursts is counted over a second at least.
    """

    def __init__(self) -> None:
        self._first = 0.0
        self._marks: list[tuple[float, float]] = []

    def report(self, done: float) -> None:
        """Add how much is done; less than before begins again."""
        now = time.monotonic()
        if not self._marks or done < self._marks[-1][1]:
            self._first, self._marks = done, []
        self._marks.append((now, done))
        latest = now - _LEAST
        while len(self._marks) > 2 and self._marks[1][0] <= latest and self._marks[1][1] <= 0.5 * (self._first + done):
            del self._marks[0]

    @property
    def per_second(self) -> float | None:
        """Work done per second; None before the second report."""
        if not self._marks or self._marks[-1][1] <= self._marks[0][1]:
            return None
        (begin, before), (end, done) = self._marks[0], self._marks[-1]
        return (done - before) / max(end - begin, 1e-9)
