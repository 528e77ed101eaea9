"""Initial shapes and side loads: their projections, what they do to the wells, and what explains measured ones."""

from __future__ import annotations

import re

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.model.buckling_modes import BucklingModes
from snapbeam.model.early_termination import crossing_energy
from snapbeam.model.equilibria import equilibria_of, least_energy_through
from snapbeam.model.imperfection_identification import identify_imperfection
from snapbeam.model.parameter_file import config_from_mapping
from snapbeam.util.validation import InputError

LENGTH = default_values.BEAM.length
LEVEL = default_values.BEAM.buckling_level


def model_of(modes: int = 4, **given) -> sb.ReducedModel:
    return sb.ReducedModel.from_beam(default_values.BEAM, modes=modes, imperfection=sb.Imperfection(**given))


def test_shapes_are_what_they_say() -> None:
    modes = BucklingModes(LENGTH, 8)
    x = np.linspace(0.0, LENGTH, 801)
    shapes = modes.shape(x)
    rise = sb.Imperfection(midspan_amplitude=2e-5).initial_shape(modes) @ shapes
    np.testing.assert_allclose(rise, 1e-5 * (1.0 - np.cos(2.0 * np.pi * x / LENGTH)), rtol=0.0, atol=1e-18)
    skew = sb.Imperfection(antisymmetric_amplitude=3e-5).initial_shape(modes) @ shapes
    assert skew.max() == pytest.approx(3e-5, rel=1e-5)
    assert skew[x < 0.5 * LENGTH].max() == skew.max()
    np.testing.assert_allclose(skew, -skew[::-1], rtol=0.0, atol=1e-18)
    # a measured shape that the modes hold is found again, a tilt of the bed is not
    at = np.linspace(0.0, 1.0, 301)
    measured = sb.Imperfection(profile=[at, 1e-5 * (1.0 - np.cos(2.0 * np.pi * at)) + 4e-5 * at + 1e-3])
    np.testing.assert_allclose(
        measured.initial_shape(modes),
        sb.Imperfection(midspan_amplitude=2e-5).initial_shape(modes),
        rtol=0.0,
        atol=1e-13,
    )
    # a half sine by its slope: the integral of (pi a/L) cos(pi x/L) phi_i'
    sine = sb.Imperfection(midspan_amplitude=1e-5, shape="sine").initial_shape(modes)
    nodes, weights = np.polynomial.legendre.leggauss(200)
    points = 0.5 * LENGTH * (1.0 + nodes)
    slope = np.pi * 1e-5 / LENGTH * np.cos(np.pi * points / LENGTH)
    expected = modes.slope(points) @ (0.5 * LENGTH * weights * slope)
    np.testing.assert_allclose(sine, expected, rtol=0.0, atol=1e-9 * np.abs(expected).max())
    assert (sine[1::2] == 0.0).all()


def test_loads_are_what_they_say() -> None:
    modes = BucklingModes(LENGTH, 6)
    nodes, weights = np.polynomial.legendre.leggauss(100)
    areas = modes.shape(0.5 * LENGTH * (1.0 + nodes)) @ (0.5 * LENGTH * weights)
    np.testing.assert_allclose(modes.integral, areas, rtol=0.0, atol=1e-14 * areas.max())
    uniform = sb.Imperfection(uniform_load=0.3).transverse_load(modes, default_values.BEAM)
    np.testing.assert_allclose(uniform, 0.3 * areas, rtol=0.0, atol=1e-13 * areas.max())
    weight = sb.Imperfection(gravity=9.81).transverse_load(modes, default_values.BEAM)
    np.testing.assert_allclose(weight, -9.81 * default_values.BEAM.mass_per_length / 0.3 * uniform, rtol=1e-14)
    point = sb.Imperfection(point_load=0.2, point_location=0.3).transverse_load(modes, default_values.BEAM)
    np.testing.assert_allclose(point, 0.2 * modes.shape(0.3 * LENGTH), rtol=1e-14)
    # a load upward lifts both wells, one downward lowers them
    assert (
        model_of(uniform_load=0.05).wells @ model_of().midspan_shape > model_of().wells @ model_of().midspan_shape
    ).all()
    assert model_of(gravity=1.0).well_energy < model_of().well_energy


def test_gone_past_a_fold() -> None:
    """Two wells up to a fold, where well and saddle meet at a frequency of zero; one beyond it, which is said."""
    low, high = 0.0, 1e-4
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if model_of(midspan_amplitude=middle).is_bistable else (low, middle)
    near, past = model_of(midspan_amplitude=low), model_of(midspan_amplitude=high)
    # one mode: kappa + 3 gamma a^2 = 0 at the fold, so that B = 2 (-kappa/3)^1.5/gamma^0.5
    kappa, gamma = near.stiffness[0], near.nonlinear_stiffness
    assert near.transverse_force[0] == pytest.approx(2.0 * (-kappa / 3.0) ** 1.5 / gamma**0.5, rel=1e-6)
    assert near.well_frequencies[0, 0] < 0.02 * near.well_frequencies[1, 0]
    assert not past.is_bistable
    assert len(past.equilibria) == 1
    np.testing.assert_array_equal(past.wells[0], past.wells[1])
    system = sb.System(
        past, contacts=[sb.Contact(default_values.CONTACT, sb.Shaker(frequency_ratio=1.2, velocity_amplitude=0.1))]
    )
    assert "monostable" in [each.code for each in system.diagnostics()]
    with pytest.raises(InputError, match="this imperfection leaves one"):
        past.saddle_energy  # noqa: B018


def test_two_well_limits_are_computed() -> None:
    """A curved silicon arch without load needs a greater rise, not a smaller one; each limit named is the limit."""
    beam = sb.Beam(length=500e-6, width=20e-6, thickness=2e-6, density=2330.0, young_modulus=160e9, axial_load=0.0)

    def arch(rise: float, load: float = 0.0) -> sb.ReducedModel:
        return sb.ReducedModel.from_beam(
            beam.replace(axial_load=load), 4, imperfection=sb.Imperfection(midspan_amplitude=rise)
        )

    said = arch(6e-6).two_well_limits
    rise, load = (float(number) for number in re.findall(r"at least ([\d.e+-]+) (?:m|N)", said))
    assert arch(rise).is_bistable
    assert not arch(0.999 * rise).is_bistable
    assert arch(6e-6, load).is_bistable
    assert not arch(6e-6, 0.999 * load).is_bistable
    with pytest.raises(InputError, match="midspan_amplitude of at least"):
        arch(6e-6).require_bistable("a threshold")
    # a buckled beam keeps two wells if its imperfection is small
    said = model_of(midspan_amplitude=1e-4).two_well_limits
    limit = float(re.search(r"midspan_amplitude of at most ([\d.e+-]+) m", said)[1])
    assert model_of(midspan_amplitude=0.999 * limit).is_bistable
    assert not model_of(midspan_amplitude=1.001 * limit).is_bistable


@pytest.mark.parametrize("seed", range(4))
def test_secular_equation_against_newton(seed) -> None:
    """Full matrices and many negative eigenvalues: Newton's method from 300 starts finds nothing else."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(2, 6))
    turned = np.linalg.qr(rng.standard_normal((count, count)))[0]
    matrix = turned @ np.diag(rng.uniform(-3.0, 2.0, count)) @ turned.T
    matrix, force, gamma = 0.5 * (matrix + matrix.T), rng.standard_normal(count) * 0.5, 0.7
    found = equilibria_of(matrix, gamma, force)
    known = np.array([alpha for alpha, _ in found])
    for a, unstable in found:
        tangent = matrix + gamma * ((a @ a) * np.eye(count) + 2.0 * np.outer(a, a))
        assert unstable == (np.linalg.eigvalsh(tangent) < 0.0).sum()
    for _ in range(300):
        a = rng.standard_normal(count) * 3.0
        for _ in range(60):
            left = matrix @ a + gamma * (a @ a) * a - force
            a = a - np.linalg.solve(matrix + gamma * ((a @ a) * np.eye(count) + 2.0 * np.outer(a, a)), left)
        if np.abs(matrix @ a + gamma * (a @ a) * a - force).max() < 1e-10:
            assert np.abs(known - a).max(axis=1).min() < 1e-7
    left = known @ matrix + gamma * np.sum(known**2, axis=1)[:, None] * known - force
    assert np.abs(left).max() < 1e-9


@pytest.mark.sampled(3)
@pytest.mark.parametrize("modes", [1, 2, 3, pytest.param(6, marks=pytest.mark.slow)])
def test_bound_behind_early_termination(modes) -> None:
    """The dual against SciPy's constrained minimum: never above it, and equal to it."""
    from scipy.optimize import minimize

    rng = np.random.default_rng(modes)
    given = {"midspan_amplitude": 1.2e-5, "point_load": 0.02, "point_location": 0.3}
    model = model_of(modes, **given)
    size = float(np.abs(model.wells).max())
    depth = model.saddle_energy - model.landscape.deepest.energy
    for location in (0.2, 0.35, 0.5):
        shape = model.shape_at(location)
        for share in (-0.8, -0.3, 0.0, 0.4, 0.9):
            height = share * float(shape @ model.wells[1])
            bound = least_energy_through(
                model.stiffness, model.nonlinear_stiffness, model.transverse_force, shape[None], np.array([height])
            )[0]
            # free coordinates of the plane c . alpha = r
            base, free = shape * height / (shape @ shape), np.linalg.svd(shape[None])[2][1:].T
            best = float(model.potential_energy(base))
            for _ in range(12 if modes > 1 else 0):
                start = rng.standard_normal(modes - 1) * size
                found = minimize(
                    lambda y, b=base, f=free: float(model.potential_energy(b + f @ (size * y))) / depth,
                    start / size, method="BFGS", options={"gtol": 1e-10},
                )  # fmt: skip
                best = min(best, found.fun * depth)
            assert bound <= best + 1e-9 * depth
            assert bound == pytest.approx(best, abs=1e-6 * depth)
    assert crossing_energy(model) == pytest.approx(model.saddle_energy, abs=1e-6 * depth)
    # without a side force it is that of equal wells
    from snapbeam.model.early_termination import least_energy_at

    plain = sb.ReducedModel.from_beam(default_values.BEAM, modes=modes)
    none = least_energy_through(
        plain.stiffness, plain.nonlinear_stiffness, np.zeros(modes), plain.shape_at(0.3)[None], np.array([0.4 * LEVEL])
    )
    assert none[0] == pytest.approx(float(least_energy_at(plain, 0.3, 0.4 * LEVEL)), rel=1e-9)


@pytest.mark.slow
def test_measured_wells_are_explained() -> None:
    """The paper's own beam: 81.3 and 80.5 Hz."""
    for kind in ("midspan_amplitude", "point_load", "uniform_load"):
        model = identify_imperfection(default_values.BEAM, 81.3, 80.5, kind)
        np.testing.assert_allclose(model.well_frequencies[:, 0], [81.3, 80.5], rtol=1e-6)
        assert model.beam.buckling_level == pytest.approx(0.331e-3, abs=1e-6)
        mirrored = identify_imperfection(default_values.BEAM, 80.5, 81.3, kind)
        assert getattr(mirrored.imperfection, kind) == pytest.approx(-getattr(model.imperfection, kind), rel=1e-5)
    assert identify_imperfection(default_values.BEAM, 81.3, 80.5).imperfection.midspan_amplitude == pytest.approx(
        -1.17e-6, abs=0.01e-6
    )
    with pytest.raises(InputError, match="no load of this beam"):
        identify_imperfection(default_values.BEAM, 400.0, 20.0)


def test_by_dotted_name_and_in_files(tmp_path) -> None:
    system = sb.System(
        model_of(midspan_amplitude=1e-5, antisymmetric_amplitude=2e-6),
        contacts=[sb.Contact(default_values.CONTACT, sb.Shaker(frequency_ratio=1.2, velocity_amplitude=0.1))],
    )
    assert system.get("imperfection.midspan_amplitude") == 1e-5
    other = system.replace(**{"imperfection.point_load": 0.01, "beam.thickness": 4.2e-4, "model.modes": 5})
    assert other.get("imperfection.point_load") == 0.01
    assert other.get("imperfection.antisymmetric_amplitude") == 2e-6
    assert other.model.modes == 5
    system.save(tmp_path / "a.toml")
    assert sb.System.load(tmp_path / "a.toml") == system
    perfect = system.replace(**{"imperfection.midspan_amplitude": 0.0, "imperfection.antisymmetric_amplitude": 0.0})
    assert perfect == system.replace(imperfection=None)
    assert (
        perfect.replace(**{"imperfection.midspan_amplitude": 1e-5, "imperfection.antisymmetric_amplitude": 2e-6})
        == system
    )
    with pytest.raises(InputError, match=r"imperfection.tilt: is not a parameter"):
        system.replace(**{"imperfection.tilt": 1.0})
    config = config_from_mapping(
        {
            "extends": "paper",
            "imperfection": {"midspan_amplitude": 1e-5, "profile": [[0.0, 0.3, 0.7, 1.0], [0.0, 1e-6, 2e-6, 0.0]]},
        }
    )
    assert config.system.model.is_bistable
    assert config.system.model.imperfection.profile.shape == (2, 4)
    with pytest.raises(InputError, match="is it given in mm"):
        config_from_mapping({"imperfection": {"midspan_amplitude": 3.0}})
    matrices = sb.ReducedModel.from_matrices(
        [[1.0]], [-1.0], contact_shape=[1.0], nonlinear_stiffness=1.0, transverse_force=[0.1]
    )
    again = sb.System.from_mapping(sb.System(matrices).to_mapping())
    np.testing.assert_array_equal(again.model.wells, matrices.wells)
    assert sorted(matrices.wells[:, 0]) == pytest.approx(sorted(np.roots([1.0, 0.0, -1.0, -0.1]).real)[::2], rel=1e-12)


@pytest.mark.slow
def test_swept_by_name() -> None:
    system = sb.System(
        sb.ReducedModel.from_beam(default_values.BEAM, modes=2),
        contacts=[sb.Contact(default_values.CONTACT, sb.Shaker(frequency_ratio=1.2, velocity_amplitude=0.2))],
    )  # fmt: skip
    axes = {"imperfection.midspan_amplitude": [-1e-5, 0.0, 1e-5], "velocity_amplitude": [0.1, 0.3]}
    swept = sb.sweep(system, axes, sb.Integration(cycles=6))
    assert swept.response_class.dims == ("imperfection_midspan_amplitude", "velocity_amplitude")
    plain = sb.sweep(system, {"velocity_amplitude": [0.1, 0.3]}, sb.Integration(cycles=6))
    np.testing.assert_array_equal(swept.max_displacement[1], plain.max_displacement)
    assert (swept.reference_frequency[0] != swept.reference_frequency[1]).all()
    assert swept.reference_frequency.values[0] == swept.reference_frequency.values[2]


@pytest.mark.parametrize("modes", [1, 3])
@pytest.mark.parametrize("load", [3e-19, 2e-22, -4e-27, 7e-29, -6e-33, 1e-161, 5e-324])
def test_a_load_that_no_digit_shows(modes, load):
    """Its square vanishes, or nearly so: two wells and the saddle between them, as without it."""
    model = sb.ReducedModel.from_beam(
        default_values.BEAM, modes=modes, imperfection=sb.Imperfection(point_load=load, point_location=0.4)
    )
    level = sb.ReducedModel.from_beam(default_values.BEAM, modes=1).length_scale
    heights = sorted(float(model.midspan_shape @ each.amplitude) for each in model.landscape.equilibria)
    np.testing.assert_allclose(heights, [-level, 0.0, level], atol=1e-12 * level)


@pytest.mark.parametrize("load", [1e120, -3e190])
def test_a_load_whose_square_overflows(load):
    with pytest.raises(sb.InputError, match="transverse_force"):
        sb.ReducedModel.from_beam(default_values.BEAM, modes=2, imperfection=sb.Imperfection(point_load=load))
