"""The interwell threshold over the quasi-static one as the frequency falls (Eq. 21 and section 4.2)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

import snapbeam as sb
from snapbeam.model.default_values import CYCLES, LOCATION
from snapbeam.paper.system import class_map, paper_model
from snapbeam.plot.style import figure_style, fix_ticks, new_figure
from snapbeam.sweeps.threshold import interwell_threshold

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from snapbeam.paper.recipe import Results


def compute(results: Results) -> dict[str, xr.Dataset]:
    """Classes over V/V_QS1 at each frequency, fine about 1."""
    from snapbeam.util.datasets import xr

    ratios = results.pick((0.15, 0.4, 1.0), (0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0))
    step = results.pick(0.1, 0.01)
    relative = np.round(np.arange(step, 1.1 + 0.5 * step, step), 6)
    found = {}
    for modes in (1, results.pick(4, 32)):
        columns = []
        for ratio in ratios:
            static = float(sb.model.quasi_static_threshold(LOCATION, ratio))
            # slow runs take long: those far from where the threshold can be are left out
            low, high = (0.8, 1.1) if ratio < 0.1 else (0.3, 1.1) if ratio < 0.5 else (0.0, 0.6)
            inside = relative[(relative >= low) & (relative <= high + 1e-9)]
            ds = class_map(
                results, f"low_frequency, N = {modes}, Omega = {ratio:g}", paper_model(modes),
                frequency_ratio=ratio, velocity_amplitude=inside * static, cycles=results.pick(6, CYCLES),
            )  # fmt: skip
            columns.append(ds.assign_coords(velocity_amplitude=inside))
        nothing = {"response_class": -1, "status": 5, "zero_crossings": 0, "final_well_proven": False}
        joined = xr.concat(
            columns, dim="frequency_ratio", join="outer", combine_attrs="drop_conflicts", fill_value=nothing
        )
        found[f"modes_{modes}"] = joined.rename(velocity_amplitude="relative_amplitude")
    return found


def draw(results: Results) -> Figure:
    """The ratio of the two thresholds over frequency."""
    with figure_style():
        figure = new_figure("single", 62.0)
        ax = figure.add_subplot()
        for ds, color, marker in zip(results["low_frequency"].values(), ("#2E7EBB", "#B03A27"), "os", strict=True):
            curve = interwell_threshold(ds, "relative_amplitude")
            ax.plot(
                ds.frequency_ratio, curve, marker=marker, color=color, markersize=3,
                label=f"$N$ = {int(ds.attrs['modes'])}",
            )  # fmt: skip
        ax.axhline(1.0, color="0.4", linewidth=0.6, dashes=(4, 2))
        ax.set(xscale="log", xlabel=r"Excitation frequency $\Omega$", ylim=(0.0, 1.15))
        ax.xaxis.set_major_formatter("{x:g}")
        ax.xaxis.set_minor_formatter("")
        ax.set_ylabel(r"Interwell threshold $V\,/\,V_\mathrm{QS1}$")
        ax.legend()
        fix_ticks(ax)
    return figure
