"""The figure of any result: the dataset decides which function draws it."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from snapbeam.model.parameters import lookup
from snapbeam.plot import dynamics, force_displacement, run, uncertainty
from snapbeam.plot.map import plot_response_map, plot_statistic
from snapbeam.plot.threshold import plot_threshold
from snapbeam.solver.statistics import name_in
from snapbeam.util.validation import InputError, checked, instance, shown

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

_Draws = Callable[..., "Axes"]
_RUN: dict[str, tuple[_Draws, str]] = {
    "run": (run.plot_run, "displacement_at_striker"),
    "modal_amplitudes": (run.plot_modal_amplitudes, "modal_amplitude"),
    "energies": (run.plot_energies, "energy_beam"),
    "spectrum": (run.plot_spectrum, "displacement_at_striker"),
    "spectrogram": (run.plot_spectrogram, "displacement_at_striker"),
    "phase_portrait": (run.plot_phase_portrait, "midspan_velocity"),
}
"""The function that draws each figure of a run, and a variable that it needs."""


class _Kind(NamedTuple):
    """A kind of result: variables and dimensions that all its datasets have, and the functions that draw them."""

    words: str
    variables: set[str]
    dimensions: set[str]
    figures: Callable[[xr.Dataset], dict[str, _Draws]]
    start: _Starts | None = None
    """Start of the run of a place in the first figure, for results that have the state of one."""


class Start(NamedTuple):
    """Start of a run: parameters by dotted name, amplitudes and velocities by name, and its cycles.

    Without a state it begins as the system does; 0 cycles are those of the result.  *place* is the drawn point that it
    starts from.
    """

    parameters: dict[str, float]
    state: dict[str, float]
    cycles: int
    place: tuple[float, float] | None = None


_Starts = Callable[["xr.Dataset", "tuple[float, float] | None"], "Start | None"]


def _of_state(dataset: xr.Dataset, state: xr.DataArray, parameters: dict[str, float]) -> Start:
    names = [str(name) for name in dataset["coordinate"].values]
    return Start(parameters, dict(zip(names, state.values.tolist(), strict=True)), int(dataset.attrs["period"]))


def _branch_start(dataset: xr.Dataset, place: tuple[float, float] | None) -> Start | None:
    """Start of the orbit nearest to a place over the parameter and mid-span displacement, or of the middle one."""
    name = str(dataset.attrs["parameter"])
    nearest = dataset.isel(orbit=_nearest(dataset[name], dataset["midspan_displacement"], place))
    at = float(nearest[name]), float(nearest["midspan_displacement"])
    return _of_state(nearest, nearest["state"], {lookup(name).name: at[0]})._replace(place=at)


def _nearest(x: Any, y: Any, place: tuple[float, float] | None) -> int:
    """Number of the point that is nearest to a place, in parts of the widths of a figure of all; the middle one of none."""
    if place is None:
        return int(np.size(x) // 2)
    away = np.zeros(np.size(x))
    for values, at in zip((np.ravel(x), np.ravel(y)), place, strict=True):
        away += ((values - at) / (np.ptp(values[np.isfinite(values)]) or 1.0)) ** 2
    return int(np.nanargmin(away))


def _diagram_start(dataset: xr.Dataset, place: tuple[float, float] | None) -> Start | None:
    """Start at the stored point nearest to a place, with all of its motion in the first mode."""
    if not {"midspan_displacement", "midspan_velocity"} <= set(map(str, dataset.data_vars)):
        return None
    w, v = dataset["midspan_displacement"], dataset["midspan_velocity"]
    name = next(str(each) for each in w.dims if each not in ("sweep", "period"))
    x = dataset[name].broadcast_like(w).transpose(*w.dims).values
    at = _nearest(x, w, place)
    here = float(x.flat[at]), float(w.values.flat[at])
    state = {"amplitude[1]": here[1], "velocity[1]": float(v.transpose(*w.dims).values.flat[at])}
    return Start({lookup(name).name: here[0]}, state, 30, here)


def _axes_start(dataset: xr.Dataset, place: tuple[float, float] | None) -> Start | None:
    """Start with the parameters of a place, the raised one up the figure if there is another one."""
    raised = dataset.attrs.get("parameter")
    names = [str(name) for name in dataset.dims if name in dataset.coords and "parameter" in dataset[name].attrs]
    names.sort(key=lambda name: name == raised)
    if "threshold" in dataset and raised not in names:
        names.append(str(raised))
    if not names or len(names) > 2:
        return None
    if place is None:
        middles = [float(np.ravel(dataset[n])[dataset[n].size // 2]) for n in names if n in dataset.coords]
        place = middles[0], middles[-1]
    given = {lookup(name).name: float(at) for name, at in zip(names, place, strict=False)}
    return Start(given, {}, 0, place)


def _backbone_start(dataset: xr.Dataset, place: tuple[float, float] | None) -> Start | None:
    """Start of the free motion nearest to a place, at rest where it turns back."""
    if "initial_shift" in dataset or "amplitude_scale" not in dataset.attrs:
        return None
    x, y = dataset["frequency_ratio"].values, 0.5 * (dataset["max_midspan"] - dataset["min_midspan"]).values
    at = _nearest(x, y, place)
    alpha = dataset["initial_amplitude"].values[at] / float(dataset.attrs["amplitude_scale"])
    state = {f"amplitude[{number}]": float(each) for number, each in enumerate(alpha, 1)}
    return Start({"model.damping_ratio": 0.0}, state, 10, (float(x[at]), float(y[at])))


def _basin_start(dataset: xr.Dataset, place: tuple[float, float] | None) -> Start | None:
    names = [str(name) for name in dataset["basin"].dims]
    if place is None or len(names) != 2:
        return None
    return Start({}, dict(zip(names, map(float, place), strict=True)), 30, place)


def _branch(dataset: xr.Dataset, ax: Axes | None = None, **options: Any) -> Axes:
    return dynamics.plot_diagram(None, ax, branches=[dataset], **options)


def _run(dataset: xr.Dataset) -> dict[str, _Draws]:
    return {name: function for name, (function, needed) in _RUN.items() if needed in dataset}


def _map(dataset: xr.Dataset) -> dict[str, _Draws]:
    over = set(dataset["response_class"].dims)
    others = [
        str(name)
        for name, item in dataset.data_vars.items()
        if item.dtype.kind in "biuf" and set(item.dims) == over and name != "response_class"
    ]
    others.sort(key="status".__eq__)  # what the runs did comes first, how they ended last
    return {"response_class": plot_response_map} | {name: partial(plot_statistic, name=name) for name in others}


def _means(dataset: xr.Dataset) -> dict[str, _Draws]:
    """Statistics with an interval, over the axes of the runs."""
    names = [
        str(n) for n, item in dataset.data_vars.items() if f"{n}_low" in dataset and item.dims == dataset["runs"].dims
    ]
    return {name: partial(plot_statistic, name=name) for name in sorted(names, key="snap".__ne__)}


def _swept(dataset: xr.Dataset) -> dict[str, _Draws]:
    figures = {name: function for name, function in _map(dataset).items() if name != "response_class"}
    return dict(sorted(figures.items(), key=lambda each: each[0] != "peak_midspan_displacement"))


def _lifetimes(dataset: xr.Dataset) -> dict[str, _Draws]:
    figures: dict[str, _Draws] = {"lifetime": dynamics.plot_lifetimes} if dataset["lifetime"].ndim else {}
    return figures | ({"survival": dynamics.plot_survival} if dataset["lifetime"].size <= dynamics.MAX_CURVES else {})


def _section(dataset: xr.Dataset) -> dict[str, _Draws]:
    return {name: partial(dynamics.plot_section, x=name) for name in dynamics.section_abscissae(dataset)}


def _designs(dataset: xr.Dataset) -> dict[str, _Draws]:
    tried = [str(name).removeprefix("tried_") for name in dataset.data_vars if str(name).startswith("tried_")]
    over = [name for name in tried if not name.startswith("objective_")]
    return {"objectives": uncertainty.plot_designs} | {
        name: partial(uncertainty.plot_designs, over=name) for name in over
    }


def _diagram(dataset: xr.Dataset) -> dict[str, _Draws]:
    names = [str(name) for name, item in dataset.data_vars.items() if {"sweep", "period"} <= set(item.dims)]
    names.sort(key=lambda each: each != "midspan_displacement")
    return {name: partial(dynamics.plot_diagram, variable=name) for name in names}


def _gradient(dataset: xr.Dataset) -> dict[str, _Draws]:
    figures: dict[str, _Draws] = {"elasticity": uncertainty.plot_gradient}
    if "statistic" in dataset.dims:
        names = uncertainty.smooth_statistics(dataset)
        figures |= {name: partial(uncertainty.plot_gradient, statistic=name) for name in names}
    return figures


_KINDS = (
    _Kind("run", {"displacement_at_striker"}, {"time"}, _run),
    _Kind("threshold", {"lower_threshold"}, set(), lambda _: {"threshold": plot_threshold}, _axes_start),
    _Kind("quantiles of a threshold", {"threshold"}, {"quantile"}, lambda _: {"threshold": uncertainty.plot_quantiles}, _axes_start),
    _Kind(
        "probability map", {"probability"}, {"outcome"},
        lambda ds: {str(name): partial(uncertainty.plot_probability, outcome=str(name)) for name in ds["outcome"].values} | _means(ds),
    ),
    _Kind("means over seeds", {"snap", "snap_low"}, set(), lambda ds: _means(ds)),
    _Kind("sensitivities", {"effect"}, {"parameter"}, lambda _: {"effect": uncertainty.plot_tornado}),
    _Kind("sensitivity indices", {"first_order"}, {"parameter"}, lambda _: {"first_order": uncertainty.plot_tornado}),
    _Kind("gradient", {"elasticity"}, {"parameter"}, _gradient),
    _Kind("posterior", {"weight"}, {"sample"}, lambda _: {"weight": uncertainty.plot_posterior}),
    _Kind("measured classes", {"most_likely"}, {"measurement"}, lambda _: {"probability": uncertainty.plot_scores}),
    _Kind("growth of a perturbation", {"separation"}, {"time"}, lambda _: {"separation": run.plot_perturbation}),
    _Kind("estimated density", {"psd_low", "psd"}, {"frequency"}, lambda _: {"psd": run.plot_spectrum}),
    _Kind("displacement field", {"displacement", "displacement_se"}, {"time", "position"}, lambda _: {"displacement": run.plot_field}),
    _Kind(
        "frequency response", {"magnitude", "coherence"}, {"frequency"}, lambda _: {"magnitude": run.plot_frequency_response}
    ),
    _Kind("homoclinic points", {"stable_arclength"}, {"point"}, lambda _: {"state": dynamics.plot_homoclinic}),
    _Kind("designs", {"constraints_satisfied"}, {"tried"}, _designs),
    _Kind("lifetimes", {"lifetime", "last_snap"}, set(), _lifetimes),
    _Kind("edge state", {"orbit_state", "distance"}, set(), lambda _: {"state": dynamics.plot_edge}),
    _Kind(
        "branch of orbits", {"multiplier_real", "stable"}, {"orbit"},
        lambda _: {"midspan_displacement": _branch, "multipliers": dynamics.plot_multipliers}, _branch_start,
    ),
    _Kind(
        "bifurcation curve", {"special_point_kind", "multiplier_real"}, {"point"},
        lambda ds: {str(list(ds.attrs["parameters"])[1]): dynamics.plot_bifurcation_curve},
    ),
    _Kind(
        "periodic orbit", {"multiplier_real", "state"}, set(), lambda _: {"multipliers": dynamics.plot_multipliers},
        lambda ds, _: _of_state(ds, ds["state"][0], {}),
    ),
    _Kind(
        "backbone curve", {"participation", "initial_amplitude"}, {"point"}, lambda _: {"frequency_ratio": dynamics.plot_backbone},
        _backbone_start,
    ),
    _Kind("homoclinic tangency", {"crosses", "bracket"}, {"value"}, lambda _: {"crosses": dynamics.plot_tangency}),
    _Kind("manifold", {"saddle", "age"}, {"point"}, lambda _: {"state": dynamics.plot_manifold}),
    _Kind("attractors", {"points", "share"}, {"attractor"}, lambda _: {"points": dynamics.plot_attractors}),
    _Kind("Lyapunov exponents", {"exponent"}, set(), lambda _: {"exponent": dynamics.plot_exponents}, _axes_start),
    _Kind("basins of attraction", {"basin"}, set(), lambda _: {"basin": dynamics.plot_basins}, _basin_start),
    _Kind("bifurcation diagram", set(), {"sweep", "period"}, _diagram, _diagram_start),
    _Kind("section", {"drive_phase"}, {"point"}, _section),
    _Kind("statistics swept up and down", {"response_class"}, {"sweep"}, _swept, _axes_start),
    _Kind(
        "force-displacement curve", {"snap_through_force"}, {"branch_number"},
        lambda _: {"force": force_displacement.plot_force_displacement},
    ),
    _Kind(
        "equilibrium branches", {"critical_value", "natural_frequency"}, {"critical_point"},
        lambda _: {
            name: partial(force_displacement.plot_equilibrium_branches, variable=name)
            for name in force_displacement.BRANCH_FIGURES
        },
    ),
    _Kind("map", {"response_class"}, set(), _map),
)  # fmt: skip


def _kind_of(dataset: xr.Dataset) -> _Kind:
    for kind in _KINDS:
        if kind.variables <= set(map(str, dataset.variables)) and kind.dimensions <= set(map(str, dataset.dims)):
            return kind
    known = ", ".join(map(str, dataset.data_vars)) or "none"
    raise InputError(
        f"dataset: must be a result of snapbeam that has a figure ({', '.join(k.words for k in _KINDS)}); "
        f"its variables are {known}"
    )


def figures_of(dataset: xr.Dataset) -> tuple[str, dict[str, _Draws]]:
    """Return the kind of a dataset, and a function that draws for each name that can be drawn, the default first."""
    kind = _kind_of(dataset)
    return kind.words, kind.figures(dataset)


def start_of(dataset: xr.Dataset) -> _Starts | None:
    """Return the function that gives the start of the run of a place in the first figure; None if there is none."""
    return _kind_of(dataset).start


@checked
def plot_dataset(dataset: xr.Dataset, variable: str | None = None, ax: Axes | None = None, **options: Any) -> Axes:
    """Draw a result of any kind; ``dataset.snapbeam.plot`` calls this function.

    Parameters
    ----------
    dataset : xarray.Dataset
        A run, map, threshold, or result of :mod:`snapbeam.dynamics` or :mod:`snapbeam.uncertainty`.
    variable : str, optional
        Which figure of this kind of result, such as a statistic of a map; by default the first one.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure by default.
    **options
        Options of the function that draws, such as ``quasi_static_line`` of :func:`plot_response_map`.

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> damped = paper.struck_beam(frequency_ratio=1.6, velocity_amplitude=0.03, damping_ratio=0.05)
    >>> run = sb.simulate(damped, sb.Integration(cycles=10))
    >>> ax = sb.plot.plot_dataset(run.dataset, "phase_portrait")
    >>> ax = run.dataset.snapbeam.plot()
    """
    from snapbeam.util.datasets import xr

    instance("dataset", dataset, xr.Dataset, "an xarray.Dataset")
    words, figures = figures_of(dataset)
    name = next(iter(figures), "") if variable is None else name_in(figures, variable)
    if name not in figures:
        raise InputError(
            f"variable = {shown(name)}: is no figure of this file ({words}); choose one of {', '.join(figures) or 'none'}"
        )
    return figures[name](dataset, ax=ax, **options)
