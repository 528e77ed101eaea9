"""Files that are either whole or not there: checked before the work, renamed into place after it."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from snapbeam.core.validate import InputError, InputTypeError

__all__ = ["atomic_path", "check_writable"]


def check_writable(
    path: str | os.PathLike[str], name: str = "output", suffixes: tuple[str, ...] = ()
) -> Path:
    """Return *path* if a file can be written there; refuse it, before any work, if not.

    Parameters
    ----------
    path : path
        The file to be written.  One that exists will be replaced.
    name : str
        The parameter to name in a refusal.
    suffixes : tuple of str
        The allowed ends of the name, such as ``(".nc",)``; any if empty.

    Raises
    ------
    InputError
        If the folder is missing or cannot be written to, *path* is a folder, or its suffix is not allowed.
    """
    if not isinstance(path, (str, os.PathLike)):
        raise InputTypeError(f"{name} = {path!r}: must be a path, not {type(path).__name__}")
    target = Path(path)
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
    return target


@contextmanager
def atomic_path(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Give a temporary path beside *path* to write to, and rename it to *path* if all went well.

    If the block raises, an interrupt included, the temporary file is removed and *path* is left as it was.

    Examples
    --------
    >>> with atomic_path("map.nc") as temporary:  # doctest: +SKIP
    ...     dataset.to_netcdf(temporary)
    """
    target = Path(path)
    handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.stem}.", suffix=target.suffix)
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        mask = os.umask(0)
        os.umask(mask)
        temporary.chmod(0o666 & ~mask)
        os.replace(temporary, target)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
