"""HDF5 files of strangers: their links are followed nowhere else, and their contents fit the memory."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

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
        100,000 datasets or 100,000 texts, stored texts of impossible lengths, and for content that
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
        size, has_texts = _size(file, f"{name} = {str(path)!r}")
        if has_texts:
            _refuse_endless_heaps(file, source, f"{name} = {str(path)!r}")
        if not in_parts:
            refuse_inflated(name, path, size)
    except BaseException as error:
        if file is not None:
            file.close()
        if isinstance(error, InputError) or not isinstance(error, Exception):
            raise
        # of damaged bytes the library makes errors of every kind, in words about its own calls
        raise InputError(f"{name} = {str(path)!r}: is no NetCDF or HDF5 file, or is damaged") from error
    return file


def members_of(group: h5py.Group) -> tuple[dict[str, Any], dict[str, Any]]:
    """Groups and datasets in a group and in those below it, by their names."""
    import h5py

    found: dict[str, Any] = {}
    group.visititems(found.__setitem__)
    groups = {name: item for name, item in found.items() if isinstance(item, h5py.Group)}
    return groups, {name: item for name, item in found.items() if isinstance(item, h5py.Dataset)}


def _size(file: h5py.File, where: str) -> tuple[int, bool]:
    """Bytes of all datasets by way of every link, at 8 bytes for a number; whether anything is stored in heaps.

    The calls of the lower level do not follow links.  The size of a virtual dataset is not asked for, because the
    library opens its sources to find it.
    """
    import h5py

    root = file.id
    waiting = [(h5py.h5g.open(root, b"/"), Path("/"))]
    groups = {h5py.h5o.get_info(root).addr}
    soft: list[tuple[h5py.h5g.GroupID, bytes, Path]] = []
    size = texts = datasets = 0
    has_texts = False

    def look(item: h5py.h5d.DatasetID | h5py.h5g.GroupID) -> None:
        """Take note of attributes of variable length, whose types are read and not the values."""
        nonlocal has_texts
        for number in range(h5py.h5a.get_num_attrs(item)):
            has_texts |= _in_heap(h5py.h5a.open(item, index=number).get_type())

    def add(item: h5py.h5d.DatasetID, at: Path) -> None:
        nonlocal size, texts, datasets, has_texts
        look(item)
        made = item.get_create_plist()
        if made.get_layout() == h5py.h5d.VIRTUAL or made.get_external_count():
            raise InputError(f"{where}: {_said(at)} has its numbers in another file: copy them into this one")
        kind, count = item.get_type(), 1
        for length in item.shape or ():
            count *= int(length)
        if item.get_space().get_simple_extent_type() == h5py.h5s.NULL:
            count = 0
        size += count * max(kind.get_size(), 8)
        has_texts |= _in_heap(kind)
        texts += count if kind.dtype.hasobject else 0
        datasets += 1
        if texts > _MOST_TEXTS:
            raise InputError(f"{where}: has more than {_MOST_TEXTS} texts")
        if datasets > _MOST_DATASETS:
            raise InputError(f"{where}: has more than {_MOST_DATASETS} datasets")

    while waiting:
        group, place = waiting.pop()
        look(group)
        for key in list(group):
            at = place / key.decode("utf-8", "replace")
            link = group.links.get_info(key).type
            if link == h5py.h5l.TYPE_SOFT:
                soft.append((group, key, at))
                continue
            if link != h5py.h5l.TYPE_HARD:
                raise InputError(f"{where}: {_said(at)} is a link to another file: copy what it names into this one")
            item = h5py.h5o.open(group, key)
            if isinstance(item, h5py.h5d.DatasetID):
                add(item, at)
            elif isinstance(item, h5py.h5g.GroupID):
                if (address := h5py.h5o.get_info(item).addr) in groups:
                    raise InputError(f"{where}: {_said(at)} is a group that has another place: must have one place")
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
    return size, has_texts


def _in_heap(kind: h5py.h5t.TypeID) -> bool:
    """Return whether values of a type may be stored in the global heaps of the file."""
    from h5py import h5t

    if isinstance(kind, h5t.TypeStringID):
        return bool(kind.is_variable_str())
    return any(kind.detect_class(each) for each in (h5t.VLEN, h5t.STRING, h5t.REFERENCE))


_HEAP = b"GCOL\x01"
_HEAD = 16
"""Bytes before the first object of a heap, and before the content of each."""
_LEAST_HEAP = 4096
_WINDOW = 2**24


def _refuse_endless_heaps(file: h5py.File, source: Path, where: str) -> None:
    """Refuse a file with a heap whose list of objects does not advance, which the library follows without end.

    A heap (HDF5 File Format Specification, III.E) is a list of objects: number (2 bytes), references (2), 4 bytes, size of
    the content.  Object 0 is the free space up to the end, whose size includes its head.
    """
    width = file.id.get_create_plist().get_sizes()[1]
    left = source.stat().st_size // _HEAD + 1  # objects without overlap
    with source.open("rb") as raw:
        for begin in _places(raw, _HEAP):
            raw.seek(begin + 8)
            size = int.from_bytes(raw.read(width), "little")
            end = begin + size
            if size < _LEAST_HEAP or end > source.stat().st_size:  # no heap: the library refuses it
                continue
            at = begin + _HEAD
            while at + _HEAD <= end:
                raw.seek(at)
                head = raw.read(_HEAD)
                length = int.from_bytes(head[8 : 8 + width], "little")
                step = _HEAD + -(-length // 8) * 8 if head[:2] != b"\0\0" else length
                left -= 1
                if not _HEAD <= step <= end - at or left < 0:
                    raise InputError(
                        f"{where}: is damaged, a stored text at byte {at} has the impossible length {length}"
                    )
                at += step


def _places(raw: BinaryIO, mark: bytes) -> Iterator[int]:
    """Places of a mark in a file, which is read in parts."""
    begin, kept = 0, b""
    while True:
        raw.seek(begin)
        if not (part := raw.read(_WINDOW)):
            return
        whole, first = kept + part, begin - len(kept)
        at = whole.find(mark)
        while at >= 0:
            yield first + at
            at = whole.find(mark, at + 1)
        begin, kept = begin + len(part), whole[-len(mark) + 1 :]


def _said(at: Path) -> str:
    text = repr(at.as_posix().lstrip("/"))
    return text if len(text) <= 80 else f"{text[:38]}...{text[-38:]}"
