"""Who computes the tasks: this process, or the workers of a cluster, whose deaths are survived."""

from __future__ import annotations

import asyncio
import time
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from dataclasses import astuple, dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from snapbeam.core.provenance import __version__, code_hash
from snapbeam.sweeps.compute.crew import Crew
from snapbeam.sweeps.compute.maker import Maker, this_maker
from snapbeam.sweeps.compute.task import PointWork, ResultTable
from snapbeam.sweeps.compute.tasks import Stage
from snapbeam.sweeps.errors import CheckpointError
from snapbeam.sweeps.points import Columns

if TYPE_CHECKING:
    from distributed import Client, Future

__all__ = ["ATTEMPTS", "ClusterWorkers", "Failure", "HereWorkers", "TaskResult", "Workers"]

ATTEMPTS = 3
"""Times that a task may kill its worker, or raise in it, before it is given up."""
_POLL = 0.5
_DELIVERY_POLL = 2.0
_RECONNECT = 30.0
_GONE = (OSError, TimeoutError, asyncio.TimeoutError, CancelledError, asyncio.CancelledError, RuntimeError)
"""What calls to a scheduler that is not there any more raise."""


class TaskResult(NamedTuple):
    """Results of a task, and what computed them; the maker of this process if none is given."""

    columns: ResultTable
    maker: Maker | None = None


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
            yield task, TaskResult(columns)


def compute_task(work: PointWork, points: Columns, threads: int, version: str, code: str) -> tuple[Any, ...]:
    """What a worker of a cluster does: one task, with all its threads, if its code is that of who asks."""
    maker = this_maker(work.setup.system)
    if (maker.version, maker.code) != (version, code):
        return None, None, astuple(maker)
    columns = work.compute(points, threads)
    return columns.integers, columns.numbers, astuple(maker)


@dataclass(frozen=True)
class ClusterWorkers:
    """Workers of a Dask cluster.

    Each worker has one task at a time, so the death of a worker is the doing of a known task, and each
    task uses all the threads its worker was given.  Results come back to this process, the only one that
    writes.  Nothing is waited for without end but workers that have yet to come.
    """

    client: Client
    note: Callable[[str], object] = print
    delivery: float = 60.0
    """Seconds that a living worker has to hand over the results of a finished task."""

    def run(
        self, work: PointWork, stage: Stage, tasks: Sequence[int], progress: Callable[[int], object]
    ) -> Iterator[tuple[int, TaskResult | Failure]]:
        """Compute the tasks as workers come and go."""
        maker = this_maker(work.setup.system)
        queue = deque(tasks)
        flying: dict[Future, tuple[int, str]] = {}
        trouble: Counter[int] = Counter()
        crew = Crew(self.client, self.note)
        try:
            while queue or flying:
                there = self._workers()
                with _answered():
                    crew.now(there)
                idle = there.keys() - {address for _, address in flying.values()}
                for address in sorted(idle)[: len(queue)]:
                    task = queue.popleft()
                    with _answered():
                        future = self.client.submit(
                            compute_task, work, stage.columns(task), there[address], maker.version, maker.code,
                            workers=[address], allow_other_workers=False, pure=False, retries=0,
                        )  # fmt: skip
                    flying[future] = task, address
                for future, task, address in self._settled(flying, there):
                    del flying[future]
                    with _answered():
                        outcome = self._outcome(future, address)
                    future.release()
                    if isinstance(outcome, TaskResult):
                        crew.finished()
                        yield task, outcome
                        continue
                    trouble[task] += 1
                    if trouble[task] < ATTEMPTS:
                        queue.append(task)
                        continue
                    if not crew.succeeded and outcome.reason.startswith("raised"):
                        raise CheckpointError(f"the workers cannot compute this map: a task {outcome.reason}")
                    yield task, Failure(f"{outcome.reason}, {ATTEMPTS} times")
        finally:
            if flying:
                with suppress(*_GONE):
                    self.client.cancel(list(flying), force=True)

    def _workers(self) -> dict[str, int]:
        until = time.monotonic() + _RECONNECT
        while self.client.status == "connecting" and time.monotonic() < until:
            time.sleep(_POLL)
        if self.client.status != "running":
            raise _gone(f"the connection is {self.client.status}")
        with _answered():
            return dict(self.client.nthreads())

    def _settled(self, flying: dict[Future, tuple[int, str]], there: dict[str, int]) -> list[Any]:
        """Futures that ended, or whose worker is gone, after waiting a moment for one to."""
        from distributed import wait

        if not flying:
            time.sleep(_POLL)
            return []
        with self.client.as_current(), suppress(*_GONE):
            wait(list(flying), timeout=_POLL, return_when="FIRST_COMPLETED")
        if self.client.status != "running":
            return []
        return [(f, task, at) for f, (task, at) in flying.items() if f.done() or at not in there]

    def _outcome(self, future: Future, address: str) -> TaskResult | Failure:
        """What came of a task that ended; one whose results do not come is as one that killed its worker."""
        from distributed import KilledWorker

        if not future.done():
            return self._dropped(future, "killed its worker")
        if future.status == "finished":
            return self._delivered(future, address)
        if future.status == "cancelled":
            return Failure("was cancelled") if address in self._workers() else Failure("killed its worker")
        error = future.exception(timeout=self.delivery)
        if isinstance(error, KilledWorker):
            return Failure("killed its worker")
        return Failure(f"raised {type(error).__name__}: {error}")

    def _delivered(self, future: Future, address: str) -> TaskResult | Failure:
        """The results of a finished task, as long as the worker that holds them lives.

        When it dies before it handed them over, the scheduler would compute them again on the same worker, which
        never comes back; so the task is dropped and handed out anew.
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
        maker = Maker(*by)
        if integers is None:
            raise CheckpointError(
                f"a worker runs snapbeam {maker.version} with code {maker.code}, this is {__version__} with code "
                f"{code_hash()}: install the same in both places"
            )
        return TaskResult(ResultTable(integers, numbers), maker)

    def _dropped(self, future: Future, reason: str) -> Failure:
        with suppress(*_GONE):
            future.cancel(force=True)
        return Failure(reason)


def _gone(why: object) -> CheckpointError:
    return CheckpointError(
        f"the scheduler does not answer any more ({why}); no finished task is lost: give the same command again"
    )


@contextmanager
def _answered() -> Iterator[None]:
    """Turn what is raised about a scheduler that is gone into words."""
    try:
        yield
    except CheckpointError:
        raise
    except _GONE as error:
        raise _gone(str(error) or type(error).__name__) from error
