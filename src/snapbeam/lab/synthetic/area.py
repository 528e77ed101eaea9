"""The scene drawn as areas seen through a lens out of focus: an edge model that is not the tracker's.

Every shape covers an exact share of each cell of a grid four times finer than the pixels, averaged over the
exposure; the cells are spread over the lens's disk of confusion and summed into pixels.  Nothing here knows
of error functions, so a tracker that fits them is not tested against itself.
"""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from snapbeam.lab.synthetic.picture import Outline
from snapbeam.lab.synthetic.setup import SyntheticCamera, SyntheticStage
from snapbeam.lab.tracking.edges import Floats

__all__ = ["AreaPicture", "disk_kernel"]

FINE = 4  # cells to a pixel, each way


@numba.njit(cache=True)
def _add(cover: NDArray, column: int, row: float, weight: float) -> None:  # pragma: no cover
    """Add to the change of coverage by cell: everything below *row* (cells, 0 at the upper border)."""
    if row <= 0.0:
        cover[0, column] += weight
        return
    k = int(np.floor(row))
    if k >= cover.shape[0]:
        return
    share = k + 1.0 - row
    cover[k, column] += weight * share
    if k + 1 < cover.shape[0]:
        cover[k + 1, column] += weight * (1.0 - share)


@numba.njit(cache=True)
def _cover(
    light: NDArray,
    shaker: NDArray,
    beam: NDArray,
    tip: NDArray,
    slope: NDArray,
    profile: NDArray,
    rod: NDArray,
    sizes: NDArray,
    levels: NDArray,
) -> None:  # pragma: no cover
    """Add the light of the beam at all instants, as changes by cell, to *light*, that of the rest to *shaker*.

    ``sizes`` are the beam's thickness and the sticker's upper and lower border from the tip, ``levels`` the
    steps of light at beam, shaker and sticker; ``rod`` the share of a column that the shaker covers.
    """
    weight = 1.0 / beam.size
    for n in range(beam.size):
        for x in range(light.shape[1]):
            far = beam[n] + slope[x]
            near = far + sizes[0]
            _add(light, x, far, weight * levels[0])
            _add(light, x, near, -weight * levels[0])
            if rod[x] > 0.0:
                part = weight * rod[x]
                _add(shaker, x, max(tip[n] + profile[x], near), part * levels[1])
                if levels[2] != 0.0:
                    _add(shaker, x, max(tip[n] + sizes[1], near), part * levels[2])
                    _add(shaker, x, max(tip[n] + sizes[2], near), -part * levels[2])


def disk_kernel(radius: float) -> NDArray[np.float32]:
    """A disk of *radius* cells, each cell weighted by the part of it inside, of sum 1."""
    reach = int(np.ceil(radius + 0.5))
    fine = (np.arange((2 * reach + 1) * 8) + 0.5) / 8.0 - reach - 0.5
    inside = (fine[:, None] ** 2 + fine[None, :] ** 2 <= radius * radius).astype(np.float64)
    kernel = inside.reshape(2 * reach + 1, 8, 2 * reach + 1, 8).sum((1, 3))
    if not kernel.sum() > 0.0:
        kernel[reach, reach] = 1.0
    out: NDArray[np.float32] = (kernel / kernel.sum()).astype(np.float32)
    return out


class AreaPicture:
    """Draws the turned scene, shaker below, area by area through a lens out of focus.

    The disk of confusion has a standard deviation of the camera's ``blur`` along each axis, so its radius is
    twice that.
    """

    def __init__(
        self, camera: SyntheticCamera, stage: SyntheticStage, texture: float = 0.0, seed: int = 0
    ) -> None:
        self.outline = shape = Outline(camera, stage)
        self.margin = int(np.ceil(2.0 * camera.blur)) + 1
        cells = (shape.width + 2 * self.margin) * FINE
        x = (np.arange(cells) + 0.5) / FINE - 0.5 - self.margin - shape.centre
        self.slope = FINE * stage.slope * x
        self.profile = FINE * shape.profile(x)
        self.rod = np.clip((shape.half - np.abs(x)) * FINE + 0.5, 0.0, 1.0)
        self.kernels = {False: disk_kernel(2.0 * FINE * camera.blur)}
        self.kernels[True] = disk_kernel(2.0 * FINE * (camera.blur + 4.0))
        self.grain: NDArray[np.float32] | None = None
        if texture:
            import cv2

            rows = (shape.height + 2 * self.margin) * FINE
            raw = np.random.default_rng([seed, 7]).standard_normal((2 * rows, cells)).astype(np.float32)
            self.grain = 1.0 + 3.0 * FINE * texture * cv2.blur(raw, (3 * FINE, 3 * FINE))

    def draw(self, beam: Floats, tip: Floats, *, blurred: bool) -> NDArray[np.float32]:
        """Light of one exposure without noise; rows of beam and tip as for :func:`render_recording`."""
        import cv2

        shape, margin = self.outline, self.margin
        stage = shape.stage
        rows = (shape.height + 2 * margin) * FINE
        light, rod = np.zeros((rows, self.slope.size)), np.zeros((rows, self.slope.size))
        # row r of a pixel's centre is the cell border (r + 1/2 + margin) FINE
        far = (beam - 0.5 * shape.thickness + 0.5 + margin) * FINE
        top = (tip + 0.5 * shape.thickness + 0.5 + margin) * FINE
        sizes = np.array([shape.thickness, *shape.marker]) * FINE
        marker = stage.marker - stage.shaker if stage.marker_thickness > 0.0 else 0.0
        levels = np.array([stage.beam - stage.background, stage.shaker - stage.background, marker])
        _cover(light, rod, far, top, self.slope, self.profile, self.rod, sizes, levels)
        layers = [np.cumsum(layer, axis=0).astype(np.float32) for layer in (light, rod)]
        if self.grain is not None:  # which moves with what it is on
            for layer, rows_of in zip(layers, (far, top), strict=True):
                shift = round(float(rows_of.mean())) % rows
                layer *= self.grain[rows - shift : 2 * rows - shift]
        fine: NDArray[Any] = np.float32(stage.background) + layers[0] + layers[1]
        fine = cv2.filter2D(fine, -1, self.kernels[blurred], borderType=cv2.BORDER_REPLICATE)
        inner = fine[margin * FINE : (margin + shape.height) * FINE, margin * FINE : -margin * FINE]
        cells = np.asarray(inner, dtype=np.float32).reshape(shape.height, FINE, shape.width, FINE)
        pixels: NDArray[np.float32] = cells.mean((1, 3), dtype=np.float32)
        return pixels
