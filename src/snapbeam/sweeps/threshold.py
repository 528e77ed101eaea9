"""Thresholds: the values of a parameter between which a beam begins to snap through, over any other parameters."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.config.parameters import lookup
from snapbeam.core.codes import ResponseClass
from snapbeam.core.reporting import counting
from snapbeam.core.validate import InputError, shown
from snapbeam.model.integration import Integration
from snapbeam.model.system import System
from snapbeam.sweeps.points import Grid, points_of
from snapbeam.sweeps.setup import Progress, SweepSetup, sweep_setup, variable_attributes
from snapbeam.sweeps.stored import CheckpointOptions, compute_sweep

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["threshold"]

_OUTCOMES = (
    "band_found",
    "no_interwell_in_range",
    "lowest_value_is_interwell",
    "highest_run_is_intrawell",
    "undecided",
    "not_searched",
)
"""Meanings of the values 0 to 5 of the variable ``outcome``."""


def threshold(
    system: System,
    parameter: str,
    values: ArrayLike,
    axes: Mapping[str, ArrayLike],
    integration: Integration | None = None,
    *,
    progress: Progress | bool | None = None,
) -> xr.Dataset:
    """Find the threshold of the interwell response along one parameter, over any other parameters, as a band.

    The boundary is fractal in places: interwell values may lie below intrawell values.  The result has
    therefore two curves: the lowest interwell value, and the value from which every run is interwell.  snapbeam runs
    every point of the grid, so both curves are exact on that grid.

    Parameters
    ----------
    system : System
        The model; parameters that are not in `over` keep their values.
    parameter : str
        Parameter to raise, such as ``"velocity_amplitude"``: one that may differ between the runs of an ensemble.
    values : array_like
        Values of that parameter, strictly increasing, in its unit: the range and the resolution of the threshold.
    axes : mapping of str to array_like
        Axes of the threshold, as in :func:`snapbeam.sweep`.
    integration : Integration, optional
        Solver settings.  Every run ends as soon as its response class is certain, whatever `early_termination` is.
    progress : callable, optional
        Function that receives ``(done, total)``, numbers of runs; True writes a line to standard error.

    Returns
    -------
    xarray.Dataset
        Over the axes:

        - ``lower_threshold``: lowest value with an interwell run; NaN if no run is interwell.
        - ``upper_threshold``: lowest value from which every run with a response class is interwell; NaN if the
          highest such run is intrawell.
        - ``last_intrawell``: highest value with an intrawell run below ``lower_threshold``.
        - ``failed_runs``: number of runs without a response class.  Such a run is neither interwell nor
          intrawell.
        - ``lower_threshold_min``, ``upper_threshold_max``: lower limit of the first curve if every failed run were
          interwell, and upper limit of the second if every failed run were intrawell.  They differ from the
          curves only where a failed run leaves the threshold open; NaN where no value of the range is the limit.
        - ``outcome``: one of the flags ``band_found``, ``no_interwell_in_range``, ``lowest_value_is_interwell``,
          ``highest_run_is_intrawell``, ``undecided`` (no run is known to be interwell, but runs failed) and
          ``not_searched`` (no run has a response class).

        Over the axes and the values: ``response`` and ``status`` of every run.

    Raises
    ------
    InputError
        For bad input, such as a parameter that belongs to the model and cannot differ between the runs of an
        ensemble.
    """
    row = lookup(parameter)
    if not row.is_run or row.quantity.kind is not float:
        raise InputError(
            f"along = {shown(parameter)}: must be a number that may differ between runs, such as velocity_amplitude"
        )
    if not isinstance(axes, Mapping) or not axes:
        raise InputError(f"over = {shown(axes)}: must map at least one parameter to an array of values")
    if np.size(values) < 2:
        raise InputError(f"{parameter}: must be an array of at least two values to choose from")
    asked = Integration() if integration is None else integration
    if not isinstance(asked, Integration):
        raise InputError(f"integration = {shown(integration)}: must be an Integration")
    points = points_of({**axes, row.name: values})
    assert isinstance(points, Grid)
    setup = sweep_setup(system, points, asked.replace(early_termination=True))
    computed = compute_sweep(setup, CheckpointOptions(), progress=counting(progress, "threshold", "runs"))
    return _dataset(setup, row.name, computed)


def _dataset(setup: SweepSetup, along: str, computed: xr.Dataset) -> xr.Dataset:
    """Reduce the response classes of a whole grid to thresholds."""
    import xarray as xr

    assert isinstance(setup.points, Grid)
    row = lookup(along)
    values = setup.points.axes[along]
    dims = tuple(lookup(name).short for name in setup.points.axes if name != along)
    whole = (*dims, row.short)
    response = computed["response_class"].transpose(*whole).values
    rows = _thresholds(response)
    attrs = setup.attributes("threshold of the interwell response of a struck bistable beam")
    attrs.pop("early_termination")
    attrs |= {"parameter": row.short, "runs": int(response.size)}
    dataset = xr.Dataset(coords=setup.coordinates(), attrs=attrs)
    words = row.quantity.long_name
    symbol = f" {row.quantity.symbol}" if row.quantity.symbol else ""
    padded = np.append(values, np.nan)
    for name, text in (
        ("lower_threshold", f"lowest {words}{symbol} that makes an interwell response"),
        ("upper_threshold", f"{words}{symbol} above which all runs are interwell"),
        ("last_intrawell", f"highest {words}{symbol} run below that without snap-through"),
        ("lower_threshold_min", f"lowest {words}{symbol} that may be interwell, failed runs included"),
        ("upper_threshold_max", f"{words}{symbol} above which no run failed or is intrawell"),
    ):
        dataset[name] = (dims, padded[rows[name]], {"units": row.quantity.unit, "long_name": text})
    failed = {"units": "1", "long_name": "runs without a response class"}
    dataset["failed_runs"] = (dims, rows["failed_runs"], failed)
    flags = {
        "units": "1",
        "long_name": "kind of result",
        "flag_values": np.arange(len(_OUTCOMES), dtype=np.int8),
        "flag_meanings": " ".join(_OUTCOMES),
    }
    dataset["outcome"] = (dims, rows["outcome"].astype(np.int8), flags)
    for name in ("response_class", "status"):
        dataset[name] = (whole, computed[name].transpose(*whole).values, variable_attributes(name))
    return dataset


def _thresholds(response: NDArray[np.int8]) -> dict[str, NDArray[Any]]:
    """Return the rows of the thresholds of columns of response classes, the rows along the last axis.

    A row equal to the number of rows means that no row of the column is the threshold.
    """
    interwell, intrawell = response >= ResponseClass.TRANSIENT_1, response == ResponseClass.INTRAWELL
    failed = ~(interwell | intrawell)
    count = response.shape[-1]
    first, first_min = _lowest(interwell), _lowest(interwell | failed)
    always = _lowest(interwell & _above_all(intrawell))
    always_max = _lowest(interwell & _above_all(intrawell | failed))
    below = intrawell & (np.arange(count) < first[..., None])
    outcome = np.select(
        [
            failed.all(axis=-1),
            (first == count) & failed.any(axis=-1),
            first == count,
            first == 0,
            always == count,
        ],
        [5, 4, 1, 2, 3],
        0,
    )
    return {
        "lower_threshold": first,
        "upper_threshold": always,
        "last_intrawell": np.where(below.any(axis=-1), count - 1 - _lowest(below[..., ::-1]), count),
        "lower_threshold_min": first_min,
        "upper_threshold_max": always_max,
        "failed_runs": failed.sum(axis=-1),
        "outcome": outcome,
    }


def _lowest(chosen: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return the lowest chosen row of each column; the number of rows if none is chosen."""
    return np.where(chosen.any(axis=-1), chosen.argmax(axis=-1), chosen.shape[-1])


def _above_all(chosen: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return whether no chosen row of the column lies at a row or above it."""
    later: NDArray[np.bool_] = np.logical_or.accumulate(chosen[..., ::-1], axis=-1)[..., ::-1]
    return ~later
