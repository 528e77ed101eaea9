"""Measured time series: one evenly sampled, labelled array a channel, in SI, and SdyPy's dictionary of it.

A *signal* here is an :class:`xarray.DataArray` with the one dimension ``time`` (seconds, evenly spaced), the
attribute ``units`` (an SI unit) and ``long_name``.  SdyPy packages exchange the same thing as the dictionary
of SEP 5, https://github.com/sdypy/sdypy/blob/main/docs/seps/sep-0005.rst; :func:`to_sep5` and
:func:`from_sep5` convert both ways.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.core.validate import InputError, InputTypeError, finite, finite_array, positive

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "Samples",
    "check_signal",
    "even_sampling",
    "from_sep5",
    "make_signal",
    "parse_sensitivity",
    "si_unit",
    "to_sep5",
]

_PREFIX = {"": 1.0, "k": 1e3, "c": 1e-2, "m": 1e-3, "u": 1e-6, "n": 1e-9}
_TO_SI: dict[str, tuple[float, str]] = {
    **{f"{p}m": (s, "m") for p, s in _PREFIX.items()},
    **{f"{p}m/s": (s, "m/s") for p, s in _PREFIX.items()},
    **{f"{p}m/s^2": (s, "m/s^2") for p, s in _PREFIX.items()},
    **{f"{p}N": (s, "N") for p, s in _PREFIX.items()},
    **{f"{p}V": (s, "V") for p, s in _PREFIX.items()},
    **{f"{p}s": (s, "s") for p, s in _PREFIX.items()},
    **{f"{p}Hz": (s, "Hz") for p, s in _PREFIX.items()},
    "FS": (1.0, "FS"),
    "1": (1.0, "1"),
    "b": (1.0, "b"),
}
_TO_SI.pop("cs")
_TO_SI.pop("ks")
_LONG_NAMES = {"m": "displacement", "m/s": "velocity", "m/s^2": "acceleration", "N": "force", "V": "voltage"}
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
MINIMUM_SAMPLES = 16


class Samples(NamedTuple):
    """The numbers of a signal: ``values`` and ``time`` [s] of shape (samples,), the sampling rate [Hz]."""

    values: NDArray[np.float64]
    time: NDArray[np.float64]
    sampling_freq: float


def si_unit(name: str, unit: str) -> tuple[float, str]:
    """Return the factor and the SI unit for *unit*, such as ``(1e-3, "m/s")`` for ``"mm/s"``.

    Known are m, m/s, m/s^2, N, V, s and Hz with the prefixes k, c, m, u (or µ), n, and FS, the fraction of
    full scale of a sound file.

    Raises
    ------
    InputError
        If the unit is unknown; *name* says whose unit it is.
    """
    if not isinstance(unit, str):
        raise InputTypeError(
            f"unit of {name} = {unit!r}: must be text such as 'mm/s', not {type(unit).__name__}"
        )
    word = unit.strip().replace("\u03bc", "u").replace("\u00b5", "u").replace(" ", "").replace("*", "")
    word = word.replace("sec", "s").replace("²", "^2").replace("/s/s", "/s^2").replace("/s2", "/s^2")
    word = re.sub(r"s\^?-1$", "/s", re.sub(r"s\^?-2$", "/s^2", word))
    if word not in _TO_SI:
        raise InputError(
            f"unit of {name} = {unit!r}: must be m, m/s, m/s^2, N, V, s or Hz with a prefix k, c, m, u or n, "
            "or FS (fraction of full scale)"
        )
    return _TO_SI[word]


def parse_sensitivity(name: str, text: str) -> tuple[float, str, str]:
    """Read a sensitivity such as ``"125 mm/s/V"``: return the factor, the SI unit, and V or FS.

    Raises
    ------
    InputError
        If *text* is not a number, a unit, and ``/V``, ``/mV`` or ``/FS``.
    """
    found = (
        re.fullmatch(r"\s*([-+0-9.eE]+)\s*(\S.*?)\s*/\s*(V|mV|FS)\s*", text)
        if isinstance(text, str)
        else None
    )
    try:
        number = float(found[1]) if found else float("nan")
    except ValueError:
        number = float("nan")
    if found is None or not np.isfinite(number) or number == 0.0:
        raise InputError(f"{name} = {text!r}: must read like '125 mm/s/V', or '0.5 m/s/FS' for a sound file")
    factor, unit = si_unit(name, found[2])
    per_factor, per = si_unit(name, found[3])
    return number * factor / per_factor, unit, per


def even_sampling(name: str, time: ArrayLike) -> tuple[float, float]:
    """Return the start [s] and the sampling frequency [Hz] of an evenly sampled time axis.

    Times rounded on printing are accepted as long as none is a fifth of a step away from an even grid.

    Raises
    ------
    InputError
        If the times are not finite, do not increase, have a gap, or are not evenly spaced.
    """
    times = finite_array(f"{name}: time", time, 1)
    if times.size < 2:
        raise InputError(f"{name}: {times.size} sample(s): must have at least 2")
    steps = np.diff(times)
    if (steps <= 0.0).any():
        at = int(np.argmax(steps <= 0.0))
        raise InputError(
            f"{name}: time[{at + 1}] = {times[at + 1]:.9g} s must come after time[{at}] = {times[at]:.9g} s"
        )
    typical = float(np.median(steps))
    if (steps > 1.5 * typical).any():
        at = int(np.argmax(steps > 1.5 * typical))
        raise InputError(
            f"{name}: gap of {steps[at]:.6g} s after time[{at}] = {times[at]:.9g} s where the step is "
            f"{typical:.6g} s: samples are missing; cut the signal there"
        )
    count = np.arange(times.size) - (times.size - 1) / 2
    step = float(count @ times / (count @ count)) if times.size > 2 else typical
    off = np.abs(times - (times.mean() + step * count)) / step
    if off.max() > 0.2:
        at = int(np.argmax(off))
        raise InputError(
            f"{name}: time[{at}] = {times[at]:.9g} s lies {off[at]:.2f} steps off an even grid: the signal "
            "must be sampled evenly; resample it first"
        )
    if off.max() < 1e-6:
        return float(times[0]), (times.size - 1) / float(times[-1] - times[0])
    return float(times.mean() - step * (times.size - 1) / 2), 1.0 / step


def make_signal(
    values: ArrayLike,
    units: str,
    sampling_freq: float | None = None,
    *,
    time: ArrayLike | None = None,
    start: float = 0.0,
    name: str = "signal",
    attrs: Mapping[str, Any] | None = None,
) -> xr.DataArray:
    """Return a signal in SI from numbers with a stated unit and either a sampling rate or a time axis.

    Parameters
    ----------
    values : array_like, shape (samples,)
    units : str
        The unit of *values*, such as ``"mm/s"``; the signal is converted to SI.
    sampling_freq : float, optional
        Samples per second [Hz]; exactly one of this and *time*.
    time : array_like, shape (samples,), optional
        Times [s], evenly spaced.
    start : float
        Time of the first sample [s], with *sampling_freq*.
    name : str
        Name of the channel.
    attrs : mapping, optional
        More attributes.

    Raises
    ------
    InputError
        For an unknown unit, numbers that are not finite, or a time axis that is not even.
    """
    import xarray as xr

    array = finite_array(name, values, 1)
    factor, unit = si_unit(name, units)
    if (time is None) == (sampling_freq is None):
        raise InputError(f"{name}: must have exactly one of sampling_freq (Hz) and time (s)")
    if time is not None:
        if np.shape(time) != array.shape:
            raise InputError(
                f"{name}: time of shape {np.shape(time)} and values of shape {array.shape}: must agree"
            )
        start, rate = even_sampling(name, time)
    else:
        rate = positive("sampling_freq", sampling_freq, "Hz")
        start = finite("start", start)
    long_name = _LONG_NAMES.get(unit, name)
    return xr.DataArray(
        array * factor,
        dims="time",
        coords={"time": ("time", start + np.arange(array.size) / rate, {"units": "s", "long_name": "time"})},
        name=name,
        attrs={**(attrs or {}), "units": unit, "long_name": long_name},
    )


def check_signal(signal: xr.DataArray, units: str | tuple[str, ...] = (), name: str = "signal") -> Samples:
    """Return the samples of *signal* if it is one: evenly sampled, finite, long enough and in one of *units*.

    Raises
    ------
    InputError
        Naming what is wrong: the dimensions, a missing or wrong unit, NaN, times that do not increase.
    """
    import xarray as xr

    if not isinstance(signal, xr.DataArray):
        raise InputTypeError(
            f"{name}: must be an xarray.DataArray (see make_signal), not {type(signal).__name__}"
        )
    label = f"{name} {str(signal.name)!r}" if signal.name not in (None, name) else name
    if signal.dims != ("time",) or "time" not in signal.coords:
        raise InputError(
            f"{label} with dimensions {signal.dims}: must have the one dimension time with its times"
        )
    allowed = (units,) if isinstance(units, str) else units
    unit = signal.attrs.get("units")
    if unit is None:
        raise InputError(f"{label}: has no units; state them in attrs['units']")
    if allowed and unit not in allowed:
        raise InputError(f"{label} in units {unit!r}: must be in {' or '.join(allowed)}")
    if signal.size < MINIMUM_SAMPLES:
        raise InputError(f"{label}: {signal.size} sample(s): must have at least {MINIMUM_SAMPLES}")
    values = finite_array(label, signal.values, 1)
    start, rate = even_sampling(label, signal["time"].values)
    return Samples(values, start + np.arange(values.size) / rate, rate)


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
