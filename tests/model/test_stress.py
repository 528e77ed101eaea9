"""Pressure, yield and bending against numbers of other kinds."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.model.contact.stress import bending_stress, hertz_stress
from snapbeam.util.validation import InputError


def test_pressure_carries_the_force() -> None:
    """p_0 sqrt(1 - (r/a)^2) over the circle is the force; 619 N on a steel sphere of 2 mm are near 7 GPa."""
    contact = sb.HertzContact.from_materials(2e-3, (200e9, 200e9), (0.3, 0.3))
    found = hertz_stress(619.0, contact.stiffness, 2e-3, yield_stress=1e9)
    carried, _ = quad(
        lambda r: 2.0 * math.pi * r * found.pressure * math.sqrt(1.0 - (r / found.contact_radius) ** 2),
        0.0, found.contact_radius,
    )  # fmt: skip
    assert carried == pytest.approx(619.0, rel=1e-8)
    assert found.pressure == pytest.approx(7.1e9, rel=0.02)
    # the penetration that the law says is a^2/R
    assert found.contact_radius**2 / 2e-3 == pytest.approx((619.0 / contact.stiffness) ** (2.0 / 3.0), rel=1e-12)
    assert found.yield_force is not None
    assert hertz_stress(found.yield_force, contact.stiffness, 2e-3).pressure == pytest.approx(1.6e9, rel=1e-12)
    assert [each.code for each in found.diagnostics()] == ["contact-yields"]
    assert hertz_stress(0.5 * found.yield_force, contact.stiffness, 2e-3, 1e9).diagnostics() == ()
    with pytest.raises(InputError, match="radius = 0"):
        hertz_stress(1.0, 4e8, 0.0)


def test_bending_of_the_well() -> None:
    """w = -(b/2)(1 - cos 2 pi x/L): E h/2 times b/2 (2 pi/L)^2."""
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=5)
    beam = default_values.BEAM
    expected = 0.25 * beam.young_modulus * beam.thickness * beam.buckling_level * (2.0 * math.pi / beam.length) ** 2
    assert float(bending_stress(model, model.well_amplitude)) == pytest.approx(expected, rel=1e-12)
    many = bending_stress(model, np.stack([model.well_amplitude, 0.0 * model.well_amplitude]))
    assert many.shape == (2,)
    assert many[1] == 0.0
