"""A map on disk while it is computed: Zarr for the numbers, a ledger for what is done, a lock for the writer.

Layout of the folder::

    map.json       the parameters
    ledger.jsonl   one record a finished task, written after its data and synced
    lock           held while a process writes
    runs.zarr/     a group a stage; in it ``integers`` and ``numbers``, a row a run, a chunk a task

What is done is read from the ledger and the hash of the data, never from the data's fill values.
"""

from __future__ import annotations

import errno
import json
import warnings
from collections import Counter
from dataclasses import asdict, fields
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np

from snapbeam.core.provenance import canonical_json, parameter_hash
from snapbeam.core.validate import InputError, integer
from snapbeam.sweeps.compute.maker import Maker, differences, this_maker
from snapbeam.sweeps.compute.task import PointWork, ResultTable
from snapbeam.sweeps.compute.tasks import Rows, Stage, chunk_size
from snapbeam.sweeps.errors import CheckpointError
from snapbeam.sweeps.keep.description import (
    FORMAT,
    read_description,
    refuse_foreign,
    refuse_other,
    store_folder,
)
from snapbeam.sweeps.keep.durable import StoreLock, durable_write, member, refuse_links
from snapbeam.sweeps.keep.growth import BASE, JoinedRows, Layer, grown, is_growth, layers_of
from snapbeam.sweeps.keep.ledger import Ledger, Record
from snapbeam.sweeps.points import Grid

__all__ = ["MapStore", "StoredRows"]

_DATA = "runs.zarr"
_TABLES = ("integers", "numbers")
_NOT_HERE = (errno.EROFS, errno.EACCES, errno.EPERM)


class MapStore:
    """The store of one map, open for writing.  Use it as a context manager: it holds the store's lock.

    Parameters
    ----------
    path : path
        Folder of the store; made if it is not there, in a folder that is.
    work : PointWork
        What is computed.
    chunk : int, optional
        Points of a task of a new store.
    config : dict, optional
        The parameter file that made the map, kept so that it can be resumed without it.
    grow : bool
        Whether a map that is there may get more values along its axes.

    Raises
    ------
    InputError
        If the folder is no store, holds links, or holds a map of other parameters (the differences are
        listed).
    CheckpointError
        If another process writes it, or its description is damaged.
    """

    def __init__(
        self,
        path: str | Path,
        work: PointWork,
        chunk: int | None = None,
        config: dict[str, Any] | None = None,
        grow: bool = False,
    ) -> None:
        self.path = store_folder(path)
        self.work = work
        if chunk is not None:
            chunk = integer("chunk", chunk, 1, 10**7)
        try:
            self.path.mkdir(exist_ok=True)
        except OSError as error:
            raise self._cannot_write(error) from error
        refuse_foreign(self.path)
        self._lock = StoreLock(self.path / "lock")
        self.read_only = False
        """Whether it stands where nothing can be written, so that it can only be read."""
        try:
            self._take_lock()
            refuse_links(self.path, sweep=not self.read_only)
            self.ledger = Ledger(self.path / "ledger.jsonl")
            self.layers: list[Layer] = []
            """What a store that has grown consists of; empty for any other."""
            self.chunk = self._describe(chunk, config, grow)
        except BaseException:
            self.close()
            raise
        self.damaged: list[tuple[str, int]] = []
        """Tasks whose data did not match the ledger when this store was opened."""
        self._arrays: dict[str, Any] = {}
        self.maker = this_maker(work.setup.system)
        """What computes in this process."""
        self._model = work.model_hash()
        self._warn_of_mixture()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Let another process write the store."""
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
            if grow and type(self.work) is PointWork and is_growth(held["parameters"], wanted):
                held = self._grown(file, held, wanted, config)
            refuse_other(self.path, held["parameters"], wanted)
            if "grown" in held:
                self.layers = layers_of(self.work, held["grown"], int(held["chunk"]))
            return int(held["chunk"])
        setup = self.work.setup
        chunk = chunk_size(setup.points.size, setup.integration.engine) if chunk is None else chunk
        held = FORMAT | {"parameters": wanted, "parameter_hash": parameter_hash(wanted), "chunk": chunk}
        if isinstance(
            setup.points, Grid
        ):  # the parameters are sorted by name: the order of the axes is said apart
            held["axes"] = list(setup.points.names)
        if config is not None:
            held["config"] = config
        self._write_description(file, held)
        return chunk

    def _grown(
        self, file: Path, held: dict[str, Any], wanted: dict[str, Any], config: dict[str, Any] | None
    ) -> dict[str, Any]:
        """Describe a store anew that is asked for more values of its axes."""
        where = f"store = {str(self.path)!r}"
        refined = {stage for stage, _ in self.ledger.records if stage.startswith("level-")}
        if refined:
            raise InputError(
                f"{where}: was refined, and the refinement of a longer map is another one: give another folder"
            )
        if "axes" not in held:
            raise InputError(
                f"{where}: was begun by a version that did not say the order of its axes: give another folder"
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
        """What the tasks of a stage were asked for by: the map that there is, or the one that it has grown from."""
        return next((layer.work for layer in self.layers if layer.stage.name == stage.name), self.work)

    def _warn_of_mixture(self) -> None:
        done = [record for record in self.ledger.records.values() if record.state == "done"]
        if words := _mixture([*map(_maker_of, done), self.maker], {*(r.model for r in done), self._model}):
            version, processor = next(
                (r.version, r.processor) for r in done if _maker_of(r) != self.maker or r.model != self._model
            )
            warnings.warn(
                f"the store was begun with snapbeam {version} on a {processor} processor and goes on with snapbeam "
                f"{self.maker.version} on {self.maker.processor}: its points are equal {words}",
                stacklevel=4,
            )

    def open_stage(self, stage: Stage) -> None:
        """Check every finished task of a stage against the ledger, and drop those that are damaged."""
        from snapbeam.sweeps.keep.tables import open_tables

        member(stage.name)
        try:
            self._arrays[stage.name] = open_tables(
                self.path / _DATA, stage, self.work_of(stage), self.read_only
            )
        except OSError as error:
            raise self._cannot_write(error) from error
        for task in range(stage.tasks):
            record = self.ledger.records.get((stage.name, task))
            if record is None or record.state != "done":
                continue
            if (
                record.parameters != self.work_of(stage).task_hash(stage.columns(task))
                or self._load(stage, task) is None
            ):
                del self.ledger.records[stage.name, task]
                self.damaged.append((stage.name, task))

    def pending(self, stage: Stage) -> list[int]:
        """Tasks of a stage that are not done, those that failed included."""
        records = self.ledger.records
        return [
            task
            for task in range(stage.tasks)
            if (record := records.get((stage.name, task))) is None or record.state != "done"
        ]

    def damaged_in(self, stage: Stage) -> list[int]:
        """Tasks of a stage that were found damaged when it was opened."""
        return [task for name, task in self.damaged if name == stage.name]

    def commit(self, stage: Stage, task: int, columns: ResultTable, maker: Maker | None = None) -> None:
        """Write the results of a task, have them on the disk, and then say in the ledger that it is done."""
        start, stop = stage.bounds(task)
        if any(len(table) != stop - start for table in columns):
            raise CheckpointError(
                f"task {task} of stage {stage.name}: {len(columns.integers)} rows, not {stop - start}"
            )
        try:
            for name, table in zip(_TABLES, columns, strict=True):
                self._arrays[stage.name][name][start:stop] = table
            self._record(stage, task, "done", columns.content_hash(), maker or self.maker)
        except OSError as error:
            raise self._cannot_write(error) from error

    def fail(self, stage: Stage, task: int, reason: str) -> None:
        """Say in the ledger that a task could not be computed, and why."""
        try:
            self._record(stage, task, "failed", reason, self.maker)
        except OSError as error:
            raise self._cannot_write(error) from error

    def _record(self, stage: Stage, task: int, state: str, content: str, maker: Maker) -> None:
        setup = self.work.setup
        self.ledger.write(
            Record(
                stage=stage.name,
                task=task,
                state=state,
                parameters=self.work_of(stage).task_hash(stage.columns(task)),
                content=content,
                engine=setup.integration.engine,
                step=setup.plan.step,
                model=self._model,
                **asdict(maker),
            )
        )

    def _cannot_write(self, error: OSError) -> CheckpointError:
        what = "make room" if error.errno in (errno.ENOSPC, errno.EDQUOT) else "make it writable"
        return CheckpointError(
            f"store = {str(self.path)!r}: cannot be written, {error.strerror or error}; no finished task is "
            f"lost: {what} and give the same command again"
        )

    def _load(self, stage: Stage, task: int) -> ResultTable | None:
        """The results of a finished task, or None if they are not what the ledger says."""
        start, stop = stage.bounds(task)
        try:
            columns = ResultTable(
                *(np.asarray(self._arrays[stage.name][name][start:stop]) for name in _TABLES)
            )
        except Exception:  # whatever a codec makes of damaged bytes
            return None
        return columns if columns.content_hash() == self.ledger.records[stage.name, task].content else None

    def reader(self, stage: Stage) -> Rows:
        """The results of a stage, read as they are asked for."""
        if self.layers and stage.name == BASE:
            return JoinedRows(self.layers, [StoredRows(self, layer.stage) for layer in self.layers])
        return StoredRows(self, stage)

    def made_with(self) -> dict[str, str]:
        """Attributes that say what computed the finished tasks, and how far their numbers can be trusted."""
        done = [record for record in self.ledger.records.values() if record.state == "done"]
        kinds = Counter((record.engine, _maker_of(record)) for record in done)
        made = "; ".join(
            f"{count} tasks by engine {engine}, snapbeam {by.version}, processor {by.processor}, {by.libraries}, "
            f"code {by.code}, arithmetic {by.arithmetic}"
            for (engine, by), count in kinds.items()
        )
        words = _mixture([by for _, by in kinds], {record.model for record in done})
        same = (
            words
            or "bit for bit, whatever the tasks, their order, the threads, the workers and the interruptions"
        )
        failed = [record for record in self.ledger.records.values() if record.state == "failed"]
        attrs = {"computed_by": made, "reproducible": same}
        if failed:
            attrs["failed_tasks"] = "; ".join(f"{r.stage} {r.task}: {r.content}" for r in failed)
        return attrs


def _maker_of(record: Record) -> Maker:
    return Maker(**{field.name: getattr(record, field.name) for field in fields(Maker)})


def _mixture(makers: list[Maker], models: set[str]) -> str:
    """How far numbers agree that several made; nothing where they agree in every bit."""
    found = differences(makers)
    if len(models) > 1 and not found:
        found = ["reduction of the model"]
    if not found:
        return ""
    how = (
        "as far as the code does" if {"code", "version"} & _apart(makers) else "to rounding, not bit for bit"
    )
    return f"{how}: more than one {' and '.join(found)} took part"


def _apart(makers: list[Maker]) -> set[str]:
    return {name for name in ("version", "code") if len({getattr(each, name) for each in makers}) > 1}


class StoredRows:
    """Rows of a stage, read from its store; what is not done is unknown, with the status NOT_RUN."""

    def __init__(self, store: MapStore, stage: Stage) -> None:
        self.store = store
        self.stage = stage

    def read(self, start: int, stop: int) -> ResultTable:
        """Rows *start* to *stop*, each task checked against the ledger again."""
        store, stage, parts = self.store, self.stage, []
        for task in range(start // stage.chunk, -(-stop // stage.chunk)):
            first, last = stage.bounds(task)
            record = store.ledger.records.get((stage.name, task))
            if record is not None and record.state == "done":
                columns = store._load(stage, task)
                if columns is None:
                    raise CheckpointError(
                        f"store = {str(store.path)!r}: task {task} of stage {stage.name} was damaged after "
                        "it was checked; give the same command again to repair it"
                    )
            else:
                columns = store.work.unfinished(last - first)
            cut = slice(max(start - first, 0), min(stop, last) - first)
            parts.append(ResultTable(columns.integers[cut], columns.numbers[cut]))
        return store.work.join(parts)
