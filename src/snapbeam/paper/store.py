"""The data of a recipe in one compressed NetCDF file, a group for each dataset."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from snapbeam.util.files import check_writable
from snapbeam.util.hdf5 import open_hdf5
from snapbeam.util.netcdf import write_netcdf
from snapbeam.util.validation import InputError

if TYPE_CHECKING:
    import xarray as xr


def save_results(results: Mapping[str, xr.Dataset], path: Path, size: str) -> Path:
    """Write datasets, by name, with 32-bit floats; coordinates keep their 64 bits.

    Every dataset contains its provenance attributes.
    """
    from snapbeam.util.datasets import xr

    target = check_writable(path, "output", (".nc",))
    groups: dict[str | None, xr.Dataset] = {None: xr.Dataset(attrs={"paper_size": size})}
    encoding: dict[str | None, dict[str, dict[str, object]]] = {}
    for name, dataset in results.items():
        compact = dataset.copy()
        packed: dict[str, dict[str, object]] = {}
        for key, variable in dataset.data_vars.items():
            if variable.dtype == bool:
                compact[key] = variable.astype(np.int8).assign_attrs(variable.attrs)
            packed[str(key)] = {"zlib": True, "complevel": 9, "shuffle": True} if variable.ndim else {}
            if variable.dtype == np.float64 and variable.ndim:
                packed[str(key)]["dtype"] = "float32"
        groups[name], encoding[name] = compact, packed
    write_netcdf(groups, target, encoding)
    return target


def load_results(path: Path, size: str | None = None) -> dict[str, xr.Dataset]:
    """Read what :func:`save_results` wrote; refuse a file of another *size*."""
    from snapbeam.util.datasets import xr

    try:
        open_hdf5(path, "data").close()
        with xr.open_datatree(path, engine="h5netcdf") as tree:
            tree.load()
    except InputError:
        raise
    except Exception as error:  # of damaged bytes the libraries make errors of every kind
        raise InputError(f"data = {str(path)!r}: cannot be read, {error}") from error
    there = tree.attrs.get("paper_size")
    if size is not None and there != size:
        raise InputError(f"data = {str(path)!r}: is of size {there!r}, not {size!r}")
    return {name: node.to_dataset() for name, node in tree.children.items()}
