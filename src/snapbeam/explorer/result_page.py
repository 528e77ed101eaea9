"""The page of a result that is no map: its figures, a run of what is clicked on, and files of the figures."""

from __future__ import annotations

from typing import Any

import matplotlib.pyplot as plt
import panel as pn
from bokeh.document import Document
from bokeh.models import ColumnDataSource
from markupsafe import Markup

import snapbeam as sb
from snapbeam import Run
from snapbeam.explorer.address import Address
from snapbeam.explorer.cards import draw
from snapbeam.explorer.drawn import Drawn
from snapbeam.explorer.jobs import Downloads, Tab, Token, check_run, drawing, file_bytes
from snapbeam.explorer.maps import Point, ResultSource, brief, sections_of, started
from snapbeam.explorer.run_view import RunView
from snapbeam.explorer.shared import Shared
from snapbeam.explorer.style import NOTE, REFUSED, Html, button, framed_plot, look_of, on_tap, sheet, styled
from snapbeam.model.parameters import parameters
from snapbeam.plot.dataset import start_of

_WIDTH = 560
"""Pixels of the page for the width of a figure; its height follows from its shape."""
_CLICK = "Click on the figure to compute the run that starts there."


class ResultPage(Tab):
    """Figures of a result on the left, and a run of the stored or the clicked state on the right."""

    def __init__(self, shared: Shared, arguments: dict[str, list[bytes]], doc: Document | None = None) -> None:
        super().__init__(doc)
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
        self.mark = ColumnDataSource({"x": [], "y": []}, name="mark")
        self.drawn: Drawn | None = None
        self.place = pn.FlexBox(margin=0, sizing_mode="stretch_width")
        self.view = RunView(self.look, "A", self.post, self.later)
        self.view.tabs.active = int("multiplier_real" in self.source.skeleton)  # an orbit in its phase portrait
        pn.config.raw_css = [sheet(self.look)]
        title = Markup('<h1>snapbeam <span class="faint">{}: {}</span></h1>').format(self.source.name, self.source.kind)
        left = pn.Column(
            pn.FlexBox(self.shown, save, self.kind, margin=0, align_items="center"), self.place,
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

    def _paint(self, ax: Any = None) -> Any:
        return self.source.figures[self.shown.value](self.source.skeleton, ax=ax)

    def draw(self) -> None:
        """Draw the chosen figure."""
        first = self.shown.value == next(iter(self.source.figures))

        def work(_: Token) -> Drawn:
            with drawing:
                try:
                    axes = self._paint()
                    if "function" in (axes.get_xscale(), axes.get_yscale()):  # the page has no such scale
                        axes = self._paint(plt.subplots()[1])
                    return Drawn(axes, self.look)
                finally:
                    plt.close("all")

        self.shared.jobs.export(work, lambda *found: self.post(lambda: self._drawn(first, *found)), Token())

    def _drawn(self, first: bool, found: Drawn | None, error: str) -> None:
        if found is None:
            self.words.object = REFUSED.format(error)
            return
        self.drawn, parts = found, []
        for plot, box in found.plots:
            plot.height = max(round(_WIDTH * found.size[1] / found.size[0] * box.height / 0.8), 150)
            if first and start_of(self.source.skeleton) is not None:
                plot.scatter(
                    "x", "y", source=self.mark, size=15, fill_color=None, line_color=self.look.accent, line_width=3
                )
                on_tap(plot, lambda x, y: self.ask((x, y)))
            part = framed_plot(plot, margin=0)
            row = sum(other.width for _, other in found.plots if abs(other.y1 - box.y1) < 0.01)
            part.styles = {"flex": f"1 1 calc({100 * box.width / row:.0f}% - 2px)", "min-width": "min(230px, 100%)"}
            parts.append(part)
        self.place.objects = parts

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

    def ask(self, place: tuple[float, float] | None) -> None:
        """Compute the run that starts at a place of the first figure, or at the stored state."""
        start, base, how = start_of(self.source.skeleton), self.shared.system, self.shared.integration
        if base is None or start is None:
            self.view.fail(self.shared.why_not)
            return
        token = self.begin_run()
        self.view.wait("")

        def work(token: Token) -> tuple[Run, str, Any] | None:
            found = start(self.source.skeleton, place)
            if found is None:
                return None
            state = [f"{name} {brief(value)}" for name, value in found.state.items()]
            words = ", ".join(filter(None, [Point(found.parameters).words(), *state]))
            system = started(sections_of(base.replace(**found.parameters), how), found.state)
            integration = how.replace(cycles=found.cycles or how.cycles, engine="auto", threads=None)
            check_run(system, integration)
            return sb.simulate(system, integration, progress=token.check), words, found.place

        def done(found: tuple[Run, str, Any] | None, error: str) -> None:
            self.post(lambda: tell(found, error))

        def tell(found: tuple[Run, str, Any] | None, error: str) -> None:
            if error:
                self.view.fail(error)
            elif found is None:
                self.view.forget(_CLICK)
            else:
                run, words, at = found
                self.mark.data = {"x": [at[0]], "y": [at[1]]} if at is not None else {"x": [], "y": []}
                self.view.show(run, words)

        self.shared.jobs.run(work, done, token)
