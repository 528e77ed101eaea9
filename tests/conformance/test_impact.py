"""A free mass against a shaker at rest: Hertz's impact, whose duration and force are known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from snapbeam.model import default_values
from snapbeam.model.reduced_model import ReducedModel
from snapbeam.model.state import State

MASS, SPEED = 2.0e-3, 0.05


def thrown(stiffness: float = 0.0) -> ReducedModel:
    return ReducedModel.from_matrices(
        [[MASS]], [stiffness], contact_shape=[1.0], length_scale=0.335e-3, reference_frequency=80.0
    )


@pytest.mark.parametrize("speed", [0.005, 0.05, 0.5])
def test_free_mass(integrate_ensemble, speed) -> None:
    """Duration 2.94328 d_max/v, peak force kc d_max^1.5, unit restitution, no work by a shaker at rest."""
    end = integrate_ensemble(thrown(), start=State(amplitude=np.zeros(1), velocity=np.array([-speed])))
    depth = default_values.CONTACT.max_penetration(MASS, speed)
    assert end.accumulators_of_runs["impacts"][0] == 1
    assert end.accumulators_of_runs["contact_time"][0] == pytest.approx(2.94328 * depth / speed, rel=2e-4)
    peak = default_values.CONTACT.stiffness * depth**1.5
    assert end.accumulators_of_runs["peak_force"][0] == pytest.approx(peak, rel=5e-4)
    restitution = math.sqrt(end.accumulators_of_runs["energy"][0] / (0.5 * MASS * speed**2))
    assert restitution == pytest.approx(1.0, abs=2e-4)
    assert end.accumulators_of_runs["work"][0] == 0.0
    assert end.accumulators_of_runs["gross_work"][0] == 0.0


def test_reference_accuracy(integrate_ensemble) -> None:
    end = integrate_ensemble(
        thrown(), start=State(amplitude=np.zeros(1), velocity=np.array([-SPEED])), accuracy="reference"
    )
    duration = default_values.CONTACT.impact_duration(MASS, SPEED)
    assert end.accumulators_of_runs["contact_time"][0] == pytest.approx(duration, rel=1e-6)
    assert end.accumulators_of_runs["energy"][0] == pytest.approx(0.5 * MASS * SPEED**2, rel=1e-6)


def test_order_in_contact(integrate_ensemble) -> None:
    """The d^1.5 edge holds any fixed order to about 2.5; here the mean over five halvings."""
    duration = default_values.CONTACT.impact_duration(MASS, SPEED)
    steps = duration * 2.0 ** np.arange(3, -3, -1)
    errors = []
    for step in steps:
        end = integrate_ensemble(
            thrown(), start=State(amplitude=np.zeros(1), velocity=np.array([-SPEED])), step=float(step)
        )
        errors.append(abs(end.accumulators_of_runs["energy"][0] / (0.5 * MASS * SPEED**2) - 1.0))
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] >= 2.5, errors


def test_onset_is_located(integrate_ensemble) -> None:
    """A mass on a spring leaves the shaker and is back after half a period, as fast as it left."""
    omega = 2.0 * math.pi * 80.0
    start = State(amplitude=np.zeros(1), velocity=np.array([SPEED]))
    end = integrate_ensemble(thrown(MASS * omega**2), start=start, frequency_ratio=1.0, cycles=1)
    # half a period of flight, the impact, and of the second flight what is left of the cycle
    half = math.pi / omega
    duration = default_values.CONTACT.impact_duration(MASS, SPEED)
    assert end.accumulators_of_runs["impacts"][0] == 1
    assert end.accumulators_of_runs["contact_time"][0] == pytest.approx(duration, rel=1e-3)
    assert duration < 0.1 * half
    assert end.accumulators_of_runs["max_displacement"][0] == pytest.approx(SPEED / omega, rel=3e-5)
