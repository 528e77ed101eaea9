"""A measured drive made ready for the model: drift-free, band-limited, resampled without adding energy."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from snapbeam.core.findings import to_json
from snapbeam.core.validate import InputError, choice, positive, shown
from snapbeam.lab.drive.align import Alignment
from snapbeam.lab.drive.displacement import displacement_from_velocity
from snapbeam.lab.drive.vibrometer import DriveMeasurement, measure_drive
from snapbeam.lab.plausibility.vibrometer import KINDS as VIBROMETER
from snapbeam.lab.signals.signal import check_signal

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["recorded_drive"]


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

    The drift-free displacement is low-passed without phase shift to *bandwidth*, resampled through a
    band-limited interpolation, and differentiated, so that displacement and velocity belong together.  The
    gain of the filter is at most 1 at every frequency.  At ends that are not at rest half the filter's length
    is left out, where it would have had to invent samples.

    Parameters
    ----------
    velocity : xarray.DataArray
        Velocity of the shaker [m/s].
    sampling_frequency : float
        Samples per second [Hz] of the result.
    bandwidth : float, optional
        Highest frequency kept [Hz]; ten times the excitation frequency if left out, and never more than 0.4
        of the measured sampling rate.
    measurement : DriveMeasurement, optional
        That of this velocity; measured here if left out.
    alignment : Alignment, optional
        With the camera: turns the drive over where the vibrometer counts the other direction as positive.
    polarity : {1, -1}, optional
        -1 to turn the drive over, instead of what the alignment says.
    amplitude_from : {"vibrometer", "camera"}
        Whose amplitude the drive has; the camera's needs an alignment.

    Returns
    -------
    xarray.Dataset
        ``displacement`` [m] and ``velocity`` [m/s] over ``time`` [s], which begins at the onset if there is
        one; the displacement there is its zero.

    Raises
    ------
    InputError
        If the result could not hold the bandwidth, the record is too short for the filter, or its start-up is
        broken by a dropout.
    """
    import xarray as xr
    from scipy.interpolate import CubicSpline
    from scipy.signal import fftconvolve, firwin, kaiserord, resample_poly

    samples = check_signal(velocity, "m/s", "velocity")
    rate = positive("sampling_frequency", sampling_frequency, "Hz")
    drive = measurement or measure_drive(velocity)
    if drive.startup is not None and not drive.has_start:
        words = next(
            one.message for one in drive.diagnostics if one.code == VIBROMETER["dropout_in_start"].code
        )
        raise InputError(f"velocity: {words}; cut the record after its start-up, or record again")
    scale = _scale(alignment, polarity, amplitude_from)
    top = 0.4 * samples.sampling_frequency
    wanted = 10.0 * drive.steady.frequency if bandwidth is None else positive("bandwidth", bandwidth, "Hz")
    band = min(wanted, top)
    if band < 1.5 * drive.steady.frequency:
        raise InputError(
            f"bandwidth = {band:g} Hz: must be 1.5 times the excitation, {drive.steady.frequency:g} Hz"
        )
    if rate < 2.5 * band:
        raise InputError(
            f"sampling_frequency = {rate:g} Hz: must be at least 2.5 times the bandwidth, {band:g} Hz"
        )
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
        raise InputError(
            "amplitude_from (--amplitude-from) = 'camera': needs an alignment with a camera (--camera)"
        )
    sign = polarity if polarity is not None else (alignment.polarity if alignment is not None else 1)
    return float(sign) * (alignment.gain if alignment is not None and amplitude_from == "camera" else 1.0)
