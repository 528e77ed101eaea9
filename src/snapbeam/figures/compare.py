"""Measured beside simulated: waveforms and spectra (Fig. 4 of the paper); dots on a map, with a table."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from snapbeam.core.validate import InputError, finite
from snapbeam.figures.response_map import plot_response_map
from snapbeam.figures.style import BEAM_COLOR, SHAKER_COLOR, fix_ticks, house_style, new_figure
from snapbeam.lab.compare.dots import Dots

if TYPE_CHECKING:
    import xarray as xr

    from snapbeam.lab.compare.maps import DotComparison
    from snapbeam.lab.compare.waveforms import WaveformComparison

__all__ = ["plot_dot_comparison", "plot_waveform_comparison"]


def plot_waveform_comparison(
    result: WaveformComparison, window: tuple[float, float] | None = None, multiples: float = 8.0
) -> Figure:
    """Draw a measured run to the left of a simulated one: beam and shaker over cycles, below their spectra.

    Impacts, where they are known, stand as ticks along the lower edge.

    Parameters
    ----------
    result : WaveformComparison
    window : (float, float), optional
        First and last cycle to draw; all by default.
    multiples : float
        Highest frequency of the spectra, in multiples of the excitation frequency.
    """
    low, high = (finite("window", value) for value in window) if window else (None, None)
    waveforms = result.waveforms.sel(cycle=slice(low, high))
    if waveforms.sizes["cycle"] < 2:
        raise InputError(f"window = {window}: holds none of the compared cycles")
    cycle = waveforms["cycle"].values
    columns = (
        ("measured", "measured_displacement", "measured_shaker", result.measured_impacts),
        ("simulated", "simulated_displacement", "simulated_shaker", result.simulated_impacts),
    )
    with house_style():
        figure = new_figure("double", 100.0)
        axes = figure.subplots(2, 2, sharey="row", height_ratios=(1.5, 1.0))
        for i, (name, beam, shaker, impacts) in enumerate(columns):
            top, bottom = axes[0, i], axes[1, i]
            top.axhline(0.0, color="0.7", linewidth=0.5)
            top.plot(cycle, waveforms[beam], color=BEAM_COLOR, label="beam, at the shaker")
            top.plot(cycle, waveforms[shaker], color=SHAKER_COLOR, label="shaker")
            shown = impacts[(impacts >= cycle[0]) & (impacts <= cycle[-1])]
            if shown.size:
                top.plot(
                    shown, np.full(shown.size, 0.02), "|", color=BEAM_COLOR, markersize=5,
                    transform=top.get_xaxis_transform(), label="impact",
                )  # fmt: skip
            top.set(xlabel=r"Cycles of excitation $\tau$", xlim=(cycle[0], cycle[-1]))
            top.set_title(name, loc="left")
            ratio = result.spectra["frequency_ratio"].values
            inside = (ratio > 0.0) & (ratio <= multiples)
            bottom.semilogy(ratio[inside], result.spectra[beam].values[inside], color=BEAM_COLOR)
            bottom.set(xlabel="Frequency (multiples of the excitation)", xlim=(0.0, multiples))
        axes[0, 0].set_ylabel("Displacement $w$ ($b$)")
        axes[1, 0].set_ylabel("Beam spectrum ($b$)")
        handles, labels = axes[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=3)
        figure.align_ylabels(axes[:, 0])
        fix_ticks(*axes.flat)
    return figure


def plot_dot_comparison(dataset: xr.Dataset, dots: Dots, result: DotComparison) -> Figure:
    """Draw measured responses on a map, and the table of measured against simulated classes beside it."""
    with house_style():
        figure = new_figure("double", 92.0)
        grid = figure.add_gridspec(1, 2, width_ratios=(1.15, 1.0))
        plot_response_map(dataset, figure.add_subplot(grid[0]), dots=dots)
        ax = figure.add_subplot(grid[1])
        counts = result.confusion
        rows = np.maximum(counts.sum(axis=1, keepdims=True), 1)
        ax.imshow(counts / rows, cmap="Greys", vmin=0.0, vmax=1.0, origin="upper")
        for (i, j), value in np.ndenumerate(counts):
            dark = value / rows[i, 0] > 0.5
            ax.text(j, i, str(value), ha="center", va="center", color="white" if dark else "black")
        names = [kind.label.replace(" interwell", "\ninterwell") for kind in result.classes]
        ax.set_xticks(np.arange(len(names)), names, rotation=40, ha="right", rotation_mode="anchor")
        ax.set_yticks(np.arange(len(names)), names)
        ax.set(xlabel="Simulated", ylabel="Measured")
        low, high = result.agreement_interval
        ax.set_title(
            f"{100 * result.agreement:.0f} % of {result.used} agree "
            f"(95 %: {100 * low:.0f} to {100 * high:.0f} %)"
            if result.used
            else "no measured point counts",
            loc="left",
        )
        fix_ticks(ax)
    return figure
