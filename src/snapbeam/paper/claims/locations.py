"""Claims 6, 7, 8 and 15: thresholds and classes over the location of the shaker."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

import snapbeam as sb
from snapbeam.core.codes import ResponseClass
from snapbeam.figures.panels import cell_edges
from snapbeam.paper.claims.table import Claim
from snapbeam.sweeps.analysis import interwell_threshold

if TYPE_CHECKING:
    import xarray as xr

    from snapbeam.paper.recipe import Results

__all__ = ["added_modes", "many_modes", "one_mode", "transient_window"]

_Array = NDArray[np.float64]
_RATIOS = (0.05, 0.625, 1.625)
_NEAR_END = 0.05
"""Locations closer to a clamp than this are left out: V_QS1 goes to zero there."""


def _map(results: Results, ratio: float, which: int) -> xr.Dataset:
    """The map of one frequency, of the few modes (0) or the many (1)."""
    maps = [ds for ds in results["fig8"].values() if float(ds.frequency_ratio) == ratio]
    return maps[which]


def _relative_threshold(ds: xr.Dataset) -> tuple[_Array, _Array]:
    """Locations away from the clamp and the threshold there over V_QS1."""
    x = ds.location.values
    curve = interwell_threshold(ds, "relative_amplitude")
    keep = x >= _NEAR_END
    return x[keep], curve[keep]


def _grid_step(ds: xr.Dataset, at: float) -> float:
    """Spacing of V/V_QS1 about a value."""
    values = ds.relative_amplitude.values
    i = int(np.clip(np.searchsorted(values, at), 1, values.size - 1))
    return float(values[i] - values[i - 1])


def one_mode(results: Results) -> list[Claim]:
    """Claim 6."""
    rows = []
    for letter, ratio, printed in zip("abc", _RATIOS, (1.0, 0.2, 0.05), strict=True):
        ds = _map(results, ratio, 0)
        _, curve = _relative_threshold(ds)
        middle = float(np.nanmedian(curve))
        low, high = np.nanquantile(curve, (0.1, 0.9))
        step = _grid_step(ds, middle)
        allowed = max(0.15 * printed, step)
        near = abs(middle - printed) <= allowed
        straight = high - low <= max(0.3 * middle, 2.0 * step)
        rows.append(
            Claim(
                f"6{letter}",
                f"one mode, Omega = {ratio:g}: the threshold over x_s is proportional to V_QS1(x_s)",
                f"{printed:g} V_QS1",
                f"{middle:.3f} V_QS1 (80 % of the locations: {low:.3f} to {high:.3f})",
                f"{step:.3f} (grid)",
                "holds" if near and straight else "in part" if near or straight else "fails",
                f"Median over x_s from {_NEAR_END} to 0.5 of the smallest V/V_QS1 that is interwell; holds "
                f"if within 15 % or "
                "one step of the printed factor, and 80 % of the locations lie in a band of 30 % or two "
                "steps.",
                "" if near else f"The factor is {middle / printed:.2f} times the printed one.",
            )
        )
    return rows


def _smooth(curve: _Array) -> _Array:
    filled = np.where(np.isfinite(curve), curve, np.nanmax(curve))
    return np.asarray(median_filter(filled, size=min(5, filled.size), mode="nearest"))


def many_modes(results: Results) -> list[Claim]:
    """Claim 7."""
    slow = _map(results, 0.05, 1)
    modes = int(slow.attrs["modes"])
    _, curve = _relative_threshold(slow)
    middle, step = float(np.nanmedian(curve)), _grid_step(slow, 1.0)
    low, high = np.nanquantile(curve, (0.1, 0.9))
    rows = [
        Claim(
            "7a",
            f"{modes} modes, Omega = 0.05: the threshold over x_s follows V_QS1(x_s)",
            "1 V_QS1",
            f"{middle:.3f} V_QS1 (80 % of the locations: {low:.3f} to {high:.3f})",
            f"{step:.3f} (grid)",
            "holds"
            if abs(middle - 1.0) <= max(0.05, step) and high - low <= max(0.15, 2.0 * step)
            else "in part",
            "As 6; holds if the median is within 5 % or one step of 1 and 80 % of the locations within a "
            "band of 0.15 or two "
            "steps.",
        )
    ]
    for letter, ratio, place, words in (
        ("b", 0.625, 0.4, "a broad peak of the threshold near x_s = 0.4"),
        ("c", 1.625, 0.3, "a raised threshold about x_s = 0.3, with a dip at the centre"),
    ):
        ds = _map(results, ratio, 1)
        x, relative = _relative_threshold(ds)
        static = sb.quasi_static_threshold(x, ratio)
        threshold = _smooth(relative * static)
        top = int(np.argmax(threshold))
        wide = x[threshold >= 0.8 * threshold[top]]
        centre = float(threshold[-1] / threshold[top])
        inside = wide.min() - 0.02 <= place <= wide.max() + 0.02
        rows.append(
            Claim(
                f"7{letter}",
                f"{modes} modes, Omega = {ratio:g}: {words}",
                f"x_s near {place:g}",
                f"highest at x_s = {x[top]:.2f} (V = {threshold[top]:.2f}), within 20 % of that from "
                f"{wide.min():.2f} to "
                f"{wide.max():.2f}; at the centre {centre:.2f} of it",
                f"{float(np.diff(x).max()):.3f} in x_s, "
                f"{_grid_step(ds, float(relative[top])) * static[top]:.3f} in V",
                "holds" if inside and centre < 0.8 else "in part" if inside else "fails",
                "Threshold: smallest V that is interwell at each x_s, with a median over five locations. "
                "Holds if the stretch "
                "within 20 % of its greatest value contains the printed place, and the centre is below that "
                "stretch.",
            )
        )
    return rows


def added_modes(results: Results) -> list[Claim]:
    """Claim 8."""
    data = {int(ds.attrs["modes"]): ds for ds in results["si5"].values()}
    place = {}
    for modes, ds in data.items():
        x, curve = _relative_threshold(ds)
        part = (x >= 0.2) & (x <= 0.32)
        place[modes] = float(np.nanmedian(curve[part]))
    last = max(data)
    half = last // 2
    first, second = data[half], data[last]
    changed = float((first.response.values != second.response.values).mean())
    _, few = _relative_threshold(first)
    _, many = _relative_threshold(second)
    apart = float(np.nanmedian(np.abs(few / many - 1.0)))
    listed = ", ".join(
        f"N = {modes}: {value:.2f}" for modes, value in place.items() if modes in (1, 2, 3, 4, 8, 16, 32)
    )
    step = _grid_step(second, place[last])
    return [
        Claim(
            "8a",
            "the threshold rises about x_s = 0.25 to 0.3 as soon as there are two modes",
            "significant increase at N = 2",
            f"{place[2] / place[1]:.1f} times that of one mode (V/V_QS1: {listed})",
            f"{step:.2f} in V/V_QS1 (grid)",
            "holds" if place[2] > 1.5 * place[1] else "fails",
            "Median threshold over x_s from 0.2 to 0.32 at Omega = 1.625; holds if two modes raise it by "
            "more than a half.",
        ),
        Claim(
            "8b",
            f"the map of {half} modes is nearly that of {last}",
            "nearly identical",
            f"thresholds differ by {100.0 * apart:.1f} % in the median; {100.0 * changed:.1f} % of the "
            f"points change class "
            f"({100.0 * _chaos(results):.1f} % do for a change of 1e-9 in V)",
            f"{100.0 * step / place[last]:.0f} % (a step of V)",
            "holds" if apart <= max(0.05, step / place[last]) else "fails",
            "Median over x_s of the relative difference of the thresholds, at most 5 % or one step; single "
            "points of the "
            "chaotic regions cannot agree, in any two computations.",
        ),
    ]


def _chaos(results: Results) -> float:
    data = results["sensitivity"]
    return float((data["base"].response.values != data["perturbed"].response.values).mean())


def transient_window(results: Results) -> list[Claim]:
    """Claim 15."""
    rows = []
    for letter, ratio in zip("ab", _RATIOS[1:], strict=True):
        ds = _map(results, ratio, 1)
        x = ds.location.values
        kinds = ds.response.transpose("location", "relative_amplitude").values
        transient = (kinds == ResponseClass.TRANSIENT_1) | (kinds == ResponseClass.TRANSIENT_2)
        edges = np.minimum(cell_edges(ds.relative_amplitude.values, 0.0), 2.0)
        relative = transient @ np.diff(edges)
        width = relative * sb.quasi_static_threshold(x, ratio)
        end, centre = x <= 0.12, x >= 0.4
        at_end, at_centre = float(width[end].mean()), float(width[centre].mean())
        share = float(relative[end].mean()), float(relative[centre].mean())
        rows.append(
            Claim(
                f"15{letter}",
                f"near the ends few amplitudes give a transient interwell response, near the centre many, "
                f"Omega = {ratio:g}",
                "narrow; wide",
                f"{at_end:.3f} of V for x_s up to 0.12, {at_centre:.3f} from 0.4 on; in V/V_QS1 "
                f"{share[0]:.2f} and "
                f"{share[1]:.2f}",
                f"{_grid_step(ds, 0.5) * ratio:.3f} in V (a step at the centre)",
                "holds" if at_centre > 2.0 * at_end else "fails",
                "Amplitudes below 2 V_QS1 that are transient, added up over V, and averaged over the "
                "locations; holds if the "
                "centre has more than twice the width.",
                "Most of this is V_QS1(x_s), which itself goes to zero at the ends: in V/V_QS1 the widths "
                "differ "
                f"{'less' if share[1] < 2.0 * share[0] else 'too'}.",
            )
        )
    return rows
