"""Fig. 8: start positions of the shaker, and classes over its location and amplitude at three frequencies."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

import snapbeam as sb
from snapbeam.model.default_values import CYCLES, LOCATION
from snapbeam.paper.recipes.fig6 import read_measurements
from snapbeam.paper.system import legend_handles, paper_model, relative_map, shapes_along
from snapbeam.plot.style import (
    BEAM_COLOR,
    SHAKER_COLOR,
    cell_edges,
    class_cells,
    figure_legend,
    figure_style,
    fix_ticks,
    new_figure,
    panel_letters,
)
from snapbeam.sweeps.measured_points import MeasuredPoints

if TYPE_CHECKING:
    import os

    import xarray as xr
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from snapbeam.paper.recipe import Results

_Array = NDArray[np.float64]

FREQUENCY_RATIOS = (0.05, 0.625, 1.625)
OPTIONS = ("measurements",)
_SHARES = {0.625: 0.2, 1.625: 0.05}
"""Fraction of V_QS1 of the paper's dash-dot line."""
_STARTS = (0.1, 0.25, LOCATION)


def relative_amplitudes(count: int) -> _Array:
    """V/V_QS1 up to 2, closer together where the thresholds of high frequencies are."""
    return np.asarray(2.0 * (np.arange(1, count + 1) / count) ** 1.6)


def compute(results: Results) -> dict[str, xr.Dataset]:
    """Six maps; the beam is symmetric, so that half of it suffices."""
    found = {}
    for ratio in FREQUENCY_RATIOS:
        points = results.pick(8, 60)
        locations = np.linspace(0.5 / points, 0.5, points)
        relative = relative_amplitudes(results.pick(8, 60))
        for modes in (1, results.pick(4, 32)):
            # slow runs at the smallest frequency need fewer cycles for a sketch
            cycles = results.pick(4 if ratio < 0.1 else 30, CYCLES)
            what = f"fig8, Omega = {ratio:g}, N = {modes}"
            found[f"omega_{ratio:g}_modes_{modes}"] = relative_map(
                results, what, modes, ratio, locations, relative, cycles
            )
    return found


def draw_relative_map(ax: Axes, ds: xr.Dataset) -> list[Artist]:
    """Draw one map up to 2 V_QS1 with its reference lines; returns their legend entries."""
    ratio = float(ds.frequency_ratio)
    edges = cell_edges(ds.location.values, 0.0, 0.5)
    relative = cell_edges(ds.relative_amplitude.values, 0.0)
    relative[-1] = min(relative[-1], 2.0)
    static = np.zeros_like(edges)
    static[edges > 0.0] = sb.model.quasi_static_threshold(edges[edges > 0.0], ratio)
    class_cells(ax, np.broadcast_to(edges, (relative.size, edges.size)), np.outer(relative, static),
                ds.response_class.transpose("relative_amplitude", "location").values)  # fmt: skip
    x = np.linspace(0.002, 0.5, 250)
    curve = sb.model.quasi_static_threshold(x, ratio)
    lines: list[tuple[float, tuple[float, ...], str]] = [(1.0, (4, 2), r"$V_\mathrm{QS1}$")]
    if ratio in _SHARES:
        lines.append((_SHARES[ratio], (4, 1.5, 1, 1.5), "0.2 or 0.05 $V_\\mathrm{QS1}$"))
    handles: list[Artist] = []
    for share, dashes, label in lines:
        ax.plot(x, share * curve, color="white", linewidth=1.7)
        handles += ax.plot(x, share * curve, color="black", linewidth=0.9, dashes=dashes, label=label)
    ax.axvline(LOCATION, color="black", linewidth=0.6)
    ax.set(xlim=(0.0, 0.5), ylim=(0.0, 2.0 * ratio))
    ax.set_title(rf"$\Omega$ = {ratio:g}, $N$ = {int(ds.attrs['modes'])}", loc="left")
    fix_ticks(ax)
    return handles


def draw(results: Results, measurements: str | os.PathLike[str] | None = None) -> Figure:
    """The start positions, and a row of maps a frequency."""
    data = results["fig8"]
    with figure_style():
        figure = new_figure("double", 205.0)
        grid = figure.add_gridspec(4, 2, height_ratios=(0.62, 1.0, 1.0, 1.0))
        top = figure.add_subplot(grid[0, :])
        _starts(top)
        axes, handles = [], {}
        for at, ds in enumerate(data.values()):
            ax = figure.add_subplot(grid[1 + at // 2, at % 2])
            for handle in draw_relative_map(ax, ds):
                handles[handle.get_label()] = handle
            if at % 2 == 0:
                ax.set_ylabel("Velocity amplitude $V$")
            if at // 2 == 2:
                ax.set_xlabel(r"Shaker location $x_\mathrm{s}$")
                _draw_measurements(ax, read_measurements(measurements, ds), float(ds.frequency_ratio))
            axes.append(ax)
        panel_letters([top, *axes])
        kinds = np.concatenate([ds.response_class.values.ravel() for ds in data.values()])
        figure_legend(figure, [*legend_handles(kinds), *handles.values()], 3)
    return figure


def _starts(ax: Axes) -> None:
    x, shapes = shapes_along(paper_model(1))
    rest = shapes[:, 0] / shapes[:, 0].max()
    ax.plot(x, -rest, color=BEAM_COLOR, linewidth=1.4)
    ax.plot([0.0, 1.0], [0.0, 0.0], color="0.6", linewidth=0.5, dashes=(8, 3, 2, 3))
    for at, strength in zip(_STARTS, (0.35, 0.6, 1.0), strict=True):
        touch = -float(np.interp(at, x, rest))
        ax.plot([at, at], [-1.9, touch - 0.06], color=SHAKER_COLOR, alpha=strength, linewidth=4, solid_capstyle="round")
        ax.annotate(rf"$x_\mathrm{{s}}$ = {at:.3g}", (at, -1.9), (5, 2), textcoords="offset points", fontsize=7)
    ax.set(xlim=(-0.02, 1.02), ylim=(-2.0, 0.3))
    ax.set_axis_off()


def _draw_measurements(ax: Axes, measurements: MeasuredPoints | None, ratio: float) -> None:
    from snapbeam.plot.style import CLASS_COLORS

    if measurements is None:
        return
    keep = np.isfinite(measurements.location) & (np.abs(measurements.frequency_ratio - ratio) <= 0.02 * ratio)
    x, y = measurements.location[keep], measurements.velocity_amplitude[keep]
    colors = [CLASS_COLORS[sb.ResponseClass(int(kind))] for kind in measurements.response_class[keep]]
    ax.scatter(np.minimum(x, 1.0 - x), y, s=14, c=colors, edgecolors="black", linewidths=0.6, zorder=4)
