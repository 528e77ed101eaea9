"""The tip of the shaker: its outline, learned where it stands clear of the beam, and its apex."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.lab.tracking.edges import Floats, masked_median
from snapbeam.lab.tracking.geometry import gather
from snapbeam.lab.tracking.scene import TipOutline

__all__ = ["Apex", "beam_light", "find_apex", "tip_outline"]

_OFF_CENTRE = 0.05  # share of the shaker's width by which its tip may be off its middle, standard deviation


def beam_light(
    frames: NDArray[np.floating], columns: NDArray[np.intp], near: Floats, thickness: float
) -> Floats:
    """Contrast of the beam in each column: its middle less the background beyond it, median over frames."""
    middle, inside = gather(frames, near - 0.5 * thickness, columns, 1)
    beyond, seen = gather(frames, near - thickness - 5.0, columns, 1)
    return masked_median((middle.mean(-1) - beyond.mean(-1)).T, (inside & seen).T)


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


class Apex(NamedTuple):
    """Where the tip comes nearest to the beam: its row, the row's standard error, its column from the contact's."""

    row: float
    error: float
    column: float


def find_apex(outline: TipOutline, rod: tuple[int, int], contact_column: float) -> Apex | None:
    """The apex of an outline; None if it is not known on both sides of the contact.

    The outline is taken as symmetric, y = a + b (x - c)^2 + d (x - c)^4, about a column c near the middle of
    the shaker: a flat tip alone would not tell it.  Columns nearer than three pixels to each other count as
    one, for the surface is uneven on that scale.
    """
    x, y = outline.columns - contact_column, outline.profile
    size = float(rod[1] - rod[0])
    inner = np.abs(x) <= 0.4 * size
    if inner.sum() < 5 or x[inner].min() > -0.1 * size or x[inner].max() < 0.1 * size:
        return None
    half = float(np.abs(x[inner]).max())
    covered = inner.sum() >= 12 and np.diff(np.sort(x[inner])).max() < 0.2 * size
    u, v = x[inner] / half, y[inner]
    middle = (0.5 * (rod[0] + rod[1] - 1) - contact_column) / half
    powers = (0, 2, 4) if covered else (0, 2)
    independent = max(2.0 * half / 3.0, len(powers) + 2.0)

    def fitted(centre: float) -> tuple[Floats, float]:
        design = np.stack([(u - centre) ** power for power in powers], axis=1)
        solution = np.linalg.lstsq(design, v, rcond=None)[0]
        return solution, float(np.mean((v - design @ solution) ** 2))

    spread = max(fitted(middle)[1], 1e-4)
    grid = middle + np.linspace(-0.5, 0.5, 201)
    cost = [
        independent * fitted(c)[1] / spread + ((c - middle) * half / (_OFF_CENTRE * size)) ** 2 for c in grid
    ]
    centre = float(grid[int(np.argmin(cost))])
    solution, variance = fitted(centre)
    rounded = float(np.polynomial.polynomial.polyval(0.9, _full(solution, powers))) - float(solution[0]) > 0.3
    error = math.sqrt(max(variance, 1e-5) * 2.0 / independent)
    return Apex(float(solution[0]), error, centre * half) if rounded or covered else None


def _full(solution: Floats, powers: tuple[int, ...]) -> Floats:
    out = np.zeros(5)
    out[list(powers)] = solution
    return out
