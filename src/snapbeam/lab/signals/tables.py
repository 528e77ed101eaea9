"""Time series as text tables: one column a channel, units in the header, faults named by line and column."""

from __future__ import annotations

import csv
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.validate import InputError, positive
from snapbeam.lab.signals.signal import check_signal, si_unit

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Table", "read_csv", "read_table", "split_unit", "write_csv"]

_SUFFIX_UNITS = {
    "_m_s": "m/s",
    "_mm_s": "mm/s",
    "_um_s": "um/s",
    "_mm": "mm",
    "_um": "um",
    "_ms": "ms",
    "_us": "us",
    "_m": "m",
    "_s": "s",
    "_v": "V",
    "_n": "N",
    "_hz": "Hz",
}


class Table(NamedTuple):
    """A text table: its ``columns`` of cells by name, the ``lines`` they stand on, and comments."""

    path: Path
    columns: dict[str, tuple[str, ...]]
    lines: list[int]
    comments: list[str]
    decimal_comma: bool

    def numbers(self, name: str) -> NDArray[np.float64]:
        """Return a column as floats; refuse a cell that is no finite number, naming its line.

        Raises
        ------
        InputError
            Naming the file, the line, the column and the cell.
        """
        cells = self.columns[name]
        if self.decimal_comma:
            cells = tuple(cell.replace(",", ".") for cell in cells)
        try:
            numbers = np.array(cells, dtype=np.float64)
        except ValueError:
            numbers = np.array([_number(cell) for cell in cells])
        bad = np.flatnonzero(~np.isfinite(numbers))
        if bad.size:
            at = int(bad[0])
            cell = self.columns[name][at]
            raise InputError(
                f"{self.path}: line {self.lines[at]}, column {name!r}: {cell!r} is not a finite number"
            )
        return numbers


def read_table(path: Path) -> Table:
    """Read a text table with a header line; lines that begin with ``#`` are comments.

    The separator is a semicolon, a tab, a comma or blanks; with semicolons a comma may be the decimal point.

    Raises
    ------
    InputError
        If there is no header line, no row, a row of another length, or a column without a name of its own.
    """
    raw = path.read_bytes()
    if b"\x00" in raw:
        raise InputError(f"{path}: is no text (it holds zero bytes)")
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = raw.decode("latin-1")
    numbered = [(i, line) for i, line in enumerate(text.split("\n"), 1) if line.strip()]
    comments = [line.strip()[1:].strip() for _, line in numbered if line.startswith("#")]
    numbered = [(i, line.rstrip("\r")) for i, line in numbered if not line.startswith("#")]
    if not numbered:
        raise InputError(f"{path}: holds no header and no row")
    at, header = numbered[0]
    separator = next((mark for mark in (";", "\t", ",") if mark in header), None)
    if separator is None and len(numbered) > 1 and len(header.split()) == len(numbered[1][1].split()):
        header, *body = (",".join(line.split()) for _, line in numbered)
    else:
        body = [line for _, line in numbered[1:]]
    lines = [i for i, _ in numbered[1:]]
    try:
        rows = csv.reader([header, *body], delimiter=separator or ",", skipinitialspace=True, strict=True)
        names = [cell.strip() for cell in next(rows)]
        cells = list(rows)
    except csv.Error as error:
        raise InputError(f"{path}: is no table ({error})") from error
    if all(np.isfinite(_number(name.replace(",", "."))) for name in names):
        raise InputError(f"{path}: line {at} must be a header that names the columns and their units")
    if "" in names or len(set(names)) < len(names):
        raise InputError(f"{path}: line {at}: columns {names}: each must have a name of its own")
    if not cells:
        raise InputError(f"{path}: holds a header and no row")
    if len(cells) != len(lines):
        raise InputError(f"{path}: a quoted value runs over the end of a line")
    for number, row in zip(lines, cells, strict=True):
        if len(row) != len(names):
            raise InputError(
                f"{path}: line {number} has {len(row)} value(s), the header names {len(names)} column(s)"
            )
    columns = zip(*cells, strict=True)
    table = {name: tuple(c.strip() for c in column) for name, column in zip(names, columns, strict=True)}
    return Table(path, table, lines, comments, separator == ";")


def read_csv(path: Path, _rate: float | None = None) -> list[dict[str, Any]]:
    """Return the channels of a text table as SEP 5 dictionaries; see ``signal_files.read_channels``."""
    table = read_table(path)
    columns = {name: split_unit(name) for name in table.columns}
    times = [name for name, (word, _) in columns.items() if word.lower() in ("time", "t")]
    if len(times) > 1:
        raise InputError(f"{path}: columns {times}: only one may be the time")
    common: dict[str, Any] = {}
    if times:
        unit = columns[times[0]][1] or "s"
        factor, base = si_unit(f"column {times[0]!r}", unit)
        if base != "s":
            raise InputError(f"{path}: column {times[0]!r} is in {unit!r}, not in seconds")
        common["time"] = table.numbers(times[0]) * factor
    else:
        for comment in table.comments:
            found = re.match(
                r"(?:sampling_freq|sampling_frequency|fs)\s*[:=]\s*([0-9.eE+]+)\s*(k?)Hz$", comment
            )
            if found:
                scale = 1e3 if found[2] else 1.0
                common["fs"] = positive(f"{path}: sampling_freq", _number(found[1]) * scale, "Hz")
    return [
        {"data": table.numbers(name), "name": word, "unit_str": unit, **common}
        for name, (word, unit) in columns.items()
        if name not in times
    ]


def write_csv(path: Path, signal: xr.DataArray, _full_scale: float | None = None) -> None:
    """Write a signal as a table of time and value, 12 digits each."""
    values, time, rate = check_signal(signal)
    with path.open("w", encoding="utf-8", newline="\n") as file:
        file.write(f"# sampling_freq: {rate:.12g} Hz\n")
        file.write(f"time [s],{signal.name} [{signal.attrs['units']}]\n")
        np.savetxt(file, np.column_stack((time, values)), fmt="%.12g", delimiter=",")


def split_unit(column: str) -> tuple[str, str | None]:
    """Split ``"velocity [mm/s]"``, ``"velocity (mm/s)"`` or ``"velocity_mm_s"`` into name and unit."""
    found = re.fullmatch(r"\s*(.*?)\s*[\[(]\s*(.+?)\s*[\])]\s*", column)
    if found:
        return found[1] or column, found[2]
    for suffix, unit in _SUFFIX_UNITS.items():
        if column.lower().endswith(suffix) and len(column) > len(suffix):
            return column[: -len(suffix)], unit
    return column, None


def _number(cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        return float("nan")
