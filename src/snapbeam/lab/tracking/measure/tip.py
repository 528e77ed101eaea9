"""The tip of the shaker in every frame, where it carries no sticker.

Blurred edges add up, so the beam's light can be taken out of a window before the tip is fitted: its near edge
is known from the far one and the thickness.  That leaves the tip measurable down to gaps of two pixels, and a
rounded tip keeps such gaps on its flanks while its middle touches.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from snapbeam.lab.tracking.edges import Floats, edge_profile, fit_edges, masked_median
from snapbeam.lab.tracking.geometry import HALF, HOT, gather
from snapbeam.lab.tracking.measure.sticker import ShakerRows
from snapbeam.lab.tracking.scene import BeamView, TipOutline

__all__ = ["MIN_GAP", "tip_edges", "tip_rows"]

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
    """Sub-pixel rows of the tip's edge at *columns*, with the beam's light taken out.

    ``tip`` and ``near`` are the expected row of the tip and the known row of the beam's near edge, (frames,
    columns); ``light`` is the beam's contrast, (columns,).  Also returns which edges are sound, and the
    share of saturated pixels in each frame.
    """
    windows, inside = gather(frames, tip, columns, HALF)
    centre = np.rint(np.where(np.isfinite(tip), tip, 0.0))
    known = np.where(np.isfinite(near), near, -1e3)
    offsets: Floats = centre[..., None] + np.arange(-HALF, HALF + 1.0) - known[..., None]
    covered: Floats = 1.0 - edge_profile(offsets, view.edge_width)
    beam = light[None, :, None] * covered
    weights = (offsets > -2.0).astype(np.float64)
    weights[..., HALF - 2 :] = 1.0
    fit = fit_edges(windows - beam, view.edge_width, sign=view.sign, weights=weights)
    sound = good & inside & np.isfinite(fit.position) & (fit.contrast > 0.4 * view.contrast)
    sound &= fit.contrast < 1.8 * view.contrast
    saturated = ((windows >= view.saturated) & inside[..., None]).mean((1, 2))
    return centre + fit.position, sound, saturated


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
    spread = np.where(good, (centred - row[:, None]) ** 2, 0.0).sum(1) / np.maximum(total - 1, 1)
    nothing = np.full(row.shape, np.nan)
    return ShakerRows(
        row=np.where(enough, row, np.nan),
        error=np.where(enough, np.sqrt(spread / total), np.nan),
        share=number / np.maximum(clear.sum(1), 1),
        contrast=np.ones(row.shape),
        width=nothing,
        merged=np.isfinite(near) & seen & (clear.sum(1) < MIN_FLANK),
        saturated=saturated,
    )
