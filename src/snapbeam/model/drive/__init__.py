"""Drives, one a file: how the striker's tip moves about its mid-position."""

from snapbeam.model.drive.base import DRIVES, Drive, Scale
from snapbeam.model.drive.burst import Burst
from snapbeam.model.drive.chirp import Chirp
from snapbeam.model.drive.flight import ConstantVelocity
from snapbeam.model.drive.half_sine import HalfSine
from snapbeam.model.drive.noise import BandLimitedNoise
from snapbeam.model.drive.recorded import RecordedMotion
from snapbeam.model.drive.sine import Sine
from snapbeam.model.drive.still import AccelerationSine, DisplacementSine, FixedStop
from snapbeam.model.drive.sum import SumDrive
from snapbeam.model.drive.timed import HORIZON, Timed
from snapbeam.model.drive.two_sines import TwoTone

__all__ = [
    "DRIVES",
    "HORIZON",
    "AccelerationSine",
    "Burst",
    "Chirp",
    "DisplacementSine",
    "Drive",
    "ConstantVelocity",
    "HalfSine",
    "BandLimitedNoise",
    "RecordedMotion",
    "Scale",
    "Sine",
    "FixedStop",
    "SumDrive",
    "Timed",
    "TwoTone",
]
