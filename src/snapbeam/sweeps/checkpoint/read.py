"""A store read as it stands, also while another process writes it: nothing is locked and nothing is written."""

from __future__ import annotations

import itertools
import os
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from snapbeam.model.integration import Integration
from snapbeam.model.system import System
from snapbeam.solver.statistics import rows_for
from snapbeam.sweeps.checkpoint.records import Ledger, Record
from snapbeam.sweeps.checkpoint.store import BASE, layers_of, read_description
from snapbeam.sweeps.export import to_dataset
from snapbeam.sweeps.points import Grid
from snapbeam.sweeps.replicates import Replicates
from snapbeam.sweeps.setup import SweepSetup
from snapbeam.sweeps.tasks import PointWork, ResultTable, Stage
from snapbeam.util.validation import InputError, InputTypeError, file_path, shown

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["read_checkpoint"]


_TABLES = ("integers", "numbers")


def read_checkpoint(checkpoint: str | os.PathLike[str]) -> xr.Dataset:
    """The map of a store as far as it is computed; it may be growing meanwhile.

    Points that are not done, or whose task is just being written, are unknown, with the status NOT_RUN.  Of a sweep
    that refines itself, the points of its first grid are read.

    Parameters
    ----------
    checkpoint : path
        The folder of a sweep over a grid.

    Returns
    -------
    xarray.Dataset
        As :func:`snapbeam.sweep` returns it, with the attributes ``points_done`` and ``points_total``.

    Raises
    ------
    InputError
        If the folder is no store, or holds what cannot be told from its description: a list of points, a recorded
        drive, other statistics.
    CheckpointError
        If its description is damaged.
    """
    if not isinstance(checkpoint, (str, os.PathLike)):
        raise InputTypeError(f"checkpoint = {shown(checkpoint)}: must be a folder")
    folder = file_path("checkpoint", checkpoint)
    file = folder / "map.json"
    if file.is_symlink() or not file.is_file():
        raise InputError(f"store = {str(checkpoint)!r}: holds no map")
    held = read_description(file)
    ledger = Ledger(folder / "ledger.jsonl")
    done: dict[str, dict[int, Record]] = {}
    for (name, task), record in ledger.records.items():
        if record.state == "done":
            done.setdefault(name, {})[task] = record
    work = _work(held, str(checkpoint), {} if "grown" in held else done.get(BASE, {}))
    table, points = work.unfinished(work.setup.points.size), 0
    for layer in layers_of(work, held.get("grown", []), int(held["chunk"])):
        part, count = _rows(folder, layer.work, layer.stage, done.get(layer.stage.name, {}))
        points += count
        table.integers[layer.places], table.numbers[layer.places] = part.integers, part.numbers
    attrs = work.setup.attributes(more={"points_done": points, "points_total": work.setup.points.size})
    return to_dataset(work, work.setup.points, _Table(table), attrs)


class _Table:
    """Rows in memory."""

    def __init__(self, table: ResultTable) -> None:
        self._table = table

    def read(self, start: int, stop: int) -> ResultTable:
        return ResultTable(self._table.integers[start:stop], self._table.numbers[start:stop])


def _work(described: dict[str, Any], name: str, done: dict[int, Record]) -> PointWork:
    """What is computed, from its description.

    Its parameters are sorted by name; the description says in which order the axes were given, in which points are
    counted.  Stores of earlier versions do not say it: there the hash of a finished task tells.
    """
    held, chunk = described["parameters"], int(described["chunk"])
    strikers = sum(section.split("_")[0] == "striker" for section in held["system"])
    if held.get("statistics") != list(rows_for(strikers)):
        raise InputError(f"store = {shown(name)}: was written with other statistics than this version has")
    axes = {axis: values for axis, values in held["points"].items() if isinstance(values, list)}
    if len(axes) < len(held["points"]) or not axes:
        raise InputError(
            f"store = {shown(name)}: holds a list of points, which is read once the sweep has returned it"
        )
    sections = held["system"]
    if any(isinstance(value, dict) for values in sections.values() for value in values.values()):
        raise InputError(f"store = {shown(name)}: was driven by a record, which is too long to be kept in it")
    system = System.from_mapping({
        section: {key: np.array(value) if isinstance(value, list) else value for key, value in values.items()}
        for section, values in sections.items()
    })  # fmt: skip
    integration = Integration(**held["integration"])
    repeats = Replicates(**held["replicas"]) if "replicas" in held else None
    number, record = next(iter(done.items()), (0, None))
    given = described.get("axes")
    known = isinstance(given, list) and sorted(map(str, given)) == sorted(axes)
    orders: Iterable[Any] = [given] if known else itertools.permutations(axes)
    for order in orders:
        points = Grid({axis: np.array(axes[axis]) for axis in order})
        work = PointWork(SweepSetup(system, integration, points), repeats)
        if record is None or work.task_hash(Stage(BASE, points, chunk).columns(number)) == record.parameters:
            return work
    raise InputError(
        f"store = {shown(name)}: its tasks are not those of its description, or of another version"
    )


def _rows(folder: Path, work: PointWork, stage: Stage, done: dict[int, Record]) -> tuple[ResultTable, int]:
    """The rows of every point, unknown where they are not done, and how many are done."""
    found = work.unfinished(stage.size)
    points = 0
    if not done:
        return found, points
    try:
        import zarr
    except ImportError as error:
        raise InputError("zarr is needed to read a store: install snapbeam[cluster]") from error
    try:
        arrays = [
            zarr.open_array(folder / "runs.zarr", path=f"{stage.name}/{name}", mode="r") for name in _TABLES
        ]
    except (OSError, ValueError, KeyError):  # it is just being made
        return found, points
    for task, record in done.items():
        if not 0 <= task < stage.tasks:
            continue
        start, stop = stage.bounds(task)
        try:
            part = ResultTable(*(np.asarray(array[start:stop]) for array in arrays))
        except Exception:  # whatever a codec makes of bytes that are just being written
            continue
        if part.content_hash() == record.content:
            found.integers[start:stop], found.numbers[start:stop] = part
            points += stop - start
    return found, points
