"""Changes after the 1000 cycles of Fig. 7: its map on a coarser grid, three times as long."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from snapbeam.model.default_values import LONG_CYCLES
from snapbeam.paper.system import class_map, legend_handles, paper_model
from snapbeam.plot.map import plot_response_map
from snapbeam.plot.style import figure_legend, figure_style, new_figure, panel_letters

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from snapbeam.paper.recipe import Results


def compute(results: Results) -> dict[str, xr.Dataset]:
    """For 1 and 32 modes, a map after 1000 and one after 3000 cycles."""
    ratio = results.pick(np.linspace(0.4, 4.0, 10), np.linspace(0.1, 4.0, 40))
    amplitude = results.pick(np.linspace(0.1, 0.65, 6), np.linspace(0.65 / 22, 0.65, 22))
    found = {}
    for modes in (1, results.pick(4, 32)):
        for name, cycles in (("before", results.pick(120, LONG_CYCLES)), ("after", results.pick(360, 3 * LONG_CYCLES))):
            found[f"modes_{modes}_{name}"] = class_map(
                results, f"transients, N = {modes}, {cycles} cycles", paper_model(modes),
                frequency_ratio=ratio, velocity_amplitude=amplitude, cycles=cycles,
            )  # fmt: skip
    return found


def draw(results: Results) -> Figure:
    """A panel a model: the class after the longer time of the points that changed."""
    maps = list(results["transients"].values())
    with figure_style():
        figure = new_figure("double", 84.0)
        axes = figure.subplots(1, 2, sharey=True)
        for ax, before, after in zip(axes, maps[::2], maps[1::2], strict=True):
            changed = after.response_class.values != before.response_class.values
            plot_response_map(after.assign(response_class=after.response_class.where(changed)), ax, legend=False)
            ax.set_title(
                f"$N$ = {int(after.attrs['modes'])}: {100.0 * changed.mean():.1f} % changed from "
                f"{int(before.attrs['cycles'])} to {int(after.attrs['cycles'])} cycles",
                loc="center",
            )
        axes[1].set_ylabel("")
        panel_letters(axes)
        figure_legend(figure, legend_handles(np.stack([ds.response_class.values for ds in maps])))
    return figure
