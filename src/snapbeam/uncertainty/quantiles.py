"""The value of a parameter at which a beam snaps with probability 0.05, 0.5, 0.95, over any others."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import optimize, special

from snapbeam.model.integration import Integration
from snapbeam.model.parameters import lookup
from snapbeam.model.system import System
from snapbeam.sweeps.compute import CheckpointOptions
from snapbeam.sweeps.points import Grid, PointList, points_of
from snapbeam.sweeps.setup import sweep_setup
from snapbeam.uncertainty.distributions import ParameterUncertainty
from snapbeam.uncertainty.monte_carlo import Trials, outcome_named, trials_of
from snapbeam.util.diagnostics import counting
from snapbeam.util.proportions import levels_of, proportion
from snapbeam.util.provenance import canonical_json
from snapbeam.util.validation import InputError, InputTypeError, checked, integer, or_default, shown, within

if TYPE_CHECKING:
    import xarray as xr

_Array = NDArray[np.float64]
_TABLE = {0.5: 0.28506, 0.75: 0.80694, 0.8: 0.98729, 0.85: 1.22756, 0.9: 1.60246, 0.95: 2.26916, 0.99: 3.83630}
"""Quantiles of the limiting distribution (Banerjee and Wellner 2001, Table 1)."""
_Index = NDArray[np.int64]
Ask = Callable[[_Index, _Array, _Index], tuple[NDArray[np.bool_], NDArray[np.bool_]]]
"""Function of columns, values and numbers of samples; returns masks of the runs that hit and that failed."""
_WIDER = 0.5
"""Fraction of an interval by which the next round extends it on either side."""
_SURE = 0.99
TITLE = "quantile thresholds of a struck bistable beam"
LEVEL = "quantile"
_FALLS = 0.01
"""Probability of so much falling below which a threshold is not called one."""
_REACH = 3.0
"""Half widths of the interval within which runs count for the curve."""
_FOUND = "found not_reached_in_range exceeded_in_whole_range"


# Where a probability that rises passes a value, from single runs at many values, with an interval.
#
# Whether a run at v is a hit is a coin with the probability P(v).  If P does not fall, its most likely form is the
# isotonic regression; the interval of the value at which it passes q holds every v for which the best P with P(v) = q
# is not much less likely than the best of all.  Twice the difference of their log likelihoods has one limiting
# distribution whatever P is (Banerjee and Wellner, Ann. Stat. 29 (2001) 1699), so that
# nothing has to be assumed of its shape.


class Crossing(NamedTuple):
    """Value at which a probability curve crosses a given probability."""

    value: float
    """Midpoint between where the isotonic regression is less and where it is more; infinite where it never is."""
    low: float
    """-inf if no run bounds it from below."""
    high: float
    """inf if no run bounds it from above."""


def isotonic(hits: ArrayLike) -> _Array:
    """The most likely probabilities that do not fall, of coins in order."""
    return np.asarray(optimize.isotonic_regression(np.asarray(hits, dtype=np.float64)).x)


def _losses(hits: _Array, share: _Array) -> _Array:
    """Minus the log likelihood of each coin."""
    return np.asarray(-special.xlogy(hits, share) - special.xlogy(1.0 - hits, 1.0 - share))


def critical(confidence: float) -> float:
    """The quantile of the limiting distribution.

    Raises
    ------
    InputError
        For a confidence outside [0.5, 0.99].
    """
    within("confidence", confidence, 0.5, 0.99, closed="both")
    # its tail falls almost like an exponential
    return float(np.interp(-np.log1p(-confidence), [-np.log1p(-each) for each in _TABLE], list(_TABLE.values())))


def crossing(values: ArrayLike, hits: ArrayLike, probability: float, confidence: float = 0.95) -> Crossing:
    """Value at which a nondecreasing hit probability crosses *probability*.

    Parameters
    ----------
    values, hits : array_like of shape (runs,)
        Value of the parameter of each run, in any order, and True if it hit.
    probability : float
        Probability that is crossed, in (0, 1).
    confidence : float
        Confidence level of the interval, in [0.5, 0.99].
    """
    q = within("probability", probability, 0.0, 1.0)
    limit = critical(confidence)
    order = np.argsort(np.asarray(values), kind="stable")
    v, h = np.asarray(values, dtype=np.float64)[order], np.asarray(hits, dtype=np.float64)[order]
    if v.ndim != 1 or v.shape != h.shape or v.size == 0:
        raise InputError("values, hits: must be two lists of one length, of at least one run")
    best = isotonic(h)
    ends = np.append(v, np.inf), np.append(-np.inf, v)
    below = int(np.searchsorted(best, q, side="left"))
    above = int(np.searchsorted(best, q, side="right"))
    middle = 0.5 * (ends[1][below] + ends[0][above])
    # a candidate between runs k - 1 and k: probabilities below it are at most q, those above it at least
    least = float(np.sum(_losses(h, best)))
    kept = [k for k in range(v.size + 1) if 2.0 * (_constrained(h, k, q) - least) <= limit]
    return Crossing(float(middle), float(ends[1][kept[0]]), float(ends[0][kept[-1]]))


def _constrained(hits: _Array, at: int, q: float) -> float:
    """Minus the maximum log likelihood if the probability passes *q* before coin *at*."""
    total = 0.0
    for part, cut in ((hits[:at], np.minimum), (hits[at:], np.maximum)):
        if part.size:
            total += float(np.sum(_losses(part, cut(isotonic(part), q))))
    return total


def rises(values: ArrayLike, hits: ArrayLike, *, bins: int = 12, samples: int = 400, seed: int = 0) -> float:
    """Probability of so much falling in the shares of hits if the probability of a hit rises.

    The runs are put into bins of equal numbers; twice the log likelihood that the isotonic regression of the bins lacks
    is compared with that of sets of coins sampled from that regression.

    Returns
    -------
    float
        Small where the probability falls somewhere.
    """
    order = np.argsort(np.asarray(values), kind="stable")
    h = np.asarray(hits, dtype=np.float64)[order]
    parts = np.array_split(h, min(bins, max(h.size // 8, 1)))
    runs = np.array([part.size for part in parts], dtype=np.float64)
    good = np.array([part.sum() for part in parts])
    fitted = optimize.isotonic_regression(good / runs, weights=runs).x
    generator = np.random.Generator(np.random.Philox(key=[seed, 0]))
    drawn = generator.binomial(runs.astype(np.int64), np.clip(fitted, 0.0, 1.0), (samples, runs.size))
    lack = np.array([_lack(row, runs) for row in drawn])
    return float((np.sum(lack >= _lack(good, runs) - 1e-9) + 1) / (samples + 1))


def spans(
    values: ArrayLike, hits: ArrayLike, probability: float, confidence: float = 0.95, bins: int = 12
) -> tuple[float, float]:
    """Range from the first value where the probability may be so great to the last where it may be so small.

    Nothing is assumed of how it rises or falls: the runs are put into bins, whose intervals hold all at once.
    """
    order = np.argsort(np.asarray(values), kind="stable")
    parts = np.array_split(order, min(bins, max(order.size // 8, 1)))
    v, h = np.asarray(values, dtype=np.float64), np.asarray(hits, dtype=np.float64)
    sure = 1.0 - (1.0 - confidence) / len(parts)
    _, low, high = proportion([h[part].sum() for part in parts], [part.size for part in parts], sure)
    first = [float(v[part].min()) for part, top in zip(parts, high, strict=True) if top >= probability]
    last = [float(v[part].max()) for part, bottom in zip(parts, low, strict=True) if bottom <= probability]
    return min(first, default=np.inf), max(last, default=-np.inf)


def _lack(good: _Array, runs: _Array) -> float:
    share = good / runs
    fitted = optimize.isotonic_regression(share, weights=runs).x
    free = special.xlogy(good, share) + special.xlogy(runs - good, 1.0 - share)
    held = special.xlogy(good, fitted) + special.xlogy(runs - good, 1.0 - fitted)
    return float(2.0 * np.sum(free - held))


# The value at which a probability passes another, from a logistic curve fitted nearby.


_STEPS, _SMALL = 60, 1e-9


def local_crossing(
    values: _Array, hits: NDArray[Any], probability: float, low: float, high: float, reach: float = 2.0
) -> float:
    """Value at which a local logistic regression about an interval crosses *probability*; NaN if it does not.

    Runs count by the tricube of their distance from the middle of the interval over *reach* times its half width. The
    fit is Firth's (Biometrika 80 (1993) 27), whose bias is of second order and which is finite for separated runs.
    """
    middle, half = 0.5 * (low + high), max(0.5 * (high - low), 1e-300)
    distance = (values - middle) / half
    weight = np.clip(1.0 - np.abs(distance / reach) ** 3, 0.0, None) ** 3
    near = weight > 0.0
    if near.sum() < 4:
        return float("nan")
    x = np.stack([np.ones(int(near.sum())), distance[near]], axis=1)
    y, w = hits[near].astype(np.float64), weight[near]
    beta = np.zeros(2)
    for _ in range(_STEPS):
        share = special.expit(x @ beta)
        curve = w * share * (1.0 - share)
        information = x.T @ (curve[:, None] * x)
        if not np.linalg.det(information) > 1e-14:
            return float("nan")
        inverse = np.linalg.inv(information)
        leverage = curve * np.einsum("ij,jk,ik->i", x, inverse, x)
        step = inverse @ (x.T @ (w * (y - share) + leverage * (0.5 - share)))
        size = float(np.abs(step).max())
        beta = beta + step / max(1.0, size / 2.0)
        if size < _SMALL:
            break
    else:
        return float("nan")
    if not beta[1] > 0.0:
        return float("nan")
    return float(middle + half * (special.logit(probability) - beta[0]) / beta[1])


# Where to run next so that quantile thresholds become narrow: rounds, each within what the last left open.


@dataclass(frozen=True, kw_only=True)
class QuantileSearchSettings:
    """Settings of the adaptive search for threshold quantiles.

    Parameters
    ----------
    probabilities : tuple of float
        Probabilities of the quantiles, increasing, each in (0, 1).
    runs : int
        Runs of every column, at least 40 for each probability.
    rounds : int
        Rounds of the runs: the first over the whole range, each later one about the intervals found.
    confidence : float
        Confidence level of the intervals, in [0.5, 0.99].
    seed : int
        Seed of the values of the runs.
    outcome : str
        Outcome of the probability, as in :class:`SamplingPlan`.

    See Also
    --------
    snapbeam.uncertainty.quantile_threshold

    Examples
    --------
    >>> import snapbeam as sb
    >>> sb.uncertainty.QuantileSearchSettings(probabilities=(0.5,), runs=80).confidence
    0.95
    """

    probabilities: tuple[float, ...] = (0.05, 0.5, 0.95)
    runs: int = 400
    rounds: int = 4
    confidence: float = 0.95
    seed: int = 0
    outcome: str = "snap"

    def __post_init__(self) -> None:
        chosen = levels_of("probabilities", self.probabilities)
        object.__setattr__(self, "probabilities", chosen)
        integer("runs", self.runs, 40 * len(chosen), 10**7)
        integer("rounds", self.rounds, 1, 50)
        within("confidence", self.confidence, 0.5, 0.99, closed="both")
        integer("seed", self.seed, 0, 2**63 - 1)
        object.__setattr__(self, "outcome", outcome_named(self.outcome)[0])


@dataclass
class Runs:
    """Runs of one column."""

    values: _Array = field(default_factory=lambda: np.empty(0))
    hits: NDArray[np.bool_] = field(default_factory=lambda: np.empty(0, dtype=bool))
    failed: int = 0
    made: int = 0


def search(
    ask: Ask,
    columns: int,
    bounds: tuple[float, float],
    options: QuantileSearchSettings,
    tell: Callable[[int, int], object] | None = None,
) -> list[Runs]:
    """Make the runs of every column.

    Every run has a value of its own, one in each of as many equal parts of what is looked at as there are runs, so that
    no grid hides anything; and a sample of its own.  Columns share the numbers of samples.
    """
    found = [Runs() for _ in range(columns)]
    share = np.diff(np.linspace(0, options.runs, options.rounds + 1).astype(np.int64))
    total = columns * options.runs
    for number, count in enumerate(share.tolist()):
        asked = [_values(column, bounds, options, number, count, c) for c, column in enumerate(found)]
        which = np.repeat(np.arange(columns), count)
        draws = np.concatenate([np.arange(column.made, column.made + count) for column in found])
        hits, failed = ask(which, np.concatenate(asked), draws)
        for c, column in enumerate(found):
            own = which == c
            good = ~failed[own]
            column.values = np.concatenate([column.values, asked[c][good]])
            column.hits = np.concatenate([column.hits, hits[own][good]])
            column.failed += int((~good).sum())
            column.made += count
        if tell is not None:
            tell(min(columns * int(share[: number + 1].sum()), total), total)
    return found


def _values(
    column: Runs, bounds: tuple[float, float], options: QuantileSearchSettings, number: int, count: int, place: int
) -> _Array:
    """Values of the runs of one round."""
    generator = np.random.Generator(np.random.Philox(key=[options.seed, place * 64 + number]))
    windows = [bounds] if number == 0 or column.values.size == 0 else _windows(column, bounds, options)
    each = np.diff(np.linspace(0, count, len(windows) + 1).astype(np.int64))
    parts = []
    for (low, high), size in zip(windows, each.tolist(), strict=True):
        parts.append(low + (high - low) * (np.arange(size) + generator.random(size)) / max(size, 1))
    return np.concatenate(parts)


def _windows(column: Runs, bounds: tuple[float, float], options: QuantileSearchSettings) -> list[tuple[float, float]]:
    """A little more than the interval of each probability."""
    found = []
    for probability in options.probabilities:
        _, low, high = crossing(column.values, column.hits, probability, _SURE)
        low, high = max(low, bounds[0]), min(high, bounds[1])
        reach = _WIDER * (high - low)
        found.append((max(low - reach, bounds[0]), min(high + reach, bounds[1])))
    return found


@checked
def quantile_threshold(
    system: System,
    parameter: str,
    bounds: tuple[float, float],
    axes: Mapping[str, ArrayLike] | None = None,
    uncertainty: ParameterUncertainty | None = None,
    options: QuantileSearchSettings | None = None,
    *,
    integration: Integration | None = None,
    checkpoint: str | os.PathLike[str] | CheckpointOptions | None = None,
    progress: Callable[[int, int], object] | bool | None = None,
) -> xr.Dataset:
    """Find the values of a parameter at which the probability of snap-through has given values, with intervals.

    Every run has its own value. The first round covers the range, each later one the remaining intervals. The interval
    is that of isotonic regression, which assumes a rise only (Banerjee and Wellner, Ann. Stat. 29 (2001) 1699); within
    it the threshold is where a fitted logistic curve passes the value. Where the probability falls, as fractal borders
    make it, ``is_monotonic`` is False, and the interval contains every value at which the probability may be the given
    one.

    Parameters
    ----------
    system : System
        The nominal system.
    parameter : str
        Parameter to raise, such as ``"velocity_amplitude"``, that may differ between runs.
    bounds : tuple of two floats
        Range of the search.
    axes : mapping of str to array_like, optional
        Axes, as in :func:`snapbeam.sweep`; the system itself by default.
    uncertainty : ParameterUncertainty, optional
        Uncertain parameters.  Without uncertainty all quantiles are one threshold.
    options : QuantileSearchSettings, optional
        Probabilities, runs and rounds.
    integration : Integration, optional
        Solver settings. Runs end early unless the outcome is a statistic beyond a value.
    checkpoint, progress : optional
        Folder and report of runs, as in :func:`snapbeam.sweep`.

    Returns
    -------
    xarray.Dataset
        ``threshold`` with ``threshold_low`` and ``threshold_high`` over the axes and ``quantile``; infinite limits
        where no run bounds it, NaN if ``outcome_of_search`` gives a reason. ``is_fitted``: the threshold is that of the
        fitted curve, not of the isotonic regression alone. ``is_monotonic``, with the ``monotonicity_p_value`` of such
        a fall; ``runs``, ``runs_failed``.

    See Also
    --------
    snapbeam.uncertainty.QuantileSearchSettings, snapbeam.threshold

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> system = paper.struck_beam(frequency_ratio=1.2, velocity_amplitude=0.18)
    >>> uncertainty = sb.uncertainty.ParameterUncertainty(
    ...     of={"contact.stiffness": sb.uncertainty.LogNormal(0.2), "location": sb.uncertainty.Normal(0.005)}
    ... )
    >>> ds = sb.uncertainty.quantile_threshold(
    ...     system,
    ...     "velocity_amplitude",
    ...     (0.02, 0.4),
    ...     {"frequency_ratio": [1.2]},
    ...     uncertainty,
    ...     sb.uncertainty.QuantileSearchSettings(probabilities=(0.5,), runs=80),
    ...     integration=sb.Integration(cycles=5),
    ... )
    >>> bool((ds.threshold_low < ds.threshold).all())
    True
    """
    row = lookup(parameter)
    if not row.is_run or row.quantity.kind is not float or row.section == "initial_state":
        raise InputError(
            f"parameter = {shown(parameter)}: must be a number that may differ between runs, such as velocity_amplitude"
        )
    low, high = _range(row.name, bounds)
    options = or_default("options", options, QuantileSearchSettings, "a QuantileSearchSettings")
    watched = outcome_named(options.outcome)[1].statistic
    trials = trials_of(system, uncertainty, integration, checkpoint=checkpoint, statistics=[watched])
    if axes is not None and not isinstance(axes, Mapping):
        raise InputTypeError(f"axes = {shown(axes)}: must map parameters to arrays of values")
    points = points_of(axes, trials.system) if axes else PointList({row.name: np.array([low])})
    assert isinstance(points, (Grid, PointList))
    if axes and row.name in points.names:
        raise InputError(f"axes: contains {row.name}, the parameter itself; leave it out")
    sweep_setup(trials.system, PointList(points.take(np.arange(points.size)) | {row.name: np.full(points.size, high)}))
    setup = sweep_setup(trials.system, points, trials.integration)
    report = counting(progress, "quantile threshold", "runs")
    found = _searched(trials, points, row.name, (low, high), options, report)
    columns = [_column(runs, options, (low, high)) for runs in found]
    more = {
        "parameter": row.short, "bounds": [low, high], "confidence": options.confidence, "watched_outcome": options.outcome,
        "uncertainty": canonical_json(trials.uncertainty.describe()), "rounds": options.rounds, "runs_made": trials.runs,
        "termination_reason": f"{options.runs} runs of every column in {options.rounds} rounds, the maximum (runs, rounds)",
        "seed": trials.uncertainty.seed, "search_seed": options.seed,
    }  # fmt: skip
    dataset = _labelled(setup.coordinates(), setup.attributes(TITLE, more), points, columns, options, row.name)
    return dataset if axes else dataset.isel(point=0).drop_vars(row.short)


def _range(name: str, bounds: Any) -> tuple[float, float]:
    quantity = lookup(name).quantity
    try:
        low, high = bounds
    except (TypeError, ValueError):
        raise InputTypeError(f"bounds = {shown(bounds)}: must be two numbers") from None
    low, high = (float(quantity.check("bounds", each)) for each in (low, high))
    if not low < high:
        raise InputError(f"bounds = ({low:g}, {high:g}): the first must be less than the second")
    return low, high


def _searched(
    trials: Trials,
    points: Grid | PointList,
    parameter: str,
    bounds: tuple[float, float],
    options: QuantileSearchSettings,
    report: Callable[[int, int], object] | None,
) -> list[Runs]:
    total, before, event = points.size * options.runs, [0], outcome_named(options.outcome)[1]

    def ask(
        columns: NDArray[np.int64], values: NDArray[np.float64], numbers: NDArray[np.int64]
    ) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        def tell(done: int, _: int) -> None:
            if report is not None:
                report(before[0] + done, total)

        found = trials.statistics(points.take(columns) | {parameter: values}, numbers, tell)
        before[0] += columns.size
        return event.happened(found), event.failed(found)

    return search(ask, points.size, bounds, options, report)


def _column(runs: Runs, options: QuantileSearchSettings, bounds: tuple[float, float]) -> dict[str, Any]:
    """Thresholds of one column, with their intervals."""
    size = len(options.probabilities)
    table = np.full((3, size), np.nan)
    codes, curve = np.zeros(size, dtype=np.int8), np.zeros(size, dtype=bool)
    p = rises(runs.values, runs.hits, seed=options.seed) if runs.values.size else np.nan
    monotone = not p < _FALLS
    # every hit is above every miss
    stepped = runs.values[~runs.hits].max(initial=-np.inf) < runs.values[runs.hits].min(initial=np.inf)
    for i, probability in enumerate(options.probabilities):
        if not runs.values.size:
            table[1:, i], codes[i] = (-np.inf, np.inf), 1
            continue
        value, low, high = crossing(runs.values, runs.hits, probability, options.confidence)
        if not monotone:
            first, last = spans(runs.values, runs.hits, probability, options.confidence)
            low, high = min(low, first), max(high, last)
        codes[i] = 1 if value == np.inf else 2 if value == -np.inf else 0
        if codes[i] == 0:
            ends = max(low, bounds[0]), min(high, bounds[1])
            near = local_crossing(runs.values, runs.hits, probability, *ends, _REACH)
            curve[i] = monotone and not stepped and low <= near <= high
            value = near if curve[i] else value
        table[:, i] = value if np.isfinite(value) else np.nan, low, high
    return {"table": table, "codes": codes, "curve": curve, "p": p, "monotone": monotone, "runs": runs}


def _labelled(
    coordinates: dict[str, Any],
    attributes: dict[str, Any],
    points: Grid | PointList,
    columns: list[dict[str, Any]],
    options: QuantileSearchSettings,
    parameter: str,
) -> xr.Dataset:
    from snapbeam.util.datasets import xr

    row = lookup(parameter)
    dataset = xr.Dataset(coords=coordinates, attrs=attributes)
    dataset[LEVEL] = ((LEVEL,), list(options.probabilities), {"units": "1", "long_name": "probability"})
    table = np.array([column["table"] for column in columns])
    for k, (ending, text) in enumerate((("", ""), ("_low", "lower limit: "), ("_high", "upper limit: "))):
        long_name = f"{text}{row.quantity.long_name} at which the probability is passed"
        labels = {"units": row.quantity.unit, "long_name": long_name}
        dataset[f"threshold{ending}"] = ((*points.dims, LEVEL), points.arranged(table[:, k]), labels)
    flags: dict[str, Any] = {"flag_values": np.arange(3, dtype=np.int8), "flag_meanings": _FOUND}
    codes = points.arranged(np.array([column["codes"] for column in columns]))
    found = {"units": "1", "long_name": "status of the search"} | flags
    dataset["outcome_of_search"] = ((*points.dims, LEVEL), codes, found)
    words = "whether the threshold is that of the fitted curve; else of the isotonic regression"
    fitted = points.arranged(np.array([column["curve"] for column in columns]))
    dataset["is_fitted"] = ((*points.dims, LEVEL), fitted, {"units": "1", "long_name": words})
    plain = {
        "is_monotonic": (
            np.array([bool(column["monotone"]) for column in columns]), "whether the probability is not seen to fall"
        ),
        "monotonicity_p_value": (np.array([column["p"] for column in columns]), "probability of so much falling if it rises"),
        "runs": (np.array([column["runs"].values.size for column in columns]), "runs that came to an end"),
        "runs_failed": (np.array([column["runs"].failed for column in columns]), "runs that failed and are left out"),
    }  # fmt: skip
    for name, (values, text) in plain.items():
        dataset[name] = (points.dims, points.arranged(values), {"units": "1", "long_name": text})
    return dataset
