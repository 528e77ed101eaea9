"""The shaker in the picture: learning its sticker and tip from a sample, and measuring it in every frame."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.validate import InputError
from snapbeam.lab.tracking.beam_edge import BeamRows, measure_beam
from snapbeam.lab.tracking.edges import Floats
from snapbeam.lab.tracking.scene import Runs, Scene, ShakerRows, spread_columns
from snapbeam.lab.tracking.sticker import find_sticker, sticker_rows
from snapbeam.lab.tracking.tip import MIN_GAP, beam_light, find_apex, tip_edges, tip_outline, tip_rows

__all__ = ["measure_shaker", "survey_shaker"]


def survey_shaker(
    scene: Scene,
    frames: NDArray[np.floating],
    smooth: NDArray[np.floating],
    runs: Runs,
    alone: NDArray[np.bool_],
    *,
    marker: bool,
    moved: bool,
    head: int,
) -> None:
    """Add sticker, tip outline and offset to *scene*.

    *moved* lets the contact column follow the tip; the first *head* frames are neighbours.
    """
    assert scene.rod is not None
    columns = spread_columns(scene.rod[0] + 1, scene.rod[1] - 2, 48)
    beam = measure_beam(scene, frames)
    near = beam.row + scene.thickness
    reference = np.full(frames.shape[0], np.nan)
    if marker:
        find_sticker(scene, smooth, runs, alone)
    if scene.marker_columns is not None:
        reference = sticker_rows(scene, frames, near).row
    edge = near[:, None] + beam.slope[:, None] * (columns - scene.contact_column)
    tip = runs.after[:, columns] - 0.5
    apart = alone[:, columns] & runs.follows[:, columns] & (tip - edge >= MIN_GAP + 0.5)
    light = beam_light(scene, frames, columns, edge)
    rows, good, _ = tip_edges(scene, frames, columns, tip, edge, apart, light)
    outline, counted = tip_outline(rows, good, reference)
    if scene.marker_columns is not None:
        # Once more where the sticker says that there is a gap, so that noise does not choose the frames.
        tip = reference[:, None] + outline
        rows, good, _ = tip_edges(scene, frames, columns, tip, edge, tip - edge >= MIN_GAP, light)
        outline, counted = tip_outline(rows, good, reference)
    known = (counted >= max(3, 0.05 * frames.shape[0])) & np.isfinite(light)
    scene.tip_columns, scene.tip_profile, scene.tip_light = columns[known], outline[known], light[known]
    if find_apex(scene, moved):
        scene.tip_source = "tip seen apart from the beam"
    elif scene.marker_columns is not None:
        scene.tip_offset = _offset_at_rest(beam, near, reference, head)
        scene.tip_source = "assumed to touch the beam in the first frames"
    else:
        raise InputError(
            "recording: the shaker's tip never stands clear of the beam and carries no sticker that could be "
            "found, so it cannot be followed; set region or threshold, or use shaker=False"
        )


def _offset_at_rest(beam: BeamRows, near: Floats, reference: Floats, head: int) -> float:
    """Row of the near edge over the sticker while both rest at the start, where the paper's tests touch."""
    still = np.isfinite(near[:head]) & np.isfinite(reference[:head])
    if not still.any():
        raise InputError(
            "recording: beam or sticker is not seen in the first frames; set region or threshold"
        )
    first = int(still.argmax())
    limit = 4.0 * float(np.nanmax(beam.error[:head])) + 1e-6
    for rows in (near, reference):
        still &= np.abs(rows[:head] - rows[first]) <= limit
    return float((near[:head] - reference[:head])[still].mean())


def measure_shaker(scene: Scene, frames: NDArray[np.floating], near: Floats, slope: Floats) -> ShakerRows:
    """Row of the shaker's reference in a batch of turned frames.

    ``near`` is the row of the beam's near edge at the contact column and ``slope`` the beam's slope.
    """
    if scene.marker_columns is not None:
        return sticker_rows(scene, frames, near)
    return tip_rows(scene, frames, near, slope)
