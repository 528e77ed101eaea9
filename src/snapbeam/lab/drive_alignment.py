"""Camera and vibrometer on one clock.

The shaker's own motion is in both records.  Its phase gives the delay to a small part of a sample, but only
up to whole cycles; the start of the motion tells the cycles apart.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from snapbeam.lab.diagnostics import KINDS_ALIGNMENT, KINDS_VIBROMETER, holding
from snapbeam.lab.signals import SignalSamples, check_signal
from snapbeam.lab.sine_fit import SineFit, fit_sine
from snapbeam.lab.vibrometer import DriveMeasurement, displacement_from_velocity, measure_drive
from snapbeam.util.diagnostics import Diagnostic, to_json
from snapbeam.util.validation import InputError, choice, finite, positive, shown

if TYPE_CHECKING:
    import xarray as xr


_Array = NDArray[np.float64]
_SAME = 0.02  # share by which two calibrated amplitudes may differ
_CERTAIN = 25.0  # chi-square by which the best cycle must beat the next


@dataclass(frozen=True)
class Alignment:
    """Time shift from the vibrometer's clock to the camera's: t_camera = t_vibrometer + delay.

    ``delay`` and ``delay_se`` in s; ``polarity`` is -1 if a motion that is positive for one is negative for the
    other; ``gain``, the camera's amplitude over the vibrometer's, is 1 if both are calibrated;
    ``clock_difference``, the camera's frequency over the vibrometer's less 1, and its standard error;
    ``certain`` is true if the onset of the motion determined the cycle, ``margin`` the difference of
    chi-square; ``diagnostics`` lists the diagnostics.

    Examples
    --------
    >>> from snapbeam import lab
    >>> velocity = lab.render_vibrometer(100.0, 7e-3, duration=0.5)  # 100 Hz, 7 mm/s
    >>> found = lab.align(lab.displacement_from_velocity(velocity), velocity, 100.0, polarity=1)
    >>> f"{abs(found.delay):.3f} s"
    '0.000 s'
    """

    delay: float
    delay_se: float
    polarity: int
    gain: float
    gain_se: float
    clock_difference: float
    clock_difference_se: float
    certain: bool
    margin: float
    period: float
    diagnostics: tuple[Diagnostic, ...]

    @property
    def description(self) -> str:
        """The alignment in words."""
        sign = "-" if self.delay < 0.0 else "+"
        text = f"t_camera = t_vibrometer {sign} {abs(self.delay):.7f} s (standard error {self.delay_se:.1e} s)"
        if self.polarity < 0:
            text += "; turned over (polarity -1)"
        if not self.certain:
            text += f"; whole cycles of {self.period:.6g} s remain open"
        return text


def align(
    camera: xr.DataArray,
    vibrometer: xr.DataArray,
    frequency: float | None = None,
    *,
    polarity: int | None = None,
    near: float | None = None,
) -> Alignment:
    """Find the delay between a camera's and a vibrometer's record of the same shaker motion.

    Parameters
    ----------
    camera : xarray.DataArray
        Displacement of the shaker [m]; times are the middles of the exposures.
    vibrometer : xarray.DataArray
        Velocity [m/s] or displacement [m] of the shaker.
    frequency : float, optional
        The excitation frequency [Hz] as set, used as a guess.
    polarity : {1, -1}, optional
        True if both count the same direction as positive; by default from the onset of the motion.
    near : float, optional
        A delay [s] known beforehand to better than half a cycle, as from a common trigger; it then decides
        the cycle.

    Examples
    --------
    >>> from snapbeam import lab
    >>> velocity = lab.render_vibrometer(100.0, 7e-3, duration=0.5)  # 100 Hz, 7 mm/s
    >>> import numpy as np
    >>> time = np.arange(4000) / 10e3  # s; the camera starts 0.05 s after the vibrometer
    >>> onset = np.clip(time - 0.05, 0.0, None)
    >>> moved = 7e-3 / (2 * np.pi * 100) * np.sin(2 * np.pi * 100 * onset)
    >>> noise = 1e-8 * np.random.default_rng(0).standard_normal(time.size)
    >>> found = lab.align(lab.make_signal(moved + noise, "m", 10e3), velocity, 100.0, polarity=1)
    >>> f"{found.delay:.3f} s"
    '-0.050 s'
    """
    if polarity is not None and (not isinstance(polarity, (int, np.integer)) or polarity not in (1, -1)):
        raise InputError(f"polarity = {shown(polarity)}: must be 1, -1 or None")
    check_signal(camera, "m", "camera")
    seen = measure_drive(camera, frequency)
    check_signal(vibrometer, ("m/s", "m"), "vibrometer")
    moved, felt = vibrometer, measure_drive(vibrometer, frequency)
    one, two = seen.steady, felt.steady
    if vibrometer.attrs["units"] == "m/s":
        moved = displacement_from_velocity(vibrometer, felt)
        two = fit_sine(_window(moved, two.start, two.stop), two.frequency)
    difference = one.frequency / two.frequency - 1.0
    difference_se = math.hypot(one.frequency_se, two.frequency_se) / two.frequency
    if abs(difference) > max(1e-3, 6.0 * difference_se):
        raise InputError(
            f"camera and vibrometer: {one.frequency:.6g} and {two.frequency:.6g} Hz: must be the same motion"
        )
    period = 1.0 / two.frequency
    signs = (1, -1) if polarity is None else (polarity,)
    candidates = _candidates(camera, moved, seen, felt, two, signs)
    if near is not None:
        goal = finite("near", near)
        half = 0.5 * period
        delay, sign, _ = min(candidates, key=lambda c: abs((c[0] - goal + half) % period - half))
        delay += round((goal - delay) / period) * period
        certain, margin = True, math.inf
    else:
        ranked = sorted(candidates, key=lambda c: c[2])
        delay, sign, best = ranked[0]
        margin = ranked[1][2] - best if len(ranked) > 1 else math.inf
        certain = margin > _CERTAIN and math.isfinite(best)
    other = [c[2] for c in candidates if c[1] != sign]
    own = min((c[2] for c in candidates if c[1] == sign), default=math.inf)
    turned = bool(other) and math.isfinite(own) and min(other) - own > _CERTAIN
    delay, delay_se = _refine(camera, moved, seen, felt, delay, sign)
    gain = one.amplitude / two.amplitude
    gain_se = gain * math.hypot(one.amplitude_se / one.amplitude, two.amplitude_se / two.amplitude)
    told = holding(
        KINDS_ALIGNMENT,
        ("polarity_open", polarity is None and not turned, {}),
        ("polarity", sign < 0 and (turned or polarity is not None), {}),
        ("cycle_open", not certain, {"period_ms": 1e3 * period}),
        ("amplitude", abs(gain - 1.0) > max(5.0 * gain_se, _SAME), {"gain": gain, "error": gain_se}),
        ("clocks", abs(difference) > 4.0 * difference_se, {"difference": difference}),
    )
    return Alignment(
        delay,
        delay_se,
        sign,
        gain,
        gain_se,
        difference,
        difference_se,
        certain,
        margin,
        period,
        diagnostics=tuple(told),
    )


def _window(signal: xr.DataArray, start: float, stop: float) -> SignalSamples:
    samples = check_signal(signal)
    return samples.part((samples.time >= start) & (samples.time < stop))


def _candidates(
    camera: xr.DataArray,
    moved: xr.DataArray,
    seen: DriveMeasurement,
    felt: DriveMeasurement,
    two: SineFit,
    signs: tuple[int, ...],
) -> list[tuple[float, int, float]]:
    """Delay, polarity and chi-square about the start, for each whole cycle that is possible."""
    from scipy.interpolate import CubicSpline

    one = seen.steady
    period = 1.0 / two.frequency
    eye, ear = check_signal(camera), check_signal(moved)
    middle = 0.5 * (one.start + one.stop)
    known = seen.startup is not None and felt.startup is not None
    first = seen.startup.onset if seen.startup else float(eye.time[0])
    # a first guess of the delay; the camera's phase at t is the vibrometer's at t - delay
    coarse = seen.startup.onset - felt.startup.onset if seen.startup and felt.startup else 0.0
    settle = max((m.startup.cycles for m in (seen, felt) if m.startup), default=0.0) + 4.0
    begin, end = first - 2.0 * period, first + settle * period
    inside = (eye.time >= begin) & (eye.time <= end)
    time, values = eye.time[inside], eye.values[inside] - one.offset
    spline = CubicSpline(ear.time, ear.values - two.offset, extrapolate=False)
    noise = max(one.noise_rms**2 + two.noise_rms**2, (1e-6 * one.amplitude) ** 2)
    found = []
    for sign in signs:
        base = coarse + _shift(one, two, middle, coarse, sign) / (2.0 * math.pi * two.frequency)
        for cycle in range(-3, 4):
            delay = base + cycle * period
            other = sign * spline(time - delay)
            both = np.isfinite(other)
            if known and both.sum() >= 0.5 * time.size:
                x, y = other[both], values[both]
                gain = float(x @ y / (x @ x)) if x @ x > 0.0 else 0.0
                chi = float(np.mean((y - gain * x) ** 2)) * time.size / noise
            else:
                chi = math.inf if known else abs(cycle) * 1e-3 + (0.0 if sign == signs[0] else 1e-4)
            found.append((delay, sign, chi))
    return found


def _refine(
    camera: xr.DataArray, moved: xr.DataArray, seen: DriveMeasurement, felt: DriveMeasurement, delay: float, sign: int
) -> tuple[float, float]:
    """The delay from the phases over the time both records share, and its standard error."""
    start = max(seen.steady.start, felt.steady.start + delay)
    stop = min(seen.steady.stop, felt.steady.stop + delay)
    common = felt.steady.frequency
    if (stop - start) * common < 5.0:
        raise InputError(
            f"camera and vibrometer share {max((stop - start) * common, 0.0):.1f} steady cycles when their clocks are "
            f"{delay:.4g} s apart: must be at least 5; record both from before the start, or give near (--near)"
        )
    one = fit_sine(_window(camera, start, stop), common, fixed=True)
    two = fit_sine(_window(moved, start - delay, stop - delay), common, fixed=True)
    middle = 0.5 * (start + stop)
    se = math.hypot(one.phase_se, two.phase_se) / (2.0 * math.pi * common)
    return delay + _shift(one, two, middle, delay, sign) / (2.0 * math.pi * common), se


def _shift(one: SineFit, two: SineFit, at: float, delay: float, sign: int) -> float:
    """Phase [rad], within half a turn, by which the second sine is ahead of the first at a time, *delay* undone."""
    turn = two.phase_at(at - delay) - one.phase_at(at) + (0.0 if sign > 0 else math.pi)
    return (turn + math.pi) % (2.0 * math.pi) - math.pi


def recorded_drive(
    velocity: xr.DataArray,
    sampling_frequency: float,
    *,
    bandwidth: float | None = None,
    measurement: DriveMeasurement | None = None,
    alignment: Alignment | None = None,
    polarity: int | None = None,
    amplitude_from: str = "vibrometer",
) -> xr.Dataset:
    """Resample a measured drive, start-up transient included, for use in the model, without adding energy.

    The drift-free displacement is low-passed to *bandwidth* without phase shift and with a gain of at most 1,
    interpolated, and differentiated, so that displacement and velocity belong together. At ends that are not at rest
    half the filter's length is discarded.

    Parameters
    ----------
    velocity : xarray.DataArray
        Velocity of the shaker [m/s].
    sampling_frequency : float
        Samples per second [Hz] of the result.
    bandwidth : float, optional
        Highest frequency of the drive [Hz]; by default ten times the excitation frequency, at most 0.4 of the measured
        sampling rate.
    measurement : DriveMeasurement, optional
        Result of :func:`measure_drive`; measured by default.
    alignment : Alignment, optional
        Alignment with the camera, which turns the drive over where the directions differ.
    polarity : {1, -1}, optional
        Polarity in place of that of the alignment.
    amplitude_from : {"vibrometer", "camera"}
        Source of the amplitude; the camera's needs an alignment.

    Returns
    -------
    xarray.Dataset
        ``displacement`` [m], zero at the onset, and ``velocity`` [m/s] over ``time`` [s], which begins there if there
        is one.

    Raises
    ------
    InputError
        If the result cannot hold the bandwidth, the record is too short, or its start-up has a dropout.

    Examples
    --------
    >>> from snapbeam import lab
    >>> velocity = lab.render_vibrometer(100.0, 7e-3, duration=0.5)  # 100 Hz, 7 mm/s
    >>> drive = lab.measure_drive(velocity, 100.0)
    >>> recorded = lab.recorded_drive(velocity, 1e5, measurement=drive)
    >>> list(recorded.data_vars)
    ['displacement', 'velocity']
    """
    from scipy.interpolate import CubicSpline
    from scipy.signal import fftconvolve, firwin, kaiserord, resample_poly

    from snapbeam.util.datasets import xr

    samples = check_signal(velocity, "m/s", "velocity")
    rate = positive("sampling_frequency", sampling_frequency, "Hz")
    drive = measurement or measure_drive(velocity)
    if drive.startup is not None and not drive.has_start:
        broken = KINDS_VIBROMETER["dropout_in_start"].code
        words = next(one.message for one in drive.diagnostics if one.code == broken)
        raise InputError(f"velocity: {words}; cut the record after its start-up, or record again")
    scale = _scale(alignment, polarity, amplitude_from)
    top = 0.4 * samples.sampling_frequency
    wanted = 10.0 * drive.steady.frequency if bandwidth is None else positive("bandwidth", bandwidth, "Hz")
    band = min(wanted, top)
    if band < 1.5 * drive.steady.frequency:
        raise InputError(f"bandwidth = {band:g} Hz: must be 1.5 times the excitation, {drive.steady.frequency:g} Hz")
    if rate < 2.5 * band:
        raise InputError(f"sampling_frequency = {rate:g} Hz: must be at least 2.5 times the bandwidth, {band:g} Hz")
    position = scale * displacement_from_velocity(velocity, drive).values
    nyquist = samples.sampling_frequency / 2.0
    width = 0.25 * band
    length, beta = kaiserord(80.0, width / nyquist)
    length |= 1
    half = length // 2
    if position.size < 4 * length:
        raise InputError(f"velocity: {position.size} samples: must be {4 * length} for {band:g} Hz")
    taps = firwin(length, band + width / 2.0, window=("kaiser", beta), fs=samples.sampling_frequency)
    taps /= np.abs(np.fft.rfft(taps, 16 * length)).max()
    smooth = fftconvolve(np.pad(position, half, mode="edge"), taps, mode="valid")
    fine = resample_poly(smooth, 8, 1, window=("kaiser", 8.0), padtype="line")
    grid = samples.time[0] + np.arange(fine.size) / (8.0 * samples.sampling_frequency)
    spline = CubicSpline(grid, fine)
    trim = (half + 16) / samples.sampling_frequency
    last = samples.time[-1]
    end = float(last if last - drive.stop > trim else last - trim)
    start = drive.startup.onset if drive.startup else float(samples.time[0]) + trim
    time = start + np.arange(int((end - start) * rate) + 1) / rate
    zero = float(spline(start)) if drive.startup else 0.0
    speed = spline.derivative()(time)
    return xr.Dataset(
        {
            "displacement": ("time", spline(time) - zero, {"units": "m", "long_name": "shaker displacement"}),
            "velocity": ("time", speed, {"units": "m/s", "long_name": "shaker velocity"}),
        },
        {"time": ("time", time - start, {"units": "s", "long_name": "time since the start"})},
        {
            "frequency": drive.steady.frequency,
            "velocity_amplitude": abs(scale) * drive.steady.amplitude,
            "polarity": 1 if scale > 0.0 else -1,
            "amplitude_from": amplitude_from,
            "diagnostics": to_json((*drive.diagnostics, *(alignment.diagnostics if alignment else ()))),
            "bandwidth": band,
            "begins_at_rest": int(drive.startup is not None),
            "source_start": start,
        },
    )


def _scale(alignment: Alignment | None, polarity: int | None, amplitude_from: str) -> float:
    """Factor from the vibrometer's motion to the drive's."""
    choice("amplitude_from", amplitude_from, ("vibrometer", "camera"))
    if polarity not in (None, 1, -1):
        raise InputError(f"polarity (--polarity) = {shown(polarity)}: must be 1 or -1")
    if amplitude_from == "camera" and alignment is None:
        raise InputError("amplitude_from (--amplitude-from) = 'camera': needs an alignment with a camera (--camera)")
    sign = polarity if polarity is not None else (alignment.polarity if alignment is not None else 1)
    return float(sign) * (alignment.gain if alignment is not None and amplitude_from == "camera" else 1.0)
