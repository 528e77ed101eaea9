"""Lifetimes from censored data: coverage on synthetic data, exact values by hand, refusals."""

from __future__ import annotations

import numpy as np
import pytest

from snapbeam.dynamics.lifetimes import LifetimeSettings, fit_lifetime
from snapbeam.util.proportions import proportion
from snapbeam.util.validation import InputError

LIFETIME, DELAY = 50.0, 8.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("runs", "limit"),
    [
        (12, 60.0),
        *(
            pytest.param(*case, marks=pytest.mark.slow)
            for case in ((12, np.inf), (12, 200.0), (32, np.inf), (32, 200.0), (32, 60.0))
        ),
    ],
)
def test_intervals_cover_as_they_say(runs: int, limit: float) -> None:
    """93 to 97 % of 1500 samples, complete or censored, of an exponential after a delay."""
    draw = np.random.default_rng(7)
    time = DELAY + draw.exponential(LIFETIME, (1500, runs))
    fit = fit_lifetime(np.minimum(time, limit), time < limit)
    covered = ((fit.low <= LIFETIME) & (fit.high >= LIFETIME)).mean()
    assert 0.93 <= covered <= 0.97
    assert np.nanmedian(fit.lifetime) == pytest.approx(LIFETIME, rel=0.06)
    assert (fit.delay >= DELAY).all()
    given = fit_lifetime(np.minimum(time, limit), time < limit, delay=DELAY)
    assert 0.93 <= ((given.low <= LIFETIME) & (given.high >= LIFETIME)).mean() <= 0.97
    assert (given.goodness < 0.05).mean() == pytest.approx(0.05, abs=0.02), "the test itself keeps its level"


def test_what_is_not_exponential_is_told() -> None:
    draw = np.random.default_rng(3)
    lasting = fit_lifetime(draw.weibull(3.0, (40, 100)), True, delay=0.0)
    assert (lasting.goodness < 0.01).mean() > 0.95


def test_a_start_that_is_not_exponential_is_left_out() -> None:
    """Many that end at once, then an exponential: the delay is found beyond them."""
    draw = np.random.default_rng(5)
    time = np.concatenate([draw.uniform(1.0, 2.0, (50, 30)), 10.0 + draw.exponential(LIFETIME, (50, 100))], axis=1)
    fit = fit_lifetime(time, True)
    plain = fit_lifetime(time, True, delay=1.0)
    assert (plain.goodness < 0.01).mean() > 0.9
    assert (fit.goodness >= 0.01).all() and (fit.delay > 1.0).all()
    assert np.abs(fit.lifetime - LIFETIME).mean() < 0.8 * np.abs(plain.lifetime - LIFETIME).mean()


def test_values_by_hand() -> None:
    """Two ends and one that lasts, from a delay of 1: kappa = 2/(1 + 3 + 9)."""
    fit = fit_lifetime([2.0, 4.0, 10.0], [True, True, False], delay=1.0)
    assert float(fit.lifetime) == pytest.approx(6.5)
    assert (int(fit.ended), int(fit.lasting)) == (2, 1)
    none = fit_lifetime([10.0, 10.0], [False, False])
    assert np.isnan(none.lifetime) and np.isinf(none.high) and 0.0 < float(none.low) < 20.0
    empty = fit_lifetime([np.nan, np.nan], [False, False])
    assert np.isnan(empty.lifetime) and float(empty.low) == 0.0 and np.isinf(empty.high)


def test_proportions() -> None:
    share, low, high = proportion([0, 5, 10], [10, 10, 10])
    np.testing.assert_allclose(share, [0.0, 0.5, 1.0])
    assert low[0] == 0.0 and high[2] == 1.0 and low[1] < 0.5 < high[1]
    assert high[0] == pytest.approx(1.0 - low[2])
    share, low, high = proportion(0, 0)
    assert np.isnan(share) and (low, high) == (0.0, 1.0)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: fit_lifetime(3.0, True), "time: must have at least one dimension"),
        (lambda: fit_lifetime([-1.0], True), "time: must be at least 0"),
        (lambda: fit_lifetime([1.0], True, confidence=1.0), "confidence = 1.0"),
        (lambda: proportion(3, 2), "hits: must be between 0"),
        (lambda: LifetimeSettings(settling_cycles=0.0), "settling_cycles = 0.0"),
        (lambda: LifetimeSettings(delay=-1.0), "delay = -1.0"),
    ],
)
def test_refusals(call, words: str) -> None:
    with pytest.raises(InputError) as error:
        call()
    assert words in str(error.value)
