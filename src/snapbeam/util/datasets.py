"""xarray, with ``dataset.snapbeam`` added; each part of snapbeam that makes or opens a dataset takes it from here.

``import snapbeam`` alone does not import this module, because xarray takes a quarter of a second.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from xarray.backends import H5NetCDFStore

from snapbeam.util.display import DatasetFigures

__all__ = ["NetCDFStore", "variable", "xr"]

xr.register_dataset_accessor("snapbeam")(DatasetFigures)


def variable(
    name: str, dims: tuple[str, ...], values: np.ndarray, attrs: Mapping[str, Any] | None = None
) -> xr.Variable:
    """Return an array as the variable *name* of a dataset.

    To tell arrays of other libraries, ``xarray.Dataset`` imports dask and pint if they are installed, which takes almost
    a second; of such a variable it knows the type.
    """
    if dims == (name,):
        return xr.Variable(dims, pd.Index(values), attrs)
    return xr.Variable(dims, values, attrs, fastpath=True)


class _Writer:
    """Writer of arrays at once; xarray's own imports dask, and leaves arrays of dask to a later call."""

    def add(self, source: Any, target: Any) -> None:
        """Write an array to a variable of a file."""
        target[...] = np.asarray(source)


class NetCDFStore(H5NetCDFStore):
    """Store of a NetCDF file that hands numbers on as they are; the coders of texts would import dask too."""

    def set_variables(self, variables: Any, check_encoding_set: Any, writer: Any, unlimited_dims: Any = None) -> None:
        """Write variables."""
        super().set_variables(variables, check_encoding_set, _Writer(), unlimited_dims)

    def encode_variable(self, variable: xr.Variable, name: Any = None) -> xr.Variable:
        """Return a variable as it is stored."""
        return variable if variable.dtype.kind in "biuf" else super().encode_variable(variable, name=name)
