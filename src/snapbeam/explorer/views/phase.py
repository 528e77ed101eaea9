"""The phase portrait and the stroboscopic section."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import panel as pn
from bokeh.models import ColumnDataSource
from bokeh.transform import linear_cmap

from snapbeam.explorer.look import blend, columns, figure
from snapbeam.explorer.views.part import Part, across, within

if TYPE_CHECKING:
    from snapbeam import Run

__all__ = ["Phase"]

_MOST = 16_000
_FOLLOW = """
const c = source.data.t;
let a = 0, b = c.length - 1;
if (b < 1 || t < c[0] || t > c[b]) { dot.data = {w: [], v: []}; return; }
while (b - a > 1) { const m = (a + b) >> 1; if (c[m] <= t) { a = m; } else { b = m; } }
dot.data = {w: [source.data.w[a]], v: [source.data.v[a]]};
"""


class Phase(Part):
    """Displacement against velocity, all of it and once a cycle."""

    title = "Phase"

    def build(self) -> list[Any]:
        look = self.look
        self.run: Run | None = None
        self.span = (0.0, 1.0)
        self.where = pn.widgets.RadioButtonGroup(
            name="Of", options={"centre": "center_", "at the striker": ""}, value="center_", button_type="default"
        )  # fmt: skip
        self.phase = pn.widgets.FloatSlider(
            name="Section at the phase (cycles)", start=0.0, end=1.0, step=0.01, value=0.0, width=240
        )
        self.line, self.dots = columns(t=[], w=[], v=[]), columns(t=[], w=[], v=[])
        self.dots.name = self.named("section")
        dot = ColumnDataSource({"w": [], "v": []}, syncable=False)
        plots = [
            figure(look, height=370, tools="pan,box_zoom,wheel_zoom,reset", x_range=(-1.6, 1.6), y_range=(-1.6, 1.6),
                   title=title, x_axis_label="displacement w (b)", y_axis_label="velocity (b ω₁)", min_border_left=50)
            for title in ("Phase portrait", "Stroboscopic section")
        ]  # fmt: skip
        plots[0].line("w", "v", source=self.line, color=look.center, line_width=0.8)
        plots[0].scatter("w", "v", source=dot, size=9, color=look.accent)
        palette = blend(look.accent, look.striker)
        colors = linear_cmap("t", palette, 0.0, 1.0)
        self.mapper = colors.transform
        plots[1].scatter("w", "v", source=self.dots, size=5, color=colors)
        plots[1].x_range, plots[1].y_range = plots[0].x_range, plots[0].y_range
        self.section = plots[1]
        self.cursor.follow(_FOLLOW, source=self.line, dot=dot)
        self.where.param.watch(lambda _: self.cursor.later(self._draw, 1), "value")
        self.phase.param.watch(lambda _: self.cursor.later(self._draw, 1), "value_throttled")
        return [
            pn.Row(self.where, self.phase, margin=0),
            pn.Row(*(self.wrap(plot) for plot in plots), sizing_mode="stretch_width"),
        ]

    def show(self, run: Run, low: float, high: float) -> None:
        self.run, self.span = run, (low, high)
        self._draw()

    def _draw(self) -> None:
        if self.run is None:
            return
        dataset, before = self.run.dataset, self.where.value
        x, _ = across(self.run)
        inside = within(x, *self.span)
        step = max(1, -(-(inside.stop - inside.start) // _MOST))
        w, v = (
            dataset[f"{before}{name}"].values for name in ("displacement_at_striker", "velocity_at_striker")
        )
        part = slice(inside.start, inside.stop, step)
        for axis_range, values in ((self.section.x_range, w[inside]), (self.section.y_range, v[inside])):
            good = values[np.isfinite(values)]
            room = 0.06 * float(np.ptp(good)) or 0.1
            axis_range.update(start=float(good.min()) - room, end=float(good.max()) + room)
        self.line.data = {"t": x[part], "w": w[part], "v": v[part]}
        if "cycle" not in dataset.variables:
            self.dots.data = {"t": [], "w": [], "v": []}
            return
        at = np.arange(np.ceil(max(self.span[0], x[0])), min(self.span[1], x[-1]) + 1e-9) + self.phase.value
        at = at[at <= x[-1] + 1e-9]
        self.mapper.update(low=self.span[0], high=max(self.span[1], self.span[0] + 1.0))
        self.section.title.text = f"Section, {at.size} cycles, blue to red"
        self.dots.data = {"t": at, "w": np.interp(at, x, w), "v": np.interp(at, x, v)}
