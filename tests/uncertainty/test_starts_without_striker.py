"""Random starts of systems without a striker: one for each run, amplitudes and velocities in their places."""

from __future__ import annotations

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.dynamics.flow import InitialConditions
from snapbeam.model import default_values
from snapbeam.model.state import amplitude_scale
from snapbeam.uncertainty.monte_carlo import Trials
from snapbeam.uncertainty.probability import probability_map

BASE = sb.BaseExcitation(motion=sb.AccelerationSine(frequency_ratio=0.7, acceleration_amplitude=0.1))


def system_of(modes: int, striker: bool = False) -> sb.System:
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=modes, damping_ratio=0.02)
    if not striker:
        return sb.System(model, base_excitation=BASE)
    drive = sb.Shaker(frequency_ratio=1.1, velocity_amplitude=0.1)
    return sb.System(model, contacts=[sb.Contact(default_values.CONTACT, drive.striker())])


@pytest.mark.parametrize("striker", [False, True])
@pytest.mark.parametrize("modes", [1, 2, 3])
@pytest.mark.parametrize("displacement", [0.0, 4e-6])
def test_a_start_for_each_location(modes, striker, displacement):
    """Several locations make a batch, whose states without a striker are the single state."""
    system = system_of(modes, striker)
    starts = InitialConditions(count=1, displacement=displacement, seed=8)
    one, places = starts.state(system, 5), [0.3, 0.5, 0.62, 0.7]
    many = starts.state(system, 5, location=places)
    assert many.amplitude.shape == many.velocity.shape == (4, modes)
    for i, place in enumerate(places):
        single = one if not striker else starts.state(system, 5, location=place)
        np.testing.assert_array_equal(many.amplitude[i], single.amplitude)
        np.testing.assert_array_equal(many.velocity[i], single.velocity)
    batch = sb.State(amplitude=np.stack([one.amplitude] * 4))
    assert starts.state(system, 5, batch, places).batch == (4,)


@pytest.mark.parametrize("modes", [1, 2, 3])
def test_columns_of_samples(modes):
    """The columns that runs begin from are those of the starts themselves, in units of the well."""
    system = system_of(modes)
    spread = sb.uncertainty.ParameterUncertainty(
        of={"damping_ratio": sb.uncertainty.Normal(0.1, relative=True)}, displacement=5e-6, seed=21
    )
    numbers = np.array([0, 3, 1, 3])
    columns = Trials(system, sb.Integration(cycles=1), spread).columns({}, numbers)
    starts = InitialConditions(count=1, displacement=5e-6, seed=21)
    scale = amplitude_scale(system.model)
    speed = 2.0 * np.pi * system.model.reference_frequency * scale
    for i, number in enumerate(numbers.tolist()):
        state = starts.state(system, number)
        amplitude = [columns[f"initial_state.amplitude[{mode + 1}]"][i] * scale for mode in range(modes)]
        velocity = [columns[f"initial_state.velocity[{mode + 1}]"][i] * speed for mode in range(modes)]
        np.testing.assert_allclose(amplitude, state.amplitude, rtol=1e-14)
        np.testing.assert_allclose(velocity, state.velocity, rtol=1e-14)


def test_a_probability_map_of_a_beam_without_a_striker():
    spread = sb.uncertainty.ParameterUncertainty(of={}, displacement=6e-6, seed=2)
    axes = {"base_excitation.acceleration_amplitude": [0.05, 0.2]}
    found = probability_map(system_of(2), axes, spread, 5, integration=sb.Integration(cycles=2))
    assert found["runs"].values.tolist() == [5, 5]
