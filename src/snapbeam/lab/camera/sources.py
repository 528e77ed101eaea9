"""Where frames come from: one small class per file format, all with the same three things.

A source knows its ``shape`` (height, width), its ``numbers`` (the number of each frame in the original
numbering, so that a missing frame leaves a hole) and can ``read`` a run of frames.  Nothing is kept in memory
between calls but an open decoder.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.validate import InputError
from snapbeam.lab.camera.mraw import check_size, read_mraw
from snapbeam.lab.camera.photron import read_header

__all__ = ["IMAGE_SUFFIXES", "VIDEO_SUFFIXES", "FrameSource", "open_source"]

VIDEO_SUFFIXES = (".avi", ".mp4", ".mov", ".mkv")
TIFF_SUFFIXES = (".tif", ".tiff")
IMAGE_SUFFIXES = (*TIFF_SUFFIXES, ".png", ".bmp", ".jpg", ".jpeg")
_LENGTH_UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "micron": 1e-6, "µm": 1e-6, "\\u00b5m": 1e-6}


class FrameSource(Protocol):
    """What the reader needs of a file format."""

    shape: tuple[int, int]
    numbers: NDArray[np.int64]
    max_value: int
    frame_rate: float | None
    pixel_size: float | None
    exposure: float | None
    metadata: dict[str, Any]

    def read(self, start: int, stop: int, rows: tuple[int, int]) -> NDArray[np.integer]: ...

    def close(self) -> None: ...


class _Source:
    """Defaults shared by the sources."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.shape = (0, 0)
        self.numbers: NDArray[np.int64] = np.empty(0, dtype=np.int64)
        self.max_value = 255
        self.frame_rate: float | None = None
        self.pixel_size: float | None = None
        self.exposure: float | None = None
        self.metadata: dict[str, Any] = {}

    def close(self) -> None:
        """Release what is held open."""


class PhotronSource(_Source):
    """A .cih or .cihx header with its .mraw."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self.header = read_header(path)
        check_size(self.header)
        self.shape = (self.header.height, self.header.width)
        self.numbers = np.arange(self.header.frame_count)
        self.max_value = self.header.max_value
        self.frame_rate = self.header.frame_rate
        self.pixel_size = self.header.pixel_size
        self.exposure = self.header.exposure
        self.metadata = {
            "format": "Photron mraw",
            "camera": self.header.camera,
            "comment": self.header.comment,
            "record_rate": self.header.record_rate,
            "skip": self.header.skip,
            "stored_bits": self.header.stored_bits,
            "effective_bits": self.header.effective_bits,
        }

    def read(self, start: int, stop: int, rows: tuple[int, int]) -> NDArray[np.integer]:
        return read_mraw(self.header, start, stop, rows)


class VideoSource(_Source):
    """A video file, decoded by PyAV.

    The rate in a video file is how fast it plays, seldom how fast it was recorded; it stands in the metadata
    as ``playback_rate`` and is no frame rate.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        import av

        self._av = av
        self._decoder: Iterator[NDArray[np.integer]] | None = None
        self._next = 0
        self._container: Any = None
        try:
            with av.open(str(path)) as container:
                if not container.streams.video:
                    raise InputError(f"{path}: holds no video stream")
                stream = container.streams.video[0]
                count = sum(1 for packet in container.demux(stream) if packet.size)
                playback = stream.average_rate
                self.metadata = {
                    "format": f"video ({stream.codec_context.name})",
                    "playback_rate": None if playback is None else float(playback),
                }
                name = stream.codec_context.pix_fmt or ""
                self.shape = (stream.codec_context.height, stream.codec_context.width)
        except (av.error.FFmpegError, OSError) as error:
            raise InputError(f"{path}: cannot be read as a video ({error})") from None
        if count == 0 or 0 in self.shape:
            raise InputError(f"{path}: the video holds no frame")
        deep = re.search(r"(9|10|12|14|16)(le|be)", name)
        self._format = "gray16le" if deep else "gray"
        self.max_value = 65535 if deep else 255
        self.numbers = np.arange(count)

    def _frames(self) -> Iterator[NDArray[np.integer]]:
        self._container = self._av.open(str(self.path))
        for frame in self._container.decode(video=0):
            yield frame.to_ndarray(format=self._format)

    def read(self, start: int, stop: int, rows: tuple[int, int]) -> NDArray[np.integer]:
        out = np.empty(
            (stop - start, rows[1] - rows[0], self.shape[1]), np.uint16 if self.max_value > 255 else np.uint8
        )
        if self._decoder is None or self._next > start:
            self.close()
            self._decoder, self._next = self._frames(), 0
        try:
            while self._next < stop:
                frame = next(self._decoder, None)
                if frame is None:
                    raise InputError(f"{self.path}: ends after frame {self._next} of {self.numbers.size}")
                if frame.shape != self.shape:
                    raise InputError(
                        f"{self.path}: frame {self._next} is of shape {frame.shape}, not {self.shape}"
                    )
                if self._next >= start:
                    out[self._next - start] = frame[rows[0] : rows[1]]
                self._next += 1
        except self._av.error.FFmpegError as error:
            raise InputError(f"{self.path}: frame {self._next} cannot be decoded ({error})") from None
        return out

    def close(self) -> None:
        if self._container is not None:
            self._container.close()
            self._container = None
        self._decoder = None


class TiffSource(_Source):
    """A TIFF file of many pages.  ImageJ's frame interval and calibrated pixel size are used if present."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        import tifffile

        try:
            self._file = tifffile.TiffFile(path)
            pages = self._file.pages
            count = len(pages)
            first = pages[0] if count else None
            if first is None or first.ndim != 2 or first.dtype is None or first.dtype.kind != "u":
                kind = "no page" if first is None else f"pages of shape {first.shape} and type {first.dtype}"
                raise InputError(f"{path}: holds {kind}; a recording has grey pages of unsigned integers")
            self.shape = (int(first.shape[0]), int(first.shape[1]))
            self._dtype = first.dtype
            self._imagej(self._file.imagej_metadata or {}, first)
        except InputError:
            raise
        except Exception as error:  # a damaged file makes tifffile raise many kinds
            raise InputError(f"{path}: cannot be read as a TIFF file ({error})") from None
        if self._dtype.itemsize > 2 or not all(self.shape):
            raise InputError(
                f"{path}: pages of shape {self.shape} and type {self._dtype}: must be 8 or 16 bits"
            )
        self.max_value = int(np.iinfo(self._dtype).max)
        self.numbers = np.arange(count)

    def _imagej(self, values: dict[str, Any], page: Any) -> None:
        self.metadata = {
            "format": "TIFF stack",
            **{k: v for k, v in values.items() if k in ("fps", "finterval")},
        }
        interval = values.get("finterval")
        if isinstance(interval, (int, float)) and interval > 0.0:
            self.frame_rate = 1.0 / float(interval)
        unit = _LENGTH_UNITS.get(str(values.get("unit", "")))
        resolution = page.tags.get("XResolution")
        if unit is not None and resolution is not None and resolution.value[0] > 0:
            self.pixel_size = unit * resolution.value[1] / resolution.value[0]

    def read(self, start: int, stop: int, rows: tuple[int, int]) -> NDArray[np.integer]:
        out = np.empty((stop - start, rows[1] - rows[0], self.shape[1]), dtype=self._dtype)
        for index in range(start, stop):
            try:
                image = self._file.pages[index].asarray()
            except Exception as error:  # a damaged page makes tifffile raise many kinds
                raise InputError(f"{self.path}: page {index} cannot be read ({error})") from None
            if image.shape != self.shape:
                raise InputError(f"{self.path}: page {index} is of shape {image.shape}, not {self.shape}")
            out[index - start] = image[rows[0] : rows[1]]
        return out

    def close(self) -> None:
        self._file.close()


class ImageSource(_Source):
    """Numbered images, one a frame: a folder, or a pattern such as ``test_*.tif``.

    The last number in each name is the number of its frame; a number that is absent is a frame that is
    missing, and stays one.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        folder, pattern = (path, "*") if path.is_dir() else (path.parent, path.name)
        names = [one for one in sorted(folder.glob(pattern)) if one.suffix.lower() in IMAGE_SUFFIXES]
        numbered: dict[int, Path] = {}
        for one in names:
            digits = re.findall(r"\d+", one.stem)
            if not digits:
                raise InputError(f"{one}: an image of a recording carries its number in its name")
            number = int(digits[-1])
            if number in numbered or number >= 2**40:
                why = "doubles one" if number in numbered else "is too large"
                raise InputError(f"{one}: the number {number} {why} in {folder}")
            numbered[number] = one
        if not numbered:
            raise InputError(f"{path}: holds no numbered image ({', '.join(IMAGE_SUFFIXES)})")
        order = sorted(numbered)
        if order[-1] - order[0] > 20 * len(order) + 1000:
            after = int(np.argmax(np.diff(order))) + 1
            raise InputError(
                f"{numbered[order[after]]}: the number {order[after]} follows {order[after - 1]}; too many "
                "frames would be missing, so number the images of one recording in a row"
            )
        self._files = [numbered[number] for number in order]
        self.numbers = np.array(order, dtype=np.int64) - order[0]
        first = self._load(0)
        self.shape = (first.shape[0], first.shape[1])
        self._dtype = first.dtype
        self.max_value = int(np.iinfo(first.dtype).max)
        self.metadata = {"format": "numbered images", "first_number": order[0]}

    def _load(self, index: int) -> NDArray[Any]:
        import cv2

        file = self._files[index]
        raw = np.fromfile(file, dtype=np.uint8)
        image = cv2.imdecode(raw, cv2.IMREAD_UNCHANGED) if raw.size else None
        if image is None:
            raise InputError(f"{file}: cannot be read as an image")
        if image.ndim == 3:
            image = cv2.cvtColor(image[..., :3], cv2.COLOR_BGR2GRAY)
        if image.dtype not in (np.uint8, np.uint16):
            raise InputError(f"{file}: pixels of type {image.dtype}: must be 8 or 16 bits")
        return image

    def read(self, start: int, stop: int, rows: tuple[int, int]) -> NDArray[np.integer]:
        out = np.empty((stop - start, rows[1] - rows[0], self.shape[1]), dtype=self._dtype)
        for index in range(start, stop):
            image = self._load(index)
            if image.shape != self.shape or image.dtype != self._dtype:
                raise InputError(
                    f"{self._files[index]}: shape {image.shape} and type {image.dtype} differ from the first "
                    f"frame's {self.shape} and {self._dtype}"
                )
            out[index - start] = image[rows[0] : rows[1]]
        return out


def open_source(path: Path) -> FrameSource:
    """The source for a path, chosen by its suffix."""
    try:
        return _open_source(path)
    except ImportError as error:
        raise InputError(f"{path}: reading it needs {error.name} (pip install 'snapbeam[lab]')") from error


def _open_source(path: Path) -> FrameSource:
    suffix = path.suffix.lower()
    if path.is_dir() or any(mark in path.name for mark in "*?["):
        return ImageSource(path)
    if not path.exists():
        raise InputError(f"{path}: no such file")
    if suffix == ".mraw":
        headers = [path.with_suffix(one) for one in (".cihx", ".cih") if path.with_suffix(one).exists()]
        if not headers:
            raise InputError(f"{path}: its header {path.stem}.cihx or {path.stem}.cih is not beside it")
        return PhotronSource(headers[0])
    if suffix in (".cih", ".cihx"):
        return PhotronSource(path)
    if suffix in VIDEO_SUFFIXES:
        return VideoSource(path)
    if suffix in TIFF_SUFFIXES:
        return TiffSource(path)
    raise InputError(
        f"{path}: unknown kind of recording; known are .cih, .cihx, .mraw, {', '.join(VIDEO_SUFFIXES)}, "
        f"{', '.join(TIFF_SUFFIXES)}, a folder of numbered images or a pattern such as 'test_*.png'"
    )
