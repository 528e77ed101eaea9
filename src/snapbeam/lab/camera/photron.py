"""Headers of Photron high-speed recordings, read and written.

A recording is two files of one name: a header (``.cih``, lines of ``key : value``; ``.cihx``, XML inside a
binary envelope) and the pixels (``.mraw``, frame after frame, row by row, without any header of its own).
The names of the fields follow what pyMRAW (J. Javh, J. Slavič, ladisk/pyMRAW) reads.
"""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from snapbeam.core.validate import InputError

__all__ = ["CameraHeader", "header_text", "read_header"]

_LENGTH_UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "μm": 1e-6, "nm": 1e-9}
_MAX_SIDE = 65536
_MAX_HEADER_BYTES = 64 * 1024 * 1024


@dataclass(frozen=True)
class CameraHeader:
    """What a .cih or .cihx header says about its recording.

    ``record_rate`` is the rate of the camera [Hz]; when only every ``skip``-th frame was saved, the time
    between saved frames is ``skip/record_rate``.  ``exposure`` [s] and ``pixel_size`` [m] are ``None``
    where the header does not hold them.  ``stored_bits`` is the size of a pixel in the file and
    ``effective_bits`` how many of them carry the image, on the ``effective_side`` of the stored number.
    """

    path: Path
    width: int
    height: int
    frame_count: int
    record_rate: float | None
    skip: int
    exposure: float | None
    pixel_size: float | None
    stored_bits: int
    effective_bits: int
    effective_side: str
    start_frame: int
    camera: str
    comment: str

    @property
    def frame_rate(self) -> float | None:
        """Saved frames per second, record_rate/skip [Hz]."""
        return None if self.record_rate is None else self.record_rate / self.skip

    @property
    def mraw(self) -> Path:
        """The file with the pixels."""
        for suffix in (".mraw", ".MRAW", ".Mraw"):
            candidate = self.path.with_suffix(suffix)
            if candidate.exists():
                return candidate
        return self.path.with_suffix(".mraw")

    @property
    def max_value(self) -> int:
        """The largest value an effective pixel can take."""
        return int(2**self.effective_bits - 1)


class _Fields:
    """The fields of a header by name, each error naming the file and the field."""

    def __init__(self, path: Path, values: Mapping[str, str]) -> None:
        self.path = path
        self.values = values

    def error(self, field: str, why: str) -> InputError:
        return InputError(f"{self.path}: field {field!r} {why}")

    def text(self, field: str, default: str | None = None) -> str:
        value = self.values.get(field)
        if value is None or value == "":
            if default is None:
                raise self.error(field, "is missing")
            return default
        return value

    def number(self, field: str) -> float | None:
        raw = self.text(field, "")
        if raw == "":
            return None
        try:
            if "/" in raw:
                above, below = raw.split("/", 1)
                value = float(above) / float(below)
            else:
                value = float(raw)
        except (ValueError, ZeroDivisionError):
            raise self.error(field, f"= {raw!r} is not a number") from None
        if not math.isfinite(value):
            raise self.error(field, f"= {raw!r} is not finite")
        return value

    def integer(self, field: str, low: int, high: int, default: int | None = None) -> int:
        value = self.number(field)
        if value is None:
            if default is None:
                raise self.error(field, "is missing")
            return default
        if value != int(value) or not low <= value <= high:
            raise self.error(field, f"= {self.text(field)!r} must be an integer in [{low}, {high}]")
        return int(value)


# Name in a .cih file and path of tags in a .cihx file, for each field used here.
_NAMES: dict[str, tuple[tuple[str, ...], str]] = {
    "width": (("Image Width",), "imageDataInfo/resolution/width"),
    "height": (("Image Height",), "imageDataInfo/resolution/height"),
    "frame_count": (("Total Frame",), "frameInfo/totalFrame"),
    "start": (("Start Frame",), "frameInfo/startFrame"),
    "skip": (("Save Step", "Skip Frame"), "frameInfo/skipFrame"),
    "record_rate": (("Record Rate(fps)",), "recordInfo/recordRate"),
    "shutter": (("Shutter Speed(s)",), "recordInfo/shutterSpeed"),
    "format": (("File Format",), "imageFileInfo/fileFormat"),
    "color": (("Color Type",), "imageDataInfo/colorInfo/type"),
    "stored_bits": (("Color Bit",), "imageDataInfo/colorInfo/bit"),
    "effective_bits": (("EffectiveBit Depth",), "imageDataInfo/effectiveBit/depth"),
    "effective_side": (("EffectiveBit Side",), "imageDataInfo/effectiveBit/side"),
    "camera": (("Camera Type",), "deviceInfo/deviceName"),
    "comment": (("Comment Text",), "basicInfo/comment"),
    "unit": ((), "plugin/calibration/distanceUnit"),
    "pixel": ((), "plugin/calibration/sizeOfPixel"),
}


def _read_cih(path: Path, raw: bytes) -> dict[str, str]:
    values: dict[str, str] = {}
    for line in raw.decode("utf-8", errors="replace").splitlines():
        match = re.match(r"\s*([^#:][^:]*?)\s*:\s?(.*)$", line)
        if match:
            values[match.group(1)] = match.group(2).strip()
    if not values:
        raise InputError(f"{path}: holds no 'key : value' line, so it is no .cih header")
    return values


def _read_cihx(path: Path, raw: bytes) -> dict[str, str]:
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
    return {tags: (root.findtext(tags) or "").strip() for _, tags in _NAMES.values()}


def read_header(path: str | Path) -> CameraHeader:
    """Read and check a Photron header.

    Parameters
    ----------
    path
        A ``.cih`` or ``.cihx`` file.  The shutter is a time or fraction in seconds in the first
        ("1/800000") and the reciprocal of the time in the second.

    Raises
    ------
    InputError
        Naming the file and the field that is missing, malformed or not supported.
    """
    path = Path(path)
    kind = path.suffix.lower()
    if kind not in (".cih", ".cihx"):
        raise InputError(f"{path}: a Photron header ends in .cih or .cihx")
    try:
        if path.stat().st_size > _MAX_HEADER_BYTES:
            raise InputError(f"{path}: is larger than 64 MiB, so it is no Photron header")
        raw = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from None
    values = _read_cih(path, raw) if kind == ".cih" else _read_cihx(path, raw)
    fields = _Fields(path, values)

    def name(key: str) -> str:
        plain, tags = _NAMES[key]
        if kind == ".cihx":
            return tags
        return next((one for one in plain if one in values), plain[0] if plain else tags)

    if fields.text(name("format"), "mraw").lower() != "mraw":
        raise fields.error(name("format"), f"= {fields.text(name('format'))!r}: only MRaw pixels are read")
    if fields.text(name("color"), "Mono").lower() != "mono":
        raise fields.error(name("color"), f"= {fields.text(name('color'))!r}: only Mono is supported")
    stored = fields.integer(name("stored_bits"), 1, 64)
    if stored not in (8, 12, 16):
        raise fields.error(name("stored_bits"), f"= {stored}: must be 8, 12 or 16")
    side = fields.text(name("effective_side"), "Lower").lower()
    if side not in ("lower", "higher"):
        raise fields.error(name("effective_side"), f"= {side!r}: must be Lower or Higher")
    rate = fields.number(name("record_rate"))
    if rate is not None and rate <= 0.0:
        raise fields.error(name("record_rate"), f"= {rate:g}: must be greater than 0")
    shutter = fields.number(name("shutter"))
    if shutter is not None and shutter <= 0.0:
        raise fields.error(name("shutter"), f"= {shutter:g}: must be greater than 0")
    header = CameraHeader(
        path=path,
        width=fields.integer(name("width"), 1, _MAX_SIDE),
        height=fields.integer(name("height"), 1, _MAX_SIDE),
        frame_count=fields.integer(name("frame_count"), 1, 2**40),
        record_rate=rate,
        skip=fields.integer(name("skip"), 1, 2**40, default=1),
        exposure=(None if shutter is None else shutter if kind == ".cih" else 1.0 / shutter),
        pixel_size=_pixel_size(fields) if kind == ".cihx" else None,
        stored_bits=stored,
        effective_bits=fields.integer(name("effective_bits"), 1, stored, default=stored),
        effective_side=side,
        start_frame=fields.integer(name("start"), -(2**40), 2**40, default=0),
        camera=fields.text(name("camera"), ""),
        comment=fields.text(name("comment"), ""),
    )
    if stored == 12 and header.width * header.height % 2:
        raise fields.error(name("width"), f"= {header.width}: 12-bit frames hold an even number of pixels")
    return header


def _pixel_size(fields: _Fields) -> float | None:
    """Metres per pixel from the calibration block, where its unit is a length."""
    unit = fields.text(_NAMES["unit"][1], "")
    if unit.lower() not in _LENGTH_UNITS:
        return None
    size = fields.number(_NAMES["pixel"][1])
    if size is not None and size <= 0.0:
        raise fields.error(_NAMES["pixel"][1], f"= {size:g}: must be greater than 0")
    return None if size is None else size * _LENGTH_UNITS[unit.lower()]


def _element(parent: ET.Element, tags: str, text: Any) -> None:
    for tag in tags.split("/"):
        found = parent.find(tag)
        parent = ET.SubElement(parent, tag) if found is None else found
    parent.text = str(text)


def header_text(kind: str, values: Mapping[str, Any], pixel_size: float) -> bytes:
    """A header of the given kind (".cih" or ".cihx") from values named as in this module's table."""
    shutter = float(values["exposure"])
    known = {
        "format": "MRaw",
        "color": "Mono",
        "effective_side": "Lower",
        "shutter": f"1/{1.0 / shutter:.12g}" if kind == ".cih" else f"{1.0 / shutter:.12g}",
        **{key: values[key] for key in values if key != "exposure"},
    }
    if kind == ".cih":
        lines = ["#Camera Information Header", f"Date : {values['date']}"]
        lines += [
            f"{names[0]} : {known[key]}" for key, (names, _) in _NAMES.items() if names and key in known
        ]
        lines += [f"Original Total Frame : {values['frame_count']}", ""]
        return "\n".join(lines).encode("utf-8")
    root = ET.Element("cih")
    _element(root, "fileInfo/date", values["date"])
    for key, (_, tags) in _NAMES.items():
        if key in known:
            _element(root, tags, known[key])
    _element(root, "frameInfo/recordedFrame", int(values["frame_count"]) * int(values["skip"]))
    _element(root, "plugin/calibration/distanceUnit", "um")
    _element(root, "plugin/calibration/sizeOfPixel", repr(round(pixel_size * 1e6, 9)))
    ET.indent(root)
    return b"<?xml version='1.0' encoding='UTF-8'?>\n" + ET.tostring(root, encoding="utf-8") + b"\n"
