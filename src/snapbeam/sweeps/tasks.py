"""What is computed at each point of a sweep: its runs, as rows of two plain tables."""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Iterable
from dataclasses import astuple, dataclass, fields
from functools import cached_property
from importlib.metadata import PackageNotFoundError, version
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from snapbeam._version import __version__
from snapbeam.model.state import State
from snapbeam.model.system import System
from snapbeam.simulation.save import code_flags
from snapbeam.solver.compilation import fingerprint
from snapbeam.solver.statistics import Statistic, rows_for
from snapbeam.sweeps.points import Columns, Points
from snapbeam.sweeps.replicates import Replicates, perturbed_start
from snapbeam.sweeps.setup import Progress, SweepSetup, variable_attributes
from snapbeam.util.provenance import (
    arithmetic_hash,
    array_hash,
    canonical_json,
    code_hash,
    parameter_hash,
    processor_name,
)
from snapbeam.util.status_codes import ResponseClass, RunStatus

__all__ = [
    "CLASSES",
    "Keeper",
    "Maker",
    "MemoryKeeper",
    "PointWork",
    "ResultTable",
    "Rows",
    "Stage",
    "chunk_size",
    "differences",
    "this_maker",
]


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


# ----------------------------------------------------------------------------------------------------
# Stages of a map, cut into tasks: which points each holds, and the results of a finished stage.


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


# ----------------------------------------------------------------------------------------------------
# What computes: everything beside the parameters that the digits of a number depend on.


_WORDS = {
    "version": "version of snapbeam",
    "code": "state of its code",
    "libraries": "version of NumPy, Numba or Python",
    "arithmetic": "kind of rounding in NumPy and its linear algebra",
    "processor": "type of processor",
}


@dataclass(frozen=True)
class Maker:
    """What computes in one process."""

    version: str
    code: str
    libraries: str
    arithmetic: str
    processor: str


def this_maker(system: System) -> Maker:
    """What computes here, for a system with its law of contact and its drive."""
    return Maker(__version__, _code(system), _libraries(), arithmetic_hash(), processor_name())


def _code(system: System) -> str:
    """Of the package, and of a law or a drive that somebody else wrote."""
    parts = [system.contact, system.striker and system.striker.drive]
    foreign = tuple(
        type(part) for part in parts if part and not type(part).__module__.startswith("snapbeam.")
    )
    mark = fingerprint(foreign) if foreign else ""
    if not mark:
        return code_hash() if not foreign else f"{code_hash()}+?"
    return f"{code_hash()}+{hashlib.sha256(mark.encode()).hexdigest()[:8]}"


def _libraries() -> str:
    found = []
    for name in ("numpy", "numba"):
        try:
            found.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            found.append(f"{name} of unknown version")
    return ", ".join([*found, f"python {platform.python_version()}"])


def differences(makers: Iterable[Maker]) -> list[str]:
    """In words, what is not the same among them; nothing if there is at most one."""
    columns = list(zip(*map(astuple, makers), strict=True))
    names = [field.name for field in fields(Maker)]
    return [_WORDS[name] for name, values in zip(names, columns, strict=False) if len(set(values)) > 1]
