"""Section 4.3: thresholds over the location of the shaker, Fig. 8."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

import snapbeam as sb
from snapbeam.paper.claims.claim_result import ClaimResult, Quantity, above, below, found, near
from snapbeam.paper.claims.uncertainty import combined, mean_of, median_of, share
from snapbeam.sweeps.threshold import interwell_threshold

if TYPE_CHECKING:
    import xarray as xr

    from snapbeam.paper.recipe import Results

_Array = NDArray[np.float64]
_NEAR_END = 0.05
"""Locations closer to a clamp than this are left out: V_QS1 goes to zero there."""
_END, _CENTRE = 0.12, 0.47
_SLOW, _MIDDLE, _FAST = 0.05, 0.625, 1.625


def _map(results: Results, ratio: float, which: int) -> xr.Dataset:
    """The map of one frequency, of one mode (0) or of many (1)."""
    return [ds for ds in results["fig8"].values() if float(ds.frequency_ratio) == ratio][which]


def relative_threshold(ds: xr.Dataset) -> tuple[_Array, _Array]:
    """Locations away from the clamp and the threshold there over V_QS1."""
    x = ds.location.values
    curve = interwell_threshold(ds, "relative_amplitude")
    keep = x >= _NEAR_END
    return x[keep], curve[keep]


def grid_step(ds: xr.Dataset, at: float) -> float:
    """Spacing of V/V_QS1 about a value."""
    values = ds.relative_amplitude.values
    i = int(np.clip(np.searchsorted(values, at), 1, values.size - 1))
    return float(values[i] - values[i - 1])


def along(results: Results, ratio: float, which: int) -> tuple[_Array, _Array, float]:
    """Locations, the threshold V there, a median over five of them, and the step of V where it is highest."""
    ds = _map(results, ratio, which)
    x, relative = relative_threshold(ds)
    static = sb.model.quasi_static_threshold(x, ratio)
    filled = np.where(np.isfinite(relative), relative, np.nanmax(relative))
    curve = np.asarray(median_filter(filled * static, size=min(5, filled.size), mode="nearest"))
    top = int(np.argmax(curve))
    return x, curve, grid_step(ds, float(filled[top])) * float(static[top])


def _follows(results: Results, ratio: float, which: int, printed: float, narrow: float) -> ClaimResult:
    """Check that a threshold is a printed multiple of V_QS1 at nearly all locations."""
    ds = _map(results, ratio, which)
    x, curve = relative_threshold(ds)
    step = grid_step(ds, float(np.nanmedian(curve)))
    level = median_of(curve, 0.5 * step)
    low, high = (float(value) for value in np.nanquantile(curve, (0.1, 0.9)))
    at_level = near(level, printed, max(0.15 * printed, step))
    straight = below(high - low, max(narrow * level.value, 2.0 * step))
    return found(
        at_level & straight, at_level | straight, level=level, low=low, high=high, printed=printed,
        times=level.value / printed, end=float(np.nanmedian(curve[x <= _END])),
    )  # fmt: skip


def _peak(results: Results, ratio: float, place: float) -> ClaimResult:
    """Location and width of the maximum of the threshold with many modes."""
    x, curve, step = along(results, ratio, 1)
    top = int(np.argmax(curve))
    same = x[curve >= curve[top] - step]
    wide = x[curve >= 0.8 * curve[top]]
    spacing = float(np.diff(x).max())
    at = Quantity(float(x[top]), combined(0.5 * float(same.max() - same.min()), 0.5 * spacing))
    inside = below(float(wide.min()), place + spacing) & above(float(wide.max()), place - spacing)
    return found(
        near(at, place, 0.05 + spacing) & inside, inside, at=at, height=Quantity(float(curve[top]), step),
        low=float(wide.min()), high=float(wide.max()),
    )  # fmt: skip


def higher_everywhere(results: Results) -> ClaimResult:
    """7d: at Omega = 0.625 more modes raise the threshold at every location."""
    few, many = (_map(results, _MIDDLE, which) for which in (0, 1))
    x, one = relative_threshold(few)
    _, more = relative_threshold(many)
    known = np.isfinite(one) & np.isfinite(more)
    steps = np.array([grid_step(few, float(value)) for value in one[known]])
    higher = (more - one)[known] > 0.5 * steps
    value = share(higher)
    times = (more / one)[known]
    return found(
        above(value.value, 0.999), above(value, 0.9), share=value,
        middle=float(np.median(times)), least=float(times.min()),
        not_at=tuple(float(at) for at in x[known][~higher]),
    )  # fmt: skip


def most_beside_centre(results: Results) -> ClaimResult:
    """7e: and most about x_s = 0.4."""
    x, one, _ = along(results, _MIDDLE, 0)
    _, many, step = along(results, _MIDDLE, 1)
    rise, times = many - one, many / one

    def mean(values: _Array, low: float, high: float) -> Quantity:
        inside = values[(x >= low) & (x <= high)]
        return mean_of(inside, 0.5 * step)

    peak, end, centre = mean(rise, 0.35, 0.45), mean(rise, 0.0, _END), mean(rise, _CENTRE, 0.5)
    over_end = Quantity(peak.value - end.value, combined(peak.uncertainty, end.uncertainty))
    over_centre = Quantity(peak.value - centre.value, combined(peak.uncertainty, centre.uncertainty))
    factors = [float(times[(x >= low) & (x <= high)].mean()) for low, high in ((0.35, 0.45), (0.0, _END))]
    # the rise in V near a clamp is small because V_QS1 is: as a factor it has to be smaller too
    by_factor = above(factors[0], factors[1])
    return found(
        above(over_centre, 0.0) & above(over_end, 0.0) & by_factor, above(over_centre, 0.0) & above(over_end, 0.0),
        over_centre=over_centre, over_end=over_end, peak=peak, factor=factors[0], factor_end=factors[1],
    )  # fmt: skip


def more_apparent(results: Results) -> ClaimResult:
    """7f: the rise is greater at Omega = 1.625 than at 0.625."""
    # the threshold of many modes over that of one
    slow, fast = (median_of(along(results, at, 1)[1] / along(results, at, 0)[1]) for at in (_MIDDLE, _FAST))
    more = Quantity(fast.value / slow.value, (fast.uncertainty + slow.uncertainty) / slow.value)
    return found(above(more, 1.0), more=more, slow=slow, fast=fast)


def _depth(results: Results, ratio: float) -> Quantity:
    """Threshold at the centre over the highest."""
    _, curve, step = along(results, ratio, 1)
    top = float(curve.max())
    return Quantity(float(curve[-1]) / top, 1.4 * step / top)


def notch_at_centre(results: Results) -> ClaimResult:
    """7g: at Omega = 0.625 there is a notch at the centre."""
    depth = _depth(results, _MIDDLE)
    return found(below(depth, 0.8), below(depth, 0.9), depth=depth)


def notch_deepens(results: Results) -> ClaimResult:
    """7h: it deepens from Omega = 0.625 to 1.625."""
    slow, fast = _depth(results, _MIDDLE), _depth(results, _FAST)
    deeper = Quantity(slow.value - fast.value, combined(slow.uncertainty, fast.uncertainty))
    return found(above(deeper, 0.0), deeper=deeper, slow=slow, fast=fast)


def below_static(results: Results) -> ClaimResult:
    """7i: at Omega = 0.625 the thresholds of both models are significantly below V_QS1."""
    x, _ = relative_threshold(_map(results, _MIDDLE, 1))
    curves = [relative_threshold(_map(results, _MIDDLE, which))[1] for which in (0, 1)]
    one, many = (share(curve < 0.8) for curve in curves)
    levels = [float(np.nanmedian(curve)) for curve in curves]
    return found(
        above(one, 0.95) & above(many, 0.95), above(one, 0.5) & above(many, 0.5), many=many, one=one,
        level=levels[1], level_one=levels[0], end=float(np.nanmedian(curves[1][x <= _END])),
    )  # fmt: skip


def rises_with_frequency(results: Results) -> ClaimResult:
    """7j: from Omega = 0.625 to 1.625 the threshold of many modes rises over much of the beam, that of one falls."""
    one, many = (share(along(results, _FAST, at)[1] > along(results, _MIDDLE, at)[1]) for at in (0, 1))
    return found(above(many, 0.5) & below(one, 0.5), above(many, 0.5) | below(one, 0.5), many=many, one=one)


ROWS = {
    "6a": partial(_follows, ratio=_SLOW, which=0, printed=1.0, narrow=0.3),
    "6b": partial(_follows, ratio=_MIDDLE, which=0, printed=0.2, narrow=0.3),
    "6c": partial(_follows, ratio=_FAST, which=0, printed=0.05, narrow=0.3),
    "7a": partial(_follows, ratio=_SLOW, which=1, printed=1.0, narrow=0.15),
    "7b": partial(_peak, ratio=_MIDDLE, place=0.4),
    "7c": partial(_peak, ratio=_FAST, place=0.3),
    "7d": higher_everywhere,
    "7e": most_beside_centre,
    "7f": more_apparent,
    "7g": notch_at_centre,
    "7h": notch_deepens,
    "7i": below_static,
    "7j": rises_with_frequency,
}
