"""Searching columns of amplitudes for the first that makes an interwell response, many columns at a time.

A column is what one frequency ratio or location does at each amplitude of a grid.  Responses are asked for in
rounds, each an ensemble; nothing here knows how they are computed.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

__all__ = ["Responses", "search_everything_below", "search_fast"]

_Index = NDArray[np.int64]
Ask = Callable[[_Index, _Index], NDArray[np.int8]]
"""Given columns and rows, the classes of the responses there."""

_SEED_EVERY = 4
"""Columns from one searched over its whole range to the next."""
_FIRST_STEP = 2
"""Rows from a guess to the first sample on either side of it."""
_LOW_BIAS = 0.35
"""Where a bracket is cut, nearer its low end: interwell points of a fractal boundary thin out downwards."""
_PULL = 0.3
"""What a row that a column lies above its neighbours counts against a row already searched below it."""
_REACH = 2
"""Neighbours, on either side, that a column is compared with."""


class _Spent(Exception):
    """The next responses would cost more than is left."""


class Responses:
    """Responses found so far: classes of shape (columns, rows), and which of them are known."""

    def __init__(self, columns: int, rows: int, ask: Ask) -> None:
        self.classes = np.full((columns, rows), -1, dtype=np.int8)
        self.known = np.zeros((columns, rows), dtype=bool)
        self.budget = columns * rows
        """Responses that may be computed in all."""
        self._ask = ask

    @property
    def interwell(self) -> NDArray[np.bool_]:
        """Where an interwell response is known."""
        return self.classes > 0

    @property
    def runs(self) -> int:
        """Responses computed."""
        return int(self.known.sum())

    def need(self, columns: _Index, rows: _Index) -> NDArray[np.bool_]:
        """Whether the responses asked for are interwell, computing those that are not known."""
        new = ~self.known[columns, rows]
        if new.any():
            pairs = np.unique(np.stack((columns[new], rows[new])), axis=1)
            if self.runs + pairs.shape[1] > self.budget:
                raise _Spent
            self.classes[pairs[0], pairs[1]] = self._ask(pairs[0], pairs[1])
            self.known[pairs[0], pairs[1]] = True
        found: NDArray[np.bool_] = self.interwell[columns, rows]
        return found

    def first(self) -> _Index:
        """Lowest row known to be interwell, of each column; the number of rows if none is."""
        rows = self.classes.shape[1]
        return np.where(self.interwell.any(axis=1), self.interwell.argmax(axis=1), rows)

    def top(self) -> _Index:
        """Lowest row from which on every known response is interwell; the number of rows if there is none."""
        rows = np.arange(self.classes.shape[1])
        last = np.where(self.known & ~self.interwell, rows, -1).max(axis=1)
        above = self.interwell & (rows > last[:, None])
        return np.where(above.any(axis=1), above.argmax(axis=1), rows.size)


def search_fast(found: Responses, budget: int) -> None:
    """Bracket the boundary of each column, its neighbours a guide, then spend what is left looking below it.

    Every fourth column is bracketed over its whole range and cut down to neighbouring rows; the others start
    from what those found.  Then rows below the lowest interwell one are tried, the columns that stand out
    above their neighbours first, until *budget* responses are known or nothing is left.
    """
    found.budget = budget
    with suppress(_Spent):
        _bracket_all(found)
    while (left := budget - found.runs) > 0:
        column, row = _next_below(found)
        if column.size == 0:
            return
        count = min(left, max(1, -(-found.classes.shape[0] // 4)))
        found.need(column[:count], row[:count])


def _bracket_all(found: Responses) -> None:
    columns, rows = found.classes.shape
    seeds = np.unique(np.append(np.arange(0, columns, _SEED_EVERY), columns - 1))
    low, high = np.full(columns, -1), np.full(columns, rows)
    _bisect(found, seeds, low, high)
    others = np.setdiff1d(np.arange(columns), seeds)
    if others.size:
        guess = np.rint(np.interp(others, seeds, high[seeds])).astype(np.int64)
        _bracket(found, others, guess, low, high)
        _bisect(found, others, low, high)


def _bisect(found: Responses, columns: _Index, low: _Index, high: _Index) -> None:
    """Narrow the brackets to neighbouring rows, low not interwell and high interwell."""
    while True:
        open_ = columns[high[columns] - low[columns] > 1]
        if open_.size == 0:
            return
        width = high[open_] - low[open_]
        middle = low[open_] + np.clip(np.rint(_LOW_BIAS * width).astype(np.int64), 1, width - 1)
        snaps = found.need(open_, middle)
        high[open_] = np.where(snaps, middle, high[open_])
        low[open_] = np.where(snaps, low[open_], middle)


def _bracket(found: Responses, columns: _Index, guess: _Index, low: _Index, high: _Index) -> None:
    """Step away from the guesses, in doubling steps, until a row is below the boundary and one above it."""
    rows = found.classes.shape[1]
    step = _FIRST_STEP
    below, above = guess - step, guess + step
    while True:
        down = np.flatnonzero((low[columns] < 0) & (below >= 0))
        up = np.flatnonzero((high[columns] >= rows) & (above < rows) & (above > low[columns]))
        up = up[~np.isin(up, down)]
        if down.size + up.size == 0:
            return
        which = np.concatenate((down, up))
        row = np.clip(np.concatenate((below[down], above[up])), 0, rows - 1)
        column = columns[which]
        snaps = found.need(column, row)
        high[column] = np.where(snaps, np.minimum(high[column], row), high[column])
        low[column] = np.where(snaps, low[column], np.maximum(low[column], row))
        step *= 2
        below[down] -= step
        above[up] += step


def _next_below(found: Responses) -> tuple[_Index, _Index]:
    """The next unknown row below the first interwell one of each column, the most promising column first."""
    first = found.first()
    rows = np.arange(found.classes.shape[1])
    candidates = ~found.known & (rows < first[:, None])
    columns = np.flatnonzero(candidates.any(axis=1))
    row = rows.size - 1 - candidates[columns, ::-1].argmax(axis=1)
    lowest = np.array([first[max(0, c - _REACH) : c + _REACH + 1].min() for c in columns], dtype=np.int64)
    rank = (first[columns] - row) - _PULL * (first[columns] - lowest)
    order = np.argsort(rank, kind="stable")
    return columns[order], row[order]


def search_everything_below(found: Responses, block: int, confirm: int) -> None:
    """Go up every column, *block* rows at a time, until *confirm* interwell rows follow each other.

    Nothing below is left out, so the first interwell row found is the first of the grid.
    """
    columns, rows = found.classes.shape
    going = np.arange(columns)
    for start in range(0, rows, block):
        stop = min(start + block, rows)
        pairs = np.meshgrid(going, np.arange(start, stop), indexing="ij")
        found.need(pairs[0].ravel(), pairs[1].ravel())
        tail = found.interwell[going, max(0, stop - confirm) : stop]
        going = going[~(tail.all(axis=1) & (stop >= confirm))]
        if going.size == 0:
            return
