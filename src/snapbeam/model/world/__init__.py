"""What surrounds a beam and moves or taps it: the base it is mounted on, a load that changes, a harvester."""

from snapbeam.model.world.base import Base
from snapbeam.model.world.harvester import HARVESTERS, Coil, Harvester, Piezo
from snapbeam.model.world.load import LOADS, AxialLoad, LoadMotion, LoadRamp, LoadSine

__all__ = [
    "HARVESTERS",
    "LOADS",
    "AxialLoad",
    "Base",
    "Coil",
    "Harvester",
    "LoadMotion",
    "LoadRamp",
    "LoadSine",
    "Piezo",
]
