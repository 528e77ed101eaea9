"""Sub-pixel edges: the blurred step as a camera sees it, and its least-squares fit in many windows at once.

A pixel integrates light over its area, so an edge at row y blurred by a Gaussian of standard deviation s is

    E(r - y) = integral over [r - 1/2, r + 1/2] of Phi((v - y)/s) dv = s [G(z2) - G(z1)],

with z1,2 = (r - y -+ 1/2)/s and G(z) = z Phi(z) + phi(z).  Fitting a + c E(r - y) gives the position
without the bias towards pixel centres that thresholds and plain centroids have, and its error in white
noise of standard deviation n is near the bound sqrt(2 sqrt(pi) s) n/c pixels for each column.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

Floats = NDArray[np.floating]
_ALIKE = 0.1  # correlation of columns that counts
MIN_WIDTH = 0.05
_ROOT_2PI = math.sqrt(2.0 * math.pi)


class EdgeFit(NamedTuple):
    """Edges fitted in windows; every field has the shape of the windows without their last axis.

    ``position`` is the row of the edge, counted from the middle of the window; NaN where no step of the wanted sign
    was found inside it.  ``contrast`` is the height of the step, ``residual`` the standard deviation about the fit,
    ``width`` the blur [px] that would fit best, to first order about the assumed one.
    """

    position: Floats
    contrast: Floats
    residual: Floats
    width: Floats


def edge_profile(offset: Floats, width: float) -> Floats:
    """Light in a pixel whose centre lies *offset* rows beyond an edge of blur *width* [px], from 0 to 1."""
    s = max(width, MIN_WIDTH)
    high, low = (offset + 0.5) / s, (offset - 0.5) / s
    above = high * ndtr(high) + np.exp(-0.5 * high * high) / _ROOT_2PI
    return s * (above - low * ndtr(low) - np.exp(-0.5 * low * low) / _ROOT_2PI)


def _pair(data: NDArray, first: NDArray[np.intp], second: NDArray[np.intp]) -> Floats:
    """Mean of two values of each row."""
    return np.asarray(np.take_along_axis(data, np.stack([first, second], axis=-1), axis=-1).mean(-1))


def _terms(position: Floats, rows: int, width: float) -> tuple[Floats, Floats, Floats]:
    """Return the profile over *rows* about an edge at *position*, and its derivatives by position and width.

    Neighbouring pixels share a border, so everything follows from values at rows + 1 borders.
    """
    s = max(width, MIN_WIDTH)
    z = (np.arange(rows + 1) - rows / 2.0 - position[..., None]) / s
    share, density = ndtr(z), np.exp(-0.5 * z * z) / _ROOT_2PI
    return s * np.diff(z * share + density), -np.diff(share), np.diff(density)


def fit_edges(
    windows: NDArray[np.floating],
    width: float,
    *,
    sign: float = 1.0,
    weights: Floats | None = None,
    iterations: int = 4,
) -> EdgeFit:
    """Fit a blurred step a + c E(r - y) to the last axis of *windows*, an odd number of rows, by Gauss-Newton.

    *width* is the blur [px], *sign* +1 for levels that rise with the row, *weights* are 0 for pixels to leave out.
    From a start within 3 pixels four steps leave less than 1e-3 px.
    """
    data = np.asarray(windows, dtype=np.float64) * sign
    rows = data.shape[-1]
    offsets = np.arange(rows) - (rows - 1) / 2.0
    ones = np.ones_like(data) if weights is None else np.asarray(weights, dtype=np.float64)
    total = ones.sum(-1)

    def centred(values: Floats) -> Floats:
        mean = (ones * values).sum(-1) / total
        return (values - mean[..., None]) * ones

    with np.errstate(divide="ignore", invalid="ignore"):
        # Start: the step between the levels at the ends of the window that has the same mean.
        used = ones > 0.0
        first, last = used.argmax(-1), rows - 1 - used[..., ::-1].argmax(-1)
        low = _pair(data, first, np.minimum(first + 1, last))
        high = _pair(data, last, np.maximum(last - 1, first))
        middle = (ones * offsets).sum(-1) / total
        share = ((ones * data).sum(-1) / total - low) / (high - low)
        position = middle + total * (0.5 - np.clip(np.where(np.isfinite(share), share, 0.5), 0.0, 1.0))
        p = centred(data)
        for _ in range(iterations):
            profile, slope, _ = _terms(position, rows, width)
            f, d = centred(profile), centred(slope)
            ff, fd, dd = (f * f).sum(-1), (f * d).sum(-1), (d * d).sum(-1)
            fp, dp = (f * p).sum(-1), (d * p).sum(-1)
            determinant = ff * dd - fd * fd
            contrast = (fp * dd - dp * fd) / determinant
            step = (dp * ff - fp * fd) / determinant / contrast
            position = position + np.clip(np.where(np.isfinite(step), step, 0.0), -1.5, 1.5)
            position = np.clip(position, offsets[0], offsets[-1])
        profile, _, by_width = _terms(position, rows, width)
        f, g = centred(profile), centred(by_width)
        ff, fg, gg = (f * f).sum(-1), (f * g).sum(-1), (g * g).sum(-1)
        fp, gp = (f * p).sum(-1), (g * p).sum(-1)
        contrast = fp / ff
        best = (gp * ff - fp * fg) / (gg * fp - gp * fg)
        misfit = p - contrast[..., None] * f
        residual = np.sqrt((misfit * misfit).sum(-1) / np.maximum(total - 3.0, 1.0))
        inside = (np.abs(position - middle) < total / 2.0 - 0.5) & (contrast > 0.0) & (total >= 5.0)
    return EdgeFit(np.where(inside, position, np.nan), contrast, residual, width + best)


def width_calibration(width: float, rows: int) -> tuple[Floats, Floats]:
    """(apparent, true) widths: what :func:`fit_edges` at *width* reports for edges of other widths.

    Its estimate is of first order and saturates for wide edges; interpolating in this table undoes that.
    """
    true = np.geomspace(0.2, 12.0, 60)
    offsets = np.arange(rows) - (rows - 1) / 2.0
    windows = np.stack([edge_profile(offsets, float(one)) for one in true])
    apparent = fit_edges(windows, width).width
    return np.maximum.accumulate(apparent) + 1e-9 * np.arange(true.size), true


def edge_noise(width: float, noise: float, contrast: float) -> float:
    """Minimum standard deviation [px] of an edge in white noise n, step c, blur s: sqrt(2 sqrt(pi) s) n/c, or 0."""
    least = math.sqrt(2.0 * math.sqrt(math.pi) * max(width, MIN_WIDTH)) * noise / max(contrast, 1e-12)
    return least if math.isfinite(least) else 0.0


def masked_median(values: NDArray, kept: NDArray[np.bool_]) -> Floats:
    """Median of the kept values along the last axis, NaN where none is."""
    count = kept.sum(-1)
    ordered = np.sort(np.where(kept, values, np.inf), axis=-1)
    middle = _pair(ordered, np.maximum(count - 1, 0) // 2, np.minimum(count // 2, values.shape[-1] - 1))
    return np.where(count > 0, middle, np.nan)


def alike_columns(off: Floats, kept: NDArray[np.bool_], fitted: int) -> float:
    """Variance of a mean over columns, over that of columns independent of each other: 1 + 2 sum of correlations.

    Texture and dust shift edges of neighbouring columns alike.  The correlations of residuals *off* are pooled over
    frames up to the first that is small, and those that *fitted* parameters take out are added.
    """
    off = np.where(kept, off, 0.0)
    count = max(float(kept.sum(-1).mean()), 1.0)
    power = float((off * off).sum()) / max(int(kept.sum()), 1)
    total = 1.0
    for lag in range(1, off.shape[-1] // 2):
        both = int((kept[..., lag:] & kept[..., :-lag]).sum())
        if not both or power <= 0.0:
            break
        alike = float((off[..., lag:] * off[..., :-lag]).sum()) / both / power + fitted / count
        if alike < _ALIKE:
            break
        total += 2.0 * alike * (1.0 - lag / count)
    return max(total, 1.0)


def fit_line(
    x: Floats, y: Floats, good: NDArray[np.bool_], limit: float, noise: float = 0.0
) -> tuple[Floats, Floats, Floats, NDArray[np.bool_]]:
    """Straight lines, one for each row of *y*: value at x = 0, its standard error, slope and the points kept.

    Points further than *limit* or four robust standard deviations from the line are left out, in two passes; with fewer
    than three all is NaN.  Of a few points the nearest may lie on a line by chance, so the deviation is never taken as
    less than the *noise* that each point has.
    """
    least = min(max(0.1, 4.0 * noise), limit)
    kept = good & np.isfinite(y)
    values = np.where(kept, y, 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        for trial in range(3):
            n = kept.sum(-1).astype(float)
            mx, my = (kept * x).sum(-1) / n, (kept * values).sum(-1) / n
            dx = (x - mx[:, None]) * kept
            sxx = (dx * dx).sum(-1)
            slope = np.where(sxx > 0.0, (dx * values).sum(-1) / sxx, 0.0)
            if trial == 0:  # start from medians, which a minority of bad columns cannot pull
                my = masked_median(y - slope[:, None] * x, kept) + slope * mx
            off = values - my[:, None] - slope[:, None] * (x - mx[:, None])
            miss = np.abs(off)
            spread = masked_median(miss, kept) / 0.6745
            if trial < 2:
                kept = kept & (miss <= np.clip(4.0 * spread, least, limit)[:, None])
        value = my - slope * mx
        variance = (np.where(kept, miss, 0.0) ** 2).sum(-1) / np.maximum(n - 2.0, 1.0)
        variance *= alike_columns(off, kept, 2)
        error = np.sqrt(variance * (1.0 / n + np.where(sxx > 0.0, mx * mx / sxx, 0.0)))
    short = n < 3
    for one in (value, error, slope):
        one[short] = np.nan
    return value, error, slope, kept
