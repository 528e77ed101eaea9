"""Natural frequencies and damping ratios from a free decay.

The paper takes natural frequencies and the damping ratio from free vibration (sections 2 and 3.3).  The
frequency wanted is that of vanishing amplitude, so the dependence on amplitude is part of every method here;
see :mod:`snapbeam.lab.decay.model`.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.lab.decay.fit import FitResult, FitSettings, explain, noise_near
from snapbeam.lab.decay.joint_fit import fit_modes, mode_by_cycles
from snapbeam.lab.decay.model import Cycles, DecayFit, ModeEstimate, backbone, noise_level, regress
from snapbeam.lab.decay.poles import without_poles
from snapbeam.lab.decay.residual_diagnostics import (
    diagnostics_about,
    judged,
    misfit_of,
    sampled_diagnostics,
    with_doubts,
)
from snapbeam.lab.decay.window import find_centres, noise_fall, prepared, undone, unexplained
from snapbeam.lab.diagnostics import KINDS_DECAY
from snapbeam.lab.signals import SignalSamples, check_signal
from snapbeam.util.diagnostics import diagnostics_of
from snapbeam.util.validation import InputError, choice, finite_array, integer, positive, within

if TYPE_CHECKING:
    import xarray as xr


_Array = NDArray[np.float64]
METHODS = ("fit", "hilbert", "log_decrement")
_UNITS = ("m", "b", "m/s", "m/s^2", "1", "V", "Pa")
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
    exponential_window: float | None = None,
) -> DecayFit:
    """Identify the modes of a free decay.

    Parameters
    ----------
    signal : xarray.DataArray
        Displacement [m or b], velocity, acceleration or voltage, evenly sampled.
    modes : int
        Number of modes, strongest first, by the matrix pencil (:mod:`snapbeam.lab.decay.poles`).
    frequencies : array_like, optional
        Approximate frequencies [Hz] of the modes, within 10 %, instead of *modes*.
    method : {"fit", "hilbert", "log_decrement"}
        Nonlinear least squares on the signal, of all modes together; regression on amplitude and phase of the analytic
        signal; or on height and time of the maxima.
    start, stop : float, optional
        Part of the signal [s] that decays freely. By default it starts where the motion sets in, not cut off, and ends
        at a second hit.
    soften : bool
        True if frequencies may depend on amplitude.
    buckling_level : float, optional
        Buckling level b [m], for displacement or velocity of mid-span: the softening then has the prior 0.75 (a/b)^2 of
        one mode, within 10 %.
    exponential_window : float, optional
        Time constant T [s] of a window exp(-t/T) of the analyser, to correct.

    Returns
    -------
    DecayFit
        Frequencies and damping ratios at zero amplitude. If the damping depends on amplitude (dry friction, quadratic
        drag, or a monotone curve), the standard error contains the spread of all forms that fit, and
        ``decay.damping_curve`` states the lowest amplitude. Standard errors follow the noise near each mode and the
        softening law. A residual above the noise adds the differences between parts of the decay, with a diagnostic.

    Raises
    ------
    InputError
        If the signal is unfit, has fewer than 8 cycles, or fewer modes above the noise.

    Examples
    --------
    >>> import numpy as np
    >>> from snapbeam import lab
    >>> time = np.arange(20000) / 10e3
    >>> noise = 1e-7 * np.random.default_rng(0).standard_normal(time.size)
    >>> decay = 1e-4 * np.exp(-0.005 * 2 * np.pi * 80 * time) * np.cos(2 * np.pi * 80 * time) + noise
    >>> signal = lab.make_signal(decay, "m", 10e3)
    >>> fit = lab.identify_decay(signal)
    >>> f"{fit.modes[0].natural_frequency:.2f} Hz, {fit.modes[0].damping_ratio:.4f}"
    '80.00 Hz, 0.0050'
    """
    check_signal(signal, _UNITS, "signal")
    units = str(signal.attrs["units"])
    choice("method", method, METHODS)
    count = integer("modes", modes, 1, 10)
    asked = None
    if frequencies is not None:
        given = np.atleast_1d(finite_array("frequencies", frequencies)).tolist()
        asked = [positive(f"frequencies[{i}]", f, "Hz") for i, f in enumerate(given)]
    if asked == []:
        raise InputError("frequencies = []: must hold at least one frequency, Hz")
    samples = check_signal(signal)
    if exponential_window is not None:
        samples = undone(samples, positive("exponential_window", exponential_window, "s"))
    decay = prepared(samples, start, stop, buckling_level is not None)
    centres = find_centres(decay, count, asked)
    told = list(centres.told)
    settings = FitSettings(units, soften, _known_softening(buckling_level, units, centres.wanted[0]))
    diagram = centres.diagram
    if method == "fit":
        made = fit_modes(decay, centres, settings)
        if made[4] is None and unexplained(made[1].residual, made[0].sampling_frequency):
            # other modes may be in the record: once more with them known, unless what bends a decay was taken for modes
            known = find_centres(decay, 1, [made[1].modes[0].natural_frequency])
            again = fit_modes(decay, known, settings)
            if again[1].noise_rms < made[1].noise_rms:
                made, centres, told = again, known, []
        samples, result, cycles, more, diagram = made
        told += more
    else:
        samples = without_poles(decay.samples, centres.far, centres.own)
        result, cycles = _by_cycles(samples, centres.wanted, units, soften, method)
    misfit = misfit_of(samples, result.residual, result.modes)
    if method != "fit":  # what its own errors leave is no misfit of the law
        misfit = misfit._replace(ratio=0.4 * misfit.ratio)
    estimates, doubts = judged(samples, result, cycles, misfit, soften)
    wanted = tuple(estimates[: len(centres.wanted)])
    doubts += diagnostics_about(samples, wanted, result.noise_near, soften)
    doubts += sampled_diagnostics(wanted, decay.samples.sampling_frequency)
    left = samples._replace(values=result.residual)
    omega = 2.0 * math.pi * wanted[0].natural_frequency
    falls = noise_fall(left, wanted[0].natural_frequency, omega * wanted[0].damping_ratio)
    if falls is not None:
        added = 100.0 * falls.rate / omega
        doubts.append(
            KINDS_DECAY["window"].found(factor=falls.factor, constant=1.0 / falls.rate, added_percent=added)
            if falls.even
            else KINDS_DECAY["fade"].found(factor=falls.factor, added_percent=added)
        )
    wanted = with_doubts(wanted, decay.doubt, falls.rate if falls is not None else 0.0)
    free = [mode.natural_frequency for mode in wanted]
    near = noise_near(samples.sampling_frequency, result.residual, free[0], free, 3 * len(free))
    top = noise_level(left)
    amplitude, freq, freq_se = backbone(cycles)
    power = wanted[0].amplitude ** 2 / 2.0
    return DecayFit(
        modes=wanted,
        noise_rms=result.noise_rms,
        snr=10.0 * math.log10(power / result.noise_rms**2) if result.noise_rms > 0.0 else math.inf,
        start=float(samples.time[0]),
        stop=float(samples.time[-1]),
        units=units,
        residual_whiteness=near / top if top > 0.0 else 1.0,
        misfit=misfit.ratio,
        lines=decay.lines,
        poles=diagram,
        diagnostics=(*diagnostics_of(signal), *decay.diagnostics, *told, *doubts),
        backbone_amplitude=amplitude,
        backbone_frequency=freq,
        backbone_frequency_se=freq_se,
        envelope_time=cycles.time,
        envelope=cycles.amplitude,
    )


def _by_cycles(
    samples: SignalSamples, centres: list[float], units: str, soften: bool, method: str
) -> tuple[FitResult, Cycles]:
    """Each mode by its cycles, the ones before filtered out."""
    sigma = noise_level(samples)
    rest = samples
    found: list[ModeEstimate] = []
    kept: Cycles | None = None
    result: FitResult | None = None
    for center in centres:
        estimate, cycles = mode_by_cycles(rest, center, sigma, units, method, soften and not found)
        kept = kept or cycles
        found.append(estimate)
        # the noise near the mode in place of that at the top of the spectrum
        result = explain(samples, found, units, soften)
        heard = cycles._replace(noise=cycles.noise * result.noise_near / sigma) if sigma > 0.0 else cycles
        found[-1] = regress(heard, float(samples.time[0]), units, method, soften and len(found) == 1)
        result = result._replace(modes=list(found))
        rest = samples._replace(values=result.residual)
    assert kept is not None and result is not None
    return result, kept


def _known_softening(level: float | None, units: str, frequency: float) -> tuple[float, float] | None:
    if level is None:
        return None
    b = within("buckling_level", level, 1e-12, 1e3, closed="both", unit="m")
    if units == "m":
        scale = b
    elif units == "m/s":
        scale = b * 2.0 * math.pi * frequency
    else:
        raise InputError(f"buckling_level = {b:g}: is of use for a signal in m or m/s, not in {units}")
    kappa = _ONE_MODE_SOFTENING / scale**2
    return kappa, _SOFTENING_DOUBT * kappa
