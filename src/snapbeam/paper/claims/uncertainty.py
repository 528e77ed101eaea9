"""Uncertainty of numbers from maps or runs: sampling, grid, sensitivity to perturbations."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.paper.claims.claim_result import Quantity
from snapbeam.paper.recipe import MissingResults

if TYPE_CHECKING:
    import xarray as xr

    from snapbeam.paper.recipe import Results

_LEVEL = 1.96
"""Standard deviations of a half width: 95 %."""
_DRAWS = 400
_SEED = 118291


def part(results: Results, name: str, key: str) -> xr.Dataset:
    """One dataset of a recipe; MissingResults if stored data of an older recipe lack it."""
    data = results[name]
    if key not in data:
        raise MissingResults(f"{name}: the stored data lack {key!r}; compute them again")
    return data[key]


def combined(*half_widths: float) -> float:
    """Half widths of independent causes together; what is not known (NaN) adds nothing."""
    return math.sqrt(sum(width**2 for width in half_widths if math.isfinite(width)))


def share(hits: ArrayLike, *more: float) -> Quantity:
    """The share of hits among independent trials, with Wilson's 95 % half width and *more* of other causes."""
    found = np.asarray(hits, dtype=bool).ravel()
    if found.size == 0:
        return Quantity(math.nan, math.nan)
    value, z = float(found.mean()), _LEVEL**2 / found.size
    half = math.sqrt(z * (value * (1.0 - value) + 0.25 * z)) / (1.0 + z)
    return Quantity(value, combined(half, *more))


def resampled(statistic: Callable[[NDArray[np.int64]], float], count: int, *more: float) -> Quantity:
    """A statistic of *count* independent items, given by their numbers, with a bootstrap 95 % half width."""
    draw = np.random.default_rng(_SEED)
    value = statistic(np.arange(count)) if count else math.nan
    if count < 3:
        return Quantity(value, combined(abs(value), *more))  # nothing to resample: known to its size
    drawn = np.array([statistic(draw.integers(0, count, count)) for _ in range(_DRAWS)])
    drawn = drawn[np.isfinite(drawn)]
    if drawn.size == 0:
        return Quantity(value, math.nan if math.isnan(value) else 0.0)
    low, high = np.quantile(drawn, (0.025, 0.975))
    return Quantity(value, combined(0.5 * float(high - low), *more))


def mean_of(values: NDArray[np.float64], *more: float) -> Quantity:
    """The mean of independent numbers, by :func:`resampled`."""
    return resampled(lambda at: float(values[at].mean()), values.size, *more)


def median_of(values: NDArray[np.float64], *more: float) -> Quantity:
    """Median of the finite values, with its uncertainty by :func:`resampled`."""
    known = values[~np.isnan(values)]
    return resampled(lambda at: float(np.median(known[at])), known.size, *more)


def _named(modes: int, variant: str, *, long: bool) -> str:
    words = [*(["one_mode"] if modes == 1 else []), *([variant] if variant else []), *(["long"] if long else [])]
    return "_".join(words) or "base"


def chaos(results: Results, number: Callable[[xr.Dataset], float], modes: int, *, long: bool = False) -> float:
    """Change of a number from a map when the drive changes by 1e-9, or the step is halved.

    Both are measured on the smaller map of the sensitivity study, with 1 mode or many; the *long* one, of 1000
    cycles, only with the changed drive.
    """
    base = number(part(results, "sensitivity", _named(modes, "", long=long)))
    variants = ("perturbed",) if long else ("perturbed", "half_step")
    moved = [abs(number(part(results, "sensitivity", _named(modes, name, long=long))) - base) for name in variants]
    return float(np.nanmax([0.0, *moved]))


def chaos_of_pairs(results: Results, number: Callable[[xr.Dataset, xr.Dataset], float], modes: int) -> float:
    """The same for a number read off a map after 200 cycles and that after 1000."""
    pairs = [
        [part(results, "sensitivity", _named(modes, variant, long=long)) for long in (False, True)]
        for variant in ("", "perturbed")
    ]
    return abs(number(*pairs[0]) - number(*pairs[1]))
