"""From light to grey levels: a fixed bar in view, exposure, the camera's curve, noise and bits."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from snapbeam.lab.synthetic.defects import Defects, Fixture
from snapbeam.lab.synthetic.setup import SyntheticCamera, SyntheticStage

__all__ = ["read_out", "with_fixture"]

_FINE = 8  # rows of light drawn for a row of pixels


def with_fixture(
    light: NDArray[np.float32], fixture: Fixture, shift: float, blur: float
) -> NDArray[np.float32]:
    """Lay a bar behind which nothing shows over a picture; *shift* [px] moves it with the camera.

    Its edges are ramps as wide as a disk of confusion of standard deviation *blur* [px].
    """
    within_pixel = (np.arange(_FINE) + 0.5) / _FINE - 0.5
    rows = np.arange(light.shape[0])[:, None] + within_pixel
    ramp = max(1.0, 2.0 * math.sqrt(3.0) * blur)
    inside = 0.5 * fixture.thickness - np.abs(rows - fixture.row - shift)
    cover = np.clip(0.5 + inside / ramp, 0.0, 1.0).mean(1).astype(np.float32)[:, None]
    out: NDArray[np.float32] = light * (1.0 - cover) + np.float32(fixture.level) * cover
    return out


def read_out(
    light: NDArray[np.float32],
    camera: SyntheticCamera,
    stage: SyntheticStage,
    defects: Defects,
    rng: np.random.Generator,
) -> NDArray[np.uint16]:
    """Grey levels of a picture of *light* (shares of full scale)."""
    light = light * np.float32(defects.gain)
    if math.isfinite(camera.snr_db):
        noise = abs(stage.beam - stage.background) / 10.0 ** (camera.snr_db / 20.0)
        light = light + np.float32(noise) * rng.standard_normal(light.shape, dtype=np.float32)
    if defects.shot:
        root = np.sqrt(np.clip(light, 0.0, None))
        light = light + np.float32(defects.shot) * root * rng.standard_normal(light.shape, dtype=np.float32)
    level = np.clip(light, 0.0, 1.0)
    if defects.gamma != 1.0:
        level = level ** np.float32(defects.gamma)
    full = 2**camera.bit_depth - 1
    grey: NDArray[np.uint16] = np.rint(level * full).astype(np.uint16)
    return grey
