"""Measured time series: one evenly sampled, labelled array a channel, in SI.

A *signal* here is an :class:`xarray.DataArray` with the one dimension ``time`` (seconds, evenly spaced), the
attribute ``units`` (an SI unit) and ``long_name``.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.core.validate import InputError, InputTypeError, finite, finite_array, positive, shown
from snapbeam.lab.signals.units import si_unit

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "SignalSamples",
    "check_signal",
    "even_sampling",
    "make_signal",
]

_LONG_NAMES = {
    "m": "displacement", "m/s": "velocity", "m/s^2": "acceleration", "N": "force", "V": "voltage", "Pa": "pressure",
}  # fmt: skip
MINIMUM_SAMPLES = 16


class SignalSamples(NamedTuple):
    """The numbers of a signal: ``values`` and ``time`` [s] of shape (samples,), the sampling rate [Hz]."""

    values: NDArray[np.float64]
    time: NDArray[np.float64]
    sampling_frequency: float


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
    sampling_frequency: float | None = None,
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
    sampling_frequency : float, optional
        Samples per second [Hz]; exactly one of this and *time*.
    time : array_like, shape (samples,), optional
        Times [s], evenly spaced.
    start : float
        Time of the first sample [s], with *sampling_frequency*.
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
    if (time is None) == (sampling_frequency is None):
        raise InputError(f"{name}: must have exactly one of sampling_frequency (Hz) and time (s)")
    if time is not None:
        if np.shape(time) != array.shape:
            raise InputError(
                f"{name}: time of shape {np.shape(time)} and values of shape {array.shape}: must agree"
            )
        start, rate = even_sampling(name, time)
    else:
        rate = positive("sampling_frequency", sampling_frequency, "Hz")
        start = finite("start", start)
    long_name = _LONG_NAMES.get(unit, name)
    return xr.DataArray(
        array * factor,
        dims="time",
        coords={"time": ("time", start + np.arange(array.size) / rate, {"units": "s", "long_name": "time"})},
        name=name,
        attrs={**(attrs or {}), "units": unit, "long_name": long_name},
    )


def check_signal(
    signal: xr.DataArray, units: str | tuple[str, ...] = (), name: str = "signal"
) -> SignalSamples:
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
        raise InputError(f"{label} in units {shown(unit)}: must be in {' or '.join(allowed)}")
    if signal.size < MINIMUM_SAMPLES:
        raise InputError(f"{label}: {signal.size} sample(s): must have at least {MINIMUM_SAMPLES}")
    values = finite_array(label, signal.values, 1)
    start, rate = even_sampling(label, signal["time"].values)
    return SignalSamples(values, start + np.arange(values.size) / rate, rate)
