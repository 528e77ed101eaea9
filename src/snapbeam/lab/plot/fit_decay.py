"""A free decay and what was read from it: signal, envelope, frequency over amplitude."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

from snapbeam.lab.decay.model import envelope as law_envelope
from snapbeam.lab.decay.model import noise_level
from snapbeam.lab.decay.poles import find_poles
from snapbeam.lab.signals import check_signal
from snapbeam.lab.sine_fit import falling_window
from snapbeam.plot.style import BEAM_COLOR, CENTER_COLOR, SHAKER_COLOR, figure_style, figure_with, fix_ticks, new_figure

if TYPE_CHECKING:
    import xarray as xr

    from snapbeam.lab.decay.model import DecayFit

__all__ = ["plot_decay", "plot_stabilisation"]


_SCALE = {"m": (1e3, "mm"), "m/s": (1e3, "mm/s"), "V": (1.0, "V"), "m/s^2": (1.0, "m/s²"), "b": (1.0, "b")}


def plot_decay(signal: xr.DataArray, fit: DecayFit) -> Figure:
    """Draw a decay with its envelope, the amplitude of each cycle, and the softening of the frequency.

    Parameters
    ----------
    signal : xarray.DataArray
        The free decay.
    fit : DecayFit
        What :func:`snapbeam.lab.decay.identify.identify_decay` made of it.
    """
    samples = check_signal(signal)
    values, time, _ = samples.part((samples.time >= fit.start) & (samples.time <= fit.stop))
    scale, unit = _SCALE.get(fit.units, (1.0, fit.units))
    mode = fit.modes[0]
    rate = 2.0 * np.pi * mode.natural_frequency * mode.damping_ratio
    envelope = mode.amplitude * law_envelope(mode.damping, time - fit.start, rate)
    middle = float(values.mean())
    with figure_style():
        figure = figure_with(fit.diagnostics, "double", 105.0)
        grid = figure.add_gridspec(2, 2, height_ratios=(1.0, 1.1))
        top = figure.add_subplot(grid[0, :])
        top.plot(time, scale * (values - middle), color=BEAM_COLOR, linewidth=0.5, label="measured")
        top.plot(time, scale * envelope, color=SHAKER_COLOR, label="fitted envelope, first mode")
        top.plot(time, -scale * envelope, color=SHAKER_COLOR)
        top.set(xlabel="Time (s)", ylabel=f"Signal ({unit})", xlim=(time[0], time[-1]))
        top.legend(loc="lower right", ncols=2, bbox_to_anchor=(1.0, 1.0), borderaxespad=0.2)

        left = figure.add_subplot(grid[1, 0])
        left.semilogy(fit.envelope_time, scale * fit.envelope, ".", color=BEAM_COLOR, markersize=3)
        left.semilogy(time, scale * envelope, color=SHAKER_COLOR)
        left.set(xlabel="Time (s)", ylabel=f"Amplitude of a cycle ({unit})")
        left.set_title(f"damping ratio {mode.damping_ratio:.5f} $\\pm$ {mode.damping_ratio_se:.5f}", loc="left")

        right = figure.add_subplot(grid[1, 1])
        right.errorbar(
            scale * fit.backbone_amplitude, fit.backbone_frequency, 2.0 * fit.backbone_frequency_se,
            fmt="o", color=BEAM_COLOR, markersize=3, linewidth=0.7, capsize=1.5, label="parts of the decay",
        )  # fmt: skip
        a = np.linspace(0.0, 1.05 * float(fit.backbone_amplitude.max()), 200)
        law = mode.natural_frequency * (1.0 - mode.softening * a**2)
        right.plot(scale * a, law, color=SHAKER_COLOR, label=r"$f_0\,(1 - \kappa a^2)$")
        right.errorbar(
            [0.0], [mode.natural_frequency], [2.0 * mode.natural_frequency_se], fmt="s", color=CENTER_COLOR,
            markeredgecolor=BEAM_COLOR, markersize=4, linewidth=0.9, capsize=2.0, label="zero amplitude",
        )  # fmt: skip
        right.set(xlabel=f"Amplitude ({unit})", ylabel="Frequency (Hz)")
        right.margins(x=0.03)
        right.set_title(f"$f_0$ = {mode.natural_frequency:.3f} $\\pm$ {mode.natural_frequency_se:.3f} Hz", loc="left")
        right.legend(loc="best")
        fix_ticks(top, left, right)
    return figure


def plot_stabilisation(signal: xr.DataArray, fit: DecayFit) -> Figure:
    """Draw the poles of a decay at every order of the matrix pencil over its spectrum.

    A mode is what stays where it is from order to order (filled); the modes identified stand as lines.

    Parameters
    ----------
    signal : xarray.DataArray
        The free decay.
    fit : DecayFit
        What :func:`snapbeam.lab.decay.identify.identify_decay` made of it.
    """
    samples = check_signal(signal)
    cut = samples.part((samples.time >= fit.start) & (samples.time <= fit.stop))
    poles = fit.poles if fit.poles is not None else find_poles(cut, noise_level(cut))[1]
    n = cut.values.size
    level = np.abs(np.fft.rfft((cut.values - cut.values.mean()) * falling_window(n)))
    freq = np.fft.rfftfreq(n, 1.0 / cut.sampling_frequency)
    with figure_style():
        figure = new_figure("double", 80.0)
        ax = figure.subplots()
        back = ax.twinx()
        back.semilogy(freq[1:], level[1:] / level.max(), color="0.7", linewidth=0.6, zorder=0)
        back.set_ylabel("Spectrum (of its maximum)")
        ax.set_zorder(back.get_zorder() + 1)
        ax.patch.set_visible(False)
        # heavier ones are no modes of a beam
        light = (poles.damping_ratio > 0.0) & (poles.damping_ratio < 0.1)
        free, stable = ~poles.stable & light, poles.stable & light
        new: dict[str, Any] = {"ms": 2.5, "mfc": "none", "mec": BEAM_COLOR, "mew": 0.4, "label": "new"}
        ax.plot(poles.frequency[free], poles.order[free], "o", **new)
        ax.plot(poles.frequency[stable], poles.order[stable], "o", ms=3, color=SHAKER_COLOR, label="stable")
        for k, mode in enumerate(fit.modes):
            label = "identified" if k == 0 else None
            ax.axvline(mode.natural_frequency, color=CENTER_COLOR, linewidth=1.2, zorder=0, label=label)
        top = min(3.0 * max(mode.natural_frequency for mode in fit.modes), cut.sampling_frequency / 2.0)
        ax.set(xlabel="Frequency (Hz)", ylabel="Order", xlim=(0.0, top))
        figure.legend(loc="outside upper right", ncols=3)
        fix_ticks(ax, back)
    return figure
