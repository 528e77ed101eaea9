"""What it takes a structure with unequal wells to pass a height: the bound behind early decision, with a side force."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["least_energy_through", "pinned_load"]

_Array = NDArray[np.float64]
_HALVINGS = 120
_BESIDE = 1e-9


def least_energy_through(
    stiffness: _Array, gamma: float, force: _Array, shapes: _Array, heights: _Array
) -> _Array:
    """Least potential energy of any amplitudes with c . alpha = r, J.

    With S_cc = sum c_i^2/(K0_i - mu), S_cB = sum c_i B_i/(K0_i - mu) and S_BB alike, it is the greatest value of

        (r - S_cB)^2/(2 S_cc) - S_BB/2 - mu^2/(4 gamma)

    over mu below the first zero of S_cc.  For every mu, gamma s^2/4 >= -mu s/2 - mu^2/(4 gamma), s = alpha . alpha, so
    that the least value of the quadratic form that is left, on the plane, is a lower bound.  It is attained: the bound
    is concave in mu, its slope is -(s + mu/gamma)/2 with the s of the shape that is least, and vanishes at
    mu = -gamma s.
    Without B it is that of equal wells.

    Parameters
    ----------
    stiffness : array of shape (N,)
        K0, diagonal.
    gamma : float
    force : array of shape (N,)
        B.
    shapes : array of shape (runs, N)
        c of each run.
    heights : array of shape (runs,)
        r, m.

    Returns
    -------
    array of shape (runs,)
    """
    squares = shapes * shapes
    different, which = np.unique(squares, axis=0, return_inverse=True)
    high = np.array([pinned_load(row, stiffness) for row in different])[which.ravel()]
    scale = float(np.abs(stiffness).max()) + float(np.abs(force).max()) ** (2.0 / 3.0) * gamma ** (1.0 / 3.0)

    def shape(mu: _Array) -> _Array:
        # at a pole the shape is a limit: beside it is near enough to say which way the bound rises
        gap = stiffness - mu[:, None]
        gap = np.where((gap == 0.0).any(axis=1)[:, None], gap - _BESIDE * scale, gap)
        first = np.sum(squares / gap, axis=1)
        held = (heights - np.sum(shapes * force / gap, axis=1)) / first
        found: _Array = (force + held[:, None] * shapes) / gap
        return found

    def rises(mu: _Array) -> NDArray[np.bool_]:
        alpha = shape(mu)
        up: NDArray[np.bool_] = -np.sum(alpha * alpha, axis=1) > mu / gamma
        return up

    with np.errstate(divide="ignore", invalid="ignore"):
        low = np.minimum(high, 0.0) - scale
        for _ in range(_HALVINGS):
            falls = ~rises(low)
            if not falls.any():
                break
            low = np.where(falls, high - 2.0 * (high - low), low)
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            up = rises(middle)
            low, high = np.where(up, middle, low), np.where(up, high, middle)
        low = np.where((stiffness == low[:, None]).any(axis=1), low - _BESIDE * scale, low)
        gap = stiffness - low[:, None]
        first = np.sum(squares / gap, axis=1)
        off = heights - np.sum(shapes * force / gap, axis=1)
        value: _Array = (
            0.5 * off * off / first - 0.5 * np.sum(force * force / gap, axis=1) - low * low / (4.0 * gamma)
        )
    return np.where(np.isfinite(value), value, -np.inf)


def pinned_load(square: _Array, k0: _Array) -> float:
    """Load, less that at hand, that buckles the structure pinned at a point: S_cc's first zero, or an untouched
    mode.
    """
    touched = square > 1e-20 * square.max()
    free = np.sort(k0[~touched])
    poles = np.sort(k0[touched])
    lowest_free = float(free[0]) if free.size else np.inf
    if poles.size < 2:
        return lowest_free if np.isfinite(lowest_free) else float(poles[0] + 1e6 * abs(poles[0]))
    gap = poles[1] - poles[0]
    low, high = poles[0] + 1e-13 * gap, poles[1] - 1e-13 * gap
    # rises from -infinity to infinity; halved here: scipy.optimize would take a quarter of a second of each start
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if np.sum(square[touched] / (k0[touched] - middle)) > 0.0:
            high = middle
        else:
            low = middle
    return min(float(0.5 * (low + high)), lowest_free)
