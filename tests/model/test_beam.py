"""The beam: both ways of saying how far it is compressed, and its refusals."""

from __future__ import annotations

import dataclasses
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from snapbeam.model.beam import Beam
from snapbeam.model.default_values import BEAM
from snapbeam.model.quasi_static import quasi_static_threshold
from snapbeam.util.validation import InputError, InputTypeError

STEEL = {"length": 0.161, "thickness": 0.4e-3, "width": 15e-3, "density": 7800.0, "young_modulus": 200e9}


def test_paper_beam() -> None:
    assert Beam(**STEEL, buckling_level=0.335e-3) == BEAM
    assert BEAM.critical_load == pytest.approx(24.368, abs=5e-4)
    assert BEAM.axial_load == pytest.approx(37.188, abs=5e-4)
    assert BEAM.second_critical_load / BEAM.critical_load == pytest.approx(2.0457, abs=5e-5)
    assert BEAM.is_buckled


def test_section_properties() -> None:
    assert BEAM.area == pytest.approx(6e-6)
    assert BEAM.second_moment == pytest.approx(8e-14)
    assert BEAM.radius_of_gyration == pytest.approx(math.sqrt(BEAM.second_moment / BEAM.area))
    assert BEAM.mass_per_length == pytest.approx(0.0468)
    assert BEAM.bending_stiffness == pytest.approx(0.016)
    assert BEAM.nonlinear_stiffness == pytest.approx(200e9 * 6e-6 / (2 * 0.161))


def test_second_mode_buckles_at_the_level_of_equal_loads() -> None:
    """P = P_cr2 at b/r = 4.09, where the saddles leave the straight beam."""
    ratio = BEAM.replace(axial_load=BEAM.second_critical_load).buckling_level / BEAM.radius_of_gyration
    assert ratio == pytest.approx(4.09, abs=5e-3)


@settings(deadline=None, max_examples=60)
@given(
    length=st.floats(0.01, 10.0),
    slenderness=st.floats(20.0, 5000.0),
    modulus=st.floats(1e6, 1e12),
    level=st.floats(1e-3, 1e3),
)
def test_level_and_load_are_inverse(length: float, slenderness: float, modulus: float, level: float) -> None:
    thickness = length / slenderness
    by_level = Beam(
        length=length,
        thickness=thickness,
        width=3.0 * thickness,
        density=1000.0,
        young_modulus=modulus,
        buckling_level=level * thickness,
    )
    by_load = by_level.replace(axial_load=by_level.axial_load)
    # b^2 is a difference of loads: rounding grows as P/(P - P_cr)
    loss = by_level.axial_load / (by_level.axial_load - by_level.critical_load)
    assert by_load.buckling_level == pytest.approx(by_level.buckling_level, rel=1e-14 * loss)
    again = by_level.replace(buckling_level=by_load.buckling_level)
    assert again.axial_load == pytest.approx(by_load.axial_load, rel=1e-13)


@pytest.mark.parametrize("load", [-100.0, 0.0, 24.0, BEAM.critical_load])
def test_below_the_critical_load_the_beam_is_straight(load: float) -> None:
    beam = Beam(**STEEL, axial_load=load)
    assert not beam.is_buckled
    assert beam.buckling_level == 0.0
    assert beam.axial_load == load


def test_replace_keeps_what_was_given() -> None:
    thicker = BEAM.replace(thickness=0.5e-3)
    assert thicker.buckling_level == BEAM.buckling_level
    assert thicker.axial_load > BEAM.axial_load
    loaded = BEAM.replace(axial_load=30.0)
    assert loaded.replace(width=20e-3).axial_load == 30.0
    assert loaded.replace(buckling_level=0.335e-3) == BEAM
    with pytest.raises(InputError, match=r"thicknes: is not a parameter of a beam.*thickness"):
        BEAM.replace(thicknes=1.0)


def test_the_replace_of_dataclasses_keeps_what_was_given_too() -> None:
    """What followed from the other is not taken for given."""
    assert dataclasses.replace(BEAM, thickness=0.5e-3) == BEAM.replace(thickness=0.5e-3)
    loaded = BEAM.replace(axial_load=30.0)
    assert dataclasses.replace(loaded, width=20e-3) == loaded.replace(width=20e-3)
    # it cannot know that the given one is meant to give way; Beam.replace does
    with pytest.raises(InputError, match=r"buckling_level = 0\.000335, axial_load = 30\.0: give exactly one"):
        dataclasses.replace(BEAM, axial_load=30.0)


@pytest.mark.parametrize("name", [*STEEL, "buckling_level"])
@pytest.mark.parametrize("value", [math.nan, math.inf, 0.0, -1.0])
def test_refuses_what_is_not_positive(name: str, value: float) -> None:
    with pytest.raises(InputError, match=rf"{name} = {value}: must be a finite number greater than 0"):
        BEAM.replace(**{name: value})


def test_refuses_other_input() -> None:
    with pytest.raises(InputTypeError, match=r"length = '16 cm': must be .* not str"):
        Beam(**{**STEEL, "length": "16 cm"}, buckling_level=1e-3)
    with pytest.raises(InputError, match=r"axial_load = nan"):
        Beam(**STEEL, axial_load=math.nan)
    with pytest.raises(InputError, match=r"buckling_level = None, axial_load = None: give exactly one"):
        Beam(**STEEL)
    with pytest.raises(InputError, match=r"buckling_level = 0.001, axial_load = 30.0: give exactly one"):
        Beam(**STEEL, buckling_level=1e-3, axial_load=30.0)


def test_quasi_static_threshold_needs_a_buckled_beam():
    """A straight beam has no unstable equilibrium that a slow striker could carry it over."""
    buckled = Beam(**STEEL, buckling_level=0.335e-3)
    threshold = quasi_static_threshold(0.3, 1.0, buckled)
    assert float(threshold) == pytest.approx(math.sin(0.3 * math.pi) ** 2)
    with pytest.raises(InputError, match="must be buckled"):
        quasi_static_threshold(0.3, 1.0, buckled.replace(axial_load=0.0))
