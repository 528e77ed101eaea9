"""Checkpoint of a sweep: Zarr arrays with the results, a log of finished tasks and a lock for the writer.

Layout of the folder::

    map.json       the parameters
    tasks.jsonl    one record for each finished task, written and synced after its data
    lock           locked while a process writes
    runs.zarr/     one group for each stage, with the arrays ``integers`` and ``numbers``: one row for each run and
                   one chunk for each task

The task log and the hashes of the data determine which tasks are finished, never the fill values of the arrays.
"""

from __future__ import annotations

import asyncio
import errno
import json
import os
import warnings
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from snapbeam.sweeps.checkpoint.records import (
    PARTIAL,
    CheckpointError,
    CheckpointLock,
    TaskLog,
    TaskRecord,
    durable_write,
    member,
    refuse_links,
)
from snapbeam.sweeps.points import Grid
from snapbeam.sweeps.setup import SweepSetup
from snapbeam.sweeps.tasks import (
    PointWork,
    Provenance,
    ResultRows,
    ResultTable,
    Stage,
    chunk_size,
    differences,
    provenance_of,
)
from snapbeam.util.input_files import input_bytes
from snapbeam.util.provenance import canonical_json, parameter_hash
from snapbeam.util.validation import InputError, file_path, integer, shown

if TYPE_CHECKING:
    from zarr.core.buffer import Buffer

FORMAT = {"format": "snapbeam checkpoint", "format_version": 5}
_KNOWN = {"map.json", "tasks.jsonl", "lock", "runs.zarr"}
BASE = "base"
"""Name of the stage that contains all points of a sweep that was not extended."""
_SAME = 1e-12
"""Relative difference up to which a requested value is a value of the checkpoint: ranges of different length round
their values differently."""
_Index = NDArray[np.int64]
_DATA = "runs.zarr"
_TABLES = ("integers", "numbers")
_NOT_HERE = (errno.EROFS, errno.EACCES, errno.EPERM)


# The description of a checkpoint: reading it, and comparing it with the requested sweep.


def axes_apart(there: Mapping[str, Any], here: Mapping[str, Any]) -> dict[str, int]:
    """Return for each axis the number of values of one sweep that the other sweep does not have."""
    return {
        name: len(set(values) - set(here[name]))
        for name, values in there.items()
        if isinstance(values, list) and isinstance(here.get(name), list)
    }


def checkpoint_folder(path: str | Path) -> Path:
    """Return the folder of a checkpoint, which may not exist yet; its parent must exist."""
    if not isinstance(path, (str, Path)):
        raise InputError(f"checkpoint = {shown(path)}: must be a folder")
    folder = file_path("checkpoint", path)
    if folder.exists() and not folder.is_dir():
        raise InputError(f"checkpoint = {str(path)!r}: must be a folder, not a file")
    if not folder.parent.is_dir():
        raise InputError(f"checkpoint = {str(path)!r}: {str(folder.parent)!r} is not an existing folder")
    return folder


def refuse_foreign(folder: Path) -> None:
    """Refuse a folder that is not empty and is not a checkpoint, before anything is written into it."""
    names = {entry.name for entry in folder.iterdir() if not entry.name.endswith(PARTIAL)}
    if "map.json" not in names and names - _KNOWN:
        raise InputError(f"checkpoint = {str(folder)!r}: is not empty and is not a checkpoint; give another folder")


def read_description(file: Path) -> dict[str, Any]:
    """Return the contents of map.json."""
    data = input_bytes("checkpoint", file)
    try:
        held = json.loads(data)
        described = {name: held[name] for name in FORMAT}
        sound = (
            isinstance(held["parameters"], dict)
            and held["parameter_hash"] == parameter_hash(held["parameters"])
            and isinstance(held["points_per_task"], int)
            and 1 <= held["points_per_task"] < 2**63
        )
    except _NO_DESCRIPTION:
        raise _damaged(file) from None
    if described != FORMAT:
        raise InputError(
            f"checkpoint = {str(file.parent)!r}: has the format {described}, not {FORMAT}; give another folder"
        )
    if not sound:
        raise _damaged(file)
    return dict(held)


_NO_DESCRIPTION = (ValueError, KeyError, TypeError, AttributeError, IndexError, OverflowError, RecursionError)


@contextmanager
def reading(file: Path) -> Iterator[None]:
    """Refuse a description whose hash is right but whose contents are not those of a sweep."""
    try:
        yield
    except InputError:
        raise
    except _NO_DESCRIPTION as error:
        raise _damaged(file) from error


def _damaged(file: Path) -> CheckpointError:
    return CheckpointError(
        f"checkpoint = {str(file.parent)!r}: map.json is damaged; restore it from a copy, or give another folder"
    )


def read_stored_config(path: str | Path) -> dict[str, Any] | None:
    """Return the parameter file of a checkpoint as nested plain values; None if it has none."""
    file = checkpoint_folder(path) / "map.json"
    if not file.exists():
        return None
    if file.is_symlink():
        raise InputError(f"checkpoint = {str(path)!r}: 'map.json' is a link or not a plain file")
    config = read_description(file).get("config")
    return config if isinstance(config, dict) else None


def read_stored_points(path: str | Path) -> dict[str, Any] | None:
    """Return the points of a checkpoint by dotted name; None if there is no checkpoint."""
    file = Path(path) / "map.json"
    if file.is_symlink() or not file.is_file():
        return None
    points = read_description(file)["parameters"].get("points")
    return points if isinstance(points, dict) else None


def refuse_other(path: Path, held: dict[str, Any], wanted: dict[str, Any]) -> None:
    """Refuse a checkpoint whose parameters differ from those of the requested sweep; lists the differences."""
    there, here = _flat(held), _flat(wanted)
    lines = [
        f"  {name}: {_brief(there.get(name))} in the checkpoint, {_brief(here.get(name))} requested"
        for name in sorted(there.keys() | here.keys())
        if there.get(name) != here.get(name)
    ]
    if lines:
        lines += [f"  {words}" for words in _advice(held, wanted)]
        raise InputError(
            f"checkpoint = {str(path)!r}: contains a sweep with other parameters; give another folder, or the same "
            "parameters\n" + "\n".join(lines)
        )


def _advice(held: dict[str, Any], wanted: dict[str, Any]) -> list[str]:
    """Return advice for the two changes that users expect to work: more cycles, and fewer values of an axis."""
    found = []
    cycles = [each.get("integration", {}).get("cycles") for each in (held, wanted)]
    if cycles[0] != cycles[1]:
        found.append(
            "A finished run cannot be continued: a checkpoint contains the statistics of each run, not its final "
            f"state. Request the {cycles[0]} cycles of the checkpoint, or give another folder for {cycles[1]}."
        )
    there, here = held.get("points", {}), wanted.get("points", {})
    for name, count in axes_apart(there, here).items():
        if count:
            found.append(
                f"A checkpoint can only be extended: {count} of its {len(there[name])} values of {name} are not among "
                "the requested values. Request these values too (a list, or a longer range of the same spacing), or "
                "give another folder."
            )
    return found


def _flat(values: dict[str, Any], before: str = "") -> dict[str, Any]:
    """Return nested parameters by dotted name."""
    found: dict[str, Any] = {}
    for name, value in values.items():
        full = f"{before}{name}"
        found |= _flat(value, f"{full}.") if isinstance(value, dict) else {full: value}
    return found


def _brief(value: Any) -> str:
    if isinstance(value, list) and len(value) > 4 and isinstance(value[0], (int, float)):
        return f"{len(value)} points from {value[0]:g} to {value[-1]:g}"
    if isinstance(value, list) and len(value) > 4:
        return f"an array of {len(value)} rows"
    return "nothing" if value is None else f"{value!r}"


# Extending a checkpoint: the sweep is requested again with more values of its axes, and only new points are computed.
#
# Each extension is a stage of its own, with the points that the sweep before did not have.  No result is written
# again: an extended checkpoint contains the stages of its earlier sweeps and one more.


@dataclass(frozen=True, eq=False)
class RefinementLayer:
    """Points that a checkpoint got when its sweep was first requested, or in one extension."""

    work: PointWork
    """Work of the sweep that was requested then."""
    stage: Stage
    places: _Index
    """Numbers of the points of the stage in the present grid."""


@dataclass(frozen=True, eq=False)
class JoinedRows:
    """Rows of the layers of a checkpoint, in the order of the present grid."""

    layers: Sequence[RefinementLayer]
    rows: Sequence[ResultRows]

    def read(self, start: int, stop: int) -> ResultTable:
        """Return the rows *start* to *stop*."""
        found = self.layers[-1].work.unfinished(stop - start)
        for layer, rows in zip(self.layers, self.rows, strict=True):
            own = np.flatnonzero((layer.places >= start) & (layer.places < stop))
            if not own.size:
                continue
            first = int(own[0])
            part = rows.read(first, int(own[-1]) + 1)
            found.integers[layer.places[own] - start] = part.integers[own - first]
            found.numbers[layer.places[own] - start] = part.numbers[own - first]
        return found


def is_growth(held: Mapping[str, Any], wanted: Mapping[str, Any]) -> bool:
    """Return whether the parameters *wanted* differ from *held* only by additional values of some axes."""
    there, here = held.get("points"), wanted.get("points")
    if not isinstance(there, dict) or not isinstance(here, dict) or there == here:
        return False
    if {**held, "points": None} != {**wanted, "points": None} or there.keys() != here.keys():
        return False
    return not any(axes_apart(there, here).values()) and all(isinstance(each, list) for each in here.values())


def grown(description: Mapping[str, Any], wanted: Mapping[str, Any], names: Sequence[str]) -> dict[str, Any]:
    """Return the description of a checkpoint after an extension, without its new hash."""
    before = {"points": description["parameters"]["points"], "axes": description["axes"]}
    layers = [*description.get("grown", []), before]
    return {**description, "parameters": dict(wanted), "axes": list(names), "grown": layers}


def layers_of(work: PointWork, earlier: Sequence[Mapping[str, Any]], chunk: int) -> list[RefinementLayer]:
    """Return the layers of a checkpoint: those of its *earlier* sweeps, as :func:`grown` stores them, and of *work*."""
    now = work.setup.points
    if not isinstance(now, Grid):  # a list of points cannot be extended
        return [RefinementLayer(work, Stage(BASE, now, chunk), np.arange(now.size))]
    grids = [
        Grid({name: np.array(each["points"][name], now.axes[name].dtype) for name in each["axes"]}) for each in earlier
    ]
    for grid in grids:  # before any array over their points is made
        for name, values in now.axes.items():
            if len(set(grid.axes[name].tolist())) < grid.axes[name].size or not np.isin(grid.axes[name], values).all():
                raise ValueError(f"{name}: is no part of the extended axis")
    found = []
    for number, grid in enumerate([*grids, now]):
        own = replace(work, setup=work.setup.with_points(grid)) if grid is not now else work
        which = None if number == 0 else _beyond(grid, grids[number - 1])
        stage = Stage(BASE if number == 0 else f"more-{number}", grid, chunk, which)
        rows = np.arange(grid.size) if which is None else which
        found.append(RefinementLayer(own, stage, _places(grid, now, rows)))
    return found


def _beyond(grid: Grid, before: Grid) -> _Index:
    """Return the numbers of the points of a grid that the one before does not contain."""
    known = np.ones(grid.shape, dtype=bool)
    for at, name in enumerate(grid.order):
        shape = [1] * len(grid.shape)
        shape[at] = -1
        known &= np.isin(grid.axes[name], before.axes[name]).reshape(shape)
    return np.flatnonzero(~known)


def _places(grid: Grid, now: Grid, which: _Index) -> _Index:
    """Return the numbers of points of a grid in a grid that contains all of them."""
    at = dict(zip(grid.order, np.unravel_index(which, grid.shape), strict=True))
    places = []
    for name in now.order:
        number = {value: place for place, value in enumerate(now.axes[name].tolist())}
        own = np.array([number[value] for value in grid.axes[name].tolist()], dtype=np.int64)
        places.append(own[at[name]])
    return np.ravel_multi_index(tuple(places), now.shape).astype(np.int64)


def snapped(setup: SweepSetup, path: str | os.PathLike[str] | None) -> tuple[SweepSetup, str]:
    """Replace values of the axes that differ from those of a checkpoint only by rounding.

    Returns the sweep, and a note about the replaced values, which is empty if there are none.
    """
    points = setup.points
    if path is None or not isinstance(points, Grid):
        return setup, ""
    held = read_stored_points(Path(path))
    if held is None or held.keys() != points.axes.keys():
        return setup, ""
    axes, moved, most = {}, 0, 0.0
    for name, values in points.axes.items():
        with reading(Path(path) / "map.json"):
            stored = np.unique(held[name]) if isinstance(held[name], list) else np.zeros(0)
        axes[name] = values
        if values.dtype.kind != "f" or stored.dtype.kind != "f" or not stored.size:
            continue
        after = stored[np.clip(np.searchsorted(stored, values), 0, stored.size - 1)]
        before = stored[np.clip(np.searchsorted(stored, values) - 1, 0, stored.size - 1)]
        near = np.where(np.abs(values - before) < np.abs(after - values), before, after)
        apart = np.abs(values - near)
        same = (apart > 0.0) & (apart <= _SAME * np.abs(near))
        axes[name] = np.where(same, near, values)
        moved, most = moved + int(same.sum()), max(most, float(apart[same].max(initial=0.0)))
    if not moved:
        return setup, ""
    words = (
        f"{moved} values of the axes differ from those of the checkpoint only by rounding, by at most {most:.1g}; the "
        "values of the checkpoint are used"
    )
    return setup.with_points(Grid(axes, points.units)), words


class Checkpoint:
    """Checkpoint of one sweep, open for writing; a context manager, because it holds the lock.

    Parameters
    ----------
    path : path
        Folder of the checkpoint; it is created if its parent exists.
    work : PointWork
        Computation of the points.
    chunk : int, optional
        Points per task of a new checkpoint.
    config : dict, optional
        Parameter file of the sweep, stored so that the sweep can be resumed without the file.
    grow : bool
        True if the sweep of an existing checkpoint may get more values of its axes.

    Raises
    ------
    InputError
        If the folder is not a checkpoint, contains links, or contains a sweep with other parameters; the message
        lists the differences.
    CheckpointError
        If another process is writing the checkpoint, or its description is damaged.
    """

    def __init__(
        self,
        path: str | Path,
        work: PointWork,
        chunk: int | None = None,
        config: dict[str, Any] | None = None,
        grow: bool = False,
    ) -> None:
        self.path = checkpoint_folder(path)
        self.work = work
        if chunk is not None:
            chunk = integer("points_per_task", chunk, 1, 10**7)
        try:
            self.path.mkdir(exist_ok=True)
        except OSError as error:
            raise self._cannot_write(error) from error
        refuse_foreign(self.path)
        self._lock = CheckpointLock(self.path / "lock")
        self.read_only = False
        """True if the file system is read-only."""
        try:
            self._take_lock()
            refuse_links(self.path, sweep=not self.read_only)
            self.task_log = TaskLog(self.path / "tasks.jsonl")
            self.layers: list[RefinementLayer] = []
            """Layers of an extended checkpoint; empty for any other."""
            self.chunk = self._describe(chunk, config, grow)
        except BaseException:
            self.close()
            raise
        self.damaged: list[tuple[str, int]] = []
        """Tasks whose data did not match the task log when the checkpoint was opened."""
        self._arrays: dict[str, Any] = {}
        self.provenance = provenance_of(work.setup.system)
        """Versions, code and processor of this process."""
        self._model = work.model_hash()
        self._warn_of_mixture()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Release the lock."""
        self._lock.__exit__(None, None, None)

    def _take_lock(self) -> None:
        try:
            self._lock.__enter__()
        except OSError as error:
            self.read_only = error.errno in _NOT_HERE and (self.path / "map.json").is_file()
            if not self.read_only:
                raise self._cannot_write(error) from error

    def _describe(self, chunk: int | None, config: dict[str, Any] | None, grow: bool) -> int:
        file = self.path / "map.json"
        wanted = json.loads(canonical_json(self.work.parameters))
        if file.exists():
            held = read_description(file)
            with reading(file):
                if grow and type(self.work) is PointWork and is_growth(held["parameters"], wanted):
                    held = self._grown(file, held, wanted, config)
                refuse_other(self.path, held["parameters"], wanted)
            if "grown" in held:
                with reading(file):
                    self.layers = layers_of(self.work, held["grown"], held["points_per_task"])
            return int(held["points_per_task"])
        setup = self.work.setup
        chunk = chunk_size(setup.points.size) if chunk is None else chunk
        held = FORMAT | {"parameters": wanted, "parameter_hash": parameter_hash(wanted), "points_per_task": chunk}
        if isinstance(setup.points, Grid):  # the parameters are sorted by name, so the order of the axes is separate
            held["axes"] = list(setup.points.names)
        if config is not None:
            held["config"] = config
        self._write_description(file, held)
        return chunk

    def _grown(
        self, file: Path, held: dict[str, Any], wanted: dict[str, Any], config: dict[str, Any] | None
    ) -> dict[str, Any]:
        """Write the description of a checkpoint whose sweep is requested with more values of its axes."""
        if any(stage.startswith("level-") for stage, _ in self.task_log.records):
            raise InputError(
                f"checkpoint = {str(self.path)!r}: contains a refined sweep, which cannot be extended; give another "
                "folder"
            )
        now = grown(held, wanted, self.work.setup.points.names) | {"parameter_hash": parameter_hash(wanted)}
        if config is not None:
            now["config"] = config
        self._write_description(file, now)
        return now

    def _write_description(self, file: Path, held: dict[str, Any]) -> None:
        try:
            durable_write(file, (json.dumps(held, indent=1) + "\n").encode())
        except OSError as error:
            raise self._cannot_write(error) from error

    def work_of(self, stage: Stage) -> PointWork:
        """Return the work of a stage: that of the present sweep, or of the sweep before an extension."""
        return next((layer.work for layer in self.layers if layer.stage.name == stage.name), self.work)

    def _warn_of_mixture(self) -> None:
        done = [record for record in self.task_log.records.values() if record.state == "done"]
        by = list(map(_recorded_provenance, done))
        if words := _mixture([*by, self.provenance], {*(r.model for r in done), self._model}):
            others = (r for r, own in zip(done, by, strict=True) if own != self.provenance or r.model != self._model)
            other = next(others)
            warnings.warn(
                f"the checkpoint was started with snapbeam {other.version} on a {other.processor} processor and is continued with "
                f"snapbeam {self.provenance.version} on {self.provenance.processor}: its results are identical {words}",
                stacklevel=4,
            )

    def open_stage(self, stage: Stage) -> None:
        """Check every finished task of a stage against the task log, and drop those that are damaged."""
        member(stage.name)
        if not self.read_only:
            try:
                self._arrays[stage.name] = open_tables(self.path / _DATA, stage, self.work_of(stage))
            except OSError as error:
                raise self._cannot_write(error) from error
        for task in range(stage.tasks):
            record = self.task_log.records.get((stage.name, task))
            if record is None or record.state != "done":
                continue
            known = record.parameters == self.work_of(stage).task_hash(stage.columns(task))
            if not known or self._load(stage, task) is None:
                del self.task_log.records[stage.name, task]
                self.damaged.append((stage.name, task))

    def pending(self, stage: Stage) -> list[int]:
        """Return the tasks of a stage that are not finished; failed tasks are included."""
        records = self.task_log.records
        return [
            task
            for task in range(stage.tasks)
            if (record := records.get((stage.name, task))) is None or record.state != "done"
        ]

    def damaged_in(self, stage: Stage) -> list[int]:
        """Return the tasks of a stage that were damaged when the stage was opened."""
        return [task for name, task in self.damaged if name == stage.name]

    def commit(self, stage: Stage, task: int, columns: ResultTable, provenance: Provenance | None = None) -> None:
        """Write and sync the results of a task, and then record the task as done."""
        start, stop = stage.bounds(task)
        if any(len(table) != stop - start for table in columns):
            raise CheckpointError(
                f"task {task} of stage {stage.name}: {len(columns.integers)} rows, not {stop - start}"
            )
        try:
            for name, table in zip(_TABLES, columns, strict=True):
                self._arrays[stage.name][name][start:stop] = table
            self._record(stage, task, "done", columns.content_hash(), provenance or self.provenance)
        except OSError as error:
            raise self._cannot_write(error) from error

    def fail(self, stage: Stage, task: int, reason: str) -> None:
        """Record that a task could not be computed, with the reason."""
        try:
            self._record(stage, task, "failed", reason, self.provenance)
        except OSError as error:
            raise self._cannot_write(error) from error

    def _record(self, stage: Stage, task: int, state: str, content: str, provenance: Provenance) -> None:
        setup = self.work.setup
        parameters = self.work_of(stage).task_hash(stage.columns(task))
        record = TaskRecord(
            stage=stage.name, task=task, state=state, parameters=parameters, content=content,
            engine=setup.integration.engine, step=setup.plan.step, model=self._model, **asdict(provenance),
        )  # fmt: skip
        self.task_log.write(record)

    def _cannot_write(self, error: OSError) -> CheckpointError:
        what = "make room" if error.errno in (errno.ENOSPC, errno.EDQUOT) else "make it writable"
        return CheckpointError(
            f"checkpoint = {str(self.path)!r}: cannot be written, {error.strerror or error}; no finished task is "
            f"lost: {what} and give the same command again"
        )

    def _load(self, stage: Stage, task: int) -> ResultTable | None:
        """Return the results of a finished task; None if they do not match the task log."""
        return read_task(self.path, stage, self.work_of(stage), self.task_log.records[stage.name, task])

    def reader(self, stage: Stage) -> ResultRows:
        """Return the results of a stage, which are read when they are needed."""
        if self.layers and stage.name == BASE:
            return JoinedRows(self.layers, [CheckpointRows(self, layer.stage) for layer in self.layers])
        return CheckpointRows(self, stage)

    def made_with(self) -> dict[str, str]:
        """Return attributes: what computed the finished tasks, and whether the results are reproducible."""
        done = [record for record in self.task_log.records.values() if record.state == "done"]
        kinds = Counter((record.engine, _recorded_provenance(record)) for record in done)
        made = "; ".join(
            f"{count} tasks by engine {engine}, snapbeam {by.version}, processor {by.processor}, {by.libraries}, "
            f"code {by.code}, arithmetic {by.arithmetic}"
            for (engine, by), count in kinds.items()
        )
        words = _mixture([by for _, by in kinds], {record.model for record in done})
        same = words or "bitwise identical for any tasks, order of tasks, threads, workers and interruptions"
        failed = [record for record in self.task_log.records.values() if record.state == "failed"]
        attrs = {"computed_by": made, "reproducible": same}
        if failed:
            attrs["failed_tasks"] = "; ".join(f"{r.stage} {r.task}: {r.content}" for r in failed)
        return attrs


def _recorded_provenance(record: TaskRecord) -> Provenance:
    return Provenance(**{field.name: getattr(record, field.name) for field in fields(Provenance)})


def _mixture(provenances: list[Provenance], models: set[str]) -> str:
    """Return how far results of several provenances agree; an empty text if they are bitwise identical."""
    found = differences(provenances)
    if len(models) > 1 and not found:
        found = ["reduction of the model"]
    if not found:
        return ""
    how = "only as far as the code agrees" if {"code", "version"} & _apart(provenances) else "to rounding, not bitwise"
    return f"{how}: more than one {' and '.join(found)} was used"


def _apart(provenances: list[Provenance]) -> set[str]:
    return {name for name in ("version", "code") if len({getattr(each, name) for each in provenances}) > 1}


class CheckpointRows:
    """Rows of a stage, read from its checkpoint; points that are not computed have the status NOT_RUN."""

    def __init__(self, store: Checkpoint, stage: Stage) -> None:
        self.store = store
        self.stage = stage

    def read(self, start: int, stop: int) -> ResultTable:
        """Return the rows *start* to *stop*, after comparing each task with the task log again."""
        store, stage, parts = self.store, self.stage, []
        for task in range(start // stage.chunk, -(-stop // stage.chunk)):
            first, last = stage.bounds(task)
            record = store.task_log.records.get((stage.name, task))
            if record is not None and record.state == "done":
                columns = store._load(stage, task)
                if columns is None:
                    raise CheckpointError(
                        f"checkpoint = {str(store.path)!r}: task {task} of stage {stage.name} was damaged after "
                        "it was checked; give the same command again to repair it"
                    )
            else:
                columns = store.work.unfinished(last - first)
            parts.append(columns.read(max(start - first, 0), min(stop, last) - first))
        return store.work.join(parts)


# The Zarr arrays of a checkpoint: one row for each run, one chunk with a check sum for each task.


def read_task(folder: Path, stage: Stage, work: PointWork, record: TaskRecord) -> ResultTable | None:
    """Return the results of a finished task; None if they are missing or do not match its record.

    The descriptions of the Zarr arrays, which could request any codec and any size, are not used.
    """
    from numcodecs.checksum32 import CRC32C
    from numcodecs.zstd import Zstd

    start, stop = stage.bounds(record.task)
    parts = []
    for name, (kind, columns) in _tables(work).items():
        rows = np.empty(_chunks(stage, len(columns)), np.dtype(kind).newbyteorder("<"))
        file = folder / _DATA / stage.name / name / f"c.{record.task}.0"
        try:
            data = input_bytes("checkpoint", file, 2 * rows.nbytes + 1024)
            Zstd().decode(CRC32C().decode(data), rows)  # fails if the data are longer than the rows
        except (InputError, ValueError, RuntimeError):
            return None
        parts.append(rows[: stop - start])
    table = ResultTable(*parts)
    return table if table.content_hash() == record.content else None


def open_tables(folder: Path, stage: Stage, work: PointWork) -> dict[str, Any]:
    """Open the arrays of a stage for writing; creates missing arrays and repairs damaged descriptions."""
    import zarr
    from zarr.storage import MemoryStore

    held: dict[str, Buffer] = {}
    fresh = MemoryStore(held)
    _create(fresh, stage, work)
    folder.mkdir(exist_ok=True)
    for key, value in held.items():
        path, data = folder / key, value.to_bytes()
        if not path.is_file() or path.stat().st_size != len(data) or path.read_bytes() != data:
            path.parent.mkdir(parents=True, exist_ok=True)
            durable_write(path, data)
    store = _durable_store(folder)
    return {
        name: zarr.open_array(store, path=f"{stage.name}/{name}", mode="r+", config=_CONFIG) for name in _tables(work)
    }


_CONFIG: Any = {"write_empty_chunks": True}


def _tables(work: PointWork) -> dict[str, tuple[str, tuple[str, ...]]]:
    return {"integers": ("int32", work.integers), "numbers": ("float64", work.numbers)}


def _chunks(stage: Stage, columns: int) -> tuple[int, int]:
    """Return the shape of a chunk: one task.  The number in map.json may be any, and whole chunks are allocated."""
    return max(min(stage.chunk, stage.size), 1), columns


def _create(store: Any, stage: Stage, work: PointWork) -> None:
    import zarr
    from zarr.codecs import Crc32cCodec, ZstdCodec

    zarr.create_group(store)
    zarr.create_group(store, path=stage.name, attributes={"parameter_hash": work.parameter_hash})
    for name, (kind, columns) in _tables(work).items():
        zarr.create_array(
            store,
            name=f"{stage.name}/{name}",
            shape=(stage.size, len(columns)),
            chunks=_chunks(stage, len(columns)),
            dtype=kind,
            compressors=[ZstdCodec(level=1), Crc32cCodec()],
            fill_value=0,
            chunk_key_encoding={"name": "default", "separator": "."},
            dimension_names=("run", "column"),
            attributes={"columns": list(columns)},
            config=_CONFIG,
        )


def _durable_store(folder: Path) -> Any:
    from zarr.storage import LocalStore

    class DurableStore(LocalStore):
        """Local Zarr store that syncs every chunk."""

        async def set(self, key: str, value: Buffer) -> None:
            await asyncio.to_thread(durable_write, self.root / key, value.to_bytes())

        def set_sync(self, key: str, value: Buffer) -> None:
            durable_write(self.root / key, value.to_bytes())

    return DurableStore(folder)
