"""Probabilities over one parameter, with their interval, or over two, with contours of equal probability."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from cmcrameri import cm
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm
from matplotlib.lines import Line2D

from snapbeam.core.codes import ResponseClass
from snapbeam.core.validate import InputError, instance, shown
from snapbeam.figures.axes import dress, edges_of, is_geometric, positions
from snapbeam.figures.style import CLASS_COLORS, fix_ticks, house_style, new_figure

if TYPE_CHECKING:
    import xarray as xr

    from snapbeam.lab.compare.dots import MeasuredPoints

__all__ = ["plot_probability"]

_LEVELS = (0.05, 0.5, 0.95)
_WORDS = {
    "snap": "P(snap-through)",
    "continuous": "P(continuous snap-through)",
    "first_well": "P(ends in the first well)",
    "other_well": "P(ends in the other well)",
}
_LINES = (("#B03A27", "-"), ("#16245E", "--"), ("#4C97C8", "-."), ("#000000", ":"))
_DASHES: dict[float, Any] = {0.05: ":", 0.5: "-", 0.95: "--"}


def plot_probability(
    dataset: xr.Dataset,
    outcome: str = "snap",
    ax: Axes | None = None,
    *,
    dots: MeasuredPoints | None = None,
    levels: tuple[float, ...] = _LEVELS,
) -> Axes:
    """Draw a probability map of one outcome.

    Over two parameters colours say the probability, in tenths, and lines where it passes *levels*; points whose
    interval is wider than was asked for have a small cross.  Over one parameter the line has its interval as a band.

    Parameters
    ----------
    dataset : xarray.Dataset
        Of :func:`snapbeam.probability_map` over one or two parameters.
    outcome : str
    ax : matplotlib.axes.Axes, optional
    dots : Dots, optional
        Measured responses to lay over it, in the colours of their classes.
    levels : tuple of float
        Probabilities, increasing, each in (0, 1).

    Raises
    ------
    InputError
        If the dataset holds no such map.
    """
    import xarray as xr

    instance("dataset", dataset, xr.Dataset, "an xarray.Dataset")
    if "probability" not in dataset or "outcome" not in dataset["probability"].dims:
        raise InputError(f"no probabilities among {list(map(str, dataset.variables))}")
    known = [str(name) for name in dataset["outcome"].values]
    if outcome not in known:
        raise InputError(f"outcome = {shown(outcome)}: must be one of {', '.join(known)}")
    data = dataset.sel(outcome=outcome)
    dims = [str(name) for name in data["probability"].dims if data.sizes[name] > 1]
    data = data.squeeze()
    if not 1 <= len(dims) <= 2 or "point" in dims:
        raise InputError(f"probability over {dims}: is drawn over one or two parameters")
    with house_style():
        if ax is None:
            ax = new_figure("single", 72.0).add_subplot()
        if len(dims) == 1:
            _line(data, ax, dims[0], outcome, levels)
        else:
            _cells(data, ax, dims, outcome, levels)
        if dots is not None and len(dims) == 2:
            _lay_dots(ax, dims, dots)
        fix_ticks(ax)
    return ax


def _line(data: xr.Dataset, ax: Axes, name: str, outcome: str, levels: tuple[float, ...]) -> None:
    x, _ = positions(data, name)
    low, high = data["probability_low"].values, data["probability_high"].values
    for level in levels:
        ax.axhline(level, color="0.75", linewidth=0.6, zorder=0)
    share = 100.0 * float(data.attrs.get("confidence", 0.95))
    ax.fill_between(x, low, high, color="#16245E", alpha=0.25, linewidth=0.0, label=f"{share:g} % interval")
    ax.plot(
        x, data["probability"].values, color="#16245E", marker="o", markersize=2.2, label="share of the runs"
    )
    ax.set(ylim=(-0.02, 1.02), ylabel=_WORDS.get(outcome, outcome))
    ax.legend(loc="best")
    dress(ax.xaxis, data, name)


def _cells(data: xr.Dataset, ax: Axes, dims: list[str], outcome: str, levels: tuple[float, ...]) -> None:
    values = data["probability"].transpose(dims[1], dims[0]).values
    edges = [edges_of(data, name) for name in dims]
    colors = cm.davos_r.resampled(10)
    cells = ax.pcolormesh(
        *edges, values, cmap=colors, norm=BoundaryNorm(np.linspace(0.0, 1.0, 11), 10), rasterized=True
    )
    figure = ax.get_figure()
    assert figure is not None
    bar = figure.colorbar(cells, ax=ax, label=_WORDS.get(outcome, outcome), ticks=np.linspace(0.0, 1.0, 6))
    bar.ax.tick_params(labelsize=7, width=0.6)
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
        marks = ax.scatter(
            x[wide[:, 1]],
            y[wide[:, 0]],
            marker="x",
            s=8,
            color="0.35",
            linewidths=0.6,
            label="wider than asked",
        )
        handles.append(marks)
    dress(ax.xaxis, data, dims[0])
    dress(ax.yaxis, data, dims[1])
    for at, axis in ((0, ax.set_xlim), (1, ax.set_ylim)):
        axis(edges[at][0], edges[at][-1]) if not is_geometric(edges[at]) else None
    if handles:
        ax.legend(handles=handles, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, borderaxespad=0.2)


def _lay_dots(ax: Axes, dims: list[str], dots: MeasuredPoints) -> None:
    for kind in ResponseClass:
        own = dots.response_class == kind
        if own.any():
            ax.scatter(
                getattr(dots, dims[0])[own], getattr(dots, dims[1])[own], s=12, color=CLASS_COLORS[kind],
                edgecolors="black", linewidths=0.5, zorder=3, label=kind.label,
            )  # fmt: skip
