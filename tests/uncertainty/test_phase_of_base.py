"""A random phase of a system without a driven striker: the message names the phase that the system has."""

from __future__ import annotations

import math

import pytest

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.uncertainty.probability import probability_map

BASE = sb.BaseExcitation(motion=sb.AccelerationSine(frequency_ratio=0.8, acceleration_amplitude=0.25))
SYSTEM = sb.System(sb.ReducedModel.from_beam(default_values.BEAM, modes=1, damping_ratio=0.02), base_excitation=BASE)


def probability(**spread):
    uncertainty = sb.uncertainty.ParameterUncertainty(**spread)
    axes = {"base_excitation.acceleration_amplitude": [0.25]}
    return probability_map(SYSTEM, axes, uncertainty, 4, integration=sb.Integration(cycles=2))


def test_message_names_the_phase_of_the_base_and_its_advice_works():
    with pytest.raises(sb.InputError, match=r"drive\.phase: .*this system has base_excitation\.phase: .*UniformRange"):
        probability(of={}, phase=True)
    found = probability(of={"base_excitation.phase": sb.uncertainty.UniformRange(0.0, 2.0 * math.pi)})
    assert int(found["runs"].sum()) == 4
