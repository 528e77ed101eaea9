"""One cursor for all pictures of a run; it lives in the browser alone."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from bokeh.models import ColumnDataSource, CustomJS, Range1d, Span

from snapbeam.explorer.look import Look

__all__ = ["Cursor"]


class Cursor:
    """Where the pointer is along a run, in cycles (or seconds), and the part of the run that is seen.

    Pictures over time share the range; each has a line at the cursor, and whatever else follows it listens to
    ``place``.
    """

    def __init__(self, look: Look, suffix: str, later: Callable[[Callable[[], None], int], Any]) -> None:
        self.look, self.suffix, self.later = look, suffix, later
        self.range = Range1d(0.0, 1.0)
        self.place = ColumnDataSource({"t": [0.0]}, syncable=False)

    def attach(self, plot: Any) -> None:
        """Give a picture over time the cursor."""
        line = Span(
            dimension="height",
            line_color=self.look.accent,
            line_width=1.2,
            line_alpha=0.9,
            syncable=False,
            location=None,
        )
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
