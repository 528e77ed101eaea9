"""A store of a map, also one that is still growing."""

from __future__ import annotations

import time
from pathlib import Path

import snapbeam as sb
from snapbeam.explorer.maps.source import DatasetSource

__all__ = ["StoreSource"]


class StoreSource(DatasetSource):
    """A store, read without disturbing who writes it; points that are not done are unknown."""

    growing = True

    def __init__(self, path: Path) -> None:
        self._path = path
        self._stamp = self._stamped()
        super().__init__(sb.read_checkpoint(path), path.name)
        self._read = time.monotonic()

    def _stamped(self) -> tuple[int, int]:
        try:
            found = (self._path / "ledger.jsonl").stat()
        except OSError:
            return 0, 0
        return found.st_mtime_ns, found.st_size

    def refresh(self) -> bool:
        """Read it again if more is done."""
        if not self._path.is_dir():
            raise sb.InputError(f"{self._path.name}: there is no such store any more")
        stamp = self._stamped()
        if stamp == self._stamp:
            return False
        self._stamp = stamp
        self.skeleton = sb.read_checkpoint(self._path)
        self.version += 1
        return True
