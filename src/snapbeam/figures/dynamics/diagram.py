"""Bifurcation diagrams, with the orbits that branches follow."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from snapbeam.core.kinds import checked
from snapbeam.core.validate import InputError
from snapbeam.figures.axes import dress
from snapbeam.figures.style import axes_or_new, fix_ticks, house_style

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["plot_diagram"]

_UP, _DOWN, _LINE = "#16245E", "#B03A27", "#000000"
_STARTS = "#8A8A8A"
_EVENTS = {"fold": "s", "flip": "D", "Neimark-Sacker": "o", "branch point": "^", "grazing": "x"}


@checked
def plot_diagram(
    dataset: xr.Dataset | None,
    ax: Axes | None = None,
    *,
    branches: Sequence[xr.Dataset] = (),
    variable: str = "midspan_displacement",
) -> Axes:
    """Draw a bifurcation diagram, swept up and down, with branches of orbits over it.

    Parameters
    ----------
    dataset : xarray.Dataset, optional
        Of :func:`snapbeam.bifurcation_diagram`.
    branches : sequence of xarray.Dataset
        Of :meth:`snapbeam.Branch.to_dataset`: stable solid, unstable dashed, events as marks.
    variable : str
        What is drawn of the diagram; branches have ``midspan_displacement`` alone, at every return.

    Raises
    ------
    InputError
        If there is nothing to draw, or branches are asked for beside another variable.
    """
    if dataset is None and not branches:
        raise InputError("dataset: give a diagram or at least one branch")
    if branches and variable != "midspan_displacement":
        raise InputError(
            f"variable = {variable!r}: branches have midspan_displacement alone; draw one or the other"
        )
    first = dataset if dataset is not None else branches[0]
    along = str(first.attrs.get("along", ""))
    with house_style():
        ax = axes_or_new(ax, "double", 84.0)
        handles: list[Line2D] = []
        if dataset is not None:
            if variable not in dataset:
                raise InputError(f"no {variable} among {list(map(str, dataset.variables))}")
            handles += _points(dataset, ax, along, variable)
            dress(ax.xaxis, dataset, along)
        for branch in branches:
            handles += _branch(branch, ax, along)
        if dataset is None:
            dress(ax.xaxis, branches[0].swap_dims(orbit=along).drop_duplicates(along), along)
        words = {"midspan_displacement": "Centre displacement once a period, over $b$"}
        ax.set_ylabel(words.get(variable, variable.replace("_", " ")))
        unique = {handle.get_label(): handle for handle in handles}
        ax.legend(handles=list(unique.values()), loc="best", ncols=2)
        fix_ticks(ax)
    return ax


def _points(dataset: xr.Dataset, ax: Axes, along: str, variable: str) -> list[Line2D]:
    handles = []
    colors = {"up": _UP, "down": _DOWN}
    sweeps = [str(name) for name in dataset["sweep"].values]
    for name in sorted(sweeps, key=lambda each: each in colors):
        part = dataset[variable].isel(sweep=sweeps.index(name)).transpose(along, "period")
        x = np.repeat(dataset[along].values, part.sizes["period"])
        size = 1.1 if name == "down" else 2.0
        color = colors.get(name, _STARTS)
        ax.plot(x, part.values.ravel(), ",", color=color, alpha=0.9, rasterized=True)
        ax.plot(
            x, part.values.ravel(), ".", color=color, markersize=size, markeredgewidth=0.0, rasterized=True
        )
        text = {"up": "swept up", "down": "swept down"}.get(name, "from many starts")
        handles.append(Line2D([], [], marker=".", linestyle="", color=color, label=text))
    return handles


def _branch(branch: xr.Dataset, ax: Axes, along: str) -> list[Line2D]:
    x, stable = branch[along].values, branch["stable"].values
    returns = branch["center_returns"].transpose("return", "orbit").values
    # up to the stable orbits beside them, so that no gap is left
    beside = ~stable | np.append(~stable[1:], False) | np.append(False, ~stable[:-1])
    for y in returns:
        ax.plot(x, np.where(stable, y, np.nan), color=_LINE, linewidth=1.1)
        ax.plot(x, np.where(beside, y, np.nan), color=_LINE, linewidth=0.9, dashes=(3, 2))
    handles = [
        Line2D([], [], color=_LINE, linewidth=1.1, label="stable orbit"),
        Line2D([], [], color=_LINE, linewidth=0.9, dashes=(3, 2), label="unstable orbit"),
    ]
    for kind, value, after in zip(
        branch["event_kind"].values, branch["event_value"].values, branch["event_after"].values, strict=True
    ):
        at = int(after)
        near = returns[:, at : at + 2].mean(axis=1)
        mark = _EVENTS[str(kind)]
        ax.plot(
            np.full(near.size, value),
            near,
            mark,
            color=_LINE,
            markersize=3.5,
            markerfacecolor="white",
            linestyle="",
        )
        handles.append(
            Line2D(
                [],
                [],
                marker=mark,
                linestyle="",
                color=_LINE,
                markersize=3.5,
                markerfacecolor="white",
                label=str(kind),
            )
        )
    return handles
