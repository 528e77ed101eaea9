"""Hertz's law: stiffness from materials, and the free impact it implies."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad

from snapbeam.core.validate import InputError, InputTypeError
from snapbeam.model.contact import HertzContact, Restitution


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
