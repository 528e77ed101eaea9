"""Where tips stand at the start beside a base that moves."""

from __future__ import annotations

import math

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model import default_values


@pytest.mark.parametrize("phase", [-0.5 * math.pi, 0.3, 0.5 * math.pi])
def test_every_stop_touches_the_beam_at_the_start(phase: float) -> None:
    """Stops in space beside a base that begins away from its mid-position: the second one was placed without the base."""
    model = sb.ReducedModel.from_beam(default_values.BEAM, 3)
    motion = sb.DisplacementSine(frequency_ratio=0.7, displacement_amplitude=0.1, phase=phase)
    stops = [sb.Striker(drive=sb.FixedStop(), location=place) for place in (0.4, 0.6)]
    system = sb.System(
        model,
        contacts=[sb.Contact(default_values.CONTACT, stop) for stop in stops],
        base_excitation=sb.BaseExcitation(motion=motion, striker_on_base=False),
    )
    run = sb.simulate(system, sb.Integration(cycles=1))
    np.testing.assert_allclose(run.dataset["striker_penetrations"].values[0], 0.0, atol=1e-12)
