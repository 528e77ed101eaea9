"""The map: any two axes, any variable, and on it the windows that were computed, the points and the layers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from bokeh import models
from numpy.typing import NDArray

from snapbeam import InputError, ResponseClass
from snapbeam.explorer.maps import Axis, Plane, Window, picture, visible_strides
from snapbeam.explorer.style import Look, colors_of, colors_of_numbers, columns, figure, hexes, inner_size, style_axis
from snapbeam.plot.map import quasi_static_curve
from snapbeam.plot.style import CLASS_COLORS

View = tuple[float, float, float, float]
_THROTTLE = 50
"""Milliseconds between two looks at where the pointer is."""
_HOVER = """
const now = Date.now();
if (now - (probe.tags[0] || 0) < %d) { return; }
probe.tags = [now];
probe.data = {x: [cb_obj.x], y: [cb_obj.y]};
"""
_IMAGE = ("image", "x", "y", "dw", "dh")


class MapView:
    """A figure of a map over the axes *x* and *y*, *height* pixels high; it holds no numbers but those it shows."""

    def __init__(self, look: Look, x: Axis, y: Axis, height: int = 400) -> None:
        self.look, self.x, self.y = look, x, y
        self.limits = (0.0, 1.0)
        self.plot = figure(
            look, name="map", height=height, used=390,
            x_axis_type="log" if x.log else "linear", y_axis_type="log" if y.log else "linear",
            x_range=models.Range1d(*x.span, bounds=None), y_range=models.Range1d(*y.span, bounds=None),
            x_axis_label=x.label, y_axis_label=y.label, title="", tools="pan,box_zoom,wheel_zoom,reset",
            active_scroll="wheel_zoom", active_drag="box_zoom",
        )  # fmt: skip
        self.plot.grid.visible = False
        for axis, bokeh_axis in ((x, self.plot.xaxis), (y, self.plot.yaxis)):
            if axis.words is not None:
                bokeh_axis.ticker = models.FixedTicker(ticks=axis.at.tolist())
                bokeh_axis.major_label_overrides = dict(zip(axis.at.tolist(), axis.words, strict=True))
        self.base = models.ColumnDataSource({name: [] for name in _IMAGE}, name="map-base")
        self.whole = self.plot.image_rgba(*_IMAGE, source=self.base)
        self.tiles = models.ColumnDataSource({name: [] for name in _IMAGE}, name="map-windows")
        self.plot.image_rgba(*_IMAGE, source=self.tiles)
        self.frames = columns(left=[], right=[], bottom=[], top=[])
        dotted = {"line_color": "#ffffff", "line_width": 1.0, "line_dash": "dotted"}
        self.plot.quad("left", "right", "bottom", "top", source=self.frames, fill_color=None, **dotted)
        self.curve, self.threshold = columns(x=[], y=[]), columns(x=[], y=[])
        for source, width, dash in ((self.curve, 1.4, "dashed"), (self.threshold, 1.8, "solid")):
            self.plot.line("x", "y", source=source, line_color="#ffffff", line_width=2.0 * width)
            self.plot.line("x", "y", source=source, line_color="#000000", line_width=width, line_dash=dash)
        self.dots = models.ColumnDataSource({"x": [], "y": [], "color": []})
        self.list = models.ColumnDataSource({"x": [], "y": [], "color": []}, name="map-list")
        for source, size, color, width in ((self.dots, 8, "#ffffff", 1.2), (self.list, 9, look.text, 0.5)):
            self.plot.scatter("x", "y", color="color", source=source, size=size, line_color=color, line_width=width)
        self.mark = models.ColumnDataSource({name: [] for name in ("x", "y", "text", "away", "align")}, name="map-mark")
        for color, width in (("#000000", 3.6), ("#ffffff", 1.6)):
            ring = {"size": 17, "marker": "circle_cross", "fill_color": None}
            self.plot.scatter("x", "y", source=self.mark, line_color=color, line_width=width, **ring)
        self.plot.text(
            "x", "y", "text", source=self.mark, x_offset="away", y_offset=-6, text_align="align", text_color="#ffffff",
            text_outline_color="#000000", text_font_style="bold", text_font_size=look.font(14),
        )  # fmt: skip
        self.mapper = models.LinearColorMapper(palette=hexes(colors_of_numbers("")), low=0.0, high=1.0)
        self.bar = models.ColorBar(
            color_mapper=self.mapper, visible=False, width=10, padding=4, label_standoff=5,
            background_fill_color=look.card, major_label_text_color=look.text, bar_line_color=look.faint,
        )  # fmt: skip
        self.plot.add_layout(self.bar, "right")
        self.probe = models.ColumnDataSource({"x": [], "y": []}, name="map-probe", tags=[0])
        self.plot.js_on_event("mousemove", models.CustomJS(args={"probe": self.probe}, code=_HOVER % _THROTTLE))
        left = models.CustomJS(args={"probe": self.probe}, code="probe.data = {x: [], y: []};")
        self.plot.js_on_event("mouseleave", left)
        self.physical: dict[str, Any] = {}
        """Axes in physical units opposite to those of the ratios, with what a ratio of 1 is, by "x" and "y"."""

    def show_units(self, units: dict[str, tuple[float, str]]) -> None:
        """Show further axes on top ("x") and on the right ("y"), in which a ratio of 1 is a number of a unit."""
        for name, axis, place in (("x", self.x, "above"), ("y", self.y, "right")):
            if name in self.physical:
                self.physical[name].visible = name in units
            if name not in units:
                continue
            factor, label = units[name]
            own = getattr(self.plot, f"{name}_range")
            if name not in self.physical:
                other = models.Range1d(own.start * factor, own.end * factor)
                getattr(self.plot, f"extra_{name}_ranges")["unit"] = other
                kind = models.LogAxis if axis.log else models.LinearAxis
                made = kind(**{f"{name}_range_name": "unit"})
                if axis.log:
                    getattr(self.plot, f"extra_{name}_scales")["unit"] = models.LogScale()
                made.ticker.desired_num_ticks = 4  # labels do not touch on a phone
                style_axis(made, self.look)
                getattr(self.plot, place).insert(0, made)  # nearer than a colour bar
                self.physical[name] = made
                scaled = models.ColumnDataSource({"factor": [factor]}, name=f"map-unit-{name}")
                made.tags = [scaled]
                code = "const f = scaled.data.factor[0]; other.setv({start: own.start * f, end: own.end * f});"
                follow = models.CustomJS(args={"own": own, "other": other, "scaled": scaled}, code=code)
                own.js_on_change("start", follow)
                own.js_on_change("end", follow)
                other.js_on_change("start", follow)
            self.physical[name].tags[0].data = {"factor": [factor]}
            self.physical[name].axis_label = label
            getattr(self.plot, f"extra_{name}_ranges")["unit"].update(start=own.start * factor, end=own.end * factor)

    # ------------------------------------------------------------------ what was asked for

    def on_hover(self, tell: Callable[[float | None, float | None], None]) -> None:
        """Say where the pointer is; None once it has left the map."""

        def moved(_: str, __: Any, data: dict[str, Any]) -> None:
            if len(data["x"]) and data["x"][0] is not None:
                tell(float(data["x"][0]), float(data["y"][0]))
            else:
                tell(None, None)

        self.probe.on_change("data", moved)

    def on_view(self, tell: Callable[[], None]) -> None:
        """Say that another part is seen."""
        self.plot.on_event("rangesupdate", lambda _: tell())

    @property
    def view(self) -> View:
        """Left, right, low and high border of what is seen."""
        across, upward = self.plot.x_range, self.plot.y_range
        return float(across.start), float(across.end), float(upward.start), float(upward.end)

    @view.setter
    def view(self, view: View) -> None:
        self.plot.x_range.update(start=view[0], end=view[1])
        self.plot.y_range.update(start=view[2], end=view[3])

    @property
    def pixels(self) -> tuple[int, int]:
        """Size of what is seen."""
        return inner_size(self.plot, (560, 340))

    @property
    def is_whole(self) -> bool:
        """True if the complete map is visible."""
        left, right, low, high = self.view
        (first, last), (bottom, top) = self.x.span, self.y.span
        return left <= first and right >= last and low <= bottom and high >= top

    # ------------------------------------------------------------------ what is shown

    def show(self, name: str, values: NDArray[Any] | None, limits: tuple[float, float], title: str) -> None:
        """Show a variable, an array of shape (y, x)."""
        self._scale(name, limits, title)
        seen = None if values is None else picture(values, self.x, self.y, self.view, self.pixels)
        held = () if seen is None else (colors_of(name, seen.values, limits), seen.x, seen.y, seen.width, seen.height)
        self.base.data = {each: list(held[at : at + 1]) for at, each in enumerate(_IMAGE)}

    def _scale(self, name: str, limits: tuple[float, float], title: str) -> None:
        """Take the limits of the colours of a variable, and its title."""
        self.limits, self.bar.visible, self.plot.title.text = limits, name != "response_class", title
        high = limits[1] if limits[1] > limits[0] else limits[0] + 1.0
        self.mapper.update(palette=hexes(colors_of_numbers(name)), low=limits[0], high=high)

    def fade(self, old: bool) -> None:
        """Show the map pale, if it is of another system than what is computed."""
        self.whole.glyph.global_alpha = 0.3 if old else 1.0

    def show_windows(
        self, windows: list[Window], name: str, plane: Plane | None
    ) -> list[tuple[Window, NDArray[np.int8]]]:
        """Draw windows over the map where they are finer; returns them with their strides as they are drawn.

        *plane* is the cut through the map; None if it has no numbers, or those of another system.
        """
        images, borders, drawn = [], [], []
        known = [window for window in windows if name in window.values]
        for window, stride in zip(known, visible_strides(known, plane), strict=True):
            if not stride.any():
                continue
            with window.writing:
                image = colors_of(name, window.values[name], self.limits).copy()
            drawn.append((window, stride))
            image[stride == 0] = 0
            left, right, low, high = window.bounds
            images.append((image, left, low, right - left, high - low))
            borders.append(window.bounds)
        self.tiles.data = {key: [each[at] for each in images] for at, key in enumerate(_IMAGE)}
        sides = ("left", "right", "bottom", "top")
        self.frames.data = {key: [each[at] for each in borders] for at, key in enumerate(sides)}
        return drawn

    def show_list(
        self, x: NDArray[Any], y: NDArray[Any], name: str, values: NDArray[Any], limits: tuple[float, float], title: str
    ) -> None:
        """Show a list of points as dots in the colours of a variable; those without a number are clear."""
        self._scale(name, limits, title)
        packed = colors_of(name, values[None, :], limits)[0].view(np.uint8).reshape(-1, 4)
        self.list.data = {"x": x, "y": y, "color": hexes(packed)}

    def show_marks(self, marks: list[tuple[float, float, str]]) -> None:
        """Mark the points whose runs are shown."""
        self.mark.data = {
            "x": [each[0] for each in marks], "y": [each[1] for each in marks], "text": [each[2] for each in marks],
            "away": [-10 if each[2] == "A" else 10 for each in marks],  # A left and B right of what may be one place
            "align": ["right" if each[2] == "A" else "left" for each in marks],
        }  # fmt: skip

    def mark_selected(self, points: models.ColumnDataSource) -> None:
        """Mark the selected ones of some points, and let a box in the map select."""
        unseen = {f"{kind}{part}_alpha": 0.0 for kind in ("", "nonselection_") for part in ("fill", "line")}
        ring: dict[str, Any] = {"selection_line_color": "#000000", "selection_fill_color": "#ffffff"}
        ring |= {"selection_line_alpha": 1.0, "selection_fill_alpha": 1.0}
        marks = self.plot.scatter("x", "y", source=points, size=6, **unseen, **ring)
        self.plot.add_tools(models.BoxSelectTool(renderers=[marks]))

    def show_quasi_static(self, visible: bool, attributes: Mapping[str, Any], fixed: dict[str, Any]) -> str:
        """Draw V_QS1 of one mode (Eq. 21); returns the reason if it cannot be drawn."""
        self.curve.data = {"x": [], "y": []}
        if not visible:
            return ""
        try:
            xy = quasi_static_curve(attributes, (self.x.name, self.y.name), (self.x.span, self.y.span), fixed)
        except InputError as error:
            return str(error)
        inside = (xy[0] <= self.x.span[1]) & (xy[1] <= self.y.span[1])
        self.curve.data = {"x": xy[0][inside], "y": xy[1][inside]}
        return ""

    def show_threshold(self, values: NDArray[Any] | None) -> None:
        """Draw the lowest interwell cell of each column, as steps; *values* are classes of shape (y, x)."""
        self.threshold.data = {"x": [], "y": []}
        if values is None:
            return
        above = values >= int(ResponseClass.TRANSIENT_1)
        first = np.where(above.any(axis=0), above.argmax(axis=0), -1)
        x, y = [], []
        for column, row in enumerate(first):
            level = np.nan if row < 0 else float(self.y.edges[row])
            x += [float(self.x.edges[column]), float(self.x.edges[column + 1])]
            y += [level, level]
        self.threshold.data = {"x": np.array(x), "y": np.array(y)}

    def show_dots(self, x: NDArray[Any], y: NDArray[Any], kinds: NDArray[Any]) -> None:
        """Lay measured points over the map."""
        colors = [CLASS_COLORS[ResponseClass(int(kind))] for kind in kinds]
        self.dots.data = {"x": x, "y": y, "color": colors}
