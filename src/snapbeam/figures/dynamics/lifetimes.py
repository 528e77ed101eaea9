"""Lifetimes over one parameter or two, and what still snaps over time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from cmcrameri import cm
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle

from snapbeam.core.codes import RunStatus
from snapbeam.core.kinds import checked
from snapbeam.core.validate import InputError
from snapbeam.figures.axes import dress, edges_of, positions
from snapbeam.figures.style import axes_or_new, fix_ticks, house_style

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["plot_lifetimes", "plot_survival"]

_UP = "#16245E"


@checked
def plot_lifetimes(
    dataset: xr.Dataset,
    ax: Axes | None = None,
    *,
    limits: tuple[float, float] | None = None,
    legend: bool = True,
) -> Axes:
    """Draw the lifetime of snapping: along one parameter with its interval, or over two in colours.

    Points without a lifetime are white where nothing snapped and hatched where runs snap on with no end seen.  *limits*
    are those of the colours, in cycles.

    Raises
    ------
    InputError
        If the dataset holds no lifetimes over one or two parameters.
    """
    if "lifetime" not in dataset:
        raise InputError(f"no lifetimes among {list(map(str, dataset.variables))}")
    dims = [str(name) for name in dataset["lifetime"].dims]
    if not 1 <= len(dims) <= 2 or "point" in dims:
        raise InputError(f"lifetime over {dims}: is drawn over one or two parameters")
    with house_style():
        ax = axes_or_new(ax)
        if len(dims) == 1:
            x, _ = positions(dataset, dims[0])
            low, high = dataset["lifetime_low"].values, dataset["lifetime_high"].values
            top = np.where(np.isfinite(high), high, np.nan)
            ax.fill_between(x, low, top, color=_UP, alpha=0.25, linewidth=0.0, label="interval")
            ax.plot(x, dataset["lifetime"].values, color=_UP, label="lifetime")
            ax.set_yscale("log")
            ax.set_ylabel("Lifetime of snapping (cycles)")
            ax.legend(loc="best")
            dress(ax.xaxis, dataset, dims[0])
        else:
            _lifetime_cells(dataset, ax, dims, limits, legend)
        fix_ticks(ax)
    return ax


def _lifetime_cells(
    dataset: xr.Dataset, ax: Axes, dims: list[str], limits: tuple[float, float] | None, legend: bool
) -> None:
    values = dataset["lifetime"].values.T
    known = values[np.isfinite(values) & (values > 0.0)]
    edges = [edges_of(dataset, name) for name in dims]
    if known.size:
        low, high = (float(np.quantile(known, share)) for share in (0.02, 0.98))
        norm = LogNorm(*((max(low, 1.0), max(high, low) * 1.001) if limits is None else limits))
        cells = ax.pcolormesh(*edges, values, cmap=cm.batlow, norm=norm, rasterized=True)
        figure = ax.get_figure()
        assert figure is not None
        figure.colorbar(cells, ax=ax, label="Lifetime of snapping (cycles)", extend="both")
    endless = np.isnan(values) & (dataset["runs_snapping"].values.T > 0)
    hatched: dict[str, Any] = {"facecolor": "white", "edgecolor": "0.4", "hatch": "//////", "linewidth": 0.0}
    for row, column in np.argwhere(endless):
        low, left = edges[1][row], edges[0][column]
        size = edges[0][column + 1] - left, edges[1][row + 1] - low
        ax.add_patch(Rectangle((left, low), *size, **hatched))
    if endless.any() and legend:
        ax.legend(
            handles=[Patch(**hatched, label="snaps on, no end seen")],
            loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.2,
        )  # fmt: skip
    dress(ax.xaxis, dataset, dims[0])
    dress(ax.yaxis, dataset, dims[1])


@checked
def plot_survival(
    dataset: xr.Dataset, ax: Axes | None = None, *, labels: Sequence[str] | None = None
) -> Axes:
    """Draw the share of runs that still snap over cycles, and the fitted exponential, for up to five points.

    The curve ends where nothing more can be known, the quiet cycles before the end; a ring there is the share of runs
    that were still snapping, whose lifetimes are longer than was seen.
    """
    if "last_snap" not in dataset:
        raise InputError("dataset: holds no lifetimes of starts")
    runs = dataset.transpose(..., "start")
    rows = np.atleast_2d(runs["last_snap"].values).reshape(-1, runs.sizes["start"])
    if len(rows) > 5:
        raise InputError(f"dataset: has {len(rows)} points; choose at most 5 of them")
    tau, delay = (np.atleast_1d(runs[name].values).ravel() for name in ("lifetime", "delay"))
    with house_style():
        ax = axes_or_new(ax)
        seen = float(dataset.attrs["cycles"]) - float(dataset.attrs["quiet"])
        settled = runs["final_well_proven"].values.astype(bool) | (
            runs["status"].values == int(RunStatus.EARLY_STOP)
        )
        settled = np.atleast_2d(settled).reshape(rows.shape)
        good = rows.shape[1] - np.atleast_1d(runs["runs_failed"].values).ravel()
        open_ends = False
        for i, row in enumerate(rows):
            color = cm.batlow(0.05 + 0.7 * i / max(len(rows) - 1, 1))
            lasting = (row > seen) & ~settled[i]
            times = np.sort(row[np.isfinite(row) & ~lasting])
            # a run that never snapped ended at once; one that failed is none
            share = (times.size + lasting.sum() - np.arange(1, times.size + 1)) / good[i]
            going = float(lasting.sum() / good[i])
            if going > 0.0:
                open_ends = True
                last = max(seen, times[-1]) if times.size else seen
                times, share = np.append(times, last), np.append(share, going)
                ax.plot(last, going, "o", color=color, markerfacecolor="white", markersize=4.0, zorder=4)
            alone = f"{row.size} runs" if len(rows) == 1 else f"point {i + 1}"
            name = labels[i] if labels is not None else alone
            ax.step(np.append(0.0, times), np.append(1.0, share), where="post", color=color, label=name)
            if np.isfinite(tau[i]) and np.isfinite(delay[i]):
                begun = float((row > delay[i]).sum() / good[i])
                t = np.linspace(delay[i], times[-1], 200)
                ax.plot(
                    t, begun * np.exp(-(t - delay[i]) / tau[i]), color=color, dashes=(4, 2), linewidth=0.7
                )
        ax.set(
            xlabel="Cycles",
            ylabel="Share of runs still snapping",
            yscale="log",
            ylim=(0.6 / rows.shape[1], 1.3),
        )
        ax.set_xlim(left=0.0)
        handles, _ = ax.get_legend_handles_labels()
        handles.append(Line2D([], [], color="0.3", dashes=(4, 2), linewidth=0.7, label="fitted"))
        if open_ends:
            ring = Line2D(
                [], [], linestyle="none", marker="o", color="0.3", markerfacecolor="white", markersize=4.0,
                label="still snapping",
            )  # fmt: skip
            handles.append(ring)
        ax.legend(handles=handles, loc="best", handlelength=1.0, fontsize=6)
        fix_ticks(ax)
    return ax
