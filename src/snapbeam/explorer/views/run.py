"""One run: what it is in a line, and its views."""

from __future__ import annotations

import html
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import panel as pn

from snapbeam import ResponseClass, RunStatus
from snapbeam.explorer.look import Look, class_chip
from snapbeam.explorer.views.beam import BeamView
from snapbeam.explorer.views.cursor import Cursor
from snapbeam.explorer.views.energy import Energy
from snapbeam.explorer.views.impacts import Impacts, Numbers
from snapbeam.explorer.views.modal import Modal
from snapbeam.explorer.views.part import across
from snapbeam.explorer.views.phase import Phase
from snapbeam.explorer.views.spectrum import Spectrum
from snapbeam.explorer.views.waveform import Waveform

if TYPE_CHECKING:
    from snapbeam import Run

__all__ = ["RunView"]

_PAUSE = 60
"""Milliseconds between two views that are built while nobody looks at them."""
_SETTLE = 60
"""Milliseconds that a range must rest before the samples in it are sent."""


class RunView:
    """The card of one run.

    Parameters
    ----------
    look : Look
    name : str
        ``"A"`` or ``"B"``.
    post, later : callable
        ``post(work)``: do something on the page's own thread; ``later(work, milliseconds)``: a little later.
    """

    def __init__(
        self,
        look: Look,
        name: str,
        post: Callable[[Callable[[], None]], None],
        later: Callable[[Callable[[], None], int], Any],
    ) -> None:
        self.look, self.name, self.later = look, name, later
        self.run: Run | None = None
        self.cursor = Cursor(look, "" if name == "A" else f"-{name}", later)
        self.parts = [
            Waveform(look, self.cursor), Phase(look, self.cursor), Spectrum(look, self.cursor),
            Modal(look, self.cursor), Energy(look, self.cursor), Impacts(look, self.cursor, self._closer),
            BeamView(look, self.cursor), Numbers(look, self.cursor),
        ]  # fmt: skip
        self.head = pn.pane.HTML(
            "", sizing_mode="stretch_width", margin=(0, 0, 2, 0), css_classes=["run-head"]
        )
        self.note = pn.pane.HTML(
            "", sizing_mode="stretch_width", margin=(0, 0, 2, 0), css_classes=["run-note"]
        )
        self.tabs = pn.Tabs(
            *((part.title, part.place) for part in self.parts), dynamic=True, sizing_mode="stretch_width", margin=0
        )  # fmt: skip
        self.tabs.param.watch(lambda _: post(self._activated), "active")
        self._moved = 0
        self._quiet = False
        for edge in ("start", "end"):
            self.cursor.range.on_change(edge, lambda attr, old, new: self._range_moved())
        self.layout = pn.Column(
            self.head, self.note, self.tabs, sizing_mode="stretch_width", css_classes=["card", "run"]
        )
        self.notes: dict[str, str] = {}

    @property
    def active(self) -> Any:
        """The view that is seen."""
        return self.parts[self.tabs.active]

    # ------------------------------------------------------------------ what is shown

    def begin(self, words: str) -> None:
        """Say what is computed, over the run before."""
        self._write_notes()
        self._head('<span class="busy">computing</span>', words)

    def wait(self, words: str, seconds: float, why: str) -> None:
        """Say for how long it has been computed, and what takes the time if that is known."""
        below = f'<span class="faint">{html.escape(why)}</span>' if why else ""
        self._head(f'<span class="busy">computing, {seconds:.0f} s</span>', words, below)

    def fail(self, words: str) -> None:
        """Say why there is no run."""
        self.notes = {}
        self._write_notes()
        self._head('<span class="bad">no run</span>', words)

    def _head(self, kind: str, words: str, below: str = "") -> None:
        line = f"<br>{below}" if below else ""
        self.head.object = (
            f'<span class="point">{html.escape(self.name)}</span> {kind} {html.escape(words)}{line}'
        )

    def show(self, run: Run, words: str, fresh: bool) -> None:
        """Show a run; *fresh* if it is not the one before with more samples."""
        self.run = run
        self._write_notes()
        answer = run.summary
        if answer.status in (RunStatus.OK, RunStatus.EARLY_STOP):
            well = "upper" if answer.final_well > 0 else "lower"
            final = ", for good" if answer.final_well_proven else ""
            counts = (
                f"{answer.zero_crossings} crossings, {answer.impacts} impacts, ends in the {well} well{final}"
            )
            self._head(class_chip(answer.response_class), words, f'<span class="faint">{counts}</span>')
        else:
            why = f'<span class="bad">{answer.status.name}: {html.escape(answer.status.advice)}</span>'
            self._head(class_chip(ResponseClass.UNKNOWN), words, why)
        if fresh:
            x, _ = across(run)
            self._quiet = True
            self.cursor.range.update(
                start=float(x[0]), end=float(x[-1]), reset_start=float(x[0]), reset_end=float(x[-1])
            )
            self._quiet = False
        self._draw()

    def say(self, about: str, words: str, bad: bool = False) -> None:
        """Put a line under the class, one for each thing that it is about."""
        kind = "bad" if bad else "faint"
        self.notes[about] = f'<span class="{kind}">{html.escape(words)}</span>' if words else ""
        self._write_notes()

    def _write_notes(self) -> None:
        self.note.object = "<br>".join(text for text in self.notes.values() if text)

    def _draw(self) -> None:
        self.active.activate()
        if self.run is not None:
            start, end = float(self.cursor.range.start), float(self.cursor.range.end)
            self.active.show(self.run, min(start, end), max(start, end))

    def stand(self) -> None:
        """Build the view that is seen."""
        self.active.activate()

    def complete(self) -> None:
        """Build the views that are not seen, one after the other, so that what is asked for meanwhile need not wait."""
        waiting = [part for part in self.parts if not part.built]
        if waiting:
            waiting[0].activate()
            self.later(self.complete, _PAUSE)

    def _activated(self) -> None:
        self.active.activate()
        self.later(self._draw, _SETTLE)  # once the browser has what it is to be drawn in

    def _range_moved(self) -> None:
        if self._quiet:
            return
        self._moved += 1
        now = self._moved
        self.later(lambda: self._draw() if now == self._moved else None, _SETTLE)

    def _closer(self, place: float, seconds: float) -> None:
        """Show the waveform about one impact."""
        if self.run is None:
            return
        x, time = across(self.run)[0], self.run.dataset["time"].values
        cycles = seconds * (x[-1] - x[0]) / (time[-1] - time[0])
        self.cursor.range.update(start=place - 1.0 * cycles, end=place + 2.0 * cycles)
        self.tabs.active = 0

    @property
    def window(self) -> tuple[float, float]:
        """The part that is seen, in cycles."""
        return float(np.min([self.cursor.range.start, self.cursor.range.end])), float(
            np.max([self.cursor.range.start, self.cursor.range.end])
        )
