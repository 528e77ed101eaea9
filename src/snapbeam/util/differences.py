"""Directional derivatives of maps by central differences of order six."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

_Array = NDArray[np.float64]

_STENCIL = np.array(((3.0 / 4.0, -3.0 / 20.0, 1.0 / 60.0), (2.0 / 3.0, -1.0 / 12.0, 0.0)))
"""Weights of central differences of order six and four, over one, two and three steps."""
_STEP = 2e-4
"""Initial step, in units of the well's amplitude."""
_SHRINKINGS = 7
"""Times that it is quartered at most."""
_CLOSE = 1e-8
"""Difference of the two orders, over the derivative, with which a step is short enough."""


def differences(
    advance_rows: Callable[[_Array, NDArray[np.intp]], tuple[_Array, _Array | None]], x: _Array, directions: _Array
) -> tuple[_Array, _Array]:
    """Directional derivatives of a map by central differences of order six.

    Parameters
    ----------
    advance_rows : callable
        Takes states of shape (n, d) and the run that each belongs to; returns their images and their numbers of impacts.
    x : array of shape (runs, d)
        States.
    directions : array of shape (runs, k, d)

    Returns
    -------
    derivatives : array of shape (runs, k, m)
        Of the m numbers of an image.
    error : array of shape (runs, k)
        Estimated error over the norm of the derivative; infinite where neighbours at any distance have other numbers of impacts.
    """
    length = np.linalg.norm(directions, axis=-1, keepdims=True)
    unit = np.divide(directions, length, out=np.zeros_like(directions), where=length > 0.0)
    found, error = np.empty((*directions.shape[:2], 0)), np.full(directions.shape[:2], np.inf)
    left, step = np.indices(error.shape).reshape(2, -1), _STEP
    for _ in range(_SHRINKINGS):
        moves = np.stack([sign * k * step * unit[*left] for k in (1, 2, 3) for sign in (1.0, -1.0)], axis=1)
        images, impacts = advance_rows((x[left[0], None] + moves).reshape(-1, x.shape[1]), np.repeat(left[0], 6))
        table = images.reshape(left.shape[1], 3, 2, -1)
        six, four = np.einsum("os,psd->opd", _STENCIL, table[:, :, 0] - table[:, :, 1]) / step
        doubt = np.linalg.norm(six - four, axis=-1) / np.maximum(np.linalg.norm(six, axis=-1), 1e-300)
        doubt[~np.isfinite(doubt)] = np.inf
        if impacts is not None:
            hits = impacts.reshape(-1, 6)
            doubt[(hits != hits[:, :1]).any(axis=1)] = np.inf
        if not found.size:
            found = six.reshape(*error.shape, -1).copy()
        better = doubt < error[*left]
        found[*left[:, better]], error[*left[:, better]] = six[better], doubt[better]
        left, step = left[:, error[*left] > _CLOSE], 0.25 * step
        if not left.size:
            break
    return found * length, error
