"""Who computes the tasks: this process, or the workers of a cluster, whose deaths are survived."""

from __future__ import annotations

import time
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from snapbeam.core.provenance import __version__, processor_name
from snapbeam.sweeps.compute.task import PointWork, ResultTable
from snapbeam.sweeps.compute.tasks import Stage
from snapbeam.sweeps.errors import StoreError
from snapbeam.sweeps.points import Columns

if TYPE_CHECKING:
    from distributed import Client, Future

__all__ = ["ATTEMPTS", "ClusterWorkers", "Failure", "HereWorkers", "TaskResult", "Workers"]

ATTEMPTS = 3
"""Times that a task may kill its worker, or raise in it, before it is given up."""
_POLL = 0.5


class TaskResult(NamedTuple):
    """Results of a task, and the type of the processor they come from."""

    columns: ResultTable
    processor: str


class Failure(NamedTuple):
    """Why a task was given up."""

    reason: str


class Workers(Protocol):
    """Computes tasks of a stage and gives each with what came of it, in any order."""

    def run(
        self, work: PointWork, stage: Stage, tasks: Sequence[int], progress: Callable[[int], object]
    ) -> Iterator[tuple[int, TaskResult | Failure]]: ...


@dataclass(frozen=True)
class HereWorkers:
    """This process, with all its threads on one task after another."""

    threads: int | None = None

    def run(
        self, work: PointWork, stage: Stage, tasks: Sequence[int], progress: Callable[[int], object]
    ) -> Iterator[tuple[int, TaskResult | Failure]]:
        """Compute the tasks in order; *progress* gets the points done of the present one."""
        for task in tasks:
            columns = work.compute(stage.columns(task), self.threads, lambda done, _: progress(done))
            yield task, TaskResult(columns, processor_name())


def compute_task(work: PointWork, points: Columns, threads: int) -> tuple[Any, Any, str, str]:
    """What a worker of a cluster does: one task, with all its threads."""
    columns = work.compute(points, threads)
    return columns.integers, columns.numbers, processor_name(), __version__


@dataclass(frozen=True)
class ClusterWorkers:
    """Workers of a Dask cluster.

    Each worker has one task at a time, so the death of a worker is the doing of a known task, and each
    task uses all the threads its worker was given.  Results come back to this process, the only one that
    writes.
    """

    client: Client
    note: Callable[[str], object] = print

    def run(
        self, work: PointWork, stage: Stage, tasks: Sequence[int], progress: Callable[[int], object]
    ) -> Iterator[tuple[int, TaskResult | Failure]]:
        """Compute the tasks as workers come and go."""
        queue = deque(tasks)
        flying: dict[Future, tuple[int, str]] = {}
        trouble: Counter[int] = Counter()
        succeeded, known = False, -1
        try:
            while queue or flying:
                there = self._workers()
                if len(there) != known and 0 in (known, len(there)):
                    self.note("waiting for workers" if not there else f"workers: {len(there)}")
                known = len(there)
                idle = there.keys() - {address for _, address in flying.values()}
                for address in sorted(idle)[: len(queue)]:
                    task = queue.popleft()
                    future = self.client.submit(
                        compute_task, work, stage.columns(task), there[address],
                        workers=[address], allow_other_workers=False, pure=False, retries=0,
                    )  # fmt: skip
                    flying[future] = task, address
                for future, task, address in self._settled(flying, there):
                    del flying[future]
                    outcome = self._outcome(future, address in there)
                    future.release()
                    if isinstance(outcome, TaskResult):
                        succeeded = True
                        yield task, outcome
                        continue
                    trouble[task] += 1
                    if trouble[task] < ATTEMPTS:
                        queue.append(task)
                        continue
                    if not succeeded and outcome.reason.startswith("raised"):
                        raise StoreError(f"the workers cannot compute this map: a task {outcome.reason}")
                    yield task, Failure(f"{outcome.reason}, {ATTEMPTS} times")
        finally:
            if flying:
                self.client.cancel(list(flying), force=True)

    def _workers(self) -> dict[str, int]:
        try:
            return dict(self.client.nthreads())
        except (OSError, TimeoutError) as error:
            raise _gone(error) from error

    def _settled(self, flying: dict[Future, tuple[int, str]], there: dict[str, int]) -> list[Any]:
        """Futures that ended, or whose worker is gone, after waiting a moment for one to."""
        from distributed import wait

        if not flying:
            time.sleep(_POLL)
            return []
        with self.client.as_current(), suppress(TimeoutError, OSError):
            wait(list(flying), timeout=_POLL, return_when="FIRST_COMPLETED")
        return [(f, task, at) for f, (task, at) in flying.items() if f.done() or at not in there]

    def _outcome(self, future: Future, alive: bool) -> TaskResult | Failure:
        from distributed import KilledWorker

        if not future.done():
            future.cancel(force=True)
            return Failure("killed its worker")
        if future.status == "finished":
            integers, numbers, processor, version = future.result()
            if version != __version__:
                raise StoreError(f"a worker runs snapbeam {version}, this is {__version__}: install the same")
            return TaskResult(ResultTable(integers, numbers), processor)
        if future.status == "cancelled":
            return Failure("was cancelled") if alive else Failure("killed its worker")
        error = future.exception()
        if isinstance(error, KilledWorker):
            return Failure("killed its worker")
        return Failure(f"raised {type(error).__name__}: {error}")


def _gone(error: Exception) -> StoreError:
    return StoreError(
        f"the scheduler does not answer any more ({error}); no finished task is lost: "
        "give the same command again"
    )
