"""What is seen in the space of states: exponents, sections, basins, the state between."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from cmcrameri import cm
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.patches import Patch

from snapbeam.core.kinds import checked
from snapbeam.core.validate import InputError
from snapbeam.figures.axes import dress, edges_of, positions
from snapbeam.figures.style import axes_or_new, fix_ticks, house_style

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["plot_basins", "plot_edge", "plot_exponents", "plot_section"]

_UP, _DOWN = "#16245E", "#B03A27"
_UNDECIDED = "#858585"


@checked
def plot_exponents(dataset: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw Lyapunov exponents: how they converge over periods, or the largest over one or two parameters."""
    if "exponent" not in dataset:
        raise InputError(f"no exponents among {list(map(str, dataset.variables))}")
    dims = [str(name) for name in dataset["exponent"].dims if name != "exponent_number"]
    with house_style():
        ax = axes_or_new(ax)
        if "running" in dataset:
            period = np.arange(1, dataset.sizes["period"] + 1)
            ax.axhline(0.0, color="0.6", linewidth=0.5)
            shown = min(dataset.sizes["exponent_number"], 10)
            for number in range(shown):
                color = cm.batlow(0.85 * number / max(shown - 1, 1))
                label = rf"$\lambda_{{{number + 1}}}$"
                ax.plot(period, dataset["running"].values[:, 0, number], color=color, label=label)
            ax.legend(loc="best", ncols=2)
            ax.set(xlabel="Periods of the drive", ylabel=r"Lyapunov exponent so far (s$^{-1}$)", xscale="log")
        elif len(dims) == 1:
            x, _ = positions(dataset, dims[0])
            value = dataset["exponent"].isel(exponent_number=0).values
            error = dataset["exponent_error"].isel(exponent_number=0).values
            ax.axhline(0.0, color="0.6", linewidth=0.5)
            ax.fill_between(x, value - 2 * error, value + 2 * error, color=_UP, alpha=0.25, linewidth=0.0)
            ax.plot(x, value, color=_UP)
            ax.set_ylabel(r"Largest Lyapunov exponent (s$^{-1}$)")
            dress(ax.xaxis, dataset, dims[0])
        elif len(dims) == 2:
            value = dataset["exponent"].isel(exponent_number=0).values.T
            most = float(np.nanmax(np.abs(value))) or 1.0
            edges = [edges_of(dataset, name) for name in dims]
            cells = ax.pcolormesh(*edges, value, cmap=cm.vik, vmin=-most, vmax=most, rasterized=True)
            figure = ax.get_figure()
            assert figure is not None
            figure.colorbar(cells, ax=ax, label=r"Largest Lyapunov exponent (s$^{-1}$)")
            dress(ax.xaxis, dataset, dims[0])
            dress(ax.yaxis, dataset, dims[1])
        else:
            raise InputError(f"exponent over {dims}: is drawn over one or two parameters")
        fix_ticks(ax)
    return ax


@checked
def plot_section(dataset: xr.Dataset, ax: Axes | None = None, x: str = "midspan_displacement") -> Axes:
    """Draw a Poincare section: a displacement against its velocity."""
    y = x.replace("displacement_at_striker", "velocity_at_striker")
    if x not in dataset or y not in dataset:
        raise InputError(f"no {x} and {y} among {list(map(str, dataset.variables))}")
    with house_style():
        ax = axes_or_new(ax)
        ax.plot(
            dataset[x].values,
            dataset[y].values,
            ".",
            color=_UP,
            markersize=2.0,
            markeredgewidth=0.0,
            rasterized=True,
        )
        where = "Centre" if x.startswith("center") else "Contact point's"
        ax.set(xlabel=f"{where} displacement, over $b$", ylabel=rf"{where} velocity, over $b\,\omega_1$")
        fix_ticks(ax)
    return ax


@checked
def plot_basins(dataset: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw basins of attraction: a colour an attractor, grey where it is undecided, attractors as rings."""
    if "basin" not in dataset:
        raise InputError(f"no basins among {list(map(str, dataset.variables))}")
    names = [str(name) for name in dataset["basin"].dims]
    labels = dataset["basin"].values
    count = int(dataset["basin"].attrs["flag_values"].max()) + 1
    colors = [_UNDECIDED, *(cm.batlow(0.08 + 0.84 * i / max(count - 1, 1)) for i in range(count))]
    meanings = str(dataset["basin"].attrs["flag_meanings"]).split()
    with house_style():
        ax = axes_or_new(ax, height=84.0)
        edges = [edges_of(dataset, name) for name in names]
        norm = BoundaryNorm(np.arange(-1.5, count), count + 1)
        ax.pcolormesh(*edges, labels.T, cmap=ListedColormap(colors), norm=norm, rasterized=True)
        for points in dataset["attractor_points"].values:
            ax.plot(
                *points.T, "o", color="black", markerfacecolor="white", markersize=3.0, markeredgewidth=0.8
            )
        for axis, name in ((ax.xaxis, names[0]), (ax.yaxis, names[1])):
            axis.set_label_text(_coordinate(name))
        ax.set(xlim=edges[0][[0, -1]], ylim=edges[1][[0, -1]])
        handles = [
            Patch(
                facecolor=colors[i],
                edgecolor="black",
                linewidth=0.4,
                label=(f"{i - 1}: " if i else "") + meanings[i].replace("_", " "),
            )
            for i in range(count + 1)
            if i > 0 or (labels == -1).any()
        ]
        figure = ax.get_figure(root=True)
        assert figure is not None
        figure.legend(handles=handles, loc="outside lower center", ncols=3)
        fix_ticks(ax)
    return ax


def plot_edge(dataset: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw an edge state: the first coordinate once a period, and the unstable orbit that it settles on."""
    if "orbit_state" not in dataset or "state" not in dataset:
        raise InputError(f"no edge state among {list(map(str, dataset.variables))}")
    name = str(dataset["coordinate"].values[0])
    values = dataset["state"].values[:, 0]
    with house_style():
        ax = axes_or_new(ax)
        for at, words in ((-1.0, "well"), (0.0, "straight")):
            if name == "amplitude[1]" and values.min() - 0.3 < at < values.max() + 0.3:
                ax.axhline(at, color="0.75", linewidth=0.5, zorder=0)
                ax.annotate(
                    words, (1.0, at), (2.0, 0.0), xycoords=("axes fraction", "data"), textcoords="offset points",
                    va="center", fontsize=6, color="0.4",
                )  # fmt: skip
        period = np.arange(1, values.size + 1)
        ax.plot(
            period, values, ".-", color=_UP, linewidth=0.7, markersize=3.5, label="between the two outcomes"
        )
        points = dataset["orbit_state"].values[:, 0]
        out = int((np.hypot(dataset["multiplier_real"], dataset["multiplier_imag"]) > 1.0).sum())
        for i, point in enumerate(points):
            words = f"orbit of period {points.size}, {out} multiplier{'s' if out != 1 else ''} outside"
            ax.axhline(point, color=_DOWN, linewidth=0.9, dashes=(4, 2), label=words if i == 0 else None)
        figure = ax.get_figure(root=True)
        assert figure is not None
        figure.legend(*ax.get_legend_handles_labels(), loc="outside lower center", ncols=1)
        ax.set(xlabel="Period of the drive", ylabel=_coordinate(name))
        fix_ticks(ax)
    return ax


def _coordinate(name: str) -> str:
    """Symbol of a coordinate of a state."""
    if name.startswith("amplitude["):
        return rf"Amplitude $\alpha_{{{name[10:-1]}}}$ over that of the well"
    if name.startswith("velocity["):
        return rf"Velocity $\dot\alpha_{{{name[9:-1]}}}$ over $\omega_1$ times that amplitude"
    return name
