"""The sticker on the shaker, the best mark: it stays visible while tip and beam touch."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from snapbeam.lab.tracking.edges import Floats, fit_edges, fit_line, masked_median
from snapbeam.lab.tracking.scene import HALF, HOT, Runs, Scene, ShakerRows, gather, spread_columns

__all__ = ["find_sticker", "sticker_rows"]

SEEN = 0.3  # share of the sample in which a sticker must be seen
SOLID = 3.0  # rows by which a shaker may seem to stand inside the beam


def _middle(rod: tuple[int, int], share: float) -> NDArray[np.intp]:
    centre, half = (rod[0] + rod[1] - 1) / 2.0, max(2.0, share * (rod[1] - rod[0]) / 2.0)
    return np.arange(int(np.ceil(centre - half)), int(np.floor(centre + half)) + 1)


def find_sticker(scene: Scene, smooth: NDArray[np.floating], runs: Runs, alone: NDArray[np.bool_]) -> None:
    """Look for a band on the shaker, two steps of opposite sign below the tip."""
    assert scene.rod is not None
    columns = _middle(scene.rod, 0.5)
    profiles = smooth[:, :, columns].mean(-1)
    steps = np.zeros_like(profiles)
    steps[:, 2:-2] = profiles[:, 4:] - profiles[:, :-4]
    found: list[tuple[int, int, int, float]] = []
    for k in range(profiles.shape[0]):
        apart = alone[k, columns] & runs.follows[k, columns]
        if apart.mean() > 0.5:
            begin = int(np.median(runs.after[k, columns][apart])) + 4
        elif runs.found[k, columns].any():
            begin = int(np.median(runs.start[k, columns][runs.found[k, columns]]) + scene.thickness) + 4
        else:
            continue
        peaks = _peaks(steps[k], begin, 0.3 * scene.contrast)
        if len(peaks) >= 2 and peaks[0][1] * peaks[1][1] < 0.0 and peaks[1][0] - peaks[0][0] >= 4:
            found.append((k, peaks[0][0], peaks[1][0], peaks[0][1]))
    if len(found) < SEEN * profiles.shape[0]:
        return
    thickness = np.array([bottom - top for _, top, bottom, _ in found])
    sign = float(np.sign(np.median([step for *_, step in found])))
    size = float(np.median(thickness))
    same = [one for one in found if abs(one[2] - one[1] - size) <= 2.0 and one[3] * sign > 0.0]
    if len(same) < SEEN * profiles.shape[0]:
        return
    margin = int(np.clip(min(smooth.shape[1] - 1 - bottom for _, _, bottom, _ in same), 2, HALF))
    cut = [
        profiles[k, top - margin : top + round(size) + margin + 1]
        for k, top, bottom, _ in same
        if top + round(size) + margin < smooth.shape[1]
    ]
    if not cut:
        return
    scene.template, scene.template_head = np.median(np.array(cut, dtype=np.float64), axis=0), margin
    scene.marker_thickness, scene.marker_sign = size, sign
    scene.marker_columns = spread_columns(int(columns[0]), int(columns[-1]), 24)
    scene.marker_contrast = float(np.median([abs(step) for *_, step in same]))


def _peaks(steps: NDArray[np.floating], begin: int, height: float) -> list[tuple[int, float]]:
    """Rows and values of the extremes of each run of *steps* beyond *height*, from *begin* down."""
    peaks: list[tuple[int, float]] = []
    row = begin
    while row < steps.size:
        if abs(steps[row]) > height:
            stop = row
            while stop < steps.size and steps[stop] * steps[row] > 0.0 and abs(steps[stop]) > height:
                stop += 1
            part = np.abs(steps[row:stop])
            peak = round(float((part * np.arange(row, stop)).sum() / part.sum()))
            if row > begin:  # a run under way at the start belongs to the tip
                peaks.append((peak, float(steps[peak])))
            row = stop
        else:
            row += 1
    return peaks


def sticker_rows(scene: Scene, frames: NDArray[np.floating], near: Floats) -> ShakerRows:
    """Rows of the sticker's middle in turned frames; ``near`` is the row of the beam's near edge."""
    assert scene.marker_columns is not None and scene.template is not None
    columns = scene.marker_columns
    half = int(np.clip(scene.marker_thickness // 2, 2, HALF))
    top = _locate_marker(scene, frames[:, :, columns].mean(-1, dtype=np.float64), near)
    rows = np.repeat(top[:, None], columns.size, axis=1)
    fits, edges, inside = [], [], np.ones(rows.shape, dtype=bool)
    saturated: Floats = np.zeros(frames.shape[0])
    for shift, sign in ((0.0, scene.marker_sign), (scene.marker_thickness, -scene.marker_sign)):
        windows, within = gather(frames, rows + shift, columns, half)
        fit = fit_edges(windows, scene.edge_width, sign=sign)
        fits.append(fit)
        edges.append(np.rint(rows + shift) + fit.position)
        inside &= within
        hot = (windows >= scene.saturated) & within[..., None]
        saturated = np.maximum(saturated, hot.mean((1, 2)))
    strength = np.stack([fit.contrast for fit in fits])
    good = inside & np.isfinite(edges[0]) & np.isfinite(edges[1])
    good &= (strength > 0.4 * scene.marker_contrast).all(0) & (strength < 1.8 * scene.marker_contrast).all(0)
    good &= np.abs(edges[1] - edges[0] - scene.marker_thickness) < 3.0
    middle = 0.5 * (edges[0] + edges[1])
    row, error, _, kept = fit_line(columns - scene.contact_column, middle, good, 1.5)
    share = kept.mean(1)
    row = np.where((share >= 0.5) & (saturated <= HOT), row, np.nan)
    width = masked_median(0.5 * (fits[0].width + fits[1].width), kept)
    merged = np.zeros(row.shape, dtype=bool)
    contrast = masked_median(strength.mean(0), kept) / scene.marker_contrast
    return ShakerRows(row, error, share, contrast, width, merged, saturated)


def _locate_marker(scene: Scene, profiles: Floats, near: Floats) -> Floats:
    """Row of the sticker's upper edge to about a pixel, by correlation with its learned profile."""
    assert scene.template is not None
    template = scene.template - scene.template.mean()
    template = template / np.sqrt((template * template).sum())
    if profiles.shape[1] <= template.size:
        return np.full(profiles.shape[0], np.nan)
    views = np.lib.stride_tricks.sliding_window_view(profiles, template.size, axis=1)
    cross = views @ template
    power = np.maximum((views * views).sum(-1) - views.sum(-1) ** 2 / template.size, 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        score = np.where(power > (0.1 * scene.contrast) ** 2, cross / np.sqrt(power), -1.0)
    rows = np.arange(score.shape[1]) + scene.template_head
    if np.isfinite(scene.tip_offset):  # the tip cannot stand inside the beam
        first = near - SOLID - scene.tip_offset - scene.marker_thickness / 2.0
    else:  # nor can the sticker be the gap between beam and tip
        first = near + 3.0
    allowed = rows[None, :] >= np.where(np.isfinite(first), first, -np.inf)[:, None]
    score = np.where(allowed, score, -1.0)
    best = score.argmax(1)
    return np.where(score[np.arange(score.shape[0]), best] > 0.7, rows[best], np.nan)
