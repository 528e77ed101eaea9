"""The shape of a beam along its length, from the amplitudes of its buckling modes."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.core.validate import InputError, finite_array
from snapbeam.model.ends.of_beam import Modes
from snapbeam.model.galerkin.modes import BucklingModes

__all__ = ["displacement_along"]


def displacement_along(
    length: float, amplitude: ArrayLike, positions: ArrayLike, modes: Modes | None = None
) -> NDArray[np.float64]:
    """Displacement w = sum alpha_i phi_i(x), m.

    Parameters
    ----------
    length : float
        L, m.
    amplitude : array_like of shape (..., N)
        alpha, m^0.5.
    positions : array_like of shape (points,)
        x over L, each in [0, 1].
    modes : optional
        Buckling modes of other ends than clamps.

    Returns
    -------
    array of shape (..., points)
    """
    alpha, x = finite_array("amplitude", amplitude), finite_array("positions", positions, 1)
    if x.size and (x.min() < 0.0 or x.max() > 1.0):
        raise InputError(f"positions from {x.min():g} to {x.max():g}: must lie in [0, 1]")
    between = BucklingModes(length, alpha.shape[-1]) if modes is None else modes
    shapes = between.shape(np.clip(x * length, 0.0, length))
    return np.asarray(alpha @ shapes)
