"""Files of measured time series, read into signals and written back.

Units are stated, by the file or by the caller, or the file is refused; a file and a caller that
contradict each other are refused too.  Whatever a reading library trips over comes out as an
:class:`~snapbeam.InputError` that names the file.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from snapbeam.lab.signal_formats import READERS, WRITERS, Channel, agree, read_table, reading, split_unit
from snapbeam.lab.signals import check_signal, make_signal, parse_sensitivity, si_unit
from snapbeam.util.diagnostics import to_json
from snapbeam.util.files import atomic_path, check_writable
from snapbeam.util.validation import InputError, file_path, positive, shown

if TYPE_CHECKING:
    import xarray as xr


def read_channels(
    path: str | os.PathLike[str], sampling_frequency: float | None = None, columns: str | None = None
) -> list[Channel]:
    """Return every channel of a file as a dictionary, in the units of the file.

    Parameters
    ----------
    path : path
        ``.csv``/``.txt`` (a header names the columns, units in brackets; a column ``time`` or a comment
        ``# sampling_frequency: 12000 Hz``), ``.wav``, ``.uff``/``.unv`` (dataset 58, ASCII or binary), ``.tdms``,
        ``.h5``/``.hdf5``/``.nc``, ``.npz``/``.npy``.
    sampling_frequency : float, optional
        Sampling frequency [Hz] if the file has none.

    Returns
    -------
    list of dict
        Keys ``data``, ``name``, ``unit_str``, and ``fs`` [Hz] or ``time`` [s].  ``unit_str`` is None where the
        file states no unit.  ``diagnostics`` lists contradictions with the header.

    Examples
    --------
    >>> from snapbeam import lab
    >>> velocity = lab.render_vibrometer(100.0, 7e-3, duration=0.5)  # 100 Hz, 7 mm/s
    >>> path = lab.write_signal("velocity.csv", velocity)
    >>> len(lab.read_channels(path))
    1
    """
    source = file_path("path", path)
    reader = READERS.get(source.suffix.lower())
    if reader is None:
        raise InputError(f"{source}: unknown kind of file; a signal is one of {', '.join(sorted(READERS))}")
    rate = None if sampling_frequency is None else positive("sampling_frequency", sampling_frequency, "Hz")
    with reading(source):
        channels = reader(source, rate, columns)
        if not channels:
            raise InputError("holds no channel of numbers")
    for channel in channels:
        told = channel.get("fs")
        if rate is not None and told is not None and abs(told / rate - 1.0) > 1e-5:
            raise InputError(
                f"{source}: {channel['name']} is sampled at {told:.9g} Hz but sampling_frequency = {rate:g} was given"
            )
        if rate is not None and "time" in channel:
            way_out = "leave out sampling_frequency (--sampling-freq)"
            agree(f"{source}: {channel['name']}", channel["time"], rate, way_out)
        if told is None and "time" not in channel:
            if rate is None:
                raise InputError(
                    f"{source}: {channel['name']} has no sampling rate; state sampling_frequency (--sampling-freq) in Hz"
                )
            channel["fs"] = rate
    return channels


def read_signal(
    path: str | os.PathLike[str],
    channel: str | int | None = None,
    *,
    units: str | None = None,
    sensitivity: str | None = None,
    sampling_frequency: float | None = None,
    columns: str | None = None,
) -> xr.DataArray:
    """Read one channel of a file as a signal in SI.

    Parameters
    ----------
    path : path
        See :func:`read_channels`.
    channel : str or int, optional
        Name or number from 0; needed if there are several.
    units : str, optional
        Unit of the values if the file has none, such as ``"mm/s"``.
    sensitivity : str, optional
        Sensitivity per volt or per full scale, such as ``"125 mm/s/V"`` or ``"0.5 m/s/FS"``, for channels in volts and
        sound files of integers.
    sampling_frequency : float, optional
        Sampling frequency [Hz] if the file has none.

    Returns
    -------
    xarray.DataArray
        One dimension ``time`` [s]; attributes ``units``, ``long_name`` and ``source``.

    Raises
    ------
    InputError
        Naming file and field: a missing or contradicting unit, an unknown channel, NaN, times that do not increase or
        have gaps, a truncated file.

    Examples
    --------
    >>> from snapbeam import lab
    >>> velocity = lab.render_vibrometer(100.0, 7e-3, duration=0.5)  # 100 Hz, 7 mm/s
    >>> path = lab.write_signal("velocity.csv", velocity)
    >>> lab.read_signal(path).attrs["units"]
    'm/s'
    """
    channels = read_channels(path, sampling_frequency, columns)
    names = [entry["name"] for entry in channels]
    listing = ", ".join(repr(name) for name in names)
    if channel is None:
        if len(channels) > 1:
            raise InputError(f"{path}: holds the channels {listing}; choose one with channel (--channel)")
        entry = channels[0]
    elif isinstance(channel, int) and not isinstance(channel, bool):
        if not 0 <= channel < len(channels):
            raise InputError(f"{path}: channel = {channel}: must be 0 to {len(channels) - 1} ({listing})")
        entry = channels[channel]
    elif channel in names:
        entry = channels[names.index(channel)]
    else:
        raise InputError(f"{path}: channel = {channel!r}: the file holds {listing}")
    try:
        return _to_signal(entry, units, sensitivity, Path(path).name)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def read_columns(
    path: str | os.PathLike[str], names: Sequence[str] | None, units: Sequence[str], *, are_stated: bool = False
) -> list[tuple[list[float], str]]:
    """Return columns of a text table whose header names them, each with its unit.

    The table is as for :func:`read_channels`, without the need of a time.  *names* are those of the columns, with or
    without units, the first ones if left out; *units* those where the header states none.  With *are_stated* a header
    that states another unit of the last column is refused.
    """
    source = Path(path)
    if not source.is_file():
        raise InputError(f"{source}: no such file")
    table = read_table(source)
    known = {split_unit(full)[0]: full for full in table.columns} | {full: full for full in table.columns}
    if names is not None and (isinstance(names, str) or len(names) != len(units)):
        raise InputError(f"columns = {shown(names)}: must be {len(units)} names")
    wanted = list(table.columns)[: len(units)] if names is None else list(names)
    missing = [name for name in wanted if name not in known]
    if missing or len(wanted) < len(units):
        listing = ", ".join(map(repr, table.columns))
        raise InputError(f"{source}: columns = {shown(missing or wanted)}: must be {len(units)} of {listing}")
    found = []
    for name, unit in zip(wanted, units, strict=True):
        own = split_unit(known[name])[1] or unit
        if are_stated and name == wanted[-1] and own != unit:
            raise InputError(f"{source}: {name} is in {own!r} but unit = {unit!r} was given")
        found.append((table.numbers(known[name]).tolist(), own))
    return found


def _to_signal(entry: Channel, units: str | None, sensitivity: str | None, source: str) -> xr.DataArray:
    name, stated = entry["name"], entry["unit_str"] or None
    if stated and units and si_unit(name, stated) != si_unit(name, units):
        raise InputError(f"{name} is in {stated!r} but units = {units!r} was given")
    unit = stated or units
    if unit is None and sensitivity is None:
        raise InputError(
            f"{name} has no stated unit; state units (--units), such as 'mm/s', or sensitivity (--sensitivity)"
        )
    per = ""
    if sensitivity is not None:
        scale, target, per = parse_sensitivity("sensitivity", sensitivity)
    factor, base = si_unit(name, unit or per)
    if sensitivity is not None:
        if per != base:
            raise InputError(f"{name} is in {unit!r} but sensitivity = {sensitivity!r} is per {per}")
        factor, base = factor * scale, target
    elif base == "FS":
        raise InputError(f"{name} is a fraction of full scale; state sensitivity (--sensitivity), such as '0.5 m/s/FS'")
    data = np.asarray(entry["data"], dtype=np.float64)
    bad = np.flatnonzero(~np.isfinite(data))
    if bad.size:
        raise InputError(
            f"{name}, sample {bad[0]}: {data[bad[0]]:g} is not a finite number ({bad.size} such, fill values "
            "included): cut the signal there"
        )
    kwargs: dict[str, Any] = {"time": entry.get("time")}
    if "time" not in entry:
        kwargs = {"sampling_frequency": entry["fs"], "start": entry.get("time_offset", 0.0)}
    attrs = {"source": source}
    if entry.get("diagnostics"):
        attrs["diagnostics"] = to_json(entry["diagnostics"])
    signal = make_signal(data * factor, base, name=name, attrs=attrs, **kwargs)
    check_signal(signal, name=name)
    return signal


def write_signal(path: str | os.PathLike[str], signal: xr.DataArray, *, full_scale: float | None = None) -> Path:
    """Write a signal to a CSV, WAV, UFF-58 (binary), TDMS, HDF5 or NumPy ``.npz`` file, whole or not at all.

    Parameters
    ----------
    path : path
        The suffix chooses the kind.
    signal : xarray.DataArray
        See :mod:`snapbeam.lab.signals`.
    full_scale : float, optional
        For WAV, full scale in the unit of the signal; 32-bit integers are written.

    Raises
    ------
    InputError
        If the path cannot be written, or a WAV would clip or needs a rate that is no whole number of hertz.

    Examples
    --------
    >>> from snapbeam import lab
    >>> velocity = lab.render_vibrometer(100.0, 7e-3, duration=0.5)  # 100 Hz, 7 mm/s
    >>> lab.write_signal("velocity.wav", velocity, full_scale=0.1).name
    'velocity.wav'
    """
    target = check_writable(path, "path", tuple(WRITERS))
    samples = check_signal(signal)
    if (full_scale is not None) != (target.suffix.lower() == ".wav"):
        raise InputError("full_scale: must be stated for a WAV file, and for no other")
    with atomic_path(target) as temporary:
        WRITERS[target.suffix.lower()](temporary, signal, samples, full_scale)
    return target
