"""How a page is laid out, and the few scripts that it runs in the browser."""

from __future__ import annotations

import html
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import panel as pn
from bokeh.events import ConnectionLost, DocumentReady
from bokeh.models import CustomJS

from snapbeam.explorer.limits import UPLOAD
from snapbeam.explorer.look import sheet, styled

if TYPE_CHECKING:
    from snapbeam.explorer.page import Page
    from snapbeam.explorer.views.run import RunView

__all__ = ["framed"]

_FIRST = "Click on the map, use the arrow keys, or type numbers, to see the run of a point."
_GONE = """
if (!document.getElementById('gone')) {
  const note = document.createElement('div');
  note.id = 'gone'; note.setAttribute('role', 'alert');
  note.textContent = 'The server of this page has stopped or cannot be reached. What is shown stays; '
    + 'nothing new can be computed. Start snapbeam explore again, then load the page anew.';
  document.body.appendChild(note);
}
"""
_ADDRESS = """
const search = bar.data.search[0];
const kept = new URLSearchParams(window.location.search).get('token');
const full = (kept ? 'token=' + encodeURIComponent(kept) + (search ? '&' : '') : '') + search;
window.history.replaceState(null, '', window.location.pathname + (full ? '?' + full : ''));
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
_THEME = """
const search = new URLSearchParams(window.location.search);
if (search.get('theme') === 'dark') { search.delete('theme'); } else { search.set('theme', 'dark'); }
window.location.search = search.toString();
"""


def framed(page: Page) -> Any:
    """All of a page."""
    look, shared = page.look, page.shared
    pn.config.raw_css = [sheet(look)]
    name = html.escape(shared.source.name)
    title = pn.pane.HTML(
        f'<h1>snapbeam <span class="faint">{name}</span></h1>', margin=0, sizing_mode="stretch_width"
    )
    dark = pn.widgets.Button(name="Dark" if look.name == "default" else "Light", width=70, align="center")
    dark.js_on_click(code=_THEME)
    top = pn.Row(
        title, page.target, page.compare, dark, sizing_mode="stretch_width", css_classes=["top"], margin=0
    )
    map_tab = pn.Column(page.card.layout, page.typed, sizing_mode="stretch_width", margin=0)
    map_tab.insert(0, page.old)
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

    left.param.watch(lambda _: page.post(turned), "active")
    runs = pn.FlexBox(page.runs[0].layout, margin=0, css_classes=["right"])
    page.runs[0].head.object = f'<span class="faint">{_FIRST}</span>'
    body = pn.FlexBox(
        left,
        runs,
        margin=0,
        sizing_mode="stretch_width",
        flex_wrap="wrap",
        css_classes=["body"],
    )
    whole = pn.Column(top, body, sizing_mode="stretch_width", margin=0, css_classes=["whole"])
    styled(whole, look)

    def add_run(view: RunView) -> None:
        styled(view.layout, look)
        runs.append(view.layout)

    page.add_run = add_run
    doc = page.doc
    page.bar.js_on_change("data", CustomJS(args={"bar": page.bar}, code=_ADDRESS))
    if doc is not None:
        doc.js_on_event(DocumentReady, CustomJS(args={"keys": page.keys}, code=_KEYS))
        doc.js_on_event(DocumentReady, CustomJS(code=_TABS))
        doc.js_on_event(DocumentReady, CustomJS(code=_FOCUS))
        large = CustomJS(args={"refused": page.refused}, code=_TOO_LARGE % UPLOAD)
        doc.js_on_event(DocumentReady, large)
        doc.js_on_event(ConnectionLost, CustomJS(code=_GONE))
        doc.add_root(page.bar)
        doc.add_root(page.keys)
        doc.add_root(page.refused)
        doc.add_root(page.downloads.source)
    return whole


def page_tabs(page: Page) -> dict[str, Callable[[], Any]]:
    """The tabs beside the map, by title: what makes them."""
    found: dict[str, Callable[[], Any]] = {}
    if page.shared.system is not None:
        found["System"] = lambda: page.system_card().layout
    return found | {"Take away": lambda: page.take_card().layout}
