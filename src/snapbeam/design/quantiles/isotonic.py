"""Where a probability that rises passes a value, from single runs at many values, with an interval.

Whether a run at v is a hit is a coin with the probability P(v).  If P does not fall, its most likely form is the
isotonic regression; the interval of the value at which it passes q holds every v for which the best P with P(v) = q
is not much less likely than the best of all.  Twice the difference of their log likelihoods has one limiting
distribution whatever P is (Banerjee and Wellner, Ann. Stat. 29 (2001) 1699), so that
nothing has to be assumed of its shape.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import optimize, special

from snapbeam.core.validate import InputError, within
from snapbeam.design.proportion import wilson

__all__ = ["Crossing", "critical", "crossing", "isotonic", "rises", "spans"]

_Array = NDArray[np.float64]
_TABLE = {
    0.5: 0.28506,
    0.75: 0.80694,
    0.8: 0.98729,
    0.85: 1.22756,
    0.9: 1.60246,
    0.95: 2.26916,
    0.99: 3.83630,
}
"""Quantiles of the limiting distribution (Banerjee and Wellner 2001, Table 1)."""


class Crossing(NamedTuple):
    """Where a probability passes a value."""

    value: float
    """Midway where the isotonic regression is less and where it is more; infinite where it never is."""
    low: float
    """-inf where no run says that it lies higher."""
    high: float
    """inf where no run says that it lies lower."""


def isotonic(hits: ArrayLike) -> _Array:
    """The most likely probabilities that do not fall, of coins in order."""
    return np.asarray(optimize.isotonic_regression(np.asarray(hits, dtype=np.float64)).x)


def _losses(hits: _Array, share: _Array) -> _Array:
    """Minus the log likelihood of each coin."""
    return np.asarray(-special.xlogy(hits, share) - special.xlogy(1.0 - hits, 1.0 - share))


def critical(confidence: float) -> float:
    """The quantile of the limiting distribution.

    Raises
    ------
    InputError
        For a confidence outside [0.5, 0.99].
    """
    within("confidence", confidence, 0.5, 0.99, closed="both")
    # its tail falls almost like an exponential
    return float(
        np.interp(-np.log1p(-confidence), [-np.log1p(-each) for each in _TABLE], list(_TABLE.values()))
    )


def crossing(values: ArrayLike, hits: ArrayLike, probability: float, confidence: float = 0.95) -> Crossing:
    """Where the probability of a hit passes *probability*, if it does not fall along *values*.

    Parameters
    ----------
    values, hits : array_like of shape (runs,)
        Where each run was made, in any order, and whether it hit.
    probability : float
        In (0, 1).
    confidence : float
        In [0.5, 0.99].
    """
    q = within("probability", probability, 0.0, 1.0)
    limit = critical(confidence)
    order = np.argsort(np.asarray(values), kind="stable")
    v, h = np.asarray(values, dtype=np.float64)[order], np.asarray(hits, dtype=np.float64)[order]
    if v.ndim != 1 or v.shape != h.shape or v.size == 0:
        raise InputError("values, hits: must be two lists of one length, of at least one run")
    best = isotonic(h)
    ends = np.append(v, np.inf), np.append(-np.inf, v)
    below = int(np.searchsorted(best, q, side="left"))
    above = int(np.searchsorted(best, q, side="right"))
    middle = 0.5 * (ends[1][below] + ends[0][above])
    # a candidate between runs k - 1 and k: probabilities below it are at most q, those above it at least
    least = float(np.sum(_losses(h, best)))
    kept = [k for k in range(v.size + 1) if 2.0 * (_constrained(h, k, q) - least) <= limit]
    return Crossing(float(middle), float(ends[1][kept[0]]), float(ends[0][kept[-1]]))


def _constrained(hits: _Array, at: int, q: float) -> float:
    """Minus the greatest log likelihood if the probability passes *q* before coin *at*."""
    total = 0.0
    if at > 0:
        total += float(np.sum(_losses(hits[:at], np.minimum(isotonic(hits[:at]), q))))
    if at < hits.size:
        total += float(np.sum(_losses(hits[at:], np.maximum(isotonic(hits[at:]), q))))
    return total


def rises(values: ArrayLike, hits: ArrayLike, *, bins: int = 12, samples: int = 400, seed: int = 0) -> float:
    """Probability of so much falling in the shares of hits if the probability of a hit rises.

    The runs are put into bins of equal numbers; twice the log likelihood that the isotonic regression of the bins lacks
    is compared with that of sets of coins drawn from that regression.

    Returns
    -------
    float
        Small where the probability falls somewhere.
    """
    order = np.argsort(np.asarray(values), kind="stable")
    h = np.asarray(hits, dtype=np.float64)[order]
    parts = np.array_split(h, min(bins, max(h.size // 8, 1)))
    runs = np.array([part.size for part in parts], dtype=np.float64)
    good = np.array([part.sum() for part in parts])
    fitted = optimize.isotonic_regression(good / runs, weights=runs).x
    generator = np.random.Generator(np.random.Philox(key=[seed, 0]))
    drawn = generator.binomial(runs.astype(np.int64), np.clip(fitted, 0.0, 1.0), (samples, runs.size))
    lack = np.array([_lack(row, runs) for row in drawn])
    return float((np.sum(lack >= _lack(good, runs) - 1e-9) + 1) / (samples + 1))


def spans(
    values: ArrayLike, hits: ArrayLike, probability: float, confidence: float = 0.95, bins: int = 12
) -> tuple[float, float]:
    """From the first value where the probability may be so great to the last where it may be so small.

    Nothing is assumed of how it rises or falls: the runs are put into bins, whose intervals hold all at once.
    """
    order = np.argsort(np.asarray(values), kind="stable")
    parts = np.array_split(order, min(bins, max(order.size // 8, 1)))
    v, h = np.asarray(values, dtype=np.float64), np.asarray(hits, dtype=np.float64)
    sure = 1.0 - (1.0 - confidence) / len(parts)
    _, low, high = wilson([h[part].sum() for part in parts], [part.size for part in parts], sure)
    first = [float(v[part].min()) for part, top in zip(parts, high, strict=True) if top >= probability]
    last = [float(v[part].max()) for part, bottom in zip(parts, low, strict=True) if bottom <= probability]
    return min(first, default=np.inf), max(last, default=-np.inf)


def _lack(good: _Array, runs: _Array) -> float:
    share = good / runs
    fitted = optimize.isotonic_regression(share, weights=runs).x
    free = special.xlogy(good, share) + special.xlogy(runs - good, 1.0 - share)
    held = special.xlogy(good, fitted) + special.xlogy(runs - good, 1.0 - fitted)
    return float(2.0 * np.sum(free - held))
