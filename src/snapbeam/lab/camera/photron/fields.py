"""The fields of a Photron header by name, each error naming the file and the field.

A ``.cih`` header is lines of ``key : value``; a ``.cihx`` one is XML inside a binary envelope.  The names of
the fields follow what pyMRAW (J. Javh, J. Slavič, ladisk/pyMRAW) reads.
"""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from pathlib import Path

from snapbeam.core.validate import InputError

__all__ = ["NAMES", "Fields", "read_fields"]

_MAX_HEADER_BYTES = 64 * 1024 * 1024

# Name in a .cih file and path of tags in a .cihx file, for each field used here.
NAMES: dict[str, tuple[tuple[str, ...], str]] = {
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


class Fields:
    """The fields of one header, asked for by the names of :data:`NAMES`."""

    def __init__(self, path: Path, values: Mapping[str, str], xml: bool) -> None:
        self.path = path
        self.values = values
        self.xml = xml

    def name(self, key: str) -> str:
        """What the header calls a field."""
        plain, tags = NAMES[key]
        if self.xml:
            return tags or plain[0]
        return next((one for one in plain if one in self.values), plain[0] if plain else tags)

    def error(self, key: str, why: str) -> InputError:
        return InputError(f"{self.path}: field {self.name(key)!r} {why}")

    def text(self, key: str, default: str | None = None) -> str:
        value = self.values.get(self.name(key))
        if value is None or value == "":
            if default is None:
                raise self.error(key, "is missing")
            return default
        return value

    def number(self, key: str) -> float | None:
        raw = self.text(key, "")
        if raw == "":
            return None
        try:
            if "/" in raw:
                above, below = raw.split("/", 1)
                value = float(above) / float(below)
            else:
                value = float(raw)
        except (ValueError, ZeroDivisionError):
            raise self.error(key, f"= {raw!r} is not a number") from None
        if not math.isfinite(value):
            raise self.error(key, f"= {raw!r} is not finite")
        return value

    def positive(self, key: str) -> float | None:
        value = self.number(key)
        if value is not None and value <= 0.0:
            raise self.error(key, f"= {value:g}: must be greater than 0")
        return value

    def integer(self, key: str, low: int, high: int, default: int | None = None) -> int:
        value = self.number(key)
        if value is None:
            if default is None:
                raise self.error(key, "is missing")
            return default
        if value != int(value) or not low <= value <= high:
            raise self.error(key, f"= {self.text(key)!r} must be an integer in [{low}, {high}]")
        return int(value)


def read_fields(path: Path) -> Fields:
    """Read the fields of a header.

    Raises
    ------
    InputError
        If the file is no such header.
    """
    kind = path.suffix.lower()
    if kind not in (".cih", ".cihx"):
        raise InputError(f"{path}: a Photron header ends in .cih or .cihx")
    try:
        if path.stat().st_size > _MAX_HEADER_BYTES:
            raise InputError(f"{path}: is larger than 64 MiB, so it is no Photron header")
        raw = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from None
    if kind == ".cih":
        return Fields(path, _lines(path, raw), xml=False)
    return Fields(path, _tags(path, raw), xml=True)


def _lines(path: Path, raw: bytes) -> dict[str, str]:
    if raw.startswith((b"\xff\xfe", b"\xfe\xff")):
        text = raw.decode("utf-16", errors="replace")
    else:
        text = raw.decode("utf-8-sig", errors="replace")
    values: dict[str, str] = {}
    for line in text.splitlines():
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
