"""Tornado pictures: how far an answer moves with each parameter, the most telling on top."""

from __future__ import annotations

import re
import textwrap
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import EngFormatter

from snapbeam.config import lookup
from snapbeam.core.validate import InputError, instance
from snapbeam.figures.style import fix_ticks, house_style, new_figure

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["plot_tornado"]

_UP, _DOWN, _TOTAL = "#B03A27", "#16245E", "#70BBF0"


def plot_tornado(dataset: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw what :func:`snapbeam.sensitivity` found, a bar a parameter, with intervals.

    Locally, bars reach from the mean answer to those with the parameter one standard score down and up; how much that
    is in the parameter's own unit stands beside its name.  Of indices, the first order and, if there is one, the total.

    Raises
    ------
    InputError
        If the dataset holds no sensitivities.
    """
    import xarray as xr

    instance("dataset", dataset, xr.Dataset, "an xarray.Dataset")
    if "parameter" not in dataset.dims or not {"effect", "first_order"} & set(map(str, dataset.variables)):
        raise InputError(f"no sensitivities among {list(map(str, dataset.variables))}")
    local = "effect" in dataset
    weight = np.abs(dataset["effect" if local else "first_order"].values)
    data = dataset.isel(parameter=np.argsort(weight, kind="stable"))
    place = np.arange(data.sizes["parameter"])
    with house_style():
        if ax is None:
            ax = new_figure("single", 28.0 + 10.0 * place.size).add_subplot()
        if local:
            _bars(data, ax, place)
        else:
            _indices(data, ax, place)
        ax.set_yticks(place, [_name(data, i, local) for i in range(place.size)])
        ax.tick_params(axis="y", length=0)
        for side in ("top", "right", "left"):
            ax.spines[side].set_visible(False)
        fix_ticks(ax)
    return ax


def _bars(data: xr.Dataset, ax: Axes, place: np.ndarray) -> None:
    middle = float(data.attrs["answer_mean"])
    half, low, high = (data[f"effect{end}"].values for end in ("", "_low", "_high"))
    for sign, color, label in ((-1.0, _DOWN, "parameter lower"), (1.0, _UP, "parameter higher")):
        ax.barh(place, sign * half, left=middle, height=0.62, color=color, label=label)
    error = np.stack([half - low, high - half])
    ax.errorbar(
        middle + half, place, xerr=error, fmt="none", ecolor="black", elinewidth=0.8, capsize=2.0,
        label=f"{100.0 * float(data.attrs['confidence']):g} % interval",
    )  # fmt: skip
    ax.axvline(middle, color="black", linewidth=0.6)
    unit = str(data.attrs["answer_units"])
    words = str(data.attrs["answer"]).replace("omega_1", r"$\omega_1$")
    text = f"{words[:1].upper()}{words[1:]}{'' if unit == '1' else f' ({unit})'}"
    ax.set_xlabel(textwrap.fill(text, 40))
    ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, borderaxespad=0.2, columnspacing=0.9)


def _indices(data: xr.Dataset, ax: Axes, place: np.ndarray) -> None:
    both = "total_order" in data
    height = 0.36 if both else 0.62
    kinds = [("first_order", _DOWN, "first order", 0.19 if both else 0.0)]
    kinds += [("total_order", _TOTAL, "total", -0.19)] if both else []
    for name, color, label, shift in kinds:
        value, low, high = (data[f"{name}{end}"].values for end in ("", "_low", "_high"))
        ax.barh(place + shift, value, height=height, color=color, label=label)
        ax.errorbar(
            value, place + shift, xerr=np.stack([value - low, high - value]), fmt="none", ecolor="black",
            elinewidth=0.8, capsize=2.0,
        )  # fmt: skip
    ax.axvline(0.0, color="black", linewidth=0.6)
    ax.set_xlabel(f"Share of the variance: {data.attrs['answer']}")
    ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, borderaxespad=0.2)


def _name(data: xr.Dataset, at: int, local: bool) -> str:
    """What stands beside a bar: the parameter and, locally, how much it is moved by, in its own unit."""
    name = str(data["parameter"].values[at])
    row = lookup(name)
    section, _, text = name.partition(".")
    text = text.replace("_", " ")
    if section == "contact":
        text = f"contact {text}"
    if not local:
        return text
    step = float(data["step"][at])
    if row.quantity.unit == "1":
        return f"{text}\n± {step:.2g}"
    unit = re.sub(r"\^([\d.]+)", r"$^{\1}$", row.quantity.unit)
    return f"{text}\n± {EngFormatter(unit, places=1)(step)}"
