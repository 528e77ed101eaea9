"""Processing of experiments: recordings, vibrometer signals, free decays, calibration, comparison with simulations.

Each public name is loaded when it is first used, so that no library of this part is needed before.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

from snapbeam.util.diagnostics import Diagnostic, DiagnosticError, Severity, diagnostics_of

_HOMES = {
    "Alignment": "drive_alignment",
    "align": "drive_alignment",
    "Calibration": "calibration",
    "ContactTest": ".uncertainty.measurements",
    "Measurements": ".uncertainty.measurements",
    "calibrate": "calibration",
    "stiffness_from_impacts": "calibration",
    "load_measurements": ".uncertainty.measurements",
    "MapComparison": "map_comparison",
    "compare_measured_points": "map_comparison",
    "compare_waveforms": "waveform_comparison",
    "write_photron": "camera",
    "write_video": "camera",
    "compare_wells": "decay.model",
    "identify_decay": "decay.identify",
    "mode_shapes": "decay.model",
    "MeasuredResponse": "waveform_comparison",
    "measure_response": "waveform_comparison",
    "frequency_response": "coherence",
    "FrameFlag": "tracking.settings",
    "TrackingSettings": "tracking.settings",
    "pixel_size_from_marks": "camera",
    "contact_onsets": "tracking.track",
    "tracking_quality": "tracking.track",
    "tracking_report": "tracking.track",
    "recorded_drive": "drive_alignment",
    "full_field": "digital_image_correlation",
    "modal_amplitudes": "digital_image_correlation",
    "Recording": "camera",
    "open_recording": "camera",
    "read_channels": "signal_files",
    "read_signal": "signal_files",
    "read_spectra": "signal_formats",
    "write_signal": "signal_files",
    "make_signal": "signals",
    "SineFit": "sine_fit",
    "fit_sine": "sine_fit",
    "Defects": "synthetic",
    "SyntheticCamera": "synthetic",
    "SyntheticStage": "synthetic",
    "render_recording": "synthetic",
    "render_run": "synthetic",
    "render_vibrometer": "synthetic",
    "track": "tracking.track",
    "DriveMeasurement": "vibrometer",
    "displacement_from_velocity": "vibrometer",
    "measure_drive": "vibrometer",
}

__all__ = ["Diagnostic", "DiagnosticError", "Severity", "diagnostics_of", *sorted(_HOMES)]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f".{_HOMES[name]}", __name__), name)


def __dir__() -> list[str]:
    return __all__
