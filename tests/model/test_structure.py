"""Models given by their matrices."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model.default_values import BEAM, LOCATION
from snapbeam.model.reduced_model import ReducedModel
from snapbeam.util.validation import InputError

TWO = {"mass": np.eye(2), "stiffness": [1.0, 4.0], "contact_shape": [1.0, 1.0]}


def test_free_mass() -> None:
    model = ReducedModel.from_matrices([[0.02]], [0.0], contact_shape=[1.0], reference_frequency=50.0)
    assert model.omega.tolist() == [0.0]
    assert model.linear_modes[0, 0] == pytest.approx(1.0 / math.sqrt(0.02))
    assert model.contact_mass(0.3) == pytest.approx(0.02)
    assert model.reference_frequency == 50.0
    assert not model.is_bistable
    assert model.length_scale == 1.0
    with pytest.raises(InputError, match=r"reference_frequency is not given and the first natural frequency is 0"):
        _ = ReducedModel.from_matrices([[0.02]], [0.0], contact_shape=[1.0]).reference_frequency


def test_free_chain_has_one_rigid_motion() -> None:
    """Five equal masses in a row with no support: the exact frequencies 2 sqrt(k/m) sin(n pi/10)."""
    stiffness = 2.0 * np.eye(5) - np.eye(5, k=1) - np.eye(5, k=-1)
    stiffness[0, 0] = stiffness[4, 4] = 1.0
    shape = [0.0, 0.0, 1.0, 0.0, 0.0]
    model = ReducedModel.from_matrices(3.0 * np.eye(5), 7.0 * stiffness, contact_shape=shape)
    expected = 2.0 * math.sqrt(7.0 / 3.0) * np.sin(np.arange(5) * math.pi / 10.0)
    assert model.omega[0] == 0.0
    np.testing.assert_allclose(model.omega, expected, atol=1e-14)
    assert model.parity.tolist() == [0] * 5


def test_reproduces_the_beam() -> None:
    """The beam's own matrices, and the same structure in rotated coordinates."""
    beam = ReducedModel.from_beam(BEAM.replace(buckling_level=8 * BEAM.radius_of_gyration), modes=6)
    rotation, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(6, 6)))
    for turn in (np.eye(6), rotation):
        model = ReducedModel.from_matrices(
            turn @ beam.mass @ turn.T,
            turn @ np.diag(beam.stiffness) @ turn.T,
            contact_shape=turn @ beam.shape_at(LOCATION),
            midspan_shape=turn @ beam.midspan_shape,
            nonlinear_stiffness=beam.nonlinear_stiffness,
            well_amplitude=turn @ beam.well_amplitude,
            length_scale=BEAM.buckling_level,
            damping_ratio=0.005,
        )
        np.testing.assert_allclose(model.natural_frequencies, beam.natural_frequencies, rtol=1e-12)
        assert model.reference_frequency == pytest.approx(beam.reference_frequency)
        assert model.contact_mass(0.1) == pytest.approx(beam.contact_mass(LOCATION))
        assert model.well_energy == pytest.approx(beam.well_energy)
        assert model.saddle_energy == pytest.approx(beam.saddle_energy)
        alpha = 1e-3 * np.random.default_rng(4).normal(size=(3, 6))
        np.testing.assert_allclose(model.potential_energy(alpha @ turn.T), beam.potential_energy(alpha))
        np.testing.assert_allclose(model.kinetic_energy(alpha @ turn.T), beam.kinetic_energy(alpha))
        np.testing.assert_allclose(
            turn.T @ model.damping_matrix @ turn, beam.damping_matrix, atol=1e-12 * beam.damping_matrix.max()
        )


def test_shape_is_the_contact_point_whatever_the_location() -> None:
    model = ReducedModel.from_matrices(**TWO, midspan_shape=[1.0, 0.0])
    np.testing.assert_array_equal(model.shape_at(0.2), [1.0, 1.0])
    np.testing.assert_array_equal(model.shape_at(0.5), [1.0, 1.0])
    np.testing.assert_array_equal(model.midspan_shape, [1.0, 0.0])
    np.testing.assert_array_equal(ReducedModel.from_matrices(**TWO).midspan_shape, [1.0, 1.0])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"mass": [[1.0, 0.1], [0.2, 1.0]]}, r"mass\[0, 1\] = 0.1, mass\[1, 0\] = 0.2: must be symmetric"),
        ({"mass": [[1.0, 2.0], [2.0, 1.0]]}, r"mass: must be positive definite, .* eigenvalue is -1"),
        ({"mass": [[1.0, 0.0], [0.0, math.nan]]}, r"mass\[1, 1\] = .*nan.*: must be finite"),
        ({"mass": [1.0, 1.0]}, r"mass of shape \(2,\): must be a square matrix"),
        ({"mass": np.eye(3)}, r"stiffness of shape \(2,\): must have the shape \(3,\)"),
        ({"mass": [["a", "b"], ["c", "d"]]}, r"mass = .*: must be an array of numbers"),
        ({"stiffness": [[1.0, 0.5], [0.0, 1.0]]}, r"stiffness\[0, 1\] = 0.5, .*: must be symmetric"),
        ({"stiffness": np.eye(3)}, r"stiffness of shape \(3, 3\): must have the shape \(2, 2\)"),
        ({"stiffness": [1.0, -1.0]}, r"well_amplitude = \[0.0, 0.0\]: must be stable, .* eigenvalue -1 1/s"),
        ({"contact_shape": [1.0]}, r"contact_shape of shape \(1,\): must have the shape \(2,\)"),
        ({"contact_shape": [0.0, 0.0]}, r"contact_shape = \[0.0, 0.0\]: must not be all zeros"),
        ({"midspan_shape": [math.inf, 0.0]}, r"midspan_shape\[0\] = .*inf.*: must be finite"),
        ({"nonlinear_stiffness": -1.0}, r"nonlinear_stiffness = -1.0: must be .* at least 0"),
        ({"length_scale": 0.0}, r"length_scale = 0.0: must be .* greater than 0 m"),
        ({"damping_ratio": 1.5}, r"damping_ratio = 1.5: must be a number in \[0, 1\)"),
        ({"reference_frequency": 0.0}, r"reference_frequency = 0.0: must be .* greater than 0 Hz"),
        ({"well_amplitude": [1.0]}, r"well_amplitude of shape \(1,\): must have the shape \(2,\)"),
        ({"well_amplitude": [-1.0, 0.0]}, r"well_amplitude = \[-1.0, 0.0\]: must be zero unless nonlinear_stiffness"),
    ],
)
def test_refusals(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        ReducedModel.from_matrices(**{**TWO, **changes})


@pytest.mark.parametrize(
    ("equilibrium", "message"),
    [
        ([-0.9, 0.0], r"must satisfy K0 a \+ gamma \(a . a\) a = 0, but leaves"),
        ([1.0, 0.0], r"must be the lower well, but displaces the centre by 1, not downward"),
        ([0.0, 0.0], r"must be stable"),
    ],
)
def test_refuses_what_is_no_lower_well(equilibrium: list[float], message: str) -> None:
    bistable = {**TWO, "stiffness": [-4.0, 3.0], "nonlinear_stiffness": 4.0}
    model = ReducedModel.from_matrices(**bistable, well_amplitude=[-1.0, 0.0])
    assert model.is_bistable
    assert model.well_energy == pytest.approx(-1.0)
    assert model.saddle_energy == 0.0
    np.testing.assert_allclose(model.omega**2, [7.0, 8.0])
    with pytest.raises(InputError, match=message):
        ReducedModel.from_matrices(**bistable, well_amplitude=equilibrium)


def test_one_well_has_no_barrier() -> None:
    with pytest.raises(InputError, match="the map needs a bistable structure: give a well_amplitude other than"):
        ReducedModel.from_matrices(**TWO).require_bistable("the map")


def test_a_contact_of_matrices_needs_no_location(tmp_path) -> None:
    """In a file, of any contact; figures and datasets state none."""
    model = ReducedModel.from_matrices(np.eye(2), [100.0, 900.0], contact_shape=[1.0, 1.0], length_scale=1e-3,
        nonlinear_stiffness=1e8, elongation_matrix=np.eye(2))  # fmt: skip
    stops = [
        sb.Contact(sb.HertzContact(1e6), sb.Striker(drive=sb.FixedStop(), side=side, gap=1e-4))
        for side in ("above", "below")
    ]
    force = sb.ExternalForce(history=sb.HarmonicForce(frequency_ratio=1.0, amplitude=0.5))
    system = sb.System(model, contacts=stops, forces=[force])
    system.save(tmp_path / "own.toml")
    lines = (tmp_path / "own.toml").read_text().splitlines()
    left = [line for line in lines if not line.startswith("location")]
    assert len(left) < len(lines)
    (tmp_path / "own.toml").write_text("\n".join(left))
    read = sb.System.load(tmp_path / "own.toml")
    how = sb.Integration(cycles=5)
    assert sb.simulate(read, how).summary.peak_force == sb.simulate(system, how).summary.peak_force > 0.0
    curve = sb.force_displacement(model, 0.5)
    assert "location" not in curve.attrs
    assert "x_" not in sb.plot.plot_force_displacement(curve).get_title()
