"""The beam's far edge in a batch of frames: found roughly in columns free of the shaker, then fitted."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.lab.tracking.edges import Floats, fit_edges, fit_line, masked_median
from snapbeam.lab.tracking.scene import HALF, HOT, Scene, gather

__all__ = ["BeamRows", "measure_beam"]


class BeamRows(NamedTuple):
    """The far edge at the contact column of each frame, and what was seen on the way.

    ``row`` and ``slope`` are NaN where it was not found.  ``level_range`` is the range of grey levels along
    the columns over the usual contrast, ``touches`` whether an object reached the far border there.
    """

    row: Floats
    error: Floats
    slope: Floats
    share: Floats
    contrast: Floats
    width: Floats
    saturated: Floats
    level_range: Floats
    touches: NDArray[np.bool_]
    outside: NDArray[np.bool_]


def measure_beam(scene: Scene, frames: NDArray[np.floating]) -> BeamRows:
    """Measure the far edge in turned frames (n, height, width)."""
    count, height = frames.shape[:2]
    guesses = np.full((len(scene.groups), count), np.nan)
    middles = np.array([group.mean() for group in scene.groups])
    ranges, touches = np.zeros(count), np.zeros(count, dtype=bool)
    for g, group in enumerate(scene.groups):
        profile = frames[:, :, group].mean(-1, dtype=np.float64)
        profile[:, 1:-1] = (profile[:, 2:] + profile[:, 1:-1] + profile[:, :-2]) / 3.0
        ranges = np.maximum(ranges, np.ptp(profile, axis=1) / scene.contrast)
        solid = (profile - scene.threshold) * scene.sign > 0.0
        touches |= solid[:, :2].any(1)
        merged = group is scene.beam_columns and scene.rod is not None
        guesses[g] = _first_band(solid, scene.thickness, height if merged else 1.6 * scene.thickness + 3.0)
    about = frames[:, :, scene.beam_columns].mean(-1, dtype=np.float64)
    ranges = np.maximum(ranges, np.ptp(about, axis=1) / scene.contrast)
    found = np.isfinite(guesses)
    with np.errstate(invalid="ignore"):
        if len(scene.groups) == 2:
            tilt = (guesses[1] - guesses[0]) / (middles[1] - middles[0])
            usual = float(np.median(tilt[np.isfinite(tilt)])) if np.isfinite(tilt).any() else 0.0
            tilt = np.where(np.isfinite(tilt), tilt, usual)
        else:
            tilt = np.zeros(count)
    anchor = np.where(found[0], guesses[0] - tilt * middles[0], np.nan)
    if len(scene.groups) == 2:
        anchor = np.where(found[0], anchor, guesses[1] - tilt * middles[1])
    x = scene.beam_columns - scene.contact_column
    rows = anchor[:, None] + tilt[:, None] * scene.beam_columns
    half = int(np.clip(scene.thickness // 2, 2, HALF))
    windows, inside = gather(frames, rows, scene.beam_columns, half)
    fit = fit_edges(windows, scene.edge_width, sign=scene.sign)
    edges = np.rint(np.where(np.isfinite(rows), rows, 0.0)) + fit.position
    good = (
        inside
        & np.isfinite(edges)
        & (fit.contrast > 0.4 * scene.contrast)
        & (fit.contrast < 1.8 * scene.contrast)
    )
    row, error, slope, kept = fit_line(x, edges, good, 1.5)
    share = kept.mean(1)
    width = masked_median(fit.width, kept)
    if scene.width_table is not None:
        width = np.interp(width, *scene.width_table)
    hot = (windows >= scene.saturated) & inside[..., None]
    saturated = hot.mean((1, 2))
    weak = (share < 0.5) | (saturated > HOT)
    row[weak], slope[weak] = np.nan, np.nan
    return BeamRows(
        row=row,
        error=error,
        slope=slope,
        share=share,
        contrast=masked_median(fit.contrast, inside) / scene.contrast,
        width=width,
        saturated=saturated,
        level_range=ranges,
        touches=touches,
        outside=np.isfinite(anchor) & ~inside.any(1),
    )


def _first_band(solid: NDArray[np.bool_], thickness: float, longest: float) -> Floats:
    """Far edge of the first band of a fitting thickness in each profile; NaN where there is none."""
    steps = np.diff(np.pad(solid.astype(np.int8), ((0, 0), (1, 1))), axis=1)
    out = np.full(solid.shape[0], np.nan)
    for k, step in enumerate(steps):
        starts, stops = np.flatnonzero(step == 1), np.flatnonzero(step == -1)
        fitting = (stops - starts >= 0.6 * thickness) & (stops - starts <= longest) & (starts > 0)
        if fitting.any():
            out[k] = starts[fitting.argmax()] - 0.5
    return out
