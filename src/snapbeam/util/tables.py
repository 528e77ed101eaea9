"""Tables of a dataset: a pandas data frame, a text file of comma-separated values, a MATLAB or universal file."""

from __future__ import annotations

import os
import warnings
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.util.files import atomic_path, check_writable
from snapbeam.util.packages import needing
from snapbeam.util.validation import InputError, file_path, instance

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

TABLE_SUFFIXES = (".csv", ".mat", ".uff")
_UFF_UNITS = {"m": 8, "N": 9, "m/s": 11, "m/s^2": 12, "s": 17, "Hz": 18}
"""Codes of physical quantities in a record of dataset 58."""
_TIME_RESPONSE, _FREQUENCY_RESPONSE, _COHERENCE = 1, 4, 6
"""Codes of functions in a record of dataset 58."""


def data_frame(dataset: xr.Dataset, *, units: bool = False) -> pd.DataFrame:
    """Return a dataset as a data frame: one row for each point of the dimensions that most variables have.

    Of a threshold there is a row for each value of the parameter at each point, with the threshold of the point. A
    variable with one dimension more, such as ``modal_amplitude``, has a column for each of its values:
    ``modal_amplitude_1``, ``modal_amplitude_2``.  Other variables are left out; ``attrs["left_out"]`` contains their
    names.  With *units* the names of the columns end with the unit, as ``time (s)``.
    """
    import pandas as pd

    from snapbeam.util.datasets import xr

    instance("dataset", dataset, xr.Dataset, "an xarray.Dataset")
    of_dims = Counter(each.dims for each in dataset.data_vars.values() if each.ndim)
    if not of_dims:
        raise InputError("dataset: must have a variable with a dimension; a table needs rows")
    main = of_dims.most_common(1)[0][0]
    # of a threshold a row for each value of the parameter that is raised
    main = next((dims for dims in of_dims if dataset.attrs.get("parameter") in dims), main)
    raised = dataset.attrs.get("parameter") in main
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
        if units and not end and variable is not None:
            end = _divisor(variable.attrs, dataset.attrs)
        more = [dim for dim in dims if dim not in main]
        if not dims and raised and name in dataset.data_vars:
            columns[name + end] = np.full(int(np.prod(shape)), values)
        elif not dims or (not set(dims) & set(main)):
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


def _divisor(labels: Any, attrs: Any) -> str:
    """End of a column's name: the quantity in a unit of the SI that the values are over; empty if over nothing."""
    words = str(labels.get("long_name", ""))
    length, frequency = attrs.get("length_scale"), attrs.get("reference_frequency")
    if "over b omega_1^2" in words or "over b" not in words or length is None:
        return ""
    if "over b omega_1" not in words:
        return f" (over {float(length):.9g} m)"
    return "" if frequency is None else f" (over {2.0 * np.pi * float(frequency) * float(length):.9g} m/s)"


def write_table(dataset: xr.Dataset, path: str | os.PathLike[str]) -> list[str]:
    """Write a dataset as a table of comma-separated values (.csv), or its arrays to a MATLAB (.mat) or universal file (.uff).

    A ``.csv`` file begins with names and units; numbers have all their digits. A ``.mat`` file contains every variable
    and coordinate, with its dimensions. A ``.uff`` file has a binary record (dataset 58) of each variable over time or
    frequency; uneven samples are interpolated, which the record states.

    Parameters
    ----------
    dataset : xarray.Dataset
        Run, impacts, map, or another result.
    path : path
        File ending in ``.csv``, ``.mat`` or ``.uff``.

    Returns
    -------
    list of str
        Variables that the table does not contain, of other dimensions.

    Raises
    ------
    InputError
        If the path cannot be written, or the dataset has nothing for such a file.

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
    if file_path("path", path).suffix.lower() == ".uff":
        records, left_out = _universal_records(dataset)
        with atomic_path(check_writable(path, "path", TABLE_SUFFIXES, f"{-1:6d}")) as temporary:
            write_universal(temporary, records)
        return left_out
    if Path(path).suffix.lower() == ".mat":
        from scipy.io import savemat

        target = check_writable(path, "path", TABLE_SUFFIXES, "MATLAB 5.0 MAT-file")
        long = [str(name) for name in dataset.variables if len(str(name)) > 63]
        with atomic_path(target) as temporary:
            arrays = {str(name): each.values for name, each in dataset.variables.items() if str(name) not in long}
            savemat(str(temporary), arrays, appendmat=False, long_field_names=True, oned_as="column")
        return long
    if Path(path).suffix.lower() != ".csv":
        check_writable(path, "path", TABLE_SUFFIXES)
    frame = data_frame(dataset, units=True)
    target = check_writable(path, "path", TABLE_SUFFIXES, f"{frame.columns[0]},")
    with atomic_path(target) as temporary:
        frame.to_csv(temporary, index=False)
    return list(frame.attrs["left_out"])


def universal_record(
    name: str,
    unit: str,
    abscissa: NDArray[np.float64],
    values: NDArray[Any],
    words: str = "",
    function: int = _TIME_RESPONSE,
    below: str = "",
) -> dict[str, Any]:
    """A binary record of dataset 58 of even samples over time [s] or frequency [Hz]; *words* is its second line.

    *function* is the code of the function, a response over time by default; *below* the unit of the excitation of a
    frequency response, *unit* that of the values or of the response.
    """
    import pyuff

    over = "s" if function == _TIME_RESPONSE else "Hz"
    entry: dict[str, Any] = pyuff.prepare_58(
        binary=1, id1=name[:80], id2=words[:80] or "NONE", func_type=function, rsp_node=1, rsp_dir=3, ref_node=0, ref_dir=0,
        data=values, x=abscissa, num_pts=values.size, abscissa_spacing=1, abscissa_min=float(abscissa[0]),
        abscissa_inc=float(abscissa[-1] - abscissa[0]) / (abscissa.size - 1), abscissa_spec_data_type=_UFF_UNITS[over],
        abscissa_axis_units_lab=over, ordinate_spec_data_type=_UFF_UNITS.get(unit, 0), ordinate_axis_units_lab=unit,
        orddenom_spec_data_type=_UFF_UNITS.get(below, 0), orddenom_axis_units_lab=below or "NONE", z_axis_spec_data_type=0,
        return_full_dict=False,
    )  # fmt: skip
    entry["n_bytes"] = values.nbytes
    return entry


def write_universal(path: Path, records: list[dict[str, Any]]) -> None:
    """Write records of :func:`universal_record` to a new universal file."""
    import pyuff

    path.unlink(missing_ok=True)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)  # pyuff leaves a file object to the garbage collector
        pyuff.UFF(str(path)).write_sets(records, mode="add")


def _universal_records(dataset: xr.Dataset) -> tuple[list[dict[str, Any]], list[str]]:
    """Records of the variables over time or frequency, and the names of the others."""
    with needing("a universal file", "lab"):
        import pyuff  # noqa: F401
    records, left_out = [], []
    names = [str(name) for name in dataset.data_vars]
    if {"magnitude", "phase", "coherence"} <= set(names):
        x, found = dataset["frequency"].values, dataset["magnitude"]
        values = found.values * np.exp(1j * dataset["phase"].values)
        own = dataset.attrs
        words = f"{own['response']} over {own['excitation']}"
        units = own["response_units"], own["excitation_units"]
        records = [
            universal_record(words, units[0], x, values, "", _FREQUENCY_RESPONSE, units[1]),
            universal_record(words, "1", x, dataset["coherence"].values, "", _COHERENCE),
        ]
        return records, [name for name in names if name not in ("magnitude", "phase", "coherence")]
    for name in names:
        variable = dataset[name]
        over_time = variable.dims[:1] == ("time",) and variable.ndim <= 2 and len(variable) > 1
        if not over_time or variable.dtype.kind not in "fiub":
            left_out.append(name)
            continue
        time, values = dataset["time"].values, variable.values.reshape(len(variable), -1).astype(np.float64)
        labels = [name]
        if variable.ndim == 2:
            labels = [f"{name}_{label}" for label in dataset[variable.dims[1]].values]
        even = np.linspace(time[0], time[-1], round((time[-1] - time[0]) / np.diff(time).max()) + 1)
        words = ""
        if even.size != time.size or np.abs(even - time).max() > 1e-6 * (even[1] - even[0]):
            values = np.column_stack([np.interp(even, time, column) for column in values.T])
            words = f"interpolated from {time.size} uneven samples"
        unit = str(variable.attrs.get("units", "1"))
        records += [
            universal_record(label, unit, even, np.ascontiguousarray(column), words)
            for label, column in zip(labels, values.T, strict=True)
        ]
    if not records:
        raise InputError(
            "dataset: must have a variable over time alone, or be a frequency response, for a universal file"
        )
    return records, left_out
