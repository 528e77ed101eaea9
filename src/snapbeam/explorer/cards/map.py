"""The card of the map: which cut is shown, what the pointer is over, which windows are computed."""

from __future__ import annotations

import html
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import panel as pn
from numpy.typing import NDArray

from snapbeam import InputError, Integration, ResponseClass, System
from snapbeam.explorer.address import Address
from snapbeam.explorer.cards.windows import WindowControl
from snapbeam.explorer.look import Look
from snapbeam.explorer.maps.plane import Plane
from snapbeam.explorer.maps.points import Point
from snapbeam.explorer.maps.scatter import Scatter
from snapbeam.explorer.maps.windows import Window
from snapbeam.explorer.shared import Shared
from snapbeam.explorer.views.map import MapView
from snapbeam.figures import CLASS_COLORS

__all__ = ["MapCard"]

_HEIGHT = 345
"""Pixels of the figure."""


class MapCard:
    """The map and its controls.

    Parameters
    ----------
    look : Look
    shared : Shared
    address : Address
    post, later : callable
        ``post(work)`` does something on the page's own thread, ``later(work, milliseconds)`` does it later.
    """

    def __init__(
        self,
        look: Look,
        shared: Shared,
        address: Address,
        post: Callable[[Callable[[], None]], None],
        later: Callable[[Callable[[], None], int], Any],
    ) -> None:
        self.look, self.shared, self.post, self.later = look, shared, post, later
        self.source = shared.source
        self.system, self.integration = shared.system, shared.integration
        self.changed = False
        self.dots: Any = None
        self.marks: list[tuple[dict[str, Any], str]] = []
        self.asked: Callable[[Point], None] = lambda _: None
        self.moved: Callable[[], None] = lambda: None
        self.own: set[Any] = set()
        """Keys of the windows that this page has asked for: those of other tabs are not laid over its map."""
        self._drawn: list[tuple[Window, NDArray[np.int8]]] = []
        self._picked: tuple[float, float] | None = None
        self._words = list(address.words)
        self._make_controls(address)
        self.control = WindowControl(self)
        self.holder = pn.Column(sizing_mode="stretch_width", margin=0)
        self.plane: Any  # a cut through a grid, or a list of points, which have one interface
        self.view: MapView
        self.rebuild(address.view)

    # ------------------------------------------------------------------ controls

    def _make_controls(self, address: Address) -> None:
        source = self.source
        dims, names = source.dims, source.variables()
        x = address.x if address.x in dims else dims[0]
        upward = [name for name in ("velocity_amplitude", "location") if name in dims and name != x]
        y = (
            address.y
            if address.y in dims and address.y != x
            else next(iter([*upward, *(n for n in dims if n != x)]))
        )
        if (address.x and address.x not in dims) or (address.y and address.y not in dims):
            self._words.append(f"address: this map's axes are {', '.join(dims)}")
        show = address.show if address.show in names else names[0]
        if address.show and address.show not in names:
            self._words.append(f"address: this map has no {address.show}")
        options = {name.replace("_", " "): name for name in dims}
        self.x = pn.widgets.Select(name="Across", options=options, value=x, width=170)
        self.y = pn.widgets.Select(name="Upward", options=options, value=y, width=170)
        self.show = pn.widgets.Select(
            name="Shown", options={name.replace("_", " "): name for name in names}, value=show, width=170
        )  # fmt: skip
        grid = [name for name in dims if not source.is_list and source.skeleton[name].size > 1]
        self.sliders = {name: self._slider(name, address) for name in grid}
        self.auto = pn.widgets.Checkbox(name="compute what is seen", value=True, align="center")
        self.stop = pn.widgets.Button(
            name="Stop", button_type="warning", width=70, visible=False, align="center"
        )
        self.again = pn.widgets.Button(name="Compute view", button_type="default", width=110, align="center")
        self.layers = pn.widgets.CheckButtonGroup(
            options={"threshold": "threshold", "V_QS1": "quasi", "measured": "dots", "windows": "windows"},
            value=["windows"], button_type="default",
        )  # fmt: skip
        self.hover = pn.pane.HTML(
            "&nbsp;", sizing_mode="stretch_width", css_classes=["hover"], margin=(0, 0, 0, 4)
        )
        self.state = pn.pane.HTML(
            "", sizing_mode="stretch_width", css_classes=["map-state"], margin=(0, 0, 0, 4)
        )
        self.key = pn.pane.HTML("", sizing_mode="stretch_width", margin=(0, 0, 0, 4))
        for widget in (self.x, self.y):
            widget.param.watch(self._axes_changed, "value")
        self.show.param.watch(lambda _: self.post(self.redraw), "value")
        self.layers.param.watch(lambda _: self.post(self.redraw), "value")
        self.stop.on_click(lambda _: self.post(lambda: self.control.cancel("stopped")))
        self.again.on_click(lambda _: self.post(lambda: self.control.compute_view(force=True)))
        for slider in self.sliders.values():
            slider.param.watch(lambda _: self.post(self._cut_changed), "value")
        self.auto.visible = self.again.visible = not source.is_list
        self.slider_box = pn.FlexBox(margin=0)

    def _slider(self, name: str, address: Address) -> Any:
        points = self.source.coordinate(name)
        labels = {
            f"{value:.6g}" if isinstance(value, float) else str(value): at
            for at, value in enumerate(points.tolist())
        }
        if len(labels) < points.size:
            labels = {repr(value): at for at, value in enumerate(points.tolist())}
        words, unit = self.source.label(name)
        title = f"{words} ({unit})" if unit != "1" else words
        wanted = address.at.get(str(self.source.skeleton[name].attrs.get("parameter", name)))
        value = (
            int(np.argmin(np.abs(points - wanted)))
            if isinstance(wanted, float) and points.dtype.kind == "f"
            else 0
        )
        return pn.widgets.DiscreteSlider(name=title, options=labels, value=value, width=240)

    def _axes_changed(self, event: Any) -> None:
        if self.x.value == self.y.value:  # the two change places
            other = self.y if event.obj is self.x else self.x
            other.value = event.old
            return
        self.post(lambda: self.rebuild(None))

    def _cut_changed(self) -> None:
        self.plane = replace(self.plane, fixed=self._fixed())
        self.redraw()
        self.control.view_moved()

    def _fixed(self) -> dict[str, int]:
        return {
            name: int(slider.value)
            for name, slider in self.sliders.items()
            if name not in (self.x.value, self.y.value)
        }

    # ------------------------------------------------------------------ the cut

    def rebuild(self, view: tuple[float, ...] | None) -> None:
        """Make the figure anew, of other axes."""
        self.control.cancel("")
        self.plane = (
            Scatter.of(self.source, self.x.value, self.y.value)
            if self.source.is_list
            else Plane.of(self.source, self.x.value, self.y.value, self._fixed())
        )
        self.view = MapView(self.look, self.plane.x, self.plane.y, _HEIGHT)
        if (
            view is not None
            and len(view) == 4
            and not ((self.plane.x.log and view[0] <= 0) or (self.plane.y.log and view[2] <= 0))
        ):
            self.view.view = (view[0], view[1], view[2], view[3])
        self.view.on_tap(self._tapped)
        self.view.on_hover(self._hovered)
        self.view.on_view(self.control.view_moved)
        for edge in ("inner_width", "inner_height"):
            self.view.plot.on_change(edge, lambda attr, old, new: self.control.view_moved())
        self.slider_box.objects = [
            slider for name, slider in self.sliders.items() if name not in (self.x.value, self.y.value)
        ]  # fmt: skip
        self.holder.objects = [pn.pane.Bokeh(self.view.plot, sizing_mode="stretch_width", margin=0)]
        self.redraw()
        self.control.view_moved()

    @property
    def layout(self) -> Any:
        """The card."""
        return pn.Column(
            pn.FlexBox(self.x, self.y, self.show, margin=0), self.slider_box, self.holder, self.key, self.hover,
            pn.FlexBox(self.auto, self.again, self.stop, self.layers, align_items="center", margin=0), self.state,
            sizing_mode="stretch_width", css_classes=["card"],
        )  # fmt: skip

    @property
    def plane_key(self) -> Any:
        """What two windows must share to be drawn over one another."""
        assert self.system is not None
        fixed = tuple(sorted(self.plane.fixed_values().items()))
        return self.system.hash, self.integration, self.plane.names, fixed

    def windows(self) -> list[Window]:
        """The windows over this cut that this page has asked for, the widest first."""
        if self.system is None or self.source.is_list:
            return []
        return self.shared.windows(self.plane_key, self.own)

    # ------------------------------------------------------------------ drawing

    def redraw(self) -> None:
        """Show everything anew."""
        name, layers = self.show.value, self.layers.value
        words: list[str] = []
        try:
            values = self.plane.values(name)
        except InputError as error:
            values = None
            words.append(str(error))
        limits = self._limits(name, values)
        label, unit = self.source.label(name)
        title = f"{label}{'' if unit == '1' else f' ({unit})'}"
        title = "" if name == "response_class" else title
        if self.source.is_list and values is not None:
            self.view.show_list(self.plane.x.at, self.plane.y.at, name, values, limits, title)
        else:
            self.view.show(name, values, limits, title)
        self.view.fade(self.changed)
        self.show_windows()
        words.append(
            self.view.show_quasi_static("quasi" in layers, self.source.scalars() | self._fixed_short())
        )
        if "threshold" in layers and self.source.is_list:
            words.append("the threshold is that of the columns of a grid; these are points")
        wanted = "threshold" in layers and values is not None and not self.source.is_list
        kinds = self.plane.values("response_class") if wanted else None
        self.view.show_threshold(kinds)
        self._draw_dots("dots" in layers, words)
        self._draw_marks()
        self._legend(values if name == "response_class" else None)
        if any(words):
            self._words = [each for each in words if each]
        self.tell()
        self.moved()

    def show_windows(self) -> None:
        """Draw the windows over the map."""
        shown = self.windows() if "windows" in self.layers.value or not self.source.skeleton.data_vars else []
        if shown and self.show.value != "response_class" and not self.source.skeleton.data_vars:
            known = [w.values[self.show.value][w.stride > 0] for w in shown if self.show.value in w.values]
            self.view.limits = _span(np.concatenate(known)) if known else (0.0, 1.0)
            self.view.mapper.update(
                low=self.view.limits[0], high=max(self.view.limits[1], self.view.limits[0] + 1e-300)
            )
        self._drawn = self.view.show_windows(shown, self.show.value)

    def _limits(self, name: str, values: NDArray[Any] | None) -> tuple[float, float]:
        return (0.0, 1.0) if values is None or name == "response_class" else _span(values)

    def _fixed_short(self) -> dict[str, Any]:
        from snapbeam.config import lookup

        return {lookup(name).short: value for name, value in self.plane.fixed_values().items()}

    def _draw_dots(self, wanted: bool, words: list[str]) -> None:
        dots = self.dots
        empty = np.zeros(0)
        if not wanted or dots is None:
            self.view.show_dots(empty, empty, empty)
            if wanted:
                words.append("no measured points yet: give a table of them under Take away")
            return
        names = (self.plane.x.name, self.plane.y.name)
        if not all(hasattr(dots, name) for name in names):
            words.append("measured points lie over frequency ratio, velocity amplitude and location")
            return
        keep = ~np.isnan(getattr(dots, names[0])) & ~np.isnan(getattr(dots, names[1]))
        x, y = (getattr(dots, name)[keep] for name in names)
        self.view.show_dots(x, y, dots.response_class[keep])

    def _draw_marks(self) -> None:
        places = [(self.plane.place(values), text) for values, text in self.marks]
        self.view.show_marks([(*place, text) for place, text in places if place is not None])

    def _legend(self, kinds: NDArray[Any] | None) -> None:
        items = []
        for kind in (*(k for k in ResponseClass if k >= 0), ResponseClass.UNKNOWN):
            share = (
                ""
                if kinds is None or not kinds.size
                else f" {100.0 * float(np.mean(kinds == int(kind))):.1f} %"
            )
            if kind is ResponseClass.UNKNOWN and (kinds is None or not (kinds == int(kind)).any()):
                continue
            items.append(
                f'<span class="swatch" style="background:{CLASS_COLORS[kind]}"></span>{kind.label}{share}'
            )
        self.key.object = (
            f'<div class="key">{" &nbsp; ".join(items)}</div>' if self.show.value == "response_class" else ""
        )

    def say(self, words: str) -> None:
        """Add a line to what is wrong."""
        self._words.append(words)
        self.tell()

    def tell(self, words: str = "") -> None:
        """Say how far windows are, and what is wrong."""
        lines = [words] if words else []
        if self.shared.why_not:
            lines.append(f"runs cannot be computed: {self.shared.why_not}")
        lines += self._words
        self.state.object = "<br>".join(html.escape(line) for line in lines)

    # ------------------------------------------------------------------ points

    def _tapped(self, x: float, y: float) -> None:
        self._picked = (x, y)
        self.asked(self.point(x, y))

    def point(self, x: float, y: float) -> Point:
        """The point that is shown at a place: that of the finest window drawn over it, or the map's."""
        for window, stride in reversed(self._drawn):
            at = window.computed_at(x, y, stride) if window.covers(x, y) else None
            if at is not None:
                values = dict(
                    zip(window.names, (window.x[at[1]].item(), window.y[at[0]].item()), strict=True)
                )
                held = {name: found[at].item() for name, found in window.values.items()}
                return Point(values | self.plane.fixed_values(), held)
        return self.plane.at(*self.plane.index(x, y))

    def expected(self, point: Point) -> dict[str, Any]:
        """What the map holds of a point; empty if it is none of the map's, or the system has changed."""
        if point.expected or self.changed or not self.source.skeleton.data_vars:
            return point.expected
        place = self.plane.find(point.values)
        return {} if place is None else self.source.point(self.plane.indexers(*place))

    def step(self, values: dict[str, Any], across: int, upward: int) -> Point | None:
        """The neighbour of a point, *across* and *upward* points on."""
        place = self.plane.place(values)
        if place is None:
            return None
        for window, drawn in reversed(self._drawn):
            at = window.computed_at(place[0], place[1], drawn) if window.covers(*place) else None
            if at is not None:
                stride = max(int(drawn[at]), 1)
                column = int(np.clip(at[1] + across * stride, 0, window.x.size - 1))
                row = int(np.clip(at[0] + upward * stride, 0, window.y.size - 1))
                return self.point(float(window.x[column]), float(window.y[row]))
        beside = self.plane.beside(place, across, upward)
        if self.source.is_list:
            return self.plane.at(*beside)
        return self.point(float(self.plane.x.at[beside[1]]), float(self.plane.y.at[beside[0]]))

    def _hovered(self, x: float, y: float) -> None:
        point = self.point(x, y)
        name = self.show.value
        held = point.expected
        if not held and not self.changed:
            place = self.plane.index(x, y)
            held = {}
            for each in {"response_class", "zero_crossings", "peak_force", name} & set(
                self.source.variables()
            ):
                try:
                    values = self.plane.values(each)
                except InputError:
                    values = None
                if values is not None:
                    held[each] = values[place].item()
        parts = [html.escape(point.words())]
        if "response_class" in held:
            parts.append(f"<b>{ResponseClass(int(held['response'])).label}</b>")
        for each in dict.fromkeys((name, "zero_crossings", "peak_force")):
            if each in held and each != "response_class":
                unit = self.source.label(each)[1]
                parts.append(f"{each.replace('_', ' ')} {held[each]:.5g}{'' if unit == '1' else f' {unit}'}")
        self.hover.object = " &nbsp;·&nbsp; ".join(parts)

    def use(self, system: System, integration: Integration, changed: bool) -> None:
        """Compute points and windows of another system from now on."""
        self.control.cancel("")
        self.system, self.integration, self.changed = system, integration, changed
        self.redraw()


def _span(values: NDArray[Any]) -> tuple[float, float]:
    good = values[np.isfinite(values)] if values.dtype.kind == "f" else values
    return (float(good.min()), float(good.max())) if good.size else (0.0, 1.0)
