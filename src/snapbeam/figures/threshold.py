"""The threshold of the interwell response, as a band, for one or several numbers of modes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Patch

from snapbeam.core.kinds import checked
from snapbeam.core.validate import InputError, instance
from snapbeam.figures.axes import dress, positions, symbol_of
from snapbeam.figures.style import fix_ticks, house_style, new_figure
from snapbeam.model.galerkin.quasi_static import quasi_static_threshold

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["plot_threshold"]

_STYLES = (("#B03A27", "-"), ("#16245E", "-"), ("#4C97C8", "--"), ("#6E8B2F", "-."), ("#000000", ":"))


@checked
def plot_threshold(
    dataset: xr.Dataset, ax: Axes | None = None, *, quasi_static: bool = True, legend: bool = True
) -> Axes:
    """Draw what :func:`snapbeam.threshold_curve` found.

    The line is the lowest velocity amplitude that makes an interwell response, the shade reaches up to the
    one above which every run is interwell.

    Parameters
    ----------
    dataset : xarray.Dataset
        ``first_interwell`` and ``always_interwell`` along frequency ratio or location.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure one column wide by default.
    quasi_static : bool
        Whether to draw the quasi-static threshold V_QS1 of one mode (Eq. 21), dashed.
    legend : bool
        Whether to name the curves.

    Raises
    ------
    InputError
        If the dataset holds no threshold curve.
    """
    import xarray as xr

    instance("dataset", dataset, xr.Dataset, "an xarray.Dataset")
    if "first_interwell" not in dataset or "always_interwell" not in dataset:
        raise InputError(f"no threshold curve among {list(map(str, dataset.variables))}")
    dims = [str(name) for name in dataset["first_interwell"].squeeze().dims]
    if not 1 <= len(dims) <= 2:
        raise InputError(
            f"threshold over {dims}: is drawn along one axis, a curve for each point of another one"
        )
    along = dims[-1] if len(dims) == 1 or dims[-1] != "modes" else dims[0]
    others = [name for name in dims if name != along]
    raised = str(dataset.attrs.get("along", "velocity_amplitude"))
    x, _ = positions(dataset, along)
    curves = (
        [dataset.isel({others[0]: at}) for at in range(dataset.sizes[others[0]])] if others else [dataset]
    )
    curves = [curve.squeeze() for curve in curves]
    if len(curves) > len(_STYLES):
        raise InputError(f"dataset: has {len(curves)} curves; at most {len(_STYLES)} can be told apart")
    with house_style():
        if ax is None:
            ax = new_figure("single", 70.0).add_subplot()
        for curve, (color, dashes) in zip(curves, _STYLES, strict=False):
            first, always = (curve[name].values for name in ("first_interwell", "always_interwell"))
            label = _label(dataset, curve, others, raised)
            ax.fill_between(x, first, always, color=color, alpha=0.25, linewidth=0.0)
            ax.plot(x, first, dashes, color=color, linewidth=1.1, label=label)
        quasi_static = (
            quasi_static and raised == "velocity_amplitude" and along in ("frequency_ratio", "location")
        )
        if quasi_static:
            ax.plot(x, _quasi_static(dataset, along, x), color="black", linewidth=0.8, dashes=(4, 2),
                    label=r"quasi-static, $V_\mathrm{QS1}$")  # fmt: skip
        amplitude = dataset[raised].values
        found = float(dataset["always_interwell"].max())
        top = min(amplitude[-1], 1.4 * found) if np.isfinite(found) else amplitude[-1]
        fix_ticks(ax)
        dress(ax.xaxis, dataset, along)
        dress(ax.yaxis, dataset, raised)
        low = amplitude[0] if ax.get_yscale() == "log" else min(0.0, amplitude[0])
        ax.set(xlim=x[[0, -1]], ylim=(low, top))
        if "cycles" in dataset.attrs:
            step = float(np.max(np.diff(amplitude)))
            ax.set_title(
                f"{int(dataset.attrs['cycles'])} cycles, steps of {step:.2g} in {symbol_of(dataset, raised)}",
                loc="left",
            )
        if legend:
            shade = Patch(facecolor="0.75", label="up to where all runs are interwell")
            handles, _ = ax.get_legend_handles_labels()
            ax.legend(handles=[*handles, shade], loc="best")
    return ax


def _label(dataset: xr.Dataset, curve: xr.Dataset, others: list[str], raised: str) -> str:
    """What one curve is called."""
    if others:
        value = curve[others[0]].item()
        text = str(value) if isinstance(value, (int, str)) else f"{value:.4g}"
        return f"{symbol_of(dataset, others[0])} = {text}"
    modes = dataset.attrs.get("modes")
    return f"lowest interwell {symbol_of(dataset, raised)}" if modes is None else f"$N$ = {int(modes)}"


def _quasi_static(dataset: xr.Dataset, along: str, x: np.ndarray) -> np.ndarray:
    if along == "location":
        return np.asarray(quasi_static_threshold(x, float(dataset["frequency_ratio"])))
    return np.asarray(quasi_static_threshold(float(dataset["location"]), x))
