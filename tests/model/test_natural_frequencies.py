"""Exact frequencies: an independent finite-element model, and no root missed or found twice."""

from __future__ import annotations

import math

import numpy as np
import pytest
import scipy.linalg

from snapbeam.model.default_values import BEAM, STRAIGHT_BEAM
from snapbeam.model.natural_frequencies import exact_natural_frequencies
from snapbeam.model.reduced_model import ReducedModel
from snapbeam.util.validation import InputError

UNIT = math.sqrt(BEAM.bending_stiffness / BEAM.mass_per_length) / BEAM.length**2 / (2.0 * math.pi)


def finite_elements(load: float, level: float, elements: int) -> np.ndarray:
    """Scaled frequencies by Hermite elements: v'''' + p v'' + 4 pi^4 b^2 cos(2 pi x) int cos(2 pi x) v."""
    h = 1.0 / elements
    points, weights = np.polynomial.legendre.leggauss(6)
    s, weight = 0.5 * (points + 1.0), 0.5 * h * weights
    shape = np.array([1 - 3 * s**2 + 2 * s**3, h * (s - 2 * s**2 + s**3), 3 * s**2 - 2 * s**3, h * (s**3 - s**2)])
    slope = np.array([-6 * s + 6 * s**2, h * (1 - 4 * s + 3 * s**2), 6 * s - 6 * s**2, h * (3 * s**2 - 2 * s)]) / h
    bend = np.array([-6 + 12 * s, h * (6 * s - 4), 6 - 12 * s, h * (6 * s - 2)]) / h**2
    size = 2 * (elements + 1)
    stiffness, mass, wave = np.zeros((size, size)), np.zeros((size, size)), np.zeros(size)
    for e in range(elements):
        at = slice(2 * e, 2 * e + 4)
        stiffness[at, at] += (bend * weight) @ bend.T - load * (slope * weight) @ slope.T
        mass[at, at] += (shape * weight) @ shape.T
        wave[at] += shape @ (weight * np.cos(2 * math.pi * h * (e + s)))
    stiffness += 4 * math.pi**4 * level**2 * np.outer(wave, wave)
    inner = slice(2, size - 2)
    return np.sqrt(np.abs(scipy.linalg.eigvalsh(stiffness[inner, inner], mass[inner, inner])))


@pytest.mark.parametrize("level", [0.1, 1.0, 4.0, 6.21208, 8.0, 20.0, 200.0])
def test_buckled_against_finite_elements(level: float) -> None:
    """Twenty frequencies, to the discretisation error of 120 elements, (k h)^4/720 < 2e-4."""
    exact = exact_natural_frequencies(BEAM.replace(buckling_level=level * BEAM.radius_of_gyration), 20) / UNIT
    discrete = finite_elements(4 * math.pi**2, level, 120)[:20]
    np.testing.assert_allclose(discrete, exact, rtol=2e-4)
    np.testing.assert_allclose(discrete[:5], exact[:5], rtol=2e-6, atol=1e-5)
    assert (discrete > exact - 1e-5).all()


@pytest.mark.parametrize("load", [-2000.0, -30.0, 0.0, 20.0, 39.0])
def test_straight_against_finite_elements(load: float) -> None:
    beam = BEAM.replace(axial_load=load * BEAM.bending_stiffness / BEAM.length**2)
    np.testing.assert_allclose(
        finite_elements(load, 0.0, 120)[:20], exact_natural_frequencies(beam, 20) / UNIT, rtol=2e-4
    )


@pytest.mark.parametrize("level", [1e-8, 1e-6, 1e-4, 0.01, 0.5, 3.0, 6.21208, 6.3, 12.0, 50.0, 200.0, 5000.0])
def test_sixty_frequencies_none_missed(level: float) -> None:
    """A Galerkin model of 256 modes bounds each frequency from above, tightly: the counts agree."""
    beam = BEAM.replace(buckling_level=level * BEAM.radius_of_gyration)
    exact = exact_natural_frequencies(beam, 60)
    galerkin = ReducedModel.from_beam(beam, modes=256).natural_frequencies[:60]
    excess = galerkin / exact - 1.0
    assert excess.min() > -1e-12
    assert excess.max() < 1e-4
    assert excess[:20].max() < 1e-5
    np.testing.assert_array_equal(exact_natural_frequencies(beam, 7), exact[:7])


@pytest.mark.parametrize("load", [-1000.0, -10.0, 0.0, 1.0, 24.0, BEAM.critical_load * (1 - 1e-9)])
def test_straight_none_missed(load: float) -> None:
    beam = BEAM.replace(axial_load=load)
    excess = (
        ReducedModel.from_beam(beam, modes=256).natural_frequencies[:60] / exact_natural_frequencies(beam, 60) - 1.0
    )
    assert excess.min() > -1e-8  # the lowest frequency loses digits in P_cr - P
    assert excess[1:].min() > 0.0
    assert excess.max() < 1e-4


def test_limits() -> None:
    # shallow: omega_1^2 -> 4 pi^4 (b/r)^2/6, and the rest those of the beam at its critical load
    shallow = exact_natural_frequencies(BEAM.replace(buckling_level=1e-6 * BEAM.radius_of_gyration), 30)
    assert shallow[0] / UNIT == pytest.approx(2e-6 * math.pi**2 / math.sqrt(6.0), rel=1e-12)
    critical = exact_natural_frequencies(BEAM.replace(axial_load=BEAM.critical_load), 30)
    assert critical[0] == 0.0
    np.testing.assert_allclose(shallow[1:], critical[1:], rtol=1e-12)
    # the antisymmetric motions do not feel the buckling level
    deep = exact_natural_frequencies(BEAM.replace(buckling_level=50.0 * BEAM.radius_of_gyration), 30)
    assert all(np.abs(deep / f - 1.0).min() < 1e-14 for f in critical[1:10:2])
    # no load: cos z cosh z = 1
    z = np.sqrt(2.0 * math.pi * exact_natural_frequencies(STRAIGHT_BEAM, 12) / (2.0 * math.pi * UNIT))
    assert np.abs(np.cos(z) - 1.0 / np.cosh(z)).max() < 1e-13


def test_symmetric_and_antisymmetric_cross() -> None:
    """At b/r = 6.21208 the first two frequencies meet and change places."""
    gaps = []
    for level in (6.212075, 6.212085):
        first = exact_natural_frequencies(BEAM.replace(buckling_level=level * BEAM.radius_of_gyration), 2) / UNIT
        fixed = int(np.argmin(np.abs(first - 44.36270469277)))
        gaps.append(first[1 - fixed] - first[fixed])
    assert gaps[0] < 0.0 < gaps[1]


def test_refusals() -> None:
    with pytest.raises(InputError, match=r"count = 0: must be an integer in \[1, 1000\]"):
        exact_natural_frequencies(BEAM, 0)
    with pytest.raises(InputError, match=r"beam = 1: must be a Beam"):
        exact_natural_frequencies(1)  # type: ignore[arg-type]
