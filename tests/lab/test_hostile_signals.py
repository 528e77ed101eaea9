"""Signals and recordings that would fill the memory or never end are refused."""

from __future__ import annotations

import os
import struct
import sys
import time
import tracemalloc
import zipfile
import zlib

import cv2
import h5py
import numpy as np
import pytest
import scipy.io
import tifffile

from snapbeam import lab
from snapbeam.lab.image_sources import load_image, open_source
from snapbeam.lab.photron import read_fields
from snapbeam.sweeps.measured_points import read_measured_points
from snapbeam.util.validation import InputError


@pytest.mark.parametrize("suffix", [".h5", ".mat"])
def test_signals_that_fill_the_memory(tmp_path, suffix):
    path = tmp_path / f"x{suffix}"
    with h5py.File(path, "w") as file:
        file.create_dataset("a", (2**33,), "f8", chunks=(2**20,)).attrs["units"] = "m/s"
    tracemalloc.start()
    try:
        with pytest.raises(InputError, match="would take 64 GiB of memory"):
            lab.read_channels(path, 1e3)
        assert tracemalloc.get_traced_memory()[1] < 100 * 2**20
    finally:
        tracemalloc.stop()


MANY = 400_000_000
"""Numbers that take 3.1 GB."""


def zeros_in_npz(path, stated=MANY):
    """Zeros in an archive: 1 byte for each 1000; few if the header alone states them."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        with archive.open("v.npy", "w", force_zip64=True) as member:
            layout = {"shape": (stated,), "fortran_order": False, "descr": "<f8"}
            np.lib.format.write_array_header_1_0(member, layout)
            for _ in range(100 if stated == MANY else 0):
                member.write(bytes(MANY * 8 // 100))


def false_npz(path):
    zeros_in_npz(path, stated=2**40)


def false_npy(path):
    with path.open("wb") as file:
        layout = {"shape": (2**33,), "fortran_order": False, "descr": "<f8"}
        np.lib.format.write_array_header_1_0(file, layout)


def zeros_in_mat(path):
    """A variable of doubles, stored as bytes and compressed, as MATLAB does."""
    element = matrix_of_zeros(b"v", MANY)
    path.write_bytes(b"MATLAB 5.0 MAT-file".ljust(124) + b"\0\1IM" + struct.pack("<II", 15, len(element)) + element)


def zeros_in_structure(path):
    """A structure, whose header states one element."""
    scipy.io.savemat(path, {"s": {"v": np.zeros(10_000_000), "w": np.zeros(60_000_000)}}, do_compression=True)


def matrix_of_zeros(name, count):
    def tagged(kind, data):
        return struct.pack("<II", kind, len(data)) + data + bytes(-len(data) % 8)

    head = tagged(6, struct.pack("<II", 6, 0)) + tagged(5, struct.pack("<ii", count, 1)) + tagged(1, name)
    packer = zlib.compressobj(1)
    parts = [packer.compress(struct.pack("<II", 14, len(head) + 8 + count) + head + struct.pack("<II", 2, count))]
    parts += [packer.compress(bytes(count // 100)) for _ in range(100)]
    return b"".join(parts) + packer.flush()


@pytest.mark.parametrize(
    "make", [zeros_in_npz, false_npz, false_npy, zeros_in_mat, zeros_in_structure], ids=lambda make: make.__name__
)
@pytest.mark.slow
def test_small_files_with_a_large_content(tmp_path, make):
    """Refused by the header, before anything is allocated."""
    path = tmp_path / f"x.{make.__name__[-3:].replace('ure', 'mat')}"
    make(path)
    assert path.stat().st_size < 4e6
    tracemalloc.start()
    began = time.monotonic()
    try:
        with pytest.raises(InputError, match=r"would take .* GiB of memory, from .* MB on the disk"):
            lab.read_channels(path, 1e3)
        assert tracemalloc.get_traced_memory()[1] < 400 * 2**20  # SciPy unpacks 128 kB to see a header
    finally:
        tracemalloc.stop()
    assert time.monotonic() - began < 5.0


def test_a_large_content_of_a_large_file(tmp_path, monkeypatch):
    """Stored numbers are read however many they are, and compressed ones up to twenty times the file."""
    monkeypatch.setattr("snapbeam.util.input_files.LARGEST_CONTENT", 1000)
    noise = np.random.default_rng(0).normal(size=5000)
    time = np.arange(5000) / 1e3
    np.savez_compressed(tmp_path / "x.npz", v=noise, v_units="m/s", time=time)
    scipy.io.savemat(tmp_path / "x.mat", {"v": noise, "v_units": "m/s", "time": time}, do_compression=True)
    scipy.io.savemat(tmp_path / "y.mat", {"s": {"v": noise, "v_units": "m/s", "time": time}})
    for name in ("x.npz", "x.mat", "y.mat"):
        np.testing.assert_array_equal(lab.read_signal(tmp_path / name).values, noise)
    cv2.imwrite(str(tmp_path / "x.png"), (noise.reshape(50, 100) * 20).astype(np.uint8))
    assert load_image(tmp_path / "x.png").shape == (50, 100)


@pytest.mark.parametrize("pixels", [30_000, 16_000, 10_000])
@pytest.mark.parametrize("suffix", [".tif", ".png", ".avi"])
def test_pictures_that_fill_the_memory(tmp_path, suffix, pixels):
    """By the size that the header states, of images and videos; FFmpeg itself refuses the largest."""
    path = tmp_path / f"x1{suffix}"
    if suffix == ".tif":
        with tifffile.TiffWriter(path) as file:
            file.write(shape=(pixels, pixels), dtype=np.uint8, data=None, compression=None, rowsperstrip=pixels)
        os.truncate(path, 1000)
    elif suffix == ".png":
        chunk = b"IHDR" + struct.pack(">IIBBBBB", pixels, pixels, 8, 0, 0, 0, 0)
        data = b"IDAT" + zlib.compress(bytes(1000))
        path.write_bytes(
            b"\x89PNG\r\n\x1a\n"
            + b"".join(
                struct.pack(">I", len(each) - 4) + each + struct.pack(">I", zlib.crc32(each))
                for each in (chunk, data, b"IEND")
            )
        )
    else:
        import av

        with av.open(str(path), "w") as file:
            stream = file.add_stream("ffv1", rate=25)
            stream.width, stream.height, stream.pix_fmt = 64, 64, "gray"
            for packet in stream.encode(av.VideoFrame.from_ndarray(np.zeros((64, 64), np.uint8), "gray")):
                file.mux(packet)
            file.mux(stream.encode())
        stated = path.read_bytes().replace(struct.pack("<ii", 64, 64), struct.pack("<ii", pixels, pixels))
        path.write_bytes(stated)
    for source in (path, tmp_path / "x*.png") if suffix == ".png" else (path,):
        with pytest.raises(InputError, match=r"would take .* GiB of memory, from .* MB on the disk|holds no frame"):
            load_image(source) if suffix == ".png" and source == path else open_source(source)


def test_tables_of_twenty_thousand_columns(tmp_path):
    """In a time proportional to the number of cells."""
    names = ",".join(f"v{k} [m/s]" for k in range(20_000))
    row = ",".join(["0.5"] * 20_000)
    (tmp_path / "x.csv").write_text("\n".join([names, row, row, row, ""]))
    began = time.monotonic()
    assert len(lab.read_channels(tmp_path / "x.csv", 1e3)) == 20_000
    assert time.monotonic() - began < 5.0


@pytest.mark.skipif(sys.platform == "win32", reason="named pipes and devices are those of POSIX")
@pytest.mark.parametrize("kind", ["pipe", "device"])
@pytest.mark.parametrize("suffix", [".csv", ".wav", ".npy", ".cih", ".cihx", ".mraw", ".tif", ".mp4"])
def test_only_regular_files_are_read(tmp_path, kind, suffix):
    """A pipe would be waited for without end, /dev/zero is read without end."""
    path = tmp_path / f"x{suffix}"
    os.mkfifo(path) if kind == "pipe" else path.symlink_to("/dev/zero")
    for call in (open_source, load_image, read_fields, lab.read_channels, read_measured_points):
        with pytest.raises(InputError):
            call(path)
