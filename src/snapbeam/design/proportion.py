"""A probability from counts, with its interval."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import special

from snapbeam.core.validate import InputError, choice, within
from snapbeam.dynamics.lifetimes.survival import proportion as jeffreys

__all__ = ["INTERVALS", "interval_of", "wilson"]

_Array = NDArray[np.float64]
INTERVALS = ("wilson", "jeffreys")


def wilson(hits: ArrayLike, runs: ArrayLike, confidence: float = 0.95) -> tuple[_Array, _Array, _Array]:
    """A probability from counts, with Wilson's score interval (J. Am. Stat. Assoc. 22 (1927) 209).

    With z the normal quantile of (1 + confidence)/2, the limits solve |h/n - p| = z sqrt(p(1 - p)/n).

    Returns
    -------
    share, low, high : arrays
        NaN, 0 and 1 where there are no runs.
    """
    good, total = np.broadcast_arrays(np.asarray(hits, dtype=np.float64), np.asarray(runs, dtype=np.float64))
    if (good < 0).any() or (good > total).any():
        raise InputError("hits: must be between 0 and the number of runs")
    z = float(special.ndtri(0.5 * (1.0 + within("confidence", confidence, 0.0, 1.0))))
    n = np.maximum(total, 1.0)
    share = good / n
    middle = (good + 0.5 * z * z) / (n + z * z)
    half = z * np.sqrt(share * (1.0 - share) * n + 0.25 * z * z) / (n + z * z)
    # at no and at all hits a limit is 0 and 1, to the last digit
    low = np.where((good == 0) | (total == 0), 0.0, middle - half)
    high = np.where((good == total) | (total == 0), 1.0, middle + half)
    return np.where(total > 0, share, np.nan), low, high


def interval_of(
    hits: ArrayLike,
    runs: ArrayLike,
    failed: ArrayLike = 0,
    *,
    confidence: float = 0.95,
    method: str = "wilson",
) -> tuple[_Array, _Array, _Array]:
    """A probability with its interval; runs that failed may have been hits or not, and widen it both ways.

    Returns
    -------
    share, low, high : arrays
    """
    choice("interval", method, INTERVALS)
    of = wilson if method == "wilson" else jeffreys
    share = of(hits, runs, confidence)[0]
    lost = np.asarray(failed)
    total = np.asarray(runs) + lost
    low = of(hits, total, confidence)[1]
    high = of(np.asarray(hits) + lost, total, confidence)[2]
    return share, low, high
