"""The workers of a cluster as they come and go: told, counted, and put back where they are this process's own."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from snapbeam.sweeps.errors import CheckpointError

if TYPE_CHECKING:
    from distributed import Client

__all__ = ["Crew"]

_MOST_LOST = 12
"""Workers, for each that is there, that may go without any task finished."""
_PATIENCE = 20.0
"""Seconds that a worker of this machine may be missing before another is started; twice as many each time."""
_MOST_MENDED = 5


class Crew:
    """Who is there.

    Tells when that changes between nobody and somebody, gives up when too many went without a result, and starts
    workers of this machine anew that their keeper has lost, as it does one that is killed while it starts.
    """

    def __init__(self, client: Client, note: Callable[[str], object]) -> None:
        self.note = note
        self.succeeded = False
        self._cluster = getattr(client, "cluster", None)
        self._known: set[str] | None = None
        self._lost: set[str] = set()
        self._whole_at = time.monotonic()
        self._mended = 0

    def finished(self) -> None:
        """A task was finished."""
        self.succeeded = True
        self._lost.clear()
        self._mended = 0

    def now(self, there: Mapping[str, int]) -> None:
        """Look at who is there.

        Raises
        ------
        CheckpointError
            If workers come and go and never finish anything, or none can be started.
        """
        before, self._known = self._known, set(there)
        if before is None or bool(before) != bool(there):
            self.note("waiting for workers" if not there else f"workers: {len(there)}")
        self._lost |= (before or set()) - self._known
        if len(self._lost) > _MOST_LOST * max(1, len(there)):
            raise CheckpointError(
                f"the workers cannot compute this map: {len(self._lost)} of them came and went and no task was "
                "finished; they may have too little memory for one: give them more, or smaller tasks (chunk)"
            )
        self._mend()

    def _mend(self) -> None:
        """Start workers of this machine that have been missing for long."""
        cluster = self._cluster
        if cluster is None or type(cluster).__name__ != "LocalCluster":
            return
        assert self._known is not None
        now = time.monotonic()
        if len(self._known) >= len(cluster.worker_spec):
            self._whole_at = now
        elif now - self._whole_at > _PATIENCE * 2**self._mended:
            if self._mended >= _MOST_MENDED and not self._known:
                raise CheckpointError("the workers cannot compute this map: none of them can be started")
            self._mended, self._whole_at = min(self._mended + 1, _MOST_MENDED), now
            self.note("starting workers anew")
            cluster.sync(_replace, cluster, self._known)
            cluster.scale(len(cluster.worker_spec))


async def _replace(cluster: Any, there: set[str]) -> None:
    """Forget the keepers whose workers are not there."""
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
