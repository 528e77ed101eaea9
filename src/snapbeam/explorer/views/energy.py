"""The energy ledger: what the striker put in, where it is, what was lost."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import panel as pn

from snapbeam.explorer.look import columns, figure, fit, legend
from snapbeam.explorer.views.part import Part, across
from snapbeam.explorer.views.series import envelope

if TYPE_CHECKING:
    from snapbeam import Run

__all__ = ["Energy"]

_CURVES = {
    "striker_work": "work of the striker",
    "energy_dissipated": "dissipated",
    "energy_beam": "in the beam, above its well",
    "energy_contact": "in the contact",
}


class Energy(Part):
    """Work, what became of it, and whether the books balance."""

    title = "Energy"

    def build(self) -> list[Any]:
        look = self.look
        colors = (look.striker, look.faint, look.center, look.second)
        self.sources = {name: columns(x=[], y=[]) for name in _CURVES}
        self.sources["striker_work"].name = self.named("energy")
        self.plot = figure(
            look, height=360, x_range=self.cursor.range, y_axis_label="energy (µJ)", y_range=(0.0, 1.0),
            tools="xpan,xbox_zoom,xwheel_zoom,reset", active_drag="xbox_zoom", active_scroll="xwheel_zoom",
        )  # fmt: skip
        for (name, label), color in zip(_CURVES.items(), colors, strict=True):
            self.plot.line(
                "x", "y", source=self.sources[name], color=color, line_width=1.4, legend_label=label
            )
        legend(self.plot, look)
        self.cursor.attach(self.plot)
        self.words = pn.pane.HTML("", sizing_mode="stretch_width")
        return [self.wrap(self.plot), self.words]

    def show(self, run: Run, low: float, high: float) -> None:
        dataset = run.dataset
        x, label = across(run)
        self.plot.xaxis.axis_label = label
        shown = []
        for name, source in self.sources.items():
            if name in dataset:
                inside = envelope(x, dataset[name].values, low, high)
                source.data = {"x": inside[0], "y": (1e6 * inside[1]).astype(np.float32)}
                shown.append(1e6 * inside[1])
        fit(self.plot, *shown)
        if all(name in dataset for name in _CURVES):
            begun = float(dataset["energy_beam"][0] + dataset["energy_contact"][0])
            parts = {name: float(dataset[name][-1]) for name in _CURVES}
            left = (
                parts["striker_work"] + begun - sum(parts[name] for name in _CURVES if name != "striker_work")
            )
            scale = max(abs(parts["striker_work"]), parts["energy_dissipated"], 1e-300)
            barrier = run.system.model.saddle_energy - run.system.model.well_energy
            self.words.object = (
                f'<p class="note">At the end the books balance to {left:.2g} J, {abs(left) / scale:.1g} of the work. '
                f"The barrier between the wells is {1e6 * barrier:.4g} µJ.</p>"
            )
