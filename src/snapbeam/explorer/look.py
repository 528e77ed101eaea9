"""Colours, light and dark, and what all pictures of the page share."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from bokeh.core.property.descriptors import UnsetValueError
from bokeh.models import ColumnDataSource
from bokeh.plotting import figure as bokeh_figure
from numpy.typing import NDArray

from snapbeam import ResponseClass
from snapbeam.figures import CLASS_COLORS

__all__ = [
    "DARK", "LIGHT", "Look", "blend", "class_chip", "colors_of", "columns", "figure", "fit", "focused", "inner_size",
    "legend", "look_of", "sequential", "sheet", "styled",
]  # fmt: skip


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


LIGHT = Look(
    "default",
    "#f3f4f6",
    "#ffffff",
    "#1b1f24",
    "#59636e",
    "#e4e7eb",
    "#000000",
    "#2a87c8",
    "#b03a27",
    "#1f6feb",
    "#8250df",
)
DARK = Look(
    "dark",
    "#0f1318",
    "#181d24",
    "#e6e9ed",
    "#9aa4af",
    "#2c333c",
    "#f2f4f6",
    "#70bbf0",
    "#f08a75",
    "#6cb0ff",
    "#c297ff",
)


def look_of(theme: str) -> Look:
    """The look of a theme of Panel's."""
    return DARK if theme == "dark" else LIGHT


@cache
def sheet(look: Look) -> str:
    """The page's style sheet."""
    text = (Path(__file__).parent / "page.css").read_text(encoding="utf-8")
    names = {
        name: getattr(look, name) for name in ("page", "card", "text", "faint", "grid", "accent", "striker")
    }
    variables = "".join(f"--sb-{name}: {value};" for name, value in names.items())
    return (
        f":root, :host {{ {variables} color-scheme: {'dark' if look.name == 'dark' else 'light'}; }}\n{text}"
    )


def focused(look: Look) -> str:
    """How what has the keyboard's focus is told, where the page's sheet does not reach."""
    return f":focus-visible {{ outline: 2px solid {look.accent} !important; outline-offset: -2px; }}"


def styled(item: Any, look: Look) -> None:
    """Give a part of the page, and all that is in it, the page's style sheet."""
    style = sheet(look)
    for each in item.select():
        if style not in each.stylesheets:
            each.stylesheets = [*each.stylesheets, style]


def figure(look: Look, **options: Any) -> Any:
    """An empty Bokeh figure in the house's look."""
    settings: dict[str, Any] = {
        "sizing_mode": "stretch_width",
        "toolbar_location": "right",
        "tools": "pan,box_zoom,wheel_zoom,reset",
        "border_fill_color": look.card,
        "background_fill_color": look.card,
        "outline_line_color": look.faint,
        "min_border_left": 58,
        "min_border_right": 6,
        "min_border_top": 6,
        "lod_threshold": None,
    }
    plot = bokeh_figure(**(settings | options))
    for axis in plot.axis:
        axis.axis_label_text_color = axis.major_label_text_color = look.text
        axis.axis_label_text_font_style = "normal"
        axis.axis_label_text_font_size = "12px"
        axis.major_label_text_font_size = "11px"
        axis.axis_line_color = axis.major_tick_line_color = look.faint
        axis.minor_tick_line_color = None
    plot.grid.grid_line_color = look.grid
    plot.stylesheets = plot.toolbar.stylesheets = [focused(look)]
    plot.toolbar.logo = None
    plot.toolbar.autohide = False
    plot.title.text_color = look.text
    plot.title.text_font_size = "12px"
    plot.title.text_font_style = "normal"
    return plot


def fit(plot: Any, *curves: NDArray[Any]) -> None:
    """Let a figure show all of some curves."""
    known = [curve[np.isfinite(curve)] for curve in curves]
    known = [curve for curve in known if curve.size]
    if known:
        low, high = min(float(each.min()) for each in known), max(float(each.max()) for each in known)
        room = 0.06 * (high - low) or 0.5
        plot.y_range.update(start=low - room, end=high + room)


def legend(plot: Any, look: Look) -> None:
    """Put the legend of a figure above it."""
    for item in list(plot.legend):
        plot.center.remove(item)
        plot.add_layout(item, "above")
        item.location = "top_left"
        item.orientation = "horizontal"
        item.background_fill_color = look.card
        item.background_fill_alpha = 0.75
        item.label_text_color = look.text
        item.label_text_font_size = "11px"
        item.border_line_color = None
        item.padding, item.spacing, item.margin = 3, 8, 4
        item.glyph_height = item.label_height = 14
        item.click_policy = "hide"


def inner_size(plot: Any, otherwise: tuple[int, int]) -> tuple[int, int]:
    """Pixels of what a figure shows; *otherwise* until the browser has said it."""
    found = []
    for name, value in zip(("inner_width", "inner_height"), otherwise, strict=True):
        try:
            found.append(int(getattr(plot, name) or value))
        except UnsetValueError:
            found.append(value)
    return found[0], found[1]


def blend(first: str, last: str, steps: int = 64) -> list[str]:
    """Colours from one to another."""
    ends = [np.array([int(color[i : i + 2], 16) for i in (1, 3, 5)]) for color in (first, last)]
    mixed = [
        np.round(ends[0] + share * (ends[1] - ends[0])).astype(int) for share in np.linspace(0.0, 1.0, steps)
    ]
    return [f"#{r:02x}{g:02x}{b:02x}" for r, g, b in mixed]


def columns(**values: Any) -> ColumnDataSource:
    """A source of columns, empty ones unless given."""
    return ColumnDataSource({name: np.asarray(value) for name, value in values.items()})


@cache
def sequential() -> NDArray[np.uint8]:
    """The 256 colours of numbers, of shape (256, 4)."""
    from cmcrameri import cm

    colors: NDArray[np.uint8] = np.round(255.0 * cm.batlow(np.linspace(0.0, 1.0, 256))).astype(np.uint8)
    return colors


@cache
def _class_table() -> NDArray[np.uint8]:
    """Colours by class + 1, of shape (5, 4)."""
    order = sorted(CLASS_COLORS)
    return np.array(
        [[int(CLASS_COLORS[kind][i : i + 2], 16) for i in (1, 3, 5)] + [255] for kind in order],
        dtype=np.uint8,
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
        bytes_ = sequential()[np.clip(np.where(good, share, 0.0) * 255.0, 0, 255).astype(np.int64)].copy()
        bytes_[~good, 3] = 0
    return np.ascontiguousarray(bytes_).view(np.uint32).reshape(values.shape)


def class_chip(kind: ResponseClass) -> str:
    """The name of a class on its colour."""
    ink = "#111" if kind in (ResponseClass.TRANSIENT_2, ResponseClass.CONTINUOUS) else "#fff"
    return f'<span class="chip" style="background:{CLASS_COLORS[kind]};color:{ink}">{kind.label}</span>'
