"""Fig. 7: classes over frequency and amplitude after 1000 cycles, and what changed since 200."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from snapbeam.model.default_values import LONG_CYCLES
from snapbeam.paper.recipes.fig6 import frequency_maps, read_measurements
from snapbeam.paper.system import legend_handles
from snapbeam.plot.map import plot_response_map
from snapbeam.plot.style import figure_legend, figure_style, new_figure, panel_letters

if TYPE_CHECKING:
    import os

    import xarray as xr
    from matplotlib.figure import Figure

    from snapbeam.paper.recipe import Results

OPTIONS = ("measurements",)


def compute(results: Results) -> dict[str, xr.Dataset]:
    """The two maps after 1000 cycles."""
    return frequency_maps(results, "fig7", results.pick(120, LONG_CYCLES))


def draw(results: Results, measurements: str | os.PathLike[str] | None = None) -> Figure:
    """Above, the maps with the quasi-static threshold; below, the new class of the points that changed."""
    long, short = results["fig7"], results["fig6"]
    with figure_style():
        figure = new_figure("double", 150.0)
        axes = figure.subplots(2, 2, sharex=True, sharey=True)
        for (above, below), name in zip(axes.T, long, strict=True):
            ds = long[name]
            plot_response_map(
                ds, above, measurements=read_measurements(measurements, ds), quasi_static_line=True, legend=False
            )
            changed = ds.response_class.values != short[name].response_class.values
            plot_response_map(
                ds.assign(response_class=ds.response_class.where(changed)), below, quasi_static_line=True, legend=False
            )
            cycles = int(short[name].attrs["cycles"])
            below.set_title(f"changed since {cycles} cycles: {100.0 * changed.mean():.1f} % of points", loc="center")
            above.set_xlabel("")
        for ax in axes[:, 1]:
            ax.set_ylabel("")
        line = axes[0, 0].lines[-1]
        line.set_label(r"$V_\mathrm{QS1}$ (Eq. 21)")
        panel_letters(axes.ravel())
        kinds = np.stack([ds.response_class.values for ds in long.values()])
        figure_legend(figure, [*legend_handles(kinds), line], 5)
    return figure
