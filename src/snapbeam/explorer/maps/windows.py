"""Parts of a map computed anew, from coarse to fine, while the page lives on."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snapbeam import Integration, System, sweep
from snapbeam.explorer.jobs import Jobs, Token
from snapbeam.explorer.limits import WINDOW_POINTS

__all__ = ["Window", "compute", "planned"]

_Array = NDArray[np.float64]
_STRIDES = (27, 9, 3, 1)
"""Cells from one point to the next, level by level; the point of a block is the centre of its middle cell."""
_BATCH_SECONDS = 0.3
_FIRST = 8
"""Points of the first batch, of which the pace is learnt."""
_MOST = 512


@dataclass(eq=False)
class Window:
    """A part of a plane of parameters, on a regular grid of cells.

    Attributes
    ----------
    system, integration : System, Integration
        What is computed; the two axes are set at each point.
    names : pair of str
        Dotted names of the axes across and upward.
    x, y : array of shape (nx,) and (ny,)
        The values at which runs are made, the centres of cells.
    bounds : 4 floats
        Left, right, low and high borders.
    log : pair of bool
    stride : array of int8, shape (ny, nx)
        Cells of the block whose point stands for the cell; 0 where nothing is known.
    values : dict of arrays of shape (ny, nx)
        Statistics by name.
    """

    system: System
    integration: Integration
    names: tuple[str, str]
    x: NDArray[Any]
    y: NDArray[Any]
    bounds: tuple[float, float, float, float]
    log: tuple[bool, bool] = (False, False)
    key: Any = None
    values: dict[str, NDArray[Any]] = field(default_factory=dict)
    stride: NDArray[np.int8] = field(init=False)
    done: int = 0
    seconds: float = 0.0
    version: int = 0
    finished: bool = False
    lock: threading.Lock = field(default_factory=threading.Lock, repr=False)
    """Held by who computes it."""
    writing: threading.Lock = field(default_factory=threading.Lock, repr=False)
    """Held while values and strides do not agree."""

    def __post_init__(self) -> None:
        self.stride = np.zeros((self.y.size, self.x.size), dtype=np.int8)

    @property
    def size(self) -> int:
        """Cells."""
        return int(self.x.size * self.y.size)

    def cell(self, x: float, y: float) -> tuple[int, int]:
        """Row and column of the cell at a place."""
        place = []
        for value, (low, high), log, size in (
            (y, self.bounds[2:], self.log[1], self.y.size),
            (x, self.bounds[:2], self.log[0], self.x.size),
        ):
            share = np.log(value / low) / np.log(high / low) if log else (value - low) / (high - low)
            place.append(int(np.clip(share * size, 0, size - 1)))
        return place[0], place[1]

    def computed_at(
        self, x: float, y: float, stride_of: NDArray[np.int8] | None = None
    ) -> tuple[int, int] | None:
        """Row and column of the point that stands for a place; None if there is none.

        *stride_of* is what ``stride`` was when the window was drawn: cells that have been computed since are not yet
        seen by who clicks on them.
        """
        row, column = self.cell(x, y)
        stride = int((self.stride if stride_of is None else stride_of)[row, column])
        if stride == 0:
            return None
        return _middle(row, stride), _middle(column, stride)

    def own(self) -> NDArray[np.bool_]:
        """Which cells hold a run of their own, not that of the block they lie in; shape (ny, nx)."""
        rows, columns = np.indices(self.stride.shape)
        stride = np.maximum(self.stride.astype(np.int64), 1)
        middle = [at // stride * stride + stride // 2 for at in (rows, columns)]
        found: NDArray[np.bool_] = (self.stride > 0) & (middle[0] == rows) & (middle[1] == columns)
        return found

    def covers(self, x: float, y: float) -> bool:
        """Whether a place lies in it."""
        left, right, low, high = self.bounds
        return left <= x <= right and low <= y <= high


def _middle(at: int, stride: int) -> int:
    return at // stride * stride + stride // 2


def _spread(low: float, high: float, cells: int, log: bool) -> _Array:
    share = (np.arange(cells) + 0.5) / cells
    return np.exp(np.log(low) + share * np.log(high / low)) if log else low + share * (high - low)


def planned(
    system: System,
    integration: Integration,
    names: tuple[str, str],
    bounds: tuple[float, float, float, float],
    log: tuple[bool, bool],
    pixels: tuple[int, int],
    cell: int = 3,
    key: Any = None,
) -> Window:
    """A window whose finest cells are *cell* pixels wide, wider if there would be too many."""
    width = max(cell, 1)
    while (pixels[0] // width + 27) * (pixels[1] // width + 27) > WINDOW_POINTS:
        width += 1
    # whole blocks of the coarsest level, so that the middle of every block is that of a finer one
    nx, ny = (max(round(size / width / _STRIDES[0]), 1) * _STRIDES[0] for size in pixels)
    x, y = _spread(*bounds[:2], nx, log[0]), _spread(*bounds[2:], ny, log[1])
    return Window(system, integration, names, x, y, bounds, log, key)


def _blocks(size: int, stride: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """First cells of the blocks along an axis, and the cells of their points."""
    first = np.arange(0, size, stride)
    return first, first + stride // 2


def compute(window: Window, jobs: Jobs, token: Token, tell: Callable[[Window], None]) -> Window:
    """Fill a window; *tell* is called after every batch.

    Raises
    ------
    Cancelled
        If it is not wanted any more.
    InputError
        For a point that no system has.
    """
    while not window.lock.acquire(timeout=0.1):  # another page has asked for it, and computes it
        token.check()
    try:
        return _filled(window, jobs, token, tell)
    finally:
        window.lock.release()


def _filled(window: Window, jobs: Jobs, token: Token, tell: Callable[[Window], None]) -> Window:
    pace = None
    structural = [not _is_run(name) for name in window.names]
    for stride in _STRIDES:
        (row0, rows), (column0, columns) = _blocks(window.y.size, stride), _blocks(window.x.size, stride)
        todo = [
            (int(a), int(b), int(i), int(j))
            for a, i in zip(row0, rows, strict=True)
            for b, j in zip(column0, columns, strict=True)
            if not 0 < int(window.stride[a, b]) <= stride
        ]
        order = _structure_order(todo, structural)
        at = 0
        while at < len(order):
            batch = _FIRST if pace is None else int(np.clip(_BATCH_SECONDS / pace, 1, _MOST))
            part = order[at : at + batch]
            fresh = [item for item in part if not _known(window, item[2], item[3])]
            found: dict[str, NDArray[Any]] = {}
            if fresh:
                with jobs.turn(token):
                    begun = time.monotonic()
                    found = _run(window, fresh, token)
                spent = (time.monotonic() - begun) / len(fresh)
                first = pace is None
                pace = spent if first or pace is None else 0.5 * (pace + spent)
                window.seconds = pace
            with window.writing:
                for name, values in found.items():
                    held = window.values.setdefault(name, np.zeros(window.stride.shape, dtype=values.dtype))
                    held[[item[2] for item in fresh], [item[3] for item in fresh]] = values
                for a, b, i, j in part:
                    block = (slice(a, a + stride), slice(b, b + stride))
                    for values in window.values.values():
                        values[block] = values[i, j]
                    window.stride[block] = stride
            at += batch
            window.done += len(fresh)
            window.version += 1
            tell(window)
    window.finished = True
    window.version += 1
    return window


def _known(window: Window, row: int, column: int) -> bool:
    """Whether the run of this very cell has been made: it is the point of a coarser block."""
    stride = int(window.stride[row, column])
    return bool(stride and _middle(row, stride) == row and _middle(column, stride) == column)


def _structure_order(
    todo: list[tuple[int, int, int, int]], structural: list[bool]
) -> list[tuple[int, int, int, int]]:
    """Points of one structure after the other; without structures, scattered over the window."""
    if structural[0]:
        return sorted(todo, key=lambda item: item[3])
    if structural[1]:
        return sorted(todo, key=lambda item: item[2])
    return [todo[i] for i in sorted(range(len(todo)), key=lambda i: i * 0.6180339887498949 % 1.0)]


def _is_run(name: str) -> bool:
    from snapbeam.config import lookup

    return lookup(name).is_run


def _run(window: Window, points: list[tuple[int, int, int, int]], token: Token) -> dict[str, NDArray[Any]]:
    """Statistics of some cells, by name."""
    import xarray as xr

    rows = np.array([item[2] for item in points])
    columns = np.array([item[3] for item in points])
    table = xr.Dataset({
        window.names[0]: ("point", window.x[columns]),
        window.names[1]: ("point", window.y[rows]),
    })  # fmt: skip
    spare = max(1, (os.cpu_count() or 2) - 1)  # a run that is clicked on needs a core
    found = sweep(window.system, table, window.integration.replace(threads=spare), progress=token.check)
    return {str(name): item.values for name, item in found.data_vars.items() if item.dims == ("point",)}
