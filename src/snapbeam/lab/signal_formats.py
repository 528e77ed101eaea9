"""Readers and writers by the end of a file's name."""

from __future__ import annotations

import csv
import math
import os
import re
import tempfile
import warnings
import zipfile
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.lab.diagnostics import KINDS_SIGNAL
from snapbeam.lab.matlab_file import read_version_5
from snapbeam.lab.signals import SignalSamples, even_sampling, si_unit, unit_factor
from snapbeam.util.diagnostics import Diagnostic, DiagnosticWarning, tell
from snapbeam.util.hdf5 import members_of, open_hdf5
from snapbeam.util.input_files import decoded, refuse_inflated
from snapbeam.util.netcdf import hdf5_stream
from snapbeam.util.packages import needs
from snapbeam.util.tables import universal_record, write_universal
from snapbeam.util.validation import InputError, file_path, positive

if TYPE_CHECKING:
    import xarray as xr


Channel = dict[str, Any]
"""One channel in the units of the file: ``data``, ``name``, ``unit_str`` (None where the file states
none), and ``fs`` [Hz] or ``time`` [s] where it has them."""
UNIT_NAMES = ("units", "unit", "unit_str", "unit_string", "NI_UnitDescription")
TIME_NAMES = (
    "time", "times", "t", "zeit", "temps", "xaxis", "second", "seconds", "xvalue", "timedomain", "timeaxis",
    "timevector", "timevec", "timebase", "timearray", "timestamp", "timestamps",
)  # fmt: skip
"""Names of time axes, in small letters and digits."""
_SECONDS = dict.fromkeys(("minute", "minutes", "min"), 60.0) | {"hour": 3600.0, "hours": 3600.0}
_SECONDS |= {"day": 86400.0, "days": 86400.0}
_LONGEST_SIDE = 64  # channels in a matrix
_SCALES = (
    "scale", "scalefactor", "scaling", "gain", "factor", "slope", "multiplier", "conversion", "conversionfactor", "lsb",
)  # fmt: skip
_OFFSETS = ("offset", "addoffset", "intercept", "zerooffset", "bias")
_PACKING = ("scale_factor", "add_offset", "_FillValue", "missing_value", "valid_min", "valid_max", "valid_range")
_COMMENT = ("#", "%", "//", "!")
_LOOK = 400  # lines in which the table must begin
_ABOVE = 20
"""Rows at the start or at the end that are looked at."""
_STAMP = re.compile(
    r"(?<![\d.])(\d{1,4}[-/.]\d{1,2}[-/.]\d{1,4}([T ]+\d{1,2}:\d{2}(:\d{2})?([.,:]\d{2,})?)?|\d{1,2}:\d{2}(:\d{2})?([.,:]\d{2,})?)"
)
_GROUPED = {
    sign: re.compile(rf"[-+]?[1-9]\d{{0,2}}([{others}])\d{{3}}(?:\1\d{{3}})*(?:[{sign}]\d*)?")
    for sign, others in ((".", ",' "), (",", ".' "))
}
"""Numbers with signs between groups of three digits, by their decimal sign."""
_SIGNS = str.maketrans("\u2212\u00a0\u2009\u202f\u2019", "-   '")
_SEPARATORS = {"tab": "\t", "comma": ",", "semicolon": ";"}
_END = "***end_of_header***"
_RATES = (
    "samplingfreq", "samplingfrequency", "samplerate", "samplingrate", "samplefrequency", "samplefreq", "fs", "fsample",
    "fsampling", "timesamplerate", "wfsamplerate", "abtastrate", "samplespersecond", "daqrate",
)  # fmt: skip
_STEPS = (
    "sampleinterval", "samplingintervall", "samplinginterval", "sampleperiod", "samplingperiod",  "timestep", "timeincrement", "timeinterval", "deltat", "dt", "tinterval", "tsample",
    "xincrement", "xincr", "increment", "resolutionx", "wfincrement",
)  # fmt: skip
_LONGEST_LINE = 2000
"""Letters of a line of a header that is looked into."""
_PER_SECOND = {"": 1.0, "1/s": 1.0, "samples/s": 1.0, "samples/sec": 1.0, "samples/second": 1.0} | {
    prefix + unit: scale
    for prefix, scale in (("", 1.0), ("k", 1e3), ("m", 1e6), ("g", 1e9))
    for unit in ("hz", "s/s", "sa/s", "sps")
}
"""Samples per second in units in small letters; none is smaller than 1 Hz."""
_LONGEST_NAME = 500
"""Letters of a name of a column that a unit is looked for in."""
_SUFFIX_UNITS = {
    "_m_s": "m/s", "_mm_s": "mm/s", "_um_s": "um/s", "_mm": "mm", "_um": "um", "_ms": "ms", "_us": "us", "_m": "m",
    "_s": "s", "_v": "V", "_n": "N", "_hz": "Hz",
}  # fmt: skip
_INTEGER_SCALE = {"int16": (0.0, 2.0**15), "int32": (0.0, 2.0**31), "uint8": (128.0, 128.0)}
_FORTRAN = re.compile(rb"(\.\d*)[Dd]([-+]\d\d)")
_EXPONENT = re.compile(r"(\.\d*)[Dd]([-+]?\d{1,3})$")  # of Fortran
_DURATIONS = {"sec": 1.0, "min": 60.0, "hr": 3600.0, "day": 86400.0, "days": 86400.0}
_DURATION = re.compile(rf"([-+\d][^ ]*) ({'|'.join(_DURATIONS)})")
SPECTRA = {
    2: "auto spectrum", 3: "cross spectrum", 4: "frequency response", 5: "transmissibility", 6: "coherence",
    9: "power spectral density", 10: "energy spectral density", 12: "spectrum",
}  # fmt: skip
"""Functions over frequency in a record of dataset 58, by their codes."""
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")


def _key(name: str) -> str:
    """Small letters and digits of a name."""
    return re.sub(r"[^a-z0-9]", "", name.lower())


def is_time(name: str) -> bool:
    """Return whether a channel name denotes a time axis."""
    return _key(name) in TIME_NAMES


def seconds_in(name: str, unit: str | None) -> float:
    """Seconds in a unit of a time axis, also as in ``milliseconds since 2024-01-01``."""
    last = name.rpartition("/")[2]
    word = (unit or split_unit(last)[1] or "").strip()
    if not word and _key(last).startswith("timestamp"):
        raise InputError(f"{name} has no unit: write its unit, such as 's', into the file")
    word = word.partition(" since ")[0]
    if word.lower() in _SECONDS:
        return _SECONDS[word.lower()]
    factor, base = si_unit(name, word or "s")
    if base != "s":
        raise InputError(f"{name} is in {unit!r}, not in seconds")
    return factor


def stated_unit(attributes: Mapping[str, Any]) -> str:
    """Unit among attributes; empty if there is none."""
    return next((_text(attributes[key]).strip() for key in UNIT_NAMES if key in attributes), "")


def with_time(channels: list[Channel]) -> list[Channel]:
    """Take the time axes out of *channels* and give each to the channels of its group and length.

    An axis belongs to its group and the groups in it.  A channel may name its own under ``axis``.
    """
    axes: dict[str, NDArray[np.float64]] = {}
    signals: list[Channel] = []
    stated = {channel.get("axis") for channel in channels}
    for channel in channels:
        name = channel["name"]
        if name in stated or is_time(split_unit(name.rpartition("/")[2])[0]):
            axes[name] = np.asarray(channel["data"], dtype=np.float64) * seconds_in(name, channel["unit_str"])
        else:
            signals.append(channel)
    for channel in signals:
        name = channel["name"]
        folder, own = name.rpartition("/")[0], channel.pop("axis", None)
        found = {own: axes[own]} if own in axes else {}
        while not found:
            found = {each: axis for each, axis in axes.items() if each.rpartition("/")[0] == folder}
            if not folder:
                break
            folder = folder.rpartition("/")[0]
        size = np.size(channel["data"])
        fitting = {each: axis for each, axis in found.items() if axis.size == size}
        if found and not fitting:
            first, axis = next(iter(found.items()))
            raise InputError(f"{name} has {size} samples, its time axis {first} {axis.size}")
        if not found:
            continue
        (first, axis), *others = fitting.items()
        least = 1e-3 * abs(axis[-1] - axis[0]) / axis.size
        for other, times in others:
            if not np.allclose(times - times[0], axis - axis[0], rtol=0.0, atol=least):
                raise InputError(f"{name} has the time axes {first} and {other}, which differ: remove the wrong one")
        if "fs" in channel:
            agree(name, axis, channel.pop("fs"), "rename or remove the wrong one")
        channel["time"] = axis
    return signals


def numbered(channels: list[Channel]) -> list[Channel]:
    """Channels of which each has a name of its own."""
    seen: Counter[str] = Counter()
    for channel in channels:
        name = channel["name"]
        seen[name] += 1
        if seen[name] > 1:
            channel["name"] = f"{name} ({seen[name]})"
    return channels


def read_numpy(path: Path, *_told: Any) -> list[Channel]:
    """Return the channels of a NumPy file, ``.npy`` or ``.npz``."""
    refuse_inflated("path", path, _stated_size(path))
    with open(path, "rb") as file:  # opened here, since NumPy leaves damaged files open
        loaded = np.load(file, allow_pickle=False)
        arrays = None if isinstance(loaded, np.ndarray) else {name: loaded[name] for name in loaded.files}
    if arrays is None:
        if loaded.ndim != 1 or loaded.dtype.kind not in "iuf":
            raise InputError(f"array of {loaded.dtype} and shape {loaded.shape}: must be one channel of numbers")
        return [{"data": loaded, "name": path.stem, "unit_str": None}]
    return _channels({name: _Stored(np.squeeze(data), {}) for name, data in arrays.items()}, {})


def _stated_size(path: Path) -> int:
    """Bytes of the arrays of a NumPy file as its headers state them, at least 8 for a number."""
    if not zipfile.is_zipfile(path):
        with open(path, "rb") as file:
            return _stated_array(file)
    size = 0
    with zipfile.ZipFile(path) as archive:
        for member in archive.infolist():
            with archive.open(member) as file:
                size += max(member.file_size, _stated_array(file))
    return size


def _stated_array(file: Any) -> int:
    version = np.lib.format.read_magic(file)
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, _, dtype = read(file)
    return math.prod(shape) * max(dtype.itemsize, 8)


def write_npz(path: Path, signal: xr.DataArray, samples: SignalSamples, _full_scale: float | None) -> None:
    """Write a signal to a NumPy file with its times and its unit."""
    name = str(signal.name)
    np.savez(
        path, **{name: samples.values, "time": samples.time, f"{name}_units": signal.attrs["units"], "time_units": "s"}
    )


# Arrays with names: vectors, and matrices with a channel in each row or column.  Attributes, and arrays of one number or
# text, state units and sampling rates; CF attributes state how numbers are packed.


class _Stored(NamedTuple):
    """An array of a file with its own attributes, and the name of the time axis that the file gives it."""

    data: NDArray[Any]
    attributes: Mapping[str, Any]
    axis: str | None = None


def _unpacked(name: str, data: NDArray[Any], attributes: Mapping[str, Any]) -> NDArray[Any]:
    """The numbers of a packed array by the CF conventions; NaN where it is filled."""
    from snapbeam.util.datasets import xr

    packing: dict[str, Any] = {}
    for key in (key for key in _PACKING if key in attributes):
        value = np.asarray(attributes[key])
        filling = key in ("_FillValue", "missing_value")
        size = 2 if key == "valid_range" else 1
        finite = value.dtype.kind in "iuf" and (filling or (value.size == size and np.isfinite(value).all()))
        if not finite or (key == "scale_factor" and value.item() == 0.0):
            raise InputError(
                f"{name}: attribute {key!r} = {_text(attributes[key])}: must be a finite number, a scale not 0"
            )
        packing[key] = value if filling and value.size > 1 else value.ravel()[0] if size == 1 else value
    low, high = packing.pop("valid_range", (-math.inf, math.inf))
    low, high = packing.pop("valid_min", low), packing.pop("valid_max", high)
    _refuse_scales(name, data, {key: value for key, value in attributes.items() if key not in packing})
    outside, values = (data < low) | (data > high), data
    if packing:
        if "_Unsigned" in attributes:
            packing["_Unsigned"] = _text(attributes["_Unsigned"])
        variable = xr.Variable([f"axis{k}" for k in range(data.ndim)], data, packing)
        values = xr.conventions.decode_cf_variable(name, variable, decode_times=False).values
    return np.where(outside, np.nan, values) if outside.any() else values


def _refuse_scales(name: str, data: NDArray[Any], values: Mapping[str, Any]) -> None:
    """Raise an error for counts with a number that may be their scale."""
    for key, value in values.items():
        neutral = 1.0 if _key(key) in _SCALES else 0.0 if _key(key) in _OFFSETS else None
        if neutral is None or (data.dtype.kind == "f" and key not in ("scale_factor", "add_offset")):
            continue
        numbers = _quantity(_text(value))[0]
        if any(number != neutral for number in numbers):
            raise InputError(
                f"{name}: {key} = {_text(value)} may scale its numbers: store the scaled numbers without it, or make it the "
                "attributes scale_factor and add_offset of an array in an HDF5 or NetCDF file"
            )


def _channels(stored: Mapping[str, _Stored], groups: Mapping[str, Mapping[str, Any]]) -> list[Channel]:
    """Channels of named arrays; *groups* are the attributes of the groups by their names, ``""`` that of the file."""
    levels: dict[str, dict[str, Any]] = {folder: dict(values) for folder, values in groups.items()}
    texts: dict[str, str] = {}
    for name, item in stored.items():
        if item.data.size == 1 and item.data.dtype.kind in "iufUSO":
            folder, _, last = name.rpartition("/")
            value = item.data.reshape(-1)[0]
            stated = stated_unit(item.attributes)
            texts[name] = _text(value)
            levels.setdefault(folder, {})[last] = f"{_text(value)} {stated}" if stated else value
    vectors = {
        name: item
        for name, item in stored.items()
        if item.data.dtype.kind in "iuf" and item.data.size > 1 and 0 < item.data.ndim <= 2
        if item.data.ndim == 1 or min(item.data.shape) <= _LONGEST_SIDE
    }
    for name in [name for name in vectors if _rate_of(name.rpartition("/")[2], 1.0) is not None]:
        folder, _, last = name.rpartition("/")
        data = vectors.pop(name).data
        if not (data == data.flat[0]).all():
            raise InputError(
                f"{name} has {data.size} numbers that differ: must be one rate; write one file for each rate"
            )
        levels.setdefault(folder, {})[last] = data.flat[0]
    channels: list[Channel] = []
    for name, item in vectors.items():
        data = item.data
        folder, last = name, name.rpartition("/")[2]
        around: list[tuple[str, Mapping[str, Any]]] = [(name, item.attributes)]
        while folder:
            folder = folder.rpartition("/")[0]
            around.append((folder, levels.get(folder, {})))
        time = is_time(split_unit(last)[0])
        for _, values in () if time else around[1:]:
            _refuse_scales(name, data, values)
        rows = np.atleast_2d(_unpacked(name, data, item.attributes))
        rows = rows if rows.shape[0] <= rows.shape[1] else rows.T
        for k, row in enumerate(rows):
            own = name if rows.shape[0] == 1 else f"{name} {k + 1}"
            unit = stated_unit(item.attributes) or _unit(texts, name)
            channel: Channel = {"data": row, "name": own, "unit_str": unit, "axis": item.axis}
            rate = _stated_rate(() if time else around, own)
            if rate is not None:
                channel["fs"] = rate
            channels.append(channel)
    return with_time(channels)


def _unit(texts: Mapping[str, str], name: str) -> str | None:
    """Unit from a text next to an array, for its name or for its group."""
    folder, _, last = name.rpartition("/")
    for key in UNIT_NAMES:
        common = () if is_time(last) else (f"{folder}/{key}" if folder else key,)
        for candidate in (f"{name}_{key}", *common):
            if texts.get(candidate, "").strip():
                return texts[candidate].strip()
    return None


def _text(value: Any) -> str:
    found = np.asarray(value)
    item = found.reshape(-1)[0] if found.size == 1 else value
    return item.decode("utf-8", "replace") if isinstance(item, bytes) else str(item)


def _refuse_length(path: Path, ends: tuple[int, ...]) -> None:
    """Refuse a file that is longer than its own header says: what lies behind the surplus bytes would be read shifted."""
    size = path.stat().st_size
    if size not in ends:
        raise InputError(
            f"has {size} bytes, and its header says {ends[0]}: damaged, such as by a transfer in text mode; copy it again"
        )


def _refuse_length_of_hdf5(path: Path) -> None:
    """The same by the end of file that the superblock states, from the start of the file or of the HDF5 data in it."""
    with open(path, "rb") as opened:
        start, at = opened.read(1 << 16), 0
    while start[at : at + 8] != b"\x89HDF\r\n\x1a\n":
        at = 2 * at or 512
        if at >= len(start):
            return
    version, size = start[at + 8], start[at + (9 if start[at + 8] > 1 else 13)]
    first = at + {0: 24, 1: 28}.get(version, 12)
    end = int.from_bytes(start[first + 2 * size : first + 3 * size], "little")
    _refuse_length(path, (end, at + end))


def read_hdf5(path: Path, *_told: Any) -> list[Channel]:
    """Return the channels of an HDF5 or NetCDF file; packed numbers by the CF conventions."""
    with open(path, "rb") as opened:
        start = opened.read(4)
    if start[:3] == b"CDF":
        return _netcdf3(path, start[3])
    _refuse_length_of_hdf5(path)
    stored: dict[str, _Stored] = {}
    with open_hdf5(path) as file:
        inner, arrays = members_of(file)
        groups = {name: _stating(item.attrs) for name, item in {"": file, **inner}.items()}
        for name, item in arrays.items():
            number = item.dtype.kind in "iuf"
            kept = item.ndim <= 2 and (number or (item.dtype.kind in "SO" and item.size == 1))
            if not kept or (item.is_scale and not _is_axis(name, item.attrs)):
                continue
            attributes = dict(item.attrs)
            if number and item.fillvalue:
                attributes.setdefault("_FillValue", item.fillvalue)
            stored[name] = _Stored(np.squeeze(item[()]), attributes, _axis_of(item))
    return _channels(stored, groups)


def _netcdf3(path: Path, version: int) -> list[Channel]:
    """Channels of a NetCDF file of version 3, whose layout is not that of HDF5."""
    from scipy.io import netcdf_file

    if version not in (1, 2):
        raise InputError(
            "is a NetCDF file of 64-bit data (CDF-5), which is not read; convert it: nccopy -k nc4 old.nc new.nc"
        )
    with netcdf_file(path, "r", mmap=False) as file:
        stored = {
            name: _Stored(
                np.squeeze(np.array(item.data)),
                dict(item._attributes),
                item.dimensions[0] if item.dimensions[:1] != (name,) and item.dimensions else None,
            )
            for name, item in file.variables.items()
            if item.data.dtype.kind in "iuf" and (item.dimensions != (name,) or _is_axis(name, item._attributes))
        }
        return _channels(stored, {"": _stating(file._attributes)})


def _stating(attributes: Mapping[str, Any]) -> dict[str, Any]:
    """Attributes of a group without its unit, which need not be that of each array."""
    return {key: value for key, value in attributes.items() if key not in UNIT_NAMES}


def _is_axis(name: str, attributes: Mapping[str, Any]) -> bool:
    """Return whether a dimension scale contains times."""
    stated = stated_unit(attributes)
    try:
        return is_time(split_unit(name.rpartition("/")[2])[0]) or (stated != "" and seconds_in(name, stated) > 0.0)
    except InputError:
        return False


def _axis_of(item: Any) -> str | None:
    """Name of the dimension scale along the samples."""
    if not item.ndim or item.is_scale:
        return None
    scales = item.dims[int(np.argmax(item.shape))]
    return scales[0].name.lstrip("/") if len(scales) else None


def write_hdf5(path: Path, signal: xr.DataArray, samples: SignalSamples, _full_scale: float | None) -> None:
    """Write a signal to an HDF5 file."""
    import h5py

    with hdf5_stream(path) as stream, h5py.File(stream, "w") as file:
        columns = {"time": (samples.time, "s"), str(signal.name): (samples.values, signal.attrs["units"])}
        for name, (numbers, unit) in columns.items():
            file.create_dataset(name, data=numbers).attrs["units"] = unit


# A text table is a block of rows of numbers with the same count of cells, after any header.  Cells are separated by
# semicolons, tabs, commas or blanks; with all but commas a comma may be the decimal sign, and points between
# groups of three digits before it are left out.  Nothing is dropped: after the first row of numbers every line
# must be one.


def to_number(cell: str, decimal_comma: bool = False) -> float:
    """The number in a cell, a duration of MATLAB such as ``0.5 min`` in seconds; NaN if it holds none."""
    text = cell.strip().translate(_SIGNS)
    duration = _DURATION.fullmatch(text)
    if duration:
        return to_number(duration[1], decimal_comma) * _DURATIONS[duration[2]]
    if decimal_comma and "," in text:
        text = _with_point(text, ",")
    try:
        return float(_EXPONENT.sub(r"\1e\2", text)) if "_" not in text else math.nan
    except ValueError:
        return math.nan


def _with_point(text: str, sign: str) -> str:
    """A number whose decimal sign is *sign* as Python writes it; empty if it is none."""
    found = _GROUPED[sign].fullmatch(text)
    text = text.replace(found[1], "") if found else text
    return "" if sign == "," and "." in text else text.replace(",", ".") if sign == "," else text


def readings(text: str, decimal_comma: bool = False) -> tuple[float, ...]:
    """The numbers that a number of a header may be, none if it is no number.

    ``51,200`` may be 51200 or 51.2.  ``51.200`` may be 51200 only in a file of decimal commas: points between groups of
    digits are seldom, and decimals that end in zeros are not.
    """
    text = text.strip().translate(_SIGNS)
    signs = (".", ",") if "," in text or decimal_comma else (".",)
    if text.count(".") > 1:
        signs = (",",)
    numbers = (to_number(_with_point(text, sign)) for sign in signs)
    return tuple(dict.fromkeys(number for number in numbers if math.isfinite(number)))


def _cells(lines: list[str], separator: str | None) -> list[list[str]]:
    if separator is None:
        return [line.split() for line in lines]
    rows = csv.reader(lines, delimiter=separator, skipinitialspace=True, strict=True)
    return [[cell.strip() for cell in row] for row in rows]


@dataclass(frozen=True)
class _Dialect:
    separator: str | None
    decimal_comma: bool
    first: int  # index of the first row of numbers
    used: tuple[int, ...]  # cells of it that are no empty columns

    def row_of(self, cells: list[str]) -> list[str]:
        return [cells[i] if i < len(cells) else "" for i in self.used]


def _is_row(cells: list[str], used: tuple[int, ...], decimal_comma: bool) -> bool:
    numbers = (to_number(cells[i], decimal_comma) if i < len(cells) else math.nan for i in used)
    return bool(used) and all(map(math.isfinite, numbers))


def _dialects(lines: list[str]) -> list[_Dialect]:
    """Every way in which a table can be seen in the first lines."""
    found = []
    few = lines[:_LOOK]
    for separator, commas in ((";", (True, False)), ("\t", (False, True)), (",", (False,)), (None, (False, True))):
        try:
            cells = _cells(few, separator)
        except csv.Error:
            continue
        if len(cells) != len(few):
            continue
        for comma in commas:
            for k, row in enumerate(cells):
                used = tuple(i for i, cell in enumerate(row) if cell)
                following = cells[k : k + 3]
                if all(_is_row(one, used, comma) and sum(map(bool, one)) == len(used) for one in following):
                    one = _Dialect(separator, comma, k, used)
                    before = replace(one, first=k - 1)
                    # the first row may have more cells, such as the settings of an instrument
                    wide = k and separator and len(cells[k - 1]) > used[-1] + 1 and _is_row(cells[k - 1], used, comma)
                    found.append(before if wide and _heads(lines, before)[0] else one)
                    break
    return found


def _is_short(cells: list[list[str]]) -> bool:
    """Return whether the last number has fewer decimals than those above it, which all have equally many."""
    column = [re.search(r"[.,](\d*)$", row[-1].strip()) for row in cells[-_ABOVE:] if row]
    digits = {len(found[1]) for found in column[:-1] if found}
    last = column[-1]
    return len(digits) == 1 and len(column) >= _ABOVE and (last is None or len(last[1]) < digits.pop())


def _best(
    path: Path, lines: list[str], dialects: list[_Dialect], columns: int, above: Mapping[int, list[str]]
) -> tuple[_Dialect, tuple[str, ...] | None, set[int]]:
    """The dialect whose header fits its columns, the names of these, and the lines that they stand on.

    *above* are the comments before the first row of each; the last may name the columns.
    """
    seen = []
    for one in dialects:
        names, taken = _heads(lines, one)
        comments = above[one.first]
        if names is None and comments:
            following = lines[one.first : one.first + 3]
            names, _ = _heads([*comments, *following], replace(one, first=len(comments)))
            parts = [split_unit(name) for name in names or ()]
            stated = any(is_time(word) or (unit and _like_unit(unit)) for word, unit in parts)
            names = names if stated and not re.search("[=:]", "".join(names or ())) else None
        seen.append((one, names, taken))
    if columns:
        seen = [entry for entry in seen if len(entry[0].used) == columns] or seen
    named = [entry for entry in seen if entry[1] is not None]
    # the earliest table, then the most columns
    best = min(named or seen, key=lambda entry: (entry[0].first, -len(entry[0].used)))
    if named:
        return best
    same_start = [one for one, *_ in seen if one.first == best[0].first]
    rivals = [one for one in same_start if len(one.used) != len(best[0].used)]
    if rivals and not columns and best[0].separator == ",":
        raise InputError(
            f"{path}: without a header it is not clear whether commas part columns or decimals in "
            f"{lines[best[0].first]!r}; give columns (--columns), such as 'time [s],velocity [mm/s]'"
        )
    return best


def _heads(lines: list[str], dialect: _Dialect) -> tuple[tuple[str, ...] | None, set[int]]:
    """Names of the columns from the one or two lines before the table, units of the second in brackets."""
    above: list[tuple[int, list[str]]] = []
    count = len(dialect.used)
    for k in range(dialect.first - 1, max(dialect.first - 3, -1), -1):
        cells = _cells_of_names(lines[k], dialect)
        row = dialect.row_of(cells)
        if len([cell for cell in cells if cell]) < count or not all(row):
            rows = _cells(lines[dialect.first : dialect.first + 3], dialect.separator)
            row = _wider([cell for cell in cells if cell], [dialect.row_of(one) for one in rows])
        text = any(re.search(r"[^\W\d_]", cell) and not math.isfinite(to_number(cell)) for cell in row)
        if not text or (dialect.separator is None and len(cells) > count):
            break
        above.append((k, row))
    if len(above) < 2 or not all(_like_unit(cell) for cell in above[0][1]):
        return (tuple(above[0][1]), {above[0][0]}) if above else (None, set())
    joined = []
    for name, unit in zip(above[1][1], above[0][1], strict=True):
        word = unit.strip("[]() ")
        known = not name or split_unit(name)[1] is not None or word in ("", "-")
        joined.append(name if known else f"{name} [{word}]")
    return tuple(joined), {at for at, _ in above}


def _cells_of_names(line: str, dialect: _Dialect) -> list[str]:
    """Cells of a line that may name the columns; above blanks names may have commas between them, and units in brackets."""
    count = len(dialect.used)
    if dialect.separator is not None or count == 1:
        return [line.strip()] if dialect.separator is None else _cells([line], dialect.separator)[0]
    ways = [[cell.strip() for cell in line.split(mark)] for mark in ",;\t"]
    ways.append(re.sub(r"\s+(?=[\[(])", "", line).split())
    return next((cells for cells in ways if len(cells) == count), line.split())


def _wider(words: list[str], rows: list[list[str]]) -> list[str]:
    """Names of all columns where one is not named: ``""`` for an index in front, as pandas and R write it; else empty.

    Without an index the first name must be the time and fit the first column alone.
    """
    values = [[to_number(cell) for cell in row] for row in rows]
    if len(words) != len(rows[0]) - 1 or not words or len(rows) < 3:
        return []
    if any(math.isfinite(to_number(word)) or re.search("[=:]", word) for word in words):
        return []
    steps = [[after - before for before, after in zip(*pair, strict=True)] for pair in (values[:2], values[1:])]
    if values[0][0] in (0.0, 1.0) and steps[0][0] == steps[1][0] == 1.0:
        return ["", *words]
    rising = [min(one[k] for one in steps) > 0.0 for k in (0, 1)]
    return [*words, f"column {len(rows[0])}"] if is_time(split_unit(words[0])[0]) and rising == [True, False] else []


def _like_unit(cell: str) -> bool:
    word = cell.strip().strip("[]()").strip()
    try:
        si_unit("column", word)
    except InputError:
        return not word or word == "-" or word.lower() == "sequence"
    return True


def read_lvm(path: Path, *_told: Any) -> list[Channel]:
    """Channels of the first segment of an .lvm file.

    A file whose number of samples is not that of its header is read with a diagnostic.  Channels that the header
    names and that have no sample are left out.  Several segments need not join, so they are refused.
    """
    lines = [line.rstrip("\r") for line in decoded(path.read_bytes(), str(path)).split("\n")]
    if not lines[0].lower().startswith("labview measurement"):
        raise InputError("does not begin with 'LabVIEW Measurement', so it is no .lvm file")
    file_header, at = _header(lines, 0, None)
    separator = _SEPARATORS.get((file_header.get("separator") or ["Tab"])[0].lower(), "\t")
    decimal = file_header.get("decimal_separator", ["."])
    comma = decimal != ["."]
    if comma and separator == ",":
        raise InputError(
            "Separator and Decimal_Separator are commas, so that cells and decimals cannot be told apart: save it again "
            "with the separator Tab"
        )
    if decimal not in (["."], [","]):
        raise InputError(f"Decimal_Separator = {' '.join(decimal)!r}: must be a point or a comma")
    header, at = _header(lines, at, separator)
    if "samples" not in header or "delta_x" not in header:
        raise InputError("has no segment header with Samples and Delta_X")
    if any(_END == line.strip().strip(separator).lower() for line in lines[at:]):
        raise InputError("holds several segments; save one to a file")
    names = [cell.strip() for cell in lines[at].split(separator)]
    rows = [(k + 1, line.split(separator)) for k, line in enumerate(lines) if k > at and line.strip(" ")]
    count = int(to_number(header.get("channels", ["0"])[0], comma) or 0)
    columns = [k for k, name in enumerate(names) if name and name.lower() not in ("x_value", "comment")]
    if not columns or (count and len(columns) != count):
        raise InputError(f"line {at + 1}: names {len(columns)} channel(s), the header says {count}")
    units = header.get("y_unit_label", [])
    channels: list[Channel] = []
    for number, k in enumerate(columns):
        cells = [row[k].strip() if k < len(row) else "" for _, row in rows]
        while cells and not cells[-1]:  # of a channel that is shorter than others
            cells.pop()
        if not cells:
            continue
        step, start, samples = (
            to_number(_of(header.get(key) or ["0"], number), comma) for key in ("delta_x", "x0", "samples")
        )
        for key, good, wanted in (
            ("Delta_X", math.isfinite(step) and step > 0.0, "a positive number of seconds"),
            ("Samples", samples >= 1.0, "a whole number from 1"),
        ):
            if not good:
                raise InputError(f"{key} = {_of(header[key.lower()] or [''], number)!r}: must be {wanted}")
        clock: dict[str, Any] = {"fs": 1.0 / step, "time_offset": start if math.isfinite(start) else 0.0}
        told: list[Diagnostic] = []
        if len(cells) != samples:
            kind = KINDS_SIGNAL["cut" if len(cells) < samples else "appended"]
            promised, present = samples, float(len(cells))
            told = [kind.found(told=path.name, promised=promised, found=present)]
            tell([kind.found(told=str(path), promised=promised, found=present)])
            if names[0].lower() == "x_value" and rows[0][1][0].strip():
                clock = {"time": np.array([to_number(row[0], comma) for _, row in rows[: len(cells)]])}
        data = np.array([to_number(cell, comma) for cell in cells])
        bad = np.flatnonzero(~np.isfinite(data))
        if bad.size:
            raise InputError(f"line {rows[int(bad[0])][0]}, column {names[k]!r}: is not a finite number")
        unit = (units[number].strip() or None) if number < len(units) else None
        channels.append({"data": data, "name": names[k], "unit_str": unit, "diagnostics": told, **clock})
    return numbered(channels)


def _of(values: list[str], number: int) -> str:
    """The value of a channel, or the last where there are fewer."""
    return values[min(number, len(values) - 1)]


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


def read_matlab(path: Path, *_told: Any) -> list[Channel]:
    """Channels of a .mat file: vectors, columns of matrices, and those in structures.

    A scalar named like ``fs`` is the sampling rate, a vector named like ``time`` the time axis, a text
    ``<name>_units`` or ``units`` the unit.
    """
    with open(path, "rb") as file:
        start = file.read(512)
    newer = start[:8] == b"\x89HDF\r\n\x1a\n" or b"MATLAB 7.3" in start[:128]
    values = _version_73(path) if newer else read_version_5(path)
    channels = _channels({name: _Stored(value, {}) for name, value in values.items()}, {})
    if not channels:
        raise InputError("holds no vector or matrix of numbers (objects and cells are not read; save as numbers)")
    return channels


def _version_73(path: Path) -> dict[str, Any]:
    _refuse_length_of_hdf5(path)
    values: dict[str, Any] = {}
    with open_hdf5(path) as file:
        for name, item in members_of(file)[1].items():
            if item.dtype.kind not in "iuf" or name.startswith("#refs#") or item.attrs.get("MATLAB_empty", 0):
                continue
            array = np.asarray(item[()])
            letters = item.attrs.get("MATLAB_class", b"") == b"char"
            text = "".join(chr(int(code)) for code in array.ravel(order="F")) if letters else ""
            values[name] = np.array(text) if letters else np.squeeze(array.T)
    return values


def header_values(lines: Iterable[str]) -> dict[str, str]:
    """Keys and values of header lines such as ``Sample Rate: 12 kHz`` or ``Vertical Units,V``.

    Keys lose everything but letters and digits; the first of two of one name counts.
    """
    values: dict[str, str] = {}
    for line in lines:
        if len(line) > _LONGEST_LINE:
            continue
        found = re.match(r'\s*"?([^:=,;\t"]+?)"?\s*([:=,;\t])\s*(?:"([^"]*)"|(.*))', line)
        if found:
            # else a comma may be the decimal sign; one before three digits may part groups of them
            ends = r"[;\t]|(?<!\d),|,(?!\d{3}(?!\d|\.))" if found[2] == "," else r"[;\t]"
            value = re.split(ends, found[4])[0] if found[3] is None else found[3]
            values.setdefault(_key(found[1]), value.strip(' ,;\t"'))
    return values


def _stated_rate(
    levels: Iterable[tuple[str, Mapping[str, Any]]], where: str, decimal_comma: bool = False, known: float | None = None
) -> float | None:
    """The sampling rate [Hz] that the named values of some places state; None if none does.

    *known* [Hz] is the rate by other evidence, which decides between two readings of a number.
    """
    found = {
        f"{place}/{key}".lstrip("/"): rate
        for place, values in levels
        for key, value in values.items()
        if (rate := _rate_of(key, value, decimal_comma, known)) is not None
    }
    if found and max(found.values()) > 1.001 * min(found.values()):
        told = ", ".join(f"{key} {value:.9g} Hz" for key, value in found.items())
        raise InputError(f"{where} contradicts itself about the sampling rate ({told}): remove the wrong one")
    return next(iter(found.values()), None)


def _rate_of(name: str, value: Any, decimal_comma: bool = False, known: float | None = None) -> float | None:
    """Samples per second [Hz] that a named value states; None if it states none, or is 0 or no number."""
    word, suffix = (name, "") if len(name) > _LONGEST_NAME else split_unit(name)
    for key in (_key(name), _key(word)):
        of_name = max((one for one in _RATES + _STEPS if key.startswith(one)), key=len, default="")
        suffix = suffix or key[len(of_name) :]
        if of_name and (key == of_name or suffix in _PER_SECOND or unit_factor(name, suffix, "s")):
            break
    else:
        return None
    numbers, unit = _quantity(_text(value), decimal_comma)
    step = of_name in _STEPS
    unit = unit or ("" if suffix == "s" and not step else suffix) or ""
    factor = unit_factor(name, unit or "s", "s") if step else _PER_SECOND.get(unit.lower())
    if factor is None or not numbers or 0.0 in numbers:
        return None
    rates = [1.0 / (number * factor) if step else number * factor for number in numbers]
    near = [rate for rate in rates if known and abs(rate / known - 1.0) < 0.05] or rates
    if len(near) > 1:
        both = " or ".join(f"{number:.12g}" for number in numbers)
        raise InputError(
            f"{name} = {_text(value)!r}: the comma or point may part thousands or decimals, so that it is {both}; write "
            f"{both} into the file"
        )
    return positive(f"{name}: sampling rate", near[0], "Hz")


def header_unit(values: dict[str, str], *keys: str) -> str | None:
    """The unit that stands under one of *keys*, without a channel's name before it; None if none does."""
    words = (values.get(key, "").rpartition(":")[2].strip() for key in keys)
    return next((word for word in words if word), None)


def _quantity(text: str, decimal_comma: bool = False) -> tuple[tuple[float, ...], str]:
    """Readings and unit of ``"12 kHz"``, ``"CH1:2e-8"``, ``"51 200"`` or ``"0,5 ms"``."""
    found = re.fullmatch(
        r"(?:\w+:)?\s*([-+]?\.?[0-9][0-9.,' ]*(?:[eE][-+]?\d+)?)\s*\[?([^\]]*)\]?", text.strip().translate(_SIGNS)
    )
    return (readings(found[1], decimal_comma), found[2].strip()) if found else ((), "")


class Table(NamedTuple):
    """A text table: ``columns`` of cells by name, on the ``lines`` of the file; ``header`` are all others, and comments."""

    path: Path
    columns: dict[str, tuple[str, ...]]
    lines: list[int]
    header: list[str]
    decimal_comma: bool

    def numbers(self, name: str) -> NDArray[np.float64]:
        """Return a column as floats; refuse a cell that is no finite number, naming its line."""
        cells = self.columns[name]
        try:
            if self.decimal_comma:
                raise ValueError
            numbers = np.array(cells, dtype=np.float64)
        except ValueError:
            numbers = np.array([to_number(cell, self.decimal_comma) for cell in cells])
        bad = np.flatnonzero(~np.isfinite(numbers))
        if bad.size:
            where = f"{self.path}: line {self.lines[bad[0]]}, column {name!r}"
            raise InputError(f"{where}: {cells[bad[0]]!r} is not a finite number")
        return numbers


def read_table(path: Path, columns: str | None = None) -> Table:
    """Read a text table; *columns* are names and units, separated by commas, instead of those in the file."""
    given = tuple(name.strip() for name in columns.split(",")) if columns else ()
    text = decoded(path.read_bytes(), str(path))
    numbered = [(i, line.rstrip("\r")) for i, line in enumerate(text.split("\n"), 1) if line.strip()]
    marked = [(i, line.strip().lstrip("#%/!").strip()) for i, line in numbered if line.startswith(_COMMENT)]
    numbered = [(i, line) for i, line in numbered if not line.startswith(_COMMENT)]
    lines = [line for _, line in numbered]
    if not lines:
        raise InputError(f"{path}: holds no header and no row")
    dialects = _dialects(lines)
    if not dialects:
        if len(lines) == 1:
            raise InputError(f"{path}: holds a header and no row")
        stamp = _STAMP.search(lines[:_LOOK][-1][:_LONGEST_LINE])
        if stamp:
            raise InputError(
                f"{path}: its times are dates or clock times, such as {stamp[0]!r}, which are not read: write them in "
                "seconds, or leave them out and give sampling_frequency (--sampling-freq)"
            )
        raise InputError(
            f"{path}: no row of numbers in its first {min(len(lines), _LOOK)} lines; its columns may not be separated "
            "by semicolons, tabs, commas or blanks"
        )
    places = [0, *(i for i, _ in numbered)]
    above = {
        one.first: [note for i, note in marked if places[one.first] < i < places[one.first + 1]] for one in dialects
    }
    dialect, names, taken = _best(path, lines, dialects, len(given), above)
    used, comma, first = dialect.used, dialect.decimal_comma, dialect.first
    if used[0] > 0:  # rows beside cells of the header too, as oscilloscopes write them
        cells = _cells(lines[:first], dialect.separator)
        while first > 0 and _is_row(cells[first - 1], used, comma):
            first -= 1
    try:
        cells = _cells(lines[first:], dialect.separator)
    except csv.Error as error:
        raise InputError(f"{path}: is no table ({error})") from error
    if len(cells) != len(lines) - first:
        raise InputError(f"{path}: a quoted value runs over the end of a line")
    if not text.endswith("\n") and _is_short(cells):
        last = f"{path}: ends inside its last number, {cells[-1][-1].strip()!r}"
        tell([KINDS_SIGNAL["cut_in_number"].found(told=last)])
    beyond = " ".join(cell for cell in cells[0][used[-1] + 1 :] if cell)  # settings behind the first row
    heads = [line for k, line in enumerate(lines[: dialect.first]) if k not in taken]
    header = [beyond, *(note for _, note in marked), *heads]
    for k, row in enumerate(cells):
        stray = (k > 0 and any(row[used[-1] + 1 :])) or (dialect.separator is None and len(row) != len(used))
        if stray or len(row) <= used[-1]:
            count, told = (
                len([cell for cell in row if cell or not stray]),
                "the header names" if names else "the first has",
            )
            raise InputError(
                f"{path}: line {numbered[first + k][0]} has {count} value(s), {told} {len(used)} column(s)"
            )
    if not given and names is None:
        values = header_values(header)
        across, up = header_unit(values, "horizontalunits"), header_unit(values, "verticalunits")
        if len(used) != 2 or not across or not up:
            raise InputError(
                f"{path}: its first row, line {numbered[first][0]}, has no header above it that names its {len(used)} "
                "column(s); give columns (--columns), such as 'time [s],velocity [mm/s]'"
            )
        names = f"time [{across}]", f"{values.get('source', 'channel 1')} [{up}]"  # an oscilloscope's table
    names = given or names or ()
    if len(names) != len(used):
        raise InputError(f"{path}: columns (--columns) = {columns!r} names {len(names)}, the rows have {len(used)}")
    columns_of = list(zip(*(dialect.row_of(row) for row in cells), strict=True))
    if not names[0] and len(names) > 1 and (np.diff([to_number(cell) for cell in columns_of[0]]) == 1.0).all():
        names, columns_of = names[1:], columns_of[1:]  # the index of a data frame
    if "" in names or len(set(names)) < len(names):
        raise InputError(f"{path}: columns {list(names)}: each must have a name of its own")
    return Table(path, dict(zip(names, columns_of, strict=True)), [i for i, _ in numbered[first:]], header, comma)


def read_csv(path: Path, rate: float | None, names: str | None) -> list[Channel]:
    """Return the channels of a text table; see :func:`snapbeam.lab.signal_files.read_channels`."""
    table = read_table(path, names)
    columns = {name: split_unit(name) for name in table.columns}
    times = [
        name
        for name, (word, unit) in columns.items()
        if is_time(word)
        and (_key(word) not in ("xaxis", "xvalue") or si_unit(f"column {word!r}", unit or "s")[1] == "s")
    ]
    if not times:  # a row of units only, as "[ s ]"
        times = [name for name, (_, unit) in columns.items() if unit and unit_factor(name, unit, "s")]
    if len(times) > 1:
        raise InputError(f"{path}: columns {times}: only one may be the time")
    values = header_values(table.header)
    first, (word, unit) = next(iter(columns.items()))
    if not times and (unit == "Hz" or word.lower().startswith("freq")):
        raise InputError(
            f"{path}: its first column, {first!r}, is a frequency, so that this is a spectrum; export the time signal"
        )
    common: dict[str, Any] = {}
    known = rate
    if times:
        word, unit = columns[times[0]]
        duration = _DURATION.fullmatch(table.columns[times[0]][0])
        if duration and unit not in (None, "s"):
            raise InputError(f"{path}: column {times[0]!r} has times such as {duration[0]!r}: remove one of the units")
        common["time"] = table.numbers(times[0]) * seconds_in(f"{path}: column {word!r}", unit)
        if known is None and common["time"].size > 2:
            known = 1.0 / float(np.median(np.diff(common["time"])) or math.inf)
    commas = table.decimal_comma and any("," in cell for cells in table.columns.values() for cell in cells[:_ABOVE])
    rate = _stated_rate([("", values)], f"{path}: the header", commas, known)
    if times:
        if rate is not None:
            way_out = "correct the header, or name the times otherwise in columns (--columns), such as "
            agree(str(path), common["time"], rate, f"{way_out}'number [1],velocity [m/s]'")
    elif rate is not None:
        common["fs"] = rate
    upward = header_unit(values, "verticalunits", "yunit", "yunits", "unity")
    return [
        {"data": table.numbers(name), "name": word, "unit_str": unit or upward, **common}
        for name, (word, unit) in columns.items()
        if name not in times
    ]


def agree(name: str, time: NDArray[np.float64], rate: float, way_out: str) -> None:
    """Refuse times that contradict a stated sampling rate [Hz], or are not even."""
    if time.size < 3:
        return
    _, found = even_sampling(name, time)
    if abs(found / rate - 1.0) * time.size > 1.0 and abs(found / rate - 1.0) > 1e-3:
        raise InputError(f"{name}: the times are sampled at {found:.9g} Hz, the header says {rate:.9g} Hz; {way_out}")


def write_csv(path: Path, signal: xr.DataArray, samples: SignalSamples, _full_scale: float | None) -> None:
    """Write a signal as a table of time and value, 12 digits each."""
    with path.open("w", encoding="utf-8", newline="\n") as file:
        file.write(f"# sampling_frequency: {samples.sampling_frequency:.12g} Hz\n")
        file.write(f"time [s],{signal.name} [{signal.attrs['units']}]\n")
        np.savetxt(file, np.column_stack((samples.time, samples.values)), fmt="%.12g", delimiter=",")


def split_unit(column: str) -> tuple[str, str | None]:
    """Split ``"velocity [mm/s]"``, ``"velocity (mm/s)"`` or ``"velocity_mm_s"`` into name and unit.

    A name that is a unit itself, such as ``Volt``, is one too.
    """
    if len(column) > _LONGEST_NAME:
        return column, None
    found = re.fullmatch(r"\s*(.*?)\s*[\[(]\s*(.+?)\s*[\])]\s*", column)
    if found:
        return found[1] or column, found[2]
    for suffix, unit in _SUFFIX_UNITS.items():
        if column.lower().endswith(suffix) and len(column) > len(suffix):
            return column[: -len(suffix)], unit
    if column.strip().lower() in ("volt", "volts", "second", "seconds"):
        return column, column.strip()
    return column, None


def read_tdms(path: Path, *_told: Any) -> list[Channel]:
    """Return the channels of a TDMS file."""
    from nptdms import TdmsFile

    with open(path, "rb") as opened:  # 28 bytes lead into each segment, and say how many follow
        end, size = 0, path.stat().st_size
        while end < size and opened.seek(end) == end and opened.read(4) == b"TDSm":
            end += 28 + int.from_bytes(opened.read(16)[8:], "little")
    _refuse_length(path, (end, size) if end > size else (end,))  # nptdms says which segment is cut short
    file = TdmsFile.read(path)
    if file.file_status.incomplete_final_segment:
        raise InputError("the file is cut short: its last segment is incomplete")
    channels: list[Channel] = []
    for group in file.groups():
        for entry in group.channels():
            data = entry[:]
            if data.dtype.kind not in "iuf" or data.size == 0:
                continue
            unit = next((str(entry.properties[k]) for k in UNIT_NAMES if entry.properties.get(k)), None)
            channel: Channel = {"data": data, "name": f"{group.name}/{entry.name}", "unit_str": unit}
            levels = (("", entry), (group.name, group), ("file", file))
            rate = _stated_rate(((place, level.properties) for place, level in levels), channel["name"])
            if rate is not None:
                channel["fs"] = rate
                channel["time_offset"] = float(entry.properties.get("wf_start_offset", 0.0))
            channels.append(channel)
    return with_time(channels)


def write_tdms(path: Path, signal: xr.DataArray, samples: SignalSamples, _full_scale: float | None) -> None:
    """Write a signal to a TDMS file."""
    from nptdms import ChannelObject, TdmsWriter

    values, time, rate = samples
    properties = {"wf_increment": 1.0 / rate, "wf_start_offset": float(time[0]), "wf_samples": values.size}
    properties["unit_string"] = signal.attrs["units"]
    with TdmsWriter(str(path)) as writer:
        writer.write_segment([ChannelObject("snapbeam", str(signal.name), values, properties=properties)])


def read_uff(path: Path, *_told: Any) -> list[Channel]:
    """Return the channels of a universal file (dataset 58)."""
    channels: list[Channel] = []
    for name, entry in _records_58(path, (0, 1)):
        data = entry["data"]
        if np.iscomplexobj(data):
            raise InputError(f"{name}: complex numbers are no time series")
        factor = seconds_in(f"{name}: the abscissa", _first(entry.get("abscissa_axis_units_lab"), "s"))
        unit = _first(entry.get("ordinate_axis_units_lab"), "") or None
        channel: Channel = {"data": data, "name": name, "unit_str": unit}
        if entry["abscissa_spacing"] == 1:
            step = float(entry["abscissa_inc"]) * factor
            if not step > 0.0:
                raise InputError(f"{name}: abscissa increment of {step!r} s")
            channel["fs"] = _undo_rounding(step)
            channel["time_offset"] = float(entry["abscissa_min"]) * factor
        else:
            channel["time"] = np.asarray(entry["x"]) * factor
        channels.append(channel)
    if not channels:
        spectra = len(list(_records_58(path, tuple(SPECTRA))))
        way_out = f"; read its {spectra} spectra by lab.read_spectra" if spectra else ""
        raise InputError(f"holds no whole time response in a dataset 58{way_out}")
    return numbered(channels)


def _records_58(path: Path, functions: tuple[int, ...]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Name and entry of each dataset 58 of these kinds of function, with its numbers."""
    import pyuff

    content = path.read_bytes()
    # exponents as Fortran writes them, which pyuff does not read
    if _FORTRAN.search(content) and b"58b" not in content:
        with tempfile.TemporaryDirectory() as folder:
            copy = Path(folder) / path.name
            copy.write_bytes(_FORTRAN.sub(rb"\1E\2", content))
            yield from _records_58(copy, functions)
        return
    file = pyuff.UFF(str(path))
    kinds, bodies = file.get_set_types().tolist(), _bodies(content)
    count = 0
    for number, kind in enumerate(kinds):
        entry = file.read_sets(number, header_only=True) if kind == 58 else {}
        if entry.get("func_type") not in functions:
            continue
        count += 1
        name = _first(entry["id1"], f"channel {count}")
        if not entry["binary"]:
            if len(bodies) != kinds.count(58):
                raise InputError("mixes binary and ASCII datasets 58: write each kind to a file of its own")
            entry |= _numbers_58(name, bodies[kinds[:number].count(58)], entry)
        else:
            entry = file.read_sets(number)
        entry["data"] = np.asarray(entry["data"])
        if entry["data"].size != entry["num_pts"]:
            raise InputError(
                f"{name}: the header promises {entry['num_pts']} samples, the file has {entry['data'].size}"
            )
        yield name, entry


@contextmanager
def reading(source: Path) -> Iterator[None]:
    """Turn whatever a reading library trips over into a refusal that names the file; refuse one that is missing or empty."""
    if not source.is_file():
        raise InputError(f"{source}: no such file")
    if source.stat().st_size == 0:
        raise InputError(f"{source}: the file is empty")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            warnings.simplefilter("default", DiagnosticWarning)
            yield
    except InputError as error:
        raise InputError(error.args[0] if str(source) in str(error) else f"{source}: {error}") from error
    except ImportError as error:
        raise InputError(needs(f"{source}: reading {source.suffix} files", error.name, "lab")) from error
    except MemoryError as error:
        raise InputError(f"{source}: the header asks for more memory than there is") from error
    except Exception as error:
        reason = f"{type(error).__name__}: {error}"
        raise InputError(f"{source}: not a readable {source.suffix} file ({reason})") from error


def read_spectra(path: str | os.PathLike[str]) -> list[xr.DataArray]:
    """Read the frequency responses and spectra of a universal file (dataset 58).

    Parameters
    ----------
    path : path
        ``.uff`` or ``.unv``, ASCII or binary.

    Returns
    -------
    list of xarray.DataArray
        Over ``frequency`` [Hz], complex where the file is, in the units of the file, as ``"m/s/N"``.  The attribute
        ``function`` is the kind, such as "frequency response" or "coherence".

    Raises
    ------
    InputError
        If the file cannot be read or has none.

    Examples
    --------
    >>> import numpy as np
    >>> import snapbeam as sb
    >>> from snapbeam import lab
    >>> force = lab.make_signal(np.random.default_rng(0).standard_normal(20_000), "N", 2000.0, name="force")
    >>> motion = lab.make_signal(0.002 * force.values, "m", 2000.0, name="tip")
    >>> left_out = sb.write_table(lab.frequency_response(force, motion, resolution=5.0), "frf.uff")
    >>> response, coherence = lab.read_spectra("frf.uff")
    >>> print(f"{abs(response.sel(frequency=100.0).item()):.4f} {response.attrs['units']}")
    0.0020 m/N
    """
    from snapbeam.util.datasets import xr

    file = file_path("path", path)
    found = []
    with reading(file):
        for name, entry in _records_58(file, tuple(SPECTRA)):
            over = _first(entry.get("abscissa_axis_units_lab"), "Hz")
            factor, base = si_unit(f"abscissa of {name}", over)
            if base != "Hz":
                raise InputError(f"{name}: its abscissa is in {over!r}, not in Hz")
            count = entry["data"].size
            even = float(entry["abscissa_min"]) + float(entry["abscissa_inc"]) * np.arange(count)
            lines = factor * (even if entry["abscissa_spacing"] == 1 else np.asarray(entry["x"]))
            units = [_first(entry.get(f"{which}_axis_units_lab"), "").strip() for which in ("ordinate", "orddenom")]
            unit = "/".join(each for each in (units[0] or "1", units[1]) if each)
            axis = ("frequency", lines, {"units": "Hz", "long_name": "frequency"})
            words = SPECTRA[entry["func_type"]]
            attrs = {"units": unit, "long_name": words, "function": words, "source": file.name}
            found.append(xr.DataArray(entry["data"], {"frequency": axis}, ("frequency",), name, attrs))
        if not found:
            raise InputError("has no spectrum in a dataset 58")
    return found


def _bodies(content: bytes) -> list[list[str]]:
    """Lines of numbers of each dataset 58 of a file, without the header's eleven."""
    lines = content.decode("latin-1").splitlines()
    marks = [k for k, line in enumerate(lines) if line.strip() == "-1"]
    pairs = zip(marks[::2], marks[1::2], strict=False)
    return [lines[a + 13 : b] for a, b in pairs if lines[a + 1][:6].strip() == "58"]


def _numbers_58(name: str, body: list[str], entry: Mapping[str, Any]) -> dict[str, Any]:
    """``data`` and ``x`` of an ASCII dataset 58, whatever the width of its numbers, without zeros that fill its last line."""
    if entry["ord_data_type"] not in (2, 4, 5, 6):
        raise InputError(f"{name}: numbers of type {entry['ord_data_type']}: must be 2 or 4, complex 5 or 6")
    parts = 2 if entry["ord_data_type"] > 4 else 1
    rows = []
    for line in body:
        if _NUMBER.sub("", line).strip():
            raise InputError(f"{name}: {line.strip()[:60]!r} is no line of numbers")
        rows.append([float(word) for word in _NUMBER.findall(line)])
    values = np.array([number for row in rows for number in row])
    each = parts if entry["abscissa_spacing"] == 1 else parts + 1
    count = each * int(entry["num_pts"])
    if values.size > count and count > values.size - len(rows[-1]) and not values[count:].any():
        values = values[:count]
    data = values[each - 1 :: each]
    if parts == 2 and values.size % each == 0:
        data = values[each - 2 :: each] + 1j * data
    return {"data": data, "x": values[::each]}


def _undo_rounding(step: float) -> float:
    """The sampling rate [Hz] of a step stored with six digits: the whole number that rounds to it."""
    whole = round(1.0 / step)
    same = whole > 0 and float(f"{1.0 / whole:.5e}") == float(f"{step:.5e}")
    return float(whole) if same else 1.0 / step


def write_uff(path: Path, signal: xr.DataArray, samples: SignalSamples, _full_scale: float | None) -> None:
    """Write a signal to a universal file (dataset 58)."""
    write_universal(path, [universal_record(str(signal.name), signal.attrs["units"], samples.time, samples.values)])


def _first(text: Any, otherwise: str) -> str:
    word = str(text or "").strip()
    return otherwise if word.upper() in ("", "NONE") else word


def read_wav(path: Path, *_told: Any) -> list[Channel]:
    """Return the channels of a sound file."""
    from scipy.io import wavfile

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        rate, data = wavfile.read(path)  # 24 bits come as the upper ones of 32
    if any(word in str(item.message) for item in caught for word in ("EOF", "prematurely", "incomplete")):
        raise InputError("the sound file is cut short")
    if rate <= 0:
        raise InputError(f"sampling rate of {rate} Hz in the header")
    size, promised = path.stat().st_size, data.shape[0] * _bytes_of_a_frame(path)
    if size < promised:
        raise InputError(f"the header promises {promised} bytes of samples, the file has {size}")
    columns = data[:, None] if data.ndim == 1 else data
    kind, unit = str(data.dtype), None
    if kind in _INTEGER_SCALE:
        middle, scale = _INTEGER_SCALE[kind]
        columns, unit = (columns - middle) / scale, "FS"
    elif data.dtype.kind != "f":
        raise InputError(f"samples of type {kind} are not known")
    return [
        {"data": columns[:, i], "name": f"channel {i + 1}", "unit_str": unit, "fs": float(rate)}
        for i in range(columns.shape[1])
    ]


def _bytes_of_a_frame(path: Path) -> int:
    """Bytes of one sample of all channels, as the header says: 3 a channel for 24 bits."""
    with open(path, "rb") as file:
        head = file.read(4096)
    at = head.find(b"fmt ") + 20
    return int.from_bytes(head[at : at + 2], "big" if head.startswith(b"RIFX") else "little")


def write_wav(path: Path, signal: xr.DataArray, samples: SignalSamples, full_scale: float | None) -> None:
    """Write a signal to a sound file."""
    from scipy.io import wavfile

    values, _, rate = samples
    scale = positive("full_scale", full_scale, signal.attrs["units"])
    if abs(rate - round(rate)) > 1e-6 * rate:
        raise InputError(f"sampling rate of {rate:.9g} Hz: a WAV file holds whole numbers of hertz only")
    if np.abs(values).max() >= scale:
        raise InputError(f"full_scale = {scale:g}: must exceed the largest value, {np.abs(values).max():g}")
    wavfile.write(path, round(rate), np.round(values / scale * 2.0**31).astype(np.int32))


READERS: dict[str, Callable[[Path, float | None, str | None], list[Channel]]] = {
    **dict.fromkeys((".csv", ".txt", ".asc", ".dat", ".tsv"), read_csv), ".lvm": read_lvm, ".wav": read_wav,
    ".uff": read_uff, ".unv": read_uff, ".tdms": read_tdms, ".mat": read_matlab,
    **dict.fromkeys((".h5", ".hdf5", ".nc"), read_hdf5), ".npz": read_numpy, ".npy": read_numpy,
}  # fmt: skip
WRITERS: dict[str, Callable[[Path, Any, SignalSamples, float | None], None]] = {
    ".csv": write_csv,
    ".wav": write_wav,
    ".uff": write_uff,
    ".tdms": write_tdms,
    ".h5": write_hdf5,
    ".npz": write_npz,
}
