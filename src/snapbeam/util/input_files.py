"""Files that a user gives: regular files below a size limit, contents that fit the memory, and TOML of limited depth."""

from __future__ import annotations

import csv
import os
import re
import stat
import tomllib
from pathlib import Path
from typing import Any

from snapbeam.util.validation import InputError, file_path

LARGEST_INPUT = 64 * 2**20
"""Largest file of parameters or of a table, bytes."""
LARGEST_CONTENT = 512 * 2**20
"""Largest content of a compressed file of numbers, bytes, at 8 bytes a number."""
COMPRESSION = 20
"""Bytes of content for each byte on the disk, up to which a larger content is read too."""
_KEY_PARTS = 8
"""Most parts of a dotted key.  The parser's time grows with the square of their number."""


def input_bytes(name: str, path: str | os.PathLike[str], largest: int = LARGEST_INPUT) -> bytes:
    """Return the contents of a regular file, *name* in refusals, of at most *largest* bytes."""
    file = file_path(name, path)
    try:
        found = file.stat()
        if not stat.S_ISREG(found.st_mode) and not stat.S_ISDIR(found.st_mode):
            raise InputError(f"{name} = {str(path)!r}: must be a regular file, not a device or a pipe")
        with file.open("rb") as stream:
            data = stream.read(min(largest, max(found.st_size, 2**16)) + 1)  # which allocates as much
    except OSError as error:
        raise InputError(f"{name} = {str(path)!r}: cannot be read, {error.strerror or error}") from error
    if len(data) > largest:
        raise InputError(f"{name} = {str(path)!r}: must be at most {largest / 2**20:g} MiB")
    return data


def refuse_inflated(name: str, path: str | os.PathLike[str], size: int) -> None:
    """Refuse a content above 512 MiB and twenty times its file, before memory is allocated for it.

    Compression, fill values and false headers can turn a file of some kilobytes into any *size* in bytes, at 8 for a
    number. Every reader calls this with the size that the header of the file states.
    """
    found = os.stat(path)
    stored = min(found.st_size, getattr(found, "st_blocks", found.st_size) * 512)
    if size > max(LARGEST_CONTENT, COMPRESSION * stored):
        raise InputError(
            f"{name} = {str(path)!r}: would take {size / 2**30:.3g} GiB of memory, from {stored / 1e6:.3g} MB on the "
            f"disk: must be at most {LARGEST_CONTENT / 2**20:.0f} MiB, or {COMPRESSION} times the file"
        )


def input_text(name: str, path: str | os.PathLike[str]) -> str:
    """Return the text of a regular file in UTF-8."""
    try:
        return input_bytes(name, path).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"{name} = {str(path)!r}: cannot be read, {error}") from error


def decoded(raw: bytes, where: str) -> str:
    """Return the text of a table that an instrument or a spreadsheet wrote: UTF-8, UTF-16 or Latin-1."""
    start = raw[:400]
    if raw.startswith((b"\xff\xfe", b"\xfe\xff")):
        kind = "utf-16"
    elif start.count(0) > 0.3 * len(start) and len(raw) % 2 == 0:
        kind = "utf-16-le" if start[1::2].count(0) > start[0::2].count(0) else "utf-16-be"
    else:
        kind = "utf-8-sig"
    try:
        text = raw.decode(kind)
    except UnicodeDecodeError:
        if kind != "utf-8-sig":
            raise InputError(f"{where}: is no text") from None
        text = raw.decode("latin-1")
    if "\x00" in text:
        raise InputError(f"{where}: is no text (it holds zero bytes)")
    return text


def rows_of_table(
    text: str, where: str, known: tuple[str, ...], beside: tuple[str, ...] = ()
) -> tuple[str, list[str], list[tuple[int, list[str]]]]:
    """The separator of a text table, names of its columns, small, and its rows: numbers of lines, cells.

    Its columns must be among those *known*, or *beside* them, once each, and each row must have a cell for each.
    """
    first = next((line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")), "")
    mark = next((one for one in (";", "\t") if one in first), ",")
    rows = [
        (number, [cell.strip() for cell in cells])
        for number, cells in enumerate(csv.reader(text.splitlines(), delimiter=mark), start=1)
        if any(cell.strip() for cell in cells) and not cells[0].lstrip().startswith("#")
    ]
    if not rows:
        raise InputError(f"{where}: is empty; its first line must name the columns")
    header = [name.lower() for name in rows[0][1]]
    for name in header:
        if name not in (*known, *beside):
            raise InputError(f"{where}: unknown column {name!r}; must be among {', '.join(known)}")
        if header.count(name) > 1:
            raise InputError(f"{where}: column {name!r} occurs twice")
    for number, cells in rows[1:]:
        if len(cells) != len(header):
            raise InputError(f"{where}, line {number}: has {len(cells)} cells, the header names {len(header)}")
    return mark, header, rows[1:]


# Strings and comments, which may contain any number of full stops.  Each alternative also matches a string without an
# end, so that the search takes a time proportional to the length of the text.
_STRINGS = re.compile(
    r'"""(?:[^"\\]|\\.|"(?!""))*+(?:"{3,5})?|'
    r"'''(?:[^']|'(?!''))*+(?:'{3,5})?|"
    r'"(?:[^"\\\n]|\\.)*+"?|'
    r"'[^'\n]*+'?|#[^\n]*+",
    re.DOTALL,
)
_DEEP = re.compile(rf"(?<![\w-])(?:[\w-]++[ \t]*+\.[ \t]*+){{{_KEY_PARTS}}}")


def parsed_toml(text: str, what: str) -> dict[str, Any]:
    """Return the sections of a TOML text, whose keys have at most eight parts; refusals name *what*."""
    plain = _STRINGS.sub(lambda found: "" if found[0].startswith("#") else "s", text)
    if _DEEP.search(plain):
        raise InputError(f"{what}: a key must have at most {_KEY_PARTS} parts separated by full stops")
    try:
        return tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise InputError(f"{what}: is no TOML, {error}") from error
    except ValueError as error:  # an integer of thousands of digits
        raise InputError(f"{what}: cannot be read, {error}") from error


def read_toml(name: str, path: str | os.PathLike[str]) -> dict[str, Any]:
    """Return the sections of a TOML file."""
    return parsed_toml(input_text(name, path), f"{name} = {str(Path(path))!r}")
