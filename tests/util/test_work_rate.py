"""The rate of a computation whose results come late, evenly or in bursts."""

from __future__ import annotations

import pytest

from snapbeam.util import work_rate
from snapbeam.util.work_rate import WorkRate


def rates(monkeypatch, reports: list[tuple[float, float]]) -> list[float | None]:
    clock, rate, found = iter(now for now, _ in reports), WorkRate(), []
    monkeypatch.setattr(work_rate.time, "monotonic", lambda: next(clock))
    for _, done in reports:
        rate.report(done)
        found.append(rate.per_second)
    return found


def test_the_delay_before_the_first_results_is_forgotten(monkeypatch) -> None:
    reports = [(0.0, 0), *((10.0 + done / 5.0, done) for done in range(1, 41))]
    assert rates(monkeypatch, reports)[-1] == pytest.approx(5.0, rel=0.05)


def test_bursts_do_not_move_the_rate_by_orders(monkeypatch) -> None:
    reports = [(float(k) + 1e-4 * j, 3 * k + j) for k in range(8) for j in range(3)]
    found = rates(monkeypatch, reports)
    assert all(1.0 <= each <= 6.0 for each in found[4:])
