"""The map of response types over two of frequency, amplitude and location (Figs. 6-8 of the paper)."""

from __future__ import annotations

import itertools
import json
import warnings
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import cmcrameri.cm as crameri
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis, XAxis
from matplotlib.colors import LogNorm, Normalize
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from snapbeam.model.mapping import labels_of, resolved
from snapbeam.model.parameters import lookup, named_in, ratio_of
from snapbeam.model.quantity import split_name
from snapbeam.model.quasi_static import quasi_static_objection, quasi_static_threshold
from snapbeam.plot.agreement import draw_agreement
from snapbeam.plot.axes import axis_label, dress, edges_of, positions, symbol_of, tick_text, wrapped
from snapbeam.plot.style import (
    BEAM_COLOR,
    CLASS_COLORS,
    SHAKER_COLOR,
    caption,
    class_cells,
    color_bar,
    fixed_value,
    frame,
    legend_below,
    marker_size,
    set_title,
)
from snapbeam.plot.units import in_symbols, in_units, ratio_along, scale_text
from snapbeam.solver.statistics import STATISTICS, name_in
from snapbeam.sweeps.measured_points import MeasuredPoints
from snapbeam.sweeps.seeds import mean_over_seeds, seed_axes
from snapbeam.util.si_prefixes import scale_of
from snapbeam.util.status_codes import ResponseClass, wells_of
from snapbeam.util.validation import InputError, InputTypeError, checked, finite_array, integer, shown

if TYPE_CHECKING:
    import xarray as xr

_Array = NDArray[np.float64]

UPWARD = ("velocity_amplitude", "location", "base_excitation_acceleration_amplitude")
"""Axes that are drawn upward rather than across, the first of them first."""

_CURVES = ("min_midspan_displacement", "max_midspan_displacement")
"""Drawn over the classes of a map over one axis."""
_LONGEST = 32
"""Characters of a line next to a map of one column."""
_NEAR = 0.02  # a measured point belongs to a map if its fixed coordinate is within this share of the map's


@checked
def plot_response_map(
    dataset: xr.Dataset,
    ax: Axes | None = None,
    *,
    measurements: MeasuredPoints | None = None,
    quasi_static_line: bool = False,
    legend: bool = True,
) -> Axes:
    """Draw the response class of each run of a map; over one axis, with the range of the mid-span displacement.

    Cell borders lie midway between points (not below zero, nor beyond the end of the beam). Cells of a map with repeats
    are the paler the fewer of them agree (``class_fraction``).

    Parameters
    ----------
    dataset : xarray.Dataset
        Map with ``response_class`` over one or two axes of more than one point, or a list of points
        (:func:`plot_points`).
    ax : matplotlib.axes.Axes, optional
        Axes to draw in; new ones by default.
    measurements : MeasuredPoints, optional
        Measured responses, drawn as dots in the colours of their classes. Those at another value of the map's fixed
        coordinate (by more than 2 %) are left out, with a warning.
    quasi_static_line : bool
        True for the quasi-static threshold V_QS1 of one mode (Eq. 21), dashed.
    legend : bool
        True for a legend with the fractions of the runs.

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> system = paper.struck_beam(frequency_ratio=1.2, velocity_amplitude=0.18)
    >>> axes = {"drive.frequency_ratio": [0.7, 0.8], "drive.velocity_amplitude": [0.1, 0.2]}
    >>> dataset = sb.sweep(system, axes, sb.Integration(cycles=20))
    >>> ax = sb.plot.plot_response_map(dataset)
    """
    over: dict[str, Any] = {"measurements": measurements, "quasi_static_line": quasi_static_line}
    if "response_class" in dataset and dataset["response_class"].dims == ("point",):
        return plot_points(dataset, "response_class", ax, legend=legend, **over)
    dataset = in_units(dataset)
    response = dataset["response_class"].squeeze() if "response_class" in dataset else dataset
    if "response_class" in dataset and response.ndim == 1 and "point" not in response.dims:
        return _line(dataset, ax, measurements is not None or quasi_static_line, legend)
    across, upward, kinds = _two_axes(dataset)
    ratios = [ratio_along(dataset, name)[0] for name in (across, upward)]
    edges = tuple(edges_of(dataset, name) for name in (across, upward))
    names = ("frequency_ratio", "location", "velocity_amplitude")
    fixed = {name: fixed_value(dataset, name) for name in names if name not in ratios}
    with frame(ax, height=92.0 if legend else 70.0) as ax:
        class_cells(ax, edges[0], edges[1], kinds)
        dress(ax.xaxis, dataset, across)
        dress(ax.yaxis, dataset, upward)
        set_title(ax, caption(dataset, 2, (across, upward)))
        handles = class_handles(kinds, wells_of(dataset.attrs))
        if "class_fraction" in dataset:
            handles.append(draw_agreement(ax, dataset, (across, upward), edges))
        ax.set(xlim=edges[0][[0, -1]], ylim=edges[1][[0, -1]])
        if quasi_static_line:
            handles.append(draw_quasi_static_line(ax, dataset, across, upward, fixed))
        if measurements is not None:
            handles.append(draw_measurements(ax, measurements, dataset, across, upward, fixed))
        if legend:
            legend_below(ax, handles)
    return ax


def _line(dataset: xr.Dataset, ax: Axes | None, overlaid: bool, legend: bool) -> Axes:
    """A map over one axis."""
    if overlaid:
        raise InputError("measurements, quasi_static_line: are drawn over two axes; this map has one")
    name = str(dataset["response_class"].squeeze().dims[0])
    with frame(ax, height=84.0 if legend else 62.0) as ax:
        _draw_line(ax, dataset, name)
        set_title(ax, caption(dataset, 2, (name,)))
        if legend:
            kinds = dataset["response_class"].values
            handles = class_handles(kinds, wells_of(dataset.attrs))
            if 0 < dataset.attrs.get("pull_in_runs", 0) == (kinds == ResponseClass.UNKNOWN).sum():
                handles[-1].set_label(str(handles[-1].get_label()).replace("unknown", "pull-in"))
            legend_below(ax, handles)
    return ax


def _draw_line(ax: Axes, dataset: xr.Dataset, name: str) -> None:
    """Draw classes along the axis *name*, with the minimum and the maximum displacement of the centre above them."""
    points, _ = positions(dataset, name)
    edges = edges_of(dataset, name)
    kinds = dataset["response_class"].squeeze().values[None, :]
    low, high = -1.6, 1.6
    curves = [dataset[key].squeeze().values for key in _CURVES if key in dataset]
    if curves and np.isfinite(np.concatenate(curves)).any():
        low, high = min(low, np.nanmin(curves[0])), max(high, np.nanmax(curves[-1]))
    pad = 0.08 * (high - low)
    class_cells(ax, edges, np.array([low - pad, high + pad]), kinds)
    for curve in curves:
        ax.plot(points, curve, color="white", linewidth=2.0)
        ax.plot(points, curve, ".-", color="black", linewidth=0.8, markersize=2.5)
    dress(ax.xaxis, dataset, name)
    ax.set_ylabel(
        f"Mid-span displacement {scale_text(dataset.attrs, '$w/b$')},\nminimum and maximum".replace(" (", "\n(")
    )
    ax.set(xlim=edges[[0, -1]], ylim=(low - pad, high + pad))


def _two_axes(dataset: xr.Dataset) -> tuple[str, str, NDArray[np.int8]]:
    if "response_class" not in dataset:
        raise InputError(
            f"dataset: is not a map; it has no variable 'response_class' among {list(map(str, dataset.variables))}"
        )
    response = dataset["response_class"].squeeze()
    named = [str(name) for name in response.dims]
    if len(named) != 2 or "point" in named:
        sizes = ", ".join(f"{name} {size}" for name, size in response.sizes.items()) or "none"
        least = min(named, key=lambda name: response.sizes[name], default="")
        more = (
            f"select one value of {least}, by --at {least}=VALUE or dataset.sel({least}=VALUE, method='nearest')"
            if len(named) > 2
            else "select fewer values"
        )
        raise InputError(f"a map is drawn over two axes of more than one point; this one has {sizes}: {more}")
    across, upward = in_order(dataset, named)
    return across, upward, response.transpose(upward, across).values


def in_order(dataset: xr.Dataset, dims: list[str]) -> tuple[str, str]:
    """The names of two axes: the one that is drawn across, then the one that is drawn upward."""
    ratios = {ratio_along(dataset, name)[0]: name for name in dims}
    upward = next((ratios[name] for name in UPWARD if name in ratios), dims[1])
    return dims[0] if dims[1] == upward else dims[1], upward


def class_handles(kinds: NDArray[np.int8] | None = None, wells: int = 2) -> list[Patch | Line2D]:
    """Return legend handles of the response classes.

    Parameters
    ----------
    kinds : int8 array, optional
        Classes of runs, whose fractions are then shown with the names; classes without runs are omitted.
    wells : int
        Number of wells of the beam, which the names of the classes follow from.

    Examples
    --------
    >>> import snapbeam as sb
    >>> [handle.get_label() for handle in sb.plot.class_handles()][:2]
    ['intrawell', 'transient interwell 1']
    """
    wells = integer("wells", wells, 1, 2)
    if kinds is not None:
        try:
            shown_kinds = np.asarray(kinds, dtype=np.float64)
        except (TypeError, ValueError, OverflowError, MemoryError):
            raise InputTypeError("kinds: must be an array of class codes") from None
        # points that a picture leaves out are NaN in it
        kinds = finite_array("kinds", shown_kinds[shown_kinds == shown_kinds]).astype(np.int8)
    handles: list[Patch | Line2D] = []
    for kind in (*(k for k in ResponseClass if k >= 0), ResponseClass.UNKNOWN):
        count = 0 if kinds is None else int((kinds == kind).sum())
        if count or (kinds is None and kind is not ResponseClass.UNKNOWN):
            name = kind.label_of(wells)
            percent = 0.0 if kinds is None else 100.0 * count / max(kinds.size, 1)
            share = "<0.1 %" if 0.0 < percent < 0.1 else f"{percent:.1f} %"
            label = name if kinds is None else f"{name}, {share}"
            handles.append(Patch(facecolor=CLASS_COLORS[kind], edgecolor="black", linewidth=0.4, label=label))
    return handles


def draw_quasi_static_line(
    ax: Axes, dataset: xr.Dataset, across: str, upward: str, fixed: dict[str, float | None]
) -> Line2D:
    """Draw V_QS1 of one mode (Eq. 21) over two of the paper's coordinates, the third of them fixed."""
    (across, wide), (upward, high) = (ratio_along(dataset, name) for name in (across, upward))
    limits = [np.divide(each, unit) for each, unit in ((ax.get_xlim(), wide), (ax.get_ylim(), high))]
    x, y = quasi_static_curve(dataset.attrs, (across, upward), limits, fixed)
    line = wide * x, high * y
    ax.plot(*line, color="white", linewidth=1.8)
    inside = [(min(lim) < at) & (at < max(lim)) for at, lim in zip(line, (ax.get_xlim(), ax.get_ylim()), strict=True)]
    where = "" if np.logical_and(*inside).any() else ": outside the map"
    label = rf"quasi-static, $V_\mathrm{{QS1}}${where}"
    return ax.plot(*line, color="black", linewidth=0.9, dashes=(4, 2), label=label)[0]


def quasi_static_curve(
    attributes: Mapping[Any, Any], names: tuple[str, str], limits: Sequence[Any], fixed: Mapping[str, Any]
) -> tuple[_Array, _Array]:
    """Points of V_QS1 of one mode (Eq. 21) over two of the paper's coordinates, the third of them fixed.

    The *names* are those of the coordinates across and upward, between the *limits* of each.
    """
    if (objection := quasi_static_objection(attributes)) is not None:
        raise InputError(f"quasi_static_line with {objection}; leave quasi_static_line out")
    if set(names) - {"frequency_ratio", "location", "velocity_amplitude"}:
        raise InputError(
            "quasi_static_line: is drawn over frequency ratio, location and velocity amplitude, "
            f"not {names[0]}, {names[1]}"
        )
    at = {name: np.linspace(low, high, 402)[1:-1] for name, (low, high) in zip(names, limits, strict=True)}
    if "velocity_amplitude" in names:
        place, ratio = (at[name] if name in at else _given(fixed, name) for name in ("location", "frequency_ratio"))
        at["velocity_amplitude"] = quasi_static_threshold(place, ratio)
    else:
        at["frequency_ratio"] = _given(fixed, "velocity_amplitude") / quasi_static_threshold(at["location"], 1.0)
    return at[names[0]], at[names[1]]


def quasi_static_along(dataset: xr.Dataset, along: str, x: _Array) -> _Array:
    """V_QS1 of one mode (Eq. 21) along ``location`` or ``frequency_ratio``, the other of them fixed."""
    place, ratio = (x if along == name else float(dataset[name]) for name in ("location", "frequency_ratio"))
    return np.asarray(quasi_static_threshold(place, ratio))


def _given(fixed: Mapping[str, Any], name: str) -> float:
    value = fixed.get(name)
    if value is None:
        raise InputError(f"quasi_static_line: needs the map's {name}, which the dataset does not contain")
    return value


def draw_measurements(
    ax: Axes, measurements: MeasuredPoints, dataset: xr.Dataset, across: str, upward: str, fixed: dict[str, Any]
) -> Line2D:
    """Draw measured responses over a map, those at other values of its fixed coordinates left out with a warning."""
    (across, wide), (upward, high) = (ratio_along(dataset, name) for name in (across, upward))
    keep = np.ones(len(measurements), dtype=bool)
    for name, value in fixed.items():
        there = getattr(measurements, name)
        if value is not None:
            keep &= np.isnan(there) | (np.abs(there - value) <= _NEAR * abs(value))
    for name in (across, upward):
        keep &= ~np.isnan(getattr(measurements, name))
    if not keep.all():
        named = ", ".join(f"{name} = {value:.4g}" for name, value in fixed.items() if value is not None)
        warnings.warn(
            f"{int((~keep).sum())} of {len(measurements)} measured points do not belong to {named} and are left out",
            stacklevel=3,
        )
    colors = [CLASS_COLORS[ResponseClass(int(kind))] for kind in measurements.response_class[keep]]
    where = wide * getattr(measurements, across)[keep], high * getattr(measurements, upward)[keep]
    ends = zip(where, (ax.get_xlim(), ax.get_ylim()), strict=True)
    outside = np.any([(at < low) | (at > high) for at, (low, high) in ends], axis=0)
    if outside.any():
        warnings.warn(f"{int(outside.sum())} of {len(measurements)} measured points lie outside the map", stacklevel=3)
    ax.scatter(*where, s=26, c="white", linewidths=0.0, zorder=3)
    ax.scatter(*where, s=14, c=colors, edgecolors="black", linewidths=0.6, zorder=4)
    return Line2D(
        [], [], linestyle="", marker="o", markersize=4, markerfacecolor="white", markeredgecolor="black",
        markeredgewidth=0.6, label=f"measured, {int(keep.sum())}",
    )  # fmt: skip


# ----------------------------------------------------------------------------------------------------
# Maps of a statistic, such as the peak force or the striker's work, over one or two axes.


_DECADES = 300.0
"""Ratio of the maximum to the minimum above which the colour scale is logarithmic."""


@checked
def plot_statistic(
    dataset: xr.Dataset, name: str, ax: Axes | None = None, *, log: bool | None = None, over: str | None = None
) -> Axes:
    """Draw a statistic of a map: colours over two axes, a curve over one, coloured dots of a list of points.

    Cells without a value are grey.

    Parameters
    ----------
    dataset : xarray.Dataset
        Map, or a result of :func:`snapbeam.dynamics.hysteresis`, drawn as two lines.
    name : str
        Name of a variable over the axes; over an axis of seeds its mean, with the interval over one other axis.
    ax : matplotlib.axes.Axes, optional
        Axes to draw in; new ones by default.
    log : bool, optional
        True for powers of ten; by default where the values span more than two.
    over : str, optional
        One of two axes: over it a curve is drawn for each value of the other one.

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> system = paper.struck_beam(frequency_ratio=1.2, velocity_amplitude=0.18)
    >>> axes = {"drive.frequency_ratio": [0.7, 0.8], "drive.velocity_amplitude": [0.1, 0.2]}
    >>> dataset = sb.sweep(system, axes, sb.Integration(cycles=20))
    >>> ax = sb.plot.plot_statistic(dataset, "peak_force")
    """
    name = name_in(dataset, name)
    if name not in dataset:
        raise InputError(f"variable = {shown(name)}: the map has {', '.join(map(str, dataset.data_vars))}")
    if dataset[name].dims == ("point",):
        return plot_points(dataset, name, ax)
    dataset = in_units(_of_any_seed(dataset, name))
    values = dataset[name].squeeze(
        [each for each, size in dataset[name].sizes.items() if size == 1 and each != "sweep"]
    )
    dims = [str(each) for each in values.dims]
    if not 1 <= len(dims) <= 2 or "point" in dims:
        sizes = ", ".join(f"{key} {size}" for key, size in values.sizes.items()) or "none"
        raise InputError(
            f"a statistic is drawn over one or two axes; this one has {sizes}: select one point of the others, as with "
            "dataset.isel(location=0)"
        )
    scaled, label = scaled_values(dataset, name)
    data = values.copy(data=scaled.reshape(values.shape))
    if log is None:
        log = wants_powers(scaled)
    along = None if over is None else _axis_named(dataset, dims, over)
    with frame(ax, height=74.0) as ax:
        if along is not None and len(dims) == 2:
            _curves(ax, dataset, data, along)
        elif dims[:1] == ["sweep"] or len(dims) == 1:
            if len(dims) > 1:
                _swept(ax, dataset, data, dims[1])
            else:
                points, _ = positions(dataset, dims[0])
                size = 1.5 * marker_size(points.size)
                ax.plot(points, data.values, ".-", color=BEAM_COLOR, markersize=size, label="mean")
                if f"{name}_low" in dataset:
                    _band(ax, dataset.squeeze(), name, points)
                if float(np.ptp(data.values)) < 1e-6 * abs(middle := float(np.mean(data.values))):
                    ax.set_ylim(middle - 0.1 * abs(middle), middle + 0.1 * abs(middle))
        else:
            across, upward = in_order(dataset, dims)
            field = np.ma.masked_invalid(data.transpose(upward, across).values)
            positive = scaled[scaled > 0.0]
            norm = LogNorm(positive.min(), positive.max()) if log else Normalize()
            ax.set_facecolor("0.8")
            mesh = ax.pcolormesh(
                edges_of(dataset, across), edges_of(dataset, upward), field, cmap=crameri.batlow, norm=norm,
                rasterized=field.size > 20_000,
            )  # fmt: skip
            color_bar(mesh, ax, label, pad=0.02)
            dress(ax.xaxis, dataset, across)
            dress(ax.yaxis, dataset, upward)
        if along is not None or len(dims) == 1 or dims[:1] == ["sweep"]:
            dress(ax.xaxis, dataset, dims[-1] if along is None else along)
            ax.set_ylabel(label)
            ax.set_yscale("log" if log else "linear")
        set_title(ax, caption(dataset, 2, dims))
    return ax


def _axis_named(dataset: xr.Dataset, dims: list[str], over: str) -> str:
    """The axis that a parameter names, as a ratio or in its physical unit."""
    full = {each: str(dataset[each].attrs.get("parameter", each)) for each in dims}
    labels = labels_of(json.loads(dataset.attrs.get("system", "{}")))
    sections: dict[str, Any] = {split_name(each)[0]: {} for each in full.values()}
    row = None if over in dims else lookup(named_in(resolved(over, labels), sections))
    for each, name in full.items():
        if over == each or (row is not None and ratio_of(row.name) == ratio_of(lookup(name).name)):
            return each
    raise InputError(f"over = {over!r}: is not an axis of the figure; its axes: {', '.join(dims)}")


def _curves(ax: Axes, dataset: xr.Dataset, data: xr.DataArray, along: str) -> None:
    """Draw a statistic over one axis as a curve for each value of the other, with the interval of its mean."""
    (other,) = (str(each) for each in data.dims if each != along)
    points, _ = positions(dataset, along)
    _, words = positions(dataset, other)
    name, colors = str(data.name), crameri.batlow(np.linspace(0.0, 0.85, data.sizes[other]))
    factor, _ = _label(dataset, name, dataset[name].values)
    for at, (color, mark) in enumerate(zip(colors, itertools.cycle("os^Dv<>"), strict=False)):
        value = tick_text(dataset, other, float(dataset[other][at]), 4) if words is None else words[at]
        symbol = symbol_of(dataset, other) or ("" if words is None else other)
        text = f"{symbol} = {value.removesuffix(f' in {symbol}')}" if symbol else value
        values = data.isel({other: at}).values
        ax.plot(points, values, f"{mark}-", color=color, markersize=1.2 * marker_size(points.size), label=text)
        if f"{name}_low" in dataset:
            part = dataset.isel({other: at}).squeeze()
            low, high = (part[f"{name}{end}"].values / factor for end in ("_low", "_high"))
            ax.fill_between(points, low, high, where=np.isfinite(high - low), color=color, alpha=0.2, linewidth=0.0)
    handles = ax.get_legend_handles_labels()[0]
    if f"{name}_low" in dataset:
        handles.append(Patch(color="0.75", label=_interval_words(dataset)))
    legend_below(ax, handles)


def _of_any_seed(dataset: xr.Dataset, name: str) -> xr.Dataset:
    """The means over seeds of a map that has other axes too; otherwise the map itself."""
    seeds = seed_axes(dataset)
    others = [each for each, size in dataset[name].sizes.items() if size > 1 and each not in seeds]
    return mean_over_seeds(dataset) if seeds and others and dataset[name].dtype.kind == "f" else dataset


def _band(ax: Axes, dataset: xr.Dataset, name: str, points: _Array) -> None:
    """Draw the interval of a mean, and the quantiles beside it."""
    factor, _ = _label(dataset, name, dataset[name].values)
    low, high = (dataset[f"{name}{end}"].values / factor for end in ("_low", "_high"))
    known = np.isfinite(low) & np.isfinite(high)
    words = _interval_words(dataset)
    ax.fill_between(points, low, high, where=known, color=BEAM_COLOR, alpha=0.25, linewidth=0.0, label=words)
    if f"{name}_quantile" in dataset:
        for level, dashes in zip(dataset["quantile"].values, itertools.cycle(("--", "-.", ":"))):
            values = dataset[f"{name}_quantile"].sel(quantile=level).values / factor
            ax.plot(points, values, dashes, color=SHAKER_COLOR, label=f"{level:g} quantile")
    legend_below(ax)


def _interval_words(dataset: xr.Dataset) -> str:
    return f"{100.0 * float(dataset.attrs.get('confidence', 0.95)):g} % interval of the mean"


def _swept(ax: Axes, dataset: xr.Dataset, data: xr.DataArray, name: str) -> None:
    """Draw a statistic over a parameter that was swept up and down: filled and open markers."""
    points, _ = positions(dataset, name)
    looks = {"up": ("^-", BEAM_COLOR, BEAM_COLOR), "down": ("v--", SHAKER_COLOR, "white")}
    for row, kind in zip(data.values, dataset["sweep"].values, strict=True):
        look, color, face = looks[str(kind)]
        size = 1.2 * marker_size(points.size)
        ax.plot(points, row, look, color=color, markerfacecolor=face, markersize=size, label=f"swept {kind}")
    ax.legend(loc="best")


def scaled_values(dataset: xr.Dataset, name: str) -> tuple[_Array, str]:
    """Values of a variable in a suitable unit, and their label."""
    values = dataset[name].values.astype(np.float64)
    factor, label = _label(dataset, name, values)
    scaled: _Array = values / factor
    return scaled, label


def wants_powers(values: _Array) -> bool:
    """Return whether values need a logarithmic colour scale: none is negative, and they span over two decades."""
    good = values[np.isfinite(values)]
    positive = good[good > 0.0]
    return bool(positive.size and (good >= 0.0).all() and positive.max() > _DECADES * positive.min())


def _label(dataset: xr.Dataset, name: str, values: np.ndarray) -> tuple[float, str]:
    """Divisor of the values, and the label of the colour bar."""
    attrs = dataset[name].attrs
    row = STATISTICS.get(name)
    words = in_symbols(str(attrs.get("long_name", row.long_name if row else name)))
    unit = str(attrs.get("units", row.unit if row else "1"))
    words = words[:1].upper() + words[1:]
    if unit == "1":
        words = scale_text(dataset.attrs, words) if "over $b" in words else words
        return 1.0, wrapped(words, _LONGEST)
    factor, scaled = scale_of(values, unit)
    return factor, wrapped(f"{words} ({scaled})", _LONGEST)


# ----------------------------------------------------------------------------------------------------
# Lists of points, as a random sweep or a search makes them: a dot for each, over two of their parameters.


_AREA = 2600.0
"""Square points of ink that all dots together take, about; each has between the two below."""
_SMALLEST, _LARGEST = 2.0, 22.0
_PAPER = (
    ("frequency_ratio", "velocity_amplitude"),
    ("location", "velocity_amplitude"),
    ("frequency_ratio", "location"),
)
_SHARE = 0.04
"""Room beyond the outermost dots, as a share of the axis."""


@checked
def plot_points(
    dataset: xr.Dataset,
    name: str = "response_class",
    ax: Axes | None = None,
    *,
    across: str | None = None,
    upward: str | None = None,
    measurements: MeasuredPoints | None = None,
    quasi_static_line: bool = False,
    legend: bool = True,
) -> Axes:
    """Draw the response class, or a statistic, of each point of a list at its parameter values.

    Parameters
    ----------
    dataset : xarray.Dataset
        Result of :func:`snapbeam.sweep` over a list of points.
    name : str
        Name of a variable over the points.
    ax : matplotlib.axes.Axes, optional
        Axes to draw in; new ones by default.
    across, upward : str, optional
        Parameters along the axes; by default two of those that differ.
    measurements, quasi_static_line
        Measured responses and V_QS1, as in :func:`plot_response_map`, over the paper's coordinates.
    legend : bool
        True for a legend with the fractions of the points.

    Examples
    --------
    >>> import snapbeam as sb
    >>> import xarray as xr
    >>> from snapbeam import paper
    >>> system = paper.struck_beam(frequency_ratio=1.2, velocity_amplitude=0.18)
    >>> values = {"drive.frequency_ratio": [0.7, 0.75, 0.8], "drive.velocity_amplitude": [0.1, 0.2, 0.3]}
    >>> points = xr.Dataset({name: ("point", each) for name, each in values.items()})
    >>> dataset = sb.sweep(system, points, sb.Integration(cycles=20))
    >>> ax = sb.plot.plot_points(dataset, "peak_force")
    """
    dataset = in_units(dataset)
    if name not in dataset.data_vars or dataset[name].dims != ("point",):
        named = [str(key) for key, item in dataset.data_vars.items() if item.dims == ("point",)]
        raise InputError(f"variable = {shown(name)}: the points have {', '.join(named) or 'no variables'}")
    along = _along(dataset, across, upward)
    of_class = name == "response_class"
    with frame(ax, height=92.0 if of_class and legend else 74.0) as ax:
        at = [_place(axis, dataset, each) for axis, each in zip((ax.xaxis, ax.yaxis), along, strict=True)]
        size = float(np.clip(_AREA / max(at[0].size, 1), _SMALLEST, _LARGEST))
        look: dict[str, Any] = {"s": size, "linewidths": 0.2 if size > 6.0 else 0.0, "edgecolors": "black"}
        look["rasterized"] = at[0].size > 5000
        handles: list[Any] = []
        if of_class:
            kinds = dataset[name].values.astype(int)
            ax.scatter(at[0], at[1], c=[CLASS_COLORS[ResponseClass(int(kind))] for kind in kinds], **look)
            handles += class_handles(kinds, wells_of(dataset.attrs))
        else:
            _statistic(ax, dataset, name, at, look)
        handles += _over(ax, dataset, along, measurements, quasi_static_line)
        if legend:
            legend_below(ax, handles)
        set_title(ax, caption(dataset, 2, along))
    return ax


def _over(
    ax: Axes, dataset: xr.Dataset, along: tuple[str, str], measurements: MeasuredPoints | None, line: bool
) -> list[Any]:
    """Draw what lies over the points; what a legend needs for it."""
    if measurements is None and not line:
        return []
    ratios = tuple(ratio_along(dataset, name)[0] for name in along)
    if ratios not in _PAPER:
        raise InputError(
            "measurements, quasi_static_line: need velocity amplitude, or location, upward over frequency or location, "
            f"not {along[1]} over {along[0]}"
        )
    fixed: dict[str, float | None] = {}
    for name in {name for pair in _PAPER for name in pair} - set(ratios):
        values = np.unique(dataset[name].values) if name in dataset.coords else np.empty(0)
        fixed[name] = float(values[0]) if values.size == 1 else None
    handles: list[Any] = [draw_quasi_static_line(ax, dataset, *along, fixed)] if line else []
    return handles if measurements is None else [*handles, draw_measurements(ax, measurements, dataset, *along, fixed)]


def _along(dataset: xr.Dataset, across: str | None, upward: str | None) -> tuple[str, str]:
    """The names of the coordinates along the two axes."""
    names = [
        str(name)
        for name, item in dataset.coords.items()
        if item.dims == ("point",) and name != "point" and "parameter" in item.attrs
    ]
    for what, given in (("across", across), ("upward", upward)):
        if given is not None and given not in names:
            raise InputError(f"{what} = {shown(given)}: the points are given by {', '.join(names) or 'nothing'}")
    ratios = {name: ratio_along(dataset, name)[0] for name in names}
    known = {ratio for name, ratio in ratios.items() if ratio != name}  # in the unit in which they were given
    names = [name for name in names if name not in known]
    differing = [name for name in names if np.unique(dataset[name].values).size > 1]
    free = [name for name in (*differing, *names) if name not in (across, upward)]
    if upward is None:
        found = {ratios[name]: name for name in reversed(free)}
        upward = next((found[name] for name in UPWARD if name in found), free[-1] if free else None)
    if across is None:
        across = next((name for name in free if name != upward), None)
    if across is None or upward is None or across == upward:
        raise InputError(f"points are drawn over two parameters; these are given by {', '.join(names) or 'none'}")
    return across, upward


def _place(axis: Axis, dataset: xr.Dataset, name: str) -> NDArray[np.float64]:
    """Coordinates of the points along an axis, which gets its label; words are equally spaced."""
    values = dataset[name].values
    axis.set_label_text(axis_label(dataset.drop_vars("point", errors="ignore"), name))
    if values.dtype.kind in "fiu":
        places = values.astype(np.float64)
    else:
        words, inverse = np.unique(values.astype(str), return_inverse=True)
        axis.set_ticks(np.arange(words.size).tolist(), words.tolist())
        places = inverse.astype(np.float64)
    low, high = float(places.min()), float(places.max())
    margin = _SHARE * (high - low) or 0.5
    limits = axis.axes.set_xlim if isinstance(axis, XAxis) else axis.axes.set_ylim
    limits(low - margin, high + margin)
    return places


def _statistic(ax: Axes, dataset: xr.Dataset, name: str, at: list[NDArray[np.float64]], look: dict[str, Any]) -> None:
    """Dots in colours by their value; those without one are hollow."""
    values, label = scaled_values(dataset, name)
    good = np.isfinite(values)
    log = wants_powers(values)
    norm = LogNorm() if log else Normalize()
    drawn = ax.scatter(at[0][good], at[1][good], c=values[good], cmap=crameri.batlow, norm=norm, **look)
    if not good.all():
        hollow = look | {"facecolors": "none", "linewidths": 0.4, "edgecolors": "0.5"}
        ax.scatter(at[0][~good], at[1][~good], **hollow)
    color_bar(drawn, ax, label, pad=0.02)
