"""Every law of contact as engines see it: a force, the energy it stores and its slope, plain and compiled alike."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit
from scipy.integrate import quad

import snapbeam as sb
from snapbeam.model.contact.base import LAWS
from snapbeam.solver.contact_force import (
    contact_energy,
    contact_force,
    contact_slope,
    is_impulsive,
    peak_force,
)

check = settings(max_examples=50, deadline=None, derandomize=True)


def numbers(law: sb.ContactLaw) -> Any:
    return law.numbers()


@njit
def all_of(law, penetration, deepest):
    return (
        contact_force(law, penetration),
        contact_energy(law, penetration),
        contact_slope(law, penetration),
        peak_force(law, deepest),
        is_impulsive(law),
    )


def plain(law, penetration, deepest):
    return all_of.py_func(law, penetration, deepest)


@cache
def some_of(name: str) -> list[sb.ContactLaw]:
    values = {
        "elastic_plastic": ((1e5, 1e5), (1e6, 4e6)),
        "hertz": ((1e5,), (4e8,), (1e12,)),
        "hunt_crossley": ((4e8, 0.0), (4e8, 0.5), (1e12, 3.0)),
        "kelvin_voigt": ((1e5, 0.0), (1e7, 3.0)),
        "layer": ((4e8, 1e13), (4e8, 5e10), (1e12, 1e8)),
        "power": ((0.4, 1.0), (0.4, 1.5), (10.0, 2.5)),
        "restitution": ((0.0,), (0.6,), (1.0,)),
    }
    return [LAWS[name](*value) for value in values[name]]


@pytest.mark.parametrize("name", LAWS)
def test_compiled_and_plain_are_the_same(name: str) -> None:
    """The simulator of CUDA runs the plain ones."""
    for law in some_of(name):
        for depth in (-1e-3, 0.0, 1e-9, 3e-6, 1e-3):
            assert all_of(numbers(law), depth, abs(depth)) == plain(numbers(law), depth, abs(depth))


@pytest.mark.parametrize("name", LAWS)
def test_apart_there_is_nothing(name: str) -> None:
    for law in some_of(name):
        for depth in (-1.0, -1e-300, 0.0, -0.0):
            assert plain(numbers(law), depth, 0.0)[:3] == (0.0, 0.0, 0.0)


@given(st.floats(1e-9, 1e-3), st.floats(1e5, 1e12))
@check
def test_hertz(depth: float, stiffness: float) -> None:
    """f = k_c d^1.5, its energy as the work of the force, its slope as a difference."""
    law = numbers(sb.HertzContact(stiffness))
    assert contact_force(law, depth) == pytest.approx(stiffness * depth**1.5, rel=1e-14)
    work, _ = quad(lambda u: 2.0 * u * contact_force(law, depth * u * u) * depth, 0.0, 1.0)
    assert contact_energy(law, depth) == pytest.approx(work, rel=1e-10)
    step = 1e-4 * depth
    slope = (contact_force(law, depth + step) - contact_force(law, depth - step)) / (2.0 * step)
    assert contact_slope(law, depth) == pytest.approx(slope, rel=1e-7)
    assert peak_force(law, depth) == contact_force(law, depth)
    assert not is_impulsive(law)


def test_an_impact_that_lasts_no_time_has_no_force() -> None:
    law = numbers(sb.Restitution(0.5))
    assert plain(law, 1e-3, 7.0) == (0.0, 0.0, 0.0, 7.0, True)


def test_numbers_go_by_the_names_of_the_fields() -> None:
    for name, kind in LAWS.items():
        assert kind.name == name
        assert kind.numbers_type() is kind.numbers_type()
        assert kind.numbers_type().owner is kind
        for law in some_of(name):
            found = numbers(law)
            assert found._asdict() == vars(law) | ({law.memory: 0.0} if law.memory else {})
            assert all(np.isfinite(value) for value in found)
