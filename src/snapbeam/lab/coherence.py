"""Frequency response and coherence of two measured signals, with their random errors."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from snapbeam.lab.diagnostics import KINDS_RESPONSE, holding
from snapbeam.lab.signals import SignalSamples, check_signal, stretches
from snapbeam.util.diagnostics import Diagnostic, to_json
from snapbeam.util.singular_values import pinv
from snapbeam.util.validation import InputError, checked, choice, positive

if TYPE_CHECKING:
    import xarray as xr

_Array = NDArray[np.float64]
_SEGMENTS = 31
"""Segments, half of each overlapping the next, where no resolution is given: 16 independent ones."""
_LEAST_SEGMENTS = 7
_OVERLAP = 1.0 / 36.0
"""Squared correlation of the spectra of two Hann windows that overlap by half."""
_BIAS = 0.02
"""Relative bias of a line by the window above which it is told."""
_CORRELATED = 35.0 / 18.0
"""Lines of a Hann window over those that are independent."""
_LEAST_LINES = 5
_WIDE = 8
"""Lines in the half-power bandwidth of a peak from which its bias is below 2 %."""
_UNRELATED = 0.05
"""Probability that the coherence of unrelated signals exceeds its limit."""
_NEIGHBOURS = 6
"""Neighbouring coherent lines that neither chance nor a single sine makes: a Hann window widens a sine to four."""


@checked
def frequency_response(
    excitation: xr.DataArray, response: xr.DataArray, *, resolution: float | None = None, estimator: str = "h1"
) -> xr.Dataset:
    """Estimate the frequency response and the coherence of two signals by Welch's method.

    With the densities S of Hann windows that overlap by half, H1 = S_xy/S_xx is unbiased by noise of the response, H2 =
    S_yy/S_yx by noise of the excitation. The coherence is ``|S_xy|**2 / (S_xx S_yy)``; sqrt((1 - coherence)/(2 n
    coherence)) with n independent segments is the relative standard error of the magnitude, and that of the phase in
    rad (J. S. Bendat and A. G. Piersol, *Random Data*, 4th ed., section 9.2). A nonlinear system has the response of
    its best linear approximation.

    Parameters
    ----------
    excitation, response : xarray.DataArray
        Signals with one sampling frequency and clock; their common part is used.
    resolution : float, optional
        Distance of the lines [Hz]; by default that of 31 segments.
    estimator : {"h1", "h2"}

    Returns
    -------
    xarray.Dataset
        ``magnitude`` and ``phase`` [rad] with ``magnitude_se`` and ``phase_se``, and ``coherence``, over ``frequency``
        [Hz]. ``window_bias`` is the relative bias of the magnitude, 0 away from the highest peak. Unrelated signals
        exceed the attribute ``coherence_limit`` at 5 % of the lines. If the mode can be fitted: ``peak_frequency``
        [Hz], ``peak_magnitude``, ``peak_damping_ratio``, each with ``..._se``.

    Raises
    ------
    InputError
        If sampling frequencies or clocks differ, or the signals are too short.

    Examples
    --------
    >>> import numpy as np
    >>> from snapbeam import lab
    >>> force = lab.make_signal(np.random.default_rng(0).standard_normal(20_000), "N", 2000.0)
    >>> motion = lab.make_signal(0.002 * force.values, "m", 2000.0)
    >>> found = lab.frequency_response(force, motion, resolution=5.0)
    >>> line = found.sel(frequency=100.0, method="nearest")
    >>> print(f"{line.magnitude.item():.4f} {line.magnitude.attrs['units']}")
    0.0020 m/N
    """
    from scipy.signal import csd

    from snapbeam.util.datasets import xr

    choice("estimator", estimator, ("h1", "h2"))
    x, y = _common(check_signal(excitation, name="excitation"), check_signal(response, name="response"))
    rate, size = x.sampling_frequency, x.values.size
    if resolution is None:
        length = 2 * size // (_SEGMENTS + 1)
    else:
        length = round(rate / positive("resolution", resolution, "Hz"))
    count = 2 * size // max(length, 1) - 1
    if length < 8 or count < _LEAST_SEGMENTS:
        least = rate * (_LEAST_SEGMENTS + 1) / (2 * size)
        raise InputError(
            f"resolution = {rate / max(length, 1):.4g} Hz: must be from {least:.4g} to {rate / 8.0:.4g} Hz for "
            f"{size / rate:.4g} s of both signals"
        )
    settings = {"fs": rate, "nperseg": length, "detrend": "constant"}
    frequency, cross = csd(x.values, y.values, **settings)
    power_x, power_y = (csd(each, each, **settings)[1].real for each in (x.values, y.values))
    inside = (frequency > 0.0) & (power_x > 0.0) & (power_y > 0.0)
    if not inside.any():
        raise InputError("excitation or response: must not be constant")
    frequency, cross, power_x, power_y = (each[inside] for each in (frequency, cross, power_x, power_y))
    coherence = np.clip(np.abs(cross) ** 2 / (power_x * power_y), 0.0, 1.0)
    ratio = cross / power_x if estimator == "h1" else power_y / np.where(cross == 0.0, np.inf, cross.conj())
    averages = count / (1.0 + 2.0 * _OVERLAP * (count - 1) / count)
    error = np.sqrt((1.0 - coherence) / (2.0 * averages * np.maximum(coherence, 1e-300)))
    limit = 1.0 - _UNRELATED ** (1.0 / (averages - 1.0))
    above, below = (str(each.attrs["units"]) for each in (response, excitation))
    unit = "1" if above == below else "/".join(f"({each})" if "/" in each else each for each in (above, below))
    columns = {
        "magnitude": (np.abs(ratio), unit, "magnitude of the frequency response"),
        "magnitude_se": (np.abs(ratio) * error, unit, "standard error of the magnitude"),
        "phase": (np.angle(ratio), "rad", "phase of the frequency response"),
        # a phase without any relation is uniform
        "phase_se": (np.minimum(error, math.pi / math.sqrt(3.0)), "rad", "standard error of the phase"),
        "coherence": (coherence, "1", "coherence"),
    }
    found = xr.Dataset(
        {name: ("frequency", values, {"units": u, "long_name": words}) for name, (values, u, words) in columns.items()},
        {"frequency": ("frequency", frequency, {"units": "Hz", "long_name": "frequency"})},
        {
            "title": "frequency response", "estimator": estimator, "window": "hann", "segments": count,
            "independent_segments": averages, "resolution": rate / length, "coherence_limit": limit,
            "excitation": str(excitation.name), "response": str(response.name), "excitation_units": below,
            "response_units": above,
        },
    )  # fmt: skip
    bias = _peak_bias(found, ratio)
    words = {"units": "1", "long_name": "relative bias of the magnitude by the window"}
    found["window_bias"] = "frequency", bias, words
    found["magnitude_se"] = found["magnitude_se"].copy(data=np.abs(ratio) * np.hypot(error, bias / (1.0 + bias)))
    found.attrs["diagnostics"] = to_json(_diagnostics(found))
    return found


def windowed_pole(turn: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """The response 1/s of a pole as spectra of Hann windows of length 1 give it; its limit for Re s >> 1 is 1/s.

    It is the Laplace transform of the window's autocorrelation on (0, 1), by which the expected cross-correlation of a
    segment multiplies an impulse response: (1 - t) (2 + cos 2 pi t)/3 + sin(2 pi t)/(2 pi).
    """
    low, high = turn - 2j * math.pi, turn + 2j * math.pi

    def constant(s: NDArray[np.complex128]) -> NDArray[np.complex128]:
        return np.asarray(-np.expm1(-s) / s)

    def falling(s: NDArray[np.complex128]) -> NDArray[np.complex128]:
        return np.asarray((s + np.expm1(-s)) / s**2)

    return np.asarray(
        2.0 / 3.0 * falling(turn) + (falling(low) + falling(high)) / 6.0
        + (constant(low) - constant(high)) / (4j * math.pi)
    )  # fmt: skip


def _peak_bias(found: xr.Dataset, ratio: NDArray[np.complex128]) -> _Array:
    """Relative bias of each line by the mode at the highest coherent peak, fitted to the lines about it.

    Its numbers become attributes of *found*.  Where the lines are too few the bias is 0.
    """
    from scipy.optimize import least_squares

    bias = np.zeros(ratio.size)
    coherent, _ = coherent_lines(found)
    size = np.where(coherent, np.abs(ratio), 0.0)
    top = int(np.argmax(size))
    if not size[top] > 0.0:
        return bias
    high, seen = (
        next(each for each in stretches(part) if each[0] <= top < each[1])
        for part in (size > 0.5 * size[top], coherent)
    )
    reach = max(top - high[0] + 1, high[1] - top, _LEAST_LINES // 2)
    lines = slice(max(top - reach, seen[0]), min(top + reach + 1, seen[1]))
    falls = seen[0] < high[0] and high[1] < seen[1]  # to half its height on either side
    if not falls or lines.stop - lines.start < _LEAST_LINES:
        return bias
    frequency, spacing = found["frequency"].values, float(found.attrs["resolution"])
    k = (frequency[lines] - frequency[top]) / spacing
    values = ratio[lines]
    # of a computed signal without noise the window's own scatter remains
    sigma = np.hypot(found["magnitude_se"].values[lines], 1e-6 * size[top])
    both = found.attrs["estimator"] == "h2"

    def poles(decay: float, middle: float) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
        """Responses of the pole through the window and without it."""
        turn = math.exp(decay) + 2j * math.pi * (k - middle)
        pole = windowed_pole(turn)
        # H2 divides by it the windowed autocorrelation of the response
        return (pole.real / (turn.real * pole.conj()) if both else pole), 1.0 / turn

    def misfit(p: _Array) -> _Array:
        left = ((p[2] + 1j * p[3]) * poles(p[0], p[1])[0] + p[4] + 1j * p[5] - values) / sigma
        return np.concatenate([left.real, left.imag])

    wide = max(float(np.sum(size[lines] > size[top] / math.sqrt(2.0))) - 1.0, 0.3)
    decay = math.log(math.pi * wide)
    first = values[top - lines.start] / poles(decay, 0.0)[0][top - lines.start]
    start = np.array([decay, 0.0, first.real, first.imag, 0.0, 0.0])
    answer = least_squares(misfit, start, x_scale="jac", method="lm")
    p = answer.x
    freedom = 2 * k.size - p.size
    stray = max(2.0 * answer.cost / max(freedom, 1), 1.0) * _CORRELATED
    if not answer.success or not abs(p[1]) < 2.0 or not -5.0 < p[0] < math.log(math.pi * k.size):
        return bias
    covariance = pinv(answer.jac.T @ answer.jac) * stray

    def numbers(p: _Array) -> _Array:
        """Frequency, magnitude there without the window, and damping ratio."""
        middle = frequency[top] + p[1] * spacing
        height = abs((p[2] + 1j * p[3]) / math.exp(p[0]) + p[4] + 1j * p[5])
        return np.array([middle, height, math.exp(p[0]) * spacing / (2.0 * math.pi * middle)])

    if not (np.isfinite(covariance).all() and np.diag(covariance).min() > 0.0):
        return bias
    value = numbers(p)
    steps = 1e-4 * np.sqrt(np.diag(covariance))
    slope = np.column_stack([(numbers(p + step) - numbers(p - step)) / 2e-4 for step in np.diag(steps)])
    scale = np.sqrt(np.diag(covariance))
    errors = np.sqrt(np.diag(slope @ (covariance / np.outer(scale, scale)) @ slope.T))
    other = p[4] + 1j * p[5]
    through, true = ((p[2] + 1j * p[3]) * pole + other for pole in poles(p[0], p[1]))
    names = [f"peak_{name}{more}" for more in ("", "_se") for name in ("frequency", "magnitude", "damping_ratio")]
    found.attrs |= dict(zip(names, [*value.tolist(), *errors.tolist()], strict=True))
    bias[lines] = np.abs(through) / np.abs(true) - 1.0
    return bias


def _common(x: SignalSamples, y: SignalSamples) -> tuple[SignalSamples, SignalSamples]:
    """The part of both signals in which each sample of one has one of the other at the same time."""
    size = min(x.values.size, y.values.size)
    if abs(x.sampling_frequency / y.sampling_frequency - 1.0) * size > 0.1:
        raise InputError(
            f"response: is sampled at {y.sampling_frequency:.6g} Hz, excitation at {x.sampling_frequency:.6g} Hz: both must "
            "have the same sampling frequency"
        )
    lead = (y.time[0] - x.time[0]) * x.sampling_frequency
    whole = round(lead)
    if abs(lead - whole) > 0.01:
        raise InputError(
            f"response: begins {abs(lead - whole):.2f} of a sample between those of excitation: both must be sampled at the "
            "same times"
        )
    first = (max(whole, 0), max(-whole, 0))
    size = min(x.values.size - first[0], y.values.size - first[1])
    if size < 2:
        raise InputError("response: has no time in common with excitation")
    parts = [each.part(slice(at, at + size)) for each, at in zip((x, y), first, strict=True)]
    return parts[0], parts[1]


def coherent_lines(found: xr.Dataset) -> tuple[NDArray[np.bool_], int]:
    """Lines of a frequency response that are coherent with their neighbours, and the most neighbouring ones."""
    seen = stretches(found["coherence"].values > found.attrs["coherence_limit"])
    coherent = np.zeros(found.sizes["frequency"], dtype=bool)
    for first, last in seen:
        coherent[first:last] = last - first >= _NEIGHBOURS
    return coherent, max((last - first for first, last in seen), default=0)


def _diagnostics(found: xr.Dataset) -> list[Diagnostic]:
    """Findings about the coherence, and about the resolution of the highest peak."""
    coherent, longest = coherent_lines(found)
    if not coherent.any():
        return [KINDS_RESPONSE["incoherent"].found(lines=longest)]
    size = np.where(coherent, found["magnitude"].values, 0.0)
    top = int(np.argmax(size))
    bias = float(found["window_bias"].values[top])
    if "peak_magnitude" not in found.attrs:
        first, last = next(each for each in stretches(size > size[top] / math.sqrt(2.0)) if each[0] <= top < each[1])
        if first == 0 or last == size.size or last - first >= _WIDE:
            return []
        return [KINDS_RESPONSE["no_mode"].found(frequency=float(found["frequency"].values[top]))]
    frequency, magnitude = (float(found.attrs[f"peak_{name}"]) for name in ("frequency", "magnitude"))
    numbers = {"bias_percent": 100.0 * bias, "frequency": frequency, "magnitude": magnitude}
    return holding(KINDS_RESPONSE, ("coarse", abs(bias) > _BIAS, numbers))
