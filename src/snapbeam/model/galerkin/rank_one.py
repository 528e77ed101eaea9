"""Eigenvalues of the diagonal-plus-rank-one problems into which a buckled beam splits."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.validate import InputError

__all__ = ["rank_one_eigenpairs"]

_Array = NDArray[np.float64]
_HALVINGS = 2200
"""More than halve any interval of two numbers until no number lies between."""


def rank_one_eigenpairs(diagonal: _Array, c: float) -> tuple[_Array, _Array]:
    """Solve diag(d) y = lam (Id + c 1 1^T) y to high relative accuracy.

    The eigenvalues are the roots of 1 - c' sum d_i/(d_i - lam) with c' = c/(1 + c n).  The sum falls
    from +inf to -inf between neighbouring d_i, and from a positive value at lam = 0 to -inf at the
    smallest d_i, so each interval holds exactly one root.  Bisection for its distance from the nearer
    pole keeps the differences d_i - lam, and with them the eigenvectors y_i = 1/(d_i - lam), accurate
    whatever the spread of the d_i, which grows like n^4 here (cf. Golub, SIAM Rev. 15, 1973).

    Parameters
    ----------
    diagonal : array of shape (n,)
        d_i >= 0, in any order.
    c : float
        Weight c > 0 of the rank-one part.

    Returns
    -------
    eigenvalues : array of shape (n,)
        Ascending.
    vectors : array of shape (n, n)
        Columns with Y^T (Id + c 1 1^T) Y = Id.
    """
    n = diagonal.size
    if not (np.isfinite(diagonal).all() and math.isfinite(c)):
        raise InputError(
            "model: its frequencies are beyond what a number holds; are the units of the beam right?"
        )
    order = np.argsort(diagonal, kind="stable")
    d = diagonal[order]
    weight = c / (1.0 + c * n)

    def secular(gap: _Array) -> _Array:
        """1 - c' sum d_i/gap, for gap[i, j] = d_i - lam_j; a vanishing d_i drops out."""
        safe = np.where(gap == 0.0, 1.0, gap)
        terms = np.where(gap == 0.0, 0.0, d[:, np.newaxis] / safe)
        return np.asarray(1.0 - weight * np.sum(terms, axis=0))

    left = np.concatenate(([0.0], d[:-1]))
    width = d - left
    middle = left + 0.5 * width
    near_left = secular(d[:, np.newaxis] - middle) < 0.0
    origin = np.where(near_left, left, d)
    from_origin = d[:, np.newaxis] - origin
    low = np.where(near_left, 0.0, -0.5 * width)
    high = np.where(near_left, 0.5 * width, 0.0)
    for _ in range(_HALVINGS):
        shift = 0.5 * (low + high)
        if ((shift == low) | (shift == high)).all():
            break
        above = secular(from_origin - shift) > 0.0
        low = np.where(above, shift, low)
        high = np.where(above, high, shift)

    gap = from_origin - shift
    with np.errstate(divide="ignore"):
        y = 1.0 / gap
    for j in np.flatnonzero(width == 0.0):  # d_j = 0, or two equal d: the pole is the eigenvalue
        y[:, j] = 0.0
        y[j, j] = 1.0
        if j > 0:
            y[j - 1, j] = -1.0
    y /= np.sqrt(np.sum(y**2, axis=0) + c * np.sum(y, axis=0) ** 2)
    vectors = np.empty_like(y)
    vectors[order] = y
    return origin + shift, vectors
