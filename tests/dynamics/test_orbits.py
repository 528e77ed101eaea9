"""Periodic orbits: exact ones under restitution, products of multipliers, reciprocal pairs, refusals."""

from __future__ import annotations

import math

import numpy as np
import pytest
from doubles import henon, logistic
from scipy.integrate import solve_ivp

import snapbeam as sb
from snapbeam.model import default_values


def system_of(modes: int, ratio: float, velocity: float, damping: float = 0.005) -> sb.System:
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes, damping_ratio=damping)
    return sb.System(
        model,
        contacts=[sb.Contact(default_values.CONTACT, sb.Shaker(frequency_ratio=ratio, velocity_amplitude=velocity))],
    )


def oscillator(ratio: float, restitution: float, amplitude: float = 1.0) -> sb.System:
    """Of natural frequency 1 rad/s and mass 1, struck by a wall amplitude sin(ratio t) about its rest position."""
    model = sb.ReducedModel.from_matrices([[1.0]], [1.0], contact_shape=[1.0], length_scale=1.0)
    drive = sb.Sine(frequency_ratio=ratio, velocity_amplitude=amplitude * ratio)
    return sb.System(model, contacts=[sb.Contact(sb.Restitution(restitution), sb.Striker(drive=drive, gap=0.0))])


def exact_orbit(ratio: float, restitution: float, periods: int) -> tuple[float, np.ndarray]:
    """Approach speed of the (1, n) orbit, and its state at the phase pi.

    It flies n periods from w with (1 + r) v/2 upward back to w with as much downward, so that w = kappa v with
    kappa = (1 + r) cot(pi n/omega)/2, and the wall's velocity there is (1 - r) v/2.
    """
    kappa = 0.5 * (1.0 + restitution) / math.tan(math.pi * periods / ratio)
    speed = 1.0 / math.hypot(kappa, 0.5 * (1.0 - restitution) / ratio)
    w, up, wall = kappa * speed, 0.5 * (1.0 + restitution) * speed, 0.5 * (1.0 - restitution) * speed
    after = ((math.pi - math.atan2(w, wall / ratio)) % (2.0 * math.pi)) / ratio
    cosine, sine = math.cos(after), math.sin(after)
    return speed, np.array([w * cosine + up * sine, -w * sine + up * cosine])


KELVIN_VOIGT = sb.KelvinVoigt(1e6, 5.0)


@pytest.mark.slow
def test_the_map_of_a_force_that_begins_with_a_jump_is_smooth() -> None:
    """The onset falls between two ticks: without its part of a tick the period map has steps of 2e-9."""
    system = system_of(1, 1.6, 0.03).replace(**{"contact.law": KELVIN_VOIGT})
    state = sb.advance(system, periods=60)
    length = abs(float(system.model.well_amplitude[0]))
    offset = np.linspace(-1.0, 1.0, 101)
    near = sb.State(
        amplitude=state.amplitude + 1e-7 * length * offset[:, None],
        velocity=np.repeat(state.velocity[None], 101, axis=0),
    )
    image = sb.advance(system, near, periods=1).amplitude[:, 0] / length
    residual = image - np.polynomial.Polynomial.fit(offset, image, 2)(offset)
    assert np.sqrt(np.mean(residual**2)) < 1e-10


@pytest.mark.slow
@pytest.mark.parametrize("transient", range(60, 165, 7))
def test_orbits_of_a_force_that_begins_with_a_jump(transient: int) -> None:
    """At the default tolerance, from 15 states."""
    system = system_of(1, 1.6, 0.03).replace(**{"contact.law": KELVIN_VOIGT})
    assert sb.dynamics.periodic_orbit(system, transient=transient).residual < 1e-9


def contact_of_a_ball(law: sb.KelvinVoigt, stroke: float, phase: float, state: np.ndarray) -> tuple[float, np.ndarray]:
    """Time in contact with a force, and the state a period later, of a unit mass under unit weight on stroke sin t."""
    k, c = law.linear_stiffness, law.linear_damping

    def gap(t, y):
        return y[0] - stroke * math.sin(t)

    def force(t, y):
        return -k * gap(t, y) + c * (stroke * math.cos(t) - y[1])

    def until(rates, event, direction, t, y):
        event.terminal, event.direction = True, direction
        found = solve_ivp(rates, (t, end), y, method="DOP853", rtol=1e-13, atol=1e-13, events=event, max_step=0.1)
        return found.t[-1], found.y[:, -1], found.t_events[0].size > 0

    def falling(t, y):
        return [y[1], -1.0]

    t, y, end, pressed = phase, np.asarray(state), phase + 2.0 * math.pi, 0.0
    while True:
        onset, y, met = until(falling, lambda t, y: gap(t, y), -1, t, y)
        if not met:
            return pressed, y
        t, y, _ = until(lambda t, y: [y[1], -1.0 + force(t, y)], lambda t, y: force(t, y), -1, onset, y)
        pressed += t - onset
        t, y, _ = until(falling, lambda t, y: gap(t, y), 1, t, y)  # the spring has yet to recover
        t, y = t + 1e-9, y + 1e-9 * np.array(falling(t, y))


@pytest.mark.slow
@pytest.mark.parametrize(("restitution", "stroke"), [(0.5, 1.2), (0.3, 1.8)])
def test_determinant_of_a_bouncing_ball(restitution: float, stroke: float) -> None:
    """Phase volume shrinks by exp(-c/m times the time with a force) in a period; k = 1e7."""
    ball = sb.ReducedModel.from_matrices([[1.0]], [0.0], contact_shape=[1.0], reference_frequency=0.5 / math.pi)
    law = sb.KelvinVoigt.from_restitution(1e7, restitution, 1.0)
    phase = math.acos(math.pi * (1.0 - restitution) / ((1.0 + restitution) * stroke))
    table = sb.DisplacementSine(frequency_ratio=1.0, displacement_amplitude=stroke, phase=phase)
    above = sb.State(amplitude=[stroke * math.sin(phase)], velocity=[math.pi], striker_position=0.0)
    weight = sb.ExternalForce(history=sb.ConstantForce(force=-1.0))
    system = sb.System(ball, contacts=[sb.Contact(law, sb.Striker(drive=table))], forces=[weight], initial_state=above)
    # steps in contact end at whole ticks, and the force jumps at the onset: the map is rough to some 3e-10
    orbit = sb.dynamics.periodic_orbit(system, transient=30, tolerance=1e-9)
    pressed, later = contact_of_a_ball(law, stroke, orbit.flow.phase, orbit.coordinates)
    np.testing.assert_allclose(later, orbit.coordinates, rtol=0.0, atol=1e-9)
    determinant = math.exp(orbit.log_determinant)
    assert determinant == pytest.approx(math.exp(-law.linear_damping * pressed), rel=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("with_striker", [True, False])
def test_a_constant_force_repeats_after_any_time(with_striker: bool) -> None:
    """The orbit under a constant load closes, and runs from it return to it; a load alone leaves the equilibrium."""
    model = sb.ReducedModel.from_beam(default_values.BEAM, 1, damping_ratio=0.02)
    load = sb.ExternalForce(history=sb.ConstantForce(force=1e-3), location=0.5)
    shaker = sb.Shaker(frequency_ratio=1.6, velocity_amplitude=0.03)
    contacts = [sb.Contact(default_values.CONTACT, shaker)] if with_striker else []
    system = sb.System(model, contacts=contacts, forces=[load])
    orbit = sb.dynamics.periodic_orbit(system, transient=100)
    assert orbit.residual < 1e-10
    period = orbit.flow.period
    run = sb.simulate(
        orbit.system,
        sb.Integration(accuracy="reference", cycles=6),
        sample_times=period * np.arange(1, 6) * (1.0 - 1e-13),
    )
    assert np.ptp(run.dataset.midspan_displacement.values) < 1e-9
    if not with_striker:
        potential = orbit.system.potential
        center = run.dataset.midspan_displacement.values[-1] * model.length_scale
        assert center == pytest.approx(potential.center(potential.wells[0]), rel=1e-9)


EXACT = [
    *((ratio, r, 1) for ratio in (1.3, 1.4, 1.6, 1.8, 1.9) for r in (0.3, 0.9)),
    *((2.0 * ratio, r, 2) for ratio in (1.7, 1.75, 1.8, 1.85, 1.9) for r in (0.3, 0.9)),
]


@pytest.mark.slow
@pytest.mark.parametrize(("ratio", "restitution", "periods"), EXACT)
def test_orbits_with_one_impact_in_n_periods(ratio: float, restitution: float, periods: int) -> None:
    """State and impulse to 1e-8, and det = r^2."""
    speed, state = exact_orbit(ratio, restitution, periods)
    orbit = sb.dynamics.periodic_orbit(oscillator(ratio, restitution), state * 1.003, periods, phase=math.pi)
    np.testing.assert_allclose(orbit.coordinates, state, rtol=0.0, atol=1e-8)
    assert orbit.contact_summary.impacts == 1
    assert orbit.contact_summary.min_impulse == pytest.approx((1.0 + restitution) * speed, rel=1e-8)
    assert math.exp(orbit.log_determinant) == pytest.approx(restitution**2, abs=1e-8)


@pytest.mark.sampled(3)
@pytest.mark.parametrize(
    ("modes", "ratio", "velocity", "periods"), [(1, 1.6, 0.03, 1), (8, 1.4, 0.03, 2), (32, 3.5, 0.06, 2)]
)
def test_products_of_multipliers(modes: int, ratio: float, velocity: float, periods: int) -> None:
    """exp(-2 T sum zeta omega), impacts or none; the orbit closes by the plain integration too."""
    system = system_of(modes, ratio, velocity)
    orbit = sb.dynamics.periodic_orbit(system, period=periods, transient=2000)
    model = system.model
    exact = -2.0 * periods * float((model.damping_ratio * model.omega).sum()) / (model.reference_frequency * ratio)
    assert orbit.log_determinant == pytest.approx(exact, abs=1e-7)
    assert np.log(np.abs(orbit.multipliers)).sum() == pytest.approx(exact, abs=1e-7)
    assert orbit.is_stable and orbit.minimal_period == periods
    assert orbit.contact_summary.impacts >= 1
    again = sb.advance(orbit.system, orbit.state, periods, integration=sb.Integration(accuracy="reference"))
    size = abs(orbit.state.amplitude[0])
    np.testing.assert_allclose(again.amplitude, orbit.state.amplitude, rtol=0.0, atol=1e-9 * size)


def test_multipliers_come_in_reciprocal_pairs_without_damping() -> None:
    orbit = sb.dynamics.periodic_orbit(system_of(1, 1.6, 0.03), transient=1500)
    for damping in (0.002, 0.0005, 0.0):
        orbit = sb.dynamics.periodic_orbit(system_of(1, 1.6, 0.03, damping), orbit)
    values = orbit.multipliers
    assert orbit.contact_summary.impacts == 1
    np.testing.assert_allclose(values[0] * values[1], 1.0, atol=1e-8)


def test_known_maps() -> None:
    """Fixed points of Henon's map; the second fixed point by leaving out the first."""
    root = math.sqrt(0.49 + 4.0 * 1.4)
    first = sb.dynamics.periodic_orbit(henon(), [0.5, 0.2])
    np.testing.assert_allclose(first.coordinates[0], (-0.7 + root) / 2.8, rtol=1e-10)
    second = sb.dynamics.periodic_orbit(henon(), [0.5, 0.2], deflate=[first], iterations=200)
    np.testing.assert_allclose(second.coordinates[0], (-0.7 - root) / 2.8, rtol=1e-9)
    assert not first.is_stable and first.unstable == 1
    twice = sb.dynamics.periodic_orbit(logistic(3.2), [0.5], 4, transient=400)
    assert twice.minimal_period == 2


def test_multipliers_at_level_standard() -> None:
    """Within 1e-4 of those of level reference."""
    system = system_of(1, 1.6, 0.03)
    coarse = sb.dynamics.periodic_orbit(system, transient=1500, integration=sb.Integration(accuracy="standard"))
    fine = sb.dynamics.periodic_orbit(system, coarse.coordinates)
    assert np.abs(coarse.multipliers - fine.multipliers).max() < 1e-4


def test_what_does_not_converge_says_why() -> None:
    with pytest.raises(sb.dynamics.OrbitNotFoundError, match="try another period"):
        sb.dynamics.periodic_orbit(logistic(3.9), [0.3], 7, iterations=2)
    free = sb.System(sb.ReducedModel.from_beam(default_values.BEAM, 1))
    with pytest.raises(sb.InputError, match=r"contacts = \[\]"):
        sb.dynamics.periodic_orbit(free)
    with pytest.raises(sb.InputError, match=r"guess of shape \(3,\)"):
        sb.dynamics.periodic_orbit(system_of(1, 1.6, 0.03), [0.1, 0.2, 0.3])
    with pytest.raises(sb.InputError, match="period = 0"):
        sb.dynamics.periodic_orbit(system_of(1, 1.6, 0.03), period=0)


def test_as_many_iterations_as_are_needed() -> None:
    """An orbit that is reached in the last iteration is found; one iteration less is too few."""
    needed = sb.dynamics.periodic_orbit(henon(), [0.3, 0.1]).iterations
    assert needed > 2
    assert sb.dynamics.periodic_orbit(henon(), [0.3, 0.1], iterations=needed).iterations == needed
    with pytest.raises(sb.dynamics.OrbitNotFoundError, match="no convergence"):
        sb.dynamics.periodic_orbit(henon(), [0.3, 0.1], iterations=needed - 1)
