"""Measured responses from a CSV table."""

from __future__ import annotations

import math
import os
import re
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.util.input_files import decoded, input_bytes, rows_of_table
from snapbeam.util.status_codes import ResponseClass
from snapbeam.util.validation import InputError, InputTypeError, file_path, positive

_Array = NDArray[np.float64]

# One of each pair is wanted; the last column of all may be left out.
_FREQUENCY = ("frequency_ratio", "frequency_hz")
_VELOCITY = ("velocity_amplitude", "velocity_m_s")
_COLUMNS = (*_FREQUENCY, *_VELOCITY, "location", "response_class")
# What a table of tests says beside; read over here.
_BESIDE = (
    "test", "recording", "vibrometer", "frequency_se_hz", "velocity_se_m_s", "zero_crossings", "cycles", "snr_db",
    "measured_share", "delay_s", "polarity", "gain", "status", "diagnostics", "comment",
)  # fmt: skip

_CLASSES = {kind.label: kind for kind in ResponseClass}
_CLASSES |= {kind.label.replace("interwell ", "").replace(" interwell", ""): kind for kind in ResponseClass}
_CLASSES |= {str(kind.value): kind for kind in ResponseClass}


@dataclass(frozen=True)
class MeasuredPoints:
    """Measured responses, in the coordinates of a map.

    Attributes
    ----------
    frequency_ratio, velocity_amplitude, location : array of shape (points,)
        Omega, V and x_s; the location is NaN where the table does not give it.
    response_class : int8 array of shape (points,)
        :class:`~snapbeam.ResponseClass` of each.

    See Also
    --------
    snapbeam.read_measured_points, snapbeam.uncertainty.score_measurements

    Examples
    --------
    >>> import snapbeam as sb
    >>> measured = sb.MeasuredPoints(
    ...     frequency_ratio=[1.0, 1.2], velocity_amplitude=[0.02, 0.2], location=[0.4762, 0.4762], response_class=[0, 3]
    ... )
    >>> len(measured)
    2
    """

    frequency_ratio: _Array
    velocity_amplitude: _Array
    location: _Array
    response_class: NDArray[np.int8]

    def __post_init__(self) -> None:
        columns = [_column(item.name, getattr(self, item.name)) for item in fields(self)]
        if len({each.shape for each in columns}) > 1 or columns[0].ndim != 1:
            raise InputError("MeasuredPoints: must be one-dimensional arrays of the same length")
        if any(each.dtype.kind not in "iuf" for each in columns):
            raise InputTypeError("MeasuredPoints: must be arrays of numbers")
        if not np.isin(columns[-1], [int(kind) for kind in ResponseClass]).all():
            raise InputError("response_class: must contain the numbers of response classes only")
        for item, column in zip(fields(self), columns, strict=True):
            kind = np.int8 if item.name == "response_class" else np.float64
            object.__setattr__(self, item.name, column.astype(kind))

    def __len__(self) -> int:
        return len(self.response_class)


def _column(name: str, values: Any) -> NDArray[Any]:
    try:
        return np.asarray(values)
    except (ValueError, TypeError, RuntimeError, MemoryError) as error:
        raise InputError(f"{name}: must be an array of numbers, {error}") from None


def read_measured_points(
    path: str | os.PathLike[str], *, reference_frequency: float | None = None, buckling_level: float | None = None
) -> MeasuredPoints:
    """Read measured responses from a CSV file with a header.

    Columns: ``frequency_ratio`` or ``frequency_hz``; ``velocity_amplitude`` (V) or ``velocity_m_s``; ``location`` (x_s,
    optional); ``response_class``: intrawell, transient 1, transient 2, continuous, unknown, or its number; further ones
    as ``snapbeam process-tests`` writes them. Separators are commas, semicolons or tabs; with the latter two the
    decimal sign may be a comma. Lines that start with ``#`` are comments.

    Parameters
    ----------
    path : path
        The file.
    reference_frequency : float, optional
        First natural frequency, Hz, for ``frequency_hz`` and ``velocity_m_s``.
    buckling_level : float, optional
        Buckling level b, m, for ``velocity_m_s``: V = velocity / (2 pi b f_1).

    See Also
    --------
    snapbeam.MeasuredPoints, snapbeam.lab.compare_measured_points

    Examples
    --------
    >>> from pathlib import Path
    >>> import snapbeam as sb
    >>> lines = ["frequency_hz,velocity_m_s,response_class", "50,0.03,transient 1"]
    >>> _ = Path("measured.csv").write_text(chr(10).join(lines))
    >>> measured = sb.read_measured_points("measured.csv", reference_frequency=45.7, buckling_level=1.8e-4)
    >>> measured.frequency_ratio.round(3)
    array([1.094])
    """
    file = file_path("path", path)
    text = decoded(input_bytes("measurements", file), file.name)
    mark, header, rows = rows_of_table(text, file.name, _COLUMNS, _BESIDE)
    for pair in (_FREQUENCY, _VELOCITY, ("response_class",)):
        there = [column for column in pair if column in header]
        if len(there) != 1:
            raise InputError(f"{file.name}: must have one column {' or '.join(pair)}, not {there}")
    frequency_scale, velocity_scale = 1.0, 1.0
    if "frequency_hz" in header:
        frequency_scale = 1.0 / _wanted(file.name, "frequency_hz", "reference_frequency", reference_frequency, "Hz")
    if "velocity_m_s" in header:
        freq = _wanted(file.name, "velocity_m_s", "reference_frequency", reference_frequency, "Hz")
        level = _wanted(file.name, "velocity_m_s", "buckling_level", buckling_level, "m")
        velocity_scale = 1.0 / (2.0 * math.pi * freq * level)
    frequency = header.index(next(name for name in _FREQUENCY if name in header))
    velocity = header.index(next(name for name in _VELOCITY if name in header))
    place = header.index("location") if "location" in header else None
    points, kinds = [], []
    for number, raw in rows:
        cells = raw if mark == "," else [_pointed(cell) for cell in raw]
        status = cells[header.index("status")] if "status" in header else "measured"
        if status != "measured":
            continue  # a test that gave no number is a row of words
        location = math.nan
        if place is not None and cells[place]:
            location = _number(file.name, number, "location", cells[place], 1.0)
        omega = frequency_scale * _number(file.name, number, header[frequency], cells[frequency])
        speed = velocity_scale * _number(file.name, number, header[velocity], cells[velocity])
        points.append((omega, speed, location))
        kinds.append(_kind(file.name, number, cells[header.index("response_class")]))
    columns = np.array(points, dtype=np.float64).reshape(-1, 3).T
    return MeasuredPoints(columns[0], columns[1], columns[2], np.array(kinds, dtype=np.int8))


def _wanted(name: str, column: str, parameter: str, value: float | None, unit: str) -> float:
    if value is None:
        raise InputError(f"{name}: column {column!r} needs {parameter}, in {unit}, to be normalised with")
    return positive(parameter, value, unit)


def _number(name: str, line: int, column: str, cell: str, below: float = math.inf) -> float:
    allowed = "a number greater than 0" + ("" if below == math.inf else f" and less than {below:g}")
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not 0.0 < value < below:
        raise InputError(f"{name}, line {line}, column {column!r}: {cell!r} must be {allowed}")
    return value


def _pointed(cell: str) -> str:
    """A cell with its decimal comma, if it is a number with one, made a point."""
    return cell.replace(",", ".") if re.fullmatch(r"[-+]?\d+,\d+([eE][-+]?\d+)?", cell) else cell


def _kind(name: str, line: int, cell: str) -> ResponseClass:
    word = " ".join(cell.lower().replace("_", " ").replace("-", " -" if cell.startswith("-") else " ").split())
    if word not in _CLASSES:
        known = ", ".join(dict.fromkeys(kind.label for kind in ResponseClass))
        raise InputError(f"{name}, line {line}, column 'response_class': {cell!r} must be one of {known}")
    return _CLASSES[word]
