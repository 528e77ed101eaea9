"""Stages of a map, cut into tasks: which points each holds, and the results of a finished stage."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from snapbeam.sweeps.compute.task import PointWork, ResultTable
from snapbeam.sweeps.points import Columns, Points
from snapbeam.sweeps.setup import Progress

__all__ = ["Keeper", "MemoryKeeper", "Rows", "Stage", "chunk_size"]


@dataclass(frozen=True, eq=False)
class Stage:
    """Points computed together: all of a sweep, or the listed ones, cut into tasks of *chunk* points."""

    name: str
    points: Points
    chunk: int
    which: NDArray[np.int64] | None = None

    @property
    def size(self) -> int:
        """Number of points."""
        return self.points.size if self.which is None else self.which.size

    @property
    def tasks(self) -> int:
        """Number of tasks."""
        return -(-self.size // self.chunk)

    def bounds(self, task: int) -> tuple[int, int]:
        """First point of a task and the one after its last."""
        return task * self.chunk, min((task + 1) * self.chunk, self.size)

    def columns(self, task: int) -> Columns:
        """The points of a task."""
        start, stop = self.bounds(task)
        return self.points.take(np.arange(start, stop) if self.which is None else self.which[start:stop])


class Rows(Protocol):
    """Rows of results of a stage, in the order of its points."""

    def read(self, start: int, stop: int) -> ResultTable: ...


class Keeper(Protocol):
    """Where the stages of a map are computed and kept."""

    work: PointWork
    chunk: int

    def complete(self, stage: Stage, progress: Progress | None = None) -> Rows:
        """Compute what is missing of a stage and return its results."""
        ...


def chunk_size(points: int, engine: str) -> int:
    """Points of a task: some two hundred tasks a map, each large enough to keep the cores busy.

    What a run gives does not depend on it.
    """
    low, high = (64, 4096) if engine == "cpu" else (4096, 65536)
    return int(np.clip(-(-points // 200), low, high))


class _Rows:
    def __init__(self, columns: ResultTable) -> None:
        self.columns = columns

    def read(self, start: int, stop: int) -> ResultTable:
        return ResultTable(self.columns.integers[start:stop], self.columns.numbers[start:stop])


class MemoryKeeper:
    """A map that lives in memory and is gone with the process."""

    def __init__(self, work: PointWork, threads: int | None = None) -> None:
        self.work = work
        self.threads = threads
        self.chunk = max(work.setup.points.size, 1)

    def complete(self, stage: Stage, progress: Progress | None = None) -> Rows:
        """Compute the stage in one go."""
        points = stage.points.take(np.arange(stage.size) if stage.which is None else stage.which)
        return _Rows(self.work.compute(points, self.threads, progress))
