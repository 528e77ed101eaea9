"""How well a recording was tracked, in numbers and in words."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from snapbeam.core.findings import diagnostics_of
from snapbeam.core.validate import InputError, InputTypeError
from snapbeam.lab.tracking.flags import FrameFlag

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["tracking_quality", "tracking_report"]


def check_tracked(dataset: xr.Dataset) -> xr.Dataset:
    """Return *dataset* if it came from :func:`snapbeam.lab.track`; refuse it if not."""
    import xarray as xr

    if not isinstance(dataset, xr.Dataset):
        raise InputTypeError(f"dataset: must be an xarray.Dataset, not {type(dataset).__name__}")
    names = (
        "time",
        "displacement_mm",
        "displacement_stderr_mm",
        "flags",
        "confidence",
        "beam_row",
        "beam_slope",
    )
    missing = [name for name in names if name not in dataset.variables]
    missing += [name for name in ("pixel_size", "frame_rate", "side") if name not in dataset.attrs]
    if missing:
        raise InputError(f"dataset without {', '.join(missing)}: must come from track()")
    return dataset


def tracking_quality(dataset: xr.Dataset) -> dict[str, Any]:
    """Figures of merit of a tracked recording.

    Returns
    -------
    dict
        ``frames``; ``measured_share`` and ``flagged_share``; ``counts`` by name of flag; ``longest_gap`` in
        frames; ``beam_stderr_px`` and ``shaker_stderr_px`` (medians; NaN without a shaker); ``confidence``
        (median); ``largest_step_px``, the most the beam moved between frames; ``snr_db``; ``edge_width``.
    """
    dataset = check_tracked(dataset)
    flags = dataset["flags"].values.astype(int)
    measured = np.isfinite(dataset["displacement_mm"].values)
    shaker = "shaker_displacement_mm" in dataset
    if shaker:
        measured &= np.isfinite(dataset["shaker_displacement_mm"].values)
    pixel = dataset.attrs["pixel_size"] * 1e3
    runs = np.diff(np.flatnonzero(np.concatenate([[True], measured, [True]]))) - 1
    steps = np.abs(np.diff(dataset["displacement_mm"].values)) / pixel
    return {
        "frames": int(flags.size),
        "measured_share": float(measured.mean()),
        "flagged_share": float((flags != 0).mean()),
        "counts": {
            str(flag.name).lower().replace("_", " "): int(((flags & int(flag)) != 0).sum())
            for flag in FrameFlag
            if flag
        },
        "longest_gap": int(runs.max()),
        "beam_stderr_px": _median(dataset["displacement_stderr_mm"].values / pixel),
        "shaker_stderr_px": _median(dataset["shaker_stderr_mm"].values / pixel) if shaker else float("nan"),
        "confidence": _median(dataset["confidence"].values),
        "largest_step_px": float(np.nanmax(steps)) if np.isfinite(steps).any() else float("nan"),
        "snr_db": float(dataset.attrs["snr_db"]),
        "edge_width": float(dataset.attrs["edge_width"]),
    }


def _median(values: np.ndarray) -> float:
    return float(np.nanmedian(values)) if np.isfinite(values).any() else float("nan")


def tracking_report(dataset: xr.Dataset, *, diagnostics: bool = True) -> str:
    """The quality of a tracked recording in plain lines: advice for every kind of trouble met, and *diagnostics*."""
    quality = tracking_quality(dataset)
    attrs = dataset.attrs
    pixel = attrs["pixel_size"] * 1e6
    lines = [
        f"{quality['frames']} frames at {attrs['frame_rate']:g} Hz, {pixel:g} um per pixel; "
        f"{100 * quality['measured_share']:.2f} % measured, {100 * quality['flagged_share']:.2f} % flagged",
        f"signal to noise {quality['snr_db']:.1f} dB, edge width {quality['edge_width']:.2f} px, beam "
        f"{attrs['beam_thickness_px'] * pixel * 1e-3:.3f} mm thick, "
        f"shaker followed by: {attrs['shaker_mark']}",
        f"standard error: beam {quality['beam_stderr_px']:.3f} px"
        + (
            ""
            if np.isnan(quality["shaker_stderr_px"])
            else f", shaker {quality['shaker_stderr_px']:.3f} px (tip: {attrs['tip_source']})"
        ),
    ]
    if quality["largest_step_px"] > 0.0:
        lines.append(f"the beam moved at most {quality['largest_step_px']:.1f} px between frames")
    for name, count in quality["counts"].items():
        if count:
            flag = FrameFlag[name.upper().replace(" ", "_")]
            lines.append(f"{name}: {count} frame{'s' if count > 1 else ''} - {flag.advice}")
    if quality["longest_gap"]:
        lines.append(f"longest stretch without a measurement, in frames: {quality['longest_gap']}")
    lines += [str(diagnostic) for diagnostic in diagnostics_of(dataset)] if diagnostics else []
    return "\n".join(lines)
