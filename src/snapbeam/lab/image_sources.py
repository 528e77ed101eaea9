"""Interface of image formats.

A source knows its ``shape`` (height, width), its ``numbers`` (the number of each frame in the original
numbering, so that a missing frame leaves a hole) and can ``read`` a run of frames.  Nothing is kept in memory
between calls but an open decoder.
"""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.lab.diagnostics import KINDS_RECORDING, LOSSY_ERROR
from snapbeam.lab.frame_times import cine_times, numbers_of_stamps
from snapbeam.lab.photron import CameraHeader, check_pixels, read_header, read_mraw
from snapbeam.lab.signal_formats import is_time, seconds_in, stated_unit
from snapbeam.lab.signals import unit_factor
from snapbeam.util.diagnostics import Diagnostic
from snapbeam.util.hdf5 import members_of, open_hdf5
from snapbeam.util.input_files import refuse_inflated
from snapbeam.util.packages import needing
from snapbeam.util.validation import InputError

TIFF_SUFFIXES = (".tif", ".tiff")
ARRAY_SUFFIXES = (".npy", ".h5", ".hdf5")
_RATES = ("frame_rate", "fps", "record_rate", "frame_rate_hz")
_SIZES = ("pixel_size", "pixel_size_m")
_SAME_RATE = 1.005  # ratio of rates that are rounded
_EVEN = 0.02  # share by which the kinds of pixels under a mosaic may differ and count as one
_JPEG = (".jpg", ".jpeg")
IMAGE_SUFFIXES = (*TIFF_SUFFIXES, ".png", ".bmp", *_JPEG)
VIDEO_SUFFIXES = (".avi", ".mp4", ".mov", ".mkv", ".cine")
LOSSLESS = (
    "rawvideo", "ffv1", "huffyuv", "ffvhuff", "utvideo", "magicyuv", "lagarith", "png", "tiff", "bmp", "qtrle",
    "v210", "v410", "r210", "r10k", "zmbv", "flashsv",
)  # fmt: skip
"""Names of the codecs that give back the pictures that went in."""
RECORDING_SUFFIXES = (".cih", ".cihx", ".mraw", *VIDEO_SUFFIXES, *TIFF_SUFFIXES, *ARRAY_SUFFIXES)
"""Ends of names of recordings that are one file."""


_LUMA = np.array([0.299, 0.587, 0.114])


class FrameSource:
    """Frames of one file, folder or pattern.

    ``shape`` is (height, width), ``max_value`` the largest grey level the file can hold; ``frame_rate`` [Hz],
    ``pixel_size`` [m, the height of a pixel], ``pixel_width`` [m] and ``exposure`` [s] are None where the file does not
    say; ``frame_rate_question`` and ``pixel_size_hint`` what it says ambiguously, for the error message; ``edge_error``
    is the standard error [px] that the format adds to every edge.
    """

    shape = (0, 0)
    numbers: NDArray[np.int64] = np.empty(0, dtype=np.int64)
    max_value = 255
    frame_rate: float | None = None
    pixel_size: float | None = None
    pixel_width: float | None = None
    exposure: float | None = None
    frame_rate_question = pixel_size_hint = ""
    diagnostics: tuple[Diagnostic, ...] = ()
    edge_error = _full = 0.0
    _dtype: Any = np.uint8

    def __init__(self, path: Path) -> None:
        self.path = path
        self.metadata: dict[str, Any] = {}

    def _page(self, index: int) -> NDArray[Any]:
        """One picture in the numbers of the file, grey, of the shape and type of the first."""
        raise NotImplementedError

    def read(self, start: int, stop: int, rows: tuple[int, int]) -> NDArray[np.integer]:
        """Frames *start* to *stop* of the rows from the first up to the second, integers (n, rows, width)."""
        out = np.empty((stop - start, rows[1] - rows[0], self.shape[1]), dtype=np.uint16 if self._full else self._dtype)
        for index in range(start, stop):
            out[index - start] = self._levels(self._page(index)[rows[0] : rows[1]], index)
        return out

    def _levels(self, values: NDArray[Any], index: int) -> NDArray[Any]:
        """Grey levels as they are; floating point numbers from 0 to the full scale as whole levels up to 65535."""
        if not self._full:
            return values
        if not np.isfinite(values).all() or values.min() < 0.0 or values.max() > self._full * (1.0 + 1e-9):
            raise InputError(f"{self.path}: picture {index} or one after it holds numbers outside 0 to {self._full:g}")
        return np.rint(values * (65535.0 / self._full)).clip(0, 65535).astype(np.uint16)

    def close(self) -> None:
        """Close open files."""

    def take_type(self, dtype: Any) -> None:
        """Take the type of the numbers; the full scale of floats is that of the first, middle and last picture."""
        self._dtype, count = dtype, self.numbers.size
        if dtype.kind == "f":
            self._full = float_range([self._page(k) for k in {0, count // 2, count - 1}], self.path)
        self.max_value = 65535 if self._full else int(np.iinfo(dtype).max)

    def tell_lossy(self) -> None:
        """Add the diagnostic of a lossy compression, and its error."""
        self.diagnostics += (KINDS_RECORDING["lossy"].found(error_px=LOSSY_ERROR),)
        self.edge_error = LOSSY_ERROR

    def tell_colour(self, channels: int) -> None:
        """Add the diagnostic of pictures in colour, once."""
        found = KINDS_RECORDING["colour"].found(channels=channels)
        if found not in self.diagnostics:
            self.diagnostics += (found,)

    def state_rate(self, rates: Mapping[str, float]) -> None:
        """Take the frame rate [Hz] from what the file states, in words; statements that differ become a question."""
        if rates and max(rates.values()) <= _SAME_RATE * min(rates.values()):
            self.frame_rate = next(iter(rates.values()))
        elif rates:
            told = ", ".join(f"{words}: {rate:.6g} Hz" for words, rate in rates.items())
            self.frame_rate_question = (
                f"the file contradicts itself about the frame rate ({told}); give frame_rate (--frame-rate) in Hz"
            )


@contextmanager
def _reading(words: str) -> Iterator[None]:
    """Turn errors of a library, which raises many kinds at a damaged file, into one of the input."""
    try:
        yield
    except InputError:
        raise
    except Exception as error:
        raise InputError(f"{words} ({error})") from None


def grey_of(colors: NDArray[Any]) -> NDArray[Any]:
    """Grey levels of pictures whose last axis is red, green, blue and perhaps opacity, of the same type."""
    grey = colors[..., :3].astype(np.float64) @ _LUMA
    return np.rint(grey).astype(colors.dtype) if colors.dtype.kind in "iu" else grey.astype(colors.dtype)


# TIFF files of many pages.


def _are_pictures(shape: tuple[int, ...], dtype: Any, frames: int = 0) -> bool:
    """Return whether an array is a grey or colour image (last axis) of a supported type, after so many other axes."""
    size = len(shape) == frames + 2 or (len(shape) == frames + 3 and shape[-1] in (3, 4))
    return size and all(shape) and (dtype.kind == "f" or (dtype.kind == "u" and dtype.itemsize <= 2))


def float_range(pictures: list[NDArray[Any]], path: Path) -> float:
    """Full scale of floating-point images: 1, or the next full scale of 8, 10, 12, 14 and 16 bits."""
    top = float(np.max([one.max() for one in pictures]))  # NaN if any is
    low = float(np.min([one.min() for one in pictures]))
    if not (np.isfinite(top) and low >= 0.0 and 0.0 < top <= 65535.0):
        raise InputError(
            f"{path}: pictures of numbers from {low:g} to {top:g}: must lie in [0, 1], or be grey levels up to 65535"
        )
    return next(full for full in (1.0, 255.0, 1023.0, 4095.0, 16383.0, 65535.0) if top <= full)


def _refuse_picture(path: Path, shape: Iterable[int]) -> None:
    """Refuse a picture that fills the memory although its file is small; see ``refuse_inflated``."""
    refuse_inflated("path", path, 8 * math.prod(map(int, shape)))


class TiffSource(FrameSource):
    """A TIFF file of many pages, or of many frames behind one page as ImageJ writes files above 4 GB.

    Times and sizes that ImageJ or OME state are used.  Channels and slices are no frames.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        import tifffile

        self._stack: NDArray[Any] | None = None
        with _reading(f"{path}: cannot be read as a TIFF file"), ExitStack() as opened:
            self._file: Any = opened.enter_context(tifffile.TiffFile(path))
            count = len(self._file.pages)
            first = self._file.pages[0] if count else None
            if first is None or first.dtype is None or not _are_pictures(first.shape, first.dtype):
                kind = "no page" if first is None else f"pages of shape {first.shape} and type {first.dtype}"
                raise InputError(
                    f"{path}: holds {kind}; a recording has pages of grey levels or red, green and blue, unsigned "
                    "integers of 8 or 16 bits or floating point numbers"
                )
            _refuse_picture(path, first.shape)
            self.shape = (int(first.shape[0]), int(first.shape[1]))
            self._colors = first.ndim == 3
            if self._colors:
                self.tell_colour(first.shape[2])
            if str(getattr(first.compression, "name", "NONE")).upper() in ("JPEG", "OJPEG", "JPEG2000", "WEBP"):
                self.tell_lossy()
            self.metadata = {"format": "TIFF stack"}
            told = self._file.imagej_metadata or {}
            self.numbers = np.arange(self._lay_out(told, count, first))
            self._imagej(told, first)
            if self._file.is_ome:
                self._ome(tifffile.xml2dict(str(self._file.ome_metadata))["OME"]["Image"])
            self.take_type(first.dtype)
            opened.pop_all()

    def _lay_out(self, told: dict[str, Any], count: int, page: Any) -> int:
        """Number of frames, by the axes that the file states."""
        import tifffile

        series = self._file.series
        if len(series) > 1:
            if self._file.is_ome or told:
                raise InputError(f"{self.path}: holds {len(series)} images of several frames; save one of them")
            return count
        sizes = zip(series[0].axes, series[0].shape, strict=True)
        axes = {axis: size for axis, size in sizes if axis not in "YXS" and size > 1}
        # ImageJ calls the frames of a video that it opened slices
        moving = "TIQ" + ("Z" if {"finterval", "fps"} & set(told) and "spacing" not in told else "")
        if len(axes) > 1 or any(axis not in moving for axis in axes):
            names = {**tifffile.TIFF.AXES_NAMES, "Q": "unnamed", "I": "unnamed"}
            found = ", ".join(f"{size} ({names.get(axis, axis)})" for axis, size in axes.items())
            raise InputError(
                f"{self.path}: holds pictures along {found}: must be frames over time alone; save one channel and slice, in "
                "ImageJ with its number of frames and one slice (Image > Properties)"
            )
        frames = math.prod(axes.values())
        if int(told.get("images", frames)) != frames:
            raise InputError(f"{self.path}: says {told['images']} images and holds {frames}: it is cut short")
        if frames != count:
            if series[0].dataoffset is None:
                raise InputError(f"{self.path}: says {frames} frames and holds {count} pages")
            self._stack = tifffile.memmap(self.path, mode="r").reshape(frames, *page.shape)
        return frames

    def _imagej(self, told: dict[str, Any], page: Any) -> None:
        self.metadata |= {key: value for key, value in told.items() if key in ("fps", "finterval", "tunit")}
        rates: dict[str, float] = {}
        interval, shown = told.get("finterval"), told.get("fps")
        if isinstance(interval, (int, float)) and interval > 0.0:
            unit = _unescaped(told.get("tunit", "s"))
            try:
                rates[f"finterval = {interval:g} {unit}"] = 1.0 / (interval * seconds_in("finterval", unit))
            except InputError as error:
                self.frame_rate_question = f"{error}; give frame_rate (--frame-rate) in Hz"
                return
        if isinstance(shown, (int, float)) and shown > 0.0:
            rates["fps"] = float(shown)
        self.state_rate(rates)
        sizes = []
        for key, name in (("unit", "XResolution"), ("yunit", "YResolution")):
            unit, resolution = _unescaped(told.get(key, told.get("unit"))), page.tags.get(name)
            known = resolution is not None and min(resolution.value) > 0 and unit not in ("in", "inch", "inches")
            metres = unit_factor("pixel size", unit, "m") if known else None  # inches come from printers
            sizes.append(None if metres is None else metres * resolution.value[1] / resolution.value[0])
        across, down = sizes
        self.pixel_size, self.pixel_width = down or across, across or down

    def _ome(self, image: Any) -> None:
        """Take times and sizes of OME, whose units are micrometres and seconds unless stated."""
        pixels = (image[0] if isinstance(image, list) else image)["Pixels"]
        sizes = []
        for axis in "YX":
            size, unit = pixels.get(f"PhysicalSize{axis}"), _unescaped(pixels.get(f"PhysicalSize{axis}Unit", "um"))
            metres = unit_factor("pixel size", unit, "m")
            sizes.append(None if not size or metres is None else float(size) * metres)
        self.pixel_size, self.pixel_width = sizes[0] or sizes[1], sizes[1] or sizes[0]
        rates: dict[str, float] = {}
        if step := pixels.get("TimeIncrement"):
            unit = str(pixels.get("TimeIncrementUnit", "s"))
            rates["TimeIncrement"] = 1.0 / (float(step) * seconds_in("TimeIncrement", unit))
        planes = pixels.get("Plane", [])
        stamps = [plane for plane in planes if "DeltaT" in plane] if isinstance(planes, list) else []
        if len(stamps) == self.numbers.size > 2 and any(plane["DeltaT"] for plane in stamps):
            stamps.sort(key=lambda plane: int(plane.get("TheT", 0)))
            times = [float(one["DeltaT"]) * seconds_in("DeltaT", str(one.get("DeltaTUnit", "s"))) for one in stamps]
            known = 1.0 / rates["TimeIncrement"] if rates else None
            self.numbers, step = numbers_of_stamps(self.path, np.array(times), 0.0, known)
            rates["time stamps DeltaT"] = 1.0 / step
        self.state_rate(rates)

    def _page(self, index: int) -> NDArray[Any]:
        if self._stack is not None:
            return grey_of(self._stack[index]) if self._colors else self._stack[index]
        with _reading(f"{self.path}: page {index} cannot be read"):
            page = self._file.pages[index]
            _refuse_picture(self.path, page.shape)
            image = page.asarray()
        if image.shape[:2] != self.shape or (image.ndim == 3) != self._colors:
            raise InputError(f"{self.path}: page {index} is of shape {image.shape}, not {self.shape}")
        return grey_of(image) if self._colors else image

    def close(self) -> None:
        """Close the file."""
        self._stack = None
        self._file.close()


def _unescaped(unit: Any) -> str:
    """A unit of ImageJ, which writes letters beyond ASCII by their codes."""
    return re.sub(r"\\u([0-9a-fA-F]{4})", lambda found: chr(int(found[1], 16)), str(unit or "")).strip()


# Stacks of pictures in arrays: NumPy's .npy and HDF5.


class ArraySource(FrameSource):
    """A stack (frames, height, width), or with red, green and blue last, read from the disk as needed.

    The attributes ``frame_rate`` [Hz], ``pixel_size`` [m] and ``exposure`` [s] of an HDF5 file are used, and times of
    the frames beside the stack.
    """

    def __init__(self, path: Path, dataset: str = "") -> None:
        super().__init__(path)
        self._file: Any = None
        self._rates: dict[str, float] = {}
        self._times: list[NDArray[np.float64]] = []
        with ExitStack() as opened:
            opened.callback(self.close)
            with _reading(f"{path}: cannot be read as a stack of pictures"):
                self._stack = self._open(dataset)
            shape, dtype = self._stack.shape, self._stack.dtype
            if not _are_pictures(shape, dtype, 1):
                raise InputError(
                    f"{path}: an array of shape {shape} and type {dtype}: must be (frames, height, width), or with 3 "
                    "colours last, of unsigned integers of 8 or 16 bits or floating point numbers"
                )
            _refuse_picture(path, shape[1:])
            self.shape = (int(shape[1]), int(shape[2]))
            self.numbers = np.arange(shape[0])
            if self._times and shape[0] > 2:
                self.numbers, step = numbers_of_stamps(path, self._times[0], 0.0)
                self._rates["times of the frames"] = 1.0 / step
            self.state_rate(self._rates)
            self._colors = len(shape) == 4
            if self._colors:
                self.tell_colour(shape[3])
            self.take_type(dtype)
            opened.pop_all()

    def _open(self, dataset: str) -> Any:
        if self.path.suffix.lower() == ".npy":
            self.metadata = {"format": "NumPy stack"}
            return np.load(self.path, mmap_mode="r", allow_pickle=False)
        self._file = open_hdf5(self.path, in_parts=True)
        arrays = members_of(self._file)[1]
        found = {name: item for name, item in arrays.items() if _are_pictures(item.shape, item.dtype, 1)}
        names = ", ".join(found) or "none"
        if dataset and dataset not in found:
            raise InputError(f"{self.path}: holds no stack {dataset!r}; its stacks are {names}")
        if not dataset and len(found) != 1:
            raise InputError(
                f"{self.path}: holds {len(found)} stacks of pictures ({names}); name one as in {self.path.name}::name"
            )
        chosen = dataset or names
        levels = (found[chosen].attrs, found[chosen].parent.attrs, self._file.attrs)
        self._rates = self._attributes(levels, _RATES)
        sizes = self._attributes(levels, _SIZES)
        if sizes and max(sizes.values()) > 1.001 * min(sizes.values()):
            told = ", ".join(f"{name} {size:g}" for name, size in sizes.items())
            self.pixel_size_hint = f"its attributes differ ({told})"
        else:
            self.pixel_size = next(iter(sizes.values()), None)
        self.exposure = next(iter(self._attributes(levels, ("exposure",)).values()), None)
        self._times = [
            np.asarray(item, dtype=np.float64) * seconds_in(name, stated_unit(item.attrs) or None)
            for name, item in found[chosen].parent.items()
            if getattr(item, "shape", None) == found[chosen].shape[:1] and is_time(name)
        ]
        self.metadata = {"format": "HDF5 stack", "dataset": chosen}
        return found[chosen]

    def _attributes(self, levels: tuple[Any, ...], names: tuple[str, ...]) -> dict[str, float]:
        """Values of the attributes of these names, the nearest first."""
        found: dict[str, float] = {}
        for level in levels:
            for name in (name for name in names if name in level and name not in found):
                value = np.asarray(level[name])
                if value.size != 1 or value.dtype.kind not in "iuf" or not value.item() > 0.0:
                    raise InputError(f"{self.path}: attribute {name!r} = {level[name]!r}: must be a positive number")
                found[name] = float(value.item())
        return found

    def _page(self, index: Any) -> NDArray[Any]:
        pictures = np.asarray(self._stack[index])
        return grey_of(pictures) if self._colors else pictures

    def read(self, start: int, stop: int, rows: tuple[int, int]) -> NDArray[np.integer]:
        """Return some frames, in some rows, in one access."""
        return self._levels(self._page((slice(start, stop), slice(*rows))), start)

    def close(self) -> None:
        """Close the file."""
        if self._file is not None:
            self._file.close()
            self._file = None


# Photron recordings: a header with its .mraw.


def take_header(source: FrameSource, header: CameraHeader) -> None:
    """Copy times and scales of a header to a source."""
    source.frame_rate, source.frame_rate_question = header.frame_rate, header.question
    source.pixel_size, source.pixel_size_hint = header.pixel_size, header.scale_hint
    source.exposure = header.exposure
    source.diagnostics = (*header.diagnostics, *source.diagnostics)
    names = ("camera", "comment", "record_rate", "skip", "stored_bits", "effective_bits")
    kind = "Photron mraw" if not header.image_suffix else f"Photron header of {header.image_suffix} images"
    source.metadata = {"format": kind, "date": header.recorded} | {name: getattr(header, name) for name in names}


class PhotronSource(FrameSource):
    """A .cih or .cihx header with its .mraw."""

    def __init__(self, header: CameraHeader) -> None:
        super().__init__(header.path)
        self.header = header
        self._gains: NDArray[np.float64] | None = None
        check_pixels(header)
        self.shape = (header.height, header.width)
        self.numbers = np.arange(header.frame_count)
        self.max_value = header.max_value
        take_header(self, header)
        if header.raw_colors:
            self._gains, spread = _mosaic(self.read(0, 1, (0, self.shape[0]))[0])
            if self._gains is not None:
                self.diagnostics += (KINDS_RECORDING["mosaic"].found(spread_percent=100.0 * spread),)

    def read(self, start: int, stop: int, rows: tuple[int, int]) -> NDArray[np.integer]:
        """Return some frames, in some rows."""
        frames = read_mraw(self.header, start, stop, rows)
        if self._gains is None:
            return frames
        full = np.tile(self._gains, (self.shape[0] // 2 + 1, self.shape[1] // 2 + 1))
        part = full[rows[0] : rows[1], : self.shape[1]]
        return np.rint(np.minimum(frames * part, self.max_value)).astype(frames.dtype)


def _mosaic(frame: NDArray[Any]) -> tuple[NDArray[np.float64] | None, float]:
    """Gains (2, 2) that bring the four kinds of pixels to one mean, None if all are alike, and their spread."""
    height, width = (size - size % 2 for size in frame.shape)
    kinds = frame[:height, :width].astype(np.float64).reshape(height // 2, 2, width // 2, 2).mean((0, 2))
    if not kinds.min() > 0.0:
        return None, 0.0
    spread = float(kinds.max() / kinds.min() - 1.0)
    return (kinds.max() / kinds if spread > _EVEN else None), spread


# Numbered images, one a frame.


def load_image(file: Path, *, grey: bool = True) -> NDArray[Any]:
    """One picture of 8 or 16 bits or floating point numbers, (height, width), or with colours last."""
    with needing(f"{file}: reading it", "lab"):
        import cv2

    if not file.is_file():
        raise InputError(f"{file}: no such file")
    try:
        raw = np.fromfile(file, dtype=np.uint8)
    except OSError as error:
        raise InputError(f"{file}: cannot be read ({error.strerror})") from None
    _refuse_picture(file, _stated_shape(file))
    image = cv2.imdecode(raw, cv2.IMREAD_UNCHANGED) if raw.size else None
    if image is None:
        raise InputError(f"{file}: cannot be read as an image")
    if image.dtype not in (np.uint8, np.uint16, np.float32, np.float64):
        raise InputError(f"{file}: pixels of type {image.dtype}: must be 8 or 16 bits or floating point")
    if image.ndim == 3:
        image = image[..., 2::-1]
    return grey_of(image) if grey and image.ndim == 3 else image


def _stated_shape(file: Path) -> tuple[int, ...]:
    """Width and height of a picture as its header states them; empty if Pillow does not know the kind."""
    from PIL import Image

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            with Image.open(file) as image:
                return image.size
    except (Image.DecompressionBombWarning, Image.DecompressionBombError) as error:
        pixels = re.search(r"\d+", str(error))
        return (int(pixels[0]),) if pixels else ()
    except Exception:  # OpenCV decides whether it can be read
        return ()


def images_of_header(header: CameraHeader) -> FrameSource:
    """The numbered images beside a header that says its pixels are in images.

    Those whose names begin with the header's; where there are none, all of that kind in its folder.
    """
    folder = header.path.parent
    kinds = {".tif": TIFF_SUFFIXES, ".jpg": _JPEG}.get(header.image_suffix, (header.image_suffix,))
    beside = sorted(one for one in folder.iterdir() if one.suffix.lower() in kinds)
    own = [one for one in beside if one.name.startswith(header.path.stem)] or beside
    if not own:
        raise InputError(f"{header.path}: its pixels are in {header.image_suffix} images, but none is beside it")
    source = ImageSource(header.path, own)
    if len(own) != header.frame_count or source.shape != (header.height, header.width):
        raise InputError(
            f"{header.path}: says {header.frame_count} frames of {header.height} x {header.width} pixels; beside it "
            f"are {len(own)} {header.image_suffix} images of {source.shape[0]} x {source.shape[1]}"
        )
    take_header(source, header)
    if source.max_value > header.max_value and header.effective_side == "lower":
        source.max_value = header.max_value
    return source


class ImageSource(FrameSource):
    """Numbered images, one a frame: a folder, or a pattern such as ``test_*.tif``.

    The last number in each name is the number of its frame; a number that is absent is a frame that is
    missing, and stays one.
    """

    def __init__(self, path: Path, names: list[Path] | None = None) -> None:
        super().__init__(path)
        folder, pattern = (path, "*") if path.is_dir() else (path.parent, path.name)
        if names is None:
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
        self.shape, self._dtype = (first.shape[0], first.shape[1]), first.dtype
        self.take_type(first.dtype)
        self.metadata = {"format": "numbered images", "first_number": order[0]}
        if any(one.suffix.lower() in _JPEG for one in self._files):
            self.tell_lossy()

    def _load(self, index: int) -> NDArray[Any]:
        image = load_image(self._files[index], grey=False)
        if image.ndim == 3:
            self.tell_colour(image.shape[2])
            image = grey_of(image)
        return image

    def _page(self, index: int) -> NDArray[Any]:
        image = self._load(index)
        if image.shape != self.shape or image.dtype != self._dtype:
            raise InputError(
                f"{self._files[index]}: shape {image.shape} and type {image.dtype} differ from the first "
                f"frame's {self.shape} and {self._dtype}"
            )
        return image


# Video files and Phantom's .cine, decoded by PyAV.


def _lossless_h264(context: Any) -> bool:
    """Return whether H.264 is lossless: x264 uses this profile without full colour only then."""
    profile = str(context.profile or "")
    return profile == "High 4:4:4 Predictive" and "444" not in (context.pix_fmt or "444")


_CURVE, _KNEE = 1.09929682680944, 0.018053968510807  # of ITU-R BT.709
_EXPORT = "export it as an uncompressed AVI or as 16-bit TIFF images, and give frame_rate (--frame-rate)"


def _light_of_packed(path: Path, bits: int) -> NDArray[np.uint16]:
    """Levels proportional to light, 12 bits in the upper ones of 16, of each 10-bit level of a packed Phantom file.

    The camera stores its 12 bits in 10 along the curve of ITU-R BT.709, from black (64 of both) to white (1014 and
    4064).  The levels are within 1 of 4095 of those in the table of the library pycine, 3 for level 0; its licence (GPL)
    is not ours.
    """
    if bits != 10:
        raise InputError(f"{path}: packed pixels of {bits} bits: must be of 10 bits; {_EXPORT}")
    signal = (np.arange(1024) - 64) / 950
    bright = ((np.maximum(signal, 0.0) + _CURVE - 1.0) / _CURVE) ** (1.0 / 0.45)
    light = 64 + 4000 * np.where(signal < 4.5 * _KNEE, signal / 4.5, bright)
    levels = np.where(signal > 1.0, 4095, np.ceil(light)).astype(np.uint16)
    return ((levels << 4) | (levels >> 8)).astype(np.uint16)


class VideoSource(FrameSource):
    """A video file, decoded by PyAV.

    The rate in a video file is how fast it plays, seldom how fast it was recorded; it stands in the metadata
    as ``playback_rate`` and is no frame rate.  Time stamps and empty chunks tell which frames are missing.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        import av

        self._av = av
        self._decoder: Iterator[NDArray[np.integer]] | None = None
        self._next = 0
        self._container: Any = None
        self._light: NDArray[np.uint16] | None = None
        try:
            with av.open(str(path)) as container:
                if not container.streams.video:
                    raise InputError(f"{path}: holds no video stream")
                stream = container.streams.video[0]
                if stream.codec_context is None:
                    raise InputError(f"{path}: its video has a codec that is not known here")
                read = (packet for packet in container.demux(stream) if packet.size)
                stamps = [packet.dts if packet.pts is None else packet.pts for packet in read]
                known = sorted(stamp for stamp in stamps if stamp is not None)
                count, tick = len(stamps), float(stream.time_base or 0.0)
                codec = stream.codec_context.name
                if path.suffix.lower() == ".cine":
                    self._cine(stream, container.metadata, count)
                    if stream.codec_context.codec_tag == "BIT\0":
                        self._light = _light_of_packed(path, stream.codec_context.bits_per_coded_sample)
                else:
                    average = float(stream.average_rate or 0.0)
                    rate = float(stream.guessed_rate or 0.0) or average or None
                    self.numbers = np.arange(count)
                    if len(known) == count > 2 and rate:
                        # Matroska counts milliseconds; of the others the average counts lost frames as slowness
                        step = 1.0 / (average if average * tick > 1.0 else rate)
                        self.numbers, _ = numbers_of_stamps(path, tick * np.array(known), tick, step)
                    self.metadata = {"format": f"video ({codec})", "playback_rate": rate}
                if codec not in LOSSLESS and not _lossless_h264(stream.codec_context):
                    self.tell_lossy()
                name = stream.codec_context.pix_fmt or ""
                self.shape = (stream.codec_context.height, stream.codec_context.width)
        except (av.error.FFmpegError, OSError) as error:
            way_out = f"; {_EXPORT}" if path.suffix.lower() == ".cine" else ""
            raise InputError(f"{path}: cannot be read as a video ({error}){way_out}") from None
        if count == 0 or 0 in self.shape:
            raise InputError(f"{path}: the video holds no frame")
        _refuse_picture(path, self.shape)
        if name not in ("gray", "gray8") and re.search(r"rgb|bgr|bayer|gbr|pal8", name):
            self.tell_colour(3)
        deep = re.search(r"(9|10|12|14|16|48)(le|be)", name)
        self._format = "gray16le" if deep else "gray"
        self.take_type(np.dtype(np.uint16 if deep else np.uint8))

    def _cine(self, stream: Any, metadata: dict[str, str], count: int) -> None:
        """Read frame rate, exposure and times of frames from the header of a Phantom recording."""
        rate = float(stream.average_rate or stream.base_rate or stream.guessed_rate or 1 / stream.time_base)
        told = {**metadata, **stream.metadata}
        shutter = float(told.get("shutter_ns", 0))
        self.exposure = 1e-9 * shutter if 0.0 < 1e-9 * shutter <= 1.01 / rate else None
        self.metadata = {"format": "Phantom cine", "record_rate": rate}
        rates, self.numbers = {"header": rate}, np.arange(count)
        times = cine_times(self.path, count)
        if times is not None and count > 2:
            self.numbers, step = numbers_of_stamps(self.path, times, 2.0**-32)
            rates["time stamps of the frames"] = 1.0 / step
        self.state_rate(rates)

    def _frames(self) -> Iterator[NDArray[np.integer]]:
        self._container = self._av.open(str(self.path))
        for frame in self._container.decode(video=0):
            levels = frame.to_ndarray(format=self._format)
            yield levels if self._light is None else self._light[levels >> 6]

    def _page(self, index: int) -> NDArray[Any]:
        """One frame; those before it are decoded too, from the last one that was asked for or from the first."""
        if self._decoder is None or self._next > index:
            self.close()
            self._decoder, self._next = self._frames(), 0
        try:
            while True:
                frame = next(self._decoder, None)
                if frame is None:
                    raise InputError(f"{self.path}: ends after frame {self._next} of {self.numbers.size}")
                if frame.shape != self.shape:
                    raise InputError(f"{self.path}: frame {self._next} is of shape {frame.shape}, not {self.shape}")
                self._next += 1
                if self._next > index:
                    return frame
        except self._av.error.FFmpegError as error:
            raise InputError(f"{self.path}: frame {self._next} cannot be decoded ({error})") from None

    def close(self) -> None:
        """Close the file."""
        if self._container is not None:
            self._container.close()
            self._container = None
        self._decoder = None


def open_source(path: Path) -> FrameSource:
    """The source for a path, chosen by its suffix."""
    with needing(f"{path}: reading it", "lab"):
        if path.is_dir() or any(mark in path.name for mark in "*?["):
            return ImageSource(path)
        name, _, dataset = str(path).partition("::")  # a dataset's name may hold "/"
        path = path if path.exists() else Path(name)
        dataset, suffix = dataset.replace("\\", "/"), path.suffix.lower()
        if not path.is_file():
            raise InputError(f"{path}: no such file")
        if suffix == ".mraw":
            headers = [path.with_suffix(one) for one in (".cihx", ".cih") if path.with_suffix(one).exists()]
            if not headers:
                raise InputError(f"{path}: its header {path.stem}.cihx or {path.stem}.cih is not beside it")
            path, suffix = headers[0], headers[0].suffix.lower()
        if suffix in (".cih", ".cihx"):
            header = read_header(path)
            return images_of_header(header) if header.image_suffix else PhotronSource(header)
        if suffix in ARRAY_SUFFIXES:
            return ArraySource(path, dataset)
        if suffix in (*VIDEO_SUFFIXES, *TIFF_SUFFIXES):
            return VideoSource(path) if suffix in VIDEO_SUFFIXES else TiffSource(path)
    raise InputError(
        f"{path}: unknown kind of recording; known are {', '.join(RECORDING_SUFFIXES)}, a folder of numbered images "
        "or a pattern such as 'test_*.png'"
    )
