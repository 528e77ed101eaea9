"""The two axes that are shown, and where the others stand: from places on the screen to points of the map."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snapbeam import InputError
from snapbeam.config import lookup
from snapbeam.explorer.maps.layers import parameter_name
from snapbeam.explorer.maps.points import Point, parameter_of
from snapbeam.explorer.maps.raster import Axis
from snapbeam.explorer.maps.source import Source

__all__ = ["Plane"]


@dataclass(frozen=True, eq=False)
class Plane:
    """A cut through a map.

    Attributes
    ----------
    x, y : Axis
        Across and upward.
    fixed : dict of str to int
        Which point of each other axis.
    """

    source: Source
    x: Axis
    y: Axis
    fixed: dict[str, int]

    @classmethod
    def of(cls, source: Source, x: str, y: str, fixed: dict[str, int]) -> Plane:
        """The cut through a map along two axes.

        Raises
        ------
        InputError
            If it has no such axes.
        """
        for name in (x, y):
            if name not in source.dims:
                raise InputError(f"{name}: is no axis of this map, whose axes are {', '.join(source.dims)}")
        if x == y:
            raise InputError(f"{x}: stands along both axes")
        others = {name: fixed.get(name, 0) for name in source.dims if name not in (x, y)}
        return cls(source, Axis.of(source, x), Axis.of(source, y), others)

    @property
    def names(self) -> tuple[str, str]:
        """Dotted names of the two axes."""
        return parameter_of(self.source.skeleton, self.x.name), parameter_of(
            self.source.skeleton, self.y.name
        )

    def values(self, name: str) -> NDArray[Any] | None:
        """A variable on the cut, of shape (y, x)."""
        found = self.source.values(name)
        if found is None:
            return None
        cut = found.isel({name: at for name, at in self.fixed.items() if name in found.dims})
        for name in (self.y.name, self.x.name):
            if name not in cut.dims:  # known of the whole map: a strip
                cut = cut.drop_vars(name, errors="ignore").expand_dims(name)
        one = {name: 0 for name in cut.dims if name not in (self.x.name, self.y.name)}
        return np.asarray(cut.isel(one).transpose(self.y.name, self.x.name).values)

    def index(self, x: float, y: float) -> tuple[int, int]:
        """Row and column of the point whose cell holds a place."""
        return self.y.nearest(y), self.x.nearest(x)

    def fixed_values(self) -> dict[str, Any]:
        """The values of the other axes, by dotted name, and of axes of one point."""
        found = {
            parameter_of(self.source.skeleton, name): _plain(self.source.coordinate(name)[at])
            for name, at in self.fixed.items()
        }
        for name in map(str, self.source.skeleton.dims):
            if (
                self.source.skeleton.sizes[name] == 1
                and name not in (self.x.name, self.y.name)
                and parameter_name(self.source.skeleton, name) is not None
            ):
                found[parameter_of(self.source.skeleton, name)] = _plain(self.source.coordinate(name)[0])
        return found

    def at(self, row: int, column: int) -> Point:
        """The point of the map in a cell, without what the map holds of it."""
        across, upward = self.names
        values = {across: _plain(self.x.points[column]), upward: _plain(self.y.points[row])}
        return Point(values | self.fixed_values())

    def indexers(self, row: int, column: int) -> dict[str, int]:
        """Where a cell lies in the arrays of the map."""
        return {self.x.name: column, self.y.name: row, **self.fixed}

    def beside(self, place: tuple[float, float], across: int, upward: int) -> tuple[int, int]:
        """Row and column of the point *across* and *upward* points from that at a place; the last one at an edge."""
        row, column = self.index(*place)
        return (
            int(np.clip(row + upward, 0, self.y.at.size - 1)),
            int(np.clip(column + across, 0, self.x.at.size - 1)),
        )

    @property
    def parameters(self) -> list[str]:
        """Dotted names of all that a point is given by."""
        return list(dict.fromkeys([*self.names, *self.fixed_values()]))

    def find(self, values: dict[str, Any]) -> tuple[int, int] | None:
        """Row and column of a point given by its exact values; None if it is not one of the map's."""
        place = []
        for axis, name in ((self.y, self.names[1]), (self.x, self.names[0])):
            at = np.flatnonzero(axis.points == values.get(name))
            if at.size != 1:
                return None
            place.append(int(at[0]))
        same = all(values.get(name, value) == value for name, value in self.fixed_values().items())
        return (place[0], place[1]) if same else None

    def place(self, values: dict[str, Any]) -> tuple[float, float] | None:
        """Where a point is drawn; None if it is of another cut."""
        found = []
        for axis, name in ((self.x, self.names[0]), (self.y, self.names[1])):
            value = values.get(name)
            if value is None:
                return None
            if axis.words is not None:
                at = np.flatnonzero(axis.points == value)
                if not at.size:
                    return None
                found.append(float(axis.at[at[0]]))
            else:
                found.append(float(value))
        return found[0], found[1]

    @property
    def can_zoom(self) -> bool:
        """Whether both axes are of numbers between which there are others."""
        return all(lookup(name).quantity.kind is float for name in self.names)


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value
