"""The reduced model of a beam: matrices, linear modes, damping, energies."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import minimize

from snapbeam.model.beam import Beam
from snapbeam.model.buckling_modes import BucklingModes
from snapbeam.model.default_values import BEAM, LOCATION, STRAIGHT_BEAM
from snapbeam.model.reduced_model import ReducedModel, rank_one_eigenpairs
from snapbeam.util.validation import InputError, InputTypeError

# above P_cr2 the second mode forms the saddles
DEEP_BEAM = BEAM.replace(buckling_level=8.0 * BEAM.radius_of_gyration)


def tangent_stiffness(model: ReducedModel, alpha: np.ndarray) -> np.ndarray:
    """Jacobian of K0 alpha + gamma (alpha . alpha) alpha."""
    square = alpha @ alpha * np.eye(alpha.size) + 2.0 * np.outer(alpha, alpha)
    return np.diag(model.stiffness) + model.nonlinear_stiffness * square


def gradient(model: ReducedModel, alpha: np.ndarray) -> np.ndarray:
    return model.stiffness * alpha + model.nonlinear_stiffness * (alpha @ alpha) * alpha


def test_matrices_against_quadrature() -> None:
    """Eqs. (13)-(15): the diagonal-plus-rank-one mass matrix, and K0 = E I int phi''^2 - P."""
    model = ReducedModel.from_beam(BEAM, modes=32)
    points, weights = np.polynomial.legendre.leggauss(200)
    x, weight = 0.5 * BEAM.length * (points + 1.0), 0.5 * BEAM.length * weights
    modes = BucklingModes(BEAM.length, 32)
    shape, curvature = modes.shape(x), modes.curvature(x)
    mass = BEAM.mass_per_length * (shape * weight) @ shape.T
    k = modes.wavenumber
    assert np.abs((mass - model.mass) * np.outer(k, k)).max() < 2e-14 * BEAM.mass_per_length
    odd_even = np.not_equal.outer(modes.parity, modes.parity)
    assert (model.mass[odd_even] == 0.0).all()
    bending = BEAM.bending_stiffness * np.sum(weight * curvature**2, axis=1)
    np.testing.assert_allclose(model.stiffness, bending - BEAM.axial_load, rtol=1e-13)
    assert model.nonlinear_stiffness == BEAM.nonlinear_stiffness


@pytest.mark.parametrize("count", [1, 2, 3, 32, 256])
@pytest.mark.parametrize(
    "beam",
    [
        BEAM,
        DEEP_BEAM,
        STRAIGHT_BEAM,
        BEAM.replace(buckling_level=1e-6 * BEAM.radius_of_gyration),
        BEAM.replace(buckling_level=200.0 * BEAM.radius_of_gyration),
    ],
    ids=["paper", "deep", "straight", "hardly buckled", "far buckled"],
)
def test_linear_modes(beam: Beam, count: int) -> None:
    """V^T m V = Id and V^T Khat V = diag(omega^2), each relative to the entries it is made of."""
    model = ReducedModel.from_beam(beam, modes=count)
    v, omega = model.linear_modes, model.omega
    assert (np.diff(omega) > 0.0).all()
    assert np.abs(v.T @ model.mass @ v - np.eye(count)).max() < 1e-13
    stiffness = v.T @ tangent_stiffness(model, model.well_amplitude) @ v / np.outer(omega, omega)
    assert np.abs(stiffness - np.eye(count)).max() < 1e-12
    across = np.not_equal.outer(model.parity, model.parity)
    assert (model.tension_matrix[across] == 0.0).all()
    np.testing.assert_allclose(model.tension_matrix, v.T @ v, rtol=1e-12, atol=1e-12 * np.abs(v.T @ v).max())
    assert (v[np.abs(v).argmax(axis=0), np.arange(count)] > 0.0).all()


def test_rank_one_with_zero_and_equal_entries() -> None:
    """A vanishing entry and a pair of equal ones, where the pole itself is the eigenvalue."""
    d = np.array([5.0, 0.0, 2.0, 2.0, 1.0])
    eigenvalue, y = rank_one_eigenpairs(d, 2.0)
    weight = np.eye(5) + 2.0
    np.testing.assert_allclose(y.T @ weight @ y, np.eye(5), atol=1e-14)
    np.testing.assert_allclose(y.T @ np.diag(d) @ y, np.diag(eigenvalue), atol=1e-14)
    assert eigenvalue[0] == 0.0
    assert 2.0 in eigenvalue


def test_beam_at_its_critical_load() -> None:
    model = ReducedModel.from_beam(BEAM.replace(axial_load=BEAM.critical_load), modes=8)
    assert model.natural_frequencies[0] == 0.0
    assert (model.natural_frequencies[1:] > 0.0).all()
    np.testing.assert_allclose(model.linear_modes.T @ model.mass @ model.linear_modes, np.eye(8), atol=1e-14)
    with pytest.raises(InputError, match=r"reference_frequency is not given .* give reference_frequency in Hz"):
        _ = model.reference_frequency


def test_shape_at() -> None:
    model = ReducedModel.from_beam(BEAM, modes=32)
    modes = BucklingModes(BEAM.length, 32)
    np.testing.assert_array_equal(model.shape_at(LOCATION), modes.shape(LOCATION * BEAM.length))
    np.testing.assert_array_equal(model.shape_at(0.5), model.midspan_shape)
    assert (model.midspan_shape[1::2] == 0.0).all()
    assert model.midspan_shape @ model.well_amplitude == pytest.approx(-BEAM.buckling_level, rel=1e-14)
    for bad in (1.1, -0.2, math.nan):
        with pytest.raises(InputError, match=r"location = .*: must be a number in \[0, 1\]"):
            model.shape_at(bad)
    np.testing.assert_allclose(model.shape_at([0.0, 1.0]), 0.0, atol=1e-12)
    along = model.shape_at(np.array([[0.1, 0.2, LOCATION], [0.5, 0.7, 0.9]]))
    assert along.shape == (2, 3, 32)
    np.testing.assert_allclose(along[0, 2], model.shape_at(LOCATION), rtol=1e-12)
    with pytest.raises(InputError, match=r"location from 0.5 to 1.5: must lie in \[0, 1\]"):
        model.shape_at([0.5, 1.5])
    with pytest.raises(InputError, match=r"location = 0.*: must be a number in \(0, 1\)"):
        model.contact_mass(0.0)


def test_contact_mass_falls_as_modes_are_added() -> None:
    """About rho S L / N: no limit for a law of impact that lasts no time."""
    total = BEAM.mass_per_length * BEAM.length
    masses = [ReducedModel.from_beam(BEAM, modes=n).contact_mass(LOCATION) for n in (1, 8, 32, 256)]
    assert total == pytest.approx(7.5e-3, rel=0.01)
    assert masses[0] == pytest.approx(2.86e-3, rel=0.01)
    assert masses[2] == pytest.approx(0.23e-3, rel=0.03)
    assert masses[3] == pytest.approx(0.03e-3, rel=0.05)
    model = ReducedModel.from_beam(BEAM, modes=8)
    shape = model.shape_at(LOCATION)
    assert masses[1] == pytest.approx(1.0 / (shape @ np.linalg.solve(model.mass, shape)), rel=1e-12)


def test_damping_matrix() -> None:
    ratio = np.linspace(0.0, 0.5, 6)
    model = ReducedModel.from_beam(BEAM, modes=6, damping_ratio=ratio)
    modal = model.linear_modes.T @ model.damping_matrix @ model.linear_modes
    np.testing.assert_allclose(modal, np.diag(2.0 * ratio * model.omega), atol=1e-12 * model.omega.max())
    np.testing.assert_array_equal(model.damping_matrix, model.damping_matrix.T)
    assert (ReducedModel.from_beam(BEAM, modes=3).damping_ratio == 0.005).all()


@pytest.mark.parametrize("beam", [BEAM, DEEP_BEAM], ids=["P < P_cr2", "P > P_cr2"])
@pytest.mark.parametrize("count", [1, 2, 6])
def test_wells_and_barrier_against_optimisation(beam: Beam, count: int) -> None:
    """The wells are the only minima; the barrier is the least energy with alpha_1 = 0.

    Every path between the wells crosses alpha_1 = 0, and the least energy there is a saddle.
    """
    model = ReducedModel.from_beam(beam, modes=count)
    a = abs(model.well_amplitude[0])
    scale = abs(model.well_energy)
    excess = beam.axial_load - beam.critical_load
    assert model.well_energy == pytest.approx(-(excess**2) / (4.0 * beam.nonlinear_stiffness), rel=1e-12)
    for well in model.wells:
        assert np.abs(gradient(model, well)).max() < 1e-12 * excess * a
        assert (np.linalg.eigvalsh(tangent_stiffness(model, well)) > 0.0).all()
    np.testing.assert_array_equal(model.wells[0], -model.wells[1])

    def energy(z: np.ndarray) -> tuple[float, np.ndarray]:
        return float(model.potential_energy(a * z)) / scale, gradient(model, a * z) * a / scale

    def energy_on_ridge(z: np.ndarray) -> tuple[float, np.ndarray]:
        value, slope = energy(np.concatenate(([0.0], z)))
        return value, slope[1:]

    rng = np.random.default_rng(1)
    ridge = 0.0
    for _ in range(10):
        found = minimize(energy, rng.normal(size=count), jac=True, options={"gtol": 1e-9})
        assert found.fun == pytest.approx(-1.0, abs=1e-9)
        assert abs(found.x[0]) == pytest.approx(1.0, abs=1e-6)
        if count > 1:
            found = minimize(energy_on_ridge, rng.normal(size=count - 1), jac=True, options={"gtol": 1e-9})
            ridge = min(ridge, found.fun)
    assert model.saddle_energy / scale == pytest.approx(ridge, abs=1e-9)
    if count == 1 or beam is BEAM:
        assert model.saddle_energy == 0.0
    else:
        second = beam.axial_load - beam.second_critical_load
        assert model.saddle_energy == pytest.approx(-(second**2) / (4.0 * beam.nonlinear_stiffness), rel=1e-10)
        saddle = np.zeros(count)
        saddle[1] = math.sqrt(second / beam.nonlinear_stiffness)
        assert float(model.potential_energy(saddle)) == pytest.approx(model.saddle_energy, rel=1e-10)
        assert np.sum(np.linalg.eigvalsh(tangent_stiffness(model, saddle)) < 0.0) == 1


def test_energies_of_many_states() -> None:
    model = ReducedModel.from_beam(BEAM, modes=5)
    rng = np.random.default_rng(0)
    alpha = 1e-3 * rng.normal(size=(4, 3, 5))
    potential, kinetic = model.potential_energy(alpha), model.kinetic_energy(alpha)
    assert potential.shape == kinetic.shape == (4, 3)
    one = alpha[2, 1]
    # the beam's own energy: bending, compression and stretching by quadrature of the shape
    points, weights = np.polynomial.legendre.leggauss(80)
    x, weight = 0.5 * BEAM.length * (points + 1.0), 0.5 * BEAM.length * weights
    modes = BucklingModes(BEAM.length, 5)
    stretch = np.sum(weight * (one @ modes.slope(x)) ** 2)
    bending = 0.5 * BEAM.bending_stiffness * np.sum(weight * (one @ modes.curvature(x)) ** 2)
    expected = bending - 0.5 * BEAM.axial_load * stretch + 0.25 * BEAM.nonlinear_stiffness * stretch**2
    assert potential[2, 1] == pytest.approx(expected, rel=1e-11)
    speed = one @ modes.shape(x)
    assert kinetic[2, 1] == pytest.approx(0.5 * BEAM.mass_per_length * np.sum(weight * speed**2), rel=1e-11)
    np.testing.assert_array_equal(model.potential_energy(-alpha), potential)
    assert float(model.potential_energy(np.zeros(5))) == 0.0


def test_straight_beam_has_no_barrier() -> None:
    model = ReducedModel.from_beam(STRAIGHT_BEAM, modes=4)
    assert not model.is_bistable
    assert model.length_scale is None
    assert model.well_energy == 0.0
    message = r"the map needs a buckled beam: axial_load = 0 N must exceed the critical load of 24.3685 N"
    with pytest.raises(InputError, match=message):
        model.require_bistable("the map")
    with pytest.raises(InputError, match="saddle_energy needs a buckled beam"):
        _ = model.saddle_energy
    ReducedModel.from_beam(BEAM, modes=4).require_bistable("the map")


def test_arrays_are_read_only() -> None:
    model = ReducedModel.from_beam(BEAM, modes=4)
    for array in (model.mass, model.stiffness, model.linear_modes, model.natural_frequencies, model.tension_matrix):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0.0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"modes": 0}, r"modes = 0: must be an integer in \[1, 256\]"),
        ({"modes": 10000}, r"modes = 10000: must be an integer in \[1, 256\]"),
        ({"modes": 2.5}, r"modes = 2.5: must be an integer"),
        ({"damping_ratio": 1.5}, r"damping_ratio = 1.5: must be a number in \[0, 1\)"),
        ({"damping_ratio": -0.1}, r"damping_ratio = -0.1: must be a number in \[0, 1\)"),
        ({"damping_ratio": math.nan}, r"damping_ratio.* = .*nan.*: must be finite"),
        ({"damping_ratio": [0.1, 1.0], "modes": 2}, r"damping_ratio\[1\] = 1.0: must be a number in \[0, 1\)"),
        ({"damping_ratio": [0.1, 0.1], "modes": 3}, r"damping_ratio of shape \(2,\): must have the shape \(3,\)"),
        ({"beam": 0.161}, r"beam = 0.161: must be a Beam"),
    ],
)
def test_refusals(changes: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        ReducedModel.from_beam(**{"beam": BEAM, **changes})


def test_refuses_text() -> None:
    with pytest.raises(InputTypeError, match="modes = '32': must be an integer"):
        ReducedModel.from_beam(BEAM, modes="32")  # type: ignore[arg-type]
    with pytest.raises(InputTypeError, match="damping_ratio = 'small'"):
        ReducedModel.from_beam(BEAM, damping_ratio="small")
