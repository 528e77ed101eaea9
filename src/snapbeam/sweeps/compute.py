"""Computation of a sweep: checkpoints, workers of a cluster, refinement and replicates."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from snapbeam.sweeps.checkpoint.records import CheckpointError
from snapbeam.sweeps.checkpoint.store import BASE, Checkpoint, snapped
from snapbeam.sweeps.distributed import (
    Cluster,
    ClusterWorkers,
    LocalThreads,
    TaskError,
    Workers,
    open_client,
    parse_cluster,
)
from snapbeam.sweeps.export import to_dataset, to_netcdf
from snapbeam.sweeps.points import Points, require_memory
from snapbeam.sweeps.refine import MAX_LEVELS, RefinedRows, refine
from snapbeam.sweeps.replicates import Replicates
from snapbeam.sweeps.setup import Progress, SweepSetup, announce_long_sweep
from snapbeam.sweeps.tasks import MemoryRunner, PointWork, ResultRows, ResultTable, Stage, StageRunner
from snapbeam.util.files import check_writable, require_room
from snapbeam.util.netcdf import write_netcdf
from snapbeam.util.validation import InputError, InputTypeError, flag, integer, shown

if TYPE_CHECKING:
    import xarray as xr

Note = Callable[[str], object]


_MOST_POINTS = 10**9
LEAST_BYTES = 50
"""Bytes of a point in a file of results, at least."""


class _Incomplete(Exception):
    """A stage that is only checked has tasks that were never computed."""


@dataclass
class SweepReport:
    """Counts of computed, resumed, damaged and failed tasks of a sweep.

    See Also
    --------
    snapbeam.sweep, snapbeam.CheckpointOptions

    Examples
    --------
    >>> import snapbeam as sb
    >>> report = sb.SweepReport()
    >>> options = sb.CheckpointOptions("sweep.checkpoint", report=report)  # of sb.sweep(..., checkpoint=options)
    """

    tasks: int = 0
    """Tasks of all stages."""
    resumed: int = 0
    """Tasks that an earlier computation finished."""
    computed: int = 0
    """Tasks that this computation finished."""
    damaged: list[tuple[str, int]] = field(default_factory=list)
    """Stage and number of each task whose stored data were damaged."""
    failed: list[tuple[str, int, str]] = field(default_factory=list)
    """Stage, number and reason of each task that could not be computed."""
    runs: int = 0
    """Runs of this computation, replicates included."""
    missing: int = 0
    """Tasks that are not finished, if the checkpoint is only checked."""


@dataclass(frozen=True, eq=False)
class CheckpointOptions:
    """Settings of a checkpoint: the folder in which a sweep stores its finished tasks.

    Parameters
    ----------
    path : path, optional
        Folder; without it the results stay in memory.
    check_checkpoint : bool
        Check every finished task, and compute only damaged ones again. Points that were never computed have the class
        UNKNOWN.
    points_per_task : int, optional
        Points of a task of a new checkpoint.
    config : dict, optional
        Parameters to store, in the form of a parameter file.
    note : callable, optional
        Function that receives messages, as ``note(text)``.
    report : SweepReport, optional
        Counts of computed, resumed, damaged and failed tasks, to fill in.

    See Also
    --------
    snapbeam.sweep, snapbeam.read_checkpoint

    Examples
    --------
    >>> import snapbeam as sb
    >>> options = sb.CheckpointOptions("sweep.checkpoint", points_per_task=64)
    """

    path: str | os.PathLike[str] | None = None
    check_checkpoint: bool = False
    points_per_task: int | None = None
    config: dict[str, Any] | None = None
    note: Note | None = None
    report: SweepReport | None = None

    def __post_init__(self) -> None:
        if self.path is not None and not isinstance(self.path, (str, os.PathLike)):
            raise InputTypeError(f"checkpoint = {shown(self.path)}: must be a folder")
        flag("check_checkpoint", self.check_checkpoint)
        if self.path is None and self.check_checkpoint:
            raise InputError("check_checkpoint = True: needs a checkpoint; give its folder as path")
        if self.path is not None and self.check_checkpoint and not (Path(self.path) / "map.json").is_file():
            raise InputError(f"checkpoint = {str(self.path)!r}: is not the folder of a sweep, so it cannot be checked")


class CheckpointRunner:
    """Computes the damaged and missing tasks of a sweep with a checkpoint."""

    def __init__(self, store: Checkpoint, workers: Workers, options: CheckpointOptions) -> None:
        self.store = store
        self.work = store.work
        self.chunk = store.chunk
        self.workers = workers
        self.report = SweepReport() if options.report is None else options.report
        self.note: Note = options.note if options.note is not None else (lambda _: None)
        self.only_damaged = options.check_checkpoint

    def complete(self, stage: Stage, progress: Progress | None = None) -> ResultRows:
        """Compute and store the tasks of a stage that are not finished; of an extended checkpoint, those of each layer."""
        layers = [layer.stage for layer in self.store.layers] if stage.name == BASE else []
        stages = layers or [stage]
        # the list completes every stage before the sum
        missing = sum([self._complete(each, progress) for each in stages])
        if missing:
            self.report.missing = missing
            raise _Incomplete
        return self.store.reader(stage)

    def _complete(self, stage: Stage, progress: Progress | None) -> int:
        """Complete one stage; returns the number of missing tasks if only damaged tasks are computed."""
        store, counts = self.store, self.report
        store.open_stage(stage)
        damaged, pending = store.damaged_in(stage), store.pending(stage)
        counts.tasks += stage.tasks
        counts.resumed += stage.tasks - len(pending)
        counts.damaged += [(stage.name, task) for task in damaged]
        if damaged:
            self.note(f"{stage.name}: {len(damaged)} of {stage.tasks} tasks are damaged; they are computed again")
        # consecutive tasks are spread over the sweep, so that the estimated remaining time is good
        todo = sorted(damaged if self.only_damaged else pending, key=lambda task: task * 0.6180339887498949 % 1.0)
        if todo and store.read_only:
            raise CheckpointError(
                f"checkpoint = {str(store.path)!r}: is read-only, and {len(todo)} of {stage.tasks} tasks are not finished; "
                "copy it to a writable folder"
            )
        sizes = {task: int(np.diff(stage.bounds(task))[0]) for task in todo}
        total, done = sum(sizes.values()), 0
        if total < stage.size and not self.only_damaged:
            name = "checkpoint" if stage.name == BASE else stage.name
            self.note(f"{name}: {stage.size - total} of {stage.size} points are finished, {total} remain")

        def report(inside: int) -> None:
            if progress is not None:
                progress(done + inside, total)

        for task, result in self.workers.run(self.work, stage, todo, report):
            if isinstance(result, TaskError):
                store.fail(stage, task, result.reason)
                counts.failed.append((stage.name, task, result.reason))
                self.note(f"{stage.name}: task {task} failed: it {result.reason}")
            else:
                store.commit(stage, task, result.columns, result.provenance)
                counts.computed += 1
                counts.runs += sizes[task] * self.work.runs_per_point
            done += sizes[task]
            report(0)
        return len(store.pending(stage)) if self.only_damaged else 0


def compute_sweep(
    setup: SweepSetup,
    options: CheckpointOptions,
    *,
    cluster: str | None = None,
    refine_levels: int = 0,
    replicates: Replicates | None = None,
    output: str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Compute a sweep whose setup was checked; see :func:`snapbeam.sweep`."""
    levels = integer("refine_levels", refine_levels, 0, MAX_LEVELS)
    if replicates is not None and not isinstance(replicates, Replicates):
        raise InputTypeError(f"replicates = {shown(replicates)}: must be an integer or a Replicates")
    if progress is not None and not callable(progress):
        raise InputTypeError(f"progress = {shown(progress)}: must be callable, as progress(done, total)")
    target = None if output is None else check_writable(output, "output", (".nc",))
    asked = None if cluster is None else parse_cluster(cluster)
    if options.path is None and asked is not None:
        raise InputError("cluster: needs a checkpoint; give its folder")
    if setup.points.size > _MOST_POINTS:
        raise InputError(f"{setup.points.size} points: must be at most {_MOST_POINTS}")
    if options.path is None:
        require_memory(setup.points.size, "give fewer points, or a checkpoint")
    for name, place in (("output", target), ("checkpoint", options.path)):
        if place is not None:
            require_room(place, LEAST_BYTES * setup.points.size, name)
    announce_long_sweep(setup, 1 if replicates is None else replicates.runs, by_cluster=asked is not None)
    setup, words = snapped(setup, options.path)
    if words and options.note is not None:
        options.note(words)
    work = PointWork(setup, replicates, metres=setup.length_varies)
    with _runner(work, options, asked) as runner:
        points, rows = _computed(runner, levels, progress)
        more = {} if not isinstance(runner, CheckpointRunner) else runner.store.made_with()
        return _result(work, points, rows, more, target)


def _computed(runner: StageRunner, levels: int, progress: Progress | None) -> tuple[Points, ResultRows]:
    points = runner.work.setup.points
    base = Stage(BASE, points, runner.chunk)
    try:
        return refine(runner, levels, progress) if levels else (points, runner.complete(base, progress))
    except _Incomplete:
        assert isinstance(runner, CheckpointRunner)
        return points, runner.store.reader(base)


@contextmanager
def _runner(work: PointWork, options: CheckpointOptions, cluster: Cluster | None) -> Iterator[StageRunner]:
    threads = work.setup.integration.threads
    if options.path is None:
        yield MemoryRunner(work, threads)
        return
    path, grow = Path(options.path), not options.check_checkpoint
    with Checkpoint(path, work, options.points_per_task, options.config, grow=grow) as kept:
        if cluster is None:
            yield CheckpointRunner(kept, LocalThreads(threads), options)
            return
        with open_client(cluster) as client:
            note = options.note if options.note is not None else (lambda _: None)
            yield CheckpointRunner(kept, ClusterWorkers(client, note), options)


def _result(work: PointWork, points: Points, rows: ResultRows, more: dict[str, Any], target: Path | None) -> xr.Dataset:
    from snapbeam.util.datasets import xr

    if work.replicates is not None:
        repeats = work.replicates
        more |= {
            "replicates": repeats.count,
            "perturbation_rms": repeats.perturbation_rms,
            "replicate_seed": repeats.seed,
            "check_half_step": int(repeats.check_half_step),
        }
    attrs = work.setup.attributes(more=more)
    if isinstance(rows, RefinedRows):
        attrs["points_computed"] = int(rows.computed.sum())
        attrs["points_filled"] = int(points.size - rows.computed.sum())
        dataset = to_dataset(work, points, rows, attrs)
        words = "whether the point was run; if not, its class was filled from its neighbours"
        labels = {"units": "1", "long_name": words}
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
    work: PointWork, options: CheckpointOptions, *, cluster: str | None = None, progress: Progress | None = None
) -> tuple[ResultTable, dict[str, Any]]:
    """Compute any work over the points of its sweep, with a checkpoint if its options give one.

    Returned are the table, a row for each point in the order of counting, and the attributes of the checkpoint: what
    computed it, and whether the results are reproducible.
    """
    if progress is not None and not callable(progress):
        raise InputTypeError(f"progress = {shown(progress)}: must be callable, as progress(done, total)")
    asked = None if cluster is None else parse_cluster(cluster)
    if options.path is None and asked is not None:
        raise InputError("cluster: needs a checkpoint; give its folder")
    announce_long_sweep(work.setup, work.runs_per_point, by_cluster=asked is not None)
    with _runner(work, options, asked) as runner:
        points, rows = _computed(runner, 0, progress)
        table = rows.read(0, points.size)
        return table, {} if not isinstance(runner, CheckpointRunner) else runner.store.made_with()
