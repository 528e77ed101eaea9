"""The mean shape of the beam's edge, finer than a pixel, and what it says of the camera's curve.

The edge crosses pixels at every phase, so the windows of a sample together hold its shape in steps of a
fraction of a pixel.  In light the edge is symmetric about itself, whatever the lens; a camera that stores
light**gamma bends it, and a step fitted to the bent edge lies off the true one.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from snapbeam.lab.tracking.edges import EdgeFit, Floats, edge_profile
from snapbeam.lab.tracking.scene import EdgeShape

__all__ = ["CLIPPED", "edge_shape"]

CLIPPED = 0.1  # share of saturated pixels in the middle of the beam that counts as overexposed
_CLIPPED_SHIFT = 0.5  # px by which the edge of an overexposed object may lie off
_STEP = 0.25  # px
_REACH = 5.0
_LEAST = 200  # windows
_CERTAIN = 30.0  # chi-square by which a bent edge must be worse than a straight one
_LIKELY = 0.4  # |log gamma| of a curve that is taken before stronger ones
_CENTRES = 24  # tried on either side of 0
_GAMMAS = np.exp(np.linspace(math.log(0.25), math.log(4.0), 81))


def edge_shape(
    windows: Floats, fit: EdgeFit, good: NDArray[np.bool_], width: float, sign: float, clipped: float
) -> EdgeShape:
    """Judge the mean edge of many windows.

    Parameters
    ----------
    windows, fit
        Grey levels (..., rows) and what :func:`fit_edges` made of them with *width* and *sign*.
    good
        Which windows to use.
    width, sign
        Blur of the edges [px]; +1 for objects brighter than the background.
    clipped
        Share of saturated pixels in the middle of the beam.
    """
    data, position = windows[good], fit.position[good]
    unknown = EdgeShape(math.nan, math.nan, math.nan, _CLIPPED_SHIFT if clipped > CLIPPED else 0.0, clipped)
    if data.shape[0] < _LEAST:
        return unknown
    rows = data.shape[-1]
    offset = np.arange(rows) - (rows - 1) / 2.0 - position[:, None]
    # each window by its own levels, so that uneven light does not count
    contrast = fit.contrast[good]
    model = edge_profile(offset, width)
    level = (data * sign).mean(-1) - contrast * model.mean(-1)
    share = (data * sign - level[:, None]) / contrast[:, None]
    x, y, error = _binned(offset, share)
    if x.size < 24 or clipped > CLIPPED:
        return unknown
    misfit = float(np.sqrt(np.mean((y - edge_profile(x, width)) ** 2)))
    dark = level if sign > 0 else -(level + contrast)
    ratio = float(np.median(dark / contrast))  # the dark side's grey level over the contrast
    if not ratio > 1e-3:
        return EdgeShape(misfit, math.nan, math.nan, 0.0, clipped)
    gamma, error_of_gamma, shift = _symmetry(x, y, error, ratio, sign)
    return EdgeShape(misfit, gamma, error_of_gamma, shift, clipped)


def _symmetry(x: Floats, y: Floats, error: Floats, ratio: float, sign: float) -> tuple[float, float, float]:
    """Gamma that makes the edge symmetric in light, its standard error, and where its centre then lies.

    The centre is 0 where a linear camera will do.
    """
    outer = np.abs(x) > 0.8 * np.abs(x).max()
    low, high = float(y[outer & (x < 0.0)].mean()), float(y[outer & (x > 0.0)].mean())
    y, error = (y - low) / (high - low), error / (high - low)
    found = np.array([_asymmetry(x, *_light(y, error, gamma, ratio, sign)) for gamma in _GAMMAS])
    scatter, centres = found[:, 0], found[:, 1]
    best = int(np.argmin(scatter))
    freedom = max(float(np.count_nonzero((x > 0.0) & (x < 4.0))) - 2.0, 1.0)
    unit = max(1.0, scatter[best] / freedom)
    # a strong curve can bend one symmetric edge into another: one near 1 that does as well is the likelier, if curves
    # on both sides of it do worse; where they only get worse towards 1, the strong one is what bent the edge
    likely = np.flatnonzero(np.abs(np.log(_GAMMAS)) < _LIKELY)
    other = int(likely[np.argmin(scatter[likely])])
    least = scatter[other] <= scatter[[other - 1, other + 1]].min()
    if least and (scatter[other] - scatter[best]) / unit < _CERTAIN:
        best, unit = other, max(1.0, scatter[other] / freedom)
    worse = (float(np.interp(0.0, np.log(_GAMMAS), scatter)) - scatter[best]) / unit
    alike = (np.abs(scatter - scatter[best]) / unit < 1.0) & (
        np.abs(np.log(_GAMMAS / _GAMMAS[best])) < _LIKELY
    )
    spread = np.log(_GAMMAS[alike])
    log_se = max(0.5 * float(np.ptp(spread)), 0.5 * math.log(_GAMMAS[1] / _GAMMAS[0]))
    gamma = float(_GAMMAS[best])
    shift = float(centres[best]) if worse > _CERTAIN else 0.0
    return gamma, gamma * log_se, shift


def _light(y: Floats, error: Floats, gamma: float, ratio: float, sign: float) -> tuple[Floats, Floats]:
    """Shares of light and their errors, from shares of grey levels that are light**gamma."""
    bright = y if sign > 0 else 1.0 - y
    grey = np.maximum(bright + ratio, 1e-6)
    low, high = ratio ** (1.0 / gamma), (1.0 + ratio) ** (1.0 / gamma)
    light = (grey ** (1.0 / gamma) - low) / (high - low)
    slope = grey ** (1.0 / gamma - 1.0) / gamma / (high - low)
    return (light if sign > 0 else 1.0 - light), error * slope


def _asymmetry(x: Floats, light: Floats, error: Floats) -> tuple[float, float]:
    """Chi-square of an edge turned about its centre against itself, least over the centre, and the centre."""
    away = np.arange(0.5, 4.0 / _STEP) * _STEP

    def chi(centre: float) -> float:
        total = np.interp(centre + away, x, light) + np.interp(centre - away, x, light) - 1.0
        spread = np.hypot(np.interp(centre + away, x, error), np.interp(centre - away, x, error))
        return float(np.sum((total / np.hypot(spread, 5e-4)) ** 2))

    near = min(np.linspace(-0.8, 0.8, 2 * _CENTRES + 1), key=chi)
    step = 0.8 / _CENTRES
    found = minimize_scalar(chi, bounds=(near - step, near + step), method="bounded", options={"xatol": 1e-4})
    return float(found.fun), float(found.x)


def _binned(offset: Floats, share: Floats) -> tuple[Floats, Floats, Floats]:
    """Mean offset, mean share and its standard error in steps of a fraction of a pixel."""
    index = np.floor((offset + _REACH) / _STEP).astype(int)
    inside = (index >= 0) & (index < int(2 * _REACH / _STEP))
    index, x, y = index[inside], offset[inside], share[inside]
    count = np.bincount(index)
    full = count >= 8
    total = np.maximum(count, 1)
    mean_x, mean = np.bincount(index, x) / total, np.bincount(index, y) / total
    variance = np.bincount(index, y * y) / total - mean**2
    error = np.sqrt(np.maximum(variance, 0.0) / total)
    return mean_x[full], mean[full], error[full]
