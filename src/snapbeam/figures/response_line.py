"""A map over a single axis: the class of every run as a stripe, and how far the centre moves in it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from snapbeam.figures.axes import dress, edges_of, positions
from snapbeam.figures.panels import class_cells

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["draw_response_line"]

_CURVES = ("min_center_displacement", "max_center_displacement")


def draw_response_line(ax: Axes, dataset: xr.Dataset, name: str) -> None:
    """Draw classes along the axis *name*, with the least and the greatest displacement of the centre above them."""
    points, _ = positions(dataset, name)
    edges = edges_of(dataset, name)
    kinds = dataset["response"].squeeze().values[None, :]
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
