"""Objects in each column of a binary sample, counted from the far side, and bars that never move."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["ColumnObjects", "column_objects", "fixed_bars", "longest_stretch"]

_STILL = 0.7  # share of the sample in which both edges of a bar must stand still
_ACROSS = 0.6  # share of the columns that a bar or a beam crosses
_MOVES = 2.0  # rows by which a beam must move to be told from a bar


@dataclass(frozen=True)
class ColumnObjects:
    """The first two objects from the far side in each column of each frame, arrays (frames, columns).

    ``start`` and ``end`` (one past the last row) of the first where ``found``; ``after`` and ``after_end`` of
    the next where one ``follows``; ``further`` whether anything lies beyond that.  ``height`` counts the rows.
    """

    start: NDArray[np.intp]
    end: NDArray[np.intp]
    found: NDArray[np.bool_]
    after: NDArray[np.intp]
    after_end: NDArray[np.intp]
    follows: NDArray[np.bool_]
    further: NDArray[np.bool_]
    height: int


def column_objects(mask: NDArray[np.bool_]) -> ColumnObjects:
    """The first two objects in each column of a mask (frames, rows, columns); specks of one row are none."""
    rows = np.arange(mask.shape[1])[None, :, None]
    solid = mask.copy()
    solid[:, :-1] &= mask[:, 1:]
    solid[:, -1] = False

    def end_of(start: NDArray[np.intp]) -> NDArray[np.intp]:
        filled = mask | (rows < start[:, None])
        return np.where(filled.all(1), mask.shape[1], filled.argmin(1))

    start, found = solid.argmax(1), solid.any(1)
    end = end_of(start)
    later = solid & (rows >= end[:, None])
    after = later.argmax(1)
    follows: NDArray[np.bool_] = np.asarray(later.any(1))
    after_end = np.where(follows, end_of(after), mask.shape[1])
    further: NDArray[np.bool_] = np.asarray((solid & (rows >= after_end[:, None])).any(1))
    return ColumnObjects(start, end, found & (start > 0), after, after_end, follows, further, mask.shape[1])


def longest_stretch(columns: NDArray[np.bool_]) -> tuple[int, int]:
    """First and one past the last of the longest stretch of True."""
    steps = np.diff(np.concatenate([[0], columns.astype(np.int8), [0]]))
    starts, stops = np.flatnonzero(steps == 1), np.flatnonzero(steps == -1)
    if not starts.size:
        return 0, 0
    best = int(np.argmax(stops - starts))
    return int(starts[best]), int(stops[best])


def fixed_bars(mask: NDArray[np.bool_]) -> tuple[tuple[int, int], ...]:
    """Rows (first, one past the last) of bars that cross the picture and never move, beside a beam that does.

    A bar that stands alone is none: it may be a beam at rest.
    """
    bars: list[tuple[int, int]] = []
    left = mask.copy()
    for bar in _still_bands(mask):
        rest = left.copy()
        rest[:, max(bar[0] - 1, 0) : bar[1] + 1] = False
        if _moving_beam(rest):
            bars.append(bar)
            left = rest
    return tuple(bars)


def _still_bands(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Bands whose two edges stand still in most of the sample, across most columns."""
    columns = np.unique(np.linspace(0, mask.shape[2] - 1, min(mask.shape[2], 32)).astype(int))
    steps = np.diff(mask[:, :, columns].astype(np.int8), axis=1)
    share = {}
    for sign in (1, -1):
        near = steps == sign
        spread = near.copy()
        spread[:, 1:] |= near[:, :-1]
        spread[:, :-1] |= near[:, 1:]
        share[sign] = spread.mean(0)  # (rows - 1, columns)
    marks = np.zeros((mask.shape[1], columns.size), dtype=bool)
    for c in range(columns.size):
        rising = _peaks(share[1][:, c])
        falling = _peaks(share[-1][:, c])
        for first in rising:
            stops = falling[falling > first]
            if stops.size and not ((rising > first) & (rising < stops[0])).any():
                marks[first + 1 : stops[0] + 1, c] = True
    across = marks.mean(1) >= _ACROSS
    edges = np.diff(np.concatenate([[0], across.astype(np.int8), [0]]))
    return list(zip(np.flatnonzero(edges == 1).tolist(), np.flatnonzero(edges == -1).tolist(), strict=True))


def _peaks(share: NDArray[np.floating]) -> NDArray[np.intp]:
    """Middle of each stretch of rows at which an edge stands in most of the sample."""
    still = share >= _STILL
    steps = np.diff(np.concatenate([[0], still.astype(np.int8), [0]]))
    middle: NDArray[np.intp] = (np.flatnonzero(steps == 1) + np.flatnonzero(steps == -1) - 1) // 2
    return middle


def _moving_beam(mask: NDArray[np.bool_]) -> bool:
    """Whether what is left of a mask holds an object that crosses the picture, ends within it and moves."""
    objects = column_objects(mask)
    bounded = objects.found & (objects.end < mask.shape[1]) & (objects.end - objects.start >= 3)
    if (bounded.mean(0) > 0.4).mean() < _ACROSS:
        return False
    where = np.where(bounded, objects.start, np.nan)
    columns = np.flatnonzero(bounded.mean(0) > 0.4)
    travel = np.nanpercentile(where[:, columns], 97, axis=0) - np.nanpercentile(where[:, columns], 3, axis=0)
    return bool(np.median(travel) > _MOVES)
