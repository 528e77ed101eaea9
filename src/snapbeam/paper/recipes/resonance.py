"""Resonance of the intrawell response against the drive, up to the notch of the threshold.

The maximum displacement at the contact over frequency, as in Fig. B.10, at many drives: the frequency of its
maximum falls with the drive (softening), and where it ends the beam snaps through.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from snapbeam.paper.system import paper_map, paper_model
from snapbeam.plot.style import BEAM_COLOR, SHAKER_COLOR, figure_style, fix_ticks, new_figure, panel_letters
from snapbeam.sweeps.threshold import interwell_threshold, is_interwell

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from snapbeam.paper.recipe import Results

_Array = NDArray[np.float64]

WINDOW = (0.8, 2.2)
"""Omega between which the notch of Fig. 6 and the maximum that belongs to it are looked for."""


def compute(results: Results) -> dict[str, xr.Dataset]:
    """Maximum displacement over frequency and drive, for 1 and 32 modes."""
    ratio = np.round(np.arange(WINDOW[0], WINDOW[1] + 1e-9, results.pick(0.1, 0.02)), 6)
    found = {}
    for modes, top in ((1, 0.064), (results.pick(4, 32), 0.16)):
        drives = np.linspace(0.0, top, results.pick(5, 17))[1:]
        ds = paper_map(
            paper_model(modes), frequency_ratio=ratio, velocity_amplitude=drives,
            cycles=results.pick(60, 400), progress=results.progress(f"resonance, N = {modes}"),
        )  # fmt: skip
        found[f"modes_{modes}"] = ds[["max_displacement", "response_class", "status"]]
    return found


def ridge(ds: xr.Dataset) -> tuple[_Array, _Array]:
    """The drives at which no frequency of the window snaps, and Omega of the maximum displacement at each."""
    calm = ~is_interwell(ds.response_class.values).any(axis=0)
    # the lowest drives only: above the first that snaps somewhere the maximum is that of what is left
    count = int(np.argmin(calm)) if not calm.all() else calm.size
    at = np.argmax(ds.max_displacement.values[:, :count], axis=0)
    return ds.velocity_amplitude.values[:count].astype(float), ds.frequency_ratio.values[at].astype(float)


def draw(results: Results) -> Figure:
    """A panel a model: displacement over frequency and drive, its ridge, and the threshold of Fig. 6."""
    from cmcrameri import cm

    data, maps = results["resonance"], results["fig6"]
    with figure_style():
        figure = new_figure("double", 78.0)
        axes = figure.subplots(1, 2)
        for ax, ds, whole in zip(axes, data.values(), maps.values(), strict=True):
            height = np.where(is_interwell(ds.response_class.values), np.nan, ds.max_displacement.values)
            mesh = ax.pcolormesh(
                ds.frequency_ratio, ds.velocity_amplitude, height.T, cmap=cm.oslo_r, vmin=-1.0, vmax=0.0,
                rasterized=True, shading="nearest",
            )  # fmt: skip
            drives, ratios = ridge(ds)
            ax.plot(ratios, drives, "o-", color=SHAKER_COLOR, markersize=2.5, label="maximum displacement")
            ax.plot(
                whole.frequency_ratio, interwell_threshold(whole), color=BEAM_COLOR,
                label="threshold of Fig. 6",
            )  # fmt: skip
            ax.set(xlabel=r"Excitation frequency $\Omega$", xlim=WINDOW)
            ax.set_ylim(0.0, float(ds.velocity_amplitude[-1]))
            ax.set_title(f"$N$ = {int(ds.attrs['modes'])}", loc="left")
        axes[0].set_ylabel("Velocity amplitude $V$")
        figure.colorbar(mesh, ax=list(axes), label=r"Maximum displacement $w_\mathrm{b}(x_\mathrm{s})$")
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=2)
        fix_ticks(*axes)
        panel_letters(axes)
    return figure
