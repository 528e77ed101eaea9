"""What is explored: a map in memory, a map in a file, or a system of which there is no map yet."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from snapbeam import STATISTICS, InputError, InputTypeError, Integration, System
from snapbeam.explorer.maps.layers import POINT, Layer, layers_of, parameter_dims, parameter_name

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["DatasetSource", "FileSource", "Source", "SystemSource", "opened"]


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

    @property
    def attrs(self) -> dict[str, Any]:
        """What the map says of itself."""
        return dict(self.skeleton.attrs)

    @property
    def layers(self) -> dict[str, Layer]:
        """All that is known of a point, by name."""
        found: dict[str, Layer] = self._of_skeleton("layers", layers_of)
        return found

    def _of_skeleton(self, what: str, make: Callable[[xr.Dataset], Any]) -> Any:
        """Something that follows from the skeleton, kept until that is another one."""
        kept: dict[str, tuple[Any, Any]] = self.__dict__.setdefault("_kept", {})
        if what not in kept or kept[what][0] is not self.skeleton:
            kept[what] = (self.skeleton, make(self.skeleton))
        return kept[what][1]

    @property
    def dims(self) -> list[str]:
        """What may stand along an axis: dimensions of more than one point; of a list what differs among its points.

        A map needs two: of one axis, or of one point, what else is known of it stands along the other, as a strip.
        """
        found: list[str] = self._of_skeleton("dims", _axes_of)
        return found

    @property
    def is_list(self) -> bool:
        """Whether it is a list of points, not a grid."""
        return POINT in parameter_dims(self.skeleton)

    def coordinate(self, name: str) -> NDArray[Any]:
        """The points of an axis."""
        return np.atleast_1d(np.asarray(self.skeleton[name].values))

    def scalars(self) -> dict[str, Any]:
        """Dimensions of one point, and coordinates that hold throughout, by name."""
        found = {
            str(name): item.values.item() for name, item in self.skeleton.coords.items() if item.size == 1
        }
        return found

    def variables(self) -> list[str]:
        """What can be shown, the class first."""
        return [name for name, layer in self.layers.items() if layer.shown]

    def numbers(self) -> list[str]:
        """All that the map holds of a point."""
        return list(self.layers)

    def label(self, name: str) -> tuple[str, str]:
        """What a variable or an axis is, in words, and its unit."""
        if name in self.layers:
            return self.layers[name].words, self.layers[name].unit
        if name in self.skeleton.variables:
            attrs = self.skeleton[name].attrs
            return str(attrs.get("long_name", name)), str(attrs.get("units", "1"))
        row = STATISTICS.get(name)
        return (name, "1") if row is None else (row.long_name, row.unit)

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
        """A variable as the dataset has it, in memory."""
        return self.skeleton[name]

    def point(self, where: Mapping[str, int]) -> dict[str, Any]:
        """All that the map holds of one point, by name."""
        return self._numbers_of(self.skeleton, where)

    def _numbers_of(self, dataset: xr.Dataset, where: Mapping[str, int]) -> dict[str, Any]:
        inside = {name: at for name, at in where.items() if name in dataset.dims}
        names = dict.fromkeys(layer.variable for layer in self.layers.values())
        part = dataset[list(names)].isel(inside).load()
        return {
            name: (
                part[layer.variable].isel(layer.where) if layer.where else part[layer.variable]
            ).values.item()
            for name, layer in self.layers.items()
        }

    def whole(self) -> xr.Dataset:
        """All of the map, in memory."""
        return self.skeleton

    def refresh(self) -> bool:
        """Look whether there is more; True if there is."""
        return False


class DatasetSource(Source):
    """A map in memory."""

    def __init__(self, dataset: xr.Dataset, name: str = "map") -> None:
        if not parameter_dims(dataset) or not layers_of(dataset):
            known = ", ".join(map(str, dataset.data_vars)) or "none"
            raise InputError(f"{name}: is no map; it has no variable over swept parameters among {known}")
        self.skeleton = dataset
        self.name = name


class SystemSource(Source):
    """Axes over a system, without numbers."""

    def __init__(self, system: System, axes: Mapping[str, Any], integration: Integration, name: str) -> None:
        self.skeleton = axes_dataset(system, axes, integration)
        self.name = name
        self.strikers = 1 + len(system.further_contacts)

    def variables(self) -> list[str]:
        """All that a sweep gives."""
        names = [name for name in STATISTICS if name != "status"]
        if self.strikers == 1:
            return names
        each = [f"{name}_striker_{number}" for number in range(1, self.strikers + 1) for name in names]
        return names + [name for name in each if name in STATISTICS]


_SMALL = 2**25
"""Bytes of a map up to which all of it is held, once a point of it has been asked for."""


class FileSource(DatasetSource):
    """A map in a NetCDF file, of which a variable is read when it is first shown."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._lock = threading.Lock()
        self._all: xr.Dataset | None = None
        self._held: dict[str, xr.DataArray] = {}
        with self._open() as dataset:
            self._stamp = self._stamped()
            super().__init__(dataset.drop_vars([]), path.name)
            coords = dataset.coords.to_dataset().load()
            self.skeleton = coords.assign({
                name: (item.dims, _unread(item), item.attrs) for name, item in dataset.data_vars.items()
            }).assign_attrs(dataset.attrs)  # fmt: skip

    def _stamped(self) -> tuple[int, int]:
        found = self._path.stat()
        return found.st_mtime_ns, found.st_size

    def _open(self) -> xr.Dataset:
        if not self._path.is_file():
            raise InputError(f"{self._path.name}: there is no such file any more")
        import xarray as xr

        try:
            return xr.open_dataset(self._path, engine="h5netcdf")
        except Exception as error:  # of damaged bytes the libraries make errors of every kind
            raise InputError(f"{self._path.name}: is no NetCDF file of results, or is damaged") from error

    def variable(self, name: str) -> xr.DataArray:
        """A variable, read from the file the first time."""
        with self._lock:
            if name not in self._held:
                with self._open() as dataset:
                    if self._stamped() != self._stamp:
                        raise InputError(f"{self.name}: the file was changed; load the page again")
                    try:
                        self._held[name] = dataset[name].load()
                    except (OSError, ValueError, RuntimeError) as error:
                        raise InputError(f"{self.name}: {name} cannot be read ({error})") from error
            return self._held[name]

    def point(self, where: Mapping[str, int]) -> dict[str, Any]:
        """All that the file holds of one point; of a large file only that is read, each time."""
        if self.skeleton.nbytes <= _SMALL:
            if self._all is None:
                self._all = self.whole()
            elif not self._path.is_file():
                raise InputError(f"{self._path.name}: there is no such file any more")
            elif self._stamped() != self._stamp:
                raise InputError(f"{self.name}: the file was changed; load the page again")
            return self._numbers_of(self._all, where)
        with self._lock, self._open() as dataset:
            if self._stamped() != self._stamp:
                raise InputError(f"{self.name}: the file was changed; load the page again")
            try:
                return self._numbers_of(dataset, where)
            except (OSError, ValueError, RuntimeError) as error:
                raise InputError(f"{self.name}: cannot be read ({error})") from error

    def whole(self) -> xr.Dataset:
        """All of the map, read now."""
        with self._lock, self._open() as dataset:
            if self._stamped() != self._stamp:
                raise InputError(f"{self.name}: the file was changed; load the page again")
            try:
                return dataset.load()
            except (OSError, ValueError, RuntimeError) as error:
                raise InputError(f"{self.name}: cannot be read ({error})") from error


def _axes_of(skeleton: xr.Dataset) -> list[str]:
    dims = parameter_dims(skeleton)
    if POINT in dims:
        over = [str(name) for name, item in skeleton.coords.items() if item.dims == (POINT,)]
        known = [
            name
            for name in over
            if parameter_name(skeleton, name) is not None and skeleton[name].dtype.kind in "iuf"
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


def _unread(item: xr.DataArray) -> NDArray[Any]:
    """Stands for numbers that are not read: of the right shape and kind, and of no size in memory."""
    return np.broadcast_to(np.zeros((), item.dtype), item.shape)


def axes_dataset(system: System, axes: Mapping[str, Any], integration: Integration) -> xr.Dataset:
    """Coordinates and attributes of a sweep that is not computed."""
    import json

    import xarray as xr

    from snapbeam.config import lookup

    coords: dict[str, Any] = {}
    for name, values in axes.items():
        row = lookup(name)
        labels = {"units": row.quantity.unit, "long_name": row.quantity.long_name, "parameter": row.name}
        coords[row.short] = ((row.short,), np.asarray(values), labels)
    for name in ("drive.frequency_ratio", "drive.velocity_amplitude", "striker.location"):
        row = lookup(name)
        if row.short not in coords and name in system.parameters:
            labels = {"units": row.quantity.unit, "long_name": row.quantity.long_name, "parameter": row.name}
            coords[row.short] = ((), system.parameters[name], labels)
    attrs = {
        "modes": system.model.modes,
        "cycles": integration.cycles_or_default,
        "reference_frequency": system.model.reference_frequency,
        "system": json.dumps(_plain(system.to_mapping())),
        "integration": json.dumps(integration_mapping(integration)),
        "snapbeam_version": "",
    }
    return xr.Dataset(coords=coords, attrs=attrs)


def integration_mapping(integration: Integration) -> dict[str, Any]:
    """An integration as plain values, without what does not change a number."""
    import dataclasses

    found = dataclasses.asdict(integration)
    return {name: value for name, value in found.items() if name != "threads"}


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items() if item is not None}
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    return value


def opened(what: Any, *, system: System | None = None, integration: Integration | None = None) -> Source:
    """The source that was named.

    Parameters
    ----------
    what : path, xarray.Dataset, System or None
        A NetCDF file or a store; a map; a system; nothing, for the paper's beam or *system*.
    system, integration : optional
        What a map is computed of, where there is none.

    Raises
    ------
    InputError
        If it cannot be read, or is no map.
    """
    import xarray as xr

    if what is None or isinstance(what, System):
        from snapbeam.config import DEFAULT_AXES, Config, parse_axis

        chosen = what or system or Config().system
        axes = {name: parse_axis(name, text) for name, text in DEFAULT_AXES.items()}
        name = "the paper's beam" if what is None and system is None else "a system"
        return SystemSource(chosen, axes, integration or Integration(), name)
    if isinstance(what, xr.Dataset):
        return DatasetSource(what)
    if isinstance(what, (str, Path)):
        path = Path(what)
        try:
            folder = path.is_dir()
        except (OSError, ValueError) as error:  # a name that no file can have
            raise InputError(f"file: is no path ({error})") from None
        if folder:
            from snapbeam.explorer.maps.store import StoreSource

            return StoreSource(path)
        if not path.exists():
            raise InputError(f"map = {str(path)!r}: there is no such file or store")
        return FileSource(path)
    raise InputTypeError(
        f"map is a {type(what).__name__}: must be a map, a file, a store, a System, or nothing"
    )
