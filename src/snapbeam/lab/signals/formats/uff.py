"""Universal files, dataset 58, ASCII or binary."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from snapbeam.core.validate import InputError
from snapbeam.lab.signals.formats.channel import Channel, Told, numbered
from snapbeam.lab.signals.signal import check_signal
from snapbeam.lab.signals.units import si_unit

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["read_uff", "write_uff"]

_UFF_UNITS = {8: "m", 11: "m/s", 12: "m/s^2", 13: "N"}
_UFF_TYPES = {unit: code for code, unit in _UFF_UNITS.items()}


def read_uff(path: Path, _told: Told) -> list[Channel]:
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
    return numbered(channels)


def _undo_rounding(step: float) -> float:
    """The sampling rate [Hz] of a step stored with six digits: the whole number that rounds to it."""
    whole = round(1.0 / step)
    same = whole > 0 and float(f"{1.0 / whole:.5e}") == float(f"{step:.5e}")
    return float(whole) if same else 1.0 / step


def write_uff(path: Path, signal: xr.DataArray, _full_scale: float | None) -> None:
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


def _first(text: Any, otherwise: str) -> str:
    word = str(text or "").strip()
    return otherwise if word.upper() in ("", "NONE") else word
