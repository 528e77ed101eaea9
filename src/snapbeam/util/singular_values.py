"""Least squares, pseudo-inverse, singular vectors and polynomials of finite numbers.

LAPACK's search of singular vectors does not end for some matrices with NaN or infinite elements, and no signal ends it.
The package calls it here only.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from snapbeam.util.validation import InputError

__all__ = ["NotFiniteError", "lstsq", "pinv", "polyfit", "svd"]


class NotFiniteError(InputError, np.linalg.LinAlgError):
    """Error if a computation overflows, so that its matrices are not finite."""

    def __init__(self) -> None:
        super().__init__(
            "numbers so large or so small that a computation with them is not finite: check their units and magnitude"
        )


def _finite(*arrays: Any) -> None:
    if not all(np.isfinite(array).all() for array in arrays):
        raise NotFiniteError


def lstsq(matrix: Any, values: Any, rcond: float | None = None) -> Any:
    """Return the solution of :func:`numpy.linalg.lstsq` for finite numbers."""
    _finite(matrix, values)
    return np.linalg.lstsq(matrix, values, rcond=rcond)[0]


def pinv(matrix: Any, rcond: float | None = None) -> Any:
    """Return :func:`numpy.linalg.pinv` of a finite matrix; errors as of :func:`lstsq`."""
    _finite(matrix)
    return np.linalg.pinv(matrix, rcond=rcond)


def svd(matrix: Any, full_matrices: bool = True) -> Any:
    """Return :func:`numpy.linalg.svd` of a finite matrix, with vectors; errors as of :func:`lstsq`."""
    _finite(matrix)
    return np.linalg.svd(matrix, full_matrices=full_matrices)


def polyfit(x: Any, y: Any, degree: int, **settings: Any) -> Any:
    """Return :func:`numpy.polyfit` of finite numbers, whose powers are finite too; errors as of :func:`lstsq`."""
    with np.errstate(over="ignore"):
        powers = np.vander(np.asarray(x, dtype=np.float64), degree + 1)
    _finite(powers, y, settings.get("w", 1.0))
    return np.polyfit(x, y, degree, **settings)
