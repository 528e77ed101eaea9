"""Labelled datasets and NetCDF files from the rows of a sweep."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from snapbeam.simulation.save import code_flags
from snapbeam.sweeps.points import PointList, Points
from snapbeam.sweeps.tasks import CLASSES, PointWork, ResultRows
from snapbeam.util.interrupts import raise_held
from snapbeam.util.netcdf import netcdf_file
from snapbeam.util.status_codes import ResponseClass

if TYPE_CHECKING:
    import xarray as xr

_CLASS_DIM = "class_code"
_BLOCK = 65536
"""Points of a block; a block is at least one index of the first dimension."""


def class_coordinate() -> tuple[tuple[str], Any, dict[str, Any]]:
    """Return the coordinate of the fractions of the classes."""
    values = np.array([int(kind) for kind in CLASSES], dtype=np.int8)
    return (_CLASS_DIM,), values, {"units": "1", "long_name": "response class"} | code_flags(ResponseClass)


def to_dataset(work: PointWork, points: Points, rows: ResultRows, attrs: dict[str, Any]) -> xr.Dataset:
    """Return the dataset of a sweep."""
    from snapbeam.util.datasets import variable, xr

    table, dims = rows.read(0, points.size), points.dims
    variables = {
        name: variable(name, (*dims, _CLASS_DIM) if by_class else dims, points.arranged(work.values(name, table)), labels)
        for name, (_, by_class, labels) in work.variables().items()
    }  # fmt: skip
    return xr.Dataset(variables, _coordinates(work, points), attrs)


def _coordinates(work: PointWork, points: Points) -> dict[str, Any]:
    coords = work.setup.with_points(points).coordinates()
    if work.replicates is not None:
        coords[_CLASS_DIM] = class_coordinate()
    return coords


def to_netcdf(work: PointWork, points: Points, rows: ResultRows, attrs: dict[str, Any], path: Path) -> None:
    """Write the dataset of a sweep to a NetCDF file atomically, block by block.

    The file is equal to the file that xarray writes from the result of :func:`to_dataset`.
    """
    import h5py

    with netcdf_file(path) as file:
        file.attrs.update({name: value for name, value in attrs.items() if value is not None})
        coords = _coordinates(work, points)
        scalars = " ".join(name for name, (dims, _, _) in coords.items() if name not in dims)
        file.dimensions = {dims[0]: len(values) for name, (dims, values, _) in coords.items() if dims == (name,)}
        if isinstance(points, PointList):
            file.dimensions[points.dims[0]] = points.size
        for name, (dims, values, labels) in coords.items():
            data = np.asarray(values)
            if data.dtype.kind in "OU":
                data = data.astype(object)
                variable = file.create_variable(name, dims, h5py.string_dtype(), data=data)
            else:
                fill = np.nan if data.dtype.kind == "f" else None
                variable = file.create_variable(name, dims, data.dtype, data=data, fillvalue=fill)
            variable.attrs.update(labels)
        written = {}
        for name, (kind, by_class, labels) in work.variables().items():
            dims = (*points.dims, _CLASS_DIM) if by_class else points.dims
            stored = "int8" if kind == "bool" else kind
            fill = np.nan if kind == "float64" else None
            written[name] = file.create_variable(
                name, dims, np.dtype(stored), fillvalue=fill, chunks=None if not dims else True, **_COMPRESSION
            )
            written[name].attrs.update(labels | ({"dtype": "bool"} if kind == "bool" else {}))
            if scalars:
                written[name].attrs["coordinates"] = scalars
        for place, start, stop in _blocks(points):
            raise_held()
            table = rows.read(start, stop)
            for name, variable in written.items():
                values = work.values(name, table)
                shape = tuple(s.stop - s.start for s in place) + points.shape[len(place) :] + values.shape[1:]
                _put(variable, points, place, values.reshape(shape).astype(variable.dtype))


_COMPRESSION: dict[str, Any] = {"compression": "gzip", "compression_opts": 4, "shuffle": True}


def _put(variable: Any, points: Points, place: tuple[slice, ...], block: np.ndarray) -> None:
    """Write a block, whose points are in the order of counting, with the dimensions of the dataset."""
    if isinstance(points, PointList):
        variable[(*place, ...)] = block
        return
    inside = [points.order.index(name) for name in points.axes]
    where = [place[at] if at < len(place) else slice(None) for at in inside]
    variable[(*where, ...)] = block.transpose(*inside, *range(len(inside), block.ndim))


def _blocks(points: Points) -> Iterator[tuple[tuple[slice, ...], int, int]]:
    """Yield ranges of the first axis in the order of counting, and the numbers of their points."""
    rows, row = points.shape[0], points.size // points.shape[0]
    step = max(1, _BLOCK // row)
    for first in range(0, rows, step):
        last = min(first + step, rows)
        yield (slice(first, last),), first * row, last * row
