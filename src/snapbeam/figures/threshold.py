"""The threshold of the interwell response, as a band, for one or several numbers of modes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Patch

from snapbeam.core.validate import InputError
from snapbeam.figures.response_map import AXIS_LABELS
from snapbeam.figures.style import fix_ticks, house_style, new_figure
from snapbeam.model.drive import quasi_static_threshold

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["plot_threshold"]

_STYLES = (("#B03A27", "-"), ("#16245E", "-"), ("#4C97C8", "--"), ("#6E8B2F", "-."), ("#000000", ":"))


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
    if "first_interwell" not in dataset or "always_interwell" not in dataset:
        raise InputError(f"no threshold curve among {list(map(str, dataset.variables))}")
    along = next(name for name in dataset["first_interwell"].dims if name != "modes")
    x = np.asarray(dataset[along].values)
    many = "modes" in dataset.dims
    curves = [dataset.isel(modes=at) for at in range(dataset.sizes["modes"])] if many else [dataset]
    if len(curves) > len(_STYLES):
        raise InputError(f"dataset: has {len(curves)} curves; at most {len(_STYLES)} can be told apart")
    with house_style():
        if ax is None:
            ax = new_figure("single", 70.0).add_subplot()
        for curve, (color, dashes) in zip(curves, _STYLES, strict=False):
            first, always = (curve[name].values for name in ("first_interwell", "always_interwell"))
            modes = curve["modes"].item() if many else dataset.attrs.get("modes")
            label = "lowest interwell $V$" if modes is None else f"$N$ = {int(modes)}"
            ax.fill_between(x, first, always, color=color, alpha=0.25, linewidth=0.0)
            ax.plot(x, first, dashes, color=color, linewidth=1.1, label=label)
        if quasi_static:
            ax.plot(x, _quasi_static(dataset, str(along), x), color="black", linewidth=0.8, dashes=(4, 2),
                    label=r"quasi-static, $V_\mathrm{QS1}$")  # fmt: skip
        amplitude = dataset["velocity_amplitude"].values
        found = float(dataset["always_interwell"].max())
        top = min(amplitude[-1], 1.4 * found) if np.isfinite(found) else amplitude[-1]
        ax.set(xlim=x[[0, -1]], ylim=(0.0, top), xlabel=AXIS_LABELS[str(along)])
        ax.set_ylabel(AXIS_LABELS["velocity_amplitude"])
        fix_ticks(ax)
        if "cycles" in dataset.attrs:
            step = float(np.max(np.diff(amplitude)))
            ax.set_title(f"{int(dataset.attrs['cycles'])} cycles, steps of {step:.2g} in $V$", loc="left")
        if legend:
            shade = Patch(facecolor="0.75", label="up to where all runs are interwell")
            handles, _ = ax.get_legend_handles_labels()
            ax.legend(handles=[*handles, shade], loc="best")
    return ax


def _quasi_static(dataset: xr.Dataset, along: str, x: np.ndarray) -> np.ndarray:
    if along == "location":
        return np.asarray(quasi_static_threshold(x, float(dataset["frequency_ratio"])))
    return np.asarray(quasi_static_threshold(float(dataset["location"]), x))
