"""A store that grows: its map is asked for again over more values of its axes, and what it holds is kept as it is.

The points of each map that was asked for, less those of the map before, are a stage of their own.  Nothing that was
computed is written again: a grown store is the stages of its earlier maps and one more.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.sweeps.compute.task import PointWork, ResultTable
from snapbeam.sweeps.compute.tasks import Rows, Stage
from snapbeam.sweeps.keep.description import axes_apart, read_stored_points
from snapbeam.sweeps.points import Grid
from snapbeam.sweeps.setup import SweepSetup

__all__ = ["BASE", "JoinedRows", "Layer", "grown", "is_growth", "layers_of", "snapped"]

BASE = "base"
"""The stage of all points of a map, whatever it grew from."""
_SAME = 1e-12
"""Relative distance within which a value asked for is one that the store has: ranges are rounded as they are cut."""

_Index = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Layer:
    """The points that a store got when its map was asked for, or when it grew."""

    work: PointWork
    """Of the map that was asked for then."""
    stage: Stage
    places: _Index
    """Numbers of the stage's points in the grid that the store has now."""


@dataclass(frozen=True, eq=False)
class JoinedRows:
    """Rows of the layers of a store, in the order of the grid that it has now."""

    layers: Sequence[Layer]
    rows: Sequence[Rows]

    def read(self, start: int, stop: int) -> ResultTable:
        """Rows *start* to *stop*."""
        found = self.layers[-1].work.unfinished(stop - start)
        for layer, rows in zip(self.layers, self.rows, strict=True):
            own = np.flatnonzero((layer.places >= start) & (layer.places < stop))
            if not own.size:
                continue
            first = int(own[0])
            part = rows.read(first, int(own[-1]) + 1)
            found.integers[layer.places[own] - start] = part.integers[own - first]
            found.numbers[layer.places[own] - start] = part.numbers[own - first]
        return found


def is_growth(held: Mapping[str, Any], wanted: Mapping[str, Any]) -> bool:
    """Whether the parameters *wanted* are those *held* but for more values along some axes."""
    there, here = held.get("points"), wanted.get("points")
    if not isinstance(there, dict) or not isinstance(here, dict) or there == here:
        return False
    if {**held, "points": None} != {**wanted, "points": None} or there.keys() != here.keys():
        return False
    return not any(axes_apart(there, here).values()) and all(isinstance(each, list) for each in here.values())


def grown(description: Mapping[str, Any], wanted: Mapping[str, Any], names: Sequence[str]) -> dict[str, Any]:
    """The description of a store that has grown to other axes, whose hash is still to be written."""
    before = {"points": description["parameters"]["points"], "axes": description["axes"]}
    layers = [*description.get("grown", []), before]
    return {
        **description,
        "parameters": dict(wanted),
        "axes": list(names),
        "grown": layers,
        "format_version": 4,
    }


def layers_of(work: PointWork, earlier: Sequence[Mapping[str, Any]], chunk: int) -> list[Layer]:
    """The layers of a store: of its *earlier* maps as :func:`grown` keeps them, and of *work*, in their order."""
    now = work.setup.points
    if not isinstance(now, Grid):  # a list of points does not grow
        return [Layer(work, Stage(BASE, now, chunk), np.arange(now.size))]
    grids = [
        Grid({name: np.array(each["points"][name], now.axes[name].dtype) for name in each["axes"]})
        for each in earlier
    ]
    found = []
    for number, grid in enumerate([*grids, now]):
        own = replace(work, setup=work.setup.with_points(grid)) if grid is not now else work
        which = None if number == 0 else _beyond(grid, grids[number - 1])
        stage = Stage(BASE if number == 0 else f"more-{number}", grid, chunk, which)
        rows = np.arange(grid.size) if which is None else which
        found.append(Layer(own, stage, _places(grid, now, rows)))
    return found


def _beyond(grid: Grid, before: Grid) -> _Index:
    """The points of a grid that the one before has not."""
    known = np.ones(grid.shape, dtype=bool)
    for at, name in enumerate(grid.order):
        shape = [1] * len(grid.shape)
        shape[at] = -1
        known &= np.isin(grid.axes[name], before.axes[name]).reshape(shape)
    return np.flatnonzero(~known)


def _places(grid: Grid, now: Grid, which: _Index) -> _Index:
    """Numbers of points of a grid in one that holds them all."""
    at = dict(zip(grid.order, np.unravel_index(which, grid.shape), strict=True))
    places = []
    for name in now.order:
        number = {value: place for place, value in enumerate(now.axes[name].tolist())}
        own = np.array([number[value] for value in grid.axes[name].tolist()], dtype=np.int64)
        places.append(own[at[name]])
    return np.ravel_multi_index(tuple(places), now.shape).astype(np.int64)


def snapped(setup: SweepSetup, path: str | os.PathLike[str] | None) -> tuple[SweepSetup, str]:
    """A sweep with the values of a store where it asks for the same but for rounding, and words for that."""
    points = setup.points
    if path is None or not isinstance(points, Grid):
        return setup, ""
    held = read_stored_points(Path(path))
    if held is None or held.keys() != points.axes.keys():
        return setup, ""
    axes, moved, most = {}, 0, 0.0
    for name, values in points.axes.items():
        stored = np.array(held[name]) if isinstance(held[name], list) else np.zeros(0)
        axes[name] = values
        if values.dtype.kind != "f" or stored.dtype.kind != "f" or not stored.size:
            continue
        near = stored[np.abs(values[:, None] - stored[None, :]).argmin(axis=1)]
        apart = np.abs(values - near)
        same = (apart > 0.0) & (apart <= _SAME * np.abs(near))
        axes[name] = np.where(same, near, values)
        moved, most = moved + int(same.sum()), max(most, float(apart[same].max(initial=0.0)))
    if not moved:
        return setup, ""
    words = f"{moved} values of the axes are those of the store, at most {most:.1g} from what was asked for"
    return setup.with_points(Grid(axes)), words
