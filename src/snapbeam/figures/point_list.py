"""Lists of points, as a random sweep or a search makes them: a dot for each, over two of their parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import cmcrameri.cm as crameri
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis, XAxis
from matplotlib.colors import LogNorm, Normalize
from numpy.typing import NDArray

from snapbeam.core.codes import ResponseClass
from snapbeam.core.kinds import checked
from snapbeam.core.validate import InputError, instance, shown
from snapbeam.figures.axes import axis_label
from snapbeam.figures.response_map import UPWARD, class_handles, draw_dots, draw_threshold_line, subtitle
from snapbeam.figures.statistic import scaled_values, wants_powers
from snapbeam.figures.style import CLASS_COLORS, fix_ticks, house_style, new_figure
from snapbeam.lab.compare.dots import MeasuredPoints

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["plot_points"]

_AREA = 2600.0
"""Square points of ink that all dots together take, about; each has between the two below."""
_SMALLEST, _LARGEST = 2.0, 22.0
_PAPER = (
    ("frequency_ratio", "velocity_amplitude"),
    ("location", "velocity_amplitude"),
    ("frequency_ratio", "location"),
)
_SHARE = 0.04
"""Room beyond the outermost dots, as a share of the axis."""


@checked
def plot_points(
    dataset: xr.Dataset,
    name: str = "response_class",
    ax: Axes | None = None,
    *,
    across: str | None = None,
    upward: str | None = None,
    dots: MeasuredPoints | None = None,
    threshold_line: bool = False,
    legend: bool = True,
) -> Axes:
    """Draw the response class, or a statistic, of each point of a list where its own values stand.

    Parameters
    ----------
    dataset : xarray.Dataset
        What :func:`snapbeam.sweep` made of a list of points: variables over ``point``, parameters as coordinates.
    name : str
        ``"response_class"``, one of :data:`snapbeam.STATISTICS`, or any other variable over the points.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure one column wide by default.
    across, upward : str, optional
        Parameters along the axes; by default two of those that differ, velocity amplitude or location upward.
    dots, threshold_line
        Measured responses and V_QS1, as :func:`plot_response_map` draws them; they need axes, and values common to all
        points, of the paper's coordinates.
    legend : bool
        Whether to say below what the colours mean, and how many of the points have each class.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    InputError
        If the dataset is no list of points, or its points have no such variable or parameters.
    """
    import xarray as xr

    instance("dataset", dataset, xr.Dataset, "an xarray.Dataset")
    if instance("name", name, str, "text") not in dataset.data_vars or dataset[name].dims != ("point",):
        named = [str(key) for key, item in dataset.data_vars.items() if item.dims == ("point",)]
        raise InputError(f"variable = {shown(name)}: the points have {', '.join(named) or 'no variables'}")
    along = _along(dataset, across, upward)
    of_class = name == "response_class"
    with house_style():
        own = new_figure("single", 92.0 if of_class and legend else 74.0) if ax is None else None
        if own is not None:
            ax = own.add_subplot()
        assert ax is not None
        fix_ticks(ax)
        at = [_place(axis, dataset, each) for axis, each in zip((ax.xaxis, ax.yaxis), along, strict=True)]
        size = float(np.clip(_AREA / max(at[0].size, 1), _SMALLEST, _LARGEST))
        look: dict[str, Any] = {"s": size, "linewidths": 0.2 if size > 6.0 else 0.0, "edgecolors": "black"}
        look["rasterized"] = at[0].size > 5000
        handles: list[Any] = []
        if of_class:
            kinds = dataset[name].values.astype(int)
            ax.scatter(at[0], at[1], c=[CLASS_COLORS[ResponseClass(int(kind))] for kind in kinds], **look)
            handles += class_handles(kinds)
        else:
            _statistic(ax, dataset, name, at, look)
        handles += _over(ax, dataset, along, dots, threshold_line)
        if legend and handles and own is not None:
            own.legend(handles=handles, loc="outside lower center", ncols=2)
        elif legend and handles:
            ax.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.17), ncols=2)
        ax.set_title(subtitle(dataset, along), loc="left")
    return ax


def _over(
    ax: Axes, dataset: xr.Dataset, along: tuple[str, str], dots: MeasuredPoints | None, threshold_line: bool
) -> list[Any]:
    """Draw what lies over the points; what a legend needs for it."""
    if dots is None and not threshold_line:
        return []
    if along not in _PAPER:
        raise InputError(
            "dots, threshold_line: need velocity amplitude, or location, upward over frequency or location, "
            f"not {along[1]} over {along[0]}"
        )
    fixed: dict[str, float | None] = {}
    for name in {name for pair in _PAPER for name in pair} - set(along):
        values = np.unique(dataset[name].values) if name in dataset.coords else np.empty(0)
        fixed[name] = float(values[0]) if values.size == 1 else None
    handles: list[Any] = [draw_threshold_line(ax, *along, fixed)] if threshold_line else []
    return handles if dots is None else [*handles, draw_dots(ax, dots, *along, fixed)]


def _along(dataset: xr.Dataset, across: str | None, upward: str | None) -> tuple[str, str]:
    """The names of the coordinates along the two axes."""
    names = [
        str(name)
        for name, item in dataset.coords.items()
        if item.dims == ("point",) and name != "point" and "parameter" in item.attrs
    ]
    for what, given in (("across", across), ("upward", upward)):
        if given is not None and given not in names:
            raise InputError(
                f"{what} = {shown(given)}: the points are given by {', '.join(names) or 'nothing'}"
            )
    differing = [name for name in names if np.unique(dataset[name].values).size > 1]
    free = [name for name in (*differing, *names) if name not in (across, upward)]
    if upward is None:
        upward = next((name for name in UPWARD if name in free), None) or (free[-1] if free else None)
    if across is None:
        across = next((name for name in free if name != upward), None)
    if across is None or upward is None or across == upward:
        raise InputError(
            f"points are drawn over two parameters; these are given by {', '.join(names) or 'none'}"
        )
    return across, upward


def _place(axis: Axis, dataset: xr.Dataset, name: str) -> NDArray[np.float64]:
    """Where the points stand along an axis, which is labelled; words stand side by side."""
    values = dataset[name].values
    axis.set_label_text(axis_label(dataset.drop_vars("point", errors="ignore"), name))
    if values.dtype.kind in "fiu":
        places = values.astype(np.float64)
    else:
        words, inverse = np.unique(values.astype(str), return_inverse=True)
        axis.set_ticks(np.arange(words.size).tolist(), words.tolist())
        places = inverse.astype(np.float64)
    low, high = float(places.min()), float(places.max())
    margin = _SHARE * (high - low) or 0.5
    limits = axis.axes.set_xlim if isinstance(axis, XAxis) else axis.axes.set_ylim
    limits(low - margin, high + margin)
    return places


def _statistic(
    ax: Axes, dataset: xr.Dataset, name: str, at: list[NDArray[np.float64]], look: dict[str, Any]
) -> None:
    """Dots in colours by their value; those without one are hollow."""
    values, label = scaled_values(dataset, name)
    good = np.isfinite(values)
    log = wants_powers(values)
    norm = LogNorm() if log else Normalize()
    drawn = ax.scatter(at[0][good], at[1][good], c=values[good], cmap=crameri.batlow, norm=norm, **look)
    if not good.all():
        ax.scatter(
            at[0][~good],
            at[1][~good],
            **look | {"facecolors": "none", "linewidths": 0.4, "edgecolors": "0.5"},
        )
    ax.figure.colorbar(drawn, ax=ax, label=label, pad=0.02).ax.tick_params(labelsize=7)
