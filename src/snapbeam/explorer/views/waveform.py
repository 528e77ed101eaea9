"""Displacements of beam and striker, and the force between them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from snapbeam.explorer.look import columns, figure, fit, legend
from snapbeam.explorer.views.part import Part, across
from snapbeam.explorer.views.series import envelope

if TYPE_CHECKING:
    from snapbeam import Run

__all__ = ["Waveform"]

_CURVES = ("midspan_displacement", "displacement_at_striker", "striker_displacement")


class Waveform(Part):
    """Who is where, and how hard they push."""

    title = "Waveform"

    def build(self) -> list[Any]:
        look = self.look
        self.sources = {name: columns(x=[], y=[]) for name in (*_CURVES, "contact_force")}
        self.sources["midspan_displacement"].name = self.named("waveform")
        common: dict[str, Any] = {
            "x_range": self.cursor.range, "tools": "xpan,xbox_zoom,xwheel_zoom,reset",
            "active_drag": "xbox_zoom", "active_scroll": "xwheel_zoom", "output_backend": "canvas",
        }  # fmt: skip
        top = figure(
            look,
            name=self.named("waveform-plot"),
            height=265,
            y_axis_label="displacement w (b)",
            y_range=(-1.5, 1.5),
            **common,
        )
        words = ("beam, centre", "beam, at the striker", "striker")
        colors, widths = (look.center, look.beam, look.striker), (2.0, 1.0, 1.3)
        for name, label, color, width in zip(_CURVES, words, colors, widths, strict=True):
            top.line("x", "y", source=self.sources[name], color=color, line_width=width, legend_label=label)
        legend(top, look)
        low = figure(
            look,
            height=165,
            y_axis_label="contact force f (N)",
            y_range=(0.0, 1.0),
            x_axis_label="cycles of excitation τ",
            **common,
        )
        low.line("x", "y", source=self.sources["contact_force"], color=look.beam, line_width=1.2)
        for plot in (top, low):
            self.cursor.attach(plot)
        self.low, self.top = low, top
        return [self.wrap(top), self.wrap(low)]

    def show(self, run: Run, low: float, high: float) -> None:
        x, label = across(run)
        self.low.xaxis.axis_label = label
        shown = []
        for name, source in self.sources.items():
            if name in run.dataset:
                y = np.asarray(run.dataset[name].values, dtype=np.float64)
                inside = envelope(x, y, low, high)
                source.data = {"x": inside[0].astype(np.float64), "y": inside[1].astype(np.float32)}
                if name == "contact_force":
                    fit(self.low, np.append(inside[1], 0.0))
                else:
                    shown.append(inside[1])
            else:
                source.data = {"x": [], "y": []}
        fit(self.top, *shown)
