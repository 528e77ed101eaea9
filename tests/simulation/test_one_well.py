"""Response classes of a shallow arch with one well, which snaps through under a shock and returns."""

from __future__ import annotations

import numpy as np
import pytest

import snapbeam as sb

pytestmark = [
    pytest.mark.filterwarnings("ignore:this imperfection leaves one well"),
    pytest.mark.filterwarnings("ignore:the lowest mode about the equilibrium"),
]


def arch(**changes) -> sb.System:
    """A silicon arch, 500 x 20 x 2 um with a rise of 6 um, under a shock of its base."""
    beam = sb.Beam(length=500e-6, width=20e-6, thickness=2e-6, density=2330.0, young_modulus=160e9, axial_load=0.0)
    imperfection = sb.Imperfection(midspan_amplitude=6e-6, antisymmetric_amplitude=20e-9)
    model = sb.ReducedModel.from_beam(beam, 2, damping_ratio=0.05, imperfection=imperfection)
    base = sb.BaseExcitation(motion=sb.Shock(acceleration_g=1.0, duration_ms=0.2))
    return sb.System(model, base_excitation=base).replace(**changes)


@pytest.mark.slow
def test_an_arch_snaps_and_returns():
    """The class follows from the extreme of the centre against half of the mirror image of the rest, of each run."""
    system = arch()
    levels = [5e3, 8e4, 1.6e5, 2.4e5]
    found = sb.sweep(system, {"base_excitation.acceleration_g": levels}, sb.Integration(cycles=100))
    inverted = found["min_midspan_displacement"].values < -0.5
    assert inverted.any() and not inverted.all()
    np.testing.assert_array_equal(found["other_well_reached"].values, inverted)
    snapped = inverted & (found["zero_crossings"].values > 0)
    np.testing.assert_array_equal(found["response_class"].values, np.where(snapped, 1, 0))
    assert found.attrs["wells"] == 1
    assert sb.ResponseClass(1).label_of(found.attrs["wells"]) == "snapped and returned"
    run = sb.simulate(system.replace(**{"base_excitation.acceleration_g": levels[-1]}), sb.Integration(cycles=100))
    assert run.summary.response_class == found["response_class"].values[-1]


@pytest.mark.slow
def test_a_crossing_of_the_flat_shape_is_no_snap_through():
    """Thrown just past flat and back, the centre crosses zero, but its shape is not inverted."""
    system = arch(**{"base_excitation.acceleration_g": 0.0})
    for speed in np.linspace(0.6, 2.0, 29):
        thrown = system.replace(**{"initial_state.velocity[1]": -float(speed)})
        summary = sb.simulate(thrown, sb.Integration(cycles=2)).summary
        if summary.zero_crossings and summary.min_midspan_displacement > -0.5:
            assert summary.response_class == sb.ResponseClass.INTRAWELL
            return
    pytest.fail("no run crosses zero without inverting its shape")


@pytest.mark.slow
def test_threshold_of_an_arch_over_one_parameter():
    """One threshold, without another axis, in g; names by their last part."""
    found = sb.threshold(arch(), "acceleration_g", [5e3, 8e4, 1.6e5, 2.4e5], integration=sb.Integration(cycles=100))
    assert found["lower_threshold"].dims == ()
    assert float(found["lower_threshold"]) in (1.6e5, 2.4e5)
    assert found["lower_threshold"].attrs["units"] == "g"
