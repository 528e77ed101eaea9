"""Section 4.2: the threshold of the interwell response over frequency, Fig. 6 and slow shakers."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from snapbeam.paper.claims.claim_result import ClaimResult, Quantity, above, below, found, near
from snapbeam.paper.claims.uncertainty import chaos, combined, median_of, part, share
from snapbeam.sweeps.threshold import Notch, interwell_threshold, threshold_notch

if TYPE_CHECKING:
    import xarray as xr

    from snapbeam.paper.recipe import Results

_Array = NDArray[np.float64]
NOTCH_WINDOW = (0.8, 2.2)
_LOW, _HIGH = (2.0, 2.5), (3.5, 4.0)


def curves(results: Results) -> tuple[_Array, _Array, _Array, float]:
    """Omega of Fig. 6, the threshold of one mode and of many, and the step of V."""
    one, many = results["fig6"].values()
    step = float(np.diff(one.velocity_amplitude.values).max())
    return one.frequency_ratio.values, interwell_threshold(one), interwell_threshold(many), step


def _modes(results: Results) -> int:
    return int(list(results["fig6"].values())[1].attrs["modes"])


def notch_of(ds: xr.Dataset, slack: float = 0.0) -> Notch:
    """The notch of a map: the stretch about the lowest threshold that is within *slack* of it."""
    return threshold_notch(ds.frequency_ratio.values, interwell_threshold(ds), slack, NOTCH_WINDOW)


def _notch(results: Results, which: int) -> tuple[Quantity, Notch, Notch]:
    """Position of the lowest threshold; the stretch at it; and that within a step of V."""
    ds = list(results["fig6"].values())[which]
    step = float(np.diff(ds.velocity_amplitude.values).max())
    lowest, wide = notch_of(ds), notch_of(ds, step)
    grid = float(np.diff(ds.frequency_ratio.values).max())
    half = 0.5 * (lowest.high - lowest.low) + 0.5 * grid
    moved = chaos(results, lambda other: notch_of(other).position, int(ds.attrs["modes"]))
    return Quantity(lowest.position, combined(half, moved)), lowest, wide


def _near_printed(results: Results, which: int, printed: float) -> ClaimResult:
    position, lowest, wide = _notch(results, which)
    meets = below(wide.low, printed + 0.05) & above(wide.high, printed - 0.05)
    ratio, _, _, step = curves(results)
    half_step = 0.5 * float(np.diff(ratio).max())
    return found(
        near(position, printed, 0.05 + half_step), meets, position=position, height=Quantity(lowest.height, step),
        low=wide.low, high=wide.high,
    )  # fmt: skip


def notch_shifts(results: Results) -> ClaimResult:
    """2c: it is lower with many modes."""
    one, many = _notch(results, 0)[0], _notch(results, 1)[0]
    shift = Quantity(one.value - many.value, combined(one.uncertainty, many.uncertainty))
    return found(above(shift, 0.0), shift=shift, one=one, many=many)


def _small_share(results: Results, variant: str) -> float:
    """Share of the frequencies of the smaller map at which many modes are lower."""
    names = [" ".join(["one_mode", variant]).strip().replace(" ", "_"), variant or "base"]
    one, many = (interwell_threshold(part(results, "sensitivity", name)) for name in names)
    return float((many < one)[np.isfinite(one) & np.isfinite(many)].mean())


def _in_hertz(results: Results) -> tuple[_Array, _Array, _Array, float]:
    """The same in Hz and in units of V of many modes: one shaker, its frequency and its speed, for both models."""
    ratio, one, many, step = curves(results)
    own, other = (float(ds.attrs["reference_frequency"]) for ds in results["fig6"].values())
    moved = np.interp(ratio, ratio * own / other, one * own / other, left=np.nan, right=np.nan)
    return ratio, moved, many, step


def universally_higher(results: Results) -> ClaimResult:
    """3a: whether many modes have the higher threshold everywhere."""
    shares, listed = [], []
    moved = abs(_small_share(results, "") - _small_share(results, "perturbed"))
    for axes in (curves(results), _in_hertz(results)):
        lower = np.asarray(axes[2] < axes[1] - 0.5 * axes[3])
        both = np.isfinite(axes[1]) & np.isfinite(axes[2])
        shares.append(share(lower[both], moved))
        listed.append(tuple(float(value) for value in axes[0][lower & both]))
    own, hertz = shares
    _, one, many, _ = curves(results)
    none = below(own.value, 0.0) & below(hertz.value, 0.0)
    return found(
        none, below(own, 0.1) & below(hertz, 0.1), own=own, hertz=hertz, own_listed=listed[0],
        hertz_listed=listed[1], own_count=len(listed[0]), hertz_count=len(listed[1]),
        middle=float(np.nanmedian(many / one)), most=float(np.nanmax((one - many)[np.isfinite(one - many)])),
    )  # fmt: skip


def _means(ratio: _Array, curve: _Array) -> tuple[float, float]:
    """Mean threshold over the two ranges of frequency."""
    low, high = ((ratio >= first) & (ratio <= last) for first, last in (_LOW, _HIGH))
    return float(np.nanmean(curve[low])), float(np.nanmean(curve[high]))


def _rise(ratio: _Array, curve: _Array) -> float:
    low, high = _means(ratio, curve)
    return high / low


def high_frequency(results: Results) -> ClaimResult:
    """3b: low with one mode, rising with many."""
    ratio, one, many, _ = curves(results)

    def rise(curve: _Array, modes: int) -> Quantity:
        moved = chaos(results, lambda ds: _rise(ds.frequency_ratio.values, interwell_threshold(ds)), modes)
        inside = [np.flatnonzero((ratio >= first) & (ratio <= last)) for first, last in (_LOW, _HIGH)]
        error = [1.96 * float(np.nanstd(curve[at]) / np.sqrt(max(at.size, 1)) / np.nanmean(curve[at])) for at in inside]
        value = _rise(ratio, curve)
        return Quantity(value, combined(moved, value * error[0], value * error[1]))

    few, more = rise(one, 1), rise(many, _modes(results))
    level = _means(ratio, many)[1] / _means(ratio, one)[1]
    level_u = level * max(few.uncertainty / few.value, more.uncertainty / more.value)
    times = Quantity(level, level_u)
    return found(
        below(few, 1.05) & above(more, 1.05) & above(times, 1.5), above(more, 1.05) & above(times, 1.5),
        many=more, one=few, times=times,
    )  # fmt: skip


def crucial(results: Results) -> ClaimResult:
    """3c: how far one mode is off with the threshold."""
    _, one, many, _ = curves(results)
    ratio = (many / one)[np.isfinite(many / one)]
    off = median_of(np.abs(1.0 / ratio - 1.0))
    return found(above(off, 0.25), above(off, 0.1), off=off, middle=float(np.median(ratio)))


def _slow(results: Results, which: int) -> tuple[_Array, _Array, float]:
    ds = list(results["low_frequency"].values())[which]
    step = float(np.diff(ds.relative_amplitude.values).max())
    return ds.frequency_ratio.values, interwell_threshold(ds, "relative_amplitude"), step


def _converges(results: Results, which: int) -> ClaimResult:
    ratio, curve, step = _slow(results, which)
    slowest = Quantity(float(curve[0]), step)
    towards = below(abs(float(curve[0]) - 1.0), abs(float(curve[1]) - 1.0) + 0.5 * step)
    listed = tuple((float(x), float(value)) for x, value in zip(ratio, curve, strict=True) if x <= 0.2)
    return found(
        near(slowest, 1.0, 0.05) & towards, near(slowest, 1.0, 0.1), slowest=slowest,
        ratio=float(ratio[0]), listed=listed,
    )  # fmt: skip


def _far_below(results: Results, which: int) -> ClaimResult:
    ratio, curve, step = _slow(results, which)
    fast = curve[ratio >= 1.0]
    most = Quantity(float(np.nanmax(fast)), step)
    return found(below(most, 0.5), below(most, 1.0), most=most, least=float(np.nanmin(fast)), last=float(ratio[-1]))


def _dips(ratio: _Array, curve: _Array, step: float) -> _Array:
    """Widths of the dips of a threshold, at half of how far they stand out, over their frequency.

    A dip stands out by two steps of V at least.
    """
    from scipy.signal import find_peaks, peak_widths

    upside = -np.where(np.isfinite(curve), curve, np.nanmax(curve))
    at, _ = find_peaks(upside, prominence=1.999 * step)
    widths = peak_widths(upside, at, rel_height=0.5)[0] * float(np.diff(ratio).max())
    return np.asarray(widths / ratio[at])


def _tuning(results: Results, which: int) -> tuple[Quantity, int]:
    ratio, one, many, step = curves(results)
    widths = _dips(ratio, (one, many)[which], step)
    return median_of(widths), int(widths.size)


def sharper(results: Results) -> ClaimResult:
    """30: how wide the dips of the threshold are, over their frequency."""
    (one, few), (many, more) = (_tuning(results, which) for which in (0, 1))
    less = Quantity(one.value - many.value, combined(one.uncertainty, many.uncertainty))
    notches = [_notch(results, which)[2] for which in (0, 1)]
    wide = [notch.high - notch.low for notch in notches]
    return found(
        above(less, 0.0) & below(wide[1], wide[0]), above(less.value, 0.0) | below(wide[1], wide[0]),
        less=less, one=one, many=many, few=few, more=more, notch_one=wide[0], notch_many=wide[1],
    )  # fmt: skip


ROWS = {
    "2a": partial(_near_printed, which=0, printed=1.4),
    "2b": partial(_near_printed, which=1, printed=1.2),
    "2c": notch_shifts,
    "3a": universally_higher,
    "3b": high_frequency,
    "3c": crucial,
    "5a": partial(_converges, which=0),
    "5b": partial(_converges, which=1),
    "5c": partial(_far_below, which=0),
    "5d": partial(_far_below, which=1),
    "30": sharper,
}
