"""Force-displacement curves: Qiu's three modes, arches in closed form, finite elements, no branch missed."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.optimize import minimize

import snapbeam as sb
from snapbeam.model import default_values, equilibrium_paths
from snapbeam.model.equilibria import equilibria_of
from snapbeam.util.validation import InputError

PI = np.pi
BEAM = sb.Beam(length=3e-3, thickness=1e-5, width=5e-4, density=2330.0, young_modulus=169e9, axial_load=0.0)
PINNED = BEAM.replace(boundary=sb.BoundaryConditions(left_rotational_stiffness=0.0, right_rotational_stiffness=0.0))


def arch(rise: float, modes: int = 3, beam: sb.Beam = BEAM, **more: float) -> sb.ReducedModel:
    """A rise in thicknesses."""
    shape = sb.Imperfection(midspan_amplitude=rise * beam.thickness, **more)
    return sb.ReducedModel.from_beam(beam, modes=modes, imperfection=shape)


@pytest.mark.slow
def test_three_modes_of_qiu_lang_and_slocum() -> None:
    """Their F1 (first mode), F2 and F3 (second and third mode branch off), F L^3/(E I h) over d/h downwards."""
    ratio = 6.0
    curve = sb.force_displacement(arch(ratio), 0.5)
    rise = ratio * BEAM.thickness
    down = 1.0 - curve.displacement.values / rise
    force = -curve.force.values * BEAM.length**3 / (BEAM.bending_stiffness * rise)
    root = np.sqrt(0.25 - 4.0 / (3.0 * ratio**2))
    primary = 1.5 * PI**4 * ratio**2 * down * (down - 1.5 + root) * (down - 1.5 - root)
    second_wavenumber = 8.986818915818128  # tan(x/2) = x/2
    second = 2.0 * PI**4 + 0.5 * PI**2 * (second_wavenumber**2 - 4.0 * PI**2) * (1.0 - down)
    third = 8.0 * PI**4 - 6.0 * PI**4 * down
    branch = curve.branch.values
    for number, exact in enumerate((primary, second, second, third, third)):
        at = branch == number
        assert at.sum() > 20
        np.testing.assert_allclose(force[at], exact[at], rtol=0.0, atol=1e-6 * np.abs(exact).max())
    kinds = curve.critical_kind.values
    found = np.sort(1.0 - curve.critical_displacement.values[kinds == "limit"] / rise)
    cubic = np.poly1d([1.0]) * np.poly1d([1.0, 0.0]) * np.poly1d([1.0, -1.5 + root]) * np.poly1d([1.0, -1.5 - root])
    np.testing.assert_allclose(found, np.sort(cubic.deriv().roots.real), rtol=1e-9)
    # the published line 4.18 - 2.18 d/h rounds the wavenumber; many modes change the snap-through force by 0.3 %
    many = sb.force_displacement(arch(ratio, 12), 0.5)
    assert float(many.snap_through_force) == pytest.approx(float(curve.snap_through_force), rel=4e-3)


def test_limit_load_of_a_pinned_arch() -> None:
    """Timoshenko and Gere's one-term load of a half-sine arch, 1 + sqrt(4 (1 - m)^3/(27 m^2)), m = 4 I/(A a^2)."""
    model = arch(2.0, 1, PINNED)
    rise = 2.0 * BEAM.thickness
    m = 4.0 * BEAM.second_moment / (BEAM.area * rise**2)
    unit = PI**4 * BEAM.bending_stiffness * rise / (2.0 * BEAM.length**3)
    branch = np.sqrt(4.0 * (1.0 - m) ** 3 / (27.0 * m**2))
    curve = sb.force_displacement(model, 0.5)
    assert float(curve.snap_through_force) == pytest.approx(-unit * (1.0 + branch), rel=1e-10)
    assert float(curve.snap_back_force) == pytest.approx(-unit * (1.0 - branch), rel=1e-10)
    # a lower arch, m > 1, has no limit point
    low = sb.force_displacement(arch(0.5, 1, PINNED), 0.5)
    assert low.sizes["critical_point"] == 0
    assert np.isnan(low.snap_through_force)
    assert (low.unstable_directions == 0).all()


def test_sideways_buckling_of_a_pinned_arch() -> None:
    """The second mode branches off where the compression is 4 pi^2 E I/L^2."""
    curve = sb.force_displacement(arch(6.0, 2, PINNED), 0.5)
    shape = PINNED.buckling_modes(2).shape(0.5 * BEAM.length)[0]
    first, second = (n**2 * PI**2 * BEAM.bending_stiffness / BEAM.length**2 for n in (1, 2))
    rise = 6.0 * BEAM.thickness
    # gamma (s0 - s) is the compression
    place = np.sqrt((rise / shape) ** 2 - second / PINNED.nonlinear_stiffness) * shape
    force = ((first - second) * place - first * rise) / shape**2
    assert curve.attrs["snap_through_kind"] == "bifurcation"
    assert float(curve.snap_through_displacement) == pytest.approx(place, rel=1e-9)
    assert float(curve.snap_through_force) == pytest.approx(force, rel=1e-9)


@pytest.mark.slow
def test_many_modes_against_the_beam_equation() -> None:
    """A clamped buckled beam under E I w'''' + P w'' = F delta, where it buckles sideways at k L = 8.9868."""
    wave = 8.986818915818128
    load = 3.0 * 4.0 * PI**2 * BEAM.bending_stiffness / BEAM.length**2
    buckled = BEAM.replace(axial_load=load)
    # the slope of the left half over F/(2 E I k^2), level at the clamp and at the centre
    half = 0.5 * wave
    c = -(1.0 - np.cos(half)) / np.sin(half)
    x, weight = np.polynomial.legendre.leggauss(60)
    z = 0.5 * half * (1.0 + x)
    slope = 1.0 - np.cos(z) + c * np.sin(z)
    k = wave / BEAM.length
    elongation = 2.0 * float(np.sum(0.5 * half * weight * slope**2)) / k * (0.5 / (BEAM.bending_stiffness * k**2)) ** 2
    compression = wave**2 * BEAM.bending_stiffness / BEAM.length**2
    exact = np.sqrt((load - compression) / buckled.nonlinear_stiffness / elongation)
    errors = []
    for modes in (8, 16):
        curve = sb.force_displacement(sb.ReducedModel.from_beam(buckled, modes=modes), 0.5)
        errors.append(abs(float(curve.snap_through_force) / exact - 1.0))
    assert errors[1] < 2e-3
    assert errors[1] < 0.5 * errors[0]


@pytest.mark.slow
@pytest.mark.parametrize(("rise", "location"), [(6.0, 0.5), (6.0, 0.41), (9.0, 0.3)])
def test_no_branch_is_missed(rise: float, location: float) -> None:
    """At any force the curve passes every equilibrium of the independent secular equation, and no other."""
    model = arch(rise, 4)
    curve = sb.force_displacement(model, location, displacement_range=(-3e-4, 3e-4))
    alpha, force = curve.amplitude.values, curve.force.values
    row = model.shape_at(location)
    tension = model.nonlinear_stiffness * np.sum(alpha**2, axis=1)[:, None] * alpha
    residual = model.stiffness * alpha + tension - model.transverse_force - force[:, None] * row
    assert np.abs(residual).max() < 1e-9 * np.abs(tension).max()
    # two points of a branch: the work of the force is the change of energy
    near = np.flatnonzero(np.diff(curve.branch.values) == 0)
    work = 0.5 * (force[near] + force[near + 1]) * np.diff(curve.displacement.values)[near]
    gain = np.diff(curve.energy.values)[near]
    assert np.abs(gain - work).max() < 1e-3 * np.abs(gain).max()
    span = np.ptp(curve.critical_force.values)
    for share in (-0.9, -0.4, -0.05, 0.0, 0.1, 0.35, 0.8):
        given = share * span
        load = model.transverse_force + given * row
        exact = [
            pair
            for pair in equilibria_of(model.stiffness, model.nonlinear_stiffness, load)
            if abs(row @ pair[0]) < 3e-4
        ]
        crossed = near[(force[near] >= given) != (force[near + 1] >= given)]
        assert len(crossed) == len(exact), share
        for each, unstable in exact:
            distance = np.abs(alpha - each).max(axis=1)
            best = int(np.argmin(distance))
            assert distance[best] < 0.03 * np.abs(alpha).max()
            assert unstable in curve.unstable_directions.values[max(best - 2, 0) : best + 3]


@pytest.mark.slow
def test_finite_elements_with_springs() -> None:
    """An arch on rotational springs against Hermite elements with the same tension."""
    unit = BEAM.bending_stiffness / BEAM.length
    ends = sb.BoundaryConditions(left_rotational_stiffness=5.0 * unit, right_rotational_stiffness=12.0 * unit)
    beam = BEAM.replace(boundary=ends)
    rise, load, count = 5.0 * beam.thickness, 0.02, 16
    model = sb.ReducedModel.from_beam(
        beam, modes=16, imperfection=sb.Imperfection(midspan_amplitude=rise, uniform_load=load)
    )
    modal = sb.force_displacement(model, 0.5)
    h, size = beam.length / count, 2 * (count + 1)
    bend = np.array([[12, 6 * h, -12, 6 * h], [6 * h, 4 * h * h, -6 * h, 2 * h * h],
                     [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h * h, -6 * h, 4 * h * h]]) / h**3  # fmt: skip
    geometric = np.array([[36, 3 * h, -36, 3 * h], [3 * h, 4 * h * h, -3 * h, -h * h],
                          [-36, -3 * h, 36, -3 * h], [3 * h, -h * h, -3 * h, 4 * h * h]]) / (30 * h)  # fmt: skip
    mass = np.array([[156, 22 * h, 54, -13 * h], [22 * h, 4 * h * h, 13 * h, -3 * h * h],
                     [54, 13 * h, 156, -22 * h], [-13 * h, -3 * h * h, -22 * h, 4 * h * h]]) * h / 420  # fmt: skip
    k, s, m, push = np.zeros((size, size)), np.zeros((size, size)), np.zeros((size, size)), np.zeros(size)
    for i in range(count):
        at = slice(2 * i, 2 * i + 4)
        k[at, at] += beam.bending_stiffness * bend
        s[at, at] += geometric
        m[at, at] += beam.mass_per_length * mass
        push[at] += load * np.array([h / 2, h * h / 12, h / 2, -h * h / 12])
    k[1, 1] += ends.left_rotational_stiffness
    k[-1, -1] += ends.right_rotational_stiffness
    modes = beam.buckling_modes(1)
    x = np.linspace(0.0, beam.length, count + 1)
    initial = np.column_stack((modes.shape(x)[0], modes.slope(x)[0])).ravel()
    initial *= rise / modes.shape(0.5 * beam.length)[0]
    free = np.array([i for i in range(size) if i not in (0, size - 2)])
    both = np.ix_(free, free)
    k, s, m, push, initial = k[both], s[both], m[both], push[free], initial[free]
    centre = (free == count).astype(float)
    gamma = beam.nonlinear_stiffness
    elements = sb.ReducedModel.from_matrices(
        m, k - gamma * float(initial @ s @ initial) * s, contact_shape=centre, nonlinear_stiffness=gamma,
        transverse_force=k @ initial + push, elongation_matrix=s,
    )  # fmt: skip
    curve = sb.force_displacement(elements, well=modal.attrs["well"])
    for name in ("snap_through_force", "snap_back_force", "snap_through_displacement"):
        assert float(curve[name]) == pytest.approx(float(modal[name]), rel=3e-3)
    assert curve.attrs["snap_through_kind"] == modal.attrs["snap_through_kind"] == "limit"


@pytest.mark.sampled(3)
@pytest.mark.parametrize("modes", [1, pytest.param(3, marks=pytest.mark.slow), pytest.param(8, marks=pytest.mark.slow)])
@pytest.mark.parametrize("law", ["spring", "magnet", "electrode"])
def test_local_forces_where_the_force_acts_add_to_it(modes: int, law: str) -> None:
    """F(w) of the system is that of the beam less the local force at w, at the same amplitudes."""
    level, location = default_values.BEAM.buckling_level, 0.47
    force = {
        "spring": sb.LocalSpring(stiffness=40.0, cubic_stiffness=1e8, location=location),
        "magnet": sb.MagneticForce(strength=2e-9, gap=2.0 * level, location=location),
        "electrode": sb.MagneticForce(strength=2e-9, gap=0.5 * level, location=location),
    }[law]
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=modes)
    curve = sb.force_displacement(sb.System(model, forces=[force]), location, well="lower")
    alpha, row = curve.amplitude.values, model.shape_at(location)
    w = curve.displacement.values
    assert w.max() < force.displacement_range(force.numbers)[1]
    bare = curve.force.values + np.array([force.force_at(each) for each in w])
    tension = model.nonlinear_stiffness * np.sum(alpha**2, axis=1)[:, None] * alpha
    residual = model.stiffness * alpha + tension - bare[:, None] * row
    assert np.abs(residual).max() < 1e-9 * np.abs(tension).max()
    # the two limits, by the derivative of the curve of one mode
    if modes == 1:
        numbers = np.polynomial.Polynomial([0.0, model.stiffness[0], 0.0, model.nonlinear_stiffness])
        stiffness = [force.stiffness_at(each, level) for each in w]
        slope = numbers.deriv()(alpha[:, 0]) / row[0] ** 2 + stiffness
        assert ((slope < 0.0) == (curve.unstable_directions.values > 0))[2:-2].mean() > 0.99
    forces = [force.force_at(float(each)) for each in curve.critical_displacement]
    beam = sb.force_displacement(model, location, well="lower")
    if modes == 1 and law == "spring":
        # gamma' = gamma + k_3 phi^4, K' = K + k phi^2: F = 2/(3 sqrt 3) |K'|^1.5/(phi sqrt gamma')
        k = model.stiffness[0] + force.stiffness * row[0] ** 2
        gamma = model.nonlinear_stiffness + force.cubic_stiffness * row[0] ** 4
        exact = 2.0 / (3.0 * np.sqrt(3.0)) * abs(k) ** 1.5 / (row[0] * np.sqrt(gamma))
        assert float(curve.snap_through_force) == pytest.approx(exact, rel=1e-9)
        assert float(curve.snap_through_force) < float(beam.snap_through_force)
    assert np.isfinite(forces).all()


@pytest.mark.slow
def test_local_forces_anywhere() -> None:
    """A spring and its force elsewhere: every point against a minimum or a root that SciPy finds from nearby."""
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=6)
    system = sb.System(model, forces=[sb.LocalSpring(stiffness=60.0, location=0.3)])
    curve = sb.force_displacement(system, 0.5)
    row = model.shape_at(0.5)
    for i in np.linspace(0, curve.sizes["point"] - 1, 23).astype(int):
        alpha, force = curve.amplitude.values[i], float(curve.force[i])
        assert np.abs(system.potential.gradient(alpha) - force * row).max() < 1e-12
        if curve.unstable_directions.values[i] == 0:
            size, joule = np.abs(alpha).max(), abs(float(model.well_energy))

            def scaled(a, force=force, size=size, joule=joule):
                return (float(system.potential.energy(size * a)) - force * size * float(a @ row)) / joule

            found = minimize(scaled, 1.001 * alpha / size, options={"gtol": 1e-9})
            np.testing.assert_allclose(size * found.x, alpha, rtol=0.0, atol=1e-4 * size)
    assert float(curve.snap_through_force) != pytest.approx(
        float(sb.force_displacement(model, 0.5).snap_through_force), rel=1e-2
    )
    # force-free points are the equilibria, and the barrier is that of the potential
    assert float(curve.energy_barrier) == pytest.approx(system.potential.barrier(0), rel=1e-12)
    for each in system.potential.equilibria:
        away = np.abs(curve.amplitude.values - each.amplitude).max(axis=1)
        assert away.min() < 1e-2 * np.abs(model.well_amplitude).max()


@pytest.mark.slow
def test_antisymmetric_wells() -> None:
    """A stiff spring at the centre of a beam beyond its second critical load leaves two antisymmetric wells."""
    beam = sb.Beam(length=5e-4, thickness=2e-6, width=2e-5, density=2330.0, young_modulus=160e9, axial_load=1e-3)
    model = sb.ReducedModel.from_beam(beam, modes=4)
    system = sb.System(model, forces=[sb.LocalSpring(stiffness=50.0, location=0.5)])
    potential = system.potential
    assert len(potential.wells) == 2 and all(abs(potential.center(each)) < 1e-12 for each in potential.wells)
    curve = sb.force_displacement(system, 0.25)
    snap, row = float(curve.snap_through_force), model.shape_at(0.25)
    assert float(curve.snap_back_force) == pytest.approx(-snap, rel=1e-9)
    # one well is left just beyond that force, two just below it
    for share, count in ((0.999, 2), (1.001, 1)):
        assert len(dataclasses.replace(potential, constant=share * snap * row).wells) == count
    # a force at the centre, a node of the wells, straightens both alike: they meet at a bifurcation, without a snap
    curve = sb.force_displacement(system, 0.5)
    assert curve.attrs["snap_through_kind"] == curve.attrs["snap_back_kind"] == "none"
    assert curve.branch_kind.values.tolist() == ["primary", "secondary", "secondary"]
    assert curve.critical_kind.values.tolist() == ["bifurcation"] * 2
    assert curve.attrs["incomplete_branches"] == 0


def test_a_branch_that_was_not_followed_to_its_end_is_told(monkeypatch) -> None:
    monkeypatch.setattr(equilibrium_paths, "_STEPS", 30)
    with pytest.warns(sb.DiagnosticWarning, match="branches end for want of steps"):
        curve = sb.force_displacement(arch(2.0, 1), 0.5)
    assert curve.attrs["incomplete_branches"] == 1


@pytest.mark.slow
def test_wells_and_refusals() -> None:
    perfect = sb.ReducedModel.from_beam(default_values.BEAM, modes=3)
    lower, upper = (sb.force_displacement(perfect, 0.5, well=name) for name in ("lower", "upper"))
    assert float(lower.snap_through_force) == pytest.approx(-float(upper.snap_through_force), rel=1e-12)
    assert float(lower.snap_back_force) == pytest.approx(-float(lower.snap_through_force), rel=1e-12)
    assert float(lower.energy_barrier) == pytest.approx(-perfect.well_energy, rel=1e-12)
    assert sb.force_displacement(perfect, 0.5).attrs["well"] == "lower"
    for rise, name in ((12.0, "upper"), (-12.0, "lower")):
        curve = sb.force_displacement(arch(rise), 0.5)
        assert (curve.attrs["well"], curve.attrs["well_chosen_as"]) == (name, "as fabricated")
        assert float(curve.energy_barrier) > float(curve.energy_barrier_back) > 0.0
    assert np.isnan(sb.force_displacement(arch(2.0), 0.5).energy_barrier)
    with pytest.raises(InputError, match="has one well, the upper one"):
        sb.force_displacement(arch(2.0), 0.5, well="lower")
    with pytest.raises(InputError, match="must be given, in"):
        sb.force_displacement(perfect)
    with pytest.raises(InputError, match="must be a number in"):
        sb.force_displacement(perfect, 1.2)
    with pytest.raises(InputError, match="of which the second is larger"):
        sb.force_displacement(perfect, 0.5, displacement_range=(1e-3, -1e-3))
    with pytest.raises(InputError, match="must contain a part of the curve"):
        sb.force_displacement(arch(2.0, 1), 0.5, displacement_range=(1e-9, 1.0001e-9))
    linear = sb.ReducedModel.from_matrices([[1.0]], [1.0], contact_shape=[1.0])
    with pytest.raises(InputError, match="must be greater than 0"):
        sb.force_displacement(linear)
