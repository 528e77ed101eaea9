"""Maps that take long: kept in a store, resumed, spread over a cluster, refined, repeated."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from snapbeam.core.files import check_writable
from snapbeam.core.validate import InputError, integer
from snapbeam.model.contact import HertzContact
from snapbeam.model.reduction import ReducedModel
from snapbeam.sweeps.compute.cluster import Cluster, open_client, parse_cluster
from snapbeam.sweeps.compute.task import Recipe
from snapbeam.sweeps.compute.tasks import Book, MemoryBook, Results, Stage
from snapbeam.sweeps.compute.workers import ClusterWorkers, Failure, HereWorkers, Workers
from snapbeam.sweeps.export import to_dataset, to_netcdf
from snapbeam.sweeps.keep.store import MapStore
from snapbeam.sweeps.refine import MAX_LEVELS, RefinedResults, refine
from snapbeam.sweeps.replicas import MEASURING_ERROR, Replicas
from snapbeam.sweeps.sweep import Grid, Progress, map_setup

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Tally", "long_map"]

_TITLE = "map of the response of a struck bistable beam"
Note = Callable[[str], object]


class _Incomplete(Exception):
    """A stage that is only checked has tasks that were never done."""


@dataclass
class Tally:
    """What happened while a map was computed."""

    tasks: int = 0
    """Tasks of the stages so far."""
    kept: int = 0
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


def _spread(task: int) -> float:
    """Order in which any few tasks lie all over the map, so that the time left is told well from the start."""
    return task * 0.6180339887498949 % 1.0


class StoreBook:
    """A map kept in a store: finished tasks are read, damaged and missing ones are computed."""

    def __init__(
        self, store: MapStore, workers: Workers, tally: Tally, note: Note, only_damaged: bool = False
    ) -> None:
        self.store = store
        self.recipe = store.recipe
        self.chunk = store.chunk
        self.workers = workers
        self.tally = tally
        self.note = note
        self.only_damaged = only_damaged

    def complete(self, stage: Stage, progress: Progress | None = None) -> Results:
        """Compute the tasks of a stage that are not done, committing each."""
        store, tally = self.store, self.tally
        store.open_stage(stage)
        damaged, pending = store.damaged_in(stage), store.pending(stage)
        tally.tasks += stage.tasks
        tally.kept += stage.tasks - len(pending)
        tally.damaged += [(stage.name, task) for task in damaged]
        if damaged:
            self.note(
                f"{stage.name}: {len(damaged)} of {stage.tasks} tasks were damaged and are computed again"
            )
        todo = sorted(damaged if self.only_damaged else pending, key=_spread)
        sizes = {task: int(np.diff(stage.bounds(task))[0]) for task in todo}
        total, done = sum(sizes.values()), 0
        if total < stage.size and not self.only_damaged:
            self.note(f"{stage.name}: {stage.size - total} of {stage.size} points are done; {total} to go")

        def report(inside: int) -> None:
            if progress is not None:
                progress(done + inside, total)

        for task, outcome in self.workers.run(self.recipe, stage, todo, report):
            if isinstance(outcome, Failure):
                store.fail(stage, task, outcome.reason)
                tally.failed.append((stage.name, task, outcome.reason))
                self.note(f"{stage.name}: task {task} was given up: it {outcome.reason}")
            else:
                store.commit(stage, task, outcome.columns, outcome.processor)
                tally.computed += 1
                tally.runs += sizes[task] * self.recipe.runs_per_point
            done += sizes[task]
            report(0)
        if self.only_damaged and (missing := len(store.pending(stage))):
            tally.missing = missing
            raise _Incomplete
        return store.reader(stage)


def long_map(
    model: ReducedModel,
    contact: HertzContact,
    *,
    frequency_ratio: ArrayLike,
    velocity_amplitude: ArrayLike,
    location: ArrayLike = 1.0 / 2.1,
    cycles: int = 200,
    side: str = "below",
    reference_freq: float | None = None,
    step: float | None = None,
    accuracy: str = "map",
    engine: str = "auto",
    early_decision: bool = False,
    store: str | os.PathLike[str] | None = None,
    verify: bool = False,
    cluster: str | None = None,
    refine_levels: int = 0,
    replicas: int = 0,
    replica_size: float = MEASURING_ERROR,
    replica_seed: int = 0,
    halve_step: bool = False,
    chunk: int | None = None,
    threads: int | None = None,
    output: str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
    note: Note | None = None,
    tally: Tally | None = None,
    config: dict[str, Any] | None = None,
) -> xr.Dataset:
    """A response map that survives interruption, refines itself and can leave this machine.

    The parameters up to *early_decision* are those of :func:`snapbeam.response_map`, and so are the numbers:
    bit for bit, whatever the tasks, their order, the threads, the workers and the interruptions.

    Parameters
    ----------
    store : path, optional
        Folder that keeps the map while it is computed.  One that exists is resumed: what is finished and
        undamaged is not computed again.
    verify : bool
        Check every finished task of the store and compute again only those that are damaged; points that
        were never computed stay unknown.
    cluster : str, optional
        Who computes: ``"local:4"``, ``"tcp://host:8786"`` or a TOML file with a section ``[slurm]``; this
        process by default.  Needs a store.
    refine_levels : int
        Times the spacing is halved where neighbours differ in class.
    replicas : int
        Repeats of each run with a changed start; adds ``class_share`` to the map.
    replica_size : float
        Root mean square of the change of the centre displacement, m; by default the error of a position
        read to one pixel of the paper's camera.
    replica_seed : int
        Chooses the changes.
    halve_step : bool
        One repeat more with every step halved; adds ``response_half_step``.
    chunk : int, optional
        Points of a task.
    threads : int, optional
        Threads of this process; all usable cores by default.  Workers of a cluster use those they have.
    output : path, optional
        NetCDF file to write, a block at a time, so that memory does not grow with the map.
    progress, note : callable, optional
        Called as ``progress(done, total)`` with points of the present stage, and ``note(text)``.
    tally : Tally, optional
        Filled with what was computed, kept, damaged and given up.
    config : dict, optional
        Parameters to keep in the store as a parameter file would hold them.

    Returns
    -------
    xarray.Dataset
        The map of :func:`snapbeam.response_map`; of a refined map at full resolution, with ``computed``
        that says which points were run.  With *output*, opened from that file.

    Raises
    ------
    InputError
        For bad input, and for a store that holds another map.
    StoreError
        If the store is in use, cannot be written or is damaged beyond repair.
    """
    setup = map_setup(
        model,
        contact,
        frequency_ratio=frequency_ratio,
        velocity_amplitude=velocity_amplitude,
        location=location,
        cycles=cycles,
        side=side,
        reference_freq=reference_freq,
        step=step,
        accuracy=accuracy,
        engine=engine,
        early_decision=early_decision,
    )
    levels = integer("refine_levels", refine_levels, 0, MAX_LEVELS)
    if threads is not None:
        threads = integer("threads", threads, 1, 4096)
    repeats = None
    if halve_step or integer("replicas", replicas, 0, 10_000):
        repeats = Replicas(replicas, replica_size, bool(halve_step), replica_seed)
    target = None if output is None else check_writable(output, "output", (".nc",))
    asked = None if cluster is None else parse_cluster(cluster)
    if store is None and (verify or asked is not None):
        raise InputError(f"{'verify' if verify else 'cluster'}: needs a store")
    if store is not None and verify and not (Path(store) / "map.json").is_file():
        raise InputError(f"store = {str(store)!r}: there is no map to verify")
    recipe = Recipe(setup, repeats)
    tally = Tally() if tally is None else tally
    note = note if note is not None else (lambda _: None)
    with _book(recipe, store, asked, threads, chunk, tally, note, verify, config) as book:
        grid, results = _computed(book, levels, progress)
        more = {} if not isinstance(book, StoreBook) else book.store.made_with()
        return _result(recipe, grid, results, more, target)


def _computed(book: Book, levels: int, progress: Progress | None) -> tuple[Grid, Results]:
    grid = book.recipe.setup.grid
    base = Stage("base", grid, book.chunk)
    try:
        return refine(book, levels, progress) if levels else (grid, book.complete(base, progress))
    except _Incomplete:
        assert isinstance(book, StoreBook)
        return grid, book.store.reader(base)


@contextmanager
def _book(
    recipe: Recipe,
    store: str | os.PathLike[str] | None,
    cluster: Cluster | None,
    threads: int | None,
    chunk: int | None,
    tally: Tally,
    note: Note,
    verify: bool,
    config: dict[str, Any] | None,
) -> Iterator[Book]:
    if store is None:
        yield MemoryBook(recipe, threads)
        return
    with MapStore(Path(store), recipe, chunk, config) as kept:
        if cluster is None:
            yield StoreBook(kept, HereWorkers(threads), tally, note, verify)
            return
        with open_client(cluster) as client:
            yield StoreBook(kept, ClusterWorkers(client, note), tally, note, verify)


def _result(
    recipe: Recipe, grid: Grid, results: Results, more: dict[str, Any], target: Path | None
) -> xr.Dataset:
    import xarray as xr

    if recipe.replicas is not None:
        repeats = recipe.replicas
        more |= {
            "replicas": repeats.count,
            "replica_size": repeats.size,
            "replica_seed": repeats.seed,
            "halve_step": int(repeats.halve_step),
        }
    attrs = recipe.setup.attributes(_TITLE, more)
    if isinstance(results, RefinedResults):
        attrs["points_computed"] = int(results.computed.sum())
        attrs["points_inferred"] = int(grid.size - results.computed.sum())
        dataset = to_dataset(recipe, grid, results, attrs)
        labels = {"units": "1", "long_name": "whether the point was run; if not, its class was inferred"}
        dataset["computed"] = (tuple(grid.axes), results.computed, labels)
        if target is None:
            return dataset
        from snapbeam.core.files import atomic_path

        with atomic_path(target) as temporary:
            dataset.to_netcdf(temporary, engine="h5netcdf")
    elif target is None:
        return to_dataset(recipe, grid, results, attrs)
    else:
        to_netcdf(recipe, grid, results, attrs, target)
    return xr.open_dataset(target, engine="h5netcdf")
