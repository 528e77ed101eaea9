"""Finding the beam and the shaker in a sample of frames, before following them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from snapbeam.core.validate import InputError
from snapbeam.lab.tracking.edges import fit_edges, width_calibration
from snapbeam.lab.tracking.scene import HALF, Runs, Scene, gather, spread_columns
from snapbeam.lab.tracking.shaker import survey_shaker

__all__ = ["otsu", "survey"]


def otsu(frames: NDArray[np.floating]) -> float:
    """Otsu's threshold of all pixels together, in their own grey levels."""
    try:
        import cv2
    except ImportError as error:
        raise InputError(
            "threshold = None: finding one needs OpenCV (pip install 'snapbeam[lab]')"
        ) from error
    low, high = (float(level) for level in np.percentile(frames[:, ::2, ::2], (0.05, 99.95)))
    if not high > low:
        raise InputError(f"recording: all pixels are {low:g}, so there is no object to find")
    scaled = np.clip((frames - low) * (65535.0 / (high - low)), 0.0, 65535.0).astype(np.uint16)
    level, _ = cv2.threshold(scaled.reshape(-1, 1), 0, 65535, cv2.THRESH_BINARY + cv2.THRESH_OTSU)
    return low + float(level) * (high - low) / 65535.0


def _runs(mask: NDArray[np.bool_]) -> Runs:
    rows = np.arange(mask.shape[1])[None, :, None]
    solid = mask.copy()
    solid[:, :-1] &= mask[:, 1:]
    solid[:, -1] = False
    start, found = solid.argmax(1), solid.any(1)
    filled = mask | (rows < start[:, None])
    end = np.where(filled.all(1), mask.shape[1], filled.argmin(1))
    later = solid & (rows >= end[:, None])
    return Runs(start, end, found & (start > 0), later.argmax(1), later.any(1))


def _longest(columns: NDArray[np.bool_]) -> tuple[int, int]:
    """First and one past the last of the longest stretch of True."""
    steps = np.diff(np.concatenate([[0], columns.astype(np.int8), [0]]))
    starts, stops = np.flatnonzero(steps == 1), np.flatnonzero(steps == -1)
    if not starts.size:
        return 0, 0
    best = int(np.argmax(stops - starts))
    return int(starts[best]), int(stops[best])


def survey(
    frames: NDArray[np.floating],
    *,
    threshold: float | None,
    objects: str,
    shaker: bool,
    marker: bool,
    columns: int,
    contact_column: float | None,
    max_value: float,
    head: int,
) -> Scene:
    """Find everything in a sample of turned frames (n, height, width); see :func:`track`."""
    smooth = ndimage.uniform_filter(frames, size=(0, 3, 3))
    level = otsu(smooth) if threshold is None else threshold
    far = float(np.median(smooth[:, :3]))
    bright = far < level if objects == "auto" else objects == "bright"
    mask = smooth > level if bright else smooth < level
    runs = _runs(mask)
    width, height = frames.shape[2], frames.shape[1]
    length = runs.end - runs.start
    usable = runs.found & (runs.end < height) & (length >= 3)
    if usable.mean() < 0.05:
        raise InputError(
            f"recording: no beam crosses the region at the threshold {level:.6g} for "
            f"{'bright' if bright else 'dark'} objects; set region, objects or threshold"
        )
    thin = float(np.percentile(length[usable], 25))
    alone = usable & (length <= 1.35 * thin + 2.0)
    thickness = float(np.median(length[alone]))
    seen = (usable & (length >= 0.6 * thickness)).mean(0)
    if (seen > 0.4).mean() < 0.6:
        raise InputError(
            f"recording: an object of {thickness:.0f} rows is seen in only "
            f"{100 * (seen > 0.4).mean():.0f} % of the columns; the beam must cross the "
            "region, so set region, objects or threshold"
        )
    merged = runs.found & (length > 1.35 * thickness + 2.0)
    below = merged | (alone & runs.follows)
    rod = None
    if shaker:
        rod = _longest(ndimage.binary_closing(below.mean(0) > 0.7, iterations=2) | (below.mean(0) > 0.7))
        if rod[1] - rod[0] < 5:
            raise InputError(
                "recording: no shaker is seen beyond the beam; set region, side, objects or threshold, or "
                "track the beam alone with shaker=False"
            )
    background, inside = _levels(smooth, runs, alone)
    scene = Scene(
        threshold=level,
        bright=bright,
        contrast=abs(inside - background),
        noise=_noise(frames),
        saturated=max_value,
        edge_width=1.0,
        thickness=thickness,
        beam_columns=np.empty(0, dtype=np.intp),
        contact_column=np.nan,
        groups=[],
        rod=rod,
    )
    _place_columns(scene, width, columns, contact_column)
    _refine_beam(scene, frames, runs, alone)
    if rod is not None:
        survey_shaker(
            scene, frames, smooth, runs, alone, marker=marker, moved=contact_column is None, head=head
        )
        _place_columns(scene, width, columns, scene.contact_column)
    return scene


def _levels(smooth: NDArray[np.floating], runs: Runs, alone: NDArray[np.bool_]) -> tuple[float, float]:
    """Grey levels of the background beyond the beam and of the beam's middle."""
    k, x = np.nonzero(alone & (runs.start >= 4))
    if not k.size:
        raise InputError("recording: the beam touches the edge of the region in every sampled frame")
    middle = (runs.start[k, x] + runs.end[k, x]) // 2
    return float(np.median(smooth[k, runs.start[k, x] - 4, x])), float(np.median(smooth[k, middle, x]))


def _noise(frames: NDArray[np.floating]) -> float:
    """Standard deviation of the pixel noise, from differences along the beam."""
    few = frames[:: max(1, frames.shape[0] // 8)]
    second = few[:, :, 2:] - 2.0 * few[:, :, 1:-1] + few[:, :, :-2]
    return float(np.median(np.abs(second)) / 0.6745 / np.sqrt(6.0))


def _place_columns(scene: Scene, width: int, count: int, contact_column: float | None) -> None:
    """Choose the columns about the contact where the beam is measured and those that see the beam alone."""
    rod = scene.rod
    centre = (rod[0] + rod[1] - 1) / 2.0 if rod is not None else (width - 1) / 2.0
    centre = centre if contact_column is None else contact_column
    scene.contact_column = centre
    half = max(20.0, (rod[1] - rod[0]) / 2.0) if rod is not None else max(20.0, width / 8.0)
    half = min(half, centre - 2.0, width - 3.0 - centre)
    if half < 2.0:
        raise InputError(
            f"contact_column = {centre:g}: must leave at least 4 columns on both sides in the region"
        )
    scene.beam_columns = spread_columns(int(np.ceil(centre - half)), int(np.floor(centre + half)), count)
    if rod is None:
        scene.groups = [scene.beam_columns]
        return
    left = np.arange(max(0, rod[0] - 19), rod[0] - 3)
    right = np.arange(rod[1] + 3, min(width, rod[1] + 19))
    scene.groups = [one for one in (left, right) if one.size >= 4] or [scene.beam_columns]


def _refine_beam(scene: Scene, frames: NDArray[np.floating], runs: Runs, alone: NDArray[np.bool_]) -> None:
    """Edge width, contrast and thickness to a fraction of a pixel, where the beam stands alone."""
    clear = ~runs.follows | (runs.after - runs.end >= 2 * HALF)  # else the tip's light is in the windows
    good = alone & (clear if (alone & clear).mean() > 0.02 else True)
    good[:, good.mean(0) < 0.1] = False
    columns = np.flatnonzero(good.any(0))
    columns = columns[np.unique(np.linspace(0, columns.size - 1, min(columns.size, 48)).astype(int))]
    half = int(np.clip(scene.thickness // 2, 2, HALF))
    few = slice(None, None, max(1, frames.shape[0] // 16))
    far, near = runs.start[:, columns] - 0.5, runs.end[:, columns] - 0.5
    width = 1.0
    for _ in range(4):
        windows, inside = gather(frames[few], far[few], columns, half)
        fit = fit_edges(windows, width, sign=scene.sign)
        usable = inside & good[few][:, columns] & np.isfinite(fit.position)
        if not usable.any():
            raise InputError(
                "recording: the far edge of the beam could not be fitted; set threshold or region"
            )
        found = float(np.median(fit.width[usable]))
        width = float(np.clip(found, 0.3, 4.0)) if np.isfinite(found) else width
    edges = []
    both = good[:, columns].copy()
    for rows, sign in ((near, -scene.sign), (far, scene.sign)):
        windows, inside = gather(frames, rows, columns, half)
        fit = fit_edges(windows, width, sign=sign)
        edges.append(np.rint(rows) + fit.position)
        both &= inside & np.isfinite(fit.position)
    if (windows[good[:, columns]] >= scene.saturated).mean() > 0.1:
        scene.saturated = np.inf  # a picture that is overexposed throughout shows no glare
    scene.edge_width = width
    scene.width_table = width_calibration(width, 2 * half + 1)
    if both.any():
        scene.contrast = float(np.median(fit.contrast[both]))
        scene.thickness = float(np.median((edges[0] - edges[1])[both]))
