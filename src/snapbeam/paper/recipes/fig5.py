"""Fig. 5: a snap-through at Omega = 1.21, V = 0.18: waveform, shapes of the beam, modes, modal amplitudes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.default_values import MODES
from snapbeam.paper.system import TOLERANCE, paper_model, paper_run, shapes_along
from snapbeam.plot.style import BEAM_COLOR, SHAKER_COLOR, figure_style, fix_ticks, new_figure, panel_letters
from snapbeam.util.validation import InputError

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from snapbeam.paper.recipe import Results

_Array = NDArray[np.float64]

FREQUENCY_RATIO, VELOCITY_AMPLITUDE = 1.21, 0.18
_CYCLES = 16
_SAMPLES = 400  # a cycle
_MODE_COLORS = ("#000000", "#B03A27", "#2E7EBB", "#E0A030")
_HALF_WAY = 0.5
"""Displacement of the centre, in b, at the first and the last snapshot."""
_AROUND = 0.9  # cycles shown before and after the snap-through


def compute(results: Results) -> dict[str, xr.Dataset]:
    """The run over the cycles shown, and the shapes along the beam."""
    from snapbeam.util.datasets import xr

    modes = MODES  # a sketch too: with half of them the beam does not snap within these cycles
    model = paper_model(modes)
    period = 1.0 / (FREQUENCY_RATIO * model.reference_frequency)
    times = np.linspace(0.0, _CYCLES * period, _CYCLES * _SAMPLES + 1)
    run = paper_run(modes, FREQUENCY_RATIO, VELOCITY_AMPLITUDE, _CYCLES, sample_times=times, tolerance=TOLERANCE)
    names = [
        "displacement_at_striker",
        "midspan_displacement",
        "striker_displacement",
        "contact_force",
        "modal_amplitude",
    ]
    x, shapes = shapes_along(model, 161)
    along = xr.Dataset(
        {"shape": (("position", "mode"), shapes, {"units": "m^0.5", "long_name": "buckling modes phi"})},
        {"position": ("position", x, {"units": "L"}), "mode": run.dataset.mode},
        {"length_scale": model.length_scale, "rest_amplitude": float(model.well_amplitude[0])},
    )
    return {"run": run.dataset[names], "shapes": along}


def snap_times(run: xr.Dataset) -> _Array:
    """Times, s, at which the first modal amplitude passes zero, interpolated between samples."""
    first, time = run.modal_amplitude.values[:, 0].astype(float), run.time.values
    at = np.flatnonzero(np.sign(first[:-1]) * np.sign(first[1:]) < 0)
    share = first[at] / (first[at] - first[at + 1])
    return np.asarray(time[at] + share * (time[at + 1] - time[at]))


def draw(results: Results) -> Figure:
    """The four panels."""
    run, along = results["fig5"]["run"], results["fig5"]["shapes"]
    cycle, time = run.cycle.values, run.time.values
    period = float(time[-1] / cycle[-1])
    snaps = snap_times(run)
    if snaps.size == 0:
        raise InputError("fig5: the run does not snap through, so that there is nothing to show")
    first = snaps[0] / period
    inside = snaps[snaps < snaps[0] + 0.5 * period] / period
    marks = _instants(cycle, run.midspan_displacement.values.astype(float), inside)
    rest = abs(float(along.attrs["rest_amplitude"]))
    with figure_style():
        figure = new_figure("double", 125.0)
        rows = figure.add_gridspec(2, 1, height_ratios=(1.15, 1.0))
        upper = rows[0].subgridspec(1, 2, width_ratios=(1.4, 1.0))
        lower = rows[1].subgridspec(1, 2, width_ratios=(1.0, 1.4))
        wave, snapshots = (figure.add_subplot(upper[at]) for at in range(2))
        modes, amplitudes = (figure.add_subplot(lower[at]) for at in range(2))
        _waveform(wave, run, marks, first)
        _snapshots(snapshots, run, along, marks)
        _modes(modes, along)
        _amplitudes(amplitudes, run, marks, first, rest)
        fix_ticks(wave, snapshots, modes, amplitudes)
        panel_letters([wave, snapshots, modes, amplitudes])
    return figure


def _instants(cycle: _Array, w: _Array, zeros: _Array) -> _Array:
    """Instants of the snapshots, from half way out of the first well to half way into the other well."""
    before = np.flatnonzero((cycle < zeros[0]) & (w < -_HALF_WAY))
    after = np.flatnonzero((cycle > zeros[-1]) & (w > _HALF_WAY))
    begin = cycle[before[-1]] if before.size else max(zeros[0] - 0.15, cycle[0])
    end = cycle[after[0]] if after.size else min(zeros[-1] + 0.15, cycle[-1])
    last = zeros[-1] if zeros.size > 1 else 0.5 * (zeros[0] + end)
    return np.array([begin, zeros[0], last, end])


def _waveform(ax: Axes, run: xr.Dataset, marks: _Array, first: float) -> None:
    cycle, w = run.cycle.values, run.midspan_displacement.values
    ax.plot(cycle, w, color=BEAM_COLOR, label="beam, centre")
    ax.plot(cycle, run.striker_displacement, color=SHAKER_COLOR, label=r"shaker $w_\mathrm{s}$")
    ax.set(xlabel=r"Cycles of excitation $\tau$", ylabel="Displacement $w$", xlim=(cycle[0], cycle[-1]))
    ax.set_ylim(-1.35, 2.0)
    ax.legend(loc="upper right", ncols=2)
    _numbers(ax, cycle, w, marks)
    start = max(np.floor(first) - 3.0, 0.0)
    inset = ax.inset_axes((0.09, 0.52, 0.34, 0.38))
    part = (cycle >= start) & (cycle <= start + 1.0)
    high = w[part] >= np.quantile(w[part], 0.35)
    inset.plot(cycle[part], w[part], color=BEAM_COLOR, linewidth=0.7)
    inset.set(xlim=(start, start + 1.0), ylim=(w[part][high].min(), w[part].max() + 0.02))
    inset.tick_params(labelsize=6, width=0.5, length=2)
    ax.indicate_inset_zoom(inset, edgecolor="0.4", linewidth=0.5)


def _numbers(ax: Axes, cycle: _Array, curve: _Array, marks: _Array) -> None:
    offsets = ((-7, 2), (-6, 6), (6, -7), (7, -3))
    for number, (at, offset) in enumerate(zip(marks, offsets, strict=True), 1):
        y = float(np.interp(at, cycle, curve))
        ax.plot(at, y, "o", markersize=2.5, color=SHAKER_COLOR, markeredgewidth=0)
        ax.annotate(str(number), (at, y), offset, textcoords="offset points", fontsize=7, ha="center", va="center")


def _snapshots(ax: Axes, run: xr.Dataset, along: xr.Dataset, marks: _Array) -> None:
    x, shapes, scale = along.position.values, along["shape"].values, float(along.attrs["length_scale"])
    alpha, cycle = run.modal_amplitude.values, run.cycle.values
    ax.axhline(0.0, color="0.7", linewidth=0.5)
    styles = (("-", "0.0"), ("--", "#B03A27"), ("-.", "#2E7EBB"), (":", "0.35"))
    for number, (at, (dashes, color)) in enumerate(zip(marks, styles, strict=True), 1):
        now = np.array([np.interp(at, cycle, column) for column in alpha.T])
        ax.plot(x, shapes @ now / scale, dashes, color=color, label=str(number), linewidth=1.2)
    ax.set(xlabel="Position $x/L$", ylabel="Displacement $w$", xlim=(0.0, 1.0))
    ax.legend(loc="upper left", ncols=4, handlelength=1.8, columnspacing=0.8)
    low, high = ax.get_ylim()
    ax.set_ylim(low, high + 0.18 * (high - low))


def _modes(ax: Axes, along: xr.Dataset) -> None:
    x, shapes = along.position.values, along["shape"].values
    ax.axhline(0.0, color="0.7", linewidth=0.5)
    for i in range(min(3, shapes.shape[1])):
        ax.plot(x, shapes[:, i] / np.abs(shapes[:, 0]).max(), color=_MODE_COLORS[i], label=rf"$\phi_{i + 1}$")
    ax.set(xlabel="Position $x/L$", ylabel=r"Buckling mode $\phi_i\,/\,\phi_1(L/2)$", xlim=(0.0, 1.0))
    ax.legend(loc="upper right", ncols=1)


def _amplitudes(ax: Axes, run: xr.Dataset, marks: _Array, first: float, rest: float) -> None:
    cycle, alpha = run.cycle.values, run.modal_amplitude.values.astype(float) / rest
    near = (cycle >= first - _AROUND) & (cycle <= marks[2] + _AROUND)
    others = np.sqrt(np.sum(alpha[:, 1:] ** 2, axis=1))
    band = ax.fill_between(
        cycle[near], 0.0, 1.0, where=(others > np.abs(alpha[:, 0]))[near], color="0.88", lw=0,
        transform=ax.get_xaxis_transform(), label=r"$|\alpha_1|$ less than the rest",
    )  # fmt: skip
    for i in range(min(4, alpha.shape[1])):
        ax.plot(cycle[near], alpha[near, i], color=_MODE_COLORS[i], label=rf"$\alpha_{i + 1}$")
    _numbers(ax, cycle, alpha[:, 0], marks)
    ax.set(xlabel=r"Cycles of excitation $\tau$", ylabel=r"Modal amplitude $\alpha_i\,/\,|\alpha_1(0)|$")
    ax.set_xlim(cycle[near][0], cycle[near][-1])
    ax.add_artist(ax.legend(handles=[band], loc="lower right", handlelength=1.0))
    ax.legend(handles=ax.lines[:4], loc="upper left", ncols=2, columnspacing=0.8, handlelength=1.4)
