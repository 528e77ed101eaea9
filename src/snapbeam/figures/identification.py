"""A free decay and what was read from it: signal, envelope, frequency over amplitude."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from snapbeam.figures.style import BEAM_COLOR, CENTER_COLOR, SHAKER_COLOR, fix_ticks, house_style, new_figure
from snapbeam.lab.signals.signal import check_signal

if TYPE_CHECKING:
    import xarray as xr

    from snapbeam.lab.decay.model import DecayFit

__all__ = ["plot_decay"]

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
    part = (samples.time >= fit.start) & (samples.time <= fit.stop)
    time, values = samples.time[part], samples.values[part]
    scale, unit = _SCALE.get(fit.units, (1.0, fit.units))
    mode = fit.modes[0]
    rate = 2.0 * np.pi * mode.natural_freq * mode.damping_ratio
    envelope = mode.amplitude * np.exp(-rate * (time - fit.start))
    middle = float(values.mean())
    with house_style():
        figure = new_figure("double", 105.0)
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
        left.set_title(
            f"damping ratio {mode.damping_ratio:.5f} $\\pm$ {mode.damping_ratio_se:.5f}", loc="left"
        )

        right = figure.add_subplot(grid[1, 1])
        right.errorbar(
            scale * fit.backbone_amplitude, fit.backbone_freq, 2.0 * fit.backbone_freq_se,
            fmt="o", color=BEAM_COLOR, markersize=3, linewidth=0.7, capsize=1.5, label="parts of the decay",
        )  # fmt: skip
        a = np.linspace(0.0, 1.05 * float(fit.backbone_amplitude.max()), 200)
        law = mode.natural_freq * (1.0 - mode.softening * a**2)
        right.plot(scale * a, law, color=SHAKER_COLOR, label=r"$f_0\,(1 - \kappa a^2)$")
        right.errorbar(
            [0.0], [mode.natural_freq], [2.0 * mode.natural_freq_se], fmt="s", color=CENTER_COLOR,
            markeredgecolor=BEAM_COLOR, markersize=4, linewidth=0.9, capsize=2.0, label="zero amplitude",
        )  # fmt: skip
        right.set(xlabel=f"Amplitude ({unit})", ylabel="Frequency (Hz)")
        right.margins(x=0.03)
        right.set_title(f"$f_0$ = {mode.natural_freq:.3f} $\\pm$ {mode.natural_freq_se:.3f} Hz", loc="left")
        right.legend(loc="lower left")
        fix_ticks(top, left, right)
    return figure
