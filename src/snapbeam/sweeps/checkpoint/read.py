"""Read a checkpoint, also while another process writes it, without a lock."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from snapbeam.model.integration import Integration
from snapbeam.model.quantity import numbered
from snapbeam.model.system import System
from snapbeam.solver.statistics import rows_for
from snapbeam.sweeps.checkpoint.records import TaskLog, TaskRecord, refuse_links
from snapbeam.sweeps.checkpoint.store import BASE, layers_of, read_description, read_task, reading
from snapbeam.sweeps.export import to_dataset
from snapbeam.sweeps.points import points_of, require_memory
from snapbeam.sweeps.replicates import Replicates
from snapbeam.sweeps.setup import SweepSetup
from snapbeam.sweeps.tasks import PointWork, ResultTable, Stage
from snapbeam.util.validation import InputError, InputTypeError, file_path, shown

if TYPE_CHECKING:
    import xarray as xr


def read_checkpoint(checkpoint: str | os.PathLike[str]) -> xr.Dataset:
    """Read the finished points of a sweep from its checkpoint, also while another process computes the sweep.

    Unfinished points have the class UNKNOWN and the status NOT_RUN. Of a refined sweep the result has the first grid.

    Parameters
    ----------
    checkpoint : path
        Folder of a sweep over a grid.

    Returns
    -------
    xarray.Dataset
        Dataset of :func:`snapbeam.sweep`, with the attributes ``points_done`` and ``points_total``.

    Raises
    ------
    InputError
        If the folder is not a checkpoint, or its description does not determine the sweep: a list of points, a
        recorded motion, or other statistics.
    CheckpointError
        If the description is damaged.

    See Also
    --------
    snapbeam.sweep, snapbeam.CheckpointOptions

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> system = paper.struck_beam(frequency_ratio=1.2, velocity_amplitude=0.18)
    >>> found = sb.sweep(
    ...     system, {"drive.velocity_amplitude": [0.05, 0.2]}, sb.Integration(cycles=2),
    ...     checkpoint=sb.CheckpointOptions("sweep.checkpoint"),
    ... )
    >>> sb.read_checkpoint("sweep.checkpoint")["response_class"].shape
    (2,)
    """
    if not isinstance(checkpoint, (str, os.PathLike)):
        raise InputTypeError(f"checkpoint = {shown(checkpoint)}: must be a folder")
    folder = file_path("checkpoint", checkpoint)
    file = folder / "map.json"
    if file.is_symlink() or not file.is_file():
        raise InputError(f"checkpoint = {str(checkpoint)!r}: is not the folder of a sweep")
    refuse_links(folder, sweep=False)
    held = read_description(file)
    task_log = TaskLog(folder / "tasks.jsonl")
    done: dict[str, dict[int, TaskRecord]] = {}
    for (name, task), record in task_log.records.items():
        if record.state == "done":
            done.setdefault(name, {})[task] = record
    with reading(file):
        work = _work(held, str(checkpoint), {} if "grown" in held else done.get(BASE, {}))
        layers = layers_of(work, held.get("grown", []), held["points_per_task"])
    table, points = work.unfinished(work.setup.points.size), 0
    for layer in layers:
        part, count = _rows(folder, layer.work, layer.stage, done.get(layer.stage.name, {}))
        points += count
        table.integers[layer.places], table.numbers[layer.places] = part.integers, part.numbers
    attrs = work.setup.attributes(more={"points_done": points, "points_total": work.setup.points.size})
    return to_dataset(work, work.setup.points, table, attrs)


def _work(described: dict[str, Any], name: str, done: dict[int, TaskRecord]) -> PointWork:
    """Return the work that a description determines; a finished task must have the same hash."""
    held, chunk = described["parameters"], int(described["points_per_task"])
    strikers = sum(numbered(section)[0] == "contact" for section in held["system"])
    if held.get("statistics") != list(rows_for(strikers)):
        raise InputError(f"checkpoint = {shown(name)}: contains other statistics than this version has")
    axes = {axis: values for axis, values in held["points"].items() if isinstance(values, list)}
    if len(axes) < len(held["points"]) or not axes:
        raise InputError(
            f"checkpoint = {shown(name)}: contains a list of points, not a grid; give the command of the sweep again"
        )
    sections = held["system"]
    if any(isinstance(value, dict) for values in sections.values() for value in values.values()):
        raise InputError(
            f"checkpoint = {shown(name)}: does not contain its recorded motion; give the command of the sweep again"
        )
    system = System.from_mapping({
        section: {key: np.array(value) if isinstance(value, list) else value for key, value in values.items()}
        for section, values in sections.items()
    })  # fmt: skip
    integration = Integration(**held["integration"])
    repeats = Replicates(**held["replicates"]) if "replicates" in held else None
    points = points_of({axis: axes[axis] for axis in described["axes"]})
    require_memory(points.size, "read the file that its command writes with --output")
    setup = SweepSetup(system, integration, points)
    work = PointWork(setup, repeats, metres=setup.length_varies)
    number, record = next(iter(done.items()), (0, None))
    if record is not None and work.task_hash(Stage(BASE, points, chunk).columns(number)) != record.parameters:
        raise InputError(f"checkpoint = {shown(name)}: its tasks do not match its description; compute it again")
    return work


def _rows(folder: Path, work: PointWork, stage: Stage, done: dict[int, TaskRecord]) -> tuple[ResultTable, int]:
    """Return the rows of all points of a stage, and the number of points that are finished."""
    found = work.unfinished(stage.size)
    points = 0
    for task, record in done.items():
        part = read_task(folder, stage, work, record) if 0 <= task < stage.tasks else None
        if part is not None:
            start, stop = stage.bounds(task)
            found.integers[start:stop], found.numbers[start:stop] = part
            points += stop - start
    return found, points
