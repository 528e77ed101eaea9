"""One test of a campaign: tracked, aligned with its vibrometer, classed; what went wrong said, never raised."""

from __future__ import annotations

import json
import math
import os
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from snapbeam.core.codes import ResponseClass
from snapbeam.core.files import atomic_path
from snapbeam.core.findings import Diagnostic, Severity, diagnostics_of
from snapbeam.core.netcdf import write_netcdf
from snapbeam.core.validate import InputError
from snapbeam.lab.camera.recording import open_recording
from snapbeam.lab.campaign.pairing import Test
from snapbeam.lab.campaign.settings import CampaignSettings
from snapbeam.lab.compare.response import measure_response
from snapbeam.lab.drive.align import Alignment, align
from snapbeam.lab.drive.seen import shaker_signal
from snapbeam.lab.drive.vibrometer import DriveMeasurement, measure_drive
from snapbeam.lab.signals.files import read_signal
from snapbeam.lab.tracking.track import track

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["TestResult", "kept_result", "run_test"]

_NAN = math.nan


@dataclass(frozen=True)
class TestResult:
    """One row of the table of tests.

    ``status`` is "measured", or "spoiled" where the test gives no number to be trusted, and then ``reason``
    says why; ``diagnostics`` are those of camera, vibrometer and alignment, as codes and words.  Numbers that
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
    crossings: int = 0
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
        """Whether any diagnostic is more than a note."""
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


def run_test(test: Test, settings: CampaignSettings, folder: Path, fingerprint: str) -> TestResult:
    """Measure one test and keep its tracked run and its result in *folder*."""
    diagnostics: list[Diagnostic] = []
    try:
        result = _measured(test, settings, folder, diagnostics)
    except (InputError, OSError) as error:
        if isinstance(error, OSError):
            fingerprint = ""  # perhaps it can be read the next time
        reason = _wrong(diagnostics) or _short(str(error), test)
        result = _row(
            test, status="spoiled", reason=reason, diagnostics=tuple(_plain(one) for one in diagnostics)
        )
    result = replace(result, fingerprint=fingerprint)
    plain = {
        name: None if isinstance(value, float) and not math.isfinite(value) else value
        for name, value in asdict(result).items()
    }
    with atomic_path(folder / f"{test.name}.json") as temporary:
        temporary.write_text(json.dumps(plain, indent=1, ensure_ascii=False), encoding="utf-8")
    return result


def _row(test: Test, **values: Any) -> TestResult:
    return TestResult(
        test=test.name,
        recording=test.recording.name,
        vibrometer=test.vibrometer.name if test.vibrometer is not None else "",
        **values,
    )


def _short(message: str, test: Test) -> str:
    """A message without the folder of the test's files."""
    return message.replace(f"{test.recording.parent}{os.sep}", "")


def _wrong(diagnostics: list[Diagnostic]) -> str:
    """The first diagnostic that leaves nothing to trust, in words; empty if there is none."""
    return next((one.message for one in diagnostics if one.severity is Severity.ERROR), "")


def _measured(
    test: Test, settings: CampaignSettings, folder: Path, diagnostics: list[Diagnostic]
) -> TestResult:
    """The row of a test; *diagnostics* is filled as they come, for a test that ends half way."""
    tracking = settings.tracking
    if test.location is not None:
        tracking = tracking.changed(location=test.location)
    with open_recording(test.recording, **settings.camera) as recording:
        tracked = track(recording, tracking)
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
    if not reason and response.response_class is ResponseClass.UNKNOWN:
        reason = "class not told: " + "; ".join(response.reasons)
    valid = tracked["valid"].values.astype(bool)
    return _row(
        test,
        status="spoiled" if reason else "measured",
        reason=reason,
        frequency_hz=drive.steady.frequency,
        frequency_se_hz=drive.steady.frequency_se,
        velocity_m_s=speed * drive.steady.amplitude,
        velocity_se_m_s=speed * drive.steady.amplitude_se,
        location=float(tracked.attrs["location"]),
        response=response.response_class.label,
        crossings=response.zero_crossings,
        cycles=response.cycles,
        snr_db=drive.steady.sinad,
        measured_share=float(np.mean(valid)),
        delay_s=_NAN if alignment is None else alignment.delay,
        polarity=_NAN if alignment is None else alignment.polarity,
        gain=_NAN if alignment is None else alignment.gain,
        diagnostics=tuple(_plain(one) for one in diagnostics),
    )


def _plain(diagnostic: Diagnostic) -> tuple[str, str, str]:
    return diagnostic.code, diagnostic.severity.value, diagnostic.message


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
