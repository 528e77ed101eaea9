"""Maps: many runs over frequency ratio, velocity amplitude and location, as one labelled dataset."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from snapbeam.core.validate import integer
from snapbeam.model.contact import HertzContact
from snapbeam.model.reduction import ReducedModel
from snapbeam.sweeps.sweep import AXES, map_setup

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["AXES", "response_map"]


def response_map(
    model: ReducedModel,
    contact: HertzContact,
    *,
    frequency_ratio: ArrayLike,
    velocity_amplitude: ArrayLike,
    location: ArrayLike = 1.0 / 2.1,
    cycles: int = 200,
    side: str = "below",
    reference_freq: float | None = None,
    step: float | None = None,
    accuracy: str = "map",
    engine: str = "auto",
    early_decision: bool = False,
    threads: int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> xr.Dataset:
    """Class and statistics of the response over any of frequency ratio, velocity amplitude and location.

    Parameters
    ----------
    model : ReducedModel
    contact : HertzContact
    frequency_ratio, velocity_amplitude, location : float or array_like
        Omega > 0, V >= 0 and x_s in (0, 1).  A number holds for the whole map; a strictly increasing
        array becomes a dimension.
    cycles : int
        Cycles of excitation of each run.
    side : {"below", "above"}
        Side of the beam the shaker pushes from.
    reference_freq : float, optional
        Frequency in Hz that stands for omega_1; the model's first natural frequency if not given.
    step : float, optional
        Step in free flight, s; the default follows from the model and the contact.
    accuracy : {"map", "reference"}
    engine : {"auto", "cpu", "cuda"}
    early_decision : bool
        End a run once its class is certain: the classes are the same, the other statistics stop at
        ``decided_at``.
    threads : int, optional
        Threads of the CPU engine; all usable cores by default.  No number depends on it.
    progress : callable, optional
        Called as ``progress(done, total)`` while the map grows.

    Returns
    -------
    xarray.Dataset
        Dimensions (frequency_ratio, velocity_amplitude, location), those given as arrays; the variables of
        :data:`snapbeam.runs.response.STATISTICS`; every parameter in the attributes.

    Raises
    ------
    InputError
        For bad input.  Runs that fail numerically are UNKNOWN points with a ``status``.
    """
    if threads is not None:
        threads = integer("threads", threads, 1, 4096)
    setup = map_setup(
        model,
        contact,
        frequency_ratio=frequency_ratio,
        velocity_amplitude=velocity_amplitude,
        location=location,
        cycles=cycles,
        side=side,
        reference_freq=reference_freq,
        step=step,
        accuracy=accuracy,
        engine=engine,
        early_decision=early_decision,
    )
    points = setup.grid.take(np.arange(setup.grid.size))
    return setup.dataset(setup.march(points, threads, progress))
