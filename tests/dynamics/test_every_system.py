"""Maps and tangents of systems whose state is more than the beam's, or whose forces the tangent flow does not contain."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.dynamics.shooting import Family, OrbitNotFoundError, jacobian
from snapbeam.dynamics.stroboscope import Stroboscope
from snapbeam.model import default_values as paper
from snapbeam.util.differences import differences

PRECISE = sb.Integration(accuracy="reference")
SINE = sb.Sine(frequency_ratio=1.3, velocity_amplitude=0.05)
BODY = {"mass": 0.02, "suspension_stiffness": 700.0, "suspension_damping": 0.7}
PIEZO = sb.PiezoelectricHarvester.from_material(
    stress_constant=-16.6, permittivity=25.55e-9, layer_thickness=1e-4, layer_width=paper.BEAM.width, beam=paper.BEAM,
    resistance=1e4, patch_end=0.25, wiring="parallel",
)  # fmt: skip
COIL = sb.ElectromagneticHarvester(
    force_factor=1.5, resistance=30.0, coil_resistance=10.0, inductance=0.05, location=0.4
)
SPRING = sb.LocalSpring(stiffness=50.0, location=0.3)


def system_of(
    modes: int = 2,
    law: Any = paper.CONTACT,
    drive: Any = SINE,
    damping: float = 0.02,
    striker: Any = None,
    **parts: Any,
) -> sb.System:
    """The paper's beam with further parts."""
    model = sb.ReducedModel.from_beam(paper.BEAM, modes=modes, damping_ratio=damping)
    return sb.System(model, contacts=[sb.Contact(law, sb.Striker(drive=drive, **(striker or {})))], **parts)


WHOLE = {"striker": BODY, "harvesters": [PIEZO, COIL], "forces": [SPRING]}


def contraction(system: sb.System) -> float:
    """Rate at which volumes of the state space shrink, 1/s: the sum of all linear rates of loss."""
    rate = float(np.sum(2.0 * system.model.damping_ratio * system.model.omega))
    for contact in system.contacts:
        if contact.striker.mass is not None:
            rate += (contact.striker.suspension_damping or 0.0) / contact.striker.mass
    for each in system.harvesters:
        if isinstance(each, sb.PiezoelectricHarvester):
            rate += 1.0 / (each.resistance * each.capacitance)
        elif each.inductance > 0.0:
            rate += (each.resistance + each.coil_resistance) / each.inductance
    return rate


def settled(flow: Stroboscope, periods: int = 7) -> np.ndarray:
    """A state on the way."""
    return flow.advance(flow.coordinates(), periods).states[0]


def random_system(seed: int) -> sb.System:
    """Conservative forces, a body or none, circuits."""
    rng = np.random.default_rng(seed)
    striker = (
        {"mass": rng.uniform(0.005, 0.03), "suspension_stiffness": rng.uniform(300.0, 900.0), "suspension_damping": rng.uniform(0.1, 1.0)}
        if rng.random() < 0.6
        else {"gap": rng.uniform(0.0, 1e-4)}
    )  # fmt: skip
    circuits = [each for each in (PIEZO, COIL) if rng.random() < 0.5]
    springs = (
        [sb.LocalSpring(stiffness=rng.uniform(0.0, 100.0), location=rng.uniform(0.2, 0.8))]
        if rng.random() < 0.5
        else []
    )
    drive = sb.Sine(frequency_ratio=rng.uniform(0.8, 3.0), velocity_amplitude=rng.uniform(0.02, 0.2))
    return system_of(
        2, drive=drive, damping=rng.uniform(0.005, 0.04), striker=striker, harvesters=circuits, forces=springs
    )


def check_volume(system: sb.System) -> bool:
    """The determinant of the map's derivative at a state; False where an impact grazes."""
    flow = Stroboscope(system, PRECISE)
    try:
        came = jacobian(Family(flow), settled(flow), 1)
    except OrbitNotFoundError:
        return False
    _, volume = np.linalg.slogdet(came.jacobian)
    assert volume == pytest.approx(-contraction(system) * flow.period, abs=1e-7)
    return True


@pytest.mark.slow
def test_volumes_shrink_by_the_losses_of_beam_body_and_circuits() -> None:
    assert check_volume(system_of(**WHOLE))


@pytest.mark.slow
def test_volumes_of_a_hundred_random_systems() -> None:
    assert sum(check_volume(random_system(seed)) for seed in range(100)) >= 90


@pytest.mark.slow
def test_coordinates_hold_the_whole_state() -> None:
    system = system_of(**WHOLE)
    flow = Stroboscope(system, PRECISE)
    assert flow.names[4:] == ("striker_shift[1]", "striker_rate[1]", "circuit[1]", "circuit[2]")
    x = settled(flow)
    assert np.abs(x[4:]).min() > 1e-6
    assert flow.coordinates(flow.state(x)) == pytest.approx(x[None], abs=1e-15)
    run = sb.simulate(flow.starting(x), PRECISE.replace(cycles=1, early_termination=False))
    ended = flow.space.of(run.final_state.flat)[0]
    assert flow.advance(x[None]).states[0] == pytest.approx(ended, abs=1e-8)
    once, twice = flow.advance(x[None]), flow.advance(x[None], 2)
    assert flow.advance(once.states).states == pytest.approx(twice.states, abs=1e-11)


@pytest.mark.slow
def test_orbit_of_a_system_with_all_parts() -> None:
    flow = Stroboscope(system_of(**WHOLE), PRECISE)
    orbit = sb.dynamics.periodic_orbit(flow, flow.advance(flow.coordinates(), 200).states[0])
    assert orbit.residual < 1e-9
    assert math.log(abs(np.prod(orbit.multipliers))) == pytest.approx(-contraction(flow.system) * flow.period, abs=1e-7)
    apart = orbit.coordinates + 1e-3 * np.random.default_rng(1).normal(size=flow.dimension)
    back = flow.advance(apart[None], 200).states[0]
    assert orbit.is_stable
    assert back == pytest.approx(orbit.coordinates, abs=1e-8)


@pytest.mark.slow
def test_all_exponents_add_up_to_the_losses() -> None:
    system = system_of(**WHOLE)
    flow = Stroboscope(system, PRECISE)
    found = sb.dynamics.lyapunov_spectrum(flow, flow.dimension, 20, transient=5)
    assert float(found["exponent"].sum()) == pytest.approx(-contraction(system), rel=1e-5)


PARTS: dict[str, dict[str, Any]] = {
    "hertz": {},
    "power": {"law": sb.PowerLaw(force_at_1um=1.0, exponent=1.4)},
    "kelvin_voigt": {"law": sb.KelvinVoigt(2e5, 3.0)},
    "hunt_crossley": {"law": sb.HuntCrossley(4e8, 1.0)},
    "plastic": {"law": sb.ElasticPlasticContact(loading_stiffness=2e5, unloading_stiffness=8e5)},
    "newton": {"law": sb.Restitution(0.7), "modes": 1},
    "body": {"striker": BODY},
    "circuits": {"harvesters": [PIEZO, COIL]},
    "spring": {"forces": [SPRING]},
    "magnet": {"forces": [sb.MagneticForce(strength=2e-9, gap=2e-3, location=0.4)]},
    "drag": {"forces": [sb.QuadraticDamping(coefficient=0.3, location=0.4)]},
    "friction": {"forces": [sb.CoulombFriction(friction_force=2e-3, smoothing_velocity=0.02, location=0.45)]},
    "force": {"forces": [sb.ExternalForce(history=sb.HarmonicForce(frequency_ratio=1.3, amplitude=0.02), location=0.4)]},
    "base": {"base_excitation": sb.BaseExcitation(motion=sb.AccelerationSine(frequency_ratio=1.3, acceleration_amplitude=0.2))},
    "load": {"axial_load": sb.AxialLoadModulation(motion=sb.HarmonicForce(frequency_ratio=1.3, amplitude=1.0))},
    "whole": WHOLE,
}  # fmt: skip


@pytest.mark.sampled(3)
@pytest.mark.parametrize("name", PARTS)
def test_tangents_are_differences_between_neighbours(name: str) -> None:
    """Of every coordinate, through impacts: releases, yields, jumps of forces and of velocities."""
    drive = sb.Sine(frequency_ratio=1.3, velocity_amplitude=1.0)
    flow = Stroboscope(system_of(**({"drive": drive} | PARTS[name])), PRECISE)
    x = settled(flow)[None]
    hits = flow.advance(x, 40, every=True)
    assert hits.every is not None
    x = next(each for each in hits.every[0] if flow.advance(each[None]).statistics["impacts"][0])[None]

    def advance_rows(rows: np.ndarray, runs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        beside = flow.advance(rows)
        return beside.states, beside.statistics["impacts"]

    came = flow.advance(x, tangents=np.eye(flow.dimension)[None])
    found, error = differences(advance_rows, x, np.eye(flow.dimension)[None])
    assert error.max() < 1e-6
    assert came.tangents is not None
    np.testing.assert_allclose(came.tangents, found, rtol=0.0, atol=1e-6 * np.abs(found).max())


@pytest.mark.parametrize(
    ("part", "name"),
    [
        ("hertz", "velocity_amplitude"), ("hertz", "frequency_ratio"), ("hertz", "location"), ("hunt_crossley", "velocity_amplitude"),
        ("base", "base_excitation.acceleration_amplitude"), ("force", "force.amplitude"), ("load", "axial_load.amplitude"),
        ("circuits", "harvester.resistance"),
    ],
)  # fmt: skip
def test_derivatives_by_parameters(part: str, name: str) -> None:
    """Of the map over two periods, against differences between runs."""
    drive = sb.Sine(frequency_ratio=1.3, velocity_amplitude=1.0)
    flow = Stroboscope(system_of(**({"drive": drive} | PARTS[part])), PRECISE)
    x, value = settled(flow), flow.value(name)

    def advance_rows(rows: np.ndarray, runs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        beside = flow.advance(np.repeat(x[None], len(rows), axis=0), 2, points={name: value * rows[:, 0]})
        return beside.states, beside.statistics["impacts"]

    found = flow.slope(x, 2, {name: value}, name, 1e-5 * value)
    expected, error = differences(advance_rows, np.ones((1, 1)), np.ones((1, 1, 1)))
    assert error.max() < 1e-6
    np.testing.assert_allclose(found * value, expected[0, 0], rtol=0.0, atol=1e-6 * np.abs(expected).max())


def test_runs_go_on_beside_one_that_failed() -> None:
    """A state beyond a magnet is lost and stays lost; the others are as alone."""
    flow = Stroboscope(system_of(1, forces=[sb.MagneticForce(strength=2e-9, gap=8e-4, location=0.4)]), sb.Integration())
    rows = np.array([[-1.0, 0.0], [0.9, 3.0], [-0.8, 0.1]])
    came = flow.advance(rows, 2)
    assert np.isfinite(came.states).all(axis=1).tolist() == [True, False, True]
    after = flow.advance(came, 3, every=True)
    assert after.every is not None and np.isnan(after.every[1]).all()
    alone = flow.advance(flow.advance(rows[[0, 2]], 2), 3)
    np.testing.assert_array_equal(after.states[[0, 2]], alone.states)


@pytest.mark.parametrize("side", ["below", "above"])
def test_linear_modes_are_those_of_the_well_where_the_beam_rests(side: str) -> None:
    """An uneven beam has other modes in its upper well: states of the map and tangents are those of runs."""
    uneven = sb.Imperfection(midspan_amplitude=8e-6, antisymmetric_amplitude=5e-6, uniform_load=0.05)
    model = sb.ReducedModel.from_beam(paper.BEAM, modes=3, damping_ratio=0.02, imperfection=uneven)
    system = sb.System(model, contacts=[sb.Contact(paper.CONTACT, sb.Striker(drive=SINE, side=side, location=0.42))])
    assert np.abs(model.mirrored.linear_modes - model.linear_modes).max() > 1e-2 * np.abs(model.linear_modes).max()
    flow = Stroboscope(system, PRECISE)
    begun = system.start_state
    came = sb.advance(system, begun, 2, integration=PRECISE)
    assert flow.advance(flow.coordinates(), 2).states[0] == pytest.approx(flow.space.of(came.flat)[0], abs=1e-12)
    change = np.random.default_rng(3).normal(size=(2, 3)) * flow.space.scales[[0, 3]][:, None]
    moved = sb.advance(system, begun, 2, [change], integration=PRECISE).tangent
    ends = [
        sb.advance(
            system,
            dataclasses.replace(
                begun, amplitude=begun.amplitude + h * change[0], velocity=begun.velocity + h * change[1],
                striker_position=np.array(flow._striker_position), modal=None,
            ),
            2, integration=PRECISE,
        )
        for h in (1e-6, -1e-6)
    ]  # fmt: skip
    expected = (flow.space.of(ends[0].flat) - flow.space.of(ends[1].flat))[0] / 2e-6
    assert moved is not None
    assert moved[0].ravel() / flow.space.scales == pytest.approx(expected, abs=1e-4 * np.abs(expected).max())


@pytest.mark.slow
def test_tangents_of_a_state_with_a_damped_force() -> None:
    """Of quadratic damping alone at a point: a change of the velocity as between two runs."""
    system = system_of(1, forces=[sb.QuadraticDamping(coefficient=0.3, location=0.4)])
    begun = sb.advance(system, periods=3, integration=PRECISE)
    size = 1e-4 * float(np.abs(begun.velocity).max())
    moved = sb.advance(system, begun, 1, [[[0.0], [1.0]]], integration=PRECISE).tangent
    assert moved is not None
    ends = [
        sb.advance(system, sb.State(amplitude=begun.amplitude, velocity=begun.velocity + sign * size, phase=begun.phase,
                                    striker_position=begun.striker_position), integration=PRECISE)
        for sign in (1.0, -1.0)
    ]  # fmt: skip
    expected = (ends[0].amplitude - ends[1].amplitude) / (2.0 * size)
    assert moved[0, 0] == pytest.approx(expected, rel=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("restitution", [0.6, 0.9])
def test_exponents_under_newtons_law_are_those_of_the_orbit(restitution: float) -> None:
    law, drive = (sb.Restitution(coefficient=restitution), sb.Sine(frequency_ratio=1.6, velocity_amplitude=0.03))
    flow = Stroboscope(system_of(1, law, drive, damping=0.05, striker={"gap": 2e-5}), PRECISE)
    orbit = sb.dynamics.periodic_orbit(flow, flow.advance(flow.coordinates(), 400).states[0])
    found = sb.dynamics.lyapunov_spectrum(flow, 2, 20, transient=0, states=orbit.coordinates)
    rates = np.sort(np.log(np.abs(orbit.multipliers)) / (orbit.period * flow.period))[::-1]
    exponents = found["exponent"].values[0]
    # two complex multipliers turn the frame, so that each exponent alone converges with the number of periods
    assert exponents.sum() == pytest.approx(rates.sum(), rel=1e-5)
    assert exponents == pytest.approx(rates, rel=1e-2)


@pytest.mark.slow
def test_tools_take_systems_with_states_of_their_own() -> None:
    system = system_of(1, damping=0.05, striker=BODY, harvesters=[PIEZO])
    found = sb.dynamics.find_attractors(system, 12)
    assert found.attractors[0].points.shape[1] == 5
    basins = sb.dynamics.basins_of_attraction(
        found, {"striker_shift[1]": np.linspace(-0.3, 0.3, 3), "velocity[1]": np.linspace(-0.3, 0.3, 3)}
    )
    assert basins.sizes["striker_shift[1]"] == 3


@pytest.mark.slow
def test_an_indentation_is_a_coordinate_but_orbits_are_not_isolated() -> None:
    system = system_of(1, sb.ElasticPlasticContact(4e5, 8e5), damping=0.05)
    flow = Stroboscope(system, PRECISE)
    assert flow.names[-1] == "indentation[1]"
    path = flow.advance(flow.coordinates(), 20, every=True).every
    assert path is not None
    assert (np.diff(path[0, :, -1]) >= 0.0).all()
    assert path[0, -1, -1] > 0.0
    assert sb.dynamics.poincare_section(system, periods=5, transient=5).sizes["point"] == 6
    for tool in (sb.dynamics.periodic_orbit, sb.dynamics.find_attractors):
        with pytest.raises(sb.InputError, match="orbits and attractors are not isolated"):
            tool(system)


REVERSIBLE: dict[str, Any] = {
    "a contact": {},
    "three modes, damped": {"modes": 3, "damping": 0.2},
    "twenty modes, side by side": {"modes": 20, "damping": 1e-3},
    "two tones": {"drive": SINE + sb.Sine(frequency_ratio=2.6, velocity_amplitude=0.03, phase=0.4)},
    "a body": {"striker": {"mass": 0.02, "suspension_stiffness": 700.0}},
    "a power law": {"law": sb.PowerLaw(force_at_1um=0.1, exponent=1.4)},
    "a spring and a magnet": {"forces": [SPRING, sb.MagneticForce(strength=2e-9, gap=8e-4, location=0.4)]},
    "a moving base": {
        "base_excitation": sb.BaseExcitation(
            motion=sb.AccelerationSine(frequency_ratio=1.3, acceleration_amplitude=2.0)
        )
    },
    "a changing load": {
        "axial_load": sb.AxialLoadModulation(motion=sb.HarmonicForce(frequency_ratio=1.3, amplitude=0.5))
    },
}
IRREVERSIBLE: dict[str, Any] = {
    "a damped contact": {"law": sb.KelvinVoigt(linear_stiffness=2e5, linear_damping=2.0)},
    "Newton's law": {"modes": 1, "law": sb.Restitution(0.8)},
    "a circuit": {"harvesters": [PIEZO]},
    "friction": {"forces": [sb.CoulombFriction(friction_force=1e-3, smoothing_velocity=1e-3, location=0.4)]},
}


@pytest.mark.sampled(3)
@pytest.mark.parametrize("name", REVERSIBLE)
def test_motion_back_in_time_is_the_inverse_map(name: str) -> None:
    """States through impacts and back, and the product of both derivatives, which is the identity."""
    flow = Stroboscope(system_of(**REVERSIBLE[name]), PRECISE)
    back = flow.inverse
    assert back is not None and back.inverse is not None and not back.inverse.backward
    start = settled(flow) + 0.02 * np.random.default_rng(3).normal(size=(12, flow.dimension))
    eye = np.broadcast_to(np.eye(flow.dimension), (12, flow.dimension, flow.dimension))
    came = flow.advance(start, tangents=eye)
    assert (came.statistics["impacts"] > 0).any()
    returned = back.advance(came.states, tangents=came.tangents)
    amplified = 1.0 + np.linalg.norm(np.linalg.inv(came.tangents), axis=(1, 2))
    assert (np.abs(returned.states - start).max(axis=1) < 1e-9 * amplified).all()
    assert (np.abs(returned.tangents - eye).max(axis=(1, 2)) < 1e-9 * amplified**2).all()


@pytest.mark.parametrize("name", IRREVERSIBLE)
def test_motion_that_has_no_inverse_in_time_is_not_integrated_backwards(name: str) -> None:
    assert Stroboscope(system_of(**IRREVERSIBLE[name]), sb.Integration()).inverse is None
