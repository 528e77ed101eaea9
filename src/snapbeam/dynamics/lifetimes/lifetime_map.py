"""How long snapping lasts, and how it ends: many starts at every point of a sweep."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.core.codes import RunStatus
from snapbeam.core.kinds import checked
from snapbeam.core.validate import InputError, InputTypeError, shown
from snapbeam.dynamics.lifetimes.survival import LifetimeSettings, checked_cycles, fit_lifetime, proportion
from snapbeam.dynamics.lifetimes.work import LifetimeWork
from snapbeam.dynamics.starts import InitialConditions, held_in_space, starts_of
from snapbeam.model.integration import Integration
from snapbeam.model.system import System
from snapbeam.runs.save import code_flags
from snapbeam.sweeps.compute.task import ResultTable
from snapbeam.sweeps.points import PointList
from snapbeam.sweeps.setup import SweepSetup, sweep_setup
from snapbeam.sweeps.stored import CheckpointOptions, compute_table

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["lifetime_map", "refit"]

TITLE = "lifetimes of the snapping of a struck bistable beam"
CYCLES = 1000
"""Cycles of a run unless others are asked for."""
WELLS = ("first", "other")
START, WELL, AFTER = "start", "well", "after"
_REACHED = (int(RunStatus.OK), int(RunStatus.EARLY_STOP))


@checked
def lifetime_map(
    system: System,
    axes: Mapping[str, Any] | xr.Dataset | Any = None,
    integration: Integration | None = None,
    *,
    initial_conditions: InitialConditions | int = 32,
    settings: LifetimeSettings | None = None,
    after: ArrayLike | None = None,
    checkpoint: str | os.PathLike[str] | CheckpointOptions | None = None,
    cluster: str | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> xr.Dataset:
    """How long snapping lasts and how likely each end is, over any parameters.

    A class after n cycles is one sample of what may be a chaotic transient.  Here every point is run from many
    starts, with the tip's mid-position fixed in space; a run snaps until its centre crosses zero for the last time,
    and the share that still snaps, exp(-(t - delay)/lifetime), is fitted to the runs that ended and to those that
    did not (:func:`~snapbeam.dynamics.lifetimes.survival.fit_lifetime`).

    Parameters
    ----------
    system : System
    axes : optional
        As of :func:`snapbeam.sweep`; one point, the system as it stands, by default.
    integration : Integration, optional
        1000 cycles by default.  Runs end early once they provably snap no more, whatever it says.
    initial_conditions : Starts or int
        Starts of each point, the same for all of them.
    settings : Survival, optional
        Delay, quiet cycles and confidence.
    after : array_like of int, optional
        Cycles n for the probability that a run still snaps then; an eighth, a quarter and a half of the cycles, and
        all of them less the quiet ones, by default.
    store, cluster, progress
        As of :func:`snapbeam.sweep`.

    Returns
    -------
    xarray.Dataset
        Over the axes, in cycles: ``lifetime`` with ``lifetime_low`` and ``lifetime_high``, ``delay``,
        ``goodness`` (the probability of so great a distance from an exponential), ``runs_ended``, ``runs_snapping``,
        ``runs_never`` (never crossed) and ``runs_failed``; ``end_probability`` over ``well`` and
        ``snapping_probability`` over ``after``, each with ``_low`` and ``_high``; and for every ``start``:
        ``last_snap``, ``well`` the run ended about, ``final_well_proven`` and ``status``.

    Raises
    ------
    InputError
        For bad input, and for a store that holds something else.
    CheckpointError
        If the store is in use, cannot be written or is damaged beyond repair.

    Examples
    --------
    >>> ds = sb.lifetime_map(system, {"velocity_amplitude": np.linspace(0.1, 0.6, 20)}, starts=100)  # doctest: +SKIP
    """
    if not isinstance(system, System):
        raise InputTypeError(f"system = {shown(system)}: must be a System")
    if system.striker is None or system.has_environment:
        raise InputError(
            "base, axial, harvester: starts differ by the phase of a striker, and what else moves has a phase to it; "
            "march a batch of states by sb.advance(system, every=True) and count"
            if system.has_environment
            else "striker = None: a beam that nothing strikes does not go on snapping"
        )
    integration = Integration() if integration is None else integration
    if not isinstance(integration, Integration):
        raise InputTypeError(f"integration = {shown(integration)}: must be an Integration")
    settings = LifetimeSettings() if settings is None else settings
    if not isinstance(settings, LifetimeSettings):
        raise InputTypeError(f"survival = {shown(settings)}: must be a Survival")
    cycles = CYCLES if integration.cycles is None else integration.cycles
    kernel_input = _after(after, cycles, settings)
    integration = integration.replace(cycles=cycles, early_termination=True)
    setup = _setup(held_in_space(system), axes, integration)
    work = LifetimeWork(setup, None, starts_of(initial_conditions))
    keeping = checkpoint if isinstance(checkpoint, CheckpointOptions) else CheckpointOptions(checkpoint)
    table, made = compute_table(work, keeping, cluster=cluster, progress=progress)
    dataset = _runs(work, table, made)
    return _single(setup, refit(dataset, settings, kernel_input))


def _after(after: ArrayLike | None, cycles: int, survival: LifetimeSettings) -> NDArray[np.int64]:
    observed = cycles - survival.settling_cycles
    if observed <= 0.0:
        raise InputError(
            f"cycles = {cycles} with quiet = {survival.settling_cycles:g}: must be more than the quiet cycles"
        )
    if after is None:
        after = sorted(
            {int(part) for part in (cycles / 8, cycles / 4, cycles / 2, observed) if part <= observed}
        )
    return checked_cycles("after", after, observed)


def _setup(system: System, axes: Any, integration: Integration) -> SweepSetup:
    if axes is None:
        assert system.striker is not None
        axes = PointList({"striker.location": np.array([system.striker.location])})
    return sweep_setup(system, axes, integration)


def _single(setup: SweepSetup, dataset: xr.Dataset) -> xr.Dataset:
    one = isinstance(setup.points, PointList) and tuple(setup.points.columns) == ("striker.location",)
    return dataset.isel(point=0) if one and setup.points.size == 1 else dataset


def _runs(work: LifetimeWork, table: ResultTable, made: dict[str, Any]) -> xr.Dataset:
    """What was kept of every run, labelled."""
    import xarray as xr

    setup, points = work.setup, work.setup.points
    more = made | {f"starts_{name}": _plain(value) for name, value in work.starts.describe().items()}
    attrs = setup.attributes(TITLE, more)
    dataset = xr.Dataset(coords=setup.coordinates(), attrs=attrs)
    dims = (*points.dims, START)
    kept = work.columns(table)
    failed = ~np.isin(kept["status"], _REACHED)
    columns: dict[str, tuple[Any, str, str, dict[str, Any]]] = {
        "last_snap": (kept["last_snap"], "1", "cycle of the last crossing; NaN: never, or not known", {}),
        "snaps": (kept["zero_crossings"], "1", "crossings of the centre", {}),
        "late_snaps": (kept["late_crossings"], "1", "crossings in the last quarter of the run", {}),
        "end_well": (
            np.where(failed, 0, kept["well"]), "1", "well that the run ended about",
            {"flag_values": np.array([-1, 0, 1], dtype=np.int8), "flag_meanings": "first unknown other"},
        ),
        "final_well_proven": (kept["final"] != 0, "1", "whether the run provably ends there", {}),
        "status": (kept["status"], "1", "status of the run", code_flags(RunStatus)),
    }  # fmt: skip
    kinds = {"last_snap": "float64", "snaps": "int32", "late_snaps": "int32", "final_well_proven": "bool"}
    for name, (values, unit, words, labels) in columns.items():
        if name == "last_snap":
            values = np.where(failed, np.nan, values)
        array = points.arranged(np.asarray(values).astype(kinds.get(name, "int8")))
        dataset[name] = (dims, array, {"units": unit, "long_name": words} | labels)
    return dataset


def _plain(value: Any) -> Any:
    return int(value) if isinstance(value, bool) else value


def refit(
    dataset: xr.Dataset, survival: LifetimeSettings | None = None, after: ArrayLike | None = None
) -> xr.Dataset:
    """The lifetimes and probabilities of a lifetime map again, with another delay, quiet time or confidence.

    Parameters
    ----------
    dataset : xarray.Dataset
        Of :func:`lifetime_map`.
    settings : Survival, optional
    after : array_like of int, optional
        As of :func:`lifetime_map`; those of the dataset by default.

    Returns
    -------
    xarray.Dataset
    """
    if "last_snap" not in dataset or START not in dataset["last_snap"].dims:
        raise InputError("dataset: holds no lifetimes of starts")
    survival = LifetimeSettings() if survival is None else survival
    cycles = float(dataset.attrs["cycles"])
    if after is None:
        after = dataset[AFTER].values if AFTER in dataset.coords else None
    kernel_input = _after(after, int(cycles), survival)
    result = dataset.drop_dims([name for name in (AFTER, WELL) if name in dataset.dims])
    runs = result.transpose(..., START)
    dims = runs["last_snap"].dims[:-1]
    last, status = runs["last_snap"].values, runs["status"].values
    good = np.isin(status, _REACHED)
    snapped = good & np.isfinite(last)
    # what ended early provably snaps no more
    settled = runs["final_well_proven"].values.astype(bool) | (status == int(RunStatus.EARLY_STOP))
    observed = cycles - survival.settling_cycles
    lasting = snapped & ~settled & (last > observed)
    time = np.where(snapped, np.where(lasting, np.minimum(last, observed), last), np.nan)
    fit = fit_lifetime(time, snapped & ~lasting, survival.delay, survival.confidence)
    words: dict[str, tuple[Any, str]] = {
        "lifetime": (fit.lifetime, "lifetime of snapping, in cycles"),
        "lifetime_low": (fit.low, "lower limit of the lifetime"),
        "lifetime_high": (fit.high, "upper limit of the lifetime"),
        "delay": (fit.delay, "delay before runs end, in cycles"),
        "goodness": (fit.goodness, "probability of so great a distance from an exponential"),
        "runs_ended": (fit.ended, "runs that say how often snapping ends"),
        "runs_snapping": (lasting.sum(axis=-1), "runs that still snapped at the end"),
        "runs_never": ((good & ~snapped).sum(axis=-1), "runs that never snapped"),
        "runs_failed": ((~good).sum(axis=-1), "runs that failed"),
    }
    for name, (values, text) in words.items():
        result[name] = (dims, values, {"units": "1", "long_name": text})
    _probabilities(result, dims, good, time, lasting, runs["end_well"].values, kernel_input, survival)
    result.attrs |= {"quiet": survival.settling_cycles, "confidence": survival.confidence}
    return result


def _probabilities(
    result: xr.Dataset,
    dims: tuple[Any, ...],
    good: NDArray[np.bool_],
    time: NDArray[np.float64],
    lasting: NDArray[np.bool_],
    well: NDArray[np.int8],
    kernel_input: NDArray[np.int64],
    survival: LifetimeSettings,
) -> None:
    """Enter the probability of each end, and of snapping on after some cycles."""
    total = good.sum(axis=-1)
    ended = good & ~lasting
    hits = np.stack([(ended & (well == side)).sum(axis=-1) for side in (-1, 1)], axis=-1)
    result[WELL] = ((WELL,), list(WELLS), {"long_name": "well that a run ends about"})
    _enter(result, "end_probability", (*dims, WELL), hits, total, "probability of ending in a well", survival)
    on = np.stack([(good & (time > cycle)).sum(axis=-1) + (lasting & (time == cycle)).sum(axis=-1)
                   for cycle in kernel_input], axis=-1)  # fmt: skip
    result[AFTER] = ((AFTER,), kernel_input, {"units": "1", "long_name": "cycles"})
    words = "probability of snapping on after so many cycles"
    _enter(result, "snapping_probability", (*dims, AFTER), on, total, words, survival)


def _enter(
    result: xr.Dataset,
    name: str,
    dims: tuple[Any, ...],
    hits: NDArray[np.int64],
    total: NDArray[np.int64],
    words: str,
    survival: LifetimeSettings,
) -> None:
    parts = proportion(hits, np.broadcast_to(total[..., None], hits.shape), survival.confidence)
    for ending, values, text in zip(
        ("", "_low", "_high"), parts, ("", "lower limit: ", "upper limit: "), strict=True
    ):
        result[f"{name}{ending}"] = (dims, values, {"units": "1", "long_name": f"{text}{words}"})
