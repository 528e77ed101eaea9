"""Points of a sweep: a grid or a list of values of any parameters."""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.parameter_axes import axis_that_changes_unit, checked_physical, parse_axis, ratios_of, unit_of
from snapbeam.model.parameters import PHYSICAL, Parameter, lookup, parameters, ratio_of, refuse_well_axis, short_names
from snapbeam.model.quantity import split_name
from snapbeam.util.provenance import array_hash
from snapbeam.util.validation import InputError, InputTypeError, axis, finite_array, instance, require_texts, shown

if TYPE_CHECKING:
    import xarray as xr

    from snapbeam.model.system import System

Columns = dict[str, NDArray[Any]]
"""Values of points by dotted name: arrays of shape (points,)."""
POINT = "point"
"""Dimension of a list of points."""
_NOT_SWEPT = (
    "integration.engine",
    "integration.threads",
    "integration.tolerance",
    "drive.displacement",
    "drive.velocity",
)


@dataclass(frozen=True, eq=False)
class Grid:
    """All combinations of the values of some axes.

    In the order of counting, the axes of model-level parameters are the outermost, so that points with the same model
    follow each other.  The dimensions of the dataset have the order in which the axes were given.
    """

    axes: dict[str, NDArray[Any]]
    """Values by dotted name, in the order of the dimensions."""
    units: dict[str, tuple[str, float]] = field(default_factory=dict)
    """Name in the physical unit in which an axis of ratios was given, and the value of a ratio of 1 in this unit."""

    @cached_property
    def order(self) -> tuple[str, ...]:
        """Axes in the order in which points are counted."""
        structural = [name for name in self.axes if not lookup(name).is_run]
        return (*structural, *(name for name in self.axes if name not in structural))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters that differ among the points."""
        return tuple(self.axes)

    @property
    def dims(self) -> tuple[str, ...]:
        """Dimensions of the dataset."""
        return tuple(lookup(name).short for name in self.axes)

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values of each axis, in the order of counting."""
        return tuple(self.axes[name].size for name in self.order)

    @property
    def size(self) -> int:
        """Number of points."""
        return math.prod(self.shape)

    def take(self, which: NDArray[np.int64]) -> Columns:
        """Return the values of the points with the given numbers."""
        at = np.unravel_index(which, self.shape) if self.axes else ()
        return {name: self.axes[name][i] for name, i in zip(self.order, at, strict=True)}

    def arranged(self, values: NDArray[Any]) -> NDArray[Any]:
        """Reshape an array over all points, in the order of counting, to the dimensions of the dataset."""
        inside = values.reshape(*self.shape, *values.shape[1:])
        moved = [self.order.index(name) for name in self.axes]
        return inside.transpose(*moved, *range(len(moved), inside.ndim))

    def coordinates(self) -> dict[str, Any]:
        """Return dimensions, values and attributes of the axes, by name."""
        rows = map(lookup, self.axes)
        found: dict[str, Any] = {row.short: ((row.short,), self.axes[row.name], labels_of(row)) for row in rows}
        for ratio, (name, unit) in self.units.items():
            row, dim = lookup(name), lookup(ratio).short
            values = [float(f"{value:.14g}") for value in self.axes[ratio] * unit]  # as they were given
            found[row.short] = (dim,), np.array(values), labels_of(row)
        return found

    def describe(self) -> dict[str, Any]:
        """Return plain values that identify the grid."""
        return {name: values.tolist() for name, values in self.axes.items()}


@dataclass(frozen=True, eq=False)
class PointList:
    """List of points."""

    columns: Columns
    labels: dict[str, NDArray[Any]] = field(default_factory=dict)
    """Further columns of the table of points."""

    @property
    def axes(self) -> dict[str, NDArray[Any]]:
        """An empty mapping: a list has no axes."""
        return {}

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters that differ among the points."""
        return tuple(self.columns)

    @property
    def dims(self) -> tuple[str, ...]:
        """The dimension ``point``."""
        return (POINT,)

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of points."""
        return (self.size,)

    @property
    def size(self) -> int:
        """Number of points."""
        return int(next(iter(self.columns.values())).size)

    def take(self, which: NDArray[np.int64]) -> Columns:
        """Return the values of the points with the given numbers."""
        return {name: values[which] for name, values in self.columns.items()}

    def arranged(self, values: NDArray[Any]) -> NDArray[Any]:
        """Return the array."""
        return values

    def coordinates(self) -> dict[str, Any]:
        """Return dimension, values and attributes of each parameter and label, by name."""
        found: dict[str, Any] = {
            row.short: ((POINT,), self.columns[row.name], labels_of(row)) for row in map(lookup, self.columns)
        }
        return found | {name: ((POINT,), values, {}) for name, values in self.labels.items()}

    def describe(self) -> dict[str, Any]:
        """Return plain values that identify the list."""
        return {name: {"points": values.size, "sha256": array_hash(values)} for name, values in self.columns.items()}


Points = Grid | PointList

_POINT_BYTES = 700
"""Memory of a point of a sweep until its dataset is complete."""
_MEMORY = 4 * 2**30


def require_memory(points: int, remedy: str, bytes_each: int = _POINT_BYTES) -> None:
    """Refuse a sweep whose results, or values, do not fit into the memory, before any of them is computed or read."""
    size = points * bytes_each
    if size > _MEMORY:
        raise InputError(
            f"{points} points would take {size / 2**30:.3g} GiB of memory, the limit is {_MEMORY / 2**30:.0f} GiB: {remedy}"
        )


def points_of(given: Mapping[str, Any] | xr.Dataset | Any, system: System | None = None) -> Points:
    """Return the points of a request, an error naming what is unknown, cannot be swept or is out of range.

    A mapping defines a grid: names of parameters, dotted or short, with strictly increasing numbers or different words.
    A dataset with one-dimensional variables along one dimension, or a data frame, defines a list.  Its columns that are
    not parameters become labels; a name that is almost a parameter's is refused.  Values in Hz, m/s, g, um or m become
    ratios of the *system*.  Where another axis changes the structure, and with it the unit of a ratio, they stay as
    they are given; :meth:`~snapbeam.sweeps.setup.SweepSetup.groups` makes the ratios of each structure.
    """
    from snapbeam.util.datasets import xr

    if isinstance(given, (Grid, PointList)):
        return given if isinstance(given, Grid) else _list_in_ratios(given, system)
    if isinstance(given, xr.Dataset):
        columns = {str(name): np.asarray(given[name].values) for name in given.variables}
        return _list_in_ratios(_list_of(columns), system)
    if hasattr(given, "columns") and hasattr(given, "to_dict"):
        return _list_in_ratios(_list_of({str(name): np.asarray(given[name]) for name in given.columns}), system)
    instance("axes", given, Mapping, "a mapping of parameters to values, an xarray.Dataset or a table of points")
    if not given:
        raise InputError("axes: must name at least one parameter to sweep")
    rows: dict[str, Parameter] = {}
    found: dict[str, NDArray[Any]] = {}
    for each, values in given.items():
        row = _swept(str(each), system)
        ratio = ratio_of(row.name)
        if ratio in rows:
            raise InputError(f"{each}: is given twice among the axes; give it once")
        rows[ratio], found[ratio] = row, _axis(row, str(each), values)
    axes, units = {}, {}
    for ratio, values in found.items():
        name = rows[ratio].name
        if name == ratio or system is None or axis_that_changes_unit(system, name, found) is not None:
            axes[name] = values
            continue
        for end in (values[0], values[-1]):
            checked_physical(system, name, end, name)
        units[ratio] = name, unit_of(system, name)
        axes[ratio] = values / units[ratio][1]
    return Grid(axes, units)


def _list_in_ratios(points: PointList, system: System | None) -> PointList:
    """Return a list of points without columns in physical units, which become labels, unless the structure changes."""
    if system is None or any(not lookup(name).is_run for name in points.columns):
        return points
    given = {lookup(name).short: values for name, values in points.columns.items() if name in PHYSICAL}
    return PointList(ratios_of(system, points.columns), points.labels | given) if given else points


def _swept(name: str, system: System | None = None) -> Parameter:
    row = lookup(name) if system is None else system.parameter(name)
    if row.name in _NOT_SWEPT:
        raise InputError(f"{name}: cannot be swept; set it in the system or the integration")
    return row


def _array(name: str, values: Any) -> NDArray[Any]:
    """Return the values of an axis as an array, of whatever object."""
    try:
        return np.asarray(values)
    except Exception as error:  # an object decides by itself how it becomes an array
        raise InputTypeError(
            f"{name} = {shown(values)}: must be an array of numbers or words, not {type(values).__name__}"
        ) from error


def _axis(row: Parameter, name: str, values: Any) -> NDArray[Any]:
    """Return the checked values of one axis: increasing numbers, or different words."""
    refuse_well_axis(row)
    item = row.quantity
    if item.kind in (str, bool):
        words = [item.check(name, value) for value in np.atleast_1d(_array(name, values)).tolist()]
        if not words:
            raise InputError(f"{name} = []: must hold at least one point")
        if len(set(words)) < len(words):
            raise InputError(f"{name} = {words}: must differ from each other")
        return np.array(words)
    if isinstance(values, str):
        values = np.atleast_1d(parse_axis(name, values, whole=item.kind is int, unit=item.unit))
    if not isinstance(values, (list, tuple, range)) and np.ndim(_array(name, values)) == 0:
        raise InputError(f"{name} = {shown(values)}: must be an array; put a single value into the system")
    closed = item.closed if item.kind is float else "both"
    array = axis(name, values, item.low, item.high, closed=closed)
    if item.kind is int:
        return np.array([item.check(name, value) for value in array.tolist()], dtype=np.int64)
    return array


def _list_of(columns: dict[str, NDArray[Any]]) -> PointList:
    known: Columns = {}
    labels: dict[str, NDArray[Any]] = {}
    for name, values in columns.items():
        require_texts(shown(name), name)
        require_texts(name, values)
        if values.ndim == 0:
            values = np.full(max((each.size for each in columns.values() if each.ndim == 1), default=1), values)
        if values.ndim != 1:
            raise InputError(f"{name} of shape {values.shape}: a list of points must have one dimension")
        if _is_label(name):
            labels[name] = values
            continue
        row = _swept(name)
        if row.name in known:
            raise InputError(f"{name}: is given twice among the points, also as {row.name}; give it once")
        item = row.quantity
        if item.kind in (str, bool):
            known[row.name] = np.array([item.check(name, value) for value in values.tolist()])
        else:
            numbers = finite_array(name, values, 1)
            known[row.name] = np.array([item.check(f"{name}[{i}]", value) for i, value in enumerate(numbers.tolist())])
    if not known:
        raise InputError(f"points with {', '.join(columns)}: must contain a parameter")
    lengths = {name: values.size for name, values in (known | labels).items()}
    if len(set(lengths.values())) > 1 or min(lengths.values()) == 0:
        raise InputError(f"points of lengths {lengths}: must be equal, and at least one")
    return PointList(known, labels)


def _is_label(name: str) -> bool:
    """Return whether a column of a table of points is a label, not a parameter."""
    table = parameters()
    known = [*table, *short_names(), *(split_name(full)[1] for full in (*table, *PHYSICAL))]
    if name in known:
        return False
    try:
        lookup(name)
    except InputError:
        close = difflib.get_close_matches(name, known, 1, 0.85)
        if close:
            raise InputError(
                f"{name}: is not a parameter; did you mean {close[0]!r}?  If the column is a label, give it another name"
            ) from None
        return True
    return False


def labels_of(row: Parameter) -> dict[str, Any]:
    """Attributes of a coordinate that holds values of a parameter."""
    return {"units": row.quantity.unit, "long_name": row.quantity.long_name, "parameter": row.name}
