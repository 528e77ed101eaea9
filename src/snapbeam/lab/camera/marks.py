"""Marks that stand still: how the camera drifts against them, and the scale of the picture from two of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.validate import InputError, instance, positive

if TYPE_CHECKING:
    from snapbeam.lab.camera.recording import Recording

__all__ = ["pixel_size_from_marks", "profile_shift"]

_Array = NDArray[np.float64]
_FARTHEST = 30  # rows
_SMOOTH = 1.2  # rows
_RASTER = 0.005  # px, error of a curve drawn between pixels of another phase


def profile_shift(profiles: _Array, reference: _Array) -> tuple[_Array, _Array]:
    """Rows by which each profile lies below the reference, and their standard errors.

    The shift, a gain and an offset are fitted by least squares, from the shift of whole rows with the best
    correlation on.

    Parameters
    ----------
    profiles
        Grey levels over rows, shape (n, rows).
    reference
        The same where nothing has moved, shape (rows,).

    Raises
    ------
    InputError
        If the reference is too short or too even to show a shift.
    """
    from scipy.interpolate import CubicSpline
    from scipy.ndimage import gaussian_filter1d

    rows = reference.size
    reach = min(_FARTHEST, (rows - 8) // 3)
    if reach < 1:
        raise InputError(f"fixed mark (--fixed-mark) of {rows} rows: must be at least 11 along the motion")
    if np.ptp(reference) <= 0.0:
        raise InputError(
            "fixed mark (--fixed-mark): shows nothing that could be followed; choose another part"
        )
    # finer than two pixels the raster shows other things in each frame
    profiles = gaussian_filter1d(np.asarray(profiles, dtype=np.float64), _SMOOTH, axis=1)
    reference = gaussian_filter1d(np.asarray(reference, dtype=np.float64), _SMOOTH)
    inner = np.arange(reach, rows - reach, dtype=np.float64)
    part = profiles[:, reach : rows - reach]
    part = part - part.mean(1, keepdims=True)
    score = []
    for shift in range(-reach, reach + 1):
        there = reference[reach - shift : rows - reach - shift]
        there = there - there.mean()
        norm = np.sqrt((there @ there) * (part * part).sum(1)) + 1e-30
        score.append(part @ there / norm)
    found = np.argmax(score, axis=0).astype(np.float64) - reach
    spline = CubicSpline(np.arange(rows, dtype=np.float64), reference)
    slope = spline.derivative()
    full = profiles[:, reach : rows - reach].astype(np.float64)
    for _ in range(6):
        at = inner[None, :] - found[:, None]
        model, grade = spline(at), -slope(at)
        design = np.stack([np.ones_like(model), model, grade], axis=-1)
        gram = np.einsum("nri,nrj->nij", design, design)
        gram += 1e-12 * np.trace(gram, axis1=1, axis2=2)[:, None, None] * np.eye(3)
        solution = np.linalg.solve(gram, np.einsum("nri,nr->ni", design, full)[..., None])[..., 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            step = np.where(solution[:, 1] > 0.0, solution[:, 2] / solution[:, 1], 0.0)
        found = found + np.clip(np.nan_to_num(step), -0.7, 0.7)
    rest = full - np.einsum("nri,ni->nr", design, solution)
    variance = (rest**2).sum(1) / max(inner.size - 3, 1) * 2.0 * np.sqrt(np.pi) * _SMOOTH
    smooth = gaussian_filter1d(design, _SMOOTH, axis=1)
    inverse = np.linalg.inv(gram)
    spread = np.einsum("ni,nri->nr", inverse[:, 2], smooth)
    with np.errstate(divide="ignore", invalid="ignore"):
        error = np.sqrt(variance * (spread**2).sum(1)) / np.abs(solution[:, 1])
    return found, np.hypot(error, _RASTER)


def pixel_size_from_marks(
    recording: Recording,
    first: tuple[float, float],
    second: tuple[float, float],
    distance: float,
    *,
    frame: int = 0,
    reach: int = 6,
) -> tuple[float, float]:
    """Metres per pixel from two small marks a known distance apart, and the standard error.

    Parameters
    ----------
    recording
        An open recording.
    first, second
        (row, column) of the two marks in the region, to about *reach* pixels.
    distance
        Between them [m].
    frame
        Frame to look in.
    reach
        Half the side [px] of the square in which the centre of each mark is sought.

    Raises
    ------
    InputError
        If a mark does not stand out, or the two are the same.
    """
    length = positive("distance", distance, "m")
    from snapbeam.lab.camera.recording import Recording

    instance("recording", recording, Recording, "a Recording")
    picture = recording.frame(frame).astype(np.float64)
    centres = [_centre(picture, where, reach, name) for name, where in (("first", first), ("second", second))]
    apart = float(np.hypot(*(centres[1] - centres[0])))
    if apart < 4.0 * reach:
        raise InputError(
            f"marks {first} and {second}: {apart:.1f} pixels apart: must be at least {4 * reach}"
        )
    # a centre of mass within a pixel's raster is good to some hundredths of a pixel
    return length / apart, length / apart**2 * 0.05 * np.sqrt(2.0)


def _centre(picture: _Array, where: tuple[float, float], reach: int, name: str) -> _Array:
    """Centre of mass of what stands out of its surroundings about *where*, sought twice."""
    at = np.array(where, dtype=np.float64)
    for _ in range(3):
        r, c = (round(float(value)) for value in at)
        if not (reach <= r < picture.shape[0] - reach and reach <= c < picture.shape[1] - reach):
            raise InputError(f"{name} mark at {where}: must lie {reach} pixels inside the region")
        patch = picture[r - reach : r + reach + 1, c - reach : c + reach + 1]
        border = np.concatenate([patch[0], patch[-1], patch[1:-1, 0], patch[1:-1, -1]])
        level, spread = float(np.median(border)), float(np.std(border))
        weight = np.abs(patch - level)
        weight[weight < max(0.3 * weight.max(), 4.0 * spread)] = 0.0
        if not weight.sum() > 0.0:
            raise InputError(f"{name} mark at {where}: nothing stands out of its surroundings there")
        grid = np.arange(-reach, reach + 1)
        at = np.array([r + (weight.sum(1) @ grid) / weight.sum(), c + (weight.sum(0) @ grid) / weight.sum()])
    return at
