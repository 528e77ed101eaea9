"""A calibration: how well the model meets each measured frequency, and what the data leave open."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from snapbeam.plot.style import BEAM_COLOR, CENTER_COLOR, SHAKER_COLOR, figure_style, fix_ticks, new_figure

if TYPE_CHECKING:
    from snapbeam.lab.calibration import Calibration

__all__ = ["plot_calibration"]


_SHOWN = {
    "thickness": (1e3, "Thickness (mm)"),
    "buckling_level": (1e3, "Buckling level (mm)"),
    "length": (1e3, "Length (mm)"),
    "young_modulus": (1e-9, "Young's modulus (GPa)"),
    "density": (1.0, "Density (kg/m³)"),
}


def plot_calibration(result: Calibration) -> Figure:
    """Draw the deviation of model from measurement for each frequency, and the first two fitted parameters.

    Right, the regions that hold the truth with 68 % and 95 %, and the point where the fit started.  Without
    two determined parameters only the deviations are drawn.
    """
    named = [name for name in result.values if name in result.standard_errors][:2]
    rows = max(len(result.residuals), 1)
    with figure_style():
        figure = new_figure("double" if len(named) == 2 else "single", 50.0 + 6.0 * rows)
        axes = figure.subplots(1, 2 if len(named) == 2 else 1, squeeze=False)[0]
        _deviations(axes[0], result)
        if len(named) == 2:
            _regions(axes[1], result, named[0], named[1])
        fix_ticks(*axes)
    return figure


def _deviations(ax: Axes, result: Calibration) -> None:
    place = np.arange(len(result.residuals))[::-1]
    share = [100.0 * (item.model / item.measured - 1.0) for item in result.residuals]
    error = [200.0 * item.standard_error / item.measured for item in result.residuals]
    ax.axvline(0.0, color=SHAKER_COLOR, linewidth=0.9)
    ax.errorbar(share, place, xerr=error, fmt="o", color=BEAM_COLOR, markersize=4, linewidth=0.9, capsize=2.0)
    names = [f"{item.name}\n{item.measured:g} Hz" for item in result.residuals]
    ax.set_yticks(place, names)
    ax.set(xlabel="Model less measured (%), bars two standard errors")
    ax.margins(y=0.15)


def _regions(ax: Axes, result: Calibration, first: str, second: str) -> None:
    names = list(result.values)
    i, j = names.index(first), names.index(second)
    spread = np.array([result.standard_errors[first], result.standard_errors[second]])
    linked = result.correlation[i, j]
    covariance = np.outer(spread, spread) * np.array([[1.0, linked], [linked, 1.0]])
    values, vectors = np.linalg.eigh(covariance)
    angle = np.linspace(0.0, 2.0 * np.pi, 200)
    circle = vectors @ (np.sqrt(np.maximum(values, 0.0))[:, None] * np.array([np.cos(angle), np.sin(angle)]))
    (scale_x, label_x), (scale_y, label_y) = _SHOWN[first], _SHOWN[second]
    for level, style in ((0.68, "-"), (0.95, "--")):
        reach = np.sqrt(-2.0 * np.log(1.0 - level))
        ax.plot(
            scale_x * (result.values[first] + reach * circle[0]),
            scale_y * (result.values[second] + reach * circle[1]),
            style, color=BEAM_COLOR, label=f"{100 * level:.0f} % region",
        )  # fmt: skip
    ax.plot(
        scale_x * result.values[first], scale_y * result.values[second], "o", color=BEAM_COLOR, markersize=4,
        label="fitted",
    )  # fmt: skip
    ax.plot(
        scale_x * getattr(result.start, first), scale_y * getattr(result.start, second), "s", markersize=5,
        color=CENTER_COLOR, markeredgecolor=BEAM_COLOR, markeredgewidth=0.6, label="start of the fit",
    )  # fmt: skip
    ax.set(xlabel=label_x, ylabel=label_y)
    ax.margins(0.12)
    ax.locator_params(axis="x", nbins=5)
    ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=4, columnspacing=0.9, borderaxespad=0.2)
