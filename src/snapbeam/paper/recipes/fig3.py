"""Fig. 3: a waveform of beam and shaker, a shallow penetration closer, and the contact force it makes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from snapbeam.paper.system import TOLERANCE, paper_run
from snapbeam.plot.style import BEAM_COLOR, SHAKER_COLOR, figure_style, fix_ticks, new_figure, panel_letters

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from snapbeam.paper.recipe import Results

FREQUENCY_RATIO, VELOCITY_AMPLITUDE = 1.21, 0.10
"""An intrawell run near the one of Fig. 5; the paper does not specify which it shows."""
_WINDOW = 6  # cycles shown


def compute(results: Results) -> dict[str, xr.Dataset]:
    """A run, sampled finely about its hardest impact after the first cycle, and that impact."""
    modes = results.pick(8, 32)
    first = paper_run(modes, FREQUENCY_RATIO, VELOCITY_AMPLITUDE, _WINDOW, tolerance=TOLERANCE)
    end = float(first.dataset.time[-1])
    later = first.impacts.isel(impact=np.flatnonzero(first.impacts.onset.values > end / _WINDOW))
    hit = later.isel(impact=[int(np.argmax(later.peak_force.values))])
    onset, duration = float(hit.onset[0]), float(hit.duration[0])
    close = np.linspace(max(onset - 0.5 * duration, 0.0), min(onset + 1.5 * duration, end), 601)
    times = np.union1d(np.linspace(0.0, end, 200 * _WINDOW + 1), close)
    run = paper_run(modes, FREQUENCY_RATIO, VELOCITY_AMPLITUDE, _WINDOW, sample_times=times, tolerance=TOLERANCE)
    names = ["displacement_at_striker", "striker_displacement", "penetration_normalised", "contact_force"]
    return {"run": run.dataset[names], "impact": hit}


def draw(results: Results) -> Figure:
    """The three panels."""
    run, hit = results["fig3"]["run"], results["fig3"]["impact"]
    cycle, time = run.cycle.values, run.time.values
    period = float(time[-1] / cycle[-1])
    onset, duration = float(hit.onset[0]), float(hit.duration[0])
    near = (time >= onset - 0.4 * duration) & (time <= onset + 1.4 * duration)
    micro = 1e6 * (time - onset)
    with figure_style():
        figure = new_figure("double", 68.0)
        grid = figure.add_gridspec(2, 2, width_ratios=(1.7, 1.0))
        wave = figure.add_subplot(grid[:, 0])
        close = figure.add_subplot(grid[0, 1])
        force = figure.add_subplot(grid[1, 1], sharex=close)
        wave.plot(cycle, run.displacement_at_striker, color=BEAM_COLOR, label=r"beam $w_\mathrm{b}(x_\mathrm{s})$")
        wave.plot(cycle, run.striker_displacement, color=SHAKER_COLOR, label=r"shaker $w_\mathrm{s}$")
        wave.set(xlabel=r"Cycles of excitation $\tau$", ylabel="Displacement $w$", xlim=(0.0, cycle[-1]))
        low, top = float(run.displacement_at_striker.min()), float(run.displacement_at_striker.max())
        wave.set_ylim(low - 0.22 * (top - low), top + 0.18 * (top - low))
        wave.legend(loc="upper right", ncols=2)
        at = onset / period
        wave.annotate(
            "B, C", (at, float(np.interp(onset, time, run.displacement_at_striker.values))), (-9, -20),
            textcoords="offset points", arrowprops={"arrowstyle": "-", "linewidth": 0.5}, ha="center",
        )  # fmt: skip
        beam, tip = run.displacement_at_striker.values[near], run.striker_displacement.values[near]
        close.fill_between(micro[near], beam, tip, where=tip >= beam, color=SHAKER_COLOR, alpha=0.25, lw=0)
        close.plot(micro[near], beam, color=BEAM_COLOR)
        close.plot(micro[near], tip, color=SHAKER_COLOR)
        deepest = int(np.argmax(tip - beam))
        close.annotate(
            "$d$", (micro[near][deepest], 0.5 * (beam + tip)[deepest]), (14, 16), textcoords="offset points",
            arrowprops={"arrowstyle": "-", "linewidth": 0.5}, va="center",
        )  # fmt: skip
        close.set_ylabel("Displacement $w$")
        close.tick_params(labelbottom=False)
        force.plot(micro[near], run.contact_force.values[near], color=BEAM_COLOR)
        force.set(xlabel=rf"Time after $\tau$ = {at:.4f} (µs)", ylabel="Contact force $f$ (N)")
        force.set_xlim(micro[near][0], micro[near][-1])
        force.set_ylim(bottom=0.0)
        figure.align_ylabels([close, force])
        fix_ticks(wave, close, force)
        panel_letters([wave, close, force])
    return figure
