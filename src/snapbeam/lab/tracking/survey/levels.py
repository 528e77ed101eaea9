"""Grey levels of a sample: what parts objects from the background, how noisy pixels are, where they saturate."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.validate import InputError

__all__ = ["otsu", "pixel_noise", "saturation_level"]

PILE = 5.0  # times more pixels at the highest level than just below it that tell saturation
LEAST = 1e-4  # share of the pixels that must be at the highest level


def otsu(frames: NDArray[np.floating]) -> float:
    """Otsu's threshold of all pixels together, in their own grey levels."""
    try:
        import cv2
    except ImportError as error:
        raise InputError(
            "threshold = None: diagnostic one needs OpenCV (pip install 'snapbeam[lab]'); or give threshold "
            "(--threshold)"
        ) from error
    low, high = (float(level) for level in np.percentile(frames[:, ::2, ::2], (0.05, 99.95)))
    if not high > low:
        raise InputError(f"recording: all pixels are {low:g}, so there is no object to find")
    scaled = np.clip((frames - low) * (65535.0 / (high - low)), 0.0, 65535.0).astype(np.uint16)
    level, _ = cv2.threshold(scaled.reshape(-1, 1), 0, 65535, cv2.THRESH_BINARY + cv2.THRESH_OTSU)
    return low + float(level) * (high - low) / 65535.0


def pixel_noise(frames: NDArray[np.floating]) -> float:
    """Standard deviation of the pixel noise, from differences along the beam.

    Never less than that of rounding to whole grey levels, 1/sqrt(12).
    """
    few = frames[:: max(1, frames.shape[0] // 8)]
    second = few[:, :, 2:] - 2.0 * few[:, :, 1:-1] + few[:, :, :-2]
    return max(float(np.median(np.abs(second)) / 0.6745 / np.sqrt(6.0)), 1.0 / math.sqrt(12.0))


def saturation_level(frames: NDArray[np.integer], max_value: float, noise: float) -> float:
    """Grey level at which pixels are saturated, by what is seen as well as by what the file says.

    A file of 16 bits may hold an image of 12, and its brightest pixels then pile up at 4095 though the file
    could hold 65535.  The largest level of the file if none piles up.

    Parameters
    ----------
    frames
        Grey levels as recorded.
    max_value
        The largest level that the file can hold.
    noise
        Standard deviation of a pixel.
    """
    top = float(frames.max())
    here = np.count_nonzero(frames == top)
    if here < LEAST * frames.size or here < 16:
        return float(max_value)
    if top >= max_value or _whole_bits(int(top)):
        return top
    reach = max(3.0 * noise, 3.0)
    below = np.count_nonzero((frames >= top - reach) & (frames < top)) / reach
    return top if noise > 0.5 and here > PILE * below else float(max_value)


def _whole_bits(level: int) -> bool:
    """Whether a level is the largest of 10, 12 or 14 bits, at either end of 16."""
    return any(level in (2**bits - 1, (2**bits - 1) << (16 - bits)) for bits in (10, 12, 14))
