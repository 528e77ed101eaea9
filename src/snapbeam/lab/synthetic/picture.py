"""The scene drawn as ideal edges blurred by a Gaussian: the edge model that the tracker fits."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from snapbeam.lab.synthetic.exposure import expose, step_table
from snapbeam.lab.synthetic.setup import SyntheticCamera, SyntheticStage
from snapbeam.lab.tracking.edges import Floats, edge_profile

__all__ = ["GaussianPicture", "Outline", "glare_light", "lamp_light"]


class Outline:
    """The scene's shapes in turned pixels, columns counted from the contact at ``centre``."""

    def __init__(self, camera: SyntheticCamera, stage: SyntheticStage) -> None:
        upright = stage.side in ("below", "above")
        self.height, self.width = camera.shape if upright else camera.shape[::-1]
        size = camera.pixel_size
        self.stage = stage
        self.thickness = stage.beam_thickness / size
        self.centre = (self.width - 1) / 2.0
        self.radius, self.half = stage.tip_radius / size, 0.5 * stage.shaker_width / size
        self.marker = (stage.marker_distance / size, (stage.marker_distance + stage.marker_thickness) / size)

    def profile(self, x: Floats) -> Floats:
        """Rows of the tip's outline below its apex at columns *x* from the contact."""
        reach = np.minimum(np.abs(x), self.radius)
        return self.radius - np.sqrt(self.radius * self.radius - reach * reach)


def lamp_light(camera: SyntheticCamera, height: int, width: int) -> NDArray[np.float32]:
    """The lamp's unevenness over a turned picture."""
    across = 1.0 + camera.light[0] * ((np.arange(width) - (width - 1) / 2.0) / width)
    down = 1.0 + camera.light[1] * (np.arange(height) / height - 0.5)
    light: NDArray[np.float32] = (down[:, None] * across[None, :]).astype(np.float32)
    return light


def glare_light(height: int, width: int, row: float, strength: float, wide: bool) -> NDArray[np.float32]:
    """A reflection about *row*, in the middle columns or, if *wide*, in all."""
    rows = (np.arange(height) - row) / (0.12 * height)
    columns = np.zeros(width) if wide else (np.arange(width) - (width - 1) / 2.0) / (0.3 * width)
    light: NDArray[np.float32] = (strength * np.exp(-(rows[:, None] ** 2) - columns[None, :] ** 2)).astype(
        np.float32
    )
    return light


class GaussianPicture:
    """Draws the turned scene, shaker below, with edges blurred by a Gaussian."""

    def __init__(self, camera: SyntheticCamera, stage: SyntheticStage) -> None:
        self.outline = Outline(camera, stage)
        x = np.arange(self.outline.width) - self.outline.centre
        self.slope = stage.slope * x
        self.profile = self.outline.profile(x)
        half = self.outline.half
        self.cover = edge_profile(x + half, camera.blur) - edge_profile(x - half, camera.blur)
        self.cover[self.cover < 1e-6] = 0.0
        self.tables = {False: step_table(camera.blur), True: step_table(camera.blur + 4.0)}

    def draw(self, beam: Floats, tip: Floats, *, blurred: bool) -> NDArray[np.float32]:
        """Light of one exposure without noise; ``beam`` and ``tip`` as for :func:`render_recording`."""
        shape = self.outline
        stage, thickness = shape.stage, shape.thickness
        steps = np.zeros((shape.height, shape.width))
        steps[0] = stage.background
        sticker = stage.marker - stage.shaker if stage.marker_thickness > 0.0 else 0.0
        expose(
            steps,
            beam - 0.5 * thickness,
            tip + 0.5 * thickness,
            self.slope,
            thickness,
            self.profile,
            self.cover,
            shape.marker,
            (stage.beam - stage.background, stage.shaker - stage.background, sticker),
            self.tables[blurred],
        )
        light: NDArray[np.float32] = np.cumsum(steps, axis=0).astype(np.float32)
        return light
