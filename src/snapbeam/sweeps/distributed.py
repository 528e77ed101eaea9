"""Workers that compute the tasks of a sweep: the threads of one process, or a Dask cluster."""

from __future__ import annotations

import asyncio
import time
from collections import Counter, deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from dataclasses import astuple, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from snapbeam._version import __version__
from snapbeam.sweeps.checkpoint.records import CheckpointError
from snapbeam.sweeps.points import Columns
from snapbeam.sweeps.tasks import PointWork, Provenance, ResultTable, Stage, provenance_of
from snapbeam.util.cores import usable_cores
from snapbeam.util.input_files import read_toml
from snapbeam.util.packages import needing
from snapbeam.util.provenance import code_hash
from snapbeam.util.validation import InputError, integer, shown

if TYPE_CHECKING:
    from distributed import Client, Future

# ----------------------------------------------------------------------------------------------------
# The pool of workers of a cluster: changes, losses and replacement of local workers.


_MOST_LOST = 12
"""Maximum number of lost workers, per present worker, while no task finishes."""
_PATIENCE = 20.0
"""Seconds after which a missing local worker is replaced; the time doubles with each replacement."""
_MOST_RESTARTS = 5


class WorkerPool:
    """Present workers of a cluster.

    The pool reports when the first worker comes and the last worker goes.  It raises an error if too many workers are
    lost without a result.  It replaces local workers that Dask does not restart, such as a worker that is killed
    while it starts.
    """

    def __init__(self, client: Client, note: Callable[[str], object]) -> None:
        self.note = note
        self.succeeded = False
        self._cluster = getattr(client, "cluster", None)
        self._known: set[str] | None = None
        self._lost: set[str] = set()
        self._complete_at = time.monotonic()
        self._restarts = 0

    def finished(self) -> None:
        """Record that a task finished."""
        self.succeeded = True
        self._lost.clear()
        self._restarts = 0

    def now(self, there: Mapping[str, int]) -> None:
        """Update the pool with the present workers."""
        before, self._known = self._known, set(there)
        if before is None or bool(before) != bool(there):
            self.note("waiting for workers" if not there else f"workers: {len(there)}")
        self._lost |= (before or set()) - self._known
        if len(self._lost) > _MOST_LOST * max(1, len(there)):
            raise CheckpointError(
                f"the workers cannot compute this sweep: {len(self._lost)} of them were lost and no task finished; "
                "they may have too little memory: give them more memory, or fewer points_per_task"
            )
        self._mend()

    def _mend(self) -> None:
        """Replace local workers that are missing for too long."""
        cluster = self._cluster
        if cluster is None or type(cluster).__name__ != "LocalCluster":
            return
        assert self._known is not None
        now = time.monotonic()
        if len(self._known) >= len(cluster.worker_spec):
            self._complete_at = now
        elif now - self._complete_at > _PATIENCE * 2**self._restarts:
            if self._restarts >= _MOST_RESTARTS and not self._known:
                raise CheckpointError("the workers cannot compute this sweep: none of them can be started")
            self._restarts, self._complete_at = min(self._restarts + 1, _MOST_RESTARTS), now
            self.note("starting workers again")
            cluster.sync(_replace, cluster, self._known)
            cluster.scale(len(cluster.worker_spec))


async def _replace(cluster: Any, there: set[str]) -> None:
    """Remove the supervisors (nannies, in Dask) whose workers are missing."""
    for name, nanny in list(cluster.workers.items()):
        if nanny.worker_address not in there:
            del cluster.workers[name]
            closing = asyncio.ensure_future(_close(nanny))
            _closing.add(closing)
            closing.add_done_callback(_closing.discard)


_closing: set[Any] = set()


async def _close(nanny: Any) -> None:
    with suppress(Exception):
        await nanny.close(timeout=5)


# ----------------------------------------------------------------------------------------------------


ATTEMPTS = 3
"""Number of times that a task may kill its worker or raise an error before it counts as failed."""
_POLL = 0.5
_DELIVERY_POLL = 2.0
_RECONNECT = 30.0
_GONE = (OSError, TimeoutError, asyncio.TimeoutError, CancelledError, asyncio.CancelledError, RuntimeError)
"""Errors of calls to a scheduler that is gone."""


class TaskResult(NamedTuple):
    """Results of a task and their provenance; None for this process."""

    columns: ResultTable
    provenance: Provenance | None = None


class TaskError(NamedTuple):
    """Reason why a task failed."""

    reason: str


class Workers(Protocol):
    """Computes tasks of a stage and yields each with its result or its error, in any order."""

    def run(
        self, work: PointWork, stage: Stage, tasks: Sequence[int], progress: Callable[[int], object]
    ) -> Iterator[tuple[int, TaskResult | TaskError]]:
        """Compute *tasks* of *stage*; yield each task with its result or its error, in any order."""
        ...


@dataclass(frozen=True)
class LocalThreads:
    """The present process, which computes one task after another with all its threads."""

    threads: int | None = None

    def run(
        self, work: PointWork, stage: Stage, tasks: Sequence[int], progress: Callable[[int], object]
    ) -> Iterator[tuple[int, TaskResult | TaskError]]:
        """Compute the tasks in order; *progress* receives the number of finished points of the present task."""
        for task in tasks:
            columns = work.compute(stage.columns(task), self.threads, lambda done, _: progress(done))
            yield task, TaskResult(columns)


def compute_task(work: PointWork, points: Columns, threads: int, version: str, code: str) -> tuple[Any, ...]:
    """Compute one task on a worker, with all its threads, if its code is that of the requesting process."""
    provenance = provenance_of(work.setup.system)
    if (provenance.version, provenance.code) != (version, code):
        return None, None, astuple(provenance)
    columns = work.compute(points, threads)
    return columns.integers, columns.numbers, astuple(provenance)


@dataclass(frozen=True)
class ClusterWorkers:
    """Workers of a Dask cluster.

    Each worker computes one task at a time with all its threads, so that the task that kills a worker is known.
    Results return to this process, which alone writes the checkpoint.  Every wait has a limit, except the wait for the
    first worker.
    """

    client: Client
    note: Callable[[str], object] = print
    delivery: float = 60.0
    """Seconds after which results of a finished task count as lost."""

    def run(
        self, work: PointWork, stage: Stage, tasks: Sequence[int], progress: Callable[[int], object]
    ) -> Iterator[tuple[int, TaskResult | TaskError]]:
        """Compute the tasks on the present workers."""
        provenance = provenance_of(work.setup.system)
        queue = deque(tasks)
        running: dict[Future, tuple[int, str]] = {}
        trouble: Counter[int] = Counter()
        pool = WorkerPool(self.client, self.note)
        try:
            while queue or running:
                there = self._workers()
                with _answered():
                    pool.now(there)
                idle = there.keys() - {address for _, address in running.values()}
                for address in sorted(idle)[: len(queue)]:
                    task = queue.popleft()
                    with _answered():
                        future = self.client.submit(
                            compute_task, work, stage.columns(task), there[address], provenance.version, provenance.code,
                            workers=[address], allow_other_workers=False, pure=False, retries=0,
                        )  # fmt: skip
                    running[future] = task, address
                for future, task, address in self._settled(running, there):
                    del running[future]
                    with _answered():
                        outcome = self._outcome(future, address)
                    future.release()
                    if isinstance(outcome, TaskResult):
                        pool.finished()
                        yield task, outcome
                        continue
                    trouble[task] += 1
                    if trouble[task] < ATTEMPTS:
                        queue.append(task)
                        continue
                    if not pool.succeeded and outcome.reason.startswith("raised"):
                        raise CheckpointError(f"the workers cannot compute this sweep: a task {outcome.reason}")
                    yield task, TaskError(f"{outcome.reason}, {ATTEMPTS} times")
        finally:
            if running:
                with suppress(*_GONE):
                    self.client.cancel(list(running), force=True)

    def _workers(self) -> dict[str, int]:
        until = time.monotonic() + _RECONNECT
        while self.client.status == "connecting" and time.monotonic() < until:
            time.sleep(_POLL)
        if self.client.status != "running":
            raise _gone(f"the connection is {self.client.status}")
        with _answered():
            return dict(self.client.nthreads())

    def _settled(self, running: dict[Future, tuple[int, str]], there: dict[str, int]) -> list[Any]:
        """Return futures that ended or whose worker is gone, after a short wait."""
        from distributed import wait

        if not running:
            time.sleep(_POLL)
            return []
        with self.client.as_current(), suppress(*_GONE):
            wait(list(running), timeout=_POLL, return_when="FIRST_COMPLETED")
        if self.client.status != "running":
            return []
        return [(f, task, at) for f, (task, at) in running.items() if f.done() or at not in there]

    def _outcome(self, future: Future, address: str) -> TaskResult | TaskError:
        """Return the result of a task that ended; lost results count like a killed worker."""
        from distributed import KilledWorker

        if not future.done():
            return self._dropped(future, "killed its worker")
        if future.status == "finished":
            return self._delivered(future, address)
        if future.status == "cancelled":
            return TaskError("was cancelled") if address in self._workers() else TaskError("killed its worker")
        error = future.exception(timeout=self.delivery)
        if isinstance(error, KilledWorker):
            return TaskError("killed its worker")
        return TaskError(f"raised {type(error).__name__}: {error}")

    def _delivered(self, future: Future, address: str) -> TaskResult | TaskError:
        """Fetch the results of a finished task.

        If the worker dies first, the scheduler would wait for the same worker, which does not return.  The task is
        therefore cancelled and submitted again.
        """
        from distributed import KilledWorker

        until = time.monotonic() + self.delivery
        while True:
            try:
                integers, numbers, by = future.result(timeout=min(_DELIVERY_POLL, self.delivery))
                break
            except TimeoutError:
                if address not in self._workers():
                    return self._dropped(future, "lost its worker before its results came")
                if time.monotonic() > until:
                    return self._dropped(future, f"gave no results within {self.delivery:g} s")
            except (KilledWorker, CancelledError, asyncio.CancelledError):
                return self._dropped(future, "lost its worker before its results came")
        provenance = Provenance(*by)
        if integers is None:
            raise CheckpointError(
                f"a worker runs snapbeam {provenance.version} with code {provenance.code}, this is {__version__} with code "
                f"{code_hash()}: install the same in both places"
            )
        return TaskResult(ResultTable(integers, numbers), provenance)

    def _dropped(self, future: Future, reason: str) -> TaskError:
        with suppress(*_GONE):
            future.cancel(force=True)
        return TaskError(reason)


def _gone(why: object) -> CheckpointError:
    return CheckpointError(
        f"the scheduler does not answer ({why}); no finished task is lost: give the same command again"
    )


@contextmanager
def _answered() -> Iterator[None]:
    """Convert the errors of a scheduler that is gone to a CheckpointError."""
    try:
        yield
    except CheckpointError:
        raise
    except _GONE as error:
        raise _gone(str(error) or type(error).__name__) from error


# ----------------------------------------------------------------------------------------------------
# Clusters: local processes, a running scheduler, or a SLURM queue.


_FORMS = "local:N, tcp://host:port, tls://host:port or a TOML file such as slurm.toml"
_LOOPBACK = "127.0.0.1"
_SLURM: dict[str, type] = {
    "account": str, "cores": int, "interface": str, "jobs": int, "memory": str, "prologue": list, "queue": str, "walltime": str
}  # fmt: skip
_NEEDED = {
    "cores": "", "interface": ": the network interface through which the workers reach the scheduler", "memory": ""
}  # fmt: skip


@dataclass(frozen=True)
class Cluster:
    """A checked request for a cluster."""

    kind: str
    """``"local"``, ``"address"`` or ``"slurm"``."""
    workers: int = 0
    address: str = ""
    slurm: dict[str, Any] = field(default_factory=dict)


def parse_cluster(text: str) -> Cluster:
    """Parse ``"local:4"`` (processes), ``"tcp://host:8786"`` (a scheduler) or a TOML file with ``[slurm]``."""
    if not isinstance(text, str) or not text:
        raise InputError(f"cluster = {shown(text)}: must be {_FORMS}")
    kind, colon, rest = text.partition(":")
    if kind == "local" and colon:
        if not rest.isdecimal():
            raise InputError(f"cluster = {shown(text)}: the workers must be a whole number, as in local:4")
        return Cluster("local", workers=integer("cluster workers", int(rest), 1, 4096))
    if text.startswith(("tcp://", "tls://")):
        return Cluster("address", address=text)
    if text.endswith(".toml"):
        return Cluster("slurm", slurm=_read_slurm(Path(text)))
    raise InputError(f"cluster = {shown(text)}: must be {_FORMS}")


def _read_slurm(path: Path) -> dict[str, Any]:
    sections = read_toml("cluster", path)
    given = sections.pop("slurm", None)
    if sections or not isinstance(given, dict):
        raise InputError(f"cluster = {str(path)!r}: must contain one section, [slurm]")
    for name, value in given.items():
        if name not in _SLURM:
            raise InputError(f"{path.name}: [slurm] {name}: unknown key; must be one of {', '.join(_SLURM)}")
        if not isinstance(value, _SLURM[name]) or isinstance(value, bool):
            raise InputError(f"{path.name}: [slurm] {name} = {shown(value)}: must be of type {_SLURM[name].__name__}")
    for name, words in _NEEDED.items():
        if name not in given:
            raise InputError(f"{path.name}: [slurm] {name} is missing{words}")
    for name in ("cores", "jobs"):
        if name in given:
            integer(f"{path.name}: [slurm] {name}", given[name], 1, 100_000)
    return given


@contextmanager
def open_client(cluster: Cluster) -> Iterator[Client]:
    """Connect to a cluster; a cluster that is started here ends with the block."""
    with needing("cluster (--cluster)", "cluster"):
        import dask
        from distributed import Client
    if cluster.kind == "address":
        try:
            client = Client(cluster.address, timeout="30s", set_as_default=False)
        except (OSError, TimeoutError, ValueError) as error:
            raise CheckpointError(
                f"cluster = {shown(cluster.address)}: no scheduler answers there ({error})"
            ) from error
        try:
            yield client
        finally:
            with suppress(Exception):  # a scheduler that is gone cannot be disconnected
                client.close(timeout=5)
        return
    with dask.config.set({"distributed.comm.timeouts.connect": "60s"}):
        made = _local(cluster.workers) if cluster.kind == "local" else _slurm(cluster.slurm)
        with made, Client(made, set_as_default=False) as client:
            yield client


def _local(workers: int) -> Any:
    from distributed import LocalCluster

    return LocalCluster(
        n_workers=workers,
        threads_per_worker=max(1, usable_cores() // workers),
        processes=True,
        host=_LOOPBACK,
        dashboard_address=f"{_LOOPBACK}:0",
        worker_dashboard_address=f"{_LOOPBACK}:0",
        memory_limit=0,
        silence_logs=50,
        env=_one_thread_each(),
    )


def _one_thread_each() -> dict[str, str]:
    """Return settings that keep linear algebra libraries from starting threads of their own."""
    return {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}


def _slurm(settings: dict[str, Any]) -> Any:
    """Start a SLURM cluster: one worker process for each job, with all its cores."""
    with needing("a SLURM cluster", "cluster"):
        from dask_jobqueue import SLURMCluster
    made = SLURMCluster(**slurm_arguments(settings))
    made.scale(jobs=settings.get("jobs", 1))
    return made


def slurm_arguments(settings: dict[str, Any]) -> dict[str, Any]:
    """Return the arguments of ``dask_jobqueue.SLURMCluster``."""
    exports = [f"export {name}={value}" for name, value in _one_thread_each().items()]
    return {
        "queue": settings.get("queue"),
        "account": settings.get("account"),
        "cores": settings["cores"],
        "processes": 1,
        "memory": settings["memory"],
        "walltime": settings.get("walltime"),
        "interface": settings["interface"],
        "job_script_prologue": [*map(str, settings.get("prologue", [])), *exports],
        "scheduler_options": {"interface": settings["interface"], "dashboard_address": f"{_LOOPBACK}:0"},
    }
