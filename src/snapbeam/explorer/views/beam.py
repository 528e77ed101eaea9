"""The beam moving beside the striker, drawn in the browser from the modal amplitudes."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
import panel as pn
from bokeh.models import ColumnDataSource, CustomJS, Label, Range1d, Select, Slider, Toggle
from numpy.typing import NDArray

from snapbeam.explorer.look import figure, inner_size, sheet
from snapbeam.explorer.views.part import Part, across, within

if TYPE_CHECKING:
    from snapbeam import ReducedModel, Run

__all__ = ["BeamView"]

_POSITIONS = 121
_CONTROLS = """
.bk-btn, .bk-input { background: var(--sb-card); color: var(--sb-text); border-color: var(--sb-faint); }
.bk-btn.bk-active, .bk-btn:hover { background: var(--sb-grid); color: var(--sb-text); }
.bk-btn.bk-active { box-shadow: inset 0 -3px 0 var(--sb-accent); }
.bk-slider-title, .bk-slider-value { color: var(--sb-text); }
.noUi-target { background: var(--sb-grid); }
"""
_FRAMES = 6000
_MODES = 32
_DRAW = """
const F = frames.data, n = F.t.length;
if (n < 2) { return; }
const S = shapes.data, P = S.x.length, m = meta.data;
let a = 0, b = n - 1;
const u = Math.min(Math.max(t, F.t[0]), F.t[b]);
while (b - a > 1) { const c = (a + b) >> 1; if (F.t[c] <= u) { a = c; } else { b = c; } }
const s = (u - F.t[a]) / (F.t[b] - F.t[a]);
const w = new Float64Array(P), M = m.modes[0], h = m.half[0];
for (let i = 0; i < M; i++) {
  const q = (1 - s) * amplitudes.data.q[a * M + i] + s * amplitudes.data.q[b * M + i];
  for (let j = 0; j < P; j++) { w[j] += q * modes.data.phi[i * P + j]; }
}
const top = new Float64Array(P), low = new Float64Array(P);
for (let j = 0; j < P; j++) { top[j] = w[j] + h; low[j] = w[j] - h; }
beam.data = {x: S.x, top: top, low: low};
const tip = ((1 - s) * F.striker[a] + s * F.striker[b]) , f = F.force[a];
const side = m.side[0], far = -side * m.reach[0], e = tip - side * h, r = m.tip[0];
striker.data = {x: [[m.at[0] - r, m.at[0] - r, m.at[0], m.at[0] + r, m.at[0] + r]],
                y: [[far, e - side * m.taper[0], e, e - side * m.taper[0], far]],
                color: [f > 0 ? m.hot[0] : m.cold[0]]};
words.text = "τ = " + u.toFixed(3) + (f > 0 ? "   in contact, " + f.toPrecision(3) + " N" : "");
"""
_PLAY = """
const on = toggle.active;
toggle.label = on ? "❚❚ Pause" : "► Play";
if (!on) { return; }
let last = performance.now();
const step = (now) => {
  if (!toggle.active) { return; }
  const F = frames.data, n = F.t.length;
  if (n > 1) {
    let t = place.data.t[0], a = 0, b = n - 1;
    if (!(t >= F.t[0] && t < F.t[b])) { t = F.t[0]; }
    while (b - a > 1) { const c = (a + b) >> 1; if (F.t[c] <= t) { a = c; } else { b = c; } }
    const slow = (linger.active && F.force[a] > 0) ? 0.04 : 1.0;
    t += Math.pow(10, speed.value) * slow * Math.min(now - last, 100) / 1000;
    last = now;
    place.data = {t: [t]};
    scrub.value = Math.min(Math.max((t - F.t[0]) / (F.t[n - 1] - F.t[0]), 0), 1);
  }
  window.requestAnimationFrame(step);
};
window.requestAnimationFrame(step);
"""
_SCRUB = """
const F = frames.data;
if (!toggle.active && F.t.length > 1) {
  place.data = {t: [F.t[0] + cb_obj.value * (F.t[F.t.length - 1] - F.t[0])]};
}
"""


@lru_cache(maxsize=8)
def _shapes(model: ReducedModel, positions: int) -> NDArray[np.float64]:
    """Buckling modes along the beam, of shape (modes, positions)."""
    along = np.linspace(0.0, 1.0, positions)
    found = np.zeros((model.modes, positions))
    for at, x in enumerate(along[1:-1], 1):
        found[:, at] = model.shape_at(float(x))
    return found


class BeamView(Part):
    """Played slowly or fast, scrubbed, slowed at impacts, in true proportions or exaggerated."""

    title = "Beam"

    def build(self) -> list[Any]:
        look = self.look
        self.run: Run | None = None
        self.fresh = True
        self.count = 0
        empty: list[float] = []
        self.frames = ColumnDataSource(
            {"t": empty, "striker": empty, "force": empty}, name=self.named("frames")
        )
        self.amplitudes = ColumnDataSource({"q": empty})
        self.modes, self.shapes = ColumnDataSource({"phi": empty}), ColumnDataSource({"x": empty})
        self.meta = ColumnDataSource({"modes": [0]})
        beam = ColumnDataSource(
            {"x": empty, "top": empty, "low": empty}, syncable=False, name=self.named("beam")
        )
        striker = ColumnDataSource({"x": empty, "y": empty, "color": empty}, syncable=False)
        self.plot = figure(
            look, name=self.named("beam-plot"), height=330, title=" ",
            x_axis_label="position (mm)", y_axis_label="displacement (mm)",
            x_range=Range1d(0.0, 1.0), y_range=Range1d(-1.0, 1.0), tools="pan,wheel_zoom,reset",
        )  # fmt: skip
        self.plot.patches("x", "y", source=striker, fill_color="color", line_color=None)
        self.plot.varea("x", "low", "top", source=beam, fill_color=look.beam)
        for edge in ("top", "low"):
            self.plot.line("x", edge, source=beam, line_color=look.beam, line_width=1.5)
        words = Label(
            x=10,
            y=8,
            x_units="screen",
            y_units="screen",
            text="",
            text_color=look.text,
            text_font_size="12px",
            syncable=False,
        )
        self.plot.add_layout(words)
        self.cursor.follow(
            _DRAW, self.meta, frames=self.frames, shapes=self.shapes, amplitudes=self.amplitudes, modes=self.modes,
            meta=self.meta, beam=beam, striker=striker, words=words,
        )  # fmt: skip
        sheets = [sheet(look), _CONTROLS]
        toggle = Toggle(label="► Play", name=self.named("play"), width=90, stylesheets=sheets)
        speed = Slider(
            title="speed (log₁₀ cycles/s)",
            start=-2.0,
            end=1.5,
            value=-0.3,
            step=0.1,
            width=210,
            stylesheets=sheets,
        )
        linger = Toggle(label="slow at impacts", active=True, width=120, stylesheets=sheets)
        scrub = Slider(
            title="",
            show_value=False,
            start=0.0,
            end=1.0,
            value=0.0,
            step=0.0005,
            sizing_mode="stretch_width",
            name=self.named("scrub"),
            syncable=False,
            stylesheets=sheets,
        )
        shared = {"toggle": toggle, "frames": self.frames, "place": self.cursor.place}
        toggle.js_on_change(
            "active", CustomJS(args=shared | {"speed": speed, "linger": linger, "scrub": scrub}, code=_PLAY)
        )
        scrub.js_on_change("value", CustomJS(args=shared, code=_SCRUB))
        self.scale = Select(
            title="",
            options=["exaggerated to fit", "true proportions", "10 times", "100 times"],
            value="exaggerated to fit",
            stylesheets=sheets,
            width=160,
        )
        self.scale.on_change("value", lambda attr, old, new: self._rescale())
        self.plot.on_change("inner_width", lambda attr, old, new: self._rescale())
        controls = pn.Row(*(pn.pane.Bokeh(item) for item in (toggle, linger, speed, self.scale)), margin=0)
        return [
            self.wrap(self.plot),
            pn.pane.Bokeh(scrub, sizing_mode="stretch_width", margin=(0, 10)),
            controls,
        ]

    def show(self, run: Run, low: float, high: float) -> None:
        self.run = run
        dataset, model = run.dataset, run.system.model
        if "modal_amplitude" not in dataset or model.beam is None:
            self.plot.title.text = "A structure given by matrices has no shape to draw"
            return
        x, _ = across(run)
        inside = within(x, low, high)
        step = max(1, -(-(inside.stop - inside.start) // _FRAMES))
        part = slice(inside.start, inside.stop, step)
        kept = min(model.modes, _MODES)
        scale = 1e3 * float(dataset.attrs["length_scale"])
        force = (
            dataset["contact_force"].values[part] if "contact_force" in dataset else np.zeros(x[part].size)
        )
        along = np.linspace(0.0, 1e3 * model.beam.length, _POSITIONS)
        self.modes.data = {"phi": (1e3 * _shapes(model, _POSITIONS)[:kept]).astype(np.float32).ravel()}
        self.shapes.data = {"x": along}
        self.amplitudes.data = {
            "q": dataset["modal_amplitude"].values[part, :kept].astype(np.float32).ravel()
        }
        shown = (
            dataset["striker_displacement"].values[part]
            if "striker_displacement" in dataset
            else np.full(x[part].size, -1e3)
        )
        self.frames.data = {
            "t": x[part],
            "striker": (scale * shown).astype(np.float64),
            "force": np.nan_to_num(force),
        }
        self.reach = 1.35 * scale * max(1.0, float(np.nanmax(np.abs(dataset["midspan_displacement"].values))))
        if (
            self.fresh
        ):  # the browser draws when it is told of a change, which what comes with the figure is not
            self.fresh = False
            self.cursor.later(self._rescale, 300)
        self.plot.x_range.update(start=-0.02 * along[-1], end=1.02 * along[-1])
        self._rescale()

    def _rescale(self) -> None:
        if self.run is None or self.run.system.model.beam is None:
            return
        run, beam = self.run, self.run.system.model.beam
        length = 1e3 * beam.length
        width, height = inner_size(self.plot, (560, 270))
        fit = 0.5 * 1.04 * length * height / width
        half = {"true proportions": fit, "10 times": fit / 10.0, "100 times": fit / 100.0}.get(
            self.scale.value, self.reach
        )
        self.plot.y_range.update(start=-half, end=half)
        self.plot.title.text = f"Displacements {fit / half:.3g} times as large as lengths"
        self.count += 1
        striker = run.system.striker
        location = 0.5 if striker is None else striker.location
        side = 1 if striker is None or striker.side == "below" else -1
        self.meta.data = {
            "modes": [min(run.system.model.modes, _MODES)], "half": [0.5e3 * beam.thickness], "at": [location * length],
            "side": [side], "reach": [1e3 * half], "tip": [0.008 * length], "taper": [0.05 * half],
            "hot": [self.look.second], "cold": [self.look.striker], "count": [self.count],
        }  # fmt: skip
