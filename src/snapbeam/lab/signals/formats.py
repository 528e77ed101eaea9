"""The kinds of files a signal can live in: a reader and a writer for each, by suffix.

Readers return SEP 5 dictionaries in the units of the file; libraries for single formats are imported on use.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from snapbeam.core.validate import InputError, positive
from snapbeam.lab.signals.signal import check_signal, si_unit
from snapbeam.lab.signals.tables import read_csv, write_csv

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["READERS", "WRITERS", "Channel"]

Channel = dict[str, Any]

_RATE_NAMES = ("sampling_freq", "sampling_frequency", "fs", "sample_rate", "wf_samplerate")
_UNIT_NAMES = ("units", "unit", "unit_str", "unit_string", "NI_UnitDescription")
_UFF_UNITS = {8: "m", 11: "m/s", 12: "m/s^2", 13: "N"}
_UFF_TYPES = {unit: code for code, unit in _UFF_UNITS.items()}
_INTEGER_SCALE = {"int16": (0.0, 2.0**15), "int32": (0.0, 2.0**31), "uint8": (128.0, 128.0)}


def _read_wav(path: Path, _rate: float | None) -> list[Channel]:
    from scipy.io import wavfile

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        rate, data = wavfile.read(path)
    if any(word in str(item.message) for item in caught for word in ("EOF", "prematurely", "incomplete")):
        raise InputError("the sound file is cut short")
    if rate <= 0:
        raise InputError(f"sampling rate of {rate} Hz in the header")
    size = path.stat().st_size
    if size < data.nbytes:
        raise InputError(f"the header promises {data.nbytes} bytes of samples, the file has {size}")
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


def _write_wav(path: Path, signal: xr.DataArray, full_scale: float | None) -> None:
    from scipy.io import wavfile

    values, _, rate = check_signal(signal)
    scale = positive("full_scale", full_scale, signal.attrs["units"])
    if abs(rate - round(rate)) > 1e-6 * rate:
        raise InputError(f"sampling rate of {rate:.9g} Hz: a WAV file holds whole numbers of hertz only")
    if np.abs(values).max() >= scale:
        raise InputError(f"full_scale = {scale:g}: must exceed the largest value, {np.abs(values).max():g}")
    wavfile.write(path, round(rate), np.round(values / scale * 2.0**31).astype(np.int32))


def _read_uff(path: Path, _rate: float | None) -> list[Channel]:
    import pyuff

    sets = pyuff.UFF(str(path)).read_sets()
    channels: list[Channel] = []
    for entry in sets if isinstance(sets, list) else [sets]:
        if entry.get("type") != 58 or entry.get("func_type") not in (0, 1):
            continue
        data = np.asarray(entry["data"])
        name = _first(entry["id1"], f"channel {len(channels) + 1}")
        if data.size != entry["num_pts"]:
            raise InputError(
                f"{name}: the header promises {entry['num_pts']} samples, the file has {data.size}"
            )
        if np.iscomplexobj(data):
            raise InputError(f"{name}: complex numbers are no time series")
        label = _first(entry.get("abscissa_axis_units_lab"), "s")
        factor, base = si_unit(f"{name}: abscissa", label)
        if base != "s":
            raise InputError(f"{name}: the abscissa is in {label!r}, not in seconds")
        channel: Channel = {
            "data": data,
            "name": name,
            "unit_str": _first(entry.get("ordinate_axis_units_lab"), "") or None,
        }
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
        raise InputError("holds no whole time response in a dataset 58")
    return _unique(channels)


def _undo_rounding(step: float) -> float:
    """The sampling rate [Hz] of a step stored with six digits: the whole number that rounds to it."""
    whole = round(1.0 / step)
    same = whole > 0 and float(f"{1.0 / whole:.5e}") == float(f"{step:.5e}")
    return float(whole) if same else 1.0 / step


def _write_uff(path: Path, signal: xr.DataArray, _full_scale: float | None) -> None:
    import pyuff

    values, time, rate = check_signal(signal)
    unit = signal.attrs["units"]
    entry = pyuff.prepare_58(
        binary=1,
        id1=str(signal.name)[:80],
        func_type=1,
        rsp_node=1,
        rsp_dir=3,
        ref_node=0,
        ref_dir=0,
        data=values,
        x=time,
        num_pts=values.size,
        abscissa_spacing=1,
        abscissa_min=float(time[0]),
        abscissa_inc=1.0 / rate,
        abscissa_spec_data_type=17,
        abscissa_axis_units_lab="s",
        ordinate_spec_data_type=_UFF_TYPES.get(unit, 0),
        ordinate_axis_units_lab=unit,
        orddenom_spec_data_type=0,
        z_axis_spec_data_type=0,
        return_full_dict=False,
    )
    entry["n_bytes"] = values.nbytes
    path.unlink(missing_ok=True)
    pyuff.UFF(str(path)).write_sets([entry], mode="add")


def _read_tdms(path: Path, rate: float | None) -> list[Channel]:
    from nptdms import TdmsFile

    file = TdmsFile.read(path)
    if file.file_status.incomplete_final_segment:
        raise InputError("the file is cut short: its last segment is incomplete")
    channels: list[Channel] = []
    for group in file.groups():
        for entry in group.channels():
            data = entry[:]
            if data.dtype.kind not in "iuf" or data.size == 0:
                continue
            unit = next((str(entry.properties[k]) for k in _UNIT_NAMES if entry.properties.get(k)), None)
            channel: Channel = {"data": data, "name": f"{group.name}/{entry.name}", "unit_str": unit}
            step = entry.properties.get("wf_increment")
            if step is not None:
                channel["fs"] = 1.0 / positive(f"{channel['name']}: wf_increment", step, "s")
                channel["time_offset"] = float(entry.properties.get("wf_start_offset", 0.0))
            channels.append(channel)
    return _with_time(channels, rate)


def _write_tdms(path: Path, signal: xr.DataArray, _full_scale: float | None) -> None:
    from nptdms import ChannelObject, TdmsWriter

    values, time, rate = check_signal(signal)
    properties = {
        "wf_increment": 1.0 / rate,
        "wf_start_offset": float(time[0]),
        "wf_samples": values.size,
        "unit_string": signal.attrs["units"],
    }
    with TdmsWriter(str(path)) as writer:
        writer.write_segment([ChannelObject("snapbeam", str(signal.name), values, properties=properties)])


def _read_hdf5(path: Path, rate: float | None) -> list[Channel]:
    import h5py

    channels: list[Channel] = []
    with h5py.File(path, "r") as file:

        def visit(name: str, item: Any) -> None:
            if not isinstance(item, h5py.Dataset) or item.ndim != 1 or item.dtype.kind not in "iuf":
                return
            levels = [item.attrs, item.parent.attrs, file.attrs]
            stated = next((item.attrs[key] for key in _UNIT_NAMES if key in item.attrs), None)
            rates = [level[key] for level in levels for key in _RATE_NAMES if key in level]
            unit = None if stated is None else _text(stated)
            channel: Channel = {"data": item[()], "name": name, "unit_str": unit}
            if rates:
                channel["fs"] = positive(f"{name}: sampling rate", np.asarray(rates[0]).item(), "Hz")
            channels.append(channel)

        file.visititems(visit)
    return _with_time(channels, rate)


def _write_hdf5(path: Path, signal: xr.DataArray, _full_scale: float | None) -> None:
    import h5py

    values, time, _ = check_signal(signal)
    with h5py.File(path, "w") as file:
        axis = file.create_dataset("time", data=time)
        axis.attrs["units"] = "s"
        data = file.create_dataset(str(signal.name), data=values)
        data.attrs["units"] = signal.attrs["units"]


def _read_numpy(path: Path, rate: float | None) -> list[Channel]:
    loaded = np.load(path, allow_pickle=False)
    if isinstance(loaded, np.ndarray):
        if loaded.ndim != 1 or loaded.dtype.kind not in "iuf":
            raise InputError(
                f"array of {loaded.dtype} and shape {loaded.shape}: must be one channel of numbers"
            )
        return [{"data": loaded, "name": path.stem, "unit_str": None}]
    with loaded:
        arrays = {name: loaded[name] for name in loaded.files}
    scalars = {name: value.item() for name, value in arrays.items() if value.ndim == 0}
    stated = next((scalars[name] for name in _RATE_NAMES if name in scalars), None)
    channels: list[Channel] = []
    for name, data in arrays.items():
        if data.ndim != 1 or data.dtype.kind not in "iuf":
            continue
        units = (scalars.get(f"{name}_{key}", scalars.get(key)) for key in _UNIT_NAMES)
        unit = next((str(value) for value in units if value), None)
        channel: Channel = {"data": data, "name": name, "unit_str": unit}
        if stated is not None:
            channel["fs"] = positive("sampling_freq", stated, "Hz")
        channels.append(channel)
    return _with_time(channels, rate)


def _write_npz(path: Path, signal: xr.DataArray, _full_scale: float | None) -> None:
    values, time, _ = check_signal(signal)
    name = str(signal.name)
    arrays: dict[str, Any] = {name: values, "time": time}
    arrays |= {f"{name}_units": signal.attrs["units"], "time_units": "s"}
    np.savez(path, **arrays)


def _with_time(channels: list[Channel], rate: float | None) -> list[Channel]:
    """Take the time axes out of *channels* and give each to the channels of its group and length."""
    axes: dict[str, Any] = {}
    for channel in channels:
        folder, _, last = channel["name"].rpartition("/")
        if last.lower() in ("time", "t"):
            factor, base = si_unit(channel["name"], channel["unit_str"] or "s")
            if base != "s":
                raise InputError(f"{channel['name']} is in {channel['unit_str']!r}, not in seconds")
            axes[folder] = np.asarray(channel["data"], dtype=np.float64) * factor
    signals = [c for c in channels if c["name"].rpartition("/")[2].lower() not in ("time", "t")]
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


def _unique(channels: list[Channel]) -> list[Channel]:
    seen: dict[str, int] = {}
    for channel in channels:
        name = channel["name"]
        seen[name] = seen.get(name, 0) + 1
        if seen[name] > 1:
            channel["name"] = f"{name} ({seen[name]})"
    return channels


def _first(text: Any, otherwise: str) -> str:
    word = str(text or "").strip()
    return otherwise if word.upper() in ("", "NONE") else word


def _text(value: Any) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)


READERS: dict[str, Callable[[Path, float | None], list[Channel]]] = {
    ".csv": read_csv,
    ".txt": read_csv,
    ".wav": _read_wav,
    ".uff": _read_uff,
    ".unv": _read_uff,
    ".tdms": _read_tdms,
    ".h5": _read_hdf5,
    ".hdf5": _read_hdf5,
    ".nc": _read_hdf5,
    ".npz": _read_numpy,
    ".npy": _read_numpy,
}
WRITERS: dict[str, Callable[[Path, Any, float | None], None]] = {
    ".csv": write_csv,
    ".wav": _write_wav,
    ".uff": _write_uff,
    ".tdms": _write_tdms,
    ".h5": _write_hdf5,
    ".npz": _write_npz,
}
