"""The shaker's motion as the camera saw it, as a signal on the camera's clock."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from snapbeam.core.validate import InputError
from snapbeam.lab.signals.signal import make_signal

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["shaker_signal"]

_BRIDGED = 5  # frames


def shaker_signal(tracked: xr.Dataset) -> xr.DataArray:
    """The displacement of the shaker [m] in a tracked recording, at the middles of the exposures.

    Gaps of up to five frames are bridged by a cubic spline; of what longer gaps part the longest stretch is
    taken.  Only the sine and the start of the motion are read from it, which a few frames do not change.

    Raises
    ------
    InputError
        If no shaker was followed, or in too few frames.
    """
    from scipy.interpolate import CubicSpline

    if "shaker_displacement_mm" not in tracked or "time" not in tracked.coords:
        raise InputError(
            "tracked: has no shaker_displacement_mm over time; it must come from track() with a shaker"
        )
    values = tracked["shaker_displacement_mm"].values
    time = tracked["time"].values
    known = np.flatnonzero(np.isfinite(values))
    if known.size < 16:
        raise InputError(f"tracked: the shaker was found in {known.size} frame(s): must be at least 16")
    breaks = np.flatnonzero(np.diff(known) > _BRIDGED + 1)
    runs = np.split(known, breaks + 1)
    used = max(runs, key=len)
    whole = np.arange(used[0], used[-1] + 1)
    filled = CubicSpline(time[used], values[used])(time[whole])
    exposure = float(tracked.attrs.get("exposure", np.nan))
    middle = 0.5 * exposure if np.isfinite(exposure) else 0.0
    return make_signal(filled, "mm", time=time[whole] + middle, name="shaker seen by the camera")
