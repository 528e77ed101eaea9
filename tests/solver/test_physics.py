"""The scalar physics against references of its own, and the same in lanes to the last bit."""

from __future__ import annotations

import math

import numpy as np
import pytest
import scipy.linalg
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit

from snapbeam.solver.physics import (
    decay_less_one,
    mode_energy,
    rotation,
    shaker_motion,
    sincos,
    sincos_cosm1,
    tension_acceleration,
    tension_energy,
    tension_factors,
    turned,
)
from snapbeam.solver.simd import WIDTH, fma, lanes_sum, load, select_less, store, vabs, vfloor


@njit
def over_scalars(x, y, z, out):
    for i in range(x.size):
        out[0, i], out[1, i], out[13, i] = sincos_cosm1(x[i])
        out[2, i] = decay_less_one(y[i])
        out[3, i], out[4, i], out[5, i], out[6, i] = rotation(
            z[i], x[i] * x[i], out[0, i], out[13, i], out[2, i]
        )
        out[7, i] = turned(x[i], y[i], z[i], x[i])
        out[8, i] = mode_energy(x[i], y[i], z[i])
        out[9, i] = tension_acceleration(0.3, -0.7, y[i], z[i])
        out[10, i] = fma(x[i], y[i], z[i])
        out[11, i] = select_less(x[i], y[i], 1.0, -1.0)
        out[12, i] = vfloor(x[i]) + abs(y[i])


@njit
def over_lanes(x, y, z, out):
    size = x.size
    flat = out.reshape(out.size)
    for i in range(0, size, 8):
        a, b, c = load(x, i), load(y, i), load(z, i)
        sine, cosine, less_one = sincos_cosm1(a)
        e = decay_less_one(b)
        store(flat, i, sine)
        store(flat, size + i, cosine)
        store(flat, 2 * size + i, e)
        a11, a12, a21, a22 = rotation(c, a * a, sine, less_one, e)
        store(flat, 3 * size + i, a11)
        store(flat, 4 * size + i, a12)
        store(flat, 5 * size + i, a21)
        store(flat, 6 * size + i, a22)
        store(flat, 7 * size + i, turned(a, b, c, a))
        store(flat, 8 * size + i, mode_energy(a, b, c))
        store(flat, 9 * size + i, tension_acceleration(0.3, -0.7, b, c))
        store(flat, 10 * size + i, fma(a, b, c))
        store(flat, 11 * size + i, select_less(a, b, 1.0, -1.0))
        store(flat, 12 * size + i, vfloor(a) + vabs(b))
        store(flat, 13 * size + i, less_one)


@njit
def summed(x):
    return lanes_sum(load(x, 0))


@pytest.fixture(scope="module")
def evaluated():
    rng = np.random.default_rng(1)
    near = np.concatenate([(np.arange(-40, 40) * math.pi / 4) + d for d in (-1e-9, 0.0, 1e-9)])
    x = np.concatenate((near, rng.uniform(-30.0, 30.0, 3000), rng.uniform(-1e5, 1e5, 3000)))
    x = np.ascontiguousarray(x[: x.size // WIDTH * WIDTH])
    y, z = rng.uniform(-4.0, 4.0, x.size), rng.uniform(0.0, 2.0, x.size)
    scalars, lanes = np.zeros((14, x.size)), np.zeros((14, x.size))
    over_scalars(x, y, z, scalars)
    over_lanes(x, y, z, lanes)
    return x, y, z, scalars, lanes


def test_lanes_are_scalars_side_by_side(evaluated) -> None:
    *_, scalars, lanes = evaluated
    np.testing.assert_array_equal(lanes, scalars)


def test_sum_of_lanes_has_a_fixed_order() -> None:
    x = np.array([1e16, 1.0, -1e16, 1.0, 3.0, 1e-3, 7.0, 1e8])
    expected = (x[0] + x[4] + (x[2] + x[6])) + (x[1] + x[5] + (x[3] + x[7]))
    assert summed(x) == expected


def test_sine_and_cosine(evaluated) -> None:
    """Within 3e-16, against extended precision where the machine has it."""
    x, _, _, values, _ = evaluated
    wide = x.astype(np.longdouble)
    assert np.abs(values[0] - np.sin(wide)).max() < 3e-16
    assert np.abs(values[1] - np.cos(wide)).max() < 3e-16
    assert np.abs(values[13] - (np.cos(wide) - 1.0)).max() < 4e-16


def test_decay(evaluated) -> None:
    """exp(-x) - 1 within 2e-14 of exp(-x)."""
    _, y, _, values, _ = evaluated
    assert np.abs((values[2] - np.expm1(-y)) / np.exp(-y)).max() < 2e-14


@given(st.floats(1e-9, 0.1))
@settings(max_examples=50, deadline=None, derandomize=True)
def test_flows_near_the_identity_keep_their_digits(x: float) -> None:
    """cos x - 1 and exp(-x) - 1 are accurate relative to themselves, however small x is."""
    assert sincos_cosm1(x)[2] == pytest.approx(-2.0 * math.sin(0.5 * x) ** 2, rel=3e-16 * 4)
    assert decay_less_one(x) == pytest.approx(math.expm1(-x), rel=2e-15)


@pytest.mark.parametrize(("omega", "zeta"), [(500.0, 0.005), (2.4e5, 0.005), (100.0, 0.9), (3.0, 0.0)])
def test_rotation_is_the_exact_flow(omega: float, zeta: float) -> None:
    """The rows are the exponential of q' = p, p' = -omega^2 q - 2 zeta omega p."""
    time, damped = 0.7 / omega, omega * math.sqrt(1.0 - zeta**2)
    sine, _, less_one = sincos_cosm1(damped * time)
    rows = rotation(zeta * omega, omega**2, sine / damped, less_one, decay_less_one(zeta * omega * time))
    scale = np.diag([1.0, 1.0 / omega])
    exact = scipy.linalg.expm(time * np.array([[0.0, 1.0], [-(omega**2), -2.0 * zeta * omega]]))
    got = scale @ (np.reshape(rows, (2, 2)) + np.eye(2)) @ np.linalg.inv(scale)
    np.testing.assert_allclose(got, scale @ exact @ np.linalg.inv(scale), atol=2e-14)


def test_tension_is_the_gradient_of_its_energy() -> None:
    """The modal force -dU/dq, by complex-free central differences."""
    rng = np.random.default_rng(2)
    matrix = rng.standard_normal((4, 4))
    matrix = matrix @ matrix.T
    g, q, gamma = rng.standard_normal(4), rng.standard_normal(4), 0.37

    def energy(at: np.ndarray) -> float:
        return tension_energy(gamma, g @ at, at @ matrix @ at)

    along_g, along_r = tension_factors(gamma, g @ q, q @ matrix @ q)
    force = [tension_acceleration(along_g, along_r, a, b) for a, b in zip(g, matrix @ q, strict=True)]
    step = 1e-5 * np.eye(4)
    slopes = [(energy(q + d) - energy(q - d)) / 2e-5 for d in step]
    # with r = G q this is -gamma (qr g + (2 gq + qr) r), and U = gamma (gq qr + qr^2/4)
    np.testing.assert_allclose(force, -np.array(slopes), rtol=1e-8)


def test_shaker() -> None:
    for phase in np.linspace(0.0, 7.0, 20):
        place, velocity = shaker_motion(2.0, 3.0, *sincos(phase))
        assert place == pytest.approx(2.0 * math.sin(phase), abs=1e-15)
        assert velocity == pytest.approx(6.0 * math.cos(phase), abs=3e-15)
