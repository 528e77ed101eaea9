"""Result of the measurement of a claim: numbers with their uncertainty, and a verdict that follows from a rule."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

VERDICTS = ("holds", "in part", "fails", "open")

Number = float | int | tuple[float, ...] | tuple[tuple[float, ...], ...]
"""Settings, sections, lists of numbers or lists of rows, which appear in the text next to quantities."""


class Quantity(NamedTuple):
    """A measured value and its uncertainty, a half width of the same quantity in the same unit."""

    value: float
    uncertainty: float


class Check(NamedTuple):
    """Result of a condition: true for all values within the uncertainty, for the measured one, for any."""

    must: bool
    does: bool
    could: bool

    def __and__(self, other: Check) -> Check:
        return Check(self.must and other.must, self.does and other.does, self.could and other.could)

    def __or__(self, other: Check) -> Check:
        return Check(self.must or other.must, self.does or other.does, self.could or other.could)


FAIL = Check(False, False, False)
"""The condition that nothing meets."""


def above(value: Quantity | float, limit: float) -> Check:
    """Check that a value is above a limit; a nonfinite value never is."""
    middle, spread = value if isinstance(value, Quantity) else (value, 0.0)
    return Check(middle - spread > limit, middle > limit, middle + spread > limit)


def below(value: Quantity | float, limit: float) -> Check:
    """Check that a value is at most a limit."""
    middle, spread = value if isinstance(value, Quantity) else (value, 0.0)
    return Check(middle + spread <= limit, middle <= limit, middle - spread <= limit)


def near(value: Quantity | float, target: float, allowed: float) -> Check:
    """Check that a value is within *allowed* of a target."""
    middle, spread = value if isinstance(value, Quantity) else (value, 0.0)
    # a slack of rounding, so that "within a step of the grid" holds a step of the grid
    off, allowed = abs(middle - target), allowed * (1.0 + 1e-9)
    return Check(off + spread <= allowed, off <= allowed, off - spread <= allowed)


@dataclass(frozen=True)
class ClaimResult:
    """Result of the measurement of one claim.

    ``close``: whether the verdict would be another somewhere within the uncertainties.  The first of the
    ``quantities`` is the one the claim is about.
    """

    verdict: str
    close: bool
    quantities: Mapping[str, Quantity]
    numbers: Mapping[str, Number] = field(default_factory=dict)


def found(holds: Check, in_part: Check = FAIL, /, **named: Quantity | Number) -> ClaimResult:
    """Return the result of a claim that *holds* by one condition and, where it does not, *in part* by another."""

    def verdict(reading: int) -> str:
        return "holds" if holds[reading] else "in part" if in_part[reading] else "fails"

    worst, now, best = (verdict(reading) for reading in range(3))
    return _claim_result(now, worst != best, named)


def measured(matters: Check, /, **named: Quantity | Number) -> ClaimResult:
    """Return the result of an open question, whose influence is measured.

    ``matters`` is 1 where it shows, beyond the uncertainty.
    """
    return _claim_result("open", matters.must != matters.does, {**named, "matters": int(matters.must)})


def _claim_result(verdict: str, close: bool, named: Mapping[str, Quantity | Number]) -> ClaimResult:
    quantities = {name: value for name, value in named.items() if isinstance(value, Quantity)}
    for name, quantity in quantities.items():
        if not (quantity.uncertainty >= 0.0 or math.isnan(quantity.value)):
            raise ValueError(f"{name} = {quantity}: must have an uncertainty of at least 0")
    numbers = {name: value for name, value in named.items() if not isinstance(value, Quantity)}
    return ClaimResult(verdict, close, quantities, numbers)
