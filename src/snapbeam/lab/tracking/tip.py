"""The tip of the shaker: its outline, learned where it stands clear of the beam, and its row in each frame.

Blurred edges add up, so the beam's light can be taken out of a window before the tip is fitted: its near edge
is known from the far one and the thickness.  That leaves the tip measurable down to gaps of two pixels, and a
rounded tip keeps such gaps on its flanks while its middle touches.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from snapbeam.lab.tracking.edges import Floats, edge_profile, fit_edges, masked_median
from snapbeam.lab.tracking.scene import HALF, HOT, Scene, ShakerRows, gather

__all__ = ["MIN_GAP", "beam_light", "find_apex", "tip_edges", "tip_outline", "tip_rows"]

MIN_GAP = 2.0  # rows between beam and tip below which a column counts as touching
MIN_FLANK = 4  # columns with a gap that it takes to measure the tip


def beam_light(scene: Scene, frames: NDArray[np.floating], columns: NDArray[np.intp], near: Floats) -> Floats:
    """Contrast of the beam in each column: its middle less the background beyond it, median over frames."""
    middle, inside = gather(frames, near - 0.5 * scene.thickness, columns, 1)
    beyond, seen = gather(frames, near - scene.thickness - 5.0, columns, 1)
    return masked_median((middle.mean(-1) - beyond.mean(-1)).T, (inside & seen).T)


def tip_edges(
    scene: Scene,
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
    covered: Floats = 1.0 - edge_profile(offsets, scene.edge_width)
    beam = light[None, :, None] * covered
    weights = (offsets > -2.0).astype(np.float64)
    weights[..., HALF - 2 :] = 1.0
    fit = fit_edges(windows - beam, scene.edge_width, sign=scene.sign, weights=weights)
    sound = good & inside & np.isfinite(fit.position) & (fit.contrast > 0.4 * scene.contrast)
    sound &= fit.contrast < 1.8 * scene.contrast
    saturated = ((windows >= scene.saturated) & inside[..., None]).mean((1, 2))
    return centre + fit.position, sound, saturated


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


def find_apex(scene: Scene, moved: bool) -> bool:
    """Set where the tip comes nearest to the beam; False if the outline is not known on both sides of it."""
    assert scene.rod is not None
    x, y = scene.tip_columns - scene.contact_column, scene.tip_profile
    size = float(scene.rod[1] - scene.rod[0])
    inner = np.abs(x) <= 0.4 * size
    if inner.sum() < 5 or x[inner].min() > -0.1 * size or x[inner].max() < 0.1 * size:
        return False
    half = float(np.abs(x[inner]).max())
    covered = inner.sum() >= 12 and np.diff(np.sort(x[inner])).max() < 0.2 * size
    fit = np.polynomial.Polynomial.fit(x[inner], y[inner], 4 if covered else 2)
    fine = np.linspace(-0.9 * half, 0.9 * half, 1001)
    drop = fit(fine)
    nearest = int(drop.argmin())
    rounded = min(drop[0], drop[-1]) - drop[nearest] > 0.3
    if not rounded and not covered:
        return False
    if rounded and moved:
        scene.contact_column += float(fine[nearest])
    scene.tip_offset = float(drop[nearest] if rounded else np.median(y[inner]))
    return True


def tip_rows(scene: Scene, frames: NDArray[np.floating], near: Floats, slope: Floats) -> ShakerRows:
    """Rows of the tip in turned frames; ``near`` and ``slope`` are those of the beam's near edge."""
    columns, profile = scene.tip_columns, scene.tip_profile
    parts = np.array_split(np.arange(columns.size), min(6, max(1, columns.size // 4)))
    guesses = np.full((frames.shape[0], len(parts)), np.nan)
    seen = np.zeros(frames.shape[0], dtype=bool)
    down = np.arange(frames.shape[1])[None, :]
    for p, part in enumerate(parts):
        mean = frames[:, :, columns[part]].mean(-1, dtype=np.float64)
        solid = (mean - scene.threshold) * scene.sign > 0.0
        beam = near + slope * (columns[part].mean() - scene.contact_column)
        below = solid & (down >= np.where(np.isfinite(beam), beam + 1.0, np.inf)[:, None])
        row = below.argmax(1)
        seen |= below.any(1)
        clear = below.any(1) & (row - 0.5 - beam >= MIN_GAP)
        guesses[clear, p] = (row - 0.5 - profile[part].mean())[clear]
    rows = masked_median(guesses, np.isfinite(guesses))[:, None] + profile
    beam = near[:, None] + slope[:, None] * (columns - scene.contact_column)
    clear = np.isfinite(rows) & (rows - beam >= MIN_GAP)
    edges, good, saturated = tip_edges(scene, frames, columns, rows, beam, clear, scene.tip_light)
    # The rod does not turn, so a constant is fitted: all columns on one flank would not hold a line.
    centred = np.where(good, edges - profile, np.nan)
    middle = masked_median(centred, good)
    good &= np.abs(centred - middle[:, None]) < 1.5
    number = good.sum(1)
    enough = (number >= MIN_FLANK) & (saturated <= HOT)
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
