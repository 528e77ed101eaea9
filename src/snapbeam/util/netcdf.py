"""NetCDF files that are written whole or not at all, whatever becomes of the disk.

The HDF5 library cannot be stopped while it writes: a disk or a memory that fills ends in a file that it cannot close, and
may take the process with it.  So it writes to a stream that does not fail.  What the disk has no room for is held in memory;
once the library is done, the file is put where there is room, and the error says where, and how much was needed.  A file
that grows without end reserves room on the disk before each part, and ends before the part for which there is none.
"""

from __future__ import annotations

import errno
import io
import os
import shutil
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

from snapbeam._version import __version__
from snapbeam.util.files import REQUEST, VERSION, NoRoomError, atomic_path, check_writable, request_hash
from snapbeam.util.hdf5 import open_hdf5
from snapbeam.util.interrupts import held_back, raise_held
from snapbeam.util.validation import InputError, file_path, instance, mapping, require_texts

if TYPE_CHECKING:
    import h5netcdf
    import xarray as xr


def read_netcdf(
    path: str | os.PathLike[str], name: str = "path", group: str | None = None, *, lazily: bool = False
) -> xr.Dataset:
    """Read the dataset in a NetCDF file, or in a group of it, into memory unless *lazily*."""
    from snapbeam.util.datasets import xr

    if not file_path(name, path).is_file():
        raise InputError(f"{name} = {str(path)!r}: no such file")
    read = xr.open_dataset if lazily else xr.load_dataset
    try:
        with open(path, "rb") as file:
            if file.read(3) == b"CDF" and group is None:  # version 3, whose layout is not that of HDF5
                return read(path, engine="scipy")
        open_hdf5(path, name).close()
        return read(path, engine="h5netcdf", group=group)
    except (InputError, MemoryError):
        raise
    except Exception as error:  # of damaged bytes the libraries make errors of every kind
        said = str(error).strip().split("\n")[0][:200]
        raise InputError(
            f"{name} = {str(path)!r}: is no NetCDF file of results, or is damaged ({said or type(error).__name__})"
        ) from error


def split_group(path: str | os.PathLike[str]) -> tuple[Path, str | None]:
    """The file and the group that ``FILE.nc:GROUP`` names, or the file alone."""
    text = os.fspath(path)
    file, colon, group = text.rpartition(".nc:")
    if not colon or not group.isidentifier() or os.path.exists(text):
        return Path(path), None
    return Path(f"{file}.nc"), group


def read_result(path: str | os.PathLike[str], name: str = "path", *, lazily: bool = False) -> xr.Dataset:
    """Read the dataset in a file of a result; of a file of several, that of ``FILE.nc:GROUP``."""
    import h5py

    file, group = split_group(file_path(name, path))
    if group is None:
        dataset = read_netcdf(file, name, lazily=lazily)
        if dataset.variables:
            return dataset
    with open_hdf5(file, name) if file.is_file() else nullcontext({}) as stored:
        groups = [each for each in stored if isinstance(stored[each], h5py.Group)]
    if group is None and groups:
        raise InputError(
            f"{name} = {str(path)!r}: has the results {', '.join(groups)}; give one as {file.name}:{groups[0]}"
        )
    if group is not None and file.is_file() and group not in groups:
        others = f"it has {', '.join(groups)}" if groups else f"it is one result; give {file.name} alone"
        raise InputError(f"{name} = {str(path)!r}: has no result {group!r}; {others}")
    return read_netcdf(file, name, group, lazily=lazily)


def write_netcdf(
    data: xr.Dataset | Mapping[str | None, xr.Dataset],
    path: str | os.PathLike[str],
    encoding: Mapping[str | None, Mapping[Any, Any]] | None = None,
) -> None:
    """Write a dataset, or one for each group, to a NetCDF file, whole or not at all.

    A root without the attribute ``snapbeam_version`` gets it, by which the file is known.

    Parameters
    ----------
    data : xarray.Dataset or mapping of str to xarray.Dataset
        Groups by name; None is the root, and comes first.
    path : path
    encoding : mapping of str to mapping, optional
        For each group, that of its variables, as xarray takes it.

    Raises
    ------
    InputError
        If *data* are no datasets, or nothing can be written to *path*, which ends in ``.nc``.
    NoRoomError
        If there is no room for the file; the message states the required size, and the location of the file.

    Examples
    --------
    >>> import snapbeam as sb
    >>> import xarray as xr
    >>> sb.write_netcdf(xr.Dataset({"gap": ("time", [0.0, 1.0])}), "gap.nc")
    """
    from snapbeam.util.datasets import NetCDFStore, xr

    target = check_writable(path, "path", (".nc",))
    groups = {None: data} if isinstance(data, xr.Dataset) else mapping("data", data)
    for name, dataset in groups.items():
        instance(f"data[{name!r}]", dataset, xr.Dataset, "an xarray.Dataset")
        _check_texts(dataset)
    settings = mapping("encoding", {} if encoding is None else encoding)
    with netcdf_file(target) as file:
        for name, dataset in groups.items():
            raise_held()
            group = None if name is None else file.create_group(name)
            store = NetCDFStore(file if group is None else group)
            dataset.dump_to_store(store, encoding=dict(mapping(f"encoding[{name!r}]", settings.get(name, {}))))


def _check_texts(dataset: xr.Dataset) -> None:
    """Raise an error for a name or an attribute of a dataset that is no text of UTF-8, naming it."""
    parts = {"attrs": dataset.attrs} | {f"{name}.attrs": each.attrs for name, each in dataset.variables.items()}
    for where, attrs in parts.items():
        require_texts(where, attrs)
    require_texts("name", [*dataset.variables, *dataset.dims])
    for name, each in dataset.variables.items():
        if each.dtype.kind in "OU":
            require_texts(str(name), each.values)


@contextmanager
def netcdf_file(path: str | os.PathLike[str]) -> Iterator[h5netcdf.File]:
    """Give a NetCDF file to write to, which is put at *path* if all went well; errors as of :func:`write_netcdf`.

    Signals are held back in the block, apart from calls of :func:`~snapbeam.util.interrupts.raise_held`.
    """
    with netcdf_stream(path) as (file, _):
        yield file


@contextmanager
def netcdf_stream(path: str | os.PathLike[str]) -> Iterator[tuple[h5netcdf.File, DiskStream]]:
    """Give what :func:`netcdf_file` gives, and the stream, which reserves room on the disk for a file that grows."""
    import h5netcdf

    import snapbeam.util.datasets  # noqa: F401  (loaded before signals are held back)

    with held_back(), atomic_path(path) as temporary, hdf5_stream(temporary, Path(path)) as stream:
        with h5netcdf.File(stream, "w", invalid_netcdf=False) as file:
            yield file, stream
            if VERSION not in file.attrs:
                file.attrs[VERSION] = __version__
            if (request := request_hash()) is not None:
                file.attrs[REQUEST] = request


@contextmanager
def hdf5_stream(path: Path, target: Path | None = None) -> Iterator[DiskStream]:
    """Give a stream that h5py can write to, and have what it wrote in the file *path*.

    *target* is the name to tell in errors, those of :func:`write_netcdf`.
    """
    with held_back() as incomplete, DiskStream(path) as stream:
        incomplete.add(path)
        try:
            yield stream
        except Exception as error:
            if stream.lost:
                raise _no_memory(target or path) from error
            raise
        stream.settle()
        if stream.lost:
            raise _no_memory(target or path)
        if stream.trouble is not None:
            raise _kept_elsewhere(target or path, stream)


def _no_memory(target: Path) -> OSError:
    return OSError(
        errno.ENOMEM,
        "cannot be written, the memory is not sufficient; make room and give the same command again",
        str(target),
    )


def _kept_elsewhere(target: Path, stream: DiskStream) -> NoRoomError:
    """Save what did not fit where there is room, if there is; the error to raise."""
    free = _free(target.parent, stream)
    there = f", {free / 1e6:.3g} MB are free" if free is not None else ""
    words = (
        f"{str(target)!r}: cannot be written, {stream.trouble.strerror or stream.trouble}; "  # type: ignore[union-attr]
        f"it needs {max(stream.size, 1000) / 1e6:.3g} MB{there}"
    )
    try:
        handle, name = tempfile.mkstemp(prefix=f"{target.stem}.", suffix=target.suffix)
        try:
            with os.fdopen(handle, "wb") as file:
                stream.copy(file)
                file.flush()
                os.fsync(file.fileno())
        except BaseException:
            os.unlink(name)
            raise
    except OSError:
        return NoRoomError(f"{words}: make room and give the same command again")
    return NoRoomError(f"{words}; it was written to {name!r} instead")


def _free(folder: Path, stream: DiskStream) -> int | None:
    """Bytes that are free on the disk once the incomplete file is removed."""
    try:
        return shutil.disk_usage(folder).free + stream.on_disk()
    except OSError:
        return None


_PAGE = 2**16


class DiskStream(io.RawIOBase):
    """A file on disk whose further changes are held in memory once the disk fails.

    The file may be longer than its content: :meth:`reserve` takes room on the disk before it is needed.
    """

    def __init__(self, path: Path) -> None:
        self._file: Any = path.open("w+b", buffering=0)
        self.size = self._at = self._reserved = 0
        self._pages: dict[int, bytearray] = {}
        """Parts of the content that differ from those on the disk, once the disk has failed."""
        self.trouble: OSError | None = None
        self.lost = False
        """True once there was no memory for a part: the content is not whole."""

    def on_disk(self) -> int:
        """Return the bytes that the file takes on the disk."""
        found = os.fstat(self._file.fileno())
        return getattr(found, "st_blocks", 0) * 512 or found.st_size

    def reserve(self, more: int) -> bool:
        """Take room on the disk for so many bytes after the content; return False if there is none."""
        if self.trouble is not None:
            return False
        zeros = bytes(2**20)
        try:
            self._file.seek(begin := max(self._reserved, self.size))
            while begin < self.size + more:
                raise_held()
                begin += self._file.write(zeros[: self.size + more - begin])
                self._reserved = begin
        except OSError:
            return False
        return True

    def write(self, data: Any) -> int:
        """Write at the present place, to the disk or to memory."""
        view = memoryview(data).cast("B")
        done = 0
        try:
            while self.trouble is None and done < len(view):
                self._file.seek(self._at + done)
                done += self._file.write(view[done:])
                self.size = max(self.size, self._at + done)
        except OSError as error:
            self.trouble = error
        try:
            while done < len(view):
                number, begin = divmod(self._at + done, _PAGE)
                part = view[done : done + _PAGE - begin]
                self._page(number)[begin : begin + len(part)] = part
                done += len(part)
        except MemoryError:
            self.lost = True
        self._at += len(view)
        self.size = max(self.size, self._at)
        return len(view)

    def _page(self, number: int) -> bytearray:
        """A part of the content, to be changed in memory."""
        if number not in self._pages:
            self._pages[number] = bytearray(self._stored(number * _PAGE, _PAGE).ljust(_PAGE, b"\0"))
        return self._pages[number]

    def _stored(self, at: int, count: int) -> bytes:
        """Content on the disk, as far as it is there."""
        self._file.seek(at)
        data = b""
        while part := self._file.read(max(0, min(count, self.size - at) - len(data))):
            data += part
        return data

    def _content(self, at: int, count: int) -> bytes:
        """Content from one place, up to the end of a page."""
        number, begin = divmod(at, _PAGE)
        count = min(count, _PAGE - begin, self.size - at)
        page = self._pages.get(number)
        return (self._stored(at, count).ljust(count, b"\0")) if page is None else bytes(page[begin : begin + count])

    def copy(self, file: Any) -> None:
        """Write the content to another file."""
        at = 0
        while at < self.size:
            at += file.write(self._content(at, _PAGE))

    def settle(self) -> None:
        """Have all of it on the disk, as far as it went there, and give the reserved room back."""
        if self.trouble is None:
            try:
                self._file.truncate(self.size)
                os.fsync(self._file.fileno())
            except OSError as error:
                if error.errno not in (errno.EINVAL, errno.ENOTSUP):
                    self.trouble = error

    def readinto(self, buffer: Any) -> int:
        """Read from the present place."""
        view, done = memoryview(buffer).cast("B"), 0
        try:
            while done < len(view) and self._at < self.size:
                part = self._content(self._at, len(view) - done)
                view[done : done + len(part)] = part
                self._at += len(part)
                done += len(part)
        except (MemoryError, OSError):
            self.lost = True
        return done

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        """Set the present place."""
        self._at = offset + {os.SEEK_SET: 0, os.SEEK_CUR: self._at, os.SEEK_END: self.size}[whence]
        return self._at

    def tell(self) -> int:
        """Return the present place."""
        return self._at

    def truncate(self, size: int | None = None) -> int:
        """Set the size of the content."""
        asked = self._at if size is None else size
        if self.trouble is None and asked > self._reserved:
            try:
                self._file.truncate(asked)
            except OSError as error:
                self.trouble = error
        if asked < self.size:
            self._clear(asked)
        self.size = asked
        return asked

    def _clear(self, begin: int) -> None:
        """Make zeros of the content from a place on: it is not there any more."""
        at, end = self._at, self.size
        self._at = begin
        while self._at < end:
            self.write(bytes(min(_PAGE, end - self._at)))
        self._at = at

    def readable(self) -> bool:
        """Return True."""
        return True

    def writable(self) -> bool:
        """Return True."""
        return True

    def seekable(self) -> bool:
        """Return True."""
        return True

    def close(self) -> None:
        """Close the file on the disk."""
        if not self.closed:
            self._file.close()
        super().close()
