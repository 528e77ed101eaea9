"""Text tables of many dialects: where the header ends, what separates cells, what the header says.

A table is a block of rows of numbers with the same count of cells, after any header.  Cells are separated by
semicolons, tabs, commas or blanks; with all but commas a comma may be the decimal sign, and points between
groups of three digits before it are left out.  Nothing is dropped: after the first row of numbers every line
must be one.
"""

from __future__ import annotations

import csv
import math
import re
from dataclasses import dataclass
from pathlib import Path

from snapbeam.core.findings import Diagnostic, tell
from snapbeam.core.validate import InputError

__all__ = ["TextBlock", "decoded", "read_block", "to_number"]

_COMMENT = ("#", "%", "//", "!")
_LOOK = 400  # lines in which the table must begin
_ABOVE = 20
"""Rows at the end whose numbers are compared."""
_GROUPED = re.compile(r"[-+]?[1-9]\d{0,2}(\.\d{3})+(,\d*)?([eE][-+]?\d+)?")


@dataclass(frozen=True)
class TextBlock:
    """A text file taken apart.

    ``header`` are the lines before the table and all comments; ``names`` and ``units`` the cells of the rows
    that head the columns, None where there is no such row; ``rows`` the cells, on the ``lines`` of the file.
    """

    path: Path
    header: tuple[str, ...]
    names: tuple[str, ...] | None
    units: tuple[str, ...] | None
    rows: list[list[str]]
    lines: list[int]
    decimal_comma: bool


def decoded(path: Path) -> str:
    """The text of a file: UTF-8, UTF-16 or Latin-1.

    Raises
    ------
    InputError
        If it is no text.
    """
    raw = path.read_bytes()
    if raw.startswith((b"\xff\xfe", b"\xfe\xff")):
        kind = "utf-16"
    elif raw[:400].count(0) > 0.3 * len(raw[:400]) and len(raw) % 2 == 0:
        kind = "utf-16-le" if raw[1:400:2].count(0) > raw[0:400:2].count(0) else "utf-16-be"
    else:
        kind = "utf-8-sig"
    if kind == "utf-8-sig" and b"\x00" in raw:
        raise InputError(f"{path}: is no text (it holds zero bytes)")
    try:
        text = raw.decode(kind)
    except UnicodeDecodeError:
        if kind != "utf-8-sig":
            raise InputError(f"{path}: is no text") from None
        text = raw.decode("latin-1")
    if "\x00" in text:
        raise InputError(f"{path}: is no text (it holds zero bytes)")
    return text


def to_number(cell: str, decimal_comma: bool = False) -> float:
    """The number in a cell; NaN if it holds none."""
    text = cell.strip()
    if decimal_comma and "," in text:
        if text.count(",") > 1 or ("." in text and not _GROUPED.fullmatch(text)):
            return math.nan
        text = text.replace(".", "").replace(",", ".")
    try:
        return float(text) if "_" not in text else math.nan
    except ValueError:
        return math.nan


def _cells(lines: list[str], separator: str | None) -> list[list[str]]:
    if separator is None:
        return [line.split() for line in lines]
    rows = csv.reader(lines, delimiter=separator, skipinitialspace=True, strict=True)
    return [[cell.strip() for cell in row] for row in rows]


@dataclass(frozen=True)
class _Dialect:
    separator: str | None
    decimal_comma: bool
    first: int  # index of the first row of numbers
    used: tuple[int, ...]  # cells of it that are no empty columns

    def row_of(self, cells: list[str]) -> list[str]:
        return [cells[i] if i < len(cells) else "" for i in self.used]


def _is_row(cells: list[str], used: tuple[int, ...], decimal_comma: bool) -> bool:
    return bool(used) and all(
        i < len(cells) and math.isfinite(to_number(cells[i], decimal_comma)) for i in used
    )


def _dialects(lines: list[str]) -> list[_Dialect]:
    """Every way in which a table can be seen in the first lines."""
    found = []
    few = lines[:_LOOK]
    for separator, commas in (
        (";", (True, False)),
        ("\t", (False, True)),
        (",", (False,)),
        (None, (False, True)),
    ):
        try:
            cells = _cells(few, separator)
        except csv.Error:
            continue
        if len(cells) != len(few):
            continue
        for comma in commas:
            for k, row in enumerate(cells):
                used = tuple(i for i, cell in enumerate(row) if cell)
                following = cells[k : k + 3]
                if all(_is_row(one, used, comma) and sum(map(bool, one)) == len(used) for one in following):
                    found.append(_Dialect(separator, comma, k, used))
                    break
    return found


def _is_short(cells: list[list[str]]) -> bool:
    """Whether the last number has fewer digits behind its point than those above it, which all have as many."""
    column = [re.search(r"[.,](\d*)$", row[-1].strip()) for row in cells[-_ABOVE:] if row]
    digits = {len(found[1]) for found in column[:-1] if found}
    if len(digits) != 1 or len(column) < _ABOVE:
        return False
    last = column[-1]
    return last is None or len(last[1]) < digits.pop()


def read_block(path: Path, columns: int = 0) -> TextBlock:
    """Take a text file apart.

    Parameters
    ----------
    path
        The file.
    columns
        How many columns there are, where a person says so.

    Raises
    ------
    InputError
        If there is no row of numbers, or the way to read it is not clear.
    """
    text = decoded(path)
    numbered = [(i, line.rstrip("\r")) for i, line in enumerate(text.split("\n"), 1) if line.strip()]
    comments = [line.strip().lstrip("#%/!").strip() for _, line in numbered if line.startswith(_COMMENT)]
    numbered = [(i, line) for i, line in numbered if not line.startswith(_COMMENT)]
    lines = [line for _, line in numbered]
    if not lines:
        raise InputError(f"{path}: holds no header and no row")
    dialects = _dialects(lines)
    if not dialects:
        if len(lines) == 1:
            raise InputError(f"{path}: holds a header and no row")
        raise InputError(
            f"{path}: no row of numbers in its first {min(len(lines), _LOOK)} lines; its columns may not be separated "
            "by semicolons, tabs, commas or blanks"
        )
    dialect, names, units, taken = _best(path, lines, dialects, columns)
    first = _earlier(lines, dialect)
    try:
        cells = _cells(lines[first:], dialect.separator)
    except csv.Error as error:
        raise InputError(f"{path}: is no table ({error})") from error
    if len(cells) != len(lines) - first:
        raise InputError(f"{path}: a quoted value runs over the end of a line")
    if not text.endswith("\n") and _is_short(cells):
        words = f"{path}: ends inside its last number, {cells[-1][-1].strip()!r}, as a copy that was broken off does"
        tell([Diagnostic("signal.cut", words, {"lines": float(len(lines))})])
    return TextBlock(
        path=path,
        header=(*comments, *(line for k, line in enumerate(lines[: dialect.first]) if k not in taken)),
        names=names,
        units=units,
        rows=[_kept(row, dialect, numbered[first + k][0], path, names) for k, row in enumerate(cells)],
        lines=[i for i, _ in numbered[first:]],
        decimal_comma=dialect.decimal_comma,
    )


def _kept(
    cells: list[str], dialect: _Dialect, line: int, path: Path, names: tuple[str, ...] | None
) -> list[str]:
    """The cells of a row that belong to the table's columns."""
    whole = len(cells) > max(dialect.used)
    extra = dialect.separator is None and len(cells) != len(dialect.used)
    stray = [cell for i, cell in enumerate(cells) if cell and i > max(dialect.used)]
    if not whole or extra or stray:
        count = len([cell for cell in cells if cell]) if stray or extra else len(cells)
        told = "the header names" if names else "the first has"
        raise InputError(f"{path}: line {line} has {count} value(s), {told} {len(dialect.used)} column(s)")
    return dialect.row_of(cells)


def _earlier(lines: list[str], dialect: _Dialect) -> int:
    """The first row of numbers, beside cells of the header too, as oscilloscopes write them."""
    if not dialect.used or dialect.used[0] == 0:
        return dialect.first
    first = dialect.first
    cells = _cells(lines[: dialect.first], dialect.separator)
    while first > 0 and _is_row(cells[first - 1], dialect.used, dialect.decimal_comma):
        first -= 1
    return first


def _best(
    path: Path, lines: list[str], dialects: list[_Dialect], columns: int
) -> tuple[_Dialect, tuple[str, ...] | None, tuple[str, ...] | None, set[int]]:
    """The dialect whose header fits its columns, its names and units, and the lines these stand on."""
    seen = [(one, *_heads(lines, one)) for one in dialects]
    if columns:
        seen = [entry for entry in seen if len(entry[0].used) == columns] or seen
    named = [entry for entry in seen if entry[1] is not None]
    if named:  # the earliest table, then the most columns
        return min(named, key=lambda entry: (entry[0].first, -len(entry[0].used)))
    best = min(seen, key=lambda entry: (entry[0].first, -len(entry[0].used)))
    rivals = [
        entry for entry in seen if entry[0].first == best[0].first and len(entry[0].used) != len(best[0].used)
    ]
    if rivals and not columns and best[0].separator == ",":
        raise InputError(
            f"{path}: without a header it is not clear whether commas part columns or decimals in "
            f"{lines[best[0].first]!r}; give columns (--columns), such as 'time [s],velocity [mm/s]'"
        )
    return best


def _heads(
    lines: list[str], dialect: _Dialect
) -> tuple[tuple[str, ...] | None, tuple[str, ...] | None, set[int]]:
    """Names and units of the columns from the one or two lines before the table."""
    above: list[tuple[int, list[str]]] = []
    count = len(dialect.used)
    for k in range(dialect.first - 1, max(dialect.first - 3, -1), -1):
        cells = (
            [lines[k].strip()]
            if count == 1 and dialect.separator is None
            else _cells([lines[k]], dialect.separator)[0]
        )
        row = dialect.row_of(cells)
        fits = len([cell for cell in cells if cell]) >= count and all(row)
        text = any(re.search(r"[^\W\d_]", cell) and not math.isfinite(to_number(cell)) for cell in row)
        if dialect.separator is None and len(cells) != count:
            fits = False
        if not fits or not text:
            break
        above.append((k, row))
    if not above:
        return None, None, set()
    at, last = above[0]
    if len(above) == 2 and all(_like_unit(cell) for cell in last):
        return tuple(above[1][1]), tuple(last), {at, above[1][0]}
    return tuple(last), None, {at}


def _like_unit(cell: str) -> bool:
    from snapbeam.lab.signals.units import si_unit

    word = cell.strip().strip("[]()").strip()
    try:
        si_unit("column", word)
    except InputError:
        return not word or word == "-" or word.lower() == "sequence"
    return True
