"""Bifurcation curves in two parameters: exact ones of maps, the beam's against its branches, refusals."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from doubles import KnownMap, henon, table
from test_continuation import grazes_at
from test_orbits import exact_orbit, oscillator

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.util.validation import InputError


def point_of(flow, start, name, bounds, kind, **options):
    orbit = sb.dynamics.periodic_orbit(flow, start)
    branch = sb.dynamics.continuation(orbit, name, bounds, **options)
    return next(point for point in branch.special_points if point.kind == kind)


def cubic(a: float, b: float) -> KnownMap:
    """x -> a + b x - x^3: folds on 27 a^2 = 4 (b - 1)^3, with a cusp at (0, 1)."""
    return KnownMap(
        lambda x, of: (of["a"] + of["b"] * x[:, 0] - x[:, 0] ** 3)[:, None],
        lambda x, of: table([of["b"] - 3.0 * x[:, 0] ** 2]),
        1, a=a, b=b,
    )  # fmt: skip


def delayed(r: float, k: float) -> KnownMap:
    """(x, y) -> (y, r y (1 - x^k)): its fixed point turns at r = 1 + 1/k, the multipliers being complex."""
    return KnownMap(
        lambda x, of: np.stack([x[:, 1], of["r"] * x[:, 1] * (1.0 - x[:, 0] ** of["k"])], axis=1),
        lambda x, of: table(
            [0.0, 1.0],
            [-of["r"] * x[:, 1] * of["k"] * x[:, 0] ** (of["k"] - 1.0), of["r"] * (1.0 - x[:, 0] ** of["k"])],
        ),
        2, r=r, k=k,
    )  # fmt: skip


def apart(a: float, b: float) -> KnownMap:
    """(x, y) -> (x + a - x^2, -(1 + b) y): folds at a = 0, flips at b = 0."""
    return KnownMap(
        lambda x, of: np.stack([x[:, 0] + of["a"] - x[:, 0] ** 2, -(1.0 + of["b"]) * x[:, 1]], axis=1),
        lambda x, of: table([1.0 - 2.0 * x[:, 0], 0.0], [0.0, -(1.0 + of["b"])]),
        2, a=a, b=b,
    )  # fmt: skip


@pytest.mark.parametrize(("kind", "factor"), [("fold", -0.25), ("flip", 0.75)])
def test_curves_of_the_henon_map(kind: str, factor: float) -> None:
    """a = -(1 - b)^2/4 at the folds and 3 (1 - b)^2/4 at the flips, within the stated errors."""
    begun = point_of(henon(0.1), [0.8, 0.2], "a", (-0.4, 1.4), kind, direction="down" if kind == "fold" else "up")
    curve = sb.dynamics.bifurcation_curve(begun, ("a", "b"), ((-0.6, 1.8), (-0.5, 0.6)))
    b = curve["b"].values
    np.testing.assert_allclose(curve["a"], factor * (1.0 - b) ** 2, rtol=0.0, atol=1e-8)
    assert b.min() == pytest.approx(-0.5, abs=1e-9) and b.max() == pytest.approx(0.6, abs=1e-9)
    assert curve.attrs["termination_reason"] == "limit of a parameter; limit of a parameter"
    assert curve.sizes["special_point"] == 0 and (curve["impacts"] == -1).all()


def test_the_cusp_of_a_cubic_map() -> None:
    begun = point_of(cubic(0.0, 1.5), [0.7], "a", (-0.5, 0.5), "fold", direction="down")
    curve = sb.dynamics.bifurcation_curve(begun, ("a", "b"), ((-0.5, 0.5), (0.8, 1.7)))
    a, b = curve["a"].values, curve["b"].values
    np.testing.assert_allclose(27.0 * a**2, 4.0 * (b - 1.0) ** 3, rtol=0.0, atol=1e-8)
    assert a.min() < -0.1 and a.max() > 0.1, "both branches of the curve, through the cusp"
    assert curve["special_point_kind"].values.tolist() == ["cusp"]
    assert curve["special_point_a"].item() == pytest.approx(0.0, abs=1e-8)
    assert curve["special_point_b"].item() == pytest.approx(1.0, abs=1e-8)


def test_neimark_sacker_points() -> None:
    begun = point_of(delayed(1.8, 1.0), [0.45, 0.45], "r", (1.7, 2.4), "Neimark-Sacker")
    curve = sb.dynamics.bifurcation_curve(begun, ("r", "k"), ((1.4, 2.6), (0.7, 2.0)))
    np.testing.assert_allclose(curve["r"], 1.0 + 1.0 / curve["k"], rtol=0.0, atol=1e-8)
    assert curve["k"].max() == pytest.approx(2.0)


def test_a_fold_with_a_second_multiplier_of_minus_one() -> None:
    begun = point_of(apart(0.09, 0.3), [0.3, 0.0], "a", (-0.1, 0.2), "fold", direction="down")
    curve = sb.dynamics.bifurcation_curve(begun, ("a", "b"), ((-0.1, 0.2), (-0.5, 0.5)))
    np.testing.assert_allclose(curve["a"], 0.0, atol=1e-8)
    assert curve["special_point_kind"].values.tolist() == ["fold-flip"]
    assert curve["special_point_b"].item() == pytest.approx(0.0, abs=1e-7)


def planar(c: float, d: float, t: float) -> KnownMap:
    """(x, y) -> (y, c - d x + t y + x^2): trace t and determinant d - 2 x."""
    return KnownMap(
        lambda x, of: np.stack([x[:, 1], of["c"] - of["d"] * x[:, 0] + of["t"] * x[:, 1] + x[:, 0] ** 2], axis=1),
        lambda x, of: table([0.0, 1.0], [2.0 * x[:, 0] - of["d"], of["t"]]),
        2, c=c, d=d, t=t,
    )  # fmt: skip


def test_strong_resonances_of_a_neimark_sacker_curve() -> None:
    """At the origin the curve is d = 1, with cos(theta) = t/2, from the resonance 1:2 at t = -2 to 1:1 at t = 2."""
    begun = point_of(planar(0.0, 0.9, 0.5), [0.0, 0.0], "d", (0.8, 1.2), "Neimark-Sacker")
    curve = sb.dynamics.bifurcation_curve(begun, ("d", "t"), ((0.8, 1.2), (-3.0, 3.0)))
    np.testing.assert_allclose(curve["d"], 1.0, rtol=0.0, atol=1e-8)
    found = dict(zip(curve["special_point_kind"].values.tolist(), curve["special_point_t"].values, strict=True))
    assert found == pytest.approx({"resonance 1:3": -1.0, "resonance 1:4": 0.0}, abs=1e-7)
    assert curve["t"].min() == pytest.approx(-2.0, abs=0.1) and curve["t"].max() == pytest.approx(2.0, abs=0.1)
    assert curve.attrs["termination_reason"].count("resonances 1:1 and 1:2") == 2


def test_resonances_at_the_ends_of_folds_and_flips() -> None:
    """Two multipliers +1 on the fold, at t = 2 and 4 c = (1 - d)^2; two of -1 on the flip of the origin, at t = -2."""
    d = 0.5
    begun = point_of(planar(0.0, d, 1.2), [0.0, 0.0], "c", (-0.2, 0.2), "fold")
    curve = sb.dynamics.bifurcation_curve(begun, ("c", "t"), ((-0.2, 0.3), (1.0, 2.5)))
    at = curve["special_point_kind"].values.tolist().index("resonance 1:1")
    assert curve["special_point_t"].values[at] == pytest.approx(2.0, abs=1e-7)
    assert curve["special_point_c"].values[at] == pytest.approx((1.0 - d) ** 2 / 4.0, abs=1e-8)
    begun = point_of(planar(0.0, 0.5, -1.2), [0.0, 0.0], "t", (-1.8, -1.0), "flip", direction="down")
    curve = sb.dynamics.bifurcation_curve(begun, ("d", "t"), ((0.2, 1.5), (-2.5, -1.0)))
    np.testing.assert_allclose(curve["t"], -1.0 - curve["d"], rtol=0.0, atol=1e-8)
    at = curve["special_point_kind"].values.tolist().index("resonance 1:2")
    assert curve["special_point_t"].values[at] == pytest.approx(-2.0, abs=1e-7)


@pytest.mark.parametrize("coupling", [0.0, 0.7])
def test_a_generalized_flip(coupling: float) -> None:
    """x -> -(1 + a) x + s x^2 + b x^3 has the coefficient b + s^2 at a = 0; with y -> y/2 + k x^2 and k' y x it is b + s^2 + 2 k k'."""
    s, k = 0.8, 0.9
    flow = KnownMap(
        lambda x, of: np.stack(
            [-(1.0 + of["a"]) * x[:, 0] + s * x[:, 0] ** 2 + of["b"] * x[:, 0] ** 3 + coupling * x[:, 0] * x[:, 1],
             0.5 * x[:, 1] + k * x[:, 0] ** 2], axis=1),
        lambda x, of: table(
            [-(1.0 + of["a"]) + 2.0 * s * x[:, 0] + 3.0 * of["b"] * x[:, 0] ** 2 + coupling * x[:, 1], coupling * x[:, 0]],
            [2.0 * k * x[:, 0], 0.5]),
        2, a=-0.1, b=-0.3,
    )  # fmt: skip
    begun = point_of(flow, [0.0, 0.0], "a", (-0.2, 0.2), "flip")
    curve = sb.dynamics.bifurcation_curve(begun, ("a", "b"), ((-0.2, 0.2), (-3.0, 0.5)))
    np.testing.assert_allclose(curve["a"], 0.0, rtol=0.0, atol=1e-8)
    assert curve["special_point_kind"].values.tolist() == ["generalized flip"]
    assert curve["special_point_b"].item() == pytest.approx(-(s**2) - 2.0 * k * coupling, abs=1e-4)


DAMPING = 0.05


def grazing_amplitude(ratio: np.ndarray) -> np.ndarray:
    """Force at which the oscillator x'' + 2 zeta x' + x = F cos(r t) without contact just reaches x = 1."""
    return np.sqrt((1.0 - ratio**2) ** 2 + (2.0 * DAMPING * ratio) ** 2)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("law", "points"), [(sb.HertzContact(1e9), 3), (sb.HertzContact(1e9), 200), (sb.Restitution(0.8), 200)]
)
def test_the_grazing_curve_of_an_oscillator_before_a_stop(law: sb.ContactLaw, points: int) -> None:
    """It is the resonance curve, to 1e-9, under any law of contact, through the resonance itself."""
    model = sb.ReducedModel.from_matrices([[1.0]], [1.0], contact_shape=[1.0], length_scale=1.0, damping_ratio=DAMPING)
    stop = sb.Contact(law, sb.Striker(drive=sb.FixedStop(), gap=1.0))
    force = float(0.98 * grazing_amplitude(np.array(1.1)))
    history = sb.HarmonicForce(amplitude=force, frequency_ratio=1.1)
    system = sb.System(model, contacts=[stop], forces=[sb.ExternalForce(shape=[1.0], history=history)])
    # linear, so that Newton's method finds it from anywhere without a contact
    light = sb.dynamics.periodic_orbit(system.replace(**{"force.amplitude": 1e-3 * force}))
    orbit = sb.dynamics.periodic_orbit(system, 1e3 * light.coordinates)
    assert orbit.contact_summary.clearance == pytest.approx(0.02, abs=1e-9)
    branch = sb.dynamics.continuation(orbit, "force.amplitude", (0.9 * force, 1.1 * force), step=0.05, max_step=0.1)
    grazing = branch.special_points[-1]
    assert grazing.kind == "grazing"
    names, bounds = ("force.frequency_ratio", "force.amplitude"), ((0.9, 1.3), (0.02, 2.0))
    curve = sb.dynamics.bifurcation_curve(
        grazing, names, bounds, step=0.1, max_step=0.2, tolerance=1e-12, max_points=points
    )
    ratio, found = (curve[name].values for name in curve.attrs["parameters"])
    assert curve.attrs["contact_force"] == "left out" and curve.attrs["kept_gap"] == 0.0
    if points > 3:
        assert ratio.min() == pytest.approx(0.9) and ratio.max() == pytest.approx(1.3)
    np.testing.assert_allclose(found, grazing_amplitude(ratio), rtol=1e-9)
    with pytest.raises(InputError, match="does not change where"):
        name = "contact.coefficient" if law.impulsive else "contact.stiffness"
        low, high = 0.5 * system.get(name), 1.01 * system.get(name)
        sb.dynamics.bifurcation_curve(grazing, (name, "force.amplitude"), ((low, high), (0.02, 2.0)))


@pytest.mark.slow
def test_the_grazing_curve_of_orbits_with_an_impact() -> None:
    """The exact (1, 2) orbit of an oscillator at a vibrating wall, under Newton's law: its flight touches once more."""
    orbit = sb.dynamics.periodic_orbit(oscillator(3.6, 0.8), exact_orbit(3.6, 0.8, 2)[1], 2, phase=math.pi)
    branch = sb.dynamics.continuation(orbit, "frequency_ratio", (2.001, 3.61), direction="down", max_step=0.1)
    names, bounds = ("frequency_ratio", "contact.coefficient"), ((2.001, 3.61), (0.75, 0.85))
    curve = sb.dynamics.bifurcation_curve(branch.special_points[-1], names, bounds, max_points=4, step=1e-3)
    assert curve.sizes["point"] > 4
    assert curve.attrs["contact_force"] == "included" and curve.attrs["kept_gap"] == 1e-6
    for ratio, restitution in zip(
        curve["frequency_ratio"].values, curve["restitution_coefficient"].values, strict=True
    ):
        assert ratio == pytest.approx(grazes_at(float(restitution), 2, 3.6), abs=1e-4)


def struck(ratio: float, velocity: float) -> sb.System:
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=1, damping_ratio=0.05)
    drive = sb.Shaker(frequency_ratio=ratio, velocity_amplitude=velocity)
    return sb.System(model, contacts=[sb.Contact(default_values.CONTACT, drive)])


@pytest.mark.slow
def test_folds_of_the_beam_are_those_of_its_branches() -> None:
    """At another frequency, continued along the velocity, the fold is where the curve says."""
    options = {"transient": 100}
    orbit = sb.dynamics.periodic_orbit(struck(1.6, 0.03), **options)
    begun = sb.dynamics.continuation(orbit, "velocity_amplitude", (0.02, 0.3), max_points=12).special_points[0]
    names = ("frequency_ratio", "velocity_amplitude")
    curve = sb.dynamics.bifurcation_curve(begun, names, ((1.45, 1.7), (0.02, 0.1)))
    assert (np.diff(curve["frequency_ratio"]) < 0.0).all() or (np.diff(curve["frequency_ratio"]) > 0.0).all()
    middle = curve.sizes["point"] // 3
    ratio = float(curve["frequency_ratio"][middle])
    other = sb.dynamics.periodic_orbit(struck(ratio, 0.02), **options)
    found = sb.dynamics.continuation(other, "velocity_amplitude", (0.015, 0.1)).special_points[0]
    assert found.kind == "fold"
    error = float(curve["velocity_amplitude_error"][middle]) + found.error
    assert abs(found.value - float(curve["velocity_amplitude"][middle])) < error < 1e-5
    near = np.abs(curve["multiplier_real"] - 1.0).min("multiplier")
    assert float(near.max()) < 1e-4
    ax = sb.plot.plot_bifurcation_curve(curve)
    assert ax.get_xlabel() == r"Excitation frequency $\Omega$" and len(ax.lines) == 1
    with pytest.raises(InputError, match="labels"):
        sb.plot.plot_bifurcation_curve([curve], labels=["one", "two"])
    with pytest.raises(InputError, match="no bifurcation curve"):
        sb.plot.plot_bifurcation_curve(orbit.to_dataset())


def test_what_cannot_be_followed_is_refused() -> None:
    begun = point_of(henon(0.1), [0.8, 0.2], "a", (-0.4, 1.4), "flip")
    bounds = ((-0.6, 1.8), (-0.5, 0.8))
    with pytest.raises(InputError, match="two different parameters"):
        sb.dynamics.bifurcation_curve(begun, ("a", "a"), bounds)
    with pytest.raises(InputError, match=r"bounds\[1\]"):
        sb.dynamics.bifurcation_curve(begun, ("a", "b"), ((-0.6, 1.8), (0.8, 0.8)))
    with pytest.raises(InputError, match=r"b = 0\.3"):
        sb.dynamics.bifurcation_curve(begun, ("a", "b"), ((-0.6, 1.8), (0.5, 0.8)))
    with pytest.raises(InputError, match="special_point"):
        sb.dynamics.bifurcation_curve(3, ("a", "b"), bounds)
    with pytest.raises(InputError, match="must be one of fold, flip, Neimark-Sacker, grazing"):
        sb.dynamics.bifurcation_curve(replace(begun, kind="branch point"), ("a", "b"), bounds)
    with pytest.raises(InputError, match="the gap of a map is not known"):
        sb.dynamics.bifurcation_curve(replace(begun, kind="grazing"), ("a", "b"), bounds)
    orbit = sb.dynamics.periodic_orbit(struck(1.6, 0.03), transient=100)
    fold = sb.dynamics.continuation(orbit, "velocity_amplitude", (0.02, 0.3), max_points=12).special_points[0]
    pair = ("velocity_amplitude", "drive.velocity_amplitude")
    with pytest.raises(InputError, match="two different parameters"):
        sb.dynamics.bifurcation_curve(fold, pair, ((0.02, 0.3), (0.02, 0.3)))
    with pytest.raises(InputError, match=r"modes cannot differ between runs|names"):
        sb.dynamics.bifurcation_curve(fold, ("velocity_amplitude", "modes"), ((0.02, 0.3), (1, 3)))
