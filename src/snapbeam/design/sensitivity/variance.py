"""Sobol's indices of independent inputs, with intervals from sequences scrambled anew."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from snapbeam.core.kinds import checked
from snapbeam.core.validate import InputError, integer, within
from snapbeam.design.sensitivity.given_data import Indices

__all__ = ["Sobol", "sobol_indices"]

_Array = NDArray[np.float64]


class Sobol(NamedTuple):
    """Indices of the first order and in total."""

    first: Indices
    total: Indices
    runs: int


@checked
def sobol_indices(
    function: Callable[[_Array], _Array],
    inputs: int,
    samples: int = 64,
    *,
    replicates: int = 16,
    confidence: float = 0.95,
    seed: int = 0,
) -> Sobol:
    """Sobol's indices by Saltelli's estimator (``scipy.stats.sobol_indices``), over scrambled Sobol sequences.

    A sequence is so even that resampling its points says too much of the error; *replicates* sequences, each scrambled
    by itself, are independent, and their scatter is the error (Owen's scrambling; Student's interval of their mean).

    Parameters
    ----------
    function : callable
        From ranks in (0, 1) of shape (inputs, points) to numbers of shape (points,); called once.
    inputs : int
    samples : int
        Points of a sequence, a power of 2; *replicates* times *samples* times (*inputs* + 2) points in all.
    replicates : int
        At least 4.
    confidence : float
    seed : int

    Raises
    ------
    InputError
        For bad input, or a function that does not vary.
    """
    integer("inputs", inputs, 1, 1000)
    integer("replicates", replicates, 4, 10_000)
    within("confidence", confidence, 0.0, 1.0)
    integer("seed", seed, 0, 2**63 - 1)
    if integer("samples", samples, 2, 2**24) & (samples - 1):
        raise InputError(f"size = {samples}: must be a power of 2")
    blocks = np.concatenate([_matrices(inputs, samples, seed, r) for r in range(replicates)], axis=1)
    values = np.asarray(function(blocks), dtype=np.float64)
    table = values.reshape(replicates, inputs + 2, samples)
    if not np.isfinite(table).all():
        raise InputError("function: gave numbers that are not finite")
    if not (table[:, :2].reshape(replicates, -1).std(axis=1) > 0.0).all():
        raise InputError("function: does not vary over the inputs, so there is nothing to share out")
    found = [
        stats.sobol_indices(func={"f_A": row[None, 0], "f_B": row[None, 1], "f_AB": row[2:, None]}, n=samples)
        for row in table
    ]
    first = np.array([np.ravel(each.first_order) for each in found])
    total = np.array([np.ravel(each.total_order) for each in found])
    return Sobol(_mean(first, confidence), _mean(total, confidence), values.size)


def _matrices(inputs: int, size: int, seed: int, number: int) -> _Array:
    """The points of one sequence: A, B and, for each input, A with that of B in its place; (inputs, points)."""
    generator = np.random.default_rng(np.random.SeedSequence([seed, number]))
    points = stats.qmc.Sobol(2 * inputs, scramble=True, seed=generator).random(size).T
    points = np.clip(points, 1e-12, 1.0 - 1e-12)
    a, b = points[:inputs], points[inputs:]
    mixed = []
    for j in range(inputs):
        one = a.copy()
        one[j] = b[j]
        mixed.append(one)
    return np.concatenate([a, b, *mixed], axis=1)


def _mean(table: _Array, confidence: float) -> Indices:
    count = len(table)
    middle = table.mean(axis=0)
    reach = (
        float(stats.t.ppf(0.5 * (1.0 + confidence), count - 1)) * table.std(axis=0, ddof=1) / np.sqrt(count)
    )
    return Indices(middle, middle - reach, middle + reach)
