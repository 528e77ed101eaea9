"""Common parts of the recipes: the paper's model, its maps and its shapes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

import snapbeam as sb
from snapbeam.model.default_values import BEAM, CONTACT, DAMPING_RATIO, LOCATION

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.artist import Artist

    from snapbeam.paper.recipe import Results

_Array = NDArray[np.float64]

TOLERANCE = 1e-5
"""Tolerance of a plotted run, in b: far below the width of a line."""
KEPT = ("response_class", "status", "zero_crossings", "final_well_proven", "early_stop_time")
"""Variables that are stored from a map of classes."""


def paper_model(modes: int, damping_ratio: ArrayLike = DAMPING_RATIO) -> sb.ReducedModel:
    """The paper's beam on its first *modes* buckling modes."""
    return sb.ReducedModel.from_beam(BEAM, modes=modes, damping_ratio=damping_ratio)


def struck_beam(
    frequency_ratio: float = 1.2,
    velocity_amplitude: float = 0.18,
    *,
    modes: int = 1,
    damping_ratio: float = DAMPING_RATIO,
    location: float = LOCATION,
) -> sb.System:
    """Return the paper's beam on its first *modes* buckling modes, struck by the paper's shaker.

    Examples
    --------
    >>> from snapbeam import paper
    >>> system = paper.struck_beam(frequency_ratio=1.4, velocity_amplitude=0.1, modes=8)
    >>> system.model.modes
    8
    """
    shaker = sb.Shaker(frequency_ratio=frequency_ratio, velocity_amplitude=velocity_amplitude, location=location)
    return sb.System(paper_model(modes, damping_ratio), contacts=[sb.Contact(CONTACT, shaker.striker())])


def paper_run(modes: int, frequency_ratio: float, velocity_amplitude: float, cycles: int, **more: Any) -> sb.Run:
    """Simulate the paper's beam and shaker.

    *more* may hold the location, the reference frequency, the sample times, and options of an
    :class:`~snapbeam.Integration`.
    """
    location, sample_times = more.pop("location", LOCATION), more.pop("sample_times", None)
    model = replace(paper_model(modes), given_reference_frequency=more.pop("reference_frequency", None))
    shaker = sb.Shaker(frequency_ratio=frequency_ratio, velocity_amplitude=velocity_amplitude, location=location)
    integration = sb.Integration(cycles=cycles, **more)
    system = sb.System(model, contacts=[sb.Contact(CONTACT, shaker.striker())])
    return sb.simulate(system, integration, sample_times=sample_times)


def paper_map(
    model: sb.ReducedModel,
    *,
    frequency_ratio: ArrayLike,
    velocity_amplitude: ArrayLike,
    location: ArrayLike = LOCATION,
    contact: sb.ContactLaw = CONTACT,
    reference_frequency: float | None = None,
    progress: Callable[[int, int], object] | None = None,
    **options: Any,
) -> xr.Dataset:
    """Sweep the paper's shaker on *model* over those of its parameters that are arrays.

    A number applies to the whole map.  *options* are those of an :class:`~snapbeam.Integration`.
    """
    if reference_frequency is not None:
        model = replace(model, given_reference_frequency=reference_frequency)
    given = {"drive.frequency_ratio": frequency_ratio, "drive.velocity_amplitude": velocity_amplitude}
    given["contact.location"] = location
    axes = {name: value for name, value in given.items() if np.ndim(value)}
    ratio, amplitude, place = (float(np.ravel(value)[0]) for value in given.values())
    shaker = sb.Shaker(frequency_ratio=ratio, velocity_amplitude=amplitude, location=place)
    system = sb.System(model, contacts=[sb.Contact(contact, shaker.striker())])
    return sb.sweep(system, axes, sb.Integration(**options), progress=progress)


def class_map(results: Results, what: str, model: sb.ReducedModel, **options: Any) -> xr.Dataset:
    """Compute the response classes of a :func:`paper_map`, and end each run once its class is certain."""
    ds = paper_map(model, progress=results.progress(what), **{"early_termination": True, **options})
    return ds[list(KEPT)]


def relative_map(
    results: Results, what: str, modes: int, frequency_ratio: float, locations: _Array, relative: _Array, cycles: int
) -> xr.Dataset:
    """Classes over location and V/V_QS1(x_s), with V as a coordinate of two dimensions.

    The relative amplitude follows the limit of the map, V < 2 V_QS1(x_s), which a rectangle in V would leave
    half empty.
    """
    from snapbeam.util.datasets import xr

    model = paper_model(modes)
    columns, made = [], []
    for at, x in enumerate(locations):
        static = float(sb.model.quasi_static_threshold(x, frequency_ratio))
        place: dict[str, Any] = {
            "frequency_ratio": frequency_ratio,
            "velocity_amplitude": relative * static,
            "location": float(x),
        }
        ds = paper_map(model, **place, cycles=cycles, early_termination=True)
        amplitude = ds["velocity_amplitude"].values
        made.append(ds.attrs["created"])
        ds = ds[list(KEPT)].rename(velocity_amplitude="relative_amplitude")
        ds = ds.assign_coords(
            relative_amplitude=("relative_amplitude", relative, {"units": "1", "long_name": "V/V_QS1"}),
            velocity_amplitude=("relative_amplitude", amplitude, {"units": "1", "long_name": "velocity amplitude V"}),
        )
        columns.append(ds)
        results.progress(what)(at + 1, len(locations))
    joined = xr.concat(
        columns, dim="location", coords=["velocity_amplitude"], compat="equals", combine_attrs="drop_conflicts"
    )
    joined.attrs.pop("location", None)
    # a column is a map of its own, with its own time and parameters
    joined.attrs["created"] = made[-1]
    return joined


def legend_handles(kinds: ArrayLike) -> list[Artist]:
    """Legend entries of the response classes, the unknown one only if *kinds* holds it."""
    from matplotlib.patches import Patch

    from snapbeam.plot.map import class_handles
    from snapbeam.plot.style import CLASS_COLORS

    handles: list[Artist] = list(class_handles())
    unknown = sb.ResponseClass.UNKNOWN
    if (np.asarray(kinds) == unknown).any():
        handles.append(Patch(facecolor=CLASS_COLORS[unknown], edgecolor="black", label=unknown.label))
    return handles


def shapes_along(model: sb.ReducedModel, points: int = 201) -> tuple[_Array, _Array]:
    """Positions x/L from end to end, and the shapes there, (points, N); both ends are clamped."""
    x = np.linspace(0.0, 1.0, points)
    inside = np.array([model.shape_at(float(at)) for at in x[1:-1]])
    return x, np.pad(inside, ((1, 1), (0, 0)))
