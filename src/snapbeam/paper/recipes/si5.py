"""Supplementary video SI5: the map over location at Omega = 1.625 as modes are added."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from snapbeam.model.default_values import CYCLES
from snapbeam.paper.recipes.fig8 import draw_relative_map, relative_amplitudes
from snapbeam.paper.system import legend_handles, relative_map
from snapbeam.plot.style import figure_legend, figure_style, new_figure, panel_letters

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from snapbeam.paper.recipe import Results

FREQUENCY_RATIO = 1.625
_SHOWN = (1, 2, 4, 8, 16, 32)


def compute(results: Results) -> dict[str, xr.Dataset]:
    """A map for each number of modes."""
    points = results.pick(8, 40)
    locations = np.linspace(0.5 / points, 0.5, points)
    relative = relative_amplitudes(results.pick(10, 40))
    counts = results.pick((1, 2, 4), (*range(1, 9), 10, 12, 14, 16, 20, 24, 28, 32))
    return {
        f"modes_{modes}": relative_map(
            results, f"si5, N = {modes}", modes, FREQUENCY_RATIO, locations, relative, results.pick(30, CYCLES)
        )
        for modes in counts
    }


def draw(results: Results) -> Figure:
    """Six frames of the animation, or as many as there are."""
    data = {name: ds for name, ds in results["si5"].items() if int(ds.attrs["modes"]) in _SHOWN}
    with figure_style():
        rows = (len(data) + 2) // 3
        figure = new_figure("double", 22.0 + 54.0 * rows)
        axes = figure.subplots(rows, 3, sharex=True, sharey=True, squeeze=False)
        for ax, ds in zip(axes.ravel(), data.values(), strict=False):
            handles = draw_relative_map(ax, ds)
        for ax in axes[:, 0]:
            ax.set_ylabel("Velocity amplitude $V$")
        for ax in axes[-1]:
            ax.set_xlabel(r"Shaker location $x_\mathrm{s}$")
        handles[-1].set_label(r"0.05 $V_\mathrm{QS1}$")
        panel_letters(axes.ravel())
        kinds = np.concatenate([ds.response_class.values.ravel() for ds in data.values()])
        figure_legend(figure, [*legend_handles(kinds), *handles], 3)
    return figure


def write_video(results: Results, folder: Path) -> list[Path]:
    """The animation, one second and a half a map, as MP4 and GIF."""
    from snapbeam.plot.animation import write_frames

    def frames() -> Any:
        for ds in results["si5"].values():
            with figure_style():
                figure = new_figure("single", 84.0)
                ax = figure.add_subplot()
                handles = draw_relative_map(ax, ds)
                handles[-1].set_label(r"0.05 $V_\mathrm{QS1}$")
                ax.set(xlabel=r"Shaker location $x_\mathrm{s}$", ylabel="Velocity amplitude $V$")
                figure_legend(figure, [*legend_handles(ds.response_class.values), *handles], 2)
            yield figure

    return [write_frames(frames(), folder / f"si5{suffix}", fps=1.0 / 1.5) for suffix in (".mp4", ".gif")]
