"""Drives, one a file: how the striker's tip moves about its mid-position."""

from snapbeam.model.drive.base import DRIVES, Drive, Scale
from snapbeam.model.drive.recorded import Recorded
from snapbeam.model.drive.sine import Sine

__all__ = ["DRIVES", "Drive", "Recorded", "Scale", "Sine"]
