"""What a sweep keeps of many starts at every point: when each snapped last, and where it ended."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.codes import RunStatus
from snapbeam.dynamics.starts import InitialConditions
from snapbeam.engines.answer import statistics_of
from snapbeam.engines.assemble import cycles_of, make_ensemble, run_columns
from snapbeam.engines.registry import resolve
from snapbeam.sweeps.compute.task import PointWork, ResultTable
from snapbeam.sweeps.points import Columns
from snapbeam.sweeps.setup import Progress

__all__ = ["LifetimeWork"]

_PER_START = ("status", "zero_crossings", "late_crossings", "well", "final")
"""Whole numbers kept of each run: how it ended, crossings in all and in the last quarter, +1 for the well opposite to
the first one and -1 for that, and whether that end is proved."""


@dataclass(frozen=True, eq=False)
class LifetimeWork(PointWork):
    """The points of a sweep, each run from many starts."""

    starts: InitialConditions = field(default_factory=InitialConditions)

    @cached_property
    def integers(self) -> tuple[str, ...]:
        """Names of the columns of whole numbers."""
        return tuple(f"{name}_{s}" for name in _PER_START for s in range(self.starts.count))

    @cached_property
    def numbers(self) -> tuple[str, ...]:
        """Names of the columns of real numbers."""
        return tuple(f"last_snap_{s}" for s in range(self.starts.count))

    @property
    def runs_per_point(self) -> int:
        """Runs that a point takes."""
        return self.starts.count

    @cached_property
    def parameters(self) -> dict[str, Any]:
        """Everything the numbers depend on, plain."""
        kept = list(_PER_START)
        return self.setup.identity() | {"lifetimes": kept, "starts": self.starts.describe()}

    def compute(
        self, points: Columns, threads: int | None = None, progress: Progress | None = None
    ) -> ResultTable:
        """Integrate every run of *points*."""
        size, count = next(iter(points.values())).size, self.starts.count
        integers = np.zeros((len(_PER_START), count, size), dtype=np.int32)
        numbers = np.full((count, size), np.nan)
        cycle = self._cycles(points)
        side = -1 if self.setup.system.striker is None or self.setup.system.striker.side == "below" else 1
        for s in range(count):

            def report(done: int, s: int = s) -> None:
                if progress is not None:
                    progress((s * size + done) // count, size)

            found = self._march(points, s, threads, report)
            integers[0, s], integers[1, s] = found["status"], found["zero_crossings"]
            integers[2, s] = found["zero_crossings_last_quarter"]
            integers[3, s] = np.where(found["final_well"] == side, -1, 1)
            integers[4, s] = found["final_well_proven"]
            numbers[s] = found["last_zero_crossing"] / cycle
        return ResultTable(integers.reshape(-1, size).T.copy(), numbers.T.copy())

    def _march(
        self, points: Columns, number: int, threads: int | None, report: Callable[[int], object]
    ) -> dict[str, NDArray[Any]]:
        """Every point from one start.

        A run ends early where it provably snaps no more, and never because it is sure to be called continuous: how
        long it goes on is what is asked.
        """
        setup, found, done = self.setup, dict[str, NDArray[Any]](), 0
        size = next(iter(points.values())).size
        for system, integration, which, own in setup.groups(points):
            begun = self.starts.state(
                system, number, setup.start_of(system, own), own.get("striker.location")
            )
            columns = {name: values for name, values in own.items() if not name.startswith("start.")}
            ensemble = make_ensemble(system, integration, columns, start=begun)
            ensemble.runs["decide_crossings"] = -1
            engine = resolve(
                integration.engine, modes=system.model.modes, law=ensemble.law, drive=ensemble.drive
            )[1]

            def inside(finished: int, _: int, before: int = done) -> object:
                return report(before + finished)

            accumulators_of_runs = engine.run_ensemble(ensemble, threads, inside)
            for name, values in statistics_of(ensemble, accumulators_of_runs).items():
                found.setdefault(name, np.zeros(size, dtype=values.dtype))[which] = values
            done += which.size
        return found

    def _cycles(self, points: Columns) -> NDArray[np.float64]:
        """Seconds of a cycle of each point."""
        cycle = np.empty(next(iter(points.values())).size)
        for system, _, which, own in self.setup.groups(points):
            columns = {name: values for name, values in own.items() if not name.startswith("start.")}
            cycle[which] = cycles_of(system, run_columns(system, columns))
        return cycle

    def unfinished(self, size: int, status: RunStatus = RunStatus.NOT_RUN) -> ResultTable:
        """Rows of points that were not computed."""
        integers = np.zeros((size, len(self.integers)), dtype=np.int32)
        integers[:, : self.starts.count] = status
        return ResultTable(integers, np.full((size, len(self.numbers)), np.nan))

    def columns(self, table: ResultTable) -> dict[str, NDArray[Any]]:
        """What was kept by name, arrays of shape (points, starts)."""
        count = self.starts.count
        found: dict[str, NDArray[Any]] = {
            name: table.integers[:, i * count : (i + 1) * count] for i, name in enumerate(_PER_START)
        }
        return found | {"last_snap": table.numbers}
