"""Section 4.3: where to strike, for the minimum velocity and for a transient response."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from snapbeam.paper.claims.claim_result import ClaimResult, Quantity, above, below, found
from snapbeam.paper.claims.topics.classes import transient
from snapbeam.paper.claims.topics.locations import along
from snapbeam.paper.claims.uncertainty import combined, mean_of, part
from snapbeam.paper.recipes.windows import CENTRE, END, longest_window

if TYPE_CHECKING:
    import xarray as xr

    from snapbeam.paper.recipe import Results

_Array = NDArray[np.float64]
_END, _CENTRE = 0.1, 0.48


def _relative(results: Results, ratio: float) -> tuple[Quantity, Quantity]:
    """Threshold near a clamp and at the centre, over the highest."""
    x, curve, step = along(results, ratio, 1)
    top = float(curve.max())
    end, centre = (mean_of(inside / top, step / top) for inside in (curve[x <= _END], curve[x >= _CENTRE]))
    return end, centre


def _efficient(results: Results, ratio: float) -> ClaimResult:
    """Check that near a clamp and at the centre little velocity is needed."""
    end, centre = _relative(results, ratio)
    return found(below(end, 0.6) & below(centre, 0.6), below(end, 0.9) & below(centre, 0.9), end=end, centre=centre)


def more_so_when_fast(results: Results) -> ClaimResult:
    """33c: particularly at high frequency."""
    slow, fast = (_relative(results, ratio) for ratio in (0.625, 1.625))
    gains = [
        Quantity(s.value - f.value, combined(s.uncertainty, f.uncertainty)) for s, f in zip(slow, fast, strict=True)
    ]
    end, centre = gains
    return found(above(end, 0.0) & above(centre, 0.0), above(end, 0.0) | above(centre, 0.0), end=end, centre=centre)


def _window(results: Results, ratio: float) -> xr.Dataset:
    return part(results, "windows", f"omega_{ratio:g}")


def _ratio(centre: Quantity, end: Quantity, least: float) -> Quantity:
    """Ratio of two numbers that are both significantly above *least*."""
    above_it, below_it = max(centre.value, least), max(end.value, least)
    value = above_it / below_it
    return Quantity(value, value * combined(centre.uncertainty / above_it, end.uncertainty / below_it))


def _means(x: _Array, values: _Array, error: float) -> tuple[Quantity, Quantity]:
    """Means over the locations near a clamp and near mid-span."""
    return mean_of(values[x <= END], error), mean_of(values[x >= CENTRE], error)


def _wide(results: Results, ratio: float) -> ClaimResult:
    """Widths of the amplitudes that give a transient response, near a clamp and near the centre."""
    ds = _window(results, ratio)
    drives, x = ds.velocity_amplitude.values, ds.location.values
    step = float(drives[1] - drives[0])
    inside = transient(ds.transpose("location", "velocity_amplitude"))
    width = inside.sum(axis=1) * step
    end, centre = _means(x, width, 0.5 * step)
    times = _ratio(centre, end, 0.5 * step)
    return found(
        above(times, 2.0), above(times, 1.0), times=times, end=end, centre=centre, top=float(drives[-1]),
        cut=int(inside[:, -1].sum()),
    )  # fmt: skip


def _fine(results: Results, ratio: float) -> ClaimResult:
    """Shares of itself to which the amplitude has to be set, near a clamp and near the centre."""
    ds = _window(results, ratio)
    step = float(ds.velocity_amplitude[1] - ds.velocity_amplitude[0])
    low, high = longest_window(ds)
    # half of the window over its middle: how far the amplitude may be off, as a share of it; 0 without a window
    room = np.where(np.isfinite(low), (high - low + step) / (high + low), 0.0)
    middle = np.nan_to_num(0.5 * (low + high), nan=np.inf)
    error = float(np.median(0.5 * step / middle)) or 0.5 * step
    end, centre = _means(ds.location.values, room, error)
    times = _ratio(centre, end, error)
    return found(
        above(times, 2.0), above(times, 1.0), times=times, end=end, centre=centre, without=int(np.isnan(low).sum())
    )


ROWS = {
    "15a": partial(_wide, ratio=0.625),
    "15b": partial(_wide, ratio=1.625),
    "15c": partial(_fine, ratio=0.625),
    "15d": partial(_fine, ratio=1.625),
    "33a": partial(_efficient, ratio=0.625),
    "33b": partial(_efficient, ratio=1.625),
    "33c": more_so_when_fast,
}
