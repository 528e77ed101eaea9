"""A small system and synthetic answers that the tests of design share."""

from __future__ import annotations

import snapbeam as sb
from snapbeam.model import default_values


def small_system(modes: int = 1, **shaker: float) -> sb.System:
    """The paper's beam with few modes."""
    drive = {"frequency_ratio": 1.21, "velocity_amplitude": 0.18} | shaker
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=modes, damping_ratio=default_values.DAMPING_RATIO)
    return sb.System(model, contacts=[sb.Contact(default_values.CONTACT, sb.Shaker(**drive).striker())])
