"""Linear least squares of waves: the design of sines, solution and covariance by scaled normal equations."""

from __future__ import annotations

import dataclasses
import math
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.util.singular_values import lstsq, pinv

_Array = NDArray[np.float64]
_Fit = TypeVar("_Fit", bound=Any)


def sines(time: _Array, frequencies: ArrayLike) -> _Array:
    """Columns of an offset, and of cosine and sine of each frequency [Hz]."""
    turn = 2.0 * np.pi * np.outer(time, np.asarray(frequencies))
    design = np.ones((time.size, 2 * turn.shape[1] + 1))
    design[:, 1::2], design[:, 2::2] = np.cos(turn), np.sin(turn)
    return design


def phasors(solution: _Array) -> NDArray[np.complex128]:
    """Complex amplitudes c of sines Re(c exp(i 2 pi f t)) from what :func:`solve` finds for :func:`sines`."""
    return np.asarray(solution[1::2] - 1j * solution[2::2])


def solve(design: _Array, values: _Array, rcond: float = 1e-14) -> _Array:
    """Solution by scaled normal equations: the columns of waves are nearly orthogonal."""
    scale = _scale(design)
    gram = (design.T @ design) / np.outer(scale, scale)
    solution: _Array = lstsq(gram, (design.T @ values) / scale, rcond=rcond) / scale
    return solution


def covariance(design: _Array, rcond: float = 1e-15) -> _Array:
    """Covariance of the solution for noise of variance 1."""
    scale = _scale(design)
    inverse = np.asarray(pinv((design / scale).T @ (design / scale), rcond=rcond), dtype=np.float64)
    return inverse / np.outer(scale, scale)


def weighted_line(x: _Array, y: _Array, weight: _Array) -> tuple[float, float, float, float]:
    """Weighted means of x and y, slope of a line through them, and weighted sum of squares of x about its mean."""
    total = weight.sum()
    middle = float((weight * x).sum() / total)
    lever = float((weight * (x - middle) ** 2).sum())
    slope = float((weight * (x - middle) * y).sum()) / lever if lever > 0.0 else math.nan
    return middle, float((weight * y).sum() / total), slope, lever


def widened(fit: _Fit, **errors: tuple[float, ...]) -> _Fit:
    """A fit whose standard errors, by the names of the numbers, hold further independent errors."""
    names = {f"{name}_se": added for name, added in errors.items()}
    return dataclasses.replace(fit, **{name: math.hypot(getattr(fit, name), *added) for name, added in names.items()})


def _scale(design: _Array) -> _Array:
    scale: _Array = np.asarray(np.linalg.norm(design, axis=0), dtype=np.float64)
    scale[scale == 0.0] = 1.0
    return scale
