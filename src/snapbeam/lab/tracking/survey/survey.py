"""Diagnostic the beam and the shaker in a sample of frames, before following them."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from snapbeam.core.validate import InputError
from snapbeam.lab.tracking.edges import width_calibration
from snapbeam.lab.tracking.geometry import HALF
from snapbeam.lab.tracking.scene import BeamView, Scene
from snapbeam.lab.tracking.settings import TrackingSettings
from snapbeam.lab.tracking.survey.bands import column_objects, fixed_bars
from snapbeam.lab.tracking.survey.beam import beam_view, find_bands, placed
from snapbeam.lab.tracking.survey.levels import otsu, pixel_noise
from snapbeam.lab.tracking.survey.noise import noise_shape
from snapbeam.lab.tracking.survey.shaker import Wanted, find_rod, shaker_view

__all__ = ["survey"]


def survey(
    frames: NDArray[np.floating],
    settings: TrackingSettings,
    *,
    saturated: float,
    pixel_size: float,
    head: int,
) -> Scene:
    """Find everything in a sample of frames.

    Parameters
    ----------
    frames
        Turned frames (n, height, width), the first *head* of them neighbours.
    settings
        What is known of the recording.
    saturated
        Grey level of saturated pixels, infinite if there are none.
    pixel_size
        Metres per pixel.

    Raises
    ------
    InputError
        If no beam, or no shaker where one is wanted, can be found.
    """
    height, width = frames.shape[1:]
    smooth = ndimage.uniform_filter(frames, size=(0, 3, 3))
    level = otsu(smooth) if settings.threshold is None else settings.threshold
    far = float(np.median(smooth[:, :3]))
    bright = far < level if settings.objects == "auto" else settings.objects == "bright"
    mask = smooth > level if bright else smooth < level
    fixtures = fixed_bars(mask)
    for first, last in fixtures:
        mask[:, max(first - 1, 0) : last + 1] = False
    bands = find_bands(column_objects(mask), height, level, bright)
    rod = find_rod(bands)
    if settings.shaker and rod is None:
        raise InputError(
            "recording: no shaker is seen beyond the beam; set region (--region), side (--side), objects "
            "(--objects) or threshold (--threshold), or track the beam alone with shaker=False (--no-shaker)"
        )
    centre, columns, groups, merged = placed(width, rod, settings.columns, settings.contact_column)
    rough = BeamView(
        threshold=level,
        bright=bright,
        contrast=math.nan,
        noise=pixel_noise(frames),
        saturated=saturated,
        hot_share=0.0,
        edge_width=1.0,
        width_table=width_calibration(1.0, 2 * HALF + 1),
        thickness=bands.thickness,
        thickness_error=0.5,
        columns=columns,
        contact_column=centre,
        groups=groups,
        merged=merged,
        fixtures=tuple((max(first - 1, 0), last + 1) for first, last in fixtures),
    )
    view, shape = beam_view(frames, smooth, bands, rough)
    noise = noise_shape(frames[:head])
    if not settings.shaker or rod is None:
        return Scene(view, None, shape, noise, rod is not None)
    distance = None if settings.tip_distance is None else settings.tip_distance / pixel_size
    wanted = Wanted(settings.marker, distance, settings.contact_column is not None, head)
    shaker, column = shaker_view(view, frames, smooth, bands, rod, wanted)
    centre, columns, groups, merged = placed(width, rod, settings.columns, column)
    view = dataclasses.replace(view, contact_column=centre, columns=columns, groups=groups, merged=merged)
    return Scene(view, shaker, shape, noise, False)
