"""Tables of a dataset: a pandas data frame, a text file of comma-separated values, a MATLAB file."""

from __future__ import annotations

import os
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from snapbeam.util.files import atomic_path, check_writable
from snapbeam.util.validation import InputError, file_path, instance

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

TABLE_SUFFIXES = (".csv", ".mat")


def data_frame(dataset: xr.Dataset, *, units: bool = False) -> pd.DataFrame:
    """Return a dataset as a data frame: one row for each point of the dimensions that most variables have.

    A variable with one dimension more, such as ``modal_amplitude``, has a column for each of its values:
    ``modal_amplitude_1``, ``modal_amplitude_2``.  Other variables are left out; ``attrs["left_out"]`` contains their
    names.

    Parameters
    ----------
    dataset : xarray.Dataset
        A run, a map, or another result.
    units : bool
        Whether the names of the columns end with the unit, as ``time (s)``.

    Returns
    -------
    pandas.DataFrame

    Raises
    ------
    InputError
        If the dataset has no variable with a dimension.
    """
    import pandas as pd

    from snapbeam.util.datasets import xr

    instance("dataset", dataset, xr.Dataset, "an xarray.Dataset")
    of_dims = Counter(each.dims for each in dataset.data_vars.values() if each.ndim)
    if not of_dims:
        raise InputError("dataset: must have a variable with a dimension; a table needs rows")
    main = of_dims.most_common(1)[0][0]
    columns: dict[str, Any] = {}
    left_out = []
    names = [*main, *(name for name in dataset.coords if name not in main), *dataset.data_vars]
    shape = tuple(dataset.sizes[dim] for dim in main)
    for name in map(str, names):
        variable = dataset[name] if name in dataset.variables else None
        if variable is None:
            values = np.arange(dataset.sizes[name])
            dims: tuple[Any, ...] = (name,)
            unit = "1"
        else:
            values, dims, unit = variable.values, variable.dims, str(variable.attrs.get("units", "1"))
        end = f" ({unit})" if units and unit not in ("1", "") else ""
        more = [dim for dim in dims if dim not in main]
        if not dims or (not set(dims) & set(main)):
            if name in dataset.data_vars:
                left_out.append(name)
        elif not more:
            own = [dim for dim in main if dim in dims]
            spread = np.transpose(values, [dims.index(dim) for dim in own]).reshape(
                [size if dim in own else 1 for dim, size in zip(main, shape, strict=True)]
            )
            columns[name + end] = np.broadcast_to(spread, shape).ravel()
        elif len(more) == 1 and set(main) <= set(dims):
            ordered = np.transpose(values, [*(dims.index(dim) for dim in main), dims.index(more[0])])
            labels = dataset[more[0]].values if more[0] in dataset.coords else np.arange(ordered.shape[-1])
            for label, column in zip(labels, np.moveaxis(ordered, -1, 0), strict=True):
                columns[f"{name}_{label}{end}"] = column.ravel()
        else:
            left_out.append(name)
    frame = pd.DataFrame(columns)
    frame.attrs["left_out"] = left_out
    return frame


def write_table(dataset: xr.Dataset, path: str | os.PathLike[str]) -> list[str]:
    """Write a dataset as a table of comma-separated values (.csv), or all its arrays to a MATLAB file (.mat).

    The first line of a ``.csv`` file contains names and units; numbers have all their digits.  A ``.mat`` file contains
    every variable and coordinate under its name, with its dimensions.

    Parameters
    ----------
    dataset : xarray.Dataset
        A run, its impacts, a map, or another result.
    path : path
        Ends in ``.csv`` or ``.mat``; MATLAB reads them by ``readtable`` and ``load``.

    Returns
    -------
    list of str
        Names of the variables that the table does not contain, since their dimensions are other ones.

    Examples
    --------
    >>> import snapbeam as sb
    >>> import xarray as xr
    >>> sb.write_table(xr.Dataset({"gap": ("time", [0.0, 1.0], {"units": "m"})}), "gap.csv")
    []
    >>> from pathlib import Path
    >>> print(Path("gap.csv").read_text().strip())
    time,gap (m)
    0,0.0
    1,1.0
    """
    from snapbeam.util.datasets import xr

    instance("dataset", dataset, xr.Dataset, "an xarray.Dataset")
    if file_path("path", path).suffix.lower() == ".mat":
        from scipy.io import savemat

        target = check_writable(path, "path", TABLE_SUFFIXES, "MATLAB 5.0 MAT-file")
        long = [str(name) for name in dataset.variables if len(str(name)) > 63]
        with atomic_path(target) as temporary:
            arrays = {
                str(name): each.values for name, each in dataset.variables.items() if str(name) not in long
            }
            savemat(str(temporary), arrays, appendmat=False, long_field_names=True, oned_as="column")
        return long
    if Path(path).suffix.lower() != ".csv":
        check_writable(path, "path", TABLE_SUFFIXES)
    frame = data_frame(dataset, units=True)
    target = check_writable(path, "path", TABLE_SUFFIXES, f"{frame.columns[0]},")
    with atomic_path(target) as temporary:
        frame.to_csv(temporary, index=False)
    return list(frame.attrs["left_out"])
