"""The value of a parameter at which a beam snaps with probability 0.05, 0.5, 0.95, over any others."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.config.parameters import lookup
from snapbeam.core.kinds import checked
from snapbeam.core.provenance import canonical_json
from snapbeam.core.reporting import counting
from snapbeam.core.validate import InputError, InputTypeError, shown
from snapbeam.design.events import OUTCOMES, reached
from snapbeam.design.quantiles.isotonic import crossing, rises, spans
from snapbeam.design.quantiles.local import local_crossing
from snapbeam.design.quantiles.search import Runs, QuantileSearchSettings, search
from snapbeam.design.spread import ParameterUncertainty
from snapbeam.design.trials import Trials, trials_of
from snapbeam.model.integration import Integration
from snapbeam.model.system import System
from snapbeam.sweeps.points import Grid, PointList, points_of
from snapbeam.sweeps.setup import sweep_setup
from snapbeam.sweeps.stored import CheckpointOptions

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["quantile_threshold"]

TITLE = "quantile thresholds of a struck bistable beam"
LEVEL = "quantile"
_FALLS = 0.01
"""Probability of so much falling below which a threshold is not called one."""
_REACH = 3.0
"""Half widths of the interval within which runs count for the curve."""
_FOUND = "found not_reached_in_range exceeded_in_whole_range"


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
    """Where the probability of snapping passes given values along one parameter, over any others, with intervals.

    Every run has a value of its own.  The first round covers the range, each later one what is left open.  The
    interval is that of the isotonic regression, of which nothing but a rise is assumed (Banerjee and Wellner, Ann.
    Stat. 29 (2001) 1699); within it the threshold is where a logistic curve fitted to the runs about it passes the
    value.  Where the probability is seen to fall, which fractal borders do, ``monotone`` is False and the interval
    reaches from the first value at which the probability may be so great to the last at which it may be so small.

    Parameters
    ----------
    system : System
        The nominal one.
    parameter : str
        Parameter to raise, such as ``"velocity_amplitude"``: a number that may differ between the runs of an ensemble.
    bounds : tuple of two floats
        Range in which it is sought.
    axes : mapping of str to array_like, optional
        Axes, as of :func:`snapbeam.sweep`; one point, the system as it stands, by default.
    uncertainty : Spread, optional
        What differs from run to run.  Without one the response is what it is, and all quantiles are one threshold.
    options : Search, optional
        Probabilities, runs and rounds.
    integration : Integration, optional
        Runs end once their class is certain, whatever it says.
    checkpoint : path or Keeping, optional
        Folder that keeps the runs; one that exists is resumed.
    progress : callable, optional
        Called as ``progress(done, total)`` with runs; True writes a line to standard error.

    Returns
    -------
    xarray.Dataset
        ``threshold`` with ``threshold_low`` and ``threshold_high`` over the axes and ``quantile``; infinite limits
        where no run bounds it, NaN where ``outcome_of_search`` says why.  ``monotone``, with the probability
        ``monotonicity_p_value`` of so much falling if it rises; ``runs``, ``runs_failed``.

    Raises
    ------
    InputError
        For bad input, such as a parameter that needs another structure, and for a store that holds something else.

    Examples
    --------
    >>> ds = sb.quantile_threshold(  # doctest: +SKIP
    ...     system, "velocity_amplitude", (0.01, 0.6), {"frequency_ratio": omega}, spread
    ... )
    """
    row = lookup(parameter)
    if not row.is_run or row.quantity.kind is not float or row.section == "start":
        raise InputError(
            f"along = {shown(parameter)}: must be a number that may differ between runs, such as velocity_amplitude"
        )
    low, high = _range(row.name, bounds)
    options = QuantileSearchSettings() if options is None else options
    if not isinstance(options, QuantileSearchSettings):
        raise InputTypeError(f"how = {shown(options)}: must be a Search")
    trials = trials_of(system, uncertainty, integration, store=checkpoint)
    if axes is not None and not isinstance(axes, Mapping):
        raise InputTypeError(f"over = {shown(axes)}: must map parameters to arrays of values")
    points = points_of(axes) if axes else PointList({row.name: np.array([low])})
    assert isinstance(points, (Grid, PointList))
    if axes and row.name in points.names:
        raise InputError(f"over: has {row.name}, which is what is raised")
    sweep_setup(
        trials.system, PointList(points.take(np.arange(points.size)) | {row.name: np.full(points.size, high)})
    )
    setup = sweep_setup(trials.system, points, trials.integration)
    report = counting(progress, "quantile threshold", "runs")
    found = _searched(trials, points, row.name, (low, high), options, report)
    columns = [_column(runs, options, (low, high)) for runs in found]
    more = {
        "parameter": row.short, "bounds": [low, high], "confidence": options.confidence, "watched_outcome": options.outcome,
        "uncertainty": canonical_json(trials.spread.describe()), "rounds": options.rounds, "runs_made": trials.runs,
        "seed": trials.spread.seed, "search_seed": options.seed,
    }  # fmt: skip
    dataset = _labelled(
        setup.coordinates(), setup.attributes(TITLE, more), points, columns, options, row.name
    )
    return dataset if axes else dataset.isel(point=0).drop_vars(row.short)


def _range(name: str, between: Any) -> tuple[float, float]:
    quantity = lookup(name).quantity
    try:
        low, high = between
    except (TypeError, ValueError):
        raise InputTypeError(f"between = {shown(between)}: must be two numbers") from None
    low, high = (float(quantity.check("bounds", each)) for each in (low, high))
    if not low < high:
        raise InputError(f"between = ({low:g}, {high:g}): the first must be less than the second")
    return low, high


def _searched(
    trials: Trials,
    points: Grid | PointList,
    along: str,
    between: tuple[float, float],
    how: QuantileSearchSettings,
    report: Callable[[int, int], object] | None,
) -> list[Runs]:
    total, before = points.size * how.runs, [0]

    def ask(
        columns: NDArray[np.int64], values: NDArray[np.float64], numbers: NDArray[np.int64]
    ) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        def tell(done: int, _: int) -> None:
            if report is not None:
                report(before[0] + done, total)

        found = trials.statistics(points.take(columns) | {along: values}, numbers, tell)
        before[0] += columns.size
        return np.asarray(OUTCOMES[how.outcome].happened(found)), ~reached(found)

    return search(ask, points.size, between, how, report)


def _column(runs: Runs, how: QuantileSearchSettings, between: tuple[float, float]) -> dict[str, Any]:
    """Thresholds of one column, with their intervals."""
    size = len(how.probabilities)
    table = np.full((3, size), np.nan)
    codes = np.zeros(size, dtype=np.int8)
    p = rises(runs.values, runs.hits, seed=how.seed) if runs.values.size else np.nan
    monotone = not p < _FALLS
    for i, probability in enumerate(how.probabilities):
        if not runs.values.size:
            table[1:, i], codes[i] = (-np.inf, np.inf), 1
            continue
        value, low, high = crossing(runs.values, runs.hits, probability, how.confidence)
        if not monotone:
            first, last = spans(runs.values, runs.hits, probability, how.confidence)
            low, high = min(low, first), max(high, last)
        codes[i] = 1 if value == np.inf else 2 if value == -np.inf else 0
        if codes[i] == 0:
            ends = max(low, between[0]), min(high, between[1])
            near = local_crossing(runs.values, runs.hits, probability, *ends, _REACH)
            value = near if monotone and not _is_step(runs) and low <= near <= high else value
        table[:, i] = value if np.isfinite(value) else np.nan, low, high
    return {"table": table, "codes": codes, "p": p, "monotone": monotone, "runs": runs}


def _is_step(runs: Runs) -> bool:
    """Whether every run that hit lies above every run that did not."""
    return bool(runs.values[~runs.hits].max(initial=-np.inf) < runs.values[runs.hits].min(initial=np.inf))


def _labelled(
    coordinates: dict[str, Any],
    attributes: dict[str, Any],
    points: Grid | PointList,
    columns: list[dict[str, Any]],
    how: QuantileSearchSettings,
    along: str,
) -> xr.Dataset:
    import xarray as xr

    row = lookup(along)
    dataset = xr.Dataset(coords=coordinates, attrs=attributes)
    dataset[LEVEL] = ((LEVEL,), list(how.probabilities), {"units": "1", "long_name": "probability"})
    table = np.array([column["table"] for column in columns])
    for k, (ending, text) in enumerate((("", ""), ("_low", "lower limit: "), ("_high", "upper limit: "))):
        words = f"{text}{row.quantity.long_name} at which the probability is passed"
        labels = {"units": row.quantity.unit, "long_name": words}
        dataset[f"threshold{ending}"] = ((*points.dims, LEVEL), points.arranged(table[:, k]), labels)
    flags = {"flag_values": np.arange(3, dtype=np.int8), "flag_meanings": _FOUND}
    codes = points.arranged(np.array([column["codes"] for column in columns]))
    dataset["outcome_of_search"] = (
        (*points.dims, LEVEL),
        codes,
        {"units": "1", "long_name": "what was found"} | flags,
    )
    plain = {
        "monotone": (
            np.array([bool(column["monotone"]) for column in columns]), "whether the probability is not seen to fall"
        ),
        "monotonicity_p_value": (np.array([column["p"] for column in columns]), "probability of so much falling if it rises"),
        "runs": (np.array([column["runs"].values.size for column in columns]), "runs that came to an end"),
        "runs_failed": (np.array([column["runs"].failed for column in columns]), "runs that failed and are left out"),
    }  # fmt: skip
    for name, (values, text) in plain.items():
        dataset[name] = (points.dims, points.arranged(values), {"units": "1", "long_name": text})
    return dataset
