"""One run: what it is in a line, and its views."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
import panel as pn
from bokeh import models
from bokeh.core.properties import value as constant
from bokeh.palettes import interp_palette
from bokeh.transform import linear_cmap
from markupsafe import Markup
from numpy.typing import NDArray

from snapbeam import STATISTICS, ResponseClass, RunStatus
from snapbeam.explorer import style
from snapbeam.plot.dataset import figures_of
from snapbeam.util.si_prefixes import scale_of

if TYPE_CHECKING:
    import xarray as xr

    from snapbeam import ReducedModel, Run

# ----------------------------------------------------------------------------------------------------
# What every view of a run is: built when it is first looked at, filled when there is a run to show.


_ROUNDED = 1e-9


class RunPanel:
    """One view of a run, with the *title* of its tab; ``place`` is empty until :meth:`build`."""

    title = ""
    picture = "run"
    """The figure of a run that shows the same in a file."""

    def __init__(self, look: style.Look, cursor: style.Cursor) -> None:
        self.look, self.cursor = look, cursor
        self.place = pn.Column(sizing_mode="stretch_width", margin=0)
        self.built = False

    def activate(self) -> None:
        """Build it, the first time."""
        if not self.built:
            self.built = True
            parts = self.build()
            for part in parts:  # before they are on the page, not after
                if hasattr(part, "select"):
                    style.styled(part, self.look)
            self.place.objects = parts

    def build(self) -> list[Any]:
        """Return the models of the panel."""
        raise NotImplementedError

    def show(self, run: Run, low: float, high: float) -> None:
        """Show a run from *low* to *high*, in cycles or seconds."""
        raise NotImplementedError

    def over_time(self, **options: Any) -> Any:
        """A figure over the common range of time, with the cursor."""
        tools: dict[str, Any] = {
            "tools": "xpan,xbox_zoom,xwheel_zoom,reset",
            "active_drag": "xbox_zoom",
            "active_scroll": "xwheel_zoom",
        }
        plot = style.figure(self.look, x_range=self.cursor.range, **tools, **options)
        self.cursor.attach(plot)
        return plot

    def scales(self, run: Run) -> tuple[float, float, float]:
        """Factors of the displacements, velocities and frequency ratios that are shown: mm, mm/s and Hz, or 1."""
        if not self.look.physical:
            return 1.0, 1.0, 1.0
        length, first = 1e3 * run.system.scale.length, run.system.model.reference_frequency
        return length, length * run.system.scale.omega, first

    def curves(self, plot: Any, sources: Iterable[Any], series: list[Any], run: Run, low: float, high: float) -> None:
        """Draw some series from *low* to *high*, None for those that the run has not, and let the figure show all."""
        x, plot.xaxis.axis_label = across(run)
        shown = []
        for source, item, values in zip(sources, plot.legend[0].items, series, strict=True):
            item.visible = values is not None
            own = [] if values is None else [envelope(x, values, low, high)]
            source.data = _curve(own)
            shown += [y for _, y in own]
        style.fit(plot, *shown)

    @property
    def units(self) -> tuple[str, str, str]:
        """Labels of those displacements, velocities and frequencies."""
        if self.look.physical:
            return "mm", "mm/s", "frequency (Hz)"
        return "b", "b ω₁", "frequency over f₁"

    def named(self, name: str) -> str:
        """The name of something in this view, another one in each of two runs."""
        return f"{name}{self.cursor.suffix}"

    def wrap(self, plot: Any) -> Any:
        """A figure in the page."""
        return style.framed_plot(plot, margin=(0, 0, 4, 0))


def across(run: Run) -> tuple[NDArray[np.float64], str]:
    """Abscissa of time plots, and its label."""
    if "cycle" in run.dataset.variables:
        return run.dataset["cycle"].values, "cycles of excitation τ"
    return run.dataset["time"].values, "time (s)"


def within(x: NDArray[np.float64], low: float, high: float) -> slice:
    """The samples from *low* to *high*, at least two; one that rounding has put beyond an end is in."""
    low, high = low - _ROUNDED * abs(low), high + _ROUNDED * abs(high)
    first, last = int(np.searchsorted(x, low)), int(np.searchsorted(x, high, side="right"))
    if last - first < 2:
        first, last = max(first - 1, 0), min(first + 2, x.size)
    return slice(first, last)


# ----------------------------------------------------------------------------------------------------
# The beam moving beside the striker, drawn in the browser from the modal amplitudes.


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
const S_ = {x: [], y: [], color: []}, f = F.force[a], r = m.tip[0], K = m.at[0].length;
for (let k = 0; k < K; k++) {
  const at = m.at[0][k], side = m.side[0][k], tips = rods.data.tip;
  const e = (1 - s) * tips[a * K + k] + s * tips[b * K + k] - side * h, far = -side * m.reach[0];
  S_.x.push([at - r, at - r, at, at + r, at + r]);
  S_.y.push([far, e - side * m.taper[0], e, e - side * m.taper[0], far]);
  S_.color.push(rods.data.force[a * K + k] > 0 ? m.hot[0] : m.cold[0]);
}
striker.data = S_;
const said = "τ = " + u.toFixed(3) + (f > 0 ? "   in contact, " + f.toPrecision(3) + " N" : "");
for (const label of words) { label.text = said; }
"""
_PLAY = """
const on = toggle.active;
toggle.label = on ? "❚❚ Pause" : "► Play";
if (!on) { return; }
let last = performance.now();
const step = (now) => {
  if (!toggle.active) { return; }
  if (now - last < 28) { window.requestAnimationFrame(step); return; }  // a beam needs no more than 30 pictures a second
  const F = frames.data, n = F.t.length;
  if (n > 1) {
    let t = place.data.t[0], a = 0, b = n - 1;
    if (!(t > F.t[0] && t < F.t[b])) { t = Math.max(F.t[0], meta.data.begin[0]); }
    while (b - a > 1) { const c = (a + b) >> 1; if (F.t[c] <= t) { a = c; } else { b = c; } }
    const slow = (linger.active && F.force[a] > 0) ? 0.04 : 1.0;
    t += parseFloat(speed.value) * slow * Math.min(now - last, 100) / 1000;
    place.data = {t: [t]};
    scrub.value = Math.min(Math.max((t - F.t[0]) / (F.t[n - 1] - F.t[0]), 0), 1);
  }
  last = now;
  window.requestAnimationFrame(step);
};
window.requestAnimationFrame(step);
"""
_BEGIN = """
if (toggle.tags.length || frames.data.t.length < 2) { return; }
toggle.tags = [1];
toggle.active = !window.matchMedia('(prefers-reduced-motion: reduce)').matches;
"""
"""The first run of a page is played at once."""
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


class BeamPanel(RunPanel):
    """Played slowly or fast, scrubbed, slowed at impacts, in true proportions or exaggerated."""

    title = "Beam"

    def build(self) -> list[Any]:
        """Return the models of this view."""
        look = self.look
        self.run: Run | None = None
        self.begin = 0.0
        """Start of the playback: half a cycle before the first snap-through."""
        self.fresh = True
        self.has_shape = True
        self.count = 0
        empty: list[float] = []
        self.frames = models.ColumnDataSource({"t": empty, "force": empty}, name=self.named("frames"))
        self.rods = models.ColumnDataSource({"tip": empty, "force": empty}, name=self.named("rods"))
        self.amplitudes = models.ColumnDataSource({"q": empty})
        self.modes, self.shapes = (models.ColumnDataSource({"phi": empty}), models.ColumnDataSource({"x": empty}))
        self.meta = models.ColumnDataSource({"modes": [0]}, name=self.named("beam-meta"))
        beam = models.ColumnDataSource(
            {"x": empty, "top": empty, "low": empty}, syncable=False, name=self.named("beam")
        )
        striker = models.ColumnDataSource({"x": empty, "y": empty, "color": empty}, syncable=False)
        self.supports = models.ColumnDataSource(
            {"left": empty, "right": empty, "low": empty, "top": empty}, name=self.named("supports")
        )
        ranges: dict[str, Any] = {"x_range": models.Range1d(0.0, 1.0), "y_range": models.Range1d(-1.0, 1.0)}
        self.plot = style.figure(
            look, name=self.named("beam-plot"), height=330, used=330, title=" ", tools="pan,wheel_zoom,reset",
            x_axis_label="position (mm)", y_axis_label="displacement (mm)", **ranges,
        )  # fmt: skip
        self.small = style.figure(
            look, name=self.named("beam-small"), height=130, used=255, share=0.3, tools="", y_axis_label="w (mm)",
            **style.BELOW, **ranges,
        )  # fmt: skip
        """The same below the waveform."""
        words = []
        for plot in (self.plot, self.small):
            plot.patches("x", "y", source=striker, fill_color="color", line_color=None)
            plot.varea("x", "low", "top", source=beam, fill_color=look.beam)
            for edge in ("top", "low"):
                plot.line("x", edge, source=beam, line_color=look.beam, line_width=2.5)
            plot.quad(
                "left", "right", "low", "top", source=self.supports, fill_color=look.grid, line_color=look.faint,
                hatch_pattern="/", hatch_color=look.faint,
            )  # fmt: skip
            words.append(models.Label(
                x=10, y=8, x_units="screen", y_units="screen", text="", text_color=look.text, text_font_size=look.font(12), syncable=False
            ))  # fmt: skip
            plot.add_layout(words[-1])
        self.cursor.follow(
            _DRAW, self.meta, frames=self.frames, shapes=self.shapes, amplitudes=self.amplitudes, modes=self.modes,
            meta=self.meta, beam=beam, striker=striker, rods=self.rods, words=words,
        )  # fmt: skip
        sheets = [style.sheet(look), _CONTROLS]
        self.play = toggle = models.Toggle(
            label="► Play", name=self.named("play"), width=90, stylesheets=sheets, syncable=False
        )
        rates = ["0.02", "0.1", "0.3", "1", "3", "10"]
        speed = models.Select(title="cycles per second", options=rates, value="1", width=120, stylesheets=sheets)
        linger = models.Toggle(label="slow at impacts", active=False, width=120, stylesheets=sheets)
        scrub = models.Slider(
            title="", show_value=False, start=0.0, end=1.0, value=0.0, step=0.0005, sizing_mode="stretch_width",
            name=self.named("scrub"), syncable=False, stylesheets=sheets,
        )  # fmt: skip
        shared = {"toggle": toggle, "frames": self.frames, "place": self.cursor.place}
        playing = shared | {"speed": speed, "linger": linger, "scrub": scrub, "meta": self.meta}
        toggle.js_on_change("active", models.CustomJS(args=playing, code=_PLAY))
        if not self.cursor.suffix:
            self.meta.js_on_change("data", models.CustomJS(args=shared, code=_BEGIN))
        scrub.js_on_change("value", models.CustomJS(args=shared, code=_SCRUB))
        scales = ["exaggerated to fit", "true proportions", "10 times", "100 times"]
        self.scale = models.Select(title="", options=scales, value=scales[0], stylesheets=sheets, width=160)
        self.scale.on_change("value", lambda attr, old, new: self._rescale())
        self.plot.on_change("inner_width", lambda attr, old, new: self._rescale())
        controls = pn.FlexBox(*(pn.pane.Bokeh(item) for item in (toggle, linger, speed, self.scale)), margin=0)
        return [self.wrap(self.plot), pn.pane.Bokeh(scrub, sizing_mode="stretch_width", margin=(0, 10)), controls]

    def show(self, run: Run, low: float, high: float) -> None:
        """Show a run between two cycles."""
        self.run = run
        dataset, model = run.dataset, run.system.model
        self.has_shape = "modal_amplitude" in dataset and model.beam is not None
        if not self.has_shape or model.beam is None:
            self.plot.title.text = "A structure given by matrices has no shape to draw"
            return
        x, _ = across(run)
        inside = within(x, low, high)
        step = max(1, -(-(inside.stop - inside.start) // _FRAMES))
        part = slice(inside.start, inside.stop, step)
        kept = min(model.modes, _MODES)
        scale = 1e3 * float(dataset.attrs["length_scale"])
        tips, forces = (
            _columns_of(dataset, plural if plural in dataset else single)[part]
            if single in dataset
            else np.zeros((x[part].size, 0))
            for single, plural in (
                ("striker_displacement", "striker_displacements"), ("contact_force", "striker_forces")
            )
        )  # fmt: skip
        along = np.linspace(0.0, 1e3 * model.beam.length, _POSITIONS)
        self.modes.data = {"phi": (1e3 * _shapes(model, _POSITIONS)[:kept]).astype(np.float32).ravel()}
        self.shapes.data = {"x": along}
        self.amplitudes.data = {"q": dataset["modal_amplitude"].values[part, :kept].astype(np.float32).ravel()}
        forces = np.nan_to_num(forces)
        self.rods.data = {"tip": scale * tips.ravel(), "force": forces[:, : tips.shape[1]].ravel()}
        self.frames.data = {"t": x[part], "force": forces.max(axis=1, initial=0.0)}
        self.reach = 1.35 * scale * max(1.0, float(np.nanmax(np.abs(dataset["midspan_displacement"].values))))
        if self.fresh:  # the browser draws when it is told of a change, which what comes with the figure is not
            self.fresh = False
            self.cursor.later(self._rescale, 300)
        w = dataset["midspan_displacement"].values[inside]
        snaps, first = np.flatnonzero(w[:-1] * w[1:] < 0.0), float(x[inside][0])
        self.begin = max(float(x[inside][snaps[0]]) - 0.5, first) if snaps.size else first
        self.plot.x_range.update(start=-0.02 * along[-1], end=1.02 * along[-1])
        self._rescale()

    def _rescale(self) -> None:
        if self.run is None or self.run.system.model.beam is None:
            return
        run, beam = self.run, self.run.system.model.beam
        length = 1e3 * beam.length
        width, height = style.inner_size(self.plot, (560, 270))
        true_half = 0.5 * 1.04 * length * height / width
        scales = {"true proportions": true_half, "10 times": true_half / 10.0, "100 times": true_half / 100.0}
        half = scales.get(self.scale.value, self.reach)
        self.plot.y_range.update(start=-half, end=half)
        true = self.scale.value == "true proportions"
        drawn = "thickness to scale" if true else "the beam as a line, without its thickness"
        self.plot.title.text = f"Displacements {true_half / half:.3g} times as large as lengths;\n{drawn}"
        tall = 0.12 * half
        self.supports.data = {
            "left": [-0.02 * length, length], "right": [0.0, 1.02 * length], "low": [-tall] * 2, "top": [tall] * 2
        }  # fmt: skip
        self.count += 1
        strikers = [contact.striker for contact in run.system.contacts]
        self.meta.data = {
            "modes": [min(run.system.model.modes, _MODES)], "half": [0.5e3 * beam.thickness if true else 0.0], "begin": [self.begin],
            "at": [[each.location * length for each in strikers]], "side": [[1 if each.side == "below" else -1 for each in strikers]],
            "reach": [1e3 * half], "tip": [0.008 * length], "taper": [0.05 * half],
            "hot": [self.look.second], "cold": [self.look.striker], "count": [self.count],
        }  # fmt: skip


# ----------------------------------------------------------------------------------------------------
# Long series for a screen: the least and the greatest of each pixel's samples, so that no peak is lost.


_Array = NDArray[np.float64]


def envelope(x: _Array, y: _Array, low: float, high: float, pixels: int = 1000) -> tuple[_Array, _Array]:
    """The samples from *low* to *high*, and one beyond on either side; of many, two a pixel.

    Parameters
    ----------
    x, y : array of shape (samples,)
        *x* ascending.
    """
    first = max(int(np.searchsorted(x, low)) - 1, 0)
    last = min(int(np.searchsorted(x, high, side="right")) + 1, x.size)
    x, y = x[first:last], y[first:last]
    if x.size <= 3 * pixels:
        return x, y
    borders = np.unique(np.searchsorted(x, np.linspace(x[0], x[-1], pixels + 1)[:-1]))
    lengths = np.diff(np.append(borders, x.size))
    group = np.repeat(np.arange(borders.size), lengths)
    order = np.lexsort((y, group))
    least, greatest = order[borders], order[borders + lengths - 1]
    kept = np.unique(np.concatenate((least, greatest, [0, x.size - 1])))
    return x[kept], y[kept]


# ----------------------------------------------------------------------------------------------------
# The energy balance: work of the striker, energy of the beam, energy lost.


_CURVES = {
    "striker_work": ("work of the striker", "striker"), "base_work": ("work of the base", "striker"),
    "load_work": ("work of the axial load", "second"), "force_work": ("work of external forces", "second"),
    "energy_dissipated": ("dissipated", "faint"), "energy_harvested": ("harvested", "accent"),
    "energy_beam": ("in the beam, above its well", "center"), "energy_contact": ("in the contact", "second"),
    "energy_striker": ("of the striker", "striker"), "energy_circuit": ("in circuits", "accent"),
}  # fmt: skip
"""Label and colour; the works first.  Dashes tell stored energies from others."""


class Energy(RunPanel):
    """Work, what became of it, and whether the books balance."""

    title = "Energy"
    picture = "energies"

    def build(self) -> list[Any]:
        """Return the models of this view."""
        look = self.look
        self.sources = {name: style.columns(x=[], y=[]) for name in _CURVES}
        self.sources["striker_work"].name = self.named("energy")
        self.plot = self.over_time(height=360, used=260, y_axis_label="energy (µJ)", y_range=(0.0, 1.0))
        for name, (label, color) in _CURVES.items():
            self.plot.line(
                "x", "y", source=self.sources[name], color=getattr(look, color), line_width=1.4, legend_label=label,
                line_dash="dashed" if name in ("energy_contact", "energy_striker", "energy_circuit") else "solid",
            )  # fmt: skip
        style.legend(self.plot, look, ncols=2)
        self.words = style.Html("", sizing_mode="stretch_width")
        return [self.wrap(self.plot), self.words]

    def show(self, run: Run, low: float, high: float) -> None:
        """Show a run between two cycles."""
        dataset = run.dataset
        series = [1e6 * dataset[name].values if name in dataset else None for name in _CURVES]
        self.curves(self.plot, self.sources.values(), series, run, low, high)
        words = ""
        ends = {name: dataset[name].values[[0, -1]] for name in _CURVES if name in dataset}
        works = sum(float(each[1]) for name, each in ends.items() if name.endswith("_work"))
        if "energy_dissipated" in ends:
            left = works - sum(float(each[1] - each[0]) for name, each in ends.items() if not name.endswith("_work"))
            scale = max(abs(works), float(ends["energy_dissipated"][1]), 1e-300)
            words = f"At the end the energy balance has an error of {left:.2g} J, {abs(left) / scale:.1g} of the work. "
        barrier = run.system.model.saddle_energy - run.system.model.well_energy
        words += f"The barrier between the wells is {1e6 * barrier:.4g} µJ."
        self.words.object = Markup('<p class="note">{}</p>').format(words)


# ----------------------------------------------------------------------------------------------------
# The table of impacts, and the statistics of the run.


_MOST = 20_000
_TABLE = """
.slick-viewport, .grid-canvas, .slick-pane { background: var(--sb-card); }
.slick-header-column, .slick-header-columns { background: var(--sb-card) !important; color: var(--sb-text); }
.slick-header-column { font-size: 11px; padding: 4px 2px !important; }
.slick-row, .slick-cell { background: var(--sb-card) !important; color: var(--sb-text); border-color: var(--sb-grid); }
.slick-row.odd, .slick-row.odd .slick-cell { background: var(--sb-page) !important; }
.slick-row .slick-cell.selected { background: var(--sb-grid) !important; }
"""


class Impacts(RunPanel):
    """A row an impact; a click on one shows it closer."""

    title = "Impacts"

    def __init__(self, look: style.Look, cursor: style.Cursor, closer: Callable[[float, float], None]) -> None:
        super().__init__(look, cursor)
        self.closer = closer

    def build(self) -> list[Any]:
        """Return the models of this view."""
        names = {
            "cycle": ("onset (cycles)", "0.0000"), "time": ("onset (ms)", "0.000"),
            "duration": ("duration (µs)", "0.0"), "peak": ("peak force (N)", "0.000"),
            "impulse": ("impulse (mN s)", "0.0000"),
        }  # fmt: skip
        self.source = models.ColumnDataSource({name: [] for name in names}, name=self.named("impacts"))
        shown = [
            models.TableColumn(field=name, title=title, formatter=models.NumberFormatter(format=digits))
            for name, (title, digits) in names.items()
        ]
        table = models.DataTable(
            source=self.source, columns=shown, sizing_mode="stretch_width", height=400, index_position=None, reorderable=False,
            stylesheets=[style.sheet(self.look), _TABLE],
        )  # fmt: skip
        self.source.selected.on_change("indices", self._chosen)
        self.words = style.Html("", sizing_mode="stretch_width")
        return [self.words, pn.pane.Bokeh(table, sizing_mode="stretch_width")]

    def show(self, run: Run, low: float, high: float) -> None:
        """Show a run between two cycles."""
        found = run.impacts.isel(impact=slice(0, _MOST))
        time = found["onset"].values
        cycle = np.interp(time, run.dataset["time"].values, across(run)[0])
        self.source.data = {
            "cycle": cycle, "time": 1e3 * time, "duration": 1e6 * found["duration"].values,
            "peak": found["peak_force"].values, "impulse": 1e3 * found["impulse"].values,
        }  # fmt: skip
        count = run.impacts.sizes["impact"]
        more = f"; the first {_MOST} are listed" if count > _MOST else ""
        words = f"{count} impacts{more}. Click on one to see it closer."
        self.words.object = Markup('<p class="note">{}</p>').format(words)

    def _chosen(self, _: str, __: Any, rows: list[int]) -> None:
        if rows:
            at = rows[0]
            self.closer(float(self.source.data["cycle"][at]), float(self.source.data["duration"][at]) * 1e-6)


_ROW = Markup('<tr><td>{}</td><td class="num">{}</td><td class="unit">{}</td><td><code>{}</code></td></tr>')


class Numbers(RunPanel):
    """Every statistic with its unit and its meaning."""

    title = "Numbers"

    def build(self) -> list[Any]:
        """Return the models of this view."""
        self.table = style.Html("", sizing_mode="stretch_width")
        return [self.table]

    def show(self, run: Run, low: float, high: float) -> None:
        """Show a run between two cycles."""
        rows = []
        system = run.system
        circuit = system.harvester is not None
        parts = {
            "base_": system.base_excitation is not None, "load_work": system.axial_load is not None,
            "local_force_": bool(system.local_forces), "energy_harvested": circuit, "harvested_": circuit,
            "rms_voltage": circuit, "peak_voltage": circuit,
        }  # fmt: skip
        for name, value in run.summary.items():
            row = STATISTICS.get(name)
            if any(name.startswith(start) and not has for start, has in parts.items()):
                continue
            shown = getattr(value, "label", None) or getattr(value, "name", None) or value
            text = f"{shown:.8g}" if isinstance(shown, float) else str(shown)
            text = "–" if isinstance(shown, float) and np.isnan(shown) else text
            unit = "" if row is None or row.unit == "1" else row.unit
            words = "" if row is None else row.long_name
            rows.append(_ROW.format(words, text, unit, name))
        self.table.object = Markup('<table class="numbers">{}</table>').format(Markup("").join(rows))


# ----------------------------------------------------------------------------------------------------
# Modal amplitudes over time, and how large each mode becomes.


_SHOWN = 6
# From Okabe and Ito, told apart by the colour-blind; the first is that of the text.
_COLORS = ("", "#E69F00", "#56B4E9", "#009E73", "#D55E00", "#CC79A7")


class Modal(RunPanel):
    """Amplitudes of the buckling modes."""

    title = "Modes"
    picture = "modal_amplitudes"

    def build(self) -> list[Any]:
        """Return the models of this view."""
        look = self.look
        plot = self.over_time(
            height=260, used=215, share=0.6, y_axis_label="αᵢ over α₁ of the well", y_range=(-1.5, 1.5)
        )
        self.lines = [style.columns(x=[], y=[]) for _ in range(_SHOWN)]
        for at, source in enumerate(self.lines):
            color = _COLORS[at] or look.text
            plot.line("x", "y", source=source, color=color, line_width=1.2, legend_label=f"mode {at + 1}")
        style.legend(plot, look, ncols=3)
        self.bars = style.columns(mode=[], rms=[], top=[])
        self.bars.name = self.named("modal")
        low = style.figure(
            look, height=170, used=215, share=0.4, y_axis_type="log", x_axis_label="buckling mode i", y_axis_label="rms αᵢ / α₁",
            tools="reset", x_range=(0.4, 32.6), y_range=(1e-8, 1.0),
        )  # fmt: skip
        low.segment("mode", 1e-16, "mode", "rms", source=self.bars, color=look.center, line_width=2)
        low.scatter("mode", "rms", source=self.bars, color=look.center, size=6)
        self.low, self.plot = low, plot
        return [self.wrap(plot), self.wrap(low)]

    def show(self, run: Run, low: float, high: float) -> None:
        """Show a run between two cycles."""
        if "modal_amplitude" not in run.dataset:
            return
        well = float(np.abs(run.system.model.wells[..., 0]).max()) or 1.0
        alpha = run.dataset["modal_amplitude"].values / well
        shown = [alpha[:, at] if at < alpha.shape[1] else None for at in range(_SHOWN)]
        self.curves(self.plot, self.lines, shown, run, low, high)
        part = alpha[within(across(run)[0], low, high)]
        rms = np.sqrt(np.mean((part - part.mean(axis=0)) ** 2, axis=0))
        self.bars.data = {"mode": np.arange(1, rms.size + 1), "rms": np.maximum(rms, 1e-16), "top": rms}
        most = float(rms.max(initial=1e-12)) or 1e-12
        self.low.y_range.update(start=max(1e-8 * most, 1e-16), end=3.0 * most)
        self.low.x_range.update(start=0.4, end=rms.size + 0.6)
        self.low.title.text = f"About the mean, cycles {low:.4g} to {high:.4g}"


# ----------------------------------------------------------------------------------------------------
# The phase portrait and the stroboscopic section.


_MOST_PHASE = 16_000
_FOLLOW = """
const c = source.data.t;
let a = 0, b = c.length - 1;
if (b < 1 || t < c[0] || t > c[b]) { dot.data = {w: [], v: []}; return; }
while (b - a > 1) { const m = (a + b) >> 1; if (c[m] <= t) { a = m; } else { b = m; } }
dot.data = {w: [source.data.w[a]], v: [source.data.v[a]]};
"""


_SIGNALS = {
    "midspan": ("midspan_displacement", "midspan_velocity"),
    "striker": ("displacement_at_striker", "velocity_at_striker"),
}


class Phase(RunPanel):
    """Displacement against velocity, all of it and once a cycle."""

    title = "Phase"
    picture = "phase_portrait"

    def build(self) -> list[Any]:
        """Return the models of this view."""
        look = self.look
        self.run: Run | None = None
        self.span = (0.0, 1.0)
        self.where = pn.widgets.RadioButtonGroup(
            name="Of", options={"mid-span": "midspan", "at the striker": "striker"}, value="midspan", button_type="default"
        )  # fmt: skip
        self.phase = pn.widgets.FloatSlider(
            name="Section at the phase (cycles)", start=0.0, end=1.0, step=0.01, value=0.0, width=240
        )
        self.line, self.dots = style.columns(t=[], w=[], v=[]), style.columns(t=[], w=[], v=[])
        self.dots.name = self.named("section")
        dot = models.ColumnDataSource({"w": [], "v": []}, syncable=False)
        plots = [
            style.figure(look, height=370, used=280, tools="pan,box_zoom,wheel_zoom,reset", x_range=(-1.6, 1.6), y_range=(-1.6, 1.6),
                   title=title, x_axis_label=f"displacement w ({self.units[0]})", y_axis_label=f"velocity ({self.units[1]})", min_border_left=50)
            for title in ("Phase portrait", "Stroboscopic section")
        ]  # fmt: skip
        plots[0].line("w", "v", source=self.line, color=look.center, line_width=0.8)
        plots[0].scatter("w", "v", source=dot, size=9, color=look.accent)
        palette = interp_palette((look.accent, look.striker), 64)
        colors = linear_cmap("t", palette, 0.0, 1.0)
        self.mapper = colors.transform
        plots[1].scatter("w", "v", source=self.dots, size=5, color=colors)
        plots[1].x_range, plots[1].y_range = plots[0].x_range, plots[0].y_range
        self.section = plots[1]
        self.cursor.follow(_FOLLOW, source=self.line, dot=dot)
        self.where.param.watch(lambda _: self.cursor.later(self._draw, 1), "value")
        self.phase.param.watch(lambda _: self.cursor.later(self._draw, 1), "value_throttled")
        parts = [self.wrap(plot) for plot in plots]
        for part in parts:
            part.styles = {"flex": "1 1 calc(50% - 2px)", "min-width": "min(240px, 100%)"}
        return [pn.FlexBox(self.where, self.phase, margin=0), pn.FlexBox(*parts, margin=0, sizing_mode="stretch_width")]

    def show(self, run: Run, low: float, high: float) -> None:
        """Show a run between two cycles."""
        self.run, self.span = run, (low, high)
        self._draw()

    def _draw(self) -> None:
        if self.run is None:
            return
        dataset = self.run.dataset
        x, _ = across(self.run)
        inside = within(x, *self.span)
        step = max(1, -(-(inside.stop - inside.start) // _MOST_PHASE))
        names = zip(_SIGNALS[self.where.value], self.scales(self.run), strict=False)
        w, v = (scale * dataset[name].values for name, scale in names)
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


# ----------------------------------------------------------------------------------------------------
# The amplitude spectrum of what is seen of a run.


_MOST_SPECTRUM = 2**16


def amplitude_spectrum(time: _Array, values: _Array) -> tuple[_Array, _Array]:
    """Frequencies, Hz, and amplitudes of a series whose samples need not be even, under a Hann window.

    A sine of amplitude a whose frequency is one of those returned has a peak of height a.
    """
    steps = np.diff(time)
    count = int(min(max(round((time[-1] - time[0]) / np.median(steps)) + 1, 8), _MOST_SPECTRUM))
    even = np.linspace(time[0], time[-1], count)
    series = np.interp(even, time, values)
    window = np.hanning(count)
    amplitudes = 2.0 * np.abs(np.fft.rfft((series - series.mean()) * window)) / window.sum()
    return np.fft.rfftfreq(count, even[1] - even[0]), amplitudes


class Spectrum(RunPanel):
    """Which frequencies the beam moves at."""

    title = "Spectrum"
    picture = "spectrum"

    def build(self) -> list[Any]:
        """Return the models of this view."""
        look = self.look
        self.sources = {name: style.columns(x=[], y=[]) for name in ("midspan_displacement", "displacement_at_striker")}
        self.sources["midspan_displacement"].name = self.named("spectrum")
        plot = style.figure(
            look, height=420, used=230, title=" ", y_axis_type="log", y_axis_label=f"amplitude ({self.units[0]})",
            x_axis_label=self.units[2], x_range=(0.0, 12.0), y_range=(1e-7, 1.0),
            tools="pan,box_zoom,wheel_zoom,reset", active_drag="box_zoom",
        )  # fmt: skip
        for name, source in self.sources.items():
            label, color, _, _ = _DISPLACEMENTS[name]
            plot.line("x", "y", source=source, color=getattr(look, color), legend_label=label, name=name)
        style.legend(plot, look)
        self.drive = models.Span(dimension="height", line_color=look.striker, line_dash="dashed", line_width=1.2)
        self.first = models.Span(dimension="height", line_color=look.faint, line_dash="dotted", location=1.0)
        plot.add_layout(self.drive)
        plot.add_layout(self.first)
        self.plot = plot
        return [self.wrap(plot)]

    def show(self, run: Run, low: float, high: float) -> None:
        """Show a run between two cycles."""
        x, _ = across(run)
        inside = within(x, low, high)
        time, first = run.dataset["time"].values[inside], run.system.model.reference_frequency
        given = run.system.parameters
        ratio = next((value for name, value in given.items() if name.endswith(".frequency_ratio")), None)
        length, _, shown = self.scales(run)
        self.drive.location, self.first.location = ratio and ratio * shown, shown
        self.plot.title.text = f"Cycles {low:.4g} to {high:.4g}, Hann window;\ndashed: the excitation, dotted: f₁"
        most = 1e-12
        for name, source in self.sources.items():
            frequency, amplitude = amplitude_spectrum(time, run.dataset[name].values[inside])
            kept = (frequency > 0.0) & (frequency <= 40.0 * first)
            source.data = {"x": frequency[kept] / first * shown, "y": np.maximum(length * amplitude[kept], 1e-12)}
            most = max(most, length * float(amplitude[kept].max(initial=0.0)))
        self.plot.y_range.update(start=1e-7 * most, end=3.0 * most)
        self.plot.x_range.update(start=0.0, end=shown * max(12.0, 4.0 * (ratio or 1.0)))


# ----------------------------------------------------------------------------------------------------
# Displacements of beam and striker, and the force between them.


_DISPLACEMENTS = {
    "striker_displacement": ("striker", "striker", 1.3, "solid"),
    "midspan_displacement": ("beam, centre", "center", 2.6, "solid"),
    "displacement_at_striker": ("beam, at the striker", "beam", 1.2, "dashed"),
}
"""Label, colour, width and dashes of each curve, the striker first, so that it hides nothing."""
_FIRST_BELOW = ("striker_forces", "contact_force", "voltage", "power_load", "midspan_velocity")


def _columns_of(dataset: xr.Dataset, name: str) -> _Array:
    """A variable over time as columns, one for each striker where there are several."""
    values = np.asarray(dataset[name].values, dtype=np.float64)
    return values[:, None] if values.ndim == 1 else values


class WaveformPanel(RunPanel):
    """Displacements of beam and strikers, and below them any other variable over time."""

    title = "Waveform"

    def __init__(self, look: style.Look, cursor: style.Cursor, beam: BeamPanel) -> None:
        super().__init__(look, cursor)
        self.beam = beam
        self.other: Run | None = None
        """Run that is drawn over this one, with the separation of the two."""
        self.run: Run | None = None

    def build(self) -> list[Any]:
        """Return the models of this view."""
        look = self.look
        self.beam.activate()
        self.span = (0.0, 1.0)
        self.sources = {name: style.columns(x=[], y=[]) for name in _DISPLACEMENTS}
        self.sources["midspan_displacement"].name = self.named("waveform")
        self.force = models.ColumnDataSource({"x": [], "y": []}, name=self.named("force"))
        self.further = [
            models.ColumnDataSource({"x": [], "y": []}, name=self.named(name)) for name in ("strikers", "below")
        ]
        self.below = pn.widgets.Select(options={}, width=230, margin=(0, 10))
        self.below.param.watch(lambda _: self.cursor.later(self._draw, 1), "value")
        top = self.over_time(
            name=self.named("waveform-plot"), height=195, used=255, share=0.46, y_axis_label=f"displacement w ({self.units[0]})",
            y_range=(-1.5, 1.5), output_backend="canvas",
        )  # fmt: skip
        for name, (label, color, width, dash) in _DISPLACEMENTS.items():
            top.line(
                "x", "y", source=self.sources[name], color=getattr(look, color), line_width=width, line_dash=dash,
                legend_label=label,
            )  # fmt: skip
        self.second, self.apart = style.columns(x=[], y=[]), style.columns(x=[], y=[])
        self.second.name, self.apart.name = self.named("waveform-second"), self.named("apart")
        drawn = top.line("x", "y", source=self.second, color=look.second, line_width=1.4)
        below: dict[str, Any] = style.BELOW | {"height": 110, "used": 255, "share": 0.24}
        low = self.over_time(y_range=(0.0, 1.0), **below)
        log = self.over_time(
            y_range=(1e-12, 1.0), y_axis_type="log", x_axis_label="cycles of excitation τ",
            y_axis_label=f"|Δw| ({self.units[0]})", visible=False, **below | {"share": 0.28},
        )  # fmt: skip
        self.decades = models.FixedTicker(ticks=[])
        log.yaxis.ticker = self.decades
        log.line("x", "y", source=self.apart, color=look.second, line_width=1.4)
        low.yaxis.ticker = models.BasicTicker(desired_num_ticks=3)
        low.line("x", "y", source=self.force, color=look.beam, line_width=1.2)
        for plot, source in zip((top, low), self.further, strict=True):
            plot.multi_line("x", "y", source=source, color=look.second, line_width=1.2, line_dash="dotdash")
        self.others = top.renderers[-1]
        style.legend(top, look)
        for label, renderer in (("beam B, centre", drawn), ("other strikers", self.others)):
            item = models.LegendItem(label=label, renderers=[renderer], visible=False)
            top.legend[0].items.append(item)
        self.low, self.top, self.log = low, top, log
        self.choice = pn.Row(self.below, pn.pane.Bokeh(self.beam.play), margin=0)
        return [self.wrap(top), self.wrap(low), self.choice, self.wrap(self.beam.small), self.wrap(log)]

    def show(self, run: Run, low: float, high: float) -> None:
        """Show a run between two cycles."""
        self.run, self.span = run, (low, high)
        data = run.dataset
        drawn = {*_DISPLACEMENTS, "striker_displacements"}
        over = {str(name): set(item.dims) for name, item in data.data_vars.items() if name not in drawn}
        names = [name for name, dims in over.items() if dims <= {"time", "striker"}]
        names.sort(key=lambda each: _FIRST_BELOW.index(each) if each in _FIRST_BELOW else len(_FIRST_BELOW))
        options = {str(data[name].attrs.get("long_name", name)): name for name in names}
        if options != self.below.options:
            held = self.below.value if self.below.value in names else names[0]
            self.below.param.update(options=options, value=held)
        self.beam.show(run, low, high)
        self._draw()

    def beside(self, other: Run | None) -> None:
        """Draw another run over this one, and their separation; None for this one alone."""
        if other is not self.other:
            self.other = other
            if self.built:
                self._draw()

    def _draw(self) -> None:
        if self.run is None:
            return
        pair = self.other is not None
        # of the figures, not of their panes: Panel 1.9 loses what a pane of Bokeh is told while changes are held
        self.choice.visible = self.low.visible = not pair
        self.beam.small.visible, self.log.visible = not pair and self.beam.has_shape, pair
        data = self.run.dataset
        x, label = across(self.run)
        scale = self.scales(self.run)[0]
        self.low.xaxis.axis_label = label
        shown = []
        struck = "striker_displacement" in data or "midspan_displacement" not in data
        for (name, source), entry in zip(self.sources.items(), self.top.legend[0].items, strict=False):
            there = name in data and (struck or name != "displacement_at_striker")
            there &= not pair or name == "midspan_displacement"
            entry.visible = there
            series = scale * _columns_of(data, name).T if there else ()
            own = [envelope(x, each, *self.span) for each in series]
            source.data = _curve(own)
            shown += [y for _, y in own]
        more: Any = ()
        if "striker_displacements" in data and not pair:
            more = scale * _columns_of(data, "striker_displacements").T[1:]
        own = [envelope(x, each, *self.span) for each in more]
        self.further[0].data = _curves(own)
        self.top.legend[0].items[-1].visible = bool(own)
        self.top.legend[0].items[1].label = constant("beam A, centre" if pair else "beam, centre")
        own += self._pair()
        style.fit(self.top, *shown, *(y for _, y in own))
        item = data[self.below.value]
        unit = str(item.attrs.get("units", "1"))
        factor, unit = (1.0, unit) if unit in ("", "1") else scale_of(item.values, unit)  # 1e-3 is no metre
        own = [envelope(x, each / factor, *self.span) for each in _columns_of(data, self.below.value).T]
        self.force.data, self.further[1].data = _curve(own), _curves(own[1:])
        self.low.yaxis.axis_label = unit or "1"  # the words, too long for its height, stand in the field below it
        style.fit(self.low, *(np.append(y, 0.0) for _, y in own))

    def _pair(self) -> list[tuple[_Array, _Array]]:
        """Draw the other run and the separation; return its curve."""
        assert self.run is not None
        other, name = self.other, "midspan_displacement"
        self.top.legend[0].items[-2].visible = other is not None and name in other.dataset
        if other is None or name not in other.dataset or name not in self.run.dataset:
            self.second.data = self.apart.data = {"x": [], "y": []}
            return []
        scales = [self.scales(run)[0] for run in (self.run, other)]
        series = [scale * run.dataset[name].values for scale, run in zip(scales, (self.run, other), strict=True)]
        x, drawn = across(self.run)[0], envelope(across(other)[0], series[1], *self.span)
        self.second.data = _curve([drawn])
        x, apart = separation((x, series[0]), (across(other)[0], series[1]))
        seen = envelope(x, apart, *self.span) if x.size else (x, apart)
        self.apart.data = _curve([seen])
        if seen[1].size:
            least, most = float(seen[1].min()), float(seen[1].max())
            self.log.y_range.update(start=0.5 * least, end=2.0 * most)
            low, high = int(np.floor(np.log10(least))), int(np.ceil(np.log10(most)))
            self.decades.ticks = [10.0**at for at in range(high, low - 1, -max(-(-(high - low) // 4), 1))]
        self.log.title.text = "" if x.size else "The two runs are equal to the last digit"
        return [drawn]


def separation(first: tuple[_Array, _Array], second: tuple[_Array, _Array]) -> tuple[_Array, _Array]:
    """Instants of two series, and how far apart they are there, without those at which they are equal.

    Only instants that both series have count, because an interpolation has larger errors than a small separation; if the
    series have hardly any in common, the second is interpolated.
    """
    x, here, there = np.intersect1d(first[0], second[0], assume_unique=False, return_indices=True)
    if 2 * x.size >= min(first[0].size, second[0].size):
        apart = np.abs(first[1][here] - second[1][there])
    else:
        x = first[0][first[0] <= second[0][-1]]
        apart = np.abs(first[1][: x.size] - np.interp(x, *second))
    kept = apart > 0.0  # NaN is no distance either
    return x[kept], apart[kept]


def _curve(curves: list[tuple[_Array, _Array]]) -> dict[str, Any]:
    """Columns of the first of some curves."""
    x, y = curves[0] if curves else (np.zeros(0), np.zeros(0))
    return {"x": x.astype(np.float64), "y": y.astype(np.float32)}


def _curves(curves: list[tuple[_Array, _Array]]) -> dict[str, Any]:
    """Columns of several curves in one source."""
    return {"x": [x for x, _ in curves], "y": [y.astype(np.float32) for _, y in curves]}


# ----------------------------------------------------------------------------------------------------


_SETTLE = 60
"""Milliseconds that a range must rest before the samples in it are sent."""


_BAD = Markup('<span class="bad">{}</span>')
FIRST = "Click on the map, use the arrow keys, or type numbers, to see the run of a point."
"""Text of a run that is not requested yet."""


def _counted(number: int, what: str) -> str:
    return f"{number} {what}" if number == 1 else f"{number} {what}s"


class RunView:
    """The card of one run, *name* ``"A"`` or ``"B"``; ``post`` and ``later`` as of the map."""

    def __init__(self, look: style.Look, name: str, post: style.Post, later: style.Later) -> None:
        self.look, self.name, self.later = look, name, later
        self.run: Run | None = None
        self.old = False
        """True if the run that is drawn is not that of the point and the system of the page."""
        self._words = ""
        self.cursor = style.Cursor(look, "" if name == "A" else f"-{name}", later)
        beam = BeamPanel(look, self.cursor)
        self.waveform = WaveformPanel(look, self.cursor, beam)
        self.parts = [
            self.waveform, Phase(look, self.cursor), Spectrum(look, self.cursor),
            Modal(look, self.cursor), Energy(look, self.cursor), Impacts(look, self.cursor, self._closer),
            beam, Numbers(look, self.cursor),
        ]  # fmt: skip
        wide = {"sizing_mode": "stretch_width", "margin": (0, 0, 2, 0)}
        self.head = style.Html(style.FAINT.format(FIRST), css_classes=["run-head"], **wide)
        self.note = style.Html("", css_classes=["run-note"], **wide)
        self.tabs = pn.Tabs(
            *((part.title, part.place) for part in self.parts), dynamic=True, sizing_mode="stretch_width", margin=0
        )  # fmt: skip
        self.tabs.param.watch(lambda _: post(self._activated), "active")
        self._moved = 0
        self._quiet = False
        for edge in ("start", "end"):
            self.cursor.range.on_change(edge, lambda attr, old, new: self._range_moved())
        parts = (self.head, self.note, self.tabs)
        self.layout = pn.Column(*parts, sizing_mode="stretch_width", css_classes=["card", "run"])
        self.notes: dict[str, str] = {}
        self.turned: Callable[[], None] = lambda: None

    @property
    def active(self) -> Any:
        """The view that is seen."""
        return self.parts[self.tabs.active]

    @property
    def current(self) -> Run | None:
        """The run that is shown; None if there is none, or it is old."""
        return None if self.old else self.run

    @property
    def picture(self) -> str:
        """The figure of the view that is seen, or the first one where the run has none of it."""
        name = str(self.active.picture)
        return name if self.run is not None and name in figures_of(self.run.dataset)[1] else "run"

    # ------------------------------------------------------------------ what is shown

    def wait(self, words: str, seconds: float = 0.0) -> None:
        """Say what is computed, over the run before, and for how long it has been."""
        self._write_notes()
        self._head(style.BUSY.format(f"computing, {seconds:.0f} s" if seconds >= 0.5 else "computing"), words)

    def rename(self, words: str) -> None:
        """Write the point of the run that is shown with other digits."""
        if self.run is not None and not self.old and words != self._words:
            self._answer(words)

    def outdate(self) -> None:
        """Say that the run is of a system before, until that of the present one is computed."""
        if self.run is not None and not self.old:
            self.tabs.css_classes, self.old = ["stale"], True
            self._head(_BAD.format("old"), "this run is of the system before")

    def fail(self, words: str) -> None:
        """Say why there is no run; the pictures of the run before are greyed."""
        self.forget()
        self.tabs.css_classes, self.old = ["stale"], True
        self._head(_BAD.format("no run"), words)

    def forget(self, words: str = FIRST) -> None:
        """Show no run, and *words* on how to ask for one; the pictures of the run before are greyed."""
        self.notes = {}
        self._write_notes()
        self.old = self.run is not None
        self.tabs.css_classes = ["stale"] if self.old else []
        self.head.object = style.FAINT.format(words)

    def _head(self, kind: str, words: str, below: str = "") -> None:
        line = Markup("<br>{}").format(below) if below else ""
        self.head.object = Markup('<span class="point">{}</span> {} {}{}').format(self.name, kind, words, line)

    def show(self, run: Run, words: str) -> None:
        """Show a run."""
        self.run, self.old = run, False
        self.tabs.css_classes = []
        self._write_notes()
        self._answer(words)
        first, last = across(run)[0][[0, -1]].tolist()
        self._quiet = True
        self.cursor.range.update(start=first, end=last, reset_start=first, reset_end=last)
        self._quiet = False
        self._draw()

    def _answer(self, words: str) -> None:
        """Write the class of the run, its point and its counts."""
        assert self.run is not None
        run, self._words = self.run, words
        answer = run.summary
        if answer.status in (RunStatus.OK, RunStatus.EARLY_STOP):
            well = "upper" if answer.final_well > 0 else "lower"
            final = ", for good" if answer.final_well_proven else ""
            counts = f"{_counted(answer.zero_crossings, 'crossing')}, {_counted(answer.impacts, 'impact')}"
            counts += f", begins in the {run.system.initial_well_text}, ends in the {well} well{final}"
            self._head(style.class_chip(answer.response_class), words, style.FAINT.format(counts))
        else:
            why = _BAD.format(f"{answer.status.name}: {answer.status.advice}")
            self._head(style.class_chip(ResponseClass.UNKNOWN), words, why)

    def say(self, about: str, words: str, bad: bool = False) -> None:
        """Put a line under the class, one for each thing that it is about."""
        self.notes[about] = (_BAD if bad else style.FAINT).format(words) if words else ""
        self._write_notes()

    def _write_notes(self) -> None:
        self.note.object = Markup("<br>").join(text for text in self.notes.values() if text)

    def _draw(self) -> None:
        self.active.activate()
        if self.run is not None:
            self.active.show(self.run, *self.window)

    def _activated(self) -> None:
        self.turned()
        self.active.activate()
        self.later(self._draw, _SETTLE)  # once the browser has what it is to be drawn in

    def _range_moved(self) -> None:
        if self._quiet:
            return
        self._moved += 1
        now = self._moved
        self.later(lambda: self._draw() if now == self._moved else None, _SETTLE)

    def _closer(self, place: float, seconds: float) -> None:
        """Show the waveform about one impact."""
        if self.run is None:
            return
        x, time = across(self.run)[0], self.run.dataset["time"].values
        cycles = seconds * (x[-1] - x[0]) / (time[-1] - time[0])
        self.cursor.range.update(start=place - 1.0 * cycles, end=place + 2.0 * cycles)
        self.tabs.active = 0

    @property
    def window(self) -> tuple[float, float]:
        """The part that is seen, in cycles."""
        low, high = sorted((float(self.cursor.range.start), float(self.cursor.range.end)))
        return low, high
