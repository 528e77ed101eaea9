"""Repeats: reproducible starts of a stated size, shares that say where the class is a matter of chance."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from small_map import swept

import snapbeam as sb
from snapbeam.model.default_values import BEAM, CONTACT
from snapbeam.sweeps.replicates import MEASURING_ERROR, Replicates, perturbed_start
from snapbeam.util.validation import InputError


def test_measuring_error_is_that_of_a_pixel():
    rng = np.random.default_rng(0)
    position = rng.uniform(0.0, 1e-3, 200_000)
    read = np.rint(position / 12e-6) * 12e-6
    assert pytest.approx(np.std(read - position), rel=5e-3) == MEASURING_ERROR
    assert MEASURING_ERROR / BEAM.buckling_level == pytest.approx(0.0103, abs=1e-4)


def starts_of(model, replicates, side="below"):
    system = sb.System(
        model, contacts=[sb.Contact(CONTACT, sb.Shaker(frequency_ratio=1.0, velocity_amplitude=0.1, side=side))]
    )
    return [perturbed_start(system, replicates, repeat) for repeat in range(replicates.count)]


@pytest.mark.parametrize("modes", [1, 4, 32])
def test_starts_have_the_size_asked_for(modes):
    model = sb.ReducedModel.from_beam(BEAM, modes=modes)
    starts = starts_of(model, Replicates(2000, perturbation_rms=5e-6))
    moved = np.array([model.midspan_shape @ (start.amplitude - model.well_amplitude) for start in starts])
    assert np.sqrt(np.mean(moved**2)) == pytest.approx(5e-6, rel=0.08)
    assert abs(moved.mean()) < 4.0 * 5e-6 / np.sqrt(2000)
    q = np.array([np.linalg.solve(model.linear_modes, start.amplitude - model.well_amplitude) for start in starts])
    p = np.array([np.linalg.solve(model.linear_modes, start.velocity) for start in starts])
    energy = 0.5 * np.array([np.mean((q * model.omega) ** 2, axis=0), np.mean(p**2, axis=0)])
    np.testing.assert_allclose(energy, energy.mean(), rtol=0.25)  # 2000 draws: 3 % a value, 64 of them


def test_starts_are_reproducible_and_mirror():
    model = sb.ReducedModel.from_beam(BEAM, modes=3)
    first = starts_of(model, Replicates(3), "below")
    more = starts_of(model, Replicates(5), "below")
    other = starts_of(model, Replicates(3, seed=1), "below")
    mirror = starts_of(model, Replicates(3), "above")
    for at, start in enumerate(first):
        np.testing.assert_array_equal(start.amplitude, more[at].amplitude)
        np.testing.assert_array_equal(start.amplitude, -mirror[at].amplitude)
        np.testing.assert_array_equal(start.velocity, -mirror[at].velocity)
        assert (start.amplitude != other[at].amplitude).all()


def test_shares(small):
    plain = swept(**small)
    sure = swept(**small, replicates=Replicates(6, check_half_step=True))
    share = sure["class_fraction"]
    assert share.dims == ("frequency_ratio", "velocity_amplitude", "class_code")
    np.testing.assert_allclose(share.sum("class_code"), 1.0)
    np.testing.assert_allclose(share.values * 8.0, np.rint(share.values * 8.0))
    for name in plain.data_vars:
        xr.testing.assert_equal(sure[name], plain[name])
    own = share.sel(class_code=sure["response_class"])
    assert (own >= 1.0 / 8.0).all()
    halved = swept(**small, step=0.5 * plain.attrs["step"])
    np.testing.assert_array_equal(sure["response_half_step"], halved["response_class"])
    assert sure.attrs["replicates"] == 6 and sure.attrs["perturbation_rms"] == MEASURING_ERROR
    tiny = swept(**small, replicates=Replicates(2, perturbation_rms=1e-15))
    wild = swept(**small, replicates=Replicates(6, perturbation_rms=1e-4))
    assert float(tiny["class_fraction"].max("class_code").mean()) > float(
        wild["class_fraction"].max("class_code").mean()
    )


def test_repeats_of_starts_that_are_swept():
    """A change is added to where each point begins, not to the rest state."""
    model = sb.ReducedModel.from_beam(BEAM, modes=2)
    system = sb.System(model, contacts=[sb.Contact(CONTACT, sb.Shaker(frequency_ratio=1.21, velocity_amplitude=0.02))])
    axes = {"initial_state.velocity[1]": [0.0, 1.0, 2.0], "velocity_amplitude": [0.02, 0.03]}
    asked = sb.Integration(cycles=3)
    ds = sb.sweep(system, axes, asked, replicates=Replicates(2, perturbation_rms=1e-15))
    assert (ds.class_fraction.max("class_code") == 1.0).all(), "hardly changed, every repeat is the run"
    assert len(np.unique(ds.response_class)) > 1, "and the runs differ"
    replicates = Replicates(1, perturbation_rms=1e-6)
    batch = sb.State(amplitude=np.array([[1e-3, 0.0], [2e-3, 1e-4]]), phase=[0.0, 0.5])
    moved = perturbed_start(system, replicates, 0, batch)
    change = perturbed_start(system, replicates, 0).amplitude - model.well_amplitude
    np.testing.assert_allclose(moved.amplitude - batch.amplitude, [change, change], rtol=1e-9)
    np.testing.assert_array_equal(moved.phase, batch.phase)


def test_what_is_refused(small):
    with pytest.raises(InputError, match="replicates = -1"):
        swept(**small, replicates=-1)
    with pytest.raises(InputError, match="perturbation_rms = 0"):
        Replicates(1, perturbation_rms=0.0)
