"""Tangents of a beam on a moving base and under a changing axial load, against differences and Liouville's formula.

Stop and striker stand where they are whatever the start is, and starts are in the air, so that a small change of the
start is a change of the beam alone.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model import default_values

GAP, CHANGE = 20e-6, 1e-6
BASE = sb.BaseExcitation(
    motion=sb.AccelerationSine(frequency_ratio=0.9, acceleration_amplitude=0.25), striker_on_base=False
)
LOAD = sb.AxialLoadModulation(motion=sb.HarmonicForce(frequency_ratio=2.0, amplitude=3.0))
SYSTEMS = {
    "base": ({"base_excitation": BASE}, sb.FixedStop(), 0.9),
    "load": ({"axial_load": LOAD}, sb.Sine(frequency_ratio=1.21, velocity_amplitude=0.05), 1.21),
    "both": ({"base_excitation": BASE, "axial_load": LOAD}, sb.FixedStop(), 0.9),
}


@pytest.mark.parametrize("modes", [1, 3])
@pytest.mark.parametrize("name", list(SYSTEMS))
def test_tangents_are_the_derivatives(name: str, modes: int) -> None:
    """Every column of the derivative after two periods, impacts on the way: central differences at level *reference*.

    The determinant is that of damping, exp(-2 T sum zeta omega); the length of a step that ends at a contact has derivatives
    to the error of the step: the logarithm agrees to 1.1e-6 at level standard, 5e-10 at reference.
    """
    around, drive, ratio = SYSTEMS[name]
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=modes)
    system = sb.System(model, contacts=[sb.Contact(default_values.CONTACT, sb.Striker(drive=drive, gap=GAP))], **around)
    well, omega = model.wells[0], float(model.omega[0])
    size = float(np.abs(well).max())
    rng, weights = np.random.default_rng(3), 1.0 / np.arange(1, modes + 1) ** 2
    at = well + 1e-2 * size * rng.normal(size=modes) * weights
    rate = 1e-2 * omega * size * rng.normal(size=modes) * weights
    changes = np.zeros((2 * modes, 2, modes))
    changes[:modes, 0], changes[modes:, 1] = np.eye(modes), omega * np.eye(modes)
    steps = CHANGE * size * np.concatenate((changes, -changes))
    batch = sb.State(amplitude=at + steps[:, 0], velocity=rate + steps[:, 1])
    exact = -2.0 * float((model.damping_ratio * model.omega).sum()) * 2 * 2.0 * math.pi / (ratio * omega)
    for accuracy, bound in (("standard", 2e-6), ("reference", 2e-9)):
        how = sb.Integration(accuracy=accuracy)
        start = sb.State(amplitude=at, velocity=rate)
        gone = sb.advance(system, start, 2, changes, integration=how)
        assert gone.statistics is not None and int(gone.statistics["impacts"]) > 0
        assert gone.tangent is not None
        columns = np.concatenate((gone.tangent[:, 0], gone.tangent[:, 1] / omega), axis=1)
        assert np.linalg.slogdet(columns)[1] == pytest.approx(exact, abs=bound)
    there = sb.advance(system, batch, 2, integration=how)
    for name, found in (("amplitude", gone.tangent[:, 0]), ("velocity", gone.tangent[:, 1])):
        values = getattr(there, name)
        differences = (values[: 2 * modes] - values[2 * modes :]) / (2.0 * CHANGE * size)
        np.testing.assert_allclose(found, differences, rtol=0.0, atol=2e-5 * np.abs(differences).max())
