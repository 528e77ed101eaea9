"""What is computed at each point of a sweep: its runs, as rows of two plain tables."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.codes import ResponseClass, RunStatus
from snapbeam.core.provenance import array_hash, canonical_json, parameter_hash
from snapbeam.engines.each import rows_for
from snapbeam.engines.outcomes import Statistic
from snapbeam.model.state import State
from snapbeam.model.system import System
from snapbeam.runs.save import code_flags
from snapbeam.sweeps.points import Columns
from snapbeam.sweeps.replicas import Replicates, perturbed_start
from snapbeam.sweeps.setup import Progress, SweepSetup, variable_attributes

__all__ = ["CLASSES", "PointWork", "ResultTable"]

CLASSES = tuple(ResponseClass)
"""Classes in the order in which repeats are counted."""
_COUNTS = tuple(f"runs_{kind.name.lower()}" for kind in CLASSES)
_HALVED = "response_half_step"


class ResultTable(NamedTuple):
    """Results of runs: whole numbers and real numbers, a row a run."""

    integers: NDArray[np.int32]
    numbers: NDArray[np.float64]

    def content_hash(self) -> str:
        """SHA-256 of what the tables hold."""
        digest = hashlib.sha256()
        tables: tuple[tuple[NDArray[Any], str], ...] = ((self.integers, "<i4"), (self.numbers, "<f8"))
        for table, kind in tables:
            digest.update(f"{table.shape}".encode())
            digest.update(np.ascontiguousarray(table, dtype=kind).tobytes())
        return digest.hexdigest()


@dataclass(frozen=True, eq=False)
class PointWork:
    """How the points of a sweep become rows of results, repeats included."""

    setup: SweepSetup
    replicas: Replicates | None = None

    @cached_property
    def statistics(self) -> dict[str, Statistic]:
        """The table's rows, with those of each of several strikers."""
        return rows_for(1 + len(self.setup.system.further_contacts))

    @cached_property
    def integers(self) -> tuple[str, ...]:
        """Names of the columns of whole numbers."""
        names = [name for name, row in self.statistics.items() if row.dtype != "float64"]
        if self.replicas is not None:
            names += [*_COUNTS, _HALVED] if self.replicas.check_half_step else _COUNTS
        return tuple(names)

    @cached_property
    def numbers(self) -> tuple[str, ...]:
        """Names of the columns of real numbers."""
        return tuple(name for name, row in self.statistics.items() if row.dtype == "float64")

    @property
    def runs_per_point(self) -> int:
        """Runs that a point takes."""
        return 1 if self.replicas is None else self.replicas.runs

    @cached_property
    def parameters(self) -> dict[str, Any]:
        """Everything the numbers depend on, plain: what two maps must share to be one."""
        found = self.setup.identity() | {"statistics": list(self.statistics)}
        if self.replicas is not None:
            found["replicas"] = {
                "count": self.replicas.count,
                "size": self.replicas.perturbation_rms,
                "seed": self.replicas.seed,
                "check_half_step": self.replicas.check_half_step,
            }
        return found

    @cached_property
    def parameter_hash(self) -> str:
        """SHA-256 of :attr:`parameters`."""
        return parameter_hash(self.parameters)

    def task_hash(self, points: Columns) -> str:
        """SHA-256 of the parameters and of the points of one task."""
        places = {name: array_hash(values) for name, values in points.items()}
        return hashlib.sha256((self.parameter_hash + canonical_json(places)).encode()).hexdigest()

    def model_hash(self) -> str:
        """SHA-256 of the model's numbers, which may differ in their last digits between processors."""
        model = self.setup.system.model
        digest = hashlib.sha256()
        for values in (model.mass, model.stiffness, model.omega, model.linear_modes, model.well_amplitude):
            digest.update(np.ascontiguousarray(values).tobytes())
        return digest.hexdigest()

    def compute(
        self, points: Columns, threads: int | None = None, progress: Progress | None = None
    ) -> ResultTable:
        """Integrate every run of *points*, repeats included."""
        setup, size = self.setup, next(iter(points.values())).size
        total = size * self.runs_per_point
        before = 0

        def report(done: int, _: int) -> None:
            if progress is not None:
                progress((before + done) // self.runs_per_point, size)

        results = setup.march(points, threads, report)
        if self.replicas is not None:
            repeats, replicas = [results["response_class"]], self.replicas
            for repeat in range(replicas.count):
                before += size

                def start(system: System, state: State | None, number: int = repeat) -> State:
                    return perturbed_start(system, replicas, number, state)

                repeats.append(setup.march(points, threads, report, start=start)["response_class"])
            if replicas.check_half_step:
                before = total - size
                repeats.append(setup.march(points, threads, report, step_factor=0.5)["response_class"])
                results[_HALVED] = repeats[-1]
            kinds = np.array(repeats)
            results |= {
                name: (kinds == kind).sum(axis=0) for name, kind in zip(_COUNTS, CLASSES, strict=True)
            }
        return ResultTable(
            np.stack([results[name] for name in self.integers], axis=1).astype(np.int32),
            np.stack([results[name] for name in self.numbers], axis=1).astype(np.float64),
        )

    def unfinished(self, size: int, status: RunStatus = RunStatus.NOT_RUN) -> ResultTable:
        """Rows of points that were not computed: class unknown, and the status that says why."""
        integers = np.zeros((size, len(self.integers)), dtype=np.int32)
        integers[:, self.integers.index("response_class")] = ResponseClass.UNKNOWN
        integers[:, self.integers.index("status")] = status
        if _HALVED in self.integers:
            integers[:, self.integers.index(_HALVED)] = ResponseClass.UNKNOWN
        return ResultTable(integers, np.full((size, len(self.numbers)), np.nan))

    def variables(self) -> dict[str, tuple[str, bool, dict[str, Any]]]:
        """Kind, whether there is one value a class, and attributes of each variable of the map."""
        variables = {
            name: (row.dtype, False, variable_attributes(name)) for name, row in self.statistics.items()
        }
        if self.replicas is not None:
            labels = {"units": "1", "long_name": "share of the runs of a point, by response class"}
            variables["class_fraction"] = ("float64", True, labels)
            if self.replicas.check_half_step:
                labels = {"units": "1", "long_name": "response class with the step halved"}
                variables[_HALVED] = ("int8", False, labels | code_flags(ResponseClass))
        return variables

    def values(self, name: str, columns: ResultTable) -> NDArray[Any]:
        """One variable of the map from rows of results, shape (runs,) or (runs, classes)."""
        if name == "class_fraction":
            first = self.integers.index(_COUNTS[0])
            counts = columns.integers[:, first : first + len(CLASSES)]
            total = counts.sum(axis=1, keepdims=True)
            return np.where(total > 0, counts / np.maximum(total, 1), np.nan)
        kind = self.variables()[name][0]
        if name in self.numbers:
            return columns.numbers[:, self.numbers.index(name)].astype(kind)
        return columns.integers[:, self.integers.index(name)].astype(kind)

    def join(self, parts: Iterable[ResultTable]) -> ResultTable:
        """Rows of several parts as one."""
        whole = [self.unfinished(0), *parts]
        return ResultTable(
            np.concatenate([part.integers for part in whole]),
            np.concatenate([part.numbers for part in whole]),
        )
