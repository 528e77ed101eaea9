"""The energy below which a beam in the far well is certain to stay."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize

import snapbeam as sb
from snapbeam.model.default_values import BEAM, CONTACT
from snapbeam.model.early_termination import decidable_energy, least_energy_at
from snapbeam.model.reduced_model import ReducedModel
from snapbeam.solver.assemble import make_ensemble


def brute_force(model: ReducedModel, location: float, displacement: float) -> float:
    """Least potential energy of any amplitudes with w(x_s) = r, from many starts, in units of the barrier."""
    shape = model.shape_at(location)
    scale = np.abs(model.well_amplitude[0])
    unit = -model.well_energy
    # alpha = particular + null(shape) z
    particular = shape * displacement / (shape @ shape)
    null = np.linalg.svd(shape[None, :])[2][1:].T

    def energy(z: np.ndarray) -> tuple[float, np.ndarray]:
        alpha = particular + null @ z * scale
        slope = (model.stiffness + model.nonlinear_stiffness * (alpha @ alpha)) * alpha
        return float(model.potential_energy(alpha)) / unit, null.T @ slope * scale / unit

    rng = np.random.default_rng(0)
    starts = rng.normal(size=(12, model.modes - 1)) * (1.0 / np.arange(1, model.modes) ** 2)
    ends = [minimize(energy, z, jac=True, method="BFGS", options={"gtol": 1e-10, "maxiter": 5000}) for z in starts]
    return min(float(end.fun) for end in ends) * unit


@pytest.mark.parametrize("modes", [2, 8])
@pytest.mark.parametrize("location", [0.25, 1.0 / 2.1])
@pytest.mark.parametrize("height", [0.0, 0.2, 0.5, 0.8])
def test_least_energy_matches_brute_force(modes: int, location: float, height: float) -> None:
    model = ReducedModel.from_beam(BEAM, modes)
    displacement = height * BEAM.buckling_level
    bound = float(least_energy_at(model, location, displacement))
    assert bound == pytest.approx(brute_force(model, location, displacement), rel=1e-6, abs=1e-6 * -model.well_energy)


@pytest.mark.parametrize("modes", [1, 2, 8, 32])
def test_least_energy_is_a_lower_bound_reached_in_the_well(modes: int) -> None:
    model = ReducedModel.from_beam(BEAM, modes)
    rng = np.random.default_rng(modes)
    shapes = rng.normal(size=(300, modes)) / np.arange(1, modes + 1) ** 2 * 2.0 * np.abs(model.well_amplitude[0])
    places = rng.choice([0.2, 0.35, 0.5, 0.7], 300)
    heights = np.array([model.shape_at(x) @ a for x, a in zip(places, shapes, strict=True)])
    bound = least_energy_at(model, places, heights)
    assert (model.potential_energy(shapes) >= bound - 1e-9 * -model.well_energy).all()
    well = np.array([model.shape_at(x) @ -model.well_amplitude for x in (0.2, 0.5)])
    np.testing.assert_allclose(least_energy_at(model, [0.2, 0.5], well), model.well_energy, rtol=1e-9)
    np.testing.assert_array_equal(least_energy_at(model, 0.3, well), least_energy_at(model, 0.3, -well))


@pytest.mark.parametrize("modes", [1, 2, 8, 32])
@pytest.mark.parametrize("location", [0.01, 0.1, 0.25, 0.5])
def test_hardly_displaced_is_hardly_more_energy(modes: int, location: float) -> None:
    """Where the pinned beam is already buckled, the best tension lies at a zero of the sum: no rounding shows."""
    model = ReducedModel.from_beam(BEAM, modes)
    heights = np.concatenate(([0.0], np.geomspace(1e-18, 1e-3, 46))) * BEAM.buckling_level
    bound = least_energy_at(model, np.full(heights.size, location), heights)
    unit = -model.well_energy
    assert np.isfinite(bound).all()
    assert (model.well_energy * (1.0 + 1e-9) <= bound).all()
    # nowhere ten times as steep as over the whole
    rise = (bound - bound[0]) / unit
    slope = np.abs(rise[-1]) / heights[-1]
    assert (np.abs(rise) <= 10.0 * slope * heights + 1e-9).all()


def test_one_mode_passes_a_point_in_one_shape_only() -> None:
    """Its least energy there is its energy, zero on the line between the clamps."""
    model = ReducedModel.from_beam(BEAM, 1)
    places, heights = (np.array([0.5, 0.3, 0.5, 0.4, 0.6]), np.array([0.0, 0.0, 0.3, 0.9, -1.1]) * BEAM.buckling_level)
    amplitude = heights / np.array([model.shape_at(x)[0] for x in places])
    energy = model.potential_energy(amplitude[:, None])
    np.testing.assert_allclose(
        least_energy_at(model, places, heights), energy, rtol=1e-9, atol=1e-9 * -model.well_energy
    )


def test_decidable_energy() -> None:
    """Less than the barrier and less the higher the shaker reaches; never where it reaches the well."""
    model = ReducedModel.from_beam(BEAM, 8)
    highest = np.linspace(-1.0, 1.2, 23) * BEAM.buckling_level
    energy = decidable_energy(model, np.full(23, 0.5), highest)
    barrier = model.saddle_energy - model.well_energy
    possible = np.isfinite(energy)
    np.testing.assert_array_equal(possible, highest < BEAM.buckling_level * (1.0 - 1e-12))
    assert (energy[possible] < barrier).all()
    assert (np.diff(energy[possible]) <= 0.0).all()
    # away from the centre touching the shaker may take less than the saddle
    aside = decidable_energy(model, np.array([0.25]), np.array([0.0]))
    assert aside[0] < energy[np.searchsorted(highest, 0.0)]


def test_decides_nothing_for_structures_given_by_matrices() -> None:
    model = ReducedModel.from_matrices(
        [[1.0]], [-1.0], contact_shape=[1.0], nonlinear_stiffness=1.0, well_amplitude=[-1.0]
    )
    assert decidable_energy(model, np.array([0.5]), np.array([0.0]))[0] == -np.inf


@pytest.mark.parametrize(
    "drive",
    [
        sb.Shock(acceleration_g=20.0, duration_ms=5.0),
        sb.Burst(frequency_ratio=1.1, velocity_amplitude=0.3, duration_cycles=4.0, retraction=0.5),
    ],
    ids=lambda each: each.name,
)
def test_a_striker_above_reaches_as_far_as_its_mirror_image_below(drive: sb.Drive) -> None:
    """Motions are positive as the striker pushes, on either side: a run is not decided while the tip still comes."""
    model = ReducedModel.from_beam(BEAM, modes=2)
    how = sb.Integration(cycles=4, early_termination=True)
    reach = [
        make_ensemble(sb.System(model, contacts=[sb.Contact(CONTACT, striker)]), how).highest
        for side in ("below", "above")
        for striker in [sb.Striker(drive=drive, location=0.45, side=side)]
    ]
    np.testing.assert_allclose(reach[1], reach[0], rtol=1e-12)
