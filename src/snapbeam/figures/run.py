"""The waveform of one run: who is where, how deep they meet, how hard they push (Fig. 3 of the paper)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.gridspec import GridSpec

from snapbeam.core.kinds import checked
from snapbeam.core.prefixes import scale_of
from snapbeam.core.validate import InputError, finite
from snapbeam.figures.captions import caption
from snapbeam.figures.series import across as across_of
from snapbeam.figures.series import dataset_of
from snapbeam.figures.style import BEAM_COLOR, CENTER_COLOR, SHAKER_COLOR, fix_ticks, house_style, new_figure
from snapbeam.runs.run import Run

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["plot_run"]

_CURVES = (
    ("midspan_displacement", "beam, centre", CENTER_COLOR),
    ("displacement_at_striker", "beam, at the striker", BEAM_COLOR),
    ("striker_displacement", "striker", SHAKER_COLOR),
)
_MANY = 20_000  # samples above which a curve is stored as pixels in a vector file


@checked
def plot_run(
    run: Run | xr.Dataset, window: tuple[float, float] | None = None, ax: Axes | None = None
) -> Axes:
    """Draw the displacements, the penetration and the contact force of a run, and its hardest impact closer.

    Left, over cycles of excitation: the whole run or a window.  Right, over time: the samples about
    the greatest contact force within the window, from a little before the contact to a little after it.  A
    measured run, which has no force, is drawn without what it lacks.

    Parameters
    ----------
    run : Run or xarray.Dataset
        A run, or a dataset that follows :data:`snapbeam.runs.schema.SCHEMA`.
    window : pair of float, optional
        First and last cycle to draw; everything by default.
    ax : matplotlib.axes.Axes, optional
        Where to draw the displacements alone; by default a new figure of two columns holds everything.

    Returns
    -------
    matplotlib.axes.Axes
        Of the displacements.

    Raises
    ------
    InputError
        If the dataset is no run or the window holds less than two samples.
    """
    dataset = dataset_of(run, "displacement_at_striker")
    across, label = across_of(dataset)
    part = _cut(dataset, across, window)
    has_force = "contact_force" in part and bool((part["contact_force"] > 0.0).any())
    rows = 1 + ("penetration_normalised" in part) + ("contact_force" in part)
    if ax is not None:
        return _alone(ax, part, part[across].values, label)
    with house_style():
        figure = new_figure("double", 35.0 + 28.0 * rows)
        grid = figure.add_gridspec(
            rows, 2 if has_force else 1, width_ratios=(2.2, 1.0) if has_force else None,
            height_ratios=(1.6, 1.0, 1.0)[:rows],
        )  # fmt: skip
        force = scale_of(part["contact_force"].values, "N") if "contact_force" in part else (1.0, "N")
        left = _column(figure, grid, 0, part, part[across].values, force)
        left[-1].set_xlabel(label)
        first, last = float(part[across][0]), float(part[across][-1])
        left[0].set_xlim(_from(first, last), last)
        left[0].set_ylabel("Displacement $w/b$")
        handles, labels = left[0].get_legend_handles_labels()
        figure.legend(
            handles, labels, loc="outside upper left", ncols=3, title=caption(dataset), alignment="left",
            title_fontsize=7,
        )  # fmt: skip
        figure.align_ylabels(left)
        if has_force:
            near, seconds, peak = _hardest_impact(part)
            scale, unit = scale_of(seconds, "s")
            around = seconds / scale
            right = _column(figure, grid, 1, near, around, force)
            right[-1].set_xlabel(
                f"Time after $\\tau$ = {peak:.4g} ({unit})" if across == "cycle" else f"Time ({unit})"
            )
            right[0].set_xlim(min(around[0], -0.12 * around[-1]), around[-1])
    return left[0]


def _alone(ax: Axes, part: xr.Dataset, x: np.ndarray, label: str) -> Axes:
    """The displacements, on axes that somebody else made."""
    with house_style():
        for name, words, color in _CURVES:
            if name in part:
                ax.plot(x, part[name].values, color=color, label=words, rasterized=x.size > _MANY)
        ax.axhline(0.0, color="0.6", linewidth=0.5, zorder=0)
        ax.set(xlabel=label, ylabel="Displacement $w/b$", xlim=(_from(x[0], x[-1]), x[-1]))
        low, high = ax.get_ylim()
        ax.set_ylim(low, high + 0.15 * (high - low))
        ax.legend(loc="upper left", ncols=3)
        fix_ticks(ax)
    return ax


def _from(first: float, last: float) -> float:
    """Where an axis begins: a little before the start of a run, so that an impact that begins at once is seen."""
    return first if first > 0.0 else first - 0.01 * (last - first)


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
    figure: Figure, grid: GridSpec, at: int, part: xr.Dataset, x: np.ndarray, force_scale: tuple[float, str]
) -> list[Axes]:
    rows = grid.nrows
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
    if "penetration_normalised" in part:
        depth = 1e3 * np.maximum(part["penetration_normalised"].values, 0.0)
        axes[row].plot(x, depth, color=BEAM_COLOR, rasterized=pixels)
        axes[row].set_ylim(bottom=0.0)
        if at == 0:
            axes[row].set_ylabel("Penetration\n$d$ ($10^{-3}\\,b$)")
        row += 1
    if "contact_force" in part:
        factor, unit = force_scale
        axes[row].plot(x, part["contact_force"].values / factor, color=BEAM_COLOR, rasterized=pixels)
        axes[row].set_ylim(bottom=0.0)
        if at == 0:
            axes[row].set_ylabel(f"Contact\nforce $f$ ({unit})")
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
    return near, near["time"].values - time[start], cycle
