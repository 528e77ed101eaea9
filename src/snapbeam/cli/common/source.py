"""The parameters that a result was computed from, read back from its file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import xarray as xr

    from snapbeam.config import Config

__all__ = ["config_of_file", "point_text"]


def config_of_file(path: Path, point: str | None) -> Config:
    """The parameters of a file, at one point of it if it is a map.

    Parameters
    ----------
    path : path
        NetCDF file of a map, a threshold or a run.
    point : str, optional
        ``name=value,name=value``: the point nearest to these coordinates, its values exact.
    """
    from snapbeam.cli.common.results import open_result
    from snapbeam.config import config_from_mapping
    from snapbeam.core.validate import InputError, parsed_json

    dataset = open_result(path)
    text = dataset.attrs.get("system")
    if not isinstance(text, str):
        raise InputError(f"from = {str(path)!r}: does not hold the parameters it was computed from")
    sections: dict[str, dict[str, Any]] = parsed_json(text, f"from = {str(path)!r}")
    if any(isinstance(value, dict) for values in sections.values() for value in values.values()):
        raise InputError(f"from = {str(path)!r}: was driven by a record, which is too long to be kept in it")
    if "mass" in sections.get("model", {}):
        raise InputError(f"from = {str(path)!r}: is of a structure given by matrices; use it from Python")
    run = {
        name: value
        for name, value in parsed_json(
            dataset.attrs.get("integration", "{}"), f"from = {str(path)!r}"
        ).items()
        if value is not None and name != "engine"
    }
    start = sections.pop("start", None)
    if start is not None:
        raise InputError(f"from = {str(path)!r}: begins in a state of its own; use it from Python")
    sections["run"] = run
    for name, value in _at_point(dataset, point, path).items():
        section, _, field = name.partition(".")
        sections.setdefault(section, {})[field] = value
    return config_from_mapping(sections, path.name)


def _at_point(dataset: xr.Dataset, point: str | None, path: Path) -> dict[str, Any]:
    """Values of the parameters at the nearest point, by dotted name."""
    from snapbeam.config import lookup
    from snapbeam.core.validate import InputError

    axes = {name: dataset[name] for name in map(str, dataset.dims) if "parameter" in dataset[name].attrs}
    if point is None:
        return {}
    found: dict[str, Any] = {}
    for part in point.split(","):
        name, equals, value = part.partition("=")
        short = lookup(name.strip()).short
        if not equals or short not in axes:
            raise InputError(f"point = {point!r}: must name axes of {path.name}: {', '.join(axes)}")
        values = axes[short].values
        if values.dtype.kind in "OU":
            chosen: Any = value.strip()
        else:
            try:
                chosen = values[int(np.argmin(np.abs(values - float(value))))].item()
            except ValueError:
                raise InputError(f"point = {point!r}: {value!r} is not a number") from None
        found[str(axes[short].attrs["parameter"])] = chosen
    missing = [name for name in axes if axes[name].attrs["parameter"] not in found and axes[name].size > 1]
    if missing:
        raise InputError(f"point = {point!r}: says nothing of {', '.join(missing)}")
    for name in axes:
        if axes[name].size == 1:
            found.setdefault(str(axes[name].attrs["parameter"]), axes[name].values[0].item())
    return found


def point_text(coordinates: dict[str, Any]) -> str:
    """Coordinates as ``--point`` takes them, to the last digit."""
    return ",".join(
        f"{name}={value!r}" if isinstance(value, float) else f"{name}={value}"
        for name, value in coordinates.items()
    )
