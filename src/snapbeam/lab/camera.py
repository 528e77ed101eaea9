"""One lazy reader for every kind of high-speed recording."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from datetime import date
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.ndimage import center_of_mass, gaussian_filter1d

from snapbeam.lab.diagnostics import KINDS_RECORDING, holding
from snapbeam.lab.image_sources import FrameSource, open_source
from snapbeam.lab.photron import frame_bytes, header_text
from snapbeam.util.diagnostics import Diagnostic
from snapbeam.util.files import atomic_path, check_writable
from snapbeam.util.packages import needing
from snapbeam.util.validation import InputError, file_path, instance, integer, positive, require_texts, shown, within

_LARGEST_PIXEL = 0.01  # m


class Recording:
    """Frames of a camera on demand, with the scales that turn them into metres and seconds.

    Made by :func:`open_recording`. Frames are read on demand and not stored. Use it as a context manager, or call
    :meth:`close`.

    ``path`` is the file, folder or pattern; ``shape`` the (height, width) of a frame in the region [px]; ``region``
    (first row, last row + 1, first column, last column + 1) in the full frame; ``frames`` in use (first, last + 1);
    ``numbers`` the number of each frame counted from the first in use, where a hole is a missing frame;
    ``frame_rate`` in Hz; ``pixel_size`` [m] the height of a pixel, for motion along columns, and ``pixel_width`` its
    width; ``exposure`` the shutter time [s] or None; ``max_value`` the grey level at which a pixel is saturated;
    ``metadata`` and ``diagnostics`` those of the file, and ``edge_error`` the standard error [px] of every edge from
    the way the file stores pictures.

    Examples
    --------
    >>> import numpy as np
    >>> from snapbeam import lab
    >>> np.save("frames.npy", np.zeros((5, 64, 64), dtype=np.uint8))
    >>> with lab.open_recording("frames.npy", frame_rate=10e3, pixel_size=12e-6) as recording:
    ...     print(len(recording), recording.shape)
    5 (64, 64)
    """

    def __init__(
        self,
        path: Path,
        source: FrameSource,
        frame_rate: float,
        pixel_size: float,
        region: tuple[int, int, int, int],
        diagnostics: tuple[Diagnostic, ...] = (),
        pixel_width: float | None = None,
        frames: tuple[int, int] | None = None,
    ) -> None:
        instance("source", source, FrameSource, "a source of frames (open_recording opens a file)")
        _tuple("region", region, 4, "four numbers")
        self.path = path
        self._source = source
        self.frame_rate = frame_rate
        self.pixel_size = pixel_size
        self.pixel_width = pixel_size if pixel_width is None else pixel_width
        self.region = region
        self.shape = (region[1] - region[0], region[3] - region[2])
        self.frames = frames or (0, source.numbers.size)
        self.numbers = _numbers(source, self.frames)
        self.exposure = source.exposure
        self.max_value = source.max_value
        self.metadata: dict[str, Any] = dict(source.metadata)
        self.diagnostics = diagnostics
        self.edge_error = source.edge_error

    def __len__(self) -> int:
        return int(self.numbers.size)

    @property
    def time_step(self) -> float:
        """Time between neighbouring frame numbers, 1/frame_rate [s]."""
        return 1.0 / self.frame_rate

    @property
    def time(self) -> NDArray[np.float64]:
        """Time of each frame [s], float (frames,), zero at the first."""
        return self.numbers / self.frame_rate

    def frame(self, index: int) -> NDArray[np.integer]:
        """One frame of the region, integers (height, width)."""
        index = integer("index", index, 0, len(self) - 1)
        return self._read(index, index + 1)[0]

    def batches(self, size: int = 64, *, start: int = 0, stop: int | None = None) -> Iterator[NDArray[np.integer]]:
        """Runs of up to *size* frames in order, integers (frames, height, width)."""
        size = integer("size", size, 1)
        start = integer("start", start, 0, len(self))
        stop = len(self) if stop is None else integer("stop", stop, start, len(self))
        for first in range(start, stop, size):
            yield self._read(first, min(first + size, stop))

    def __iter__(self) -> Iterator[NDArray[np.integer]]:
        for batch in self.batches(16):
            yield from batch

    def _read(self, start: int, stop: int) -> NDArray[np.integer]:
        top, bottom, left, right = self.region
        return self._source.read(start + self.frames[0], stop + self.frames[0], (top, bottom))[:, :, left:right]

    def close(self) -> None:
        """Close the file."""
        self._source.close()

    def __enter__(self) -> Recording:
        return self

    def __exit__(self, *ended: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return (
            f"Recording({str(self.path)!r}, {len(self)} frames of {self.shape[0]} x {self.shape[1]} pixels, "
            f"{self.frame_rate:g} Hz, {self.pixel_size * 1e6:g} um per pixel)"
        )


def _tuple(name: str, value: Any, size: int, allowed: str) -> None:
    if not isinstance(value, (tuple, list)) or len(value) != size:
        raise InputError(f"{name} = {shown(value)}: must be {allowed}")


def _range(name: str, value: Any, at: int, count: int) -> tuple[int, int]:
    """First of *count* things and one past the last, from two neighbours of a sequence."""
    first = integer(f"{name}[{at}]", value[at], 0, count - 1)
    return first, integer(f"{name}[{at + 1}]", value[at + 1], first + 1, count)


def _numbers(source: FrameSource, frames: tuple[int, int]) -> NDArray[np.int64]:
    """Numbers of the frames in use, counted from the first of them."""
    numbers = source.numbers[slice(*frames)]
    return numbers - numbers[0] if frames[0] else numbers


def _told_of(source: FrameSource, rate: float, numbers: NDArray[np.int64]) -> tuple[Diagnostic, ...]:
    """Diagnostics of a file, whose frame rate [Hz] may be another than it states, and which may lack frames."""
    stated = source.frame_rate or rate
    before = numbers[:-1][np.diff(numbers) > 1]
    lost = {"frames": numbers[-1] + 1 - numbers.size, "places": before.size, "first": before[0] if before.size else 0}
    question = bool(source.frame_rate_question)
    return *source.diagnostics, *holding(
        KINDS_RECORDING,
        ("contradiction", question, {"given": rate}),
        ("rate_given", not question and abs(rate / stated - 1.0) > 1e-3, {"given": rate, "stated": stated}),
        ("frames_missing", before.size > 0, lost),
    )


def open_recording(
    path: str | Path,
    *,
    frame_rate: float | None = None,
    pixel_size: float | None = None,
    region: tuple[int, int, int, int] | None = None,
    frames: tuple[int, int] | None = None,
) -> Recording:
    """Open a high-speed recording for reading frame by frame.

    Parameters
    ----------
    path
        Photron header (.cih, .cihx) or its .mraw; video (.avi, .mp4, .mov, .mkv); .cine; TIFF stack; array (.npy, or
        .h5, ``"file.h5::name"`` if it contains several); folder of numbered images or a pattern such as
        ``"run3/img_*.png"``.
    frame_rate
        Frame rate [Hz], in place of that of the file. Required for a video, whose file has the playback rate, and if
        statements in a file contradict each other.
    pixel_size
        Metres per pixel in the plane of the beam, in place of that of the file (.cihx, ImageJ, OME).
    region
        Part of the frame: (first row, last row + 1, first column, last column + 1).
    frames
        Frames to use: (first, last + 1), counted from 0 over those in the file; the first of them is at time zero.

    Raises
    ------
    InputError
        If the file is malformed, or frame rate or pixel size is missing.

    Examples
    --------
    >>> import numpy as np
    >>> from snapbeam import lab
    >>> np.save("frames.npy", np.zeros((5, 64, 64), dtype=np.uint8))
    >>> with lab.open_recording("frames.npy", frame_rate=10e3, pixel_size=12e-6) as recording:
    ...     print(recording.frame(4).max())
    0
    """
    path = file_path("path", path)
    source = open_source(path)
    try:
        given = None if frame_rate is None else positive("frame_rate", frame_rate, "Hz")
        size = source.pixel_size if pixel_size is None else positive("pixel_size", pixel_size, "m")
        rate = source.frame_rate if given is None else given
        if rate is None:
            played = source.metadata.get("playback_rate")
            hint = f"; it plays at {played:g} Hz, which need not be how it was recorded" if played else ""
            why = source.frame_rate_question or (
                f"the frame rate is not in the file{hint}; give frame_rate (--frame-rate) in Hz"
            )
            raise InputError(f"{path}: {why}")
        if size is None:
            hint = f"; {source.pixel_size_hint}" if source.pixel_size_hint else ""
            raise InputError(f"{path}: the pixel size is not in the file{hint}; give pixel_size (--pixel-size) in m")
        if size > _LARGEST_PIXEL:
            raise InputError(
                f"pixel_size (--pixel-size) = {size:g}: a pixel of {size:g} m; must be at most {_LARGEST_PIXEL:g} m, "
                "in metres, such as 12e-6 for 12 um"
            )
        width = source.pixel_width if pixel_size is None else None
        (height, across), count = source.shape, source.numbers.size
        part, used = (0, height, 0, across) if region is None else region, (0, count) if frames is None else frames
        _tuple("region", part, 4, "(first row, last row + 1, first column, last column + 1)")
        _tuple("frames (--frames)", used, 2, "(first frame, last frame + 1)")
        part = (*_range("region", part, 0, height), *_range("region", part, 2, across))
        used = _range("frames", used, 0, count)
        told = _told_of(source, rate, _numbers(source, used))
        return Recording(path, source, rate, size, part, told, width, used)
    except BaseException:
        source.close()
        raise


# ----------------------------------------------------------------------------------------------------
# Marks that stand still: how the camera drifts against them, and the scale of the picture from two of them.


_Array = NDArray[np.float64]
_FARTHEST = 30  # rows
_SMOOTH = 1.2  # rows
_RASTER = 0.005  # px, error of a curve drawn between pixels of another phase


def profile_shift(profiles: _Array, reference: _Array) -> tuple[_Array, _Array]:
    """Rows by which each profile, (n, rows), lies below the reference, (rows,), and their standard errors.

    Shift, gain and offset are fitted by least squares, from the shift of whole rows with the best correlation on.
    """
    rows = reference.size
    reach = min(_FARTHEST, (rows - 8) // 3)
    if reach < 1:
        raise InputError(f"fixed mark (--fixed-mark) of {rows} rows: must be at least 11 along the motion")
    if np.ptp(reference) <= 0.0:
        raise InputError("fixed mark (--fixed-mark): shows nothing that could be followed; choose another part")
    # finer than two pixels the raster shows other things in each frame
    profiles = gaussian_filter1d(np.asarray(profiles, dtype=np.float64), _SMOOTH, axis=1)
    reference = gaussian_filter1d(np.asarray(reference, dtype=np.float64), _SMOOTH)
    inner = np.arange(reach, rows - reach, dtype=np.float64)
    full = profiles[:, reach : rows - reach]
    part = full - full.mean(1, keepdims=True)
    score = []
    for shift in range(-reach, reach + 1):
        there = reference[reach - shift : rows - reach - shift]
        there = there - there.mean()
        norm = np.sqrt((there @ there) * (part * part).sum(1)) + 1e-30
        score.append(part @ there / norm)
    found = np.argmax(score, axis=0).astype(np.float64) - reach
    spline = CubicSpline(np.arange(rows, dtype=np.float64), reference)
    slope = spline.derivative()
    for _ in range(6):
        at = inner[None, :] - found[:, None]
        model, grade = spline(at), -slope(at)
        design = np.stack([np.ones_like(model), model, grade], axis=-1)
        gram = np.einsum("nri,nrj->nij", design, design)
        gram += 1e-12 * np.trace(gram, axis1=1, axis2=2)[:, None, None] * np.eye(3)
        solution = np.linalg.solve(gram, np.einsum("nri,nr->ni", design, full)[..., None])[..., 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            step = np.where(solution[:, 1] > 0.0, solution[:, 2] / solution[:, 1], 0.0)
        found = found + np.clip(np.nan_to_num(step), -0.7, 0.7)
    rest = full - np.einsum("nri,ni->nr", design, solution)
    variance = (rest**2).sum(1) / max(inner.size - 3, 1) * 2.0 * np.sqrt(np.pi) * _SMOOTH
    smooth = gaussian_filter1d(design, _SMOOTH, axis=1)
    inverse = np.linalg.inv(gram)
    spread = np.einsum("ni,nri->nr", inverse[:, 2], smooth)
    with np.errstate(divide="ignore", invalid="ignore"):
        error = np.sqrt(variance * (spread**2).sum(1)) / np.abs(solution[:, 1])
    return found, np.hypot(error, _RASTER)


def pixel_size_from_marks(
    recording: Recording,
    first: tuple[float, float],
    second: tuple[float, float],
    distance: float,
    *,
    frame: int = 0,
    reach: int = 6,
) -> tuple[float, float]:
    """Metres per pixel from two small marks a known distance apart, and the standard error.

    Parameters
    ----------
    recording
        An open recording.
    first, second
        (row, column) of the two marks in the region, to about *reach* pixels.
    distance
        Between them [m].
    frame
        Frame to look in.
    reach
        Half the side [px] of the square in which the centre of each mark is located.

    Examples
    --------
    >>> import numpy as np
    >>> from snapbeam import lab
    >>> row, column = np.mgrid[:120, :100]
    >>> def mark(at_row, at_column):
    ...     return 150.0 * np.exp(-((row - at_row) ** 2 + (column - at_column) ** 2) / 8.0)
    >>> frame = 20.0 + mark(20, 18) + mark(98, 71) + np.random.default_rng(0).standard_normal((120, 100))
    >>> np.save("marks.npy", frame[None].astype(np.uint8))
    >>> with lab.open_recording("marks.npy", frame_rate=1000.0, pixel_size=1e-5) as recording:
    ...     size, error = lab.pixel_size_from_marks(recording, (20, 18), (98, 71), 0.010)
    >>> f"{1e6 * size:.1f} um"
    '106.0 um'
    """
    length = positive("distance", distance, "m")

    instance("recording", recording, Recording, "a Recording")
    picture = recording.frame(frame).astype(np.float64)
    centres = [_centre(picture, where, reach, name) for name, where in (("first", first), ("second", second))]
    apart = float(np.hypot(*(centres[1] - centres[0])))
    if apart < 4.0 * reach:
        raise InputError(f"marks {first} and {second}: {apart:.1f} pixels apart: must be at least {4 * reach}")
    # a centre of mass within a pixel's raster is good to some hundredths of a pixel
    return length / apart, length / apart**2 * 0.05 * np.sqrt(2.0)


def _centre(picture: _Array, where: tuple[float, float], reach: int, name: str) -> _Array:
    """Centre of mass of the contrast about *where*, in two iterations."""
    at = np.array(where, dtype=np.float64)
    for _ in range(3):
        r, c = (round(float(value)) for value in at)
        if not (reach <= r < picture.shape[0] - reach and reach <= c < picture.shape[1] - reach):
            raise InputError(f"{name} mark at {where}: must lie {reach} pixels inside the region")
        patch = picture[r - reach : r + reach + 1, c - reach : c + reach + 1]
        border = np.concatenate([patch[0], patch[-1], patch[1:-1, 0], patch[1:-1, -1]])
        level, spread = float(np.median(border)), float(np.std(border))
        weight = np.abs(patch - level)
        weight[weight < max(0.3 * weight.max(), 4.0 * spread)] = 0.0
        if not weight.sum() > 0.0:
            raise InputError(f"{name} mark at {where}: nothing stands out of its surroundings there")
        at = np.array([r - reach, c - reach]) + center_of_mass(weight)
    return at


# ----------------------------------------------------------------------------------------------------
# Writing recordings: Photron header and pixels, and lossless video.  Frames are streamed.


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
        shape[:] = [number + 1, *(shape[1:] or array.shape)]
        if array.shape != tuple(shape[1:]):
            raise InputError(f"frames[{number}] of shape {array.shape}: must be of shape {tuple(shape[1:])}")
        if even and array.size % 2:
            raise InputError(f"frames of shape {array.shape}: 12-bit frames hold an even number of pixels")
        if array.min() < 0 or array.max() > limit:
            raise InputError(f"frames[{number}] holds {array.min()} to {array.max()}: must lie in [0, {limit}]")
        yield array
    if not shape:
        raise InputError("frames is empty: must hold at least one frame")


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
        Name of the header, ``.cih`` or ``.cihx``, with the ``.mraw`` beside it. Only ``.cihx`` stores the pixel size.
    frames
        Arrays of integers of one shape (height, width).
    frame_rate
        Frames written per second [Hz].
    pixel_size
        Metres per pixel.
    exposure
        Shutter time [s]; by default the time between frames.
    bit_depth
        Stored bits per pixel, 8, 12 or 16; by default 12 for .cihx, 16 for .cih.
    effective_bits
        Bits that carry the image; by default 8 in an 8-bit file, else 12.
    skip
        Number of camera frames per written frame; the record rate is ``frame_rate*skip``.

    Returns
    -------
    pathlib.Path
        The header's path.

    Examples
    --------
    >>> import numpy as np
    >>> from snapbeam import lab
    >>> frames = np.random.default_rng(0).integers(0, 4096, (5, 64, 64), dtype=np.uint16)
    >>> lab.write_photron("noise.cihx", frames, frame_rate=10e3, pixel_size=12e-6, bit_depth=12).name
    'noise.cihx'
    """
    path = check_writable(path, "path", (".cih", ".cihx"))
    check_writable(path.with_suffix(".mraw"), "path")
    kind = path.suffix.lower()
    rate = positive("frame_rate", frame_rate, "Hz")
    size = positive("pixel_size", pixel_size, "m")
    skip = integer("skip", skip, 1)
    shutter = 1.0 / (rate * skip) if exposure is None else positive("exposure", exposure, "s")
    bits = integer("bit_depth", (12 if kind == ".cihx" else 16) if bit_depth is None else bit_depth, 8, 16)
    if bits not in (8, 12, 16):
        raise InputError(f"bit_depth = {shown(bit_depth)}: must be 8, 12 or 16")
    effective = integer("effective_bits", min(bits, 12) if effective_bits is None else effective_bits, 1, bits)
    require_texts("comment", instance("comment", comment, str, "text"))
    if "\n" in comment or "\r" in comment:
        raise InputError(f"comment = {shown(comment)}: must be a single line")
    shape: list[int] = []
    with atomic_path(path) as header, atomic_path(path.with_suffix(".mraw")) as mraw:
        with open(mraw, "wb") as file:
            for chunk in frame_bytes(_checked(frames, 2**effective - 1, shape, even=bits == 12), bits):
                file.write(chunk)
        values = dict(zip(("frame_count", "height", "width"), shape, strict=True)) | {
            "start": 0, "skip": skip, "record_rate": f"{rate * skip:.12g}", "exposure": shutter, "stored_bits": bits,
            "effective_bits": effective, "camera": "snapbeam synthetic camera", "comment": comment,
            "date": f"{date.today():%Y/%m/%d}",
        }  # fmt: skip
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

    Examples
    --------
    >>> import numpy as np
    >>> from snapbeam import lab
    >>> frames = np.random.default_rng(0).integers(0, 256, (5, 64, 64), dtype=np.uint8)
    >>> lab.write_video("noise.avi", frames).name
    'noise.avi'
    """
    path = check_writable(path, "path", (".avi", ".mkv"))
    with needing(f"path = {str(path)!r}: a video", "lab"):
        import av

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
            assert stream is not None  # _checked refuses no frames
            container.mux(stream.encode())
    return path
