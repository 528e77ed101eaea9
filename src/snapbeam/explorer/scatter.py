"""Two statistics of a map against each other: points selected there are marked in the map, and the other way round."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import panel as pn
from bokeh import models

from snapbeam.explorer import style

if TYPE_CHECKING:
    from snapbeam.explorer.cards import MapCard

_MOST = 20_000
"""Points that are drawn; of more every second, third, ... one."""
_FIRST = ("zero_crossings", "peak_force")


class ScatterView:
    """The figure below a map; it shares its points, and with them the selection, with the map."""

    def __init__(self, card: MapCard) -> None:
        self.card, look = card, card.look
        self.points = models.ColumnDataSource({name: [] for name in ("a", "b", "x", "y", "color")}, name="scatter")
        names = card.source.variables()
        start = [name if name in names else names[min(at, len(names) - 1)] for at, name in enumerate(_FIRST)]
        options = {name.replace("_", " "): name for name in names}
        self.choice = [
            pn.widgets.Select(name=title, options=options, value=value, width=170)
            for title, value in zip(("Points across", "Points upward"), start, strict=True)
        ]
        for each in self.choice:
            each.param.watch(lambda _: card.post(self.fill), "value")
        tools = {"tools": "box_select,lasso_select,pan,wheel_zoom,reset", "active_drag": "box_select"}
        self.plot = style.figure(look, name="scatter-plot", height=165, used=390, share=0.4, **tools)
        faint = {"nonselection_fill_alpha": 0.12, "nonselection_line_alpha": 0.0}
        self.plot.scatter(
            "a", "b", color="color", source=self.points, size=5, line_color=look.faint, line_width=0.5, **faint
        )
        self.words = style.Html("", width=170, css_classes=["scatter-words"])
        self.points.selected.on_change("indices", lambda attr, old, new: card.post(self._tell))
        self.layout = pn.Column(
            pn.FlexBox(*self.choice, self.words, margin=0, align_items="flex-end"), style.framed_plot(self.plot, margin=0),
            sizing_mode="stretch_width", margin=0,
        )  # fmt: skip
        style.styled(self.layout, look)
        self._marked: Any = None
        self._filled: Any = None

    def fill(self) -> None:
        """Show the points of the cut, and let the map mark those that are selected."""
        card, plane = self.card, self.card.plane
        key = (*(each.value for each in self.choice), plane, card.source.version)
        if key == self._filled:
            return
        self._filled = key
        values = [plane.values(each.value) for each in self.choice]
        if any(each is None for each in values):
            self.words.object = style.NOTE.format("there is no map yet")
            return
        x, y = (plane.x.at, plane.y.at) if card.source.is_list else np.meshgrid(plane.x.at, plane.y.at)
        kinds = plane.values("response_class")
        packed = style.colors_of("response_class", np.zeros(x.shape) if kinds is None else kinds, (0.0, 1.0))
        step = -(-x.size // _MOST)
        colors = style.hexes(packed.reshape(-1, 1).view(np.uint8)[::step])
        a, b, x, y = (np.ravel(each)[::step].astype(np.float64) for each in (*values, x, y))
        self.points.selected.indices = []
        color = colors if kinds is not None else [card.look.accent] * a.size
        self.points.data = {"a": a, "b": b, "x": x, "y": y, "color": color}
        for axis, each in zip(self.plot.axis, self.choice, strict=True):
            name, unit = each.value.replace("_", " "), card.source.label(each.value)[1]
            axis.axis_label = name if unit == "1" else f"{name} ({unit})"
        if self._marked is not card.view:
            self._marked = card.view
            card.view.mark_selected(self.points)
        self._tell()

    def _tell(self) -> None:
        count, chosen = len(self.points.data["a"]), len(self.points.selected.indices)
        words = f"{chosen} of {count} points are selected" if chosen else f"{count} points; draw a box or a lasso"
        self.words.object = style.NOTE.format(words)
