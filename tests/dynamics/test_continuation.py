"""Branches: exact orbits along them up to their grazing end, flips and folds where they are known to be."""

from __future__ import annotations

import math

import numpy as np
import pytest
from doubles import henon, logistic
from scipy.linalg import expm
from scipy.optimize import brentq
from test_orbits import EXACT, exact_orbit, oscillator, system_of

import snapbeam as sb


def test_flips_of_the_logistic_map() -> None:
    orbit = sb.dynamics.periodic_orbit(logistic(2.5), [0.6])
    branch = sb.dynamics.continuation(orbit, "r", (2.2, 3.7))
    assert branch.termination_reason == "limit of the parameter"
    flip = next(event for event in branch.special_points if event.kind == "flip")
    assert flip.value == pytest.approx(3.0, abs=1e-7)
    doubled = sb.dynamics.switch_branch(flip, "r", (2.2, 3.7))
    assert doubled.period == 2 and doubled.minimal_period == 2 and doubled.is_stable
    second = sb.dynamics.continuation(doubled, "r", (2.2, 3.7))
    flips = [event.value for event in second.special_points if event.kind == "flip"]
    assert flips[0] == pytest.approx(1.0 + math.sqrt(6.0), abs=1e-7)
    first = next(event for event in second.special_points if event.kind == "flip")
    for event, exact in ((flip, 3.0), (first, 1.0 + math.sqrt(6.0))):
        assert abs(event.value - exact) <= event.error < 1e-7
    assert "±" in repr(flip) and float(branch.to_dataset()["special_point_error"][0]) == flip.error
    np.testing.assert_allclose(branch.orbits[-1].coordinates, 1.0 - 1.0 / 3.7, atol=1e-9)


def test_a_fold_is_passed() -> None:
    """Henon's fixed points meet at a = -(1 - b)^2/4; the branch turns there and goes on along the other."""
    orbit = sb.dynamics.periodic_orbit(henon(0.1), [0.8, 0.2])
    branch = sb.dynamics.continuation(orbit, "a", (-0.2, 0.3), direction="down")
    fold = next(event for event in branch.special_points if event.kind == "fold")
    assert fold.value == pytest.approx(-0.1225, abs=1e-8)
    assert abs(fold.value + 0.1225) <= fold.error < 1e-8
    assert branch.values[-1] > branch.values.min()
    stable = branch.is_stable
    assert stable[0] and not stable[-1]


def test_an_isola_is_closed_from_a_seed_on_it() -> None:
    """Fixed points of x -> x - 0.4 (x^2 + (r - 2)^2 - 1/4) are a circle, which no branch from elsewhere meets."""
    from doubles import KnownMap, table

    ring = KnownMap(
        lambda x, of: np.stack(
            [x[:, 0] - 0.4 * (x[:, 0] ** 2 + (of["r"] - 2.0) ** 2 - 0.25), 0.1 * x[:, 0] + 0.3 * x[:, 1]], 1
        ),
        lambda x, of: table([1.0 - 0.8 * x[:, 0], 0.0], [0.1, 0.3]),
        2,
        r=2.1,
    )
    (seed,) = sb.dynamics.find_attractors(
        ring, np.random.default_rng(0).uniform(-0.3, 0.8, (20, 2)), transient=200
    ).attractors
    branch = sb.dynamics.continuation(seed.orbit, "r", (0.0, 4.0), max_points=2000)
    assert branch.termination_reason == "closed"
    assert sorted(event.value for event in branch.special_points) == pytest.approx([1.5, 2.5], abs=1e-8)
    assert {event.kind for event in branch.special_points} == {"fold"}
    for event in branch.special_points:
        assert min(abs(event.value - 1.5), abs(event.value - 2.5)) <= event.error < 1e-7
    radius = np.hypot([orbit.coordinates[0] for orbit in branch.orbits], branch.values - 2.0)
    np.testing.assert_allclose(radius, 0.5, atol=1e-8)
    other = sb.dynamics.periodic_orbit(ring, [0.1, 0.0], deflate=[seed.orbit], iterations=200)
    assert other.coordinates[0] == pytest.approx(-seed.orbit.coordinates[0], abs=1e-9) and other.unstable == 1


def scratch(ratio: float, restitution: float, periods: int, looks: int = 40_001) -> float:
    """Least gap between the flight of the exact (1, n) orbit and the wall, away from its ends."""
    speed, _ = exact_orbit(ratio, restitution, periods)
    w = 0.5 * (1.0 + restitution) / math.tan(math.pi * periods / ratio) * speed
    up, wall = 0.5 * (1.0 + restitution) * speed, 0.5 * (1.0 - restitution) * speed
    time = np.linspace(0.0, 2.0 * math.pi * periods / ratio, looks)
    gap = w * np.cos(time) + up * np.sin(time) - np.sin(ratio * time + math.atan2(w, wall / ratio))
    before, here, after = gap[:-2], gap[1:-1], gap[2:]
    turns = (here <= before) & (here < after)
    bend = (before - 2.0 * here + after)[turns]
    return float((here[turns] - (after - before)[turns] ** 2 / (8.0 * bend)).min(initial=10.0))


def grazes_at(restitution: float, periods: int, below: float) -> float:
    """The greatest ratio below another at which the flight touches the wall a second time."""
    ratios = np.append(np.linspace(below, 1.002 * periods, 80), np.linspace(1.0019, 1.0003, 20) * periods)
    rooms = np.array([scratch(float(ratio), restitution, periods, 4001) for ratio in ratios])
    first = int(np.flatnonzero(rooms < 0.0)[0])
    return float(brentq(scratch, ratios[first], ratios[first - 1], args=(restitution, periods)))


def follow_to_grazing(ratio: float, restitution: float, periods: int, longest: float) -> sb.dynamics.Branch:
    """Every orbit is the exact one, and the branch ends where its flight touches the wall a second time."""
    _, state = exact_orbit(ratio, restitution, periods)
    orbit = sb.dynamics.periodic_orbit(oscillator(ratio, restitution), state, periods, phase=math.pi)
    between = (1.0005 * periods, ratio + 0.01)
    branch = sb.dynamics.continuation(orbit, "frequency_ratio", between, direction="down", max_step=longest)
    assert branch.termination_reason == "grazing"
    for each, value in zip(branch.orbits, branch.values, strict=True):
        # at the same velocity the wall's amplitude goes with 1/omega
        exact = exact_orbit(float(value), restitution, periods)[1] * ratio / value
        np.testing.assert_allclose(each.coordinates, exact, rtol=0.0, atol=1e-8)
    grazing = branch.special_points[-1]
    assert grazing.kind == "grazing" and grazing.orbit.contact_summary.clearance < 5e-3
    assert abs(grazing.value - grazes_at(restitution, periods, ratio)) <= grazing.error < 1e-2
    return branch


@pytest.mark.slow
def test_restitution_orbits_are_followed_to_grazing() -> None:
    branch = follow_to_grazing(3.6, 0.8, 2, 0.1)
    assert branch.special_points[-1].orbit.contact_summary.clearance < 1e-4 and branch.special_points[-1].error < 1e-4
    ds = branch.to_dataset()
    assert set(ds["special_point_kind"].values) <= {"fold", "flip", "Neimark-Sacker", "branch point", "grazing"}


@pytest.mark.slow
@pytest.mark.parametrize(("ratio", "restitution", "periods"), EXACT)
def test_orbits_of_twenty_points_are_followed_to_grazing(ratio: float, restitution: float, periods: int) -> None:
    follow_to_grazing(ratio, restitution, periods, 0.1)


# ----------------------------------------------------------------------------------------------------
# One impact a period on a wall a gap of 1 away, with damping: two linear conditions and a quadratic equation.


def damped(ratio: float, velocity: float) -> sb.System:
    """Mass and stiffness 1, a damping ratio of 0.05, a coefficient of restitution of 0.8."""
    model = sb.ReducedModel.from_matrices([[1.0]], [1.0], contact_shape=[1.0], length_scale=1.0, damping_ratio=0.05)
    drive = sb.Sine(frequency_ratio=ratio, velocity_amplitude=velocity)
    return sb.System(model, contacts=[sb.Contact(sb.Restitution(0.8), sb.Striker(drive=drive, gap=1.0))])


def flight(ratio: float) -> tuple[float, float]:
    """Displacement at impact, and the wall's over its frequency a quarter period earlier, per approach speed."""
    once = expm(np.array([[0.0, 1.0], [-1.0, -0.1]]) * 2.0 * math.pi / ratio)
    matrix = [[1.0 - once[0, 0], -once[0, 1]], [-once[1, 0], 1.0 - once[1, 1]]]
    place, wall = np.linalg.solve(matrix, [0.8 * once[0, 1], 1.0 + 0.8 * once[1, 1]])
    return place, wall / ratio


def fold_of(ratio: float) -> float:
    place, wall = flight(ratio)
    return ratio * abs(wall) / math.hypot(place, wall)


def damped_orbits(ratio: float, velocity: float, phase: float) -> list[np.ndarray]:
    """States of both orbits with one impact a period at a phase of the wall, that of the faster impact first."""
    place, wall = flight(ratio)
    reach = velocity / ratio
    found = []
    for speed in np.sort(np.roots([place**2 + wall**2, 2.0 * place, 1.0 - reach**2]).real)[::-1]:
        x, rate = place * speed, wall * ratio * speed
        after = (phase - math.atan2(x + 1.0, rate / ratio)) % (2.0 * math.pi) / ratio
        carry = expm(np.array([[0.0, 1.0], [-1.0, -0.1]]) * after)
        found.append(carry @ np.array([x, rate + 0.8 * speed]))
    return found


FOLD = 0.40663746


@pytest.mark.slow
@pytest.mark.parametrize(
    ("velocity", "which", "direction"),
    [(0.44, 0, "down"), (0.43, 1, "down"), (0.42495795, 0, "down"), (0.415, 0, "up")],
)
def test_an_impact_at_the_phase_of_observation_is_no_bifurcation(velocity: float, which: int, direction: str) -> None:
    """At 0.424958 the faster impact is at the phase at which a run begins; the only fold is at 0.40663746."""
    assert fold_of(1.4) == pytest.approx(FOLD, abs=1e-8)
    system = damped(1.4, velocity)
    orbit = sb.dynamics.periodic_orbit(system, damped_orbits(1.4, velocity, 0.0)[which])
    if velocity == 0.42495795:
        values = orbit.multipliers
        np.testing.assert_allclose([values.real, np.abs(values.imag)], [[0.616] * 2, [0.171] * 2], atol=1e-3)
    branch = sb.dynamics.continuation(orbit, "velocity_amplitude", (0.38, 0.46), direction=direction, max_step=0.1)
    assert branch.termination_reason == "limit of the parameter"
    folds = branch.special_points
    assert [point.kind for point in folds] == ([] if direction == "up" else ["fold"])
    for point in folds:
        assert abs(point.value - fold_of(1.4)) <= 10.0 * point.error < 1e-8
        assert np.abs(point.orbit.multipliers - 1.0).min() < 1e-6
    for each, value in zip(branch.orbits, branch.values, strict=True):
        exact = damped_orbits(1.4, float(value), each.flow.clock.striker_phase)
        assert min(np.abs(each.coordinates - state).max() for state in exact) < 1e-8


@pytest.mark.slow
def test_the_phase_of_observation_changes_along_a_branch() -> None:
    """The impact comes within 0.27 rad of the phase given; the dataset keeps that phase, and so does a curve."""
    orbit = sb.dynamics.periodic_orbit(damped(1.4, 0.415), damped_orbits(1.4, 0.415, 0.9)[0], phase=0.9)
    branch = sb.dynamics.continuation(orbit, "velocity_amplitude", (0.38, 0.46), direction="down", max_step=0.1)
    phases = [each.flow.clock.striker_phase for each in branch.orbits]
    assert phases[0] == 0.9 and len(set(phases)) == 2
    for state, value in zip(branch.to_dataset()["state"].values, branch.values, strict=True):
        assert min(np.abs(state - each).max() for each in damped_orbits(1.4, float(value), 0.9)) < 2e-8
    again = sb.dynamics.periodic_orbit(damped(1.4, 0.415), branch.orbits[0], phase=3.0)
    np.testing.assert_allclose(again.coordinates, damped_orbits(1.4, 0.415, 3.0)[0], atol=1e-8)
    curve = sb.dynamics.bifurcation_curve(
        branch.special_points[0],
        ("frequency_ratio", "velocity_amplitude"),
        ((1.2, 1.8), (0.2, 0.6)),
        step=0.03,
        max_step=0.1,
    )
    assert curve.attrs["termination_reason"] == "limit of a parameter; limit of a parameter"
    exact = [fold_of(float(ratio)) for ratio in curve["frequency_ratio"]]
    np.testing.assert_allclose(curve["velocity_amplitude"].values, exact, atol=5e-9)


@pytest.mark.slow
def test_a_branch_of_the_beam() -> None:
    """One mode, from intrawell tapping up: stable first, then a flip; product of multipliers all the way."""
    system = system_of(1, 1.6, 0.03)
    orbit = sb.dynamics.periodic_orbit(system, transient=1000)
    branch = sb.dynamics.continuation(orbit, "velocity_amplitude", (0.005, 0.2), max_step=0.1)
    model = system.model
    exact = -2.0 * float((model.damping_ratio * model.omega).sum()) / (model.reference_frequency * 1.6)
    for each in branch.orbits:
        assert each.log_determinant == pytest.approx(exact, abs=1e-8)
    flip = next(event for event in branch.special_points if event.kind == "flip")
    nearest = flip.orbit.multipliers[np.argmin(np.abs(flip.orbit.multipliers + 1.0))]
    assert abs(nearest + 1.0) < 1e-6
    doubled = sb.dynamics.switch_branch(flip, "velocity_amplitude", (0.005, 0.2))
    assert doubled.minimal_period == 2


def test_refusals() -> None:
    orbit = sb.dynamics.periodic_orbit(logistic(2.5), [0.6])
    with pytest.raises(sb.InputError, match="must contain the orbit's own"):
        sb.dynamics.continuation(orbit, "r", (3.0, 4.0))
    with pytest.raises(sb.InputError, match="of which the second is larger"):
        sb.dynamics.continuation(orbit, "r", (4.0, 3.0))
    with pytest.raises(sb.InputError, match="direction"):
        sb.dynamics.continuation(orbit, "r", (2.0, 4.0), direction="sideways")
