"""How long something lasts that ends at random: censored maximum likelihood with intervals, and whether it fits.

After a delay t0 a transient that forgets its past ends at a constant rate kappa = 1/tau: the share that lasts longer
than t is exp(-(t - t0)/tau).  The rate is estimated from d ends in a total time at risk E by kappa = d/E (Lawless,
Statistical Models and Methods for Lifetime Data, 2nd ed., 2003, section 4.1).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats

from snapbeam.core.validate import InputError, integer, nonnegative, shown, within

__all__ = ["LifetimeFit", "LifetimeSettings", "fit_lifetime", "proportion"]

_Array = NDArray[np.float64]
_JEFFREYS = 0.5
_REFUSED = 0.01
"""Goodness below which a later delay is tried."""
_FEWEST, _TRIALS = 8, 40
"""Ends that are left at least, beside half of them; delays that are tried at most, about."""


@dataclass(frozen=True, kw_only=True)
class LifetimeSettings:
    """How lifetimes are read from runs.

    Parameters
    ----------
    delay : float, optional
        Cycles t0 from which on ends are counted; by default the first end from which on the exponential is not
        refused at 1 %, at most half of them left out.  That end says when ends begin and is none of those that say
        how often they are.
    settling_cycles : float
        Cycles without a crossing after which snapping is taken to have ended, greater than 0.  A run that crossed
        within the last of them is still snapping: its lifetime is only known to be longer.
    confidence : float
        Of the intervals, in (0, 1).
    """

    delay: float | None = None
    settling_cycles: float = 50.0
    confidence: float = 0.95

    def __post_init__(self) -> None:
        if self.delay is not None:
            nonnegative("delay", self.delay, "cycles")
        if not nonnegative("settling_cycles", self.settling_cycles, "cycles") > 0.0:
            raise InputError(f"quiet = {shown(self.settling_cycles)}: must be greater than 0 cycles")
        within("confidence", self.confidence, 0.0, 1.0)


class LifetimeFit(NamedTuple):
    """An exponential law of lifetimes; arrays of the shape of the batch."""

    lifetime: _Array
    """tau; NaN where no end says it."""
    low: _Array
    high: _Array
    """Interval of tau; infinite where the ends do not bound it."""
    delay: _Array
    """t0; NaN where nothing ended."""
    ended: NDArray[np.int64]
    """Ends that count."""
    lasting: NDArray[np.int64]
    """Runs that outlived the observation."""
    goodness: _Array
    """Probability of so great a distance from the exponential if it holds (Kolmogorov and Smirnov); NaN for fewer
    than three ends."""


def fit_lifetime(
    time: ArrayLike, ended: ArrayLike, delay: float | None = None, confidence: float = 0.95
) -> LifetimeFit:
    """Fit exp(-(t - t0)/tau) to times of which some are only known to be longer.

    Without a given delay, t0 is the first end from which on the exponential is not refused at 1 % (at most half of
    the ends are left out; if it is refused still, t0 is the first end and ``goodness`` says so).  Since the
    exponential forgets, what lasts longer is, counted from t0, a sample without a delay, and the interval is that of
    complete data where every run ended, with 2 d kappa E distributed as chi squared.  With censored times the rate
    has the posterior of Jeffreys' prior, gamma(d + 1/2, E), whose intervals cover as they say to a percent or so.

    Parameters
    ----------
    time : array_like of shape (..., runs)
        Lifetimes, or for how long a run was seen to last; NaN: no run.
    ended : array_like of bool of the same shape
        Whether it ended then.
    delay : float, optional
        t0; times before it are left out.
    confidence : float

    Returns
    -------
    LifetimeFit
    """
    times, ends = np.broadcast_arrays(np.asarray(time, dtype=np.float64), np.asarray(ended, dtype=bool))
    if times.ndim == 0:
        raise InputError("time: must have at least one dimension, of runs")
    if (times < 0.0).any() or np.isinf(times).any():
        raise InputError("time: must be at least 0 and finite, or NaN where there is no run")
    share = within("confidence", confidence, 0.0, 1.0)
    batch = times.shape[:-1]
    times, ends = times.reshape(-1, times.shape[-1]), ends.reshape(-1, times.shape[-1])
    rows = [_fit_one(t[~np.isnan(t)], e[~np.isnan(t)], delay) for t, e in zip(times, ends, strict=True)]
    begun, count, lasting, exposure, distance, used = (np.array(column) for column in zip(*rows, strict=True))
    shape = np.where(lasting == 0, count, count + _JEFFREYS)
    tail = 0.5 * (1.0 - share)
    with np.errstate(divide="ignore", invalid="ignore"):
        tau = np.where(count > 0, exposure / count, np.nan)
        high = np.where(count > 0, exposure / stats.gamma.ppf(tail, np.maximum(shape, 1e-9)), np.inf)
        low = exposure / stats.gamma.ppf(1.0 - tail, np.maximum(shape, 1e-9))
    unknown = exposure <= 0.0
    low = np.where(unknown, 0.0, low)
    high = np.where(unknown, np.inf, high)
    tau = np.where(unknown, np.nan, tau)
    goodness = np.where(used >= 2, stats.kstwo.sf(distance, np.maximum(used, 1)), np.nan)
    return LifetimeFit(
        tau.reshape(batch), low.reshape(batch), high.reshape(batch), begun.reshape(batch),
        count.astype(np.int64).reshape(batch), lasting.astype(np.int64).reshape(batch), goodness.reshape(batch),
    )  # fmt: skip


def _fit_one(times: _Array, ends: NDArray[np.bool_], delay: float | None) -> tuple[float, ...]:
    """Delay, ends, lasting, time at risk, distance from the exponential and the ends that it was measured with."""
    if delay is not None:
        kept = times >= delay
        return (delay, *_from(times[kept] - delay, ends[kept]))
    if not ends.any():
        return np.nan, 0, times.size, float(times.sum()), np.nan, 0
    moments = np.sort(times[ends])
    most = moments.size - max(_FEWEST, moments.size // 2)
    found: tuple[float, ...] = ()
    for dropped in range(0, max(most, 0) + 1, max(1, moments.size // _TRIALS)):
        begun = float(moments[dropped])
        kept = times >= begun
        first = int(np.flatnonzero(ends & (times == begun))[0])
        kept[first] = False
        tried = (begun, *_from(times[kept] - begun, ends[kept]))
        found = found or tried
        if not tried[5] >= 2 or stats.kstwo.sf(tried[4], tried[5]) >= _REFUSED:
            return tried
    return found


def _from(times: _Array, ends: NDArray[np.bool_]) -> tuple[float, ...]:
    """As :func:`_fit_one`, of times that are counted from the delay."""
    order = np.argsort(times, kind="stable")
    times, ends = times[order], ends[order]
    exposure, count = float(times.sum()), int(ends.sum())
    # the ends in the time that all runs together were at risk come as those of a Poisson process
    at_risk = np.arange(times.size, 0, -1)
    spent = np.cumsum(at_risk * np.diff(times, prepend=0.0))
    marks = spent[ends] / exposure if exposure > 0.0 else np.empty(0)
    lasting = int(times.size - count)
    if lasting == 0:
        marks = marks[:-1]
    distance = np.nan
    if marks.size >= 2:
        steps = np.arange(marks.size + 1) / marks.size
        distance = max(float((steps[1:] - marks).max()), float((marks - steps[:-1]).max()))
    return count, lasting, exposure, distance, marks.size


def proportion(hits: ArrayLike, runs: ArrayLike, confidence: float = 0.95) -> tuple[_Array, _Array, _Array]:
    """A probability from counts, with Jeffreys' interval (Brown, Cai and DasGupta, Stat. Sci. 16 (2001) 101).

    Returns
    -------
    share, low, high : arrays
        NaN, 0 and 1 where there are no runs.
    """
    good, total = np.broadcast_arrays(np.asarray(hits, dtype=np.float64), np.asarray(runs, dtype=np.float64))
    if (good < 0).any() or (good > total).any():
        raise InputError("hits: must be between 0 and the number of runs")
    tail = 0.5 * (1.0 - within("confidence", confidence, 0.0, 1.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(total > 0, good / total, np.nan)
    low = np.where(good > 0, stats.beta.ppf(tail, good + 0.5, total - good + 0.5), 0.0)
    high = np.where(good < total, stats.beta.ppf(1.0 - tail, good + 0.5, total - good + 0.5), 1.0)
    return share, low, high


def checked_cycles(name: str, values: ArrayLike, most: float) -> NDArray[np.int64]:
    """Whole numbers of cycles in increasing order, at most *most*."""
    found = [
        integer(f"{name}[{i}]", value, 0, int(most)) for i, value in enumerate(np.atleast_1d(values).tolist())
    ]
    if not found or (np.diff(found) <= 0).any():
        raise InputError(f"{name} = {found}: must be increasing whole numbers of cycles")
    return np.array(found, dtype=np.int64)
