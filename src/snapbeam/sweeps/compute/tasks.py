"""Stages of a map, cut into tasks: which points each holds, and the results of a finished stage."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from snapbeam.sweeps.compute.task import Columns, Recipe
from snapbeam.sweeps.sweep import Grid, Points, Progress

__all__ = ["Book", "MemoryBook", "Results", "Stage", "chunk_size"]


@dataclass(frozen=True, eq=False)
class Stage:
    """Points computed together: all of a grid, or the listed ones, cut into tasks of *chunk* points."""

    name: str
    grid: Grid
    chunk: int
    which: NDArray[np.int64] | None = None

    @property
    def size(self) -> int:
        """Number of points."""
        return self.grid.size if self.which is None else self.which.size

    @property
    def tasks(self) -> int:
        """Number of tasks."""
        return -(-self.size // self.chunk)

    def bounds(self, task: int) -> tuple[int, int]:
        """First point of a task and the one after its last."""
        return task * self.chunk, min((task + 1) * self.chunk, self.size)

    def points(self, task: int) -> Points:
        """The points of a task."""
        start, stop = self.bounds(task)
        return self.grid.take(np.arange(start, stop) if self.which is None else self.which[start:stop])


class Results(Protocol):
    """Rows of results of a stage, in the order of its points."""

    def read(self, start: int, stop: int) -> Columns: ...


class Book(Protocol):
    """Where the stages of a map are computed and kept."""

    recipe: Recipe
    chunk: int

    def complete(self, stage: Stage, progress: Progress | None = None) -> Results:
        """Compute what is missing of a stage and return its results."""
        ...


def chunk_size(points: int, engine: str) -> int:
    """Points of a task: some two hundred tasks a map, each large enough to keep the cores busy.

    What a run gives does not depend on it.
    """
    low, high = (64, 4096) if engine == "cpu" else (4096, 65536)
    return int(np.clip(-(-points // 200), low, high))


class _Rows:
    def __init__(self, columns: Columns) -> None:
        self.columns = columns

    def read(self, start: int, stop: int) -> Columns:
        return Columns(self.columns.integers[start:stop], self.columns.numbers[start:stop])


class MemoryBook:
    """A map that lives in memory and is gone with the process."""

    def __init__(self, recipe: Recipe, threads: int | None = None) -> None:
        self.recipe = recipe
        self.threads = threads
        self.chunk = max(recipe.setup.grid.size, 1)

    def complete(self, stage: Stage, progress: Progress | None = None) -> Results:
        """Compute the stage in one go."""
        points = stage.grid.take(np.arange(stage.size) if stage.which is None else stage.which)
        return _Rows(self.recipe.compute(points, self.threads, progress))
