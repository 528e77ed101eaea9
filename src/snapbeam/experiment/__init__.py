"""The laboratory: recordings, vibrometer signals, identification, calibration and comparison.

The public names are loaded when they are first used, so that none of the laboratory's libraries is needed before.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

_HOMES = {
    "Alignment": "alignment",
    "align": "alignment",
    "Calibration": "calibration",
    "ContactTest": "calibration",
    "Measurements": "calibration",
    "calibrate": "calibration",
    "load_measurements": "calibration",
    "MeasuredDots": "compare",
    "compare_dots": "compare",
    "compare_waveforms": "compare_runs",
    "write_photron": "export",
    "write_video": "export",
    "compare_wells": "identification",
    "identify_decay": "identification",
    "MeasuredResponse": "measured_response",
    "measure_response": "measured_response",
    "FrameFlag": "flags",
    "contact_onsets": "onsets",
    "tracking_quality": "quality",
    "tracking_report": "quality",
    "recorded_drive": "drive_record",
    "Recording": "recording",
    "open_recording": "recording",
    "read_channels": "signal_files",
    "read_signal": "signal_files",
    "write_signal": "signal_files",
    "from_sep5": "signals",
    "make_signal": "signals",
    "to_sep5": "signals",
    "SineFit": "sine_fit",
    "fit_sine": "sine_fit",
    "SyntheticCamera": "synthetic",
    "SyntheticStage": "synthetic",
    "render_recording": "synthetic",
    "render_run": "synthetic_run",
    "render_vibrometer": "synthetic_run",
    "track": "tracking",
    "DriveMeasurement": "vibrometer",
    "displacement_from_velocity": "vibrometer",
    "measure_drive": "vibrometer",
}

__all__ = sorted(_HOMES)


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return __all__
