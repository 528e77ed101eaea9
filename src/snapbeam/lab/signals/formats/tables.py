"""Time series as text tables: one column a channel, units in the header, faults named by line and column."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.validate import InputError
from snapbeam.lab.signals.formats.channel import Channel, Told, is_time
from snapbeam.lab.signals.formats.header import header_rate, header_unit, header_values
from snapbeam.lab.signals.formats.text import TextBlock, read_block, to_number
from snapbeam.lab.signals.signal import check_signal, even_sampling
from snapbeam.lab.signals.units import si_unit

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Table", "read_csv", "read_table", "split_unit", "write_csv"]

_LONGEST_NAME = 500
"""Letters of a name of a column that a unit is looked for in."""
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
    """A text table: its ``columns`` of cells by name, the ``lines`` they stand on, and the lines above."""

    path: Path
    columns: dict[str, tuple[str, ...]]
    lines: list[int]
    header: tuple[str, ...]
    decimal_comma: bool

    def numbers(self, name: str) -> NDArray[np.float64]:
        """Return a column as floats; refuse a cell that is no finite number, naming its line.

        Raises
        ------
        InputError
            Naming the file, the line, the column and the cell.
        """
        cells = self.columns[name]
        try:
            if self.decimal_comma:
                raise ValueError
            numbers = np.array(cells, dtype=np.float64)
        except ValueError:
            numbers = np.array([to_number(cell, self.decimal_comma) for cell in cells])
        bad = np.flatnonzero(~np.isfinite(numbers))
        if bad.size:
            at = int(bad[0])
            cell = self.columns[name][at]
            raise InputError(
                f"{self.path}: line {self.lines[at]}, column {name!r}: {cell!r} is not a finite number"
            )
        return numbers


def read_table(path: Path, columns: str | None = None) -> Table:
    """Read a text table; see :mod:`snapbeam.lab.signals.formats.text` for its dialects.

    Parameters
    ----------
    path
        The file.
    columns
        Names and units of the columns, separated by commas, instead of those in the file.

    Raises
    ------
    InputError
        If there is no header and no *columns*, no row, a row of another length, or a column without a name of
        its own.
    """
    given = [name.strip() for name in columns.split(",")] if columns else []
    block = read_block(path, len(given))
    width = len(block.rows[0])
    names = tuple(given) if given else _names(block)
    if names is None:
        raise InputError(
            f"{path}: its first row, line {block.lines[0]}, has no header above it that names its {width} column(s); "
            "give columns (--columns), such as 'time [s],velocity [mm/s]'"
        )
    if len(names) != width:
        raise InputError(
            f"{path}: columns (--columns) = {columns!r} names {len(names)}, the rows have {width}"
        )
    if "" in names or len(set(names)) < len(names):
        raise InputError(f"{path}: columns {list(names)}: each must have a name of its own")
    cells = zip(*block.rows, strict=True)
    table = {name: tuple(column) for name, column in zip(names, cells, strict=True)}
    return Table(path, table, block.lines, block.header, block.decimal_comma)


def _names(block: TextBlock) -> tuple[str, ...] | None:
    """Names of the columns with their units in brackets; None if there are none."""
    if block.names is None:
        values = header_values(block.header)
        across, up = header_unit(values, "horizontalunits"), header_unit(values, "verticalunits")
        if len(block.rows[0]) == 2 and across and up:  # an oscilloscope's table
            return f"time [{across}]", f"{values.get('source', 'channel 1')} [{up}]"
        return None
    if block.units is None:
        return block.names
    joined = []
    for name, unit in zip(block.names, block.units, strict=True):
        word = unit.strip().strip("[]()").strip()
        known = split_unit(name)[1] is not None or word in ("", "-")
        joined.append(name if known else f"{name} [{word}]")
    return tuple(joined)


def read_csv(path: Path, told: Told) -> list[Channel]:
    """Return the channels of a text table; see :func:`snapbeam.lab.signals.files.read_channels`."""
    table = read_table(path, told.columns)
    columns = {name: split_unit(name) for name in table.columns}
    times = [name for name, (word, unit) in columns.items() if _is_time(word, unit)]
    if len(times) > 1:
        raise InputError(f"{path}: columns {times}: only one may be the time")
    values = header_values(table.header)
    rate = header_rate(values, str(path))
    common: dict[str, Any] = {}
    if times:
        unit = columns[times[0]][1] or "s"
        factor, base = si_unit(f"column {times[0]!r}", unit)
        if base != "s":
            raise InputError(f"{path}: column {times[0]!r} is in {unit!r}, not in seconds")
        common["time"] = table.numbers(times[0]) * factor
        if rate is not None:
            _agree(path, common["time"], rate)
    elif rate is not None:
        common["fs"] = rate
    upward = header_unit(values, "verticalunits", "yunit", "yunits", "unity")
    return [
        {"data": table.numbers(name), "name": word, "unit_str": unit or upward, **common}
        for name, (word, unit) in columns.items()
        if name not in times
    ]


def _is_time(word: str, unit: str | None) -> bool:
    """Whether a column is the time: by its name, unless that is one of an axis with another unit."""
    if not is_time(word) or unit is None or word.lower() not in ("x-axis", "x_value"):
        return is_time(word)
    return si_unit(f"column {word!r}", unit)[1] == "s"


def _agree(path: Path, time: NDArray[np.float64], rate: float) -> None:
    """Refuse a column of times that contradicts the rate in the header."""
    if time.size < 3:
        return
    _, found = even_sampling(str(path), time)
    if abs(found / rate - 1.0) * time.size > 1.0 and abs(found / rate - 1.0) > 1e-3:
        raise InputError(
            f"{path}: the column of times is sampled at {found:.9g} Hz, the header says {rate:.9g} Hz; give columns "
            "(--columns) with another name for the wrong one"
        )


def write_csv(path: Path, signal: xr.DataArray, _full_scale: float | None = None) -> None:
    """Write a signal as a table of time and value, 12 digits each."""
    values, time, rate = check_signal(signal)
    with path.open("w", encoding="utf-8", newline="\n") as file:
        file.write(f"# sampling_frequency: {rate:.12g} Hz\n")
        file.write(f"time [s],{signal.name} [{signal.attrs['units']}]\n")
        np.savetxt(file, np.column_stack((time, values)), fmt="%.12g", delimiter=",")


def split_unit(column: str) -> tuple[str, str | None]:
    """Split ``"velocity [mm/s]"``, ``"velocity (mm/s)"`` or ``"velocity_mm_s"`` into name and unit.

    A name that is a unit itself, such as ``Volt``, is one too.
    """
    if len(column) > _LONGEST_NAME:
        return column, None
    found = re.fullmatch(r"\s*(.*?)\s*[\[(]\s*(.+?)\s*[\])]\s*", column)
    if found:
        return found[1] or column, found[2]
    for suffix, unit in _SUFFIX_UNITS.items():
        if column.lower().endswith(suffix) and len(column) > len(suffix):
            return column[: -len(suffix)], unit
    if column.strip().lower() in ("volt", "volts", "second", "seconds"):
        return column, column.strip()
    return column, None
