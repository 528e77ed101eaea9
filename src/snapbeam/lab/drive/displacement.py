"""From the shaker's velocity to its displacement, without drift and without the flaws of the record."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from snapbeam.lab.drive.lines import without_hum
from snapbeam.lab.drive.vibrometer import DriveMeasurement, measure_drive
from snapbeam.lab.signals.flaws import sound_samples
from snapbeam.lab.signals.signal import SignalSamples, check_signal, make_signal

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["displacement_from_velocity", "mended"]


def displacement_from_velocity(
    velocity: xr.DataArray, measurement: DriveMeasurement | None = None
) -> xr.DataArray:
    """Integrate the shaker's velocity to its displacement [m] without drift.

    The velocity's cubic spline is integrated exactly.  What noise and offset add is a slow drift; it is found
    where the truth is known, at rest (zero) and in steady motion (zero mean over a cycle), as a smoothing
    spline that follows nothing faster than about four cycles, and subtracted.  The start-up transient is
    bridged, so it keeps its shape.  Dropouts and cut tops are replaced by the steady sine.  The shaker's
    suspension is taken to hold its mean position.

    Parameters
    ----------
    velocity : xarray.DataArray
        Velocity [m/s].
    measurement : DriveMeasurement, optional
        That of this velocity; measured here if left out.

    Raises
    ------
    InputError
        As :func:`measure_drive`.
    """
    from scipy.interpolate import CubicSpline, make_smoothing_spline

    samples = check_signal(velocity, "m/s", "velocity")
    drive = measurement or measure_drive(velocity)
    samples = mended(samples, drive)
    period = 1.0 / drive.steady.frequency
    time = samples.time
    quiet_until = time[0] if drive.startup is None else drive.startup.onset - drive.startup.onset_uncertainty
    spline = CubicSpline(time, samples.values - drive.steady.offset)
    position, integral = spline.antiderivative(1), spline.antiderivative(2)
    settled = drive.steady.start if drive.startup is None else drive.startup.onset + drive.startup.duration
    edges = [np.arange(settled, drive.steady.stop - period, period)]
    if quiet_until - time[0] > period:
        edges.append(np.arange(quiet_until - period, time[0], -period)[::-1])
    if time[-1] - drive.stop > 10.0 * period:
        edges.append(np.arange(drive.stop + 5.0 * period, time[-1] - period, period))
    edge = np.sort(np.concatenate(edges))
    mean = (integral(edge + period) - integral(edge)) / period
    scaled = (edge + 0.5 * period - time[0]) / period
    drift = make_smoothing_spline(scaled, mean, lam=(4.0 / (2.0 * math.pi)) ** 4)
    values = position(time) - drift((time - time[0]) / period)
    return make_signal(
        values,
        "m",
        samples.sampling_frequency,
        start=float(time[0]),
        name="shaker displacement",
        attrs={key: value for key, value in velocity.attrs.items() if key not in ("units", "long_name")},
    )


def mended(samples: SignalSamples, drive: DriveMeasurement) -> SignalSamples:
    """A record without hum, whose flaws and cut tops are replaced by the motion about them; the same without any.

    In steady motion that is the steady sine; in the start-up cut tops follow from a sine of changing amplitude
    through what is left of the two cycles about them.
    """
    samples = without_hum(samples, drive.lines)
    if not drive.flaws and not drive.clipping.found:
        return samples
    values = samples.values.copy()
    bad = ~sound_samples(values.size, list(drive.flaws))
    cut = drive.clipping.touches(samples.values) & (samples.time < drive.stop)
    early = cut & (samples.time < drive.steady.start)
    if drive.startup is not None:
        early &= samples.time >= drive.startup.onset
    late = bad | (cut & (samples.time >= drive.steady.start))
    model = drive.steady.waveform(samples.time, harmonics=not drive.clipping.found)
    values[late] = model[late]
    for first, last in _stretches(early):
        values[first:last] = _about(samples, drive, first, last, ~(cut | bad))
    return SignalSamples(values, samples.time, samples.sampling_frequency)


def _stretches(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(np.int8), [0]])))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def _about(
    samples: SignalSamples, drive: DriveMeasurement, first: int, last: int, sound: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """The motion between two samples, from the sound ones up to a cycle away since the start."""
    middle = 0.5 * (samples.time[first] + samples.time[last - 1])
    period = 1.0 / drive.steady.frequency
    since = samples.time - middle
    begin = -math.inf if drive.startup is None else drive.startup.onset - middle
    used = sound & (np.abs(since) < period) & (since >= begin)

    def design(t: NDArray[np.float64]) -> NDArray[np.float64]:
        turn = 2.0 * math.pi * t / period
        wave = np.stack([np.cos(turn), np.sin(turn)], axis=1)
        return np.concatenate([wave, wave * (t / period)[:, None]], axis=1)

    if np.count_nonzero(used) < 12:
        return samples.values[first:last]
    solution = np.linalg.lstsq(design(since[used]), samples.values[used] - drive.steady.offset, rcond=None)[0]
    return drive.steady.offset + design(since[first:last]) @ solution
