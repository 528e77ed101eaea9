"""Collecting the measurements of all frames, with every frame's trouble on record."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.lab.tracking.edges import Floats
from snapbeam.lab.tracking.flags import FrameFlag
from snapbeam.lab.tracking.geometry import HOT
from snapbeam.lab.tracking.measure.beam import BeamRows
from snapbeam.lab.tracking.measure.series import distortion, jumps, pooled, unexplained_blur, wanderings
from snapbeam.lab.tracking.measure.sticker import ShakerRows
from snapbeam.lab.tracking.scene import Scene

__all__ = ["Drift", "Follower", "TrackedRows"]

_SMEARED = 0.25  # error over what edges are wider than explained

BORDER = 14.0  # rows from the border within which a vanished object is taken to have left the region
KEPT = 0.5  # px by which a beam may look distorted and its row still be kept, with that as its error


@dataclass(frozen=True)
class TrackedRows:
    """Rows [px, turned picture] of the whole recording, one entry a frame number.

    ``shaker`` is the row of its reference; ``width`` that of the beam's edge; NaN and a flag where nothing
    was measured.  Errors are standard errors.
    """

    row: Floats
    error: Floats
    slope: Floats
    width: Floats
    shaker: Floats
    shaker_error: Floats
    confidence: Floats
    flags: NDArray[np.uint16]

    def flagged(self, flag: FrameFlag) -> int:
        """How many frames carry a flag."""
        return int(np.count_nonzero(self.flags & int(flag)))


class Drift(NamedTuple):
    """Rows by which the camera has sunk in each frame [px], NaN where no mark was seen, and their errors."""

    shift: Floats
    error: Floats


class Follower:
    """Collects the measurements of batch after batch and says what is wrong with each frame."""

    def __init__(self, scene: Scene, blur_limit: float | None) -> None:
        self.scene = scene
        self.blur_limit = 2.5 * scene.beam.edge_width + 0.5 if blur_limit is None else blur_limit
        self._parts: list[dict[str, NDArray]] = []
        self._last: NDArray | None = None
        self._border = {"beam": False, "shaker": False}

    def add(
        self, frames: NDArray[np.floating], beam: BeamRows, tip: ShakerRows | None, drift: Drift | None
    ) -> None:
        """Add the measurements of a batch of turned frames; *drift* of the camera is taken out."""
        view, height = self.scene.beam, frames.shape[1]
        leaving = self._leaving("beam", beam.row, height)
        strip = frames[:, :, view.columns[::6]]
        lost = (beam.level_range < 0.25) & (~leaving | (np.ptp(strip, axis=(1, 2)) == 0.0))
        lost |= self._repeats(strip)
        flags = np.zeros(beam.row.shape, dtype=np.uint16)
        missing = ~np.isfinite(beam.row)
        hot = beam.saturated > view.hot_share + HOT
        hot |= missing & ((strip >= view.saturated).mean((1, 2)) > view.hot_share + 0.05)
        reasons = [
            (hot | (missing & (beam.contrast >= 1.8)), FrameFlag.GLARE),
            (beam.touches | beam.outside | leaving, FrameFlag.OUT_OF_REGION),
            ((beam.level_range < 0.6) | (beam.contrast <= 0.4), FrameFlag.LOW_CONTRAST),
        ]
        _assign(flags, missing & ~lost, reasons)
        with np.errstate(invalid="ignore"):
            flags[beam.width > self.blur_limit] |= np.uint16(FrameFlag.BLUR)
        confidence = beam.share * np.minimum(1.0, np.nan_to_num(beam.contrast))
        confidence *= np.minimum(1.0, view.edge_width / np.fmax(beam.width, view.edge_width))
        row = np.full(beam.row.shape, np.nan)
        error = row.copy()
        if tip is not None and self.scene.shaker is not None:
            row, error = tip.row.copy(), tip.error.copy()
            with np.errstate(invalid="ignore"):
                wide = beam.width > self.blur_limit
            if self.scene.shaker.sticker is None:  # the beam's light cannot be taken out of such windows
                row[wide] = np.nan
            else:
                error = np.where(wide, np.hypot(error, 0.2 * (beam.width - view.edge_width)), error)
            gone = ~np.isfinite(row) & ~lost & ~wide
            flags[gone & tip.merged] |= np.uint16(FrameFlag.MERGED)
            other = [
                ((tip.saturated > view.hot_share + HOT) | hot, FrameFlag.GLARE),
                (self._leaving("shaker", row + self.scene.shaker.lowest, height), FrameFlag.OUT_OF_REGION),
                (beam.level_range < 0.6, FrameFlag.LOW_CONTRAST),
            ]
            _assign(flags, gone & ~tip.merged, other)
            confidence = np.minimum(confidence, tip.share * np.clip(np.nan_to_num(tip.contrast), 0.0, 1.0))
            row[lost] = np.nan
        flags[lost] = FrameFlag.DROPPED
        shift, shift_error = (0.0, 0.0) if drift is None else drift
        flags[~lost & ~np.isfinite(shift)] |= np.uint16(FrameFlag.GAP)  # no mark was seen
        self._parts.append(
            {
                "row": np.where(lost, np.nan, beam.row) - shift,
                "error": np.where(
                    lost, np.nan, np.hypot(_with_blur(beam, view.edge_width, self.blur_limit), shift_error)
                ),
                "slope": np.where(lost, np.nan, beam.slope),
                "width": beam.width,
                "thickness": np.where(lost, np.nan, beam.thickness),
                "residual": np.where(lost, np.nan, beam.residual),
                "shaker": row - shift,
                "shaker_error": np.hypot(error, shift_error),
                "confidence": confidence,
                "flags": flags,
            }
        )

    def result(self, numbers: NDArray[np.int64]) -> TrackedRows:
        """All batches joined and held against each other; *numbers* are those of the frames."""
        found = {name: np.concatenate([part[name] for part in self._parts]) for name in self._parts[0]}
        found = _with_missing(found, numbers)
        flags, row, shaker = found["flags"], found["row"], found["shaker"]
        miss, odd = distortion(
            found["thickness"], found["residual"], found["width"], self.scene.beam.edge_width
        )
        odd &= np.isfinite(row)
        flags[odd] |= np.uint16(FrameFlag.DISTORTED)
        blur = unexplained_blur(row, found["width"], self.scene.beam.edge_width)
        error = np.hypot(
            pooled(found["error"]), np.where(odd, np.fmax(miss, _SMEARED * blur), _SMEARED * blur)
        )
        shaker_error = np.hypot(pooled(found["shaker_error"]), _SMEARED * blur)
        row[odd & (miss > KEPT)] = np.nan
        strays = jumps(row)
        row[strays] = np.nan
        flags[strays] |= np.uint16(FrameFlag.JUMP)
        if self.scene.shaker is not None:
            astray = jumps(shaker) | wanderings(shaker, ~np.isfinite(row))
            shaker[astray] = np.nan
            flags[astray] |= np.uint16(FrameFlag.JUMP)
        gone = ~np.isfinite(row) | (~np.isfinite(shaker) if self.scene.shaker is not None else False)
        return TrackedRows(
            row=row,
            error=np.where(np.isfinite(row), error, np.nan),
            slope=found["slope"],
            width=found["width"],
            shaker=shaker,
            shaker_error=np.where(np.isfinite(shaker), shaker_error, np.nan),
            confidence=np.where(gone, 0.0, found["confidence"]),
            flags=flags,
        )

    def _repeats(self, strip: NDArray[np.floating]) -> NDArray[np.bool_]:
        """Frames equal to the one before, which in a picture with noise cannot happen."""
        before = np.concatenate([strip[:1] + 1.0 if self._last is None else self._last[None], strip[:-1]])
        self._last = strip[-1].copy()
        if self.scene.beam.noise < 0.3:
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


def _with_blur(beam: BeamRows, usual: float, limit: float) -> Floats:
    """Standard errors of the beam's row, widened in frames whose edges are too wide for their windows."""
    with np.errstate(invalid="ignore"):
        wide = beam.width > limit
    return np.where(wide, np.hypot(beam.error, _SMEARED * (beam.width - usual)), beam.error)


def _assign(
    flags: NDArray[np.uint16], missing: NDArray[np.bool_], reasons: list[tuple[NDArray[np.bool_], FrameFlag]]
) -> None:
    """Give every missing frame its reasons, and a plain gap where none applies."""
    explained = np.zeros(flags.shape, dtype=bool)
    for where, flag in reasons:
        here = missing & where
        flags[here] |= np.uint16(flag)
        explained |= here
    flags[missing & ~explained] |= np.uint16(FrameFlag.GAP)


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
