"""Cells of a map as the pixels of a picture, for the part that is seen."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.figures.axes import edges_of, is_geometric, positions

if TYPE_CHECKING:
    from snapbeam.explorer.maps.source import Source

__all__ = ["Axis", "Picture", "picture", "plain_symbol"]

_Array = NDArray[np.float64]
_MOST = 1_000_000
"""Cells that are sent as they are."""
_EVEN = 1e-6
_SIGNS = {
    r"\Omega": "Ω",
    r"\omega": "ω",
    r"\zeta": "ζ",
    r"\rho": "ρ",
    r"\phi": "φ",
    r"\varphi": "φ",
    r"\tau": "τ",
}


def plain_symbol(text: str) -> str:
    """A symbol as a browser shows it without mathematics."""
    for sign, letter in _SIGNS.items():
        text = text.replace(sign, letter)
    return (
        text.replace(r"\mathrm", "")
        .replace("_s", "ₛ")
        .replace("_{s}", "ₛ")
        .replace("{", "")
        .replace("}", "")
        .replace("\\", "")
    )


@dataclass(frozen=True, eq=False)
class Axis:
    """One axis of a map: its points, where they are drawn, and the borders of their cells."""

    name: str
    label: str
    points: NDArray[Any]
    at: _Array
    edges: _Array
    words: list[str] | None = None
    log: bool = False

    @classmethod
    def of(cls, source: Source, name: str) -> Axis:
        """The axis of a map."""
        skeleton = source.skeleton
        if not skeleton[name].dims:
            skeleton = skeleton.drop_vars(name).assign_coords({
                name: (name, source.coordinate(name), skeleton[name].attrs)
            })  # fmt: skip
        at, words = positions(skeleton, name)
        label = cls.words_of(source, name)
        edges = (
            edges_of(skeleton, name) if at.size > 1 else at[0] + np.array([-0.5, 0.5]) * max(abs(at[0]), 1.0)
        )
        log = words is None and is_geometric(at)
        return cls(name, label, source.coordinate(name), at, edges, words, log)

    @classmethod
    def scattered(cls, source: Source, name: str, size: int) -> Axis:
        """One parameter of a list of points, in the order of the list."""
        at = np.broadcast_to(source.coordinate(name).astype(np.float64), (size,))
        low, high = float(at.min()), float(at.max())
        room = 0.04 * (high - low) or 0.5 * max(abs(low), 1.0)
        edges = np.array([low - room, high + room])
        return cls(name, cls.words_of(source, name), source.coordinate(name), at, edges)

    @staticmethod
    def words_of(source: Source, name: str) -> str:
        """What stands along it: words, symbol and unit."""
        from snapbeam.config import lookup

        attrs = source.skeleton[name].attrs
        text, unit = source.label(name)
        text = text.replace("omega_1", "ω₁")
        symbol = ""
        if "parameter" in attrs or name in ("frequency_ratio", "velocity_amplitude", "location"):
            symbol = plain_symbol(lookup(str(attrs.get("parameter", name))).quantity.symbol)
        return " ".join(part for part in (text, symbol, "" if unit == "1" else f"({unit})") if part)

    @property
    def span(self) -> tuple[float, float]:
        """Outermost borders."""
        return float(self.edges[0]), float(self.edges[-1])

    def nearest(self, value: float) -> int:
        """The number of the point in whose cell a place lies; the nearest one outside."""
        return int(np.clip(np.searchsorted(self.edges, value, side="right") - 1, 0, self.at.size - 1))

    def spread(self, low: float, high: float, pixels: int) -> _Array:
        """Centres of even pixels from *low* to *high*."""
        share = (np.arange(pixels) + 0.5) / pixels
        if self.log:
            return np.exp(np.log(low) + share * np.log(high / low))
        return low + share * (high - low)

    @property
    def even(self) -> bool:
        """Whether its cells are equally wide on the screen."""
        edges = np.log(self.edges) if self.log and self.edges[0] > 0.0 else self.edges
        widths = np.diff(edges)
        return bool(np.allclose(widths, widths[0], rtol=_EVEN))


@dataclass(frozen=True, eq=False)
class Picture:
    """An array of cells and where it lies."""

    values: NDArray[Any]
    x: float
    y: float
    width: float
    height: float


def _cut(axis: Axis, view: tuple[float, float], pixels: int) -> tuple[NDArray[np.int64], float, float]:
    """Which cells to show, and from where to where: the cells in view, or pixels, if they are fewer."""
    low, high = max(min(view), axis.edges[0]), min(max(view), axis.edges[-1])
    if not low < high:
        return np.zeros(0, dtype=np.int64), 0.0, 0.0
    first, last = axis.nearest(low), axis.nearest(np.nextafter(high, low))
    if axis.even and last - first < max(pixels, 2) * 2:
        return np.arange(first, last + 1), float(axis.edges[first]), float(axis.edges[last + 1])
    where = axis.spread(low, high, pixels)
    index = np.clip(np.searchsorted(axis.edges, where, side="right") - 1, 0, axis.at.size - 1)
    return index, float(low), float(high)


def picture(
    values: NDArray[Any], x: Axis, y: Axis, view: tuple[float, float, float, float], pixels: tuple[int, int]
) -> Picture | None:
    """The part of *values*, of shape (y, x), that a view (x0, x1, y0, y1) of so many pixels shows.

    Cells that lie evenly are sent as they are, so that their borders are exact at any zoom; uneven ones, and more of
    them than there are pixels, are read off at the centre of each pixel.
    """
    if values.size <= _MOST and x.even and y.even:
        return Picture(values, x.span[0], y.span[0], x.span[1] - x.span[0], y.span[1] - y.span[0])
    across, left, right = _cut(x, view[:2], pixels[0])
    upward, low, high = _cut(y, view[2:], pixels[1])
    if not across.size or not upward.size:
        return None
    return Picture(values[np.ix_(upward, across)], left, low, right - left, high - low)
