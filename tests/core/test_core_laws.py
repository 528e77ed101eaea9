"""Laws in the core against those of the model: numbers by name, force, potential, slope and damping."""

from __future__ import annotations

import numpy as np
import pytest

import snapbeam as sb
from snapbeam import _core
from snapbeam.solver.channels import LAWS

MADE = (
    sb.HertzContact(3.3e8),
    sb.PowerLaw(0.7, 2.3),
    sb.LayeredHertz(4e8, 2e12),
    sb.HuntCrossley(2e8, 3.1),
    sb.KelvinVoigt(3e5, 1.7),
    sb.ElasticPlasticContact(2e5, 7e5),
    sb.LocalSpring(stiffness=30.0, cubic_stiffness=4e7),
    sb.LocalSpring(stiffness=30.0, cubic_stiffness=-3e7),
    sb.ElectrostaticForce(voltage=30.0, area=2e-4, gap=-1.1e-3),
    sb.MagneticForce(strength=-4e-9, gap=9e-4),
    sb.QuadraticDamping(coefficient=0.3),
    sb.CoulombFriction(friction_force=2e-3, smoothing_velocity=0.03),
)
SPEEDS = (-0.4, -0.01, 0.0, 0.2)


def values(law, numbers, x, y):
    found = {name: np.empty(x.size) for name in ("force", "potential", "stiffness", "damping", "low", "high")}
    _core.law_values(law, {"x": x, "y": y, "numbers": np.array(numbers, float), **found})
    return found


def test_every_law_is_here():
    assert {*map(type, MADE), sb.Restitution} == set(LAWS)


@pytest.mark.parametrize("law", MADE, ids=repr)
def test_law(law):
    kind = type(law)
    number, names = LAWS[kind]
    contact = isinstance(law, sb.ContactLaw)
    held = law.numbers() if contact else law.numbers
    if contact and law.memory:
        held = held._replace(indentation=3e-7)
    x = np.geomspace(1e-9, 1e-5, 9) if contact else np.linspace(-5e-4, 5e-4, 9)
    for speed in SPEEDS:
        found = values(
            number,
            [getattr(held, name) for name in names],
            x,
            np.full(x.size, 0.0 if contact and law.memory else speed),
        )
        if contact:
            loss = [kind.damping_coefficient(held, d) for d in x] if law.rate_dependent else np.zeros(x.size)
            force = [kind.force(held, d) + c * speed for d, c in zip(x, loss, strict=True)]
            slopes = np.array([kind.slope(held, d) for d in x])
            if law.memory:
                assert (found["stiffness"] >= slopes).all()
            else:
                np.testing.assert_allclose(found["stiffness"], slopes, rtol=1e-12)
            np.testing.assert_allclose(found["damping"], loss, rtol=1e-12)
        else:
            loss = [kind.damping_force(held, u, speed) for u in x]
            force = [kind.force(held, u) + f for u, f in zip(x, loss, strict=True)]
            steep = np.abs([kind.damping_coefficient(held, u, speed) for u in x])
            assert (found["low"][0], found["high"][0]) == pytest.approx(kind.displacement_range(held))
            assert (found["damping"] >= steep * (1.0 - 1e-12)).all()
        np.testing.assert_allclose(found["force"], force, rtol=1e-12, atol=1e-300)
        np.testing.assert_allclose(found["potential"], [kind.energy(held, u) for u in x], rtol=1e-12, atol=1e-300)


@pytest.mark.parametrize("law", [law for law in MADE if isinstance(law, sb.LocalForce)], ids=repr)
def test_the_stiffness_bounds_the_slope_of_the_force(law):
    number, names = LAWS[type(law)]
    numbers = [getattr(law.numbers, name) for name in names]
    x = np.linspace(-6e-4, 6e-4, 101)
    found, moved = (values(number, numbers, x + dx, np.zeros(x.size)) for dx in (0.0, 1e-9))
    slope = np.abs(moved["force"] - found["force"]) / 1e-9
    assert (slope <= found["stiffness"] * (1.0 + 1e-3) + 1e-9).all()


def test_powers_of_any_size():
    """x^n = exp(n ln x) is as exact as the rounding of n ln x leaves it."""
    d = np.geomspace(1e-200, 1e200, 2001)
    for exponent in (1.0, 0.5, 1.4):
        exact = (1e6 * d) ** exponent
        kept = np.isfinite(exact)
        found = values(LAWS[sb.PowerLaw][0], [1.0, exponent], d, np.zeros(d.size))["force"]
        allowed = 2.3e-16 * (4.0 + 2.0 * np.abs(np.log(exact, where=kept, out=np.zeros(d.size))))
        assert (np.abs(found / exact - 1.0)[kept] <= allowed[kept]).all()
    assert values(LAWS[sb.PowerLaw][0], [1.0, 2.0], np.array([0.0, 1e-200, 1e200]), np.zeros(3))["force"].tolist() == [
        0.0,
        0.0,
        np.inf,
    ]


def test_friction_at_any_speed():
    speeds = np.geomspace(1e-300, 1e300, 3001)
    for side in (1.0, -1.0):
        found = values(LAWS[sb.CoulombFriction][0], [1.0, 1.0], np.zeros(speeds.size), side * speeds)["force"]
        np.testing.assert_allclose(found, -side * np.tanh(speeds), rtol=2e-15, atol=0.0)
