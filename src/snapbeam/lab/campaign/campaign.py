"""A whole campaign: every test of a folder measured, kept, and written to one table."""

from __future__ import annotations

import csv
import dataclasses
import math
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

from snapbeam.core.files import atomic_path, check_writable
from snapbeam.core.validate import InputError
from snapbeam.lab.campaign.one_test import TestResult, kept_result, run_test
from snapbeam.lab.campaign.pairing import Test, find_tests
from snapbeam.lab.campaign.settings import CampaignSettings

__all__ = ["COLUMNS", "run_campaign", "write_table"]

COLUMNS = (
    "test", "recording", "vibrometer", "status", "frequency_hz", "frequency_se_hz", "velocity_m_s", "velocity_se_m_s",
    "location", "response_class", "zero_crossings", "cycles", "snr_db", "measured_share", "delay_s", "polarity", "gain",
    "diagnostics", "comment",
)  # fmt: skip


def run_campaign(
    folder: Path,
    settings: CampaignSettings,
    output: Path,
    *,
    table: Path | None = None,
    strict: bool = False,
    progress: Callable[[int, int, TestResult | None], None] | None = None,
) -> list[TestResult]:
    """Measure every test of a folder.

    Each test's tracked run (NetCDF) and result (JSON) are kept in ``output/tests`` as soon as they are there,
    and ``output/tests.csv`` is written anew after each; a test whose files and settings have not changed since
    is not measured again, so an interrupted campaign goes on where it was.

    Parameters
    ----------
    folder
        Recordings and vibrometer files.
    settings
        What all tests have in common.
    output
        Folder for the results; made if it is not there.
    table
        Which files are which test; by their names if left out.
    strict
        Whether a test with any doubtful diagnostic counts as spoiled.
    progress
        Called with (tests done, tests in all, the last one's result).

    Raises
    ------
    InputError
        If there is nothing to measure.  A test that cannot be measured is a row that says why.
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
        fingerprint = settings.fingerprint(*_files(test)) + _set(test)
        result = kept_result(kept / f"{test.name}.json", fingerprint)
        if result is None:
            result = run_test(test, settings, kept, fingerprint)
        results.append(strictly(result) if strict else result)
        write_table(output / "tests.csv", results)
        if progress is not None:
            progress(len(results), len(tests), results[-1])
    return results


def strictly(result: TestResult) -> TestResult:
    """A result that is spoiled if anything makes it doubtful."""
    if result.status != "measured" or not result.doubtful:
        return result
    words = next(words for _, severity, words in result.diagnostics if severity != "note")
    return dataclasses.replace(result, status="spoiled", reason=words)


def _files(test: Test) -> list[Path]:
    return [path for path in (test.recording, test.vibrometer) if path is not None]


def _set(test: Test) -> str:
    """What a table says of a test, for its fingerprint."""
    values = (test.frequency, test.velocity, test.location)
    return (
        ""
        if not any(values)
        else " " + " ".join("-" if value is None else f"{value:.12g}" for value in values)
    )


def write_table(path: Path, results: list[TestResult]) -> None:
    """Write the table of tests, as ``snapbeam compare`` reads it."""
    check_table(path)
    with atomic_path(path) as temporary, open(temporary, "w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        for result in results:
            values = asdict(result)
            values["diagnostics"] = " ".join(code for code, _, _ in result.diagnostics)
            values["comment"] = result.reason
            writer.writerow([_cell(values[name]) for name in COLUMNS])


def check_table(path: Path) -> Path:
    """Refuse, before any work, a table that cannot be written."""
    return check_writable(path, "output", begin=",".join(COLUMNS))


def _cell(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.9g}" if math.isfinite(value) else ""
    return str(value)
