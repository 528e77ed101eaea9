"""The sticker on the shaker in every frame, the best mark: it stays visible while tip and beam touch."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.lab.tracking.edges import Floats, edge_noise, fit_edges, fit_line, masked_median
from snapbeam.lab.tracking.geometry import HALF, HOT, gather
from snapbeam.lab.tracking.scene import BeamView, Sticker

__all__ = ["ShakerRows", "sticker_rows", "sticker_thickness"]

SOLID = 3.0  # rows by which a shaker may seem to stand inside the beam


class ShakerRows(NamedTuple):
    """Row of the shaker's reference in each frame, its standard error, and the quality of the edges."""

    row: Floats
    error: Floats
    share: Floats
    contrast: Floats
    width: Floats
    merged: NDArray[np.bool_]
    saturated: Floats


def sticker_rows(
    view: BeamView,
    sticker: Sticker,
    frames: NDArray[np.floating],
    near: Floats,
    tip_offset: float | None = None,
) -> ShakerRows:
    """Rows of the sticker's middle in turned frames.

    ``near`` is the row of the beam's near edge, ``tip_offset`` that of the tip from the sticker's middle if
    it is known already: the tip cannot stand inside the beam.
    """
    both = _both_edges(view, sticker, frames, near, tip_offset)
    middle = 0.5 * (both.upper + both.lower)
    noise = math.sqrt(0.5) * edge_noise(view.edge_width, view.noise, sticker.contrast)
    row, error, _, kept = fit_line(sticker.columns - view.contact_column, middle, both.good, 1.5, noise)
    share = kept.mean(1)
    return ShakerRows(
        row=np.where((share >= 0.5) & (both.saturated <= view.hot_share + HOT), row, np.nan),
        error=error,
        share=share,
        contrast=masked_median(both.strength, kept) / sticker.contrast,
        width=masked_median(both.width, kept),
        merged=np.zeros(row.shape, dtype=bool),
        saturated=both.saturated,
    )


def sticker_thickness(view: BeamView, sticker: Sticker, frames: NDArray[np.floating], near: Floats) -> float:
    """Rows from the sticker's upper edge to its lower one, to a fraction of a pixel."""
    both = _both_edges(view, sticker, frames, near, None)
    found = (both.lower - both.upper)[both.good]
    return float(np.median(found)) if found.size else sticker.thickness


class _Edges(NamedTuple):
    """Rows of the two edges (frames, columns), which are sound, and what was seen there."""

    upper: Floats
    lower: Floats
    good: NDArray[np.bool_]
    strength: Floats
    width: Floats
    saturated: Floats


def _both_edges(
    view: BeamView,
    sticker: Sticker,
    frames: NDArray[np.floating],
    near: Floats,
    tip_offset: float | None,
) -> _Edges:
    columns = sticker.columns
    half = int(np.clip(sticker.thickness // 2, 2, HALF))
    if tip_offset is not None:
        first = near - SOLID - tip_offset - sticker.thickness / 2.0
    else:  # nor can the sticker be the gap between beam and tip
        first = near + 3.0
    profiles = frames[:, :, columns].mean(-1, dtype=np.float64)
    top = _locate(sticker, profiles, np.where(np.isfinite(first), first, -np.inf), 0.1 * view.contrast)
    rows = np.repeat(top[:, None], columns.size, axis=1)
    fits, edges, inside = [], [], np.ones(rows.shape, dtype=bool)
    saturated: Floats = np.zeros(frames.shape[0])
    for shift, sign in ((0.0, sticker.sign), (sticker.thickness, -sticker.sign)):
        windows, within = gather(frames, rows + shift, columns, half)
        fit = fit_edges(windows, view.edge_width, sign=sign)
        fits.append(fit)
        edges.append(np.rint(rows + shift) + fit.position)
        inside &= within
        hot = (windows >= view.saturated) & within[..., None]
        saturated = np.maximum(saturated, hot.mean((1, 2)))
    strength = np.stack([fit.contrast for fit in fits])
    good = inside & np.isfinite(edges[0]) & np.isfinite(edges[1])
    good &= (strength > 0.4 * sticker.contrast).all(0) & (strength < 1.8 * sticker.contrast).all(0)
    good &= np.abs(edges[1] - edges[0] - sticker.thickness) < 3.0
    width = 0.5 * (fits[0].width + fits[1].width)
    return _Edges(edges[0], edges[1], good, strength.mean(0), width, saturated)


def _locate(sticker: Sticker, profiles: Floats, first: Floats, least: float) -> Floats:
    """Row of the sticker's upper edge, from *first* on, to about a pixel: by correlation with its profile.

    Views whose range stays below *least* count for nothing.
    """
    template = sticker.template - sticker.template.mean()
    template = template / np.sqrt((template * template).sum())
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
