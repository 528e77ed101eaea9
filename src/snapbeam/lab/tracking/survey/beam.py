"""The beam in a sample of frames: its levels, its thickness, the blur of its edges and where to measure it."""

from __future__ import annotations

import dataclasses
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.validate import InputError
from snapbeam.lab.tracking.edges import EdgeFit, Floats, fit_edges, masked_median, width_calibration
from snapbeam.lab.tracking.geometry import HALF, gather, spread_columns
from snapbeam.lab.tracking.scene import BeamView, EdgeShape
from snapbeam.lab.tracking.survey.bands import ColumnObjects
from snapbeam.lab.tracking.survey.edge_shape import edge_shape

__all__ = ["BeamBands", "beam_view", "find_bands", "placed"]

_STEADY = 1.1  # blur of a frame over the usual one up to which its edges show the camera's own


class BeamBands(NamedTuple):
    """The beam as a band in each column (frames, columns): ``alone`` where nothing else merges with it."""

    objects: ColumnObjects
    alone: NDArray[np.bool_]
    thickness: float


def find_bands(objects: ColumnObjects, height: int, level: float, bright: bool) -> BeamBands:
    """The band that crosses the picture.

    Raises
    ------
    InputError
        If none does, with what to change.
    """
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


def placed(
    width: int, rod: tuple[int, int] | None, count: int, contact_column: float | None
) -> tuple[float, NDArray[np.intp], tuple[NDArray[np.intp], ...], bool]:
    """Contact column, columns to measure the beam in, groups that see it alone, and whether there are none.

    Raises
    ------
    InputError
        If the contact column leaves too little of the picture on one side.
    """
    centre = (rod[0] + rod[1] - 1) / 2.0 if rod is not None else (width - 1) / 2.0
    centre = centre if contact_column is None else contact_column
    half = max(20.0, (rod[1] - rod[0]) / 2.0) if rod is not None else max(20.0, width / 8.0)
    half = min(half, centre - 2.0, width - 3.0 - centre)
    if half < 2.0:
        raise InputError(
            f"contact_column (--contact-column) = {centre:g}: must leave at least 4 columns on both sides in "
            "the region"
        )
    columns = spread_columns(int(np.ceil(centre - half)), int(np.floor(centre + half)), count)
    if rod is None:
        return centre, columns, (columns,), False
    left = np.arange(max(0, rod[0] - 19), rod[0] - 3)
    right = np.arange(rod[1] + 3, min(width, rod[1] + 19))
    groups = tuple(one for one in (left, right) if one.size >= 4)
    return centre, columns, groups or (columns,), not groups


def beam_view(
    frames: NDArray[np.floating],
    smooth: NDArray[np.floating],
    bands: BeamBands,
    rough: BeamView,
) -> tuple[BeamView, EdgeShape]:
    """The beam to a fraction of a pixel, where it stands alone, and the shape of its edge.

    ``rough`` holds all but contrast, edge width and thickness.
    """
    objects, alone = bands.objects, bands.alone
    background, inside = _levels(smooth, objects, alone)
    clear = ~objects.follows | (
        objects.after - objects.end >= 2 * HALF
    )  # else the tip's light is in the windows
    good = alone & (clear if (alone & clear).mean() > 0.02 else True)
    good[:, good.mean(0) < 0.1] = False
    columns = np.flatnonzero(good.any(0))
    columns = columns[np.unique(np.linspace(0, columns.size - 1, min(columns.size, 48)).astype(int))]
    half = int(np.clip(bands.thickness // 2, 2, HALF))
    good = good[:, columns]
    far, near = objects.start[:, columns] - 0.5, objects.end[:, columns] - 0.5
    width = _edge_width(frames, far, columns, good, half, rough.sign)
    windows, fits, edges, usable = [], [], [], good.copy()
    for rows, sign in ((near, -rough.sign), (far, rough.sign)):
        window, within = gather(frames, rows, columns, half)
        fit = fit_edges(window, width, sign=sign)
        windows.append(window)
        fits.append(fit)
        edges.append(np.rint(rows) + fit.position)
        usable &= within & np.isfinite(fit.position)
    contrast, thickness, error = abs(inside - background), bands.thickness, 0.5
    if usable.any():
        contrast = float(np.median(fits[1].contrast[usable]))
        thickness = float(np.median((edges[0] - edges[1])[usable]))
        by_column = masked_median((edges[0] - edges[1]).T, usable.T)
        by_column = by_column[np.isfinite(by_column)]
        # the surface is uneven on the scale of three pixels: neighbouring columns count as one
        independent = max(min(by_column.size, float(np.ptp(columns)) / 3.0), 1.0)
        error = float(np.std(by_column)) / math.sqrt(independent)
    clipped = max(
        _hot(frames, rows, columns, good, rough.saturated) for rows in (0.5 * (far + near), far - half)
    )
    hot = float((windows[1][good] >= rough.saturated).mean()) if good.any() else 0.0
    view = dataclasses.replace(
        rough,
        contrast=contrast,
        thickness=thickness,
        thickness_error=error,
        edge_width=width,
        width_table=width_calibration(width, 2 * half + 1),
        hot_share=hot,
    )
    blur = masked_median(fits[1].width, usable)
    steady = usable
    if np.isfinite(
        blur
    ).any():  # an edge that speeds up within the exposure is bent whatever the camera's curve
        steady = usable & (blur <= _STEADY * np.nanpercentile(blur, 25.0))[:, None]
    return view, edge_shape(windows[1], fits[1], steady, width, rough.sign, clipped)


def _hot(
    frames: NDArray[np.floating],
    rows: Floats,
    columns: NDArray[np.intp],
    good: NDArray[np.bool_],
    level: float,
) -> float:
    """Share of saturated pixels about the given rows."""
    windows, seen = gather(frames, rows, columns, 1)
    return float((windows[seen & good] >= level).mean()) if (seen & good).any() else 0.0


def _levels(
    smooth: NDArray[np.floating], objects: ColumnObjects, alone: NDArray[np.bool_]
) -> tuple[float, float]:
    """Grey levels of the background beyond the beam and of the beam's middle."""
    k, x = np.nonzero(alone & (objects.start >= 4))
    if not k.size:
        raise InputError(
            "recording: the beam touches the edge of the region in every sampled frame; make region (--region) "
            "taller"
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
        fit: EdgeFit = fit_edges(windows, width, sign=sign)
        usable = inside & good[few] & np.isfinite(fit.position)
        if not usable.any():
            raise InputError(
                "recording: the far edge of the beam could not be fitted; set threshold (--threshold) or region "
                "(--region)"
            )
        found = float(np.median(fit.width[usable]))
        width = float(np.clip(found, 0.3, 4.0)) if np.isfinite(found) else width
    return width
