"""What is explored: a map in memory, a map in a file, or a system of which there is no map yet."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from snapbeam import STATISTICS, InputError, InputTypeError, Integration, System

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["DatasetSource", "FileSource", "Source", "SystemSource", "opened"]

_HIDDEN = ("status",)


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
    def dims(self) -> list[str]:
        """Dimensions of more than one point."""
        return [str(name) for name, size in self._response_sizes().items() if size > 1]

    @property
    def is_list(self) -> bool:
        """Whether it is a list of points, not a grid."""
        return "point" in self._response_sizes()

    def _response_sizes(self) -> Mapping[Any, int]:
        found = self.skeleton
        return found["response"].sizes if "response" in found else found.sizes

    def coordinate(self, name: str) -> NDArray[Any]:
        """The points of an axis."""
        return np.asarray(self.skeleton[name].values)

    def scalars(self) -> dict[str, Any]:
        """Dimensions of one point, and coordinates that hold throughout, by name."""
        found = {
            str(name): item.values.item() for name, item in self.skeleton.coords.items() if item.size == 1
        }
        return found

    def variables(self) -> list[str]:
        """What can be shown, the class first."""
        over = set(self._response_sizes())
        names = [
            str(name)
            for name, item in self.skeleton.data_vars.items()
            if set(item.dims) == over and item.dtype.kind in "biuf" and name not in _HIDDEN
        ]
        return sorted(
            names,
            key=lambda name: (name != "response", list(STATISTICS).index(name) if name in STATISTICS else 99),
        )

    def numbers(self) -> list[str]:
        """All that the map holds of a point."""
        return [*self.variables(), *(name for name in _HIDDEN if name in self.skeleton)]

    def label(self, name: str) -> tuple[str, str]:
        """What a variable or an axis is, in words, and its unit."""
        if name in self.skeleton.variables:
            attrs = self.skeleton[name].attrs
            return str(attrs.get("long_name", name)), str(attrs.get("units", "1"))
        row = STATISTICS.get(name)
        return (name, "1") if row is None else (row.words, row.unit)

    def values(self, name: str) -> xr.DataArray | None:
        """A variable, in memory; None if there are no numbers yet.

        Raises
        ------
        InputError
            If they cannot be read.
        """
        return self.skeleton[name] if name in self.skeleton else None

    def point(self, where: Mapping[str, int]) -> dict[str, Any]:
        """All that the map holds of one point, by name of the statistic."""
        found = {}
        for name in self.numbers():
            values = self.values(name)
            if values is not None:
                found[name] = values.isel(where).values.item()
        return found

    def refresh(self) -> bool:
        """Look whether there is more; True if there is."""
        return False


class DatasetSource(Source):
    """A map in memory."""

    def __init__(self, dataset: xr.Dataset, name: str = "map") -> None:
        if "response" not in dataset:
            known = ", ".join(map(str, dataset.data_vars)) or "none"
            raise InputError(f"{name}: is no map; it has no variable 'response' among {known}")
        self.skeleton = dataset
        self.name = name


class SystemSource(Source):
    """Axes over a system, without numbers."""

    def __init__(self, system: System, axes: Mapping[str, Any], integration: Integration, name: str) -> None:
        self.skeleton = axes_dataset(system, axes, integration)
        self.name = name

    def variables(self) -> list[str]:
        """All that a sweep gives."""
        return [name for name in STATISTICS if name not in _HIDDEN]


class FileSource(DatasetSource):
    """A map in a NetCDF file, of which a variable is read when it is first shown."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._lock = threading.Lock()
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

    def values(self, name: str) -> xr.DataArray | None:
        """A variable, read from the file the first time."""
        if name not in self.skeleton:
            return None
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
        """All that the file holds of one point; only that is read."""
        with self._lock, self._open() as dataset:
            if self._stamped() != self._stamp:
                raise InputError(f"{self.name}: the file was changed; load the page again")
            try:
                part = dataset[self.numbers()].isel(where).load()
            except (OSError, ValueError, RuntimeError) as error:
                raise InputError(f"{self.name}: cannot be read ({error})") from error
            return {str(name): item.values.item() for name, item in part.data_vars.items()}


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
        labels = {"units": row.quantity.unit, "long_name": row.quantity.words, "parameter": row.name}
        coords[row.short] = ((row.short,), np.asarray(values), labels)
    for name in ("drive.frequency_ratio", "drive.velocity_amplitude", "striker.location"):
        row = lookup(name)
        if row.short not in coords and name in system.parameters:
            labels = {"units": row.quantity.unit, "long_name": row.quantity.words, "parameter": row.name}
            coords[row.short] = ((), system.parameters[name], labels)
    attrs = {
        "modes": system.model.modes,
        "cycles": integration.cycles_or_default,
        "reference_freq": system.model.reference_freq,
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
        if path.is_dir():
            from snapbeam.explorer.maps.store import StoreSource

            return StoreSource(path)
        if not path.exists():
            raise InputError(f"map = {str(path)!r}: there is no such file or store")
        return FileSource(path)
    raise InputTypeError(f"map = {what!r}: must be a map, a file, a store, a System, or nothing")
