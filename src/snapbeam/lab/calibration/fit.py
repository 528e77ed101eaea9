"""Least squares of a calibration: its minimum, its sensitivities, and what the data respond to."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

__all__ = ["directions", "open_upwards", "search", "sensitivity"]

_Array = NDArray[np.float64]
STARTS = (1.0, 0.75, 1.33, 0.55, 1.8)
"""Buckling levels to start from, over the given one."""
HIGHER = (1.05, 1.15, 1.3)
"""Buckling levels that are tried beyond the one found, over it."""
UNDETERMINED = 1e-5
"""Least singular value of the relative sensitivities that counts as a response, over the greatest."""


def sensitivity(frequencies: Callable[[_Array], _Array], logs: _Array, errors: _Array) -> _Array:
    """Change of the frequencies, in standard errors, with the logarithms of the parameters."""
    step = 1e-5
    columns = [
        (frequencies(logs + step * e) - frequencies(logs - step * e)) / (2.0 * step)
        for e in np.eye(logs.size)
    ]
    return np.column_stack(columns) / errors[:, None]


def search(
    residual: Callable[[_Array], _Array], begin: _Array, keep: _Array, names: list[str], freedom: int
) -> _Array:
    """The least squares minimum; other buckling levels are tried where the first start meets the data badly.

    Frequencies are told apart by their order only, and at b/r = 6.2 the first two change places: from the
    wrong side of it the fit can end in a minimum that is none of the data's.
    """
    from scipy.optimize import least_squares

    enough = freedom + 3.0 * math.sqrt(2.0 * freedom) + 1e-6
    best, found = math.inf, begin
    for factor in STARTS if "buckling_level" in names else STARTS[:1]:
        start = begin + np.array([math.log(factor) if name == "buckling_level" else 0.0 for name in names])
        result = least_squares(
            lambda z, start=start: residual(start + keep @ z), np.zeros(keep.shape[1]), x_scale=0.1,
            xtol=1e-10, ftol=1e-10, gtol=1e-10,
        )  # fmt: skip
        if 2.0 * result.cost < best:
            best, found = 2.0 * result.cost, start + keep @ result.x
        if best <= enough:
            break
    return found


def open_upwards(residual: Callable[[_Array], _Array], logs: _Array, names: list[str]) -> bool:
    """Whether any higher buckling level meets the data as well as the one found.

    So it is where the only frequency about a well is that of the antisymmetric mode, which does not depend on
    the level; the symmetric one lies above it from b/r = 6.2 on.
    """
    if "buckling_level" not in names:
        return False
    least = float(np.sum(residual(logs) ** 2))
    higher = (logs + np.array([math.log(by) * (name == "buckling_level") for name in names]) for by in HIGHER)
    return all(float(np.sum(residual(one) ** 2)) < least + 4.0 for one in higher)


def directions(jacobian: _Array) -> _Array:
    """Orthonormal combinations of parameters that the data respond to, one a column."""
    _, singular, rows = np.linalg.svd(jacobian, full_matrices=False)
    told = singular > UNDETERMINED * singular[0]
    return np.asarray(rows[told].T)
