"""From rows of pixels to a labelled dataset: flags, confidence and the common scale of beam and shaker."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.validate import InputError
from snapbeam.lab.camera.recording import Recording
from snapbeam.lab.tracking.beam_edge import BeamRows
from snapbeam.lab.tracking.edges import Floats
from snapbeam.lab.tracking.flags import FrameFlag
from snapbeam.lab.tracking.scene import HOT, Orientation, Scene, ShakerRows
from snapbeam.runs.schema import trajectory_dataset

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Follower", "tracked_dataset"]

BORDER = 14.0  # rows from the border within which a vanished object is taken to have left the region


class Follower:
    """Collects the measurements of batch after batch and says what is wrong with each frame."""

    def __init__(self, scene: Scene, blur_limit: float | None) -> None:
        self.scene = scene
        self.blur_limit = 2.5 * scene.edge_width + 0.5 if blur_limit is None else blur_limit
        self._parts: list[dict[str, NDArray]] = []
        self._last: NDArray | None = None
        self._border = {"beam": False, "shaker": False}

    def add(self, frames: NDArray[np.floating], beam: BeamRows, tip: ShakerRows | None) -> None:
        """Add the measurements of a batch of turned frames."""
        height = frames.shape[1]
        leaving = self._leaving("beam", beam.row, height)
        strip = frames[:, :, self.scene.beam_columns[::6]]
        lost = (beam.level_range < 0.25) & (~leaving | (np.ptp(strip, axis=(1, 2)) == 0.0))
        lost |= self._repeats(strip)
        flags = np.zeros(beam.row.shape, dtype=np.uint8)
        missing = ~np.isfinite(beam.row)
        hot = beam.saturated > HOT
        hot |= missing & ((strip >= self.scene.saturated).mean((1, 2)) > 0.05)
        reasons = [
            (hot | (missing & (beam.contrast >= 1.8)), FrameFlag.GLARE),
            (beam.touches | beam.outside | leaving, FrameFlag.OUT_OF_REGION),
            ((beam.level_range < 0.6) | (beam.contrast <= 0.4), FrameFlag.LOW_CONTRAST),
        ]
        _assign(flags, missing & ~lost, reasons)
        with np.errstate(invalid="ignore"):
            flags[beam.width > self.blur_limit] |= np.uint8(FrameFlag.BLUR)
        confidence = beam.share * np.minimum(1.0, np.nan_to_num(beam.contrast))
        confidence *= np.minimum(1.0, self.scene.edge_width / np.fmax(beam.width, self.scene.edge_width))
        row = np.full(beam.row.shape, np.nan)
        error = row.copy()
        if tip is not None:
            row, error = tip.row.copy(), tip.error.copy()
            gone = ~np.isfinite(row) & ~lost
            flags[gone & tip.merged] |= np.uint8(FrameFlag.MERGED)
            other = [
                ((tip.saturated > HOT) | hot, FrameFlag.GLARE),
                (self._leaving("shaker", row + self._lowest(), height), FrameFlag.OUT_OF_REGION),
                (beam.level_range < 0.6, FrameFlag.LOW_CONTRAST),
            ]
            _assign(flags, gone & ~tip.merged, other)
            confidence = np.minimum(confidence, tip.share * np.clip(np.nan_to_num(tip.contrast), 0.0, 1.0))
            row[lost] = np.nan
        flags[lost] = FrameFlag.DROPPED
        beam_row = np.where(lost, np.nan, beam.row)
        confidence[~np.isfinite(beam_row) | (~np.isfinite(row) if tip is not None else False)] = 0.0
        self._parts.append(
            {
                "row": beam_row,
                "error": np.where(lost, np.nan, beam.error),
                "slope": np.where(lost, np.nan, beam.slope),
                "width": beam.width,
                "shaker": row,
                "shaker_error": error,
                "confidence": confidence,
                "flags": flags,
            }
        )

    def result(self) -> dict[str, NDArray]:
        """All batches joined."""
        return {name: np.concatenate([part[name] for part in self._parts]) for name in self._parts[0]}

    def _lowest(self) -> float:
        """Rows from the shaker's reference to the lowest pixel needed."""
        if self.scene.marker_columns is None:
            return float(self.scene.tip_profile.max()) if self.scene.tip_profile.size else 0.0
        return self.scene.marker_thickness / 2.0

    def _repeats(self, strip: NDArray[np.floating]) -> NDArray[np.bool_]:
        """Frames equal to the one before, which in a picture with noise cannot happen."""
        before = np.concatenate([strip[:1] + 1.0 if self._last is None else self._last[None], strip[:-1]])
        self._last = strip[-1].copy()
        if self.scene.noise < 0.3:
            return np.zeros(strip.shape[0], dtype=bool)
        return (strip == before).all((1, 2))

    def _leaving(self, name: str, rows: Floats, height: int) -> NDArray[np.bool_]:
        """Whether the last position before each frame was near the border of the region."""
        near = np.where(np.isfinite(rows), (rows < BORDER) | (rows > height - 1 - BORDER), False)
        known = np.isfinite(rows)
        last = np.maximum.accumulate(np.where(known, np.arange(rows.size), -1))
        out = np.where(last >= 0, near[last], self._border[name])
        self._border[name] = bool(out[-1])
        return out


def _assign(
    flags: NDArray[np.uint8], missing: NDArray[np.bool_], reasons: list[tuple[NDArray[np.bool_], FrameFlag]]
) -> None:
    """Give every missing frame its reasons, and a plain gap where none applies."""
    explained = np.zeros(flags.shape, dtype=bool)
    for where, flag in reasons:
        here = missing & where
        flags[here] |= np.uint8(flag)
        explained |= here
    flags[missing & ~explained] |= np.uint8(FrameFlag.GAP)


def tracked_dataset(
    found: dict[str, NDArray],
    recording: Recording,
    scene: Scene,
    turn: Orientation,
    *,
    rest: float,
    rest_frames: int | None,
    buckling_level: float | None,
    location: float,
) -> xr.Dataset:
    """The dataset of a tracked recording; see :func:`snapbeam.lab.track` for its variables."""
    found = _with_missing(found, recording.numbers)
    scale = recording.pixel_size * 1e3
    used = _at_rest(found["row"], found["error"]) if rest_frames is None else np.arange(rest_frames)
    used = used[np.isfinite(found["row"][used])]
    if not used.size:
        raise InputError(
            f"{recording.path}: the beam was found in none of the frames at rest; set rest_frames"
        )
    origin = float(found["row"][used].mean())
    tip = found["shaker"] + scene.tip_offset
    beam_mm = rest * 1e3 - turn.sign * scale * (found["row"] - origin)
    shaker_mm = rest * 1e3 - turn.sign * scale * (tip - scene.thickness - origin)
    closing_mm = turn.sign * (shaker_mm - beam_mm)
    valid = np.isfinite(beam_mm) & (np.isfinite(shaker_mm) if scene.rod is not None else True)
    time = np.arange(found["row"].size) / recording.frame_rate
    attrs: dict[str, Any] = {
        "title": "displacement of beam and shaker from a high-speed recording",
        "source": recording.path.name,
        "frame_rate": recording.frame_rate,
        "pixel_size": recording.pixel_size,
        "region": list(recording.region),
        "exposure": np.nan if recording.exposure is None else recording.exposure,
        "side": turn.side,
        "objects": "bright" if scene.bright else "dark",
        "threshold": scene.threshold,
        "contrast": scene.contrast,
        "noise": scene.noise,
        "snr_db": float(20.0 * np.log10(scene.contrast / scene.noise)) if scene.noise > 0.0 else np.inf,
        "edge_width": scene.edge_width,
        "beam_thickness_px": scene.thickness,
        "contact_column": scene.contact_column,
        "beam_columns": scene.beam_columns.tolist(),
        "shaker_mark": "none" if scene.rod is None else "tip" if scene.marker_columns is None else "sticker",
        "tip_offset": scene.tip_offset,
        "tip_source": scene.tip_source,
        "rest_displacement": rest,
        "rest_frames": int(used.size),
        "location": location,
    }
    if scene.marker_columns is not None:
        attrs["marker_thickness"] = scene.marker_thickness
        attrs["marker_columns"] = scene.marker_columns.tolist()
    scaled: dict[str, NDArray] = {}
    if buckling_level is not None:
        attrs["buckling_level"] = buckling_level
        scaled["displacement"] = beam_mm / (buckling_level * 1e3)
        if scene.rod is not None:
            scaled["shaker_displacement"] = shaker_mm / (buckling_level * 1e3)
            scaled["penetration"] = closing_mm / (buckling_level * 1e3)
    dataset = trajectory_dataset(time, attrs=attrs, valid=valid, **scaled)
    own = {
        "displacement_mm": (beam_mm, "mm", "beam displacement at the shaker"),
        "displacement_stderr_mm": (scale * found["error"], "mm", "standard error of the beam displacement"),
        "confidence": (found["confidence"], "1", "confidence, 0 to 1"),
        "flags": (found["flags"].astype(np.uint8), "1", "what is wrong with the frame (FrameFlag)"),
        "edge_width": (found["width"], "px", "width of the beam's edge"),
        "beam_row": (found["row"], "px", "row of the beam's far edge at the contact column"),
        "beam_slope": (found["slope"], "1", "slope of the beam's far edge"),
    }
    if scene.rod is not None:
        own["shaker_displacement_mm"] = (shaker_mm, "mm", "shaker displacement")
        own["penetration_mm"] = (closing_mm, "mm", "penetration")
        own["shaker_stderr_mm"] = (
            scale * found["shaker_error"],
            "mm",
            "standard error of the shaker displacement",
        )
        own["tip_row"] = (tip, "px", "row of the shaker's tip at the contact column")
        if scene.marker_columns is not None:
            own["marker_row"] = (found["shaker"], "px", "row of the middle of the sticker")
    for name, (values, units, long_name) in own.items():
        dataset[name] = ("time", values, {"units": units, "long_name": long_name})
    dataset["flags"].attrs["flag_masks"] = [int(flag) for flag in FrameFlag if flag]
    dataset["flags"].attrs["flag_meanings"] = " ".join(str(flag.name).lower() for flag in FrameFlag if flag)
    return dataset


def _at_rest(row: Floats, error: Floats) -> NDArray[np.intp]:
    """Frames at the start before the beam departs, the first half of them."""
    known = np.flatnonzero(np.isfinite(row))
    if not known.size:
        return known
    noise = float(np.sqrt(np.nanmean(error[known] ** 2)))
    values = row[known]
    before = np.cumsum(values)[:-1] / np.arange(1, known.size)
    gone = np.abs(values[1:] - before) > 3.0 * noise + 1e-6
    quiet = int(gone.argmax()) + 1 if gone.any() else known.size
    return known[: (quiet + 1) // 2]


def _with_missing(found: dict[str, NDArray], numbers: NDArray[np.int64]) -> dict[str, NDArray]:
    """Make room for frames absent from the numbering, marked as dropped."""
    length = int(numbers[-1]) + 1
    if length == numbers.size:
        return found
    out: dict[str, NDArray] = {}
    for name, values in found.items():
        empty = FrameFlag.DROPPED if name == "flags" else 0.0 if name == "confidence" else np.nan
        out[name] = np.full(length, empty, dtype=values.dtype)
        out[name][numbers] = values
    return out
