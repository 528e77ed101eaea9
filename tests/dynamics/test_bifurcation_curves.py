"""Bifurcation curves in two parameters: exact ones of maps, the beam's against its branches, refusals."""

from __future__ import annotations

import numpy as np
import pytest
from doubles import KnownMap, henon, table

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
    begun = point_of(
        henon(0.1), [0.8, 0.2], "a", (-0.4, 1.4), kind, direction="down" if kind == "fold" else "up"
    )
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


def struck(ratio: float, velocity: float) -> sb.System:
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=1, damping_ratio=0.05)
    drive = sb.Shaker(frequency_ratio=ratio, velocity_amplitude=velocity)
    return sb.System(model, contacts=[sb.Contact(default_values.CONTACT, drive)])


@pytest.mark.slow
def test_folds_of_the_beam_are_those_of_its_branches() -> None:
    """At another frequency, continued along the velocity, the fold is where the curve says."""
    options = {"transient": 100}
    orbit = sb.dynamics.periodic_orbit(struck(1.6, 0.03), **options)
    begun = sb.dynamics.continuation(orbit, "velocity_amplitude", (0.02, 0.3), max_points=12).special_points[
        0
    ]
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
    grazing = sb.dynamics.SpecialPoint("grazing", begun.orbit, 0.1, 0)
    with pytest.raises(InputError, match="must be one of fold, flip, Neimark-Sacker"):
        sb.dynamics.bifurcation_curve(grazing, ("a", "b"), bounds)
    orbit = sb.dynamics.periodic_orbit(struck(1.6, 0.03), transient=100)
    fold = sb.dynamics.continuation(orbit, "velocity_amplitude", (0.02, 0.3), max_points=12).special_points[0]
    pair = ("velocity_amplitude", "drive.velocity_amplitude")
    with pytest.raises(InputError, match="two different parameters"):
        sb.dynamics.bifurcation_curve(fold, pair, ((0.02, 0.3), (0.02, 0.3)))
    with pytest.raises(InputError, match=r"modes cannot differ between runs|names"):
        sb.dynamics.bifurcation_curve(fold, ("velocity_amplitude", "modes"), ((0.02, 0.3), (1, 3)))
