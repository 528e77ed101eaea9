"""Adaptive refinement of maps near the boundaries of response classes.

Each level halves the grid spacing of every axis.  snapbeam computes the new points of a cell if its corners have
different classes, or if a computed point on its border has another class than the corners.  Otherwise the new points
get the class of the corners, with the status FILLED.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from snapbeam.sweeps.points import Grid
from snapbeam.sweeps.setup import Progress
from snapbeam.sweeps.tasks import ResultRows, ResultTable, Stage, StageRunner
from snapbeam.util.status_codes import ResponseClass, RunStatus
from snapbeam.util.validation import InputError

MAX_LEVELS = 10
_BLOCK = 65536

_Classes = NDArray[np.int8]
_Mask = NDArray[np.bool_]
_Index = NDArray[np.int64]
_Split = tuple[bool, ...]


@dataclass(frozen=True, eq=False)
class RefinedRows:
    """Rows of a refined map, computed and filled."""

    columns: ResultTable
    computed: _Mask
    """True for each point that was run, shape of the grid."""

    def read(self, start: int, stop: int) -> ResultTable:
        """Return the rows *start* to *stop*."""
        return self.columns.read(start, stop)


def refined_grid(grid: Grid) -> Grid:
    """Return the grid with half the spacing of its axes of real numbers.

    Axes of integers and of words stay as they are.
    """
    axes = {}
    for name, values in grid.axes.items():
        if values.dtype.kind != "f":
            axes[name] = values
            continue
        axes[name] = np.empty(2 * values.size - 1)
        axes[name][::2] = values
        axes[name][1::2] = 0.5 * (values[1:] + values[:-1])
    return Grid(axes, grid.units)


def refine(runner: StageRunner, levels: int, progress: Progress | None = None) -> tuple[Grid, RefinedRows]:
    """Compute a map and refine it *levels* times where neighbours differ in response class.

    Returns
    -------
    grid : Grid
        The grid at full resolution, (n - 1) 2^levels + 1 points along an axis of n.
    results : RefinedRows
        The rows of all of its points.
    """
    work = runner.work
    grid = work.setup.points
    if not isinstance(grid, Grid):
        raise InputError("refine_levels: a list of points cannot be refined; give axes")
    split = _split(grid)
    if not any(split):
        raise InputError("refine_levels: needs an axis of at least two real numbers; add one, or set refine_levels = 0")
    base = Stage("base", grid, runner.chunk)
    parts: list[tuple[_Index, ResultRows]] = [(np.arange(grid.size), runner.complete(base, progress))]
    classes = _classes(runner, parts[0][1], grid.size).reshape(grid.shape)
    computed = np.ones(grid.shape, dtype=bool)
    for level in range(1, levels + 1):
        finer = refined_grid(grid)
        parts = [(_finer_index(index, grid, finer), results) for index, results in parts]
        corners = classes
        classes = _embed(corners, finer.shape, split, ResponseClass.UNKNOWN)
        computed = _embed(computed, finer.shape, split, False)
        active = _differ(corners, split)
        part = 0
        while True:
            missing = np.flatnonzero(_points_of(active, finer.shape, split) & ~computed)
            if missing.size:
                part += 1
                stage = Stage(f"level-{level}-{part}", finer, runner.chunk, missing)
                results = runner.complete(stage, progress)
                parts.append((missing, results))
                classes.flat[missing] = _classes(runner, results, missing.size)
                computed.flat[missing] = True
            contradicted = _contradicted(corners, classes, computed, split) & ~active
            if not contradicted.any():
                break
            active |= contradicted
        _fill(corners, classes, computed, active, split)
        grid = finer
    return grid, _assemble(runner, grid, parts, classes, computed)


def _classes(runner: StageRunner, results: ResultRows, size: int) -> _Classes:
    blocks = [
        runner.work.values("response_class", results.read(start, min(start + _BLOCK, size)))
        for start in range(0, size, _BLOCK)
    ]
    return np.concatenate(blocks).astype(np.int8)


def _split(grid: Grid) -> _Split:
    """Return which axes are refined, in the order of counting."""
    return tuple(grid.axes[name].dtype.kind == "f" and grid.axes[name].size > 1 for name in grid.order)


def _finer_index(index: _Index, grid: Grid, finer: Grid) -> _Index:
    places = np.unravel_index(index, grid.shape)
    doubled = tuple(2 * at if halved else at for at, halved in zip(places, _split(grid), strict=True))
    return np.ravel_multi_index(doubled, finer.shape).astype(np.int64)


def _embed(coarse: NDArray, shape: tuple[int, ...], split: _Split, fill: int) -> NDArray:
    fine = np.full(shape, fill, dtype=coarse.dtype)
    fine[tuple(slice(None, None, 2) if halved else slice(None) for halved in split)] = coarse
    return fine


def _corner_views(coarse: _Classes, split: _Split) -> list[_Classes]:
    """Return the corners of all cells, one array for each corner; along an axis that is not refined a cell is a point."""
    cells = tuple(count - 1 if halved else count for count, halved in zip(coarse.shape, split, strict=True))
    offsets = product(*((0, 1) if halved else (0,) for halved in split))
    return [coarse[tuple(slice(o, o + c) for o, c in zip(at, cells, strict=True))] for at in offsets]


def _fine_slices(shape: tuple[int, ...], split: _Split) -> list[tuple[slice, ...]]:
    """Return for each of the 3^d points of a refined cell its slices of the fine grid, for all cells at once."""
    offsets = product(*((0, 1, 2) if halved else (0,) for halved in split))
    cells = tuple((count - 1) // 2 if halved else count for count, halved in zip(shape, split, strict=True))
    return [
        tuple(
            slice(o, o + 2 * c - 1, 2) if halved else slice(0, c) for o, c, halved in zip(at, cells, split, strict=True)
        )
        for at in offsets
    ]


def _differ(coarse: _Classes, split: _Split) -> _Mask:
    """Return the cells whose corners have different classes."""
    first, *others = _corner_views(coarse, split)
    different = np.zeros(first.shape, dtype=bool)
    for other in others:
        different |= other != first
    return different


def _points_of(active: _Mask, shape: tuple[int, ...], split: _Split) -> _Mask:
    inside = np.zeros(shape, dtype=bool)
    for at in _fine_slices(shape, split):
        inside[at] |= active
    return inside


def _contradicted(corners: _Classes, fine: _Classes, computed: _Mask, split: _Split) -> _Mask:
    """Return the cells with a computed point whose class is not that of the first corner."""
    expected = _corner_views(corners, split)[0]
    found = np.zeros(expected.shape, dtype=bool)
    for at in _fine_slices(fine.shape, split):
        found |= computed[at] & (fine[at] != expected)
    return found


def _fill(corners: _Classes, fine: _Classes, computed: _Mask, active: _Mask, split: _Split) -> None:
    expected = _corner_views(corners, split)[0]
    for at in _fine_slices(fine.shape, split):
        fine[at] = np.where(computed[at] | active, fine[at], expected)


def _assemble(
    runner: StageRunner, grid: Grid, parts: list[tuple[_Index, ResultRows]], classes: _Classes, computed: _Mask
) -> RefinedRows:
    work = runner.work
    columns = work.unfinished(grid.size, RunStatus.FILLED)
    columns.integers[:, work.integers.index("response_class")] = classes.ravel()
    for index, results in parts:
        for start in range(0, index.size, _BLOCK):
            rows = index[start : start + _BLOCK]
            block = results.read(start, start + rows.size)
            columns.integers[rows], columns.numbers[rows] = block
    return RefinedRows(columns, computed)
