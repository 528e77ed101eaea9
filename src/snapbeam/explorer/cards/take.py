"""The card of what can be taken away: pictures, data, the command, the lines of Python, a link."""

from __future__ import annotations

import html
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import panel as pn

from snapbeam import InputError, write_netcdf
from snapbeam.config import lookup
from snapbeam.explorer.downloads import drawing, file_bytes
from snapbeam.explorer.jobs import Token
from snapbeam.explorer.limits import UPLOAD, too_large
from snapbeam.explorer.lines import map_command, python_lines, run_command

if TYPE_CHECKING:
    import xarray as xr

    from snapbeam import Run
    from snapbeam.explorer.page import Page

__all__ = ["TakeCard", "window_dataset"]

_EXPORT_SECONDS = 300.0
_LONGEST = 20.0
"""Cycles of an animation, if more are seen."""


class TakeCard:
    """Buttons, and text to copy.

    Parameters
    ----------
    page : Page
        Whose views are taken away.
    """

    def __init__(self, page: Page) -> None:
        self.page = page
        self.words = pn.pane.HTML("", sizing_mode="stretch_width", css_classes=["take-words"])
        self.text = pn.pane.HTML("", sizing_mode="stretch_width", css_classes=["take-text"])
        self.kind = pn.widgets.RadioButtonGroup(options=["png", "pdf", "svg"], value="png")
        self.slow = pn.widgets.FloatInput(
            name="slow motion at the hardest impact (s)", value=4.0, start=0.0, end=30.0, width=260
        )
        self.length = pn.widgets.FloatInput(
            name="length of the animation (s)", value=8.0, start=1.0, end=60.0, width=210
        )
        self.dots = pn.widgets.FileInput(accept=".csv", multiple=False, width=220)
        self.dots.param.watch(lambda event: page.post(lambda: self._dots(event.new)), "value")
        buttons = {
            "Map": lambda: self._picture("map"), "Run": lambda: self._picture("run"),
            "MP4": lambda: self._animation(".mp4"), "GIF": lambda: self._animation(".gif"),
            "Run as NetCDF": self._run_data, "Map as NetCDF": self._map_data, "Window as NetCDF": self._window_data,
        }  # fmt: skip
        self.buttons = {name: pn.widgets.Button(name=name, width=145) for name in buttons}
        for name, work in buttons.items():
            self.buttons[name].on_click(_posted(page, work))
        self.link = pn.widgets.Button(name="Copy the link", width=145)
        self.link.js_on_click(
            args={"holder": self.page.bar}, code="navigator.clipboard.writeText(window.location.href);"
        )

    @property
    def layout(self) -> Any:
        """The card."""
        make = self.buttons
        return pn.Column(
            pn.pane.HTML("<h2>Pictures in the style of the journal</h2>", margin=0),
            pn.FlexBox(make["Map"], make["Run"], self.kind, margin=0, align_items="center"),
            pn.pane.HTML("<h2>The beam moving, of the cycles that are seen</h2>", margin=0),
            pn.FlexBox(make["MP4"], make["GIF"], self.length, self.slow, margin=0, align_items="center"),
            pn.pane.HTML("<h2>Data</h2>", margin=0),
            pn.FlexBox(make["Run as NetCDF"], make["Map as NetCDF"], make["Window as NetCDF"], self.link, margin=0),
            pn.pane.HTML("<h2>Measured points to lay over the map (CSV)</h2>", margin=0), self.dots,
            self.words, self.text, sizing_mode="stretch_width", css_classes=["card", "take"],
        )  # fmt: skip

    # ------------------------------------------------------------------ text

    def refresh(self) -> None:
        """Write the command and the lines of what is shown."""
        page = self.page
        run, point = page.runs[page.which].run, page.points[page.which]
        parts = []
        if run is not None and point is not None:
            file = page.shared.file.name if page.shared.file is not None else ""
            on_map = bool(file) and not page.card.changed and page.card.plane.find(point.values) is not None
            skeleton = page.shared.source.skeleton
            over = {
                name: value
                for name, value in point.values.items()
                if page.card.source.is_list or lookup(name).short in skeleton.dims
            }
            command = run_command(over if on_map else point.values, file, on_map)
            beside = "" if on_map else " (with the system saved as system.toml beside it)"
            parts.append(
                f'<h2>The command that makes this run{beside}</h2><pre class="command">{html.escape(command)}</pre>'
            )
            text = python_lines(run.system, run.integration)
            parts.append(f'<h2>The same in Python</h2><pre class="python">{html.escape(text)}</pre>')
        window = self._window()
        if window is not None:
            axes = {
                name: (float(values[0]), float(values[-1]), int(values.size))
                for name, values in zip(window.names, (window.x, window.y), strict=True)
            }
            if not any(window.log):
                parts.append(
                    "<h2>The command that makes the finest window</h2>"
                    f'<pre class="map-command">{html.escape(map_command(axes, {}))}</pre>'
                )
        self.text.object = "".join(parts) or '<p class="note">Click on a point of the map first.</p>'

    def _window(self) -> Any:
        windows = self.page.card.windows()
        return windows[-1] if windows else None

    def refuse(self, words: str) -> None:
        """Say what cannot be done."""
        self.words.object = f'<p class="bad" role="alert">{html.escape(words)}</p>'

    # ------------------------------------------------------------------ files

    def _make(self, name: str, suffix: str, write: Callable[[Any, Token], object]) -> None:
        """Make a file beside the page and hand it to the browser."""
        page = self.page
        self.words.object = f'<p class="busy">making {html.escape(name)}{suffix}</p>'
        token = Token(_EXPORT_SECONDS)

        def done(content: bytes | None, error: str) -> None:
            def tell() -> None:
                if content is None:
                    self.words.object = f'<p class="bad">{html.escape(error)}</p>'
                else:
                    self.words.object = (
                        f'<p class="note">{html.escape(name)}{suffix}, {len(content) / 1e3:.0f} kB</p>'
                    )
                    page.downloads.give(f"{name}{suffix}", content)

            page.post(tell)

        page.shared.jobs.export(lambda t: file_bytes(suffix, lambda path: write(path, t)), done, token)

    def _run(self) -> Run | None:
        run = self.page.runs[self.page.which].run
        if run is None:
            self.words.object = '<p class="bad">there is no run: click on a point of the map first</p>'
        return run

    def _picture(self, of: str) -> None:
        suffix = f".{self.kind.value}"
        if of == "run":
            run = self._run()
            if run is not None:
                window = self.page.runs[self.page.which].window
                self._make("run", suffix, lambda path, _: _draw_run(run, window, path))
            return
        try:
            cut = self._cut()
        except InputError as error:
            self.refuse(str(error))
            return
        quasi = "quasi" in self.page.card.layers.value
        dots = self.page.card.dots if "dots" in self.page.card.layers.value else None
        name = self.page.card.show.value
        label = name if name != "response_class" else "map"
        if self.page.card.source.is_list:
            plane = self.page.card.plane
            along = str(plane.x.name), str(plane.y.name)
            self._make(label, suffix, lambda path, _: _draw_points(cut, name, along, quasi, dots, path))
            return
        self._make(label, suffix, lambda path, _: _draw_map(cut, name, quasi, dots, path))

    def _cut(self) -> xr.Dataset:
        """The map over the two axes that are shown; of a system without a map, its finest window."""
        card = self.page.card
        source = card.source
        if not source.skeleton.data_vars or card.changed:
            window = self._window()
            if window is None or not window.values:
                raise InputError("there is no map yet")
            return window_dataset(window)
        cut = source.skeleton.drop_vars(list(source.skeleton.data_vars)).isel(card.plane.fixed)
        for name in dict.fromkeys(("response_class", card.show.value)):
            values = source.values(name)
            if values is not None:
                cut[name] = values.isel(card.plane.fixed)
        return cut

    def _animation(self, suffix: str) -> None:
        run = self._run()
        if run is None:
            return
        first, last = self.page.runs[self.page.which].window
        window = (first, min(last, first + _LONGEST))
        length, slow = float(self.length.value), float(self.slow.value)

        def write(path: Any, token: Token) -> None:
            from snapbeam.figures.animation import animate_run

            with drawing:
                animate_run(
                    run.dataset,
                    path,
                    window,
                    duration=length,
                    slow_motion=slow,
                    progress=lambda done, total: token.check(),
                )

        self._make("run", suffix, write)

    def _run_data(self) -> None:
        run = self._run()
        if run is not None:
            self._make("run", ".nc", lambda path, _: run.save(path))

    def _map_data(self) -> None:
        source = self.page.card.source
        if not source.skeleton.data_vars:
            self.words.object = '<p class="bad">there is no map: take the window</p>'
            return

        def write(path: Any, _: Token) -> None:
            write_netcdf(source.whole(), path)

        self._make("map", ".nc", write)

    def _window_data(self) -> None:
        window = self._window()
        if window is None or not window.values:
            self.words.object = '<p class="bad">no window was computed</p>'
            return
        dataset = window_dataset(window)
        self._make("window", ".nc", lambda path, _: write_netcdf(dataset, path))

    def _dots(self, content: bytes | None) -> None:
        from snapbeam.figures import read_measured_points

        if not content:
            return
        attrs = self.page.card.source.attrs
        try:
            if len(content) > UPLOAD:
                raise InputError(too_large("the table", len(content)))
            with tempfile.TemporaryDirectory(prefix="snapbeam-") as folder:
                path = Path(folder) / "dots.csv"
                path.write_bytes(content)
                level = attrs.get("beam_buckling_level")
                dots = read_measured_points(
                    path, reference_frequency=attrs.get("reference_frequency"), buckling_level=level
                )
        except (InputError, UnicodeDecodeError) as error:
            self.refuse(str(error))
            return
        self.page.card.dots = dots
        self.words.object = f'<p class="note">{len(dots)} measured points</p>'
        self.page.card.layers.value = [*{*self.page.card.layers.value, "dots"}]
        self.page.card.redraw()


def _posted(page: Page, work: Callable[[], None]) -> Callable[[Any], None]:
    return lambda _: page.post(work)


def _draw_run(run: Run, window: tuple[float, float], path: Any) -> None:
    from snapbeam.figures import plot_run, save_figure

    with drawing:
        _save(save_figure, plot_run(run.dataset, window), path)


def _draw_map(cut: xr.Dataset, name: str, quasi: bool, dots: Any, path: Any) -> None:
    from snapbeam.figures import plot_response_map, plot_statistic, save_figure

    with drawing:
        if name == "response_class":
            ax = plot_response_map(cut, threshold_line=quasi, dots=dots)
        else:
            ax = plot_statistic(cut, name)
        _save(save_figure, ax, path)


def _draw_points(
    cut: xr.Dataset, name: str, along: tuple[str, str], quasi: bool, dots: Any, path: Any
) -> None:
    from snapbeam.figures import plot_points, save_figure

    with drawing:
        ax = plot_points(cut, name, across=along[0], upward=along[1], dots=dots, threshold_line=quasi)
        _save(save_figure, ax, path)


def _save(save_figure: Any, drawn: Any, path: Any) -> None:
    import matplotlib.pyplot as plt

    figure = drawn.get_figure(root=True) if hasattr(drawn, "get_figure") else drawn
    try:
        save_figure(figure, path)
    finally:
        plt.close(figure)


def window_dataset(window: Any) -> xr.Dataset:
    """A window as a labelled map; cells that no run was made of are unknown, with ``computed`` = 0."""
    import numpy as np

    from snapbeam import STATISTICS
    from snapbeam.explorer.maps.source import axes_dataset

    dataset = axes_dataset(
        window.system, {window.names[1]: window.y, window.names[0]: window.x}, window.integration
    )
    dims = tuple(lookup(name).short for name in (window.names[1], window.names[0]))
    own = window.own()
    for name, values in window.values.items():
        row = STATISTICS[name]
        held = values.astype(np.float64) if values.dtype.kind == "f" else values.copy()
        held[~own] = np.nan if held.dtype.kind == "f" else -1 if name == "response_class" else 0
        if name == "status":
            held[~own] = 5
        dataset[name] = (dims, held, {"units": row.unit, "long_name": row.long_name})
    dataset["computed"] = (
        dims,
        own.astype(np.int8),
        {"units": "1", "long_name": "whether the point was run"},
    )
    dataset.attrs["title"] = "window of a map of the response of a struck bistable beam"
    return dataset
