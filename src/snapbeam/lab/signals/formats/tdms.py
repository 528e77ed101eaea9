"""LabVIEW's TDMS files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from snapbeam.core.validate import InputError, positive
from snapbeam.lab.signals.formats.channel import UNIT_NAMES, Channel, Told, with_time
from snapbeam.lab.signals.signal import check_signal

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["read_tdms", "write_tdms"]


def read_tdms(path: Path, _told: Told) -> list[Channel]:
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
            unit = next((str(entry.properties[k]) for k in UNIT_NAMES if entry.properties.get(k)), None)
            channel: Channel = {"data": data, "name": f"{group.name}/{entry.name}", "unit_str": unit}
            step = entry.properties.get("wf_increment")
            if step is not None:
                channel["fs"] = 1.0 / positive(f"{channel['name']}: wf_increment", step, "s")
                channel["time_offset"] = float(entry.properties.get("wf_start_offset", 0.0))
            channels.append(channel)
    return with_time(channels)


def write_tdms(path: Path, signal: xr.DataArray, _full_scale: float | None) -> None:
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
