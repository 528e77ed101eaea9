"""Iterations end: at tolerances of 0, 1e-16 and huge ones each is refused, or says when it stopped and why."""

from __future__ import annotations

import numpy as np
import pytest
from doubles import KnownMap, henon, logistic, table
from test_orbits import system_of

import snapbeam as sb
from snapbeam.dynamics import edge_states
from snapbeam.util import diagnostics

TOLERANCES = (0.0, 1e-16, 1e300)


def cubic() -> KnownMap:
    """Two wells; the border between their basins contains the fixed point at 0."""
    return KnownMap(
        lambda x, of: np.stack([1.5 * x[:, 0] - 0.5 * x[:, 0] ** 3 + 0.1 * x[:, 1], 0.4 * x[:, 1]], axis=1),
        lambda x, of: table([1.5 - 1.5 * x[:, 0] ** 2, 0.1], [0.0, 0.4]),
        2,
    )


def right(flow, states, horizon):
    return flow.advance(states, horizon).states[:, 0] > 0.0


def tracked(**options) -> sb.dynamics.EdgeState:
    return sb.dynamics.edge_tracking(cubic(), [-0.8, 0.6], [0.9, 0.6], outcome=right, periods=20, **options)


def branch(**options) -> sb.dynamics.Branch:
    return sb.dynamics.continuation(
        sb.dynamics.periodic_orbit(logistic(2.5), [0.6]), "r", (2.4, 2.6), max_points=40, **options
    )


def orbit(tolerance: float) -> str:
    return f"{sb.dynamics.periodic_orbit(henon(), [0.6, 0.2], tolerance=tolerance).iterations} iterations"


def attractors(tolerance: float) -> str:
    states = np.linspace(0.1, 0.9, 5)[:, None]
    return sb.dynamics.find_attractors(logistic(3.2), states, transient=100, tolerance=tolerance).termination_reason


def exponent(distance: float) -> str:
    found = sb.dynamics.largest_lyapunov(henon(), 40, transient=20, states=[[0.1, 0.1]], distance=distance)
    return str(found.attrs["termination_reason"])


ITERATIONS = {
    "edge, bisection": lambda value: tracked(bisect_threshold=value).termination_reason,
    "edge, divergence": lambda value: tracked(diverge_threshold=value, bisect_threshold=1e-17).termination_reason,
    "orbit": orbit,
    "branch, tolerance": lambda value: branch(tolerance=value).termination_reason,
    "branch, step": lambda value: branch(step=value).termination_reason,
    "branch, max_step": lambda value: branch(max_step=value).termination_reason,
    "attractors": attractors,
    "two trajectories": exponent,
}


@pytest.mark.parametrize("value", TOLERANCES)
@pytest.mark.parametrize("name", ITERATIONS)
def test_every_iteration_ends_and_says_why(name: str, value: float) -> None:
    try:
        reason = ITERATIONS[name](value)
    except (sb.InputError, sb.dynamics.OrbitNotFoundError) as error:
        reason = str(error)
        # the remedy is in the message
        assert "must be" in reason or "increase tolerance" in reason
    assert reason
    if value == 0.0:
        assert "must be" in reason
    if value > 1.0:
        assert "must be" in reason, "a tolerance that any state meets is refused"


def test_an_edge_at_the_resolution_of_numbers_says_so() -> None:
    found = tracked(bisect_threshold=1e-20)
    assert len(found.states) == 20 and found.orbit is not None
    assert "rounding stopped the bisection" in found.termination_reason
    assert "1e-20 was not reached" in found.to_dataset().attrs["termination_reason"]
    plain = tracked()
    assert "rounding" not in plain.termination_reason and "orbit of period 1" in plain.termination_reason
    assert plain.termination_reason in repr(plain)


def test_the_edge_of_a_beam_ends_at_any_threshold() -> None:
    """It never ended at 1e-16: rounding leaves no state between the two."""
    system = system_of(1, 1.6, 0.03, 0.05)
    found = sb.dynamics.edge_tracking(
        system,
        np.array([-0.9, 0.0]),
        np.array([-1.0, 1.3]),
        periods=3,
        horizon=30,
        bisect_threshold=1e-17,
        integration=sb.Integration(),
    )
    assert len(found.states) == 3 and "was not reached" in found.termination_reason


def test_an_edge_that_leaves_its_orbit_names_it() -> None:
    """The orbit 0 of the cubic map, which a path leaves after 30 periods along its unstable direction and meets again."""
    away = 1e-4 * 6.0 ** np.arange(6)
    path = np.zeros((60, 2))
    path[30:36, 0], path[36:42, 0], path[50:56, 0], path[56:, 0] = away, away[::-1], away, 0.5
    orbit, words = edge_states._settled(cubic(), path)
    np.testing.assert_allclose(orbit.points, [[0.0, 0.0]], atol=1e-10)
    assert words == "it settled on an orbit of period 1, and left it after 30 periods or later"
    assert edge_states._settled(cubic(), path[:30])[1] == "it settled on an orbit of period 1"
    assert edge_states._settled(cubic(), np.linspace([0.0, 0.0], [1.0, 1.0], 30))[0] is None


def test_an_edge_that_is_lost_says_so() -> None:
    """Once both states have the same outcome there is nothing left to bisect."""

    def early(flow, states, horizon):
        return states[:, 0] > 0.3  # no border of the map: every state above it returns

    found = sb.dynamics.edge_tracking(
        KnownMap(lambda x, of: 0.5 * x, lambda x, of: table([0.5, 0.0], [0.0, 0.5]), 2),
        [0.0, 0.0],
        [1.0, 0.0],
        outcome=early,
        bisect_threshold=1e-3,
        diverge_threshold=2e-3,
        periods=30,
    )
    assert found.orbit is None or len(found.states) <= 30
    assert found.termination_reason


def test_states_without_a_verified_orbit_are_explained() -> None:
    """At a tolerance below rounding no orbit is verified, and the reason names the tolerance."""
    found = sb.dynamics.find_attractors(
        logistic(3.2), np.linspace(0.1, 0.9, 5)[:, None], transient=100, tolerance=1e-18
    )
    if found.undecided:
        assert "increase tolerance" in found.termination_reason
    assert found.to_dataset().attrs["termination_reason"] == found.termination_reason
    chaos = sb.dynamics.find_attractors(logistic(3.83), np.linspace(0.1, 0.9, 40)[:, None], transient=3)
    assert "repeat after none" in chaos.termination_reason and chaos.undecided > 0.0


def test_trajectories_that_merge_have_no_exponent(monkeypatch) -> None:
    """A superstable orbit: minus infinity is not what two trajectories measured."""
    monkeypatch.setattr(diagnostics, "_told", set())
    flat = KnownMap(lambda x, of: 0.0 * x + 0.3, lambda x, of: table([0.0, 0.0], [0.0, 0.0]), 2)
    with pytest.warns(sb.DiagnosticWarning, match="become equal to rounding"):
        found = sb.dynamics.largest_lyapunov(flat, 20, transient=1, states=[[0.1, 0.1]])
    assert np.isnan(found["exponent"]).all() and found.attrs["merged"] == 1


def test_the_orbit_advice_is_not_the_default() -> None:
    """accuracy = 'reference' is the default here, and no advice; at level standard it is one."""
    with pytest.raises(sb.dynamics.OrbitNotFoundError) as error:
        sb.dynamics.periodic_orbit(system_of(1, 1.6, 0.03), [0.5, 0.5], iterations=1)
    assert "reference" not in str(error.value)
    with pytest.raises(sb.dynamics.OrbitNotFoundError, match="or use accuracy = 'reference'"):
        sb.dynamics.periodic_orbit(
            system_of(1, 1.6, 0.03), [0.5, 0.5], iterations=1, integration=sb.Integration(accuracy="standard")
        )
