"""Colours, light and dark, and what all pictures of the page share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import panel as pn
from bokeh.core.property.descriptors import UnsetValueError
from bokeh.events import ConnectionLost, DocumentReady
from bokeh.models import ColumnDataSource, CustomJS, Range1d, Span
from bokeh.plotting import figure as bokeh_figure
from markupsafe import Markup, escape
from numpy.typing import NDArray

from snapbeam import ResponseClass
from snapbeam.explorer.jobs import UPLOAD
from snapbeam.plot.style import CLASS_COLORS

if TYPE_CHECKING:
    from snapbeam.explorer.page import Page


@dataclass(frozen=True)
class Look:
    """One of the two looks of the page."""

    name: str
    page: str
    card: str
    text: str
    faint: str
    grid: str
    beam: str
    center: str
    striker: str
    accent: str
    second: str
    scale: float = 1.0
    """Size of all type over the usual one."""

    physical: bool = False
    """Units of the views of a run: Hz, mm and mm/s if True, ratios if False."""

    def font(self, size: int) -> str:
        """A size of type, of one in pixels."""
        return f"{round(size * self.scale)}px"


LIGHT = Look(
    "default", "#f3f4f6", "#ffffff", "#1b1f24", "#59636e", "#e4e7eb", "#000000", "#2a87c8", "#b03a27", "#1a62d2", "#8250df",
)  # fmt: skip
DARK = Look(
    "dark", "#0f1318", "#181d24", "#e6e9ed", "#9aa4af", "#2c333c", "#f2f4f6", "#70bbf0", "#f08a75", "#6cb0ff", "#c297ff",
)  # fmt: skip


LECTURE = 1.4
"""Size of type for a projector."""


def look_of(theme: str, *, lecture: bool = False, physical: bool = False) -> Look:
    """The look of a theme of Panel's; with larger type and lines for a *lecture*, and numbers in *physical* units."""
    look = replace(DARK if theme == "dark" else LIGHT, physical=physical)
    return replace(look, scale=LECTURE) if lecture else look


@cache
def sheet(look: Look) -> str:
    """The page's style sheet."""
    text = (Path(__file__).parent / "page.css").read_text(encoding="utf-8")
    names = {name: getattr(look, name) for name in ("page", "card", "text", "faint", "grid", "accent", "striker")}
    variables = "".join(f"--sb-{name}: {value};" for name, value in names.items())
    variables += f"--sb-scale: {look.scale};"
    return f":root, :host {{ {variables} color-scheme: {'dark' if look.name == 'dark' else 'light'}; }}\n{text}"


def focused(look: Look) -> str:
    """Style sheet of the keyboard focus for elements that the sheet of the page does not reach."""
    return f":focus-visible {{ outline: 2px solid {look.accent} !important; outline-offset: -2px; }}"


def styled(item: Any, look: Look) -> None:
    """Give a part of the page, and all that is in it, the page's style sheet."""
    style = sheet(look)
    for each in item.select():
        if style not in each.stylesheets:
            each.stylesheets = [*each.stylesheets, style]


def figure(look: Look, *, used: int = 0, share: float = 1.0, **options: Any) -> Any:
    """An empty Bokeh figure in the style of the page.

    Parameters
    ----------
    used : int
        Pixels of the window's height that other parts of the page need.  The figure takes *share* of the rest, and at
        least its own height; 0 for a figure of fixed height.
    share : float
    """
    settings: dict[str, Any] = {
        "sizing_mode": "stretch_width", "toolbar_location": "right", "tools": "pan,box_zoom,wheel_zoom,reset",
        "border_fill_color": look.card, "background_fill_color": look.card, "outline_line_color": look.faint,
        "min_border_left": round(58 * look.scale), "min_border_right": 6, "min_border_top": 6, "lod_threshold": None,
    }  # fmt: skip
    plot = bokeh_figure(**(settings | options))
    for axis in plot.axis:
        style_axis(axis, look)
    plot.grid.grid_line_color = look.grid
    plot.stylesheets = plot.toolbar.stylesheets = [focused(look)]
    if used:
        tall = f"max(calc(var(--sb-least, 1) * {plot.height}px), calc(var(--sb-share, 1) * {share:g} * (100vh - {used}px - var(--sb-more, 0px))))"
        high = f"@media (min-width: 1000px) {{ :host {{ min-height: {tall} !important; }} }}"
        plot.stylesheets = [*plot.stylesheets, high]
    plot.toolbar.update(logo=None, autohide=False)
    plot.title.update(text_color=look.text, text_font_size=look.font(12), text_font_style="normal")
    return plot


BELOW: dict[str, Any] = {"toolbar_location": None, "min_border_right": 36, "output_backend": "canvas"}
"""Of a low figure below another one, whose tools serve both and whose frame is as wide."""


def style_axis(axis: Any, look: Look) -> None:
    """Give an axis the style of the page."""
    axis.update(
        axis_label_text_color=look.text, major_label_text_color=look.text, axis_label_text_font_style="normal",
        axis_label_text_font_size=look.font(12), major_label_text_font_size=look.font(11),
        axis_line_color=look.faint, major_tick_line_color=look.faint, minor_tick_line_color=None,
    )  # fmt: skip


def framed_plot(plot: Any, **options: Any) -> Any:
    """A figure in the page; Panel gives it the style sheets of its frame."""
    return pn.pane.Bokeh(plot, sizing_mode="stretch_width", stylesheets=list(plot.stylesheets), **options)


def on_tap(plot: Any, tell: Callable[[float, float], None]) -> None:
    """Say where a figure was clicked.

    Bokeh has other names for a click within 300 ms of another one, and for one of more than 300 ms.
    """
    for kind in ("tap", "doubletap", "pressup"):
        plot.on_event(kind, lambda event: tell(float(event.x), float(event.y)))


def fit(plot: Any, *curves: NDArray[Any]) -> None:
    """Let a figure show all of some curves."""
    known = [curve[np.isfinite(curve)] for curve in curves]
    known = [curve for curve in known if curve.size]
    if known:
        low, high = min(float(each.min()) for each in known), max(float(each.max()) for each in known)
        room = 0.06 * (high - low) or 0.5
        plot.y_range.update(start=low - room, end=high + room)


def legend(plot: Any, look: Look, **options: Any) -> None:
    """Put the legend of a figure above it."""
    for item in list(plot.legend):
        plot.center.remove(item)
        plot.add_layout(item, "above")
        item.stylesheets = ["@media (max-width: 600px) { .bk-label { font-size: 11px !important; } }"]
        item.update(
            location="top_left", orientation="horizontal", click_policy="hide", border_line_color=None,
            background_fill_color=look.card, background_fill_alpha=0.75, label_text_color=look.text,
            label_text_font_size=look.font(11), padding=3, spacing=5, margin=4, glyph_width=22,
            glyph_height=round(14 * look.scale), label_height=round(14 * look.scale), **options,
        )  # fmt: skip


def inner_size(plot: Any, otherwise: tuple[int, int]) -> tuple[int, int]:
    """Pixels of what a figure shows; *otherwise* until the browser has said it."""
    try:
        return int(plot.inner_width or otherwise[0]), int(plot.inner_height or otherwise[1])
    except UnsetValueError:
        return otherwise


def hexes(colors: NDArray[np.uint8]) -> list[str]:
    """Colours of shape (n, 4) as text."""
    return [f"#{r:02x}{g:02x}{b:02x}{a:02x}" for r, g, b, a in colors]


def columns(**values: Any) -> ColumnDataSource:
    """A source of columns, empty ones unless given."""
    return ColumnDataSource({name: np.asarray(value) for name, value in values.items()})


DIFFERENCE = "difference"
"""Name of what is shown of two maps."""


@cache
def colors_of_numbers(name: str = "") -> NDArray[np.uint8]:
    """The 256 colours of a number, or of a difference, of shape (256, 4)."""
    from cmcrameri import cm

    scale = cm.vik if name == DIFFERENCE else cm.batlow
    colors: NDArray[np.uint8] = np.round(255.0 * scale(np.linspace(0.0, 1.0, 256))).astype(np.uint8)
    return colors


@cache
def _class_table() -> NDArray[np.uint8]:
    """Colours by class + 1, of shape (5, 4)."""
    order = sorted(CLASS_COLORS)
    return np.array(
        [[int(CLASS_COLORS[kind][i : i + 2], 16) for i in (1, 3, 5)] + [255] for kind in order], dtype=np.uint8
    )


def colors_of(name: str, values: NDArray[Any], limits: tuple[float, float]) -> NDArray[np.uint32]:
    """Numbers as colours, packed; what is not finite is left clear."""
    if name == "response_class":
        table = _class_table()
        bytes_ = table[np.clip(values.astype(np.int64) + 1, 0, len(table) - 1)]
    else:
        numbers = values.astype(np.float64)
        low, high = limits
        share = (numbers - low) / (high - low if high > low else 1.0)
        good = np.isfinite(share)
        bytes_ = colors_of_numbers(name)[np.clip(np.where(good, share, 0.0) * 255.0, 0, 255).astype(np.int64)].copy()
        bytes_[~good, 3] = 0
    return np.ascontiguousarray(bytes_).view(np.uint32).reshape(values.shape)


class Html(pn.pane.HTML):
    """Text on the page.  It shows ``Markup`` as HTML and escapes every other text.

    All texts of the page are shown by it.  Text from files, addresses and messages therefore never becomes HTML:
    ``Markup("<b>{}</b>").format(text)`` escapes *text*, and a plain string is escaped here.
    """

    priority = 0  # Panel must not choose it by itself

    def _transform_object(self, obj: Any) -> dict[str, Any]:
        found: dict[str, Any] = super()._transform_object(str(escape("" if obj is None else obj)))
        return found


def class_chip(kind: ResponseClass) -> Markup:
    """The name of a class on its colour."""
    light = (ResponseClass.TRANSIENT_2, ResponseClass.CONTINUOUS, ResponseClass.UNKNOWN)
    ink = "#111" if kind in light else "#fff"
    return Markup('<span class="chip" style="background:{};color:{}">{}</span>').format(
        CLASS_COLORS[kind], ink, kind.label
    )


Post = Callable[[Callable[[], None]], None]
"""Function that calls another on the thread of the page."""
Later = Callable[[Callable[[], None], int], Any]
"""Function that calls another there after some milliseconds."""
NOTE = Markup('<p class="note">{}</p>')
HEADING = Markup("<h2>{}</h2>")
REFUSED = Markup('<p class="bad" role="alert">{}</p>')
WRONG = Markup('<span class="bad" role="alert">{}</span>')
BUSY = Markup('<span class="busy">{}</span>')
FAINT = Markup('<span class="faint">{}</span>')


def button(name: str, post: Post, work: Callable[[], None], **options: Any) -> Any:
    """A button that calls *work* on the thread of the page."""
    made = pn.widgets.Button(name=name, **options)
    made.on_click(lambda _: post(work))
    return made


# ----------------------------------------------------------------------------------------------------
# One cursor for all pictures of a run; it lives in the browser alone.


class Cursor:
    """Cursor position along a run, in cycles (or seconds), and the visible part of the run.

    Pictures over time share the range; each has a line at the cursor, and whatever else follows it listens to
    ``place``.
    """

    def __init__(self, look: Look, suffix: str, later: Later) -> None:
        self.look, self.suffix, self.later = look, suffix, later
        self.range = Range1d(0.0, 1.0)
        self.place = ColumnDataSource({"t": [0.0]}, syncable=False)

    def attach(self, plot: Any) -> None:
        """Give a picture over time the cursor."""
        accent = {"line_color": self.look.accent, "line_width": 1.2, "line_alpha": 0.9}
        line = Span(dimension="height", syncable=False, location=None, **accent)
        plot.add_layout(line)
        move = CustomJS(args={"place": self.place}, code="place.data = {t: [cb_obj.x]};")
        plot.js_on_event("mousemove", move)
        follow = CustomJS(args={"line": line, "place": self.place}, code="line.location = place.data.t[0];")
        self.place.js_on_change("data", follow)

    def follow(self, code: str, *also: Any, **arguments: Any) -> None:
        """Run *code* in the browser whenever the cursor moves, or the data of one of *also* change.

        In the code ``t`` is where the cursor is.
        """
        script = CustomJS(args={"place": self.place} | arguments, code=f"const t = place.data.t[0];\n{code}")
        for source in (self.place, *also):
            source.js_on_change("data", script)


# ----------------------------------------------------------------------------------------------------
# How a page is laid out, and the few scripts that it runs in the browser.


_GONE = """
if (!document.getElementById('gone')) {
  const note = document.createElement('div');
  note.id = 'gone'; note.setAttribute('role', 'alert');
  note.textContent = 'The server of this page has stopped or cannot be reached. What is shown stays; '
    + 'nothing new can be computed. Start snapbeam explore again, then load the page again.';
  document.body.appendChild(note);
}
"""
_ADDRESS = """
const search = bar.data.search[0];
const kept = new URLSearchParams(window.location.search).get('token');
const full = (kept ? 'token=' + encodeURIComponent(kept) + (search ? '&' : '') : '') + search;
const wanted = window.location.pathname + (full ? '?' + full : '');
if (wanted !== window.location.pathname + window.location.search) {
  if (bar.data.step[0]) { window.history.pushState(null, '', wanted); } else { window.history.replaceState(null, '', wanted); }
}
"""
_HISTORY = """
window.addEventListener('popstate', () => {
  back.data = {search: [window.location.search], count: [back.data.count[0] + 1]};
});
"""
_KEYS = """
document.documentElement.lang = 'en';
document.addEventListener('keydown', (event) => {
  if (!event.key.startsWith('Arrow') || event.ctrlKey || event.metaKey || event.altKey) { return; }
  const path = event.composedPath();
  const owns = (e) => ['INPUT', 'SELECT', 'TEXTAREA'].includes(e.tagName)
    || ['slider', 'tab', 'grid'].includes(e.getAttribute('role'))
    || e.classList.contains('bk-tab') || e.classList.contains('slick-viewport') || e.classList.contains('noUi-handle');
  const typing = path.some((e) => e instanceof Element && owns(e));
  if (typing) { return; }
  event.preventDefault();
  keys.data = {key: [event.key], count: [keys.data.count[0] + 1]};
});
"""
_TABS = """
document.addEventListener('keydown', (event) => {
  const tab = event.composedPath()[0];
  if (!(tab instanceof Element) || !tab.classList.contains('bk-tab')) { return; }
  if (event.key === 'Enter' || event.key === ' ') { event.preventDefault(); tab.click(); }
  const next = {ArrowLeft: tab.previousElementSibling, ArrowRight: tab.nextElementSibling}[event.key];
  if (next && next.classList.contains('bk-tab')) { event.preventDefault(); next.focus(); next.click(); }
});
"""
_FOCUS = """
const framed = (event, style) => {
  const plot = event.composedPath().find((e) => e instanceof HTMLElement && e.classList.contains('bk-events'));
  if (plot) { plot.style.outline = style; plot.style.outlineOffset = '-2px'; }
};
document.addEventListener('keyup', (event) => {
  if (event.key !== 'Tab') { return; }
  framed(event, '2px solid ' + getComputedStyle(document.documentElement).getPropertyValue('--sb-accent'));
});
document.addEventListener('pointerdown', (event) => framed(event, 'none'), true);
document.addEventListener('keydown', (event) => { if (event.key === 'Tab') { framed(event, 'none'); } }, true);
"""
"""Plots lie where no sheet of the page reaches; one that was clicked needs no frame."""
_TOO_LARGE = """
document.addEventListener('input', (event) => {
  const field = event.composedPath()[0];
  if (!(field instanceof HTMLInputElement) || field.type !== 'file') { return; }
  const large = [...field.files].find((file) => file.size > %d);
  if (!large) { return; }
  field.value = '';
  refused.data = {name: [large.name], bytes: [large.size], count: [refused.data.count[0] + 1]};
}, true);
"""
_TURN = """
const search = new URLSearchParams(window.location.search);
if (search.get('%(name)s') === '%(value)s') { search.delete('%(name)s'); } else { search.set('%(name)s', '%(value)s'); }
window.location.search = search.toString();
"""
"""Load the page again with another look; the address keeps all else."""


def framed(page: Page) -> Any:
    """All of a page."""
    look, shared = page.look, page.shared
    pn.config.raw_css = [sheet(look)]
    words = Markup('<h1>snapbeam <span class="faint">{}</span></h1>').format(shared.source.name)
    title = Html(words, margin=0, sizing_mode="stretch_width", css_classes=["title"])
    dark = pn.widgets.Button(name="Dark" if look.name == "default" else "Light", align="center")
    dark.js_on_click(code=_TURN % {"name": "theme", "value": "dark"})
    lecture = pn.widgets.Button(name="Lecture" if look.scale == 1.0 else "Desk", align="center")
    lecture.js_on_click(code=_TURN % {"name": "type", "value": "large"})
    units = pn.widgets.Button(name="Ratios" if look.physical else "Hz, mm/s", align="center")
    units.js_on_click(code=_TURN % {"name": "units", "value": "physical"})
    controls = (page.target, page.compare, units, lecture, dark)
    top = pn.Row(title, *controls, sizing_mode="stretch_width", css_classes=["top"], margin=0)
    map_tab = pn.Column(page.old, page.card.layout, sizing_mode="stretch_width", margin=0)
    others = page_tabs(page)
    left = pn.Tabs(
        ("Map", map_tab),
        *((title, pn.Column(sizing_mode="stretch_width", margin=0)) for title in others),
        sizing_mode="stretch_width",
        css_classes=["left"],
    )

    def turned() -> None:
        """Fill a tab when it is first looked at."""
        at = left.active
        if at > 0 and not left[at].objects:
            made = list(others.values())[at - 1]()
            styled(made, look)
            left[at].objects = [made]
        page.write_address()

    left.param.watch(lambda _: page.post(turned), "active")
    page.cards, page.card_names = left, ["Map", *others]
    page.runs_box = runs = pn.FlexBox(page.runs[0].layout, margin=0, css_classes=["right"])
    wide = {"sizing_mode": "stretch_width", "margin": 0}
    body = pn.FlexBox(left, runs, flex_wrap="wrap", css_classes=["body"], **wide)
    whole = pn.Column(top, body, css_classes=["whole"], **wide)
    styled(whole, look)

    doc = page.doc
    page.bar.js_on_change("data", CustomJS(args={"bar": page.bar}, code=_ADDRESS))
    if doc is not None:
        sources = {"keys": page.keys, "back": page.back, "refused": page.refused}
        for code in (_KEYS, _TABS, _HISTORY, _FOCUS, _TOO_LARGE % UPLOAD):
            doc.js_on_event(DocumentReady, CustomJS(args=sources, code=code))
        doc.js_on_event(ConnectionLost, CustomJS(code=_GONE))
        for source in (page.bar, page.downloads.source, *sources.values()):
            doc.add_root(source)
    return whole


def page_tabs(page: Page) -> dict[str, Callable[[], Any]]:
    """Constructors of the tabs next to the map, by title."""
    found: dict[str, Callable[[], Any]] = {}
    if page.shared.system is not None:
        found["System"] = lambda: page.system_card().layout
    return found | {"Export": lambda: page.take_card().layout}
