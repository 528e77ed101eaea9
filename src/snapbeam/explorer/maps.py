"""Sources of the explorer: a map in memory, a map in a file, or a system without a map."""

from __future__ import annotations

import json
import math
import os
import pprint
import shlex
import threading
import time
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

import snapbeam as sb
from snapbeam.explorer.drawn import plain as plain_formulas
from snapbeam.explorer.jobs import WINDOW_POINTS, Jobs, Token, check_run
from snapbeam.model.parameter_axes import to_physical
from snapbeam.model.parameter_file import config_from_mapping, config_text
from snapbeam.model.parameters import PHYSICAL, Parameter, lookup, parameters, row_of
from snapbeam.model.quantity import split_name
from snapbeam.plot.axes import edges_of, is_geometric, positions
from snapbeam.plot.dataset import figures_of
from snapbeam.sweeps.points import ratios_of
from snapbeam.util.netcdf import read_result, split_group
from snapbeam.util.proportions import proportion
from snapbeam.util.validation import parsed_json

if TYPE_CHECKING:
    import xarray as xr

# ----------------------------------------------------------------------------------------------------
# What a dataset can show over its parameters: its variables, and each entry of those that have one dimension more.


POINT = "point"
"""Dimension of a list of points."""
_ENTRIES = 12
"""Entries of one more dimension that are shown one by one: outcomes, wells, classes, numbers of cycles."""
_HIDDEN = ("status",)


@dataclass(frozen=True)
class MapLayer:
    """One number a point: a variable, or the entry *where* of it; those not *shown* are told with their point alone."""

    variable: str
    where: dict[str, int]
    words: str
    unit: str
    shown: bool


def parameter_name(skeleton: xr.Dataset, name: str) -> str | None:
    """The dotted name of what a coordinate is of; None if it is no parameter."""
    if name not in skeleton.coords:
        return None
    said = skeleton[name].attrs.get("parameter", "")
    try:
        return lookup(str(said)).name
    except sb.InputError:
        return None


def parameter_dims(skeleton: xr.Dataset) -> list[str]:
    """The dimensions that are swept; one of them is ``point`` for a list."""
    names = [str(name) for name in skeleton.dims]
    if "response_class" in skeleton:
        names = [str(name) for name in skeleton["response_class"].dims]
    return [name for name in names if name == POINT or parameter_name(skeleton, name) is not None]


def layers_of(skeleton: xr.Dataset) -> dict[str, MapLayer]:
    """All that is known of a point, by name, the class first."""
    over = set(parameter_dims(skeleton))
    found: dict[str, MapLayer] = {}
    names = set(map(str, skeleton.data_vars))
    for name, item in skeleton.data_vars.items():
        if item.dtype.kind not in "biuf" or not over <= set(item.dims):
            continue
        further = [str(each) for each in item.dims if each not in over]
        words, unit = str(item.attrs.get("long_name", name)), str(item.attrs.get("units", "1"))
        limit = str(name).endswith(("_low", "_high")) and str(name).rpartition("_")[0] in names
        if not further:
            found[str(name)] = MapLayer(str(name), {}, words, unit, shown=not limit and str(name) not in _HIDDEN)
        elif len(further) == 1 and further[0] in skeleton.coords and item.sizes[further[0]] <= _ENTRIES:
            for at, entry in enumerate(skeleton[further[0]].values.tolist()):
                label = _entry(further[0], entry)
                found[f"{name}_{label.replace(' ', '_')}"] = MapLayer(
                    str(name), {further[0]: at}, f"{words}: {label}", unit, shown=not limit
                )
    order = list(sb.STATISTICS)

    def place(name: str) -> tuple[bool, int, str]:
        # those of one of several strikers after those of all
        whole = name.partition("_contact_")[0] if name in sb.STATISTICS else name
        return (name != "response_class", order.index(whole) if whole in order else -1, name if whole != name else "")

    return dict(sorted(found.items(), key=lambda each: place(each[0])))


def _entry(dimension: str, value: Any) -> str:
    if dimension == "class_code":
        return sb.ResponseClass(int(value)).label
    return f"{value:g}" if isinstance(value, float) else str(value)


def chances(layers: dict[str, MapLayer], held: dict[str, Any]) -> str:
    """Lifetimes and probabilities of a point in words, each with its interval; empty if there are none."""
    parts = []
    for name, layer in layers.items():
        low, high = (_partner(layers, layer, f"{layer.variable}_{ending}", held) for ending in ("low", "high"))
        if name not in held or low is None or high is None:
            continue
        value = held[name]
        if isinstance(value, float) and np.isnan(value) and np.isnan(low):
            continue
        parts.append(f"{layer.words} {_number(value)} ({_number(low)} to {_number(high)})")
    shares = {name: layer for name, layer in layers.items() if layer.variable == "class_fraction"}
    there = {layer.words.rpartition(": ")[2]: held.get(name, 0.0) for name, layer in shares.items()}
    some = [f"{words} {100.0 * share:.0f} %" for words, share in there.items() if share > 0.0]
    if some:
        parts.append(f"of its replicas: {', '.join(some)}")
    return "; ".join(parts)


def _partner(layers: dict[str, MapLayer], layer: MapLayer, variable: str, held: dict[str, Any]) -> Any:
    for name, each in layers.items():
        if each.variable == variable and each.where == layer.where:
            return held.get(name)
    return None


def _number(value: Any) -> str:
    return "∞" if value == np.inf else f"{value:.3g}" if isinstance(value, float) else str(value)


# ----------------------------------------------------------------------------------------------------


_SMALL = 2**25
"""Size of a map up to which it is read completely with its first point, bytes."""
_Data = TypeVar("_Data", "xr.Dataset", "xr.DataArray")


class Source:
    """A map: its coordinates and attributes, and its variables when they are asked for.

    Attributes
    ----------
    name : str
        What to call it.
    skeleton : xarray.Dataset
        Coordinates, attributes, and variables that need not be loaded.
    version : int
        Grows when the numbers change.
    """

    name = ""
    skeleton: xr.Dataset
    version = 0
    growing = False
    _reading = threading.RLock()
    """Held while a file is read."""

    @property
    def attrs(self) -> dict[str, Any]:
        """Attributes of the map."""
        return dict(self.skeleton.attrs)

    @property
    def layers(self) -> dict[str, MapLayer]:
        """All that is known of a point, by name."""
        found: dict[str, MapLayer] = self._of_skeleton("layers", layers_of)
        return found

    def _of_skeleton(self, what: str, make: Callable[[xr.Dataset], Any]) -> Any:
        """Something that follows from the skeleton, kept until that is another one."""
        kept: dict[str, tuple[Any, Any]] = self.__dict__.setdefault("_kept", {})
        if what not in kept or kept[what][0] is not self.skeleton:
            kept[what] = (self.skeleton, make(self.skeleton))
        return kept[what][1]

    @property
    def dims(self) -> list[str]:
        """Possible axes: dimensions of more than one point; for a list of points, parameters that differ.

        A map needs two: of one axis, or of one point, what else is known of it stands along the other, as a strip.
        """
        found: list[str] = self._of_skeleton("dims", _axes_of)
        return found

    @property
    def is_list(self) -> bool:
        """True if the source is a list of points, not a grid."""
        return POINT in parameter_dims(self.skeleton)

    def coordinate(self, name: str) -> NDArray[Any]:
        """The points of an axis."""
        return np.atleast_1d(np.asarray(self.skeleton[name].values))

    def scalars(self) -> dict[str, Any]:
        """Dimensions of one point, and coordinates that hold throughout, by name."""
        return {str(name): item.values.item() for name, item in self.skeleton.coords.items() if item.size == 1}

    def variables(self) -> list[str]:
        """Variables that can be shown, the response class first."""
        return [name for name, layer in self.layers.items() if layer.shown]

    def label(self, name: str) -> tuple[str, str]:
        """Long name and unit of a variable or an axis."""
        if name in self.layers:
            return self.layers[name].words, self.layers[name].unit
        if name in self.skeleton.variables:
            attrs = self.skeleton[name].attrs
            return str(attrs.get("long_name", name)), str(attrs.get("units", "1"))
        row = sb.STATISTICS.get(name)
        return (name, "1") if row is None else (row.long_name, row.unit)

    def title(self, name: str) -> str:
        """Long name of a variable or an axis, with its unit."""
        words, unit = self.label(name)
        return words if unit == "1" else f"{words} ({unit})"

    def values(self, name: str) -> xr.DataArray | None:
        """A number over the parameters, in memory; None if there are no numbers yet.

        Raises
        ------
        InputError
            If they cannot be read.
        """
        layer = self.layers.get(name)
        return None if layer is None else self.variable(layer.variable).isel(layer.where)

    def variable(self, name: str) -> xr.DataArray:
        """A variable as the dataset has it, read from its file the first time."""
        return self._read(self.skeleton[name])

    def _read(self, part: _Data) -> _Data:
        try:
            with self._reading:
                return part.load()
        except (OSError, ValueError, RuntimeError) as error:
            raise sb.InputError(f"{self.name}: cannot be read ({error})") from error

    def point(self, where: Mapping[str, int]) -> dict[str, Any]:
        """All that the map holds of one point, by name; of a large file only that is read."""
        if self.skeleton.nbytes <= _SMALL:
            self._read(self.skeleton)
        inside = {name: at for name, at in where.items() if name in self.skeleton.dims}
        names = dict.fromkeys(layer.variable for layer in self.layers.values())
        part = self._read(self.skeleton[list(names)].isel(inside))
        return {
            name: (part[layer.variable].isel(layer.where) if layer.where else part[layer.variable]).values.item()
            for name, layer in self.layers.items()
        }

    def whole(self) -> xr.Dataset:
        """All of the map, in memory."""
        return self._read(self.skeleton)

    def refresh(self) -> bool:
        """Look whether there is more; True if there is."""
        return False


class DatasetSource(Source):
    """A map in memory."""

    def __init__(self, dataset: xr.Dataset, name: str = "map") -> None:
        if not is_map(dataset):
            raise sb.InputError(f"{name}: must be a map over two parameters")
        self.skeleton = dataset
        self.name = name


def is_map(dataset: xr.Dataset) -> bool:
    """Return whether a dataset has numbers over two parameters, and no figure of its own that shows more."""
    try:
        kind = figures_of(dataset)[0]
    except sb.InputError:
        kind = "map"
    return kind in _MAPS and bool(layers_of(dataset)) and len(_axes_of(dataset)) > 1


_MAPS = ("map", "probability map", "lifetimes")


class ResultSource(Source):
    """A result that is no map: what ``snapbeam plot`` draws of it, and its run if it is one."""

    def __init__(self, dataset: xr.Dataset, name: str = "result", run: sb.Run | None = None) -> None:
        try:
            self.kind, self.figures = figures_of(dataset)
        except sb.InputError as error:
            raise sb.InputError(f"{name}: {str(error).partition(': ')[2]}") from None
        if not self.figures or self.kind in _MAPS[:1]:
            raise sb.InputError(f"{name}: a {self.kind} needs two parameters in its axes or coordinates")
        self.skeleton, self.name, self.run = dataset, name, run


class SystemSource(Source):
    """Axes over a system, without numbers."""

    def __init__(self, system: sb.System, axes: Mapping[str, Any], integration: sb.Integration, name: str) -> None:
        self.skeleton = axes_dataset(system, axes, integration)
        self.name = name
        self.strikers = len(system.contacts)

    def variables(self) -> list[str]:
        """All that a sweep gives."""
        names = [name for name in sb.STATISTICS if name != "status"]
        if self.strikers == 1:
            return names
        each = [f"{name}_contact_{number}" for number in range(1, self.strikers + 1) for name in names]
        return names + [name for name in each if name in sb.STATISTICS]


def _axes_of(skeleton: xr.Dataset) -> list[str]:
    dims = parameter_dims(skeleton)
    if POINT in dims:
        over = [str(name) for name, item in skeleton.coords.items() if item.dims == (POINT,)]
        known = [
            name for name in over if parameter_name(skeleton, name) is not None and skeleton[name].dtype.kind in "iuf"
        ]
        found = [name for name in known if np.unique(skeleton[name].values).size > 1]
        spare = [name for name in known if name not in found]
    else:
        found = [name for name in dims if skeleton.sizes[name] > 1]
        spare = [name for name in dims if name not in found]
    spare += [
        str(name)
        for name, item in skeleton.coords.items()
        if item.ndim == 0 and parameter_name(skeleton, str(name)) is not None and item.dtype.kind in "iuf"
    ]
    return [*found, *spare[: max(2 - len(found), 0)]]


def default_axes(system: sb.System) -> dict[str, Any]:
    """Two axes over a system: frequency and amplitude of its excitation, else the first parameters that it has."""
    from snapbeam.model.parameter_axes import parse_axis
    from snapbeam.model.parameter_file import DEFAULT_AXES

    if DEFAULT_AXES.keys() <= system.parameters.keys():
        return {name: parse_axis(name, text) for name, text in DEFAULT_AXES.items()}
    held = system.parameters
    order = ("frequency_ratio", "amplitude", "rms", "stop_ratio", "high_ratio", "peak", "change")
    rows = [row for row in rows_of(system) if row.name in held and row.is_run and row.quantity.kind is float]
    rows = [row for row in rows if "phase" not in row.name]
    rows.sort(key=lambda row: next((at for at, word in enumerate(order) if word in row.name), len(order)))
    axes: dict[str, Any] = {}
    for row in rows:
        value = float(held[row.name]) or 1.0
        for least, most in ((0.1, 3.0), (0.5, 1.5)):  # of a band, less than its other edge
            low, high = sorted((least * value, min(most * value, row.quantity.high)))
            with suppress(sb.InputError):
                for end in (low, high):
                    system.replace(**{row.name: end})
                axes[row.name] = np.linspace(low, high, 40)
                break
        if len(axes) == 2:
            return axes
    raise sb.InputError("system: has no two parameters of a run, such as an excitation, for the axes of a map")


def rows_of(system: sb.System) -> list[Parameter]:
    """The table of parameters, and after it the parameters that a system has of a sum of forces or motions."""
    further = (row_of(name) for name in system.parameters if name not in parameters())
    return [*parameters().values(), *(row for row in further if row is not None)]


def axes_dataset(system: sb.System, axes: Mapping[str, Any], integration: sb.Integration) -> xr.Dataset:
    """Coordinates and attributes of a sweep that is not computed."""
    from snapbeam.sweeps.setup import sweep_setup
    from snapbeam.util.datasets import xr

    setup = sweep_setup(system, axes, integration.replace(tolerance=None))
    whole = {"system": plain(system.to_mapping()), "integration": integration_mapping(integration)}
    attrs = setup.attributes() | {name: json.dumps(values) for name, values in whole.items()}
    return xr.Dataset(coords=setup.coordinates(), attrs=attrs)


def integration_mapping(integration: sb.Integration) -> dict[str, Any]:
    """An integration as plain values, without what does not change a number."""
    return {name: value for name, value in asdict(integration).items() if name != "threads"}


def plain(value: Any) -> Any:
    """Plain values of sections, without what follows from others."""
    if isinstance(value, Mapping):
        return {key: plain(item) for key, item in value.items() if item is not None}
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    return value


def opened(what: Any, *, system: sb.System | None = None, integration: sb.Integration | None = None) -> Source:
    """The source that was named.

    Parameters
    ----------
    what : path, xarray.Dataset, Run, System or None
        A NetCDF file or a checkpoint; a result; a system; nothing, for the paper's beam or *system*.
    system, integration : optional
        What a map is computed of, where there is none.

    Raises
    ------
    InputError
        If it cannot be read, or is no result that has a view.
    """
    from snapbeam.util.datasets import xr

    if what is None or isinstance(what, sb.System):
        from snapbeam.model.parameter_file import Config

        chosen = what or system or Config().system
        axes = default_axes(chosen)
        name = "the paper's beam" if what is None and system is None else "a system"
        return SystemSource(chosen, axes, integration or sb.Integration(), name)
    if isinstance(what, sb.Run):
        return ResultSource(what.dataset, "run", what)
    if isinstance(what, xr.Dataset):
        return DatasetSource(what) if is_map(what) else ResultSource(what)
    if isinstance(what, (str, Path)):
        path = Path(what)
        try:
            folder = path.is_dir()
        except (OSError, ValueError) as error:  # a name that no file can have
            raise sb.InputError(f"file: is no path ({error})") from None
        if folder:
            return CheckpointSource(path)
        if not split_group(path)[0].exists():
            raise sb.InputError(f"map = {str(path)!r}: there is no such file or checkpoint")
        dataset = read_result(path, "map", lazily=True)
        if is_map(dataset):
            return DatasetSource(dataset, path.name)
        run = sb.load(path) if "snapbeam_system" in dataset.attrs else None
        return ResultSource(dataset.load() if run is None else run.dataset, path.name, run)
    raise sb.InputTypeError(
        f"map is a {type(what).__name__}: must be a result, a file, a checkpoint, a System, or None"
    )


# ----------------------------------------------------------------------------------------------------
# One point of a map: the system and the integration that it was computed with, to the last bit.


@dataclass(frozen=True, eq=False)
class Point:
    """Requested point.

    Attributes
    ----------
    values : dict
        Exact values by dotted name, of what the map sweeps.
    expected : dict
        What the map holds of it, by name of the statistic; empty if nothing.
    """

    values: dict[str, Any]
    expected: dict[str, Any] = field(default_factory=dict)

    def system(self, base: sb.System, integration: sb.Integration) -> tuple[sb.System, sb.Integration]:
        """System and solver settings of the run at this point."""
        of_run = {split_name(name)[1]: value for name, value in self.values.items() if name.startswith("integration.")}
        of_system = {name: value for name, value in self.values.items() if not name.startswith("integration.")}
        physical = {name: of_system.pop(name) for name in list(of_system) if name in PHYSICAL}
        system = base.replace(**of_system)
        if physical:
            system = system.replace(**ratios_of(system, physical))
        return system, integration.replace(**of_run) if of_run else integration

    def words(self, other: Point | None = None) -> str:
        """The point for a person, in few digits, but all that tell it from an *other* one."""
        return ", ".join(
            f"{lookup(name).short.replace('_', ' ')} {brief(value, other and other.values.get(name))}"
            for name, value in self.values.items()
        )


def short_names(parameters: Iterable[str]) -> dict[str, str]:
    """Words for some parameters by their dotted names: without the section, if no other one has the same."""
    last = {name: name.rpartition(".")[2] for name in parameters}
    alone = [word for word in last.values() if list(last.values()).count(word) == 1]
    return {name: (word if word in alone else lookup(name).short).replace("_", " ") for name, word in last.items()}


def brief(value: Any, other: Any = None) -> str:
    """A value in six digits, or in as many as tell it from an *other* one."""
    if not isinstance(value, float):
        return str(value)
    apart = isinstance(other, float) and other != value
    digits = next((n for n in range(6, 17) if not apart or f"{value:.{n}g}" != f"{other:.{n}g}"), 17)
    return f"{value:.{digits}g}"


def system_of(attrs: Mapping[str, Any], name: str) -> sb.System:
    """System stored in a map."""
    text = attrs.get("system")
    if not isinstance(text, str):
        raise sb.InputError(f"{name}: does not hold the system that it was computed of")
    sections = parsed_json(text, name)
    if any(isinstance(value, dict) for values in sections.values() for value in values.values()):
        raise sb.InputError(f"{name}: was driven by a record, which is too long to be kept in it")
    arrays = {
        section: {key: np.array(value) if isinstance(value, list) else value for key, value in values.items()}
        for section, values in sections.items()
    }
    return sb.System.from_mapping(arrays)


def integration_of(attrs: Mapping[str, Any]) -> sb.Integration:
    """Solver settings stored in a map; the engine is left out, because single runs use the CPU."""
    found = parsed_json(attrs.get("integration", "{}"), "integration")
    known = {item: value for item, value in found.items() if value is not None and item != "engine"}
    return sb.Integration(**known)


def parameter_of(skeleton: xr.Dataset, name: str) -> str:
    """The dotted name of an axis."""
    attrs = skeleton[name].attrs if name in skeleton.coords else {}
    return lookup(str(attrs.get("parameter", name))).name


NOT_COMPUTED = "the map has no result here yet"
"""Text of a cell that is not computed, as in an unfinished checkpoint."""


def compared(expected: Mapping[str, Any], outcome: sb.RunSummary, engine: str) -> tuple[bool, str]:
    """Return whether a run is bitwise equal to the values of a map, and a message."""
    expected = {name: value for name, value in expected.items() if name in outcome}
    if not expected:
        return True, ""
    if expected.get("status") == sb.RunStatus.NOT_RUN:
        return True, NOT_COMPUTED
    differing = []
    for name, value in expected.items():
        found = outcome[name]
        found = int(found) if name in ("response_class", "status") else found
        same = found == value or (_is_nan(found) and _is_nan(value))
        if not same and name not in ("steps",):
            differing.append(name)
    if not differing:
        return True, f"bitwise identical to the map ({len(expected)} results)"
    if "response_class" in differing:
        return False, "another class than the map's" + _why(expected, engine)
    return True, f"the map's class; differs in {', '.join(differing[:4])}" + _why(expected, engine)


def _why(expected: Mapping[str, Any], engine: str) -> str:
    if expected.get("status") == sb.RunStatus.FILLED:
        return ": the map inferred it from its neighbours"
    if engine == "python":
        return ": the map was computed by another engine"
    return ": the map was computed by another version, on another processor, or of a system that has changed"


def _is_nan(value: Any) -> bool:
    return isinstance(value, float) and math.isnan(value)


# ----------------------------------------------------------------------------------------------------
# Cells of a map as the pixels of a picture, for the part that is seen.


_Array = NDArray[np.float64]
_MOST = 1_000_000
"""Cells that are sent as they are."""
_EVEN = 1e-6


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
        edges = edges_of(skeleton, name) if at.size > 1 else at[0] + np.array([-0.5, 0.5]) * max(abs(at[0]), 1.0)
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
        """Axis label: name of a parameter as the fields have it, otherwise the long name; symbol and unit."""
        text, unit = source.label(name)
        text, symbol = text.replace("omega_1", "ω₁").replace("^2", "²"), ""
        if "parameter" in source.skeleton[name].attrs or name in ("frequency_ratio", "velocity_amplitude", "location"):
            full = parameter_of(source.skeleton, name)
            text = short_names(parameter_of(source.skeleton, each) for each in source.dims)[full]
            symbol = plain_formulas(f"${lookup(full).quantity.symbol}$")
        return " ".join(part for part in (text, symbol, "" if unit == "1" else f"({unit})") if part)

    @property
    def span(self) -> tuple[float, float]:
        """Outermost borders."""
        return float(self.edges[0]), float(self.edges[-1])

    def nearest(self, value: float) -> int:
        """The number of the point in whose cell a place lies; the nearest one outside."""
        return int(np.clip(np.searchsorted(self.edges, value, side="right") - 1, 0, self.at.size - 1))

    @property
    def even(self) -> bool:
        """True if the cells are equally wide on the screen."""
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
    where = _spread(low, high, pixels, axis.log)
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


# ----------------------------------------------------------------------------------------------------
# The two axes that are shown, and where the others stand: from places on the screen to points of the map.


@dataclass(frozen=True, eq=False)
class _Cut:
    """A source along two axes, across and upward; ``fixed`` is the point of each other axis.

    Of a list, ``at`` of an axis are the places of the points, in the order of the list.
    """

    source: Source
    x: Axis
    y: Axis
    fixed: dict[str, int]

    @property
    def names(self) -> tuple[str, str]:
        """Dotted names of the two axes."""
        return parameter_of(self.source.skeleton, self.x.name), parameter_of(self.source.skeleton, self.y.name)

    @staticmethod
    def check(source: Source, x: str, y: str) -> None:
        """Refuse (InputError) names that are no two axes of a source."""
        for name in (x, y):
            if name not in source.dims:
                raise sb.InputError(f"{name}: is no axis of this map, whose axes are {', '.join(source.dims)}")
        if x == y:
            raise sb.InputError(f"{x}: stands along both axes")


@dataclass(frozen=True, eq=False)
class Plane(_Cut):
    """A cut through a map."""

    @classmethod
    def of(cls, source: Source, x: str, y: str, fixed: dict[str, int]) -> Plane:
        """The cut through a map along two axes.

        Raises
        ------
        InputError
            If it has no such axes.
        """
        cls.check(source, x, y)
        others = {name: fixed.get(name, 0) for name in source.dims if name not in (x, y)}
        return cls(source, Axis.of(source, x), Axis.of(source, y), others)

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
        source, skeleton = self.source, self.source.skeleton
        found = {parameter_of(skeleton, name): plain(source.coordinate(name)[at]) for name, at in self.fixed.items()}
        for name in map(str, skeleton.dims):
            other = skeleton.sizes[name] == 1 and name not in (self.x.name, self.y.name)
            if other and parameter_name(skeleton, name) is not None:
                found[parameter_of(skeleton, name)] = plain(source.coordinate(name)[0])
        return found

    def at(self, row: int, column: int) -> Point:
        """The point of the map in a cell, without what the map holds of it."""
        across, upward = self.names
        values = {across: plain(self.x.points[column]), upward: plain(self.y.points[row])}
        return Point(values | self.fixed_values())

    def indexers(self, row: int, column: int) -> dict[str, int]:
        """Indices of a cell in the arrays of the map."""
        return {self.x.name: column, self.y.name: row, **self.fixed}

    def beside(self, place: tuple[float, float], across: int, upward: int) -> tuple[int, int]:
        """Row and column of the point *across* and *upward* points from that at a place; the last one at an edge."""
        row, column = self.index(*place)
        return (int(np.clip(row + upward, 0, self.y.at.size - 1)), int(np.clip(column + across, 0, self.x.at.size - 1)))

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
        """Plot coordinates of a point; None if the point belongs to another section of the map."""
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
        """True if both axes are continuous parameters."""
        return all(lookup(name).quantity.kind is float for name in self.names)


# ----------------------------------------------------------------------------------------------------
# A list of points over two of its parameters: each point stands where its own values are.


@dataclass(frozen=True, eq=False)
class Scatter(_Cut):
    """A list of points seen along two of its parameters; it has the interface of a cut through a grid."""

    @classmethod
    def of(cls, source: Source, x: str, y: str) -> Scatter:
        """A list of points along two parameters."""
        cls.check(source, x, y)
        size = source.skeleton.sizes[POINT]
        return cls(source, Axis.scattered(source, x, size), Axis.scattered(source, y, size), {})

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
        return np.array([(axis.at - value) / np.ptp(axis.span) for axis, value in ((self.x, x), (self.y, y))])

    def fixed_values(self) -> dict[str, Any]:
        """Fixed values: none for a list of points."""
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
        """Index of a point in the arrays of the map."""
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
        """Plot coordinates of a point; None if its parameters are incomplete."""
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


# ----------------------------------------------------------------------------------------------------
# A checkpoint of a map, also one that is still growing.


class CheckpointSource(DatasetSource):
    """A checkpoint that may still grow; points that are not done are unknown."""

    growing = True

    def __init__(self, path: Path) -> None:
        self._path = path
        self._stamp = self._stamped()
        super().__init__(sb.read_checkpoint(path), path.name)

    def _stamped(self) -> tuple[int, int]:
        try:
            found = (self._path / "tasks.jsonl").stat()
        except OSError:
            return 0, 0
        return found.st_mtime_ns, found.st_size

    def refresh(self) -> bool:
        """Read the checkpoint again if more tasks are done."""
        if not self._path.is_dir():
            raise sb.InputError(f"{self._path.name}: the checkpoint is gone; open another file")
        stamp = self._stamped()
        if stamp == self._stamp:
            return False
        self._stamp = stamp
        self.skeleton = sb.read_checkpoint(self._path)
        self.version += 1
        return True


# ----------------------------------------------------------------------------------------------------
# Parts of a map computed again, from coarse to fine, while the page lives on.


_STRIDES = (27, 9, 3, 1)
"""Cells from one point to the next, level by level; the point of a block is the centre of its middle cell."""
_BATCH_SECONDS = 0.3
_FIRST = 8
"""Points of the first batch, of which the pace is learnt."""
_MOST_WINDOWS = 512


@dataclass(eq=False)
class Window:
    """A part of a plane of parameters, on a regular grid of cells.

    ``x`` and ``y`` are the values at which runs are made, the centres of cells; ``bounds`` left, right, low and high.
    ``stride``, (ny, nx), is the cells of the block whose point stands for the cell, 0 where nothing is known;
    ``values`` the statistics by name.
    """

    system: sb.System
    integration: sb.Integration
    names: tuple[str, str]
    x: NDArray[Any]
    y: NDArray[Any]
    bounds: tuple[float, float, float, float]
    log: tuple[bool, bool] = (False, False)
    key: Any = None
    values: dict[str, NDArray[Any]] = field(default_factory=dict)
    stride: NDArray[np.int8] = field(init=False)
    known: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None
    """Width and height of the cells of other data at each cell, in cells of this window; None if there are none."""
    done: int = 0
    seconds: float = 0.0
    """Seconds that one point takes."""
    waits: bool = False
    """True if the next level was not begun, because it would take too long."""
    version: int = 0
    finished: bool = False
    lock: threading.Lock = field(default_factory=threading.Lock, repr=False)
    """Held by who computes it."""
    writing: threading.Lock = field(default_factory=threading.Lock, repr=False)
    """Held while values and strides do not agree."""

    def __post_init__(self) -> None:
        self.stride = np.zeros((self.y.size, self.x.size), dtype=np.int8)

    @property
    def size(self) -> int:
        """Cells."""
        return int(self.x.size * self.y.size)

    @property
    def edges(self) -> tuple[_Array, _Array]:
        """Scaled borders of the cells across and upward."""
        (left, right), (low, high) = (_scaled(self.bounds[:2], self.log[0]), _scaled(self.bounds[2:], self.log[1]))
        return np.linspace(left, right, self.x.size + 1), np.linspace(low, high, self.y.size + 1)

    @property
    def wanted(self) -> int:
        """Cells that are finer than other data at the same location."""
        return int(self.refines(1).sum())

    def refines(self, stride: int | NDArray[np.int8]) -> NDArray[np.bool_]:
        """Mask of the cells in which blocks of *stride* cells are finer than other data; shape (ny, nx)."""
        sides = np.broadcast_to(stride, self.stride.shape).astype(np.float64)
        if self.known is None:
            return np.ones(self.stride.shape, dtype=bool)
        return _finer((sides, sides), self.known)

    def cell(self, x: float, y: float) -> tuple[int, int]:
        """Row and column of the cell at a place."""
        row, column = (
            int(np.clip(np.searchsorted(edges, _scaled(value, log), side="right") - 1, 0, edges.size - 2))
            for edges, value, log in zip(self.edges[::-1], (y, x), self.log[::-1], strict=True)
        )
        return row, column

    def computed_at(self, x: float, y: float, stride_of: NDArray[np.int8] | None = None) -> tuple[int, int] | None:
        """Row and column of the point that stands for a place; None if there is none.

        *stride_of* is what ``stride`` was when the window was drawn: cells that have been computed since are not yet
        seen by who clicks on them.
        """
        row, column = self.cell(x, y)
        stride = int((self.stride if stride_of is None else stride_of)[row, column])
        if stride == 0:
            return None
        return _middle(row, stride), _middle(column, stride)

    def own(self) -> NDArray[np.bool_]:
        """Which cells hold a run of their own, not that of the block they lie in; shape (ny, nx)."""
        rows, columns = np.indices(self.stride.shape)
        stride = np.maximum(self.stride.astype(np.int64), 1)
        return (self.stride > 0) & (_middle(rows, stride) == rows) & (_middle(columns, stride) == columns)

    def covers(self, x: float, y: float) -> bool:
        """Return whether a point is inside the window."""
        left, right, low, high = self.bounds
        return left <= x <= right and low <= y <= high


_GAIN = 0.7
"""Area of a cell, as a share of the area of the data below, up to which it is worth computing and showing."""


def _finer(sides: tuple[_Array, _Array], below: tuple[_Array, _Array]) -> NDArray[np.bool_]:
    """Mask of the cells that are neither wider nor taller than those below, and clearly smaller."""
    (wide, tall), slack = sides, 1.0 + 1e-9
    inside = (wide <= slack * below[0]) & (tall <= slack * below[1])
    return np.asarray(inside & (wide * tall < _GAIN * below[0] * below[1]))


def _scaled(values: Any, log: bool) -> _Array:
    return np.log(values) if log else np.asarray(values, dtype=np.float64)


def known_cells(
    window: Window, plane: Plane | None, others: list[tuple[Window, NDArray[np.int8]]]
) -> tuple[_Array, _Array]:
    """Width and height of the cells of a map and of other windows at each cell of a window, in its cells.

    They are infinite where nothing is known.  *plane* is the cut through the map, None if it has no numbers, or those
    of another system; *others* are windows and the strides of their blocks, in the order in which they are drawn.
    """
    centers = [_scaled(each, log) for each, log in zip((window.x, window.y), window.log, strict=True)]
    units = [np.ptp(edges) / (edges.size - 1) for edges in window.edges]
    below = (np.full(window.stride.shape, np.inf), np.full(window.stride.shape, np.inf))
    grids = [(other.edges, stride.astype(np.float64)) for other, stride in others]
    if plane is not None:
        ones = np.ones((plane.y.edges.size - 1, plane.x.edges.size - 1))
        grids.insert(0, (_edges_of(plane, window.log), ones))
    for edges, stride in grids:
        (columns, across), (rows, upward) = map(_inside, edges, centers)
        widths = [np.diff(each) / unit for each, unit in zip(edges, units, strict=True)]
        part, found = np.ix_(rows, columns), stride[np.ix_(upward, across)]
        sides = (found * widths[0][across], found * widths[1][upward, None])
        better = (found > 0) & _finer(sides, (below[0][part], below[1][part]))
        for held, side in zip(below, sides, strict=True):
            held[part] = np.where(better, side, held[part])
    return below


def _edges_of(plane: Plane, log: tuple[bool, bool]) -> tuple[_Array, _Array]:
    """Scaled borders of the cells of a map across and upward."""
    return _scaled(plane.x.edges, log[0]), _scaled(plane.y.edges, log[1])


def _inside(edges: _Array, places: _Array) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Indices of the places between the first and the last of *edges*, and of the cells that contain them."""
    at = np.searchsorted(edges, places, side="right") - 1
    inside = np.flatnonzero((at >= 0) & (at < edges.size - 1))
    return inside, at[inside]


def visible_strides(windows: list[Window], plane: Plane | None) -> list[NDArray[np.int8]]:
    """Strides of windows that are drawn one over the other, 0 where a cell would hide finer data below."""
    drawn: list[tuple[Window, NDArray[np.int8]]] = []
    for window in windows:
        with window.writing:
            stride = window.stride.copy()
        sides = np.maximum(stride, 1).astype(np.float64)
        stride[~_finer((sides, sides), known_cells(window, plane, drawn))] = 0
        drawn.append((window, stride))
    return [stride for _, stride in drawn]


def drawn_shares(
    plane: Plane,
    kinds: NDArray[Any] | None,
    drawn: list[tuple[Window, NDArray[np.int8]]],
    view: tuple[float, float, float, float],
    pixels: tuple[int, int],
) -> dict[int, float]:
    """Share that each class has of the area of a view with a map (*kinds*, of shape (y, x), or None) and windows over it."""
    none, log = np.iinfo(np.int16).min, (plane.x.log, plane.y.log)
    own = _edges_of(plane, log)
    borders: list[_Array] = []
    for side in (0, 1):
        first, last = _scaled(view[2 * side : 2 * side + 2], log[side])
        parts = [window.edges[side] for window, _ in drawn]
        edges = np.unique(np.clip(np.concatenate([own[side], *parts, [first, last]]), first, last))
        if edges.size > 2 * pixels[side]:  # more of them than the screen shows
            edges = np.linspace(first, last, pixels[side] + 1)
        borders.append(edges)
    middles = [0.5 * (edges[1:] + edges[:-1]) for edges in borders]
    shown = np.full((middles[1].size, middles[0].size), none, dtype=np.int16)
    if kinds is not None:
        _lay(shown, middles, own, kinds, np.ones(kinds.shape, dtype=np.int8))
    for window, stride in drawn:
        _lay(shown, middles, window.edges, window.values["response_class"], stride)
    area = np.outer(np.diff(borders[1]), np.diff(borders[0]))
    whole = float(area[shown != none].sum())
    return {int(kind): float(area[shown == kind].sum()) / whole for kind in np.unique(shown) if kind != none}


def _lay(
    shown: NDArray[Any], places: list[_Array], edges: tuple[_Array, _Array], values: NDArray[Any], stride: NDArray[Any]
) -> None:
    """Write the values of cells over what is shown at some places across and upward, where their stride is not 0."""
    (across, columns), (upward, rows) = map(_inside, edges, places)
    part, there = np.ix_(upward, across), np.ix_(rows, columns)
    shown[part] = np.where(stride[there] > 0, values[there], shown[part])


# ----------------------------------------------------------------------------------------------------
# The difference of a map from another one, or from what was computed of a changed system.


def apart(
    plane: Plane, name: str, other: Source | None, drawn: list[tuple[Window, NDArray[np.int8]]]
) -> tuple[_Array, str]:
    """A number of a map minus that of the *other* one, or that of the *drawn* windows minus the map's.

    Returns
    -------
    array of shape (y, x)
        Differences at the points of the map, those of the other one in whose cells they lie; NaN where one is unknown.
    str
        Number of the points that differ, and of those that differ by more than the scatter of both: the interval of the
        difference (Newcombe, Stat. Med. 17 (1998) 873) of two estimates with intervals does not hold 0.

    Raises
    ------
    InputError
        If the other map has no such number, or not the cut.
    """
    values, cut = _known_numbers(plane, name), None if other is None else _same_cut(plane, other)
    places = [plane.x.at, plane.y.at]

    def of_other(wanted: str) -> _Array:
        found = np.full(values.shape, np.nan)
        if cut is not None:
            held = _known_numbers(cut, wanted)
            _lay(found, places, (cut.x.edges, cut.y.edges), held, np.ones(held.shape))
        log = (plane.x.log, plane.y.log)
        for window, stride in drawn if cut is None else []:
            scaled = [_scaled(each, along) for each, along in zip(places, log, strict=True)]
            _lay(found, scaled, window.edges, window.values[wanted], stride)
        return found

    beside = of_other(name)
    found = beside - values if cut is None else values - beside
    known = np.isfinite(found)
    words = f"{int((found[known] != 0.0).sum())} of {int(known.sum())} points differ"
    ends = [_limits(each, name) for each in (plane, cut) if each is not None]
    if len(ends) == 2 and cut is not None and all(ends):
        (low, high), (low_there, high_there) = (
            [_known_numbers(plane, each) for each in ends[0]], [of_other(each) for each in ends[1]]
        )  # fmt: skip
        least = found - np.hypot(values - low, high_there - beside)
        most = found + np.hypot(high - values, beside - low_there)
        level = 100.0 * float(plane.source.attrs.get("confidence", 0.95))
        words += (
            f", {int(((least > 0.0) | (most < 0.0)).sum())} by more than the scatter of both (intervals of {level:g} %)"
        )
    else:
        words += "; their scatter is not known, the values have no intervals"
    return found, words + (f"; {int((~known).sum())} points are not in both" if not known.all() else "")


def _known_numbers(plane: Plane, name: str) -> _Array:
    """A number on a cut, NaN where it is not computed; also the limits of a share of replicas, ``.low`` and ``.high``."""
    share, _, end = name.partition(".")
    found = plane.values(share)
    if found is None:
        raise sb.InputError(f"{plane.source.name}: has no {share}")
    numbers = found.astype(np.float64)
    if end:
        runs = int(plane.source.attrs["replicates"]) + 1
        numbers = proportion(np.round(numbers * runs), runs)[1 if end == "low" else 2]
    status = plane.values("status")
    unknown = np.zeros(numbers.shape, dtype=bool) if status is None else status == sb.RunStatus.NOT_RUN
    numbers[unknown | ((numbers < 0.0) if name == "response_class" else False)] = np.nan
    return numbers


def _limits(plane: Plane, name: str) -> list[str]:
    """Names of the limits of a number; empty if it has none."""
    layers = plane.source.layers
    if layers[name].variable == "class_fraction" and "replicates" in plane.source.attrs:
        return [f"{name}.low", f"{name}.high"]
    names = {each: each for each in layers}
    found = [_partner(layers, layers[name], f"{layers[name].variable}_{end}", names) for end in ("low", "high")]
    return found if all(found) else []


def _same_cut(plane: Plane, other: Source) -> Plane:
    """The cut through another map at the same values; refused (InputError) if it has not the axes or the values."""
    source, fixed = plane.source, {}
    for name in other.dims:
        if name in (plane.x.name, plane.y.name):
            continue
        points, value = other.coordinate(name), None
        if name in source.skeleton.coords:
            value = source.coordinate(name)[plane.fixed.get(name, 0)]
            same = np.isclose(points, value) if points.dtype.kind in "iuf" else points == value
            fixed[name] = int(np.argmax(same))
        if value is None or not same.any():
            raise sb.InputError(f"{other.name}: has no {name} = {value}, at which this map is seen")
    try:
        cut = Plane.of(other, plane.x.name, plane.y.name, fixed)
    except sb.InputError as error:
        raise sb.InputError(f"{other.name}: {error}") from None
    for axis, there in ((plane.x, cut.x), (plane.y, cut.y)):
        if axis.words != there.words:
            raise sb.InputError(f"{other.name}: has other values of {axis.name}")
    return cut


def _middle(at: Any, stride: Any) -> Any:
    return at // stride * stride + stride // 2


def _spread(low: float, high: float, cells: int, log: bool) -> _Array:
    share = (np.arange(cells) + 0.5) / cells
    if log:
        return np.exp(np.log(low) + share * np.log(high / low))
    return np.linspace(low + share[0] * (high - low), low + share[-1] * (high - low), cells)


def planned(
    system: sb.System,
    integration: sb.Integration,
    names: tuple[str, str],
    bounds: tuple[float, float, float, float],
    log: tuple[bool, bool],
    pixels: tuple[int, int],
    cell: int = 3,
    key: Any = None,
) -> Window:
    """A window whose finest cells are *cell* pixels wide, wider if there would be too many."""
    width = max(cell, 1)
    while (pixels[0] // width + 27) * (pixels[1] // width + 27) > WINDOW_POINTS:
        width += 1
    # whole blocks of the coarsest level, so that the middle of every block is that of a finer one
    nx, ny = (max(round(size / width / _STRIDES[0]), 1) * _STRIDES[0] for size in pixels)
    x, y = _spread(*bounds[:2], nx, log[0]), _spread(*bounds[2:], ny, log[1])
    return Window(system, integration, names, x, y, bounds, log, key)


def _blocks(size: int, stride: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """First cells of the blocks along an axis, and the cells of their points."""
    first = np.arange(0, size, stride)
    return first, first + stride // 2


def compute(
    window: Window, jobs: Jobs, token: Token, tell: Callable[[Window], None], seconds: float = math.inf
) -> Window:
    """Fill a window where it is finer than other data; *tell* is called after every batch.

    It stops before a level that would end later than *seconds* after the beginning; ``window.waits`` is true then.

    Raises
    ------
    Cancelled
        If it is not wanted any more.
    InputError
        For a point that no system has.
    """
    while not window.lock.acquire(timeout=0.1):  # another page has asked for it, and computes it
        token.check()
    try:
        return _filled(window, jobs, token, tell, seconds)
    finally:
        window.lock.release()


def _filled(window: Window, jobs: Jobs, token: Token, tell: Callable[[Window], None], seconds: float) -> Window:
    window.waits = False
    structural = [not lookup(name).is_run for name in window.names]
    paced, spent = (2, 0.0) if window.seconds else (0, 0.0)
    for stride in _STRIDES:
        (row0, rows), (column0, columns) = _blocks(window.y.size, stride), _blocks(window.x.size, stride)
        refines = window.refines(stride)
        todo = [
            (int(a), int(b), int(i), int(j))
            for a, i in zip(row0, rows, strict=True)
            for b, j in zip(column0, columns, strict=True)
            if refines[i, j] and not 0 < int(window.stride[a, b]) <= stride
        ]
        order = _structure_order(todo, structural)
        at = 0
        while at < len(order):
            left = sum(1 for item in order[at:] if not _known(window, item[2], item[3]))
            if paced >= 2 and spent + left * window.seconds > seconds:
                window.waits = True
                window.version += 1
                return window
            batch = _FIRST if paced < 2 else int(np.clip(_BATCH_SECONDS / window.seconds, 1, _MOST_WINDOWS))
            part = order[at : at + batch]
            fresh = [item for item in part if not _known(window, item[2], item[3])]
            found: dict[str, NDArray[Any]] = {}
            if fresh:
                with jobs.turn(token):
                    begun = time.monotonic()
                    found = _run(window, fresh, token)
                took = time.monotonic() - begun
                each = took / len(fresh)
                window.seconds = each if paced < 2 else 0.5 * (window.seconds + each)
                spent += took if paced else 0.0
                paced += 1
            with window.writing:
                for name, values in found.items():
                    held = window.values.setdefault(name, np.zeros(window.stride.shape, dtype=values.dtype))
                    held[[item[2] for item in fresh], [item[3] for item in fresh]] = values
                for a, b, i, j in part:
                    block = (slice(a, a + stride), slice(b, b + stride))
                    for values in window.values.values():
                        values[block] = values[i, j]
                    window.stride[block] = stride
            at += batch
            window.done += len(fresh)
            window.version += 1
            tell(window)
    window.finished = True
    window.version += 1
    return window


def _known(window: Window, row: int, column: int) -> bool:
    """Return whether the run of this cell is already computed as the point of a coarser block."""
    stride = int(window.stride[row, column])
    return bool(stride and _middle(row, stride) == row and _middle(column, stride) == column)


def _structure_order(todo: list[tuple[int, int, int, int]], structural: list[bool]) -> list[tuple[int, int, int, int]]:
    """Points of one structure after the other; without structures, scattered over the window."""
    if structural[0]:
        return sorted(todo, key=lambda item: item[3])
    if structural[1]:
        return sorted(todo, key=lambda item: item[2])
    return [todo[i] for i in sorted(range(len(todo)), key=lambda i: i * 0.6180339887498949 % 1.0)]


def _run(window: Window, points: list[tuple[int, int, int, int]], token: Token) -> dict[str, NDArray[Any]]:
    """Statistics of some cells, by name."""
    from snapbeam.util.datasets import xr

    rows, columns = np.array(points)[:, 2:].T
    table = xr.Dataset({window.names[0]: ("point", window.x[columns]), window.names[1]: ("point", window.y[rows])})
    spare = max(1, (os.cpu_count() or 2) - 1)  # a run that is clicked on needs a core
    found = sb.sweep(window.system, table, window.integration.replace(threads=spare), progress=token.check)
    return {str(name): item.values for name, item in found.data_vars.items() if item.dims == ("point",)}


# ----------------------------------------------------------------------------------------------------
# The command and the lines of Python that make exactly what is shown, to the last digit.


_CONFIG = "system.toml"


def _integration_section(integration: sb.Integration) -> dict[str, Any]:
    default = integration_mapping(sb.Integration())
    return {
        name: value
        for name, value in integration_mapping(integration).items()
        if value is not None and value != default[name] and name != "engine"
    }


def system_toml(system: sb.System, integration: sb.Integration, comment: str = "") -> str:
    """A parameter file of a system, which ``--config`` reads back equal."""
    return config_text(config_from_mapping(sections_of(system, integration)), comment)


def sections_of(system: sb.System, integration: sb.Integration) -> dict[str, dict[str, Any]]:
    """A system and how it is integrated, as a parameter file holds them."""
    found = plain(system.to_mapping()) | {"integration": _integration_section(integration)}
    return {section: values for section, values in found.items() if values}


def system_from(sections: Mapping[str, Any], name: str = "sections") -> tuple[sb.System, sb.Integration]:
    """The system and the integration of a parameter file; refused (InputError) if a page may not ask for them."""
    own = dict(sections)
    start = own.pop("initial_state", None)  # in the units of a system, not in those of a parameter file
    config = config_from_mapping(own, name)
    system, integration = config.system, config.integration
    if start is not None:
        system = sb.System.from_mapping(system.to_mapping() | {"initial_state": start})
    check_run(system, integration)
    return system, integration


def started(sections: Mapping[str, Any], state: Mapping[str, float]) -> sb.System:
    """The system of some sections, started from a *state* of amplitudes and velocities by name."""
    own = {section: values for section, values in sections.items() if section != "initial_state"}
    return config_from_mapping(own | {"initial_state": dict(state)}).system


def difference(before: Mapping[str, Any], after: Mapping[str, Any]) -> dict[str, Any]:
    """Values of *after* that differ, by dotted name; None for a parameter, or a section, that only *before* has."""
    found: dict[str, Any] = {section: None for section in before if section not in after}
    for section, values in after.items():
        old = before.get(section, {})
        names = [name for name in dict.fromkeys([*old, *values]) if old.get(name) != values.get(name)]
        found |= {f"{section}.{name}": values.get(name) for name in names}
    return found


def patched(sections: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Sections with a :func:`difference`: ``patched(before, difference(before, after)) == after``."""
    found = {section: dict(values) for section, values in sections.items()}
    for name, value in changes.items():
        section, key = split_name(name)
        if not key:
            found.pop(section, None)
        elif value is None:
            found.get(section, {}).pop(key, None)
        else:
            found.setdefault(section, {})[key] = value
    return {section: values for section, values in found.items() if values}


def held_values(system: sb.System, integration: sb.Integration) -> dict[str, Any]:
    """Values of the parameters of a system and of its integration, by dotted name."""
    how = integration_mapping(integration) | {"cycles": integration.cycles_or_default}
    return dict(system.parameters) | {f"integration.{name}": value for name, value in how.items()}


def values_of(names: Iterable[str], system: sb.System, integration: sb.Integration) -> dict[str, Any]:
    """The values of some parameters, also in physical units, by dotted name; without those that a system has not."""
    held = held_values(system, integration)
    found = {}
    for name in names:
        value = held.get(PHYSICAL[name].parameter if name in PHYSICAL else name)
        if value is not None:
            found[name] = float(to_physical(system, name, value)) if name in PHYSICAL else value
    return found


def _value(value: Any) -> str:
    return repr(value) if isinstance(value, (int, float)) else str(value)


def run_command(values: Mapping[str, Any], file: str, on_map: bool) -> str:
    """The command that computes a point: of a file's map, or of a parameter file stored next to it."""
    if file and on_map:
        point = ",".join(f"{lookup(name).short}={_value(value)}" for name, value in values.items())
        source = ["--from", file, "--point", point]
    else:
        source = ["--config", _CONFIG]
        for name, value in values.items():
            source += ["--set", f"{name}={_value(value)}"]
    return shlex.join(["snapbeam", "simulate", *source, "-o", "run.nc", "--plot", "run.png"])


def map_command(window: Window, fixed: Mapping[str, Any]) -> str:
    """The command that computes a window, on the cut at *fixed*, of a parameter file stored next to it."""
    parts = ["snapbeam", "map", "--config", _CONFIG]
    for name, value in fixed.items():
        parts += ["--set", f"{name}={_value(value)}"]
    for name, values in zip(window.names, (window.x, window.y), strict=True):
        first, last, count = float(values[0]), float(values[-1]), values.size
        even = np.array_equal(np.linspace(first, last, count), values)
        text = f"{first!r}:{last!r}:{count}" if even else ",".join(map(repr, values.tolist()))
        parts += ["--sweep", f"{name}={text}"]
    return shlex.join([*parts, "-o", "window.nc", "--plot", "window.png"])


def python_lines(system: sb.System, integration: sb.Integration, figure: str = "run") -> str:
    """Self-contained Python code that computes a run of a system and draws a *figure* of it."""
    run = _integration_section(integration)
    arguments = ", ".join(f"{name}={value!r}" for name, value in run.items())
    sections = plain(system.to_mapping())
    if "initial_state" in sections:
        state = sections["initial_state"]
        sections["initial_state"] = {name: np.asarray(value).tolist() for name, value in state.items()}
    text = pprint.pformat(sections, width=100, sort_dicts=False)
    return (
        "import snapbeam as sb\n\n"
        f"system = sb.System.from_mapping({text})\n"
        f"run = sb.simulate(system, sb.Integration({arguments}))\n"
        "print(run.summary)\n"
        'run.save("run.nc")\n'
        f'run.dataset.snapbeam.plot("{figure}").get_figure(root=True).savefig("{figure}.png")\n'
    )
