"""Fig. 6: classes over frequency and amplitude after 200 cycles, for 1 and 32 modes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from snapbeam.model.default_values import BEAM, CYCLES
from snapbeam.paper.system import class_map, legend_handles, paper_model
from snapbeam.plot.map import plot_response_map
from snapbeam.plot.style import figure_legend, figure_style, new_figure, panel_letters
from snapbeam.sweeps.measured_points import MeasuredPoints

if TYPE_CHECKING:
    import os

    import xarray as xr
    from matplotlib.figure import Figure

    from snapbeam.paper.recipe import Results

OPTIONS = ("measurements",)


def frequency_maps(results: Results, name: str, cycles: int) -> dict[str, xr.Dataset]:
    """The map of each model, Omega to 4 and V to 0.65."""
    ratio = results.pick(np.linspace(0.2, 4.0, 20), np.linspace(0.1, 4.0, 160))
    amplitude = results.pick(np.linspace(0.05, 0.65, 13), np.linspace(0.65 / 66, 0.65, 66))
    found = {}
    for modes in (1, results.pick(4, 32)):
        found[f"modes_{modes}"] = class_map(
            results, f"{name}, N = {modes}", paper_model(modes), frequency_ratio=ratio,
            velocity_amplitude=amplitude, cycles=cycles,
        )  # fmt: skip
    return found


def compute(results: Results) -> dict[str, xr.Dataset]:
    """The two maps after 200 cycles."""
    return frequency_maps(results, "fig6", results.pick(40, CYCLES))


def read_measurements(measurements: str | os.PathLike[str] | None, ds: xr.Dataset) -> MeasuredPoints | None:
    """The measured responses of a CSV table, normalised as the map is."""
    from snapbeam.sweeps.measured_points import read_measured_points

    if measurements is None:
        return None
    return read_measured_points(
        measurements, reference_frequency=ds.attrs["reference_frequency"], buckling_level=BEAM.buckling_level
    )


def draw(results: Results, measurements: str | os.PathLike[str] | None = None) -> Figure:
    """A panel a model, measured responses laid over both if a table of them is given."""
    data = results["fig6"]
    with figure_style():
        figure = new_figure("double", 84.0)
        axes = figure.subplots(1, 2, sharey=True)
        for ax, ds in zip(axes, data.values(), strict=True):
            plot_response_map(ds, ax, measurements=read_measurements(measurements, ds), legend=False)
        axes[1].set_ylabel("")
        panel_letters(axes)
        figure_legend(figure, legend_handles(np.stack([ds.response_class.values for ds in data.values()])))
    return figure
