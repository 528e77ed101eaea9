"""Whether the noise of pixels is a camera's own: new in every frame, and each pixel's for itself."""

from __future__ import annotations

import itertools
import math

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from snapbeam.lab.tracking.edges import Floats
from snapbeam.lab.tracking.scene import NoiseShape

__all__ = ["noise_shape"]

_APART = 4  # frames after which no noise is left of one in the other
_LEAST = 1500  # even pixels
_ROUNDED = 0.6  # grey levels; less noise than this is rounded away
_EVEN = 6.0  # standard deviations by which even pixels may differ from their neighbours
_CERTAIN = 0.2  # correlation that is no chance, and more than a sensor's own


def noise_shape(head: NDArray[np.floating]) -> NoiseShape:
    """Correlation of the noise with that of the next frame, and of the next pixel along the beam and across it.

    The difference of two frames holds the noise of both and no scene.  Neighbours in time differ by
    2 sigma^2 (1 - r), frames further apart by 2 sigma^2, r the correlation.  Only pixels count about which the
    picture is even, so that what moves does not; changes of the light are fitted and taken out.

    Parameters
    ----------
    head
        Turned frames that follow each other, (n, height, width).
    """
    none = NoiseShape(0.0, 0.0, 0.0)
    if head.shape[0] < _APART + 3:
        return none
    mean = head.mean(0)
    around = ndimage.maximum_filter(mean, 5) - ndimage.minimum_filter(mean, 5)
    apart = [_noise_of(head[k + _APART], head[k], mean) for k in range(head.shape[0] - _APART)]
    noise = max(float(np.median(np.abs(apart))) / 0.6745 / math.sqrt(2.0), _ROUNDED)
    even = around < _EVEN * noise
    even &= np.max(np.abs(apart), axis=0) < 6.0 * noise
    even &= np.ptp(head, axis=0) > 0.0
    if np.count_nonzero(even) < _LEAST:
        return none
    far = float(np.median([np.var(one[even]) for one in apart]))
    if far < 2.0 * _ROUNDED**2:
        return none
    near = [_noise_of(after, before, mean) for before, after in itertools.pairwise(head)]
    in_time = 1.0 - float(np.median([np.var(one[even]) for one in near])) / far
    along, across = (_alike(apart, even, axis) / far for axis in (1, 0))
    return NoiseShape(*(min(value, 0.9) if value > _CERTAIN else 0.0 for value in (in_time, along, across)))


def _alike(apart: list[Floats], even: NDArray[np.bool_], axis: int) -> float:
    """Mean product of neighbouring pixels, both of them even, along an axis."""
    here, there = slice(1, None), slice(None, -1)
    first, second = ((slice(None), one) if axis else (one, slice(None)) for one in (here, there))
    both = even[first] & even[second]
    return float(np.median([np.mean(one[first][both] * one[second][both]) for one in apart]))


def _noise_of(after: NDArray[np.floating], before: NDArray[np.floating], mean: Floats) -> Floats:
    """The difference of two frames without a change of light between them."""
    step: Floats = (after - before).astype(np.float64)
    level = mean - mean.mean()
    total = float(np.sum(level * level))
    slope = float(np.sum(step * level)) / total if total > 0.0 else 0.0
    left: Floats = step - np.median(step - slope * level) - slope * level
    return left
