"""Writing recordings: Photron header and pixels, and lossless video.  Frames are streamed."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from datetime import date
from fractions import Fraction
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.files import atomic_path, check_writable
from snapbeam.core.validate import InputError, integer, positive, shown, within
from snapbeam.lab.camera.photron.pixels import frame_bytes
from snapbeam.lab.camera.photron.text import header_text

__all__ = ["write_photron", "write_video"]


def _checked(
    frames: Iterable[NDArray[np.integer]], limit: int, shape: list[int], even: bool = False
) -> Iterator[NDArray[np.integer]]:
    """Pass frames on, checking shape and range; *shape* ends as [count, height, width]."""
    for number, frame in enumerate(frames):
        array = np.asarray(frame)
        if array.ndim != 2 or array.dtype.kind not in "iu" or not array.size:
            raise InputError(
                f"frames[{number}] of shape {array.shape} and type {array.dtype}: must be a two-dimensional "
                "array of integers"
            )
        if shape and array.shape != tuple(shape[1:]):
            raise InputError(f"frames[{number}] of shape {array.shape}: must be of shape {tuple(shape[1:])}")
        if even and array.size % 2:
            raise InputError(f"frames of shape {array.shape}: 12-bit frames hold an even number of pixels")
        if array.min() < 0 or array.max() > limit:
            raise InputError(
                f"frames[{number}] holds {array.min()} to {array.max()}: must lie in [0, {limit}]"
            )
        if not shape:
            shape[:] = [0, *array.shape]
        shape[0] += 1
        yield array


def write_photron(
    path: str | Path,
    frames: Iterable[NDArray[np.integer]],
    *,
    frame_rate: float,
    pixel_size: float,
    exposure: float | None = None,
    bit_depth: int | None = None,
    effective_bits: int | None = None,
    skip: int = 1,
    comment: str = "",
) -> Path:
    """Write a recording as a Photron header with its .mraw, readable by pyMRAW and :func:`open_recording`.

    Parameters
    ----------
    path
        Name of the header, ``.cih`` or ``.cihx``; the pixels go beside it as ``.mraw``.  Only a ``.cihx``
        header has a place for the pixel size.
    frames
        Arrays of integers of one shape (height, width), taken one at a time.
    frame_rate
        Frames written per second [Hz].
    pixel_size
        Metres per pixel.
    exposure
        Shutter time [s]; the whole time between recorded frames unless given.
    bit_depth
        Stored bits per pixel, 8, 12 or 16; unless given 12 for .cihx and 16 for .cih.
    effective_bits
        Bits that carry the image; unless given 8 in an 8-bit file and 12 in the others.
    skip
        Every ``skip``-th frame of the camera is in *frames*; the record rate is ``frame_rate*skip``.

    Returns
    -------
    pathlib.Path
        The header's path.
    """
    path = check_writable(path, "path", (".cih", ".cihx"))
    kind = path.suffix.lower()
    rate = positive("frame_rate", frame_rate, "Hz")
    size = positive("pixel_size", pixel_size, "m")
    skip = integer("skip", skip, 1)
    shutter = 1.0 / (rate * skip) if exposure is None else positive("exposure", exposure, "s")
    bits = integer("bit_depth", (12 if kind == ".cihx" else 16) if bit_depth is None else bit_depth, 8, 16)
    if bits not in (8, 12, 16):
        raise InputError(f"bit_depth = {shown(bit_depth)}: must be 8, 12 or 16")
    effective = integer(
        "effective_bits", min(bits, 12) if effective_bits is None else effective_bits, 1, bits
    )
    if "\n" in comment or "\r" in comment:
        raise InputError(f"comment = {shown(comment)}: must be a single line")
    shape: list[int] = []
    with atomic_path(path) as header, atomic_path(path.with_suffix(".mraw")) as mraw:
        with open(mraw, "wb") as file:
            for chunk in frame_bytes(_checked(frames, 2**effective - 1, shape, even=bits == 12), bits):
                file.write(chunk)
        if not shape:
            raise InputError("frames is empty: must hold at least one frame")
        values = {
            "width": shape[2],
            "height": shape[1],
            "frame_count": shape[0],
            "start": 0,
            "skip": skip,
            "record_rate": f"{rate * skip:.12g}",
            "exposure": shutter,
            "stored_bits": bits,
            "effective_bits": effective,
            "camera": "snapbeam synthetic camera",
            "comment": comment,
            "date": f"{date.today():%Y/%m/%d}",
        }
        header.write_bytes(header_text(kind, values, size))
    return path


def write_video(
    path: str | Path, frames: Iterable[NDArray[np.integer]], *, play_rate: float = 25.0, max_value: int = 255
) -> Path:
    """Write frames as a lossless 8-bit grey video (FFV1), streamed.

    Parameters
    ----------
    path
        ``.avi`` or ``.mkv``.
    frames
        Arrays of integers of one shape (height, width), taken one at a time.
    play_rate
        Frames shown per second [Hz], at most 1000; for high-speed video not the rate it was recorded at.
    max_value
        Grey level that becomes 255; frames above 8 bits lose their lower bits.
    """
    import av

    path = check_writable(path, "path", (".avi", ".mkv"))
    rate = Fraction(within("play_rate", play_rate, 0.0, 1000.0, closed="right", unit="Hz"))
    rate = rate.limit_denominator(1000)
    limit = integer("max_value", max_value, 1, 65535)
    shape: list[int] = []
    with atomic_path(path) as temporary:
        with av.open(str(temporary), "w") as container:
            stream = None
            for frame in _checked(frames, limit, shape):
                if stream is None:
                    stream = container.add_stream("ffv1", rate=rate)
                    stream.height, stream.width = frame.shape
                    stream.pix_fmt = "gray"
                grey = np.rint(frame * (255.0 / limit)).astype(np.uint8)
                image = av.VideoFrame.from_ndarray(grey, format="gray")
                image.pts, image.time_base = shape[0] - 1, 1 / rate
                container.mux(stream.encode(image))
            if stream is None:
                raise InputError("frames is empty: must hold at least one frame")
            container.mux(stream.encode())
    return path
