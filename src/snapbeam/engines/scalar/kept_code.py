"""Compiled code on disk: checked before it is loaded, and never a reason for a run to fail.

Machine code that is loaded is run, so a file of it that was damaged could do anything.  Every file here begins with
the check sum of what follows; one that does not agree counts for nothing, and the code is compiled and written again.
Where nothing can be written, the code goes into a private folder of the temporary ones, or is not kept at all; that
is said once.
"""

from __future__ import annotations

import hashlib
import logging
import os
import pickle
import stat
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from numba.core.caching import CompileResultCacheImpl, FunctionCache, IndexDataCacheFile, _CacheLocator

__all__ = ["keep_code"]

_LOG = logging.getLogger("snapbeam")
_CHECK = hashlib.sha256
_SIZE = _CHECK().digest_size
_said: set[str] = set()


def keep_code(dispatcher: Any, mark: str) -> Any:
    """Have what *dispatcher* compiles kept on disk under *mark*, where that is possible; returns it.

    Parameters
    ----------
    dispatcher : a function that Numba compiles
        One that is not, since compilation is switched off, is left as it is.
    mark : str
        What tells this code from the same function's for something else; part of the file's name.
    """
    if not hasattr(dispatcher, "enable_caching"):
        return dispatcher
    try:
        alone = dispatcher.targetoptions.get("_nrt") is False
        dispatcher._cache = _KeptCode(dispatcher.py_func, mark, alone)
    except Exception as error:  # no folder anywhere, or a Numba that keeps code in another way
        _say(f"compiled code is not kept, each start compiles anew ({error})")
    return dispatcher


def _say(words: str) -> None:
    """Once a process."""
    if words not in _said:
        _said.add(words)
        _LOG.warning(words)


class _PrivateFolder(_CacheLocator):
    """A folder of this user alone among the temporary ones, for where neither the package nor HOME can be written."""

    def __init__(self, function: Callable[..., Any], file: str) -> None:
        self._file = file
        self._path = private_folder()

    def get_cache_path(self) -> str:
        return self._path

    def get_source_stamp(self) -> tuple[float, int]:
        found = os.stat(self._file)
        return found.st_mtime, found.st_size

    def get_disambiguator(self) -> str:
        return hashlib.sha256(self._file.encode()).hexdigest()[:10]

    @classmethod
    def from_function(cls, function: Callable[..., Any], file: str) -> Any:
        try:
            locator = cls(function, file)
            locator.ensure_cache_path()
        except OSError:
            return None
        _say(
            f"compiled code is kept in {locator.get_cache_path()}: neither the package nor HOME can be written"
        )
        return locator


def private_folder() -> str:
    """A folder that nobody else can write, made if it is not there.

    Raises
    ------
    OSError
        If there is none, or what stands in its place belongs to somebody else.
    """
    owner = os.getuid() if hasattr(os, "getuid") else 0
    folder = Path(tempfile.gettempdir()) / f"snapbeam-{owner}"
    folder.mkdir(mode=0o700, exist_ok=True)
    found = folder.lstat()
    if not stat.S_ISDIR(found.st_mode) or (
        os.name != "nt" and (found.st_uid != owner or found.st_mode & 0o022)
    ):
        raise PermissionError(f"{folder} is not this user's alone")
    return str(folder)


class _Implementation(CompileResultCacheImpl):
    _locator_classes = [*CompileResultCacheImpl._locator_classes, _PrivateFolder]  # noqa: RUF012


class _KeptCode(FunctionCache):
    """Numba's cache of one function, under a mark, with check sums, and deaf to the disk's troubles."""

    _impl_class = _Implementation

    def __init__(self, function: Callable[..., Any], mark: str, alone: bool) -> None:
        super().__init__(function)
        self._alone = alone
        """Whether the code calls nothing of Numba's runtime, so that it can be loaded by itself."""
        self._cache_file = _CheckedFiles(
            cache_path=self._cache_path,
            filename_base=f"{self._impl.filename_base}-{mark}",
            source_stamp=self._impl.locator.get_source_stamp(),
        )

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        try:
            if not self._alone:
                return super().load_overload(sig, target_context)
            # without refreshing the context, which loads what only compiling needs, half a second of each start
            with self._guard_against_spurious_io_errors():
                return self._load_overload(sig, target_context)
        except Exception as error:  # whatever became of the file: compile
            _LOG.debug("compiled code could not be loaded: %s", error)
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        try:
            super().save_overload(sig, data)
        except Exception as error:
            why = getattr(error, "strerror", None) or error
            _say(
                f"compiled code is not kept, each start compiles anew: {self._cache_path} cannot be written "
                f"({why}); set NUMBA_CACHE_DIR to a folder with 20 MB of room"
            )


class _CheckedFiles(IndexDataCacheFile):
    """Files whose contents are preceded by their check sum."""

    def _load_index(self) -> dict[Any, str]:
        data = self._read(self._index_path)
        if data is None:
            return {}
        stamp, overloads = pickle.loads(data)
        return overloads if stamp == self._source_stamp else {}

    def _save_index(self, overloads: dict[Any, str]) -> None:
        self._write(self._index_path, self._dump((self._source_stamp, overloads)))

    def _load_data(self, name: str) -> Any:
        data = self._read(self._data_path(name))
        return None if data is None else pickle.loads(data)

    def _save_data(self, name: str, data: Any) -> None:
        self._write(self._data_path(name), self._dump(data))

    def _write(self, path: str, data: bytes) -> None:
        with self._open_for_write(path) as stream:
            stream.write(_CHECK(data).digest() + data)

    @staticmethod
    def _read(path: str) -> bytes | None:
        """What a file holds; None if it is not there or not what was written."""
        try:
            held = Path(path).read_bytes()
        except OSError:
            return None
        check, data = held[:_SIZE], held[_SIZE:]
        return data if _CHECK(data).digest() == check else None
