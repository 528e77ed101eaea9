"""Files that are either whole or not there: checked before the work, renamed into place after it."""

from __future__ import annotations

import errno
import hashlib
import os
import platform
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from snapbeam.core.foreign import refuse_foreign
from snapbeam.core.validate import InputError, file_path

__all__ = ["NoRoomError", "atomic_path", "check_writable", "lives"]


def check_writable(
    path: str | os.PathLike[str],
    name: str = "output",
    suffixes: tuple[str, ...] = (),
    begin: str = "",
    *,
    appended: bool = False,
) -> Path:
    """Return *path* if a file can be written there; refuse it, before any work, if not.

    Parameters
    ----------
    path : path
        The file to be written.  One that exists will be replaced; a command of the command line replaces only
        what snapbeam wrote (:mod:`snapbeam.core.foreign`).
    name : str
        The parameter to name in a refusal.
    suffixes : tuple of str
        The allowed ends of the name, such as ``(".nc",)``; any if empty.
    begin : str
        What text of this kind begins with, by which a file that snapbeam wrote is known.
    appended : bool
        Whether what is there stays, as in a log: then anybody's file will do.

    Raises
    ------
    InputError
        If the folder is missing or cannot be written to, *path* is a folder, its suffix is not allowed, or a
        command would replace what is not snapbeam's.
    """
    target = file_path(name, path)
    if suffixes and target.suffix.lower() not in suffixes:
        raise InputError(f"{name} = {str(path)!r}: must end in {' or '.join(suffixes)}")
    if target.is_dir():
        raise InputError(f"{name} = {str(path)!r}: must be a file, not a folder")
    folder = target.parent
    if not folder.is_dir():
        raise InputError(
            f"{name} = {str(path)!r}: cannot be written, {str(folder)!r} is not an existing folder"
        )
    try:
        with tempfile.NamedTemporaryFile(dir=folder, prefix=f".{target.name}."):
            pass
        if target.exists():
            with target.open("ab"):
                pass
    except OSError as error:
        raise InputError(f"{name} = {str(path)!r}: cannot be written, {error.strerror or error}") from error
    if not appended:
        refuse_foreign(target, name, begin)
    return target


class NoRoomError(OSError):
    """A file that could not be written since the disk is full: the message says how much room is needed."""


@contextmanager
def atomic_path(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Give a temporary path beside *path* to write to, and rename it to *path* if all went well.

    If the block raises, an interrupt included, the temporary file is removed and *path* is left as it was.  What a
    process that was killed left of its own is removed by the next that writes there.

    Examples
    --------
    >>> with atomic_path("system.toml") as temporary:  # doctest: +SKIP
    ...     temporary.write_text(text)
    """
    target = Path(path)
    _sweep(target)
    try:
        handle, name = tempfile.mkstemp(
            dir=target.parent, prefix=f".{target.stem}.{_HERE}-{os.getpid()}-", suffix=target.suffix
        )
    except OSError as error:
        raise _said(error, target) from error
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        mask = os.umask(0)
        os.umask(mask)
        temporary.chmod(0o666 & ~mask)
        os.replace(temporary, target)
    except BaseException as error:
        temporary.unlink(missing_ok=True)
        if isinstance(error, OSError) and not isinstance(error, NoRoomError):
            raise _said(error, target) from error
        raise


_HERE = hashlib.sha256(platform.node().encode()).hexdigest()[:6]
"""A mark of this machine: the numbers of its processes mean nothing on another that shares the disk."""


def _sweep(target: Path) -> None:
    """Remove what killed processes of this machine left beside *target*."""
    if os.name == "nt":
        return
    begin = f".{target.stem}.{_HERE}-"
    with suppress(OSError), os.scandir(target.parent) as entries:
        for entry in entries:
            if entry.name.startswith(begin) and entry.name.endswith(target.suffix):
                number = entry.name[len(begin) :].partition("-")[0]
                if number.isdecimal() and not lives(int(number)):
                    os.unlink(entry.path)


def lives(process: int) -> bool:
    """Whether a process of this machine is there."""
    if os.name == "nt":
        return True
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        return True
    return True


def _said(error: OSError, target: Path) -> OSError:
    """The error of a full disk in words; any other as it is."""
    if error.errno not in (errno.ENOSPC, errno.EDQUOT):
        return error
    return NoRoomError(
        f"{str(target)!r}: cannot be written, {error.strerror}: make room and give the same command again"
    )
