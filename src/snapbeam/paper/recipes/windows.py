"""Amplitudes that give a transient interwell response, near a clamp and near the centre.

Fig. 8 ends at 2 V_QS1(x_s), which near a clamp is before most of what there is; here every location has the
amplitudes of the centre.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

import snapbeam as sb
from snapbeam.model.default_values import CYCLES
from snapbeam.paper.system import KEPT, legend_handles, paper_map, paper_model
from snapbeam.plot.style import class_cells, figure_legend, figure_style, fix_ticks, new_figure, panel_letters

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from snapbeam.paper.recipe import Results

_Array = NDArray[np.float64]

FREQUENCY_RATIOS = (0.625, 1.625)
END, CENTRE = 0.12, 0.42
"""Locations up to the first are near a clamp, from the second on near the centre."""


def compute(results: Results) -> dict[str, xr.Dataset]:
    """A map over locations and amplitudes, evenly spaced up to 2 V_QS1 of the centre, for each frequency."""
    offsets = results.pick(np.array([0.0, 0.04]), np.linspace(0.0, 0.08, 5))
    locations = np.round(np.concatenate([0.04 + offsets, CENTRE + offsets]), 6)
    modes, found = results.pick(4, 32), {}
    for ratio in FREQUENCY_RATIOS:
        count = results.pick(24, 160)
        drives = np.linspace(0.0, 2.0 * ratio, count + 1)[1:]
        ds = paper_map(
            paper_model(modes), frequency_ratio=ratio, velocity_amplitude=drives,
            location=locations, cycles=results.pick(30, CYCLES), early_termination=True,
            progress=results.progress(f"windows, Omega = {ratio:g}"),
        )  # fmt: skip
        found[f"omega_{ratio:g}"] = ds[list(KEPT)].transpose("location", "velocity_amplitude")
    return found


def longest_window(ds: xr.Dataset) -> tuple[_Array, _Array]:
    """Lower and upper end of the longest stretch of transient amplitudes at each location; NaN if there is none.

    A stretch may hold amplitudes of another class as long as of any five in a row three are transient.
    """
    kinds = ds.response_class.transpose("location", "velocity_amplitude").values
    drives = ds.velocity_amplitude.values.astype(float)
    transient = (kinds == sb.ResponseClass.TRANSIENT_1) | (kinds == sb.ResponseClass.TRANSIENT_2)
    ends = []
    for row in transient:
        most = np.convolve(row, np.ones(5), mode="same") >= 3
        steps = np.diff(np.concatenate([[0], most.astype(int), [0]]))
        first, last = np.flatnonzero(steps == 1), np.flatnonzero(steps == -1) - 1
        if first.size == 0:
            ends.append((np.nan, np.nan))
            continue
        at = int(np.argmax(last - first))
        ends.append((drives[first[at]], drives[last[at]]))
    low, high = np.array(ends).T
    return low, high


def draw(results: Results) -> Figure:
    """A panel a frequency; the longest window of each location in black."""
    data = results["windows"]
    with figure_style():
        figure = new_figure("double", 92.0)
        axes = figure.subplots(1, 2)
        for ax, ds in zip(axes, data.values(), strict=True):
            drives = ds.velocity_amplitude.values
            step = float(drives[1] - drives[0])
            columns = np.arange(ds.sizes["location"] + 1) - 0.5
            edges = np.concatenate([[0.5 * step], drives + 0.5 * step])
            class_cells(ax, columns, edges, ds.response_class.values.T)
            low, high = longest_window(ds)
            for at, (bottom, top) in enumerate(zip(low, high, strict=True)):
                ax.plot([at, at], [bottom, top], color="black", linewidth=1.2)
            ax.axvline(0.5 * ds.sizes["location"] - 0.5, color="white", linewidth=2.0)
            ax.set_xticks(range(ds.sizes["location"]), [f"{x:g}" for x in ds.location.values])
            ax.set(xlabel=r"Shaker location $x_\mathrm{s}$")
            ax.set_title(rf"$\Omega$ = {float(ds.frequency_ratio):g}, $N$ = {ds.attrs['modes']}", loc="left")
        axes[0].set_ylabel("Velocity amplitude $V$")
        fix_ticks(*axes)
        panel_letters(axes)
        figure_legend(figure, legend_handles(np.stack([ds.response_class.values for ds in data.values()])))
    return figure
