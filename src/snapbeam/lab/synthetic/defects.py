"""What goes wrong in front of a camera and in it, to be drawn into a synthetic recording."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from snapbeam.core.validate import InputError, integer, nonnegative, positive, shown, within

__all__ = ["FRAME_LISTS", "Defects", "Fixture"]

FRAME_LISTS = ("glare_frames", "blurred_frames", "repeated_frames", "blank_frames", "hidden_frames")


@dataclass(frozen=True)
class Fixture:
    """A bar that crosses the picture and never moves: ``row`` of its middle in the turned picture and
    ``thickness`` [px], grey ``level`` from 0 to 1."""

    row: float
    thickness: float
    level: float

    def __post_init__(self) -> None:
        within("row", self.row, -1e4, 1e4, unit="px")
        positive("thickness", self.thickness, "px")
        within("level", self.level, 0.0, 1.0, closed="both")


@dataclass(frozen=True)
class Defects:
    """Departures from the ideal camera and scene.

    Attributes
    ----------
    glare_frames, blurred_frames, repeated_frames, blank_frames, hidden_frames
        Numbers of frames with a reflection, 4 px more blur, a repeat of the frame before, black, or with the
        beam hidden by something of the background's grey.
    glare_strength, glare_wide
        Light of the reflection over full scale, and whether it spans all columns.
    gamma
        Grey level = light**gamma.
    gain
        Light over what the camera's full scale takes.
    flicker
        Relative change of the light with mains frequency (100 Hz).
    texture
        Relative unevenness of the surfaces, which moves with them.
    shot
        Noise of bright pixels that grows with the root of the light: standard deviation at full scale.
    fixture
        A bar that never moves.
    drift
        Rows by which the whole picture has sunk at the end of the recording [px], evenly over time.
    """

    glare_frames: Sequence[int] = ()
    blurred_frames: Sequence[int] = ()
    repeated_frames: Sequence[int] = ()
    blank_frames: Sequence[int] = ()
    hidden_frames: Sequence[int] = ()
    glare_strength: float = 4.0
    glare_wide: bool = False
    gamma: float = 1.0
    gain: float = 1.0
    flicker: float = 0.0
    texture: float = 0.0
    shot: float = 0.0
    fixture: Fixture | None = None
    drift: float = 0.0

    def __post_init__(self) -> None:
        positive("gamma", self.gamma)
        positive("gain", self.gain)
        for name in ("glare_strength", "flicker", "texture", "shot"):
            nonnegative(name, getattr(self, name))
        within("drift", self.drift, -1e3, 1e3, unit="px")

    def frames(self, count: int) -> dict[str, frozenset[int]]:
        """The spoiled frames by kind, of a recording of *count* frames.

        Raises
        ------
        InputError
            For a number that is no frame of the recording.
        """
        chosen = {}
        for name in FRAME_LISTS:
            values = getattr(self, name)
            if isinstance(values, (str, int)):
                raise InputError(f"{name} = {shown(values)}: must be a list of frame numbers")
            chosen[name.removesuffix("_frames")] = frozenset(
                integer(f"{name}[{i}]", value, 0, count - 1) for i, value in enumerate(values)
            )
        return chosen
