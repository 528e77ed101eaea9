"""A map on disk while it is computed: Zarr for the numbers, a ledger for what is done, a lock for the writer.

Layout of the folder::

    map.json       the parameters
    ledger.jsonl   one record a finished task, written after its data and synced
    lock           held while a process writes
    runs.zarr/     a group a stage; in it ``integers`` and ``numbers``, a row a run, a chunk a task

What is done is read from the ledger and the hash of the data, never from the data's fill values.
"""

from __future__ import annotations

import asyncio
import errno
import json
import os
import warnings
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from snapbeam.sweeps.checkpoint.records import (
    PARTIAL,
    CheckpointError,
    Ledger,
    Record,
    StoreLock,
    durable_write,
    member,
    refuse_links,
)
from snapbeam.sweeps.points import Grid
from snapbeam.sweeps.setup import SweepSetup
from snapbeam.sweeps.tasks import (
    Maker,
    PointWork,
    ResultTable,
    Rows,
    Stage,
    chunk_size,
    differences,
    this_maker,
)
from snapbeam.util.provenance import canonical_json, parameter_hash
from snapbeam.util.validation import InputError, file_path, integer, shown

if TYPE_CHECKING:
    from zarr.core.buffer import Buffer

__all__ = [
    "BASE",
    "FORMAT",
    "JoinedRows",
    "Layer",
    "MapStore",
    "StoredRows",
    "axes_apart",
    "grown",
    "is_growth",
    "layers_of",
    "open_tables",
    "read_description",
    "read_stored_config",
    "read_stored_points",
    "refuse_foreign",
    "refuse_other",
    "snapped",
    "store_folder",
]


# ----------------------------------------------------------------------------------------------------
# What a store says that it holds: read, compared with what is asked for, and refused in words.


FORMAT = {"format": "snapbeam map", "format_version": 3}
"""Of a new store."""
_VERSIONS = (3, 4)
"""4: a store that has grown, which earlier versions would take for another map."""
_KNOWN = {"map.json", "ledger.jsonl", "lock", "runs.zarr"}


def axes_apart(there: Mapping[str, Any], here: Mapping[str, Any]) -> dict[str, int]:
    """How many values of each axis of one map another one has not."""
    return {
        name: len(set(values) - set(here[name]))
        for name, values in there.items()
        if isinstance(values, list) and isinstance(here.get(name), list)
    }


def store_folder(path: str | Path) -> Path:
    if not isinstance(path, (str, Path)):
        raise InputError(f"store = {shown(path)}: must be a folder")
    folder = file_path("store", path)
    if folder.exists() and not folder.is_dir():
        raise InputError(f"store = {str(path)!r}: must be a folder, not a file")
    if not folder.parent.is_dir():
        raise InputError(f"store = {str(path)!r}: {str(folder.parent)!r} is not an existing folder")
    return folder


def refuse_foreign(folder: Path) -> None:
    """Refuse a folder that holds something and no map, before anything is written into it."""
    names = {entry.name for entry in folder.iterdir() if not entry.name.endswith(PARTIAL)}
    if "map.json" not in names and names - _KNOWN:
        raise InputError(f"store = {str(folder)!r}: is not empty and holds no map")


def read_description(file: Path) -> dict[str, Any]:
    damaged = CheckpointError(
        f"store = {str(file.parent)!r}: map.json is damaged; put it back from a copy, or start another store"
    )
    try:
        held = json.loads(file.read_bytes())
        sound = (
            isinstance(held, dict)
            and isinstance(held["parameters"], dict)
            and held["parameter_hash"] == parameter_hash(held["parameters"])
            and isinstance(held["chunk"], int)
            and held["chunk"] >= 1
        )
    except (ValueError, KeyError, RecursionError):
        raise damaged from None
    if not sound:
        raise damaged
    if held.get("format") != FORMAT["format"] or held.get("format_version") not in _VERSIONS:
        raise InputError(
            f"store = {str(file.parent)!r}: was written in another format ({held.get('format_version')})"
        )
    return held


def read_stored_config(path: str | Path) -> dict[str, Any] | None:
    """The parameter file a store keeps, as nested plain values; None if there is none."""
    file = store_folder(path) / "map.json"
    if not file.exists():
        return None
    if file.is_symlink():
        raise InputError(f"store = {str(path)!r}: 'map.json' is a link or no plain file")
    config = read_description(file).get("config")
    return config if isinstance(config, dict) else None


def read_stored_points(path: str | Path) -> dict[str, Any] | None:
    """What a store says of its points, by dotted name; None if there is none."""
    file = Path(path) / "map.json"
    if file.is_symlink() or not file.is_file():
        return None
    points = read_description(file)["parameters"].get("points")
    return points if isinstance(points, dict) else None


def refuse_other(path: Path, held: dict[str, Any], wanted: dict[str, Any]) -> None:
    there, here = _flat(held), _flat(wanted)
    lines = [
        f"  {name}: {_brief(there.get(name))} in the store, {_brief(here.get(name))} asked for"
        for name in sorted(there.keys() | here.keys())
        if there.get(name) != here.get(name)
    ]
    if lines:
        lines += [f"  {words}" for words in _advice(held, wanted)]
        raise InputError(f"store = {str(path)!r}: holds a map of other parameters\n" + "\n".join(lines))


def _advice(held: dict[str, Any], wanted: dict[str, Any]) -> list[str]:
    """What to do about parameters by which people would have a store go on."""
    found = []
    cycles = [each.get("integration", {}).get("cycles") for each in (held, wanted)]
    if cycles[0] != cycles[1]:
        found.append(
            "A finished run is not marched on: a store keeps what came of each run, not the state in which it "
            f"ended. Ask for the store's {cycles[0]} cycles, or give another folder for {cycles[1]}."
        )
    there, here = held.get("points", {}), wanted.get("points", {})
    for name, count in axes_apart(there, here).items():
        if count:
            found.append(
                f"A store only grows: {count} of its {len(there[name])} values of {name} are not among those asked "
                "for. Give values that hold them too, a list or a longer range of the same spacing, or another folder."
            )
    return found


def _flat(values: dict[str, Any], before: str = "") -> dict[str, Any]:
    """Nested parameters by dotted name."""
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


# ----------------------------------------------------------------------------------------------------
# A store that grows: its map is asked for again over more values of its axes, and what it holds is kept as it is.
#
# The points of each map that was asked for, less those of the map before, are a stage of their own.  Nothing that was
# computed is written again: a grown store is the stages of its earlier maps and one more.


BASE = "base"
"""The stage of all points of a map, whatever it grew from."""
_SAME = 1e-12
"""Relative distance within which a value asked for is one that the store has: ranges are rounded as they are cut."""

_Index = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Layer:
    """The points that a store got when its map was asked for, or when it grew."""

    work: PointWork
    """Of the map that was asked for then."""
    stage: Stage
    places: _Index
    """Numbers of the stage's points in the grid that the store has now."""


@dataclass(frozen=True, eq=False)
class JoinedRows:
    """Rows of the layers of a store, in the order of the grid that it has now."""

    layers: Sequence[Layer]
    rows: Sequence[Rows]

    def read(self, start: int, stop: int) -> ResultTable:
        """Rows *start* to *stop*."""
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
    """Whether the parameters *wanted* are those *held* but for more values along some axes."""
    there, here = held.get("points"), wanted.get("points")
    if not isinstance(there, dict) or not isinstance(here, dict) or there == here:
        return False
    if {**held, "points": None} != {**wanted, "points": None} or there.keys() != here.keys():
        return False
    return not any(axes_apart(there, here).values()) and all(isinstance(each, list) for each in here.values())


def grown(description: Mapping[str, Any], wanted: Mapping[str, Any], names: Sequence[str]) -> dict[str, Any]:
    """The description of a store that has grown to other axes, whose hash is still to be written."""
    before = {"points": description["parameters"]["points"], "axes": description["axes"]}
    layers = [*description.get("grown", []), before]
    return {
        **description,
        "parameters": dict(wanted),
        "axes": list(names),
        "grown": layers,
        "format_version": 4,
    }


def layers_of(work: PointWork, earlier: Sequence[Mapping[str, Any]], chunk: int) -> list[Layer]:
    """The layers of a store: of its *earlier* maps as :func:`grown` keeps them, and of *work*, in their order."""
    now = work.setup.points
    if not isinstance(now, Grid):  # a list of points does not grow
        return [Layer(work, Stage(BASE, now, chunk), np.arange(now.size))]
    grids = [
        Grid({name: np.array(each["points"][name], now.axes[name].dtype) for name in each["axes"]})
        for each in earlier
    ]
    found = []
    for number, grid in enumerate([*grids, now]):
        own = replace(work, setup=work.setup.with_points(grid)) if grid is not now else work
        which = None if number == 0 else _beyond(grid, grids[number - 1])
        stage = Stage(BASE if number == 0 else f"more-{number}", grid, chunk, which)
        rows = np.arange(grid.size) if which is None else which
        found.append(Layer(own, stage, _places(grid, now, rows)))
    return found


def _beyond(grid: Grid, before: Grid) -> _Index:
    """The points of a grid that the one before has not."""
    known = np.ones(grid.shape, dtype=bool)
    for at, name in enumerate(grid.order):
        shape = [1] * len(grid.shape)
        shape[at] = -1
        known &= np.isin(grid.axes[name], before.axes[name]).reshape(shape)
    return np.flatnonzero(~known)


def _places(grid: Grid, now: Grid, which: _Index) -> _Index:
    """Numbers of points of a grid in one that holds them all."""
    at = dict(zip(grid.order, np.unravel_index(which, grid.shape), strict=True))
    places = []
    for name in now.order:
        number = {value: place for place, value in enumerate(now.axes[name].tolist())}
        own = np.array([number[value] for value in grid.axes[name].tolist()], dtype=np.int64)
        places.append(own[at[name]])
    return np.ravel_multi_index(tuple(places), now.shape).astype(np.int64)


def snapped(setup: SweepSetup, path: str | os.PathLike[str] | None) -> tuple[SweepSetup, str]:
    """A sweep with the values of a store where it asks for the same but for rounding, and words for that."""
    points = setup.points
    if path is None or not isinstance(points, Grid):
        return setup, ""
    held = read_stored_points(Path(path))
    if held is None or held.keys() != points.axes.keys():
        return setup, ""
    axes, moved, most = {}, 0, 0.0
    for name, values in points.axes.items():
        stored = np.array(held[name]) if isinstance(held[name], list) else np.zeros(0)
        axes[name] = values
        if values.dtype.kind != "f" or stored.dtype.kind != "f" or not stored.size:
            continue
        near = stored[np.abs(values[:, None] - stored[None, :]).argmin(axis=1)]
        apart = np.abs(values - near)
        same = (apart > 0.0) & (apart <= _SAME * np.abs(near))
        axes[name] = np.where(same, near, values)
        moved, most = moved + int(same.sum()), max(most, float(apart[same].max(initial=0.0)))
    if not moved:
        return setup, ""
    words = f"{moved} values of the axes are those of the store, at most {most:.1g} from what was asked for"
    return setup.with_points(Grid(axes)), words


# ----------------------------------------------------------------------------------------------------


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


# ----------------------------------------------------------------------------------------------------
# The Zarr arrays of a store: a row a run, a chunk a task, every chunk with its check sum.


_MISSING = "zarr is needed for --checkpoint: install snapbeam[cluster]"


def open_tables(folder: Path, stage: Stage, work: PointWork, read_only: bool = False) -> dict[str, Any]:
    """The arrays of a stage, made if they are not there; damaged descriptions are written again."""
    try:
        import zarr
    except ImportError as error:
        raise InputError(_MISSING) from error
    from zarr.storage import MemoryStore

    held: dict[str, Buffer] = {}
    fresh = MemoryStore(held)
    _create(fresh, stage, work)
    folder.mkdir(exist_ok=True)
    mode: Any = "r" if read_only else "r+"
    for key, value in held.items():
        path, data = folder / key, value.to_bytes()
        if not path.is_file() or path.read_bytes() != data:
            path.parent.mkdir(parents=True, exist_ok=True)
            durable_write(path, data)
    store = _durable_store(folder)
    return {
        name: zarr.open_array(store, path=f"{stage.name}/{name}", mode=mode, config=_CONFIG)
        for name in _tables(work)
    }


_CONFIG: Any = {"write_empty_chunks": True}


def _tables(work: PointWork) -> dict[str, tuple[str, tuple[str, ...]]]:
    return {"integers": ("int32", work.integers), "numbers": ("float64", work.numbers)}


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
            chunks=(stage.chunk, len(columns)),
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
        """A local store whose chunks are on the disk when a write returns."""

        async def set(self, key: str, value: Buffer) -> None:
            await asyncio.to_thread(durable_write, self.root / key, value.to_bytes())

        def set_sync(self, key: str, value: Buffer) -> None:
            durable_write(self.root / key, value.to_bytes())

    return DurableStore(folder)
