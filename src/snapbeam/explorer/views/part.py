"""What every view of a run is: built when it is first looked at, filled when there is a run to show."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import panel as pn
from numpy.typing import NDArray

from snapbeam.explorer.look import Look, styled
from snapbeam.explorer.views.cursor import Cursor

if TYPE_CHECKING:
    from snapbeam import Run

__all__ = ["Part", "across", "within"]

_ROUNDED = 1e-9


class Part:
    """One view of a run.

    Attributes
    ----------
    title : str
        Of its tab.
    place : panel.Column
        Where it stands; empty until :meth:`build`.
    """

    title = ""

    def __init__(self, look: Look, cursor: Cursor) -> None:
        self.look, self.cursor = look, cursor
        self.place = pn.Column(sizing_mode="stretch_width", margin=0)
        self.built = False

    def activate(self) -> None:
        """Build it, the first time."""
        if not self.built:
            self.built = True
            parts = self.build()
            for part in parts:  # before they are on the page, not after
                if hasattr(part, "select"):
                    styled(part, self.look)
            self.place.objects = parts

    def build(self) -> list[Any]:
        """What stands in it."""
        raise NotImplementedError

    def show(self, run: Run, low: float, high: float) -> None:
        """Show a run from *low* to *high*, in cycles or seconds."""
        raise NotImplementedError

    def named(self, name: str) -> str:
        """The name of something in this view, another one in each of two runs."""
        return f"{name}{self.cursor.suffix}"

    def wrap(self, plot: Any) -> Any:
        """A figure in the page."""
        return pn.pane.Bokeh(plot, sizing_mode="stretch_width", margin=(0, 0, 4, 0))


def across(run: Run) -> tuple[NDArray[np.float64], str]:
    """What pictures over time have along them, and its label."""
    if "cycle" in run.dataset.variables:
        return run.dataset["cycle"].values, "cycles of excitation τ"
    return run.dataset["time"].values, "time (s)"


def within(x: NDArray[np.float64], low: float, high: float) -> slice:
    """The samples from *low* to *high*, at least two; one that rounding has put beyond an end is in."""
    low, high = low - _ROUNDED * abs(low), high + _ROUNDED * abs(high)
    first, last = int(np.searchsorted(x, low)), int(np.searchsorted(x, high, side="right"))
    if last - first < 2:
        first, last = max(first - 1, 0), min(first + 2, x.size)
    return slice(first, last)
