"""What can be wrong with a frame, as codes with advice."""

from __future__ import annotations

from enum import IntFlag

__all__ = ["FrameFlag"]


class FrameFlag(IntFlag):
    """Reasons why a frame gave no measurement, or one to be careful with; several may hold at once.

    A position that could not be measured is NaN and its frame carries the reason.  ``BLUR`` alone leaves the
    position in place: it is the mean over a long exposure.
    """

    OK = 0
    GAP = 1
    BLUR = 2
    DROPPED = 4
    GLARE = 8
    MERGED = 16
    LOW_CONTRAST = 32
    OUT_OF_REGION = 64
    JUMP = 128
    DISTORTED = 256

    @property
    def advice(self) -> str:
        """What happened and what to do about it, for each reason in turn."""
        return "; ".join(text for flag, text in _ADVICE.items() if flag in self) or "measured"


_ADVICE = {
    FrameFlag.GAP: (
        "an edge was not found; look at the frame (--picture, --frame), narrow region (--region) or set "
        "threshold (--threshold)"
    ),
    FrameFlag.BLUR: (
        "the edges are much wider than usual; shorten the exposure or refocus (blur_limit, --blur-limit, "
        "moves the limit)"
    ),
    FrameFlag.DROPPED: "the camera lost the frame: it is absent, blank or a repeat of the one before",
    FrameFlag.GLARE: (
        "light saturates the edge; turn the lamp or choose other columns (contact_column, --contact-column)"
    ),
    FrameFlag.MERGED: "beam and shaker touch and the shaker shows no edge of its own; put a sticker on it",
    FrameFlag.LOW_CONTRAST: (
        "the edge is too faint; add light or set objects (--objects) and threshold (--threshold)"
    ),
    FrameFlag.OUT_OF_REGION: "the object left the region; make region (--region) taller",
    FrameFlag.JUMP: (
        "the position leaves its neighbours for a frame or few and comes back: something else was taken for "
        "the object; look at the frame (--picture, --frame)"
    ),
    FrameFlag.DISTORTED: (
        "the beam looks thicker or thinner than usual, or its edge is no step: light or another object lies "
        "on it; look at the frame (--picture, --frame)"
    ),
}
