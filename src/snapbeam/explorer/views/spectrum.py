"""The amplitude spectrum of what is seen of a run."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from bokeh.models import Span
from numpy.typing import NDArray

from snapbeam.explorer.look import columns, figure, legend
from snapbeam.explorer.views.part import Part, across, within

if TYPE_CHECKING:
    from snapbeam import Run

__all__ = ["Spectrum", "amplitude_spectrum"]

_Array = NDArray[np.float64]
_MOST = 2**16


def amplitude_spectrum(time: _Array, values: _Array) -> tuple[_Array, _Array]:
    """Frequencies, Hz, and amplitudes of a series whose samples need not be even, under a Hann window.

    A sine of amplitude a whose frequency is one of those returned has a peak of height a.
    """
    steps = np.diff(time)
    count = int(min(max(round((time[-1] - time[0]) / np.median(steps)) + 1, 8), _MOST))
    even = np.linspace(time[0], time[-1], count)
    series = np.interp(even, time, values)
    window = np.hanning(count)
    amplitudes = 2.0 * np.abs(np.fft.rfft((series - series.mean()) * window)) / window.sum()
    return np.fft.rfftfreq(count, even[1] - even[0]), amplitudes


class Spectrum(Part):
    """Which frequencies the beam moves at."""

    title = "Spectrum"

    def build(self) -> list[Any]:
        look = self.look
        self.sources = {
            name: columns(x=[], y=[]) for name in ("midspan_displacement", "displacement_at_striker")
        }
        self.sources["midspan_displacement"].name = self.named("spectrum")
        plot = figure(
            look, height=420, title=" ", y_axis_type="log", y_axis_label="amplitude (b)",
            x_axis_label="frequency over f₁", x_range=(0.0, 12.0), y_range=(1e-7, 1.0),
            tools="pan,box_zoom,wheel_zoom,reset", active_drag="box_zoom",
        )  # fmt: skip
        for (name, source), color, label in zip(
            self.sources.items(),
            (look.center, look.beam),
            ("beam, centre", "beam, at the striker"),
            strict=True,
        ):
            plot.line("x", "y", source=source, color=color, legend_label=label, name=name)
        legend(plot, look)
        self.drive = Span(dimension="height", line_color=look.striker, line_dash="dashed", line_width=1.2)
        self.first = Span(dimension="height", line_color=look.faint, line_dash="dotted", location=1.0)
        plot.add_layout(self.drive)
        plot.add_layout(self.first)
        self.plot = plot
        return [self.wrap(plot)]

    def show(self, run: Run, low: float, high: float) -> None:
        x, _ = across(run)
        inside = within(x, low, high)
        time, first = run.dataset["time"].values[inside], run.system.model.reference_frequency
        striker = run.system.striker
        ratio = getattr(striker.drive, "frequency_ratio", None) if striker is not None else None
        self.drive.location = ratio
        self.plot.title.text = f"Cycles {low:.4g} to {high:.4g}, Hann window; dashed: the drive, dotted: f₁"
        most = 1e-12
        for name, source in self.sources.items():
            frequency, amplitude = amplitude_spectrum(time, run.dataset[name].values[inside])
            kept = (frequency > 0.0) & (frequency <= 40.0 * first)
            source.data = {"x": frequency[kept] / first, "y": np.maximum(amplitude[kept], 1e-12)}
            most = max(most, float(amplitude[kept].max(initial=0.0)))
        self.plot.y_range.update(start=1e-7 * most, end=3.0 * most)
        self.plot.x_range.update(start=0.0, end=max(12.0, 4.0 * (ratio or 1.0)))
