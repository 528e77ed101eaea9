"""A small system and synthetic answers that the tests of design share."""

from __future__ import annotations

import snapbeam as sb
from snapbeam import paper


def small_system(modes: int = 1, **shaker: float) -> sb.System:
    """The paper's beam with few modes."""
    drive = {"frequency_ratio": 1.21, "velocity_amplitude": 0.18} | shaker
    model = sb.ReducedModel.from_beam(paper.BEAM, modes=modes, damping_ratio=paper.DAMPING_RATIO)
    return sb.System(model, paper.CONTACT, sb.Shaker(**drive).striker())
