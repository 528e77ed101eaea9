"""Following beam and shaker through a recording, with every frame's trouble on record."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.core.validate import InputError, choice, finite, finite_array, integer, positive, within
from snapbeam.lab.camera.recording import Recording
from snapbeam.lab.tracking.beam_edge import measure_beam
from snapbeam.lab.tracking.edges import Floats
from snapbeam.lab.tracking.scene import SIDES, Orientation
from snapbeam.lab.tracking.shaker import measure_shaker
from snapbeam.lab.tracking.survey import survey
from snapbeam.lab.tracking.tracked import Follower, tracked_dataset

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["track"]

_SAMPLE_PIXELS = 6_000_000
_HEAD = 8
_BATCH_PIXELS = 6_000_000


def track(
    recording: Recording,
    *,
    buckling_level: float | None = None,
    location: float = 0.5,
    rest_displacement: float | None = None,
    rest_frames: int | None = None,
    side: str = "below",
    objects: str = "auto",
    threshold: float | None = None,
    background: ArrayLike | None = None,
    shaker: bool = True,
    marker: bool = True,
    columns: int = 24,
    contact_column: float | None = None,
    blur_limit: float | None = None,
    progress: Callable[[int, int], None] | None = None,
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
    buckling_level
        b [m].  If given, displacements are also returned in units of b.
    location
        Location x_s/L of the contact, which sets the displacement of the beam at rest.
    rest_displacement
        Displacement of the beam [m] at rest, the one length a camera cannot know.
        Unless given, the well that faces the shaker: -(b/2)(1 - cos 2 pi x_s/L), of opposite sign for a
        shaker above; 0 without ``buckling_level``.
    rest_frames
        Frames at the start in which the beam is at rest; unless given, the first half of those before it
        first departs from their mean by three standard errors.
    side
        Side of the beam on which the shaker stands: "below", "above", "left" or "right".  Up (or right) is
        positive.
    objects
        "bright" or "dark" against the background, or "auto": unlike the rows beyond the beam.
    threshold
        Grey level for binarising; Otsu's from the sample unless given.
    background
        A picture of the scene without beam and shaker, shape (height, width), to subtract.
    shaker, marker
        Whether a shaker is in the picture, and whether to look for a sticker on it.
    columns
        Columns in which the beam's edge is fitted.
    contact_column
        Column of the contact (or row, for a shaker at the left or right); found from the tip unless given.
    blur_limit
        Edge width [px] beyond which a frame is flagged as blurred; 2.5 times the usual plus 0.5 unless given.
    progress
        Called with (frames done, frames in all).

    Returns
    -------
    xarray.Dataset
        Over ``time`` [s]: ``displacement``, ``shaker_displacement``, ``penetration`` in b and, with
        ``_mm``, in mm; ``displacement_stderr_mm`` and ``shaker_stderr_mm`` from the scatter of the columns;
        ``confidence`` from 0 to 1; ``flags`` (:class:`FrameFlag`); ``valid``; ``edge_width`` [px]; and, for
        drawing, ``beam_row``, ``beam_slope``, ``tip_row``, ``marker_row`` [px, turned picture].  What could
        not be measured is NaN and flagged, never filled in; frames missing from the numbering appear so.

    Raises
    ------
    InputError
        For parameters out of range, or a recording in which beam or shaker cannot be found.
    """
    side = choice("side", side, SIDES)
    objects = choice("objects", objects, ("auto", "bright", "dark"))
    level = None if buckling_level is None else positive("buckling_level", buckling_level, "m")
    place = within("location", location, 0.0, 1.0)
    threshold = None if threshold is None else finite("threshold", threshold)
    columns = integer("columns", columns, 3, 1000)
    rest_frames = None if rest_frames is None else integer("rest_frames", rest_frames, 1, len(recording))
    turn = Orientation(side, recording.shape)
    if rest_displacement is None:
        rest = 0.0 if level is None else -turn.sign * level * 0.5 * (1.0 - math.cos(2.0 * math.pi * place))
    else:
        rest = finite("rest_displacement", rest_displacement)
    if contact_column is not None:
        across = recording.shape[1] if side in ("below", "above") else recording.shape[0]
        contact_column = within("contact_column", contact_column, 0.0, across - 1.0, closed="both", unit="px")
    limit = None if blur_limit is None else positive("blur_limit", blur_limit, "px")
    prepare = _Prepare(recording, turn, background)
    sample, head = _sample(recording)
    scene = survey(
        prepare(sample),
        threshold=threshold,
        objects=objects,
        shaker=shaker,
        marker=marker,
        columns=columns,
        contact_column=contact_column,
        max_value=prepare.saturation,
        head=head,
    )
    follower = Follower(scene, limit)
    size = int(np.clip(_BATCH_PIXELS // (recording.shape[0] * recording.shape[1]), 4, 128))
    done = 0
    for batch in recording.batches(size):
        frames = prepare(batch)
        beam = measure_beam(scene, frames)
        tip = measure_shaker(scene, frames, beam.row + scene.thickness, beam.slope) if shaker else None
        follower.add(frames, beam, tip)
        done += batch.shape[0]
        if progress is not None:
            progress(done, len(recording))
    found = follower.result()
    return tracked_dataset(
        found,
        recording,
        scene,
        turn,
        rest=rest,
        rest_frames=rest_frames,
        buckling_level=level,
        location=place,
    )


def _sample(recording: Recording) -> tuple[NDArray[np.integer], int]:
    """Frames spread over the recording after a few from its beginning, and how many those are."""
    pixels = recording.shape[0] * recording.shape[1]
    count = int(np.clip(_SAMPLE_PIXELS // pixels, 8, 96))
    chosen = np.unique(np.rint(np.linspace(0, len(recording) - 1, count)).astype(int))
    head = min(_HEAD, len(recording))
    chosen = np.concatenate([np.arange(head), chosen[chosen >= head]])
    return np.stack([recording.frame(int(index)) for index in chosen]), head


class _Prepare:
    """Turn a batch of frames so that the shaker stands below, and subtract the background."""

    def __init__(self, recording: Recording, turn: Orientation, background: ArrayLike | None) -> None:
        self.turn = turn
        self.saturation = float(recording.max_value)
        self.background: Floats | None = None
        if background is not None:
            picture = finite_array("background", background, 2)
            if picture.shape != recording.shape:
                raise InputError(f"background of shape {picture.shape}: must be of shape {recording.shape}")
            self.background = (picture - np.median(picture)).astype(np.float32)
            self.saturation = math.inf

    def __call__(self, batch: NDArray[np.integer]) -> NDArray[np.float32]:
        frames = batch.astype(np.float32)
        if self.background is not None:
            frames -= self.background
        return self.turn.turn(frames)
