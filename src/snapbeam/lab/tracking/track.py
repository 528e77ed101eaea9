"""Following beam and shaker through a recording, with every frame's trouble on record."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.validate import instance
from snapbeam.lab.camera.marks import profile_shift
from snapbeam.lab.camera.recording import Recording
from snapbeam.lab.tracking.edges import Floats
from snapbeam.lab.tracking.geometry import Orientation
from snapbeam.lab.tracking.measure.beam import measure_beam
from snapbeam.lab.tracking.measure.fields import seen_fields
from snapbeam.lab.tracking.measure.follower import Drift, Follower
from snapbeam.lab.tracking.measure.shaker import measure_shaker
from snapbeam.lab.tracking.settings import TrackingSettings
from snapbeam.lab.tracking.survey.levels import pixel_noise, saturation_level
from snapbeam.lab.tracking.survey.survey import survey
from snapbeam.lab.tracking.tracked import tracked_dataset

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["track"]

_SAMPLE_PIXELS = 6_000_000
_HEAD = 8
_BATCH_PIXELS = 5_000_000


def track(
    recording: Recording,
    settings: TrackingSettings | None = None,
    *,
    progress: Callable[[int, int], None] | None = None,
    **changes: Any,
) -> xr.Dataset:
    """Measure the displacement of beam and shaker tip in every frame of a recording.

    A sample of frames is binarised (Otsu or a fixed threshold) to find the beam, the shaker and, on it, a
    sticker.  Then in every frame the beam's far edge, which the tip never covers, is fitted with a blurred
    step in several columns about the contact, and the shaker by its sticker, or without one by its tip in
    the columns where a gap remains.  The thickness of the beam and the way from sticker to tip, measured in
    the sample, turn both into one scale on which the penetration is zero when the edges coincide.

    Parameters
    ----------
    recording
        An open recording.
    settings
        What is known of the recording and how to look at it; the defaults of :class:`TrackingSettings`
        unless given.
    progress
        Called with (frames done, frames in all).
    **changes
        Settings by name, such as ``buckling_level`` or ``side``, in place of those in *settings*.

    Returns
    -------
    xarray.Dataset
        Over ``time`` [s]: ``displacement``, ``striker_displacement``, ``penetration`` in b and, with
        ``_mm``, in mm; ``displacement_stderr_mm`` and ``shaker_stderr_mm`` from the scatter of the columns,
        the rest position and what the diagnostics widen; ``confidence`` from 0 to 1; ``flags``
        (:class:`FrameFlag`); ``valid``; ``edge_width`` [px]; and, for drawing, ``beam_row``, ``beam_slope``,
        ``tip_row``, ``marker_row`` [px, turned picture], with the noise of the first and third in
        ``beam_row_stderr`` and ``tip_row_stderr``.  What could not be measured is NaN and flagged, never
        filled in; frames missing from the numbering appear so.  The attribute ``diagnostics`` holds what makes
        the result doubtful; :func:`snapbeam.lab.diagnostics_of` reads it.

    Raises
    ------
    InputError
        For settings out of range, or a recording in which beam or shaker cannot be found.
    """
    instance("recording", recording, Recording, "a Recording")
    if settings is not None:
        instance("settings", settings, TrackingSettings, "TrackingSettings")
    wanted = (settings or TrackingSettings()).changed(**changes)
    wanted = wanted.checked_for(recording.shape, len(recording))
    turn = Orientation(wanted.side, recording.shape)
    sample, head = _sample(recording)
    noise = pixel_noise(turn.turn(sample).astype(np.float32))
    saturated = saturation_level(sample, float(recording.max_value), noise)
    prepare = _Prepare(recording, turn, wanted, saturated)
    scene = survey(
        prepare(sample), wanted, saturated=prepare.saturated, pixel_size=recording.pixel_size, head=head
    )
    marks = _FixedMarks(sample[:head], wanted, turn)
    follower = Follower(scene, wanted.blur_limit)
    size = int(np.clip(_BATCH_PIXELS // (recording.shape[0] * recording.shape[1]), 4, 128))
    done = 0
    for batch in recording.batches(size):
        frames = prepare(batch)
        beam = measure_beam(scene.beam, frames)
        near = beam.row + scene.beam.thickness
        tip = (
            None
            if scene.shaker is None
            else measure_shaker(scene.beam, scene.shaker, frames, near, beam.slope)
        )
        follower.add(frames, beam, tip, marks(batch))
        done += batch.shape[0]
        if progress is not None:
            progress(done, len(recording))
    rows = follower.result(recording.numbers)
    fields = seen_fields(recording, prepare, scene.beam, rows, wanted.side in ("below", "above"))
    return tracked_dataset(rows, recording, scene, wanted, marks.largest, fields)


def _sample(recording: Recording) -> tuple[NDArray[np.integer], int]:
    """Frames spread over the recording after a few from its beginning, and how many those are."""
    pixels = recording.shape[0] * recording.shape[1]
    count = int(np.clip(_SAMPLE_PIXELS // pixels, 8, 96))
    chosen = np.unique(np.rint(np.linspace(0, len(recording) - 1, count)).astype(int))
    head = min(_HEAD, len(recording))
    chosen = np.concatenate([np.arange(head), chosen[chosen >= head]])
    return np.stack([recording.frame(int(index)) for index in chosen]), head


class _Prepare:
    """Turn a batch of frames so that the shaker stands below, undo the camera's curve, take the background out."""

    def __init__(
        self, recording: Recording, turn: Orientation, settings: TrackingSettings, saturated: float
    ) -> None:
        self.turn = turn
        self.full = float(recording.max_value)
        self.power = 1.0 / settings.gamma
        self.saturated = saturated
        if math.isfinite(saturated) and settings.gamma != 1.0:
            self.saturated = float(self._light(np.array(saturated, dtype=np.float32)))
        self.background: Floats | None = None
        if settings.background is not None:
            picture = self._light(np.asarray(settings.background, dtype=np.float32))
            self.background = (picture - np.median(picture)).astype(np.float32)
            self.saturated = math.inf

    def _light(self, grey: NDArray) -> NDArray[np.float32]:
        if self.power == 1.0:
            return grey
        light: NDArray[np.float32] = (
            np.float32(self.full) * np.maximum(grey / np.float32(self.full), 0.0) ** np.float32(self.power)
        ).astype(np.float32)
        return light

    def __call__(self, batch: NDArray[np.integer]) -> NDArray[np.float32]:
        frames = self._light(batch.astype(np.float32))
        if self.background is not None:
            frames -= self.background
        return self.turn.turn(frames)


class _FixedMarks:
    """Rows by which the camera has sunk against marks that stand still, batch by batch."""

    def __init__(self, head: NDArray[np.integer], settings: TrackingSettings, turn: Orientation) -> None:
        self.marks = settings.fixed_marks
        self.turn = turn
        self.references = [self._profiles(head, mark).mean(0) for mark in self.marks]
        self.largest = 0.0

    def _profiles(self, batch: NDArray[np.integer], mark: tuple[int, int, int, int]) -> NDArray[np.float64]:
        top, bottom, left, right = mark
        part = self.turn.turn(batch[:, top:bottom, left:right].astype(np.float64))
        profile: NDArray[np.float64] = part.mean(-1)
        return profile

    def __call__(self, batch: NDArray[np.integer]) -> Drift | None:
        if not self.marks:
            return None
        total, weight = np.zeros(batch.shape[0]), np.zeros(batch.shape[0])
        for mark, reference in zip(self.marks, self.references, strict=True):
            shift, error = profile_shift(self._profiles(batch, mark), reference)
            sound = np.isfinite(shift) & np.isfinite(error) & (error < 1.0)
            inverse = np.where(sound, 1.0 / np.maximum(error, 1e-3) ** 2, 0.0)
            total += np.where(sound, shift, 0.0) * inverse
            weight += inverse
        drift: Floats = np.where(weight > 0.0, total / np.maximum(weight, 1e-30), np.nan)
        if np.isfinite(drift).any():
            self.largest = max(self.largest, float(np.nanmax(np.abs(drift))))
        return Drift(drift, 1.0 / np.sqrt(np.maximum(weight, 1e-30)))
