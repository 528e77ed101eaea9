"""The measured motion of a shaker: start-up, amplitude cycle by cycle, spectrum."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from snapbeam.lab.signals import check_signal
from snapbeam.plot.style import BEAM_COLOR, CENTER_COLOR, SHAKER_COLOR, figure_style, figure_with, fix_ticks

if TYPE_CHECKING:
    import xarray as xr

    from snapbeam.lab.vibrometer import DriveMeasurement

__all__ = ["plot_drive"]


_SCALE = {"m/s": (1e3, "mm/s", "Velocity"), "m": (1e3, "mm", "Displacement")}


def plot_drive(signal: xr.DataArray, drive: DriveMeasurement, cycles: float = 12.0) -> Figure:
    """Draw the start of a shaker's motion with the steady sine, the amplitude of each cycle, the spectrum.

    Parameters
    ----------
    signal : xarray.DataArray
        Velocity [m/s] or displacement [m].
    drive : DriveMeasurement
        What was measured of it.
    cycles : float
        How many cycles of the start to draw.
    """
    values, time, rate = check_signal(signal)
    scale, unit, word = _SCALE[drive.units]
    fit = drive.steady
    begin = fit.start if drive.startup is None else drive.startup.onset
    with figure_style():
        figure = figure_with(drive.diagnostics, "double", 105.0)
        grid = figure.add_gridspec(2, 2, height_ratios=(1.1, 1.0))
        top = figure.add_subplot(grid[0, :])
        period = 1.0 / fit.frequency
        near = (time >= begin - 2.0 * period) & (time <= begin + cycles * period)
        shown = 1e3 * (time[near] - begin)
        top.plot(shown, scale * (values[near] - fit.offset), color=BEAM_COLOR, label="measured")
        model = fit.waveform(time[near], harmonics=not drive.clipping.found) - fit.offset
        sine = np.where(time[near] >= begin, model, np.nan)
        top.plot(shown, scale * sine, color=SHAKER_COLOR, dashes=(4, 2), label="steady sine")
        since = "start" if drive.startup is not None else "first steady cycle"
        top.set(xlabel=f"Time after the {since} (ms)", ylabel=f"{word} ({unit})", xlim=(shown[0], shown[-1]))
        top.legend(loc="lower right", ncols=2, bbox_to_anchor=(1.0, 1.0), borderaxespad=0.2)

        left = figure.add_subplot(grid[1, 0])
        left.plot(drive.cycle_time, scale * drive.cycle_amplitude, ".", color=BEAM_COLOR, markersize=2.5)
        left.axhline(scale * fit.amplitude, color=SHAKER_COLOR, dashes=(4, 2), linewidth=0.9)
        if drive.startup is not None:
            left.axvspan(begin, begin + drive.startup.duration, color=CENTER_COLOR, alpha=0.4, linewidth=0.0)
        for flaw in drive.flaws:
            low = float(time[flaw.first])
            high = float(time[min(flaw.last, time.size - 1)])
            wide = max(high - low, 0.002 * float(time[-1] - time[0]))
            left.axvspan(low, low + wide, color=SHAKER_COLOR, alpha=0.5, linewidth=0.0)
            edges = 1e3 * (low - begin), 1e3 * (high - begin)
            top.axvspan(*edges, color=SHAKER_COLOR, alpha=0.3, linewidth=0.0)
        for cut in (drive.clipping.low, drive.clipping.high):
            if np.isfinite(cut):
                top.axhline(scale * (cut - fit.offset), color=SHAKER_COLOR, linewidth=0.6, dashes=(1, 2))
        top_amplitude = 1.12 * scale * max(float(drive.cycle_amplitude.max()), fit.amplitude)
        left.set(xlabel="Time (s)", ylabel=f"Amplitude of a cycle ({unit})", ylim=(0.0, top_amplitude))
        words = "shaded: start-up" if drive.startup else "begins in motion"
        left.set_title(words + ("; red: dropouts" if drive.flaws else ""), loc="left")

        right = figure.add_subplot(grid[1, 1])
        steady = values[(time >= fit.start) & (time < fit.stop)]
        window = np.hanning(steady.size)
        spectrum = 2.0 * np.abs(np.fft.rfft((steady - steady.mean()) * window)) / window.sum()
        freq = np.fft.rfftfreq(steady.size, 1.0 / rate)
        power = 20.0 * np.log10(np.maximum(spectrum, 1e-12 * spectrum.max()) / fit.amplitude)
        right.plot(freq, power, color=BEAM_COLOR, linewidth=0.5, rasterized=freq.size > 20_000)
        count = fit.harmonic_amplitude.size
        level = 20.0 * np.log10(np.maximum(fit.harmonic_amplitude, 1e-12 * fit.amplitude) / fit.amplitude)
        multiples = fit.frequency * np.arange(1, count + 1)
        right.plot(multiples, level, "o", color=SHAKER_COLOR, markersize=3, mfc="none")
        floor = float(np.median(power))
        right.set(xlabel="Frequency (Hz)", ylabel="Level (dB of the sine)", ylim=(floor - 25.0, 5.0))
        right.set_xlim(0.0, min(rate / 2.0, fit.frequency * (count + 1.5)))
        right.set_title(
            f"SNR {fit.snr:.1f} dB, with distortion {fit.sinad:.1f} dB, THD {100.0 * fit.distortion:.2f} %", loc="right"
        )
        fix_ticks(top, left, right)
    return figure
