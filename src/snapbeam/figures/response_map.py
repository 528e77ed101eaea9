"""The map of response types over two of frequency, amplitude and location (Figs. 6-8 of the paper)."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from snapbeam.core.codes import ResponseClass
from snapbeam.core.kinds import checked
from snapbeam.core.validate import InputError, InputTypeError, finite_array, instance
from snapbeam.figures.agreement import draw_agreement
from snapbeam.figures.axes import dress, edges_of, positions, symbol_of
from snapbeam.figures.captions import beam_text
from snapbeam.figures.panels import class_cells
from snapbeam.figures.style import CLASS_COLORS, fix_ticks, house_style, new_figure
from snapbeam.lab.compare.dots import MeasuredPoints
from snapbeam.model.galerkin.quasi_static import quasi_static_threshold

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["UPWARD", "class_handles", "draw_dots", "draw_threshold_line", "plot_response_map", "subtitle"]

_Array = NDArray[np.float64]

UPWARD = ("velocity_amplitude", "location")
"""Axes that are drawn upward rather than across, the first of them first."""

_CURVES = ("min_midspan_displacement", "max_midspan_displacement")
"""Drawn over the classes of a map over one axis."""
_NEAR = 0.02  # a measured point belongs to a map if its fixed coordinate is within this share of the map's


@checked
def plot_response_map(
    dataset: xr.Dataset,
    ax: Axes | None = None,
    *,
    dots: MeasuredPoints | None = None,
    threshold_line: bool = False,
    legend: bool = True,
) -> Axes:
    """Draw the response class of every run of a map as one cell; over one axis, with how far the centre moves.

    Cell borders lie midway between the points of an axis, the outermost as far out as the next one in (but
    not below zero, nor beyond the end of the beam).  Cells of a map with repeats are the paler the fewer
    of them agree (``class_fraction``).

    Parameters
    ----------
    dataset : xarray.Dataset
        A map with the variable ``response`` over one or two axes of more than one point, or over a list of points
        (:func:`plot_points`).
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure one column wide by default.
    dots : Dots, optional
        Measured responses, drawn as dots in the colours of their classes.  Those measured at another value
        of the map's fixed coordinate (by more than 2 %) are left out, with a warning.
    threshold_line : bool
        Whether to draw the quasi-static threshold V_QS1 of one mode (Eq. 21), dashed.
    legend : bool
        Whether to say below the map what the colours mean, and how many of the runs have each.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    InputError
        If the dataset is no map of one or two axes.
    """
    import xarray as xr

    instance("dataset", dataset, xr.Dataset, "an xarray.Dataset")
    if "response_class" in dataset and dataset["response_class"].dims == ("point",):
        from snapbeam.figures.point_list import plot_points

        return plot_points(
            dataset, "response_class", ax, dots=dots, threshold_line=threshold_line, legend=legend
        )
    if "response_class" in dataset and _is_line(dataset):
        return _line(dataset, ax, dots is not None or threshold_line, legend)
    across, upward, kinds = _two_axes(dataset)
    edges = tuple(edges_of(dataset, name) for name in (across, upward))
    fixed = {
        name: _scalar(dataset, name)
        for name in ("frequency_ratio", "location", "velocity_amplitude")
        if name not in (across, upward)
    }
    with house_style():
        own = new_figure("single", 92.0 if legend else 70.0) if ax is None else None
        if own is not None:
            ax = own.add_subplot()
        assert ax is not None
        class_cells(ax, edges[0], edges[1], kinds)
        fix_ticks(ax)
        dress(ax.xaxis, dataset, across)
        dress(ax.yaxis, dataset, upward)
        ax.set_title(subtitle(dataset, (across, upward)), loc="left")
        handles = class_handles(kinds)
        if "class_fraction" in dataset:
            handles.append(draw_agreement(ax, dataset, (across, upward), edges))
        ax.set(xlim=edges[0][[0, -1]], ylim=edges[1][[0, -1]])
        if threshold_line:
            handles.append(draw_threshold_line(ax, across, upward, fixed))
        if dots is not None:
            handles.append(draw_dots(ax, dots, across, upward, fixed))
        if legend and own is not None:
            own.legend(handles=handles, loc="outside lower center", ncols=2)
        elif legend:
            ax.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.17), ncols=2)
    return ax


def _is_line(dataset: xr.Dataset) -> bool:
    response = dataset["response_class"].squeeze()
    return response.ndim == 1 and "point" not in response.dims


def _line(dataset: xr.Dataset, ax: Axes | None, overlaid: bool, legend: bool) -> Axes:
    """A map over one axis."""
    if overlaid:
        raise InputError("dots, threshold_line: are drawn over two axes; this map has one")
    name = str(dataset["response_class"].squeeze().dims[0])
    with house_style():
        own = new_figure("single", 84.0 if legend else 62.0) if ax is None else None
        ax = own.add_subplot() if own is not None else ax
        assert ax is not None
        fix_ticks(ax)
        _draw_line(ax, dataset, name)
        ax.set_title(subtitle(dataset, (name,)), loc="left")
        handles = class_handles(dataset["response_class"].values)
        if legend and own is not None:
            own.legend(handles=handles, loc="outside lower center", ncols=2)
        elif legend:
            ax.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.2), ncols=2)
    return ax


def _draw_line(ax: Axes, dataset: xr.Dataset, name: str) -> None:
    """Draw classes along the axis *name*, with the least and the greatest displacement of the centre above them."""
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
    ax.set_ylabel("Centre displacement $w/b$,\nleast and greatest")
    ax.set(xlim=edges[[0, -1]], ylim=(low - pad, high + pad))


def _two_axes(dataset: xr.Dataset) -> tuple[str, str, NDArray[np.int8]]:
    import xarray as xr

    instance("dataset", dataset, xr.Dataset, "an xarray.Dataset")
    if "response_class" not in dataset:
        raise InputError(f"no map: it has no variable 'response' among {list(map(str, dataset.variables))}")
    response = dataset["response_class"].squeeze()
    named = [str(name) for name in response.dims]
    if len(named) != 2 or "point" in named:
        sizes = ", ".join(f"{name} {size}" for name, size in response.sizes.items()) or "none"
        raise InputError(
            f"a map is drawn over two axes of more than one point; this one has {sizes}: select one point of the "
            "others, as with dataset.isel(location=0)"
        )
    upward = next((name for name in UPWARD if name in named), named[1])
    across = named[0] if named[1] == upward else named[1]
    return across, upward, response.transpose(upward, across).values


def _scalar(dataset: xr.Dataset, name: str) -> float | None:
    return float(dataset[name].squeeze()) if name in dataset.coords and dataset[name].size == 1 else None


def subtitle(dataset: xr.Dataset, axes: tuple[str, ...]) -> str:
    """The beam, and what holds for the whole map: modes, cycles and the paper's coordinates that are no axes."""
    parts = []
    if "modes" in dataset.attrs:
        parts.append(f"$N$ = {int(dataset.attrs['modes'])}")
    if "cycles" in dataset.attrs:
        parts.append(f"{int(dataset.attrs['cycles'])} cycles")
    for name in ("frequency_ratio", "velocity_amplitude", "location"):
        value = _scalar(dataset, name)
        if name not in axes and value is not None:
            parts.append(f"{symbol_of(dataset, name)} = {value:.4g}")
    beam = "" if any(name.startswith("beam") for name in axes) else beam_text(dataset.attrs)
    return "\n".join(line for line in (beam, ", ".join(parts)) if line)


def class_handles(kinds: NDArray[np.int8] | None = None) -> list[Patch | Line2D]:
    """Return what a legend needs to say which colour is which class.

    Parameters
    ----------
    kinds : int8 array, optional
        Classes of runs, whose shares then stand beside the names; unknown ones are named if there are any.
    """
    if kinds is not None:
        try:
            shown_kinds = np.asarray(kinds, dtype=np.float64)
        except (TypeError, ValueError, OverflowError):
            raise InputTypeError("kinds: must be an array of class codes") from None
        # points that a picture leaves out are NaN in it
        kinds = finite_array("kinds", shown_kinds[shown_kinds == shown_kinds]).astype(np.int8)
    handles: list[Patch | Line2D] = []
    for kind in (*(k for k in ResponseClass if k >= 0), ResponseClass.UNKNOWN):
        count = 0 if kinds is None else int((kinds == kind).sum())
        if count or kind is not ResponseClass.UNKNOWN:
            label = kind.label if kinds is None else f"{kind.label}, {_percent(count, kinds.size)}"
            handles.append(Patch(facecolor=CLASS_COLORS[kind], edgecolor="black", linewidth=0.4, label=label))
    return handles


def _percent(count: int, total: int) -> str:
    share = 100.0 * count / max(total, 1)
    return "<0.1 %" if 0.0 < share < 0.1 else f"{share:.1f} %"


def draw_threshold_line(ax: Axes, across: str, upward: str, fixed: dict[str, float | None]) -> Line2D:
    """Draw V_QS1 of one mode (Eq. 21) over two of the paper's coordinates, the third of them fixed."""
    x = np.linspace(*ax.get_xlim(), 402)[1:-1]
    if {across, upward} - {"frequency_ratio", "location", "velocity_amplitude"}:
        raise InputError(
            f"threshold_line: is drawn over frequency ratio, location and velocity amplitude, not {across}, {upward}"
        )
    if (across, upward) == ("frequency_ratio", "location"):
        height = np.linspace(*ax.get_ylim(), 402)[1:-1]
        line = _given(fixed, "velocity_amplitude") / quasi_static_threshold(height, 1.0), height
    elif across == "location":
        line = x, quasi_static_threshold(x, _given(fixed, "frequency_ratio"))
    else:
        line = x, quasi_static_threshold(_given(fixed, "location"), x)
    ax.plot(*line, color="white", linewidth=1.8)
    label = r"quasi-static, $V_\mathrm{QS1}$"
    return ax.plot(*line, color="black", linewidth=0.9, dashes=(4, 2), label=label)[0]


def _given(fixed: dict[str, float | None], name: str) -> float:
    value = fixed[name]
    if value is None:
        raise InputError(f"threshold_line: needs the map's {name}, which the dataset does not say")
    return value


def draw_dots(
    ax: Axes, dots: MeasuredPoints, across: str, upward: str, fixed: dict[str, float | None]
) -> Line2D:
    """Draw measured responses over a map, those at other values of its fixed coordinates left out with a warning."""
    keep = np.ones(len(dots), dtype=bool)
    for name, value in fixed.items():
        there = getattr(dots, name)
        if value is not None:
            keep &= np.isnan(there) | (np.abs(there - value) <= _NEAR * abs(value))
    for name in (across, upward):
        keep &= ~np.isnan(getattr(dots, name))
    if not keep.all():
        named = ", ".join(f"{name} = {value:.4g}" for name, value in fixed.items() if value is not None)
        warnings.warn(
            f"{int((~keep).sum())} of {len(dots)} measured points do not belong to {named} and are left out",
            stacklevel=3,
        )
    colors = [CLASS_COLORS[ResponseClass(int(kind))] for kind in dots.response_class[keep]]
    where = getattr(dots, across)[keep], getattr(dots, upward)[keep]
    outside = (
        (where[0] < ax.get_xlim()[0])
        | (where[0] > ax.get_xlim()[1])
        | (where[1] < ax.get_ylim()[0])
        | (where[1] > ax.get_ylim()[1])
    )
    if outside.any():
        warnings.warn(
            f"{int(outside.sum())} of {len(dots)} measured points lie outside the map", stacklevel=3
        )
    ax.scatter(*where, s=26, c="white", linewidths=0.0, zorder=3)
    ax.scatter(*where, s=14, c=colors, edgecolors="black", linewidths=0.6, zorder=4)
    return Line2D(
        [], [], linestyle="", marker="o", markersize=4, markerfacecolor="white", markeredgecolor="black",
        markeredgewidth=0.6, label=f"measured, {int(keep.sum())}",
    )  # fmt: skip
