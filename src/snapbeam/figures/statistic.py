"""Maps of a statistic, such as the peak force or the striker's work, over one or two axes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import cmcrameri.cm as crameri
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm, Normalize
from numpy.typing import NDArray

from snapbeam.core.kinds import checked
from snapbeam.core.prefixes import scale_of
from snapbeam.core.validate import InputError, instance, shown
from snapbeam.engines.outcomes import STATISTICS
from snapbeam.figures.axes import dress, edges_of, positions
from snapbeam.figures.response_map import UPWARD, subtitle
from snapbeam.figures.style import BEAM_COLOR, fix_ticks, house_style, new_figure

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["plot_statistic", "scaled_values", "wants_powers"]

_Array = NDArray[np.float64]

_DECADES = 300.0
"""Greatest over least value, from which colours go by powers of ten."""


@checked
def plot_statistic(
    dataset: xr.Dataset, name: str, ax: Axes | None = None, *, log: bool | None = None
) -> Axes:
    """Draw a statistic of a map: colours over two axes, a curve over one, coloured dots of a list of points.

    Cells of runs that failed, or that have none of it, are grey.

    Parameters
    ----------
    dataset : xarray.Dataset
        A map.
    name : str
        One of :data:`snapbeam.STATISTICS`, or any other variable over the axes.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure one column wide by default.
    log : bool, optional
        Whether colours, or the axis, go by powers of ten; by default where the values span more than two of them.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    InputError
        If there is no such variable, or it is over more than two axes.
    """
    import xarray as xr

    instance("dataset", dataset, xr.Dataset, "an xarray.Dataset")
    if instance("name", name, str, "text") not in dataset:
        raise InputError(f"variable = {shown(name)}: the map has {', '.join(map(str, dataset.data_vars))}")
    if dataset[name].dims == ("point",):
        from snapbeam.figures.point_list import plot_points

        return plot_points(dataset, name, ax)
    values = dataset[name].squeeze()
    dims = [str(each) for each in values.dims]
    if not 1 <= len(dims) <= 2 or "point" in dims:
        sizes = ", ".join(f"{key} {size}" for key, size in values.sizes.items()) or "none"
        raise InputError(
            f"a statistic is drawn over one or two axes; this one has {sizes}: select one point of the others, as with "
            "dataset.isel(location=0)"
        )
    scaled, label = scaled_values(dataset, name)
    data = values.copy(data=scaled.reshape(values.shape))
    if log is None:
        log = wants_powers(scaled)
    with house_style():
        if ax is None:
            ax = new_figure("single", 74.0).add_subplot()
        fix_ticks(ax)
        if len(dims) == 1:
            points, _ = positions(dataset, dims[0])
            ax.plot(points, data.values, ".-", color=BEAM_COLOR, markersize=3)
            dress(ax.xaxis, dataset, dims[0])
            ax.set_ylabel(label)
            ax.set_yscale("log" if log else "linear")
        else:
            upward = next((each for each in UPWARD if each in dims), dims[1])
            across = dims[0] if dims[1] == upward else dims[1]
            field = np.ma.masked_invalid(data.transpose(upward, across).values)
            positive = scaled[scaled > 0.0]
            norm = LogNorm(positive.min(), positive.max()) if log else Normalize()
            ax.set_facecolor("0.8")
            mesh = ax.pcolormesh(
                edges_of(dataset, across), edges_of(dataset, upward), field, cmap=crameri.batlow, norm=norm,
                rasterized=field.size > 20_000,
            )  # fmt: skip
            ax.figure.colorbar(mesh, ax=ax, label=label, pad=0.02).ax.tick_params(labelsize=7)
            dress(ax.xaxis, dataset, across)
            dress(ax.yaxis, dataset, upward)
        ax.set_title(subtitle(dataset, (*dims,)), loc="left")
    return ax


def scaled_values(dataset: xr.Dataset, name: str) -> tuple[_Array, str]:
    """Values of a variable in a unit that suits them, and what stands beside them."""
    values = dataset[name].values.astype(np.float64)
    factor, label = _label(dataset, name, values)
    scaled: _Array = values / factor
    return scaled, label


def wants_powers(values: _Array) -> bool:
    """Whether values span so much that colours go by powers of ten: none negative, more than two of them."""
    good = values[np.isfinite(values)]
    positive = good[good > 0.0]
    return bool(positive.size and (good >= 0.0).all() and positive.max() > _DECADES * positive.min())


def _label(dataset: xr.Dataset, name: str, values: np.ndarray) -> tuple[float, str]:
    """What values are divided by, and what stands beside them."""
    attrs = dataset[name].attrs
    row = STATISTICS.get(name)
    words = str(attrs.get("long_name", row.long_name if row else name))
    unit = str(attrs.get("units", row.unit if row else "1"))
    words = words[:1].upper() + words[1:]
    if unit == "1":
        return 1.0, words
    factor, scaled = scale_of(values, unit)
    return factor, f"{words} ({scaled})"
