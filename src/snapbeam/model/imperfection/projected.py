"""A shape given by points, on the buckling modes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.ends.of_beam import Modes

__all__ = ["projected"]

_Array = NDArray[np.float64]
_POINTS = 16
"""Of Gauss and Legendre, in each of the panels that a half wave of the last mode has two of."""


def projected(modes: Modes, profile: _Array, symmetric: bool = False) -> _Array:
    """The integrals of w0' phi_i', m^0.5, of a shape through points.

    The slopes of the modes are orthonormal, so that sum alpha0_i phi_i is the shape among those of the modes whose
    slope is nearest to that of w0.

    Parameters
    ----------
    modes : BucklingModes or SpringModes
    profile : array of shape (2, points)
        Places over the length from 0 to 1, and heights, m, zero at the ends.
    symmetric : bool
        Whether the shape is known to be symmetric, so that the antisymmetric modes have no part in it.

    Returns
    -------
    array of shape (N,)
    """
    from scipy.interpolate import CubicSpline

    at, heights = profile
    spline = CubicSpline(at * modes.length, heights)
    panels = 2 * (modes.count + 1)
    nodes, weights = np.polynomial.legendre.leggauss(_POINTS)
    edges = (
        np.unique(np.concatenate((np.linspace(0.0, 1.0, panels + 1), np.clip(at, 0.0, 1.0)))) * modes.length
    )
    half = 0.5 * np.diff(edges)
    x = np.clip((edges[:-1, None] + half[:, None] * (1.0 + nodes)).ravel(), 0.0, modes.length)
    weight = (half[:, None] * weights).ravel()
    found: _Array = (modes.slope(x) * spline(x, 1)) @ weight
    if symmetric:
        found[modes.parity < 0] = 0.0
    return found
