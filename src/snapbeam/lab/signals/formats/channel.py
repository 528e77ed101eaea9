"""One channel as it comes out of a file, and what a reader is told beside the path."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from snapbeam.core.validate import InputError
from snapbeam.lab.signals.units import si_unit

__all__ = ["RATE_NAMES", "TIME_NAMES", "UNIT_NAMES", "Channel", "Told", "is_time", "numbered", "with_time"]

Channel = dict[str, Any]
"""One channel in the units of the file: ``data``, ``name``, ``unit_str`` (None where the file states
none), and ``fs`` [Hz] or ``time`` [s] where it has them."""

RATE_NAMES = ("sampling_frequency", "sampling_frequency", "fs", "sample_rate", "samplerate", "wf_samplerate")
UNIT_NAMES = ("units", "unit", "unit_str", "unit_string", "NI_UnitDescription")
TIME_NAMES = ("time", "t", "zeit", "temps", "x-axis", "second", "seconds", "x_value")


class Told(NamedTuple):
    """What a person says of a file: samples per second [Hz], and the columns of a table without a header."""

    rate: float | None = None
    columns: str | None = None


def is_time(name: str) -> bool:
    """Whether a channel's name is that of a time axis."""
    return name.strip().lower() in TIME_NAMES


def with_time(channels: list[Channel]) -> list[Channel]:
    """Take the time axes out of *channels* and give each to the channels of its group and length."""
    axes: dict[str, Any] = {}
    for channel in channels:
        folder, _, last = channel["name"].rpartition("/")
        if is_time(last):
            factor, base = si_unit(channel["name"], channel["unit_str"] or "s")
            if base != "s":
                raise InputError(f"{channel['name']} is in {channel['unit_str']!r}, not in seconds")
            axes[folder] = np.asarray(channel["data"], dtype=np.float64) * factor
    signals = [c for c in channels if not is_time(c["name"].rpartition("/")[2])]
    for channel in signals:
        folder = channel["name"].rpartition("/")[0]
        if "fs" in channel or folder not in axes:
            continue
        if axes[folder].size != np.size(channel["data"]):
            raise InputError(
                f"{channel['name']} has {np.size(channel['data'])} samples, its time axis {axes[folder].size}"
            )
        channel["time"] = axes[folder]
    return signals


def numbered(channels: list[Channel]) -> list[Channel]:
    """Channels of which each has a name of its own."""
    seen: dict[str, int] = {}
    for channel in channels:
        name = channel["name"]
        seen[name] = seen.get(name, 0) + 1
        if seen[name] > 1:
            channel["name"] = f"{name} ({seen[name]})"
    return channels
