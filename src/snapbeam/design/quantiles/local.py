"""The value at which a probability passes another, from a logistic curve fitted nearby."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import special

__all__ = ["local_crossing"]

_Array = NDArray[np.float64]
_STEPS, _SMALL = 60, 1e-9


def local_crossing(
    values: _Array, hits: NDArray[Any], probability: float, low: float, high: float, reach: float = 2.0
) -> float:
    """Where a logistic curve, fitted to the runs about an interval, passes *probability*.

    Runs count by the tricube of their distance from the middle of the interval over *reach* times its half width.
    The fit is Firth's (Biometrika 80 (1993) 27), whose bias is of second order and which is finite for separated
    runs.

    Returns
    -------
    float
        NaN if the curve does not rise there.
    """
    middle, half = 0.5 * (low + high), max(0.5 * (high - low), 1e-300)
    distance = (values - middle) / half
    weight = np.clip(1.0 - np.abs(distance / reach) ** 3, 0.0, None) ** 3
    near = weight > 0.0
    if near.sum() < 4:
        return float("nan")
    x = np.stack([np.ones(int(near.sum())), distance[near]], axis=1)
    y, w = hits[near].astype(np.float64), weight[near]
    beta = np.zeros(2)
    for _ in range(_STEPS):
        share = special.expit(x @ beta)
        curve = w * share * (1.0 - share)
        information = x.T @ (curve[:, None] * x)
        if not np.linalg.det(information) > 1e-14:
            return float("nan")
        inverse = np.linalg.inv(information)
        leverage = curve * np.einsum("ij,jk,ik->i", x, inverse, x)
        step = inverse @ (x.T @ (w * (y - share) + leverage * (0.5 - share)))
        size = float(np.abs(step).max())
        beta = beta + step / max(1.0, size / 2.0)
        if size < _SMALL:
            break
    if not beta[1] > 0.0:
        return float("nan")
    return float(middle + half * (special.logit(probability) - beta[0]) / beta[1])
