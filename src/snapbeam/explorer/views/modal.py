"""Modal amplitudes over time, and how large each mode becomes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from snapbeam.explorer.look import columns, figure, fit, legend
from snapbeam.explorer.views.part import Part, across, within
from snapbeam.explorer.views.series import envelope

if TYPE_CHECKING:
    from snapbeam import Run

__all__ = ["Modal"]

_SHOWN = 6
# From Okabe and Ito, told apart by the colour-blind; the first is that of the text.
_COLORS = ("", "#E69F00", "#56B4E9", "#009E73", "#D55E00", "#CC79A7")


class Modal(Part):
    """What each buckling mode does."""

    title = "Modes"

    def build(self) -> list[Any]:
        look = self.look
        plot = figure(
            look, height=260, x_range=self.cursor.range, y_axis_label="αᵢ over α₁ of the well", y_range=(-1.5, 1.5),
            tools="xpan,xbox_zoom,xwheel_zoom,reset", active_drag="xbox_zoom", active_scroll="xwheel_zoom",
        )  # fmt: skip
        self.lines = [columns(x=[], y=[]) for _ in range(_SHOWN)]
        for at, source in enumerate(self.lines):
            color = _COLORS[at] or look.text
            plot.line("x", "y", source=source, color=color, line_width=1.2, legend_label=f"mode {at + 1}")
        legend(plot, look)
        self.cursor.attach(plot)
        self.bars = columns(mode=[], rms=[], top=[])
        self.bars.name = self.named("modal")
        low = figure(
            look, height=170, y_axis_type="log", x_axis_label="buckling mode i", y_axis_label="rms αᵢ / α₁",
            tools="reset", x_range=(0.4, 32.6), y_range=(1e-8, 1.0),
        )  # fmt: skip
        low.segment("mode", 1e-16, "mode", "rms", source=self.bars, color=look.center, line_width=2)
        low.scatter("mode", "rms", source=self.bars, color=look.center, size=6)
        self.low, self.plot = low, plot
        return [self.wrap(plot), self.wrap(low)]

    def show(self, run: Run, low: float, high: float) -> None:
        if "modal_amplitude" not in run.dataset:
            return
        x, label = across(run)
        self.plot.xaxis.axis_label = label
        well = float(np.abs(run.system.model.wells[..., 0]).max()) or 1.0
        alpha = run.dataset["modal_amplitude"].values / well
        shown = []
        for at, source in enumerate(self.lines):
            if at < alpha.shape[1]:
                inside = envelope(x, np.ascontiguousarray(alpha[:, at]), low, high, 700)
                source.data = {"x": inside[0], "y": inside[1].astype(np.float32)}
                shown.append(inside[1])
            else:
                source.data = {"x": [], "y": []}
        fit(self.plot, *shown)
        part = alpha[within(x, low, high)]
        rms = np.sqrt(np.mean((part - part.mean(axis=0)) ** 2, axis=0))
        self.bars.data = {"mode": np.arange(1, rms.size + 1), "rms": np.maximum(rms, 1e-16), "top": rms}
        most = float(rms.max(initial=1e-12)) or 1e-12
        self.low.y_range.update(start=max(1e-8 * most, 1e-16), end=3.0 * most)
        self.low.x_range.update(start=0.4, end=rms.size + 0.6)
        self.low.title.text = f"About the mean, cycles {low:.4g} to {high:.4g}"
