"""The fields of a Photron header by name, each error naming the file and the field.

A ``.cih`` header is lines of ``key : value``; a ``.cihx`` one is XML inside a binary envelope.  The names of
the fields follow what pyMRAW (J. Javh, J. Slavič, ladisk/pyMRAW) reads.
"""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.lab.diagnostics import KINDS_RECORDING
from snapbeam.lab.signals import unit_factor
from snapbeam.util.diagnostics import Diagnostic
from snapbeam.util.input_files import input_bytes
from snapbeam.util.validation import InputError, shown

# Name in a .cih file and path of tags in a .cihx file, for each field used here.
NAMES: dict[str, tuple[tuple[str, ...], str]] = {
    "date": (("Date",), "fileInfo/date"),
    "time": (("Time",), "fileInfo/time"),
    "width": (("Image Width",), "imageDataInfo/resolution/width"),
    "height": (("Image Height",), "imageDataInfo/resolution/height"),
    "frame_count": (("Total Frame",), "frameInfo/totalFrame"),
    "recorded": (("Original Total Frame",), "frameInfo/recordedFrame"),
    "start": (("Start Frame",), "frameInfo/startFrame"),
    "skip": (("Save Step", "Skip Frame"), "frameInfo/skipFrame"),
    "record_rate": (("Record Rate(fps)",), "recordInfo/recordRate"),
    "shutter": (("Shutter Speed(s)",), "recordInfo/shutterSpeed"),
    "shutter_nsec": (("Shutter Type2(nsec)",), "recordInfo/shutterSpeedNsec"),
    "format": (("File Format",), "imageFileInfo/fileFormat"),
    "color": (("Color Type",), "imageDataInfo/colorInfo/type"),
    "stored_bits": (("Color Bit",), "imageDataInfo/colorInfo/bit"),
    "effective_bits": (("EffectiveBit Depth",), "imageDataInfo/effectiveBit/depth"),
    "effective_side": (("EffectiveBit Side",), "imageDataInfo/effectiveBit/side"),
    "camera": (("Camera Type",), "deviceInfo/deviceName"),
    "comment": (("Comment Text",), "basicInfo/comment"),
    "unit": ((), "plugin/calibration/distanceUnit"),
    "pixel": ((), "plugin/calibration/sizeOfPixel"),
    "scale": (("Scale Pixel Size",), ""),
    "gamma": (("Pre LUT Gamma",), ""),
    "edge_enhance": (("Edge Enhance",), ""),
}


class HeaderFields:
    """The fields of one header, asked for by the names of :data:`NAMES`."""

    def __init__(self, path: Path, values: Mapping[str, str], xml: bool) -> None:
        self.path = path
        self.values = values
        self.xml = xml

    def name(self, key: str) -> str:
        """Name of a field in the header."""
        plain, tags = NAMES[key]
        if self.xml:
            return tags or plain[0]
        return next((one for one in plain if one in self.values), plain[0] if plain else tags)

    def error(self, key: str, why: str) -> InputError:
        """Return the error for a field that cannot be used."""
        return InputError(f"{self.path}: field {self.name(key)!r} {why}")

    def text(self, key: str, default: str = "") -> str:
        """Return a field as text."""
        return self.values.get(self.name(key)) or default

    def number(self, key: str) -> float | None:
        """Return a field as a number; None if it is absent."""
        raw = self.text(key)
        if raw == "":
            return None
        try:
            above, _, below = raw.partition("/")
            value = float(above) / float(below) if "/" in raw else float(raw)
        except (ValueError, ZeroDivisionError):
            raise self.error(key, f"= {raw!r} is not a number") from None
        if not math.isfinite(value):
            raise self.error(key, f"= {raw!r} is not finite")
        return value

    def positive(self, key: str) -> float | None:
        """Return a field as a number greater than 0; None if it is absent."""
        value = self.number(key)
        if value is not None and value <= 0.0:
            raise self.error(key, f"= {value:g}: must be greater than 0")
        return value

    def integer(self, key: str, low: int, high: int, default: int | None = None) -> int:
        """Return a field as an integer between two limits."""
        value = self.number(key)
        if value is None:
            if default is None:
                raise self.error(key, "is missing")
            return default
        if value != int(value) or not low <= value <= high:
            raise self.error(key, f"= {self.text(key)!r} must be an integer in [{low}, {high}]")
        return int(value)


def read_fields(path: Path) -> HeaderFields:
    """Read the fields of a header."""
    kind = path.suffix.lower()
    if kind not in (".cih", ".cihx"):
        raise InputError(f"{path}: a Photron header ends in .cih or .cihx")
    values = (_lines if kind == ".cih" else _tags)(path, input_bytes("path", path))
    return HeaderFields(path, values, xml=kind == ".cihx")


def _lines(path: Path, raw: bytes) -> dict[str, str]:
    wide = raw.startswith((b"\xff\xfe", b"\xfe\xff"))
    values: dict[str, str] = {}
    for line in raw.decode("utf-16" if wide else "utf-8-sig", errors="replace").splitlines():
        match = re.match(r"\s*([^#:][^:]*?)\s*:\s?(.*)$", line)
        if match:  # the first of two fields of one name is the camera's own
            values.setdefault(match.group(1), match.group(2).strip())
    if not values:
        raise InputError(f"{path}: holds no 'key : value' line, so it is no .cih header")
    return values


def _tags(path: Path, raw: bytes) -> dict[str, str]:
    start, stop = raw.find(b"<cih>"), raw.rfind(b"</cih>")
    if start < 0 or stop < start:
        raise InputError(f"{path}: holds no <cih> ... </cih> element, so it is no .cihx header")
    text = raw[start : stop + len(b"</cih>")].decode("utf-8", errors="replace")
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise InputError(f"{path}: the <cih> element must not declare document types or entities")
    try:
        root = ET.fromstring(text)
    except ET.ParseError as error:
        raise InputError(f"{path}: the <cih> element is not well-formed XML ({error})") from None
    return {tags: (root.findtext(tags) or "").strip() for _, tags in NAMES.values() if tags}


# ----------------------------------------------------------------------------------------------------
# When the frames of a Photron recording were taken: every field that says something, held against the others.


def read_timing(fields: HeaderFields, frames: int) -> dict[str, Any]:
    """The rates of a recording that holds *frames* frames, as the fields of a :class:`CameraHeader`.

    A step between saved frames must agree with how many were recorded and how many are left: every
    ``skip``-th of ``recorded`` frames makes recorded/skip.  The shutter is a time in seconds, or its
    reciprocal, as it stands in .cihx and in .cih files that were written from those; no exposure is longer
    than a frame.
    """
    rate = fields.positive("record_rate")
    skip = fields.integer("skip", 1, 2**40, default=1)
    recorded = fields.integer("recorded", 0, 2**50, default=0)
    question = ""
    if rate is not None and skip > 1 and recorded > 0 and abs(math.ceil(recorded / skip) - frames) > 1:
        question = (
            f"the header contradicts itself: every {skip}th of {recorded} recorded frames would be "
            f"{math.ceil(recorded / skip)} frames, but there are {frames}; frame_rate (--frame-rate) is "
            f"{rate:g} Hz if no frame was left out, {rate / skip:g} Hz if every {skip}th was kept"
        )
        if frames < recorded:
            question += f", {rate / (recorded / frames):g} Hz if these {frames} are spread over all {recorded}"
    if rate == 1.0 and "Generated sequence" in fields.text("comment"):
        question = (
            "the file was made by a program that writes 1 frame per second where it is not told "
            "another rate; give frame_rate (--frame-rate) in Hz"
        )
    exposure, diagnostics = _exposure(fields, rate)
    return {
        "record_rate": rate, "skip": skip, "frame_rate": None if rate is None or question else rate / skip,
        "question": question, "exposure": exposure, "diagnostics": (*diagnostics, *_curve(fields)),
    }  # fmt: skip


def _exposure(fields: HeaderFields, rate: float | None) -> tuple[float | None, tuple[Diagnostic, ...]]:
    stated = fields.positive("shutter")
    longest = math.inf if rate is None else 1.01 / rate
    diagnostics: list[Diagnostic] = []
    exposure = stated if not fields.xml or stated is None else 1.0 / stated
    if exposure is not None and exposure > longest:
        other = 1.0 / exposure
        if other <= longest:
            diagnostics.append(KINDS_RECORDING["shutter"].found(stated=exposure, exposure_us=1e6 * other))
            exposure = other
        else:
            diagnostics.append(KINDS_RECORDING["no_exposure"].found(stated=exposure, frame_us=1e6 / (rate or math.nan)))
            exposure = None
    nsec = fields.number("shutter_nsec")
    if nsec is not None and nsec > 0.0 and 1e-9 * nsec <= longest:
        if exposure is not None and abs(1e-9 * nsec / exposure - 1.0) > 0.02:
            diagnostics.append(KINDS_RECORDING["two_exposures"].found(first_us=1e6 * exposure, second_us=1e-3 * nsec))
        exposure = 1e-9 * nsec
    return exposure, tuple(diagnostics)


# ----------------------------------------------------------------------------------------------------
# Headers of Photron high-speed recordings, read and checked.
#
# A recording is two files of one name: a header (``.cih``, ``.cihx``) and the pixels (``.mraw``, frame after
# frame, row by row, without any header of its own); or a header and numbered images.


_MAX_SIDE = 65536
_IMAGES = {"png": ".png", "tiff": ".tif", "tif": ".tif", "bmp": ".bmp", "jpeg": ".jpg", "jpg": ".jpg"}


@dataclass(frozen=True)
class CameraHeader:
    """Content of a .cih or .cihx header.

    ``record_rate`` [Hz] is the camera's, ``skip`` the step between saved frames; ``frame_rate`` [Hz] that of the
    saved frames, None where it is missing or the header contradicts itself, which ``question`` then tells.
    ``pixel_size`` [m] is None where the header does not hold it, and ``scale_hint`` says what it holds instead.
    ``effective_bits`` of the ``stored_bits`` of a pixel carry the image, on the ``effective_side``; ``raw_colors``
    says that pixels may lie under a mosaic of colour filters.  ``image_suffix`` is that of numbered images with the
    pixels, empty for a .mraw file.
    """

    path: Path
    width: int
    height: int
    frame_count: int
    record_rate: float | None
    skip: int
    frame_rate: float | None
    question: str
    exposure: float | None
    pixel_size: float | None
    scale_hint: str
    stored_bits: int
    effective_bits: int
    effective_side: str
    raw_colors: bool
    image_suffix: str
    camera: str
    comment: str
    recorded: str
    diagnostics: tuple[Diagnostic, ...]

    @property
    def mraw(self) -> Path:
        """The file with the pixels."""
        named = [self.path.with_suffix(suffix) for suffix in (".mraw", ".MRAW", ".Mraw")]
        return next((one for one in named if one.exists()), named[0])

    @property
    def max_value(self) -> int:
        """The largest value an effective pixel can take."""
        return int(2**self.effective_bits - 1)


def read_header(path: str | Path) -> CameraHeader:
    """Read and check a Photron header, ``.cih`` or ``.cihx``."""
    fields = read_fields(Path(path))
    kind = fields.text("format", "mraw").lower()
    color = fields.text("color", "Mono").lower()
    for key, sound, allowed in (
        ("format", kind == "mraw" or kind in _IMAGES, "MRaw, PNG, TIFF, BMP or JPEG; save it as one of these"),
        ("color", color in ("mono", "raw"), "Mono or Raw; save the recording in grey levels"),
    ):
        if not sound:
            raise fields.error(key, f"= {fields.text(key)!r}: must be {allowed}")
    stored, effective, side = _bits(fields, "" if kind == "mraw" else kind)
    frames = fields.integer("frame_count", 1, 2**40)
    header = CameraHeader(
        path=fields.path,
        width=fields.integer("width", 1, _MAX_SIDE),
        height=fields.integer("height", 1, _MAX_SIDE),
        frame_count=frames,
        pixel_size=_pixel_size(fields),
        scale_hint=_scale_hint(fields),
        stored_bits=stored,
        effective_bits=effective,
        effective_side=side,
        raw_colors=color == "raw",
        image_suffix=_IMAGES.get(kind, ""),
        camera=fields.text("camera"),
        comment=fields.text("comment"),
        recorded=f"{fields.text('date')} {fields.text('time')}".strip(),
        **read_timing(fields, frames),
    )
    if stored == 12 and not header.image_suffix and header.width * header.height % 2:
        raise fields.error("width", f"= {header.width}: 12-bit frames hold an even number of pixels")
    return header


def _bits(fields: HeaderFields, images: str) -> tuple[int, int, str]:
    """Stored bits, effective bits and their side.

    A camera of 12 bits saved in 8 keeps the upper ones, and says so: all 8 are effective.
    """
    stored = fields.integer("stored_bits", 1, 64)
    if stored not in (8, 12, 16):
        raise fields.error("stored_bits", f"= {stored}: must be 8, 12 or 16")
    side = fields.text("effective_side", "Lower").lower()
    if side not in ("lower", "higher"):
        raise fields.error("effective_side", f"= {shown(side)}: must be Lower or Higher")
    depth = fields.integer("effective_bits", 1, 16, default=stored)
    if depth > stored and side == "lower" and not images:
        raise fields.error(
            "effective_bits",
            f"= {depth}: the lower {stored} bits of {depth} were stored, so bright pixels wrap around to dark; "
            "save the upper bits, or all",
        )
    return stored, min(depth, stored), side


def _pixel_size(fields: HeaderFields) -> float | None:
    """Metres per pixel from the calibration block, where its unit is a length."""
    factor = unit_factor("pixel", fields.text("unit").lower() if fields.xml else "", "m")
    size = None if factor is None else fields.positive("pixel")
    return None if factor is None or size is None else size * factor


def _scale_hint(fields: HeaderFields) -> str:
    """Note on the scale in a .cih header: its unit is an undocumented code."""
    size = None if fields.xml else fields.number("scale")
    if size is None or size in (0.0, 1.0):
        return ""
    return f"its field 'Scale Pixel Size' is {size:g} in a unit that it does not name ({size:g}e-6 if um)"


def _curve(fields: HeaderFields) -> tuple[Diagnostic, ...]:
    gamma, enhance = fields.number("gamma"), fields.number("edge_enhance")
    if (gamma is None or gamma == 1.0) and not enhance:
        return ()
    return (KINDS_RECORDING["curve"].found(gamma=1.0 if gamma is None else gamma, enhance=enhance or 0.0),)


def check_pixels(header: CameraHeader) -> None:
    """Raise an error if the file size of the pixels contradicts the header."""
    mraw = header.mraw
    try:
        found = mraw.stat().st_size
    except OSError as error:
        raise InputError(f"{mraw}: cannot be read ({error.strerror})") from None
    expected = header.frame_count * header.width * header.height * header.stored_bits // 8
    if found != expected:
        state = "is truncated" if found < expected else "is larger than its header says"
        raise InputError(
            f"{mraw}: {state}: {found} bytes, but the fields width, height, total frame and bit depth of "
            f"{header.path.name} ({header.width} x {header.height} x {header.frame_count} at "
            f"{header.stored_bits} bits) ask for {expected}"
        )


# ----------------------------------------------------------------------------------------------------
# The pixels of Photron recordings: 8, 12 or 16 bits each, decoded a frame at a time.
#
# The 12-bit packing follows what pyMRAW (J. Javh, J. Slavič, ladisk/pyMRAW) reads; frames are decoded here
# one by one, so that a recording larger than memory can be read.


def unpack_12bit(packed: NDArray[np.uint8]) -> NDArray[np.uint16]:
    """Unpack 12-bit pixels of a flat array, two in three bytes with the most significant bits first."""
    whole = np.ascontiguousarray(packed)
    count = whole.size // 3
    pixels = np.empty((count, 2), dtype=np.uint16)
    # numbers of 16 bits, the first byte the higher, from every third byte and from the one behind it
    first, second = (np.ndarray(count, dtype=">u2", buffer=whole, offset=at, strides=(3,)) for at in (0, 1))
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
                head, tail = (first % 2, last % 2) if bits == 12 else (0, 0)  # pixels of a pair that begins before
                size = (last + tail - first + head) * bits // 8
                file.seek((first - head) * bits // 8)
                raw = np.frombuffer(file.read(size), dtype=np.uint8)
                if raw.size != size:
                    raise InputError(f"{header.mraw}: ends inside frame {start + frame}")
                pixels = unpack_12bit(raw)[head : head + wanted * width] if bits == 12 else raw.view(f"<u{bits // 8}")
                out[frame] = pixels.reshape(wanted, width)
    except OSError as error:
        raise InputError(f"{header.mraw}: cannot be read ({error.strerror})") from None
    if header.effective_side == "higher" and header.effective_bits < bits:
        out >>= bits - header.effective_bits
    return out


def frame_bytes(frames: Iterable[NDArray[np.integer]], bits: int) -> Iterable[bytes]:
    """The bytes of each frame as they stand in a .mraw file of 8, 12 or 16 bits."""
    for frame in frames:
        yield (pack_12bit(frame.astype(np.uint16)) if bits == 12 else frame.astype(f"<u{bits // 8}")).tobytes()


# ----------------------------------------------------------------------------------------------------
# Headers of Photron recordings, written.


def header_text(kind: str, values: Mapping[str, Any], pixel_size: float) -> bytes:
    """A header of the given kind (".cih" or ".cihx") from values named as in this module's table."""
    shutter = float(values["exposure"])
    known = {
        "format": "MRaw",
        "color": "Mono",
        "effective_side": "Lower",
        "shutter": f"1/{1.0 / shutter:.12g}" if kind == ".cih" else f"{1.0 / shutter:.12g}",
        "recorded": int(values["frame_count"]) * int(values["skip"]),
        **{key: values[key] for key in values if key != "exposure"},
    }
    if kind == ".cih":
        lines = [f"{names[0]} : {known[key]}\n" for key, (names, _) in NAMES.items() if names and key in known]
        return "".join(["#Camera Information Header\n", *lines]).encode("utf-8")
    known |= {"unit": "um", "pixel": repr(round(pixel_size * 1e6, 9))}
    root = ET.Element("cih")
    for key, (_, tags) in NAMES.items():
        if key in known and tags:
            at = root
            for tag in tags.split("/"):
                found = at.find(tag)
                at = ET.SubElement(at, tag) if found is None else found
            at.text = str(known[key])
    ET.indent(root)
    return b"<?xml version='1.0' encoding='UTF-8'?>\n" + ET.tostring(root, encoding="utf-8") + b"\n"
