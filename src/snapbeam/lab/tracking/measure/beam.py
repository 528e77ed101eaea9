"""The beam's far edge in a batch of frames: found roughly in columns free of the shaker, then fitted."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.lab.tracking.edges import Floats, edge_noise, fit_edges, fit_line, masked_median
from snapbeam.lab.tracking.geometry import HALF, HOT, gather
from snapbeam.lab.tracking.scene import BeamView

__all__ = ["BeamRows", "measure_beam"]

_CHECKED = 4  # columns of a group in which the near edge is fitted too


class BeamRows(NamedTuple):
    """The far edge at the contact column of each frame, and what was seen on the way.

    ``row`` and ``slope`` are NaN where it was not found.  ``thickness`` [px] is measured across the beam in
    columns free of the shaker (NaN without such columns), ``residual`` what the fitted steps leave of their
    windows, share of the contrast.  ``level_range`` is the range of grey levels along the columns over the
    usual contrast, ``touches`` whether an object reached the far border there.
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


def measure_beam(view: BeamView, frames: NDArray[np.floating]) -> BeamRows:
    """Measure the far edge in turned frames (n, height, width)."""
    count, height = frames.shape[:2]
    guesses = np.full((len(view.groups), count), np.nan)
    ranges, touches = np.zeros(count), np.zeros(count, dtype=bool)
    longest = height if view.merged else 1.6 * view.thickness + 3.0
    for g, group in enumerate(view.groups):
        profile = frames[:, :, group].mean(-1, dtype=np.float64)
        profile[:, 1:-1] = (profile[:, 2:] + profile[:, 1:-1] + profile[:, :-2]) / 3.0
        ranges = np.maximum(ranges, np.ptp(profile, axis=1) / view.contrast)
        level = (profile - view.threshold) * view.sign
        for first, last in view.fixtures:
            level[:, first:last] = -1.0
        touches |= (level[:, :2] > 0.0).any(1)
        guesses[g] = _first_band(level, view.thickness, longest)
    about = frames[:, :, view.columns].mean(-1, dtype=np.float64)
    ranges = np.maximum(ranges, np.ptp(about, axis=1) / view.contrast)
    anchor, tilt = _anchor(guesses, [float(group.mean()) for group in view.groups])
    rows = anchor[:, None] + tilt[:, None] * view.columns
    half = int(np.clip(view.thickness // 2, 2, HALF))
    windows, inside = gather(frames, rows, view.columns, half)
    fit = fit_edges(windows, view.edge_width, sign=view.sign)
    edges = np.rint(np.where(np.isfinite(rows), rows, 0.0)) + fit.position
    good = inside & np.isfinite(edges)
    good &= (fit.contrast > 0.4 * view.contrast) & (fit.contrast < 1.8 * view.contrast)
    for first, last in view.fixtures:
        with np.errstate(invalid="ignore"):
            good &= (rows < first - half) | (rows >= last + half)
    noise = edge_noise(view.edge_width, view.noise, view.contrast)
    row, error, slope, kept = fit_line(view.columns - view.contact_column, edges, good, 1.5, noise)
    share = kept.mean(1)
    width = np.interp(masked_median(fit.width, kept), *view.width_table)
    saturated = ((windows >= view.saturated) & inside[..., None]).mean((1, 2))
    weak = (share < 0.5) | (saturated > view.hot_share + HOT)
    row[weak], slope[weak] = np.nan, np.nan
    return BeamRows(
        row=row,
        error=error,
        slope=slope,
        share=share,
        contrast=masked_median(fit.contrast, inside) / view.contrast,
        width=width,
        thickness=_thickness(view, frames, row, slope, half),
        residual=masked_median(fit.residual, kept) / view.contrast,
        saturated=saturated,
        level_range=ranges,
        touches=touches,
        outside=np.isfinite(anchor) & ~inside.any(1),
    )


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


def _first_band(level: Floats, thickness: float, longest: float) -> Floats:
    """Far edge of the first band of fitting thickness in each profile; NaN where there is none.

    ``level`` is positive inside objects.
    """
    steps = np.diff(np.pad((level > 0.0).astype(np.int8), ((0, 0), (1, 1))), axis=1)
    out = np.full(level.shape[0], np.nan)
    for k, step in enumerate(steps):
        starts, stops = np.flatnonzero(step == 1), np.flatnonzero(step == -1)
        fitting = (stops - starts >= 0.6 * thickness) & (stops - starts <= longest) & (starts > 0)
        if fitting.any():
            out[k] = starts[fitting.argmax()] - 0.5
    return out


def _thickness(view: BeamView, frames: NDArray[np.floating], row: Floats, slope: Floats, half: int) -> Floats:
    """Rows from the far edge to the near one, across the beam, in a few columns free of the shaker.

    Light on one of the edges shows here, for the beam's thickness does not change.
    """
    if view.merged:
        return np.full(row.shape, np.nan)
    columns = np.concatenate(
        [
            group[:_CHECKED] if group.mean() < view.contact_column else group[-_CHECKED:]
            for group in view.groups
        ]
    )
    across = columns - view.contact_column
    expected = row[:, None] + slope[:, None] * across + view.thickness
    windows, inside = gather(frames, expected, columns, half)
    fit = fit_edges(windows, view.edge_width, sign=-view.sign, iterations=3)
    found = np.rint(np.where(inside, expected, 0.0)) + fit.position - expected
    good = inside & np.isfinite(found) & (np.abs(found) < half - 1.0)
    miss = np.where(good.sum(1) >= 3, masked_median(found, good), np.nan)
    return (view.thickness + miss) / np.sqrt(1.0 + np.where(np.isfinite(slope), slope, 0.0) ** 2)
