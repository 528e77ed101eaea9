"""Repeats: reproducible starts of a stated size, shares that say where the class is a matter of chance."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import snapbeam as sb
from snapbeam.core.validate import InputError
from snapbeam.model.paper_values import BEAM
from snapbeam.sweeps.replicas import MEASURING_ERROR, Replicas, perturbed_starts
from snapbeam.sweeps.stored import long_map


def test_measuring_error_is_that_of_a_pixel():
    rng = np.random.default_rng(0)
    position = rng.uniform(0.0, 1e-3, 200_000)
    read = np.rint(position / 12e-6) * 12e-6
    assert pytest.approx(np.std(read - position), rel=5e-3) == MEASURING_ERROR
    assert MEASURING_ERROR / BEAM.buckling_level == pytest.approx(0.0103, abs=1e-4)


@pytest.mark.parametrize("modes", [1, 4, 32])
def test_starts_have_the_size_asked_for(modes):
    model = sb.ReducedModel.from_beam(BEAM, modes=modes)
    starts = perturbed_starts(model, Replicas(2000, size=5e-6), "below")
    moved = np.array([model.center_shape @ (start.alpha - model.equilibrium) for start in starts])
    assert np.sqrt(np.mean(moved**2)) == pytest.approx(5e-6, rel=0.08)
    assert abs(moved.mean()) < 4.0 * 5e-6 / np.sqrt(2000)
    q = np.array([np.linalg.solve(model.linear_modes, start.alpha - model.equilibrium) for start in starts])
    p = np.array([np.linalg.solve(model.linear_modes, start.velocity) for start in starts])
    energy = 0.5 * np.array([np.mean((q * model.omega) ** 2, axis=0), np.mean(p**2, axis=0)])
    np.testing.assert_allclose(energy, energy.mean(), rtol=0.25)  # 2000 draws: 3 % a value, 64 of them


def test_starts_are_reproducible_and_mirror():
    model = sb.ReducedModel.from_beam(BEAM, modes=3)
    first = perturbed_starts(model, Replicas(3), "below")
    more = perturbed_starts(model, Replicas(5), "below")
    other = perturbed_starts(model, Replicas(3, seed=1), "below")
    mirror = perturbed_starts(model, Replicas(3), "above")
    for at, start in enumerate(first):
        np.testing.assert_array_equal(start.alpha, more[at].alpha)
        np.testing.assert_array_equal(start.alpha, -mirror[at].alpha)
        np.testing.assert_array_equal(start.velocity, -mirror[at].velocity)
        assert (start.alpha != other[at].alpha).all()


def test_shares(small):
    plain = sb.response_map(**small)
    sure = long_map(**small, replicas=6, halve_step=True)
    share = sure["class_share"]
    assert share.dims == ("frequency_ratio", "velocity_amplitude", "response_class")
    np.testing.assert_allclose(share.sum("response_class"), 1.0)
    np.testing.assert_allclose(share.values * 8.0, np.rint(share.values * 8.0))
    for name in plain.data_vars:
        xr.testing.assert_equal(sure[name], plain[name])
    own = share.sel(response_class=sure["response"])
    assert (own >= 1.0 / 8.0).all()
    halved = sb.response_map(**small, step=0.5 * plain.attrs["step"])
    np.testing.assert_array_equal(sure["response_half_step"], halved["response"])
    assert sure.attrs["replicas"] == 6 and sure.attrs["replica_size"] == MEASURING_ERROR
    tiny = long_map(**small, replicas=2, replica_size=1e-15)
    wild = long_map(**small, replicas=6, replica_size=1e-4)
    assert float(tiny["class_share"].max("response_class").mean()) > float(
        wild["class_share"].max("response_class").mean()
    )


def test_what_is_refused(small):
    with pytest.raises(InputError, match="replicas = -1"):
        long_map(**small, replicas=-1)
    with pytest.raises(InputError, match="replica_size = 0"):
        long_map(**small, replicas=1, replica_size=0.0)
