"""Following beam and shaker through a recording, with every frame's trouble on record."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from snapbeam.lab.camera import Recording, profile_shift
from snapbeam.lab.tracking.diagnostics import (
    SeenMotion,
    contact_shift,
    never_touching,
    open_shift,
    rounding_shift,
    tracking_diagnostics,
)
from snapbeam.lab.tracking.drive_clock import drive_clock
from snapbeam.lab.tracking.edges import Floats
from snapbeam.lab.tracking.frame_order import FrameOrder, find_order, without_repeats
from snapbeam.lab.tracking.measure import (
    Drift,
    ExposureBlur,
    Follower,
    Rest,
    TrackedRows,
    alternation,
    exposure_blur,
    fastest,
    fields_apart,
    find_rest,
    measure,
    measure_beam,
    touching,
)
from snapbeam.lab.tracking.settings import FrameFlag, Orientation, Scene, TrackingSettings, VideoFields
from snapbeam.lab.tracking.survey import CLIPPED, pixel_noise, saturation_level, survey
from snapbeam.simulation.dataset import trajectory_dataset
from snapbeam.util.diagnostics import Diagnostic, diagnostics_of, to_json
from snapbeam.util.singular_values import polyfit
from snapbeam.util.validation import InputError, InputTypeError, instance, integer, positive

if TYPE_CHECKING:
    import xarray as xr


# ----------------------------------------------------------------------------------------------------
# From rows of pixels to a labelled dataset: the common scale of beam and shaker, errors and diagnostics.


# Error that goes with the phase of the edge in its pixel, over the misfit of the edge, by the width of the edge [px]:
# measured with an out-of-focus lens (disk) on a beam along the rows, 3.1 at 0.55 px, 1.8 at 0.66 px, 0.1 at 0.83 px.
_PIXEL_PHASE = ((0.6, 0.85), (3.1, 0.7))
_CLIPPED_ERROR = 0.05  # px; an overexposed edge is sharper than pixels can follow


def tracked_dataset(
    rows: TrackedRows,
    recording: Recording,
    scene: Scene,
    settings: TrackingSettings,
    drift: float,
    fields: VideoFields,
    moves: Floats,
) -> xr.Dataset:
    """The dataset of a tracked recording; see :func:`snapbeam.lab.track` for its variables.

    *drift* [px] is the largest shift of the camera that was taken out, *fields* what is seen of interlaced video, *moves*
    [px] by how much the background does in each frame.
    """
    motion_blur = ExposureBlur(0.0, 0.0, 0.0)
    opened = None if recording.exposure is None else recording.exposure * recording.frame_rate
    whole = not (fields.shift or fields.apart or scene.noise.lag)  # frames, each of an instant
    if whole:
        motion_blur = exposure_blur(rows.row, rows.width, opened)
    rows = _as_filtered(rows, scene, fields, motion_blur.late)
    rest = find_rest(rows.row, rows.error, rows.shaker, settings.rest_range(rows.row.size))
    if not rest.indices.size:
        located = int(np.isfinite(rows.row).sum())
        counts = {flag.words: rows.flagged(flag) for flag in FrameFlag if flag}
        reasons = ", ".join(f"{name}: {number}" for name, number in counts.items() if number)
        raise InputError(
            f"{recording.path}: the beam was found in none of the frames at rest, in {located} of {rows.row.size} at all "
            f"(flags: {reasons}); "
            + (
                "set rest_frames (--rest-frames)"
                if settings.rest_frames is None
                else f"rest_frames = {settings.rest_frames}: must contain frames in which it is seen; look at "
                "one (--picture) and narrow region (--region)"
            )
        )
    turn = Orientation(settings.side, recording.shape)
    down, across = _pixel(recording, settings)
    scale = down * 1e3 / math.hypot(1.0, 0.0 if scene.shaker is None else scene.shaker.turn * down / across)
    beam, shaker = scene.beam, scene.shaker
    order = FrameOrder((), (), ())
    if whole:
        steady = np.nan if shaker is not None and shaker.loose else 1.0  # a sticker that swings is no clock
        clock = tuple(drive_clock(steady * rows.shaker))
        if all(kind != "scattered" for kind, _ in clock):  # frames at uneven times look like lost ones
            blurred = (rows.flags & int(FrameFlag.BLUR)) != 0  # which pulls the rows
            order = find_order(*(np.where(blurred, np.nan, one) for one in (rows.row, steady * rows.shaker)))
            rows = without_repeats(rows, order)
            clock = tuple(drive_clock(steady * rows.shaker))
        order = order._replace(clock=order.clock or clock)
    beam_mm = settings.rest * 1e3 - turn.sign * scale * (rows.row - rest.row)
    tip = rows.shaker + (shaker.tip_offset if shaker is not None else np.nan)
    shaker_mm = settings.rest * 1e3 - turn.sign * scale * (tip - beam.thickness - rest.row)
    closing_mm = turn.sign * (shaker_mm - beam_mm)
    at_rest = rest.error if rest.found else float(np.nanmax(rows.row) - np.nanmin(rows.row))  # the range of the motion
    offset = math.hypot(at_rest, scene.row_errors[1])
    penetration = closing_mm / scale
    touch = touching(penetration, np.hypot(rows.error, rows.shaker_error), rows.row)
    seen = SeenMotion(
        rows, rest, penetration, touch, scale, drift, fields, order, motion_blur, opened or 0.0, float(moves.max())
    )
    diagnostics = (
        *recording.diagnostics,
        *tracking_diagnostics(scene, seen, settings, scale * offset, recording.frame_rate),
    )
    # a shift of the edges by the camera's curve moves the shaker against the beam, not the beam against itself
    placed = scene.placed_error
    bent = math.hypot(
        2.0 * scene.shape.shift, max(contact_shift(touch, placed), open_shift(scene.shape, touch, placed)), placed
    )
    apart = 0.0 if shaker is None or shaker.certain else never_touching(penetration, rows)
    loose = 0.0 if shaker is None else shaker.loose
    bent = math.hypot(bent, apart, loose, rounding_shift(scene.beam), 2.0 * rows.hollow)
    # an edge that is no blurred step is found a little off, by where in its pixel it lies
    share = float(np.interp(beam.edge_width, *_PIXEL_PHASE))
    misfit = share * float(np.nan_to_num(scene.shape.misfit))
    if scene.shape.clipped > CLIPPED:
        misfit = max(misfit, _CLIPPED_ERROR)
    rounded = 0.5 * rounding_shift(scene.beam)
    common = np.hypot(math.hypot(offset, recording.edge_error, misfit, rounded, scene.noise.made_up), moves)
    beam_error = np.hypot(rows.error, common)
    shaker_error = np.hypot(rows.shaker_error, np.hypot(common, bent))
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
        own |= {
            "shaker_displacement_mm": (shaker_mm, "mm", "shaker displacement"),
            "penetration_mm": (closing_mm, "mm", "penetration"),
            "shaker_stderr_mm": (scale * shaker_error, "mm", "standard error of the shaker displacement"),
            "tip_row": (tip, "px", "row of the shaker's tip at the contact column"),
            "tip_row_stderr": (rows.shaker_error, "px", "noise of the tip's row, standard error"),
        }
        if shaker.sticker is not None:
            own["marker_row"] = (rows.shaker, "px", "row of the middle of the sticker")
    for name, (values, units, long_name) in own.items():
        dataset[name] = ("time", values, {"units": units, "long_name": long_name})
    dataset["flags"].attrs["flag_masks"] = [int(flag) for flag in FrameFlag if flag]
    dataset["flags"].attrs["flag_meanings"] = " ".join(str(flag.name).lower() for flag in FrameFlag if flag)
    return dataset


def _as_filtered(rows: TrackedRows, scene: Scene, fields: VideoFields, late: float) -> TrackedRows:
    """The rows with errors of pictures that were averaged over frames, smoothed or interlaced, or whose rows have noise.

    *late* is by how many frames a position may be of another instant.
    """
    noise = scene.noise
    lag = noise.lag + fields.lag + late

    def widened(row: Floats, error: Floats) -> Floats:
        moved = lag * np.nan_to_num(fastest(row))
        return np.hypot(np.hypot(noise.factor * error, moved), math.hypot(fields.shift, scene.row_errors[0]))

    return dataclasses.replace(
        rows, error=widened(rows.row, rows.error), shaker_error=widened(rows.shaker, rows.shaker_error)
    )


def _attributes(
    recording: Recording, scene: Scene, settings: TrackingSettings, rest: Rest, diagnostics: tuple[Diagnostic, ...]
) -> dict[str, Any]:
    beam, shaker = scene.beam, scene.shaker
    attrs: dict[str, Any] = {
        "title": "displacement of beam and shaker from a high-speed recording",
        "source": recording.path.name,
        "frame_rate": recording.frame_rate,
        "pixel_size": _pixel(recording, settings)[0],
        "region": list(recording.region),
        "frames": list(recording.frames),
        "exposure": np.nan if recording.exposure is None else recording.exposure,
        "objects": "bright" if beam.bright else "dark",
        "contrast": beam.contrast,
        "noise": beam.noise,
        "snr_db": float(20.0 * np.log10(beam.contrast / beam.noise)),
        "edge_width": beam.edge_width,
        "edge_misfit": scene.shape.misfit,
        "edge_gamma": scene.shape.gamma,
        "edge_shift_px": scene.shape.shift,
        "saturated_share": scene.shape.clipped,
        "shaker_mark": "none" if shaker is None else shaker.mark,
        "tip_offset": np.nan if shaker is None else shaker.tip_offset,
        "tip_source": "no shaker" if shaker is None else shaker.tip_source,
        "rest_displacement": settings.rest,
        "rest_frames": int(rest.indices.size),
        "rest_row": rest.row,
        "location": settings.location,
        "diagnostics": to_json(diagnostics),
    }
    stated = {name: value for name, value in recording.metadata.items() if value not in (None, "")}
    attrs |= {f"recording_{name}": value for name, value in stated.items()}
    if settings.buckling_level is not None:
        attrs["buckling_level"] = settings.buckling_level
    return attrs | _of_scene(scene, settings)


# ----------------------------------------------------------------------------------------------------


_SAMPLE_PIXELS = 6_000_000
_HEAD = 8
_BATCH_PIXELS = 5_000_000
_CLEAR = 6.0  # px between the beam and the background that is followed, beside its blur
_LEAST_BACKGROUND = 16  # rows of it
_MOST_FRAMES = (10.0, 90.0)  # %, between which its shifts count
_REACH, _STRIPE = 16, 8  # rows it may move by, and most of the stripes that make either half
_FINE = (1.0, 4.0)  # px, between which its structure is followed
_SWINGS, _SWING = 2.0, 0.2  # times by which both halves must move more alike than apart, and px, for a motion


def track(
    recording: Recording,
    settings: TrackingSettings | None = None,
    *,
    progress: Callable[[int, int], None] | None = None,
    **changes: Any,
) -> xr.Dataset:
    """Measure the displacement of beam and shaker tip in every frame of a recording.

    A sample of frames is binarised (Otsu or a fixed threshold) to find the beam, the shaker and its sticker. In every
    frame the beam's far edge is fitted with a blurred step in several columns about the contact, and the shaker by its
    sticker, or else by its tip where a gap remains. The thickness of the beam and the distance from sticker to tip,
    from the sample, give one scale on which the penetration is zero when the edges coincide.

    Parameters
    ----------
    recording
        An open recording.
    settings
        Settings; the defaults of :class:`TrackingSettings` otherwise.
    progress
        Called with (frames done, frames in all).
    **changes
        Settings by name, such as ``buckling_level`` or ``side``.

    Returns
    -------
    xarray.Dataset
        Over ``time`` [s]: ``displacement_at_striker``, ``striker_displacement``, ``penetration_normalised`` in b and,
        with ``_mm``, in mm; ``displacement_stderr_mm`` and ``shaker_stderr_mm`` from the scatter of the columns, the
        rest position and diagnostics; ``confidence`` from 0 to 1; ``flags`` (:class:`FrameFlag`); ``valid``;
        ``edge_width`` [px]; for drawing ``beam_row``, ``beam_slope``, ``tip_row``, ``marker_row`` [px, turned picture],
        ``beam_row_stderr``, ``tip_row_stderr``. Missing frames and frames without a valid edge are NaN and flagged.
        :func:`snapbeam.lab.diagnostics_of` reads the attribute ``diagnostics``.

    Examples
    --------
    >>> import numpy as np
    >>> from snapbeam import lab
    >>> time = np.arange(60) / 10e3  # s
    >>> beam = -0.335e-3 * np.ones(60)  # m: at rest in the lower well
    >>> tip = -0.6e-3 + 0.1e-3 * np.sin(2 * np.pi * 100 * time)
    >>> camera, stage = lab.SyntheticCamera(shape=(160, 64)), lab.SyntheticStage(shaker_width=0.4e-3)
    >>> synthetic = lab.render_recording(time, beam, tip, camera=camera, stage=stage)
    >>> with lab.open_recording(synthetic.write("test.cihx"), frame_rate=10e3, pixel_size=12e-6) as recording:
    ...     tracked = lab.track(recording, buckling_level=0.335e-3)
    >>> list(tracked.data_vars)[:2]
    ['valid', 'displacement_at_striker']
    """
    instance("recording", recording, Recording, "a Recording")
    if settings is not None:
        instance("settings", settings, TrackingSettings, "TrackingSettings")
    wanted = (settings or TrackingSettings()).changed(**changes)
    wanted = wanted.checked_for(recording.shape, len(recording))
    sample, head = _sample(recording)
    scene, prepare = _find_scene(recording, wanted, sample, head)
    marks = _FixedMarks(sample[:head], wanted, prepare.turn)
    background = _Background(prepare(sample[:head]), measure_beam(scene.beam, prepare(sample)).row, scene, wanted)
    follower = Follower(scene, wanted.blur_limit)
    size = int(np.clip(_BATCH_PIXELS // (recording.shape[0] * recording.shape[1]), 4, 128))
    done = 0
    for batch in recording.batches(size):
        frames = prepare(batch)
        beam, tip = measure(scene, frames)
        follower.add(frames, beam, tip, marks(batch))
        background.add(frames, beam.row)
        done += batch.shape[0]
        if progress is not None:
            progress(done, len(recording))
    rows = follower.result(recording.numbers)
    apart = fields_apart(recording, prepare, scene.beam, rows, wanted.side in ("below", "above"))
    fields = VideoFields(apart, alternation(rows.row))
    return tracked_dataset(rows, recording, scene, wanted, marks.largest, fields, background.moves(recording.numbers))


def _find_scene(
    recording: Recording, settings: TrackingSettings, sample: NDArray[np.integer], head: int
) -> tuple[Scene, _Prepare]:
    """Find beam and shaker in a sample of frames, the first *head* of them neighbours, and how a frame is prepared."""
    turn = Orientation(settings.side, recording.shape)
    noise = pixel_noise(turn.turn(sample).astype(np.float32))
    saturated = saturation_level(sample, float(recording.max_value), noise)
    prepare = _Prepare(recording, turn, settings, saturated)
    pixel_size = _pixel(recording, settings)[0]
    return survey(prepare(sample), settings, saturated=prepare.saturated, pixel_size=pixel_size, head=head), prepare


def edges_in(
    recording: Recording, settings: TrackingSettings
) -> Callable[[int], tuple[dict[str, Any], dict[str, float]]]:
    """Find beam and shaker; return a function of a frame that gives attributes and variables of it as :func:`track` does."""
    scene, prepare = _find_scene(recording, settings, *_sample(recording))

    def measured(index: int) -> tuple[dict[str, Any], dict[str, float]]:
        beam, tip = measure(scene, prepare(recording.frame(index)[None]))
        rows = {"beam_row": float(beam.row[0]), "beam_slope": float(beam.slope[0])}
        if tip is not None and scene.shaker is not None:
            rows["tip_row"] = float(tip.row[0]) + scene.shaker.tip_offset
            if scene.shaker.sticker is not None:
                rows["marker_row"] = float(tip.row[0])
        return _of_scene(scene, settings), rows

    return measured


def _of_scene(scene: Scene, settings: TrackingSettings) -> dict[str, Any]:
    """The attributes by which the edges of a frame are drawn."""
    beam, shaker = scene.beam, scene.shaker
    attrs: dict[str, Any] = {
        "side": settings.side,
        "threshold": beam.threshold,
        "beam_thickness_px": beam.thickness,
        "contact_column": beam.contact_column,
        "beam_columns": beam.columns.tolist(),
    }
    if shaker is not None and shaker.sticker is not None:
        attrs["marker_thickness"] = shaker.sticker.thickness
        attrs["marker_columns"] = shaker.sticker.columns.tolist()
    return attrs


def _pixel(recording: Recording, settings: TrackingSettings) -> tuple[float, float]:
    """Size [m] of a pixel along the motion and across it."""
    sizes = recording.pixel_size, recording.pixel_width
    return sizes[::-1] if settings.side in ("left", "right") else sizes


def _sample(recording: Recording) -> tuple[NDArray[np.integer], int]:
    """Frames spread over the recording after a few from its beginning, and how many those are."""
    pixels = recording.shape[0] * recording.shape[1]
    count = int(np.clip(_SAMPLE_PIXELS // pixels, 8, 96))
    chosen = np.unique(np.rint(np.linspace(0, len(recording) - 1, count)).astype(int))
    head = min(_HEAD, len(recording))
    chosen = np.concatenate([np.arange(head), chosen[chosen >= head]])
    return np.stack([recording.frame(int(index)) for index in chosen]), head


class _Prepare:
    """Rotate a batch of frames so that the shaker is below, linearise grey levels, subtract the background."""

    def __init__(self, recording: Recording, turn: Orientation, settings: TrackingSettings, saturated: float) -> None:
        self.turn, self.full, self.power = turn, np.float32(recording.max_value), np.float32(1.0 / settings.gamma)
        self.saturated = float(self._light(np.array(saturated, dtype=np.float32)))
        self.background: Floats | None = None
        if settings.background is not None:
            picture = self._light(np.asarray(settings.background, dtype=np.float32))
            self.background = (picture - np.median(picture)).astype(np.float32)
            self.saturated = math.inf

    def _light(self, grey: NDArray) -> NDArray[np.float32]:
        if self.power == 1.0:
            return grey
        return np.asarray(self.full * np.maximum(grey / self.full, 0.0) ** self.power, dtype=np.float32)

    def __call__(self, batch: NDArray[np.integer]) -> NDArray[np.float32]:
        frames = self._light(batch.astype(np.float32))
        if self.background is not None:
            frames -= self.background
        return self.turn.turn(frames)


class _FixedMarks:
    """Rows by which the camera has sunk against marks that stand still, batch by batch."""

    def __init__(self, head: NDArray[np.integer], settings: TrackingSettings, turn: Orientation) -> None:
        self.marks, self.turn = settings.fixed_marks, turn
        self.references = [profiles.mean(0) for profiles in self._profiles(head)]
        self.largest = 0.0

    def _profiles(self, batch: NDArray[np.integer]) -> list[NDArray[np.float64]]:
        parts = (batch[:, top:bottom, left:right].astype(np.float64) for top, bottom, left, right in self.marks)
        return [self.turn.turn(part).mean(-1) for part in parts]

    def __call__(self, batch: NDArray[np.integer]) -> Drift | None:
        if not self.marks:
            return None
        total, weight = np.zeros(batch.shape[0]), np.zeros(batch.shape[0])
        for profiles, reference in zip(self._profiles(batch), self.references, strict=True):
            shift, error = profile_shift(profiles, reference)
            sound = np.isfinite(shift) & np.isfinite(error) & (error < 1.0)
            inverse = np.where(sound, 1.0 / np.maximum(error, 1e-3) ** 2, 0.0)
            total += np.where(sound, shift, 0.0) * inverse
            weight += inverse
        drift: Floats = np.where(weight > 0.0, total / np.maximum(weight, 1e-30), np.nan)
        if np.isfinite(drift).any():
            self.largest = max(self.largest, float(np.nanmax(np.abs(drift))))
        return Drift(drift, 1.0 / np.sqrt(np.maximum(weight, 1e-30)))


class _Background:
    """Rows by which the background, on the far side of the beam, moves from frame to frame, by two halves of its rows.

    Nothing in it moves, so where both halves move alike the picture does: an electronic stabiliser, or the camera.  Noise
    of whole rows differs between the halves.  Light that the beam sheds on it is smooth, and taken out.
    """

    def __init__(self, head: Floats, row: Floats, scene: Scene, settings: TrackingSettings) -> None:
        self.margin = _CLEAR + 4.0 * scene.beam.edge_width
        self.found: list[Floats] = []
        top = float(np.nanmin(row)) - self.margin if np.isfinite(row).any() else 0.0
        self.rows = slice(0, max(int(top), 0))
        self.reach = min(self.rows.stop // 3, _REACH)
        clear = self.rows.stop >= _LEAST_BACKGROUND and not settings.fixed_marks and settings.background is None
        self.reference = self._fine(head).mean(0)[self.reach : -self.reach] if clear else None

    def _fine(self, frames: Floats) -> Floats:
        """The background without noise of single pixels and without what is smooth."""
        part = np.asarray(frames[:, self.rows], dtype=np.float32)
        return np.asarray(np.subtract(*(gaussian_filter(part, (0, sigma, sigma)) for sigma in _FINE)))

    def add(self, frames: Floats, row: Floats) -> None:
        """Follow the background in a batch of turned frames, where the beam at *row* does not come near it."""
        if self.reference is None:
            return
        fine, height = self._fine(frames), self.reference.shape[0]
        parts = [fine[:, k : k + height] for k in range(2 * self.reach + 1)]
        along = np.stack([np.einsum("nrc,rc->nr", part, self.reference) for part in parts], 1)
        square = np.stack([np.einsum("nrc,nrc->nr", part, part) for part in parts], 1)
        stripe = np.arange(height) // min(_STRIPE, -(-height // 4)) % 2
        both = []
        for half in (0, 1):
            alike = along[..., stripe == half].sum(2) / np.sqrt(square[..., stripe == half].sum(2) + 1e-30)
            best = np.clip(alike.argmax(1), 1, alike.shape[1] - 2)
            before, at, after = (np.take_along_axis(alike, best[:, None] + k, 1)[:, 0] for k in (-1, 0, 1))
            bend = np.minimum(before + after - 2.0 * at, -1e-30)
            both.append(best - self.reach + np.clip(0.5 * (before - after) / bend, -0.5, 0.5))
        self.found.append(np.where(row - self.margin >= self.rows.stop - 1.0, both, np.nan))

    def moves(self, numbers: NDArray[np.int64]) -> Floats:
        """Displacement of the background in each frame [px], with its noise; 0 where it stands still or is not seen."""
        moves: Floats = np.zeros(int(numbers[-1]) + 1)
        if not self.found:
            return moves
        first, second = np.concatenate(self.found, axis=1)
        known = np.isfinite(first)
        if known.sum() < 0.5 * known.size:
            return moves
        alike, apart = 0.5 * (first + second), 0.5 * (first - second)
        swing, noise = (float(np.ptp(np.percentile(one[known], _MOST_FRAMES))) for one in (alike, apart))
        if swing < max(_SWINGS * noise, _SWING):
            return moves
        moved = np.hypot(alike, noise)
        most = float(np.nanpercentile(moved, _MOST_FRAMES[1]))
        moves[numbers] = np.where(moved < 2.0 * most, moved, most)
        return moves


# ----------------------------------------------------------------------------------------------------
# How well a recording was tracked, in numbers and in words.


_NAMES = ("time", "displacement_mm", "displacement_stderr_mm", "flags", "confidence", "beam_row", "beam_slope")


def check_tracked(
    dataset: xr.Dataset, names: tuple[str, ...] = _NAMES, attrs: tuple[str, ...] = ("pixel_size", "frame_rate", "side")
) -> xr.Dataset:
    """Return *dataset* if it came from :func:`snapbeam.lab.track`; refuse it if not."""
    from snapbeam.util.datasets import xr

    if not isinstance(dataset, xr.Dataset):
        raise InputTypeError(f"dataset: must be an xarray.Dataset, not {type(dataset).__name__}")
    missing = [name for name in names if name not in dataset.variables]
    missing += [name for name in attrs if name not in dataset.attrs]
    if missing:
        where = " with a shaker" if "penetration_mm" in missing else ""
        raise InputError(f"dataset without {', '.join(missing)}: must come from track(){where}")
    return dataset


def tracking_quality(dataset: xr.Dataset) -> dict[str, Any]:
    """Figures of merit of a tracked recording.

    Returns
    -------
    dict
        ``frames``; ``measured_share`` and ``flagged_share``; ``counts`` by name of flag; ``longest_gap`` in
        frames; ``beam_stderr_px`` and ``shaker_stderr_px`` (medians; NaN without a shaker); ``confidence``
        (median); ``largest_step_px``, the most the beam moved between frames; ``snr_db``; ``edge_width``.

    Examples
    --------
    >>> import numpy as np
    >>> from snapbeam import lab
    >>> time = np.arange(60) / 10e3  # s
    >>> beam = -0.335e-3 * np.ones(60)  # m: at rest in the lower well
    >>> tip = -0.6e-3 + 0.1e-3 * np.sin(2 * np.pi * 100 * time)
    >>> camera, stage = lab.SyntheticCamera(shape=(160, 64)), lab.SyntheticStage(shaker_width=0.4e-3)
    >>> synthetic = lab.render_recording(time, beam, tip, camera=camera, stage=stage)
    >>> with lab.open_recording(synthetic.write("test.cihx"), frame_rate=10e3, pixel_size=12e-6) as recording:
    ...     tracked = lab.track(recording, buckling_level=0.335e-3)
    >>> sorted(lab.tracking_quality(tracked))[:3]
    ['beam_stderr_px', 'confidence', 'counts']
    """
    dataset = check_tracked(dataset)
    flags = dataset["flags"].values.astype(int)
    moving = [dataset[name].values for name in ("displacement_mm", "shaker_displacement_mm") if name in dataset]
    measured = np.isfinite(moving).all(0)
    pixel = dataset.attrs["pixel_size"] * 1e3
    runs = np.diff(np.flatnonzero(np.concatenate([[True], measured, [True]]))) - 1
    steps = np.abs(np.diff(moving[0])) / pixel
    return {
        "frames": int(flags.size),
        "measured_share": float(measured.mean()),
        "flagged_share": float((flags != 0).mean()),
        "counts": {flag.words: int(((flags & int(flag)) != 0).sum()) for flag in FrameFlag if flag},
        "longest_gap": int(runs.max()),
        "beam_stderr_px": _median(dataset["displacement_stderr_mm"].values / pixel),
        "shaker_stderr_px": _median(dataset["shaker_stderr_mm"].values / pixel) if len(moving) > 1 else float("nan"),
        "confidence": _median(dataset["confidence"].values),
        "largest_step_px": float(np.nanmax(steps)) if np.isfinite(steps).any() else float("nan"),
        "snr_db": float(dataset.attrs["snr_db"]),
        "edge_width": float(dataset.attrs["edge_width"]),
    }


def _median(values: np.ndarray) -> float:
    return float(np.nanmedian(values)) if np.isfinite(values).any() else float("nan")


def tracking_report(dataset: xr.Dataset, *, diagnostics: bool = True) -> str:
    """The quality of a tracked recording in plain lines: advice for every kind of trouble met, and *diagnostics*.

    Examples
    --------
    >>> import numpy as np
    >>> from snapbeam import lab
    >>> time = np.arange(60) / 10e3  # s
    >>> beam = -0.335e-3 * np.ones(60)  # m: at rest in the lower well
    >>> tip = -0.6e-3 + 0.1e-3 * np.sin(2 * np.pi * 100 * time)
    >>> camera, stage = lab.SyntheticCamera(shape=(160, 64)), lab.SyntheticStage(shaker_width=0.4e-3)
    >>> synthetic = lab.render_recording(time, beam, tip, camera=camera, stage=stage)
    >>> with lab.open_recording(synthetic.write("test.cihx"), frame_rate=10e3, pixel_size=12e-6) as recording:
    ...     tracked = lab.track(recording, buckling_level=0.335e-3)
    >>> print(lab.tracking_report(tracked).splitlines()[0])
    69 frames at 10000 Hz, 12 um per pixel; 100.00 % measured, 0.00 % flagged
    """
    quality = tracking_quality(dataset)
    attrs = dataset.attrs
    pixel = attrs["pixel_size"] * 1e6
    shaker = f", shaker {quality['shaker_stderr_px']:.3f} px (tip: {attrs['tip_source']})"
    shaker = "" if np.isnan(quality["shaker_stderr_px"]) else shaker
    lines = [
        f"{quality['frames']} frames at {attrs['frame_rate']:g} Hz, {pixel:g} um per pixel; "
        f"{100 * quality['measured_share']:.2f} % measured, {100 * quality['flagged_share']:.2f} % flagged",
        f"signal to noise {quality['snr_db']:.1f} dB, edge width {quality['edge_width']:.2f} px, beam "
        f"{attrs['beam_thickness_px'] * pixel * 1e-3:.3f} mm thick, shaker followed by: {attrs['shaker_mark']}",
        f"standard error: beam {quality['beam_stderr_px']:.3f} px{shaker}",
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


# ----------------------------------------------------------------------------------------------------
# When contact begins and ends, from a tracked recording.


def contact_onsets(dataset: xr.Dataset, *, tolerance: float | None = None, minimum_frames: int = 1) -> xr.Dataset:
    """Impacts in a tracked recording: where the tip reaches the beam and leaves it again.

    Contact begins when the penetration rises above ``-tolerance`` and ends below twice that. The instant is where a
    straight line through the last frames of the approach (the first of the parting) reaches zero; the time of a frame
    is the middle of its exposure, if known. A contact that begins or ends in unmeasured frames has ``bounded`` = 0.

    Parameters
    ----------
    dataset
        Result of :func:`track`, with a shaker.
    tolerance
        Penetration below zero that still is contact [mm]; by default three standard deviations of its noise, at least
        0.1 pixel.
    minimum_frames
        Shortest contact to report, in frames.

    Returns
    -------
    xarray.Dataset
        Over ``impact``: ``onset`` and ``duration`` [s] with standard errors, ``frames`` in contact, ``closing_speed``
        [m/s] (NaN where fewer than two frames precede the onset), ``bounded``.

    Examples
    --------
    >>> import numpy as np
    >>> from snapbeam import lab
    >>> time = np.arange(60) / 10e3  # s
    >>> beam = -0.335e-3 * np.ones(60)  # m: at rest in the lower well
    >>> tip = -0.6e-3 + 0.1e-3 * np.sin(2 * np.pi * 100 * time)
    >>> camera, stage = lab.SyntheticCamera(shape=(160, 64)), lab.SyntheticStage(shaker_width=0.4e-3)
    >>> synthetic = lab.render_recording(time, beam, tip, camera=camera, stage=stage)
    >>> with lab.open_recording(synthetic.write("test.cihx"), frame_rate=10e3, pixel_size=12e-6) as recording:
    ...     tracked = lab.track(recording, buckling_level=0.335e-3)
    >>> lab.contact_onsets(tracked).sizes["impact"]
    0
    """
    from snapbeam.util.datasets import xr

    check_tracked(dataset, ("time", "penetration_mm"), ())
    minimum_frames = integer("minimum_frames", minimum_frames, 1)
    time, gap = dataset["time"].values, dataset["penetration_mm"].values
    pixel = float(dataset.attrs.get("pixel_size", 0.0)) * 1e3
    noise = _noise(dataset)
    if tolerance is None:
        limit = max(3.0 * noise, 0.1 * pixel, 1e-9)
    else:
        limit = positive("tolerance", tolerance, "mm")
    exposure = float(dataset.attrs.get("exposure", math.nan))
    middle = 0.5 * exposure if math.isfinite(exposure) else 0.0
    rows = []
    for start, stop, bounded in _contacts(gap, limit):
        if stop - start >= minimum_frames:
            onset, speed, onset_error = _crossing(time, gap, start, -1, limit, noise)
            end, _, end_error = _crossing(time, gap, stop - 1, +1, limit, noise)
            span = math.hypot(onset_error, end_error)
            rows.append((onset + middle, onset_error, max(end - onset, 0.0), span, stop - start, speed, bounded))
    table = np.array(rows, dtype=np.float64).reshape(-1, 7)
    names = {
        "onset": ("s", "time at which contact begins"),
        "onset_stderr": ("s", "standard error of the onset"),
        "duration": ("s", "duration of the contact"),
        "duration_stderr": ("s", "standard error of the duration"),
        "frames": ("1", "frames in contact"),
        "closing_speed": ("m/s", "speed at which tip and beam close"),
        "bounded": ("1", "whether both ends of the contact were seen"),
    }
    found = xr.Dataset(attrs={"tolerance_mm": limit})
    for column, (name, (units, words)) in zip(table.T, names.items(), strict=True):
        kind = np.int64 if name in ("frames", "bounded") else np.float64
        found[name] = "impact", column.astype(kind), {"units": units, "long_name": words}
    return found


def _noise(dataset: xr.Dataset) -> float:
    """Standard deviation of the penetration [mm] from the noise of both edges."""
    scale = float(dataset.attrs.get("pixel_size", 0.0)) * 1e3
    names = [name for name in ("beam_row_stderr", "tip_row_stderr") if name in dataset]
    errors = [scale * _median(dataset[name].values) for name in names]
    return float(np.hypot(errors[0], errors[1])) if len(errors) == 2 and np.isfinite(errors).all() else 0.0


def _contacts(gap: np.ndarray, limit: float) -> list[tuple[int, int, bool]]:
    """First frame, one past the last, and whether both ends were seen, for each contact."""
    found: list[tuple[int, int, bool]] = []
    start, clean = -1, True
    for k, value in enumerate(gap):
        if not np.isfinite(value):
            if start >= 0:
                found.append((start, k, False))
            start, clean = -1, False
        elif start < 0 and value > -limit:
            start, clean = k, clean and k > 0
        elif start >= 0 and value < -2.0 * limit:
            found.append((start, k, clean))
            start, clean = -1, True
        elif start < 0:
            clean = True
    if start >= 0:
        found.append((start, gap.size, False))
    return found


def _crossing(
    time: np.ndarray, gap: np.ndarray, edge: int, step: int, limit: float, noise: float
) -> tuple[float, float, float]:
    """Time at which a line through the frames beyond *edge* meets zero, its speed [m/s], the time's error.

    As few frames as the noise allows, two to five, since beam and tip do not move in straight lines.  ``edge`` is the
    first (``step`` = -1, approach) or last (+1, parting) frame of the contact.  The crossing is sought from the
    nearest frame outside to the first inside that has closed to within the noise.
    """
    outside: list[int] = []
    k = edge + step
    while (
        0 <= k < gap.size and len(outside) < 5 and gap[k] <= min(-limit, gap[outside[-1]] + limit if outside else 0.0)
    ):
        outside.append(k)
        k += step
    usual = float(np.median(np.diff(time)))
    slope = 0.0
    for count in range(2, len(outside) + 1):
        slope, level = polyfit(time[outside[:count]] - time[edge], gap[outside[:count]], 1)
        # The line's error where it is continued to, about 2 noise/sqrt(count), in frames of the approach.
        frame = abs(float(time[outside[0]] - time[edge]))
        if slope * step < 0.0 and 2.0 * noise / math.sqrt(count) < 0.2 * abs(slope) * frame:
            break
    if slope * step >= 0.0:  # also of fewer than two frames
        return float(time[edge]), float("nan"), 0.5 * usual
    inside = edge
    while 0 <= inside - step < gap.size and gap[inside] < -noise and gap[inside - step] > -limit:
        inside -= step
    low, high = sorted((float(time[outside[0]]), float(time[inside])))
    at = float(np.clip(time[edge] - level / slope, low, high))
    used = time[outside[:count]]
    lever = (at - float(used.mean())) ** 2 / float(np.sum((used - used.mean()) ** 2))
    # the motion bends within a frame, so no onset is known better than to a tenth of one
    error = math.hypot(noise / abs(slope) * math.sqrt(1.0 / count + lever), 0.1 * usual)
    return at, float(abs(slope) * 1e-3), error
