"""A list of points over two of its parameters: each point stands where its own values are."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snapbeam import InputError
from snapbeam.explorer.maps.layers import POINT, parameter_name
from snapbeam.explorer.maps.points import Point, parameter_of
from snapbeam.explorer.maps.raster import Axis
from snapbeam.explorer.maps.source import Source

__all__ = ["Scatter"]


@dataclass(frozen=True, eq=False)
class Scatter:
    """A list of points seen along two of its parameters; it has the interface of a cut through a grid.

    Attributes
    ----------
    x, y : Axis
        Across and upward; their ``at`` are the places of the points, in the order of the list.
    """

    source: Source
    x: Axis
    y: Axis
    fixed: dict[str, int]

    @classmethod
    def of(cls, source: Source, x: str, y: str) -> Scatter:
        """A list of points along two parameters.

        Raises
        ------
        InputError
            If its points have no such parameters.
        """
        for name in (x, y):
            if name not in source.dims:
                raise InputError(
                    f"{name}: is no parameter of these points, which are {', '.join(source.dims)}"
                )
        if x == y:
            raise InputError(f"{x}: stands along both axes")
        size = source.skeleton.sizes[POINT]
        return cls(source, Axis.scattered(source, x, size), Axis.scattered(source, y, size), {})

    @property
    def names(self) -> tuple[str, str]:
        """Dotted names of the two axes."""
        skeleton = self.source.skeleton
        return parameter_of(skeleton, self.x.name), parameter_of(skeleton, self.y.name)

    @property
    def parameters(self) -> list[str]:
        """Dotted names of all that a point is given by."""
        return list(self.at(0).values)

    def values(self, name: str) -> NDArray[Any] | None:
        """A number of each point, of shape (points,)."""
        found = self.source.values(name)
        return None if found is None else np.asarray(found.values)

    def index(self, x: float, y: float) -> tuple[int]:
        """The point nearest to a place, distances in shares of the axes."""
        distance = self._away(x, y)
        return (int(np.argmin(distance[0] ** 2 + distance[1] ** 2)),)

    def _away(self, x: float, y: float) -> NDArray[np.float64]:
        """Distances of the points across and upward from a place, in shares of the axes; shape (2, points)."""
        sides = []
        for axis, value in ((self.x, x), (self.y, y)):
            low, high = axis.span
            sides.append((axis.at - value) / (high - low))
        return np.array(sides)

    def fixed_values(self) -> dict[str, Any]:
        """Nothing is the same for all points by itself."""
        return {}

    def at(self, number: int) -> Point:
        """A point of the list, without what the map holds of it."""
        values = {}
        for name, item in self.source.skeleton.coords.items():
            full = parameter_name(self.source.skeleton, str(name))
            if item.dims == (POINT,) and "parameter" in item.attrs and full is not None:
                values[full] = item.values[number].item()
        return Point(values)

    def indexers(self, number: int) -> dict[str, int]:
        """Where a point lies in the arrays of the map."""
        return {POINT: number}

    def find(self, values: dict[str, Any]) -> tuple[int] | None:
        """The point of exactly these values; None if the list has none."""
        same = np.ones(self.x.at.size, dtype=bool)
        for name in self.at(0).values:
            same &= self.source.skeleton[self._short(name)].values == values.get(name)
        found = np.flatnonzero(same)
        return (int(found[0]),) if found.size else None

    def _short(self, full: str) -> str:
        skeleton = self.source.skeleton
        return next(str(name) for name in skeleton.coords if parameter_name(skeleton, str(name)) == full)

    def place(self, values: dict[str, Any]) -> tuple[float, float] | None:
        """Where a point is drawn; None if it does not say."""
        found = [values.get(name) for name in self.names]
        if any(value is None for value in found):
            number = self.find(values)
            return None if number is None else (float(self.x.at[number[0]]), float(self.y.at[number[0]]))
        return float(found[0]), float(found[1])  # type: ignore[arg-type]

    def beside(self, place: tuple[float, float], across: int, upward: int) -> tuple[int]:
        """The nearest point within 45 degrees of a direction; the one at the place itself if there is none."""
        away = self._away(*place)
        along = across * away[0] + upward * away[1]
        aside = np.abs(upward * away[0] - across * away[1])
        ahead = (along > 0.0) & (aside <= along)
        if not ahead.any():
            return self.index(*place)
        distance = np.where(ahead, away[0] ** 2 + away[1] ** 2, np.inf)
        return (int(np.argmin(distance)),)

    @property
    def can_zoom(self) -> bool:
        """Between the points of a list there is nothing to compute."""
        return False
