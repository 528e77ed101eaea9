"""The waveform of one run: who is where, how deep they meet, how hard they push (Fig. 3 of the paper)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.gridspec import GridSpec

from snapbeam.core.validate import InputError, finite
from snapbeam.figures.style import BEAM_COLOR, CENTER_COLOR, SHAKER_COLOR, fix_ticks, house_style, new_figure
from snapbeam.runs.schema import check_trajectory

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["plot_run"]

_CURVES = (
    ("center_displacement", "beam, centre", CENTER_COLOR),
    ("displacement", "beam, at the shaker", BEAM_COLOR),
    ("shaker_displacement", "shaker", SHAKER_COLOR),
)
_MANY = 20_000  # samples above which a curve is stored as pixels in a vector file


def plot_run(dataset: xr.Dataset, window: tuple[float, float] | None = None) -> Figure:
    """Draw the displacements, the penetration and the contact force of a run, and its hardest impact closer.

    Left, over cycles of excitation: the whole run or a window.  Right, over milliseconds: the samples about
    the greatest contact force within the window, from a little before the contact to a little after it.  A
    measured run, which has no force, is drawn without what it lacks.

    Parameters
    ----------
    dataset : xarray.Dataset
        A run that follows :data:`snapbeam.runs.schema.SCHEMA`.
    window : pair of float, optional
        First and last cycle to draw; everything by default.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the dataset is no run or the window holds less than two samples.
    """
    check_trajectory(dataset, require=("displacement",))
    across = "cycle" if "cycle" in dataset.variables else "time"
    part = _cut(dataset, across, window)
    has_force = "contact_force" in part and bool((part["contact_force"] > 0.0).any())
    rows = 1 + ("penetration" in part) + ("contact_force" in part)
    with house_style():
        figure = new_figure("double", 35.0 + 28.0 * rows)
        grid = figure.add_gridspec(
            rows, 2 if has_force else 1, width_ratios=(2.2, 1.0) if has_force else None,
            height_ratios=(1.6, 1.0, 1.0)[:rows],
        )  # fmt: skip
        left = _column(figure, grid, 0, part, part[across].values, rows)
        left[-1].set_xlabel(r"Cycles of excitation $\tau$" if across == "cycle" else "Time (s)")
        left[0].set_xlim(float(part[across][0]), float(part[across][-1]))
        left[0].set_ylabel("Displacement $w$ ($b$)")
        handles, labels = left[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=3)
        figure.align_ylabels(left)
        if has_force:
            near, milliseconds, peak = _hardest_impact(part)
            right = _column(figure, grid, 1, near, milliseconds, rows)
            right[-1].set_xlabel(
                f"Time after $\\tau$ = {peak:.4g} (ms)" if across == "cycle" else "Time (ms)"
            )
            right[0].set_xlim(milliseconds[0], milliseconds[-1])
    return figure


def _cut(dataset: xr.Dataset, across: str, window: tuple[float, float] | None) -> xr.Dataset:
    if window is None:
        return dataset
    first, last = (finite(f"window[{at}]", value) for at, value in enumerate(window))
    inside = (dataset[across].values >= first) & (dataset[across].values <= last)
    if inside.sum() < 2:
        end = float(dataset[across][-1])
        raise InputError(
            f"window = ({first:g}, {last:g}): must hold at least two samples of a run of {end:g} cycles"
        )
    return dataset.isel(time=inside)


def _column(
    figure: Figure, grid: GridSpec, at: int, part: xr.Dataset, x: np.ndarray, rows: int
) -> list[Axes]:
    axes: list[Axes] = []
    for row in range(rows):
        axes.append(figure.add_subplot(grid[row, at], sharex=axes[0] if axes else None))
        fix_ticks(axes[-1])
        axes[-1].tick_params(labelbottom=row == rows - 1)
        axes[-1].margins(x=0.0)
    pixels = x.size > _MANY
    for name, label, color in _CURVES:
        if name in part:
            axes[0].plot(x, part[name].values, color=color, label=label, rasterized=pixels)
    if at == 0:
        axes[0].axhline(0.0, color="0.6", linewidth=0.5, zorder=0)
    row = 1
    if "penetration" in part:
        depth = 1e3 * np.maximum(part["penetration"].values, 0.0)
        axes[row].plot(x, depth, color=BEAM_COLOR, rasterized=pixels)
        axes[row].set_ylim(bottom=0.0)
        if at == 0:
            axes[row].set_ylabel("Penetration\n$d$ ($10^{-3}\\,b$)")
        row += 1
    if "contact_force" in part:
        axes[row].plot(x, part["contact_force"].values, color=BEAM_COLOR, rasterized=pixels)
        axes[row].set_ylim(bottom=0.0)
        if at == 0:
            axes[row].set_ylabel("Contact\nforce $f$ (N)")
    return axes


def _hardest_impact(part: xr.Dataset) -> tuple[xr.Dataset, np.ndarray, float]:
    """The samples about the greatest force: the contact around it and as much again on either side."""
    force, time = part["contact_force"].values, part["time"].values
    peak = int(np.nanargmax(force))
    apart = np.flatnonzero(~(force > 0.0))
    before = apart[apart < peak]
    after = apart[apart > peak]
    start = int(before[-1]) if before.size else 0
    stop = int(after[0]) if after.size else len(force) - 1
    margin = 0.6 * (time[stop] - time[start])
    inside = (time >= time[start] - margin) & (time <= time[stop] + margin)
    near = part.isel(time=inside)
    cycle = float(part["cycle"][start]) if "cycle" in part.variables else 0.0
    return near, 1e3 * (near["time"].values - time[start]), cycle
