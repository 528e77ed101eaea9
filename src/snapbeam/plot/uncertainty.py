"""Figures of the uncertainty tools: optimised designs, probabilities, quantile thresholds, sensitivities."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import numpy as np
from cmcrameri import cm
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm
from matplotlib.lines import Line2D

from snapbeam.model.parameters import PHYSICAL, lookup
from snapbeam.model.quantity import split_name
from snapbeam.model.quasi_static import quasi_static_objection
from snapbeam.plot.axes import AXIS_LABELS, axis_label, dress, edges_of, is_geometric, positions, wrapped, written_unit
from snapbeam.plot.map import in_order, quasi_static_along
from snapbeam.plot.style import (
    CLASS_COLORS,
    SERIES_COLORS,
    color_bar,
    contains,
    extend_title,
    figure_legend,
    figure_style,
    fix_ticks,
    frame,
    legend_below,
    new_figure,
    plain_decades,
)
from snapbeam.plot.units import in_symbols, in_units, ratio_along, ratio_name, scale_text
from snapbeam.solver.statistics import STATISTICS
from snapbeam.util.proportions import weighted_quantiles
from snapbeam.util.si_prefixes import prefixed, scale_of
from snapbeam.util.status_codes import ResponseClass
from snapbeam.util.validation import InputError, checked, shown

if TYPE_CHECKING:
    import xarray as xr

    from snapbeam.sweeps.measured_points import MeasuredPoints

__all__ = [
    "plot_designs", "plot_gradient", "plot_posterior", "plot_probability", "plot_quantiles", "plot_scores",
    "plot_tornado",
]  # fmt: skip


_BLUE, _RED, _SKY = SERIES_COLORS[:3]
_TRIED = "#4C97C8"
_BARS: dict[str, Any] = {"ecolor": "black", "elinewidth": 0.8, "capsize": 2.0}
_STATES = (("violated", "X", "#B03A27"), ("undecided", "D", "#C3DD8A"), ("satisfied", "o", "#16245E"))
_OBJECTIVE = "tried_objective_"
_DECADE = 10.0
"""Ratio of the maximum to the minimum above which an axis is logarithmic."""


@checked
def plot_designs(dataset: xr.Dataset, over: str | None = None, ax: Axes | None = None) -> Axes:
    """Draw the result of :func:`snapbeam.uncertainty.optimize_design`: the first objective over the second, or a variable.

    Small dots are designs of the search that satisfy the constraints.  The reported designs have the intervals of the
    validation samples, and a marker for whether the constraints are satisfied there.

    Parameters
    ----------
    over : str, optional
        A variable, such as ``"location"``, or a distance to a constraint, such as ``"distance_snap"``; by default the second
        objective, or the first variable that is not the objective.
    """
    if "constraints_satisfied" not in dataset or "tried" not in dataset.dims:
        raise InputError(f"no designs among {list(map(str, dataset.variables))}")
    names = [str(name) for name in dataset.data_vars]
    objectives = [name[len(_OBJECTIVE) :] for name in names if name.startswith(_OBJECTIVE)]
    variables = [name[6:] for name in names if name.startswith("tried_") and "parameter" in dataset[name].attrs]
    # an objective that is the only variable is drawn over the distance to its constraint
    known = [*variables, *(name[6:] for name in names if name.startswith("tried_distance_"))]
    if over is not None and over not in known:
        raise InputError(f"over = {shown(over)}: must be one of {', '.join(known)}")
    free = next((name for name in known if name != objectives[0]), variables[0])
    across = over or (f"objective_{objectives[1]}" if len(objectives) > 1 else free)
    up = f"objective_{objectives[0]}"
    dataset = _with_prefix(_with_prefix(dataset, up), across)
    with frame(ax, dataset, height=84.0) as ax:
        x, y = dataset[f"tried_{across}"].values, dataset[f"tried_{up}"].values
        kept = (dataset["violation"].values == 0.0) & np.isfinite(y)
        ax.scatter(x[kept], y[kept], s=4, color=_TRIED, linewidths=0.0, label="candidates that satisfy the constraints")
        for code, (word, marker, color) in enumerate(_STATES):
            own = dataset["constraints_satisfied"].values == code
            if own.any():
                bars = [_errors(dataset, name, own) for name in (across, up)]
                ax.errorbar(
                    dataset[across].values[own], dataset[up].values[own], xerr=bars[0], yerr=bars[1], fmt=marker,
                    color=color, markersize=5, markeredgecolor="black", markeredgewidth=0.5, zorder=3,
                    label=f"reported design, constraints {word}", **_BARS,
                )  # fmt: skip
        ax.set(xlabel=_label(dataset, across), ylabel=_label(dataset, up))
        for values, scale, axis in ((x[kept], ax.set_xscale, ax.xaxis), (y[kept], ax.set_yscale, ax.yaxis)):
            if values.size and values.min() > 0.0 and values.max() > _DECADE * values.min():
                scale("log")
                plain_decades(axis, values.min(), values.max())
        legend_below(ax)
    return ax


def _with_prefix(dataset: xr.Dataset, name: str) -> xr.Dataset:
    """The dataset with an objective or a variable in its unit with a prefix of the SI, such as µW."""
    unit = str(dataset[name].attrs.get("units", "1"))
    if not unit.isalpha() or name in AXIS_LABELS or unit in ("g", "um"):
        return dataset
    factor, scaled = scale_of(dataset[f"tried_{name}"].values, unit)
    own = [f"{start}{name}{end}" for start, end in (("", ""), ("", "_low"), ("", "_high"), ("tried_", ""))]
    return dataset.assign({
        each: (dataset[each] / factor).assign_attrs(dataset[each].attrs | {"units": scaled})
        for each in own if each in dataset
    })  # fmt: skip


def _errors(dataset: xr.Dataset, name: str, own: np.ndarray) -> np.ndarray | None:
    if f"{name}_low" not in dataset:
        return None
    middle, low, high = (dataset[f"{name}{end}"].values[own] for end in ("", "_low", "_high"))
    found = np.stack([middle - low, high - middle])
    return np.where(np.isfinite(found), found, 0.0)


def _label(dataset: xr.Dataset, name: str) -> str:
    short = name.removeprefix("objective_")
    labels = dataset[name].attrs
    row = lookup(labels["parameter"]) if "parameter" in labels else None
    if f"fixed_{short}" in dataset.attrs or (row is not None and labels.get("units") == row.quantity.unit):
        return axis_label(dataset, short)
    unit, words = written_unit(str(labels.get("units", "1"))), in_symbols(str(labels.get("long_name", name)))
    words = re.sub("(?<=[a-z])_(?=[a-z])", " ", words)  # names of statistics in it
    words = scale_text(dataset.attrs, words) if "over $b" in words else words
    return wrapped(f"{words[:1].upper()}{words[1:]}{'' if unit == '1' else f' ({unit})'}", 44)


# ----------------------------------------------------------------------------------------------------
# Probabilities over one parameter, with their interval, or over two, with contours of equal probability.


_LEVELS = (0.05, 0.5, 0.95)
_WORDS = {
    "snap": "Probability of snap-through",
    "continuous": "Probability of continuous snap-through",
    "first_well": "Probability of ending in the first well",
    "other_well": "Probability of ending in the other well",
}


def _words_of(outcome: str) -> str:
    if outcome in _WORDS:
        return _WORDS[outcome]
    from snapbeam.uncertainty.monte_carlo import outcome_named

    return wrapped(f"Probability that {in_symbols(outcome_named(outcome)[1].long_name)}", 40)


_DASHES: dict[float, Any] = {0.05: ":", 0.5: "-", 0.95: "--"}


@checked
def plot_probability(
    dataset: xr.Dataset,
    outcome: str = "snap",
    ax: Axes | None = None,
    *,
    measurements: MeasuredPoints | None = None,
    levels: tuple[float, ...] = _LEVELS,
) -> Axes:
    """Draw a probability map of one outcome.

    Over two parameters colours say the probability, in tenths, and lines where it passes *levels*; points whose
    interval is wider than requested have a small cross.  Over one parameter the line has its interval as a
    band.

    Parameters
    ----------
    dataset : xarray.Dataset
        Of :func:`snapbeam.uncertainty.probability_map` over one or two parameters.
    measurements : MeasuredPoints, optional
        Measured responses to lay over it, in the colours of their classes.
    levels : tuple of float
        Probabilities, increasing, each in (0, 1).
    """
    contains(dataset, "probabilities", "probability", "outcome")
    dataset = in_units(dataset)
    known = [str(name) for name in dataset["outcome"].values]
    if outcome not in known:
        raise InputError(f"outcome = {shown(outcome)}: must be one of {', '.join(known)}")
    data = dataset.sel(outcome=outcome)
    dims = [str(name) for name in data["probability"].dims if data.sizes[name] > 1]
    data = data.squeeze()
    if not 1 <= len(dims) <= 2 or "point" in dims:
        raise InputError(f"probability over {dims}: is drawn over one or two parameters")
    with frame(ax, dataset, height=80.0) as ax:
        if len(dims) == 1:
            _line(data, ax, dims[0], outcome)
        else:
            dims = list(in_order(data, dims))
            _cells(data, ax, dims, outcome, levels)
        if measurements is not None and len(dims) == 2:
            for kind in ResponseClass:
                own = measurements.response_class == kind
                if own.any():
                    x, y = (
                        unit * getattr(measurements, ratio)[own]
                        for ratio, unit in (ratio_along(data, name) for name in dims)
                    )
                    ax.scatter(
                        x, y, s=12, color=CLASS_COLORS[kind],
                        edgecolors="black", linewidths=0.5, zorder=3, label=kind.label,
                    )  # fmt: skip
    return ax


def _line(data: xr.Dataset, ax: Axes, name: str, outcome: str) -> None:
    x, _ = positions(data, name)
    low, high = data["probability_low"].values, data["probability_high"].values
    share = 100.0 * float(data.attrs.get("confidence", 0.95))
    ax.fill_between(x, low, high, color=_BLUE, alpha=0.25, linewidth=0.0, label=f"{share:g} % interval")
    ax.plot(x, data["probability"].values, "o-", color=_BLUE, markersize=2.2, label="fraction of the runs")
    ax.set(ylim=(-0.02, 1.02), ylabel=_words_of(outcome))
    legend_below(ax)
    dress(ax.xaxis, data, name)


def _cells(data: xr.Dataset, ax: Axes, dims: list[str], outcome: str, levels: tuple[float, ...]) -> None:
    values = data["probability"].transpose(dims[1], dims[0]).values
    edges = [edges_of(data, name) for name in dims]
    colors = cm.davos_r.resampled(10)
    cells = ax.pcolormesh(
        *edges, values, cmap=colors, norm=BoundaryNorm(np.linspace(0.0, 1.0, 11), 10), rasterized=True
    )
    color_bar(cells, ax, _words_of(outcome), ticks=np.linspace(0.0, 1.0, 6))
    x, y = (positions(data, name)[0] for name in dims)
    drawn = [level for level in levels if np.nanmin(values) < level < np.nanmax(values)]
    handles: list[Any] = []
    if min(values.shape) > 1:
        for level in drawn:
            style = _DASHES.get(level, "-")
            # twice, so that it is seen on light and on dark
            ax.contour(x, y, values, levels=[level], colors="white", linewidths=2.0, linestyles="-")
            ax.contour(x, y, values, levels=[level], colors="#B03A27", linewidths=1.0, linestyles=style)
            handles.append(Line2D([], [], color="#B03A27", linestyle=style, label=f"P = {level:g}"))
    wide = np.argwhere(~data["reached"].transpose(dims[1], dims[0]).values)
    if wide.size:
        look: dict[str, Any] = {"marker": "x", "s": 8, "color": "0.35", "linewidths": 0.6}
        handles.append(ax.scatter(x[wide[:, 1]], y[wide[:, 0]], label="interval wider than requested", **look))
    dress(ax.xaxis, data, dims[0])
    dress(ax.yaxis, data, dims[1])
    for at, axis in ((0, ax.set_xlim), (1, ax.set_ylim)):
        axis(edges[at][0], edges[at][-1]) if not is_geometric(edges[at]) else None
    legend_below(ax, handles)


# ----------------------------------------------------------------------------------------------------
# Quantile thresholds over one parameter: lines with their intervals as bands.


_STYLES = (("#4C97C8", ":"), ("#B03A27", "-"), ("#16245E", "--"), ("#6E8B2F", "-."), ("#000000", (0, (1, 1, 5, 1))))


@checked
def plot_quantiles(dataset: xr.Dataset, ax: Axes | None = None, *, quasi_static: bool = False) -> Axes:
    """Draw the result of :func:`snapbeam.uncertainty.quantile_threshold` over one parameter.

    A line a probability with its interval as a band; a cross where the probability is seen to fall somewhere, so that
    the threshold is not one.

    Parameters
    ----------
    quasi_static : bool
        Whether to draw V_QS1 (Eq. 21) too, over frequency ratio or location.
    """
    contains(dataset, "quantile thresholds", "threshold", "quantile")
    dataset = in_units(dataset)
    data = dataset.squeeze([name for name in dataset["is_monotonic"].dims if dataset.sizes[name] == 1])
    dims = [str(name) for name in data["is_monotonic"].dims]
    if len(dims) != 1 or "point" in dims:
        raise InputError(f"thresholds over {dims}: are drawn over one parameter")
    if data.sizes["quantile"] > len(_STYLES):
        raise InputError(f"dataset: has {data.sizes['quantile']} lines; at most {len(_STYLES)} can be told apart")
    along, raised = dims[0], str(data.attrs["parameter"])
    if quasi_static and (objection := quasi_static_objection(data.attrs)) is not None:
        raise InputError(f"quasi_static with {objection}; leave quasi_static out")
    ratio, wide = ratio_along(data, along)
    if quasi_static and (ratio not in ("location", "frequency_ratio") or ratio_name(raised) != "velocity_amplitude"):
        raise InputError(
            f"quasi_static of {raised} over {ratio}: is known of velocity_amplitude over location and frequency_ratio"
        )
    bottom, top = (float(each) for each in data.attrs["bounds"])
    x, _ = positions(data, along)
    with frame(ax, dataset, height=76.0, axes=(raised,)) as ax:
        for level, (color, dashes) in zip(data["quantile"].values, _STYLES, strict=False):
            one = data.sel(quantile=level)
            low, high = (np.clip(one[f"threshold_{end}"].values, bottom, top) for end in ("low", "high"))
            ax.fill_between(x, low, high, color=color, alpha=0.22, linewidth=0.0)
            look: dict[str, Any] = {"linestyle": dashes, "color": color, "linewidth": 1.1}
            ax.plot(x, one["threshold"].values, label=f"P = {level:g}", marker=".", markersize=3.0, **look)
        if quasi_static:
            line = quasi_static_along(data, ratio, x / wide)
            if raised != "velocity_amplitude":  # in m/s
                omega = 2.0 * np.pi * float(data.attrs["reference_frequency"])
                line = PHYSICAL["drive.velocity_m_s"].unit_of(float(data.attrs["length_scale"]), omega) * line
            ax.plot(x, line, color="black", linewidth=0.8, dashes=(4, 2), label=r"quasi-static, $V_\mathrm{QS1}$")
        falls = ~data["is_monotonic"].values
        if falls.any():
            middle = data["threshold"].sel(quantile=0.5, method="nearest").values
            ax.plot(x[falls], middle[falls], "x", color="black", markersize=4, label="not monotone")
        dress(ax.xaxis, data, along)
        ends = data.drop_vars(raised, errors="ignore").assign_coords({raised: (raised, [bottom, top])})
        dress(ax.yaxis, ends, raised)
        label = axis_label(ends, raised)
        ax.set(xlim=x[[0, -1]], ylabel=wrapped(f"Threshold: {label[:1].lower()}{label[1:]}", 44))
        reach = np.nanmax(np.where(np.isfinite(data["threshold_high"]), data["threshold_high"], np.nan))
        ax.set_ylim(min(0.0, bottom), min(top, 1.08 * float(reach)) if np.isfinite(reach) else top)
        share = 100.0 * float(data.attrs.get("confidence", 0.95))
        watched = str(data.attrs.get("watched_outcome", "snap"))
        words = _WORDS.get(watched, watched).replace("Probability", "$P$: probability")
        extend_title(ax, f"{words}; {int(data['runs'].max())} runs a point, {share:g} % bands")
        legend_below(ax)
    return ax


# ----------------------------------------------------------------------------------------------------
# Tornado pictures: how far an answer moves with each parameter, the most telling on top.


@checked
def plot_tornado(dataset: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw the result of :func:`snapbeam.uncertainty.sensitivity`: a bar for each parameter, with intervals.

    Locally, bars reach from the mean answer to those with the parameter one standard score down and up; how
    much that is in the unit of the parameter is next to its name.  Of indices, the first order and, if there is
    one, the total.
    """
    if "parameter" not in dataset.dims or not {"effect", "first_order"} & set(map(str, dataset.variables)):
        raise InputError(f"no sensitivities among {list(map(str, dataset.variables))}")
    local = "effect" in dataset
    weight = np.abs(dataset["effect" if local else "first_order"].values)
    data = dataset.isel(parameter=np.argsort(weight, kind="stable"))
    count = data.sizes["parameter"]
    with frame(ax, dataset, height=28.0 + 10.0 * count) as ax:
        (_bars if local else _indices)(data, ax, _rows(ax, [_name(data, i) for i in range(count)]))
    return ax


def _bars(data: xr.Dataset, ax: Axes, place: np.ndarray) -> None:
    middle, unit = float(data.attrs["quantity_mean"]), str(data.attrs["quantity_units"])
    found = [data[f"effect{end}"].values for end in ("", "_low", "_high")]
    scale, unit = scale_of([abs(middle), *map(abs, found[0])], unit) if unit.isalpha() else (1.0, unit)
    middle, (half, low, high) = middle / scale, (each / scale for each in found)
    for sign, color, label in (
        (-1.0, _BLUE, "one standard deviation lower"),
        (1.0, _RED, "one standard deviation higher"),
    ):
        ax.barh(place, sign * half, left=middle, height=0.62, color=color, label=label)
        error = np.stack([half - low, high - half])[:: int(sign)]
        interval = f"{100.0 * float(data.attrs['confidence']):g} % interval" if sign > 0.0 else None
        ax.errorbar(middle + sign * half, place, xerr=error, fmt="none", label=interval, **_BARS)
    ax.axvline(middle, color="black", linewidth=0.6)
    words = in_symbols(str(data.attrs["quantity"]))
    text = f"{words[:1].upper()}{words[1:]}{'' if unit == '1' else f' ({unit})'}"
    ax.set_xlabel(wrapped(text, 40))
    legend_below(ax)


def _indices(data: xr.Dataset, ax: Axes, place: np.ndarray) -> None:
    both = "total_order" in data
    height = 0.36 if both else 0.62
    kinds = [("first_order", _BLUE, "first order", 0.19 if both else 0.0)]
    kinds += [("total_order", _SKY, "total", -0.19)] if both else []
    for name, color, label, shift in kinds:
        value, low, high = (data[f"{name}{end}"].values for end in ("", "_low", "_high"))
        ax.barh(place + shift, value, height=height, color=color, label=label)
        words = f"{100.0 * float(data.attrs['confidence']):g} % interval" if name == kinds[-1][0] else None
        error = np.stack([value - low, high - value])
        ax.errorbar(value, place + shift, xerr=error, fmt="none", label=words, **_BARS)
    ax.axvline(0.0, color="black", linewidth=0.6)
    ax.set_xlabel(wrapped(f"Share of the variance of {in_symbols(str(data.attrs['quantity']))}", 44))
    legend_below(ax)


def _name(data: xr.Dataset, at: int) -> str:
    """Label of a bar: the parameter and, for a local analysis, its step with unit."""
    name = str(data["parameter"].values[at])
    size = float(data["step"][at]) if "step" in data else 0.0  # 0 where it is not known
    step = size and _with_unit(size, lookup(name).quantity.unit, 2)
    return f"{_words(name)}\n± {step}" if step else _words(name)


def _words(name: str) -> str:
    if name in PHYSICAL:
        return PHYSICAL[name].words
    section, text = split_name(name)
    return f"{'contact ' if section == 'contact' and lookup(name).kinds else ''}{text.replace('_', ' ')}"


def _with_unit(value: float, unit: str, digits: int) -> str:
    unit = re.sub(r"\^([\d.]+)", r"$^{\1}$", unit)
    return f"{value:.{digits}g}" if unit == "1" else prefixed(value, unit, digits)


@checked
def plot_gradient(dataset: xr.Dataset, ax: Axes | None = None, *, statistic: str | None = None) -> Axes:
    """Draw the elasticities of a quantity, the result of :func:`snapbeam.uncertainty.gradient`, with their errors.

    Several statistics have a panel each, with the parameters in the same order; those without a derivative have none.  A bar whose
    error is not below its length is hatched.

    Parameters
    ----------
    dataset : xarray.Dataset
    statistic : str, optional
        One of several statistics; by default all, which need a figure of their own.
    """
    contains(dataset, "gradient", "elasticity", "relative_error")
    panels = smooth_statistics(dataset)
    if statistic is not None:
        if statistic not in panels:
            raise InputError(f"statistic = {shown(statistic)}: must be one of {', '.join(panels) or 'none'}")
        panels = {statistic: panels[statistic]}
    size = np.max([np.abs(np.nan_to_num(each["elasticity"].values)) for each in panels.values()], axis=0)
    order = np.argsort(size, kind="stable")
    if len(panels) == 1:
        (one,) = panels.values()
        with frame(ax, dataset, height=24.0 + 9.0 * order.size) as ax:
            legend_below(ax, _elasticities(one.isel(parameter=order), ax))
        return ax
    if ax is not None:
        raise InputError(
            f"ax: holds one panel, and the dataset has {len(panels)}; choose a statistic: {', '.join(panels)}"
        )
    with figure_style():
        figure = new_figure("single", len(panels) * (20.0 + 6.0 * order.size))
        axes = figure.subplots(len(panels), 1)
        handles = [
            _elasticities(one.isel(parameter=order), each) for one, each in zip(panels.values(), axes, strict=True)
        ]
        drawn = next(filter(None, handles), [])
        if drawn:
            figure_legend(figure, drawn)
        fix_ticks(*axes)
    first: Axes = axes[0]
    return first


def smooth_statistics(dataset: xr.Dataset) -> dict[str, xr.Dataset]:
    """The gradient of each statistic that has one, by its name; of a single quantity the dataset itself."""
    if "statistic" not in dataset.dims:
        return {str(dataset.attrs["quantity"]): dataset}
    kept = dataset.isel(statistic=np.flatnonzero(dataset["no_derivative"].values == ""))
    return {str(name): kept.sel(statistic=name) for name in kept["statistic"].values}


def _elasticities(data: xr.Dataset, ax: Axes) -> list[Any]:
    """Bars of one quantity; returns the entries of a legend."""
    name = str(data["statistic"].item() if "statistic" in data.coords else data.attrs["quantity"])
    words = STATISTICS[name].long_name.partition(", over")[0] if name in STATISTICS else name.replace("_", " ")
    value, error = data["elasticity"].values, data["relative_error"].values
    place = _rows(ax, [_name(data, i) for i in range(value.size)])
    sure = error <= 1.0
    ax.barh(place[sure], value[sure], xerr=np.abs(value * error)[sure], height=0.62, color=_BLUE, error_kw=_BARS)
    look: dict[str, Any] = {"facecolor": "white", "edgecolor": _BLUE, "hatch": "/////", "linewidth": 0.6}
    doubtful = ax.barh(
        place[~sure], value[~sure], height=0.62, label="error not below the value: grazing or chaos", **look
    )
    ax.axvline(0.0, color="black", linewidth=0.6)
    if not np.isfinite(value).any():
        ax.text(0.5, 0.5, "the quantity is 0", transform=ax.transAxes, ha="center", va="center")
    ax.set_xlabel(wrapped(f"Change of {words}", 44) + "\nfor 1 % of the parameter (%)")
    return [doubtful] if np.isfinite(value[~sure]).any() else []


@checked
def plot_posterior(dataset: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw the marginal intervals of a posterior, over the median of each parameter, and state the medians."""
    contains(dataset, "posterior", "weight")
    names = [str(name) for name in dataset.data_vars if name != "weight"]
    weight = dataset["weight"].values
    labels, ends = [], []
    for name in names:
        found = weighted_quantiles(dataset[name].values, weight, (0.025, 0.25, 0.5, 0.75, 0.975))
        row = lookup(str(dataset[name].attrs["parameter"]))
        labels.append(f"{_words(row.name)}\nmedian {_with_unit(found[2], row.quantity.unit, 4)}")
        ends.append(100.0 * (found / found[2] - 1.0))
    with frame(ax, dataset, height=28.0 + 9.0 * len(names)) as ax:
        place, at = _rows(ax, labels), np.array(ends)
        ax.hlines(place, at[:, 0], at[:, 4], color=_BLUE, linewidth=1.0, label="95 % interval")
        ax.hlines(place, at[:, 1], at[:, 3], color=_BLUE, linewidth=4.0, label="50 % interval")
        ax.axvline(0.0, color="black", linewidth=0.6)
        ax.set_xlabel("Difference from the median (%)")
        legend_below(ax)
    return ax


@checked
def plot_scores(dataset: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw the probability of each measured class, the result of :func:`snapbeam.uncertainty.score_measurements`."""
    contains(dataset, "measured classes", "most_likely", "probability_low")
    order = np.argsort(dataset["probability"].values, kind="stable")
    data = dataset.isel(measurement=order)
    x, middle = np.arange(1, order.size + 1), data["probability"].values
    bars = np.clip([middle - data["probability_low"], data["probability_high"] - middle], 0.0, None)
    with frame(ax, dataset) as ax:
        for kind in ResponseClass:
            own = data["response_class"].values == kind
            if own.any():
                ax.errorbar(
                    x[own], middle[own], yerr=bars[:, own], fmt="o", color=CLASS_COLORS[kind], markersize=4,
                    markeredgecolor="black", markeredgewidth=0.5, label=f"measured: {kind.label}", **_BARS,
                )  # fmt: skip
        extend_title(
            ax, f"{data.attrs['agree']} of {order.size} most likely, {data.attrs['agree_expected']:.3g} expected"
        )
        ax.set(xlabel="Measurement, by probability", ylabel="Probability of the measured class", ylim=(-0.02, 1.02))
        legend_below(ax)
    return ax


def _rows(ax: Axes, labels: list[str]) -> np.ndarray:
    """Name the rows of a picture, from the bottom, and take away the frame beside them; returns their places."""
    place = np.arange(len(labels))
    ax.set_yticks(place, labels)
    ax.set_ylim(-0.6, len(labels) - 0.4)
    ax.tick_params(axis="y", length=0)
    for side in ("top", "right", "left"):
        ax.spines[side].set_visible(False)
    return place
