"""When a part of the map is computed anew, and what is told of it meanwhile."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np

from snapbeam import InputError
from snapbeam.config import lookup
from snapbeam.explorer.jobs import Token
from snapbeam.explorer.limits import WINDOW_SECONDS
from snapbeam.explorer.maps.points import Point
from snapbeam.explorer.maps.windows import Window, compute, planned
from snapbeam.explorer.waiting import Waiting

if TYPE_CHECKING:
    from snapbeam.explorer.cards.map import MapCard

__all__ = ["WindowControl"]

_REST = 350
"""Milliseconds that a view must rest before it is computed."""
_PUSH = 0.2
"""Seconds between two pictures of a window that fills."""
_COARSE = 9.0
"""Pixels of a cell above which a view is worth computing anew."""


class WindowControl:
    """The window that is being computed for a page, if any."""

    def __init__(self, card: MapCard) -> None:
        self.card = card
        self._token: Token | None = None
        self._moved, self._pushed = 0, 0.0
        self._awake = False
        self._waiting = Waiting(card.shared.compiling, card.later)

    def wake(self) -> None:
        """The page stands in a browser: from now on what is seen is worth computing."""
        self._awake = True
        self.view_moved()

    def view_moved(self) -> None:
        """Another part is seen; it is looked at once it rests."""
        if not self._awake:
            return
        self._moved += 1
        now = self._moved
        self.card.later(lambda: self._rested() if now == self._moved else None, _REST)

    def _rested(self) -> None:
        if self.card.source.skeleton.data_vars and not (self.card.plane.x.even and self.card.plane.y.even):
            self.card.redraw()
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
        """Compute what is seen, from coarse to fine, in place of what was being computed."""
        if self.card.system is None or not self.card.plane.can_zoom:
            self.card.tell("a window needs two axes of numbers, and a system" if force else "")
            return
        bounds = self._bounds()
        if bounds is None:
            return
        key = (self.card.plane_key, bounds)
        self.cancel("")
        self.card.own.add(key)
        try:
            system, integration = Point(self.card.plane.fixed_values()).system(
                self.card.system, self.card.integration
            )
        except InputError as error:
            self.card.tell(str(error))
            return
        log = (self.card.plane.x.log, self.card.plane.y.log)
        made = planned(
            system, integration, self.card.plane.names, bounds, log, self.card.view.pixels, key=key
        )
        window = self.card.shared.window(made)
        if window.finished:  # by this page before, or by another
            self.card.show_windows()
            return
        self._token = token = Token(WINDOW_SECONDS)
        self.card.stop.visible = True
        self.card.tell("computing what is seen")
        self._waiting.begin(0, self._still)
        self.card.shared.jobs.window(
            lambda _: compute(window, self.card.shared.jobs, token, lambda w: self._grew(w, token)),
            lambda _, words: self.card.post(lambda: self._ended(window, token, words)),
            token,
        )

    def _bounds(self) -> tuple[float, float, float, float] | None:
        """What is seen, within what the axes may be."""
        left, right, low, high = self.card.view.view
        found: list[float] = []
        for (a, b), name, axis in (
            ((left, right), self.card.plane.names[0], self.card.plane.x),
            ((low, high), self.card.plane.names[1], self.card.plane.y),
        ):
            item = lookup(name).quantity
            least = max(a, item.low) if np.isfinite(item.low) else a
            most = min(b, item.high) if np.isfinite(item.high) else b
            if axis.log:
                least = max(least, 1e-3 * float(axis.at[0]))
            if not least < most:
                return None
            found += [least, most]
        return found[0], found[1], found[2], found[3]

    def _grew(self, window: Window, token: Token) -> None:
        now = time.monotonic()
        if now - self._pushed > _PUSH and not token.cancelled:
            self._pushed = now
            self.card.post(lambda: self._draw_growing(window, token))

    def _still(self, seconds: float, why: str) -> None:
        if self._token is not None:
            self.card.tell(f"computing what is seen, {seconds:.0f} s" + (f"; {why}" if why else ""))

    def _draw_growing(self, window: Window, token: Token) -> None:
        if token is not self._token:
            return
        self._waiting.end(0)
        self.card.show_windows()
        left = (window.size - window.done) * window.seconds
        finest = int(window.stride[window.stride > 0].min()) if (window.stride > 0).any() else 27
        self.card.tell(
            f"window: {window.done} of {window.size} points, {left:.0f} s to the finest; blocks of {finest} cells now"
        )

    def _ended(self, window: Window, token: Token, words: str) -> None:
        if token is self._token:
            self._waiting.end(0)
            self.card.stop.visible = False
            self._token = None
            self.card.show_windows()
            self.card.tell(words or f"window: all {window.size} points computed")

    def cancel(self, words: str) -> None:
        """Compute no window any more."""
        if self._token is not None:
            self._token.cancel()
            self._token = None
            self._waiting.end(0, computed=False)
            self.card.stop.visible = False
        if words:
            self.card.tell(f"{words}; what was computed is kept")
