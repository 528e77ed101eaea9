"""SdyPy's dictionary of a channel, SEP 5, from a signal and back.

https://github.com/sdypy/sdypy/blob/main/docs/seps/sep-0005.rst
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from snapbeam.core.validate import InputError, InputTypeError
from snapbeam.lab.signals.signal import check_signal, even_sampling, make_signal
from snapbeam.lab.signals.units import si_unit

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["from_sep5", "to_sep5"]

_SEP5_PROHIBITED = {"unit", "timestamp", "signal", "sample_frequency"}
_SEP5_KNOWN = (
    "data",
    "name",
    "unit_str",
    "fs",
    "time",
    "unit_tex",
    "start_timestamp",
    "start_timestamp_format",
)


def to_sep5(signal: xr.DataArray) -> dict[str, Any]:
    """Return the SEP 5 dictionary of a signal: ``data``, ``name``, ``unit_str``, ``fs`` and other attributes.

    A start other than zero is kept in the extra field ``time_offset`` [s].
    """
    samples = check_signal(signal)
    extra = {
        key: value for key, value in signal.attrs.items() if key not in ("units", "long_name", *_SEP5_KNOWN)
    }
    channel = {
        "data": samples.values,
        "name": str(signal.name),
        "fs": samples.sampling_freq,
        "unit_str": signal.attrs["units"],
        "quantity": signal.attrs.get("long_name", str(signal.name)),
        **extra,
    }
    if samples.time[0] != 0.0:
        channel["time_offset"] = float(samples.time[0])
    for key in ("start_timestamp", "start_timestamp_format"):
        if key in signal.attrs:
            channel[key] = signal.attrs[key]
    return channel


def from_sep5(channel: Mapping[str, Any], units: str | None = None) -> xr.DataArray:
    """Return the signal of a SEP 5 dictionary, in SI.

    Parameters
    ----------
    channel : mapping
        With ``data`` (one-dimensional), ``name``, ``unit_str`` and ``fs`` [Hz] or ``time`` [s].
    units : str, optional
        The unit of ``data`` where ``unit_str`` is empty, which SEP 5 allows and this package does not.

    Raises
    ------
    InputError
        For a missing or prohibited field, a missing unit, two units that contradict, or bad numbers.
    """
    if not isinstance(channel, Mapping):
        raise InputTypeError(f"channel: must be a SEP 5 dictionary, not {type(channel).__name__}")
    name = str(channel.get("name", "channel"))
    for key in channel:
        slim = str(key).lower().replace("_", "")
        if key in _SEP5_PROHIBITED or (
            key not in _SEP5_KNOWN and slim in {known.replace("_", "") for known in _SEP5_KNOWN}
        ):
            raise InputError(f"{name}: field {key!r} is prohibited by SEP 5")
    for key in ("data", "name", "unit_str"):
        if key not in channel:
            raise InputError(f"{name}: SEP 5 field {key!r} is missing")
    stated = channel["unit_str"] or None
    if stated and units and si_unit(name, stated) != si_unit(name, units):
        raise InputError(f"{name}: unit_str is {stated!r} but units = {units!r} was given")
    unit = stated or units
    if unit is None:
        raise InputError(f"{name}: unit_str is empty; state units")
    used = ("data", "name", "unit_str", "fs", "time", "time_offset", "quantity")
    attrs = {key: value for key, value in channel.items() if key not in used}
    if "fs" in channel:
        rate, start = channel["fs"], channel.get("time_offset", 0.0)
        if "time" in channel:
            start, measured = even_sampling(name, channel["time"])
            if abs(measured * len(channel["data"]) - rate * len(channel["data"])) > 0.5 * rate:
                raise InputError(f"{name}: fs = {rate!r} Hz but time is sampled at {measured:.9g} Hz")
        return make_signal(channel["data"], unit, rate, start=start, name=name, attrs=attrs)
    if "time" not in channel:
        raise InputError(f"{name}: SEP 5 needs 'fs' or 'time'")
    return make_signal(channel["data"], unit, time=channel["time"], name=name, attrs=attrs)
