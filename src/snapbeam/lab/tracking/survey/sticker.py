"""Looking for a sticker on the shaker: a band between two steps of opposite sign."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from snapbeam.lab.tracking.geometry import HALF, spread_columns
from snapbeam.lab.tracking.scene import Sticker

__all__ = ["find_sticker", "rod_middle"]

SEEN = 0.3  # share of the sample in which a sticker must be seen


def rod_middle(rod: tuple[int, int], share: float = 0.5) -> NDArray[np.intp]:
    """The middle *share* of the columns that the shaker covers, at least five."""
    centre, half = (rod[0] + rod[1] - 1) / 2.0, max(2.0, share * (rod[1] - rod[0]) / 2.0)
    return np.arange(int(np.ceil(centre - half)), int(np.floor(centre + half)) + 1)


def find_sticker(
    smooth: NDArray[np.floating],
    columns: NDArray[np.intp],
    begin: NDArray[np.intp],
    contrast: float,
    sign: float = 0.0,
) -> Sticker | None:
    """Look for a band in the middle columns of the shaker; None if there is none.

    Parameters
    ----------
    smooth
        Smoothed frames of the sample (n, height, width).
    columns
        Columns in the middle of the shaker.
    begin
        Row of each frame from which to look, -1 for frames to leave out.
    contrast
        Of the beam.
    sign
        Sign of the band's upper step, where it is known.
    """
    profiles = smooth[:, :, columns].mean(-1)
    steps = np.zeros_like(profiles)
    steps[:, 2:-2] = profiles[:, 4:] - profiles[:, :-4]
    found: list[tuple[int, int, int, float]] = []
    for k in np.flatnonzero(begin >= 0):
        peaks = _peaks(steps[k], int(begin[k]), 0.3 * contrast)
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
    cut = [
        profiles[k, top - margin : top + round(size) + margin + 1]
        for k, top, bottom, _ in same
        if top + round(size) + margin < smooth.shape[1]
    ]
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
