"""Maps as version 0.1 asked for them: frequency ratio, velocity amplitude and location by themselves."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from snapbeam.model.contact.base import ContactLaw
from snapbeam.model.integration import Integration
from snapbeam.model.reduced_model import ReducedModel
from snapbeam.model.striker import Shaker
from snapbeam.model.system import System
from snapbeam.sweeps.checkpointed_sweep import CheckpointOptions, Note, SweepReport, compute_sweep
from snapbeam.sweeps.points import Grid, PointList, points_of
from snapbeam.sweeps.replicates import MEASURING_ERROR, Replicates
from snapbeam.sweeps.setup import SweepSetup, sweep_setup
from snapbeam.sweeps.threshold import threshold
from snapbeam.util.diagnostics import counting
from snapbeam.util.validation import (
    InputError,
    InputTypeError,
    finite_array,
    flag,
    integer,
    positive,
    shown,
    within,
)

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["long_map", "map_setup", "response_map", "threshold_curve"]


_AXES = {
    "frequency_ratio": ("drive.frequency_ratio", 0.0, np.inf, "neither"),
    "velocity_amplitude": ("drive.velocity_amplitude", 0.0, np.inf, "left"),
    "location": ("striker.location", 0.0, 1.0, "neither"),
}


def map_setup(
    model: ReducedModel,
    contact: ContactLaw,
    *,
    frequency_ratio: ArrayLike,
    velocity_amplitude: ArrayLike,
    location: ArrayLike = 1.0 / 2.1,
    cycles: int = 200,
    side: str = "below",
    reference_frequency: float | None = None,
    **options: Any,
) -> SweepSetup:
    """A map of version 0.1 as a sweep; *options* are those of an :class:`~snapbeam.Integration`."""
    given = {
        "frequency_ratio": frequency_ratio,
        "velocity_amplitude": velocity_amplitude,
        "location": location,
    }
    axes, scalars = {}, {}
    for name, value in given.items():
        full, low, high, closed = _AXES[name]
        if _is_number(value):
            scalars[name] = within(name, value, low, high, closed=closed)
        else:
            axes[full] = value
    if reference_frequency is not None and isinstance(model, ReducedModel):
        model = replace(
            model, given_reference_frequency=positive("reference_frequency", reference_frequency, "Hz")
        )
    if contact is None:
        raise InputError("contact = None: must be a law of contact, such as HertzContact(stiffness)")
    shaker = Shaker(
        frequency_ratio=scalars.get("frequency_ratio", 1.0),
        velocity_amplitude=scalars.get("velocity_amplitude", 0.0),
        location=scalars.get("location", 0.5),
        side=side,
    )
    points = points_of(axes) if axes else PointList({"striker.location": np.array([shaker.location])})
    system = System(model, contact, shaker)  # type: ignore[arg-type]
    return sweep_setup(system, points, Integration(cycles=integer("cycles", cycles, 1, 10**7), **options))


def _is_number(value: Any) -> bool:
    """Whether it stands for the whole map; lists of unequal lengths do not."""
    try:
        return np.ndim(value) == 0
    except (TypeError, ValueError):
        return False


def response_map(
    model: ReducedModel,
    contact: ContactLaw,
    *,
    frequency_ratio: ArrayLike,
    velocity_amplitude: ArrayLike,
    location: ArrayLike = 1.0 / 2.1,
    cycles: int = 200,
    side: str = "below",
    reference_frequency: float | None = None,
    step: float | None = None,
    accuracy: str = "standard",
    engine: str = "auto",
    early_termination: bool = False,
    threads: int | None = None,
    progress: Callable[[int, int], object] | bool | None = None,
) -> xr.Dataset:
    """Class and statistics of the response over any of frequency ratio, velocity amplitude and location.

    This is :func:`snapbeam.sweep` as version 0.1 had it; a sweep takes any parameter.

    Parameters
    ----------
    model : ReducedModel
    contact : ContactLaw
    frequency_ratio, velocity_amplitude, location : float or array_like
        Omega > 0, V >= 0 and x_s in (0, 1).  A number holds for the whole map; a strictly increasing
        array becomes a dimension.
    cycles : int
        Cycles of excitation of each run.
    side : {"below", "above"}
        Side of the beam the shaker pushes from.
    reference_frequency : float, optional
        Frequency in Hz that stands for omega_1; the model's first natural frequency if not given.
    step, accuracy, engine, early_termination, threads
        As in an :class:`~snapbeam.Integration`.
    progress : callable, optional
        Called as ``progress(done, total)`` while the map grows.

    Returns
    -------
    xarray.Dataset
        Dimensions (frequency_ratio, velocity_amplitude, location), those given as arrays; the variables of
        :data:`snapbeam.STATISTICS`; every parameter in the attributes.

    Raises
    ------
    InputError
        For bad input.  Runs that fail numerically are UNKNOWN points with a ``status``.
    """
    setup = map_setup(
        model, contact, frequency_ratio=frequency_ratio, velocity_amplitude=velocity_amplitude, location=location,
        cycles=cycles, side=side, reference_frequency=reference_frequency, step=step, accuracy=accuracy, engine=engine,
        early_termination=early_termination, threads=threads,
    )  # fmt: skip
    return _plain(setup, compute_sweep(setup, CheckpointOptions(), progress=counting(progress, "map")))


def _plain(setup: SweepSetup, dataset: xr.Dataset) -> xr.Dataset:
    """A map of a single point has no dimension."""
    return dataset if isinstance(setup.points, Grid) else dataset.isel(point=0)


def long_map(
    model: ReducedModel,
    contact: ContactLaw,
    *,
    store: str | os.PathLike[str] | None = None,
    verify: bool = False,
    cluster: str | None = None,
    refine_levels: int = 0,
    replicas: int = 0,
    perturbation_rms: float = MEASURING_ERROR,
    replicate_seed: int = 0,
    check_half_step: bool = False,
    chunk: int | None = None,
    output: str | os.PathLike[str] | None = None,
    progress: Callable[[int, int], object] | bool | None = None,
    note: Note | None = None,
    tally: SweepReport | None = None,
    config: dict[str, Any] | None = None,
    **options: Any,
) -> xr.Dataset:
    """A response map that survives interruption, refines itself and can leave this machine.

    This is :func:`snapbeam.sweep` as version 0.1 had it.  *options* are those of :func:`snapbeam.response_map`, and
    so are the numbers.

    Parameters
    ----------
    store, cluster, refine_levels, output, progress
        As in :func:`snapbeam.sweep`.
    verify, chunk, note, tally, config
        As in :class:`snapbeam.CheckpointOptions`.
    replicas, perturbation_rms, replicate_seed, check_half_step
        As in :class:`snapbeam.Replicates`.

    Returns
    -------
    xarray.Dataset

    Raises
    ------
    InputError
        For bad input, and for a store that holds another map.
    CheckpointError
        If the store is in use, cannot be written or is damaged beyond repair.
    """
    setup = map_setup(model, contact, **options)
    repeats = None
    if flag("check_half_step", check_half_step) or integer("replicas", replicas, 0, 10_000):
        repeats = Replicates(replicas, perturbation_rms, bool(check_half_step), replicate_seed)
    dataset = compute_sweep(
        setup,
        CheckpointOptions(store, verify, chunk, config, note, tally),
        cluster=cluster,
        refine_levels=refine_levels,
        replicas=repeats,
        output=output,
        progress=counting(progress, "map"),
    )
    return _plain(setup, dataset)


def threshold_curve(
    model: ReducedModel | Sequence[ReducedModel],
    contact: ContactLaw,
    *,
    frequency_ratio: ArrayLike,
    velocity_amplitude: ArrayLike,
    location: ArrayLike = 1.0 / 2.1,
    progress: Callable[[int, int], object] | bool | None = None,
    **options: Any,
) -> xr.Dataset:
    """The threshold of interwell response along frequency ratio or location, as a band.

    This is :func:`snapbeam.threshold` as version 0.1 had it, along the velocity amplitude.

    Parameters
    ----------
    model : ReducedModel or sequence of them
        One curve for each; several must differ in their number of modes.
    contact : ContactLaw
    frequency_ratio, location : float or array_like
        One of the two is an array, along which the threshold is found.
    velocity_amplitude : array_like
        The amplitudes to choose from, strictly increasing: the range and the resolution.
    progress
        As in :func:`snapbeam.threshold`.
    **options
        ``cycles``, ``side``, ``reference_frequency``, ``step``, ``accuracy``, ``engine``, ``threads`` as in
        :func:`snapbeam.response_map`.

    Returns
    -------
    xarray.Dataset
        As of :func:`snapbeam.threshold`, along the axis that is an array, and ``modes``, if several models were given.

    Raises
    ------
    InputError
        For bad input, such as neither or both of frequency ratio and location as arrays.
    """
    import xarray as xr

    if finite_array("velocity_amplitude", velocity_amplitude).size < 2:
        raise InputError("velocity_amplitude: must be an array of at least two amplitudes to choose from")
    over = {
        name: finite_array(name, value)
        for name, value in (("frequency_ratio", frequency_ratio), ("location", location))
        if finite_array(name, value).ndim > 0
    }
    if len(over) != 1:
        raise InputError(
            "frequency_ratio, location: one of them must be an array, the other a number, "
            f"not {len(over)} arrays"
        )
    told = counting(progress, "threshold", "runs")
    models = [model] if isinstance(model, ReducedModel) else _several(model)
    curves = []
    for at, each in enumerate(models):
        setup = map_setup(
            each, contact, frequency_ratio=frequency_ratio, velocity_amplitude=velocity_amplitude, location=location,
            **options,
        )  # fmt: skip

        def report(done: int, total: int, number: int = at) -> None:
            if told is not None:
                told(number * total + done, len(models) * total)

        curves.append(
            threshold(
                setup.system,
                "velocity_amplitude",
                velocity_amplitude,
                over,
                setup.integration,
                progress=report,
            )
        )
    if isinstance(model, ReducedModel):
        return curves[0]
    words = {"units": "Hz", "long_name": "frequency that Omega and V are normalised by"}
    for curve in curves:
        curve["reference_frequency"] = ((), curve.attrs["reference_frequency"], words)
        curve["step"] = ((), curve.attrs["step"], {"units": "s", "long_name": "step in free flight"})
    labels = {"units": "1", "long_name": "number of modes N"}
    coordinate = xr.DataArray([each.modes for each in models], dims="modes", attrs=labels)
    result = xr.concat(curves, coordinate.rename("modes"), combine_attrs="drop_conflicts")
    result.attrs["runs"] = sum(curve.attrs["runs"] for curve in curves)
    return result


def _several(models: Any) -> list[ReducedModel]:
    listed = list(models) if isinstance(models, Sequence) else []
    if not listed or not all(isinstance(each, ReducedModel) for each in listed):
        raise InputTypeError(f"model = {shown(models)}: must be a ReducedModel or a list of them")
    modes = [each.modes for each in listed]
    if len(set(modes)) < len(modes):
        raise InputError(f"model: the numbers of modes {modes} must differ from each other")
    return listed
