"""NumPy's files: .npy with one channel, .npz with several, their units and their rate."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from snapbeam.core.validate import InputError, positive
from snapbeam.lab.signals.formats.channel import RATE_NAMES, UNIT_NAMES, Channel, Told, with_time
from snapbeam.lab.signals.signal import check_signal

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["read_numpy", "write_npz"]


def read_numpy(path: Path, _told: Told) -> list[Channel]:
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
    stated = next((scalars[name] for name in RATE_NAMES if name in scalars), None)
    channels: list[Channel] = []
    for name, data in arrays.items():
        if data.ndim != 1 or data.dtype.kind not in "iuf":
            continue
        units = (scalars.get(f"{name}_{key}", scalars.get(key)) for key in UNIT_NAMES)
        unit = next((str(value) for value in units if value), None)
        channel: Channel = {"data": data, "name": name, "unit_str": unit}
        if stated is not None:
            channel["fs"] = positive("sampling_frequency", stated, "Hz")
        channels.append(channel)
    return with_time(channels)


def write_npz(path: Path, signal: xr.DataArray, _full_scale: float | None) -> None:
    values, time, _ = check_signal(signal)
    name = str(signal.name)
    arrays: dict[str, Any] = {name: values, "time": time}
    arrays |= {f"{name}_units": signal.attrs["units"], "time_units": "s"}
    np.savez(path, **arrays)
