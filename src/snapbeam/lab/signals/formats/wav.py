"""Sound files: whole numbers are fractions of full scale, floating point numbers what the caller says."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from snapbeam.core.validate import InputError, positive
from snapbeam.lab.signals.formats.channel import Channel, Told
from snapbeam.lab.signals.signal import check_signal

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["read_wav", "write_wav"]

_INTEGER_SCALE = {"int16": (0.0, 2.0**15), "int32": (0.0, 2.0**31), "uint8": (128.0, 128.0)}


def read_wav(path: Path, _told: Told) -> list[Channel]:
    from scipy.io import wavfile

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        rate, data = wavfile.read(path)  # 24 bits come as the upper ones of 32
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


def write_wav(path: Path, signal: xr.DataArray, full_scale: float | None) -> None:
    from scipy.io import wavfile

    values, _, rate = check_signal(signal)
    scale = positive("full_scale", full_scale, signal.attrs["units"])
    if abs(rate - round(rate)) > 1e-6 * rate:
        raise InputError(f"sampling rate of {rate:.9g} Hz: a WAV file holds whole numbers of hertz only")
    if np.abs(values).max() >= scale:
        raise InputError(f"full_scale = {scale:g}: must exceed the largest value, {np.abs(values).max():g}")
    wavfile.write(path, round(rate), np.round(values / scale * 2.0**31).astype(np.int32))
