"""The synthetic laboratory's camera and scene, in sizes a person would measure."""

from __future__ import annotations

import math
from dataclasses import dataclass

from snapbeam.core.validate import InputError, choice, integer, nonnegative, positive, shown, within
from snapbeam.lab.tracking.geometry import SIDES

__all__ = ["SyntheticCamera", "SyntheticStage"]


@dataclass(frozen=True)
class SyntheticCamera:
    """The camera: sampling, optics, light and noise.

    Attributes
    ----------
    frame_rate, pixel_size
        Frames per second [Hz]; metres per pixel.
    shape
        (height, width) of the region, pixels.
    exposure
        Shutter time [s], at most a frame; half a frame unless given.
    bit_depth
        Bits of a pixel, 8 to 16.
    snr_db
        20 log10(contrast of the beam's edge / standard deviation of the pixel noise); infinite for no noise.
    blur
        Blur of the optics, standard deviation in pixels.
    lens
        "gaussian", the edges that the tracker fits; "disk", a lens out of focus that sees areas.
    light
        Relative change of the light from left to right and from top to bottom.
    """

    frame_rate: float = 10_000.0
    pixel_size: float = 12e-6
    shape: tuple[int, int] = (384, 384)
    exposure: float | None = None
    bit_depth: int = 12
    snr_db: float = 30.0
    blur: float = 0.8
    lens: str = "gaussian"
    light: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        rate = positive("frame_rate", self.frame_rate, "Hz")
        positive("pixel_size", self.pixel_size, "m")
        for name in ("shape", "light"):
            if not isinstance(getattr(self, name), (tuple, list)) or len(getattr(self, name)) != 2:
                raise InputError(f"{name} = {shown(getattr(self, name))}: must be a pair of numbers")
        for name, value in zip(("shape[0]", "shape[1]"), self.shape, strict=True):
            integer(name, value, 16, 8192)
        exposure = 0.5 / rate if self.exposure is None else self.exposure
        object.__setattr__(
            self,
            "exposure",
            within("exposure", exposure, 0.0, 1.0 / rate * (1 + 1e-9), closed="right", unit="s"),
        )
        integer("bit_depth", self.bit_depth, 8, 16)
        if not (isinstance(self.snr_db, float) and math.isinf(self.snr_db) and self.snr_db > 0.0):
            within("snr_db", self.snr_db, -20.0, 200.0, closed="both", unit="dB")
        choice("lens", self.lens, ("gaussian", "disk"))
        within("blur", self.blur, 0.0, 20.0, closed="left", unit="px")
        for name, change in zip(("light[0]", "light[1]"), self.light, strict=True):
            within(name, change, -1.0, 1.0)


@dataclass(frozen=True)
class SyntheticStage:
    """The scene: sizes in metres, grey levels from 0 (black) to 1 (saturated).

    ``marker_distance`` is from the tip to the sticker, ``marker_thickness`` its height along the motion; 0
    for no sticker.  ``slope`` is the beam's at the contact.  A dark beam before bright light is
    ``background`` above ``beam``.
    """

    beam_thickness: float = 0.4e-3
    slope: float = 0.0
    tip_radius: float = 2.5e-3
    shaker_width: float = 2.0e-3
    marker_distance: float = 0.35e-3
    marker_thickness: float = 0.25e-3
    side: str = "below"
    background: float = 0.12
    beam: float = 0.72
    shaker: float = 0.66
    marker: float = 0.2

    def __post_init__(self) -> None:
        for name in ("beam_thickness", "tip_radius", "shaker_width"):
            positive(name, getattr(self, name), "m")
        for name in ("marker_distance", "marker_thickness"):
            nonnegative(name, getattr(self, name), "m")
        within("slope", self.slope, -1.0, 1.0)
        choice("side", self.side, SIDES)
        for name in ("background", "beam", "shaker", "marker"):
            within(name, getattr(self, name), 0.0, 1.0, closed="both")
        if self.beam == self.background:
            raise InputError(f"beam = {self.beam!r}: must differ from background = {self.background!r}")
