"""A structure whose tension acts along a matrix of its own, against an independent solution; input that is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.sparse import csr_array

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.model.equilibria import condensed
from snapbeam.model.imperfection import perfect_equilibria
from snapbeam.util.validation import InputError

MASS = np.array([[1.0, 0.1, 0.0], [0.1, 1.5, 0.2], [0.0, 0.2, 0.8]])
STIFF = np.array([[3.0, -1.0, 0.0], [-1.0, 4.0, -1.0], [0.0, -1.0, 5.0]])
SPRING = np.array([1.0, -1.0, 0.0])
FULL = np.array([[2.0, 0.5, 0.1], [0.5, 1.0, 0.0], [0.1, 0.0, 0.7]])


def model(stiffness, elongation, **more) -> sb.ReducedModel:
    return sb.ReducedModel.from_matrices(
        MASS, stiffness, contact_shape=[1.0, 0.4, 0.2], nonlinear_stiffness=2.0, elongation_matrix=elongation,
        damping_ratio=0.01, reference_frequency=0.3, length_scale=4.0, **more,
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("elongation", [np.outer(SPRING, SPRING), FULL], ids=["one spring", "full"])
@pytest.mark.parametrize("buckled", [False, True])
def test_against_an_independent_solution(elongation, buckled) -> None:
    stiffness = STIFF - 6.0 * np.outer(SPRING, SPRING) if buckled else STIFF
    load = np.array([0.1, -0.05, 0.02])
    reduced = model(stiffness, elongation, transverse_force=load)
    assert reduced.is_bistable == buckled
    for each in reduced.equilibria:
        a = each.amplitude
        pull = elongation @ a
        np.testing.assert_allclose(stiffness @ a + 2.0 * (a @ pull) * pull, load, atol=1e-10)
        tangent = stiffness + 2.0 * ((a @ pull) * elongation + 2.0 * np.outer(pull, pull))
        assert int((np.linalg.eigvalsh(tangent) < 0.0).sum()) == each.unstable_directions
    start, row = reduced.wells[0], np.array([0.0, 1.0, 0.5])
    history = sb.HarmonicForce(frequency_ratio=1.0, amplitude=1.5)
    system = sb.System(reduced, forces=[sb.ExternalForce(history=history, shape=row)])
    inverse, damping = np.linalg.inv(MASS), system.struck_model.damping_matrix

    def rate(t, y):
        a, pull = y[:3], elongation @ y[:3]
        force = load + row * 1.5 * math.sin(2.0 * math.pi * 0.3 * t)
        bent = stiffness @ a + 2.0 * (a @ pull) * pull
        return np.concatenate((y[3:], inverse @ (force - bent - damping @ y[3:])))

    times = np.linspace(0.0, 3.99 / 0.3, 200)
    expected = solve_ivp(rate, (0.0, times[-1]), np.r_[start, np.zeros(3)], "DOP853", times, rtol=1e-11, atol=1e-13)
    run = sb.simulate(system, sb.Integration(cycles=4, accuracy="reference"), sample_times=times)
    np.testing.assert_allclose(run.dataset["modal_amplitude"].values, expected.y[:3].T, atol=2e-8)
    assert sb.System.from_mapping(system.to_mapping()) == system


def test_equal_wells() -> None:
    stiffness = STIFF - 6.0 * np.outer(SPRING, SPRING)
    own = condensed(stiffness, np.zeros(3), np.outer(SPRING, SPRING))
    lowest = perfect_equilibria(own.stiffness, 2.0)[0]
    down = own.back @ lowest.amplitude
    down = -down if SPRING @ down > 0.0 else down
    wells = model(stiffness, np.outer(SPRING, SPRING), midspan_shape=SPRING, well_amplitude=down)
    assert wells.is_bistable
    assert wells.well_energy == pytest.approx(lowest.energy)
    assert wells.saddle_energy == pytest.approx(0.0)


def test_identity_is_the_default() -> None:
    with_one = model(STIFF, np.eye(3))
    without = model(STIFF, None)
    np.testing.assert_allclose(with_one.tension_matrix, without.tension_matrix)
    sparse = sb.ReducedModel.from_matrices(
        csr_array(MASS), csr_array(STIFF), contact_shape=[1.0, 0.4, 0.2], elongation_matrix=csr_array(FULL),
        nonlinear_stiffness=2.0,
    )  # fmt: skip
    np.testing.assert_array_equal(sparse.omega, without.omega)


@pytest.mark.parametrize(
    ("matrix", "words"),
    [
        (np.eye(2), r"elongation_matrix of shape \(2, 2\)"),
        (np.array([[1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]), "must be symmetric"),
        (-np.eye(3), "give the geometric stiffness"),
        (np.zeros((3, 3)), "give the geometric stiffness"),
    ],
)
def test_refused(matrix, words) -> None:
    with pytest.raises(InputError, match=words):
        model(STIFF, matrix)


def test_refused_with_nothing_to_stiffen() -> None:
    with pytest.raises(InputError, match="give nonlinear_stiffness"):
        sb.ReducedModel.from_matrices(MASS, STIFF, contact_shape=[1.0, 0.0, 0.0], elongation_matrix=np.eye(3))
    with pytest.raises(InputError, match="is singular for a motion"):
        model(np.diag([1.0, 1.0, 0.0]), np.diag([1.0, 1.0, 0.0]), transverse_force=[1.0, 0.0, 0.0])


def test_imperfect_beam_with_one_well_vibrates_through_its_centre() -> None:
    """The beam has no second well about which it could be described."""
    straight = default_values.BEAM.replace(axial_load=0.0)
    reduced = sb.ReducedModel.from_beam(straight, modes=1, imperfection=sb.Imperfection(midspan_amplitude=2e-5))
    assert not reduced.is_bistable
    system = sb.System(reduced, initial_state=sb.State(amplitude=-12.0 * reduced.well_amplitude))
    with pytest.warns(sb.DiagnosticWarning, match="leaves one well"):
        run = sb.simulate(system, sb.Integration(cycles=20, accuracy="reference"))
    assert abs(run.dataset.attrs["energy_error"]) < 1e-9
