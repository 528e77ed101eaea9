"""From rows of pixels to a labelled dataset: the common scale of beam and shaker, errors and diagnostics."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.findings import Diagnostic, to_json
from snapbeam.core.validate import InputError
from snapbeam.lab.camera.recording import Recording
from snapbeam.lab.plausibility.tracking import (
    SeenMotion,
    contact_shift,
    never_touching,
    rounding_shift,
    tracking_findings,
)
from snapbeam.lab.tracking.edges import Floats
from snapbeam.lab.tracking.flags import FrameFlag
from snapbeam.lab.tracking.geometry import Orientation
from snapbeam.lab.tracking.measure.follower import TrackedRows
from snapbeam.lab.tracking.measure.series import Rest, find_rest, touching
from snapbeam.lab.tracking.scene import Fields, NoiseShape, Scene
from snapbeam.lab.tracking.settings import TrackingSettings
from snapbeam.lab.tracking.survey.edge_shape import CLIPPED
from snapbeam.runs.schema import trajectory_dataset

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["tracked_dataset"]

_CLIPPED_ERROR = 0.05  # px; an overexposed edge is sharper than pixels can follow


def tracked_dataset(
    rows: TrackedRows,
    recording: Recording,
    scene: Scene,
    settings: TrackingSettings,
    drift: float,
    fields: Fields,
) -> xr.Dataset:
    """The dataset of a tracked recording; see :func:`snapbeam.lab.track` for its variables.

    *drift* [px] is the largest shift of the camera that was taken out, *fields* what is seen of interlaced video.
    """
    rows = _as_filtered(rows, scene.noise, fields)
    rest = find_rest(rows.row, rows.error, rows.shaker, settings.rest_range(rows.row.size))
    if not rest.indices.size:
        raise InputError(
            f"{recording.path}: the beam was found in none of the frames at rest; set rest_frames (--rest-frames)"
        )
    turn = Orientation(settings.side, recording.shape)
    scale = recording.pixel_size * 1e3
    beam, shaker = scene.beam, scene.shaker
    beam_mm = settings.rest * 1e3 - turn.sign * scale * (rows.row - rest.row)
    tip = rows.shaker + (shaker.tip_offset if shaker is not None else np.nan)
    shaker_mm = settings.rest * 1e3 - turn.sign * scale * (tip - beam.thickness - rest.row)
    closing_mm = turn.sign * (shaker_mm - beam_mm)
    offset = _offset_error(rows.row, rest)
    penetration = closing_mm / scale
    touch = touching(penetration, np.hypot(rows.error, rows.shaker_error), rows.row)
    seen = SeenMotion(rows, rest, penetration, touch, scale, drift, fields)
    diagnostics = (*recording.diagnostics, *tracking_findings(scene, seen, settings, scale * offset))
    # a shift of the edges by the camera's curve moves the shaker against the beam, not the beam against itself
    placed = scene.placed_error
    bent = math.hypot(2.0 * scene.shape.shift, contact_shift(touch, placed), placed)
    bent = math.hypot(bent, never_touching(penetration, rows.row), rounding_shift(scene.beam))
    # an edge that is no blurred step is found a little off, by where in its pixel it lies
    misfit = 0.7 * float(np.nan_to_num(scene.shape.misfit))
    if scene.shape.clipped > CLIPPED:
        misfit = max(misfit, _CLIPPED_ERROR)
    rounded = 0.5 * rounding_shift(scene.beam)
    common = math.hypot(offset, recording.edge_error, misfit, rounded, scene.noise.made_up)
    beam_error = np.hypot(rows.error, common)
    shaker_error = np.hypot(rows.shaker_error, math.hypot(common, bent))
    valid = np.isfinite(beam_mm) & (np.isfinite(shaker_mm) if shaker is not None else True)
    scaled: dict[str, NDArray] = {}
    if settings.buckling_level is not None:
        unit = settings.buckling_level * 1e3
        scaled["displacement_at_striker"] = beam_mm / unit
        if shaker is not None:
            scaled["striker_displacement"] = shaker_mm / unit
            scaled["penetration_normalised"] = closing_mm / unit
    time = np.arange(rows.row.size) / recording.frame_rate
    attrs = _attributes(recording, scene, settings, rest, diagnostics)
    dataset = trajectory_dataset(time, attrs=attrs, valid=valid, **scaled)
    own = {
        "displacement_mm": (beam_mm, "mm", "beam displacement at the shaker"),
        "displacement_stderr_mm": (scale * beam_error, "mm", "standard error of the beam displacement"),
        "confidence": (rows.confidence, "1", "confidence, 0 to 1"),
        "flags": (rows.flags, "1", "what is wrong with the frame (FrameFlag)"),
        "edge_width": (rows.width, "px", "width of the beam's edge"),
        "beam_row": (rows.row, "px", "row of the beam's far edge at the contact column"),
        "beam_slope": (rows.slope, "1", "slope of the beam's far edge"),
        "beam_row_stderr": (rows.error, "px", "noise of the beam's row, standard error"),
    }
    if shaker is not None:
        own["shaker_displacement_mm"] = (shaker_mm, "mm", "shaker displacement")
        own["penetration_mm"] = (closing_mm, "mm", "penetration_normalised")
        own["shaker_stderr_mm"] = (scale * shaker_error, "mm", "standard error of the shaker displacement")
        own["tip_row"] = (tip, "px", "row of the shaker's tip at the contact column")
        own["tip_row_stderr"] = (rows.shaker_error, "px", "noise of the tip's row, standard error")
        if shaker.sticker is not None:
            own["marker_row"] = (rows.shaker, "px", "row of the middle of the sticker")
    for name, (values, units, long_name) in own.items():
        dataset[name] = ("time", values, {"units": units, "long_name": long_name})
    dataset["flags"].attrs["flag_masks"] = [int(flag) for flag in FrameFlag if flag]
    dataset["flags"].attrs["flag_meanings"] = " ".join(str(flag.name).lower() for flag in FrameFlag if flag)
    return dataset


def _as_filtered(rows: TrackedRows, noise: NoiseShape, fields: Fields) -> TrackedRows:
    """The rows with errors of pictures that were averaged over frames, smoothed or interlaced, where that is seen."""
    lag = noise.lag + fields.lag

    def widened(row: Floats, error: Floats) -> Floats:
        step = np.abs(np.diff(row, prepend=np.nan, append=np.nan))
        most = np.nan_to_num(np.fmax(step[1:], step[:-1]))
        return np.hypot(np.hypot(noise.factor * error, lag * most), fields.shift)

    if lag == 0.0 and noise.factor == 1.0 and fields.shift == 0.0:
        return rows
    return dataclasses.replace(
        rows, error=widened(rows.row, rows.error), shaker_error=widened(rows.shaker, rows.shaker_error)
    )


def _offset_error(row: Floats, rest: Rest) -> float:
    """Standard error [px] of the row at rest; the range of the motion where the rest was not recorded."""
    if rest.found:
        return rest.error
    known = row[np.isfinite(row)]
    return float(np.ptp(known)) if known.size else float("nan")


def _attributes(
    recording: Recording,
    scene: Scene,
    settings: TrackingSettings,
    rest: Rest,
    diagnostics: tuple[Diagnostic, ...],
) -> dict[str, Any]:
    beam, shaker = scene.beam, scene.shaker
    attrs: dict[str, Any] = {
        "title": "displacement of beam and shaker from a high-speed recording",
        "source": recording.path.name,
        "frame_rate": recording.frame_rate,
        "pixel_size": recording.pixel_size,
        "region": list(recording.region),
        "exposure": np.nan if recording.exposure is None else recording.exposure,
        "side": settings.side,
        "objects": "bright" if beam.bright else "dark",
        "threshold": beam.threshold,
        "contrast": beam.contrast,
        "noise": beam.noise,
        "snr_db": float(20.0 * np.log10(beam.contrast / beam.noise)),
        "edge_width": beam.edge_width,
        "edge_misfit": scene.shape.misfit,
        "edge_gamma": scene.shape.gamma,
        "edge_shift_px": scene.shape.shift,
        "saturated_share": scene.shape.clipped,
        "beam_thickness_px": beam.thickness,
        "contact_column": beam.contact_column,
        "beam_columns": beam.columns.tolist(),
        "shaker_mark": "none" if shaker is None else shaker.mark,
        "tip_offset": np.nan if shaker is None else shaker.tip_offset,
        "tip_source": "no shaker" if shaker is None else shaker.tip_source,
        "rest_displacement": settings.rest,
        "rest_frames": int(rest.indices.size),
        "rest_row": rest.row,
        "location": settings.location,
        "diagnostics": to_json(diagnostics),
    }
    if settings.buckling_level is not None:
        attrs["buckling_level"] = settings.buckling_level
    if shaker is not None and shaker.sticker is not None:
        attrs["marker_thickness"] = shaker.sticker.thickness
        attrs["marker_columns"] = shaker.sticker.columns.tolist()
    return attrs
