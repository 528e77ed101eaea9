"""HDF5 files of strangers: their links are followed nowhere else, and their contents fit the memory."""

from __future__ import annotations

import os
import stat
from pathlib import Path
from typing import TYPE_CHECKING

from snapbeam.util.input_files import refuse_inflated
from snapbeam.util.validation import InputError, file_path

if TYPE_CHECKING:
    import h5py

_MOST_TEXTS = 100_000
_MOST_GROUPS = 1_000
_MOST_DATASETS = 100_000
_DEEPEST = 32
"""Levels of groups.  The libraries' time grows with the square of their number."""


def open_hdf5(path: str | os.PathLike[str], name: str = "path", *, in_parts: bool = False) -> h5py.File:
    """Open an HDF5 file for reading, after a check of every link and dataset; no other file is opened.

    Every reader calls this, also before a library that opens the file itself.

    Parameters
    ----------
    path : path
    name : str
        The parameter to name in a refusal.
    in_parts : bool
        True if the numbers are read in parts, so that a content larger than the memory is allowed.

    Returns
    -------
    h5py.File
        To be closed by the caller.

    Raises
    ------
    InputError
        If *path* is no regular file; for external links, links of unknown kinds, links from a group to a group that has
        another place, numbers in other files (external storage, virtual datasets), more than 32 levels, 1,000 groups,
        100,000 datasets or 100,000 texts, and for content that
        :func:`~snapbeam.util.input_files.refuse_inflated` refuses; if *path* is no HDF5 file, or is damaged.

    Examples
    --------
    >>> with open_hdf5("run.nc") as file:  # doctest: +SKIP
    ...     print(list(file))
    """
    import h5py

    source = file_path(name, path)
    if not source.exists():
        raise InputError(f"{name} = {str(path)!r}: no such file")
    if not stat.S_ISREG(source.stat().st_mode):
        raise InputError(f"{name} = {str(path)!r}: must be a regular file, not a folder, a device or a pipe")
    file = None
    try:
        file = h5py.File(source, "r")
        size = _size(file, f"{name} = {str(path)!r}")
        if not in_parts:
            refuse_inflated(name, path, size)
    except BaseException as error:
        if file is not None:
            file.close()
        if isinstance(error, InputError) or not isinstance(error, Exception):
            raise
        said = (
            str(error).strip().split("\n")[0][:200]
        )  # of damaged bytes the library makes errors of every kind
        raise InputError(
            f"{name} = {str(path)!r}: is no NetCDF or HDF5 file, or is damaged ({said or type(error).__name__})"
        ) from error
    return file


def _size(file: h5py.File, where: str) -> int:
    """Bytes of all datasets by way of every link, at 8 bytes for a number.

    The calls of the lower level do not follow links.  The size of a virtual dataset is not asked for, because the
    library opens its sources to find it.
    """
    import h5py

    root = file.id
    waiting = [(h5py.h5g.open(root, b"/"), Path("/"))]
    groups = {h5py.h5o.get_info(root).addr}
    soft: list[tuple[h5py.h5g.GroupID, bytes, Path]] = []
    size = texts = datasets = 0

    def add(item: h5py.h5d.DatasetID, at: Path) -> None:
        nonlocal size, texts, datasets
        made = item.get_create_plist()
        if made.get_layout() == h5py.h5d.VIRTUAL or made.get_external_count():
            raise InputError(f"{where}: {_said(at)} has its numbers in another file: copy them into this one")
        kind, count = item.get_type(), 1
        for length in item.shape or ():
            count *= int(length)
        if item.get_space().get_simple_extent_type() == h5py.h5s.NULL:
            count = 0
        size += count * max(kind.get_size(), 8)
        texts += count if kind.dtype.hasobject else 0
        datasets += 1
        if texts > _MOST_TEXTS:
            raise InputError(f"{where}: has more than {_MOST_TEXTS} texts")
        if datasets > _MOST_DATASETS:
            raise InputError(f"{where}: has more than {_MOST_DATASETS} datasets")

    while waiting:
        group, place = waiting.pop()
        for key in list(group):
            at = place / key.decode("utf-8", "replace")
            link = group.links.get_info(key).type
            if link == h5py.h5l.TYPE_SOFT:
                soft.append((group, key, at))
                continue
            if link != h5py.h5l.TYPE_HARD:
                raise InputError(
                    f"{where}: {_said(at)} is a link to another file: copy what it names into this one"
                )
            item = h5py.h5o.open(group, key)
            if isinstance(item, h5py.h5d.DatasetID):
                add(item, at)
            elif isinstance(item, h5py.h5g.GroupID):
                if (address := h5py.h5o.get_info(item).addr) in groups:
                    raise InputError(
                        f"{where}: {_said(at)} is a group that has another place: must have one place"
                    )
                groups.add(address)
                if len(groups) > _MOST_GROUPS:
                    raise InputError(f"{where}: has more than {_MOST_GROUPS} groups")
                if len(at.parts) > _DEEPEST:
                    raise InputError(f"{where}: has more than {_DEEPEST} levels of groups")
                waiting.append((item, at))
    # soft links last: no link to another file is left that one of them could pass
    for group, key, at in soft:
        try:
            item = h5py.h5o.open(group, key)
        except KeyError:
            raise InputError(f"{where}: {_said(at)} is a link to nothing in this file") from None
        if isinstance(item, h5py.h5g.GroupID):
            raise InputError(f"{where}: {_said(at)} is a link to a group: must be a link to a dataset")
        if isinstance(item, h5py.h5d.DatasetID):
            add(item, at)
    return size


def _said(at: Path) -> str:
    text = repr(at.as_posix().lstrip("/"))
    return text if len(text) <= 80 else f"{text[:38]}...{text[-38:]}"
