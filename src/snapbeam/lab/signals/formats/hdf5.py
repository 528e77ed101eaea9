"""HDF5 files: one-dimensional datasets, units and rates in attributes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from snapbeam.core.netcdf import hdf5_stream
from snapbeam.core.validate import InputError, positive
from snapbeam.lab.signals.formats.channel import RATE_NAMES, UNIT_NAMES, Channel, Told, with_time
from snapbeam.lab.signals.signal import check_signal

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["read_hdf5", "write_hdf5"]


def read_hdf5(path: Path, _told: Told) -> list[Channel]:
    import h5py

    channels: list[Channel] = []
    with h5py.File(path, "r") as file:

        def visit(name: str, item: Any) -> None:
            if not isinstance(item, h5py.Dataset) or item.ndim != 1 or item.dtype.kind not in "iuf":
                return
            if item.external or item.is_virtual:
                raise InputError(
                    f"path = {str(path)!r}: {name!r} has its numbers in another file: copy them into this one"
                )
            levels = [item.attrs, item.parent.attrs, file.attrs]
            stated = next((item.attrs[key] for key in UNIT_NAMES if key in item.attrs), None)
            rates = [level[key] for level in levels for key in RATE_NAMES if key in level]
            unit = None if stated is None else _text(stated)
            channel: Channel = {"data": item[()], "name": name, "unit_str": unit}
            if rates:
                channel["fs"] = positive(f"{name}: sampling rate", np.asarray(rates[0]).item(), "Hz")
            channels.append(channel)

        file.visititems(visit)
    return with_time(channels)


def write_hdf5(path: Path, signal: xr.DataArray, _full_scale: float | None) -> None:
    import h5py

    values, time, _ = check_signal(signal)
    with hdf5_stream(path) as stream, h5py.File(stream, "w") as file:
        axis = file.create_dataset("time", data=time)
        axis.attrs["units"] = "s"
        data = file.create_dataset(str(signal.name), data=values)
        data.attrs["units"] = signal.attrs["units"]


def _text(value: Any) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)
