"""A Phantom recording written byte by byte, for the tests of its reader."""

from __future__ import annotations

import struct

import numpy as np

_HEADER, _BITMAP, _SETUP = 44, 40, 0x1700
# Where the fields of the block SETUP stand, as Vision Research's description of the format has them.
_MARK, _BOTTOM_UP, _RATE, _BITS, _SHUTTER = 140, 760, 768, 896, 1568


def packed(levels):
    """Four levels of 10 bits in five bytes, the upper bits first."""
    bits = np.unpackbits(levels.astype(">u2").view(np.uint8).reshape(-1, 2), axis=1)[:, 6:]
    return np.packbits(bits).tobytes()


def write_cine(path, frames, *, frame_rate, exposure, bits=12, packing=0, times=None):
    """Write grey frames of 8 or 16 bits, (count, height, width), bottom row first as bitmaps have them; *packing* 256
    packs them to 10 bits, top row first; *times* [s] of the frames go into a block of their own."""
    count, height, width = frames.shape
    pixels = [packed(one) if packing else np.ascontiguousarray(one[::-1]).tobytes() for one in frames]
    size = len(pixels[0])
    block = b""
    if times is not None:
        stamps = [(round((t % 1.0) * 2**32) % 2**32, int(t)) for t in times]
        block = struct.pack("<IHH", 12, 1000, 0) + b"text" + struct.pack("<IHH", 8 + 8 * len(stamps), 1002, 0)
        block += b"".join(struct.pack("<II", *one) for one in stamps)
    table = _HEADER + _BITMAP + _SETUP + len(block)
    data = table + 8 * count
    header = struct.pack("<2sHHHiIiIIII8x", b"CI", _HEADER, 0, 1, 0, count, 0, count,
                         _HEADER, _HEADER + _BITMAP, table)  # fmt: skip
    depth = 8 * frames.dtype.itemsize
    bitmap = struct.pack("<IiiHHIIiiII", _BITMAP, width, height, 1, depth, packing, size, 0, 0, 0, 0)
    setup = bytearray(_SETUP)
    struct.pack_into("<HH", setup, _MARK, 0x5453, _SETUP)
    struct.pack_into("<I", setup, _RATE, frame_rate)
    struct.pack_into("<I", setup, _BITS, bits)
    struct.pack_into("<I", setup, _SHUTTER, round(1e9 * exposure))
    places = struct.pack(f"<{count}Q", *(data + k * (8 + size) for k in range(count)))
    pictures = b"".join(struct.pack("<I", 8) + struct.pack("<I", size) + one for one in pixels)
    path.write_bytes(header + bitmap + bytes(setup) + block + places + pictures)
    return path
