"""A tracked recording against itself: is it the beam, is it at rest, do its edges look like edges."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from snapbeam.lab.decay.model import likely
from snapbeam.lab.diagnostics import holding, table
from snapbeam.lab.tracking.frame_order import FrameOrder
from snapbeam.lab.tracking.measure import ExposureBlur, Rest, Touch, TrackedRows
from snapbeam.lab.tracking.rulers import Ruler, compare_rulers, option_name, seen_rulers
from snapbeam.lab.tracking.settings import BeamView, EdgeShape, FrameFlag, Scene, TrackingSettings, VideoFields
from snapbeam.lab.tracking.survey import CLIPPED
from snapbeam.util.diagnostics import Diagnostic, Severity

KINDS = table(
    "camera",
    info={
        "fixture": "{count:.0f} bar(s) that never move cross the picture, the first at row {row:.0f} of the turned "
        "picture; left out as no beam",
        "ruler_unseen": "{told} was given and is not seen in the recording: the pixel size is not checked with it",
        "turned": "beam and striker lean by {angle:.1f} degrees alike: the camera is turned; taken out",
        "no_contact": "the tip never comes nearer to the beam than {gap_px:.1f} px: no contact is recorded",
        "striker_in_view": "a shaker is in view though shaker=False (--no-shaker): its columns are kept out of the "
        "search for the beam",
        "drift": "the camera moves by up to {drift_px:.2f} px against its fixed marks; taken out",
    },
    warning={
        "no_motion": "what is tracked never moves by more than {range_px:.2f} px: it may be a clamp or a fixture; "
        "look at a frame (--picture) and narrow region (--region)",
        "rulers": "{told}; check these and the planes they were taken in, pixel_size (--pixel-size), beam_thickness "
        "(--beam-thickness), tip_diameter (--tip-diameter), drive_amplitude (--drive-amplitude), and what was tracked "
        "(region, --region)",
        "rest_moves": "{told}: all displacements may be shifted by up to {shift_mm:.3g} mm, which is in their "
        "standard errors",
        "gamma": "edges look as if grey levels were light to the power {gamma:.2f} +- {error:.2f}: shaker and beam "
        "shift against each other by {shift_px:.2f} px, which is in the shaker's standard errors; switch the camera's "
        "curve off, or undo it with gamma (--gamma)",
        "overexposed": "{share_percent:.0f} % of the beam's pixels are saturated: its edges lie up to {shift_px:.2f} "
        "px off, which is in the shaker's standard errors; less light, or a shorter exposure",
        "edge_shape": "edges are no blurred steps (off by {misfit_percent:.1f} % of the contrast): sharpened, doubled "
        "or structured; switch the camera's edge enhancement off, or choose another contact_column (--contact-column)",
        "averaged": "noise of one frame is still there in the next (correlation {correlation:.2f}): frames were "
        "averaged, by the camera's noise reduction or by a program that changed the frame rate; positions lag by "
        "about {lag:.1f} frame(s), which is in their standard errors; keep the frames as they were taken",
        "lag": "a frame still shows about {share_percent:.0f} % of the one before (image lag of the sensor, an "
        "afterglow of the lamp, or a longer exposure than the file says): positions lag by that share of a frame, "
        "which is in their standard errors; more light and a shorter exposure, or give the frames as they were taken",
        "pulse": "edges in motion are sharper than the exposure explains: the lamp pulses, or the exposure of the "
        "file is wrong; positions are of an instant up to {frames:.2f} frames from the middle of the exposure, which "
        "is in their standard errors; use steady light, or give the frames as they were taken",
        "smoothed": "noise of neighbouring pixels is alike (correlation {correlation:.2f}): pictures were enlarged, "
        "smoothed, compressed or made of fields, so that edges are known {factor:.1f} times less well than they seem "
        "and lie {made_px:.2f} px off, which is in the standard errors; keep the frames as they were taken",
        "interlaced": "odd and even rows differ by {share:.2f} of the step from frame to frame: interlaced video, "
        "whose rows are of two instants; positions are of an instant up to half a frame off, which is in their "
        "standard errors; record progressive frames, or part the fields into frames of their own",
        "fields": "every other frame is shifted by {shift_px:.2f} px: fields of an interlaced video, made frames by "
        "repeating rows; the shift is in the standard errors; take a program that puts each field's rows where they "
        "belong",
        "few_levels": "the beam stands out by {levels:.1f} grey levels only: rounding moves edges by up to "
        "{shift_px:.2f} px, which is in the standard errors; more light, or more bits",
        "sticker_alone": "all that is seen of the shaker is a band {height_px:.0f} px high that never comes nearer to "
        "the beam than {gap_px:.0f} px: taken for a sticker on a dark shaker whose tip touches the beam in the first "
        "frames; give tip_distance (--tip-distance), or marker=False (--no-marker) if the band is the tip",
        "rod_cut": "the border of the region cuts the striker, so where its tip touches is not seen: its position may "
        "be off by as much as its tip is round; widen region (--region) or give contact_column (--contact-column)",
        "sticker_loose": "the sticker moves against the tip by {swing_px:.2f} px (standard deviation), which is in "
        "the shaker's standard errors: it is loose, or another object; fix it, or follow the tip with marker=False "
        "(--no-marker)",
        "never_touches": "the beam moves though what is taken for the tip never comes nearer to it than {gap_px:.1f} "
        "px: it may be a sticker; look at a frame (--picture), give tip_distance (--tip-distance)",
        "contact_offset": "while beam and shaker move together the tip seems to stand {depth_px:+.2f} +- "
        "{error_px:.2f} px inside the beam: their edges are shifted against each other, which is in the shaker's "
        "standard errors; look for a curve of the camera (--gamma), overexposure or a wrong tip_distance "
        "(--tip-distance)",
        "inside": "the tip stands up to {depth_px:.1f} px inside the beam ({frames:.0f} frames): what is taken for "
        "the tip is not, or beam and shaker are lit differently; give tip_distance (--tip-distance)",
        "jumps": "{frames:.0f} frame(s) ({share_percent:.1f} %) left out because the position jumps and comes back",
        "distorted": "{frames:.0f} frame(s) ({share_percent:.1f} %) in which the beam looks thicker or thinner, or "
        "its edge is no step: light, dust, blur or another object may lie on it; their standard errors are widened, "
        "or they are left out",
        "lost": "only {share_percent:.0f} % of the frames were measured; see the flags for the reasons",
        "striker_lost": "the striker was found in only {share_percent:.0f} % of the frames; see the flags for the "
        "reasons, narrow region (--region), or track the beam alone with shaker=False (--no-shaker)",
        "frames_repeated": "at least {frames:.0f} frame(s) show the frame before again, the first is frame "
        "{first:.0f}: left out; keep the frames as they were taken",
        "off_its_drive": "from about frame {first:.0f} on the striker is off its steady sine; a shift of the picture "
        "and a jump of the time explain it alike: look at the frames about it",
        "scattered": "the striker scatters with its speed, by {size:.2f} frames: an uneven trigger, or edges that are "
        "found less well while they move",
        "curved": "the beam's edge is curved: at the contact it lies {hollow_px:.2f} px off the line through its "
        "columns, which is in the shaker's standard errors; give fewer columns (--columns) or check the lens",
        "background_moves": "the background moves with the picture, by up to {shift_px:.2f} px: an electronic "
        "stabiliser, or a camera that moves; it is in the standard errors; record without a stabiliser, or take it "
        "out with fixed_marks (--fixed-mark)",
    },
    error={
        "scale": "at this pixel size the beam is {found_mm:.3g} mm thick; pixel_size (--pixel-size) is in metres, "
        "such as 12e-6",
        "no_rest": "the recording begins in motion ({quiet:.0f} quiet frame(s)), so where the beam rests is not known "
        "and all displacements are shifted by up to {shift_mm:.3g} mm, which is in their standard errors; give "
        "rest_frames (--rest-frames), such as a range at the end, or record from before the start",
        "frames_lost": "at least {frames:.0f} frame(s) are missing at {places:.0f} place(s), the first before frame "
        "{first:.0f}: times after it are {short_ms:.3g} ms or more too small; copy the recording again, or keep the "
        "frames before",
        "frames_exchanged": "{frames:.0f} pair(s) of frames are in the wrong order, the first from frame {first:.0f} "
        "on: write the images again in the order of their numbers",
        "time_jump": "the drive's phase jumps by {size:.2f} frames at about frame {first:.0f}: frames are missing, or "
        "two recordings were joined; keep the frames before",
        "knocked": "the picture shifts by {size:.2f} px at about frame {first:.0f}: the camera was knocked (or, where "
        "beam and striker move alike, frames are missing); keep the frames before, or give a part with a stationary "
        "object (fixed_marks, --fixed-mark)",
        "jump": "beam and striker jump by {beam:.2f} and {striker:.2f} px at frame {first:.0f}: frames are missing, "
        "two recordings were joined, or the camera was knocked; keep the frames before",
        "rate_changes": "from about frame {first:.0f} on the drive has {ratio:.2f} times its frequency before: the "
        "frame rate changed within the recording; keep the frames before, or give each part its frame_rate "
        "(--frame-rate)",
        "beyond": "{told}: check pixel_size (--pixel-size), frame_rate (--frame-rate) and buckling_level "
        "(--buckling-level)",
    },
)

_WELLS = 3.0  # buckling levels; a beam that snaps through does not go further
_FASTEST = (30.0, 3.0)  # m/s of beam and shaker
_CLOSE = 3.0  # px of gap that is no contact, of a tip that merges with the beam
_NEAR = 1.2  # px of gap that is no contact, of another one
_STRIKER = 0.5  # share of the frames in which the striker must be found
_BENT = 0.09  # share of recordings with a curve, where edges leave it open
_CONTACT = 6  # stretches of frames in contact from which an offset is told
_LEVELS = 16.0  # grey levels of contrast
_EVENED = 0.4  # grey levels of noise that even out their rounding
_RARE = 0.05  # share of frames that may jump or be distorted without more than a note


@dataclass(frozen=True)
class SeenMotion:
    """Input of the diagnostics of a tracked recording, in addition to the scene.

    ``penetration`` [px] of the tip into the beam, NaN where unknown, and that while they ``touch``; ``scale``
    [mm/px]; the largest ``drift`` [px] of the camera; ``open_share``, the exposure over the time between frames, 0 if
    not known; ``moves`` [px] of the background, 0 if it stands still.
    """

    rows: TrackedRows
    rest: Rest
    penetration: np.ndarray
    touch: Touch
    scale: float
    drift: float
    fields: VideoFields
    order: FrameOrder
    blur: ExposureBlur
    open_share: float
    moves: float


def tracking_diagnostics(
    scene: Scene, seen: SeenMotion, settings: TrackingSettings, offset_mm: float, rate: float
) -> tuple[Diagnostic, ...]:
    """Diagnostics of a tracked recording.

    *offset_mm* is the error of the rest position, *rate* that of the frames [Hz].
    """
    told = [*_of_the_beam(scene, seen), *_of_the_scale(scene, seen, settings)]
    told += _of_the_rest(seen, settings, offset_mm) + _of_the_motion(seen, settings, rate)
    shape, noise, shift, order = scene.shape, scene.noise, rounding_shift(scene.beam), seen.order
    alike = {"correlation": max(noise.along, noise.across), "factor": noise.factor, "made_px": noise.made_up}
    lost, repeated, frames = order.missing, order.repeated, sum(order.many)
    gaps = {"frames": frames, "places": len(lost), "first": min(lost, default=0), "short_ms": 1e3 * frames / rate}
    clipped, bent = shape.clipped > CLIPPED, abs(shape.shift) > 0.02
    moved = {"shift_px": 2.0 * abs(shape.shift)}
    curve = {"gamma": settings.gamma * shape.gamma, "error": settings.gamma * shape.gamma_se, **moved}
    told += holding(
        KINDS,
        ("frames_lost", bool(lost), gaps),
        ("frames_repeated", bool(repeated), {"frames": len(repeated), "first": min(repeated, default=0)}),
        *((kind, not lost, numbers) for kind, numbers in order.clock),
        ("lag", seen.blur.trail > 0.0, {"share_percent": 100.0 * seen.blur.trail}),
        ("pulse", seen.blur.pulse > 0.0, {"frames": seen.blur.pulse}),
        ("curved", seen.rows.hollow > 0.0, {"hollow_px": seen.rows.hollow}),
        ("overexposed", clipped, {"share_percent": 100.0 * shape.clipped, **moved}),
        ("gamma", bent and not clipped, curve),
        ("edge_shape", shape.misfit > 0.03 and not (bent or clipped), {"misfit_percent": 100.0 * shape.misfit}),
        ("interlaced", seen.fields.apart > 0.0, {"share": seen.fields.apart}),
        ("fields", seen.fields.shift > 0.0, {"shift_px": seen.fields.shift}),
        ("averaged", noise.lag > 0.0, {"correlation": noise.in_time, "lag": noise.lag}),
        ("smoothed", noise.factor > 1.0 or noise.across > 0.0, alike),
        ("few_levels", shift > 0.0, {"levels": scene.beam.contrast, "shift_px": shift}),
    )
    told += _of_the_frames(seen.rows)
    if scene.shaker is not None:
        told += _of_the_tip(scene, seen)
    told += holding(
        KINDS,
        ("striker_in_view", scene.striker_in_view, {}),
        ("background_moves", seen.moves > 0.0, {"shift_px": seen.moves}),
        ("drift", seen.drift > 0.05, {"drift_px": seen.drift}),
    )
    return tuple(told)


def contact_shift(touch: Touch, known: float) -> float:
    """Offset [px] between shaker and beam from their contact; 0 if it cannot be determined.

    *known* is the standard error [px] of where tip and beam are, which explains as much.
    """
    shift = abs(touch.penetration)
    told = touch.frames >= _CONTACT and shift > max(6.0 * touch.error, 4.0 * known, 0.06)
    return shift if told else 0.0


def open_shift(shape: EdgeShape, touch: Touch, known: float) -> float:
    """Standard error [px] of the shaker against the beam by curves of the camera that edges and contact leave open.

    *known* is as in :func:`contact_shift`.  Without a contact a curve is as probable as it is rare.
    """
    far, share = 2.0 * shape.open, _BENT
    if touch.frames and far > 0.0:
        error = math.hypot(touch.error, known)
        wide = math.hypot(far, error)
        gain = (touch.penetration / error) ** 2 - (touch.penetration / wide) ** 2 - 2.0 * math.log(wide / error)
        share = likely(gain, -2.0 * math.log(_BENT / (1.0 - _BENT)))
        far = far / wide * math.hypot(far / wide * touch.penetration, error)
    return math.sqrt(share) * far


def rounding_shift(beam: BeamView) -> float:
    """Shift [px] of edges by grey levels rounded to few; 0 where they are many or noise cancels the rounding."""
    if beam.noise > _EVENED or beam.contrast > _LEVELS:
        return 0.0
    return 1.5 * max(beam.edge_width, 0.5) / beam.contrast


def never_touching(penetration: np.ndarray, rows: TrackedRows) -> float:
    """Minimum gap [px] between tip and beam if the beam moves without ever being touched; else 0."""
    row = rows.row
    known, seen = np.isfinite(penetration), np.isfinite(row)
    if not known.any() or not seen.any() or np.ptp(np.percentile(row[seen], (0.5, 99.5))) <= 2.0:
        return 0.0
    closest = -float(np.percentile(penetration[known], 99.5))
    least = _CLOSE if rows.flagged(FrameFlag.MERGED) else _NEAR  # a tip that merges with the beam is not seen closer
    return closest if closest > least else 0.0


def _of_the_beam(scene: Scene, seen: SeenMotion) -> list[Diagnostic]:
    bars, found = scene.beam.fixtures, scene.beam.thickness * seen.scale
    row = seen.rows.row[np.isfinite(seen.rows.row)]
    span = float(np.ptp(np.percentile(row, (0.5, 99.5)))) if row.size else math.inf
    return holding(
        KINDS,
        ("fixture", bool(bars), {"count": len(bars), "row": bars[0][0] if bars else 0}),
        ("no_motion", span < max(0.3, 8.0 * float(np.nanmedian(seen.rows.error))), {"range_px": span}),
        ("scale", not 0.005 <= found <= 30.0, {"found_mm": found}),
    )


def _of_the_scale(scene: Scene, seen: SeenMotion, settings: TrackingSettings) -> list[Diagnostic]:
    rulers, unseen = seen_rulers(scene, seen.rows.shaker, settings, seen.open_share)
    told = [KINDS["ruler_unseen"].found(told=option_name(name)) for name in unseen]
    found = compare_rulers([Ruler("pixel_size", 1e-3 * seen.scale / scene.straight, 0.0), *rulers])
    if found is not None:
        severity, words, numbers = found
        told.append(KINDS["rulers"].found(severity, words, **numbers))
    return told


def _of_the_motion(seen: SeenMotion, settings: TrackingSettings, rate: float) -> list[Diagnostic]:
    """Diagnostics for a beam or shaker motion beyond plausible displacement or speed."""
    told = []
    if settings.buckling_level is not None:
        sign = 1.0 if settings.side in ("below", "left") else -1.0
        far = np.abs(settings.rest - sign * 1e-3 * seen.scale * (seen.rows.row - seen.rest.row))
        most = float(np.nanpercentile(far, 99.5)) / settings.buckling_level
        if most > _WELLS:
            told.append(f"the beam moves to {most:.3g} buckling levels, more than {_WELLS:g}")
    for name, row, limit in zip(("beam", "shaker"), (seen.rows.row, seen.rows.shaker), _FASTEST, strict=True):
        steps = np.abs(np.diff(row))
        if np.isfinite(steps).any():
            speed = float(np.nanpercentile(steps, 99.0)) * 1e-3 * seen.scale * rate
            if speed > limit:
                told.append(f"the {name} moves at {speed:.3g} m/s, above {limit:g} m/s")
    return [KINDS["beyond"].found(told=", ".join(told))] if told else []


def _of_the_rest(seen: SeenMotion, settings: TrackingSettings, offset_mm: float) -> list[Diagnostic]:
    if seen.rest.found:
        return []
    if settings.rest_frames is not None:
        drift = seen.rest.drift
        told = (
            f"the beam moves within the rest_frames (--rest-frames) given, or right beside them, by {drift:.0f} times "
            "the standard error of a frame"
            if np.isfinite(drift)
            else "the rest_frames (--rest-frames) given, and those measured beside them, are too few to show that the "
            "beam rests"
        )
        return [KINDS["rest_moves"].found(told=told, drift=drift, shift_mm=offset_mm)]
    return [KINDS["no_rest"].found(quiet=2 * seen.rest.indices.size, shift_mm=offset_mm)]


def _of_the_frames(rows: TrackedRows) -> list[Diagnostic]:
    told = []
    for name, flag in (("jumps", FrameFlag.JUMP), ("distorted", FrameFlag.DISTORTED)):
        if frames := rows.flagged(flag):
            share = frames / rows.row.size
            severity = Severity.WARNING if share > _RARE else Severity.INFO
            told.append(KINDS[name].found(severity, frames=frames, share_percent=100.0 * share))
    share = float(np.isfinite(rows.row).mean())
    return told + holding(KINDS, ("lost", share < 0.9, {"share_percent": 100.0 * share}))


def _of_the_tip(scene: Scene, seen: SeenMotion) -> list[Diagnostic]:
    shaker = scene.shaker
    assert shaker is not None
    share = float(np.isfinite(seen.rows.shaker).mean())
    told = holding(KINDS, ("striker_lost", share < _STRIKER, {"share_percent": 100.0 * share}))
    if not np.isfinite(seen.penetration).any():
        return told
    error = np.hypot(seen.rows.error, seen.rows.shaker_error)
    given = shaker.tip_source == "distance to the sticker as given"
    if shaker.isolated and not given and shaker.sticker is not None:
        # the sticker's own upper edge over the beam
        nearest = -float(np.nanmax(seen.penetration)) - shaker.tip_offset - 0.5 * shaker.sticker.thickness
        told.append(KINDS["sticker_alone"].found(height_px=shaker.sticker.thickness, gap_px=nearest))
    closest = never_touching(seen.penetration, seen.rows)
    offset = {"depth_px": seen.touch.penetration, "error_px": seen.touch.error}
    with np.errstate(invalid="ignore"):
        deep = seen.penetration[seen.penetration - 5.0 * error > 1.0]
    return told + holding(
        KINDS,
        ("turned", shaker.turn != 0.0, {"angle": math.degrees(math.atan(shaker.turn))}),
        ("rod_cut", shaker.cut, {}),
        ("sticker_loose", shaker.loose > 0.0, {"swing_px": shaker.loose}),
        ("no_contact" if shaker.certain else "never_touches", closest > 0.0, {"gap_px": closest}),
        ("contact_offset", contact_shift(seen.touch, scene.placed_error) > 0.0, offset),
        ("inside", deep.size >= 3, {"depth_px": float(deep.max(initial=0.0)), "frames": deep.size}),
    )
