"""The page of a result that is no map: its figures, a run of what is clicked on, and files of the figures."""

from __future__ import annotations

import base64
import io
from typing import Any

import matplotlib.pyplot as plt
import panel as pn
from bokeh.events import Tap
from bokeh.models import ColumnDataSource
from bokeh.plotting import figure
from markupsafe import Markup
from matplotlib.backends.backend_agg import FigureCanvasAgg

import snapbeam as sb
from snapbeam import Run
from snapbeam.explorer.address import Address
from snapbeam.explorer.cards import draw
from snapbeam.explorer.jobs import RUN_SECONDS, Downloads, Tab, Token, check_run, drawing, file_bytes
from snapbeam.explorer.maps import ResultSource, sections_of, started
from snapbeam.explorer.run_view import RunView
from snapbeam.explorer.shared import Shared
from snapbeam.explorer.style import NOTE, REFUSED, Html, button, look_of, sheet, styled
from snapbeam.model.parameters import parameters
from snapbeam.plot.dataset import start_of

_DOTS = 150
"""Dots per inch of a figure on the page."""
_CLICK = "Click on the figure to compute the run that starts there."


class ResultPage(Tab):
    """Figures of a result on the left, and a run of the stored or the clicked state on the right."""

    def __init__(self, shared: Shared, arguments: dict[str, list[bytes]]) -> None:
        super().__init__()
        assert isinstance(shared.source, ResultSource)
        self.shared, self.source = shared, shared.source
        address = Address.read(arguments)
        self.look = look_of(address.theme, lecture=address.type == "large", physical=address.units == "physical")
        names = list(self.source.figures)
        self.shown = pn.widgets.Select(
            options={name.replace("_", " "): name for name in names}, width=240,
            value=address.show if address.show in names else names[0],
        )  # fmt: skip
        self.shown.param.watch(lambda _: self.post(self.draw), "value")
        self.kind = pn.widgets.RadioButtonGroup(options=["png", "pdf", "svg"], value="png")
        save = button("Save figure", self.post, self.save, width=100)
        self.downloads = Downloads()
        self.words = Html("", sizing_mode="stretch_width", css_classes=["take-words"])
        self.image = ColumnDataSource({"url": [], "w": [], "h": []}, name="result")
        self.plot = figure(
            toolbar_location=None, sizing_mode="scale_width", aspect_ratio=1.4, tools="", name="result-plot"
        )
        self.plot.axis.visible = self.plot.grid.visible = False
        self.plot.min_border = 0
        self.plot.image_url("url", 0, 0, "w", "h", anchor="bottom_left", source=self.image)
        self.plot.on_event(Tap, lambda event: self.tapped(event.x, event.y))
        self.axes: Any = None
        self.view = RunView(self.look, "A", self.post, self.later)
        self.view.tabs.active = int("multiplier_real" in self.source.skeleton)  # an orbit in its phase portrait
        self._token: Token | None = None
        pn.config.raw_css = [sheet(self.look)]
        title = Markup('<h1>snapbeam <span class="faint">{}: {}</span></h1>').format(self.source.name, self.source.kind)
        left = pn.Column(
            pn.FlexBox(self.shown, save, self.kind, margin=0, align_items="center"), pn.pane.Bokeh(self.plot, sizing_mode="stretch_width"),
            self.words, Html(self._facts(), sizing_mode="stretch_width"),
            sizing_mode="stretch_width", css_classes=["card", "left"],
        )  # fmt: skip
        parts = [left]
        if self.source.run is not None or start_of(self.source.skeleton) is not None:
            parts.append(pn.FlexBox(self.view.layout, margin=0, css_classes=["right"]))
        body = pn.FlexBox(*parts, margin=0, sizing_mode="stretch_width", flex_wrap="wrap", css_classes=["body"])
        self.layout = pn.Column(
            Html(title, margin=0), body, sizing_mode="stretch_width", margin=0, css_classes=["whole"]
        )
        styled(self.layout, self.look)
        if self.doc is not None:
            self.doc.add_root(self.downloads.source)
        pn.state.onload(self.stand)

    def stand(self) -> None:
        """Draw the figure, and show the run of the file or of the stored state."""
        self.view.active.activate()
        self.draw()
        if self.source.run is not None:
            self.view.show(self.source.run, "the run of the file")
        elif start_of(self.source.skeleton) is not None:
            self.ask(None)
        self.later(self.view.complete, 700)

    def _facts(self) -> Markup:
        """The title and the parameters among the attributes, with their units."""
        row = Markup('<tr><td class="faint">{}</td><td>{} {}</td></tr>')
        known = {each.short: each.quantity.unit for each in parameters().values()}
        known |= {each.name.replace(".", "_"): each.quantity.unit for each in parameters().values()}
        held = {name: value for name, value in self.source.attrs.items() if name in known or name == "title"}
        rows = [
            row.format(
                name.replace("_", " "), f"{value:.6g}" if isinstance(value, float) else value,
                known.get(name, "").removesuffix("1"),
            )
            for name, value in held.items() if len(str(value)) < 60
        ]  # fmt: skip
        return Markup('<table class="facts">{}</table>').format(Markup("").join(rows))

    # ------------------------------------------------------------------ figures

    def _paint(self) -> Any:
        return self.source.figures[self.shown.value](self.source.skeleton, ax=None)

    def draw(self) -> None:
        """Draw the chosen figure."""

        def work(_: Token) -> tuple[bytes, tuple[int, int], Any]:
            with drawing:
                axes = self._paint()
                canvas = FigureCanvasAgg(axes.get_figure(root=True))
                canvas.figure.set_dpi(_DOTS)
                stream = io.BytesIO()
                canvas.print_png(stream)
                plt.close(canvas.figure)
                return stream.getvalue(), canvas.get_width_height(), axes

        self.shared.jobs.export(work, lambda *found: self.post(lambda: self._drawn(*found)), Token())

    def _drawn(self, found: Any, error: str) -> None:
        if found is None:
            self.words.object = REFUSED.format(error)
            return
        picture, (width, height), self.axes = found
        self.plot.x_range.update(start=0, end=width)
        self.plot.y_range.update(start=0, end=height)
        self.plot.update(aspect_ratio=width / height, max_width=round(1.2 * width))
        url = "data:image/png;base64," + base64.b64encode(picture).decode()
        self.image.data = {"url": [url], "w": [width], "h": [height]}

    def save(self) -> None:
        """Give the figure as a file."""
        suffix, name = f".{self.kind.value}", str(self.shown.value)

        def saved(content: bytes | None, error: str) -> None:
            if content is not None:
                self.downloads.give(f"{name}{suffix}", content)
            self.words.object = NOTE.format(error or f"{name}{suffix}")

        def work(_: Token) -> bytes:
            return file_bytes(suffix, lambda path: draw(self._paint, path))

        self.shared.jobs.export(work, lambda *found: self.post(lambda: saved(*found)), Token())

    # ------------------------------------------------------------------ runs

    def tapped(self, x: float, y: float) -> None:
        """Compute the run of a place in the figure."""
        if self.axes is None or start_of(self.source.skeleton) is None:
            return
        if self.axes.bbox.contains(x, y):
            self.ask(tuple(self.axes.transData.inverted().transform((x, y))))

    def ask(self, place: tuple[float, float] | None) -> None:
        """Compute the run that starts at a place of the first figure, or at the stored state."""
        start, base, how = start_of(self.source.skeleton), self.shared.system, self.shared.integration
        if base is None or start is None:
            self.view.fail(self.shared.why_not)
            return
        if self._token is not None:
            self._token.cancel()
        self._token = token = Token(RUN_SECONDS)
        self.view.wait("")

        def work(token: Token) -> tuple[Run, str] | None:
            found = start(self.source.skeleton, place)
            if found is None:
                return None
            given = {**found.parameters, **found.state}
            words = ", ".join(f"{name} {value:.5g}" for name, value in given.items())
            system = started(sections_of(base.replace(**found.parameters), how), found.state)
            integration = how.replace(cycles=found.cycles, engine="auto", threads=None)
            check_run(system, integration)
            return sb.simulate(system, integration, progress=token.check), words

        def done(found: tuple[Run, str] | None, error: str) -> None:
            self.post(lambda: tell(found, error))

        def tell(found: tuple[Run, str] | None, error: str) -> None:
            if error:
                self.view.fail(error)
            elif found is None:
                self.view.forget(_CLICK)
            else:
                self.view.show(*found)

        self.shared.jobs.run(work, done, token)

    def close(self) -> None:
        """The tab is closed: compute nothing for it any more."""
        super().close()
        if self._token is not None:
            self._token.cancel()
