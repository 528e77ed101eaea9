"""Quantile thresholds over one parameter: lines with their intervals as bands."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from snapbeam.core.validate import InputError, instance
from snapbeam.figures.axes import dress, positions, symbol_of
from snapbeam.figures.style import fix_ticks, house_style, new_figure
from snapbeam.model.galerkin.quasi_static import quasi_static_threshold

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["plot_quantiles"]

_STYLES = (
    ("#4C97C8", ":"),
    ("#B03A27", "-"),
    ("#16245E", "--"),
    ("#6E8B2F", "-."),
    ("#000000", (0, (1, 1, 5, 1))),
)


def plot_quantiles(dataset: xr.Dataset, ax: Axes | None = None, *, quasi_static: bool = False) -> Axes:
    """Draw what :func:`snapbeam.quantile_threshold` found over one parameter.

    A line a probability with its interval as a band; a cross where the probability is seen to fall somewhere, so that
    the threshold is not one.

    Parameters
    ----------
    dataset : xarray.Dataset
    ax : matplotlib.axes.Axes, optional
    quasi_static : bool
        Whether to draw V_QS1 (Eq. 21) too, over frequency ratio or location.

    Raises
    ------
    InputError
        If the dataset holds no such thresholds, or those over more than one parameter.
    """
    import xarray as xr

    instance("dataset", dataset, xr.Dataset, "an xarray.Dataset")
    if "threshold" not in dataset or "quantile" not in dataset["threshold"].dims:
        raise InputError(f"no quantile thresholds among {list(map(str, dataset.variables))}")
    data = dataset.squeeze([name for name in dataset["monotone"].dims if dataset.sizes[name] == 1])
    dims = [str(name) for name in data["monotone"].dims]
    if len(dims) != 1 or "point" in dims:
        raise InputError(f"thresholds over {dims}: are drawn over one parameter")
    if data.sizes["quantile"] > len(_STYLES):
        raise InputError(
            f"dataset: has {data.sizes['quantile']} lines; at most {len(_STYLES)} can be told apart"
        )
    along, raised = dims[0], str(data.attrs["along"])
    bottom, top = (float(each) for each in data.attrs["between"])
    x, _ = positions(data, along)
    with house_style():
        if ax is None:
            ax = new_figure("single", 70.0).add_subplot()
        for level, (color, dashes) in zip(data["quantile"].values, _STYLES, strict=False):
            one = data.sel(quantile=level)
            low, high = (np.clip(one[f"threshold_{end}"].values, bottom, top) for end in ("low", "high"))
            ax.fill_between(x, low, high, color=color, alpha=0.22, linewidth=0.0)
            ax.plot(
                x,
                one["threshold"].values,
                linestyle=dashes,
                color=color,
                linewidth=1.1,
                label=f"P = {level:g}",
            )
        if quasi_static:
            _quasi_static(data, ax, along, x)
        falls = ~data["monotone"].values
        if falls.any():
            middle = data["threshold"].sel(quantile=0.5, method="nearest").values
            ax.plot(x[falls], middle[falls], "x", color="black", markersize=4, label="not monotone")
        fix_ticks(ax)
        dress(ax.xaxis, data, along)
        symbol = symbol_of(data, raised)
        ax.set(xlim=x[[0, -1]], ylabel=f"Threshold of {symbol}")
        reach = np.nanmax(np.where(np.isfinite(data["threshold_high"]), data["threshold_high"], np.nan))
        ax.set_ylim(min(0.0, bottom), min(top, 1.08 * float(reach)) if np.isfinite(reach) else top)
        share = 100.0 * float(data.attrs.get("confidence", 0.95))
        ax.set_title(f"{int(data['runs'].max())} runs a point, {share:g} % bands", loc="left")
        ax.legend(loc="best")
    return ax


def _quasi_static(data: xr.Dataset, ax: Axes, along: str, x: np.ndarray) -> None:
    if along not in ("location", "frequency_ratio"):
        raise InputError(f"quasi_static over {along}: is known over location and frequency_ratio")
    place = x if along == "location" else float(data["location"])
    ratio = x if along == "frequency_ratio" else float(data["frequency_ratio"])
    line = quasi_static_threshold(place, ratio)
    ax.plot(x, line, color="black", linewidth=0.8, dashes=(4, 2), label=r"quasi-static, $V_\mathrm{QS1}$")
