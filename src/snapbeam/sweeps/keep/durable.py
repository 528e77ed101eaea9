"""Files of a store: on the disk when a call returns, owned by one writer, and never anyone else's."""

from __future__ import annotations

import os
import re
import stat
import uuid
from pathlib import Path
from types import TracebackType
from typing import Self

from snapbeam.core.validate import InputError
from snapbeam.sweeps.errors import StoreError

__all__ = ["PARTIAL", "StoreLock", "append_line", "durable_write", "member", "refuse_links"]

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
    handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND | getattr(os, "O_NOFOLLOW", 0), 0o666)
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


def refuse_links(folder: Path) -> None:
    """Refuse a store in which anything is neither a plain file nor a plain folder; remove torn files.

    A link could make a resumed map read, or write, outside its store.
    """
    pending = [folder]
    while pending:
        with os.scandir(pending.pop()) as entries:
            for entry in entries:
                mode = entry.stat(follow_symlinks=False).st_mode
                if stat.S_ISDIR(mode):
                    pending.append(Path(entry.path))
                elif not stat.S_ISREG(mode):
                    inside = Path(entry.path).relative_to(folder)
                    raise InputError(f"store = {str(folder)!r}: {str(inside)!r} is a link or no plain file")
                elif entry.name.startswith(".") and entry.name.endswith(PARTIAL):
                    os.unlink(entry.path)


class StoreLock:
    """The right to write a store: held by one process, given back by the system however it ends."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._handle: int | None = None

    def __enter__(self) -> Self:
        handle = os.open(self.path, os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0), 0o666)
        try:
            _lock(handle)
        except OSError:
            holder = os.pread(handle, 32, 0).decode(errors="replace").strip() or "unknown"
            os.close(handle)
            raise StoreError(
                f"store = {str(self.path.parent)!r}: is being written by another process ({holder}); "
                "wait for it, or stop it"
            ) from None
        os.ftruncate(handle, 0)
        os.pwrite(handle, f"process {os.getpid()}\n".encode(), 0)
        self._handle = handle
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._handle is not None:
            os.close(self._handle)
            self._handle = None


def _lock(handle: int) -> None:
    try:
        import fcntl
    except ImportError:
        import msvcrt

        msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined, unused-ignore]
        return
    fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
