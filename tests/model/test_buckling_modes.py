"""Buckling modes: closed forms against the equations that define them and against quadrature."""

from __future__ import annotations

import math

import numpy as np
import pytest

from snapbeam.model.buckling_modes import BucklingModes, wavenumbers
from snapbeam.util.validation import InputError

LENGTH = 0.161


def gauss(count: int) -> tuple[np.ndarray, np.ndarray]:
    points, weights = np.polynomial.legendre.leggauss(count)
    return 0.5 * LENGTH * (points + 1.0), 0.5 * LENGTH * weights


def test_wavenumbers() -> None:
    k = wavenumbers(256, LENGTH)
    assert (np.diff(k) > 0.0).all()
    odd = np.arange(1, 257, 2)
    np.testing.assert_allclose(k[::2] * LENGTH, (odd + 1) * math.pi, rtol=4e-16)
    z = 0.5 * k[1::2] * LENGTH
    assert z[0] == pytest.approx(4.493409457909064, rel=4e-16)
    # distance from the root of sin z - z cos z = 0, whose slope is z sin z: within two spacings of floats
    assert (np.abs((np.sin(z) - z * np.cos(z)) / (z * np.sin(z))) < 4.5e-16 * z).all()
    np.testing.assert_array_equal(np.floor(z / math.pi), np.arange(1, 129))


def test_clamped_ends_and_symmetry() -> None:
    modes = BucklingModes(LENGTH, 256)
    ends = [0.0, LENGTH]
    size = np.abs(modes.shape(np.linspace(0.0, LENGTH, 2001))).max(axis=1)
    assert (np.abs(modes.shape(ends)).max(axis=1) < 1e-13 * size).all()
    assert np.abs(modes.slope(ends)).max() < 1e-11
    even = modes.parity < 0
    assert (modes.shape(0.5 * LENGTH)[even] == 0.0).all()
    assert (modes.slope(0.5 * LENGTH)[~even] == 0.0).all()
    x = LENGTH * np.array([0.125, 0.25, 0.375])
    np.testing.assert_allclose(modes.shape(LENGTH - x), modes.parity[:, None] * modes.shape(x), atol=1e-13 * size.max())


@pytest.mark.parametrize("count", [1, 2, 7, 32])
def test_shape_is_the_papers(count: int) -> None:
    """Against Eqs. (4)-(8) as written from the left end."""
    modes = BucklingModes(LENGTH, count)
    x = np.linspace(0.0, LENGTH, 301)
    k = modes.wavenumber[:, None]
    odd_form = 1.0 - np.cos(k * x)
    even_form = 1.0 - 2.0 * x / LENGTH - np.cos(k * x) + 2.0 * np.sin(k * x) / (k * LENGTH)
    bracket = np.where(modes.parity[:, None] > 0, odd_form, even_form)
    np.testing.assert_allclose(modes.shape(x), math.sqrt(2.0 / LENGTH) / k * bracket, atol=2e-13 / modes.wavenumber[0])


def test_slope_and_curvature_are_derivatives() -> None:
    modes = BucklingModes(LENGTH, 9)
    x = np.linspace(0.01, LENGTH - 0.01, 50)
    h = 1e-6
    np.testing.assert_allclose(modes.slope(x), (modes.shape(x + h) - modes.shape(x - h)) / (2 * h), atol=1e-6)
    scale = modes.wavenumber.max()
    np.testing.assert_allclose(
        modes.curvature(x), (modes.slope(x + h) - modes.slope(x - h)) / (2 * h), atol=1e-6 * scale
    )


def test_orthonormal_slopes_and_curvatures() -> None:
    """Eq. (9), and the diagonal bending stiffness k_i^2, to rounding."""
    modes = BucklingModes(LENGTH, 32)
    x, weight = gauss(200)
    slope, curvature = modes.slope(x), modes.curvature(x)
    assert np.abs((slope * weight) @ slope.T - np.eye(32)).max() < 2e-14
    k = modes.wavenumber
    assert np.abs((curvature * weight) @ curvature.T / np.outer(k, k) - np.eye(32)).max() < 1e-13


def test_shapes_of_arrays() -> None:
    modes = BucklingModes(LENGTH, 5)
    assert modes.shape(0.1).shape == (5,)
    assert modes.slope(np.full((2, 3), 0.1)).shape == (5, 2, 3)
    np.testing.assert_array_equal(modes.curvature(np.full((2, 3), 0.1))[:, 1, 2], modes.curvature(0.1))


def test_refusals() -> None:
    with pytest.raises(InputError, match=r"count = 0: must be an integer in \[1, 256\]"):
        BucklingModes(LENGTH, 0)
    with pytest.raises(InputError, match=r"count = 257: must be an integer in \[1, 256\]"):
        wavenumbers(257, LENGTH)
    with pytest.raises(InputError, match="length = -1"):
        wavenumbers(2, -1)
    with pytest.raises(InputError, match=r"x = 0.2: must lie in \[0, 0.161\] m"):
        BucklingModes(LENGTH, 2).shape(0.2)
    with pytest.raises(InputError, match=r"x\[1\] = .*nan.*: must be finite"):
        BucklingModes(LENGTH, 2).slope([0.1, math.nan])
