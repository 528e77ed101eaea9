"""Runs at the points of a sweep as rows of two tables, and the stages and tasks that they are divided into."""

from __future__ import annotations

import hashlib
import inspect
import platform
from collections.abc import Iterable
from dataclasses import asdict, astuple, dataclass, field, fields
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from snapbeam._version import __version__
from snapbeam.model.state import State
from snapbeam.model.system import System
from snapbeam.simulation.save import code_flags
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

CLASSES = tuple(ResponseClass)
"""Response classes in the order of the columns that count replicates."""
_COUNTS = tuple(f"runs_{kind.name.lower()}" for kind in CLASSES)
_HALVED = "response_half_step"


class ResultTable(NamedTuple):
    """Results of runs: integers and real numbers, one row for each run."""

    integers: NDArray[np.int32]
    numbers: NDArray[np.float64]

    def read(self, start: int, stop: int) -> ResultTable:
        """Return the rows *start* to *stop*."""
        return ResultTable(self.integers[start:stop], self.numbers[start:stop])

    def content_hash(self) -> str:
        """SHA-256 of the contents of the tables."""
        digest = hashlib.sha256()
        tables: tuple[tuple[NDArray[Any], str], ...] = ((self.integers, "<i4"), (self.numbers, "<f8"))
        for table, kind in tables:
            digest.update(f"{table.shape}".encode())
            digest.update(np.ascontiguousarray(table, dtype=kind).tobytes())
        return digest.hexdigest()


@dataclass(frozen=True, eq=False)
class PointWork:
    """Computation of rows of results from the points of a sweep, replicates included."""

    setup: SweepSetup
    replicates: Replicates | None = None
    metres: bool = field(default=False, kw_only=True)
    """True if displacements are in m and velocities in m/s, because b differs between the points; else over b."""

    @cached_property
    def statistics(self) -> dict[str, Statistic]:
        """Statistics of the sweep, with those of each of several strikers."""
        return rows_for(len(self.setup.system.contacts))

    @cached_property
    def integers(self) -> tuple[str, ...]:
        """Names of the columns of integers."""
        names = [name for name, row in self.statistics.items() if row.dtype != "float64"]
        if self.replicates is not None:
            names += [*_COUNTS, _HALVED] if self.replicates.check_half_step else _COUNTS
        return tuple(names)

    @cached_property
    def numbers(self) -> tuple[str, ...]:
        """Names of the columns of real numbers."""
        return tuple(name for name, row in self.statistics.items() if row.dtype == "float64")

    @property
    def runs_per_point(self) -> int:
        """Number of runs at each point."""
        return 1 if self.replicates is None else self.replicates.runs

    @cached_property
    def parameters(self) -> dict[str, Any]:
        """Plain values of everything that the results depend on; sweeps with equal values have equal results."""
        found = self.setup.identity() | {"statistics": list(self.statistics)}
        if self.metres:
            found["displacements"] = "m"
        if self.replicates is not None:
            found["replicates"] = asdict(self.replicates)
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
        """SHA-256 of the matrices of the model, whose last digits may differ between processors."""
        model = self.setup.system.model
        digest = hashlib.sha256()
        for values in (model.mass, model.stiffness, model.omega, model.linear_modes, model.well_amplitude):
            digest.update(np.ascontiguousarray(values).tobytes())
        return digest.hexdigest()

    def compute(self, points: Columns, threads: int | None = None, progress: Progress | None = None) -> ResultTable:
        """Integrate all runs of *points*, replicates included."""
        setup, size = self.setup, next(iter(points.values())).size
        total = size * self.runs_per_point
        before = 0

        def report(done: int, _: int) -> None:
            if progress is not None:
                progress((before + done) // self.runs_per_point, size)

        results = setup.integrate(points, threads, report)
        if self.metres:
            length, speed = setup.scales_of(points)
            for name, row in self.statistics.items():
                if row.normalised_by:
                    results[name] = results[name] * (length if row.normalised_by == "b" else speed)
        if self.replicates is not None:
            repeats, replicates = [results["response_class"]], self.replicates
            for repeat in range(replicates.count):
                before += size

                def start(system: System, state: State | None, _: Columns, number: int = repeat) -> State:
                    return perturbed_start(system, replicates, number, state)

                repeats.append(setup.integrate(points, threads, report, start=start)["response_class"])
            if replicates.check_half_step:
                before = total - size
                repeats.append(setup.integrate(points, threads, report, step_factor=0.5)["response_class"])
                results[_HALVED] = repeats[-1]
            kinds = np.array(repeats)
            results |= {name: (kinds == kind).sum(axis=0) for name, kind in zip(_COUNTS, CLASSES, strict=True)}
        return ResultTable(
            np.stack([results[name] for name in self.integers], axis=1).astype(np.int32),
            np.stack([results[name] for name in self.numbers], axis=1).astype(np.float64),
        )

    def unfinished(self, size: int, status: RunStatus = RunStatus.NOT_RUN) -> ResultTable:
        """Return rows of points that were not computed, with the class UNKNOWN and the given status."""
        integers = np.zeros((size, len(self.integers)), dtype=np.int32)
        integers[:, self.integers.index("response_class")] = ResponseClass.UNKNOWN
        integers[:, self.integers.index("status")] = status
        if _HALVED in self.integers:
            integers[:, self.integers.index(_HALVED)] = ResponseClass.UNKNOWN
        return ResultTable(integers, np.full((size, len(self.numbers)), np.nan))

    def variables(self) -> dict[str, tuple[str, bool, dict[str, Any]]]:
        """Return for each variable its data type, whether it has one value for each class, and its attributes."""
        variables = {
            name: (row.dtype, False, variable_attributes(name, self.metres)) for name, row in self.statistics.items()
        }
        if self.replicates is not None:
            labels = {"units": "1", "long_name": "fraction of the runs of a point, by response class"}
            variables["class_fraction"] = ("float64", True, labels)
            if self.replicates.check_half_step:
                labels = {"units": "1", "long_name": "response class with half the step"}
                variables[_HALVED] = ("int8", False, labels | code_flags(ResponseClass))
        return variables

    def values(self, name: str, columns: ResultTable) -> NDArray[Any]:
        """Return one variable from rows of results, of shape (runs,) or (runs, classes)."""
        if name == "class_fraction":
            first = self.integers.index(_COUNTS[0])
            counts = columns.integers[:, first : first + len(CLASSES)]
            total = counts.sum(axis=1, keepdims=True)
            return np.where(total > 0, counts / np.maximum(total, 1), np.nan)
        kind = "int8" if name == _HALVED else self.statistics[name].dtype
        if name in self.numbers:
            return columns.numbers[:, self.numbers.index(name)].astype(kind)
        return columns.integers[:, self.integers.index(name)].astype(kind)

    def join(self, parts: Iterable[ResultTable]) -> ResultTable:
        """Return the rows of several parts as one table."""
        whole = [self.unfinished(0), *parts]
        return ResultTable(
            np.concatenate([part.integers for part in whole]), np.concatenate([part.numbers for part in whole])
        )


# ----------------------------------------------------------------------------------------------------
# Stages of a sweep and their tasks.


@dataclass(frozen=True, eq=False)
class Stage:
    """Points that are computed together, all or some of a sweep, in tasks of *chunk* points."""

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
        """Return the first point of a task and the point after its last."""
        return task * self.chunk, min((task + 1) * self.chunk, self.size)

    def columns(self, task: int) -> Columns:
        """Return the points of a task."""
        start, stop = self.bounds(task)
        return self.points.take(np.arange(start, stop) if self.which is None else self.which[start:stop])


class ResultRows(Protocol):
    """Rows of results of a stage, in the order of its points."""

    def read(self, start: int, stop: int) -> ResultTable:
        """Return the rows *start* to *stop*."""
        ...


class StageRunner(Protocol):
    """Computes the stages of a sweep and stores their results."""

    work: PointWork
    chunk: int

    def complete(self, stage: Stage, progress: Progress | None = None) -> ResultRows:
        """Compute the missing tasks of a stage and return its results."""
        ...


def chunk_size(points: int) -> int:
    """Return the points per task: about 200 tasks for a sweep, each large enough for all cores.

    The results do not depend on it.
    """
    return int(np.clip(-(-points // 200), 64, 4096))


class MemoryRunner:
    """Computes a sweep in memory."""

    def __init__(self, work: PointWork, threads: int | None = None) -> None:
        self.work = work
        self.threads = threads
        self.chunk = max(work.setup.points.size, 1)

    def complete(self, stage: Stage, progress: Progress | None = None) -> ResultRows:
        """Compute all points of the stage."""
        points = stage.points.take(np.arange(stage.size) if stage.which is None else stage.which)
        return self.work.compute(points, self.threads, progress)


# ----------------------------------------------------------------------------------------------------
# Provenance: everything except the parameters that the last digits of a result depend on.


_WORDS = {
    "version": "version of snapbeam",
    "code": "state of its code",
    "libraries": "version of NumPy or Python",
    "arithmetic": "kind of rounding in NumPy and its linear algebra",
    "processor": "type of processor",
}


@dataclass(frozen=True)
class Provenance:
    """Versions, code and processor of a process."""

    version: str
    code: str
    libraries: str
    arithmetic: str
    processor: str


def provenance_of(system: System) -> Provenance:
    """Return the provenance of this process, for a system with its contact law and its drive."""
    libraries = f"numpy {np.__version__}, python {platform.python_version()}"
    return Provenance(__version__, _code(system), libraries, arithmetic_hash(), processor_name())


def _code(system: System) -> str:
    """Return the hash of the code of the package, and of a contact law or drive that is defined outside it."""
    parts: list[object] = [part for each in system.contacts for part in (each.law, each.striker.drive)]
    parts += [*system.forces, *system.harvesters]
    foreign = tuple(type(part) for part in parts if not type(part).__module__.startswith("snapbeam."))
    if not foreign:
        return code_hash()
    digest = hashlib.sha256()
    for kind in foreign:
        try:
            digest.update(Path(inspect.getfile(kind)).read_bytes())
        except (TypeError, OSError):  # of a class typed at a prompt
            return f"{code_hash()}+?"
    return f"{code_hash()}+{digest.hexdigest()[:8]}"


def differences(provenances: Iterable[Provenance]) -> list[str]:
    """Return the names of the parts in which provenances differ; an empty list if they are equal."""
    columns = list(zip(*map(astuple, provenances), strict=True))
    names = [field.name for field in fields(Provenance)]
    return [_WORDS[name] for name, values in zip(names, columns, strict=False) if len(set(values)) > 1]
