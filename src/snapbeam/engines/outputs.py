"""What engines hand over beside books: states at landings, and pieces of a recorded run."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["Landings", "Last", "Recorded"]

_Array = NDArray[np.float64]


class Landings(NamedTuple):
    """States of many runs at every landing."""

    accumulators_of_runs: NDArray[Any]
    q: _Array
    """Linear modes about the well at hand, shape (runs, landings, N)."""
    p: _Array
    well_sign: NDArray[np.int64]
    """That well: +1 the first, -1 the other, shape (runs, landings)."""
    contact_ticks: NDArray[np.int64]
    """Ticks since the present contact began, -1 where tip and beam are apart."""


class Last(NamedTuple):
    """Where a recorded run stands at its end."""

    q: _Array
    """Linear modes about the well at hand, shape (N,)."""
    p: _Array
    well_sign: int
    contact_ticks: int


class Recorded(NamedTuple):
    """A piece of a recorded run."""

    times: _Array
    """When each sample was taken, s, shape (samples,)."""
    q: _Array
    """Linear modes about the first well, shape (samples, N)."""
    p: _Array
    values: _Array
    """Penetration, contact force, beam energy, contact energy, work, dissipation, loss in contact; (samples, 7)."""
    impacts: _Array
    """Onset, duration, peak force and impulse of each impact that ended, shape (impacts, 4)."""
    accumulators_of_runs: NDArray[Any]
    """The run's book as it is at the end of the piece, shape (1,)."""
    last: Last
