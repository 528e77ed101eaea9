"""Numbers read off maps: thresholds, their notches, shares of classes, what differs between two maps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.codes import ResponseClass, RunStatus
from snapbeam.core.validate import InputError

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "Difference",
    "Notch",
    "class_fraction",
    "compare_maps",
    "interwell_threshold",
    "is_interwell",
    "threshold_notch",
]

_Array = NDArray[np.float64]


def is_interwell(response: NDArray[np.int8]) -> NDArray[np.bool_]:
    """Which responses snapped through at least once."""
    return np.asarray(response >= ResponseClass.TRANSIENT_1)


def interwell_threshold(ds: xr.Dataset, amplitude: str = "velocity_amplitude") -> _Array:
    """Return the smallest interwell amplitude at each point of the other axis of a map.

    The threshold is NaN where no run is interwell, and where a failed run at a smaller amplitude leaves it open.
    Points that were never started (status ``NOT_RUN``) are left out.
    """
    response = ds["response_class"].transpose(..., amplitude)
    if response.ndim != 2:
        raise InputError(f"map over {response.dims}: must have {amplitude!r} and one more axis")
    snapped = is_interwell(response.values)
    failed = response.values == ResponseClass.UNKNOWN
    if "status" in ds:
        failed &= ds["status"].transpose(*response.dims).values != RunStatus.NOT_RUN
    values = ds[amplitude].values.astype(float)
    lowest = np.argmax(snapped, axis=1)
    known = snapped.any(axis=1) & (np.argmax(snapped | failed, axis=1) == lowest)
    return np.where(known, values[lowest], np.nan)


@dataclass(frozen=True)
class Notch:
    """A local minimum of a threshold: where, how low, and between where it is within one step of that."""

    position: float
    height: float
    low: float
    high: float


def threshold_notch(x: _Array, threshold: _Array, step: float, window: tuple[float, float]) -> Notch:
    """The deepest local minimum of a threshold curve inside a window.

    The position is the middle of the stretch about the lowest point over which the curve stays within one
    *step* of the amplitude axis; the stretch is its uncertainty.
    """
    inside = (x >= window[0]) & (x <= window[1]) & np.isfinite(threshold)
    if not inside.any():
        raise InputError(f"window = {window}: must hold a point of the threshold")
    at = int(np.flatnonzero(inside)[np.argmin(threshold[inside])])
    limit = threshold[at] + 1.0001 * step
    first = last = at
    while first > 0 and threshold[first - 1] <= limit:
        first -= 1
    while last < x.size - 1 and threshold[last + 1] <= limit:
        last += 1
    return Notch(float(0.5 * (x[first] + x[last])), float(threshold[at]), float(x[first]), float(x[last]))


def class_fraction(
    response: NDArray[np.int8], kind: ResponseClass, where: NDArray[np.bool_] | None = None
) -> float:
    """Share of the points, those *where* holds, that have a class; NaN if there are none."""
    points = response if where is None else response[where]
    return float(np.mean(points == kind)) if points.size else float("nan")


@dataclass(frozen=True)
class Difference:
    """What differs between two maps of one grid, as shares of all points.

    ``changed``: the class; ``snapped``: whether it is interwell; ``at_border``: of the changed points, those
    with a neighbour of another class in the first map; ``share``: the greatest change of the share of a
    class; ``threshold``: ratio of the mean interwell thresholds, second over first.
    """

    changed: float
    snapped: float
    at_border: float
    share: float
    threshold: float


def compare_maps(first: xr.Dataset, second: xr.Dataset) -> Difference:
    """Compare the classes of two maps over the same grid."""
    a, b = first["response_class"].values, second["response_class"].values
    if a.shape != b.shape or a.ndim != 2:
        raise InputError(f"maps of shapes {a.shape} and {b.shape}: must share one grid of two axes")
    changed = a != b
    border = np.zeros_like(changed)
    for axis in (0, 1):
        step = np.diff(a, axis=axis) != 0
        lower = [slice(None)] * 2
        upper = [slice(None)] * 2
        lower[axis], upper[axis] = slice(None, -1), slice(1, None)
        border[tuple(lower)] |= step
        border[tuple(upper)] |= step
    shares = [abs(class_fraction(a, kind) - class_fraction(b, kind)) for kind in ResponseClass]
    curves = [interwell_threshold(ds) for ds in (first, second)]
    both = np.isfinite(curves[0]) & np.isfinite(curves[1])
    return Difference(
        changed=float(changed.mean()),
        snapped=float((is_interwell(a) != is_interwell(b)).mean()),
        at_border=float(border[changed].mean()) if changed.any() else float("nan"),
        share=max(shares),
        threshold=float(curves[1][both].mean() / curves[0][both].mean()) if both.any() else float("nan"),
    )
