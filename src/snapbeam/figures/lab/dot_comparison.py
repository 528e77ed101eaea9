"""Measured responses on a simulated map, those that disagree marked, with a table of the classes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from snapbeam.figures.response_map import plot_response_map
from snapbeam.figures.style import fix_ticks, house_style, new_figure
from snapbeam.lab.compare.dots import MeasuredPoints

if TYPE_CHECKING:
    import xarray as xr

    from snapbeam.lab.compare.maps import DotComparison

__all__ = ["plot_dot_comparison"]

_DRAWN = ("frequency_ratio", "location", "velocity_amplitude")  # across first, then upward


def plot_dot_comparison(dataset: xr.Dataset, dots: MeasuredPoints, result: DotComparison) -> Figure:
    """Draw measured responses on a map, and the table of measured against simulated classes beside it.

    Dots whose class is not that of the map are crossed out.  In the table what agrees is grey, on the diagonal,
    and what does not is red and bold, each the darker the greater its share of the measured class is.
    """
    with house_style():
        figure = new_figure("double", 92.0)
        grid = figure.add_gridspec(1, 2, width_ratios=(1.15, 1.0))
        left = plot_response_map(dataset, figure.add_subplot(grid[0]), dots=dots)
        _mark_disagreeing(left, dataset, result)
        ax = figure.add_subplot(grid[1])
        _confusion(ax, result.confusion)
        names = [kind.label.replace(" interwell", "\ninterwell") for kind in result.classes]
        ax.set_xticks(np.arange(len(names)), names, rotation=40, ha="right", rotation_mode="anchor")
        ax.set_yticks(np.arange(len(names)), names)
        ax.set(xlabel="Simulated", ylabel="Measured")
        low, high = result.agreement_interval
        ax.set_title(
            f"{100 * result.agreement:.0f} % of {result.used} agree, × do not\n"
            f"(95 %: {100 * low:.0f} to {100 * high:.0f} %)"
            if result.used
            else "No measured point counts",
            loc="left",
        )
        fix_ticks(ax)
    return figure


def _confusion(ax: Axes, counts: NDArray[np.int64]) -> None:
    """Counts of measured (rows) and simulated classes (columns), agreements and errors in two colours."""
    share = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    right = np.eye(len(counts), dtype=bool)
    for cells, colors in ((right, "Greys"), (~right, "Reds")):
        # a single error is seen too: shades begin at a quarter
        shade = np.ma.masked_where(~cells | (counts == 0), 0.25 + 0.6 * share)
        ax.imshow(shade, cmap=colors, vmin=0.0, vmax=1.0, origin="upper")
    for (i, j), value in np.ndenumerate(counts):
        error = i != j and value > 0
        color = "0.6" if value == 0 else "white" if share[i, j] > 0.6 else "black"
        weight = "bold" if error else "normal"
        ax.text(j, i, str(value), ha="center", va="center", color=color, fontweight=weight)
    ax.set_xticks(np.arange(-0.5, len(counts)), minor=True)
    ax.set_yticks(np.arange(-0.5, len(counts)), minor=True)
    ax.grid(which="minor", color="white", linewidth=1.0)
    ax.tick_params(which="minor", length=0)


def _mark_disagreeing(ax: Axes, dataset: xr.Dataset, result: DotComparison) -> None:
    """Cross out the dots that count and whose class is not that of the map."""
    table = result.table
    wrong = (table["used"].values == 1) & (table["measured"].values != table["simulated"].values)
    if not wrong.any():
        return
    across, upward = (name for name in _DRAWN if name in dataset["response_class"].squeeze().dims)
    ax.plot(
        table[across].values[wrong], table[upward].values[wrong], "x", color="black", markersize=8.5,
        markeredgewidth=1.1, zorder=2.9,
    )  # fmt: skip
