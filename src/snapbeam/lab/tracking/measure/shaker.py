"""The shaker in every frame: by its sticker, or without one by its tip."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from snapbeam.lab.tracking.edges import Floats
from snapbeam.lab.tracking.measure.sticker import ShakerRows, sticker_rows
from snapbeam.lab.tracking.measure.tip import tip_rows
from snapbeam.lab.tracking.scene import BeamView, ShakerView

__all__ = ["measure_shaker"]


def measure_shaker(
    view: BeamView, shaker: ShakerView, frames: NDArray[np.floating], near: Floats, slope: Floats
) -> ShakerRows:
    """Row of the shaker's reference in a batch of turned frames.

    ``near`` is the row of the beam's near edge at the contact column and ``slope`` the beam's slope.
    """
    if shaker.sticker is not None:
        return sticker_rows(view, shaker.sticker, frames, near, shaker.tip_offset)
    return tip_rows(view, shaker.outline, frames, near, slope)
