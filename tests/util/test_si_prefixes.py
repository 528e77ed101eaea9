"""Numbers with the prefixes of the SI."""

from __future__ import annotations

import math

import pytest

from snapbeam.util.si_prefixes import prefixed, scale_of


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [(0.161, "m", "161 mm"), (3.35e-4, "m", "335 µm"), (2e-6, "m", "2 µm"), (1.0, "m", "1 m"), (0.0, "N", "0 N"),
     (81853.0, "Hz", "81.9 kHz"), (-4e-9, "J", "-4 nJ"), (999.4, "N", "999 N"), (999.9, "N", "1 kN"),
     (1e-27, "J", "0.001 yJ"), (1e30, "N", "1e+06 YN"), (math.inf, "N", "inf N"), (math.nan, "s", "nan s")],
)  # fmt: skip
def test_prefixes(value, unit, text) -> None:
    assert prefixed(value, unit) == text


def test_digits() -> None:
    """Rounding comes before the prefix: 0.99996 N of four digits is 1 N, of five 999.96 mN."""
    assert prefixed(0.99996, "N", 4) == "1 N"
    assert prefixed(0.99996, "N", 5) == "999.96 mN"
    assert prefixed(21.498e-5, "s", 5) == "214.98 µs"


def test_one_prefix_for_many() -> None:
    assert scale_of([1e-5, 0.0, -2e-4], "N") == (pytest.approx(1e-6), "µN")
    assert scale_of([0.0], "N") == (1.0, "N") and scale_of([], "N") == (1.0, "N")
