"""Invariant manifolds: exact ones of maps, invariance under the map, and Melnikov's threshold of a twin-well oscillator."""

from __future__ import annotations

import math

import numpy as np
import pytest
from doubles import KnownMap, henon, table

import snapbeam as sb
from snapbeam.dynamics.manifolds import _continued
from snapbeam.model import default_values
from snapbeam.model.state import amplitude_scale
from snapbeam.util.validation import InputError


def bent(expansion: float) -> KnownMap:
    """(x, y) -> (s x, y/4 + x^2): the manifolds of the origin are y = x^2/(s^2 - 1/4) and x = 0."""
    return KnownMap(
        lambda x, of: np.stack([of["s"] * x[:, 0], 0.25 * x[:, 1] + x[:, 0] ** 2], axis=1),
        lambda x, of: table([of["s"], 0.0], [2.0 * x[:, 0], 0.25]),
        2, s=expansion,
    )  # fmt: skip


@pytest.mark.parametrize("expansion", [2.0, -1.5, 60.0])
def test_exact_manifolds(expansion: float) -> None:
    """Both, also with a negative multiplier and with a large one, within the error of a chord."""
    saddle = sb.dynamics.periodic_orbit(bent(expansion), [0.1, 0.1])
    unstable = sb.dynamics.invariant_manifold(saddle, max_arclength=4.0)
    x, y = unstable["state"].values.T
    np.testing.assert_allclose(y, x**2 / (expansion**2 - 0.25), rtol=0.0, atol=1e-8)
    assert x.min() < -0.9 and x.max() > 0.9
    for side in (-1, 1):
        points = unstable["state"].values[unstable["side"].values == side]
        chords = np.diff(points, axis=0)
        size = np.linalg.norm(chords, axis=1)
        assert size.max() <= 0.05 and size.sum() >= 4.0
        cosine = (chords[1:] * chords[:-1]).sum(axis=1) / (size[1:] * size[:-1])
        assert np.arccos(np.minimum(cosine, 1.0)).max() <= 0.2
    stable = sb.dynamics.invariant_manifold(saddle, "stable", max_arclength=3.0)
    np.testing.assert_allclose(stable["state"].values[:, 0], 0.0, atol=1e-9)
    assert stable["state"].values[:, 1].max() >= 3.0 - 1e-4
    assert sb.dynamics.homoclinic_points(unstable, stable).sizes["point"] == 0


def test_manifolds_of_the_henon_map() -> None:
    """Points of the stable manifold come to the saddle; homoclinic points do so forwards, and lie on both."""
    saddle = sb.dynamics.periodic_orbit(henon(1.4, 0.3), [0.6, 0.19])
    unstable = sb.dynamics.invariant_manifold(saddle, max_arclength=10.0, max_distance=0.02)
    stable = sb.dynamics.invariant_manifold(saddle, "stable", max_arclength=5.0)
    assert stable.attrs["multiplier"] == pytest.approx(-0.3 / unstable.attrs["multiplier"])
    early = stable["age"].values < 3.0
    came = saddle.flow.advance(stable["state"].values[early], 12).states
    assert np.abs(came - saddle.coordinates).max() < 1e-2
    crossing = sb.dynamics.homoclinic_points(unstable, stable)
    assert crossing.sizes["point"] > 5 and (np.diff(crossing["arclength"]) >= 0.0).all()
    for point in crossing["state"].values:
        near = np.linalg.norm(stable["state"].values - point, axis=1).min()
        assert near <= 0.05 and np.linalg.norm(unstable["state"].values - point, axis=1).min() <= 0.02
    ax = sb.plot.plot_manifold(unstable)
    sb.plot.plot_manifold(stable, ax)
    assert len(ax.lines) == 6


def test_points_and_length_are_limited() -> None:
    saddle = sb.dynamics.periodic_orbit(henon(1.4, 0.3), [0.6, 0.19])
    short = sb.dynamics.invariant_manifold(saddle, max_arclength=100.0, max_points=200)
    assert short.attrs["termination_reason"] == "max_points; max_points"
    assert short.sizes["point"] <= 400 and short["arclength"].max() < 100.0


def test_refusals() -> None:
    sink = sb.dynamics.periodic_orbit(henon(0.2, 0.3), [0.7, 0.2])
    with pytest.raises(InputError, match="unstable manifold has 0 dimensions"):
        sb.dynamics.invariant_manifold(sink)
    with pytest.raises(InputError, match="stable manifold has 2 dimensions"):
        sb.dynamics.invariant_manifold(sink, "stable")
    saddle = sb.dynamics.periodic_orbit(henon(1.4, 0.3), [0.6, 0.19])
    unstable = sb.dynamics.invariant_manifold(saddle, max_arclength=1.0)
    with pytest.raises(InputError, match="must be the stable manifold"):
        sb.dynamics.homoclinic_points(unstable, unstable)


@pytest.mark.parametrize(("bounds", "crosses"), [((1.39, 1.41), True), ((0.96, 0.99), False)])
def test_bounds_on_one_side_of_a_tangency_keep_what_was_found(bounds, crosses) -> None:
    saddle = sb.dynamics.periodic_orbit(henon(1.4, 0.3), [0.6, 0.19])
    with pytest.warns(sb.DiagnosticWarning, match="cross at both values" if crosses else "at neither value"):
        found = sb.dynamics.homoclinic_tangency(saddle, "a", bounds, max_arclength=3.0, max_distance=0.05)
    assert "give one with and one without crossing" in found.attrs["termination_reason"]
    assert found["value"].values.tolist() == list(bounds)
    assert found["crosses"].values.tolist() == [crosses, crosses]
    assert np.isfinite(found["bracket"].values).tolist() == [not crosses, crosses]
    if crosses:  # the advice works
        options = {"max_arclength": 3.0, "max_distance": 0.05, "tolerance": 0.5}
        found = sb.dynamics.homoclinic_tangency(saddle, "a", (1.0, 1.4), **options)
        assert found.attrs["termination_reason"] == "tolerance"


@pytest.mark.slow
def test_a_saddle_is_followed_to_a_value_from_which_newtons_method_would_not_find_it() -> None:
    """The hilltop saddle of the two-well oscillator (multiplier 245), in steps of its amplitude."""
    model = sb.ReducedModel.from_matrices(
        [[1.0]], [-1.0], contact_shape=[1.0], nonlinear_stiffness=1.0, well_amplitude=[-1.0],
        damping_ratio=0.25 / (2.0 * np.sqrt(2.0)), reference_frequency=0.5 / np.pi,
    )  # fmt: skip
    force = sb.ExternalForce(history=sb.HarmonicForce(frequency_ratio=1.0, amplitude=0.2))
    saddle = sb.dynamics.periodic_orbit(sb.System(model, forces=[force]), [0.0, -0.1])
    alone = saddle.flow.changed({"force.amplitude": 0.15})
    with pytest.raises(sb.dynamics.OrbitNotFoundError):
        sb.dynamics.periodic_orbit(alone, saddle.coordinates)
    found = sb.dynamics.homoclinic_tangency(saddle, "force.amplitude", (0.15, 0.23), max_seconds=1e-3)
    assert found.attrs["termination_reason"] == "max_seconds"
    found = sb.dynamics.homoclinic_tangency(saddle, "force.amplitude", (0.15, 0.23), tolerance=0.02)
    apart, crossing = found["bracket"].values
    # Guckenheimer and Holmes (section 2.2) observe it near .188; Melnikov's first order is .19
    assert found.attrs["termination_reason"] == "tolerance" and 0.185 < apart < crossing < 0.192
    there = _continued(saddle, "force.amplitude", 0.15)
    assert there.flow.value("force.amplitude") == 0.15
    assert abs(there.multipliers).max() > 100.0
    assert np.abs(there.coordinates).max() < 0.2 and there.coordinates[1] == pytest.approx(-0.075, abs=0.02)


def test_a_saddle_that_is_gone_keeps_what_was_found() -> None:
    """Below a = -(1 - b)^2/4 the Henon map has no fixed point; a = 1 - c."""
    henon_map = henon(1.0, 0.3)
    falling = KnownMap(
        lambda x, of: henon_map._step(x, {"a": 1.0 - of["c"], "b": of["b"]}),
        lambda x, of: henon_map._slope(x, {"a": 1.0 - of["c"], "b": of["b"]}),
        2, c=0.0, b=0.3,
    )  # fmt: skip
    saddle = sb.dynamics.periodic_orbit(falling, [0.6, 0.19])
    options = {"max_arclength": 1.0, "max_distance": 0.05}
    with pytest.warns(sb.DiagnosticWarning, match=r"c = 1\.7: "):
        found = sb.dynamics.homoclinic_tangency(saddle, "c", (0.0, 1.7), **options)
    assert found["value"].values.tolist() == [0.0]
    assert "c = 1.7: " in found.attrs["termination_reason"]
    with pytest.raises((sb.dynamics.OrbitNotFoundError, InputError)):
        sb.dynamics.homoclinic_tangency(saddle, "c", (1.7, 1.9), **options)


def test_a_map_that_jumps_ends_the_branch() -> None:
    """No gap wider than max_distance is left without a word."""
    jumping = KnownMap(
        lambda x, of: np.stack([2.0 * x[:, 0] + (x[:, 0] > 0.3), 0.25 * x[:, 1]], axis=1),
        lambda x, of: table([2.0, 0.0], [0.0, 0.25]),
        2, unused=0.0,
    )  # fmt: skip
    found = sb.dynamics.invariant_manifold(sb.dynamics.periodic_orbit(jumping, [0.1, 0.1]), max_arclength=5.0)
    right, left = found.attrs["termination_reason"].split("; ")
    if found["state"].values[found["side"].values == 1][:, 0].max() < 0.0:
        right, left = left, right
    assert right.startswith("the map jumps") and left == "max_arclength"
    for side in (-1, 1):
        states = found["state"].values[found["side"].values == side]
        assert np.linalg.norm(np.diff(states, axis=0), axis=1).max() <= 0.05


def test_a_manifold_that_ends_early_is_no_proof_that_none_cross(monkeypatch: pytest.MonkeyPatch) -> None:
    from snapbeam.dynamics import manifolds

    monkeypatch.setattr(manifolds, "_POINTS", 40)
    saddle = sb.dynamics.periodic_orbit(henon(1.0, 0.3), [0.7, 0.2])
    with pytest.warns(sb.DiagnosticWarning, match="choose a smaller max_arclength"):
        found = sb.dynamics.homoclinic_tangency(saddle, "a", (0.95, 1.05))
    assert "manifold ends before max_arclength" in found.attrs["termination_reason"]
    assert found.sizes["value"] == 0 and np.isnan(found["bracket"]).all()


def test_bracket_of_a_tangency() -> None:
    """The manifolds of the Henon map begin to cross between a = 1 and 1.4."""
    saddle = sb.dynamics.periodic_orbit(henon(1.4, 0.3), [0.6, 0.19])
    told: list[float] = []
    options = {"max_arclength": 3.0, "max_distance": 0.05, "tolerance": 0.2}
    found = sb.dynamics.homoclinic_tangency(saddle, "a", (1.0, 1.4), **options, progress=told.append)
    apart, crossing = found["bracket"].sel(manifolds=["apart", "crossing"]).values
    assert 1.0 <= apart < crossing <= 1.4 and crossing - apart <= 0.08 + 1e-12
    assert found.attrs["termination_reason"] == "tolerance"
    crosses = found["crosses"].values
    assert not crosses[found["value"].values <= apart].any() and crosses[found["value"].values >= crossing].all()
    assert told == sorted(told) and told[-1] == 1.0 and len(told) > 10


@pytest.mark.parametrize("known", [0, 1, 2, 3])
def test_a_search_that_is_stopped_keeps_what_it_found(known: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """The time is over after so many values: each is kept, with the bracket that they give."""
    from snapbeam.dynamics import manifolds

    made, tell = [], manifolds.homoclinic_points
    monkeypatch.setattr(manifolds, "homoclinic_points", lambda *both: made.append(1) or tell(*both))
    monkeypatch.setattr(manifolds._Clock, "is_over", property(lambda clock: len(made) >= known))
    saddle = sb.dynamics.periodic_orbit(henon(1.4, 0.3), [0.6, 0.19])
    found = sb.dynamics.homoclinic_tangency(
        saddle, "a", (1.0, 1.4), max_arclength=3.0, max_distance=0.05, max_seconds=9.0
    )
    assert found.attrs["termination_reason"] == "max_seconds"
    assert found.sizes["value"] == known
    apart, crossing = found["bracket"].values
    assert [np.isnan(apart), np.isnan(crossing)] == [known < 1, known < 2]
    if known == 3:
        assert crossing - apart == pytest.approx(0.2)


def test_a_manifold_that_is_stopped_keeps_its_points(monkeypatch: pytest.MonkeyPatch) -> None:
    from snapbeam.dynamics import manifolds

    asked: list[int] = []
    monkeypatch.setattr(manifolds._Clock, "is_over", property(lambda clock: asked.append(1) or len(asked) > 12))
    saddle = sb.dynamics.periodic_orbit(henon(1.4, 0.3), [0.6, 0.19])
    curve = sb.dynamics.invariant_manifold(saddle, "stable", max_seconds=1.0, max_arclength=100.0)
    assert curve.attrs["termination_reason"] == "max_seconds; max_seconds"
    assert curve.sizes["point"] > 10 and np.isfinite(curve["state"]).all()
    with pytest.raises(InputError, match="max_seconds = 0"):
        sb.dynamics.invariant_manifold(saddle, max_seconds=0.0)


@pytest.mark.slow
def test_stable_manifold_of_a_struck_beam() -> None:
    """It is complete, ends at its length, and the map takes its points to the curve again."""
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=1, damping_ratio=0.05)
    shaker = sb.Shaker(frequency_ratio=1.6, velocity_amplitude=0.03)
    saddle = sb.dynamics.periodic_orbit(
        sb.System(model, contacts=[sb.Contact(default_values.CONTACT, shaker)]), [0.0, 0.0]
    )
    curve = sb.dynamics.invariant_manifold(saddle, "stable", max_arclength=2.5)
    assert curve.attrs["termination_reason"] == "max_arclength; max_arclength"
    for side in (-1, 1):
        age, states = (curve[name].values[curve["side"].values == side] for name in ("age", "state"))
        length = np.linalg.norm(np.diff(states, axis=0), axis=1).cumsum()
        assert length[-2] <= 2.5 + 1e-12 and length[-1] >= 2.5 and (np.diff(age) > 0.0).all()
        late = age >= 1.0
        came = saddle.flow.advance(states[late], saddle.period).states
        # the nearest point of a chord
        chords = np.diff(states, axis=0)
        away = came[:, None] - states[:-1]
        part = np.clip((away * chords).sum(axis=2) / (chords**2).sum(axis=1), 0.0, 1.0)
        apart = np.linalg.norm(away - part[..., None] * chords, axis=2).min(axis=1)
        assert apart.max() < curve.attrs["chord_error"]


@pytest.mark.slow
def test_newtons_law_has_no_inverse() -> None:
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=1, damping_ratio=0.05)
    shaker = sb.Shaker(frequency_ratio=1.6, velocity_amplitude=0.005)
    system = sb.System(model, contacts=[sb.Contact(sb.Restitution(0.8), shaker)])
    saddle = sb.dynamics.periodic_orbit(system, [0.0, 0.0])
    with pytest.raises(InputError, match="under Newton's law the map has no inverse"):
        sb.dynamics.invariant_manifold(saddle, "stable")


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:accuracy = 'standard'")
def test_melnikovs_threshold() -> None:
    """x'' + d x' - x + x^3 = g cos(w t): tangency at g/d = 4 cosh(pi w/2)/(3 sqrt(2) pi w), for light damping."""
    damping_ratio, ratio = 0.01, 0.9
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=1, damping_ratio=damping_ratio)
    # in the time of the saddle the frequency of a well is sqrt(2)
    w, d = ratio * math.sqrt(2.0), 2.0 * damping_ratio * math.sqrt(2.0)
    threshold = d * 4.0 * math.cosh(0.5 * math.pi * w) / (3.0 * math.sqrt(2.0) * math.pi * w)
    unit = 0.5 * (2.0 * math.pi * model.reference_frequency) ** 2 * amplitude_scale(model)
    force = threshold * unit * model.mass[0, 0] / float(np.ravel(model.shape_at(0.5))[0])
    history = sb.HarmonicForce(amplitude=force, frequency_ratio=ratio)
    system = sb.System(model, forces=[sb.ExternalForce(location=0.5, history=history)])
    saddle = sb.dynamics.periodic_orbit(system, [0.0, 0.0], integration=sb.Integration())
    found = sb.dynamics.homoclinic_tangency(
        saddle, "force.amplitude", (0.95 * force, 1.05 * force), max_arclength=4.5, max_distance=0.05, tolerance=0.1
    )
    assert found.attrs["termination_reason"] == "tolerance"
    without, crossing = found["bracket"].values
    assert without < crossing
    assert without == pytest.approx(force, rel=0.031) and crossing == pytest.approx(force, rel=0.031)
