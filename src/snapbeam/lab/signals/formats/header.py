"""What the lines above a table say: sampling rate and units, under the names that instruments give them."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable

from snapbeam.core.validate import InputError
from snapbeam.lab.signals.formats.text import to_number
from snapbeam.lab.signals.units import si_unit

__all__ = ["header_rate", "header_unit", "header_values"]

_RATES = (
    "samplingfreq", "samplingfrequency", "samplingfreqhz", "samplingfrequencyhz", "samplerate", "samplerate hz",
    "sampleratehz", "samplingrate", "samplingratehz", "samplefrequency", "fs", "fshz", "abtastrate",
)  # fmt: skip
_STEPS = (
    "sampleinterval", "samplingintervall", "samplinginterval", "sampleperiod", "samplingperiod", "timestep",
    "timeincrement", "timeinterval", "deltat", "deltats", "dt", "dts", "xincrement", "increment", "resolutionx",
)  # fmt: skip
_LONGEST_LINE = 2000
"""Letters of a line of a header that is looked into."""
_PER_SECOND = {
    "": 1.0,
    "hz": 1.0,
    "khz": 1e3,
    "mhz": 1e6,
    "s/s": 1.0,
    "sa/s": 1.0,
    "ks/s": 1e3,
    "ms/s": 1e6,
    "1/s": 1.0,
}


def header_values(lines: Iterable[str]) -> dict[str, str]:
    """Keys and values of header lines such as ``Sample Rate: 12 kHz`` or ``Vertical Units,V``.

    Keys lose everything but letters and digits; the first of two of one name counts.
    """
    values: dict[str, str] = {}
    for line in lines:
        if len(line) > _LONGEST_LINE:
            continue
        found = re.match(r'\s*"?([^:=,;\t"]+?)"?\s*([:=,;\t])\s*"?(.*?)"?\s*[,;\t]*\s*$', line)
        if found:
            key = re.sub(r"[^a-z0-9]", "", found[1].lower())
            ends = r"[,;\t]" if found[2] == "," else r"[;\t]"  # else a comma may be the decimal sign
            values.setdefault(key, re.split(ends, found[3])[0].strip().strip('"'))
    return values


def header_rate(values: dict[str, str], where: str) -> float | None:
    """Samples per second [Hz] that a header states; None if it does not.

    Raises
    ------
    InputError
        If it states two that differ.
    """
    found: dict[str, float] = {}
    for key, value in values.items():
        number, unit = _quantity(value)
        if not (math.isfinite(number) and number > 0.0):
            continue
        if key in _RATES and unit.lower() in _PER_SECOND:
            found[key] = number * _PER_SECOND[unit.lower()]
        elif key in _STEPS:
            try:
                factor, base = si_unit(key, unit or "s")
            except InputError:
                continue
            if base == "s":
                found[key] = 1.0 / (number * factor)
    if found and max(found.values()) > 1.001 * min(found.values()):
        told = ", ".join(f"{key} {value:.9g} Hz" for key, value in found.items())
        raise InputError(f"{where}: the header contradicts itself about the sampling rate ({told})")
    return next(iter(found.values()), None)


def header_unit(values: dict[str, str], *keys: str) -> str | None:
    """The unit that stands under one of *keys*, without a channel's name before it; None if none does."""
    for key in keys:
        word = values.get(key, "").rpartition(":")[2].strip()
        if word:
            return word
    return None


def _quantity(text: str) -> tuple[float, str]:
    """Number and unit of ``"12 kHz"``, ``"CH1:2e-8"`` or ``"0,5 ms"``."""
    found = re.fullmatch(r"(?:\w+:)?\s*([-+]?[0-9][0-9.,]*(?:[eE][-+]?\d+)?)\s*\[?([^\]]*)\]?", text.strip())
    if not found:
        return math.nan, ""
    comma = "," in found[1] and "." not in found[1]
    return to_number(found[1], comma), found[2].strip()
