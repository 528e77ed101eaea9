"""Fig. 2: the beam in its two wells and the shaker, with their symbols, drawn from the model."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.patches import FancyArrowPatch, Polygon, Rectangle

from snapbeam.model.default_values import BEAM, LOCATION
from snapbeam.paper.system import paper_model, shapes_along
from snapbeam.plot.style import BEAM_COLOR, SHAKER_COLOR, figure_style, new_figure

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from snapbeam.paper.recipe import Results


def compute(results: Results) -> dict[str, xr.Dataset]:
    """The two wells along the beam, in units of b."""
    from snapbeam.util.datasets import xr

    model = paper_model(1)
    x, shapes = shapes_along(model, 201)
    wells = model.wells @ shapes.T / BEAM.buckling_level
    words = {"units": "b", "long_name": "deflection in a well"}
    return {
        "wells": xr.Dataset(
            {"displacement": (("well", "position"), wells, words)},
            {"well": [-1, 1], "position": ("position", x, {"units": "L"})},
            {"location": LOCATION},
        )
    }


def draw(results: Results) -> Figure:
    """The schematic."""
    wells = results["fig2"]["wells"]
    x, (lower, upper) = wells.position.values, wells.displacement.values
    location = float(wells.attrs["location"])
    touch = float(np.interp(location, x, lower))
    with figure_style():
        figure = new_figure("single", 58.0)
        ax = figure.add_subplot()
        ax.set(xlim=(-0.22, 1.22), ylim=(-2.45, 1.75))
        ax.set_axis_off()
        _clamps(ax)
        ax.plot([0.0, 1.0], [0.0, 0.0], color="0.6", linewidth=0.5, dashes=(8, 3, 2, 3))
        ax.plot(x, lower, color=BEAM_COLOR, linewidth=1.8)
        ax.plot(x, upper, color=BEAM_COLOR, linewidth=1.2, dashes=(4, 2))
        _shaker(ax, location, touch)
        _dimension(ax, (0.0, 1.45), (1.0, 1.45), "$L$", (0.5, 1.53))
        _dimension(ax, (0.0, -2.05), (location, -2.05), r"$x_\mathrm{s}$", (0.5 * location, -2.0))
        ax.plot([0.0, 0.0], [-2.15, -0.55], [location] * 2, [-2.15, -1.95], color="0.5", linewidth=0.4)
        _dimension(ax, (0.78, 0.0), (0.78, 1.0), "$b$", (0.795, 0.42))
        ax.plot([0.5, 0.8], [1.0, 1.0], color="0.5", linewidth=0.4)
        _dimension(ax, (0.28, 0.0), (0.28, float(np.interp(0.28, x, lower))), "", (0.0, 0.0))
        ax.text(0.295, -0.36, r"$w_\mathrm{b}(x, t)$", ha="left", va="center")
        for start, stop in (((-0.2, 0.0), (-0.07, 0.0)), ((1.2, 0.0), (1.07, 0.0))):
            ax.add_patch(_arrow(start, stop, "-|>", 1.2))
            ax.text(0.5 * (start[0] + stop[0]), 0.18, "$P$", ha="center", va="bottom")
        _dimension(ax, (0.6, -2.1), (0.6, touch - 0.55), "", (0.0, 0.0), SHAKER_COLOR)
        ax.text(0.62, -1.85, r"$w_\mathrm{s}(t)$", color=SHAKER_COLOR, va="center")
        for tip, words, at in (((-0.18, -0.9), "$w$", (-0.18, -0.8)), ((-0.04, -1.6), "$x$", (-0.02, -1.65))):
            ax.add_patch(_arrow((-0.18, -1.6), tip, "->", 0.7))
            ax.text(*at, words, ha="center", va="bottom")
    return figure


def _clamps(ax: Axes) -> None:
    for left in (-0.06, 1.0):
        ax.add_patch(Rectangle((left, -0.5), 0.06, 1.0, facecolor="0.85", hatch="////", edgecolor="0.4", lw=0.6))


def _shaker(ax: Axes, x: float, touch: float) -> None:
    """A rod with a rounded tip, on screen as round as the paper's."""
    angle = np.linspace(0.0, np.pi, 41)
    half, round_height = 0.03, 0.16
    tip = np.column_stack((x + half * np.cos(angle), touch - round_height + round_height * np.sin(angle)))
    rod = np.vstack(([[x + half, -2.35]], tip, [[x - half, -2.35]]))
    ax.add_patch(Polygon(rod, facecolor=SHAKER_COLOR, edgecolor="none"))


def _arrow(
    start: tuple[float, float], stop: tuple[float, float], style: str, width: float, color: str = "black"
) -> FancyArrowPatch:
    return FancyArrowPatch(
        start, stop, arrowstyle=style, mutation_scale=7, linewidth=width, color=color, shrinkA=0, shrinkB=0
    )


def _dimension(
    ax: Axes,
    start: tuple[float, float],
    stop: tuple[float, float],
    words: str,
    at: tuple[float, float],
    color: str = "black",
) -> None:
    ax.add_patch(_arrow(start, stop, "<->", 0.7, color))
    if words:
        ax.text(*at, words, ha="center" if start[1] == stop[1] else "left", va="bottom", color=color)
