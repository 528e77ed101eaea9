"""Running statistics of a signal given by values and slopes, against the cubic itself."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from snapbeam.solver.interpolation import (
    count_zero_crossings,
    cubic,
    first_downcrossing,
    first_upcrossing,
    sign_of,
    turning_point,
    update_extrema,
)

VALUES = st.floats(-2.0, 2.0).map(lambda x: round(x, 6))
SLOPES = st.floats(-20.0, 20.0).map(lambda x: round(x, 6))
STEPS = st.sampled_from([1.0, 0.1, 1e-6])
S = np.linspace(0.0, 1.0, 4001)
check = settings(
    max_examples=60, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.filter_too_much]
)


def sampled(u0: float, v0: float, u1: float, v1: float, h: float) -> np.ndarray:
    """The Hermite cubic, from its basis functions."""
    return (
        u0 * (1 + 2 * S) * (1 - S) ** 2 + v0 * h * S * (1 - S) ** 2
        + u1 * S**2 * (3 - 2 * S) + v1 * h * S**2 * (S - 1)
    )  # fmt: skip


def turns_at_most_once(u0: float, v0: float, u1: float, v1: float) -> bool:
    """Whether the slope of the cubic has at most one zero inside, as steps shorter than any period see to."""
    rise = u1 - u0
    zeros = np.roots([3.0 * (v0 + v1 - 2.0 * rise), 2.0 * (3.0 * rise - 2.0 * v0 - v1), v0])
    real = zeros[np.abs(zeros.imag) < 1e-9].real
    return np.count_nonzero((real > -1e-9) & (real < 1.0 + 1e-9)) <= 1


@given(VALUES, SLOPES, VALUES, SLOPES, STEPS)
@check
def test_cubic(u0: float, v0: float, u1: float, v1: float, h: float) -> None:
    c0, c1, c2, c3 = cubic(u0, v0 / h, u1, v1 / h, h)
    np.testing.assert_allclose(c0 + S * (c1 + S * (c2 + S * c3)), sampled(u0, v0, u1, v1, 1.0), atol=1e-12)


@given(VALUES, SLOPES, VALUES, SLOPES, STEPS)
@check
def test_turning_point_and_extremes(u0: float, v0: float, u1: float, v1: float, h: float) -> None:
    """A cubic whose slopes at the ends differ in sign turns once; where they do not, its ends are taken."""
    u = sampled(u0, v0, u1, v1, 1.0)
    turn = turning_point(u0, v0 / h, u1, v1 / h, h)
    low, high = update_extrema(math.inf, -math.inf, u0, v0 / h, u1, v1 / h, h)
    if v0 * v1 >= 0.0:
        assert turn == -1.0
        assert (low, high) == (min(u0, u1), max(u0, u1))
        return
    assert 0.0 < turn < 1.0
    at = np.interp(turn, S, u)
    assert at == pytest.approx(u.max() if v0 > 0.0 else u.min(), abs=1e-5)
    assert low == pytest.approx(u.min(), abs=1e-5)
    assert high == pytest.approx(u.max(), abs=1e-5)


@given(VALUES, SLOPES, VALUES, SLOPES, STEPS)
@check
def test_crossings(u0: float, v0: float, u1: float, v1: float, h: float) -> None:
    u = sampled(u0, v0, u1, v1, 1.0)
    assume(turns_at_most_once(u0, v0, u1, v1))
    assume(v0 * v1 != 0.0 and abs(u0) > 1e-3 and abs(u1) > 1e-3)
    changes = np.flatnonzero((u[1:] > 0.0) != (u[:-1] > 0.0))
    # a turn so close to zero that samples cannot tell
    turn = turning_point(u0, v0 / h, u1, v1 / h, h)
    assume(turn < 0.0 or abs(np.interp(turn, S, u)) > 1e-4)
    count, last, side = count_zero_crossings(sign_of(u0, 0), u0, v0 / h, u1, v1 / h, h)
    assert count == changes.size
    assert side == np.sign(u1)
    if count:
        assert last == pytest.approx(S[changes[-1]], abs=3e-4)
    else:
        assert last == -1.0


@given(VALUES, SLOPES, VALUES, SLOPES, STEPS)
@check
def test_parity_of_crossings(u0: float, v0: float, u1: float, v1: float, h: float) -> None:
    """Whatever happens between, an odd number of crossings has changed the side."""
    for side in (-1, 1):
        count, last, after = count_zero_crossings(side, u0, v0 / h, u1, v1 / h, h)
        assert (count % 2 == 1) == (after != side)
        assert last == -1.0 or 0.0 <= last <= 1.0


def test_crossings_through_exact_zeros() -> None:
    """A value of exactly zero belongs to the side before it; the other side must be seen to count."""
    assert count_zero_crossings(-1, -1.0, 1.0, 0.0, 1.0, 1.0) == (0, -1.0, -1)
    count, last, side = count_zero_crossings(-1, 0.0, 1.0, 1.0, 1.0, 1.0)
    assert (count, side) == (1, 1)
    assert last == 0.0
    assert count_zero_crossings(0, 0.0, 1.0, 1.0, 1.0, 1.0)[::2] == (0, 1)
    # touches zero from below and turns
    assert count_zero_crossings(-1, -0.25, 1.0, -0.25, -1.0, 1.0)[0] in (0, 2)


@given(VALUES, SLOPES, VALUES, SLOPES, STEPS)
@check
def test_first_rise(u0: float, v0: float, u1: float, v1: float, h: float) -> None:
    u0 = -abs(u0)
    u = sampled(u0, v0, u1, v1, 1.0)
    assume(turns_at_most_once(u0, v0, u1, v1))
    assume(
        v0 * v1 != 0.0
        and u0 < -1e-3
        and abs(u1) > 1e-3
        and not 0.0 <= u.max() < 1e-4
        and not -1e-4 < u.max() < 0.0
    )
    rise = first_upcrossing(u0, v0 / h, u1, v1 / h, h)
    above = np.flatnonzero(u > 0.0)
    if above.size == 0:
        assert rise == -1.0
    else:
        assert rise == pytest.approx(S[above[0]], abs=3e-4)


def test_first_rise_at_the_start() -> None:
    assert first_upcrossing(0.0, 1.0, 1.0, 1.0, 1.0) == 0.0
    assert first_upcrossing(0.0, -1.0, -1.0, -1.0, 1.0) == -1.0
    # leaves downward, turns, and comes back through zero
    assert first_upcrossing(0.0, -1.0, 1.0, 4.0, 1.0) == pytest.approx(
        S[np.flatnonzero(sampled(0.0, -1.0, 1.0, 4.0, 1.0) > 1e-9)[0]], abs=3e-4
    )


@given(st.floats(0.01, 2.0), SLOPES, st.floats(-2.0, -0.01), SLOPES, STEPS)
@check
def test_first_fall(u0: float, v0: float, u1: float, v1: float, h: float) -> None:
    """A fall that is the only one is found; of three, one is."""
    u = sampled(u0, v0, u1, v1, 1.0)
    fall = first_downcrossing(u0, v0 / h, u1, v1 / h, h)
    falls = S[np.flatnonzero((u[:-1] > 0.0) & (u[1:] <= 0.0))]
    crossings = np.count_nonzero((u[1:] > 0.0) != (u[:-1] > 0.0))
    if crossings == 1:
        assert fall == pytest.approx(falls[0], abs=3e-4)
    assert np.interp(fall, S, u) == pytest.approx(0.0, abs=1e-4)


def test_sign_of() -> None:
    assert [sign_of(u, 7) for u in (-0.5, 0.0, -0.0, 0.5)] == [-1, 7, 7, 1]
    assert sign_of(math.nan, 7) == 7
