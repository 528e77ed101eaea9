"""LabVIEW's text files (.lvm): a header of the file, then for each segment its own and a table."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from snapbeam.core.validate import InputError
from snapbeam.lab.signals.formats.channel import Channel, Told, numbered
from snapbeam.lab.signals.formats.text import decoded, to_number

__all__ = ["read_lvm"]

_SEPARATORS = {"tab": "\t", "comma": ",", "semicolon": ";"}
_END = "***end_of_header***"


def read_lvm(path: Path, _told: Told) -> list[Channel]:
    """Channels of the first segment of an .lvm file.

    Raises
    ------
    InputError
        If the header is not that of such a file, or the file holds several segments: they need not join.
    """
    lines = [line.rstrip("\r") for line in decoded(path).split("\n")]
    if not lines[0].lower().startswith("labview measurement"):
        raise InputError("does not begin with 'LabVIEW Measurement', so it is no .lvm file")
    file_header, at = _header(lines, 0, None)
    separator = _SEPARATORS.get(file_header.get("separator", ["Tab"])[0].lower(), "\t")
    comma = file_header.get("decimal_separator", ["."])[0] == ","
    header, at = _header(lines, at, separator)
    if "samples" not in header or "delta_x" not in header:
        raise InputError("has no segment header with Samples and Delta_X")
    if any(_END == line.strip().strip(separator).lower() for line in lines[at:]):
        raise InputError("holds several segments; save one to a file")
    names = [cell.strip() for cell in lines[at].split(separator)]
    rows = [(k + 1, line.split(separator)) for k, line in enumerate(lines) if k > at and line.strip()]
    count = int(to_number(header.get("channels", ["0"])[0], comma) or 0)
    columns = [k for k, name in enumerate(names) if name and name.lower() not in ("x_value", "comment")]
    if not columns or (count and len(columns) != count):
        raise InputError(f"line {at + 1}: names {len(columns)} channel(s), the header says {count}")
    units = header.get("y_unit_label", [])
    channels: list[Channel] = []
    for number, k in enumerate(columns):
        step = to_number(header["delta_x"][min(number, len(header["delta_x"]) - 1)], comma)
        start = to_number(header.get("x0", ["0"])[min(number, len(header.get("x0", ["0"])) - 1)], comma)
        if not (math.isfinite(step) and step > 0.0):
            raise InputError(f"Delta_X = {header['delta_x'][0]!r}: must be a positive number of seconds")
        samples = int(to_number(header["samples"][min(number, len(header["samples"]) - 1)], comma))
        if len(rows) != samples:
            raise InputError(f"the header promises {samples} samples, the file has {len(rows)}")
        data = np.array([to_number(cells[k], comma) if k < len(cells) else math.nan for _, cells in rows])
        bad = np.flatnonzero(~np.isfinite(data))
        if bad.size:
            raise InputError(f"line {rows[int(bad[0])][0]}, column {names[k]!r}: is not a finite number")
        channels.append(
            {
                "data": data,
                "name": names[k],
                "unit_str": (units[number].strip() or None) if number < len(units) else None,
                "fs": 1.0 / step,
                "time_offset": start if math.isfinite(start) else 0.0,
            }
        )
    return numbered(channels)


def _header(lines: list[str], at: int, separator: str | None) -> tuple[dict[str, list[str]], int]:
    """Fields of a header that ends with its mark, and the line after it."""
    fields: dict[str, list[str]] = {}
    for k in range(at, len(lines)):
        line = lines[k].strip()
        if line.strip("\t,;").lower() == _END:
            return fields, k + 1
        mark = separator or next((one for one in ("\t", ";", ",") if one in line), None)
        if mark is not None and line:
            key, *values = line.split(mark)
            fields.setdefault(key.strip().lower(), [value.strip() for value in values if value.strip()])
    raise InputError("the header has no end (***End_of_Header***)")
