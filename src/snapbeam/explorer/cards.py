"""The card of the map: which cut is shown, what the pointer is over, which windows are computed."""

from __future__ import annotations

import math
import tempfile
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib.pyplot as plt
import numpy as np
import panel as pn
from bokeh.models import PrintfTickFormatter
from markupsafe import Markup, escape
from numpy.typing import NDArray
from scipy.io import wavfile

from snapbeam import STATISTICS, InputError, Integration, ResponseClass, RunStatus, System, write_netcdf
from snapbeam.explorer import jobs, maps, style
from snapbeam.explorer.address import Address, typed
from snapbeam.explorer.map_view import MapView
from snapbeam.explorer.run_view import across, within
from snapbeam.explorer.scatter import ScatterView
from snapbeam.explorer.shared import Shared
from snapbeam.model.parameter_axes import CHANGES_UNITS
from snapbeam.model.parameter_file import Config, config_from_mapping
from snapbeam.model.parameters import PHYSICAL, Parameter, lookup, parameters, row_of
from snapbeam.model.quantity import split_name
from snapbeam.plot.dataset import plot_dataset
from snapbeam.plot.map import plot_points, plot_response_map, plot_statistic
from snapbeam.plot.schematic import LAWS
from snapbeam.plot.style import CLASS_COLORS, save_figure
from snapbeam.util.input_files import parsed_toml

if TYPE_CHECKING:
    import xarray as xr

    from snapbeam import Run
    from snapbeam.explorer.page import Page

# ----------------------------------------------------------------------------------------------------
# When a part of the map is computed again, and what the page shows meanwhile.


_REST = 350
"""Milliseconds that a view must rest before it is computed."""
_PUSH = 0.2
"""Seconds between two pictures of a window that fills."""
_COARSE = 9.0
"""Pixels of a cell above which a view is worth computing again."""
_WAIT = 10.0
"""Seconds of a window that are computed unasked."""


class WindowControl:
    """The window that is being computed for a page, if any."""

    def __init__(self, card: MapCard) -> None:
        self.card = card
        self._token: jobs.Token | None = None
        self._key: Any = None
        self._moved, self._pushed = 0, 0.0
        self._asked: set[Any] = set()
        """Keys of the windows that were asked for: they are computed to their end."""
        self._halted: set[Any] = set()
        """Keys of the windows that were stopped: they go on when they are asked for."""
        self._awake = False
        self._waiting = jobs.Waiting(card.later)

    def wake(self) -> None:
        """Start computing visible windows; the page is now loaded in a browser."""
        self._awake = True
        self.view_moved()

    def view_moved(self) -> None:
        """Another part is seen: the computation of the previous one stops, and this one is computed once it rests."""
        self.cancel("stopped, because the view moved" if self._token is not None else "")
        self.resized()

    def resized(self) -> None:
        """The figure has another size, or another part is seen."""
        if not self._awake:
            return
        self._moved += 1
        now = self._moved
        self.card.later(lambda: self._rested() if now == self._moved else None, _REST)

    def _rested(self) -> None:
        if self.card.source.skeleton.data_vars and not (self.card.plane.x.even and self.card.plane.y.even):
            self.card.redraw()
        self.card._legend()
        self.card.moved()
        if self.card.auto.value and self._worth_computing():
            self.compute_view()

    def _worth_computing(self) -> bool:
        if self.card.system is None or not self.card.plane.can_zoom or self.card.source.is_list:
            return False
        if not self.card.source.skeleton.data_vars or self.card.changed:
            return True
        left, right, low, high = self.card.view.view
        wide, tall = self.card.view.pixels
        inside = [
            max(int(((axis.edges[:-1] < b) & (axis.edges[1:] > a)).sum()), 1)
            for axis, a, b in ((self.card.plane.x, left, right), (self.card.plane.y, low, high))
        ]
        return not self.card.view.is_whole and max(wide / inside[0], tall / inside[1]) > _COARSE

    def compute_view(self, force: bool = False) -> None:
        """Compute what is seen where it becomes finer, from coarse to fine, in place of what was being computed.

        Unless *force* asks for all of it, it ends before a level that would take too long.
        """
        if self.card.system is None or not self.card.plane.can_zoom:
            self.card.tell("a window needs two axes of numbers, and a system" if force else "")
            return
        bounds = self._bounds()
        if bounds is None:
            return
        key = (self.card.plane_key, bounds)
        if force:
            self._asked.add(key)
            self._halted.discard(key)
        elif key in self._halted:
            return
        seconds = math.inf if key in self._asked else _WAIT
        self.cancel("")
        self.card.own.add(key)
        try:
            system, integration = maps.Point(self.card.plane.fixed_values()).system(
                self.card.system, self.card.integration
            )
        except InputError as error:
            self.card.tell(str(error))
            return
        log = (self.card.plane.x.log, self.card.plane.y.log)
        made = maps.planned(system, integration, self.card.plane.names, bounds, log, self.card.view.pixels, key=key)
        window = self.card.shared.window(made)
        if window is made:
            others = [each for each in self.card.windows() if each is not made]
            strides = [each.stride.copy() for each in others]
            made.known = maps.known_cells(made, self.card.shown_plane, list(zip(others, strides, strict=True)))
        if window.finished or not window.wanted:  # by this page before, or by another
            self.card.show_windows()
            self.card.tell("" if window.finished or not force else "the map is as fine as the screen shows")
            return
        self._token = token = jobs.Token(jobs.WINDOW_SECONDS)
        self._key = key
        self.card.stop.visible = True
        self.card.tell("computing this view")
        self._waiting.begin(0, self._still)
        self.card.shared.jobs.window(
            lambda _: maps.compute(window, self.card.shared.jobs, token, lambda w: self._grew(w, token), seconds),
            lambda _, words: self.card.post(lambda: self._ended(window, token, words)),
            token,
        )

    def _bounds(self) -> tuple[float, float, float, float] | None:
        """Visible ranges of the axes, clipped to the allowed parameter values."""
        left, right, low, high = self.card.view.view
        plane = self.card.plane
        found: list[float] = []
        for a, b, name, axis in zip((left, low), (right, high), plane.names, (plane.x, plane.y), strict=True):
            item = lookup(name).quantity
            least, most = max(a, item.low), min(b, item.high)
            if axis.log:
                least = max(least, 1e-3 * float(axis.at[0]))
            if not least < most:
                return None
            found += [least, most]
        return found[0], found[1], found[2], found[3]

    def _grew(self, window: maps.Window, token: jobs.Token) -> None:
        now = time.monotonic()
        if now - self._pushed > _PUSH and not token.cancelled:
            self._pushed = now
            self.card.post(lambda: self._draw_growing(window, token))

    def _still(self, seconds: float) -> None:
        if self._token is not None:
            self.card.tell(f"computing this view, {seconds:.0f} s")

    def _draw_growing(self, window: maps.Window, token: jobs.Token) -> None:
        if token is not self._token:
            return
        self._waiting.end(0)
        self.card.show_windows()
        finest = int(window.stride[window.stride > 0].min()) if (window.stride > 0).any() else 27
        left = _duration((window.wanted - window.done) * window.seconds)
        self.card.tell(
            f"window: {window.done} of {window.wanted} points; blocks of {finest} cells now; about {left} left"
        )

    def _ended(self, window: maps.Window, token: jobs.Token, words: str) -> None:
        if token is self._token:
            self._waiting.end(0)
            self.card.stop.visible = False
            self._token = None
            self.card.show_windows()
            if not words and window.waits:
                words = f"window: {window.done} of {window.wanted} points; Compute view continues"
            self.card.tell(words or f"window: all {window.wanted} points computed")

    def halt(self) -> None:
        """Stop the window, until it is asked for."""
        self._halted.add(self._key)
        self.cancel("stopped")

    def cancel(self, words: str) -> None:
        """Compute no window any more."""
        if self._token is not None:
            self._token.cancel()
            self._token = None
            self._waiting.end(0)
            self.card.stop.visible = False
        if words:
            self.card.tell(f"{words}; what was computed is kept")


def _duration(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 120.0 else f"{seconds / 60.0:.0f} min"


# ----------------------------------------------------------------------------------------------------


_HEIGHT, _LOW = 345, 195
"""Pixels of the figure, alone and above another one."""


class MapCard:
    """The map and its controls; ``post`` does something on the page's own thread, ``later`` after milliseconds."""

    def __init__(
        self, look: style.Look, shared: Shared, address: Address, post: style.Post, later: style.Later
    ) -> None:
        self.look, self.shared, self.post, self.later = look, shared, post, later
        self.source = shared.source
        self.system, self.integration = shared.system, shared.integration
        self.changed = False
        self.dots: Any = None
        self.marks: list[tuple[dict[str, Any], str]] = []
        self.asked: Callable[[maps.Point], None] = lambda _: None
        self.moved: Callable[[], None] = lambda: None
        self.cut_moved: Callable[[dict[str, Any]], None] = lambda _: None
        self.own: set[Any] = set()
        """Keys of the windows that this page requested; those of other tabs are not drawn over its map."""
        self._drawn: list[tuple[maps.Window, NDArray[np.int8]]] = []
        self._apart: NDArray[np.float64] | None = None
        """The difference of two maps, of shape (y, x), if it is shown."""
        self._said = ""
        """The legend of the difference, or the reason why there is none."""
        self._words = list(address.words)
        self._restoring = False
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
        sizes = {name: source.coordinate(name) for name in dims}
        longest = sorted(dims, key=lambda name: (sizes[name].dtype.kind != "f", -sizes[name].size))
        best = sorted(longest[:2], key=dims.index) + longest[2:]  # the longest continuous axes, in the map's order
        x = address.x if address.x in dims else next(name for name in best if name != address.y)
        y = address.y if address.y in dims and address.y != x else next(name for name in best if name != x)
        if (address.x and address.x not in dims) or (address.y and address.y not in dims):
            self._words.append(f"address: this map's axes are {', '.join(dims)}")
        show = address.show if address.show in names else names[0]
        if address.show and address.show not in names:
            self._words.append(f"address: this map has no {address.show}")
        full = {name: maps.parameter_of(source.skeleton, name) for name in dims}
        words = maps.short_names(full.values())
        options = {words[full[name]]: name for name in dims}
        self.x = pn.widgets.Select(name="Across", options=options, value=x, width=170)
        self.y = pn.widgets.Select(name="Upward", options=options, value=y, width=170)
        self.show = pn.widgets.Select(
            name="Shown", options={name.replace("_", " "): name for name in names}, value=show, width=170
        )  # fmt: skip
        grid = [name for name in dims if not source.is_list and source.skeleton[name].size > 1]
        self.sliders = {name: self._slider(name, address) for name in grid}
        self.auto = pn.widgets.Checkbox(name="compute the view automatically", value=True, align="center")
        hidden: dict[str, Any] = {"visible": False, "align": "center"}
        self.stop = style.button(
            "Stop", self.post, lambda: self.control.halt(), button_type="warning", width=70, **hidden
        )
        self.again = style.button(
            "Compute view", self.post, lambda: self.control.compute_view(force=True), width=110, align="center"
        )  # fmt: skip
        layers = {"threshold": "threshold", "quasi-static": "quasi", "measured": "dots", "windows": "windows"}
        if source.skeleton.data_vars:
            layers |= {"difference": "difference", "scatter": "scatter"}
        given = ["windows"] if self.shared.other is None else ["windows", "difference"]
        self.layers = pn.widgets.CheckButtonGroup(options=layers, value=given, button_type="default")
        self.hover = style.Html("\xa0", sizing_mode="stretch_width", css_classes=["hover"], margin=(0, 0, 0, 4))
        self._selected: Markup = Markup("&nbsp;")
        self.state = style.Html("", sizing_mode="stretch_width", css_classes=["map-state"], margin=(0, 0, 0, 4))
        self.key = style.Html("", sizing_mode="stretch_width", margin=(0, 0, 0, 4), css_classes=["key-box"])
        for widget in (self.x, self.y):
            widget.param.watch(self._axes_changed, "value")
        self.show.param.watch(lambda _: self.post(self.redraw), "value")
        self.layers.param.watch(lambda _: self.post(self.redraw), "value")
        for slider in self.sliders.values():
            slider.param.watch(lambda _: None if self._restoring else self.post(self._cut_changed), "value")
        self.auto.visible = self.again.visible = not source.is_list
        self.slider_box = pn.FlexBox(margin=0)
        self.scatter: ScatterView | None = None
        self.scatter_box = pn.Column(sizing_mode="stretch_width", margin=0)
        self.typed = pn.FlexBox(margin=0)
        """Fields of a point."""

    def _slider(self, name: str, address: Address) -> Any:
        points = self.source.coordinate(name).tolist()
        labels = {f"{value:.6g}" if isinstance(value, float) else str(value): at for at, value in enumerate(points)}
        if len(labels) < len(points):
            labels = {repr(value): at for at, value in enumerate(points)}
        value = self._place(name, address) or 0
        # this one of Panel's widgets shows its name and its labels as HTML
        options = {str(escape(label)): at for label, at in labels.items()}
        return pn.widgets.DiscreteSlider(
            name=str(escape(self.source.title(name))), options=options, value=value, width=240
        )

    def _place(self, name: str, address: Address) -> int | None:
        """Which point of an axis that is not shown an address describes; None if it does not, or is of another map."""
        full, points = maps.parameter_of(self.source.skeleton, name), self.source.coordinate(name)
        wanted = address.cut.get(full, address.at.get(full))
        if wanted is None or points.dtype.kind not in "iuf":
            found = np.flatnonzero(points == wanted)
            return int(found[0]) if found.size else None
        return int(np.argmin(np.abs(points - wanted)))

    def cut(self) -> dict[str, Any]:
        """The values of the axes that have a slider and are not shown, by dotted name."""
        skeleton, held = self.source.skeleton, self._fixed()
        return {maps.parameter_of(skeleton, name): self.source.coordinate(name)[at].item() for name, at in held.items()}

    def restore(self, address: Address) -> None:
        """Show the axes, the variable, the cut and the part of the map of an address of this page."""
        self._restoring = True
        for widget, name in ((self.x, address.x), (self.y, address.y), (self.show, address.show)):
            if name in widget.options.values():
                widget.value = name
        for name, slider in self.sliders.items():
            place = self._place(name, address)
            slider.value = slider.value if place is None else place
        self._restoring = False
        if (self.x.value, self.y.value) != (self.plane.x.name, self.plane.y.name):
            self.rebuild(address.view)
            return
        self.plane = replace(self.plane, fixed=self.plane.fixed | self._fixed())
        self._see(address.view)
        self.redraw()
        self.control.view_moved()

    def _see(self, view: tuple[float, ...] | None) -> None:
        """Show a part of the map; all of it if there is none, or not on its logarithmic axes."""
        if view is None or (self.plane.x.log and view[0] <= 0) or (self.plane.y.log and view[2] <= 0):
            view = (*self.plane.x.span, *self.plane.y.span)
        self.view.view = (view[0], view[1], view[2], view[3])

    def _axes_changed(self, event: Any) -> None:
        if self._restoring:
            return
        if self.x.value == self.y.value:  # the two change places
            other = self.y if event.obj is self.x else self.x
            other.value = event.old
            return
        self.post(lambda: self.rebuild(None))

    def _cut_changed(self) -> None:
        self.plane = replace(self.plane, fixed=self.plane.fixed | self._fixed())
        self.cut_moved(self.cut())
        self.redraw()
        self.control.view_moved()

    def _fixed(self) -> dict[str, int]:
        return {
            name: int(slider.value) for name, slider in self.sliders.items() if name not in (self.x.value, self.y.value)
        }

    # ------------------------------------------------------------------ the cut

    def rebuild(self, view: tuple[float, ...] | None) -> None:
        """Make the figure again, for other axes."""
        self.control.cancel("")
        self.plane = (
            maps.Scatter.of(self.source, self.x.value, self.y.value)
            if self.source.is_list
            else maps.Plane.of(self.source, self.x.value, self.y.value, self._fixed())
        )
        self.view = MapView(self.look, self.plane.x, self.plane.y, _HEIGHT)
        self._see(view)
        style.on_tap(self.view.plot, lambda x, y: self.asked(self.point(x, y)))
        self.view.on_hover(self._hovered)
        self.view.on_view(self.control.view_moved)
        for edge in ("inner_width", "inner_height"):
            self.view.plot.on_change(edge, lambda attr, old, new: self.control.resized())
        self.slider_box.objects = [self.sliders[name] for name in self._fixed()]
        self.holder.objects = [style.framed_plot(self.view.plot, margin=0)]
        self.redraw()
        self.control.view_moved()

    @property
    def layout(self) -> Any:
        """The card."""
        return pn.Column(
            pn.FlexBox(self.x, self.y, self.show, margin=0), self.slider_box, self.holder, self.scatter_box,
            self.state, self.key, self.hover, self.typed,
            pn.FlexBox(self.auto, self.again, self.stop, self.layers, align_items="center", margin=0),
            sizing_mode="stretch_width", css_classes=["card"],
        )  # fmt: skip

    @property
    def plane_key(self) -> Any:
        """Key that two windows must share to be drawn over one another."""
        assert self.system is not None
        fixed = tuple(sorted(self.plane.fixed_values().items()))
        return self.system.hash, self.integration, self.plane.names, fixed

    def windows(self) -> list[maps.Window]:
        """Windows over this section that the page requested, the widest first."""
        if self.system is None or self.source.is_list:
            return []
        return self.shared.windows(self.plane_key, self.own)

    def _units(self) -> dict[str, tuple[float, str]]:
        """Physical value and unit of a ratio of 1 along each axis of the map (Hz, mm/s or g)."""
        names, fixed = self.plane.names, {} if self.source.is_list else self.plane.fixed_values()
        if self.system is None or any(name.startswith(CHANGES_UNITS) for name in names):
            return {}
        system = self.system.replace(**{
            name: value for name, value in fixed.items() if name.startswith(CHANGES_UNITS)
        })  # fmt: skip
        rows = {row.parameter: row for row in PHYSICAL.values() if row.unit != "m"}
        found = {}
        for side, name in zip("xy", names, strict=True):
            if name in rows:
                row, scale = rows[name], system.scale
                factor = row.unit_of(scale.length, scale.omega)
                factor, unit = (1e3 * factor, "mm/s") if row.unit == "m/s" else (factor, row.unit)
                found[side] = factor, "µm" if unit == "um" else unit
        return found

    # ------------------------------------------------------------------ drawing

    def redraw(self) -> None:
        """Show everything again."""
        self.view.show_units(self._units())
        name, layers = self.show.value, self.layers.value
        words: list[str] = []
        try:
            values = self.plane.values(name)
        except InputError as error:
            values = None
            words.append(str(error))
        limits = (0.0, 1.0) if values is None or name == "response_class" else _span(values)
        title = "" if name == "response_class" else self.source.title(name)
        if self.source.is_list and values is not None:
            self.view.show_list(self.plane.x.at, self.plane.y.at, name, values, limits, title)
        else:
            self.view.show(name, values, limits, title)
        self.view.fade(self.changed)
        self.show_windows()
        fixed = self.source.scalars() | {lookup(full).short: each for full, each in self.plane.fixed_values().items()}
        words.append(self.view.show_quasi_static("quasi" in layers, self.source.attrs, fixed))
        if "threshold" in layers and self.source.is_list:
            words.append("the threshold is that of the columns of a grid; these are points")
        wanted = "threshold" in layers and values is not None and not self.source.is_list
        if wanted and self.changed:
            words.append("the threshold is that of the map, which is of the system before")
        kinds = self.plane.values("response_class") if wanted and not self.changed else None
        self.view.show_threshold(kinds)
        self._draw_dots("dots" in layers, words)
        self._draw_marks()
        self.scatter_box.visible = "scatter" in layers
        self.holder.css_classes = ["two"] if "scatter" in layers else []  # both are seen at a time
        self.view.plot.height = _LOW if "scatter" in layers else _HEIGHT
        if "scatter" in layers:
            self.scatter = self.scatter or ScatterView(self)
            self.scatter.fill()
            self.scatter_box.objects = [self.scatter.layout]
        if any(words):
            self._words = [each for each in words if each]
        self.tell()
        self.moved()

    def show_windows(self) -> None:
        """Draw the windows over the map."""
        layers, held = set(self.layers.value), bool(self.source.skeleton.data_vars)
        shown = self.windows() if layers & {"windows", "difference"} or not held else []
        if shown and self.show.value != "response_class" and not self.source.skeleton.data_vars:
            known = [w.values[self.show.value][w.stride > 0] for w in shown if self.show.value in w.values]
            self.view.limits = _span(np.concatenate(known)) if known else (0.0, 1.0)
            low, high = self.view.limits
            self.view.mapper.update(low=low, high=max(high, low + 1e-300))
        self._drawn = self.view.show_windows(shown, self.show.value, self.shown_plane)
        self._apart, words = self._difference() if "difference" in layers else (None, "")
        if self._apart is not None:
            most = float(np.nanmax(np.abs(self._apart), initial=0.0)) or 1.0
            self.view.show(style.DIFFERENCE, self._apart, (-most, most), words)
            self.view.fade(False)
            self.view.show_windows([], "", None)
        self._said = words if self._apart is None else self._said
        self._legend()

    def _difference(self) -> tuple[NDArray[np.float64] | None, str]:
        """The difference from the other map, or of what was computed from the map, and its title; None and a reason."""
        other, name = None if self.changed else self.shared.other, self.show.value
        if self.source.is_list or not self.source.skeleton.data_vars or (other is None and not self.changed):
            return None, "a difference needs two maps: start with --against, or change the system of a map"
        try:
            found, self._said = maps.apart(self.plane, name, other, self._drawn)
        except InputError as error:
            return None, str(error)
        names = ("computed", self.source.name) if other is None else (self.source.name, other.name)
        return found, f"{self.source.title(name)}: {names[0]} minus {names[1]}"

    @property
    def shown_plane(self) -> maps.Plane | None:
        """The cut through the map; None if it has no numbers, or those of another system."""
        held = bool(self.source.skeleton.data_vars) and not self.changed and not self.source.is_list
        return self.plane if held else None

    def _draw_dots(self, wanted: bool, words: list[str]) -> None:
        dots = self.dots
        empty = np.zeros(0)
        if not wanted or dots is None:
            self.view.show_dots(empty, empty, empty)
            if wanted:
                words.append("no measured points yet: give a table of them under Export")
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

    def _legend(self) -> None:
        """Name the classes, with the share of the area in view that each has as it is drawn."""
        if self._said or self.show.value != "response_class":
            self.key.object = Markup('<div class="key">{}</div>').format(self._said) if self._said else ""
            return
        shares = self._shares()
        items = []
        for kind in (*(k for k in ResponseClass if k >= 0), ResponseClass.UNKNOWN):
            if kind is ResponseClass.UNKNOWN and int(kind) not in shares:
                continue
            share = f" {100.0 * shares.get(int(kind), 0.0):.1f} %" if shares else ""
            swatch = Markup('<span class="item"><span class="swatch" style="background:{}"></span>{}{}</span>')
            items.append(swatch.format(CLASS_COLORS[kind], kind.label, share))
        if shares:
            part = "the map" if self.view.is_whole else "the view"
            items.append(Markup('<span class="faint">shares of {}</span>').format(part))
        self.key.object = Markup('<div class="key">{}</div>').format(Markup(" &nbsp; ").join(items))

    def _shares(self) -> dict[int, float]:
        """Shares of the classes that are drawn in view: of the area, or of the points of a list; empty if there are none."""
        try:
            kinds = None if self.changed else self.plane.values("response_class")
        except InputError:
            kinds = None
        left, right, low, high = self.view.view
        if self.source.is_list:
            x, y = self.plane.x.at, self.plane.y.at
            inside = (x >= left) & (x <= right) & (y >= low) & (y <= high)
            found, counts = np.unique(np.zeros(0) if kinds is None else kinds[inside], return_counts=True)
            return dict(zip(found.tolist(), (counts / max(counts.sum(), 1)).tolist(), strict=True))
        return maps.drawn_shares(self.plane, kinds, self._drawn, (left, right, low, high), self.view.pixels)

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
        self.state.object = Markup("<br>").join(lines)

    # ------------------------------------------------------------------ points

    def point(self, x: float, y: float) -> maps.Point:
        """The point that is shown at a place: that of the finest window drawn over it, or the map's."""
        for window, stride in reversed(self._drawn):
            at = window.computed_at(x, y, stride) if window.covers(x, y) else None
            if at is not None:
                values = dict(zip(window.names, (window.x[at[1]].item(), window.y[at[0]].item()), strict=True))
                held = {name: found[at].item() for name, found in window.values.items()}
                return maps.Point(values | self.plane.fixed_values(), held)
        return self.plane.at(*self.plane.index(x, y))

    def start(self) -> maps.Point:
        """The point that is shown first: of a system its own, of a map one whose beam moves most, in the middle."""
        names = self.plane.parameters
        if self.system is not None and not self.source.skeleton.data_vars:
            own = maps.values_of(names, self.system, self.integration)
            if len(own) == len(names):
                return maps.Point(own)
        left, right, low, high = self.view.view
        middle = self.plane.index(0.5 * (left + right), 0.5 * (low + high))
        kinds = None
        if "response_class" in self.source.layers and not self.changed:
            with suppress(InputError):  # the file is gone; a run can be computed
                kinds = self.plane.values("response_class")
        if kinds is None:
            return self.plane.at(*middle)
        places = np.argwhere(kinds == kinds.max())
        away = (places - np.array(middle)) / np.array(kinds.shape)
        return self.plane.at(*places[np.argmin((away**2).sum(axis=1))].tolist())

    def expected(self, point: maps.Point) -> dict[str, Any]:
        """Results of the map at a point; empty if the point is not on the map, or the system has changed."""
        if point.expected or self.changed or not self.source.skeleton.data_vars:
            return point.expected
        place = self.plane.find(point.values)
        return {} if place is None else self.source.point(self.plane.indexers(*place))

    def step(self, values: dict[str, Any], across: int, upward: int) -> maps.Point | None:
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

    def select(self, point: maps.Point | None, words: str) -> None:
        """Let the readout show a point, in *words*, whenever the pointer is not over the map."""
        self._selected = Markup("&nbsp;")
        if point is not None:
            place = self.plane.place(point.values)
            held = {} if place is None else self._held(point, *place)
            self._selected = Markup("Selected: {}").format(self._readout(words, held))
        self.hover.object = self._selected

    def _hovered(self, x: float | None, y: float | None) -> None:
        if x is None or y is None:
            self.hover.object = self._selected
            return
        point = self.point(x, y)
        held = self._held(point, x, y)
        if self._apart is not None:
            held = held | {style.DIFFERENCE: float(self._apart[self.plane.index(x, y)])}
        self.hover.object = self._readout(point.words(), held)

    def _held(self, point: maps.Point, x: float, y: float) -> dict[str, Any]:
        """The class, the shown variable and two more of the cell at a location."""
        held = point.expected
        if held or self.changed:
            return held
        place, found = self.plane.index(x, y), {}
        if not self.plane.at(*place).values == point.values:
            return {}
        known = {"response_class", "status", "zero_crossings", "peak_force", self.show.value} & set(self.source.layers)
        for each in known:
            try:
                values = self.plane.values(each)
            except InputError:
                values = None
            if values is not None:
                found[each] = values[place].item()
        return found

    def _readout(self, words: str, held: dict[str, Any]) -> Markup:
        parts: list[str] = [words]
        if held.get("status") == RunStatus.NOT_RUN:
            parts.append(maps.NOT_COMPUTED)
            held = {}
        if "response_class" in held:
            parts.append(Markup("<b>{}</b>").format(ResponseClass(int(held["response_class"])).label))
        for each in dict.fromkeys((style.DIFFERENCE, self.show.value, "zero_crossings", "peak_force")):
            if each in held and each != "response_class":
                unit = self.source.label(each)[1]
                parts.append(f"{each.replace('_', ' ')} {held[each]:.5g}{'' if unit == '1' else f' {unit}'}")
        return Markup(" &nbsp;·&nbsp; ").join(parts)

    def use(self, system: System, integration: Integration, changed: bool) -> None:
        """Compute points and windows of another system from now on."""
        self.control.cancel("")
        self.system, self.integration, self.changed = system, integration, changed
        self.redraw()


def _span(values: NDArray[Any]) -> tuple[float, float]:
    good = values[np.isfinite(values)] if values.dtype.kind == "f" else values
    return (float(good.min()), float(good.max())) if good.size else (0.0, 1.0)


# ----------------------------------------------------------------------------------------------------
# The card of the system: every parameter with its unit and its limits, what follows from them, files in and out.


_SECTIONS = {
    "beam": "Beam", "model": "Reduced model", "contact": "Contact", "striker": "Striker", "drive": "Drive",
    "base_excitation": "Base excitation", "axial_load": "Axial load", "force": "External force",
    "local_force": "Local force", "harvester": "Harvester", "boundary": "Supports", "imperfection": "Imperfection",
    "integration": "Integration",
}  # fmt: skip
_ALWAYS = ("beam", "model", "integration")
"""Sections of which all parameters have a field; of contact and drive if there is a striker, else those that are set."""
_INTEGRATION = tuple(f"integration.{name}" for name in ("cycles", "accuracy", "step", "early_termination"))
_PRESETS: dict[str, dict[str, dict[str, Any]]] = {
    "the paper's beam": {},
    "the paper's, one mode": {"model": {"modes": 1}},
    "the paper's, 8 modes": {"model": {"modes": 8}},
    "the paper's, 1000 cycles": {"integration": {"cycles": 1000}},
    "Newton's impact, one mode": {"model": {"modes": 1}, "contact": {"coefficient": 0.6}},
    "twice the buckling level": {"beam": {"buckling_level": 0.67e-3}},
    "struck a quarter along": {"contact": {"location": 0.25}},
}


class SystemCard:
    """Fields of the system of a page at the point that is shown."""

    def __init__(self, page: Page) -> None:
        self.page = page
        self.system: System
        self.fields: dict[str, Any] = {}
        self._varied = 0.0
        self._filled: dict[str, Any] = {}
        self.words = style.Html("", sizing_mode="stretch_width", css_classes=["system-words"])
        self.facts = style.Html("", sizing_mode="stretch_width", css_classes=["system-facts"])
        self.box = pn.Column(sizing_mode="stretch_width", margin=0)
        apply = style.button("Use this system", page.post, self.apply, button_type="primary", width=130)
        back = style.button("Back to the map's", page.post, self._back, width=130)
        save = style.button("Save as TOML", page.post, self.save, width=110)
        self.preset = pn.widgets.Select(name="Preset", options=["", *_PRESETS], width=210)
        self.preset.param.watch(lambda event: page.post(lambda: self._chosen(event.new)), "value")
        self.vary = pn.widgets.Select(name="Vary by a slider", width=210)
        self.vary.param.watch(lambda _: page.post(self._vary), "value")
        digits = PrintfTickFormatter(format="%.6g")
        self.slider = pn.widgets.FloatSlider(visible=False, width=330, format=digits)
        self.slider.param.watch(lambda _: page.post(lambda: self._dragged(self.slider.value)), "value")  # the latest
        self.slider.param.watch(lambda event: page.post(lambda: self._released(event.new)), "value_throttled")
        laws = {LAWS.get(kind, kind.replace("_", " ")): kind for kind in _kinds("contact")}
        self.law = pn.widgets.Select(name="Contact law", options=laws, width=160)
        self.law.param.watch(lambda _: page.post(self._law_changed), "value")
        self.file = pn.widgets.FileInput(accept=".toml", multiple=False, width=220)
        self.file.param.watch(lambda event: page.post(lambda: self._given(event.new)), "value")
        self._buttons = pn.FlexBox(apply, back, save, margin=0)
        self.fill()

    @property
    def layout(self) -> Any:
        """The card."""
        return pn.Column(
            pn.FlexBox(self.vary, self.slider, margin=0, align_items="center"),
            pn.FlexBox(self.preset, pn.Column("Open a TOML file", self.file, margin=0), margin=0),
            self._buttons, self.words, self.facts, self.box,
            sizing_mode="stretch_width", css_classes=["card", "system"],
        )  # fmt: skip

    # ------------------------------------------------------------------ fields

    def _rows(self) -> list[Parameter]:
        held = self.system.parameters
        kinds = {"contact": self.law.value, "drive": str(held.get("drive.type", "sine"))}
        whole = (*_ALWAYS, *(kinds if self.system.contacts else ()))

        def shown(row: Parameter) -> bool:
            if row.section in whole:
                return not row.kinds or kinds.get(row.section) in row.kinds
            return row.name in held

        rows = [row for row in maps.rows_of(self.system) if _group(row) in _SECTIONS and shown(row)]
        return [
            row for row in rows
            if row.quantity.kind in (float, int, str, bool) and (row.section != "integration" or row.name in _INTEGRATION)
        ]  # fmt: skip

    def fill(self, keep: bool = False) -> None:
        """Let the fields show the system at the point that is shown; *keep* what was typed and is not used yet."""
        typed = self._edited() if keep else {}
        self.system, self.integration = self.page.shown_system()
        self._law = str(self.system.parameters.get("contact.type", self.law.value))
        if not keep:
            self.words.object = ""
            if self._law in self.law.options.values():
                self.law.value = self._law
        self._make_fields(typed)
        self._vary()
        self._show_facts()

    def _vary(self) -> None:
        """Let the slider hold the chosen parameter, from half of its value to one and a half."""
        held = maps.held_values(self.system, self.integration)
        rows = {row.name: row for row in maps.rows_of(self.system)}
        numbers = [name for name in self.fields if isinstance(held.get(name), (int, float)) and held[name]]
        self.vary.options = {"": ""} | {
            name.replace("_", " "): name for name in numbers if rows[name].quantity.kind is not bool
        }
        name = str(self.vary.value or "")
        self.slider.visible = bool(name)
        if name:
            item, value = rows[name].quantity, held[name]
            ends = sorted((0.5 * value, 1.5 * value))
            low, high = max(ends[0], item.low), min(ends[1], item.high)
            step = 1 if item.kind is int else (high - low) / 500
            self._varied = value
            self.slider.param.update(
                name=self.fields[name].name, start=low, end=max(high, low + step), step=step, value=value
            )

    def _dragged(self, value: float) -> None:
        if value != self._varied:
            self.page.drag({str(self.vary.value): lookup(self.vary.value).quantity.kind(value)})

    def _released(self, value: float) -> None:
        self.page.drag({})
        name = str(self.vary.value)  # back at its place, the run that was shown before is computed again
        self._use({name: lookup(name).quantity.kind(value)} if value != self._varied else {})

    def _edited(self) -> dict[str, Any]:
        return {name: each.value for name, each in self.fields.items() if each.value != self._filled[name]}

    def _make_fields(self, typed: Mapping[str, Any]) -> None:
        held = maps.held_values(self.system, self.integration)
        rows = self._rows()
        if [row.name for row in rows] != list(self.fields):
            self.fields = {row.name: self._field(row) for row in rows}
            parts: list[Any] = []
            for section, title in _SECTIONS.items():
                fields = [self.fields[row.name] for row in rows if _group(row) == section]
                if section == "contact" and self.system.contacts:
                    fields = [self.law, *fields]
                if fields:
                    parts += [style.Html(style.HEADING.format(title), margin=0), pn.FlexBox(*fields, margin=0)]
            for part in parts:
                style.styled(part, self.page.look)
            self.box.objects = parts
        for row in rows:
            value = held.get(row.name)
            is_choice = row.quantity.choices or row.quantity.kind is bool
            self._filled[row.name] = value if is_choice else _text(value)
            self.fields[row.name].value = typed.get(row.name, self._filled[row.name])

    def _field(self, row: Parameter) -> Any:
        unit = "" if row.quantity.unit == "1" else f" ({row.quantity.unit})"
        name = f"{row.name.partition('.')[2].replace('_', ' ')}{unit}"
        words = f"{row.quantity.long_name}; allowed: {row.limits or 'any'}"
        common: dict[str, Any] = {"name": name, "width": 160 if len(name) < 20 else 230, "description": words}
        if row.quantity.choices:
            return pn.widgets.Select(options=list(row.quantity.choices), **common)
        if row.quantity.kind is bool:
            return pn.widgets.Select(options={"no": False, "yes": True}, **common)
        field = pn.widgets.TextInput(placeholder=row.limits, **common)
        field.param.watch(lambda _: self.page.post(self.apply), "enter_pressed")
        return field

    def _typed(self, name: str) -> Any:
        """The value in a field; None if it is empty.  Refused (InputError) if it is no number, or out of range."""
        value = str(self.fields[name].value)
        return typed(name, value) if value.strip() else None

    def changed_fields(self) -> dict[str, Any]:
        """Parameters of changed fields, by dotted name; of another contact law all, None for those of the old one."""
        found = {name: self._typed(name) for name in self._edited()}
        if self.law.value != self._law:
            law = [row.name for row in parameters().values() if _group(row) == "contact"]
            found |= {name: None for name in law if name in self.system.parameters}
            found |= {name: self._typed(name) for name in law if name in self.fields}
            found["contact.type"] = self.law.value
        return found

    # ------------------------------------------------------------------ doing

    def apply(self) -> None:
        """Apply the values of the fields; invalid ones give a message and change nothing."""
        try:
            self._use(self.changed_fields())
        except InputError as error:
            self.refuse(str(error))

    def _use(self, changed: Mapping[str, Any]) -> None:
        """Compute with some parameters changed."""
        try:
            card = self.page.card
            assert card.system is not None
            held = maps.sections_of(card.system, card.integration)
            self.page.use(*maps.system_from(maps.patched(held, changed)), changed)
        except InputError as error:
            self.refuse(str(error))

    def _back(self) -> None:
        shared = self.page.shared
        assert shared.system is not None
        self.page.use(shared.system, shared.integration, ())

    def _law_changed(self) -> None:
        if self._law != self.law.value:
            self._make_fields(self._edited())

    def _chosen(self, name: str) -> None:
        if name:
            self._open(config_from_mapping(_PRESETS[name] | {"extends": "paper"}))

    def _open(self, config: Config) -> None:
        given = {f"{section}.{name}" for section, values in config.given.items() for name in values}
        given |= {PHYSICAL[name].parameter for name in given & PHYSICAL.keys()}
        own, named = config.integration, config.given.get("integration", {})
        how = self.page.shared.integration.replace(**{name: getattr(own, name) for name in named if hasattr(own, name)})
        try:
            self.page.use(config.system, how, given)
        except InputError as error:
            self.refuse(str(error))

    def _given(self, content: bytes | None) -> None:
        _read_upload(self, "the file", content, _uploaded_config, self._open)

    def refuse(self, words: str) -> None:
        """Say what cannot be done."""
        self.words.object = style.REFUSED.format(words)

    def save(self) -> None:
        """Give the parameter file of the system."""
        try:
            text = maps.system_toml(self.system, self.integration)
        except InputError as error:
            self.refuse(str(error))
            return
        self.page.downloads.give("system.toml", text.encode())

    def _show_facts(self) -> None:
        model = self.system.model
        frequencies = ", ".join(f"{value:.4g}" for value in model.natural_frequencies[:4])
        facts = [
            ("f₁", f"{model.reference_frequency:.6g} Hz"),
            ("natural frequencies", f"{frequencies} Hz"),
            ("barrier", f"{1e6 * (model.saddle_energy - model.well_energy):.4g} µJ"),
        ]
        beam = model.beam
        if beam is not None:
            facts.append(("b/r", f"{beam.buckling_level / beam.radius_of_gyration:.4g}"))
            facts.append(("P/P_cr", f"{beam.axial_load / beam.critical_load:.5g}"))
        cell = Markup('<td><span class="faint">{}</span> <b>{}</b></td>')
        cells = Markup("").join(cell.format(name, value) for name, value in facts)
        found = [each.message for each in self.system.diagnostics()]
        doubts = Markup("").join(style.REFUSED.format(each) for each in found)
        self.facts.object = Markup('<table class="facts"><tr>{}</tr></table>{}').format(cells, doubts)


def changed_words(before: Mapping[str, Any], after: Mapping[str, Any]) -> str:
    """Parameters that differ, in the words of their fields and with their values.

    Lists, and sections that are gone, are told by their titles; defaults of a new section are not told.
    """
    found: dict[str, None] = {}
    sections = [{split_name(name)[0] for name in each} for each in (before, after)]
    for name in dict.fromkeys([*before, *after]):
        value, (section, key), row = after.get(name), split_name(name), row_of(name)
        root = section.partition(".")[0]
        title = _SECTIONS.get(_group(row) if row else root, root.replace("_", " "))
        if maps.plain(before.get(name)) == maps.plain(value):
            continue
        if section not in sections[1]:
            found[f"no {_SECTIONS.get(root, root).lower()}"] = None
        elif isinstance(value, (list, tuple, dict, np.ndarray)):
            found[title] = None
        elif name == "contact.type":
            found[f"Contact law: {LAWS.get(str(value), str(value).replace('_', ' '))}"] = None
        elif value is not None and (section in sections[0] or row is None or value != row.default):
            unit = "" if row is None or row.quantity.unit == "1" else f" {row.quantity.unit}"
            found[f"{title}: {key.replace('_', ' ')} {maps.brief(value)}{unit}"] = None
    more = f" and {len(found) - 6} more" if len(found) > 6 else ""
    return ", ".join(list(found)[:6]) + more


def _group(row: Parameter) -> str:
    """The heading that the field of a parameter stands under: of a contact, that of its law or that of its striker."""
    return "striker" if row.section == "contact" and not row.kinds else row.section


def _kinds(section: str) -> list[str]:
    return sorted({kind for row in parameters().values() if row.section == section for kind in row.kinds})


def _text(value: Any) -> str:
    """A value as a field holds it: a number as short as it can be and be the same when it is read."""
    if isinstance(value, float):
        short = f"{value:.6g}"
        return short if float(short) == value else repr(value)
    return "" if value is None else str(value)


# ----------------------------------------------------------------------------------------------------
# The card of what can be taken away: pictures, data, the command, the lines of Python, a link.


_EXPORT_SECONDS = 300.0
_LONGEST = 20.0
"""Cycles of an animation, if more are seen."""
_PROGRESS = 0.3
"""Seconds between two reports of the progress of an animation."""
_COPY = """
const say = (words) => { button.label = words; setTimeout(() => { button.label = 'Copy the link'; }, 3000); };
const failed = () => say('Not copied');
if (!navigator.clipboard) { failed(); }
else { navigator.clipboard.writeText(window.location.href).then(() => say('Copied'), failed); }
"""


class TakeCard:
    """Buttons by which views of a page are taken away, and text to copy."""

    def __init__(self, page: Page) -> None:
        self.page = page
        self.words = style.Html("", sizing_mode="stretch_width", css_classes=["take-words"])
        self.text = style.Html("", sizing_mode="stretch_width", css_classes=["take-text"])
        self.kind = pn.widgets.RadioButtonGroup(options=["png", "pdf", "svg"], value="png")
        slow, length = "slow motion at the hardest impact (s)", "length of the animation (s)"
        self.slow = pn.widgets.FloatInput(name=slow, value=2.0, start=0.0, end=30.0, width=260)
        self.length = pn.widgets.FloatInput(name=length, value=4.0, start=1.0, end=60.0, width=210)
        self.dots = pn.widgets.FileInput(accept=".csv", multiple=False, width=220)
        self.dots.param.watch(lambda event: page.post(lambda: self._dots(event.new)), "value")
        buttons = {
            "Map": self._map_picture, "Run": self._run_picture,
            "MP4": lambda: self._animation(".mp4"), "GIF": lambda: self._animation(".gif"), "WAV": self._sound,
            "Parameter file": lambda: page.system_card().save(),
            "Run as NetCDF": lambda: self._make("run", ".nc", self._run().save),
            "Map as NetCDF": self._map_data, "Window as NetCDF": self._window_data,
        }  # fmt: skip
        self.buttons = {
            name: style.button(name, page.post, partial(self._tried, work), width=145) for name, work in buttons.items()
        }
        self.link = pn.widgets.Button(name="Copy the link", width=145)
        self.link.js_on_click(args={"button": self.link}, code=_COPY)
        stop: dict[str, Any] = {"button_type": "warning", "width": 180, "visible": False}
        self.cancel = style.button("Cancel the animation", page.post, self._cancelled, **stop)
        self._animating: jobs.Token | None = None

    @property
    def layout(self) -> Any:
        """The card."""
        make = self.buttons
        return pn.Column(
            style.Html(style.HEADING.format("Figures in the style of the journal, of what is in view"), margin=0),
            pn.FlexBox(make["Map"], make["Run"], self.kind, margin=0, align_items="center"),
            style.Html(style.HEADING.format(f"Animation of at most {_LONGEST:g} of the visible cycles, and their sound"), margin=0),
            pn.FlexBox(make["MP4"], make["GIF"], self.length, self.slow, make["WAV"], margin=0, align_items="center"),
            style.Html(style.HEADING.format("Data"), margin=0),
            pn.FlexBox(make["Parameter file"], make["Run as NetCDF"], make["Map as NetCDF"], make["Window as NetCDF"], self.link, margin=0),
            style.Html(style.HEADING.format("Measured points to lay over the map (CSV)"), margin=0), self.dots,
            pn.FlexBox(self.words, self.cancel, margin=0), self.text, sizing_mode="stretch_width", css_classes=["card", "take"],
        )  # fmt: skip

    # ------------------------------------------------------------------ text

    def refresh(self) -> None:
        """Write the command and the lines of what is shown."""
        page = self.page
        run, point, card = page.runs[page.which].current, page.points[page.which], page.card
        part, texts = Markup('<h2>{}</h2><pre class="{}">{}</pre>'), []
        beside = " (with the system saved as system.toml beside it)"
        if run is not None and point is not None:
            file = page.shared.file.name if page.shared.file is not None else ""
            on_map = bool(file) and not card.changed and card.plane.find(point.values) is not None
            values, dims = dict(point.values), page.shared.source.skeleton.dims
            if on_map and not card.source.is_list:
                values = {name: value for name, value in values.items() if lookup(name).short in dims}
            command, title = maps.run_command(values, file, on_map), "The command that makes this run"
            texts.append(part.format(title + ("" if on_map else beside), "command", command))
            lines = maps.python_lines(run.system, run.integration, page.runs[page.which].picture)
            texts.append(part.format("The same in Python", "python", lines))
        if card.windows():
            command = maps.map_command(card.windows()[-1], card.plane.fixed_values())
            texts.append(part.format(f"The command that makes the finest window{beside}", "map-command", command))
        old = page.runs[page.which].old
        why = "The run is old: that of the present system is not computed."
        none = why if old else "Click on a point of the map first."
        self.text.object = Markup("").join(
            ([] if run or not old else [style.REFUSED.format(none)]) + texts
        ) or style.NOTE.format(none)

    def refuse(self, words: str) -> None:
        """Say what cannot be done."""
        self.words.object = style.REFUSED.format(words)

    # ------------------------------------------------------------------ files

    def _tried(self, work: Callable[[], None]) -> None:
        try:
            work()
        except InputError as error:
            self.refuse(str(error))

    def _make(self, name: str, suffix: str, write: Callable[[Any], object], token: jobs.Token | None = None) -> None:
        """Make a file in the background and send it to the browser."""
        page, token = self.page, token or jobs.Token(_EXPORT_SECONDS)
        self.words.object = style.BUSY.format(f"making {name}{suffix}")

        def done(content: bytes | None, error: str) -> None:
            def tell() -> None:
                if token is self._animating:
                    self._animating, self.cancel.visible = None, False
                if content is None:
                    self.refuse(error)
                else:
                    self.words.object = style.NOTE.format(f"{name}{suffix}, {len(content) / 1e3:.0f} kB")
                    page.downloads.give(f"{name}{suffix}", content)

            page.post(tell)

        page.shared.jobs.export(lambda _: jobs.file_bytes(suffix, write), done, token)

    def _cancelled(self) -> None:
        if self._animating is not None:
            self._animating.cancel()
        self._animating, self.cancel.visible = None, False
        self.words.object = style.NOTE.format("the animation was cancelled")

    def _run(self) -> Run:
        """The run that is shown; refused (InputError) if there is none."""
        view = self.page.runs[self.page.which]
        if view.old:
            raise InputError("the run is old: that of the present system is not computed")
        if view.run is None:
            raise InputError("there is no run: click on a point of the map first")
        return view.run

    def _run_picture(self) -> None:
        """Give the figure of the view that is seen, of the part of the run that is seen."""
        run, view = self._run(), self.page.runs[self.page.which]
        name, data = view.picture, run.dataset
        options: dict[str, Any] = {"window": view.window} if name == "run" else {}
        if name != "run":
            data = data.isel(time=within(across(run)[0], *view.window))
        self._make(name, f".{self.kind.value}", partial(draw, partial(plot_dataset, data, name, **options)))

    def _map_picture(self) -> None:
        """Give the figure of the part of the map that is seen, or of the finest window that holds all of it."""
        card = self.page.card
        left, right, low, high = view = card.view.view
        cut, name, plane = self._cut(view), card.show.value, card.plane
        overlay: dict[str, Any] = {
            "quasi_static_line": "quasi" in card.layers.value, "measurements": card.dots if "dots" in card.layers.value else None
        }  # fmt: skip
        painter: Callable[..., Any] = partial(plot_statistic, cut, name=name)
        if card.source.is_list:
            painter = partial(
                plot_points, cut, name=name, across=str(plane.x.name), upward=str(plane.y.name), **overlay
            )
        elif name == "response_class":
            painter = partial(plot_response_map, cut, **overlay)

        def zoomed() -> Any:
            axes = painter()
            if not card.view.is_whole:
                axes.set(xlim=(left, right), ylim=(low, high))
            return axes

        label = name if name != "response_class" else "map"
        self._make(label, f".{self.kind.value}", partial(draw, zoomed))

    def _cut(self, view: tuple[float, float, float, float]) -> xr.Dataset:
        """The map over the two axes that are shown, or the finest window drawn over all of a *view*."""
        card, source = self.page.card, self.page.card.source
        held = card.shown_plane is not None or source.is_list
        for window, stride in reversed(card._drawn):
            left, right, low, high = window.bounds
            covers = left <= view[0] and view[1] <= right and low <= view[2] and view[3] <= high
            if not held or (covers and (stride > 0).all()):
                return window_dataset(window, blocks=True)
        if not held:
            raise InputError("there is no map yet")
        cut = source.skeleton.drop_vars(list(source.skeleton.data_vars)).isel(card.plane.fixed)
        for name in dict.fromkeys(("response_class", card.show.value)):
            values = source.values(name)
            if values is not None:
                cut[name] = values.isel(card.plane.fixed)
        return cut

    def _seen(self) -> tuple[float, float]:
        """The visible cycles, at most so many as an animation may have."""
        first, last = self.page.runs[self.page.which].window
        return first, min(last, first + _LONGEST)

    def _animation(self, suffix: str) -> None:
        run, window = self._run(), self._seen()
        length, slow = float(self.length.value), float(self.slow.value)
        if self._animating is not None:
            self._animating.cancel()
        self._animating = token = jobs.Token(_EXPORT_SECONDS)
        self.cancel.visible = True
        told = 0.0

        def progress(done: int, total: int) -> None:
            nonlocal told
            token.check(done)
            jobs.drawing.release()  # between two frames another picture may be drawn
            try:
                time.sleep(0.002)
                if time.monotonic() - told > _PROGRESS:
                    told = time.monotonic()
                    words = f"making run{suffix}: {100 * done / total:.0f} %"
                    self.page.post(lambda: self._report(words, token))
            finally:
                jobs.drawing.acquire()

        def write(path: Any) -> None:
            from snapbeam.plot.animation import animate_run

            with jobs.drawing:
                animate_run(run.dataset, path, window, duration=length, slow_motion=slow, progress=progress)

        self._make("run", suffix, write, token)

    def _report(self, words: str, token: jobs.Token) -> None:
        if token is self._animating:
            self.words.object = style.BUSY.format(words)

    def _sound(self) -> None:
        """Give the velocity of mid-span, as long as it lasts, as sound."""
        data, (low, high) = self._run().dataset, self.page.runs[self.page.which].window
        part = data.isel(time=within(across(self._run())[0], low, high))
        self._make(
            "velocity", ".wav", lambda path: write_sound(part["time"].values, part["midspan_velocity"].values, path)
        )

    def _map_data(self) -> None:
        source = self.page.card.source
        if not source.skeleton.data_vars:
            raise InputError("there is no map: take the window")
        self._make("map", ".nc", lambda path: write_netcdf(source.whole(), path))

    def _window_data(self) -> None:
        windows = self.page.card.windows()
        if not windows or not windows[-1].values:
            raise InputError("no window was computed")
        self._make("window", ".nc", partial(write_netcdf, window_dataset(windows[-1])))

    def _dots(self, content: bytes | None) -> None:
        page, attrs = self.page, self.page.card.source.attrs

        def tell(dots: Any) -> None:
            page.card.dots = dots
            self.words.object = style.NOTE.format(f"{len(dots)} measured points")
            page.card.layers.value = list(dict.fromkeys([*page.card.layers.value, "dots"]))
            page.card.redraw()

        _read_upload(self, "the table", content, partial(_uploaded_points, attrs=attrs), tell)


_RATE = 44_100


def write_sound(time: NDArray[np.float64], velocity: NDArray[np.float64], path: Path) -> None:
    """Write a velocity as sound of 44.1 kHz and 16 bits, its maximum the loudest."""
    even = np.arange(time[0], time[-1], 1.0 / _RATE)
    series = np.interp(even, time, velocity)
    loudest = float(np.abs(series).max(initial=0.0)) or 1.0
    wavfile.write(path, _RATE, np.round(32767.0 / loudest * series).astype(np.int16))


def _read_upload(
    card: SystemCard | TakeCard,
    what: str,
    content: bytes | None,
    read: Callable[[bytes], Any],
    use: Callable[[Any], None],
) -> None:
    """Read a file that was given to a card, beside the page, and use what it holds; say why if it cannot be read."""
    if content and len(content) > jobs.UPLOAD:
        card.refuse(jobs.too_large(what, len(content)))
    elif content:

        def done(found: Any, error: str) -> None:
            card.page.post(lambda: card.refuse(error) if found is None else use(found))

        card.page.shared.jobs.run(lambda _: read(content), done, jobs.Token())


def _uploaded_config(content: bytes) -> Config:
    try:
        text = content.decode("utf-8")
    except UnicodeDecodeError as error:
        raise InputError(f"the file: is no TOML, {error}") from None
    return config_from_mapping(parsed_toml(text, "the file"), "the file")


def _uploaded_points(content: bytes, attrs: dict[str, Any]) -> Any:
    from snapbeam.sweeps.measured_points import read_measured_points

    with tempfile.TemporaryDirectory(prefix="snapbeam-") as folder:
        path = Path(folder) / "points.csv"
        path.write_bytes(content)
        level = attrs.get("beam_buckling_level")
        return read_measured_points(path, reference_frequency=attrs.get("reference_frequency"), buckling_level=level)


def draw(painter: Callable[[], Any], path: Any) -> None:
    """Write the figure of the axes that a function draws; one thread at a time may draw."""
    with jobs.drawing:
        figure = painter().get_figure(root=True)
        try:
            save_figure(figure, path)
        finally:
            plt.close(figure)


def window_dataset(window: maps.Window, *, blocks: bool = False) -> xr.Dataset:
    """A window as a labelled map, with ``computed`` = 0 where no run was made.

    Such cells are unknown or, with *blocks*, hold what the run of their block gave.
    """
    axes = dict(zip(window.names[::-1], (window.y, window.x), strict=True))
    dataset = maps.axes_dataset(window.system, axes, window.integration)
    dims = tuple(lookup(name).short for name in axes)
    own = window.own()
    for name, values in window.values.items():
        row = STATISTICS[name]
        held = values.astype(np.float64) if values.dtype.kind == "f" else values.copy()
        unknown = np.nan if held.dtype.kind == "f" else {"response_class": -1, "status": RunStatus.NOT_RUN}.get(name, 0)
        held[window.stride == 0 if blocks else ~own] = unknown
        dataset[name] = (dims, held, {"units": row.unit, "long_name": row.long_name})
    labels = {"units": "1", "long_name": "whether the point was run"}
    dataset["computed"] = (dims, own.astype(np.int8), labels)
    dataset.attrs["title"] = "window of a map of the response of a struck bistable beam"
    return dataset
