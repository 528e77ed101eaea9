"""Files of a checkpoint: durable writes, the lock of the writer, and the task log.

The task log has one line for each finished or failed task: a JSON object and its check sum.  A line is written and
synced after the data of its task.  snapbeam ignores a torn or altered line and computes its task again.
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

PARTIAL = ".partial"
"""Suffix of a file that is being written."""
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}")
_CHECK_DIGITS = 16
_LARGEST_LOG = 2**30
"""Largest task log, bytes: about a million tasks."""


# Errors of checkpoints and clusters.


class CheckpointError(OSError):
    """A checkpoint cannot be written or read, or its workers cannot compute; the message contains the remedy.

    See Also
    --------
    snapbeam.CheckpointOptions, snapbeam.read_checkpoint

    Examples
    --------
    >>> import snapbeam as sb
    >>> try:
    ...     sb.read_checkpoint("no_such_folder")
    ... except (sb.CheckpointError, sb.InputError) as error:
    ...     print(type(error).__name__)
    InputError
    """


# Files of a checkpoint: each is on the disk when the call returns, and only one process writes them.


def durable_write(path: Path, data: bytes | memoryview) -> None:
    """Write a file atomically: after a crash the file is complete or absent."""
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
    """Append a line to a file and sync it; a torn last line is ended first."""
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
    """Return *name* if it is a valid name of a member of a checkpoint: not a path, not hidden, without dots upward."""
    if not isinstance(name, str) or not _NAME.fullmatch(name) or ".." in name:
        raise InputError(f"checkpoint: {name!r} is not a name of a member of a checkpoint")
    return name


def refuse_links(folder: Path, *, sweep: bool) -> None:
    """Refuse a checkpoint that contains anything except plain files and folders.

    A link could make a resumed sweep read or write outside its checkpoint.  *sweep* removes partial files.  Only the
    process that holds the lock may remove them, because another process may be writing them.
    """
    pending = [folder]
    while pending:
        with os.scandir(pending.pop()) as entries:
            for entry in entries:
                try:
                    mode = entry.stat(follow_symlinks=False).st_mode
                except FileNotFoundError:  # the writer has renamed its partial file
                    continue
                if stat.S_ISDIR(mode):
                    pending.append(Path(entry.path))
                elif not stat.S_ISREG(mode):
                    raise _link(Path(entry.path), folder)
                elif sweep and entry.name.startswith(".") and entry.name.endswith(PARTIAL):
                    os.unlink(entry.path)


def _link(path: Path, folder: Path) -> InputError:
    inside = path.relative_to(folder)
    return InputError(f"checkpoint = {str(folder)!r}: {str(inside)!r} is a link or not a plain file")


def open_own(path: Path, flags: int) -> int:
    """Open a file of a checkpoint for writing in place; refuse a link and a file with a second name."""
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


class CheckpointLock:
    """Exclusive lock for writing a checkpoint; the operating system releases it when the process ends."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._handle: int | None = None

    def __enter__(self) -> Self:
        from filelock import lock_descriptor

        handle = open_own(self.path, os.O_RDWR)
        if not lock_descriptor(handle, blocking=False):
            holder = _holder(handle)
            os.close(handle)
            raise CheckpointError(
                f"checkpoint = {str(self.path.parent)!r}: another process is writing it ({holder}); "
                "wait for it, or stop it"
            )
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
    """Return the process that holds a lock; waits up to a second for a new holder to write its number."""
    holder = ""
    for _ in range(20):
        holder = os.pread(handle, 32, 0).decode(errors="replace").strip()
        kind, _, number = holder.partition(" ")
        if kind == "process" and number.isdecimal() and lives(int(number)):
            return holder
        time.sleep(0.05)
    return holder or "unknown"


@dataclass(frozen=True, kw_only=True)
class TaskRecord:
    """Entry of the task log: how one task ended, and what computed it."""

    stage: str
    task: int
    state: str
    """``"done"`` or ``"failed"``."""
    parameters: str
    """Hash of the parameters and of the task's points."""
    content: str
    """Hash of the results; the reason if the task failed."""
    engine: str
    step: float
    model: str
    """Hash of the matrices of the model."""
    version: str
    code: str
    """Hash of the code of the package, and of contact laws and drives that are defined outside it."""
    libraries: str
    """Versions of NumPy and Python."""
    arithmetic: str
    """Hash of the rounding of products, sums and elementary functions."""
    processor: str
    created: str = ""

    def line(self) -> str:
        """Return the record as a line of the task log."""
        text = json.dumps(asdict(self), sort_keys=True, separators=(",", ":"), allow_nan=False)
        return f"{text}\t{_check(text)}"

    @classmethod
    def from_line(cls, line: str) -> TaskRecord | None:
        """Return the record of a line; None if the line is torn or altered."""
        text, tab, check = line.rstrip("\n").rpartition("\t")
        if not tab or check != _check(text):
            return None
        try:
            values = json.loads(text)
        except (ValueError, RecursionError):  # nested too deep, or an integer of thousands of digits
            return None
        kinds = {field.name: field.type for field in fields(cls)}
        if not isinstance(values, dict) or values.keys() != kinds.keys():
            return None
        allowed: dict[str, tuple[type, ...]] = {"str": (str,), "int": (int,), "float": (int, float)}
        if not all(isinstance(values[name], allowed[str(kind)]) for name, kind in kinds.items()):
            return None
        return cls(**values) if values["state"] in ("done", "failed") else None


def _check(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:_CHECK_DIGITS]


class TaskLog:
    """Records of a checkpoint: the last one of each task."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.records: dict[tuple[str, int], TaskRecord] = {}
        self.torn = 0
        if path.exists():
            if path.stat().st_size > _LARGEST_LOG:
                raise InputError(f"checkpoint = {str(path.parent)!r}: {path.name!r} is larger than 1 GiB")
            with path.open(encoding="utf-8", errors="replace") as stream:
                for line in stream:
                    record = TaskRecord.from_line(line)
                    if record is None:
                        self.torn += bool(line.strip())
                    else:
                        self.records[member(record.stage), record.task] = record

    def write(self, record: TaskRecord) -> None:
        """Append a record and sync the file."""
        record = TaskRecord(**(asdict(record) | {"created": record.created or created_now()}))
        append_line(self.path, record.line())
        self.records[record.stage, record.task] = record
