"""Statistics of each of several strikers: rows beside the table's, whose names bear the striker's number."""

from __future__ import annotations

from snapbeam.engines.outcomes import (
    OTHER_IMPACTS,
    OTHER_IMPULSE,
    OTHER_PEAK,
    OTHER_WORK,
    STATISTICS,
    Statistic,
)
from snapbeam.model.drive.joined import MOST_STRIKERS

__all__ = ["of_one_named", "rows_for"]

_EACH = {
    "impacts": (OTHER_IMPACTS, "impacts"),
    "peak_force": (OTHER_PEAK, "peak contact force"),
    "impulse": (OTHER_IMPULSE, "impulse on the beam, all impacts"),
    "striker_work": (OTHER_WORK, "work done"),
}
"""What each of several has: where the others' is kept, and words."""
_NUMBERS = {str(number) for number in range(1, MOST_STRIKERS + 1)}


def rows_for(strikers: int) -> dict[str, Statistic]:
    """The rows of a system with so many strikers: the table's, and if there are several those of each of them."""
    rows = [_of_one(name, number + 1) for number in range(strikers if strikers > 1 else 0) for name in _EACH]
    return STATISTICS | {row.name: row for row in rows}


def of_one_named(name: str) -> Statistic | None:
    """The row of one of several strikers by its name; None if there is no such row."""
    whole, _, number = name.rpartition("_striker_")
    if whole not in _EACH or number not in _NUMBERS:
        return None
    return _of_one(whole, int(number))


def _of_one(name: str, number: int) -> Statistic:
    """Of one striker, the first being 1."""
    whole, (column, words) = STATISTICS[name], _EACH[name]
    words = f"{words}, striker {number}"
    return Statistic(
        f"{name}_striker_{number}",
        whole.dtype,
        whole.unit,
        words,
        lambda reading: reading.one(column, number),
    )
