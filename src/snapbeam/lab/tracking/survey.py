"""Find the beam and the shaker in a sample of frames before they are followed."""

from __future__ import annotations

import dataclasses
import itertools
import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.optimize import minimize_scalar

from snapbeam.lab.signals import stretches
from snapbeam.lab.tracking.edges import EdgeFit, Floats, edge_profile, fit_edges, masked_median, width_calibration
from snapbeam.lab.tracking.measure import (
    MIN_FLANK,
    MIN_GAP,
    BeamRows,
    measure_beam,
    sticker_rows,
    sticker_thickness,
    tip_edges,
)
from snapbeam.lab.tracking.settings import (
    HALF,
    BeamView,
    EdgeShape,
    NoiseShape,
    Scene,
    ShakerView,
    Sticker,
    TipOutline,
    TrackingSettings,
    edges_about,
    gather,
    spread_columns,
)
from snapbeam.util.packages import needs
from snapbeam.util.singular_values import lstsq, polyfit
from snapbeam.util.validation import InputError

# ----------------------------------------------------------------------------------------------------
# Objects in each column of a binary sample, counted from the far side, and bars that never move.


_STILL = 0.7  # share of the sample in which both edges of a bar must stand still
_ACROSS = 0.6  # share of the columns that a bar or a beam crosses
_BORDER = 0.25  # share of the rows that a bar along the border may cover
_MOVES = 2.0  # rows by which a beam must move to be told from a bar


class ColumnObjects(NamedTuple):
    """The first two objects from the far side in each column of each frame, arrays (frames, columns).

    ``start`` and ``end`` (one past the last row) of the first where ``found``; ``after`` and ``after_end`` of
    the next where one ``follows``; ``further`` whether anything lies beyond that.  ``height`` counts the rows.
    """

    start: NDArray[np.intp]
    end: NDArray[np.intp]
    found: NDArray[np.bool_]
    after: NDArray[np.intp]
    after_end: NDArray[np.intp]
    follows: NDArray[np.bool_]
    further: NDArray[np.bool_]
    height: int


def column_objects(mask: NDArray[np.bool_]) -> ColumnObjects:
    """The first two objects in each column of a mask (frames, rows, columns); specks of one row are none."""
    rows = np.arange(mask.shape[1])[None, :, None]
    solid = mask.copy()
    solid[:, :-1] &= mask[:, 1:]
    solid[:, -1] = False

    def end_of(start: NDArray[np.intp]) -> NDArray[np.intp]:
        filled = mask | (rows < start[:, None])
        return np.where(filled.all(1), mask.shape[1], filled.argmin(1))

    start, found = solid.argmax(1), solid.any(1)
    end = end_of(start)
    later = solid & (rows >= end[:, None])
    after, follows = later.argmax(1), np.asarray(later.any(1))
    after_end = np.where(follows, end_of(after), mask.shape[1])
    further = np.asarray((solid & (rows >= after_end[:, None])).any(1))
    return ColumnObjects(start, end, found & (start > 0), after, after_end, follows, further, mask.shape[1])


def without_rows(mask: NDArray[np.bool_], first: int, last: int) -> NDArray[np.bool_]:
    """A mask without the rows of a bar (last one past its end), and one on either side."""
    rest = mask.copy()
    rest[:, max(first - 1, 0) : last + 1] = False
    return rest


def longest_stretch(columns: NDArray[np.bool_]) -> tuple[int, int]:
    """First and one past the last of the longest stretch of True; 0, 0 if there is none."""
    return max(stretches(columns), key=lambda run: run[1] - run[0], default=(0, 0))


def fixed_bars(mask: NDArray[np.bool_]) -> tuple[tuple[int, int], ...]:
    """Rows of bars that cross the picture and never move, beside a beam that does: one alone may be a beam at rest."""
    bars: list[tuple[int, int]] = []
    left = mask
    for bar in _still_bands(mask):
        rest = without_rows(left, *bar)
        if _moving_beam(rest):
            bars.append(bar)
            left = rest
    return tuple(bars)


def border_bar(side: NDArray[np.bool_]) -> int:
    """Rows of a bar that never moves along the far border, beside a beam that does; 0 if there is none.

    *side* holds the pixels that are as bright or as dark as the border.  Background between a fixed line and the beam
    moves with that line, if the camera does.
    """
    exits = np.where(side.all(1), side.shape[1], (~side).argmax(1))
    usual = np.median(exits, axis=0)
    still = (np.abs(exits - usual) <= 1).mean(0) >= _STILL
    if still.mean() < _ACROSS or not 1.0 <= np.median(usual[still]) <= _BORDER * side.shape[1]:
        return 0
    rows = int(np.percentile(usual[still], 90)) + 1
    return rows if _moving_beam(without_rows(side, 0, rows), exits) else 0


def _still_bands(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Bands whose two edges stand still in most of the sample, across most columns."""
    columns = np.unique(np.linspace(0, mask.shape[2] - 1, min(mask.shape[2], 32)).astype(int))
    steps = np.diff(mask[:, :, columns].astype(np.int8), axis=1)
    usual = [ndimage.maximum_filter1d(steps == sign, 3, axis=1).mean(0) >= _STILL for sign in (1, -1)]
    marks = np.zeros((mask.shape[1], columns.size), dtype=bool)
    for c in range(columns.size):
        rising, falling = (
            np.array([(first + last - 1) // 2 for first, last in stretches(edge[:, c])], dtype=np.intp)
            for edge in usual
        )
        for first in rising:
            stops = falling[falling > first]
            if stops.size and not ((rising > first) & (rising < stops[0])).any():
                marks[first + 1 : stops[0] + 1, c] = True
    return stretches(marks.mean(1) >= _ACROSS)


def _moving_beam(mask: NDArray[np.bool_], edge: NDArray[np.intp] | None = None) -> bool:
    """Return whether a mask contains an object that crosses the image, ends within it and moves (against *edge*)."""
    objects = column_objects(mask)
    bounded = objects.found & (objects.end < mask.shape[1]) & (objects.end - objects.start >= 3)
    columns = bounded.mean(0) > 0.4
    if columns.mean() < _ACROSS:
        return False
    where = np.where(bounded, objects.start if edge is None else objects.start - edge, np.nan)[:, columns]
    return bool(np.median(np.subtract(*np.nanpercentile(where, (97, 3), axis=0))) > _MOVES)


# ----------------------------------------------------------------------------------------------------
# The mean shape of the beam's edge, finer than a pixel, and what it says of the camera's curve.
#
# The edge crosses pixels at every phase, so the windows of a sample together hold its shape in steps of a
# fraction of a pixel.  In light the edge is symmetric about itself, whatever the lens; a camera that stores
# light**gamma bends it, and a step fitted to the bent edge lies off the true one.


CLIPPED = 0.1  # share of saturated pixels in the middle of the beam that counts as overexposed
_CLIPPED_SHIFT = 0.5  # px by which the edge of an overexposed object may lie off
_STEP = 0.25  # px
_REACH = 5.0
_AWAY = np.arange(0.5, 4.0 / _STEP) * _STEP  # from the centre of an edge, where its halves are held against each other
_LEAST = 200  # windows
_MIRRORED = 5e-4  # of the contrast to which the halves of an edge are alike
_GRAIN = 4  # columns that share a grain of texture
_CERTAIN = 30.0  # chi-square by which a bent edge must be worse than a straight one
_LIKELY = 0.4  # |log gamma| of a curve that is taken before stronger ones
_USUAL = 0.6  # standard deviation of log gamma of cameras with a curve
_CENTRES = 24  # tried on either side of 0
_GAMMAS = np.exp(np.linspace(math.log(0.25), math.log(4.0), 81))


def edge_shape(
    windows: Floats, centre: Floats, fit: EdgeFit, good: NDArray[np.bool_], width: float, sign: float, clipped: float
) -> EdgeShape:
    """Judge the mean edge of the *good* ones of many windows, grey levels (frames, columns, rows) about rows *centre*.

    *fit* is what :func:`fit_edges` made of them, *clipped* the share of saturated pixels in the middle of the beam.
    """
    data, position = windows[good], fit.position[good]
    unknown = EdgeShape(math.nan, math.nan, math.nan, _CLIPPED_SHIFT if clipped > CLIPPED else 0.0, 0.0, clipped)
    if data.shape[0] < _LEAST:
        return unknown
    rows = data.shape[-1]
    offset = np.arange(rows) - (rows - 1) / 2.0 - position[:, None]
    # each window by its own levels, so that uneven light does not count
    contrast = fit.contrast[good]
    model = edge_profile(offset, width)
    level = (data * sign).mean(-1) - contrast * model.mean(-1)
    share = (data * sign - level[:, None]) / contrast[:, None]
    places = np.stack(np.nonzero(good))
    groups = (places[0], places[1] // _GRAIN, np.floor(centre[good] - centre[good].min()).astype(np.intp))
    x, y, error, by_grain = _binned(offset, share, groups)
    if x.size < 24 or clipped > CLIPPED:
        return unknown
    misfit = float(np.sqrt(np.mean((y - edge_profile(x, width)) ** 2)))
    dark = level if sign > 0 else -(level + contrast)
    ratio = float(np.median(dark / contrast))  # the dark side's grey level over the contrast
    if not ratio > 1e-3:
        return EdgeShape(misfit, math.nan, math.nan, 0.0, 0.0, clipped)
    return EdgeShape(misfit, *_symmetry(x, y, error, ratio, sign, by_grain), clipped)


def _symmetry(
    x: Floats, y: Floats, error: Floats, ratio: float, sign: float, by_grain: Floats
) -> tuple[float, float, float, float]:
    """Gamma that makes the edge symmetric in light, its standard error, where its centre then lies, and what is open.

    The centre is 0 where a linear camera will do; what curves that are not excluded shift it by is open.  Texture, the
    parts of the edge *by_grain*, that bends it as a curve does is no curve.
    """
    together = _together(x, error, by_grain)
    outer = np.abs(x) > 0.8 * np.abs(x).max()
    low, high = float(y[outer & (x < 0.0)].mean()), float(y[outer & (x > 0.0)].mean())
    y, error, by_grain = (y - low) / (high - low), error / (high - low), by_grain / (high - low)
    found = np.array([_asymmetry(x, *_light(y, error, gamma, ratio, sign)) for gamma in _GAMMAS])
    scatter, centres = found[:, 0], found[:, 1]
    best = int(np.argmin(scatter))
    freedom = max(float(np.count_nonzero((x > 0.0) & (x < 4.0))) - 2.0, 1.0)
    unit = max(together, scatter[best] / freedom)
    # a strong curve can bend one symmetric edge into another: one near 1 that does as well is the likelier, if curves
    # on both sides of it do worse; where they only get worse towards 1, the strong one is what bent the edge
    likely = np.flatnonzero(np.abs(np.log(_GAMMAS)) < _LIKELY)
    other = int(likely[np.argmin(scatter[likely])])
    least = scatter[other] <= scatter[[other - 1, other + 1]].min()
    if least and (scatter[other] - scatter[best]) / unit < _CERTAIN:
        best, unit = other, max(together, scatter[other] / freedom)
    bent = _totals(x, _light(y, error, float(_GAMMAS[best]), ratio, sign)[0], float(centres[best])) - _totals(
        x, y, float(np.interp(0.0, np.log(_GAMMAS), centres))
    )
    variance = sum(np.interp(side, x, error) ** 2 for side in (_AWAY, -_AWAY)) + _MIRRORED**2
    grains = np.stack([_totals(x, one, 0.0) + 1.0 for one in by_grain.T])
    along = float(((grains @ (bent / variance)) ** 2).sum() / max(float((bent**2 / variance).sum()), 1e-300))
    unit = max(unit, along)
    worse = (float(np.interp(0.0, np.log(_GAMMAS), scatter)) - scatter[best]) / unit
    alike = np.abs(scatter - scatter[best]) / unit < 1.0
    spread = np.log(_GAMMAS[alike & (np.abs(np.log(_GAMMAS / _GAMMAS[best])) < _LIKELY)])
    log_se = max(0.5 * float(np.ptp(spread)), 0.5 * math.log(_GAMMAS[1] / _GAMMAS[0]))
    gamma = float(_GAMMAS[best])
    if worse > _CERTAIN:
        return gamma, gamma * log_se, float(centres[best]), 0.0
    likely_too = np.exp(-0.5 * ((scatter - scatter.min()) / unit + (np.log(_GAMMAS) / _USUAL) ** 2))
    return gamma, gamma * log_se, 0.0, math.sqrt(float(np.average(centres**2, weights=likely_too)))


def _light(y: Floats, error: Floats, gamma: float, ratio: float, sign: float) -> tuple[Floats, Floats]:
    """Shares of light and their errors, from shares of grey levels that are light**gamma."""
    bright = y if sign > 0 else 1.0 - y
    grey = np.maximum(bright + ratio, 1e-6)
    low, high = ratio ** (1.0 / gamma), (1.0 + ratio) ** (1.0 / gamma)
    light = (grey ** (1.0 / gamma) - low) / (high - low)
    slope = grey ** (1.0 / gamma - 1.0) / gamma / (high - low)
    return (light if sign > 0 else 1.0 - light), error * slope


def _together(x: Floats, error: Floats, by_grain: Floats) -> float:
    """Chi-square of one degree of freedom of an edge's asymmetry, more than 1 where texture moves many steps together.

    Grains (the columns of *by_grain*) with random signs are an edge by texture alone: the variance of its chi-square over
    that of independent steps.
    """
    signs = np.random.default_rng(0).choice([-1.0, 1.0], (by_grain.shape[1], 128))
    halves = [np.stack([np.interp(side, x, one) for one in (by_grain @ signs).T]) for side in (_AWAY, -_AWAY)]
    spread = np.hypot(*(np.interp(side, x, error) for side in (_AWAY, -_AWAY)))
    chi = ((halves[0] + halves[1]) ** 2 / (spread**2 + _MIRRORED**2)).sum(1)
    return max(float(np.var(chi)) / (2.0 * _AWAY.size), 1.0)


def _totals(x: Floats, light: Floats, centre: float) -> Floats:
    """An edge and itself turned about its *centre*, less 1."""
    return np.interp(centre + _AWAY, x, light) + np.interp(centre - _AWAY, x, light) - 1.0


def _asymmetry(x: Floats, light: Floats, error: Floats) -> tuple[float, float]:
    """Chi-square of an edge turned about its centre against itself, minimum over the centre, and the centre."""

    def chi(centre: float) -> float:
        spread = np.hypot(*(np.interp(side, x, error) for side in (centre + _AWAY, centre - _AWAY)))
        return float(np.sum((_totals(x, light, centre) / np.hypot(spread, _MIRRORED)) ** 2))

    near = min(np.linspace(-0.8, 0.8, 2 * _CENTRES + 1), key=chi)
    step = 0.8 / _CENTRES
    found = minimize_scalar(chi, bounds=(near - step, near + step), method="bounded", options={"xatol": 1e-4})
    return float(found.fun), float(found.x)


def _binned(
    offset: Floats, share: Floats, groups: tuple[NDArray[np.intp], ...]
) -> tuple[Floats, Floats, Floats, Floats]:
    """Mean offset, mean share, its standard error and what each of the second groups gives, in steps of a fraction of a pixel.

    Windows of one frame, of columns side by side or of one row may be off together, by uneven light, texture or noise: the
    error is the largest of those with the windows of a group as one.
    """
    index = np.floor((offset + _REACH) / _STEP).astype(int)
    inside = (index >= 0) & (index < int(2 * _REACH / _STEP))
    owners = [np.broadcast_to(one[:, None], index.shape)[inside] for one in groups]
    index, x, y = index[inside], offset[inside], share[inside]
    count = np.bincount(index)
    full = count >= 8
    total = np.maximum(count, 1)
    mean_x, mean = np.bincount(index, x) / total, np.bincount(index, y) / total
    off = y - mean[index]
    error = np.sqrt(np.bincount(index, off**2)) / total
    parts = []
    for owner in owners:
        step = int(owner.max()) + 1
        together = np.bincount(index * step + owner, off, minlength=count.size * step).reshape(-1, step)
        parts.append(together / total[:, None])
        error = np.maximum(error, np.sqrt((parts[-1] ** 2).sum(1)))
    return mean_x[full], mean[full], error[full], parts[1][full]


# ----------------------------------------------------------------------------------------------------
# The beam in a sample of frames: its levels, its thickness, the blur of its edges and where to measure it.


_LEANS = 6.0  # standard errors by which the thickness must change along the beam
_SURFACE = 0.02  # px
_STEADY = 1.1  # blur of a frame over the usual one up to which its edges show the camera's own


class BeamBands(NamedTuple):
    """The beam as a band in each column (frames, columns): ``alone`` where nothing else merges with it."""

    objects: ColumnObjects
    alone: NDArray[np.bool_]
    thickness: float


def find_bands(objects: ColumnObjects, height: int, level: float, bright: bool) -> BeamBands:
    """The band that crosses the picture."""
    length = objects.end - objects.start
    usable = objects.found & (objects.end < height) & (length >= 3)
    way_out = "set region (--region), objects (--objects) or threshold (--threshold)"
    if usable.mean() < 0.05:
        raise InputError(
            f"recording: no beam crosses the region at the threshold {level:.6g} for "
            f"{'bright' if bright else 'dark'} objects; {way_out}"
        )
    thin = float(np.percentile(length[usable], 25))
    alone = usable & (length <= 1.35 * thin + 2.0)
    thickness = float(np.median(length[alone]))
    seen = ((usable & (length >= 0.6 * thickness)).mean(0) > 0.4).mean()
    if seen < 0.6:
        raise InputError(
            f"recording: an object of {thickness:.0f} rows is seen in only {100 * seen:.0f} % of the columns; "
            f"the beam must cross the region, so {way_out}"
        )
    return BeamBands(objects, alone, thickness)


def placed(width: int, rod: tuple[int, int] | None, count: int, contact_column: float | None) -> dict[str, Any]:
    """Contact column, columns to measure the beam in, groups that see it alone, and whether there are none."""
    centre = (rod[0] + rod[1] - 1) / 2.0 if rod is not None else (width - 1) / 2.0
    centre = centre if contact_column is None else contact_column
    half = max(20.0, (rod[1] - rod[0]) / 2.0) if rod is not None else max(20.0, width / 8.0)
    half = min(half, centre - 2.0, width - 3.0 - centre)
    if half < 2.0:
        raise InputError(
            f"contact_column (--contact-column) = {centre:g}: must leave at least 4 columns on both sides in the region"
        )
    columns = spread_columns(int(np.ceil(centre - half)), int(np.floor(centre + half)), count)
    view = {"contact_column": centre, "columns": columns, "groups": (columns,), "merged": False}
    if rod is None:
        return view
    left = np.arange(max(0, rod[0] - 19), rod[0] - 3)
    right = np.arange(rod[1] + 3, min(width, rod[1] + 19))
    groups = tuple(one for one in (left, right) if one.size >= 4)
    return view | {"groups": groups or (columns,), "merged": not groups}


def beam_view(
    frames: NDArray[np.floating], smooth: NDArray[np.floating], bands: BeamBands, known: dict[str, Any]
) -> tuple[BeamView, EdgeShape]:
    """The beam to a fraction of a pixel, where it stands alone, and the shape of its edge.

    *known* are the fields of the view but contrast, edge width and thickness.
    """
    sign, saturated = (1.0 if known["bright"] else -1.0), known["saturated"]
    objects, alone = bands.objects, bands.alone
    background, inside = _levels(smooth, objects, alone)
    clear = ~objects.follows | (objects.after - objects.end >= 2 * HALF)  # else the tip's light is in the windows
    good = alone & (clear if (alone & clear).mean() > 0.02 else True)
    good[:, good.mean(0) < 0.1] = False
    columns = np.flatnonzero(good.any(0))
    columns = columns[np.unique(np.linspace(0, columns.size - 1, min(columns.size, 48)).astype(int))]
    half = int(np.clip(bands.thickness // 2, 2, HALF))
    good = good[:, columns]
    far, near = objects.start[:, columns] - 0.5, objects.end[:, columns] - 0.5
    width = _edge_width(frames, far, columns, good, half, sign)
    windows, fits, edges, usable = [], [], [], good.copy()
    for rows, rising in ((near, -sign), (far, sign)):
        window, within, fit, found = edges_about(frames, rows, columns, half, width, rising)
        windows.append(window)
        fits.append(fit)
        edges.append(found)
        usable &= within & np.isfinite(found)
    contrast, thickness, error = abs(inside - background), bands.thickness, 0.5
    if usable.any():
        contrast = float(np.median(fits[1].contrast[usable]))
        thickness = float(np.median((edges[0] - edges[1])[usable]))
    by_column = masked_median((edges[0] - edges[1]).T, usable.T)
    seen = np.isfinite(by_column)
    by_column, across = by_column[seen], columns[seen] - known["contact_column"]
    if across.size > 1:  # a line needs two columns
        # the surface is uneven on the scale of three pixels: neighbouring columns count as one
        independent = max(min(by_column.size, float(np.ptp(columns)) / 3.0), 1.0)
        error = float(np.std(by_column)) / math.sqrt(independent)
        (lean, level), cover = polyfit(across, by_column, 1, cov="unscaled")
        left = float(np.std(by_column - lean * across))
        if abs(lean) * math.sqrt(independent / by_column.size) > _LEANS * left * math.sqrt(cover[0, 0]):
            thickness = float(level)
            error = max(left, _SURFACE) * math.sqrt(cover[1, 1] * by_column.size / independent)
    clipped = 0.0
    for rows in (0.5 * (far + near), far - half):
        window, within = gather(frames, rows, columns, 1)
        clipped = max(clipped, float((window[within & good] >= saturated).mean()) if (within & good).any() else 0.0)
    hot = float((windows[1][good] >= saturated).mean()) if good.any() else 0.0
    known |= {"contrast": contrast, "thickness": thickness, "thickness_error": error, "hot_share": hot}
    view = BeamView(**known, edge_width=width, width_table=width_calibration(width, 2 * half + 1))
    blur = masked_median(fits[1].width, usable)
    steady = usable
    if np.isfinite(blur).any():  # an edge that speeds up within the exposure is bent whatever the camera's curve
        steady = usable & (blur <= _STEADY * np.nanpercentile(blur, 25.0))[:, None]
    return view, edge_shape(windows[1], np.rint(far), fits[1], steady, width, sign, clipped)


def _levels(smooth: NDArray[np.floating], objects: ColumnObjects, alone: NDArray[np.bool_]) -> tuple[float, float]:
    """Grey levels of the background beyond the beam and of the beam's middle."""
    k, x = np.nonzero(alone & (objects.start >= 4))
    if not k.size:
        raise InputError(
            "recording: the beam touches the edge of the region in every sampled frame; make region (--region) taller"
        )
    middle = (objects.start[k, x] + objects.end[k, x]) // 2
    return float(np.median(smooth[k, objects.start[k, x] - 4, x])), float(np.median(smooth[k, middle, x]))


def _edge_width(
    frames: NDArray[np.floating],
    far: Floats,
    columns: NDArray[np.intp],
    good: NDArray[np.bool_],
    half: int,
    sign: float,
) -> float:
    """Blur of the far edge [px], by fits that start from the last one's."""
    few = slice(None, None, max(1, frames.shape[0] // 16))
    windows, inside = gather(frames[few], far[few], columns, half)
    width = 1.0
    for _ in range(4):
        fit = fit_edges(windows, width, sign=sign)
        usable = inside & good[few] & np.isfinite(fit.position)
        if not usable.any():
            raise InputError(
                "recording: the far edge of the beam could not be fitted; set threshold (--threshold) or region "
                "(--region)"
            )
        found = float(np.median(fit.width[usable]))
        width = float(np.clip(found, 0.3, 4.0)) if np.isfinite(found) else width
    return width


# ----------------------------------------------------------------------------------------------------
# Grey levels of a sample: what parts objects from the background, how noisy pixels are, where they saturate.


PILE = 5.0  # times more pixels at the highest level than just below it that tell saturation
LEAST = 1e-4  # share of the pixels that must be at the highest level


def otsu(frames: NDArray[np.floating]) -> float:
    """Otsu's threshold of all pixels together, in their own grey levels."""
    try:
        import cv2
    except ImportError as error:
        raise InputError(
            f"{needs('threshold = None: an automatic threshold', 'OpenCV', 'lab')}; or give threshold (--threshold)"
        ) from error
    low, high = (float(level) for level in np.percentile(frames[:, ::2, ::2], (0.05, 99.95)))
    if not high > low:
        raise InputError(f"recording: all pixels are {low:g}, so there is no object to find")
    scaled = np.clip((frames - low) * (65535.0 / (high - low)), 0.0, 65535.0).astype(np.uint16)
    level, _ = cv2.threshold(scaled.reshape(-1, 1), 0, 65535, cv2.THRESH_BINARY + cv2.THRESH_OTSU)
    return low + float(level) * (high - low) / 65535.0


def pixel_noise(frames: NDArray[np.floating]) -> float:
    """Standard deviation of the pixel noise, from differences along the beam.

    Never less than that of rounding to whole grey levels, 1/sqrt(12).
    """
    few = frames[:: max(1, frames.shape[0] // 8)]
    second = few[:, :, 2:] - 2.0 * few[:, :, 1:-1] + few[:, :, :-2]
    return max(float(np.median(np.abs(second)) / 0.6745 / np.sqrt(6.0)), 1.0 / math.sqrt(12.0))


def saturation_level(frames: NDArray[np.integer], max_value: float, noise: float) -> float:
    """Grey level at which pixels are saturated, by what is seen as well as by what the file says.

    A file of 16 bits may hold an image of 12, and its brightest pixels then pile up at 4095 though the file could hold
    65535.  It is *max_value*, the largest level of the file, if none piles up; *noise* is the standard deviation of a
    pixel.
    """
    top = float(frames.max())
    here = np.count_nonzero(frames == top)
    if here < LEAST * frames.size or here < 16:
        return float(max_value)
    # full scale of 10, 12 or 14 bits, at either end of 16
    scales = [(2**bits - 1) << shift for bits in (10, 12, 14) for shift in (0, 16 - bits)]
    if top >= max_value or int(top) in scales:
        return top
    reach = max(3.0 * noise, 3.0)
    below = np.count_nonzero((frames >= top - reach) & (frames < top)) / reach
    return top if noise > 0.5 and here > PILE * below else float(max_value)


# ----------------------------------------------------------------------------------------------------
# Whether the noise of pixels is a camera's own: new in every frame, and each pixel's for itself.


_APART = 4  # frames after which no noise is left of one in the other
_LEAST_NOISE = 1500  # even pixels
_ROUNDED = 0.6  # grey levels; less noise than this is rounded away
_EVEN = 6.0  # standard deviations by which even pixels may differ from their neighbours
_COLUMNS = 12  # of even pixels that tell the mean of a row, and rows
_SURE_ROWS = 6.0  # standard errors of the noise of rows
_CERTAIN_NOISE = 0.2  # correlation that is no chance, and more than a sensor's own


def noise_shape(head: NDArray[np.floating]) -> NoiseShape:
    """Correlation of the noise in successive turned frames with the next frame, and along and across the beam.

    The difference of two frames holds the noise of both and no scene.  Neighbours in time differ by 2 sigma^2 (1 - r),
    frames further apart by 2 sigma^2, r the correlation.  Only pixels count about which the picture is even, so that
    what moves does not; changes of the light are fitted and taken out.
    """
    none = NoiseShape(0.0, 0.0, 0.0, 0.0, 0.0)
    if head.shape[0] < _APART + 3:
        return none
    mean = head.mean(0)
    around = ndimage.maximum_filter(mean, 5) - ndimage.minimum_filter(mean, 5)
    apart = [_noise_of(head[k + _APART], head[k], mean) for k in range(head.shape[0] - _APART)]
    noise = max(float(np.median(np.abs(apart))) / 0.6745 / math.sqrt(2.0), _ROUNDED)
    even = around < _EVEN * noise
    even &= np.max(np.abs(apart), axis=0) < 6.0 * noise
    even &= np.ptp(head, axis=0) > 0.0
    if np.count_nonzero(even) < _LEAST_NOISE:
        return none

    def power(steps: list[Floats]) -> float:
        return float(np.median([np.var(one[even]) for one in steps]))

    rows = row_noise(head, even)
    fixed = min(row_noise(mean[None], even), rows)
    far = power(apart)
    if far < 2.0 * _ROUNDED**2:
        return NoiseShape(0.0, 0.0, 0.0, rows, fixed)
    near = [_noise_of(after, before, mean) for before, after in itertools.pairwise(head)]
    count = np.maximum(even.sum(1, keepdims=True), 1)
    own = [one - np.where(even, one, 0.0).sum(1, keepdims=True) / count for one in apart]
    alike = (1.0 - power(near) / far, _alike(own, even, 1) / power(own), _alike(apart, even, 0) / far)
    in_time, along, across = (min(value, 0.9) if value > _CERTAIN_NOISE else 0.0 for value in alike)
    return NoiseShape(in_time, along, across, rows, fixed)


def row_noise(frames: NDArray[np.floating], even: NDArray[np.bool_]) -> float:
    """Standard deviation of what the pixels of a row along the beam have in common, fixed or new in every frame.

    From second differences across rows of the means over the *even* pixels of each, less what the noise of single
    pixels leaves of these; 0 where it is no more than that.
    """
    whole = even[2:] & even[1:-1] & even[:-2]
    count = whole.sum(1)
    used = count >= _COLUMNS
    if np.count_nonzero(used) < _COLUMNS:
        return 0.0
    bends = np.where(whole, frames[:, 2:] - 2.0 * frames[:, 1:-1] + frames[:, :-2], 0.0)[:, used].astype(np.float64)
    mean = bends.sum(-1) / count[used]
    single = ((bends**2).sum(-1) / count[used] - mean**2) / count[used]
    more = float(np.mean(mean**2 - single))
    chance = math.sqrt(2.0 / mean.size) * float(np.mean(single))
    return math.sqrt(more / 6.0) if more > _SURE_ROWS * chance else 0.0


def _alike(apart: list[Floats], even: NDArray[np.bool_], axis: int) -> float:
    """Mean product of neighbouring pixels, both of them even, along an axis."""
    if axis:
        apart, even = [one.T for one in apart], even.T
    both = even[1:] & even[:-1]
    return float(np.median([np.mean(one[1:][both] * one[:-1][both]) for one in apart]))


def _noise_of(after: NDArray[np.floating], before: NDArray[np.floating], mean: Floats) -> Floats:
    """The difference of two frames without a change of light between them."""
    step = (after - before).astype(np.float64)
    level = mean - mean.mean()
    total = float(np.sum(level * level))
    slope = float(np.sum(step * level)) / total if total > 0.0 else 0.0
    return np.asarray(step - np.median(step - slope * level) - slope * level)


# ----------------------------------------------------------------------------------------------------
# Looking for a sticker on the shaker: a band between two steps of opposite sign.


SEEN = 0.3  # share of the sample in which a sticker must be seen


def rod_middle(rod: tuple[int, int], share: float = 0.5) -> NDArray[np.intp]:
    """The middle *share* of the columns that the shaker covers, at least five."""
    centre, half = (rod[0] + rod[1] - 1) / 2.0, max(2.0, share * (rod[1] - rod[0]) / 2.0)
    return np.arange(int(np.ceil(centre - half)), int(np.floor(centre + half)) + 1)


def find_sticker(
    smooth: NDArray[np.floating], columns: NDArray[np.intp], begin: NDArray[np.intp], contrast: float, sign: float = 0.0
) -> Sticker | None:
    """Look for a band in *columns* in the middle of the shaker, in smoothed frames; None if there is none.

    *begin* is the row of each frame from which to look, -1 for frames to leave out; *sign* that of the band's upper
    step.
    """
    profiles = smooth[:, :, columns].mean(-1)
    steps = np.zeros_like(profiles)
    steps[:, 2:-2] = profiles[:, 4:] - profiles[:, :-4]
    found: list[tuple[int, int, int, float]] = []
    for k in np.flatnonzero(begin >= 0):
        peaks = _peaks_sticker(steps[k], int(begin[k]), 0.3 * contrast)
        if len(peaks) >= 2 and peaks[0][1] * peaks[1][1] < 0.0 and peaks[1][0] - peaks[0][0] >= 4:
            found.append((int(k), peaks[0][0], peaks[1][0], peaks[0][1]))
    if len(found) < SEEN * profiles.shape[0]:
        return None
    upper = sign or float(np.sign(np.median([step for *_, step in found])))
    size = float(np.median([bottom - top for _, top, bottom, _ in found]))
    same = [one for one in found if abs(one[2] - one[1] - size) <= 2.0 and one[3] * upper > 0.0]
    if len(same) < SEEN * profiles.shape[0]:
        return None
    margin = int(np.clip(min(smooth.shape[1] - 1 - bottom for _, _, bottom, _ in same), 2, HALF))
    ends = [(k, top - margin, top + round(size) + margin + 1) for k, top, *_ in same]
    cut = [profiles[k, first:last] for k, first, last in ends if last <= smooth.shape[1]]
    if not cut:
        return None
    return Sticker(
        columns=spread_columns(int(columns[0]), int(columns[-1]), 24),
        thickness=size,
        sign=upper,
        contrast=float(np.median([abs(step) for *_, step in same])),
        template=np.median(np.array(cut, dtype=np.float64), axis=0),
        head=margin,
    )


def _peaks_sticker(steps: NDArray[np.floating], begin: int, height: float) -> list[tuple[int, float]]:
    """Rows and values of the extremes of each run of *steps* beyond *height*, from *begin* down."""
    peaks: list[tuple[int, float]] = []
    for row, stop in sorted(stretches(steps > height) + stretches(steps < -height)):
        if row > begin:  # a run under way at the start belongs to the tip
            part = np.abs(steps[row:stop])
            peak = round(float((part * np.arange(row, stop)).sum() / part.sum()))
            peaks.append((peak, float(steps[peak])))
    return peaks


# ----------------------------------------------------------------------------------------------------
# The tip of the shaker: its outline, learned where it stands clear of the beam, and its apex.


_OFF_CENTRE = 0.05  # share of the shaker's width by which its tip may be off its middle, standard deviation


def beam_light(frames: NDArray[np.floating], columns: NDArray[np.intp], near: Floats, thickness: float) -> Floats:
    """Contrast of the beam in each column: its middle less the background beyond it, median over frames."""
    middle, inside = gather(frames, near - 0.5 * thickness, columns, 1)
    beyond, seen = gather(frames, near - thickness - 5.0, columns, 1)
    return masked_median((middle.mean(-1) - beyond.mean(-1)).T, (inside & seen).T)


def tip_outline(rows: Floats, good: NDArray[np.bool_], reference: Floats) -> tuple[Floats, NDArray[np.int64]]:
    """Outline t of rows = reference(frame) + t(column), by medians in turn if it is not known."""
    known = np.isfinite(reference)
    shift = np.where(known, reference, masked_median(rows, good))
    profile: Floats = np.zeros(rows.shape[1])
    for _ in range(1 if known.any() else 12):
        use = good & np.isfinite(shift)[:, None] & (known[:, None] if known.any() else True)
        profile = masked_median((rows - shift[:, None]).T, use.T)
        if not known.any():
            shift = masked_median(rows - profile, good & np.isfinite(profile))
    counted = (good & (known[:, None] if known.any() else True)).sum(0)
    return profile, counted


def find_apex(outline: TipOutline, rod: tuple[int, int], contact_column: float) -> tuple[float, float, float] | None:
    """Row of an outline's apex, its standard error and column from the contact; None if not known on both sides of it.

    The outline is taken as symmetric, y = a + b (x - c)^2 + d (x - c)^4, about a column c near the middle of
    the shaker: a flat tip alone would not tell it.  Columns nearer than three pixels to each other count as
    one, for the surface is uneven on that scale.
    """
    x, y = outline.columns - contact_column, outline.profile
    size = float(rod[1] - rod[0])
    inner = np.abs(x) <= 0.4 * size
    if inner.sum() < 5 or x[inner].min() > -0.1 * size or x[inner].max() < 0.1 * size:
        return None
    half = float(np.abs(x[inner]).max())
    covered = inner.sum() >= 12 and np.diff(np.sort(x[inner])).max() < 0.2 * size
    u, v = x[inner] / half, y[inner]
    middle = (0.5 * (rod[0] + rod[1] - 1) - contact_column) / half
    powers = (0, 2, 4) if covered else (0, 2)
    independent = max(2.0 * half / 3.0, len(powers) + 2.0)

    def fitted(centre: float) -> tuple[Floats, float]:
        design = np.stack([(u - centre) ** power for power in powers], axis=1)
        solution = lstsq(design, v)
        return solution, float(np.mean((v - design @ solution) ** 2))

    spread = max(fitted(middle)[1], 1e-4)
    grid = middle + np.linspace(-0.5, 0.5, 201)
    cost = [independent * fitted(c)[1] / spread + ((c - middle) * half / (_OFF_CENTRE * size)) ** 2 for c in grid]
    centre = float(grid[int(np.argmin(cost))])
    solution, variance = fitted(centre)
    full = np.zeros(5)
    full[list(powers)] = solution
    rounded = float(np.polynomial.polynomial.polyval(0.9, full)) - float(solution[0]) > 0.3
    error = math.sqrt(max(variance, 1e-5) * 2.0 / independent)
    return (float(solution[0]), error, centre * half) if rounded or covered else None


# ----------------------------------------------------------------------------------------------------
# The shaker in a sample of frames: the columns it covers, its sticker and its tip.


_ROWS = 12  # in which the sides of the rod must be seen
_SIDE = 0.04  # px; error of two sides that no scatter shows
_TIPS = 12  # frames in which tip and sticker must be seen apart
_LOOSE = 0.1  # px
_TURNED = 0.009  # rows a column by which a camera must be turned
_SQUARE = 0.04  # by which a beam may lean against its striker
_STEEP = 3.0  # rows a column by which the outline of a tip may fall
_CLEAR = 4.0  # rows from the beam within which a mark that stands alone may be the tip itself


def find_rod(bands: BeamBands) -> tuple[int, int] | None:
    """Columns in which something stands beyond the beam in most of the sample; None if too few."""
    objects = bands.objects
    merged = objects.found & (objects.end - objects.start > 1.35 * bands.thickness + 2.0)
    share = (merged | (bands.alone & objects.follows)).mean(0)
    rod = longest_stretch(ndimage.binary_closing(share > 0.7, iterations=2) | (share > 0.7))
    return rod if rod[1] - rod[0] >= 5 else None


def shaker_view(
    view: BeamView,
    frames: NDArray[np.floating],
    smooth: NDArray[np.floating],
    bands: BeamBands,
    rod: tuple[int, int],
    settings: TrackingSettings,
    distance: float | None,
    head: int,
) -> tuple[ShakerView, float]:
    """The shaker, and the column at which its tip comes nearest to the beam.

    *distance* [px] is that of the tip from the sticker, if given; the first *head* frames are neighbours.
    """
    beam = measure_beam(view, frames)
    near = beam.row + view.thickness
    middle = rod_middle(rod)
    isolated = settings.marker and _stands_alone(bands, middle, near)
    sticker = None
    if settings.marker:
        begin = _begin(view, bands, middle, isolated)
        sticker = find_sticker(smooth, middle, begin, view.contrast, view.sign if isolated else 0.0)
    isolated = isolated and sticker is not None
    reference = np.full(frames.shape[0], np.nan)
    if sticker is not None:
        size = sticker_thickness(view, sticker, frames, near)
        sticker = dataclasses.replace(sticker, thickness=size)
        reference = sticker_rows(view, sticker, frames, near).row
    nothing: Floats = np.empty(0)
    outline, loose, width, lean = TipOutline(np.empty(0, dtype=np.intp), nothing, nothing), 0.0, *_NO_SIDES
    if not isolated:
        outline, loose = _outline(view, frames, bands, rod, beam, reference)
        width, lean = rod_sides(frames, rod, view.edge_width)
    column = view.contact_column
    certain = distance is not None
    if sticker is None:  # the object below the beam reaches the border of the picture without a gap
        after = bands.objects.after_end[:, middle][(bands.alone & bands.objects.follows)[:, middle]]
        certain = bool(after.size and (after == bands.objects.height).mean() > 0.9)
    turned = abs(lean) > _TURNED and abs(lean + float(np.nanmedian(beam.slope))) < _SQUARE
    turn = -lean if turned else 0.0
    free = settings.contact_column is None
    cut = free and (rod[0] < 2) != (rod[1] > frames.shape[2] - 2)
    shown = ShakerView(rod, sticker, outline, np.nan, 0.0, "", isolated, certain, width, loose, turn, cut)
    if sticker is not None and distance is not None:
        offset = -(distance + 0.5 * sticker.thickness)
        return dataclasses.replace(shown, tip_offset=offset, tip_source="distance to the sticker as given"), column
    upright = dataclasses.replace(outline, profile=outline.profile - turn * (outline.columns - column))
    apex = None if isolated else find_apex(upright, rod, column)
    if apex is not None:
        row, error, away = apex
        source = "tip seen apart from the beam"
        column += away if free else 0.0
        return dataclasses.replace(shown, tip_offset=row, tip_error=error, tip_source=source), column
    if sticker is not None:
        offset = _offset_at_rest(beam, near, reference, head)
        source = "assumed to touch the beam in the first frames"
        return dataclasses.replace(shown, tip_offset=offset, tip_source=source), column
    raise InputError(
        "recording: the shaker's tip never stands clear of the beam and carries no sticker that could be found, "
        "so it cannot be followed; set region (--region) or threshold (--threshold), or track the beam alone "
        "with shaker=False (--no-shaker)"
    )


_NO_SIDES = ((math.nan, math.nan), 0.0)


def rod_sides(frames: NDArray[np.floating], rod: tuple[int, int], blur: float) -> tuple[tuple[float, float], float]:
    """Width [px] across the rod, its standard error, and columns by which a row leans; NaN and 0 where not seen.

    The rod moves along its sides, so that they are sharp in the mean over the sample.  Rows of the lower half count
    that show as much contrast as most do: neither sticker nor tip.
    """
    mean = frames[:, frames.shape[1] // 2 :].mean(0, dtype=np.float64)
    low, high = rod[0] - HALF, rod[1] + HALF
    if low < 0 or high > mean.shape[1]:
        return _NO_SIDES
    outside = 0.5 * (mean[:, low : low + 3].mean(1) + mean[:, high - 3 : high].mean(1))
    step = mean[:, rod_middle(rod, 0.2)].mean(1) - outside
    sign = float(np.sign(np.median(step)))
    rows = np.flatnonzero(step * sign > 0.8 * float(np.percentile(step * sign, 75.0)))
    solid = (mean[rows, low:high] - outside[rows, None]) * sign > 0.5 * step[rows, None] * sign
    first, last = low + solid.argmax(1) - 0.5, high - solid[:, ::-1].argmax(1) - 0.5
    sides = []
    for guess, rising in ((first, sign), (last, -sign)):
        _, inside, _, side = edges_about(mean.T[None], guess[None], rows, HALF, blur, rising)
        sides.append(np.where(inside, side, np.nan)[0])
    found, middle = sides[1] - sides[0], 0.5 * (sides[0] + sides[1])
    known = np.isfinite(found)
    known &= np.abs(found - np.median(found[known])) < 1.0 if known.any() else known
    if np.count_nonzero(known) < _ROWS:
        return _NO_SIDES
    lean = float(polyfit(rows[known], middle[known], 1)[0])
    across = 1.0 / math.sqrt(1.0 + lean * lean)
    scatter = float(np.std(found[known])) / math.sqrt(np.count_nonzero(known) / 3.0)
    return (across * float(np.mean(found[known])), math.hypot(scatter, _SIDE)), lean


def _stands_alone(bands: BeamBands, middle: NDArray[np.intp], near: Floats) -> bool:
    """Return whether only a separate band of constant height appears below the beam.

    So a bright sticker on a shaker as dark as the background looks; a bright shaker reaches the border.
    """
    objects = bands.objects
    shown = bands.alone[:, middle] & objects.follows[:, middle]
    frames = shown.mean(1) > 0.5
    if frames.mean() < 0.3:
        return False
    ends = ~objects.further[:, middle] & (objects.after_end[:, middle] < objects.height)
    if (ends & shown)[frames].sum() < 0.8 * shown[frames].sum():
        return False
    height, top = (
        masked_median(one[:, middle][frames], shown[frames])
        for one in (objects.after_end - objects.after, objects.after)
    )
    gap = (top - near[frames])[np.isfinite(near[frames])]
    even = np.ptp(np.percentile(height, (10, 90))) <= 2.5
    return bool(even and gap.size and np.percentile(gap, 2) > _CLEAR)


def _begin(view: BeamView, bands: BeamBands, middle: NDArray[np.intp], isolated: bool) -> NDArray[np.intp]:
    """Row in each frame of the sample from which to look for a sticker; -1 where nothing is seen."""
    objects = bands.objects
    apart, found = (bands.alone & objects.follows)[:, middle], objects.found[:, middle]
    clear = apart.mean(1) > 0.5
    if isolated:
        return np.where(clear, np.nan_to_num(masked_median(objects.end[:, middle], apart)) + 2, -1).astype(np.intp)
    after = np.nan_to_num(masked_median(objects.after[:, middle], apart)).astype(np.intp)
    start = np.nan_to_num(masked_median(objects.start[:, middle], found) + view.thickness, nan=-5.0)
    return np.where(clear, after, start.astype(np.intp)) + 4


def _outline(
    view: BeamView,
    frames: NDArray[np.floating],
    bands: BeamBands,
    rod: tuple[int, int],
    beam: BeamRows,
    reference: Floats,
) -> tuple[TipOutline, float]:
    """The tip's outline where it stands clear of the beam, counted from the sticker if there is one.

    Also the standard deviation [px] by which the sticker moves against the tip; 0 if it is no more than noise.
    """
    columns = spread_columns(rod[0] + 1, rod[1] - 2, 48)
    objects = bands.objects
    near = beam.row + view.thickness
    edge = near[:, None] + beam.slope[:, None] * (columns - view.contact_column)
    tip = objects.after[:, columns] - 0.5
    apart = bands.alone[:, columns] & objects.follows[:, columns] & (tip - edge >= MIN_GAP + 0.5)
    light = beam_light(frames, columns, edge, view.thickness)
    rows, good, _ = tip_edges(view, frames, columns, tip, edge, apart, light)
    outline, counted = tip_outline(rows, good, reference)
    if np.isfinite(reference).any():
        # Once more where the sticker says that there is a gap, so that noise does not choose the frames.
        tip = reference[:, None] + outline
        rows, good, _ = tip_edges(view, frames, columns, tip, edge, tip - edge >= MIN_GAP, light)
        outline, counted = tip_outline(rows, good, reference)
    known = (counted >= max(3, 0.05 * frames.shape[0])) & np.isfinite(light)
    at = np.flatnonzero(known)
    smooth = np.abs(np.diff(outline[at])) < _STEEP * np.diff(columns[at])
    first, last = longest_stretch(smooth)  # beyond a step it is not the tip
    known = np.isin(np.arange(columns.size), at[first : last + 1])
    loose = 0.0
    seen = good & known & np.isfinite(reference)[:, None]
    count = seen.sum(1)
    whole = count >= 2 * MIN_FLANK
    if np.count_nonzero(whole) >= _TIPS:
        away = np.where(seen, rows - reference[:, None] - outline, 0.0)[whole]
        mean = away.sum(1) / count[whole]
        within = float(np.mean(((away - np.where(seen[whole], mean[:, None], 0.0)) ** 2).sum(1) / count[whole] ** 2))
        # the smaller of both: a few blurred frames are no motion
        spread = min(float(np.std(mean)), 1.4826 * float(np.median(np.abs(mean - np.median(mean)))))
        loose = spread if spread > max(_LOOSE, 4.0 * math.sqrt(within)) else 0.0
    return TipOutline(columns[known], outline[known], light[known]), loose


def _offset_at_rest(beam: BeamRows, near: Floats, reference: Floats, head: int) -> float:
    """Row of the near edge over the sticker while both rest at the start, where the paper's tests touch."""
    still = np.isfinite(near[:head]) & np.isfinite(reference[:head])
    if not still.any():
        raise InputError(
            "recording: beam or sticker is not seen in the first frames; set region (--region) or threshold "
            "(--threshold), or give tip_distance (--tip-distance)"
        )
    first = int(still.argmax())
    limit = 4.0 * float(np.nanmax(beam.error[:head])) + 1e-6
    for rows in (near, reference):
        still &= np.abs(rows[:head] - rows[first]) <= limit
    return float((near[:head] - reference[:head])[still].mean())


# ----------------------------------------------------------------------------------------------------


def survey(
    frames: NDArray[np.floating], settings: TrackingSettings, *, saturated: float, pixel_size: float, head: int
) -> Scene:
    """Find everything in turned frames, the first *head* of them neighbours; *saturated* is infinite if no level is."""
    height, width = frames.shape[1:]
    smooth = ndimage.uniform_filter(frames, size=(0, 3, 3))
    level = otsu(smooth) if settings.threshold is None else settings.threshold
    far = float(np.median(smooth[:, :3]))
    bright = far < level if settings.objects == "auto" else settings.objects == "bright"
    side = smooth > level if far > level else smooth < level
    border = border_bar(side)
    if border and settings.objects == "auto":
        bright = far > level
    mask = smooth > level if bright else smooth < level
    if border:
        mask = without_rows(mask, 0, border)
    fixtures = ((0, border), *fixed_bars(mask)) if border and bright == (far > level) else fixed_bars(mask)
    for bar in fixtures:
        mask = without_rows(mask, *bar)
    bands = find_bands(column_objects(mask), height, level, bright)
    rod = find_rod(bands)
    if settings.shaker and rod is None:
        raise InputError(
            "recording: no shaker is seen beyond the beam; set region (--region), side (--side), objects "
            "(--objects) or threshold (--threshold), or track the beam alone with shaker=False (--no-shaker)"
        )
    bars = tuple((max(first - 1, 0), last + 1) for first, last in fixtures)
    known = {
        "threshold": level,
        "bright": bright,
        "noise": pixel_noise(frames),
        "saturated": saturated,
        "fixtures": bars,
    }
    known |= placed(width, rod, settings.columns, settings.contact_column)
    view, shape = beam_view(frames, smooth, bands, known)
    noise = noise_shape(frames[:head])
    if not settings.shaker or rod is None:
        return Scene(view, None, shape, noise, rod is not None)
    distance = None if settings.tip_distance is None else settings.tip_distance / pixel_size
    shaker, column = shaker_view(view, frames, smooth, bands, rod, settings, distance, head)
    view = dataclasses.replace(view, **placed(width, rod, settings.columns, column))
    return Scene(view, shaker, shape, noise, False)
