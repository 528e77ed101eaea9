"""The pixels of Photron recordings: 8, 12 or 16 bits each, decoded a frame at a time.

The 12-bit packing follows what pyMRAW (J. Javh, J. Slavič, ladisk/pyMRAW) reads; frames are decoded here
one by one, so that a recording larger than memory can be read.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.validate import InputError
from snapbeam.lab.camera.photron.header import CameraHeader

__all__ = ["frame_bytes", "pack_12bit", "read_mraw", "unpack_12bit"]


def unpack_12bit(packed: NDArray[np.uint8]) -> NDArray[np.uint16]:
    """Unpack 12-bit pixels, two in three bytes with the most significant bits first.

    ``packed`` is a flat array of bytes whose length is a multiple of three.
    """
    whole = np.ascontiguousarray(packed)
    count = whole.size // 3
    # numbers of 16 bits, the first byte the higher, from every third byte and from the one behind it
    first = np.ndarray(count, dtype=">u2", buffer=whole, offset=0, strides=(3,))
    second = np.ndarray(count, dtype=">u2", buffer=whole, offset=1, strides=(3,))
    pixels = np.empty((count, 2), dtype=np.uint16)
    np.right_shift(first, 4, out=pixels[:, 0])
    np.bitwise_and(second, 0x0FFF, out=pixels[:, 1])
    return pixels.reshape(-1)


def pack_12bit(pixels: NDArray[np.uint16]) -> NDArray[np.uint8]:
    """Pack pixels of 12 bits, an even number of them; the inverse of :func:`unpack_12bit`."""
    flat = np.ascontiguousarray(pixels).reshape(-1, 2)
    packed = np.empty((flat.shape[0], 3), dtype=np.uint8)
    packed[:, 0] = flat[:, 0] >> 4
    packed[:, 1] = ((flat[:, 0] & 0x0F) << 4) | (flat[:, 1] >> 8)
    packed[:, 2] = flat[:, 1] & 0xFF
    return packed.reshape(-1)


def read_mraw(
    header: CameraHeader, start: int, stop: int, rows: tuple[int, int]
) -> NDArray[np.uint8] | NDArray[np.uint16]:
    """Read frames ``start`` to ``stop`` of the given rows, right-aligned to the effective bits."""
    bits, width, height = header.stored_bits, header.width, header.height
    count, wanted = stop - start, rows[1] - rows[0]
    out: NDArray[Any] = np.empty((count, wanted, width), dtype=np.uint8 if bits == 8 else np.uint16)
    try:
        with open(header.mraw, "rb") as file:
            for frame in range(count):
                first = ((start + frame) * height + rows[0]) * width
                last = first + wanted * width
                head = first % 2 if bits == 12 else 0
                tail = last % 2 if bits == 12 else 0
                file.seek((first - head) * bits // 8)
                raw = np.frombuffer(file.read((last + tail - first + head) * bits // 8), dtype=np.uint8)
                if raw.size * 8 != (last + tail - first + head) * bits:
                    raise InputError(f"{header.mraw}: ends inside frame {start + frame}")
                pixels: NDArray[Any]
                if bits == 12:
                    pixels = unpack_12bit(raw)[head : head + wanted * width]
                else:
                    pixels = raw.view("<u2") if bits == 16 else raw
                out[frame] = pixels.reshape(wanted, width)
    except OSError as error:
        raise InputError(f"{header.mraw}: cannot be read ({error.strerror})") from None
    if header.effective_side == "higher" and header.effective_bits < bits:
        out >>= bits - header.effective_bits
    return out


def frame_bytes(frames: Iterable[NDArray[np.integer]], bits: int) -> Iterable[bytes]:
    """The bytes of each frame as they stand in a .mraw file of 8, 12 or 16 bits."""
    for frame in frames:
        if bits == 12:
            yield pack_12bit(frame.astype(np.uint16)).tobytes()
        else:
            yield frame.astype("<u2" if bits == 16 else np.uint8).tobytes()
