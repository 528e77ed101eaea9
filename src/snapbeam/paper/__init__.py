"""The paper by name: its beam, contact and parameters."""

from snapbeam.model.parameters import (
    BEAM,
    CONTACT,
    CYCLES,
    DAMPING_RATIO,
    LOCATION,
    LONG_CYCLES,
    MODES,
    STRAIGHT_BEAM,
)

__all__ = [
    "BEAM",
    "CONTACT",
    "CYCLES",
    "DAMPING_RATIO",
    "LOCATION",
    "LONG_CYCLES",
    "MODES",
    "STRAIGHT_BEAM",
]
