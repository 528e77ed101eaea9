"""One page: the map, the runs, the system, and what can be taken away; each page has its own."""

from __future__ import annotations

import threading
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from typing import Any
from urllib.parse import parse_qs

import panel as pn
from bokeh.document import Document
from bokeh.models import ColumnDataSource
from markupsafe import Markup

import snapbeam as sb
from snapbeam import InputError, Integration, Run, System
from snapbeam.explorer import jobs, maps
from snapbeam.explorer.address import Address, typed
from snapbeam.explorer.cards import MapCard, SystemCard, TakeCard, changed_words
from snapbeam.explorer.maps import chances as chances_of
from snapbeam.explorer.run_view import RunView
from snapbeam.explorer.shared import Shared
from snapbeam.explorer.style import WRONG, Html, Look, framed, look_of, styled
from snapbeam.model.parameters import PHYSICAL, lookup

# ----------------------------------------------------------------------------------------------------
# What a page computes of a point, beside the page: the run, and how it compares.


@dataclass(frozen=True, eq=False)
class Answer:
    """A run of a point, and what is said below it."""

    run: Run
    words: str
    """Result of the comparison with the map, as text."""
    same: bool
    chances: str
    """Probabilities and lifetime of the point, where the map holds them."""


def answer(card: MapCard, point: maps.Point, base: Any, how: Any, token: jobs.Token) -> Answer:
    """Compute a point of a card's map."""
    system, integration = point.system(base, how.replace(engine="auto", threads=None))
    jobs.check_run(system, integration)
    run = recorded(system, integration, token)
    chances, source = "", card.shared.source
    try:
        held = card.expected(point)
        chances = chances_of(source.layers, held)
        same, words = maps.compared(held, run.summary, str(source.attrs.get("engine", "native")))
    except InputError as error:  # the run stands, although its map cannot be read any more
        same, words = False, str(error)
    if jobs.sample_times(system, integration) is not None:
        words += f"; recorded at {run.dataset.sizes['time']} instants, the most that a page may ask for"
    return Answer(run, words, same, chances)


def recorded(system: System, integration: Integration, token: jobs.Token) -> Run:
    """A run with no more samples than a page may have."""
    times = jobs.sample_times(system, integration)
    run = sb.simulate(system, integration, sample_times=times, progress=token.check)
    _ = run.dataset  # made here and not on the page's thread, which others wait for
    return run


# ----------------------------------------------------------------------------------------------------


_GROWTH = 1500
"""Milliseconds between two looks at a checkpoint that may grow."""
_EARLY = 0.5
"""Seconds for which a page that is not sent yet waits for its first run."""
_DRAGGED = 30
"""Cycles of the run that is shown while a slider is dragged."""


class Page(jobs.Tab):
    """Content of one tab of a browser; *arguments* is the query string of the address."""

    def __init__(self, shared: Shared, arguments: dict[str, list[bytes]], doc: Document | None = None) -> None:
        super().__init__(doc)
        self.shared = shared
        self.address = Address.read(arguments)
        self.look: Look = look_of(
            self.address.theme, lecture=self.address.type == "large", physical=self.address.units == "physical"
        )
        self.card = MapCard(self.look, shared, self.address, self.post, self.later)
        self.card.asked = self.ask
        self.card.moved = self.write_address
        self.card.cut_moved = self._cut_moved
        self.waiting = jobs.Waiting(self.later)
        self.runs = [RunView(self.look, "A", self.post, self.later)]
        self.runs[0].turned = self._turned
        self.points: list[maps.Point | None] = [None, None]
        self._dragged: Mapping[str, Any] = {}
        self._dragging = False
        self.runs_box: Any = None
        self.compare = pn.widgets.Toggle(name="Two points", width=100, align="center")
        self.target = pn.widgets.RadioButtonGroup(options=["A", "B"], value="A", visible=False, align="center")
        self.compare.param.watch(lambda _: self.post(self._compared), "value")
        self.target.param.watch(lambda _: self.post(self._follow), "value")
        self.downloads = jobs.Downloads()
        self.fields: dict[str, Any] = {}
        self.errors: dict[str, Any] = {}
        self._exact: dict[str, tuple[str, Any]] = {}
        """Text of a field, of at most six digits unless they were typed, and the value that it stands for."""
        self.old = Html("", sizing_mode="stretch_width", margin=0, css_classes=["old-words"])
        self.go = pn.widgets.Button(name="Run", button_type="primary", width=70, align="end")
        self.go.on_click(lambda _: self.post(self._ask_typed))
        self._make_fields()
        self.bar = ColumnDataSource({"search": [""], "step": [0]}, name="address")
        self._written = ""
        self.back = ColumnDataSource({"search": [""], "count": [0]}, name="back")
        self.back.on_change("data", lambda _, __, data: self._went(str(data["search"][0])))
        self._quiet = True
        """True while the address must not change: during construction, and while the page applies an address."""
        self.cards: Any = None
        self.card_names: list[str] = []
        self.keys = ColumnDataSource({"key": [""], "count": [0]}, name="keys")
        self.keys.on_change("data", lambda _, __, data: self._key(str(data["key"][0])))
        self.refused = ColumnDataSource({"name": [""], "bytes": [0], "count": [0]}, name="refused")
        self.refused.on_change("data", lambda _, __, data: self._too_large(data))
        self.changes: dict[str, Any] = {}
        self._take: TakeCard | None = None
        self._system: SystemCard | None = None
        if self.address.changes:
            self._take_changes(self.address.changes)
        early = self._early()
        self.runs[0].active.activate()
        self.layout = framed(self)
        self._version = shared.source.version
        early()
        pn.state.onload(self._stands)

    def _early(self) -> Callable[[], None]:
        """Begin the first run; what is returned shows it, if it is ready, in the page as it is sent."""
        names, at = set(self.card.plane.parameters), self.address.at
        base, how = self.card.system, self.card.integration
        if base is None:
            return lambda: None
        known = names <= at.keys()
        point = maps.Point({name: at[name] for name in at if name in names}) if known else self.card.start()
        self.address, self.points[0] = replace(self.address, at=point.values), point
        self._fill_fields(point)  # before somebody can type
        found: list[Run] = []
        ended, token = threading.Event(), jobs.Token(jobs.RUN_SECONDS)

        def work(token: jobs.Token) -> None:
            try:
                found.append(answer(self.card, point, base, how, token).run)
            finally:
                ended.set()

        def show() -> None:
            ended.wait(_EARLY)
            token.cancel()
            for run in found:
                self.runs[0].show(run, point.words())

        self.shared.jobs.run(work, lambda _, __: None, token)
        return show

    def _stands(self) -> None:
        """The map is on the screen: now for the rest."""
        if self.shared.source.growing and self.doc is not None:
            self._look_for_more()
            self.doc.add_periodic_callback(self._look_for_more, _GROWTH)
        with self._together():
            self._show_runs(self.address, again=True)  # changes made before the browser is connected may be lost
            self._quiet = False
            self.write_address()  # the state to which Back returns
        self.card.control.wake()  # after the run, for which windows wait

    def system_card(self) -> SystemCard:
        """The card of the system, made when it is first needed."""
        self._system = self._system or SystemCard(self)
        return self._system

    def shown_system(self) -> tuple[System, Integration]:
        """The system and the integration at the point that is shown; without a point, on the cut."""
        assert self.card.system is not None
        point = self.points[self.which] or maps.Point(self.card.plane.fixed_values())
        try:
            return point.system(self.card.system, self.card.integration)
        except InputError:  # a point that the system cannot have
            return self.card.system, self.card.integration

    def take_card(self) -> TakeCard:
        """The card of what can be taken away, made when it is first needed."""
        if self._take is None:
            self._take = TakeCard(self)
            self._take.refresh()
        return self._take

    def _refresh_take(self) -> None:
        if self._take is not None:
            self._take.refresh()

    def close(self) -> None:
        """The tab is closed: compute nothing for it any more."""
        super().close()
        self.card.control.cancel("")

    def _make_fields(self) -> None:
        names = self.card.plane.parameters
        self.fields, self.errors, self._exact = {}, {}, {}
        for name, words in maps.short_names(names).items():
            row = lookup(name)
            unit = "" if row.quantity.unit == "1" else f" ({row.quantity.unit})"
            field = pn.widgets.TextInput(name=words + unit, value="", width=170)
            field.param.watch(lambda _: self.post(self._ask_typed), "enter_pressed")
            self.fields[name] = field
            self.errors[name] = Html("", width=180, margin=(0, 0, 0, 10), css_classes=["field-error"])
        parts = [pn.Column(self.fields[name], self.errors[name], margin=0) for name in self.fields]
        for part in parts:
            styled(part, self.look)
        self.card.typed.objects = [*parts, self.go]

    def _take_changes(self, changes: Mapping[str, Any]) -> None:
        """Compute with the map's system with the changes of an address."""
        try:
            self._adopt(changes)
        except InputError as error:
            self.card.say(f"address, set: {error}")

    def _show_runs(self, address: Address, again: bool = False) -> None:
        """Show the points, the view of the run and the card of an address; compute them *again* of another system."""
        names = set(self.card.plane.parameters)
        self.compare.value = bool(address.b)
        self._compared()
        for which, at in ((0, address.at), (1, address.b)):
            values = {name: at[name] for name in at if name in names} if names <= at.keys() else {}
            point = self.points[which]
            if values and (again or point is None or point.values != values):
                self.ask(maps.Point(values), which)
        self.target.value = "B" if address.b else "A"
        titles = [part.title for part in self.runs[0].parts]
        self.runs[0].tabs.active = titles.index(address.tab) if address.tab in titles else 0
        if self.cards is not None:
            known = address.card in self.card_names
            self.cards.active = self.card_names.index(address.card) if known else 0
        self._follow()

    def _went(self, search: str) -> None:
        """Show the state that the browser went back or forward to."""
        address = Address.read({
            name: [value.encode() for value in values]
            for name, values in parse_qs(search.removeprefix("?")).items()
        })  # fmt: skip
        self._quiet = True
        with self._together():
            again = dict(address.changes) != self.changes
            if again:
                self._take_changes(address.changes)
            self.card.restore(address)
            self._show_runs(address, again)
        self._quiet, self._written = False, self._search()

    def _look_for_more(self) -> None:
        """Show what was added to a checkpoint since the last look."""
        source = self.shared.source

        def done(_: Any, error: str) -> None:
            def tell() -> None:
                if error:
                    self.card.tell(error)
                elif source.version != self._version:
                    self._version = source.version
                    self.card.redraw()
                    done, whole = (source.attrs.get(f"points_{name}") for name in ("done", "total"))
                    self.card.tell(f"checkpoint: {done} of {whole} points")

            self.post(tell)

        self.shared.jobs.export(lambda _: source.refresh(), done, jobs.Token())

    # ------------------------------------------------------------------ runs

    @property
    def which(self) -> int:
        """Number of the requested run of the two."""
        return 1 if self.compare.value and self.target.value == "B" else 0

    def ask(self, point: maps.Point, which: int | None = None) -> None:
        """Compute the run of a point; earlier requests are cancelled."""
        which = self.which if which is None else which
        view = self.runs[which]
        if self.card.system is None:
            self._fill_fields(point)
            view.fail(self.shared.why_not)
            return
        token = self.begin_run(which)
        self.points[which] = point
        words = self._words(which)
        base, how = self.card.system, self.card.integration

        def work(token: jobs.Token) -> Answer:
            return answer(self.card, point, base, how, token)

        def done(found: Answer | None, error: str) -> None:
            self.post(lambda: self._done(which, point, token, found, error))

        self.shared.jobs.run(work, done, token)  # what follows is said while it is computed
        view.notes = {}
        self.waiting.begin(which, lambda seconds: view.wait(words, seconds))
        with self._together():
            self._fill_fields(point)
            self.card.select(point, words)
            self._mark()
            self.write_address()

    def _words(self, which: int) -> str:
        """A point in words, with all digits in which it differs from the other one."""
        point, other = self.points[which], self.points[1 - which]
        return "" if point is None else point.words(other if self.compare.value else None)

    def _turned(self) -> None:
        """Another view of A: B shows the same, or is drawn over A's waveform."""
        self._pair()
        self.write_address()

    def _pair(self) -> None:
        """Draw both waveforms in one axis, and the other views of B below those of A."""
        first, second = self.runs[0], self.runs[-1]
        two = self.compare.value and len(self.runs) > 1
        first.waveform.beside(second.current if two else None)
        if two:
            second.tabs.visible = first.tabs.active > 0
            second.tabs.active = first.tabs.active
            for which, view in enumerate(self.runs):
                if self.points[which] is not None:
                    view.rename(self._words(which))
        below = ["two" if first.tabs.active else "over"] if two else []
        self.runs_box.css_classes = ["right", *below]

    def _cut_moved(self, cut: dict[str, Any]) -> None:
        """Let the point that the fields hold follow the sliders."""
        point = self.points[self.which]
        if point is not None and point.values | cut != point.values:
            self.ask(maps.Point(point.values | cut))

    def _done(self, which: int, point: maps.Point, token: jobs.Token, found: Answer | None, error: str) -> None:
        if token.cancelled or self.points[which] is not point:
            return
        self.waiting.end(which)
        view = self.runs[which]
        if found is None:
            view.fail(f"{self._words(which)}: {error}")
            self._pair()
            self._refresh_take()
            return
        view.show(found.run, self._words(which))
        self._pair()
        view.say("map", found.words, bad=not found.same)
        view.say("chances", found.chances)
        view.say("conditioning", "")
        self._refresh_take()
        self._condition(which, point, found.run, token)

    def _condition(self, which: int, point: maps.Point, run: Run, token: jobs.Token) -> None:
        def done(words: str | None, error: str) -> None:
            def tell() -> None:
                if not token.cancelled and self.points[which] is point:
                    self.runs[which].say("conditioning", words or error)

            self.post(tell)

        self.shared.jobs.run(lambda t: jobs.conditioned(run, t), done, token)

    def drag(self, changes: Mapping[str, Any]) -> None:
        """Show the first cycles of the run with some parameters changed; without any, no more of them."""
        self._dragged = changes
        if not changes or self._dragging:  # the latest changes follow when the run before is shown
            return
        self._dragging, which, (base, how) = True, self.which, self.shown_system()
        how = how.replace(cycles=min(how.cycles_or_default, _DRAGGED), engine="auto", threads=None)

        def work(token: jobs.Token) -> Run:
            system, short = maps.system_from(maps.patched(maps.sections_of(base, how), changes))
            return recorded(system, short, token)

        def done(run: Run | None, error: str) -> None:
            self.post(lambda: tell(run, error))

        def tell(run: Run | None, error: str) -> None:
            self._dragging = False
            if self._dragged is not changes:
                self.drag(self._dragged)
            elif run is None:
                self.runs[which].fail(error)
            else:
                values = maps.values_of(self.card.plane.parameters, run.system, run.integration)
                words = ", ".join(f"{name} = {value:.5g}" for name, value in changes.items())
                self.runs[which].notes = {}
                self.runs[which].show(run, f"{words}, the first {run.integration.cycles} cycles")
                self.card.marks = [(values, "")]
                self.card._draw_marks()

        self.shared.jobs.run(work, done, jobs.Token(jobs.RUN_SECONDS))

    def use(self, system: System, integration: Integration, given: Collection[str]) -> None:
        """Compute with another system; the point moves to those of the *given* parameters that the map sweeps."""
        assert self.shared.system is not None
        names = self.card.plane.parameters
        swept = {name: PHYSICAL[name].parameter if name in PHYSICAL else name for name in names}
        before = maps.sections_of(self.shared.system, self.shared.integration)
        found = maps.difference(before, maps.sections_of(system, integration))
        self._adopt({name: value for name, value in found.items() if name not in swept.values()})
        held, own = self.points[self.which], maps.values_of(swept, system, integration)
        moved = {name: value for name, value in own.items() if swept[name] in given}
        if moved:
            self.points[self.which] = maps.Point({**own, **(held.values if held else {}), **moved})
        for which in sorted({0, 1}, key=lambda each: each == self.which):
            point = self.points[which]
            if point is not None:
                self.ask(maps.Point(point.values), which)
        self._refresh_take()
        self.write_address()

    def _adopt(self, changes: Mapping[str, Any]) -> None:
        """Take the map's system with some parameters changed, and mark the map if it is outdated."""
        if self.shared.system is None:
            return
        system, integration = self.shared.system, self.shared.integration
        if changes:
            system, integration = maps.system_from(maps.patched(maps.sections_of(system, integration), changes))
        self.changes = dict(changes)
        self.card.use(system, integration, bool(changes))
        held = [
            maps.held_values(*each) for each in ((self.shared.system, self.shared.integration), (system, integration))
        ]
        old = f"Changed: {changed_words(*held)}" if changes else ""
        for view in self.runs:
            view.outdate()
        self._refresh_take()
        if old and self.shared.source.skeleton.data_vars:
            old = f"The map is old: it is of the system before. {old}"
        self.old.object = Markup('<p class="old" role="status">{}</p>').format(old) if old else ""
        if self._system is not None:
            self._system.fill()

    def _mark(self) -> None:
        names = ("A", "B") if self.compare.value else ("",)
        self.card.marks = [
            (point.values, name) for point, name in zip(self.points, names, strict=False) if point is not None
        ]
        self.card._draw_marks()

    def _compared(self) -> None:
        self.target.visible = self.compare.value
        if self.compare.value and len(self.runs) == 1:
            self.runs.append(RunView(self.look, "B", self.post, self.later))
            self.runs[1].tabs.active = self.runs[0].tabs.active
            styled(self.runs[1].layout, self.look)
            self.runs_box.append(self.runs[1].layout)
        if len(self.runs) > 1:
            self.runs[1].layout.visible = self.compare.value
        self._pair()
        if self.compare.value:
            self.target.value = "B"
        self._mark()
        self._follow()
        self.write_address()

    # ------------------------------------------------------------------ typed and keyed

    def _follow(self) -> None:
        """Let the fields hold the point of the run that the next click replaces."""
        point = self.points[self.which]
        self.card.select(point, self._words(self.which))
        if point is not None:
            self._fill_fields(point)

    def _fill_fields(self, point: maps.Point) -> None:
        if set(point.values) - set(self.fields):
            self._make_fields()
        other = self.points[1 - self.which] if self.compare.value else None
        for name, value in point.values.items():
            if name in self.fields:
                text = maps.brief(value, other and other.values.get(name))
                typed_so = str(self.fields[name].value_input or self.fields[name].value)
                if isinstance(value, float) and typed_so.strip() and _same(typed_so, value):
                    text = typed_so
                self._exact[name] = (text, value)
                self.fields[name].value = text
                self.errors[name].object = ""
        if self._system is not None:
            self._system.fill(keep=True)

    def _ask_typed(self) -> None:
        values: dict[str, Any] = {}
        for name, field in self.fields.items():
            self.errors[name].object = ""
            try:
                text, value = str(field.value_input or field.value), self._exact.get(name)
                values[name] = value[1] if value and value[0] == text else typed(lookup(name).short, text)
            except InputError as error:
                self.errors[name].object = WRONG.format(error)
        if len(values) < len(self.fields):
            self.runs[self.which].fail("correct the marked field")
            return
        self.ask(maps.Point(values))

    def _key(self, key: str) -> None:
        point = self.points[self.which]
        steps = {"ArrowLeft": (-1, 0), "ArrowRight": (1, 0), "ArrowUp": (0, 1), "ArrowDown": (0, -1)}
        if key not in steps:
            return
        if point is None:
            left, right, low, high = self.card.view.view
            self.ask(self.card.point(0.5 * (left + right), 0.5 * (low + high)))
            return
        neighbour = self.card.step(point.values, *steps[key])
        if neighbour is not None and neighbour.values != point.values:
            self.ask(neighbour)

    def _too_large(self, file: Any) -> None:
        """A file that the browser did not send; said wherever one can be given."""
        words = jobs.too_large(str(file["name"][0]), int(file["bytes"][0]))
        for card in (self._take, self._system):
            if card is not None:
                card.refuse(words)

    # ------------------------------------------------------------------ address

    def write_address(self) -> None:
        """Write what is shown into the address: a step in the history of the browser."""
        search = "" if self._quiet else self._search()
        if len(search) > jobs.ADDRESS:
            self.card.tell("the system is too long for an address: save it as TOML to open it again")
        elif search and search != self._written:
            step = self.bar.data["step"][0] + 1 if self._written else 0
            self.bar.data = {"search": [search], "step": [step]}
            self._written = search

    def _search(self) -> str:
        """Query string of the displayed state."""
        card = self.card
        at, b = ({} if point is None else point.values for point in self.points)
        view = None if card.view.is_whole else card.view.view
        tab, shown = self.runs[0].tabs.active, 0 if self.cards is None else self.cards.active
        return Address(
            card.x.value, card.y.value, card.show.value, card.cut(), at, b if self.compare.value else {}, view, self.changes,
            self.address.theme, self.address.type, self.runs[0].parts[tab].title if tab else "", self.card_names[shown] if shown else "",
            self.address.units,
        ).write()  # fmt: skip


def _same(text: str, value: float) -> bool:
    try:
        return float(text) == value
    except ValueError:
        return False
