"""The shaker in a sample of frames: the columns it covers, its sticker and its tip."""

from __future__ import annotations

import dataclasses
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from snapbeam.core.validate import InputError
from snapbeam.lab.tracking.edges import Floats
from snapbeam.lab.tracking.geometry import spread_columns
from snapbeam.lab.tracking.measure.beam import BeamRows, measure_beam
from snapbeam.lab.tracking.measure.sticker import sticker_rows, sticker_thickness
from snapbeam.lab.tracking.measure.tip import MIN_GAP, tip_edges
from snapbeam.lab.tracking.scene import BeamView, ShakerView, TipOutline
from snapbeam.lab.tracking.survey.bands import longest_stretch
from snapbeam.lab.tracking.survey.beam import BeamBands
from snapbeam.lab.tracking.survey.sticker import find_sticker, rod_middle
from snapbeam.lab.tracking.survey.tip import beam_light, find_apex, tip_outline

__all__ = ["Wanted", "find_rod", "shaker_view"]

_CLEAR = 4.0  # rows from the beam within which a mark that stands alone may be the tip itself


class Wanted(NamedTuple):
    """What a person asks of the shaker: to look for a sticker, where its tip is [px], to keep the column.

    ``head`` counts the frames at the start of the sample that are neighbours.
    """

    marker: bool
    tip_distance: float | None
    fixed_column: bool
    head: int


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
    wanted: Wanted,
) -> tuple[ShakerView, float]:
    """The shaker, and the column at which its tip comes nearest to the beam.

    Raises
    ------
    InputError
        If neither tip nor sticker can be followed, with the way out.
    """
    beam = measure_beam(view, frames)
    near = beam.row + view.thickness
    middle = rod_middle(rod)
    isolated = wanted.marker and _stands_alone(bands, middle, near)
    sticker = None
    if wanted.marker:
        begin = _begin(view, bands, middle, isolated)
        sticker = find_sticker(smooth, middle, begin, view.contrast, view.sign if isolated else 0.0)
    isolated = isolated and sticker is not None
    reference = np.full(frames.shape[0], np.nan)
    if sticker is not None:
        size = sticker_thickness(view, sticker, frames, near)
        sticker = dataclasses.replace(sticker, thickness=size)
        reference = sticker_rows(view, sticker, frames, near).row
    outline = _outline(view, frames, bands, rod, beam, reference, learn=not isolated)
    column = view.contact_column
    shown = ShakerView(rod, sticker, outline, np.nan, 0.0, "", isolated)
    if sticker is not None and wanted.tip_distance is not None:
        offset = -(wanted.tip_distance + 0.5 * sticker.thickness)
        return dataclasses.replace(
            shown, tip_offset=offset, tip_source="distance to the sticker as given"
        ), column
    apex = None if isolated else find_apex(outline, rod, column)
    if apex is not None:
        column += 0.0 if wanted.fixed_column else apex.column
        source = "tip seen apart from the beam"
        return dataclasses.replace(
            shown, tip_offset=apex.row, tip_error=apex.error, tip_source=source
        ), column
    if sticker is not None:
        offset = _offset_at_rest(beam, near, reference, wanted.head)
        source = "assumed to touch the beam in the first frames"
        return dataclasses.replace(shown, tip_offset=offset, tip_source=source), column
    raise InputError(
        "recording: the shaker's tip never stands clear of the beam and carries no sticker that could be found, "
        "so it cannot be followed; set region (--region) or threshold (--threshold), or track the beam alone "
        "with shaker=False (--no-shaker)"
    )


def _stands_alone(bands: BeamBands, middle: NDArray[np.intp], near: Floats) -> bool:
    """Whether all that is seen below the beam is a band of one height that never comes near it.

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
    size = (objects.after_end - objects.after)[:, middle]
    height = np.array([np.median(size[k][shown[k]]) for k in np.flatnonzero(frames)])
    top = np.array([np.median(objects.after[k, middle][shown[k]]) for k in np.flatnonzero(frames)])
    gap = (top - near[frames])[np.isfinite(near[frames])]
    even = np.ptp(np.percentile(height, (10, 90))) <= 2.5
    return bool(even and gap.size and np.percentile(gap, 2) > _CLEAR)


def _begin(view: BeamView, bands: BeamBands, middle: NDArray[np.intp], isolated: bool) -> NDArray[np.intp]:
    """Row in each frame of the sample from which to look for a sticker; -1 where nothing is seen."""
    objects = bands.objects
    begin = np.full(objects.start.shape[0], -1, dtype=np.intp)
    for k in range(begin.size):
        apart = bands.alone[k, middle] & objects.follows[k, middle]
        if apart.mean() > 0.5:
            if isolated:
                begin[k] = int(np.median(objects.end[k, middle][apart])) + 2
            else:
                begin[k] = int(np.median(objects.after[k, middle][apart])) + 4
        elif objects.found[k, middle].any() and not isolated:
            begin[k] = int(np.median(objects.start[k, middle][objects.found[k, middle]]) + view.thickness) + 4
    return begin


def _outline(
    view: BeamView,
    frames: NDArray[np.floating],
    bands: BeamBands,
    rod: tuple[int, int],
    beam: BeamRows,
    reference: Floats,
    *,
    learn: bool,
) -> TipOutline:
    """The tip's outline where it stands clear of the beam, counted from the sticker if there is one."""
    columns = spread_columns(rod[0] + 1, rod[1] - 2, 48)
    if not learn:
        nothing: Floats = np.empty(0)
        return TipOutline(np.empty(0, dtype=np.intp), nothing, nothing)
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
    return TipOutline(columns[known], outline[known], light[known])


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
