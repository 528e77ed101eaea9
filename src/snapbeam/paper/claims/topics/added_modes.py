"""Section 4.3: how the map over location changes as modes are added, video SI5."""

from __future__ import annotations

import math
from functools import cache
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.stats import spearmanr

import snapbeam as sb
from snapbeam.model.default_values import MODES
from snapbeam.paper.claims.claim_result import ClaimResult, Quantity, above, below, found, near
from snapbeam.paper.claims.topics.locations import grid_step, relative_threshold
from snapbeam.paper.claims.uncertainty import combined, median_of, part, resampled, share
from snapbeam.paper.system import paper_model
from snapbeam.sweeps.threshold import interwell_threshold, is_interwell

if TYPE_CHECKING:
    import xarray as xr

    from snapbeam.paper.recipe import Results

_Array = NDArray[np.float64]
_PLACE = (0.2, 0.32)
"""Locations about 0.25 to 0.3 of which the paper speaks."""


def _maps(results: Results) -> dict[int, xr.Dataset]:
    return {int(ds.attrs["modes"]): ds for ds in results["si5"].values()}


def _at_place(ds: xr.Dataset) -> Quantity:
    """Median threshold over V_QS1 about the place; V_QS1 is the same for all numbers of modes."""
    x, curve = relative_threshold(ds)
    inside = curve[(x >= _PLACE[0]) & (x <= _PLACE[1])]
    step = grid_step(ds, float(np.nanmedian(inside)))
    return median_of(inside, 0.5 * step)


def _over(first: Quantity, second: Quantity) -> Quantity:
    value = first.value / second.value
    spread = combined(first.uncertainty / first.value, second.uncertainty / second.value)
    return Quantity(value, value * spread)


def two_modes(results: Results) -> ClaimResult:
    """8a: two modes raise the threshold about x_s = 0.25."""
    maps = _maps(results)
    one, two = _at_place(maps[1]), _at_place(maps[2])
    times = _over(two, one)
    listed = tuple((n, _at_place(ds).value) for n, ds in maps.items() if math.log2(n).is_integer())
    return found(above(times, 1.5), above(times, 1.0), times=times, one=one, two=two, listed=listed)


def _apart(first: xr.Dataset, second: xr.Dataset) -> Quantity:
    """Median over the locations of the relative difference of two thresholds."""
    _, few = relative_threshold(first)
    _, many = relative_threshold(second)
    off = np.abs(few / many - 1.0)
    step = grid_step(second, float(np.nanmedian(many))) / float(np.nanmedian(many))
    return median_of(off, 0.5 * step)


def half_the_modes(results: Results) -> ClaimResult:
    """8b: 16 modes give nearly the map of 32."""
    maps = _maps(results)
    last = max(maps)
    first, second = maps[last // 2], maps[last]
    apart = _apart(first, second)
    a, b = first.response_class.values, second.response_class.values
    base, nudged = (part(results, "sensitivity", name).response_class.values for name in ("base", "perturbed"))
    changed, floor = share(a != b), share(base != nudged)
    snapped = share(is_interwell(a) != is_interwell(b))
    return found(
        below(apart, 0.05) & below(changed, floor.value + floor.uncertainty), below(apart, 0.1), apart=apart,
        changed=changed, floor=floor, snapped=snapped, half=last // 2, last=last,
    )  # fmt: skip


@cache
def _antinode() -> tuple[float, float]:
    """Location of the maximum of the second buckling mode, and of the second dynamic mode, in the first half."""
    model, x = paper_model(MODES), np.linspace(0.01, 0.49, 961)
    phi = np.array([model.shape_at(float(at)) for at in x])
    dynamic = phi @ model.linear_modes[:, 1]
    return float(x[np.argmax(np.abs(phi[:, 1]))]), float(x[np.argmax(np.abs(dynamic))])


def antinode(results: Results) -> ClaimResult:
    """8c: the place is that of the antinode of the second mode."""
    maps = _maps(results)
    x, one = relative_threshold(maps[1])
    _, two = relative_threshold(maps[2])
    static = sb.model.quasi_static_threshold(x, 1.625)
    rise = (two - one) * static
    rise = np.where(np.isfinite(rise), rise, -np.inf)
    top = int(np.argmax(rise))
    step = grid_step(maps[2], float(two[top])) * static[top]
    same = x[rise >= rise[top] - step]
    spacing = float(np.diff(x).max())
    at = Quantity(float(x[top]), combined(0.5 * float(same.max() - same.min()), 0.5 * spacing))
    buckling, dynamic = _antinode()
    return found(
        near(buckling, 0.3, 0.05) & near(at, buckling, 0.05 + 0.5 * spacing), near(buckling, 0.3, 0.05),
        at=at, buckling=buckling, dynamic=dynamic,
    )  # fmt: skip


def small_changes(results: Results) -> ClaimResult:
    """8d: beyond two modes each number added changes the threshold little."""
    maps = _maps(results)
    counts = sorted(maps)
    first = _at_place(maps[counts[1]]).value / _at_place(maps[counts[0]]).value
    steps, errors = [], []
    for few, many in pairwise(counts[1:]):
        times = _over(_at_place(maps[many]), _at_place(maps[few]))
        steps.append(abs(math.log(times.value)))
        errors.append(times.uncertainty / times.value)
    at = int(np.argmax(steps))
    greatest = Quantity(math.expm1(steps[at]), errors[at])
    altogether = _over(_at_place(maps[counts[-1]]), _at_place(maps[counts[1]]))
    return found(
        below(greatest, 0.2) & below(altogether, 1.5), below(greatest, 0.5), greatest=greatest, altogether=altogether,
        first=first, few=counts[1 + at], many=counts[2 + at],
    )  # fmt: skip


def energy_of_second_mode(results: Results) -> ClaimResult:
    """8e: the threshold of two modes rises where an impulse gives its energy to the second."""
    maps = _maps(results)
    x, one = relative_threshold(maps[1])
    _, two = relative_threshold(maps[2])
    model = paper_model(2)
    speed = np.array([model.linear_modes.T @ model.shape_at(float(at)) for at in x])
    given = speed[:, 1] ** 2 / np.sum(speed**2, axis=1)
    known = np.isfinite(one) & np.isfinite(two)
    times, given = (two / one)[known], given[known]

    def rank(at: NDArray[np.int64]) -> float:
        if np.ptp(times[at]) == 0.0 or np.ptp(given[at]) == 0.0:
            return 0.0
        return float(spearmanr(times[at], given[at]).statistic)

    correlation = resampled(rank, times.size)
    return found(
        above(correlation, 0.7), above(correlation, 0.4), correlation=correlation,
        greatest=float(given.max()), place=float(x[known][np.argmax(given)]),
    )  # fmt: skip


def second_mode_is_critical(results: Results) -> ClaimResult:
    """8f: how much of the rise from 1 to 32 modes the second alone makes, as a share of its logarithm."""
    maps = _maps(results)
    last = max(maps)
    one, two, all_of_them = (_at_place(maps[n]) for n in (1, 2, last))
    whole = math.log(all_of_them.value / one.value)
    relative = combined(two.uncertainty / two.value, one.uncertainty / one.value)
    made = Quantity(math.log(two.value / one.value) / whole, relative / abs(whole))
    return found(above(made, 0.5), above(made, 0.25), made=made, last=last)


def twice_the_modes(results: Results) -> ClaimResult:
    """8g: the map over frequency of 32 modes against that of 64."""
    base, double = (part(results, "sensitivity", name) for name in ("base", "double_modes"))
    curves = [interwell_threshold(ds) for ds in (base, double)]
    off = curves[1] / curves[0] - 1.0
    off = off[np.isfinite(off)]
    step = float(np.diff(base.velocity_amplitude.values).max()) / float(np.nanmedian(curves[0]))
    apart = median_of(np.abs(off), 0.5 * step)
    changed = share(base.response_class.values != double.response_class.values)
    floor = share(base.response_class.values != part(results, "sensitivity", "perturbed").response_class.values)
    return found(
        below(apart, 0.05) & below(changed, floor.value + floor.uncertainty), below(apart, 0.1), apart=apart,
        changed=changed, floor=floor, mean=float(off.mean()), modes=int(base.attrs["modes"]),
        double=int(double.attrs["modes"]),
    )  # fmt: skip


ROWS = {
    "8a": two_modes,
    "8b": half_the_modes,
    "8c": antinode,
    "8d": small_changes,
    "8e": energy_of_second_mode,
    "8f": second_mode_is_critical,
    "8g": twice_the_modes,
}
