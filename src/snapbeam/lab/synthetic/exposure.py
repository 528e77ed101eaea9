"""The picture of a few edges, summed over an exposure: compiled loops for the synthetic camera."""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

from snapbeam.engines.scalar.kept_code import keep_code
from snapbeam.lab.tracking.edges import edge_profile

__all__ = ["FINE", "expose", "step_table"]

FINE = 256  # table entries per pixel


def step_table(blur: float) -> NDArray[np.float64]:
    """Change of an edge's light from one row to the next, tabulated over the row's offset from the edge.

    The first and last offsets are -reach and +reach with reach = (entries - 1)/(2 FINE).
    """
    reach = int(np.ceil(5.0 * blur)) + 2
    offsets = np.arange(-reach * FINE, reach * FINE + 1) / FINE
    return edge_profile(offsets, blur) - edge_profile(offsets - 1.0, blur)


@numba.njit
def _add_edge(
    steps: NDArray, column: int, row: float, height: float, table: NDArray
) -> None:  # pragma: no cover
    reach = (table.size - 1) // (2 * FINE)
    first = int(np.floor(row)) - reach + 1
    for r in range(first, first + 2 * reach):
        if r >= steps.shape[0]:
            break
        at = (r - row + reach) * FINE
        i = int(at)
        if 0 <= i < table.size - 1:
            share = at - i
            value = height * (table[i] * (1.0 - share) + table[i + 1] * share)
            steps[max(r, 0), column] += value


@numba.njit
def _expose(
    steps: NDArray,
    beam: NDArray,
    tip: NDArray,
    slope: NDArray,
    thickness: float,
    profile: NDArray,
    cover: NDArray,
    marker: tuple[float, float],
    contrast: tuple[float, float, float],
    table: NDArray,
) -> None:  # pragma: no cover
    """Add the edges of all instants of one exposure to *steps* (rows, columns), the change of light by row.

    ``beam`` and ``tip`` are rows of the beam's far edge and of the tip at the contact at each instant;
    ``slope`` the beam's drop at each column, ``profile`` the tip's, ``cover`` how much of a column the
    shaker covers; ``marker`` where a sticker begins and ends behind the tip, ``contrast`` the steps of
    light at the beam's, the shaker's and the sticker's edges.
    """
    weight = 1.0 / beam.size
    marker_from, marker_to = marker
    beam_step, shaker_step, marker_step = contrast
    for n in range(beam.size):
        for x in range(steps.shape[1]):
            far = beam[n] + slope[x]
            near = far + thickness
            _add_edge(steps, x, far, weight * beam_step, table)
            _add_edge(steps, x, near, -weight * beam_step, table)
            if cover[x] > 0.0:
                edge = max(tip[n] + profile[x], near)
                _add_edge(steps, x, edge, weight * cover[x] * shaker_step, table)
                if marker_step != 0.0:
                    _add_edge(steps, x, tip[n] + marker_from, weight * cover[x] * marker_step, table)
                    _add_edge(steps, x, tip[n] + marker_to, -weight * cover[x] * marker_step, table)


expose = keep_code(_expose, numba.__version__)
