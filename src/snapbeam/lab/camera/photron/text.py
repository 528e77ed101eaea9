"""Headers of Photron recordings, written."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from typing import Any

from snapbeam.lab.camera.photron.fields import NAMES

__all__ = ["header_text"]


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
        "recorded": int(values["frame_count"]) * int(values["skip"]),
        **{key: values[key] for key in values if key != "exposure"},
    }
    if kind == ".cih":
        lines = ["#Camera Information Header", f"Date : {values['date']}"]
        lines += [f"{names[0]} : {known[key]}" for key, (names, _) in NAMES.items() if names and key in known]
        lines.append("")
        return "\n".join(lines).encode("utf-8")
    root = ET.Element("cih")
    _element(root, "fileInfo/date", values["date"])
    for key, (_, tags) in NAMES.items():
        if key in known and tags:
            _element(root, tags, known[key])
    _element(root, "plugin/calibration/distanceUnit", "um")
    _element(root, "plugin/calibration/sizeOfPixel", repr(round(pixel_size * 1e6, 9)))
    ET.indent(root)
    return b"<?xml version='1.0' encoding='UTF-8'?>\n" + ET.tostring(root, encoding="utf-8") + b"\n"
