"""Published values, each within its tolerance, and the table of the documentation."""

from __future__ import annotations

import math

import pytest
from cases import CASES, Row
from write_table import TABLE, rows_of

SLOW = ("basin_shares", "mass_on_a_stop", "bouncing_ball", "lyapunov")
"""Cases that take long."""


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow) if name in SLOW else name for name in CASES]
)
def test_case(name: str) -> None:
    for row in CASES[name]():
        assert math.isfinite(row.ours), row
        assert abs(row.difference - row.expected) <= row.tolerance, row


@pytest.mark.parametrize("name", ["buckled_frequencies", "elastica", "timoshenko_beams"])
def test_table_of_the_documentation(name: str) -> None:
    """The page has the rows that are computed."""
    text = TABLE.read_text(encoding="utf-8")
    for line in rows_of(CASES[name]()):
        assert line in text


def test_difference() -> None:
    assert Row("", "", "", 2.0, 2.02, 0.1).difference == pytest.approx(0.01)
