"""Ends that turn or give way: closed forms of pinned beams, orthogonality, the limits of clamped and pinned ends."""

from __future__ import annotations

import math

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.model.buckling_modes import BucklingModes, SpringModes
from snapbeam.util.validation import InputError

BEAM = default_values.BEAM
LENGTH = BEAM.length
UNIT = BEAM.bending_stiffness / LENGTH


def beam_with(left: float | None, right: float | None, **more) -> sb.Beam:
    """Stiffnesses over E I/L; None clamps."""
    ends = sb.BoundaryConditions(
        left_rotational_stiffness=None if left is None else left * UNIT,
        right_rotational_stiffness=None if right is None else right * UNIT,
    )
    return BEAM.replace(boundary=ends, **more)


@pytest.mark.parametrize(("left", "right"), [(0.0, 0.0), (3.0, 3.0), (0.5, 40.0), (0.0, math.inf), (math.inf, 7.0)])
def test_modes_are_orthogonal(left, right) -> None:
    """Slopes, and curvatures with the springs' energy; and they fulfil the conditions at the ends."""
    count = 24
    modes = SpringModes(LENGTH, count, left, right)
    nodes, weights = np.polynomial.legendre.leggauss(600)
    x, weight = 0.5 * LENGTH * (1.0 + nodes), 0.5 * LENGTH * weights
    slope, bent = modes.slope(x), modes.curvature(x)
    np.testing.assert_allclose((slope * weight) @ slope.T, np.eye(count), rtol=0.0, atol=1e-12)
    energy = (bent * weight) @ bent.T
    for at, stiffness, outward in ((0.0, left, 1.0), (LENGTH, right, -1.0)):
        turn, moment = modes.slope(at), modes.curvature(at)
        scale = modes.wavenumber * np.abs(slope).max()
        if math.isinf(stiffness):
            np.testing.assert_allclose(turn, 0.0, atol=1e-11 * np.abs(slope).max())
            continue
        np.testing.assert_allclose(moment - outward * stiffness / LENGTH * turn, 0.0, atol=1e-11 * scale.max())
        energy += stiffness / LENGTH * np.outer(turn, turn)
    k = modes.wavenumber
    np.testing.assert_allclose(energy / np.outer(k, k), np.eye(count), rtol=0.0, atol=1e-11)
    np.testing.assert_allclose(modes.shape(np.array([0.0, LENGTH])), 0.0, atol=1e-14)
    shapes = modes.shape(x)
    np.testing.assert_allclose(modes.overlap, (shapes * weight) @ shapes.T, rtol=0.0, atol=1e-13 * modes.overlap.max())
    assert (np.diff(k) > 0.0).all()


def test_limits_of_the_springs() -> None:
    """An infinite spring clamps, and the error falls in proportion to its softness; none at all pins."""
    clamped, x = BucklingModes(LENGTH, 12), np.linspace(0.0, LENGTH, 101)
    np.testing.assert_allclose(SpringModes(LENGTH, 12, math.inf, math.inf).shape(x), clamped.shape(x), atol=1e-15)
    errors = [
        np.abs(SpringModes(LENGTH, 12, k, k).wavenumber / clamped.wavenumber - 1.0).max() for k in (1e4, 1e6, 1e8)
    ]
    assert errors == pytest.approx([2e-4, 2e-6, 2e-8], rel=1e-3)
    index = np.arange(1, 13)
    pinned = SpringModes(LENGTH, 12, 0.0, 0.0)
    np.testing.assert_allclose(pinned.wavenumber * LENGTH, index * np.pi, rtol=1e-14)
    shape = np.sqrt(2.0 * LENGTH) / (np.pi * index[:, None]) * np.sin(np.pi * index[:, None] * x / LENGTH)
    np.testing.assert_allclose(pinned.shape(x), shape, rtol=0.0, atol=1e-15)
    soft = SpringModes(LENGTH, 12, 1e-7, 1e-7)
    np.testing.assert_allclose(soft.wavenumber, pinned.wavenumber, rtol=1e-7)
    # stiffer and stiffer: every wavenumber rises
    ladder = np.array([SpringModes(LENGTH, 6, k, 2.0 * k).wavenumber for k in (0.0, 0.1, 1.0, 10.0, 1e3)])
    assert (np.diff(ladder, axis=0) > 0.0).all()


def test_pinned_beam_in_closed_form() -> None:
    """omega_i^2 of a straight and of a buckled pinned beam, its critical load, wells and mass."""
    pinned = beam_with(0.0, 0.0)
    euler = math.pi**2 * BEAM.bending_stiffness / LENGTH**2
    assert pinned.critical_load == pytest.approx(euler, rel=1e-14)
    assert pinned.second_critical_load == pytest.approx(4.0 * euler, rel=1e-14)
    index = np.arange(1, 9)
    unit = (math.pi / LENGTH) ** 2 * math.sqrt(BEAM.bending_stiffness / BEAM.mass_per_length) / (2.0 * math.pi)
    straight = pinned.replace(axial_load=0.4 * euler)
    expected = unit * index * np.sqrt(index**2 - 0.4)
    np.testing.assert_allclose(sb.ReducedModel.from_beam(straight, modes=8).natural_frequencies, expected, rtol=1e-11)
    np.testing.assert_allclose(sb.model.exact_natural_frequencies(straight, 8), expected, rtol=1e-11)
    # w = b sin(pi x/L): the i-th frequency by i^2 (i^2 - 1), the first by b^2/(2 r^2)
    square = (index**2 * (index**2 - 1)).astype(float)
    square[0] = 0.5 * (BEAM.buckling_level / BEAM.radius_of_gyration) ** 2
    expected = np.sort(unit * np.sqrt(square))
    np.testing.assert_allclose(sb.ReducedModel.from_beam(pinned, modes=8).natural_frequencies, expected, rtol=1e-11)
    np.testing.assert_allclose(sb.model.exact_natural_frequencies(pinned, 8), expected, rtol=1e-10)
    model = sb.ReducedModel.from_beam(pinned, modes=8)
    assert float(model.midspan_shape @ model.well_amplitude) == pytest.approx(-BEAM.buckling_level, rel=1e-14)
    np.testing.assert_allclose(model.mass, np.diag(model.mass.diagonal()), atol=1e-14 * model.mass.max())


@pytest.mark.slow
def test_static_snap_of_a_pinned_beam() -> None:
    """A force at the centre of a high beam: it gives way sideways, F = P_2 sqrt(8 s/(3 L)), gamma s = P - P_2."""
    euler = math.pi**2 * BEAM.bending_stiffness / LENGTH**2
    pinned = beam_with(0.0, 0.0, axial_load=10.0 * euler)
    second, s = 4.0 * euler, 6.0 * euler / pinned.nonlinear_stiffness
    closed = second * math.sqrt(8.0 * s / (3.0 * LENGTH))

    def holds(force: float) -> bool:
        return sb.ReducedModel.from_beam(pinned, modes=64, imperfection=sb.Imperfection(point_load=force)).is_bistable

    low, high = 0.5 * closed, 1.5 * closed
    assert holds(low)
    assert not holds(high)
    for _ in range(24):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if holds(middle) else (low, middle)
    assert low == pytest.approx(closed, rel=1e-4)


@pytest.mark.parametrize(("left", "right"), [(5.0, 5.0), (2.0, None), (0.0, 40.0), (None, None)])
def test_frequencies_against_finite_elements(left, right) -> None:
    """100 Hermite elements with the springs and the rank-one term of the buckled shape."""
    beam = beam_with(left, right)
    exact = sb.model.exact_natural_frequencies(beam, 6)
    np.testing.assert_allclose(finite_elements(beam, left, right, 6), exact, rtol=2e-5)
    reduced = sb.ReducedModel.from_beam(beam, modes=64).natural_frequencies[:6]
    assert (reduced >= exact * (1.0 - 1e-9)).all()
    np.testing.assert_allclose(reduced, exact, rtol=2e-4)
    np.testing.assert_allclose(
        sb.model.exact_natural_frequencies(beam_with(1e9, 1e9), 6),
        sb.model.exact_natural_frequencies(BEAM, 6),
        rtol=1e-8,
    )


def finite_elements(beam: sb.Beam, left: float | None, right: float | None, count: int) -> np.ndarray:
    import scipy.linalg

    elements = 100
    h, size = LENGTH / elements, 2 * (elements + 1)
    bend = np.array([[12, 6 * h, -12, 6 * h], [6 * h, 4 * h * h, -6 * h, 2 * h * h],
                     [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h * h, -6 * h, 4 * h * h]]) / h**3  # fmt: skip
    geo = np.array([[36, 3 * h, -36, 3 * h], [3 * h, 4 * h * h, -3 * h, -h * h],
                    [-36, -3 * h, 36, -3 * h], [3 * h, -h * h, -3 * h, 4 * h * h]]) / (30 * h)  # fmt: skip
    mass = np.array([[156, 22 * h, 54, -13 * h], [22 * h, 4 * h * h, 13 * h, -3 * h * h],
                     [54, 13 * h, 156, -22 * h], [-13 * h, -3 * h * h, -22 * h, 4 * h * h]]) * h / 420  # fmt: skip
    k, g, m = (np.zeros((size, size)) for _ in range(3))
    for e in range(elements):
        part = slice(2 * e, 2 * e + 4)
        k[part, part] += beam.bending_stiffness * bend
        g[part, part] += geo
        m[part, part] += beam.mass_per_length * mass
    free = np.ones(size, dtype=bool)
    free[[0, size - 2]] = False
    for at, spring in ((1, left), (size - 1, right)):
        if spring is None:
            free[at] = False
        else:
            k[at, at] += spring * UNIT
    # the buckled shape is the first buckling mode of the same elements
    kf, gf, mf = (matrix[np.ix_(free, free)] for matrix in (k, g, m))
    load, shape = scipy.linalg.eigh(kf, gf, subset_by_index=[0, 0])
    shape = shape[:, 0]
    full = np.zeros(size)
    full[free] = shape
    shape = shape * beam.buckling_level / full[2 * (elements // 2)]
    push = gf @ shape
    tangent = kf - load[0] * gf + 2.0 * beam.nonlinear_stiffness * np.outer(push, push)
    square = scipy.linalg.eigh(tangent, mf, eigvals_only=True, subset_by_index=[0, count - 1])
    return np.sqrt(square) / (2.0 * math.pi)


def test_supports_that_give_way() -> None:
    """The stretching shares with the supports: gamma, and the load that the same height asks for."""
    rigid = BEAM.nonlinear_stiffness
    soft = BEAM.replace(boundary=sb.BoundaryConditions(axial_support_stiffness=2.0 * rigid))
    assert soft.nonlinear_stiffness == pytest.approx(0.5 * rigid, rel=1e-14)
    assert soft.axial_load - soft.critical_load == pytest.approx(
        0.5 * (BEAM.axial_load - BEAM.critical_load), rel=1e-12
    )
    model = sb.ReducedModel.from_beam(soft, modes=8)
    assert float(model.midspan_shape @ model.well_amplitude) == pytest.approx(-BEAM.buckling_level, rel=1e-12)
    stiff = sb.ReducedModel.from_beam(BEAM, modes=8)
    assert model.natural_frequencies[0] < stiff.natural_frequencies[0]
    np.testing.assert_allclose(
        sb.model.exact_natural_frequencies(soft, 4)[:2], model.natural_frequencies[:2], rtol=1e-2
    )
    nearly = BEAM.replace(boundary=sb.BoundaryConditions(axial_support_stiffness=1e12 * rigid))
    np.testing.assert_allclose(
        sb.ReducedModel.from_beam(nearly, modes=8).natural_frequencies, stiff.natural_frequencies, rtol=1e-11
    )


def test_quasi_static_threshold_follows_the_first_mode() -> None:
    pinned = beam_with(0.0, 0.0)
    x = np.array([0.2, 0.5, 0.8])
    np.testing.assert_allclose(sb.model.quasi_static_threshold(x, 2.0, pinned), 2.0 * np.sin(np.pi * x), rtol=1e-13)
    np.testing.assert_array_equal(
        sb.model.quasi_static_threshold(x, 2.0, BEAM), sb.model.quasi_static_threshold(x, 2.0)
    )


def test_slow_striker_snaps_a_pinned_beam_at_the_closed_form() -> None:
    """One mode, Omega = 0.02: the run's threshold is Eq. (21) with the pinned mode, as it is between clamps."""
    model = sb.ReducedModel.from_beam(beam_with(0.0, 0.0), modes=1, damping_ratio=0.05)
    location = 0.3
    level = float(sb.model.quasi_static_threshold(location, 0.02, model.beam))

    def crosses(share: float) -> bool:
        drive = sb.Sine(frequency_ratio=0.02, velocity_amplitude=share * level)
        system = sb.System(
            model, contacts=[sb.Contact(default_values.CONTACT, sb.Striker(drive=drive, location=location))]
        )
        return sb.simulate(system, sb.Integration(cycles=1)).summary.zero_crossings > 0

    assert not crosses(0.85)
    assert crosses(1.1)


def test_by_name_and_in_files(tmp_path) -> None:
    system = sb.System(
        sb.ReducedModel.from_beam(beam_with(3.0, None), modes=3),
        contacts=[sb.Contact(default_values.CONTACT, sb.Shaker(frequency_ratio=1.2, velocity_amplitude=0.1))],
    )  # fmt: skip
    assert system.get("boundary.left_rotational_stiffness") == pytest.approx(3.0 * UNIT)
    system.save(tmp_path / "a.toml")
    assert sb.System.load(tmp_path / "a.toml") == system
    clamped = system.replace(boundary=None)
    assert clamped.model.beam == BEAM
    again = clamped.replace(**{"boundary.left_rotational_stiffness": 3.0 * UNIT})
    assert again == system
    assert again.replace(**{"beam.width": 0.02}).model.beam.boundary == again.model.beam.boundary
    swept = sb.sweep(system, {"boundary.left_rotational_stiffness": [0.0, 3.0 * UNIT]}, sb.Integration(cycles=2))
    assert swept.response_class.dims == ("left_rotational_stiffness",)
    assert (np.diff(swept.reference_frequency.values) != 0.0).all()
    with pytest.raises(InputError, match="left"):
        sb.BoundaryConditions(left_rotational_stiffness=-1.0)
    with pytest.raises(InputError, match=r"boundary = 3\.0: must be"):
        BEAM.replace(boundary=3.0)
