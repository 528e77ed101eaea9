"""The potential energy of a system: closed forms, gradients, and rest states that runs stay in."""

from __future__ import annotations

import math
import warnings

import numpy as np
import pytest
from scipy.optimize import brentq, minimize

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.model.local_force import LOCAL_FORCES
from snapbeam.model.potential import Potential

LEVEL = default_values.BEAM.buckling_level


def model_of(modes: int, **values) -> sb.ReducedModel:
    return sb.ReducedModel.from_beam(default_values.BEAM, modes=modes, damping_ratio=0.05, **values)


def test_a_spring_at_the_centre_of_one_mode():
    """alpha^2 = -(K0 + k phi^2)/gamma, omega^2 = -2 (K0 + k phi^2)/m, barrier (K0 + k phi^2)^2/(4 gamma)."""
    model, k = model_of(1), 300.0
    potential = sb.System(model, forces=[sb.LocalSpring(stiffness=k, location=0.5)]).potential
    stiffness = float(model.stiffness[0] + k * model.midspan_shape[0] ** 2)
    well = math.sqrt(-stiffness / model.nonlinear_stiffness)
    lower, upper = potential.wells
    assert [float(each.amplitude[0]) for each in (lower, upper)] == pytest.approx([-well, well], rel=1e-12)
    frequency = math.sqrt(-2.0 * stiffness / float(model.mass[0, 0])) / (2.0 * math.pi)
    assert potential.natural_frequencies(lower) == pytest.approx([frequency], rel=1e-10)
    assert potential.barrier(0) == pytest.approx(stiffness**2 / (4.0 * model.nonlinear_stiffness), rel=1e-10)
    assert [each.unstable_directions for each in potential.equilibria] == [0, 0, 1]
    stiff = sb.System(model, forces=[sb.LocalSpring(stiffness=1e4, location=0.5)]).potential
    assert len(stiff.equilibria) == 1 and stiff.wells[0].amplitude == pytest.approx(0.0, abs=1e-12)


@pytest.mark.slow
def test_pull_in_at_a_third_of_the_gap():
    """A linear spring under a/(g - u)^2: two equilibria below a = 4 k g^3/27, none above, u = g/3 there."""
    k, gap = 2.0, 3e-6
    model = sb.ReducedModel.from_matrices([[1e-9]], [[k]], contact_shape=[1.0], length_scale=gap)
    critical = 4.0 * k * gap**3 / 27.0

    def potential(share: float) -> Potential:
        return sb.System(model, forces=[sb.MagneticForce(strength=share * critical, gap=gap)]).potential

    below = potential(1.0 - 1e-6)
    assert [each.unstable_directions for each in below.equilibria] == [0, 1]
    places = [float(each.amplitude[0]) / gap for each in below.equilibria]
    assert places == pytest.approx([1.0 / 3.0, 1.0 / 3.0], abs=1e-3) and places[0] < places[1]
    exact = brentq(lambda x: x * (1.0 - x) ** 2 - 0.5 * 4.0 / 27.0, 0.0, 1.0 / 3.0, xtol=1e-15)
    assert float(potential(0.5).wells[0].amplitude[0]) / gap == pytest.approx(exact, rel=1e-10)
    soft = k - 2.0 * 0.5 * critical / (gap * (1.0 - exact)) ** 3
    assert potential(0.5).natural_frequencies(potential(0.5).wells[0])[0] == pytest.approx(
        math.sqrt(soft / 1e-9) / (2.0 * math.pi), rel=1e-9
    )
    assert potential(0.5).saddles[0].wells in ((0, None), (None, 0))
    assert potential(1.0 + 1e-6).equilibria == ()
    with pytest.raises(sb.InputError, match="leave no well where a run begins"):
        print(sb.System(model, forces=[sb.MagneticForce(strength=1.1 * critical, gap=gap)]).start_state)


@pytest.mark.slow
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_pull_in_voltage_of_an_electrode(side):
    """V^2 = 8 k g^3/(27 eps_0 A), on either side; a run beyond it ends, and one below it comes to rest."""
    mass, k, gap, area = 1e-9, 2.0, 3e-6, 4e-8
    model = sb.ReducedModel.from_matrices([[mass]], [[k]], contact_shape=[1.0], length_scale=gap, damping_ratio=0.2)
    critical = math.sqrt(8.0 * k * gap**3 / (27.0 * 8.8541878188e-12 * area))

    def system(share: float) -> sb.System:
        electrode = sb.ElectrostaticForce(voltage=share * critical, area=area, gap=side * gap)
        straight = sb.State(amplitude=[0.0], velocity=[0.0])
        return sb.System(model, forces=[electrode], initial_state=straight)

    below = system(1.0 - 1e-6).potential
    assert [each.unstable_directions for each in below.equilibria] == [0, 1]
    for each in below.equilibria:
        assert float(each.amplitude[0]) / (side * gap) == pytest.approx(1.0 / 3.0, abs=1e-3)
    assert system(1.0 + 1e-6).potential.equilibria == ()
    rest = sb.simulate(system(0.8), sb.Integration(cycles=100)).final_state
    well = system(0.8).potential.wells[0].amplitude
    assert rest.amplitude == pytest.approx(well, rel=1e-8)
    pulled = sb.simulate(system(1.2), sb.Integration(cycles=100))
    assert pulled.summary.status is sb.RunStatus.DIVERGED
    assert "as at pull-in" in pulled.dataset.attrs["status"]


def test_electrodes_and_magnets_stand_on_one_side():
    for kind, name in ((sb.MagneticForce, "strength"), (sb.ElectrostaticForce, "voltage")):
        more = {"area": 1e-9} if kind is sb.ElectrostaticForce else {}
        with pytest.raises(sb.InputError, match=r"force\.gap = 0: must differ from 0"):
            kind(**{name: 1.0}, gap=0.0, location=0.5, **more)


def test_a_spring_on_eight_modes_against_minimisation():
    """The shallow silicon arch with a spring of 5 N/m at its centre, by SciPy on an energy written here."""
    beam = sb.Beam(length=8e-4, thickness=3e-6, width=3e-5, density=2330.0, young_modulus=169e9, axial_load=0.0)
    model = sb.ReducedModel.from_beam(beam, modes=8, imperfection=sb.Imperfection(midspan_amplitude=6e-6))
    spring = sb.LocalSpring(stiffness=5.0, cubic_stiffness=2e11, location=0.5)
    potential = Potential.of(model, [spring])
    unit = float(np.abs(model.well_amplitude).max())
    row = model.midspan_shape

    def energy(x):
        alpha = unit * x
        u = float(row @ alpha)
        tension = 0.25 * model.nonlinear_stiffness * float(alpha @ alpha) ** 2
        quadratic = 0.5 * float(alpha @ (model.stiffness * alpha)) - float(model.transverse_force @ alpha)
        return 1e12 * (quadratic + tension + 0.5 * 5.0 * u * u + 0.25 * 2e11 * u**4)

    found = minimize(energy, model.well_amplitude / unit, method="BFGS", options={"gtol": 1e-9})
    assert float(row @ (unit * found.x)) == pytest.approx(potential.center(potential.wells[0]), rel=1e-6)
    assert 1e-12 * found.fun == pytest.approx(potential.wells[0].energy, rel=1e-9)
    assert potential.center(potential.wells[0]) < 0.95 * float(row @ model.well_amplitude)


def test_a_constant_force_is_that_of_the_model():
    """An external force and the same transverse force of the model have the same wells, frequencies and curves."""
    model, force = model_of(6), -0.05
    external = sb.ExternalForce(history=sb.ConstantForce(force=force), location=0.37)
    system = sb.System(model, forces=[external])
    load = force * model.shape_at(0.37)
    given = sb.ReducedModel.from_matrices(
        model.mass, model.stiffness, contact_shape=model.shape_at(0.5), midspan_shape=model.midspan_shape,
        nonlinear_stiffness=model.nonlinear_stiffness, transverse_force=load, reference_frequency=80.0,
    )  # fmt: skip
    potential = system.potential
    np.testing.assert_allclose(
        [each.amplitude for each in potential.equilibria], [each.amplitude for each in given.equilibria], rtol=0.0,
        atol=1e-10 * float(np.abs(model.well_amplitude).max()),
    )  # fmt: skip
    np.testing.assert_allclose(potential.natural_frequencies(potential.wells[0]), given.natural_frequencies, rtol=1e-8)
    curves = sb.force_displacement(system, 0.5), sb.force_displacement(given, 0.5)
    assert float(curves[0].snap_through_force) == pytest.approx(float(curves[1].snap_through_force), rel=1e-8)
    barrier = given.saddle_energy - given.landscape.lower.energy
    assert potential.barrier(0) == pytest.approx(barrier, rel=1e-8)


def random_system(rng: np.random.Generator) -> sb.System:
    modes = int(rng.integers(1, 7))
    model = model_of(modes, imperfection=rng.choice([None, sb.Imperfection(midspan_amplitude=2e-6)]))
    gap = 3.0 * default_values.BEAM.buckling_level
    forces = []
    for _ in range(int(rng.integers(0, 3))):
        at = float(rng.uniform(0.2, 0.8))
        forces.append(rng.choice([
            sb.LocalSpring(stiffness=float(rng.uniform(1.0, 300.0)), cubic_stiffness=float(rng.uniform(0.0, 1e9)), location=at),
            sb.LocalSpring(stiffness=float(rng.uniform(1e-4, 1e-2)), location=at, coordinate="rotation"),
            sb.MagneticForce(strength=float(rng.uniform(1e-10, 3e-9)), gap=gap, location=at),
        ]))  # fmt: skip
    if rng.random() < 0.5:
        constant, at = float(rng.normal(0.0, 0.01)), float(rng.uniform(0.2, 0.8))
        forces.append(sb.ExternalForce(history=sb.ConstantForce(force=constant), location=at))
    return sb.System(model, forces=forces)


def test_gradient_and_tangent_of_random_systems():
    """Differences of the energy and of the gradient; every equilibrium has no gradient."""
    rng = np.random.default_rng(2)
    for _ in range(6):
        potential = random_system(rng).potential
        size = float(np.abs(potential.model.well_amplitude).max())
        alpha = potential.model.well_amplitude + 0.1 * size * rng.standard_normal(potential.model.modes)
        change = 1e-3 * size * rng.standard_normal(alpha.size)
        weights = ((1, 45.0 / 60.0), (2, -9.0 / 60.0), (3, 1.0 / 60.0))
        slope = sum(
            w * (potential.energy(alpha + k * change) - potential.energy(alpha - k * change)) for k, w in weights
        )
        assert slope == pytest.approx(float(potential.gradient(alpha) @ change), rel=1e-8)
        bend = sum(
            w * (potential.gradient(alpha + k * change) - potential.gradient(alpha - k * change)) for k, w in weights
        )
        product = potential.tangent(alpha) @ change
        np.testing.assert_allclose(bend, product, rtol=0.0, atol=1e-7 * np.abs(product).max())
        for each in potential.equilibria:
            terms = np.abs(potential.terms(each.amplitude)).sum(axis=0).max()
            assert np.abs(potential.gradient(each.amplitude)).max() <= 1e-10 * terms


@pytest.mark.slow
def test_the_solver_pushes_as_the_potential_does():
    """The velocity after three short times from rest gives the acceleration, which is minus the gradient."""
    rng = np.random.default_rng(53)
    for _ in range(500):
        system = random_system(rng)
        model, potential = system.model, system.potential
        size = np.abs(model.well_amplitude).max() * np.exp(-np.arange(model.modes))
        alpha = size * rng.normal(size=model.modes)
        if not potential.holds(alpha):
            continue
        start = sb.State(amplitude=alpha, velocity=np.zeros(model.modes))
        h, period = 2.0**-20, 1.0 / model.reference_frequency  # of whole ticks
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            rates = [sb.advance(system, start, periods=k * h).velocity / (k * h * period) for k in (1, 2, 4)]
        force = model.mass @ (8.0 * rates[0] - 6.0 * rates[1] + rates[2]) / 3.0
        terms = np.abs(potential.terms(alpha)).sum(axis=0).max()
        assert np.abs(force + potential.gradient(alpha)).max() < 1e-10 * terms


@pytest.mark.slow
def test_runs_stay_at_rest():
    """A damped run that begins at rest drifts by less than 1e-8 of b in 1,000 cycles, and one beside it comes back."""
    rng = np.random.default_rng(5)
    for _ in range(12):
        system = random_system(rng)
        system = system.replace(forces=system.local_forces)
        if not system.forces or any(not isinstance(each, sb.LocalSpring) for each in system.forces):
            continue
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            own = float(system.model.midspan_shape @ system.start_state.amplitude) / system.model.length_scale
            at_rest = system.replace(initial_state=system.start_state)
            run = sb.simulate(at_rest, sb.Integration(cycles=1000), sample_times=[0.0, 1.0])
            assert np.abs(run.dataset.midspan_displacement.values - own).max() < 1e-8
            beside = sb.State(amplitude=1.01 * system.start_state.amplitude)
            back = sb.simulate(system.replace(initial_state=beside), sb.Integration(cycles=1000))
            np.testing.assert_allclose(
                back.final_state.amplitude,
                system.start_state.amplitude,
                rtol=0.0,
                atol=1e-7 * np.abs(system.start_state.amplitude).max(),
            )


@pytest.mark.parametrize("law", [each for each in LOCAL_FORCES.values() if each.__module__.startswith("snapbeam.")])
def test_laws_of_the_package(law):
    """Force, energy and stiffness agree with differences for every registered law."""
    constants = {name: 1.3 for name in law.numbers_type()._fields}
    one = law(location=0.5, **constants)
    for u in (-0.3, 0.01, 0.8):
        slope = (one.energy_at(u + 1e-5) - one.energy_at(u - 1e-5)) / 2e-5
        assert one.force_at(u) == pytest.approx(-slope, rel=1e-7, abs=1e-12)
        bend = (one.force_at(u + 1e-5) - one.force_at(u - 1e-5)) / 2e-5
        assert one.stiffness_at(u, 1.0) == pytest.approx(-bend, rel=1e-7, abs=1e-10)


def test_a_law_with_a_force_has_an_energy():
    """The energy balance of a run would be wrong without it."""
    with pytest.raises(sb.InputError, match=r"Bare\.energy: must be given for a law with a force"):
        type("Bare", (sb.LocalForce,), {"force": staticmethod(lambda law, displacement: -displacement)})


def test_a_force_that_leaves_one_well_has_a_diagnostic():
    one = sb.System(model_of(1), forces=[sb.LocalSpring(stiffness=5000.0, location=0.5)])
    (found,) = [each for each in one.diagnostics() if each.code == "other-wells"]
    assert "leaves 1 wells, while response classes" in found.message
    shifted = sb.System(model_of(1), forces=[sb.MagneticForce(strength=8e-9, gap=LEVEL * 2.5, location=0.5)])
    assert not [each for each in shifted.diagnostics() if each.code == "other-wells"]


@pytest.mark.slow
@pytest.mark.parametrize("modes", [1, 4])
@pytest.mark.parametrize("rise", [0.0, pytest.param(2e-6, marks=pytest.mark.slow)])
@pytest.mark.parametrize("side", [pytest.param("below", marks=pytest.mark.slow), "above"])
def test_classes_count_crossings_of_the_saddle_of_the_system(modes, rise, side):
    """Released at rest on either side of the saddle that a magnet shifts: the well, and no crossing."""
    shape = sb.Imperfection(midspan_amplitude=rise) if rise else None
    model = model_of(modes, imperfection=shape)
    magnet = sb.MagneticForce(strength=8e-9, gap=LEVEL * 2.5, location=0.5)
    tip = sb.Striker(drive=sb.FixedStop(), gap=5.0 * LEVEL, side=side)
    system = sb.System(model, contacts=[sb.Contact(default_values.CONTACT, tip)], forces=[magnet])
    potential = system.potential
    (saddle,) = [each.equilibrium for each in potential.saddles if set(each.wells) == {0, 1}]
    assert potential.dividing_height == pytest.approx(potential.center(saddle), rel=1e-12)
    assert abs(potential.dividing_height - model.dividing_height) > 0.02 * LEVEL
    for step, well in ((-0.02, "lower"), (0.02, "upper")):
        start = saddle.amplitude + step * LEVEL * model.midspan_shape / float(model.midspan_shape @ model.midspan_shape)
        assert potential.descent(start) == ("lower", "upper").index(well)
        run = sb.simulate(system.replace(initial_state=sb.State(amplitude=start)), sb.Integration(cycles=400))
        assert run.summary.zero_crossings == 0
        assert run.summary.final_well == {"lower": -1, "upper": 1}[well]
        assert run.final_state.amplitude == pytest.approx(
            potential.wells[("lower", "upper").index(well)].amplitude, abs=1e-6
        )


def test_magnets_on_both_sides_at_nearly_the_same_place():
    """Their poles meet only far beyond the wells: two wells, their saddle and one in front of each magnet."""
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=2)
    magnets = [
        sb.MagneticForce(strength=1.86e-10, gap=-1.11e-3, location=0.363),
        sb.MagneticForce(strength=5.0e-10, gap=9.04e-4, location=0.340),
    ]
    potential = sb.System(model, forces=magnets).potential
    far = [np.abs(each.amplitude).max() > 20.0 * np.abs(potential.size).max() for each in potential.equilibria]
    directions = [each.unstable_directions for each in potential.equilibria]
    assert sorted(n for n, beyond in zip(directions, far, strict=True) if not beyond) == [0, 0, 1, 1, 1]
    assert [n for n, beyond in zip(directions, far, strict=True) if beyond] in ([], [2])


ATTRACTION = 1e-9


@pytest.mark.sampled(3)
@pytest.mark.parametrize(
    ("modes", "magnets", "directions"),
    [
        # on both sides: next to each, to each pair and to all three
        (
            6,
            [(ATTRACTION, 1.0e-3, 0.3), (ATTRACTION, -1.1e-3, 0.5), (ATTRACTION, 1.0e-3, 0.7)],
            [0, 0, 1, 1, 1, 1, 2, 2, 2, 3],
        ),
        (5, [(3e-9, -1.15e-3, 0.3), (2e-9, 0.9e-3, 0.41), (8e-10, 1.3e-3, 0.73)], [0, 0, 1, 1, 1, 2, 2, 3]),
        # one that repels between two, so near that the beam bends around it
        (5, [(2e-12, -0.9e-3, 0.4), (2.5e-12, -1.15e-3, 0.63), (-2e-9, -0.93e-3, 0.525)], [0, 0, 1, 1, 1, 2]),
    ],
)
def test_equilibria_next_to_several_magnets(modes, magnets, directions):
    """Hilltops between poles whose forces differ much: sum of (-1)^directions = 1 - chi of the faces that attract."""
    forces = [sb.MagneticForce(strength=s, gap=gap, location=x) for s, gap, x in magnets]
    potential = sb.System(model_of(modes), forces=forces).potential
    assert sorted(each.unstable_directions for each in potential.equilibria) == directions
    for each in potential.equilibria:
        # the distance to a pole follows from the amplitudes to their rounding, and so does its force
        rounding = 1e-15 * np.abs(potential.tangent(each.amplitude)) @ np.abs(each.amplitude)
        terms = np.abs(potential.terms(each.amplitude)).sum(axis=0)
        assert (np.abs(potential.gradient(each.amplitude)) <= 1e-10 * terms.max() + 10.0 * rounding).all()


def test_a_start_that_is_a_saddle_now_comes_to_a_well() -> None:
    """A structure between two magnets, x + 50 x^3 = a/(1 - x)^2 - a/(1 + x)^2, begins on the side of its striker."""
    model = sb.ReducedModel.from_matrices(
        [[1.0]], [1.0], contact_shape=[1.0], nonlinear_stiffness=50.0, reference_frequency=0.2
    )
    magnets = [sb.MagneticForce(strength=0.4, gap=gap) for gap in (1.0, -1.0)]
    well = brentq(lambda x: x + 50.0 * x**3 - 0.4 / (1.0 - x) ** 2 + 0.4 / (1.0 + x) ** 2, 0.05, 0.5)
    for side, sign in (("below", -1.0), ("above", 1.0)):
        striker = sb.Striker(drive=sb.FixedStop(), side=side, gap=0.1)
        system = sb.System(model, contacts=[sb.Contact(sb.HertzContact(stiffness=1e3), striker)], forces=magnets)
        assert len(system.potential.wells) == 2
        height = float(system.rest_state.amplitude[0])
        assert height == pytest.approx(sign * well, rel=1e-6)
        assert sb.simulate(system, sb.Integration(cycles=2)).summary.status.name == "OK"
