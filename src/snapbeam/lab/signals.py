"""Measured time series: one evenly sampled, labelled array a channel, in SI.

A *signal* here is an :class:`xarray.DataArray` with the one dimension ``time`` (seconds, evenly spaced), the
attribute ``units`` (an SI unit) and ``long_name``.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.util.validation import InputError, finite, finite_array, instance, positive, require_texts, shown

if TYPE_CHECKING:
    import xarray as xr


_PREFIX = {"": 1.0, "k": 1e3, "c": 1e-2, "m": 1e-3, "u": 1e-6, "n": 1e-9}
_WITH_PREFIX = ("m", "m/s", "m/s^2", "N", "V", "s", "Hz", "Pa")
_ODD = ("cs", "ks", "cV", "cHz", "cPa", "cN")
_GRAVITY = 9.80665  # m/s^2, standard acceleration of free fall
_INCH = 0.0254  # m
_TO_SI: dict[str, tuple[float, str]] = {
    **{f"{p}{u}": (s, u) for u in _WITH_PREFIX for p, s in _PREFIX.items() if f"{p}{u}" not in _ODD},
    **dict.fromkeys(("g", "g_n"), (_GRAVITY, "m/s^2")),
    **{f"in{per}": (_INCH, f"m{per}") for per in ("", "/s", "/s^2")},
    "ips": (_INCH, "m/s"),
    "FS": (1.0, "FS"),
    "1": (1.0, "1"),
    "b": (1.0, "b"),
}
_WORDS = {
    "second": "s", "seconds": "s", "millisecond": "ms", "milliseconds": "ms", "microsecond": "us",
    "microseconds": "us", "nanosecond": "ns", "nanoseconds": "ns", "volt": "V", "volts": "V",
    "millivolts": "mV", "inch": "in", "inches": "in", "hertz": "Hz", "pascal": "Pa", "newton": "N",
    "meter": "m", "metre": "m", "micron": "um", "microns": "um", "micrometer": "um", "micrometre": "um",
    "millimeter": "mm", "millimetre": "mm",
}  # fmt: skip
KNOWN_UNITS = (
    "m, m/s, m/s^2, N, V, s, Hz or Pa with a prefix k, c, m, u or n, g, in, in/s, in/s^2, or FS (fraction of full "
    "scale)"
)
_LONG_NAMES = {
    "m": "displacement", "m/s": "velocity", "m/s^2": "acceleration", "N": "force", "V": "voltage", "Pa": "pressure",
}  # fmt: skip
MINIMUM_SAMPLES = 16
_ON_GRID = 0.35  # steps off an even grid with gaps, below which samples are missing; jitter is beyond
_LARGEST = 1e30  # of a value in SI units and of a sampling rate: powers and derivatives stay finite


def si_unit(name: str, unit: str) -> tuple[float, str]:
    """Return the factor and the SI unit for *unit*, such as ``(1e-3, "m/s")`` for ``"mm/s"``; *name* is the signal's.

    Known are ``KNOWN_UNITS``, with u or µ for micro; g is the standard acceleration of free fall.
    """
    where = f"unit of {name if isinstance(name, str) else 'a signal'}"
    instance(where, unit, str, "text such as 'mm/s'")
    word = unit.strip().replace("\u03bc", "u").replace("\u00b5", "u").replace(" ", "").replace("*", "")
    word = _WORDS.get(word.lower(), word)
    word = word.replace("sec", "s").replace("²", "^2").replace("/s/s", "/s^2").replace("/s2", "/s^2")
    word = re.sub(r"s\^?-1$", "/s", re.sub(r"s\^?-2$", "/s^2", word)).replace("//", "/")
    if word not in _TO_SI:
        raise InputError(f"{where} = {shown(unit)}: must be {KNOWN_UNITS}")
    return _TO_SI[word]


def unit_factor(name: str, unit: str, base: str) -> float | None:
    """The factor from *unit* to an SI unit; None if it is none of that kind."""
    try:
        factor, own = si_unit(name, unit)
    except InputError:
        return None
    return factor if own == base else None


def parse_sensitivity(name: str, text: str) -> tuple[float, str, str]:
    """Read a sensitivity: return the factor, the SI unit, and V or FS.

    Either the sensitivity per volt (or full scale), ``"125 mm/s/V"``, or the volts that a sensor gives, ``"100
    mV/g"``, ``"50 mV/Pa"``, ``"10 mV/(m/s^2)"``.
    """
    found = re.fullmatch(r"\s*([-+0-9.eE]+)\s*(\S.*)", text) if isinstance(text, str) else None
    try:
        number = float(found[1]) if found else float("nan")
    except ValueError:
        number = float("nan")
    rest = found[2].replace(" ", "") if found is not None and np.isfinite(number) and number != 0.0 else ""
    per = re.fullmatch(r"(.+)/(V|mV|FS)", rest)
    if per is not None:
        factor, unit = si_unit(name, per[1].strip("()"))
        per_factor, base = si_unit(name, per[2])
        return number * factor / per_factor, unit, base
    gives = re.fullmatch(r"(u|m|)V/(.+)", rest)
    if gives is None:
        raise InputError(f"{name} = {text!r}: must read like '125 mm/s/V', '100 mV/g' or '0.5 m/s/FS'")
    volts, _ = si_unit(name, f"{gives[1]}V")
    factor, unit = si_unit(name, gives[2].strip("()"))
    return factor / (number * volts), unit, "V"


class SignalSamples(NamedTuple):
    """The numbers of a signal: ``values`` and ``time`` [s] of shape (samples,), the sampling rate [Hz]."""

    values: NDArray[np.float64]
    time: NDArray[np.float64]
    sampling_frequency: float

    @property
    def duration(self) -> float:
        """Samples over the sampling rate [s]."""
        return self.values.size / self.sampling_frequency

    def part(self, which: slice | NDArray[np.bool_]) -> SignalSamples:
        """The samples of a slice or a mask."""
        return SignalSamples(self.values[which], self.time[which], self.sampling_frequency)


def even_sampling(name: str, time: ArrayLike) -> tuple[float, float]:
    """Return the start [s] and the sampling frequency [Hz] of an evenly sampled time axis.

    Times rounded on printing are accepted as long as none is a fifth of a step away from an even grid.
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
    counted = np.concatenate([[0.0], np.cumsum(np.maximum(np.rint(steps / typical), 1.0))])
    if counted[-1] >= times.size and np.abs(grid_of(times, counted)[1]).max() < _ON_GRID:
        at = int(np.argmax(steps > 1.5 * typical))
        raise InputError(
            f"{name}: gap of {steps[at]:.6g} s after time[{at}] = {times[at]:.9g} s where the step is "
            f"{typical:.6g} s: samples are missing; cut the signal there"
        )
    step, off = grid_of(times, np.arange(times.size))
    off = np.abs(off)
    if off.max() > 0.2:
        at = int(np.argmax(off))
        raise InputError(
            f"{name}: time[{at}] = {times[at]:.9g} s lies {off[at]:.2f} steps off an even grid: the signal "
            "must be sampled evenly; resample it first"
        )
    if off.max() < 1e-6:
        return float(times[0]), (times.size - 1) / float(times[-1] - times[0])
    return float(times.mean() - step * (times.size - 1) / 2), 1.0 / step


def grid_of(times: NDArray[np.float64], number: NDArray[Any]) -> tuple[float, NDArray[np.float64]]:
    """Step of the grid of these numbers that fits the times best, and by how many steps each time lies after it."""
    count = number - number.mean()
    step = float(count @ times / (count @ count))
    return step, (times - (times.mean() + step * count)) / step


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

    Examples
    --------
    >>> from snapbeam import lab
    >>> signal = lab.make_signal([0.0, 1.0, 0.0, -1.0], "mm", 1e3)
    >>> signal.values
    array([ 0.   ,  0.001,  0.   , -0.001])
    """
    from snapbeam.util.datasets import xr

    require_texts("name", name)
    require_texts("attrs", attrs)
    array = finite_array(name, values, 1)
    factor, unit = si_unit(name, units)
    if (time is None) == (sampling_frequency is None):
        raise InputError(f"{name}: must have exactly one of sampling_frequency (Hz) and time (s)")
    if time is not None:
        time = finite_array("time", time, 1)
        if np.shape(time) != array.shape:
            raise InputError(f"{name}: time of shape {np.shape(time)} and values of shape {array.shape}: must agree")
        start, rate = even_sampling(name, time)
    else:
        rate = positive("sampling_frequency", sampling_frequency, "Hz")
        start = finite("start", start)
    long_name = _LONG_NAMES.get(unit, name)
    with np.errstate(over="ignore", under="ignore"):
        scaled = _computable(name, array * factor, rate, unit)
    return xr.DataArray(
        scaled,
        dims="time",
        coords={"time": ("time", start + np.arange(array.size) / rate, {"units": "s", "long_name": "time"})},
        name=name,
        attrs={**(attrs or {}), "units": unit, "long_name": long_name},
    )


def check_signal(signal: xr.DataArray, units: str | tuple[str, ...] = (), name: str = "signal") -> SignalSamples:
    """Return the samples of *signal* if it is one: evenly sampled, finite, long enough and in one of *units*."""
    from snapbeam.util.datasets import xr

    instance(name, signal, xr.DataArray, "an xarray.DataArray (see make_signal)")
    label = f"{name} {str(signal.name)!r}" if signal.name not in (None, name) else name
    if signal.dims != ("time",) or "time" not in signal.coords:
        raise InputError(f"{label} with dimensions {signal.dims}: must have the one dimension time with its times")
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
    _computable(label, values, rate, str(unit))
    return SignalSamples(values, start + np.arange(values.size) / rate, rate)


def _computable(label: str, values: NDArray[np.float64], rate: float, unit: str) -> NDArray[np.float64]:
    """Return values of a signal whose powers and derivatives are numbers; refuse others."""
    largest = float(np.abs(values).max(initial=0.0))
    for what, size, its_unit in ((f"{label}: largest value", largest, unit), (f"{label}: sampling rate", rate, "Hz")):
        if size and not 1.0 / _LARGEST <= size <= _LARGEST:
            raise InputError(
                f"{what} = {size:.3g} {its_unit}: must be from {1.0 / _LARGEST:g} to {_LARGEST:g}; check the unit"
            )
    return values


def stretches(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and one past the last index of each stretch of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(np.int8), [0]])))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
