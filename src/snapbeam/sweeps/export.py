"""From the rows of a store to a labelled map, a block at a time or in memory."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from snapbeam.core.files import atomic_path
from snapbeam.sweeps.compute.task import CLASSES, Recipe
from snapbeam.sweeps.compute.tasks import Results
from snapbeam.sweeps.sweep import Grid, response_flags

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["class_coordinate", "to_dataset", "to_netcdf"]

_CLASS_DIM = "response_class"
_BLOCK = 65536
"""Points held at a time, or one index of the first dimension if that is more."""


def class_coordinate() -> tuple[tuple[str], Any, dict[str, Any]]:
    """The coordinate of the shares of the classes."""
    values = np.array([int(kind) for kind in CLASSES], dtype=np.int8)
    return (_CLASS_DIM,), values, {"units": "1", "long_name": "response class"} | response_flags()


def to_dataset(recipe: Recipe, grid: Grid, results: Results, attrs: dict[str, Any]) -> xr.Dataset:
    """The map in memory."""
    import xarray as xr

    columns = results.read(0, grid.size)
    coords = grid.coordinates()
    if recipe.replicas is not None:
        coords[_CLASS_DIM] = class_coordinate()
    dataset = xr.Dataset(coords=coords, attrs=attrs)
    for name, (_, by_class, labels) in recipe.variables().items():
        dims = (*grid.axes, _CLASS_DIM) if by_class else tuple(grid.axes)
        shape = (*grid.shape, len(CLASSES)) if by_class else grid.shape
        dataset[name] = (dims, recipe.values(name, columns).reshape(shape), labels)
    return dataset


def to_netcdf(recipe: Recipe, grid: Grid, results: Results, attrs: dict[str, Any], path: Path) -> None:
    """Write the map to a NetCDF file, whole or not at all, holding only a block of it in memory.

    The file is the one that :func:`to_dataset` and xarray would write.
    """
    import h5netcdf

    with atomic_path(path) as temporary, h5netcdf.File(temporary, "w") as file:
        file.attrs.update(attrs)
        coords = grid.coordinates()
        if recipe.replicas is not None:
            coords[_CLASS_DIM] = class_coordinate()
        scalars = " ".join(name for name, (dims, _, _) in coords.items() if not dims)
        file.dimensions = {dims[0]: len(values) for dims, values, _ in coords.values() if dims}
        for name, (dims, values, labels) in coords.items():
            data = np.asarray(values)
            fill = np.nan if data.dtype.kind == "f" else None
            variable = file.create_variable(name, dims, data.dtype, data=data, fillvalue=fill)
            variable.attrs.update(labels)
        written = {}
        for name, (kind, by_class, labels) in recipe.variables().items():
            dims = (*grid.axes, _CLASS_DIM) if by_class else tuple(grid.axes)
            stored = "int8" if kind == "bool" else kind
            fill = np.nan if kind == "float64" else None
            written[name] = file.create_variable(name, dims, np.dtype(stored), fillvalue=fill)
            written[name].attrs.update(labels | ({"dtype": "bool"} if kind == "bool" else {}))
            if scalars:
                written[name].attrs["coordinates"] = scalars
        for place, start, stop in _blocks(grid):
            columns = results.read(start, stop)
            for name, variable in written.items():
                values = recipe.values(name, columns)
                shape = tuple(s.stop - s.start for s in place) + grid.shape[len(place) :] + values.shape[1:]
                variable[(*place, ...)] = values.reshape(shape).astype(variable.dtype)


def _blocks(grid: Grid) -> Iterator[tuple[tuple[slice, ...], int, int]]:
    """Ranges of the first dimension and the points they hold."""
    if not grid.axes:
        yield (), 0, 1
        return
    rows, row = grid.shape[0], grid.size // grid.shape[0]
    step = max(1, _BLOCK // row)
    for first in range(0, rows, step):
        last = min(first + step, rows)
        yield (slice(first, last),), first * row, last * row
