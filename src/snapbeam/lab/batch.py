"""A test series: every test of a folder measured, kept, and written to one table."""

from __future__ import annotations

import csv
import hashlib
import html
import json
import math
import os
import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, field, replace
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

import numpy as np

from snapbeam._version import __version__
from snapbeam.lab.camera import open_recording
from snapbeam.lab.drive_alignment import Alignment, align
from snapbeam.lab.image_sources import IMAGE_SUFFIXES, RECORDING_SUFFIXES
from snapbeam.lab.signal_files import read_signal
from snapbeam.lab.signal_formats import READERS
from snapbeam.lab.tracking.settings import TrackingSettings
from snapbeam.lab.tracking.track import track
from snapbeam.lab.vibrometer import DriveMeasurement, measure_drive, shaker_signal
from snapbeam.lab.waveform_comparison import LEAST_CYCLES, TOO_SHORT, measure_response
from snapbeam.util.diagnostics import Diagnostic, Severity, diagnostics_of
from snapbeam.util.files import atomic_path, check_writable
from snapbeam.util.input_files import decoded, input_bytes, read_toml, rows_of_table
from snapbeam.util.netcdf import write_netcdf
from snapbeam.util.status_codes import ResponseClass
from snapbeam.util.validation import InputError, instance, integer, positive, require_texts, shown, within

if TYPE_CHECKING:
    import xarray as xr


_HEADERS = (".cih", ".cihx")
_SIGNALS = tuple(suffix for suffix in READERS if suffix not in (".h5", ".hdf5", ".npy", ".nc"))
_WORDS = (
    r"[-_ ]?(?<![a-z])(vibrometer|vibro|vib|velocity|vel|laser|ldv|drive|shaker|camera|cam|recording|rec|video)"
    r"(?![a-z])"
)
_COLUMNS = ("test", "recording", "vibrometer", "frequency_hz", "velocity_m_s", "location", "comment")
_CAMERA = ("frame_rate", "pixel_size", "region", "frames")
_SIGNAL = ("channel", "units", "sensitivity", "sampling_frequency", "columns")
_KNOWN = {"camera": _CAMERA, "signal": _SIGNAL}
_NAN = math.nan
COLUMNS = (
    "test", "recording", "vibrometer", "status", "frequency_hz", "frequency_se_hz", "velocity_m_s", "velocity_se_m_s",
    "location", "response_class", "zero_crossings", "cycles", "snr_db", "measured_share", "delay_s", "polarity", "gain",
    "diagnostics", "comment",
)  # fmt: skip
PAGE_START = "<!DOCTYPE html>\n<!-- test series, written by snapbeam -->\n"
"""First lines of a page, by which it is known."""
_PAGE = """<html lang="en"><head><meta charset="utf-8"><title>{title}</title>
<style>
body {{ font-family: sans-serif; margin: 2em; }}
table {{ border-collapse: collapse; font-size: 85%; }}
td, th {{ border: 1px solid #ccc; padding: .3em .5em; text-align: left; }}
th {{ position: sticky; top: 0; background: #eee; }}
img {{ max-width: 100%; display: block; margin: 1em 0; }}
</style></head><body>
<h1>{title}</h1>
<p>{words}</p>
{pictures}
{table}
</body></html>
"""


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
    such as "vib", "velocity_at_striker" or "camera".  A folder of numbered images is a recording, but not *besides*,
    such as that of the results.  *table* is a text table with the columns test, recording, and, as far as known,
    vibrometer, frequency_hz, velocity_m_s, location and comment.
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
        elif suffix in _SIGNALS and path.name not in ("tests.csv", "test_series.csv"):
            _put(signals, path, path.stem)
    if not recordings:
        raise InputError(f"{folder}: holds no recording ({', '.join(RECORDING_SUFFIXES)}, or a folder of images)")
    return [Test(name, path, signals.get(name)) for name, path in recordings.items()]


def _put(known: dict[str, Path], path: Path, stem: str) -> None:
    name = re.sub(_WORDS, "", stem, flags=re.IGNORECASE).strip("-_ ") or stem
    if name in known:
        raise InputError(
            f"{path.name} and {known[name].name}: both would be of test {name!r}; rename one, or give a table (--table)"
        )
    known[name] = path


def _from_table(folder: Path, table: Path) -> list[Test]:
    text = decoded(input_bytes("table (--table)", table), table.name)
    mark, header, rows = rows_of_table(text, table.name, _COLUMNS)
    for name in ("test", "recording"):
        if name not in header:
            raise InputError(f"{table.name}: must have a column {name!r}")
    tests = []
    for number, cells in rows:
        where = f"{table.name}, line {number}"
        row = dict(zip(header, cells, strict=True))
        for name in ("test", "recording"):
            if not row[name]:
                raise InputError(f"{where}: {name} is empty; must name the {name}")
        files = [folder / row[name] if row.get(name) else None for name in ("recording", "vibrometer")]
        for file in files:
            if file is not None and not file.exists() and not (file is files[0] and "*" in file.name):
                kind = "recording" if file is files[0] else "vibrometer"
                raise InputError(f"{where}: {kind} {row[kind]!r} is not in {folder}")
        stated = ("location", "frequency_hz", "velocity_m_s")
        place, frequency, velocity = (_number(row.get(name), mark, where, name) for name in stated)
        if place is not None:
            within(f"{where}: location", place, 0.0, 1.0)
        tests.append(Test(row["test"], folder / row["recording"], files[1], frequency, velocity, place))
    names = [test.name for test in tests]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
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


@dataclass(frozen=True)
class SeriesSettings:
    """Settings of every test.

    ``camera`` and ``signal`` are arguments of :func:`snapbeam.lab.open_recording` and :func:`snapbeam.lab.read_signal`;
    ``tracking`` must have the buckling level, for the response; ``cycles`` is the number of cycles for its class, of
    which the rule needs 20; ``operator`` the name of the person who measured.
    """

    camera: Mapping[str, Any] = field(default_factory=dict)
    tracking: TrackingSettings = field(default_factory=TrackingSettings)
    signal: Mapping[str, Any] = field(default_factory=dict)
    cycles: int = 200
    operator: str = ""

    def __post_init__(self) -> None:
        for name in _KNOWN:
            _check_keys(name, getattr(self, name))
        object.__setattr__(self, "cycles", integer("cycles", self.cycles, LEAST_CYCLES))
        require_texts("operator", instance("operator", self.operator, str, "text"))
        if self.tracking.buckling_level is None:
            raise InputError("buckling_level (--buckling-level): must be given, in m, or no response can be told")
        if not self.tracking.shaker:
            raise InputError("shaker: must be followed in a test series")

    def fingerprint(self, *files: Path) -> str:
        """A number that changes with any setting and any of the files."""
        parts = [__version__]
        parts += [repr(sorted(one.items())) for one in (self.camera, vars(self.tracking), self.signal)]
        parts.append(repr((self.cycles, self.operator)))
        for file in files:
            for one in sorted(file.iterdir()) if file.is_dir() else [file, file.with_suffix(".mraw")]:
                if one.exists():
                    state = one.stat()
                    parts.append(f"{one.name} {state.st_size} {state.st_mtime_ns}")
        return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:24]


def _check_keys(name: str, values: Mapping[str, Any]) -> None:
    for key in values:
        if key not in _KNOWN[name]:
            raise InputError(f"{name} {key}: unknown; must be among {', '.join(_KNOWN[name])}")


def read_settings(path: Path | None, changes: Mapping[str, Mapping[str, Any]]) -> dict[str, dict[str, Any]]:
    """Sections camera, tracking, signal and test_series of a TOML file, and changes, which go first."""
    sections: dict[str, dict[str, Any]] = {"camera": {}, "tracking": {}, "signal": {}, "test_series": {}}
    for name, values in () if path is None else read_toml("settings", path).items():
        if name not in sections or not isinstance(values, dict):
            raise InputError(f"{path}: [{name}]: unknown section; must be among {', '.join(sections)}")
        sections[name] |= values
    for name, given in changes.items():
        sections[name] |= {key: value for key, value in given.items() if value is not None}
    for key in sections["test_series"]:
        if key not in ("cycles", "operator"):
            raise InputError(f"[test_series] {key}: unknown; must be cycles or operator")
    for name in _KNOWN:
        _check_keys(name, sections[name])
    for name, value in sections["camera"].items():
        sections["camera"][name] = tuple(value) if isinstance(value, list) else value
    return sections


def load_settings(path: Path | None, changes: Mapping[str, Mapping[str, Any]]) -> SeriesSettings:
    """Settings of a test series from a TOML file and changes; see :func:`read_settings`."""
    sections = read_settings(path, changes)
    tracking = TrackingSettings().changed(**sections["tracking"])
    return SeriesSettings(sections["camera"], tracking, sections["signal"], **sections["test_series"])


@dataclass(frozen=True)
class TestResult:
    """One row of the table of tests.

    ``status`` is "measured"; "too short" where only the response class is unknown, since too few cycles were
    recorded; or "spoiled" where the test gives no number to be trusted.  For the latter two ``reason`` says why; ``diagnostics`` are those of camera, vibrometer and alignment, as codes and words.  Numbers that
    were not measured are NaN.
    """

    __test__ = False  # no test of pytest's

    test: str
    recording: str
    vibrometer: str
    status: str
    reason: str
    frequency_hz: float = _NAN
    frequency_se_hz: float = _NAN
    velocity_m_s: float = _NAN
    velocity_se_m_s: float = _NAN
    location: float = _NAN
    response_class: str = ResponseClass.UNKNOWN.label
    zero_crossings: int = 0
    cycles: float = _NAN
    snr_db: float = _NAN
    measured_share: float = _NAN
    delay_s: float = _NAN
    polarity: float = _NAN
    gain: float = _NAN
    diagnostics: tuple[tuple[str, str, str], ...] = ()
    fingerprint: str = ""

    @property
    def doubtful(self) -> bool:
        """True if any diagnostic has a severity above INFO."""
        return any(severity != Severity.INFO.value for _, severity, _ in self.diagnostics)


def kept_result(path: Path, fingerprint: str) -> TestResult | None:
    """A result kept from before, if it is of the same files and settings."""
    try:
        values = json.loads(path.read_text(encoding="utf-8"))
        if values.get("fingerprint") != fingerprint:
            return None
        values["diagnostics"] = tuple((str(a), str(b), str(c)) for a, b, c in values["diagnostics"])
        filled: dict[str, Any] = {name: _NAN if value is None else value for name, value in values.items()}
        return TestResult(**filled)
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None


def run_test(test: Test, settings: SeriesSettings, folder: Path, fingerprint: str) -> TestResult:
    """Measure one test and keep its tracked run and its result in *folder*."""
    diagnostics: list[Diagnostic] = []
    try:
        result = _measured(test, settings, folder, diagnostics)
    except (InputError, OSError) as error:
        if isinstance(error, OSError):
            fingerprint = ""  # perhaps it can be read the next time
        # a message without the folder of the test's files
        reason = _wrong(diagnostics) or str(error).replace(f"{test.recording.parent}{os.sep}", "")
        result = _row(test, diagnostics, status="spoiled", reason=reason)
    result = replace(result, fingerprint=fingerprint)
    missing = {
        name: None for name, value in vars(result).items() if isinstance(value, float) and not math.isfinite(value)
    }
    plain = asdict(result) | missing
    with atomic_path(folder / f"{test.name}.json") as temporary:
        temporary.write_text(
            json.dumps(plain, indent=1, ensure_ascii=False), encoding="utf-8", errors="backslashreplace"
        )
    return result


def _row(test: Test, diagnostics: list[Diagnostic], **values: Any) -> TestResult:
    return TestResult(
        test=test.name,
        recording=test.recording.name,
        vibrometer=test.vibrometer.name if test.vibrometer is not None else "",
        diagnostics=tuple((one.code, one.severity.value, one.message) for one in diagnostics),
        **values,
    )


def _wrong(diagnostics: list[Diagnostic]) -> str:
    """The first diagnostic that leaves nothing to trust, in words; empty if there is none."""
    return next((one.message for one in diagnostics if one.severity is Severity.ERROR), "")


def _measured(test: Test, settings: SeriesSettings, folder: Path, diagnostics: list[Diagnostic]) -> TestResult:
    """The row of a test; *diagnostics* is filled as they come, for a test that ends half way."""
    tracking = settings.tracking
    if test.location is not None:
        tracking = tracking.changed(location=test.location)
    with open_recording(test.recording, **settings.camera) as recording:
        tracked = track(recording, tracking)
    if settings.operator:
        tracked.attrs["operator"] = settings.operator
    write_netcdf(tracked, folder / f"{test.name}.nc")
    diagnostics += diagnostics_of(tracked)
    seen = measure_drive(shaker_signal(tracked), test.frequency)
    drive, alignment = seen, None
    if test.vibrometer is not None:
        signal = read_signal(test.vibrometer, **settings.signal)
        drive = measure_drive(signal, test.frequency, amplitude=_stated(signal, test))
        diagnostics += drive.diagnostics
        alignment = align(shaker_signal(tracked), signal, test.frequency)
        diagnostics += alignment.diagnostics
    response = measure_response(
        tracked, drive.steady.frequency, cycles=settings.cycles, start=_start(seen, drive, alignment)
    )
    speed = 1.0 if drive.units == "m/s" else 2.0 * math.pi * drive.steady.frequency
    reason = _wrong(diagnostics)
    status = "spoiled" if reason else "measured"
    if not reason and response.response_class is ResponseClass.UNKNOWN:
        reason = "class not told: " + "; ".join(response.reasons)
        short = all(one.startswith(TOO_SHORT) for one in response.reasons)
        status = TOO_SHORT if short else "spoiled"
    valid = tracked["valid"].values.astype(bool)
    aligned: dict[str, float] = {}
    if alignment is not None:
        aligned = {"delay_s": alignment.delay, "polarity": alignment.polarity, "gain": alignment.gain}
    return _row(
        test,
        diagnostics,
        status=status,
        reason=reason,
        frequency_hz=drive.steady.frequency,
        frequency_se_hz=drive.steady.frequency_se,
        velocity_m_s=speed * drive.steady.amplitude,
        velocity_se_m_s=speed * drive.steady.amplitude_se,
        location=float(tracked.attrs["location"]),
        response_class=response.response_class.label,
        zero_crossings=response.zero_crossings,
        cycles=response.cycles,
        snr_db=drive.steady.sinad,
        measured_share=float(np.mean(valid)),
        **aligned,
    )


def _stated(signal: xr.DataArray, test: Test) -> float | None:
    """The amplitude that was set, in the unit of the signal, where the table gives it."""
    if test.velocity is None:
        return None
    if signal.attrs["units"] == "m/s":
        return test.velocity
    return None if test.frequency is None else test.velocity / (2.0 * math.pi * test.frequency)


def _start(seen: DriveMeasurement, drive: DriveMeasurement, alignment: Alignment | None) -> float | None:
    """Start of the excitation on the camera's clock [s]: the vibrometer's where both are aligned, else the camera's."""
    if alignment is not None and alignment.certain and drive.startup is not None:
        return drive.startup.onset + alignment.delay
    return None if seen.startup is None else seen.startup.onset


def run_test_series(
    folder: Path,
    settings: SeriesSettings,
    output: Path,
    *,
    table: Path | None = None,
    strict: bool = False,
    progress: Callable[[int, int, TestResult | None], None] | None = None,
) -> list[TestResult]:
    """Measure every test of a folder.

    Each test's tracked run (NetCDF) and result (JSON) are kept in ``output/tests`` as soon as they are there,
    and ``output/tests.csv`` is written again after each; a test whose files and settings have not changed since
    is not measured again, so an interrupted test series goes on where it was.  A test that cannot be measured has a row
    with the reason; with *strict*, one with any doubtful diagnostic counts as spoiled.  *table* says which files are
    which test, by their names if left out; *progress* is called with (tests done, tests in all, the last one's result).
    """
    tests = find_tests(folder, table, output)
    kept = output / "tests"
    try:
        kept.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"output = {str(output)!r}: cannot be made, {error.strerror}") from error
    check_table(output / "tests.csv")
    results: list[TestResult] = []
    if progress is not None:
        progress(0, len(tests), None)
    for test in tests:
        files = [path for path in (test.recording, test.vibrometer) if path is not None]
        stated = (test.frequency, test.velocity, test.location)
        words = " ".join("-" if value is None else f"{value:.12g}" for value in stated)
        fingerprint = settings.fingerprint(*files) + (f" {words}" if any(stated) else "")
        result = kept_result(kept / f"{test.name}.json", fingerprint)
        if result is None:
            result = run_test(test, settings, kept, fingerprint)
        if strict and result.doubtful and result.status != "spoiled":
            words = next(words for _, severity, words in result.diagnostics if severity != "info")
            result = replace(result, status="spoiled", reason=words)
        results.append(result)
        write_table(output / "tests.csv", results)
        if progress is not None:
            progress(len(results), len(tests), results[-1])
    return results


def write_table(path: Path, results: list[TestResult]) -> None:
    """Write the table of tests, as ``snapbeam compare`` reads it."""
    check_table(path)
    with (
        atomic_path(path) as temporary,
        open(temporary, "w", encoding="utf-8", errors="backslashreplace", newline="") as file,
    ):
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        writer.writerows(_row_of(result) for result in results)


def _row_of(result: TestResult) -> list[str]:
    """The cells of a test in the table."""
    values = asdict(result)
    values["diagnostics"] = " ".join(code for code, _, _ in result.diagnostics)
    values["comment"] = result.reason
    values |= {name: f"{x:.9g}" if math.isfinite(x) else "" for name, x in values.items() if isinstance(x, float)}
    return [str(values[name]) for name in COLUMNS]


def write_page(path: Path, results: list[TestResult], settings: SeriesSettings, pictures: Iterable[Path]) -> Path:
    """Write the table of tests as a page for a browser, with links to pictures in its folder."""
    import pandas as pd

    table = pd.DataFrame([_row_of(result) for result in results], columns=COLUMNS)
    counts = ", ".join(f"{count} {status}" for status, count in Counter(r.status for r in results).items())
    words = [f"{len(results)} tests: {counts}", f"snapbeam {__version__}", f"{datetime.now():%Y-%m-%d %H:%M}"]
    if settings.operator:
        words.insert(1, f"operator: {settings.operator}")
    images = [f'<img src="{quote(each.name)}" alt="{html.escape(each.stem)}">' for each in pictures]
    page = _PAGE.format(
        title=html.escape(f"Test series {path.resolve().parent.parent.name}"),
        words=html.escape("; ".join(words)),
        pictures="\n".join(images),
        table=table.to_html(index=False, border=0),
    )
    with atomic_path(path) as temporary:
        temporary.write_text(PAGE_START + page, encoding="utf-8", errors="backslashreplace")
    return path


def check_table(path: Path) -> Path:
    """Refuse, before any work, a table that cannot be written."""
    return check_writable(path, "output", begin=",".join(COLUMNS))
