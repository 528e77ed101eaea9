"""HDF5 files that refer to other files, or have no end of groups: refused by every reader, before anything else is opened."""

from __future__ import annotations

import os
import re
import sys

import h5py
import numpy as np
import pytest
import xarray as xr

import snapbeam as sb
from snapbeam.util.files import is_ours
from snapbeam.util.hdf5 import open_hdf5
from snapbeam.util.netcdf import read_netcdf, read_result
from snapbeam.util.validation import InputError


def read_channels(path):
    from snapbeam.lab import read_channels

    return read_channels(path)


def open_recording(path):
    pytest.importorskip("cv2")
    from snapbeam.lab.camera import open_recording

    return open_recording(path, frame_rate=1e4, pixel_size=1e-5)


READERS = {
    "open_hdf5": open_hdf5,
    "in parts": lambda path: open_hdf5(path, in_parts=True),
    "read_netcdf": read_netcdf,
    "lazily": lambda path: read_netcdf(path, lazily=True),
    "group": lambda path: read_netcdf(path, group="deep"),
    "read_result": lambda path: read_result(f"{path}:deep") if path.suffix == ".nc" else read_result(path),
    "load": sb.load,
    "read_channels": read_channels,
    "open_recording": open_recording,
}


def linked(path, kind, other):
    """A file of measured numbers beside something in a deep group that leads to *other*."""
    with h5py.File(path, "w") as file:
        file["time"] = np.arange(8.0)
        deep = file.create_group("deep/er")
        if kind == "external link":
            deep["out"] = h5py.ExternalLink(str(other), "/numbers")
        elif kind == "link through a link":
            deep["way"] = h5py.ExternalLink(str(other), "/")
            file["out"] = h5py.SoftLink("/deep/er/way/numbers")
        elif kind == "external storage":
            deep.create_dataset("out", (8,), "f8", external=[(str(other), 0, h5py.h5f.UNLIMITED)])
        elif kind == "virtual":
            layout = h5py.VirtualLayout((8,), "f8")
            layout[:] = h5py.VirtualSource(str(other), "numbers", (8,))
            deep.create_virtual_dataset("out", layout)
        elif kind == "virtual without end":
            layout = h5py.VirtualLayout((8,), "f8", maxshape=(None,))
            source = h5py.VirtualSource(str(other), "numbers", (8,), maxshape=(None,))
            layout[: h5py.h5s.UNLIMITED] = source[: h5py.h5s.UNLIMITED]
            deep.create_virtual_dataset("out", layout)


KINDS = ["external link", "link through a link", "external storage", "virtual", "virtual without end"]


@pytest.mark.skipif(sys.platform == "win32", reason="pipes with a name")
@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize("kind", KINDS)
def test_no_reader_follows_a_link_out_of_the_file(kind, reader, tmp_path):
    """The target is a pipe that nobody writes to: a reader that opened it would wait without end."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    path = tmp_path / ("file.h5" if reader == "open_recording" else "file.nc")
    linked(path, kind, tmp_path / "regular")
    os.rename(pipe, tmp_path / "regular")
    with pytest.raises(InputError, match=r"in another file|to another file"):
        READERS[reader](path)


@pytest.mark.skipif(sys.platform == "win32", reason="pipes with a name")
@pytest.mark.parametrize("reader", READERS)
def test_a_pipe_or_device_is_no_file_to_read(reader, tmp_path):
    pipe = tmp_path / ("pipe.h5" if reader == "open_recording" else "pipe.nc")
    os.mkfifo(pipe)
    for path in (pipe, tmp_path / f"device{pipe.suffix}"):
        if path != pipe:
            path.symlink_to("/dev/zero")
        with pytest.raises(InputError, match=r"no such file|regular file|neither"):
            READERS[reader](path)


@pytest.mark.parametrize("reader", READERS)
def test_groups_without_end_are_refused(reader, tmp_path):
    suffix = ".h5" if reader == "open_recording" else ".nc"
    deep, many, ring = (tmp_path / f"{name}{suffix}" for name in ("deep", "many", "ring"))
    with h5py.File(deep, "w") as file:
        file.create_group("/".join(["deep"] * 400))
    with h5py.File(many, "w") as file:
        for number in range(1001):
            file.create_group(f"g{number}")
    with h5py.File(ring, "w") as file:
        group = file.create_group("deep/er")
        group["ring"] = file["deep"]
    for path, words in ((deep, "32 levels"), (many, "1000 groups"), (ring, "one place")):
        with pytest.raises(InputError, match=words):
            READERS[reader](path)


def test_links_within_a_file_are_read(tmp_path):
    path = tmp_path / "linked.nc"
    with h5py.File(path, "w") as file:
        file["deep/numbers"] = np.arange(4.0)
        file["same"] = file["deep/numbers"]
        file["soft"] = h5py.SoftLink("/deep/numbers")
    with open_hdf5(path) as file:
        np.testing.assert_array_equal(file["soft"][()], np.arange(4.0))
    with h5py.File(path, "a") as file:
        file["nowhere"] = h5py.SoftLink("/deep/missing")
    with pytest.raises(InputError, match="link to nothing"):
        open_hdf5(path)
    with h5py.File(path, "a") as file:
        del file["nowhere"]
        file["deep/up"] = h5py.SoftLink("/deep")
    with pytest.raises(InputError, match="link to a group"):
        open_hdf5(path)


def test_each_link_counts_for_the_memory(tmp_path):
    """One array by a hundred names is read a hundred times."""
    path = tmp_path / "names.nc"
    with h5py.File(path, "w") as file:
        file.create_dataset("x0", (2_000_000,), "f4", fillvalue=1.0, chunks=(100_000,))
        for number in range(1, 100):
            file[f"x{number}"] = file["x0"] if number % 2 else h5py.SoftLink("/x0")
    for read in (read_netcdf, open_hdf5):
        with pytest.raises(InputError, match="GiB of memory"):
            read(path)
    with open_hdf5(path, in_parts=True) as file:
        assert file["x99"].shape == (2_000_000,)


def test_results_with_groups_are_read(tmp_path):
    path = tmp_path / "groups.nc"
    data = xr.Dataset({"gap": ("time", np.arange(3.0))})
    sb.write_netcdf({None: xr.Dataset(), "one": data, "two": data}, path)
    xr.testing.assert_equal(read_result(f"{path}:two"), data)


def _with_texts(path, at_root):
    """A file with texts of variable length; the place in it of the heap that holds them."""
    with h5py.File(path, "w") as file:
        file["time"] = np.arange(8.0)
        deep = file.create_group("deep/er")
        place = file if at_root else deep
        place.attrs["laboratory"] = "Sherbrooke"
        if not at_root:
            file["time"].attrs["units"] = "seconds"
            deep["names"] = ["one", "another"]
    return path.read_bytes().index(b"GCOL")


DAMAGE = {
    "the first has no length": lambda heap: heap[:16] + bytes(16) + heap[32:],
    "the free space has no length": lambda heap: re.sub(
        rb"\0{8}[\0-\xff]{8}(\0*)\Z", rb"\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\1", heap
    ),
    "the sum of lengths overflows": lambda heap: heap[:24] + (2**64 - 16).to_bytes(8, "little") + heap[32:],
    "longer than the heap": lambda heap: heap[:24] + (5000).to_bytes(8, "little") + heap[32:],
}


@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize("at_root", [True, False])
@pytest.mark.parametrize("damage", DAMAGE)
def test_texts_whose_list_does_not_advance_are_refused(damage, at_root, reader, tmp_path):
    """The HDF5 library follows such a list without end, and holds the interpreter's lock meanwhile."""
    path = tmp_path / ("file.h5" if reader == "open_recording" else "file.nc")
    begin = _with_texts(path, at_root)
    whole = path.read_bytes()
    spoiled = DAMAGE[damage](whole[begin : begin + 4096])
    assert len(spoiled) == 4096 and spoiled != whole[begin : begin + 4096]
    path.write_bytes(whole[:begin] + spoiled + whole[begin + 4096 :])
    with pytest.raises(InputError, match=r"a stored text at byte .* has the impossible length"):
        READERS[reader](path)


def test_an_output_with_such_texts_is_not_ours(tmp_path):
    path = tmp_path / "file.nc"
    begin = _with_texts(path, True)
    whole = path.read_bytes()
    path.write_bytes(whole[: begin + 16] + bytes(16) + whole[begin + 32 :])
    assert not is_ours(path)


def test_many_texts_are_read(tmp_path):
    """Heaps that are full, removed texts, a user block before the file, and the name of a heap in a text."""
    path = tmp_path / "texts.nc"
    with h5py.File(path, "w", userblock_size=1024) as file:
        file["names"] = [f"{'x' * (k % 50)}GCOL {k}" for k in range(3000)]
        for number in range(200):
            file.attrs["changed"] = "y" * number
        file.attrs["empty"] = ""
    with open_hdf5(path) as file:
        assert file["names"].shape == (3000,) and len(file.attrs["changed"]) == 199
