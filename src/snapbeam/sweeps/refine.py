"""Refined maps: the resolution where classes meet, without the runs where they do not.

Each level halves the spacing of every axis.  The new points of a cell are computed if its corners are of
different classes, or if a point computed on its border disagrees with them; otherwise they take the class
that all its corners share.
"""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.codes import ResponseClass, RunStatus
from snapbeam.sweeps.compute.task import Columns
from snapbeam.sweeps.compute.tasks import Book, Results, Stage
from snapbeam.sweeps.sweep import Grid, Progress

__all__ = ["MAX_LEVELS", "RefinedResults", "refine", "refined_grid"]

MAX_LEVELS = 10
_BLOCK = 65536

_Classes = NDArray[np.int8]
_Mask = NDArray[np.bool_]
_Index = NDArray[np.int64]


class RefinedResults:
    """Rows of a refined map: those that were computed, and those that were inferred."""

    def __init__(self, columns: Columns, computed: _Mask) -> None:
        self.columns = columns
        self.computed = computed
        """Whether each point was run, shape of the grid."""

    def read(self, start: int, stop: int) -> Columns:
        """Rows *start* to *stop*."""
        return Columns(self.columns.integers[start:stop], self.columns.numbers[start:stop])


def refined_grid(grid: Grid) -> Grid:
    """The grid with a point more between each two neighbours of an axis."""
    axes = {}
    for name, values in grid.axes.items():
        axes[name] = np.empty(2 * values.size - 1)
        axes[name][::2] = values
        axes[name][1::2] = 0.5 * (values[1:] + values[:-1])
    return Grid(axes, grid.scalars)


def refine(book: Book, levels: int, progress: Progress | None = None) -> tuple[Grid, RefinedResults]:
    """Compute a map and refine it *levels* times where neighbours differ in class.

    Returns
    -------
    grid : Grid
        The grid at full resolution, (n - 1) 2^levels + 1 points along an axis of n.
    results : RefinedResults
        The rows of all of its points.
    """
    recipe = book.recipe
    grid = recipe.setup.grid
    base = Stage("base", grid, book.chunk)
    parts: list[tuple[_Index, Results]] = [(np.arange(grid.size), book.complete(base, progress))]
    classes = _classes(book, parts[0][1], grid.size).reshape(grid.shape)
    computed = np.ones(grid.shape, dtype=bool)
    for level in range(1, levels + 1):
        finer = refined_grid(grid)
        parts = [(_finer_index(index, grid, finer), results) for index, results in parts]
        corners = classes
        classes = _spread(corners, finer.shape, ResponseClass.UNKNOWN)
        computed = _spread(computed, finer.shape, False)
        active = _differ(corners)
        part = 0
        while True:
            missing = np.flatnonzero(_points_of(active, finer.shape) & ~computed)
            if missing.size:
                part += 1
                stage = Stage(f"level-{level}-{part}", finer, book.chunk, missing)
                results = book.complete(stage, progress)
                parts.append((missing, results))
                classes.flat[missing] = _classes(book, results, missing.size)
                computed.flat[missing] = True
            surprised = _surprised(corners, classes, computed) & ~active
            if not surprised.any():
                break
            active |= surprised
        _infer(corners, classes, computed, active)
        grid = finer
    return grid, _assemble(book, grid, parts, classes, computed)


def _classes(book: Book, results: Results, size: int) -> _Classes:
    blocks = [
        book.recipe.values("response", results.read(start, min(start + _BLOCK, size)))
        for start in range(0, size, _BLOCK)
    ]
    return np.concatenate(blocks).astype(np.int8)


def _finer_index(index: _Index, grid: Grid, finer: Grid) -> _Index:
    if not grid.axes:
        return index
    places = tuple(2 * at for at in np.unravel_index(index, grid.shape))
    return np.ravel_multi_index(places, finer.shape).astype(np.int64)


def _spread(coarse: NDArray, shape: tuple[int, ...], fill: int) -> NDArray:
    fine = np.full(shape, fill, dtype=coarse.dtype)
    fine[tuple(slice(None, None, 2) for _ in shape)] = coarse
    return fine


def _cells(shape: tuple[int, ...]) -> tuple[int, ...]:
    """Cells between the points of a grid; an axis of one point has one flat cell."""
    return tuple(max(count - 1, 1) for count in shape)


def _corner_views(coarse: _Classes) -> list[_Classes]:
    cells = _cells(coarse.shape)
    offsets = product(*((0, 1) if count > 1 else (0,) for count in coarse.shape))
    return [coarse[tuple(slice(o, o + c) for o, c in zip(at, cells, strict=True))] for at in offsets]


def _fine_slices(shape: tuple[int, ...]) -> list[tuple[slice, ...]]:
    """For each of the 3^d points of a refined cell, where it lies in the fine grid, all cells at once."""
    offsets = product(*((0, 1, 2) if count > 1 else (0,) for count in shape))
    cells = tuple((count - 1) // 2 if count > 1 else 1 for count in shape)
    return [tuple(slice(o, o + 2 * c - 1, 2) for o, c in zip(at, cells, strict=True)) for at in offsets]


def _differ(coarse: _Classes) -> _Mask:
    """Cells whose corners are not all of one class."""
    first, *others = _corner_views(coarse)
    different = np.zeros(first.shape, dtype=bool)
    for other in others:
        different |= other != first
    return different


def _points_of(active: _Mask, shape: tuple[int, ...]) -> _Mask:
    inside = np.zeros(shape, dtype=bool)
    for at in _fine_slices(shape):
        inside[at] |= active
    return inside


def _surprised(corners: _Classes, fine: _Classes, computed: _Mask) -> _Mask:
    """Cells with a computed point that is not of the class of the first corner."""
    expected = _corner_views(corners)[0]
    found = np.zeros(expected.shape, dtype=bool)
    for at in _fine_slices(fine.shape):
        found |= computed[at] & (fine[at] != expected)
    return found


def _infer(corners: _Classes, fine: _Classes, computed: _Mask, active: _Mask) -> None:
    expected = _corner_views(corners)[0]
    for at in _fine_slices(fine.shape):
        fine[at] = np.where(computed[at] | active, fine[at], expected)


def _assemble(
    book: Book, grid: Grid, parts: list[tuple[_Index, Results]], classes: _Classes, computed: _Mask
) -> RefinedResults:
    recipe = book.recipe
    columns = recipe.unfinished(grid.size, RunStatus.INFERRED)
    columns.integers[:, recipe.integers.index("response")] = classes.ravel()
    for index, results in parts:
        for start in range(0, index.size, _BLOCK):
            rows = index[start : start + _BLOCK]
            block = results.read(start, start + rows.size)
            columns.integers[rows], columns.numbers[rows] = block
    return RefinedResults(columns, computed)
