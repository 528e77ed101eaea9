"""Sweeps that take long: kept in a store, resumed, spread over a cluster, refined, repeated."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from snapbeam.sweeps.checkpoint.records import CheckpointError
from snapbeam.sweeps.checkpoint.store import BASE, MapStore, snapped
from snapbeam.sweeps.distributed import (
    Cluster,
    ClusterWorkers,
    Failure,
    HereWorkers,
    Workers,
    open_client,
    parse_cluster,
)
from snapbeam.sweeps.export import to_dataset, to_netcdf
from snapbeam.sweeps.points import Points
from snapbeam.sweeps.refine import MAX_LEVELS, RefinedRows, refine
from snapbeam.sweeps.replicates import Replicates
from snapbeam.sweeps.setup import Progress, SweepSetup
from snapbeam.sweeps.tasks import Keeper, MemoryKeeper, PointWork, ResultTable, Rows, Stage
from snapbeam.util.files import check_writable
from snapbeam.util.netcdf import write_netcdf
from snapbeam.util.validation import InputError, InputTypeError, flag, integer, shown

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["CheckpointOptions", "SweepReport", "compute_sweep", "compute_table"]


Note = Callable[[str], object]


_POINT_BYTES = 700
"""Memory that a point of a sweep takes until its dataset is made."""
_MEMORY = 4 * 2**30
_MOST_POINTS = 10**9


class _Incomplete(Exception):
    """A stage that is only checked has tasks that were never done."""


@dataclass
class SweepReport:
    """What happened while a sweep was computed."""

    tasks: int = 0
    """Tasks of the stages so far."""
    resumed: int = 0
    """Tasks that were done before."""
    computed: int = 0
    damaged: list[tuple[str, int]] = field(default_factory=list)
    """Tasks whose stored data were damaged, by stage and number."""
    failed: list[tuple[str, int, str]] = field(default_factory=list)
    """Tasks that were given up, and why."""
    runs: int = 0
    """Runs computed now, repeats included."""
    missing: int = 0
    """Tasks that are not done, when a store is only verified."""


@dataclass(frozen=True, eq=False)
class CheckpointOptions:
    """Where a sweep is kept while it is computed, and how.

    Parameters
    ----------
    path : path, optional
        Folder of the store; in memory if none is given.
    check_checkpoint : bool
        Check every finished task of the store and compute again only those that are damaged; points that
        were never computed stay unknown.
    points_per_task : int, optional
        Points of a task of a new store.
    config : dict, optional
        Parameters to keep in the store as a parameter file would hold them.
    note : callable, optional
        Called as ``note(text)`` with what there is to say.
    report : SweepReport, optional
        Filled with what was computed, kept, damaged and given up.
    """

    path: str | os.PathLike[str] | None = None
    check_checkpoint: bool = False
    points_per_task: int | None = None
    config: dict[str, Any] | None = None
    note: Note | None = None
    report: SweepReport | None = None

    def __post_init__(self) -> None:
        if self.path is not None and not isinstance(self.path, (str, os.PathLike)):
            raise InputTypeError(f"store = {shown(self.path)}: must be a folder")
        flag("check_checkpoint", self.check_checkpoint)
        if self.path is None and self.check_checkpoint:
            raise InputError("verify: needs a store")
        if self.path is not None and self.check_checkpoint and not (Path(self.path) / "map.json").is_file():
            raise InputError(f"store = {str(self.path)!r}: there is no map to verify")


def _scattered(task: int) -> float:
    """Order in which any few tasks lie all over the map, so that the time left is told well from the start."""
    return task * 0.6180339887498949 % 1.0


class StoreKeeper:
    """A sweep kept in a store: finished tasks are read, damaged and missing ones are computed."""

    def __init__(self, store: MapStore, workers: Workers, keeping: CheckpointOptions) -> None:
        self.store = store
        self.work = store.work
        self.chunk = store.chunk
        self.workers = workers
        self.tally = SweepReport() if keeping.report is None else keeping.report
        self.note: Note = keeping.note if keeping.note is not None else (lambda _: None)
        self.only_damaged = keeping.check_checkpoint

    def complete(self, stage: Stage, progress: Progress | None = None) -> Rows:
        """Compute the tasks of a stage that are not done, committing each; of a store that has grown, of each layer."""
        layers = [layer.stage for layer in self.store.layers] if stage.name == BASE else []
        stages = layers or [stage]
        missing = sum(
            [self._complete(each, progress) for each in stages]
        )  # each of them, whatever is missing
        if missing:
            self.tally.missing = missing
            raise _Incomplete
        return self.store.reader(stage)

    def _complete(self, stage: Stage, progress: Progress | None) -> int:
        """Complete one stage; how many of its tasks are missing, if only damaged ones are computed."""
        store, tally = self.store, self.tally
        store.open_stage(stage)
        damaged, pending = store.damaged_in(stage), store.pending(stage)
        tally.tasks += stage.tasks
        tally.resumed += stage.tasks - len(pending)
        tally.damaged += [(stage.name, task) for task in damaged]
        if damaged:
            self.note(
                f"{stage.name}: {len(damaged)} of {stage.tasks} tasks were damaged and are computed again"
            )
        todo = sorted(damaged if self.only_damaged else pending, key=_scattered)
        if todo and store.read_only:
            raise CheckpointError(
                f"store = {str(store.path)!r}: is read-only, and {len(todo)} of {stage.tasks} tasks are to be computed"
            )
        sizes = {task: int(np.diff(stage.bounds(task))[0]) for task in todo}
        total, done = sum(sizes.values()), 0
        if total < stage.size and not self.only_damaged:
            self.note(f"{stage.name}: {stage.size - total} of {stage.size} points are done; {total} to go")

        def report(inside: int) -> None:
            if progress is not None:
                progress(done + inside, total)

        for task, result in self.workers.run(self.work, stage, todo, report):
            if isinstance(result, Failure):
                store.fail(stage, task, result.reason)
                tally.failed.append((stage.name, task, result.reason))
                self.note(f"{stage.name}: task {task} was given up: it {result.reason}")
            else:
                store.commit(stage, task, result.columns, result.maker)
                tally.computed += 1
                tally.runs += sizes[task] * self.work.runs_per_point
            done += sizes[task]
            report(0)
        return len(store.pending(stage)) if self.only_damaged else 0


def compute_sweep(
    setup: SweepSetup,
    keeping: CheckpointOptions,
    *,
    cluster: str | None = None,
    refine_levels: int = 0,
    replicas: Replicates | None = None,
    output: str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Compute a sweep that was checked; see :func:`snapbeam.sweep`."""
    levels = integer("refine_levels", refine_levels, 0, MAX_LEVELS)
    if replicas is not None and not isinstance(replicas, Replicates):
        raise InputTypeError(f"replicas = {shown(replicas)}: must be a number of repeats, or Replicates")
    if progress is not None and not callable(progress):
        raise InputTypeError(f"progress = {shown(progress)}: must be callable, as progress(done, total)")
    target = None if output is None else check_writable(output, "output", (".nc",))
    asked = None if cluster is None else parse_cluster(cluster)
    if keeping.path is None and asked is not None:
        raise InputError("cluster: needs a store")
    _require_room(setup.points.size, keeping)
    setup, words = snapped(setup, keeping.path)
    if words and keeping.note is not None:
        keeping.note(words)
    work = PointWork(setup, replicas)
    with _keeper(work, keeping, asked) as keeper:
        points, rows = _computed(keeper, levels, progress)
        more = {} if not isinstance(keeper, StoreKeeper) else keeper.store.made_with()
        return _result(work, points, rows, more, target)


def _require_room(points: int, keeping: CheckpointOptions) -> None:
    """Refuse a sweep whose results would not fit, before anything is computed."""
    size = points * _POINT_BYTES
    if keeping.path is None and size > _MEMORY:
        raise InputError(
            f"{points} points would take {size / 2**30:.3g} GiB of memory, the limit is {_MEMORY / 2**30:.0f} GiB: "
            "give fewer points, or a store"
        )
    if points > _MOST_POINTS:
        raise InputError(f"{points} points: must be at most {_MOST_POINTS}")


def _computed(keeper: Keeper, levels: int, progress: Progress | None) -> tuple[Points, Rows]:
    points = keeper.work.setup.points
    base = Stage(BASE, points, keeper.chunk)
    try:
        return refine(keeper, levels, progress) if levels else (points, keeper.complete(base, progress))
    except _Incomplete:
        assert isinstance(keeper, StoreKeeper)
        return points, keeper.store.reader(base)


@contextmanager
def _keeper(work: PointWork, keeping: CheckpointOptions, cluster: Cluster | None) -> Iterator[Keeper]:
    threads = work.setup.integration.threads
    if keeping.path is None:
        yield MemoryKeeper(work, threads)
        return
    path, grow = Path(keeping.path), not keeping.check_checkpoint
    with MapStore(path, work, keeping.points_per_task, keeping.config, grow=grow) as kept:
        if cluster is None:
            yield StoreKeeper(kept, HereWorkers(threads), keeping)
            return
        with open_client(cluster) as client:
            note = keeping.note if keeping.note is not None else (lambda _: None)
            yield StoreKeeper(kept, ClusterWorkers(client, note), keeping)


def _result(
    work: PointWork, points: Points, rows: Rows, more: dict[str, Any], target: Path | None
) -> xr.Dataset:
    import xarray as xr

    if work.replicas is not None:
        repeats = work.replicas
        more |= {
            "replicas": repeats.count,
            "perturbation_rms": repeats.perturbation_rms,
            "replicate_seed": repeats.seed,
            "check_half_step": int(repeats.check_half_step),
        }
    attrs = work.setup.attributes(more=more)
    if isinstance(rows, RefinedRows):
        attrs["points_computed"] = int(rows.computed.sum())
        attrs["points_inferred"] = int(points.size - rows.computed.sum())
        dataset = to_dataset(work, points, rows, attrs)
        labels = {"units": "1", "long_name": "whether the point was run; if not, its class was inferred"}
        dataset["computed"] = (points.dims, points.arranged(rows.computed.ravel()), labels)
        if target is None:
            return dataset
        write_netcdf(dataset, target)
    elif target is None:
        return to_dataset(work, points, rows, attrs)
    else:
        to_netcdf(work, points, rows, attrs, target)
    return xr.open_dataset(target, engine="h5netcdf")


def compute_table(
    work: PointWork,
    keeping: CheckpointOptions,
    *,
    cluster: str | None = None,
    progress: Progress | None = None,
) -> tuple[ResultTable, dict[str, Any]]:
    """Compute any work over the points of its sweep, kept and resumed as a sweep is.

    Returns
    -------
    table : ResultTable
        A row a point, in the order of counting.
    made_with : dict
        What the store says of how it was made.
    """
    if progress is not None and not callable(progress):
        raise InputTypeError(f"progress = {shown(progress)}: must be callable, as progress(done, total)")
    asked = None if cluster is None else parse_cluster(cluster)
    if keeping.path is None and asked is not None:
        raise InputError("cluster: needs a store")
    with _keeper(work, keeping, asked) as keeper:
        points, rows = _computed(keeper, 0, progress)
        table = rows.read(0, points.size)
        return table, {} if not isinstance(keeper, StoreKeeper) else keeper.store.made_with()
