"""Maps: many runs over frequency ratio, velocity amplitude and location, as one labelled dataset."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.codes import ResponseClass
from snapbeam.kernels.engines import resolve
from snapbeam.kernels.ensemble import make_ensemble
from snapbeam.kernels.plan import Plan, plan_steps
from snapbeam.model.contact import HertzContact
from snapbeam.model.drive import Shaker
from snapbeam.model.reduction import ReducedModel
from snapbeam.provenance import made_by
from snapbeam.response import STATISTICS, statistics_of
from snapbeam.simulation import check_system, describe_system
from snapbeam.validate import InputError, axis, integer, positive

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["AXES", "response_map"]

AXES = {
    "frequency_ratio": ("1", "frequency ratio Omega"),
    "velocity_amplitude": ("1", "velocity amplitude V"),
    "location": ("1", "shaker location x_s"),
}
"""The dimensions of a map, in their order: unit and name in words."""

_LIMITS = {
    "frequency_ratio": (0.0, np.inf, "neither"),
    "velocity_amplitude": (0.0, np.inf, "left"),
    "location": (0.0, 1.0, "neither"),
}


def response_map(
    model: ReducedModel,
    contact: HertzContact,
    *,
    frequency_ratio: ArrayLike,
    velocity_amplitude: ArrayLike,
    location: ArrayLike = 1.0 / 2.1,
    cycles: int = 200,
    side: str = "below",
    reference_freq: float | None = None,
    step: float | None = None,
    accuracy: str = "map",
    engine: str = "auto",
    early_decision: bool = False,
    threads: int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> xr.Dataset:
    """Class and statistics of the response over any of frequency ratio, velocity amplitude and location.

    Parameters
    ----------
    model : ReducedModel
    contact : HertzContact
    frequency_ratio, velocity_amplitude, location : float or array_like
        Omega > 0, V >= 0 and x_s in (0, 1).  A number holds for the whole map; a strictly increasing
        array becomes a dimension.
    cycles : int
        Cycles of excitation of each run.
    side : {"below", "above"}
        Side of the beam the shaker pushes from.
    reference_freq : float, optional
        Frequency in Hz that stands for omega_1; the model's first natural frequency if not given.
    step : float, optional
        Step in free flight, s; the default follows from the model and the contact at the first location.
    accuracy : {"map", "reference"}
    engine : {"auto", "cpu"}
    early_decision : bool
        End a run once its class is certain: the classes are the same, the other statistics stop at
        ``decided_at``.
    threads : int, optional
        Threads of the CPU engine; all usable cores by default.  No number depends on it.
    progress : callable, optional
        Called as ``progress(done, total)`` while the map grows.

    Returns
    -------
    xarray.Dataset
        Dimensions (frequency_ratio, velocity_amplitude, location), those given as arrays; the variables of
        :data:`snapbeam.response.STATISTICS`; every parameter in the attributes.

    Raises
    ------
    InputError
        For bad input.  Runs that fail numerically are UNKNOWN points with a ``status``.
    """
    import xarray as xr

    check_system(model, contact)
    if contact is None:
        raise InputError("contact = None: must be a HertzContact")
    cycles = integer("cycles", cycles, 1, 10**7)
    if threads is not None:
        threads = integer("threads", threads, 1, 4096)
    engine_name, run = resolve(engine)
    given = {
        "frequency_ratio": frequency_ratio,
        "velocity_amplitude": velocity_amplitude,
        "location": location,
    }
    axes, scalars = _axes(given)
    points = grid_points(axes, scalars)
    Shaker(frequency_ratio=1.0, velocity_amplitude=0.0, side=side)  # refuses a side that is none
    reference = model.reference_freq if reference_freq is None else positive("reference_freq", reference_freq)
    plan = plan_steps(model, contact, float(points["location"][0]), step=step, accuracy=accuracy)
    ensemble = make_ensemble(
        model,
        contact,
        plan,
        **points,
        side=side,
        cycles=cycles,
        reference_freq=reference,
        early_decision=bool(early_decision),
    )
    counts, numbers = run(ensemble, threads, progress)
    attrs: dict[str, Any] = {"title": "map of the response of a struck bistable beam", "cycles": cycles}
    attrs |= {"engine": engine_name, "side": side, "early_decision": int(bool(early_decision))}
    attrs |= describe_system(model, contact, plan, reference) | scalars
    dataset = xr.Dataset(coords=_coordinates(axes, scalars), attrs=attrs | made_by(attrs))
    shape = tuple(values.size for values in axes.values())
    for name, values in statistics_of(ensemble, counts, numbers, cycles).items():
        dataset[name] = (tuple(axes), values.reshape(shape), variable_attributes(name))
    return dataset


def _axes(given: dict[str, ArrayLike]) -> tuple[dict[str, NDArray[np.float64]], dict[str, float]]:
    axes, scalars = {}, {}
    for name, value in given.items():
        low, high, closed = _LIMITS[name]
        if np.ndim(np.asarray(value)) == 0:
            scalars[name] = float(axis(name, [_scalar(name, value)], low, high, closed=closed)[0])
        else:
            axes[name] = axis(name, value, low, high, closed=closed)
    return axes, scalars


def _scalar(name: str, value: Any) -> Any:
    array = np.asarray(value)
    return array.item() if array.dtype.kind in "iuf" else value


def grid_points(
    axes: dict[str, NDArray[np.float64]], scalars: dict[str, float]
) -> dict[str, NDArray[np.float64]]:
    """Every point of a grid, flattened in the order of its dimensions, by the name of the coordinate."""
    mesh = np.meshgrid(*axes.values(), indexing="ij") if axes else []
    size = int(np.prod([values.size for values in axes.values()], dtype=np.int64))
    points = {name: values.ravel() for name, values in zip(axes, mesh, strict=True)}
    return {name: points.get(name, np.full(size, scalars.get(name, np.nan))) for name in AXES}


def _coordinates(axes: dict[str, NDArray[np.float64]], scalars: dict[str, float]) -> dict[str, Any]:
    coords: dict[str, Any] = {}
    for name, (units, words) in AXES.items():
        labels = {"units": units, "long_name": words}
        coords[name] = ((name,), axes[name], labels) if name in axes else ((), scalars[name], labels)
    return coords


def variable_attributes(name: str) -> dict[str, Any]:
    """Attributes of one variable of a map."""
    _, units, words = STATISTICS[name]
    labels: dict[str, Any] = {"units": units, "long_name": words}
    if name == "response":
        labels["flag_values"] = np.array([int(c) for c in ResponseClass], dtype=np.int8)
        labels["flag_meanings"] = " ".join(c.label.replace(" ", "_") for c in ResponseClass)
    return labels
