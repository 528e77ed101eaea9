"""Which files that exist may be replaced: in Python every one, on the command line those that snapbeam wrote.

Files carry a mark: NetCDF and JSON files the version as an attribute, pictures and animations a line in what they say
of themselves.  Text that a person edits, such as a parameter file, carries none and is never replaced unasked.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path

from snapbeam.core.validate import InputError
from snapbeam.core.version import __version__

__all__ = ["MADE_BY", "VERSION", "foreign_files_kept", "is_ours", "refuse_foreign"]

VERSION = "snapbeam_version"
"""Name of the attribute of NetCDF files and of the key of JSON files."""
MADE_BY = f"made by snapbeam {__version__}"
"""What pictures and animations say of themselves."""
_MARK = b"made by snapbeam "
_LOOKED_AT = 1 << 16  # bytes, at each end


@dataclass(frozen=True)
class _Guard:
    """The files that a command names, and those of them that it may write to."""

    named: tuple[Path, ...]
    allowed: set[Path] = field(default_factory=set)


_GUARD: ContextVar[_Guard | None] = ContextVar("guard", default=None)


@contextmanager
def foreign_files_kept(named: Sequence[Path] = ()) -> Iterator[None]:
    """In the block, refuse to replace files that snapbeam did not write, and those that are read too.

    Parameters
    ----------
    named : sequence of path
        Every file that a command names: one that stands there twice is read as well as written.
    """
    token = _GUARD.set(_Guard(tuple(path.resolve() for path in named)))
    try:
        yield
    finally:
        _GUARD.reset(token)


def refuse_foreign(target: Path, name: str, begin: str = "") -> None:
    """Refuse a file to be written if a guard is up and it would replace what is not snapbeam's.

    What was allowed once stays so: a file that appears while a result is computed does not cost the result.

    Raises
    ------
    InputError
        If *target* exists and snapbeam did not write it, or it is named twice.
    """
    guard = _GUARD.get()
    if guard is None or (there := target.resolve()) in guard.allowed:
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
    guard.allowed.add(there)


def is_ours(path: str | os.PathLike[str], begin: str = "") -> bool:
    """Whether a file says that snapbeam made it; an empty one may be anybody's.

    Parameters
    ----------
    path : path
    begin : str
        What text of this kind begins with, such as the names of the columns of a table.
    """
    path = Path(path)
    if not path.is_file():
        return False
    if not path.stat().st_size:
        return True
    with suppress(OSError, ValueError):
        if path.suffix.lower() == ".nc":
            return _attribute(path)
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


def _attribute(path: Path) -> bool:
    """Whether the root of a NetCDF file has the attribute; False of what is no such file."""
    import h5py

    with h5py.File(path, "r") as file:
        return VERSION in file.attrs
