"""Files that are either whole or not there: checked before the work, renamed into place after it."""

from __future__ import annotations

import errno
import hashlib
import json
import os
import platform
import shutil
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path

from snapbeam._version import __version__
from snapbeam.util.memory_limit import limit
from snapbeam.util.packages import needing
from snapbeam.util.validation import InputError, file_path

__all__ = [
    "MADE_BY", "REQUEST", "VERSION", "NoRoomError", "atomic_path", "check_writable", "foreign_files_kept",
    "is_ours", "lives", "missing_room", "refuse_foreign", "request_hash", "require_room", "require_room_of",
    "set_request",
]  # fmt: skip

VERSION = "snapbeam_version"
"""Name of the attribute of NetCDF files and of the key of JSON files."""
MADE_BY = f"made by snapbeam {__version__}"
"""Provenance text in pictures and animations."""
_MARK = b"made by snapbeam "
_LOOKED_AT = 1 << 16  # bytes, at each end
_TRIED = 4096
"""Bytes that are written to a folder to see whether it takes a file."""
REQUEST = "request_hash"
"""Name of the attribute of NetCDF files that a command wrote: the hash of its parameters."""
_HASHED = 64 * 2**20
"""Bytes of an input file up to which its content is part of the request; of larger ones size and time are."""

_NEEDED = {
    ".mp4": ("imageio_ffmpeg", "video"),
    ".mov": ("imageio_ffmpeg", "video"),
    ".uff": ("pyuff", "lab"),
    ".unv": ("pyuff", "lab"),
    ".tdms": ("nptdms", "lab"),
}
"""Module that writes files of a suffix, and the extra of the distribution that installs it."""


# Which files that exist may be replaced: in Python every one, on the command line those that snapbeam wrote.
#
# Files carry a mark: NetCDF and JSON files the version as an attribute, pictures and animations a line in what they say
# of themselves.  Text that a person edits, such as a parameter file, carries none and is never replaced unasked.


@dataclass
class _Guard:
    """Input files, output files and arguments of a command."""

    named: tuple[Path, ...]
    defaults: tuple[Path, ...]
    request: str
    force: bool
    allowed: set[Path] = field(default_factory=set)


_GUARD: ContextVar[_Guard | None] = ContextVar("guard", default=None)


@contextmanager
def foreign_files_kept(
    named: Sequence[Path] = (), *, defaults: Sequence[Path] = (), request: object = None, force: bool = False
) -> Iterator[None]:
    """In the block, refuse to replace files that snapbeam did not write, and those that are read too, unless *force*.

    A file that stands twice among *named* is read as well as written.  In *defaults*, written to since no other was
    named, results of another *request* stay; the hash of the request is in the NetCDF files.
    """
    guard = _Guard(
        tuple(path.resolve() for path in named), tuple(path.resolve() for path in defaults), _hash(request), force
    )
    token = _GUARD.set(guard)
    try:
        yield
    finally:
        _GUARD.reset(token)


def set_request(request: object) -> None:
    """Replace the request of the running command by parameters that it has completed, as from a checkpoint."""
    if (guard := _GUARD.get()) is not None:
        guard.request = _hash(request)


def request_hash() -> str | None:
    """Return the hash of the request of the running command; None if no command runs."""
    guard = _GUARD.get()
    return None if guard is None else guard.request


def _hash(request: object) -> str:
    text = json.dumps(request, sort_keys=True, default=_described)
    return hashlib.sha256(text.encode()).hexdigest()


def _described(value: object) -> object:
    """Plain values for an argument of a command: of a path, what is there."""
    if not isinstance(value, Path):
        return value.tolist() if hasattr(value, "tolist") else repr(value)
    if value.is_dir():
        return sorted((each.name, each.stat().st_size, each.stat().st_mtime_ns) for each in value.iterdir())
    if not value.is_file():
        return str(value)
    found = value.stat()
    if found.st_size > _HASHED:
        return value.name, found.st_size, found.st_mtime_ns
    return hashlib.sha256(value.read_bytes()).hexdigest()


def refuse_foreign(target: Path, name: str, begin: str = "") -> None:
    """Refuse a file to be written if a guard is up and it would replace what is not snapbeam's, or another result.

    What was allowed once stays so: a file that appears while a result is computed does not cost the result.
    """
    guard = _GUARD.get()
    if guard is None or guard.force or (there := target.resolve()) in guard.allowed:
        return
    if guard.named.count(there) > 1:
        raise InputError(
            f"{name} = {str(target)!r}: is named twice, as what is read and what is written; give another name, or "
            "--force"
        )
    if target.exists() and not is_ours(target, begin):
        raise InputError(
            f"{name} = {str(target)!r}: exists and does not say that snapbeam made it; give another name, or --force "
            "to replace it"
        )
    by_default = there in guard.defaults or there.parent in guard.defaults
    if by_default and target.suffix == ".nc" and target.exists():
        found = _attribute(target, REQUEST) if target.stat().st_size else guard.request
        if found != guard.request:
            raise InputError(
                f"{name} = {str(target)!r}: exists, and its parameters are not those of this command; name another output "
                "with -o, or give --force to replace it"
            )
    guard.allowed.add(there)


def is_ours(path: str | os.PathLike[str], begin: str = "") -> bool:
    """Return whether snapbeam made a file, of which text starts with *begin*; True for an empty file."""
    path = Path(path)
    if not path.is_file():
        return False
    if not path.stat().st_size:
        return True
    with suppress(OSError, ValueError):
        if path.suffix.lower() == ".nc":
            return _attribute(path, VERSION) is not None
        if path.suffix.lower() == ".json":
            found = json.loads(path.read_text(encoding="utf-8"))
            return isinstance(found, dict) and VERSION in found
        with path.open("rb") as file:
            head = file.read(_LOOKED_AT)
            if begin:
                return head.startswith(begin.encode())
            file.seek(-min(_LOOKED_AT, path.stat().st_size), os.SEEK_END)
            pictures = (".png", ".pdf", ".svg", ".gif", ".mp4", ".mov", ".avi")
            return path.suffix.lower() in pictures and _MARK in head + b"\0" + file.read()
    return False


def _attribute(path: Path, name: str) -> object:
    """An attribute of the root of a NetCDF file; None if it has none that can be read."""
    from snapbeam.util.hdf5 import open_hdf5

    with suppress(Exception):  # of damaged bytes the library makes errors of every kind
        with open_hdf5(path, in_parts=True) as file:
            return file.attrs.get(name)
    return None


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
        what snapbeam wrote (:mod:`snapbeam.util.files`).
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
        If the folder is missing or cannot be written to, *path* is a folder, a device or a pipe, its suffix is not allowed, or a
        command would replace what is not snapbeam's.
    """
    target = file_path(name, path)
    if suffixes and target.suffix.lower() not in suffixes:
        raise InputError(f"{name} = {str(path)!r}: must end in {' or '.join(suffixes)}")
    if target.is_dir():
        raise InputError(f"{name} = {str(path)!r}: must be a file, not a folder")
    if target.exists() and not target.is_file():  # to open a pipe waits for its reader; a device would be replaced
        raise InputError(f"{name} = {str(path)!r}: must be a regular file, not a device, a pipe or a socket")
    folder = target.parent
    if not folder.is_dir():
        raise InputError(f"{name} = {str(path)!r}: cannot be written, {str(folder)!r} is not an existing folder")
    if target.suffix.lower() in _NEEDED:
        module, extra = _NEEDED[target.suffix.lower()]
        with needing(f"{name} = {str(path)!r}: a file {target.suffix}", extra):
            import_module(module)
    if target.suffix.lower() == ".nc" and limit() < float("inf"):
        import_module("h5netcdf")  # whose libraries must fit the memory before the work, too
    try:
        with tempfile.NamedTemporaryFile(dir=folder, prefix=f".{target.stem[:40]}.") as tried:
            tried.write(bytes(_TRIED))  # a full disk still makes empty files
            tried.flush()
        if target.exists():
            with target.open("ab"):
                pass
    except OSError as error:
        raise InputError(f"{name} = {str(path)!r}: cannot be written, {error.strerror or error}") from error
    if not appended:
        refuse_foreign(target, name, begin)
    return target


def missing_room(path: str | os.PathLike[str], size: float, name: str = "output") -> str:
    """Return words if the disk has no room for a file of at least an estimated *size* in bytes; empty if it has.

    A file that will be replaced takes room too: it is removed once the new one is complete.
    """
    folder = Path(path).absolute()
    while not folder.is_dir():  # a folder that will be made
        folder = folder.parent
    try:
        free = shutil.disk_usage(folder).free
    except OSError:
        return ""
    if not size > free:
        return ""
    return f"{name} = {str(path)!r}: needs some {size / 1e6:.3g} MB, and the disk has {free / 1e6:.3g} MB"


def require_room(path: str | os.PathLike[str], size: float, name: str = "output") -> None:
    """Refuse an output for which the disk has no room, before any work; *size* is its least estimated size in bytes."""
    require_room_of({name: (path, size)})


def require_room_of(outputs: Mapping[str, tuple[str | os.PathLike[str], float]]) -> None:
    """Refuse outputs, paths and least sizes in bytes by name, for which together a disk has no room."""
    disks: dict[int, list[str]] = {}
    for name, (path, _) in outputs.items():
        folder = Path(path).absolute().parent
        disks.setdefault(folder.stat().st_dev if folder.is_dir() else 0, []).append(name)
    for names in disks.values():
        size = sum(outputs[name][1] for name in names)
        if words := missing_room(outputs[names[-1]][0], size, names[-1]):
            others = f" with {', '.join(names[:-1])} on the same disk" if names[1:] else ""
            raise InputError(f"{words}{others}: make room or name a file on another disk")


class NoRoomError(OSError):
    """Error if the disk is full; the message states the required size."""


@contextmanager
def atomic_path(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Provide a temporary path next to *path* to write to, and rename it to *path* if all went well.

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
    """Remove temporary files next to *target* of killed processes of this machine."""
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
    """Return whether a process exists on this machine."""
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
