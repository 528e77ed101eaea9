"""Which of some inputs moves an output most, from any sample of both."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats

from snapbeam.core.kinds import checked
from snapbeam.core.validate import InputError, finite_array, integer, within

__all__ = ["Indices", "sobol_indices_from_samples"]

_Array = NDArray[np.float64]
_GROUPS = 20


class Indices(NamedTuple):
    """Sensitivity indices with their intervals, arrays of shape (inputs,)."""

    estimate: _Array
    low: _Array
    high: _Array


@checked
def sobol_indices_from_samples(
    inputs: ArrayLike, output: ArrayLike, *, confidence: float = 0.95, bins: int | None = None, seed: int = 0
) -> Indices:
    """First-order indices Var(E[y | x_j])/Var(y) of a sample, however it was drawn, of correlated inputs too.

    Inputs are cut into bins of equal numbers of runs; the index is the variance of the means of the bins over that of
    the output, less what chance alone makes of it: Kelley's epsilon squared (Plischke, Borgonovo and Smith, Eur. J.
    Oper. Res. 226 (2013) 536, on estimates from bins).  The interval is that of a jackknife over twenty groups of runs.

    Parameters
    ----------
    inputs : array_like of shape (runs, inputs)
    output : array_like of shape (runs,)
    confidence : float
    bins : int, optional
        By default one for forty runs, 5 to 100: what varies within a bin is lost to the index.
    seed : int
        Chooses the groups.

    Returns
    -------
    Indices
        Of inputs that matter little, the estimate may be less than 0 by chance.

    Raises
    ------
    InputError
        For fewer than 200 runs, or an output that does not vary.
    """
    x, y = finite_array("inputs", inputs, 2), finite_array("output", output, 1)
    if x.shape[0] != y.size:
        raise InputError(f"inputs of shape {x.shape} with output of shape {y.shape}: must have as many runs")
    if y.size < 200:
        raise InputError(f"output of {y.size} runs: must be at least 200 to be cut into bins")
    if not y.std() > 0.0:
        raise InputError("output: does not vary, so nothing moves it")
    within("confidence", confidence, 0.0, 1.0)
    count = int(np.clip(y.size // 40, 5, 100)) if bins is None else integer("bins", bins, 2, y.size // 10)
    generator = np.random.Generator(np.random.Philox(key=[integer("seed", seed, 0, 2**63 - 1), 0]))
    group = generator.permutation(y.size) % _GROUPS
    binned = np.array([_bins(column, count) for column in x.T])
    whole = _all(binned, y, count)
    left = np.array([_all(binned[:, group != g], y[group != g], count) for g in range(_GROUPS)])
    pseudo = _GROUPS * whole - (_GROUPS - 1) * left
    error = pseudo.std(axis=0, ddof=1) / np.sqrt(_GROUPS)
    reach = float(stats.t.ppf(0.5 * (1.0 + confidence), _GROUPS - 1)) * error
    return Indices(whole, whole - reach, whole + reach)


def _bins(x: _Array, count: int) -> NDArray[np.int64]:
    """The bin of each run: bins of equal numbers, in the order of an input."""
    found = np.empty(x.size, dtype=np.int64)
    found[np.argsort(x, kind="stable")] = np.arange(x.size) * count // x.size
    return found


def _all(binned: NDArray[np.int64], y: _Array, count: int) -> _Array:
    return np.array([_epsilon(row, y, count) for row in binned])


def _epsilon(binned: NDArray[np.int64], y: _Array, count: int) -> float:
    size = np.bincount(binned, minlength=count)
    middle = y - y.mean()
    means = np.bincount(binned, weights=middle, minlength=count) / size
    total = float(np.sum(middle**2))
    between = float(np.sum(size * means**2))
    within_bins = (total - between) / (y.size - count)
    return (between - (count - 1) * within_bins) / total
