"""What else a run shows: amplitudes of its modes, energies, spectrum, phase portrait."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import cmcrameri.cm as crameri
import numpy as np
from matplotlib.axes import Axes

from snapbeam.core.kinds import checked
from snapbeam.core.prefixes import scale_of
from snapbeam.core.validate import InputError, choice, integer
from snapbeam.figures.captions import caption
from snapbeam.figures.style import BEAM_COLOR, CENTER_COLOR, SHAKER_COLOR, fix_ticks, house_style, new_figure
from snapbeam.runs.run import Run
from snapbeam.runs.schema import check_trajectory

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "across",
    "dataset_of",
    "plot_energies",
    "plot_modal_amplitudes",
    "plot_phase_portrait",
    "plot_spectrum",
]

_ENERGIES = (
    ("energy_beam", "in the beam", BEAM_COLOR),
    ("energy_contact", "in the contact", SHAKER_COLOR),
    ("energy_dissipated", "dissipated", "#858585"),
    ("striker_work", "striker's work", CENTER_COLOR),
)


def dataset_of(run: Run | xr.Dataset, *needed: str) -> xr.Dataset:
    """The time series of a run, given as a run or as its dataset; refused if it lacks a variable."""
    return check_trajectory(run.dataset if isinstance(run, Run) else run, require=needed)


def across(dataset: xr.Dataset) -> tuple[str, str]:
    """The variable that a run is drawn over, and its label."""
    if "cycle" in dataset.variables:
        return "cycle", r"Cycles of excitation $\tau$"
    return "time", "Time (s)"


def _axes(ax: Axes | None, dataset: xr.Dataset) -> Axes:
    if ax is None:
        ax = new_figure("single", 66.0).add_subplot()
        ax.set_title(caption(dataset, 2), loc="left", fontsize=7)
    fix_ticks(ax)
    return ax


@checked
def plot_modal_amplitudes(run: Run | xr.Dataset, ax: Axes | None = None, *, modes: int = 5) -> Axes:
    """Draw the amplitudes of the first *modes* buckling modes, over that of the well.

    Parameters
    ----------
    run : Run or xarray.Dataset
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure one column wide by default.
    modes : int

    Returns
    -------
    matplotlib.axes.Axes
    """
    dataset = dataset_of(run, "modal_amplitude")
    count = min(integer("modes", modes, 1), dataset.sizes["mode"])
    name, label = across(dataset)
    alpha = dataset["modal_amplitude"].values
    well = _well_amplitude(dataset)
    with house_style():
        ax = _axes(ax, dataset)
        for i in range(count):
            color = crameri.batlow(0.85 * i / max(count - 1, 1))
            ax.plot(
                dataset[name],
                alpha[:, i] / (well or 1.0),
                color=color,
                label=rf"$\alpha_{{{i + 1}}}$",
                zorder=-i,
            )
        unit = r"$\alpha_i\,/\,|\alpha_1|$ in the well" if well else r"$\alpha_i$ (m$^{1/2}$)"
        ax.set(xlabel=label, ylabel=f"Modal amplitude {unit}")
        ax.margins(x=0.0)
        _legend(ax, count)
    return ax


def _well_amplitude(dataset: xr.Dataset) -> float | None:
    """Amplitude of the first mode in a well: b = 2 sqrt(2 L)/(2 pi) alpha_1, from the attributes."""
    if {"beam_length", "beam_buckling_level"} <= set(dataset.attrs):
        return float(
            np.pi * dataset.attrs["beam_buckling_level"] / np.sqrt(2.0 * dataset.attrs["beam_length"])
        )
    return None


def _legend(ax: Axes, entries: int) -> None:
    """A legend in a row above the curves, where it crosses none."""
    low, high = ax.get_ylim()
    ax.set_ylim(low, high + 0.16 * (high - low))
    ax.legend(loc="upper left", ncols=entries, columnspacing=1.0, handlelength=1.2)


@checked
def plot_energies(run: Run | xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw where the striker's work went: into the beam, the contact, and damping.

    Parameters
    ----------
    run : Run or xarray.Dataset
    ax : matplotlib.axes.Axes, optional

    Returns
    -------
    matplotlib.axes.Axes
    """
    dataset = dataset_of(run, "energy_beam")
    name, label = across(dataset)
    found = [(key, words, color) for key, words, color in _ENERGIES if key in dataset]
    factor, unit = scale_of(np.concatenate([dataset[key].values for key, _, _ in found]), "J")
    with house_style():
        ax = _axes(ax, dataset)
        for key, words, color in found:
            ax.plot(dataset[name], dataset[key] / factor, color=color, label=words)
        ax.set(xlabel=label, ylabel=f"Energy ({unit})")
        ax.margins(x=0.0)
        low, high = ax.get_ylim()
        ax.set_ylim(low, high + 0.24 * (high - low))
        ax.legend(loc="upper left", ncols=2)
    return ax


@checked
def plot_spectrum(
    run: Run | xr.Dataset,
    ax: Axes | None = None,
    *,
    variable: str = "midspan_displacement",
    window: Any = None,
) -> Axes:
    """Draw the amplitude spectrum of a run, from evenly spaced samples under a Hann window.

    Parameters
    ----------
    run : Run or xarray.Dataset
    ax : matplotlib.axes.Axes, optional
    variable : str
        A variable over time, by name.
    window : pair of float, optional
        First and last cycle to take; everything by default.

    Returns
    -------
    matplotlib.axes.Axes
        Over the excitation frequency where the run has cycles, else over hertz.
    """
    dataset = dataset_of(run, variable)
    choice(
        "variable", variable, tuple(str(key) for key in dataset.data_vars if dataset[key].dims == ("time",))
    )
    name, _ = across(dataset)
    x, y = dataset[name].values, dataset[variable].values
    if window is not None:
        inside = (x >= window[0]) & (x <= window[1])
        x, y = x[inside], y[inside]
    if x.size < 16:
        raise InputError(f"window = {window}: must hold at least 16 samples")
    even = np.linspace(x[0], x[-1], min(x.size, 1 << 17))
    y = np.interp(even, x, y)
    weight = np.hanning(even.size)
    spectrum = 2.0 * np.abs(np.fft.rfft((y - y.mean()) * weight)) / weight.sum()
    frequency = np.fft.rfftfreq(even.size, float(even[1] - even[0]))
    unit = dataset[variable].attrs.get("units", "1")
    with house_style():
        ax = _axes(ax, dataset)
        ax.plot(frequency[1:], spectrum[1:], color=BEAM_COLOR, linewidth=0.6)
        top = 12.0 if name == "cycle" else float(frequency[-1])
        shown = spectrum[1:][frequency[1:] <= top]
        ax.set(xlim=(0.0, top), yscale="log", ylim=(max(shown.max() * 1e-5, 1e-300), shown.max() * 2.0))
        ax.set_xlabel(r"Frequency $f\,/\,f_\mathrm{excitation}$" if name == "cycle" else "Frequency (Hz)")
        words = str(dataset[variable].attrs.get("long_name", variable)).replace(", over b", " over $b$")
        ax.set_ylabel(f"{words[:1].upper()}{words[1:]}{'' if unit == '1' else f' ({unit})'}")
    return ax


@checked
def plot_phase_portrait(
    run: Run | xr.Dataset, ax: Axes | None = None, *, of: str = "center", strobe: bool = True
) -> Axes:
    """Draw velocity over displacement, with a dot at each whole cycle of excitation.

    Parameters
    ----------
    run : Run or xarray.Dataset
    ax : matplotlib.axes.Axes, optional
    of : {"center", "striker"}
        The point of the beam.
    strobe : bool
        Whether to mark whole cycles.

    Returns
    -------
    matplotlib.axes.Axes
    """
    before = "center_" if choice("of", of, ("center", "striker")) == "center" else ""
    dataset = dataset_of(run, f"{before}displacement", f"{before}velocity")
    w, v = (dataset[f"{before}{name}"].values for name in ("displacement_at_striker", "velocity_at_striker"))
    with house_style():
        ax = _axes(ax, dataset)
        ax.plot(w, v, color="0.6", linewidth=0.4, rasterized=w.size > 20_000)
        if strobe and "cycle" in dataset.variables:
            cycle = dataset["cycle"].values
            whole = np.arange(np.ceil(cycle[0]), np.floor(cycle[-1]) + 1.0)
            ax.plot(
                np.interp(whole, cycle, w), np.interp(whole, cycle, v), ".", color=SHAKER_COLOR, markersize=3,
                label="whole cycles",
            )  # fmt: skip
            _legend(ax, 1)
        ax.set(xlabel="Displacement $w/b$", ylabel=r"Velocity $\dot w\,/\,b\omega_1$")
    return ax
