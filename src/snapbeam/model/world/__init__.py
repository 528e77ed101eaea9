"""What surrounds a beam and moves or taps it: the base it is mounted on, a load that changes, a harvester."""

from snapbeam.model.world.base import BaseExcitation
from snapbeam.model.world.harvester import (
    HARVESTERS,
    ElectromagneticHarvester,
    Harvester,
    PiezoelectricHarvester,
)
from snapbeam.model.world.load import LOADS, AxialLoadModulation, LoadMotion, LoadRamp, HarmonicLoad

__all__ = [
    "HARVESTERS",
    "LOADS",
    "AxialLoadModulation",
    "BaseExcitation",
    "ElectromagneticHarvester",
    "Harvester",
    "LoadMotion",
    "LoadRamp",
    "HarmonicLoad",
    "PiezoelectricHarvester",
]
