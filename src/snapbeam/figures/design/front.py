"""Designs that were tried, and what was found among them: a goal against another, or over a variable."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from snapbeam.core.validate import InputError, instance, shown
from snapbeam.figures.style import fix_ticks, house_style, new_figure

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["plot_designs"]

_TRIED, _BROKEN = "#4C97C8", "0.8"
_STATES = (("fails", "X", "#B03A27"), ("undecided", "D", "#C3DD8A"), ("holds", "o", "#16245E"))
_GOAL = "tried_goal_"
_DECADE = 10.0
"""Greatest over least value from which an axis is one of powers."""


def plot_designs(dataset: xr.Dataset, over: str | None = None, ax: Axes | None = None) -> Axes:
    """Draw what :func:`snapbeam.optimize_design` found: the first goal over the second, or over a variable.

    Designs that kept their limits while they were sought are small dots; those reported have the intervals of fresh
    draws, and a sign that says whether their limits hold there.

    Parameters
    ----------
    dataset : xarray.Dataset
    over : str, optional
        A variable, such as ``"location"``; the second goal by default, or the first variable if there is one goal.
    ax : matplotlib.axes.Axes, optional

    Raises
    ------
    InputError
        If the dataset holds no designs, or nothing of that name.
    """
    import xarray as xr

    instance("dataset", dataset, xr.Dataset, "an xarray.Dataset")
    if "holds" not in dataset or "tried" not in dataset.dims:
        raise InputError(f"no designs among {list(map(str, dataset.variables))}")
    names = [str(name) for name in dataset.data_vars]
    goals = [name[len(_GOAL) :] for name in names if name.startswith(_GOAL)]
    variables = [name[6:] for name in names if name.startswith("tried_") and not name.startswith(_GOAL)]
    if over is None:
        across = f"goal_{goals[1]}" if len(goals) > 1 else variables[0]
    elif over in variables:
        across = over
    else:
        raise InputError(f"over = {shown(over)}: must be one of {', '.join(variables)}")
    up = f"goal_{goals[0]}"
    with house_style():
        if ax is None:
            ax = new_figure("single", 74.0).add_subplot()
        x, y = dataset[f"tried_{across}"].values, dataset[f"tried_{up}"].values
        kept = (dataset["violation"].values == 0.0) & np.isfinite(y)
        ax.scatter(x[kept], y[kept], s=4, color=_TRIED, linewidths=0.0, label="tried, limits kept")
        for code, (word, marker, color) in enumerate(_STATES):
            own = dataset["holds"].values == code
            if own.any():
                _reported(dataset, ax, across, up, own, marker, color, f"limits: {word}")
        ax.set(xlabel=_label(dataset, across), ylabel=_label(dataset, up))
        for values, scale in ((x[kept], ax.set_xscale), (y[kept], ax.set_yscale)):
            if values.size and values.min() > 0.0 and values.max() > _DECADE * values.min():
                scale("log")
        ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, borderaxespad=0.2)
        fix_ticks(ax)
    return ax


def _reported(
    dataset: xr.Dataset, ax: Axes, across: str, up: str, own: np.ndarray, marker: str, color: str, label: str
) -> None:
    x, y = dataset[across].values[own], dataset[up].values[own]
    bars = [_errors(dataset, name, own) for name in (across, up)]
    ax.errorbar(
        x, y, xerr=bars[0], yerr=bars[1], fmt=marker, color=color, markersize=5, markeredgecolor="black",
        markeredgewidth=0.5, ecolor="black", elinewidth=0.8, capsize=2.0, label=label, zorder=3,
    )  # fmt: skip


def _errors(dataset: xr.Dataset, name: str, own: np.ndarray) -> np.ndarray | None:
    if f"{name}_low" not in dataset:
        return None
    middle, low, high = (dataset[f"{name}{end}"].values[own] for end in ("", "_low", "_high"))
    found = np.stack([middle - low, high - middle])
    return np.where(np.isfinite(found), found, 0.0)


def _label(dataset: xr.Dataset, name: str) -> str:
    labels = dataset[name].attrs
    unit, words = str(labels.get("units", "1")), str(labels.get("long_name", name))
    return f"{words[:1].upper()}{words[1:]}{'' if unit == '1' else f' ({unit})'}"
