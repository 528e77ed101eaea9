"""When the excitation of a measured run starts, read from its own shaker."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from snapbeam.core.validate import InputError
from snapbeam.lab.drive.vibrometer import measure_drive
from snapbeam.lab.signals.signal import make_signal

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["start_of_shaker"]


def start_of_shaker(run: xr.Dataset, frequency: float) -> float | None:
    """The time [s] at which the shaker starts to move, where the run shows it at rest before; else None.

    Parameters
    ----------
    run : xarray.Dataset
        A run with ``striker_displacement`` over ``time`` [s].
    frequency : float
        Of the excitation [Hz].
    """
    time = np.asarray(run["time"].values, dtype=np.float64)
    values = np.asarray(run["striker_displacement"].values, dtype=np.float64)
    known = np.isfinite(values)
    if np.count_nonzero(known) < 64:
        return None
    even = np.linspace(time[0], time[-1], time.size)
    # only when it starts is asked, which no unit changes
    signal = make_signal(np.interp(even, time[known], values[known]), "m", time=even, name="shaker")
    try:
        startup = measure_drive(signal, frequency).startup
    except InputError:
        return None
    return None if startup is None else startup.onset
