"""A probability from counts with Wilson's score interval, and a mean with Student's: the intervals of the package."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.util.validation import InputError, finite_array, shown, within

_Array = NDArray[np.float64]


def proportion(
    hits: ArrayLike, runs: ArrayLike, confidence: float = 0.95, failed: ArrayLike = 0
) -> tuple[_Array, _Array, _Array]:
    """Return a probability with Wilson's score interval (J. Am. Stat. Assoc. 22 (1927) 209).

    With z the normal quantile of (1 + confidence)/2, the limits solve |h/n - p| = z sqrt(p(1 - p)/n).  Runs that
    failed, besides *runs*, may have been hits or not, and widen the interval both ways.

    Returns
    -------
    share, low, high : arrays
        NaN, 0 and 1 where there are no runs.
    """
    good, total, lost = np.broadcast_arrays(*(np.asarray(each, dtype=np.float64) for each in (hits, runs, failed)))
    if (good < 0).any() or (good > total).any():
        raise InputError("hits: must be between 0 and the number of runs")
    from scipy import special  # not loaded with every figure

    z = float(special.ndtri(0.5 * (1.0 + within("confidence", confidence, 0.0, 1.0))))
    share = np.divide(good, total, where=total > 0, out=np.full(total.shape, np.nan))
    low, high = _limits(good, total + lost, z)[0], _limits(good + lost, total + lost, z)[1]
    return share, low, high


def mean_interval(values: ArrayLike, confidence: float = 0.95, positive: bool = False) -> tuple[_Array, _Array, _Array]:
    """Return the mean along the last axis, without NaN, and Student's interval.

    It is infinite for fewer than two values, and for values that are all the same: their spread is not known.
    That of the mean m of a *positive* quantity is of its logarithm, of which s/m is the standard error: it stays positive,
    and holds skewed quantities more often.
    """
    given = np.asarray(values, dtype=np.float64)
    known = ~np.isnan(given)
    count = known.sum(axis=-1)
    mean = np.divide(np.where(known, given, 0.0).sum(axis=-1), count, where=count > 0, out=np.full(count.shape, np.nan))
    squares = np.where(known, (given - mean[..., None]) ** 2, 0.0).sum(axis=-1)
    freedom = np.maximum(count - 1, 1)
    from scipy import special  # not loaded with every figure

    half = special.stdtrit(freedom, 0.5 * (1.0 + confidence)) * np.sqrt(squares / freedom / np.maximum(count, 1))
    least, most = (np.fmin.reduce(given, -1, initial=np.inf), np.fmax.reduce(given, -1, initial=-np.inf))
    good = (least < most) & known.all(axis=-1)
    low, high = mean - half, mean + half
    if positive:
        as_said = (mean > 0.0) & ~(given < 0.0).any(axis=-1)
        factor = np.exp(np.divide(half, mean, where=as_said, out=np.zeros(mean.shape)))
        low, high = np.where(as_said, mean / factor, low), np.where(as_said, mean * factor, high)
    return mean, np.where(good, low, 0.0 if positive else -np.inf), np.where(good, high, np.inf)


def levels_of(name: str, given: Any) -> tuple[float, ...]:
    """Return probabilities, increasing, each in (0, 1)."""
    found = tuple(within(name, each, 0.0, 1.0) for each in np.atleast_1d(finite_array(name, given)).ravel())
    if not found or (np.diff(found) <= 0.0).any():
        raise InputError(f"{name} = {shown(given)}: must be increasing numbers, at least one")
    return found


def weighted_quantiles(values: _Array, weights: _Array, shares: tuple[float, ...]) -> _Array:
    """Return quantiles of samples whose weights add up to 1."""
    order = np.argsort(values, kind="stable")
    return np.interp(shares, np.cumsum(weights[order]) - 0.5 * weights[order], values[order])


def _limits(good: _Array, total: _Array, z: float) -> tuple[_Array, _Array]:
    n = np.maximum(total, 1.0)
    middle = (good + 0.5 * z * z) / (n + z * z)
    half = z * np.sqrt(good * (n - good) / n + 0.25 * z * z) / (n + z * z)
    # at no and at all hits a limit is 0 and 1, to the last digit
    low = np.where((good == 0) | (total == 0), 0.0, middle - half)
    return low, np.where((good == total) | (total == 0), 1.0, middle + half)
