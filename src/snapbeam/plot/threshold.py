"""The threshold of the interwell response, as a band, for one or several numbers of modes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Patch
from numpy.typing import NDArray

from snapbeam.model.quasi_static import quasi_static_objection
from snapbeam.plot.axes import dress, edges_of, is_geometric, positions, symbol_of, tick_text
from snapbeam.plot.map import plot_response_map, quasi_static_along
from snapbeam.plot.style import contains, extend_title, frame
from snapbeam.plot.units import in_units, ratio_along
from snapbeam.util.status_codes import wells_of
from snapbeam.util.validation import InputError, checked

if TYPE_CHECKING:
    import xarray as xr

_Array = NDArray[np.float64]
_OPEN = "left open by failed runs"
_NEEDED = ("lower_threshold", "upper_threshold", "lower_threshold_min", "upper_threshold_max", "outcome")

_STYLES = (("#B03A27", "-"), ("#16245E", "-"), ("#4C97C8", "--"), ("#6E8B2F", "-."), ("#000000", ":"))


@checked
def plot_threshold(
    dataset: xr.Dataset, ax: Axes | None = None, *, quasi_static: bool = True, legend: bool = True
) -> Axes:
    """Draw the result of :func:`snapbeam.threshold`.

    The line is the lowest value that makes an interwell response. The shade reaches up to the value above which every
    run is interwell, or to the end of the range. A triangle at the top: no run is interwell. Hatching: ``not_searched``
    or ``undecided``. A dotted line: failed runs leave the threshold open.

    Parameters
    ----------
    dataset : xarray.Dataset
        Result of :func:`snapbeam.threshold` along one axis, or a curve for each point of a second; without an axis the
        classes along the parameter are drawn.
    ax : matplotlib.axes.Axes, optional
        Axes to draw in; new ones by default.
    quasi_static : bool
        True for the quasi-static threshold V_QS1 of one mode (Eq. 21), dashed, of a system that it describes.
    legend : bool
        True to name the curves.

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> system = paper.struck_beam(frequency_ratio=1.2, velocity_amplitude=0.18)
    >>> dataset = sb.threshold(
    ...     system, "drive.velocity_amplitude", [0.02, 0.08, 0.14, 0.2],
    ...     {"drive.frequency_ratio": [1.0, 1.2]}, sb.Integration(cycles=20),
    ... )
    >>> ax = sb.plot.plot_threshold(dataset)
    """
    contains(dataset, "threshold curve", *_NEEDED)
    dataset = in_units(dataset)
    dims = [str(name) for name in dataset["lower_threshold"].squeeze().dims]
    if not dims:  # one threshold: the classes along its parameter
        ax = plot_response_map(dataset, ax, legend=legend)
        for name in ("lower_threshold", "upper_threshold"):
            if np.isfinite(float(dataset[name])):
                ax.axvline(float(dataset[name]), color="black", linewidth=0.8, linestyle="--")
        return ax
    if len(dims) > 2:
        raise InputError(f"threshold over {dims}: is drawn along one axis, a curve for each point of another one")
    along = dims[-1] if len(dims) == 1 or dims[-1] != "modes" else dims[0]
    others = [name for name in dims if name != along]
    raised = str(dataset.attrs.get("parameter", "velocity_amplitude"))
    x, _ = positions(dataset, along)
    edges = edges_of(dataset, along)
    curves = [dataset.isel({others[0]: at}) for at in range(dataset.sizes[others[0]])] if others else [dataset]
    curves = [curve.squeeze() for curve in curves]
    if len(curves) > len(_STYLES):
        raise InputError(f"dataset: has {len(curves)} curves; at most {len(_STYLES)} can be told apart")
    with frame(ax, dataset, height=76.0) as ax:
        for curve, (color, dashes) in zip(curves, _STYLES, strict=False):
            _draw_curve(ax, curve, x, (color, dashes), _label(dataset, curve, others, raised))
        (ratio, wide), (kind, high) = ratio_along(dataset, along), ratio_along(dataset, raised)
        known = kind == "velocity_amplitude" and ratio in ("frequency_ratio", "location")
        quasi_static = quasi_static and known and quasi_static_objection(dataset.attrs) is None
        if quasi_static:
            static = high * quasi_static_along(dataset, ratio, x / wide)
            (line,) = ax.plot(x, static, color="black", linewidth=0.8, dashes=(4, 2))
        amplitude = dataset[raised].values
        upper = dataset["upper_threshold_max"].where(dataset["lower_threshold"].notnull(), -np.inf)
        closed = bool(upper.notnull().all()) and bool(np.isfinite(upper).any())
        top = min(amplitude[-1], 1.4 * float(upper.max())) if closed else amplitude[-1]
        dress(ax.xaxis, dataset, along)
        dress(ax.yaxis, dataset, raised)
        low = amplitude[0] if ax.get_yscale() == "log" else min(0.0, amplitude[0])
        ax.set(xlim=x[[0, -1]], ylim=(low, top))
        if quasi_static:
            line.set_label(r"quasi-static, $V_\mathrm{QS1}$" if static.min() <= top else "")
        marks = _mark_no_threshold(ax, curves, x, edges)
        if is_geometric(amplitude):
            extend_title(ax, f"steps of a factor of {amplitude[1] / amplitude[0]:.3g}")
        elif amplitude.size > 1:
            extend_title(ax, f"steps of {tick_text(dataset, raised, float(np.max(np.diff(amplitude))))}")
        if legend:
            handles, _ = ax.get_legend_handles_labels()
            first, always = dataset["lower_threshold"], dataset["upper_threshold"]
            if bool((first.notnull() & ~(always <= first)).any()):
                handles.append(Patch(facecolor="0.75", label="up to where all runs are interwell"))
            ax.legend(handles=[*handles, *marks], loc="best", frameon=True, edgecolor="none")
    return ax


def _draw_curve(ax: Axes, curve: xr.Dataset, x: _Array, style: tuple[str, str], label: str) -> None:
    """Draw one band, its isolated points and the intervals that failed runs leave open."""
    color, dashes = style
    end = float(curve[str(curve.attrs.get("parameter", "velocity_amplitude"))][-1])
    first, always, least, most = (np.atleast_1d(curve[name].values) for name in _NEEDED[:4])
    found = np.isfinite(first)
    always = np.where(found & ~np.isfinite(always), end, always)
    most = np.where(found & ~np.isfinite(most), end, most)
    ax.fill_between(x, first, always, color=color, alpha=0.25, linewidth=0.0)
    ax.plot(x, first, dashes, color=color, linewidth=1.1, marker=".", markersize=3.5, label=label)
    alone = found & ~np.append(found[1:], False) & ~np.append(False, found[:-1])
    ax.vlines(x[alone], first[alone], always[alone], color=color, alpha=0.25, linewidth=3.0)
    for low, high in ((least, first), (always, most)):
        wide = found & (low < high)
        if wide.any():
            known = _OPEN in ax.get_legend_handles_labels()[1]
            ax.vlines(
                x[wide], low[wide], high[wide], color=color, linewidth=0.9, linestyle=":",
                label="" if known else _OPEN,
            )  # fmt: skip


def _mark_no_threshold(ax: Axes, curves: list[xr.Dataset], x: _Array, edges: _Array) -> list[Patch]:
    """Mark the points without a threshold, and return the legend handles of the hatching."""
    labelled = False
    above = ax.get_xaxis_transform()
    codes = np.array([np.atleast_1d(curve["outcome"].values) for curve in curves])
    kinds = str(curves[0]["outcome"].attrs["flag_meanings"]).split()
    for number, (color, _) in zip(range(len(curves)), _STYLES, strict=False):
        none = codes[number] == kinds.index("no_interwell_in_range")
        if none.any():
            ax.plot(
                x[none], np.full(int(none.sum()), 0.98), "^", color=color, markersize=3.5, transform=above,
                clip_on=False, label="" if labelled else "no interwell response in range",
            )  # fmt: skip
            labelled = True
    handles = []
    for kind, hatch, label in (
        ("undecided", "....", "undecided: runs failed"),
        ("not_searched", "////", "not searched"),
    ):
        chosen = (codes == kinds.index(kind)).any(axis=0)
        look: dict[str, Any] = {"facecolor": "none", "edgecolor": "0.5", "hatch": hatch, "linewidth": 0.0}
        for at in np.flatnonzero(chosen):
            ax.axvspan(edges[at], edges[at + 1], zorder=0.5, **look)
        if chosen.any():
            handles.append(Patch(label=label, **look))
    return handles


def _label(dataset: xr.Dataset, curve: xr.Dataset, others: list[str], raised: str) -> str:
    """Legend label of a curve."""
    if others:
        value = curve[others[0]].item()
        symbol = symbol_of(dataset, others[0])
        if isinstance(value, (int, str)):
            return f"{symbol} = {value}"
        text = tick_text(dataset, others[0], value, 4).partition(" in ")[0]
        return f"{symbol} = {text}" if symbol else text
    one = wells_of(dataset.attrs) == 1
    return (
        f"lowest {symbol_of(dataset, raised) or 'value'} {'with snap-through' if one else 'of an interwell response'}"
    )
