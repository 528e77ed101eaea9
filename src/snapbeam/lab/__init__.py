"""The laboratory: recordings, vibrometer signals, identification, calibration and comparison.

The public names are loaded when they are first used, so that none of the laboratory's libraries is needed before.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

from snapbeam.core.findings import Diagnostic, DiagnosticError, Severity, diagnostics_of

_HOMES = {
    "Alignment": "drive.align",
    "align": "drive.align",
    "Calibration": "calibration.calibrate",
    "ContactTest": "calibration.calibrate",
    "Measurements": "calibration.calibrate",
    "calibrate": "calibration.calibrate",
    "stiffness_from_impacts": "calibration.impacts",
    "load_measurements": "calibration.calibrate",
    "MeasuredDots": "compare.maps",
    "compare_dots": "compare.maps",
    "compare_waveforms": "compare.waveforms",
    "write_photron": "camera.write",
    "write_video": "camera.write",
    "compare_wells": "decay.wells",
    "identify_decay": "decay.identify",
    "mode_shapes": "decay.shapes",
    "MeasuredResponse": "compare.response",
    "measure_response": "compare.response",
    "FrameFlag": "tracking.flags",
    "TrackingSettings": "tracking.settings",
    "pixel_size_from_marks": "camera.marks",
    "contact_onsets": "tracking.onsets",
    "tracking_quality": "tracking.quality",
    "tracking_report": "tracking.quality",
    "recorded_drive": "drive.record",
    "Recording": "camera.recording",
    "open_recording": "camera.recording",
    "read_channels": "signals.files",
    "read_signal": "signals.files",
    "write_signal": "signals.files",
    "make_signal": "signals.signal",
    "SineFit": "signals.sine_fit",
    "fit_sine": "signals.sine_fit",
    "Defects": "synthetic.defects",
    "SyntheticCamera": "synthetic.recording",
    "SyntheticStage": "synthetic.recording",
    "render_recording": "synthetic.recording",
    "render_run": "synthetic.run",
    "render_vibrometer": "synthetic.run",
    "track": "tracking.track",
    "DriveMeasurement": "drive.vibrometer",
    "displacement_from_velocity": "drive.displacement",
    "measure_drive": "drive.vibrometer",
}

__all__ = ["Diagnostic", "DiagnosticError", "Severity", "diagnostics_of", *sorted(_HOMES)]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return __all__
