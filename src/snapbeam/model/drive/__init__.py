"""Drives, one a file: how the striker's tip moves about its mid-position."""

from snapbeam.model.drive.base import DRIVES, Drive, Scale
from snapbeam.model.drive.burst import Burst
from snapbeam.model.drive.chirp import Chirp
from snapbeam.model.drive.flight import Flight
from snapbeam.model.drive.half_sine import HalfSine
from snapbeam.model.drive.noise import Noise
from snapbeam.model.drive.recorded import Recorded
from snapbeam.model.drive.sine import Sine
from snapbeam.model.drive.still import AccelerationSine, DisplacementSine, Still
from snapbeam.model.drive.sum import Sum
from snapbeam.model.drive.timed import HORIZON, Timed
from snapbeam.model.drive.two_sines import TwoSines

__all__ = [
    "DRIVES",
    "HORIZON",
    "AccelerationSine",
    "Burst",
    "Chirp",
    "DisplacementSine",
    "Drive",
    "Flight",
    "HalfSine",
    "Noise",
    "Recorded",
    "Scale",
    "Sine",
    "Still",
    "Sum",
    "Timed",
    "TwoSines",
]
