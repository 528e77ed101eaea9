"""Measured responses on a simulated map, those that disagree marked, with a table of the classes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from snapbeam.plot.map import plot_response_map
from snapbeam.plot.style import BEAM_COLOR, CENTER_COLOR, SHAKER_COLOR, figure_style, figure_with, fix_ticks
from snapbeam.sweeps.measured_points import MeasuredPoints
from snapbeam.util.validation import InputError, finite

if TYPE_CHECKING:
    import xarray as xr

    from snapbeam.lab.map_comparison import MapComparison
    from snapbeam.lab.waveform_comparison import WaveformComparison

__all__ = ["plot_map_comparison", "plot_waveform_comparison", "plot_waveform_overlay"]


_PLACES = {"displacement_at_striker": "beam at the shaker", "midspan_displacement": "beam at midspan"}
_DRAWN = ("frequency_ratio", "location", "velocity_amplitude")  # across first, then upward


def plot_map_comparison(dataset: xr.Dataset, points: MeasuredPoints, result: MapComparison) -> Figure:
    """Draw measured responses on a map, and the table of measured against simulated classes beside it.

    Points whose class differs from the class of the map are crossed out.  In the table what agrees is grey, on the diagonal,
    and what does not is red and bold, each the darker the greater its share of the measured class is.
    """
    with figure_style():
        figure = figure_with(result.diagnostics, "double", 92.0, 3)
        grid = figure.add_gridspec(1, 2, width_ratios=(1.15, 1.0))
        left = plot_response_map(dataset, figure.add_subplot(grid[0]), measurements=points)
        _mark_disagreeing(left, dataset, result)
        ax = figure.add_subplot(grid[1])
        _confusion(ax, result.confusion)
        names = [kind.label.replace(" interwell", "\ninterwell") for kind in result.classes]
        ax.set_xticks(np.arange(len(names)), names, rotation=40, ha="right", rotation_mode="anchor")
        ax.set_yticks(np.arange(len(names)), names)
        ax.set(xlabel="Simulated", ylabel="Measured")
        low, high = result.agreement_interval
        title = "No measured point counts"
        if result.used:
            title = f"{100 * result.agreement:.0f} % of {result.used} agree, × do not\n"
            title += f"(95 %: {100 * low:.0f} to {100 * high:.0f} %)"
        ax.set_title(title, loc="left")
        fix_ticks(ax)
    return figure


def _confusion(ax: Axes, counts: NDArray[np.int64]) -> None:
    """Counts of measured (rows) and simulated classes (columns), agreements and errors in two colours."""
    share = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    right = np.eye(len(counts), dtype=bool)
    for cells, colors in ((right, "Greys"), (~right, "Reds")):
        # a single error is seen too: shades begin at a quarter
        shade = np.ma.masked_where(~cells | (counts == 0), 0.25 + 0.6 * share)
        ax.imshow(shade, cmap=colors, vmin=0.0, vmax=1.0, origin="upper")
    for (i, j), value in np.ndenumerate(counts):
        error = i != j and value > 0
        color = "0.6" if value == 0 else "white" if share[i, j] > 0.6 else "black"
        weight = "bold" if error else "normal"
        ax.text(j, i, str(value), ha="center", va="center", color=color, fontweight=weight)
    ax.set_xticks(np.arange(-0.5, len(counts)), minor=True)
    ax.set_yticks(np.arange(-0.5, len(counts)), minor=True)
    ax.grid(which="minor", color="white", linewidth=1.0)
    ax.tick_params(which="minor", length=0)


def _mark_disagreeing(ax: Axes, dataset: xr.Dataset, result: MapComparison) -> None:
    """Cross out the points that count and whose class is not that of the map."""
    table = result.table
    wrong = (table["used"].values == 1) & (table["measured"].values != table["simulated"].values)
    if not wrong.any():
        return
    across, upward = (name for name in _DRAWN if name in dataset["response_class"].squeeze().dims)
    ax.plot(
        table[across].values[wrong], table[upward].values[wrong], "x", color="black", markersize=8.5,
        markeredgewidth=1.1, zorder=2.9,
    )  # fmt: skip


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
    waveforms = _inside(result, window)
    cycle = waveforms["cycle"].values
    columns = (
        ("measured", "measured_displacement", "measured_shaker", result.measured_impacts),
        ("simulated", "simulated_displacement", "simulated_shaker", result.simulated_impacts),
    )
    with figure_style():
        figure = figure_with(result.diagnostics, "double", 100.0, 3)
        axes = figure.subplots(2, 2, sharey="row", height_ratios=(1.5, 1.0))
        for i, (name, beam, shaker, impacts) in enumerate(columns):
            top, bottom = axes[0, i], axes[1, i]
            top.axhline(0.0, color="0.7", linewidth=0.5)
            top.plot(cycle, waveforms[beam], color=BEAM_COLOR, label=_PLACES[result.at])
            top.plot(cycle, waveforms[shaker], color=SHAKER_COLOR, label="shaker")
            _ticks(top, impacts, cycle, BEAM_COLOR, 0.02, "impact")
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


def _inside(result: WaveformComparison, window: tuple[float, float] | None) -> xr.Dataset:
    """The compared cycles in a window."""
    low, high = (finite("window", value) for value in window) if window else (None, None)
    waveforms = result.waveforms.sel(cycle=slice(low, high))
    if waveforms.sizes["cycle"] < 2:
        raise InputError(f"window = {window}: holds none of the compared cycles")
    return waveforms


def _ticks(
    ax: Axes, impacts: NDArray[np.float64], cycle: NDArray[np.float64], color: str, height: float, label: str
) -> None:
    """Impacts among the drawn cycles as ticks at a height of the axes."""
    shown = impacts[(impacts >= cycle[0]) & (impacts <= cycle[-1])]
    if shown.size:
        at, upward = np.full(shown.size, height), ax.get_xaxis_transform()
        ax.plot(shown, at, "|", color=color, markersize=5, transform=upward, label=label)


def plot_waveform_overlay(result: WaveformComparison, window: tuple[float, float] | None = None) -> Figure:
    """Draw a simulated run over a measured one: beams, shakers, and their difference; where they part is marked.

    With an ensemble, the band that contains 90 % of its runs is shaded.

    Parameters
    ----------
    result : WaveformComparison
    window : (float, float), optional
        First and last cycle to draw; all by default.
    """
    waveforms = _inside(result, window)
    cycle = waveforms["cycle"].values
    with figure_style():
        figure = figure_with(result.diagnostics, "double", 105.0, 3)
        top, middle, bottom = figure.subplots(3, 1, sharex=True, height_ratios=(2.0, 1.0, 1.0))
        top.axhline(0.0, color="0.8", linewidth=0.5)
        if "simulated_low" in waveforms:
            top.fill_between(
                cycle, waveforms["simulated_low"], waveforms["simulated_high"], color=SHAKER_COLOR, alpha=0.25,
                linewidth=0.0, label="90 % of the model's runs",
            )  # fmt: skip
        for ax, name, word in ((top, "displacement", _PLACES[result.at]), (middle, "shaker", "shaker")):
            ax.plot(cycle, waveforms[f"measured_{name}"], color=BEAM_COLOR, label="measured")
            ax.plot(
                cycle, waveforms[f"simulated_{name}"], color=SHAKER_COLOR, dashes=(4, 1.5), linewidth=0.8,
                label="simulated",
            )  # fmt: skip
            ax.set_ylabel(f"{word} ($b$)")
        _ticks(top, result.measured_impacts, cycle, BEAM_COLOR, 0.03, "impact, measured")
        _ticks(top, result.simulated_impacts, cycle, SHAKER_COLOR, 0.09, "impact, simulated")
        difference = waveforms["measured_displacement"] - waveforms["simulated_displacement"]
        bottom.axhspan(
            -result.apart, result.apart, color=CENTER_COLOR, alpha=0.35, linewidth=0.0,
            label=rf"within {result.apart:.2g} $b$",
        )  # fmt: skip
        bottom.plot(cycle, difference, color=BEAM_COLOR, linewidth=0.7)
        bottom.set(xlabel=r"Cycles of excitation $\tau$", ylabel="difference ($b$)", xlim=(cycle[0], cycle[-1]))
        if cycle[0] <= result.parted <= cycle[-1]:
            for ax in (top, middle, bottom):
                ax.axvline(result.parted, color="0.45", linewidth=0.8, dashes=(2, 2))
        parted = "they never part" if np.isnan(result.parted) else f"they part at cycle {result.parted:.1f}"
        top.set_title(
            f"{parted}; RMS difference {result.rms_difference:.3f} $b$, correlation {result.correlation:.3f}"
            + ("" if np.isnan(result.within) else f"; {100.0 * result.within:.0f} % of the samples in the band"),
            loc="left",
        )
        parts = [ax.get_legend_handles_labels() for ax in (top, bottom)]
        handles, labels = ([*one, *other] for one, other in zip(*parts, strict=True))
        figure.legend(handles, labels, loc="outside upper right", ncols=len(labels))
        figure.align_ylabels((top, middle, bottom))
        fix_ticks(top, middle, bottom)
    return figure
