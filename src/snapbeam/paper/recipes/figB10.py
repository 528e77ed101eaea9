"""Fig. B.10: maximum displacement at the contact over frequency, at two drives, for 1 and 32 modes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.default_values import LONG_CYCLES
from snapbeam.paper.system import paper_map, paper_model
from snapbeam.plot.style import figure_style, fix_ticks, new_figure, panel_letters

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from snapbeam.paper.recipe import Results

LEVELS = (0.005, 0.02)
"""Low and moderate drive; the paper does not give its own.  Neither snaps through."""
_FOOT = -1.01
"""Ordinate of the markers of the maxima at the lower drive, below all curves."""
_STYLES = (("#2E7EBB", "-"), ("#B03A27", "-"))


def compute(results: Results) -> dict[str, xr.Dataset]:
    """Maximum displacement at the contact over a sweep of frequency."""
    ratio = results.pick(np.linspace(0.5, 4.0, 36), np.linspace(0.25, 4.0, 151))
    found = {}
    for modes in (1, results.pick(4, 32)):
        ds = paper_map(
            paper_model(modes), frequency_ratio=ratio, velocity_amplitude=np.array(LEVELS),
            cycles=results.pick(100, LONG_CYCLES), progress=results.progress(f"figB10, N = {modes}"),
        )  # fmt: skip
        found[f"modes_{modes}"] = ds[["max_displacement", "response_class", "status", "contact_time_fraction"]]
    return found


def maxima(ds: xr.Dataset, level: int, prominence: float = 0.1) -> list[tuple[float, float]]:
    """Local maxima (Omega, displacement) of one drive that stand out, highest first.

    *prominence* is how far they stand out at least, over the range of the curve.
    """
    from scipy.signal import find_peaks

    ratio: NDArray[np.float64] = ds.frequency_ratio.values
    curve = ds.max_displacement.values[:, level].astype(float)
    peaks, _ = find_peaks(curve, prominence=prominence * float(np.ptp(curve)))
    return sorted(((float(ratio[i]), float(curve[i])) for i in peaks), key=lambda peak: -peak[1])


def draw(results: Results) -> Figure:
    """One panel a model, with the two largest maxima of each drive marked."""
    data = results["figB10"]
    with figure_style():
        figure = new_figure("double", 62.0)
        axes = figure.subplots(1, 2, sharey=True)
        for ax, ds in zip(axes, data.values(), strict=True):
            for level, (color, line) in enumerate(_STYLES):
                drive = float(ds.velocity_amplitude[level])
                ax.plot(ds.frequency_ratio, ds.max_displacement[:, level], line, color=color, label=f"$V$ = {drive:g}")
                for ratio, height in maxima(ds, level)[:2]:
                    ax.plot(ratio, height, "v", color=color, markersize=3.5, markeredgewidth=0)
                    if level == len(_STYLES) - 1:  # no curve is above it
                        ax.annotate(
                            f"{ratio:.2f}", (ratio, height), (0, 4), textcoords="offset points", fontsize=7,
                            color=color, ha="center",
                        )  # fmt: skip
                    else:  # below all curves, under its maximum
                        ax.plot([ratio, ratio], [height, _FOOT], ":", color=color, linewidth=0.6)
                        ax.annotate(
                            f"{ratio:.2f}", (ratio, _FOOT), (0, -1), textcoords="offset points", fontsize=7,
                            color=color, ha="center", va="top",
                        )  # fmt: skip
            ax.set(xlabel=r"Excitation frequency $\Omega$", xlim=(0.0, 4.0))
            ax.set_title(f"$N$ = {int(ds.attrs['modes'])}, {int(ds.attrs['cycles'])} cycles", loc="left")
        axes[0].set_ylabel(r"Maximum displacement $w_\mathrm{b}(x_\mathrm{s})$")
        low, high = axes[0].get_ylim()
        axes[0].set_ylim(min(low, _FOOT - 0.06), high + 0.08 * (high - low))
        axes[0].legend(loc="upper left")
        fix_ticks(*axes)
        panel_letters(axes)
    return figure
