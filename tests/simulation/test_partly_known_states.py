"""States of which only some strikers or circuits have numbers of their own."""

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model import default_values

MODEL = sb.ReducedModel.from_beam(default_values.BEAM, modes=2, damping_ratio=0.005)
SHAKER = sb.Shaker(frequency_ratio=1.2, velocity_amplitude=0.1, location=0.4)
MOVED = sb.Striker(drive=sb.Sine(frequency_ratio=1.2, velocity_amplitude=0.2), mass=0.01, suspension_stiffness=1e3)
PLASTIC = sb.ElasticPlasticContact(1e5, 2e5)


@pytest.mark.parametrize(
    "contacts",
    [
        [sb.Contact(default_values.CONTACT, MOVED), sb.Contact(default_values.CONTACT, SHAKER)],
        [sb.Contact(PLASTIC, MOVED), sb.Contact(default_values.CONTACT, SHAKER)],
    ],
    ids=["one with a mass", "one with an indentation"],
)
def test_a_run_goes_on_from_its_last_state(contacts, tmp_path):
    system = sb.System(MODEL, contacts=contacts)
    how = sb.Integration(cycles=3, accuracy="reference")
    last = sb.simulate(system, how).final_state
    assert np.isnan(last.striker_shift).any()
    onward = system.replace(initial_state=last)
    onward.save(tmp_path / "onward.toml")
    again = sb.System.load(tmp_path / "onward.toml")
    assert again.hash == onward.hash
    whole = sb.simulate(system, how.replace(cycles=5)).final_state
    for each in (onward, again):
        end = sb.simulate(each, how.replace(cycles=2)).final_state
        np.testing.assert_allclose(end.amplitude, whole.amplitude, rtol=0, atol=1e-8 * MODEL.length_scale)
