"""Natural frequencies and damping ratios from a free decay, and whether the two wells agree.

The paper tests both wells for their natural frequency (81.3 and 80.5 Hz) and takes the damping ratio from
free vibration (sections 2 and 3.3).  The frequency wanted is that of vanishing amplitude, so the dependence
on amplitude is part of every method here; see :mod:`snapbeam.lab.decay.model`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.core.validate import InputError, choice, finite, integer, nonnegative, positive
from snapbeam.lab.decay.cycles import (
    Cycles,
    backbone,
    hilbert_cycles,
    noise_level,
    peak_cycles,
    regress,
)
from snapbeam.lab.decay.fit import explain, fit_decay
from snapbeam.lab.decay.model import DecayFit, ModeEstimate
from snapbeam.lab.signals.signal import SignalSamples, check_signal
from snapbeam.lab.signals.sine_fit import spectral_peak, white_variance

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["METHODS", "WellComparison", "compare_wells", "identify_decay"]

_Array = NDArray[np.float64]
METHODS = ("fit", "hilbert", "log_decrement")
_UNITS = ("m", "b", "m/s", "m/s^2", "1", "V")
_ONE_MODE_SOFTENING = 0.75
_SOFTENING_DOUBT = 0.1  # how far the kappa of a beam may be from that of one mode


def identify_decay(
    signal: xr.DataArray,
    *,
    modes: int = 1,
    frequencies: ArrayLike | None = None,
    method: str = "fit",
    start: float | None = None,
    stop: float | None = None,
    soften: bool = True,
    buckling_level: float | None = None,
) -> DecayFit:
    """Identify the modes of a free decay.

    Parameters
    ----------
    signal : xarray.DataArray
        Displacement [m or b], velocity, acceleration or voltage, evenly sampled, with its mean position of no
        concern.
    modes : int
        How many modes to look for, strongest first; each is filtered out for a first value and, with the
        method ``"fit"``, fitted together with the others.
    frequencies : array_like, optional
        Rough frequencies [Hz] of the modes, instead of *modes*.
    method : {"fit", "hilbert", "log_decrement"}
        Nonlinear least squares on the signal itself; regression on amplitude and phase of the analytic
        signal; regression on height and time of the maxima.
    start, stop : float, optional
        The part of the signal [s] that decays freely; all of it if left out.
    soften : bool
        Whether frequencies may depend on amplitude.
    buckling_level : float, optional
        b [m], for the centre's displacement or velocity: the softening is then held near 0.75 (a/b)^2, that
        of one mode, within 10 %, which narrows the frequency of a short decay.

    Returns
    -------
    DecayFit
        The truth is the frequency of vanishing amplitude.  Standard errors follow the noise near each mode
        and include what is not known of the law of softening.

    Raises
    ------
    InputError
        If the signal is unfit, fewer than 8 cycles long, or does not hold that many modes above the noise.
    """
    check_signal(signal, _UNITS, "signal")
    units = str(signal.attrs["units"])
    samples = _cut(check_signal(signal), start, stop)
    choice("method", method, METHODS)
    bands: list[float | None]
    if frequencies is not None:
        bands = [
            positive(f"frequencies[{i}]", float(f), "Hz") for i, f in enumerate(np.atleast_1d(frequencies))
        ]
    else:
        bands = [None] * integer("modes", modes, 1, 10)
    known = _known_softening(buckling_level, units, samples, bands[0])
    sigma = noise_level(samples)
    found: list[ModeEstimate] = []
    rest = samples
    cycles: Cycles | None = None
    for band in bands:
        center = _center(rest, band, found, sigma)
        maker = peak_cycles if method == "log_decrement" else hilbert_cycles
        first = maker(rest, center, sigma)
        estimate = regress(first, float(samples.time[0]), units, method, soften and not found)
        # once more about the mode's own mean frequency
        mean = float(np.polyfit(first.time, first.phase, 1, w=first.amplitude)[0] / (2.0 * math.pi))
        if 0.8 * center < mean < 1.2 * center:
            first = maker(rest, mean, sigma)
            estimate = regress(first, float(samples.time[0]), units, method, soften and not found)
        if cycles is None:
            cycles = first
        found.append(estimate)
        if method == "fit":
            result = fit_decay(samples, found, units, soften=soften, known=known)
            found = result.modes
        else:
            # the noise near the mode in place of that at the top of the spectrum
            result = explain(samples, found, units, soften)
            heard = first._replace(noise=first.noise * result.noise_near / sigma) if sigma > 0.0 else first
            found[-1] = regress(heard, float(samples.time[0]), units, method, soften and len(found) == 1)
        rest = SignalSamples(result.residual, samples.time, samples.sampling_freq)
    final = found
    assert cycles is not None
    notes = _notes(samples, final, result.noise_near, soften)
    free = [mode.natural_freq for mode in final]
    lines = [0.0, *free, *(2.0 * f for f in free)]
    near = white_variance(result.residual, samples.sampling_freq, free[0], lines, 3 * len(free))
    top = noise_level(SignalSamples(result.residual, samples.time, samples.sampling_freq))
    amplitude, freq, freq_se = backbone(cycles)
    power = final[0].amplitude ** 2 / 2.0
    return DecayFit(
        modes=tuple(final),
        noise_rms=result.noise_rms,
        snr=10.0 * math.log10(power / result.noise_rms**2) if result.noise_rms > 0.0 else math.inf,
        start=float(samples.time[0]),
        stop=float(samples.time[-1]),
        units=units,
        residual_whiteness=math.sqrt(near) / top if top > 0.0 else 1.0,
        notes=tuple(notes),
        backbone_amplitude=amplitude,
        backbone_freq=freq,
        backbone_freq_se=freq_se,
        envelope_time=cycles.time,
        envelope=cycles.amplitude,
    )


def _cut(samples: SignalSamples, start: float | None, stop: float | None) -> SignalSamples:
    low = samples.time[0] if start is None else finite("start", start)
    high = samples.time[-1] if stop is None else finite("stop", stop)
    inside = (samples.time >= low) & (samples.time <= high)
    if inside.sum() < 64:
        raise InputError(
            f"start = {low:g}, stop = {high:g}: hold {inside.sum()} samples of the signal, which runs from "
            f"{samples.time[0]:g} to {samples.time[-1]:g} s: must hold at least 64"
        )
    return SignalSamples(samples.values[inside], samples.time[inside], samples.sampling_freq)


def _center(rest: SignalSamples, band: float | None, found: list[ModeEstimate], sigma: float) -> float:
    span = rest.values.size / rest.sampling_freq
    if band is None:
        center = spectral_peak(rest, low=4.0 / span)
    else:
        center = spectral_peak(rest, low=0.8 * band, high=1.2 * band)
    if center * span < 8.0:
        raise InputError(f"signal spans {center * span:.1f} cycles of {center:g} Hz: must span at least 8")
    window = np.hanning(rest.values.size)
    spectrum = np.abs(np.fft.rfft((rest.values - rest.values.mean()) * window, 4 * rest.values.size)) ** 2
    freq = np.fft.rfftfreq(4 * rest.values.size, 1.0 / rest.sampling_freq)
    floor = sigma**2 * float(np.sum(window**2))
    if spectrum[np.abs(freq - center) <= 1.0 / span].max() < 20.0 * floor:
        names = ", ".join(f"{mode.natural_freq:.4g} Hz" for mode in found) or "none"
        raise InputError(f"signal: no further mode stands out of the noise (found: {names})")
    return center


def _known_softening(
    level: float | None, units: str, samples: SignalSamples, band: float | None
) -> tuple[float, float] | None:
    if level is None:
        return None
    b = positive("buckling_level", level, "m")
    if units == "m":
        scale = b
    elif units == "m/s":
        scale = b * 2.0 * math.pi * (band or spectral_peak(samples))
    else:
        raise InputError(f"buckling_level = {b:g}: is of use for a signal in m or m/s, not in {units}")
    kappa = _ONE_MODE_SOFTENING / scale**2
    return kappa, _SOFTENING_DOUBT * kappa


def _notes(samples: SignalSamples, modes: list[ModeEstimate], noise: float, soften: bool) -> list[str]:
    notes = []
    span = samples.values.size / samples.sampling_freq
    first = modes[0]
    fall = math.exp(-first.damping_ratio * 2.0 * math.pi * first.natural_freq * span)
    if fall > 0.7:
        notes.append(
            f"the record ends with {fall:.0%} of the amplitude left: damping is read from little decay"
        )
    if soften and abs(first.softening) * first.amplitude**2 > 0.1:
        notes.append("the frequency changes by more than 10 %: leave out the first cycles")
    if first.amplitude < 5.0 * noise:
        notes.append("the first mode starts less than 5 times above the noise")
    if first.damping_ratio < 2.0 * first.damping_ratio_se:
        notes.append("the damping ratio is not told from zero")
    return notes


@dataclass(frozen=True)
class WellComparison:
    """The natural frequencies [Hz] of the two wells, their difference, and whether they agree."""

    lower: float
    upper: float
    difference: float
    difference_se: float | None
    relative: float

    @property
    def agree(self) -> bool | None:
        """Whether the difference is within two standard errors; None if none were given."""
        return None if self.difference_se is None else abs(self.difference) <= 2.0 * self.difference_se

    @property
    def statement(self) -> str:
        """The comparison in words."""
        text = (
            f"wells at {self.lower:.5g} and {self.upper:.5g} Hz differ by {abs(self.difference):.3g} Hz "
            f"({abs(self.relative):.2%} of their mean)"
        )
        if self.difference_se is not None:
            text += f", standard error {self.difference_se:.2g} Hz"
        if self.agree:
            return text + ": equal within two standard errors"
        return text + ": the symmetric model has one frequency for both and cannot show this difference"


def compare_wells(
    lower: DecayFit | float,
    upper: DecayFit | float,
    lower_se: float | None = None,
    upper_se: float | None = None,
) -> WellComparison:
    """Compare the first natural frequency about the two wells.

    Parameters
    ----------
    lower, upper : DecayFit or float
        Decays about either well, or their frequencies [Hz].
    lower_se, upper_se : float, optional
        Standard errors of frequencies given as numbers.
    """
    values, errors = [], []
    for name, well, se in (("lower", lower, lower_se), ("upper", upper, upper_se)):
        if isinstance(well, DecayFit):
            values.append(well.natural_freq)
            errors.append(well.modes[0].natural_freq_se)
        else:
            values.append(positive(name, well, "Hz"))
            errors.append(math.nan if se is None else nonnegative(f"{name}_se", se, "Hz"))
    difference = values[0] - values[1]
    error = math.hypot(*errors)
    return WellComparison(
        lower=values[0],
        upper=values[1],
        difference=difference,
        difference_se=error if math.isfinite(error) else None,
        relative=difference / (0.5 * (values[0] + values[1])),
    )
