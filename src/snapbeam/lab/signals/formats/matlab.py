"""MATLAB files: version 5 by SciPy, version 7.3 by h5py.  Numbers and text only; objects are left alone."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from snapbeam.core.validate import InputError, positive
from snapbeam.lab.signals.formats.channel import RATE_NAMES, UNIT_NAMES, Channel, Told, is_time, with_time

__all__ = ["read_matlab"]

_LONGEST_SIDE = 64  # channels in a matrix


def read_matlab(path: Path, _told: Told) -> list[Channel]:
    """Channels of a .mat file: vectors, columns of matrices, and those in structures.

    A scalar named like ``fs`` is the sampling rate, a vector named like ``time`` the time axis, a text
    ``<name>_units`` or ``units`` the unit.
    """
    with open(path, "rb") as file:
        start = file.read(512)
    if start[:8] == b"\x89HDF\r\n\x1a\n" or b"MATLAB 7.3" in start[:128]:
        values = _version_73(path)
    else:
        values = _version_5(path)
    return _channels(values)


def _version_5(path: Path) -> dict[str, Any]:
    from scipy.io import loadmat

    loaded = loadmat(path, squeeze_me=True, struct_as_record=True, chars_as_strings=True)
    values: dict[str, Any] = {}

    def take(name: str, item: Any, depth: int) -> None:
        array = np.asarray(item)
        if array.dtype.names and depth < 4:
            for key in array.dtype.names:
                inner = array[key]
                take(
                    f"{name}/{key}",
                    inner.item() if inner.dtype == object and inner.ndim == 0 else inner,
                    depth + 1,
                )
        elif array.dtype.kind in "iufU":
            values[name] = array

    for name, item in loaded.items():
        if not name.startswith("__"):
            take(name, item, 0)
    return values


def _version_73(path: Path) -> dict[str, Any]:
    import h5py

    values: dict[str, Any] = {}
    with h5py.File(path, "r") as file:

        def visit(name: str, item: Any) -> None:
            if (
                not isinstance(item, h5py.Dataset)
                or name.startswith("#refs#")
                or item.dtype.kind not in "iuf"
            ):
                return
            if item.attrs.get("MATLAB_empty", 0):
                return
            array = np.asarray(item[()])
            if item.attrs.get("MATLAB_class", b"") == b"char":
                values[name] = np.array("".join(chr(int(code)) for code in array.ravel(order="F")))
            else:
                values[name] = np.squeeze(array.T)

        file.visititems(visit)
    return values


def _channels(values: dict[str, Any]) -> list[Channel]:
    rates = {name: value for name, value in values.items() if _last(name) in RATE_NAMES and value.size == 1}
    channels: list[Channel] = []
    for name, value in values.items():
        if value.dtype.kind not in "iuf" or value.size < 2:
            continue
        if value.ndim == 2 and min(value.shape) <= _LONGEST_SIDE:
            columns = value if value.shape[0] >= value.shape[1] else value.T
        elif value.ndim == 1:
            columns = value[:, None]
        else:
            continue
        folder = name.rpartition("/")[0]
        unit = _unit(values, name)
        rate = next((rates[key] for key in rates if key.rpartition("/")[0] in (folder, "")), None)
        for k in range(columns.shape[1]):
            own = name if columns.shape[1] == 1 else f"{name} {k + 1}"
            channel: Channel = {"data": columns[:, k].astype(np.float64), "name": own, "unit_str": unit}
            if rate is not None:
                channel["fs"] = positive(f"{own}: sampling rate", float(rate.item()), "Hz")
            channels.append(channel)
    if not channels:
        raise InputError(
            "holds no vector or matrix of numbers (objects and cells are not read; save as numbers)"
        )
    return with_time(channels)


def _last(name: str) -> str:
    return name.rpartition("/")[2].lower()


def _unit(values: dict[str, Any], name: str) -> str | None:
    folder = name.rpartition("/")[0]
    for key in UNIT_NAMES:
        common = () if is_time(_last(name)) else (f"{folder}/{key}" if folder else key,)
        for candidate in (f"{name}_{key}", *common):
            value = values.get(candidate)
            if value is not None and value.dtype.kind == "U" and value.ndim == 0:
                return str(value.item()).strip() or None
    return None
