"""The ledger of a store: which tasks are done, by records that are written after the data and synced.

One line a record, a JSON object and its check sum.  A line that was torn or altered counts for nothing, and
its task is computed again.
"""

from __future__ import annotations

import errno
import hashlib
import json
import os
import re
import stat
import time
import uuid
from contextlib import suppress
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from types import TracebackType
from typing import Self

from snapbeam.util.files import lives
from snapbeam.util.provenance import created_now
from snapbeam.util.validation import InputError

__all__ = [
    "PARTIAL",
    "CheckpointError",
    "Ledger",
    "Record",
    "StoreLock",
    "append_line",
    "durable_write",
    "member",
    "open_own",
    "refuse_links",
]


# ----------------------------------------------------------------------------------------------------
# What goes wrong with stores and clusters.


class CheckpointError(OSError):
    """A store that cannot be written, read or trusted, or workers that cannot compute; the message says what to do."""


# ----------------------------------------------------------------------------------------------------
# Files of a store: on the disk when a call returns, owned by one writer, and never anyone else's.


PARTIAL = ".partial"
"""Suffix of a file that is being written."""
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}")


def durable_write(path: Path, data: bytes | memoryview) -> None:
    """Write a file so that it is whole or not there, whatever stops the process or the machine."""
    temporary = path.with_name(f".{path.name}.{uuid.uuid4().hex}{PARTIAL}")
    try:
        with temporary.open("wb") as stream:
            stream.write(data)
            stream.flush()
            os.fsync(stream.fileno())
        os.replace(temporary, path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
    _sync_folder(path.parent)


def append_line(path: Path, line: str) -> None:
    """Append a line to a file and have it on the disk; a line torn by an earlier failure stays apart."""
    handle = open_own(path, os.O_RDWR | os.O_APPEND)
    try:
        size = os.fstat(handle).st_size
        torn = size > 0 and os.pread(handle, 1, size - 1) != b"\n"
        data = ("\n" if torn else "").encode() + line.encode() + b"\n"
        while data:
            data = data[os.write(handle, data) :]
        os.fsync(handle)
    finally:
        os.close(handle)
    if size == 0:
        _sync_folder(path.parent)


def _sync_folder(folder: Path) -> None:
    if os.name == "nt":
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def member(name: str) -> str:
    """Return *name* if it can name a member of a store: no path, nothing hidden, nothing upward."""
    if not isinstance(name, str) or not _NAME.fullmatch(name) or ".." in name:
        raise InputError(f"store: {name!r} is no name of a member of a store")
    return name


def refuse_links(folder: Path, *, sweep: bool) -> None:
    """Refuse a store in which anything is neither a plain file nor a plain folder.

    A link could make a resumed map read, or write, outside its store.  *sweep* removes torn files; only the holder of
    the store's lock may, for they may be another writer's that is at work.
    """
    pending = [folder]
    while pending:
        with os.scandir(pending.pop()) as entries:
            for entry in entries:
                mode = entry.stat(follow_symlinks=False).st_mode
                if stat.S_ISDIR(mode):
                    pending.append(Path(entry.path))
                elif not stat.S_ISREG(mode):
                    raise _link(Path(entry.path), folder)
                elif sweep and entry.name.startswith(".") and entry.name.endswith(PARTIAL):
                    os.unlink(entry.path)


def _link(path: Path, folder: Path) -> InputError:
    inside = path.relative_to(folder)
    return InputError(f"store = {str(folder)!r}: {str(inside)!r} is a link or no plain file")


def open_own(path: Path, flags: int) -> int:
    """Open a file of a store that is written in place; refuse one that is a link or that also has another name.

    Raises
    ------
    InputError
    """
    try:
        handle = os.open(path, flags | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0), 0o666)
    except OSError as error:
        if error.errno in (errno.ELOOP, errno.EISDIR):
            raise _link(path, path.parent) from None
        raise
    found = os.fstat(handle)
    if not stat.S_ISREG(found.st_mode) or found.st_nlink > 1:
        os.close(handle)
        raise _link(path, path.parent)
    return handle


class StoreLock:
    """The right to write a store: held by one process, given back by the system however it ends."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._handle: int | None = None

    def __enter__(self) -> Self:
        handle = open_own(self.path, os.O_RDWR)
        try:
            _lock(handle)
        except OSError:
            holder = _holder(handle)
            os.close(handle)
            raise CheckpointError(
                f"store = {str(self.path.parent)!r}: is being written by another process ({holder}); "
                "wait for it, or stop it"
            ) from None
        self._handle = handle
        with suppress(OSError):  # a full disk: the lock holds without its holder's name
            os.ftruncate(handle, 0)
            os.pwrite(handle, f"process {os.getpid()}\n".encode(), 0)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._handle is not None:
            with suppress(OSError):
                os.ftruncate(self._handle, 0)
            os.close(self._handle)
            self._handle = None


def _holder(handle: int) -> str:
    """Who holds a lock: waits a moment for one that has only just taken it, and writes down that it has."""
    said = ""
    for _ in range(20):
        said = os.pread(handle, 32, 0).decode(errors="replace").strip()
        kind, _, number = said.partition(" ")
        if kind == "process" and number.isdecimal() and lives(int(number)):
            return said
        time.sleep(0.05)
    return said or "unknown"


def _lock(handle: int) -> None:
    try:
        import fcntl
    except ImportError:
        import msvcrt

        msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined, unused-ignore]
        return
    fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)


# ----------------------------------------------------------------------------------------------------


_CHECK_DIGITS = 16


@dataclass(frozen=True, kw_only=True)
class Record:
    """What the ledger says of one task."""

    stage: str
    task: int
    state: str
    """``"done"`` or ``"failed"``."""
    parameters: str
    """Hash of the parameters and of the task's points."""
    content: str
    """Hash of the results; of a failed task, why it failed."""
    engine: str
    step: float
    model: str
    """Hash of the model's numbers."""
    version: str
    code: str
    """Hash of the package's code, and of what a law or a drive of somebody else's brings along."""
    libraries: str
    """NumPy, Numba and Python with their versions."""
    arithmetic: str
    """Hash of how products, sums and functions were rounded."""
    processor: str
    created: str = ""

    def line(self) -> str:
        """The record as a line of the ledger."""
        text = json.dumps(asdict(self), sort_keys=True, separators=(",", ":"), allow_nan=False)
        return f"{text}\t{_check(text)}"

    @classmethod
    def from_line(cls, line: str) -> Record | None:
        """The record a line holds; None if it is torn, altered or none."""
        text, tab, check = line.rstrip("\n").rpartition("\t")
        if not tab or check != _check(text):
            return None
        values = json.loads(text)
        kinds = {field.name: field.type for field in fields(cls)}
        if not isinstance(values, dict) or values.keys() != kinds.keys():
            return None
        allowed: dict[str, tuple[type, ...]] = {"str": (str,), "int": (int,), "float": (int, float)}
        if not all(isinstance(values[name], allowed[str(kind)]) for name, kind in kinds.items()):
            return None
        return cls(**values) if values["state"] in ("done", "failed") else None


def _check(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:_CHECK_DIGITS]


class Ledger:
    """The records of a store, the last one of each task."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.records: dict[tuple[str, int], Record] = {}
        self.torn = 0
        if path.exists():
            with path.open(encoding="utf-8", errors="replace") as stream:
                for line in stream:
                    record = Record.from_line(line)
                    if record is None:
                        self.torn += bool(line.strip())
                    else:
                        self.records[member(record.stage), record.task] = record

    def write(self, record: Record) -> None:
        """Append a record and have it on the disk."""
        record = Record(**(asdict(record) | {"created": record.created or created_now()}))
        append_line(self.path, record.line())
        self.records[record.stage, record.task] = record
