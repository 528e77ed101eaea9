"""The rows of all frames together: jumps, distorted frames, rest, and standard errors that lean on each other."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from snapbeam.lab.camera import Recording
from snapbeam.lab.decay.model import likely
from snapbeam.lab.signals import stretches
from snapbeam.lab.tracking.edges import (
    Floats,
    alike_columns,
    edge_noise,
    edge_profile,
    fit_edges,
    fit_line,
    masked_median,
)
from snapbeam.lab.tracking.settings import (
    HALF,
    HOT,
    BeamView,
    FrameFlag,
    Scene,
    Sticker,
    TipOutline,
    edges_about,
    gather,
)
from snapbeam.util.singular_values import polyfit

_WIDER = 1.6  # times the width that is explained
_FAR = 5.0  # standard deviations of the thickness that are no chance
_STRETCH = 32  # frames that faint light must last to be told
_FAINT = 0.025  # px by which the thickness must then be off on average
_JUMP = 3.0  # px
_LONGEST = 3  # frames of a jump
_STEADY = 0.005  # px; noise less than this is not asked of a rest
_QUIET = 8  # frames that make a rest
_FEW = 5  # frames that may be nearer than those that count as nearest
_OFTEN = 3  # stretches as quiet as the start from which the start is nothing special


class Rest(NamedTuple):
    """Frames at rest, the row there and its standard error; whether it is one, or the recording begins in motion.

    ``drift`` is by how much the row moves within the frames, in standard errors of a frame.
    """

    indices: NDArray[np.intp]
    row: float
    error: float
    found: bool
    drift: float


class Touch(NamedTuple):
    """Penetration [px] while beam and shaker move together, its standard error, and the frames it rests on."""

    penetration: float
    error: float
    frames: int


def touching(penetration: Floats, error: Floats, beam: Floats) -> Touch:
    """Penetration in the frames in which beam and shaker move together: zero, if both are located rightly.

    They are together where, over four frames, the penetration stays within its errors while the beam moves by
    many, as near to each other as they ever come; of all such stretches those that agree count.
    """
    length = 4
    nothing = Touch(math.nan, math.nan, 0)
    if penetration.size < 2 * length:
        return nothing
    views = np.lib.stride_tricks.sliding_window_view
    together, motion = views(penetration, length), views(beam, length)
    noise = float(np.nanmedian(error)) if np.isfinite(error).any() else math.nan
    if not math.isfinite(noise):
        return nothing
    known = np.isfinite(together).all(1) & np.isfinite(motion).all(1)
    still = np.full(known.shape, False)
    still[known] = (np.ptp(together[known], axis=1) < 4.5 * noise) & (
        np.ptp(motion[known], axis=1) > max(12.0 * noise, 0.3)
    )
    # two bodies also move together where they are farthest apart; touching, they are at their nearest
    seen = penetration[np.isfinite(penetration)]
    deepest = float(np.partition(seen, -_FEW)[-_FEW]) if seen.size > _FEW else 0.0
    means = together.mean(1)
    still &= np.where(known, means, -np.inf) > deepest - max(5.0 * noise, 0.1)
    if np.count_nonzero(still) < 3:
        return nothing
    means = np.sort(means[still])
    counts = np.searchsorted(means, means + max(16.0 * noise, 0.3), side="right") - np.arange(means.size)
    first = int(np.argmax(counts))
    near = means[first : first + int(counts[first])]
    spread = max(float(np.std(near)), noise / math.sqrt(length))
    return Touch(float(np.median(near)), spread / math.sqrt(max(near.size / length, 1.0)), int(near.size))


def jumps(rows: Floats) -> NDArray[np.bool_]:
    """Frames whose row leaves both neighbours, for up to three frames, as no motion does.

    The steps into and out of the jump must be of opposite sign, beyond 3 px and ten times the usual bend of
    the motion, and three times as large as the steps before and after: a beam thrown back moves as fast
    before and after.
    """
    out = np.zeros(rows.shape, dtype=bool)
    at = np.flatnonzero(np.isfinite(rows))
    if at.size < 8:
        return out
    values = rows[at]
    step = np.abs(np.diff(values, prepend=values[0], append=values[-1]))
    for length in range(1, _LONGEST + 1):
        n = values.size - length - 1
        before, *within, behind = np.lib.stride_tricks.sliding_window_view(values, n)
        inside = np.stack(within)
        share = np.arange(1, length + 1)[:, None] / (length + 1.0)
        bend = inside - (before + share * (behind - before))
        least = np.abs(bend).min(0)
        same = (bend > 0.0).all(0) | (bend < 0.0).all(0)
        usual = 1.4826 * float(np.median(np.abs(bend)))
        own = np.maximum(step[:n], step[length + 2 :])
        steps = np.minimum(np.abs(inside[0] - before), np.abs(behind - inside[-1]))
        near = at[length + 1 :] - at[:n] <= length + 5
        for k in np.flatnonzero(same & near & (least > max(_JUMP, 10.0 * usual)) & (steps > 3.0 * own + 1.0)):
            out[at[k + 1 : k + 1 + length]] = True
    return out


def wanderings(rows: Floats, lost: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Frames of a row that strays while something it leans on is *lost*.

    Lost frames are held against a line between those before and after, and may bend as the motion bends elsewhere.
    """
    out = np.zeros(rows.shape, dtype=bool)
    good = np.isfinite(rows) & ~lost
    where = np.flatnonzero(good)
    if where.size < 8:
        return out | (lost & np.isfinite(rows))
    whole = good[:-2] & good[1:-1] & good[2:]
    bends = np.abs(rows[2:] - 2.0 * rows[1:-1] + rows[:-2])[whole]
    bend = float(np.percentile(bends, 99.5)) if bends.size else 0.0
    suspect = np.flatnonzero(lost & np.isfinite(rows))
    position = np.searchsorted(where, suspect)
    left = where[np.clip(position - 1, 0, where.size - 1)]
    right = where[np.clip(position, 0, where.size - 1)]
    span = np.maximum(right - left, 1)
    line = rows[left] + (rows[right] - rows[left]) * np.clip((suspect - left) / span, 0.0, 1.0)
    beyond = (suspect < where[0]) | (suspect > where[-1])
    allowed = _JUMP + bend * (span / 2.0) ** 2 / 2.0
    strays = np.abs(rows[suspect] - line) > allowed
    out[suspect] = np.where(beyond, np.abs(suspect - left) > _LONGEST, strays)
    return out


def distortion(
    thickness: Floats, residual: Floats, width: Floats, usual_width: float, row_error: float
) -> tuple[Floats, NDArray[np.bool_]]:
    """Deviation of the beam thickness from the usual value [px], and the distorted frames.

    A frame is distorted if that exceeds five robust standard deviations, 0.06 px and the noise of rows (*row_error*
    [px] of one edge), if the mean over 32 frames about it is as far off (faint light that lasts), or if its edges are
    no steps: fits that leave three times as much as usual without being blurred.
    """
    known = np.isfinite(thickness)
    miss = np.zeros(thickness.shape)
    odd = np.zeros(thickness.shape, dtype=bool)
    if known.sum() >= 8:
        usual = float(np.median(thickness[known]))
        spread = 1.4826 * float(np.median(np.abs(thickness[known] - usual)))
        miss[known] = np.abs(thickness[known] - usual)
        both = _FAR * math.sqrt(2.0) * row_error
        odd = miss > max(_FAR * spread, 0.06, both)
        faint = _lasting(thickness[known] - usual, max(_FAINT, both))
        miss[known] = np.maximum(miss[known], faint)
        odd[known] |= faint > 0.0
    sound = np.isfinite(residual)
    if sound.any():
        with np.errstate(invalid="ignore"):
            rough = residual > 3.0 * float(np.median(residual[sound])) + 0.03
            odd |= rough & ~(width > 1.5 * usual_width + 0.3)
    return miss, odd


def _lasting(miss: Floats, least: float) -> Floats:
    """Mean deviation of the thickness over the stretch around each frame; 0 unless significant and beyond *least*.

    It is the larger of those from the median and from the half of the stretches that are most alike, for light on many
    frames moves the median.  Steps from frame to frame tell chance, which light that lasts does not widen.
    """
    out = np.zeros(miss.size)
    if miss.size < 4 * _STRETCH:
        return out
    noise = 1.4826 * float(np.median(np.abs(np.diff(miss)))) / math.sqrt(2.0)
    mean = np.convolve(miss, np.full(_STRETCH, 1.0 / _STRETCH), "valid")
    ordered, half = np.sort(mean), mean.size // 2
    at = int(np.argmin(ordered[half:] - ordered[: ordered.size - half]))
    mean = np.maximum(np.abs(mean), np.abs(mean - float(np.median(ordered[at : at + half + 1]))))
    for first in np.flatnonzero(mean > max(_FAR * noise / math.sqrt(_STRETCH), least)):
        inside = slice(int(first), int(first) + _STRETCH)
        out[inside] = np.maximum(out[inside], mean[first])
    return out


def pooled(error: Floats) -> Floats:
    """Standard errors of single frames, none less than the usual one: few columns scatter less by chance."""
    known = np.isfinite(error)
    if not known.any():
        return error
    usual = float(np.median(error[known]))
    with np.errstate(invalid="ignore"):
        return np.where(error < usual, usual, error)


def unexplained_blur(row: Floats, width: Floats, usual: float, limit: float) -> Floats:
    """Excess of the edge width over lens and motion blur [px], over the frames; otherwise 0.

    An exposure is no longer than a frame, so motion smears an edge over no more than the step from frame to
    frame, with a standard deviation of that over the root of 12.  Beyond *limit* edges are too wide for their windows:
    the excess is that over the lens alone.
    """
    with np.errstate(invalid="ignore"):
        explained = np.hypot(usual, fastest(row) / np.sqrt(12.0))
        excess = np.where(width > _WIDER * explained + 0.2, width - explained, 0.0)
        return np.where(width > limit, width - usual, excess)


def fastest(row: Floats) -> Floats:
    """The larger step of a row to the frame before or after, NaN where neither is known."""
    step = np.abs(np.diff(row, prepend=np.nan, append=np.nan))
    return np.asarray(np.fmax(step[1:], step[:-1]))


def find_rest(row: Floats, error: Floats, shaker: Floats, given: tuple[int, int] | None) -> Rest:
    """The frames at rest, given or sought at the start.

    Sought: the first half of the frames before the row departs from their mean by three standard errors.  A
    turning point looks like rest for a few frames too, so it must last eight frames, and beam and shaker (NaN
    where it is not followed) must not be as quiet time and again.
    """
    known = np.flatnonzero(np.isfinite(row))
    if given is not None:
        used = known[(known >= given[0]) & (known < given[1])]
        if not used.size:
            return Rest(used, math.nan, math.nan, False, math.nan)
        noise = max(float(np.sqrt(np.mean(error[used] ** 2))), _STEADY)
        thirds = [part.mean() for part in np.array_split(row[used], 3) if part.size]
        drift = float(np.ptp(thirds)) / (noise / math.sqrt(max(used.size / 3.0, 1.0)))
        drift = max(drift, _beside(row[known], np.flatnonzero(np.isin(known, used)), noise))
        return Rest(used, float(row[used].mean()), _mean_error(row[used], noise), drift < 8.0, drift)
    if not known.size:
        return Rest(known, math.nan, math.nan, False, math.nan)
    noise = max(float(np.median(error[known])), _STEADY)
    values = row[known]
    averaged = np.arange(1, known.size)
    before = np.cumsum(values)[:-1] / averaged
    gone = np.abs(values[1:] - before) > 3.0 * noise * np.sqrt(1.0 + 1.0 / averaged) + 1e-6
    # one frame in some hundred strays by chance; two in a row do not
    away = gone & np.append(gone[1:], True)
    quiet = int(away.argmax()) + 1 if away.any() else known.size
    used = known[: (quiet + 1) // 2]
    length = max(4 * quiet // 5, _QUIET)
    still = _still(values[quiet:], length, noise)
    if np.isfinite(shaker[known]).mean() > 0.5:
        still &= _still(shaker[known][quiet:], length, noise)
    found = quiet >= _QUIET and len(stretches(still)) < _OFTEN
    return Rest(used, float(row[used].mean()), _mean_error(row[used], noise), found, 0.0)


def _beside(values: Floats, used: NDArray[np.intp], noise: float) -> float:
    """Deviation of few frames at rest, which tell no motion, from those of the nearer side, in standard errors."""
    short = _QUIET - used.size
    if short <= 0:
        return 0.0
    middle = float(values[used].mean())
    sides = [values[max(used[0] - short, 0) : used[-1] + 1], values[used[0] : used[-1] + 1 + short]]
    return min((float(np.abs(side - middle).max()) / noise for side in sides if side.size == _QUIET), default=math.inf)


def _still(values: Floats, length: int, noise: float) -> NDArray[np.bool_]:
    """From which frames on the row stays within six standard errors for *length* frames."""
    if values.size < length:
        return np.zeros(0, dtype=bool)
    shift = -(length // 2)
    filled = np.where(np.isfinite(values), values, 1e6 * np.arange(values.size))
    high, low = (extreme(filled, length, origin=shift) for extreme in (maximum_filter1d, minimum_filter1d))
    return np.asarray(((high - low) < 6.0 * noise)[: values.size - length + 1])


def _mean_error(values: Floats, noise: float) -> float:
    spread = float(np.std(values)) if values.size > 4 else noise
    return max(spread, noise) / math.sqrt(values.size)


# ----------------------------------------------------------------------------------------------------
# The beam's far edge in a batch of frames: found roughly in columns free of the shaker, then fitted.


_CHECKED = 4  # columns of a group in which the near edge is fitted too
_CONTRAST = (0.4, 1.8)  # of the usual, between which a step is the edge that is followed


def _sound(contrast: Floats, usual: float) -> NDArray[np.bool_]:
    return np.asarray((contrast > _CONTRAST[0] * usual) & (contrast < _CONTRAST[1] * usual))


def _too_hot(windows: Floats, inside: NDArray[np.bool_], view: BeamView) -> Floats:
    """Share of saturated pixels in the windows of each frame."""
    return np.asarray(((windows >= view.saturated) & inside[..., None]).mean((1, 2)))


class BeamRows(NamedTuple):
    """The far edge at the contact column of each frame, and what was seen on the way.

    ``row`` and ``slope`` are NaN where it was not found.  ``thickness`` [px] is measured across the beam in columns
    free of the shaker (NaN without such columns), ``hollow`` [px] by how much a parabola through the columns lies off
    the line at the contact, ``residual`` what the fitted steps leave of their windows, share of the contrast.
    ``level_range`` is the range of grey levels along the columns over the usual contrast, ``touches`` whether an
    object reached the far border there.
    """

    row: Floats
    error: Floats
    slope: Floats
    share: Floats
    contrast: Floats
    width: Floats
    thickness: Floats
    residual: Floats
    saturated: Floats
    level_range: Floats
    touches: NDArray[np.bool_]
    outside: NDArray[np.bool_]
    hollow: Floats


def measure_beam(view: BeamView, frames: NDArray[np.floating]) -> BeamRows:
    """Measure the far edge in turned frames (n, height, width)."""
    count, height = frames.shape[:2]
    guesses = np.full((len(view.groups), count), np.nan)
    ranges, touches = np.zeros(count), np.zeros(count, dtype=bool)
    longest = height if view.merged else 1.6 * view.thickness + 3.0
    for guess, group in zip(guesses, view.groups, strict=True):
        profile = frames[:, :, group].mean(-1, dtype=np.float64)
        profile[:, 1:-1] = (profile[:, 2:] + profile[:, 1:-1] + profile[:, :-2]) / 3.0
        ranges = np.maximum(ranges, np.ptp(profile, axis=1) / view.contrast)
        solid = (profile - view.threshold) * view.sign > 0.0
        for first, last in view.fixtures:
            solid[:, first:last] = False
        touches |= solid[:, :2].any(1)
        for k, inside in enumerate(solid):  # the far edge of the first band of fitting thickness
            bands = (one for one, end in stretches(inside) if 0.6 * view.thickness <= end - one <= longest and one)
            guess[k] = next(bands, np.nan) - 0.5
    about = frames[:, :, view.columns].mean(-1, dtype=np.float64)
    ranges = np.maximum(ranges, np.ptp(about, axis=1) / view.contrast)
    anchor, tilt = _anchor(guesses, [float(group.mean()) for group in view.groups])
    rows = anchor[:, None] + tilt[:, None] * view.columns
    half = view.half
    windows, inside, fit, edges = edges_about(frames, rows, view.columns, half, view.edge_width, view.sign)
    good = inside & np.isfinite(edges) & _sound(fit.contrast, view.contrast)
    for first, last in view.fixtures:
        with np.errstate(invalid="ignore"):
            good &= (rows < first - half) | (rows >= last + half)
    noise = edge_noise(view.edge_width, view.noise, view.contrast)
    row, error, slope, kept = fit_line(view.columns - view.contact_column, edges, good, 1.5, noise)
    share = kept.mean(1)
    saturated = _too_hot(windows, inside, view)
    weak = (share < 0.5) | (saturated > view.hot_share + HOT)
    row[weak], slope[weak] = np.nan, np.nan
    return BeamRows(
        row=row,
        error=error,
        slope=slope,
        share=share,
        contrast=masked_median(fit.contrast, inside) / view.contrast,
        width=np.interp(masked_median(fit.width, kept), *view.width_table),
        thickness=_thickness(view, frames, row, slope, half),
        residual=masked_median(fit.residual, kept) / view.contrast,
        saturated=saturated,
        level_range=ranges,
        touches=touches,
        outside=np.isfinite(anchor) & ~inside.any(1),
        hollow=_hollow(view.columns - view.contact_column, edges - row[:, None], slope, kept),
    )


def _hollow(x: Floats, edges: Floats, slope: Floats, kept: NDArray[np.bool_]) -> Floats:
    """Rows at x = 0 of a parabola through *edges*, which are counted from the line through them."""
    line = polyfit(x, x * x, 1)
    bend = x * x - np.polyval(line, x)
    left = np.where(kept, edges - slope[:, None] * x, 0.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        curve: Floats = (left * bend).sum(1) / np.where(kept, bend * bend, 0.0).sum(1)
    return -curve * float(line[1])


def _anchor(guesses: Floats, middles: list[float]) -> tuple[Floats, Floats]:
    """Row at column 0 and slope of a line through the rough rows of one or two groups of columns."""
    if len(middles) == 1:
        return guesses[0], np.zeros(guesses.shape[1])
    with np.errstate(invalid="ignore"):
        tilt = (guesses[1] - guesses[0]) / (middles[1] - middles[0])
    usual = float(np.median(tilt[np.isfinite(tilt)])) if np.isfinite(tilt).any() else 0.0
    tilt = np.where(np.isfinite(tilt), tilt, usual)
    left = guesses[0] - tilt * middles[0]
    return np.where(np.isfinite(left), left, guesses[1] - tilt * middles[1]), tilt


def _thickness(view: BeamView, frames: NDArray[np.floating], row: Floats, slope: Floats, half: int) -> Floats:
    """Rows across the beam, in a few columns free of the shaker, where light on one of the edges shows."""
    if view.merged:
        return np.full(row.shape, np.nan)
    columns = np.concatenate(
        [one[:_CHECKED] if one.mean() < view.contact_column else one[-_CHECKED:] for one in view.groups]
    )
    across = columns - view.contact_column
    expected = row[:, None] + slope[:, None] * across + view.thickness
    windows, inside = gather(frames, expected, columns, half)
    fit = fit_edges(windows, view.edge_width, sign=-view.sign, iterations=3)
    found = np.rint(np.where(inside, expected, 0.0)) + fit.position - expected
    good = inside & np.isfinite(found) & (np.abs(found) < half - 1.0)
    miss = np.where(good.sum(1) >= 3, masked_median(found, good), np.nan)
    return (view.thickness + miss) / np.sqrt(1.0 + np.where(np.isfinite(slope), slope, 0.0) ** 2)


# ----------------------------------------------------------------------------------------------------
# The sticker on the shaker in every frame, the best mark: it stays visible while tip and beam touch.


SOLID = 3.0  # rows by which a shaker may seem to stand inside the beam


class ShakerRows(NamedTuple):
    """Row of the shaker's reference in each frame, its standard error, and the quality of the edges."""

    row: Floats
    error: Floats
    share: Floats
    contrast: Floats
    merged: NDArray[np.bool_]
    saturated: Floats


def sticker_rows(
    view: BeamView, sticker: Sticker, frames: NDArray[np.floating], near: Floats, tip_offset: float | None = None
) -> ShakerRows:
    """Rows of the sticker's middle in turned frames, below the beam's near edge at *near*.

    ``tip_offset`` is the tip's row from the middle, if it is known already: the tip cannot stand inside the beam.
    """
    upper, lower, good, strength, saturated = _both_edges(view, sticker, frames, near, tip_offset)
    noise = math.sqrt(0.5) * edge_noise(view.edge_width, view.noise, sticker.contrast)
    row, error, _, kept = fit_line(sticker.columns - view.contact_column, 0.5 * (upper + lower), good, 1.5, noise)
    share = kept.mean(1)
    return ShakerRows(
        row=np.where((share >= 0.5) & (saturated <= view.hot_share + HOT), row, np.nan),
        error=error,
        share=share,
        contrast=masked_median(strength, kept) / sticker.contrast,
        merged=np.zeros(row.shape, dtype=bool),
        saturated=saturated,
    )


def sticker_thickness(view: BeamView, sticker: Sticker, frames: NDArray[np.floating], near: Floats) -> float:
    """Rows from the sticker's upper edge to its lower one, to a fraction of a pixel."""
    upper, lower, good, *_ = _both_edges(view, sticker, frames, near, None)
    found = (lower - upper)[good]
    return float(np.median(found)) if found.size else sticker.thickness


def _both_edges(
    view: BeamView, sticker: Sticker, frames: NDArray[np.floating], near: Floats, tip_offset: float | None
) -> tuple[Floats, Floats, NDArray[np.bool_], Floats, Floats]:
    """Rows of the upper and the lower edge, which are sound, their contrast (frames, columns), and saturated shares."""
    columns = sticker.columns
    half = int(np.clip(sticker.thickness // 2, 2, HALF))
    if tip_offset is not None:
        first = near - SOLID - tip_offset - sticker.thickness / 2.0
    else:  # nor can the sticker be the gap between beam and tip
        first = near + 3.0
    profiles = frames[:, :, columns].mean(-1, dtype=np.float64)
    top = _locate(sticker, profiles, np.where(np.isfinite(first), first, -np.inf), 0.1 * view.contrast)
    rows = np.repeat(top[:, None], columns.size, axis=1)
    edges, strength, saturated, good = [], [], [], np.ones(rows.shape, dtype=bool)
    for shift, sign in ((0.0, sticker.sign), (sticker.thickness, -sticker.sign)):
        windows, inside, fit, found = edges_about(frames, rows + shift, columns, half, view.edge_width, sign)
        edges.append(found)
        strength.append(fit.contrast)
        saturated.append(_too_hot(windows, inside, view))
        good &= inside & np.isfinite(found) & _sound(fit.contrast, sticker.contrast)
    good &= np.abs(edges[1] - edges[0] - sticker.thickness) < 3.0
    return edges[0], edges[1], good, np.mean(strength, axis=0), np.max(saturated, axis=0)


def _locate(sticker: Sticker, profiles: Floats, first: Floats, least: float) -> Floats:
    """Row of the sticker's upper edge, from *first* on, to about a pixel, where the range is not below *least*."""
    template = sticker.template - sticker.template.mean()
    template /= np.sqrt((template * template).sum())
    if profiles.shape[1] <= template.size:
        return np.full(profiles.shape[0], np.nan)
    views = np.lib.stride_tricks.sliding_window_view(profiles, template.size, axis=1)
    cross = views @ template
    power = np.maximum((views * views).sum(-1) - views.sum(-1) ** 2 / template.size, 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        score = np.where(power > least**2, cross / np.sqrt(power), -1.0)
    rows = np.arange(score.shape[1]) + sticker.head
    score = np.where(rows[None, :] >= first[:, None], score, -1.0)
    best = score.argmax(1)
    return np.where(score[np.arange(score.shape[0]), best] > 0.7, rows[best], np.nan)


# ----------------------------------------------------------------------------------------------------
# Collecting the measurements of all frames, with every frame's trouble on record.


_HOLLOW = 0.06  # px of curvature in all frames, more than of real surfaces
_SMEARED = 0.25  # error over what edges are wider than explained

BORDER = 14.0  # rows from the border within which a vanished object is taken to have left the region
KEPT = 0.5  # px by which a beam may look distorted and its row still be kept, with that as its error


@dataclass(frozen=True)
class TrackedRows:
    """Rows [px, turned picture] of the whole recording, one entry a frame number; NaN and a flag where not measured.

    ``shaker`` is the row of its reference, ``width`` that of the beam's edge; errors are standard errors.  ``hollow``
    [px] is that of :class:`BeamRows` over all frames, 0 where it is no more than columns scatter.
    """

    row: Floats
    error: Floats
    slope: Floats
    width: Floats
    shaker: Floats
    shaker_error: Floats
    confidence: Floats
    flags: NDArray[np.uint16]
    hollow: float = 0.0

    def flagged(self, flag: FrameFlag) -> int:
        """Number of frames with a flag."""
        return int(np.count_nonzero(self.flags & int(flag)))


class Drift(NamedTuple):
    """Rows by which the camera has sunk in each frame [px], NaN where no mark was seen, and their errors."""

    shift: Floats
    error: Floats


class Follower:
    """Collect the measurements of all batches, and flag invalid frames."""

    def __init__(self, scene: Scene, blur_limit: float | None) -> None:
        self.scene = scene
        self.blur_limit = 2.5 * scene.beam.edge_width + 0.5 if blur_limit is None else blur_limit
        self._parts: list[dict[str, NDArray]] = []
        self._last: NDArray | None = None
        self._border = {"beam": False, "shaker": False}

    def add(self, frames: NDArray[np.floating], beam: BeamRows, tip: ShakerRows | None, drift: Drift | None) -> None:
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
            wide = beam.width > self.blur_limit
        flags[wide] |= np.uint16(FrameFlag.BLUR)
        confidence = beam.share * np.minimum(1.0, np.nan_to_num(beam.contrast))
        confidence *= np.minimum(1.0, view.edge_width / np.fmax(beam.width, view.edge_width))
        row = np.full(beam.row.shape, np.nan)
        error = row
        if tip is not None and self.scene.shaker is not None:
            row, error = tip.row.copy(), tip.error
            if self.scene.shaker.sticker is None:  # the beam's light cannot be taken out of such windows
                row[wide] = np.nan
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
        seen = {name: getattr(beam, name) for name in ("slope", "hollow", "thickness", "residual")}
        seen |= {"row": beam.row - shift, "error": np.hypot(beam.error, shift_error)}
        seen = {name: np.where(lost, np.nan, values) for name, values in seen.items()}
        seen |= {"shaker": row - shift, "shaker_error": np.hypot(error, shift_error), "width": beam.width}
        self._parts.append(seen | {"confidence": confidence, "flags": flags})

    def result(self, numbers: NDArray[np.int64]) -> TrackedRows:
        """All batches joined and held against each other; *numbers* are those of the frames."""
        found = {name: np.concatenate([part[name] for part in self._parts]) for name in self._parts[0]}
        found = _with_missing(found, numbers)
        flags, row, shaker, width = (found[name] for name in ("flags", "row", "shaker", "width"))
        usual = self.scene.beam.edge_width
        miss, odd = distortion(found["thickness"], found["residual"], width, usual, self.scene.row_errors[0])
        odd &= np.isfinite(row)
        flags[odd] |= np.uint16(FrameFlag.DISTORTED)
        blur = unexplained_blur(row, width, usual, self.blur_limit)
        error = np.hypot(pooled(found["error"]), np.where(odd, np.fmax(miss, _SMEARED * blur), _SMEARED * blur))
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
        curved = found["hollow"][np.isfinite(found["hollow"])]
        hollow = abs(float(np.median(curved))) if curved.size else 0.0
        return TrackedRows(
            row=row,
            error=np.where(np.isfinite(row), error, np.nan),
            slope=found["slope"],
            width=width,
            shaker=shaker,
            shaker_error=np.where(np.isfinite(shaker), shaker_error, np.nan),
            confidence=np.where(gone, 0.0, found["confidence"]),
            flags=flags,
            hollow=hollow if hollow > _HOLLOW else 0.0,
        )

    def _repeats(self, strip: NDArray[np.floating]) -> NDArray[np.bool_]:
        """Frames equal to the one before, which in a picture with noise cannot happen."""
        before = np.concatenate([strip[:1] + 1.0 if self._last is None else self._last[None], strip[:-1]])
        self._last = strip[-1].copy()
        if self.scene.beam.noise < 0.3:
            return np.zeros(strip.shape[0], dtype=bool)
        return (strip == before).all((1, 2))

    def _leaving(self, name: str, rows: Floats, height: int) -> NDArray[np.bool_]:
        """Mask of the frames whose preceding valid position was near the border of the region."""
        near = (rows < BORDER) | (rows > height - 1 - BORDER)
        last = np.maximum.accumulate(np.where(np.isfinite(rows), np.arange(rows.size), -1))
        out = np.where(last >= 0, near[last], self._border[name])
        self._border[name] = bool(out[-1])
        return out


def _assign(
    flags: NDArray[np.uint16], missing: NDArray[np.bool_], reasons: list[tuple[NDArray[np.bool_], FrameFlag]]
) -> None:
    """Give every missing frame its reasons, and a plain gap where none applies."""
    unexplained = ~np.any([where for where, _ in reasons], axis=0)
    for where, flag in (*reasons, (unexplained, FrameFlag.GAP)):
        flags[missing & where] |= np.uint16(flag)


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


# ----------------------------------------------------------------------------------------------------
# Whether a picture was taken at one instant: interlaced video holds its odd and even rows half a frame apart.


_FRAMES = 32  # the fastest, that are looked at
_PIXELS = 5_000_000  # of these together
_MOVES = 0.1  # px a frame that count as motion
_LEAST = 12  # frames
_CERTAIN = 6.0  # standard errors
_PART = 0.15  # of the step from frame to frame by which rows must differ; fields differ by a half
_SHIFT = 0.02  # px


def fields_apart(
    recording: Recording,
    prepare: Callable[[NDArray[np.integer]], NDArray[np.float32]],
    view: BeamView,
    rows: TrackedRows,
    along_rows: bool,
) -> float:
    """Difference between odd and even rows, as a fraction of the step between frames; 0 if there is none.

    *prepare* turns frames as they were tracked; *along_rows*: the beam is along image rows.
    In the fastest frames the edge is sought in odd and in even rows: with d_k the difference and v_k the step a frame,
    the share is the slope of d over v through 0.  Rows taken together differ by nothing, fields half a frame apart by
    half a step, whatever the sign.
    """
    row = rows.row
    speed = np.where(np.isfinite(row), _speed(row), np.nan)
    at = np.searchsorted(recording.numbers, np.arange(row.size))
    seen = recording.numbers[np.minimum(at, recording.numbers.size - 1)] == np.arange(row.size)
    moving = np.flatnonzero(seen & (np.abs(np.nan_to_num(speed)) > _MOVES))
    if moving.size < _LEAST:
        return 0.0
    count = int(np.clip(_PIXELS // (recording.shape[0] * recording.shape[1]), _LEAST, _FRAMES))
    chosen = np.sort(moving[np.argsort(-np.abs(speed[moving]))[:count]])
    frames = prepare(np.stack([recording.frame(int(at[k])) for k in chosen]))
    columns = view.columns if along_rows else np.arange(view.columns.min(), view.columns.max() + 1)
    lines = row[chosen][:, None] + rows.slope[chosen][:, None] * (columns - view.contact_column)
    windows, inside, fit, edges = edges_about(frames, lines, columns, view.half, view.edge_width, view.sign)
    good = inside & np.isfinite(fit.position) & (fit.contrast > _CONTRAST[0] * view.contrast)
    if along_rows:
        apart = _within_windows(windows * view.sign, fit.position, view.edge_width, np.rint(lines))
    else:
        apart = 2.0 * np.where(columns % 2 == 0, 1.0, -1.0) * (edges - lines)
    with np.errstate(invalid="ignore", divide="ignore"):
        difference = np.where(good, apart, 0.0).sum(1) / good.sum(1)
    known = np.isfinite(difference)
    if known.sum() < _LEAST:
        return 0.0
    v, d = speed[chosen][known], difference[known]
    slope = float((v * d).sum() / (v * v).sum())
    error = math.sqrt(float(((d - slope * v) ** 2).sum()) / (v.size - 1) / float((v * v).sum()))
    return abs(slope) if abs(slope) > max(_CERTAIN * error, _PART) else 0.0


def _speed(row: Floats) -> Floats:
    """Step a frame of a row, from the frames before and after; NaN at the ends."""
    return np.pad(0.5 * (row[2:] - row[:-2]), 1, constant_values=np.nan)


def _within_windows(windows: Floats, position: Floats, width: float, centre: Floats) -> Floats:
    """Rows by which the edge in even rows lies beyond that in odd ones, to first order, for each window."""
    rows = windows.shape[-1]
    offset = np.arange(rows) - (rows - 1) / 2.0
    away = offset - np.nan_to_num(position)[..., None]
    profile = edge_profile(away, width)
    slope = -10.0 * (edge_profile(away + 0.05, width) - edge_profile(away - 0.05, width))  # by the position of the edge
    comb = np.where((centre[..., None] + offset) % 2 == 0, 0.5, -0.5) * slope
    basis = np.stack([np.ones_like(profile), profile, slope, comb], axis=-1)
    gram = np.einsum("...ri,...rj->...ij", basis, basis) + 1e-9 * np.eye(4)
    solved = np.linalg.solve(gram, np.einsum("...ri,...r->...i", basis, windows)[..., None])[..., 0]
    return np.asarray(solved[..., 3] / np.where(np.abs(solved[..., 1]) > 0.0, solved[..., 1], np.nan))


_SURE_LAG = 4.0  # standard errors
_LAG = 0.04  # of the square of the speed by which the square of the blur must exceed what the exposure explains
_PULSE_ODDS = 9.0  # chi-square by which no blur must be the better explanation for a pulse to be as likely as none
_SELDOM = 0.05  # probability of a pulse that an interval of two standard errors may leave out


class ExposureBlur(NamedTuple):
    """Share of the frame before that a frame still shows, and frames by which a pulsing lamp leaves its instant open.

    Both are 0 if they are not told.  ``late`` is the standard error [frames] of the instant.
    """

    trail: float
    pulse: float
    late: float


def exposure_blur(row: Floats, width: Floats, exposure: float | None) -> ExposureBlur:
    """By how much motion blurs edges, beside what the exposure explains.

    Motion at a speed v a frame adds v^2 s^2/12 to the square of an edge's blur, s the *exposure* over the time between
    frames (None if unknown); a share a of the frame before adds v^2 a (1 - a).  A lamp that pulses adds nothing, at an
    instant that is not known within the exposure: how probable it is follows from the slope and its standard error, so
    that edges which do not show their blur leave it open.
    """
    nothing = ExposureBlur(0.0, 0.0, 0.0)
    speed = _speed(row)
    bend = np.pad(np.abs(row[2:] - 2.0 * row[1:-1] + row[:-2]), 1, constant_values=np.nan)
    with np.errstate(invalid="ignore"):
        used = np.isfinite(width) & (bend < 0.3 * np.abs(speed) + _MOVES)  # not where the beam is struck
    if np.count_nonzero(used & (np.abs(np.nan_to_num(speed)) > 3.0 * _MOVES)) < _LEAST:
        return nothing
    x, y = speed[used] ** 2, width[used] ** 2
    if np.ptp(x) == 0.0:  # no slope
        return nothing
    (slope, _), cover = polyfit(x, y, 1, cov=True)
    opened = 1.0 if exposure is None else min(exposure, 1.0)
    more = float(slope) - opened**2 / 12.0
    error = math.sqrt(float(cover[0, 0]))
    if more > max(_LAG, _SURE_LAG * error):
        trail = 0.5 - math.sqrt(max(0.25 - more, 0.0))
        return ExposureBlur(trail, 0.0, trail)
    if exposure is None or error == 0.0:
        return nothing
    pulse = likely((more**2 - float(slope) ** 2) / error**2, _PULSE_ODDS)
    late = 0.5 * opened
    return ExposureBlur(0.0, late if pulse > 0.5 else 0.0, late * math.sqrt(pulse) if pulse > _SELDOM else 0.0)


def alternation(row: Floats) -> float:
    """Shift of every other frame [px]; 0 if it is not significant.

    Each frame against the mean of its neighbours, with turning sign: no motion that a camera can follow does that.
    """
    bend = row[1:-1] - 0.5 * (row[2:] + row[:-2])
    turned = np.where(np.arange(bend.size) % 2 == 0, 0.5, -0.5) * bend
    turned = turned[np.isfinite(turned)]
    if turned.size < 4 * _LEAST:
        return 0.0
    shift = float(np.median(turned))
    spread = 1.4826 * float(np.median(np.abs(turned - shift)))
    # neighbouring values share frames; the median of as many as these is known to 1.25 spread / sqrt(n)
    return abs(shift) if abs(shift) > max(_CERTAIN * 2.0 * spread / math.sqrt(turned.size), _SHIFT) else 0.0


# ----------------------------------------------------------------------------------------------------
# The tip of the shaker in every frame, where it carries no sticker.
#
# Blurred edges add up, so the beam's light can be taken out of a window before the tip is fitted: its near edge
# is known from the far one and the thickness.  That leaves the tip measurable down to gaps of two pixels, and a
# rounded tip keeps such gaps on its flanks while its middle touches.


MIN_GAP = 2.0  # rows between beam and tip below which a column counts as touching
MIN_FLANK = 4  # columns with a gap that it takes to measure the tip


def tip_edges(
    view: BeamView,
    frames: NDArray[np.floating],
    columns: NDArray[np.intp],
    tip: Floats,
    near: Floats,
    good: NDArray[np.bool_],
    light: Floats,
) -> tuple[Floats, NDArray[np.bool_], Floats]:
    """Rows of the tip's edge at *columns*, without the beam's light; which are sound; saturated shares.

    ``tip`` and ``near`` are the expected row of the tip and the known row of the beam's near edge, (frames,
    columns); ``light`` is the beam's contrast, (columns,).
    """
    windows, inside = gather(frames, tip, columns, HALF)
    centre = np.rint(np.where(np.isfinite(tip), tip, 0.0))
    known = np.where(np.isfinite(near), near, -1e3)
    offsets: Floats = centre[..., None] + np.arange(-HALF, HALF + 1.0) - known[..., None]
    beam = light[None, :, None] * (1.0 - edge_profile(offsets, view.edge_width))
    weights = (offsets > -2.0).astype(np.float64)
    weights[..., HALF - 2 :] = 1.0
    fit = fit_edges(windows - beam, view.edge_width, sign=view.sign, weights=weights)
    sound = good & inside & np.isfinite(fit.position) & _sound(fit.contrast, view.contrast)
    return centre + fit.position, sound, _too_hot(windows, inside, view)


def tip_rows(
    view: BeamView, outline: TipOutline, frames: NDArray[np.floating], near: Floats, slope: Floats
) -> ShakerRows:
    """Rows of the tip in turned frames; ``near`` and ``slope`` are those of the beam's near edge."""
    columns, profile = outline.columns, outline.profile
    parts = np.array_split(np.arange(columns.size), min(6, max(1, columns.size // 4)))
    guesses = np.full((frames.shape[0], len(parts)), np.nan)
    seen = np.zeros(frames.shape[0], dtype=bool)
    down = np.arange(frames.shape[1])[None, :]
    for p, part in enumerate(parts):
        mean = frames[:, :, columns[part]].mean(-1, dtype=np.float64)
        solid = (mean - view.threshold) * view.sign > 0.0
        beam = near + slope * (columns[part].mean() - view.contact_column)
        below = solid & (down >= np.where(np.isfinite(beam), beam + 1.0, np.inf)[:, None])
        row = below.argmax(1)
        seen |= below.any(1)
        clear = below.any(1) & (row - 0.5 - beam >= MIN_GAP)
        guesses[clear, p] = (row - 0.5 - profile[part].mean())[clear]
    rows = masked_median(guesses, np.isfinite(guesses))[:, None] + profile
    beam = near[:, None] + slope[:, None] * (columns - view.contact_column)
    clear = np.isfinite(rows) & (rows - beam >= MIN_GAP)
    edges, good, saturated = tip_edges(view, frames, columns, rows, beam, clear, outline.light)
    # The rod does not turn, so a constant is fitted: all columns on one flank would not hold a line.
    centred = np.where(good, edges - profile, np.nan)
    middle = masked_median(centred, good)
    good &= np.abs(centred - middle[:, None]) < 1.5
    number = good.sum(1)
    enough = (number >= MIN_FLANK) & (saturated <= view.hot_share + HOT)
    total = np.maximum(number, 1)
    row = np.where(good, centred, 0.0).sum(1) / total
    off = np.where(good, centred - row[:, None], 0.0)
    spread = (off**2).sum(1) / np.maximum(total - 1, 1) * alike_columns(off, good, 1)
    return ShakerRows(
        row=np.where(enough, row, np.nan),
        error=np.where(enough, np.sqrt(spread / total), np.nan),
        share=number / np.maximum(clear.sum(1), 1),
        contrast=np.ones(row.shape),
        merged=np.isfinite(near) & seen & (clear.sum(1) < MIN_FLANK),
        saturated=saturated,
    )


def measure(scene: Scene, frames: NDArray[np.floating]) -> tuple[BeamRows, ShakerRows | None]:
    """Rows of the beam and of the shaker, by its sticker or without one by its tip, in a batch of turned frames."""
    view, shaker = scene.beam, scene.shaker
    beam = measure_beam(view, frames)
    near = beam.row + view.thickness
    if shaker is None:
        return beam, None
    if shaker.sticker is not None:
        return beam, sticker_rows(view, shaker.sticker, frames, near, shaker.tip_offset)
    return beam, tip_rows(view, shaker.outline, frames, near, beam.slope)
