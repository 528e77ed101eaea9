"""Attractors, basins and edge states: known systems, certification, nothing guessed, nothing that depends on order."""

from __future__ import annotations

import math
import warnings

import numpy as np
import pytest
from doubles import duffing, grebogi, henon, logistic, pendulum, turning_pendulum
from scipy.integrate import solve_ivp
from test_orbits import system_of

import snapbeam as sb
from snapbeam.dynamics.stroboscope import Stroboscope, settling_periods
from snapbeam.util import diagnostics


def test_known_attractors() -> None:
    """Henon's is chaotic, the logistic map's at 3.2 of period 2, at 3.83 of period 3 beside a chaotic saddle."""
    draw = np.random.default_rng(1)
    chaotic = sb.dynamics.find_attractors(henon(), draw.uniform(-0.1, 0.1, (12, 2)), transient=200)
    assert [each.kind for each in chaotic.attractors] == ["chaotic"] and chaotic.undecided == 0.0
    assert chaotic.attractors[0].exponent == pytest.approx(0.419, abs=0.03)
    two = sb.dynamics.find_attractors(logistic(3.2), draw.uniform(0.1, 0.9, (20, 1)))
    assert [each.period for each in two.attractors] == [2]
    three = sb.dynamics.find_attractors(logistic(3.83), draw.uniform(0.1, 0.9, (40, 1)), transient=3)
    assert [each.kind for each in three.attractors] == ["periodic"] and three.attractors[0].period == 3
    assert three.undecided > 0.0, "after three steps some have not arrived, and none is called chaotic"


def shares_of_the_pendulum(found: sb.dynamics.Attractors, periods: int) -> list[float]:
    plane = {
        "x[1]": math.asin(0.5) + np.linspace(-math.pi, math.pi, 48, endpoint=False),
        "x[2]": np.linspace(-10.0, 10.0, 48),
    }
    ds = sb.dynamics.basins_of_attraction(found, plane, periods=periods)
    return [float((ds["basin"] == label).mean()) for label in (0, 1, -1)]


@pytest.mark.slow
def test_the_pendulum_of_bstab() -> None:
    """15 % go to the fixed point, 85 % rotate: a fixed point too where the angle is seen whenever it has come round."""
    starts = np.array([[math.asin(0.5), 0.01], [math.asin(0.5), 0.02], [2.0, 3.0], [1.0, 6.0]])
    found = sb.dynamics.find_attractors(turning_pendulum(), starts, transient=200)
    assert [each.period for each in found.attractors] == [1, 1]
    rest = int(np.argmin([abs(each.points[0, 1]) for each in found.attractors]))
    shares = shares_of_the_pendulum(found, 60)
    assert shares[rest] == pytest.approx(0.15, abs=0.02)
    assert shares[1 - rest] == pytest.approx(0.85, abs=0.02)
    assert shares[2] == 0.0


@pytest.mark.slow
def test_what_is_no_attractor_of_the_map_is_undecided() -> None:
    """Seen at a fixed interval the rotation never repeats and does not diverge: neither periodic nor chaotic."""
    found = sb.dynamics.find_attractors(
        pendulum(), np.array([[math.asin(0.5), 0.01], [math.asin(0.5), 0.02]]), transient=600
    )
    assert [each.period for each in found.attractors] == [1]
    with pytest.warns(sb.DiagnosticWarning, match="of the states are undecided after 60 periods"):
        rest, _, undecided = shares_of_the_pendulum(found, 60)
    assert rest == pytest.approx(0.15, abs=0.02) and undecided == pytest.approx(0.85, abs=0.02)


def test_labels_do_not_depend_on_order() -> None:
    flow = grebogi()
    draw = np.random.default_rng(4)
    states = np.column_stack([draw.uniform(-1.5, 4.5, 60), draw.uniform(-0.5, 0.5, 60)])
    order = draw.permutation(60)
    one, other = (sb.dynamics.find_attractors(flow, rows, transient=400) for rows in (states, states[order]))
    np.testing.assert_array_equal(one.labels[order], other.labels)
    assert one.undecided == 0.0 and {len(one.attractors), len(other.attractors)} == {2}
    assert one.shares.sum() == pytest.approx(1.0)


@pytest.mark.slow
def test_a_beam_between_two_wells() -> None:
    """A weak drive: tapping in the struck well, rest in the far one; basins in any number of threads."""
    system = system_of(1, 1.6, 0.03, 0.05)
    found = sb.dynamics.find_attractors(system, 40, transient=300)
    assert all(each.kind == "periodic" and each.orbit.is_stable for each in found.attractors)
    for each in found.attractors:
        fine = each.verification
        assert fine.flow.integration.accuracy == "reference" and fine.is_stable
        assert np.abs(fine.coordinates - each.points[0]).max() < 1e-3
        assert each.exponent == pytest.approx(math.log(abs(fine.multipliers[0])) / fine.flow.period)
    sides = {math.copysign(1.0, each.points[0, 0]) for each in found.attractors}
    assert sides == {-1.0, 1.0} and found.undecided == 0.0
    plane = {"amplitude[1]": np.linspace(-1.6, 1.6, 24), "velocity[1]": np.linspace(-1.0, 1.0, 20)}
    ds = sb.dynamics.basins_of_attraction(found, plane, periods=300)
    assert ds["basin"].dims == ("amplitude[1]", "velocity[1]")
    assert ds.attrs["undecided"] < 0.02
    flow = found.flow
    for at in ((3, 4), (12, 10), (20, 15)):
        row = np.array([[plane["amplitude[1]"][at[0]], plane["velocity[1]"][at[1]]]])
        end, label = flow.advance(row, 2000).states[0], int(ds["basin"][at])
        assert label == -1 or np.abs(found.attractors[label].points - end).max(axis=1).min() < 1e-3
    alone = sb.dynamics.find_attractors(system, 40, transient=300, integration=sb.Integration(threads=1))
    np.testing.assert_array_equal(alone.labels, found.labels)
    again = sb.dynamics.basins_of_attraction(alone, plane, periods=300)
    np.testing.assert_array_equal(again["basin"], ds["basin"])
    np.testing.assert_array_equal(again["captured_after"], ds["captured_after"])


def test_the_edge_of_a_map_is_its_saddle() -> None:
    """Between the basins of x -> x^3-like wells lies the fixed point at 0."""
    from doubles import KnownMap, table

    cubic = KnownMap(
        lambda x, of: np.stack([1.5 * x[:, 0] - 0.5 * x[:, 0] ** 3 + 0.1 * x[:, 1], 0.4 * x[:, 1]], axis=1),
        lambda x, of: table([1.5 - 1.5 * x[:, 0] ** 2, 0.1], [0.0, 0.4]),
        2,
    )

    def right(flow, states, horizon):
        return flow.advance(states, horizon).states[:, 0] > 0.0

    edge = sb.dynamics.edge_tracking(cubic, [-0.8, 0.6], [0.9, 0.6], outcome=right, horizon=80)
    np.testing.assert_allclose(edge.states[-1], [0.0, 0.0], atol=1e-4)
    assert edge.orbit is not None and edge.orbit.unstable == 1
    np.testing.assert_allclose(edge.orbit.coordinates, 0.0, atol=1e-8)


@pytest.mark.slow
def test_the_edge_between_snapping_and_not() -> None:
    """One damped mode: the border runs to an unstable orbit near the hilltop."""
    system = system_of(1, 1.6, 0.03, 0.05)
    edge = sb.dynamics.edge_tracking(system, np.array([-0.9, 0.0]), np.array([-1.0, 1.3]), periods=25, horizon=60)
    assert (edge.distance < 1e-3).all()
    assert edge.orbit is not None and edge.orbit.unstable == 1


DUFFING = ((-0.779054, 0.027417), (1.210091, 0.055295))
"""The two attractors of x'' + 0.15 x' - x + x^3 = 0.2 cos t at t = 0."""


@pytest.mark.slow
def test_the_double_well_has_two_attractors_and_a_slow_transient() -> None:
    """After 40 periods some states are not near an attractor yet; after 220 periods every state is."""
    states = np.random.default_rng(7).uniform(-2.0, 2.0, (120, 2))
    found = sb.dynamics.find_attractors(duffing(), states, transient=220, max_periods=4)
    assert [each.period for each in found.attractors] == [1, 1] and found.undecided == 0.0
    np.testing.assert_allclose([each.points[0] for each in found.attractors], DUFFING, atol=2e-4)
    size = math.exp(-0.15 * math.pi)
    assert all(abs(each.orbit.multipliers[0]) == pytest.approx(size, abs=1e-3) for each in found.attractors)
    bound = 1.0 - 0.05 ** (1.0 / 120)
    assert found.unseen_share() == pytest.approx(bound) and found.unseen_share() < 3.0 / 120
    assert found.to_dataset().attrs["unseen_share_95"] == pytest.approx(bound)
    assert f"less than {100 * bound:.2g} %" in repr(found)
    soon = sb.dynamics.find_attractors(duffing(), states, transient=40, max_periods=4, check_periods=20)
    assert len(soon.attractors) == 2 and 0.0 < soon.undecided < 0.2
    assert soon.unseen_share() > soon.undecided > found.unseen_share()


@pytest.mark.slow
def test_scipy_finds_no_third_attractor_of_the_double_well() -> None:
    """Every one of 800 random states ends on one of two orbits; after 60 periods some are 0.4 away from both."""
    draw = np.random.default_rng(11)
    x = draw.uniform(-2.0, 2.0, (2, 800))

    def rate(t, y):
        return np.concatenate([y[800:], -0.15 * y[800:] + y[:800] - y[:800] ** 3 + 0.2 * math.cos(t)])

    ends = solve_ivp(
        rate, (0.0, 400.0 * math.pi), x.ravel(), "DOP853", [120.0 * math.pi, 400.0 * math.pi], rtol=1e-8, atol=1e-8
    ).y.reshape(2, 800, 2)
    away = np.min([np.hypot(ends[0] - a, ends[1] - b) for a, b in DUFFING], axis=0)
    assert 0.002 < (away[:, 0] > 0.4).mean() < 0.03, "a slow transient"
    assert away[:, 1].max() < 1e-4, "no third attractor"


def test_the_share_of_attractors_that_were_not_seen() -> None:
    """The rule of three, and the bound of Clopper and Pearson with undecided states, cover a known share."""

    def of(labels) -> sb.dynamics.Attractors:
        return sb.dynamics.Attractors(logistic(), [], np.asarray(labels), 20, "")

    assert of(np.zeros(200, dtype=int)).unseen_share() == pytest.approx(0.01487, abs=1e-5)
    assert of(np.full(4, -1)).unseen_share() == 1.0
    draw = np.random.default_rng(2)
    share = 0.03
    bounds = [of(np.where(draw.random(150) < share, -1, 0)).unseen_share() for _ in range(400)]
    assert 0.93 < np.mean(np.array(bounds) >= share) <= 1.0
    with pytest.raises(sb.InputError, match="confidence"):
        of([0, 0]).unseen_share(1.5)


def test_basins_choose_their_periods_from_the_damping(monkeypatch) -> None:
    """At zeta = 0.02 200 periods are too few and say so; the default leaves less than 5 % undecided."""
    monkeypatch.setattr(diagnostics, "_told", set())
    system = system_of(1, 1.6, 0.03, 0.02)
    found = sb.dynamics.find_attractors(system, 20)
    grid = {"amplitude[1]": np.linspace(-1.6, 1.6, 10), "velocity[1]": np.linspace(-1.0, 1.0, 10)}
    with pytest.warns(sb.DiagnosticWarning, match="undecided after 40 periods"):
        short = sb.dynamics.basins_of_attraction(found, grid, periods=40)
    assert short.attrs["undecided"] > 0.05
    assert diagnostics.diagnostics_of(short)[0].code == "dynamics.basins_undecided"
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "basins: the labels of")  # at 2 % damping borders are near
        ds = sb.dynamics.basins_of_attraction(found, grid)
    rate = 0.02 * float(system.model.omega[0]) * found.flow.period
    assert ds.attrs["periods"] == math.ceil(16.0 / rate) > 200
    assert ds.attrs["undecided"] <= 0.05
    lightly = system_of(1, 1.6, 0.03, 1e-5)
    periods, rule = settling_periods(Stroboscope(lightly))
    assert periods == 20_000 and "maximum of 20000" in rule


def test_refusals() -> None:
    system = system_of(1, 1.6, 0.03)
    with pytest.raises(sb.InputError, match="states"):
        sb.dynamics.find_attractors(henon(), 20)
    with pytest.raises(sb.InputError, match="attractors = "):
        sb.dynamics.basins_of_attraction(system, {})
    with pytest.raises(sb.InputError, match="must be False and True"):
        sb.dynamics.edge_tracking(system, np.array([-1.0, 0.0]), np.array([-1.0, 0.001]))
    found = sb.dynamics.find_attractors(logistic(3.2), np.array([[0.3]]))
    with pytest.raises(sb.InputError, match="two coordinates"):
        sb.dynamics.basins_of_attraction(found, {"x[1]": [0.1, 0.2]})
    with pytest.raises(sb.InputError, match="is not a coordinate"):
        sb.dynamics.basins_of_attraction(found, {"x[1]": [0.1, 0.2], "y": [0.1, 0.2]})


def twin_well(drive: float) -> sb.System:
    """x'' + .15 x' - x + x^3 = drive cos t."""
    model = sb.ReducedModel.from_matrices(
        [[1.0]], [[-1.0]], contact_shape=[1.0], nonlinear_stiffness=1.0, well_amplitude=[-1.0],
        damping_ratio=0.075 / math.sqrt(2.0), reference_frequency=0.5 / math.pi,
    )  # fmt: skip
    force = sb.HarmonicForce(amplitude=drive, frequency_ratio=1.0)
    return sb.System(model, forces=[sb.ExternalForce(history=force, shape=[1.0])])


@pytest.mark.slow
@pytest.mark.parametrize(("drive", "fractal"), [(0.05, False), (0.2, True)])
def test_labels_state_whether_the_error_of_the_integration_changes_them(drive, fractal, monkeypatch) -> None:
    """With a fractal border 14 % of the labels differ between the levels of accuracy: as many are marked as sensitive."""
    monkeypatch.setattr(diagnostics, "_told", set())
    system = twin_well(drive)
    grid = {"amplitude[1]": np.linspace(-2.0, 2.0, 40), "velocity[1]": np.linspace(-1.5, 1.5, 40)}
    found = {}
    for accuracy in ("standard", "reference"):
        attractors = sb.dynamics.find_attractors(system, 60, integration=sb.Integration(accuracy=accuracy))
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            found[accuracy] = sb.dynamics.basins_of_attraction(attractors, grid)
        assert any("change if the step is halved" in str(each.message) for each in caught) == fractal
    ds = found["standard"]
    differing = ds["basin"].values != found["reference"]["basin"].values
    share, low, high = (ds.attrs[f"sensitive_share{end}"] for end in ("", "_low", "_high"))
    assert low <= share <= high
    if not fractal:
        assert high < 0.01 and differing.mean() < 0.01
        return
    assert 0.11 < differing.mean() < 0.18
    assert low - 0.03 < differing.mean() < high + 0.03
    tested = ds["sensitive"].values >= 0
    # outside of the states that were tested hardly any label differs
    assert differing[~tested].sum() <= 0.03 * (~tested).sum()
    assert found["reference"].attrs["sensitive_share"] < 0.5 * share


def test_labels_of_a_map_without_steps_are_not_tested() -> None:
    """A map of one's own has no step that could be halved, and says nothing about sensitivity."""
    found = sb.dynamics.find_attractors(grebogi(), np.array([[0.1, 0.1], [3.0, 0.2], [1.0, -0.1]]), transient=300)
    grid = {"x[1]": np.linspace(-1.0, 4.0, 6), "x[2]": np.linspace(-0.4, 0.4, 5)}
    ds = sb.dynamics.basins_of_attraction(found, grid)
    assert "sensitive" not in ds and "sensitive_share" not in ds.attrs
