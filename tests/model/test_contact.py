"""Hertz's law: stiffness from materials, and the free impact it implies."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq

import snapbeam as sb
from snapbeam.model.contact.base import LAWS, ContactLaw
from snapbeam.model.contact.hertz import HertzContact
from snapbeam.model.contact.hunt_crossley import HuntCrossley
from snapbeam.model.contact.kelvin_voigt import KelvinVoigt
from snapbeam.model.contact.layered_hertz import LayeredHertz
from snapbeam.model.contact.loss import loss_number, restitution_of_loss
from snapbeam.model.contact.power_law import PowerLaw
from snapbeam.model.contact.restitution import Restitution
from snapbeam.util.validation import InputError, InputTypeError


def test_from_materials() -> None:
    """A tip of polylactic acid (3.5 GPa, 2.5 mm) on steel gives 2.6e8; the paper's 4e8 needs 5.3 GPa."""
    common = HertzContact.from_materials(2.5e-3, (3.5e9, 200e9), (0.35, 0.3))
    assert common.stiffness == pytest.approx(2.6e8, rel=0.01)
    stiff = HertzContact.from_materials(2.5e-3, (5.3e9, 200e9), (0.35, 0.3))
    assert stiff.stiffness == pytest.approx(4e8, rel=0.03)
    rigid_flat = HertzContact.from_materials(0.01, (200e9, 1e300), (0.3, 0.3))
    assert rigid_flat.stiffness == pytest.approx(4 / 3 * 0.1 * 200e9 / 0.91)
    swapped = HertzContact.from_materials(2.5e-3, (200e9, 3.5e9), (0.3, 0.35))
    assert swapped.stiffness == pytest.approx(common.stiffness, rel=1e-15)


def test_free_impact() -> None:
    contact, mass, velocity = HertzContact(4e8), 2e-3, 0.3
    depth = contact.max_penetration(mass, velocity)
    assert 0.4 * contact.stiffness * depth**2.5 == pytest.approx(0.5 * mass * velocity**2)
    # time through the contact, with d = depth (1 - u^2) to take the root out of the integrand
    time, _ = quad(lambda u: 2.0 * u / math.sqrt(-math.expm1(2.5 * math.log1p(-u * u))), 0.0, 1.0)
    assert contact.impact_duration(mass, velocity) == pytest.approx(2.0 * time * depth / velocity, rel=1e-7)
    assert contact.impact_duration(mass, velocity) * velocity / depth == pytest.approx(2.94328, abs=5e-6)
    assert contact.max_penetration(mass, 0.0) == 0.0


def test_restitution() -> None:
    assert [Restitution(e).coefficient for e in (0, 0.5, 1)] == [0.0, 0.5, 1.0]
    for bad in (-0.1, 1.1, np.nan):
        with pytest.raises(InputError, match=r"coefficient = .*: must be a number in \[0, 1\]"):
            Restitution(bad)


def test_refusals() -> None:
    with pytest.raises(InputError, match=r"stiffness = 0: must be .* greater than 0 N/m\^1.5"):
        HertzContact(0)
    with pytest.raises(InputTypeError, match="stiffness = '4e8'"):
        HertzContact("4e8")  # type: ignore[arg-type]
    with pytest.raises(InputError, match=r"poisson_ratio\[1\] = 0.6: must be a number in \(-1, 0.5\]"):
        HertzContact.from_materials(1e-3, (1e9, 1e9), (0.3, 0.6))
    with pytest.raises(InputError, match=r"young_modulus\[0\] = -1"):
        HertzContact.from_materials(1e-3, (-1.0, 1e9), (0.3, 0.3))
    with pytest.raises(InputError, match="radius = inf"):
        HertzContact.from_materials(math.inf, (1e9, 1e9), (0.3, 0.3))
    with pytest.raises(InputError, match=r"young_modulus = 1000000000.0: must be two numbers"):
        HertzContact.from_materials(1e-3, 1e9, (0.3, 0.3))  # type: ignore[arg-type]
    with pytest.raises(InputError, match=r"young_modulus = .*: must be two numbers"):
        HertzContact.from_materials(1e-3, (1e9,), (0.3, 0.3))  # type: ignore[arg-type]


@pytest.mark.parametrize("e", [0.999999, 0.9991, 0.9989, 0.9, 0.5, 0.2, 0.01])
def test_exact_restitution(e) -> None:
    """The approach and the departure take the same penetration: the integrals of v dv/(1 + chi v) are equal."""
    d = loss_number(e)
    assert restitution_of_loss(d) == pytest.approx(e, abs=1e-12)
    if 0.1 < e < 0.99:
        approach = quad(lambda v: v / (1.0 + d * v), 0.0, 1.0, epsabs=0.0, epsrel=1e-12)[0]
        departure = quad(lambda v: v / (1.0 - d * v), 0.0, e, epsabs=0.0, epsrel=1e-12, limit=500)[0]
        assert departure == pytest.approx(approach, rel=1e-9)


def test_presets_say_what_they_give() -> None:
    """For e = 0.5 the published shortcuts give other restitutions; the exact one gives it at its speed alone."""
    given = {"hunt-crossley": 0.6630, "lankarani-nikravesh": 0.7252, "flores": 0.4704, "gonthier": 0.4877}
    for name, found in given.items():
        law = HuntCrossley.from_restitution(4e8, 0.5, 0.05, name)
        assert law.restitution(0.05) == pytest.approx(found, abs=1e-4)
    law = HuntCrossley.from_restitution(4e8, 0.5, 0.05)
    assert law.restitution(0.05) == pytest.approx(0.5, abs=1e-12)
    assert law.restitution(0.1) < 0.5 < law.restitution(0.01)
    assert law.speed_for(0.5) == pytest.approx(0.05, rel=1e-12)
    assert HuntCrossley(4e8, 0.0).restitution(1.0) == 1.0
    with pytest.raises(InputError, match="preset = 'kelvin'"):
        HuntCrossley.from_restitution(4e8, 0.5, 0.05, "kelvin")
    with pytest.raises(InputError, match=r"restitution = 0.0: must be a number in \[1e-300, 1\]"):
        HuntCrossley.from_restitution(4e8, 0.0, 0.05)


@pytest.mark.parametrize("e", [1.0, 0.9, 0.5, math.exp(-2.0), 0.05, 0.01])
def test_kelvin_voigt_restitution(e) -> None:
    law, mass = KelvinVoigt.from_restitution(1e6, e, 2e-3), 2e-3
    assert law.restitution(mass) == pytest.approx(e, abs=1e-12)
    zeta = law.linear_damping / (2.0 * math.sqrt(1e6 * mass))
    # the force k d + c d' of the free mass vanishes where its speed is e times that of arrival
    rate = np.roots([1.0, 2.0 * zeta, 1.0]).astype(complex)
    if abs(rate[0] - rate[1]) > 1e-3 and e < 1.0:

        def moved(t):
            a = 1.0 / (rate[0] - rate[1])
            return (a * (np.exp(rate[0] * t) - np.exp(rate[1] * t))).real

        def speed(t):
            a = 1.0 / (rate[0] - rate[1])
            return (a * (rate[0] * np.exp(rate[0] * t) - rate[1] * np.exp(rate[1] * t))).real

        end = brentq(lambda t: moved(t) + 2.0 * zeta * speed(t), 1e-3, 3.2 if zeta < 1.0 else 30.0)
        assert -speed(end) == pytest.approx(e, abs=1e-9)


def test_power_law_is_hertz_at_three_halves() -> None:
    power, hertz = PowerLaw.from_stiffness(4e8, 1.5), HertzContact(4e8)
    assert power.max_penetration(2e-3, 0.1) == pytest.approx(hertz.max_penetration(2e-3, 0.1), rel=1e-12)
    assert power.impact_duration(2e-3, 0.1) == pytest.approx(hertz.impact_duration(2e-3, 0.1), rel=1e-12)
    for name in ("force", "energy", "slope"):
        assert getattr(power, name)(power, 3e-6) == pytest.approx(getattr(hertz, name)(hertz, 3e-6), rel=1e-12)


def test_layer_and_hertz_carry_one_force_and_share_the_penetration() -> None:
    """d = (f/k_c)^(2/3) + (f/k_l)^(1/2) to rounding; the energy is the integral, the slope the derivative."""
    for k_l in (1e8, 1e13, 1e18):
        law = LayeredHertz(4e8, k_l)
        for d in 10.0 ** np.arange(-12.0, 1.0, 0.5) * 1e-3:
            f = law.force(law, d)
            assert (f / 4e8) ** (2.0 / 3.0) + math.sqrt(f / k_l) == pytest.approx(d, rel=1e-13)
            assert law.energy(law, d) == pytest.approx(
                quad(lambda x, law=law: law.force(law, x), 0.0, d, epsabs=0.0)[0], rel=1e-9
            )
            step = 1e-5 * d
            rise = (law.force(law, d + step) - law.force(law, d - step)) / (2.0 * step)
            assert law.slope(law, d) == pytest.approx(rise, rel=1e-8)


def test_layer_between_its_limits() -> None:
    """A stiff layer leaves Hertz's law, a soft one f = k_l d^2; a free impact lasts as long as a numerical one."""
    stiff, hertz = LayeredHertz(4e8, 1e26), HertzContact(4e8)
    soft, square = LayeredHertz(4e20, 1e10), PowerLaw.from_stiffness(1e10, 2.0)
    for law, limit in ((stiff, hertz), (soft, square)):
        assert law.force(law, 3e-6) == pytest.approx(limit.force(limit, 3e-6), rel=1e-4)
        assert law.impact_duration(2e-3, 0.1) == pytest.approx(limit.impact_duration(2e-3, 0.1), rel=1e-4)
    law = LayeredHertz(4e8, 5e10)

    def rate(t, y):
        return [y[1], -law.force(law, max(y[0], 1e-30)) / 2e-3]

    def apart(t, y):
        return y[0] + 1e-15 if t > 1e-6 else 1.0

    apart.terminal = True
    bounce = solve_ivp(rate, (0.0, 1.0), [0.0, 0.1], "DOP853", rtol=1e-11, atol=1e-16, events=apart, max_step=1e-5)
    assert bounce.t[-1] == pytest.approx(law.impact_duration(2e-3, 0.1), rel=1e-6)
    assert bounce.y[0].max() == pytest.approx(law.max_penetration(2e-3, 0.1), rel=1e-3)


def test_layer_from_its_material() -> None:
    """pi R E (1 - nu)/[(1 + nu)(1 - 2 nu) h]."""
    law = LayeredHertz.from_layer(4e8, radius=5e-3, thickness=1e-4, young_modulus=2e6, poisson_ratio=0.4)
    assert law.layer_stiffness == pytest.approx(math.pi * 5e-3 * 2e6 * 0.6 / (1.4 * 0.2) / 1e-4, rel=1e-12)
    with pytest.raises(InputError, match="poisson_ratio"):
        LayeredHertz.from_layer(4e8, 5e-3, 1e-4, 2e6, 0.5)


def test_a_law_without_force_is_refused_by_name() -> None:
    with pytest.raises(InputError, match="contact law 'half_done': has no force; write"):

        class HalfDone(ContactLaw):
            name = "half_done"

            @staticmethod
            def energy(law, penetration):
                return 5e4 * penetration**2

    assert "half_done" not in LAWS


@dataclass(frozen=True, kw_only=True)
class LinearOfAnyScope(ContactLaw):
    """A law whose constant was declared without a scope."""

    rigidity: float = sb.quantity("N/m", "rigidity", low=0.0)
    name = "linear_of_any_scope"

    @staticmethod
    def force(law, penetration):
        return law.rigidity * penetration

    @staticmethod
    def energy(law, penetration):
        return 0.5 * law.rigidity * penetration * penetration

    @staticmethod
    def slope(law, penetration):
        return law.rigidity


del LAWS["linear_of_any_scope"]


def test_a_constant_of_an_own_law_may_be_of_the_model(monkeypatch) -> None:
    """A linear law is a spring of the package without its damper, alone and along an axis."""
    monkeypatch.setitem(LAWS, LinearOfAnyScope.name, LinearOfAnyScope)
    model = sb.ReducedModel.from_beam(sb.Beam(length=0.2, thickness=5e-4, width=0.012, density=2700.0, young_modulus=70e9, buckling_level=6e-4), modes=2)  # fmt: skip
    shaker = sb.Shaker(frequency_ratio=1.2, velocity_amplitude=0.2).striker()
    own, built_in = (
        sb.System(model, contacts=[sb.Contact(law, shaker)])
        for law in (LinearOfAnyScope(rigidity=1e5), sb.KelvinVoigt(linear_stiffness=1e5, linear_damping=0.0))
    )
    cycles = sb.Integration(cycles=2)
    expected = sb.sweep(built_in, {"contact.linear_stiffness": [1e4, 1e5]}, cycles).peak_force.values
    found = sb.sweep(own, {"contact.rigidity": [1e4, 1e5]}, cycles).peak_force.values
    np.testing.assert_allclose(found, expected, rtol=1e-3)
    assert sb.simulate(own, cycles).summary.peak_force == pytest.approx(expected[1], rel=1e-3)
