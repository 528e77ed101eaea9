"""Which files of a folder are one test: paired by their names, or by a table."""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass
from pathlib import Path

from snapbeam.core.validate import InputError, positive, shown, within
from snapbeam.lab.camera.sources.images import IMAGE_SUFFIXES
from snapbeam.lab.camera.sources.opening import RECORDING_SUFFIXES
from snapbeam.lab.signals.formats.registry import READERS
from snapbeam.lab.signals.formats.text import decoded

__all__ = ["Test", "find_tests"]

_HEADERS = (".cih", ".cihx")
_SIGNALS = tuple(suffix for suffix in READERS if suffix not in (".h5", ".hdf5", ".npy", ".nc"))
_WORDS = (
    r"[-_ ]?(?<![a-z])(vibrometer|vibro|vib|velocity|vel|laser|ldv|drive|shaker|camera|cam|recording|rec|video)"
    r"(?![a-z])"
)
_COLUMNS = ("test", "recording", "vibrometer", "frequency_hz", "velocity_m_s", "location", "comment")


@dataclass(frozen=True)
class Test:
    """One test: its name, its files, and what was set, where a table says so.

    ``frequency`` [Hz], ``velocity`` [m/s] amplitude, ``location`` x_s/L.
    """

    __test__ = False  # no test of pytest's

    name: str
    recording: Path
    vibrometer: Path | None = None
    frequency: float | None = None
    velocity: float | None = None
    location: float | None = None


def find_tests(folder: Path, table: Path | None = None, besides: Path | None = None) -> list[Test]:
    """The tests of a folder, in the order of their names or of the table.

    A recording and a vibrometer file are one test if their names are the same but for the ending and words
    such as "vib", "velocity_at_striker" or "camera".  A folder of numbered images is a recording.

    Parameters
    ----------
    folder
        Where the files are.
    table
        A text table with the columns test, recording, and, as far as known, vibrometer, frequency_hz,
        velocity_m_s, location and comment.
    besides
        A folder that is none of the recordings, such as that of the results.

    Raises
    ------
    InputError
        If there is no recording, a file of the table is missing, or names do not pair uniquely.
    """
    if not folder.is_dir():
        raise InputError(f"{folder}: must be a folder of recordings")
    if table is not None:
        return _from_table(folder, table)
    recordings: dict[str, Path] = {}
    signals: dict[str, Path] = {}
    for path in sorted(folder.iterdir()):
        if path.name.startswith(".") or (besides is not None and path.resolve() == besides.resolve()):
            continue
        if path.is_dir():
            if any(one.suffix.lower() in IMAGE_SUFFIXES for one in path.iterdir()):
                _put(recordings, path, path.name)
            continue
        suffix = path.suffix.lower()
        if suffix == ".mraw" and any(path.with_suffix(one).exists() for one in _HEADERS):
            continue
        if suffix in RECORDING_SUFFIXES:
            _put(recordings, path, path.stem)
        elif suffix in _SIGNALS and path.name not in ("tests.csv", "campaign.csv"):
            _put(signals, path, path.stem)
    if not recordings:
        raise InputError(
            f"{folder}: holds no recording ({', '.join(RECORDING_SUFFIXES)}, or a folder of images)"
        )
    return [Test(name, path, signals.get(name)) for name, path in recordings.items()]


def _put(known: dict[str, Path], path: Path, stem: str) -> None:
    name = re.sub(_WORDS, "", stem, flags=re.IGNORECASE).strip("-_ ") or stem
    if name in known:
        raise InputError(
            f"{path.name} and {known[name].name}: both would be of test {name!r}; rename one, or give a table (--table)"
        )
    known[name] = path


def _from_table(folder: Path, table: Path) -> list[Test]:
    try:
        text = decoded(table)
    except OSError as error:
        raise InputError(f"table (--table) = {str(table)!r}: cannot be read, {error.strerror}") from error
    lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")]
    if not lines:
        raise InputError(f"{table.name}: is empty; its first line must name the columns")
    mark = next((one for one in (";", "\t") if one in lines[0]), ",")
    rows = [[cell.strip() for cell in row] for row in csv.reader(lines, delimiter=mark)]
    header = [name.lower() for name in rows[0]]
    for name in header:
        if name not in _COLUMNS:
            raise InputError(f"{table.name}: unknown column {name!r}; must be among {', '.join(_COLUMNS)}")
    for name in ("test", "recording"):
        if name not in header:
            raise InputError(f"{table.name}: must have a column {name!r}")
    tests = []
    for number, cells in enumerate(rows[1:], start=2):
        row = dict(zip(header, cells, strict=False))
        where = f"{table.name}, row {number}"
        recording = folder / row["recording"]
        if not recording.exists() and "*" not in recording.name:
            raise InputError(f"{where}: recording {row['recording']!r} is not in {folder}")
        vibrometer = folder / row["vibrometer"] if row.get("vibrometer") else None
        if vibrometer is not None and not vibrometer.exists():
            raise InputError(f"{where}: vibrometer {row['vibrometer']!r} is not in {folder}")
        place = _number(row.get("location"), mark, where, "location")
        tests.append(
            Test(
                row["test"],
                recording,
                vibrometer,
                _number(row.get("frequency_hz"), mark, where, "frequency_hz"),
                _number(row.get("velocity_m_s"), mark, where, "velocity_m_s"),
                None if place is None else within(f"{where}: location", place, 0.0, 1.0),
            )
        )
    names = [test.name for test in tests]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None or "" in names:
        raise InputError(f"{table.name}: test {twice!r} stands twice; each must have a name of its own")
    return tests


def _number(cell: str | None, mark: str, where: str, column: str) -> float | None:
    if not cell:
        return None
    text = cell.replace(",", ".") if mark != "," else cell
    try:
        return positive(f"{where}: {column}", float(text))
    except ValueError as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{where}: {column} = {shown(cell)}: must be a number") from None
