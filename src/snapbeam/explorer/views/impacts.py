"""The table of impacts, and the statistics of the run."""

from __future__ import annotations

import html
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import panel as pn
from bokeh.models import ColumnDataSource, DataTable, NumberFormatter, TableColumn

from snapbeam import STATISTICS
from snapbeam.explorer.look import Look, sheet
from snapbeam.explorer.views.cursor import Cursor
from snapbeam.explorer.views.part import Part

if TYPE_CHECKING:
    from snapbeam import Run

__all__ = ["Impacts", "Numbers"]

_MOST = 20_000
_TABLE = """
.slick-viewport, .grid-canvas, .slick-pane { background: var(--sb-card); }
.slick-header-column, .slick-header-columns { background: var(--sb-card) !important; color: var(--sb-text); }
.slick-row, .slick-cell { background: var(--sb-card) !important; color: var(--sb-text); border-color: var(--sb-grid); }
.slick-row.odd, .slick-row.odd .slick-cell { background: var(--sb-page) !important; }
.slick-row .slick-cell.selected { background: var(--sb-grid) !important; }
"""


class Impacts(Part):
    """A row an impact; a click on one shows it closer."""

    title = "Impacts"

    def __init__(self, look: Look, cursor: Cursor, closer: Callable[[float, float], None]) -> None:
        super().__init__(look, cursor)
        self.closer = closer

    def build(self) -> list[Any]:
        names = {
            "cycle": ("onset (cycles)", "0.0000"), "time": ("onset (ms)", "0.000"),
            "duration": ("duration (µs)", "0.0"), "peak": ("peak force (N)", "0.000"),
            "impulse": ("impulse (mN s)", "0.0000"),
        }  # fmt: skip
        self.source = ColumnDataSource({name: [] for name in names}, name=self.named("impacts"))
        shown = [
            TableColumn(field=name, title=title, formatter=NumberFormatter(format=digits))
            for name, (title, digits) in names.items()
        ]
        table = DataTable(
            source=self.source,
            columns=shown,
            sizing_mode="stretch_width",
            height=400,
            index_position=None,
            stylesheets=[sheet(self.look), _TABLE],
        )
        self.source.selected.on_change("indices", self._chosen)
        self.words = pn.pane.HTML("", sizing_mode="stretch_width")
        return [self.words, pn.pane.Bokeh(table, sizing_mode="stretch_width")]

    def show(self, run: Run, low: float, high: float) -> None:
        found = run.impacts.isel(impact=slice(0, _MOST))
        time = found["onset"].values
        cycle = (
            np.interp(time, run.dataset["time"].values, run.dataset["cycle"].values)
            if "cycle" in run.dataset.variables
            else time
        )
        self.source.data = {
            "cycle": cycle, "time": 1e3 * time, "duration": 1e6 * found["duration"].values,
            "peak": found["peak_force"].values, "impulse": 1e3 * found["impulse"].values,
        }  # fmt: skip
        count = run.impacts.sizes["impact"]
        more = f"; the first {_MOST} are listed" if count > _MOST else ""
        self.words.object = f'<p class="note">{count} impacts{more}. Click on one to see it closer.</p>'

    def _chosen(self, _: str, __: Any, rows: list[int]) -> None:
        if rows:
            at = rows[0]
            self.closer(float(self.source.data["cycle"][at]), float(self.source.data["duration"][at]) * 1e-6)


class Numbers(Part):
    """Every statistic with its unit and its meaning."""

    title = "Numbers"

    def build(self) -> list[Any]:
        self.table = pn.pane.HTML("", sizing_mode="stretch_width")
        return [self.table]

    def show(self, run: Run, low: float, high: float) -> None:
        rows = []
        for name, value in run.summary.items():
            row = STATISTICS.get(name)
            shown = getattr(value, "label", None) or getattr(value, "name", None) or value
            text = f"{shown:.8g}" if isinstance(shown, float) else str(shown)
            text = "–" if isinstance(shown, float) and np.isnan(shown) else text
            unit = "" if row is None or row.unit == "1" else row.unit
            words = "" if row is None else row.long_name
            cells = (
                html.escape(words),
                html.escape(text),
                html.escape(unit),
                f"<code>{html.escape(name)}</code>",
            )
            kinds = ("", ' class="num"', ' class="unit"', "")
            row_text = "".join(f"<td{kind}>{cell}</td>" for kind, cell in zip(kinds, cells, strict=True))
            rows.append(f"<tr>{row_text}</tr>")
        self.table.object = f'<table class="numbers">{"".join(rows)}</table>'
