"""Verdicts from conditions, and how a number's uncertainty is found."""

from __future__ import annotations

import numpy as np
import pytest
from claims_data import Given

from snapbeam.paper.claims.claim_result import VERDICTS, Quantity, above, below, found, measured, near
from snapbeam.paper.claims.uncertainty import combined, mean_of, median_of, part, resampled, share
from snapbeam.paper.recipe import MissingResults


@pytest.mark.parametrize(
    ("value", "verdict", "close"),
    [(2.0, "holds", False), (1.05, "holds", True), (0.95, "in part", True), (0.7, "in part", False),
     (0.55, "in part", True), (0.45, "fails", True), (0.1, "fails", False), (float("nan"), "fails", False)],
)  # fmt: skip
def test_verdict_of_one_number(value, verdict, close):
    """Holds above 1, in part above 0.5, with an uncertainty of 0.1."""
    number = Quantity(value, 0.1)
    result = found(above(number, 1.0), above(number, 0.5), number=number)
    assert (result.verdict, result.close) == (verdict, close)
    assert result.verdict in VERDICTS


def test_conditions_are_joined():
    sure, unsure, wrong = above(Quantity(2.0, 0.1), 1.0), above(Quantity(1.0, 0.1), 0.95), above(0.0, 1.0)
    assert found(sure & unsure).verdict == "holds" and found(sure & unsure).close
    assert found(sure & wrong, sure | wrong).verdict == "in part" and not found(sure & wrong, sure).close
    assert found(unsure & wrong).verdict == "fails" and not found(unsure & wrong).close
    # a limit that an uncertain number may be beyond makes the verdict close, from either side
    assert found(above(Quantity(0.9, 0.2), 1.0) & sure).close


def test_on_a_limit():
    assert below(1.0, 1.0).must and not above(1.0, 1.0).could
    assert near(1.3, 1.2, 0.1).does and not near(1.3001, 1.2, 0.1).does
    assert near(Quantity(1.25, 0.1), 1.2, 0.1) == (False, True, True)


def test_an_open_question_matters_beyond_its_uncertainty():
    result = measured(above(Quantity(0.2, 0.1), 0.0), moved=Quantity(0.2, 0.1))
    assert result.verdict == "open" and result.numbers["matters"] == 1
    assert measured(above(Quantity(0.05, 0.1), 0.0), moved=Quantity(0.05, 0.1)).numbers["matters"] == 0


def test_an_uncertainty_is_asked_for():
    with pytest.raises(ValueError, match="uncertainty of at least 0"):
        found(above(1.0, 0.0), number=Quantity(1.0, -0.1))
    with pytest.raises(ValueError, match="uncertainty of at least 0"):
        found(above(1.0, 0.0), number=Quantity(1.0, float("nan")))


@pytest.mark.slow
def test_half_widths_cover():
    """95 % of intervals hold the truth, for shares from 1 to 99 %, for means and for medians."""
    rng = np.random.default_rng(1)
    for truth in (0.01, 0.2, 0.5, 0.99):
        hits = 0
        for _ in range(300):
            value, half = share(rng.random(400) < truth)
            # Wilson's interval is about a middle that is drawn towards one half
            middle = (value + 0.5 * 1.96**2 / 400) / (1.0 + 1.96**2 / 400)
            hits += abs(middle - truth) <= half * 1.0001
        assert hits >= 0.92 * 300
    for of, truth in ((mean_of, 1.0), (median_of, np.log(2.0))):
        hits = sum(abs((q := of(rng.exponential(size=60))).value - truth) <= q.uncertainty for _ in range(100))
        assert hits >= 87


def test_causes_add_and_few_items_say_nothing():
    assert combined(3.0, 4.0, float("nan")) == 5.0
    assert share(np.ones(100)).value == 1.0 and share(np.ones(100)).uncertainty > 0.01
    assert np.isnan(share([]).value)
    assert resampled(lambda at: float(at.size), 2).uncertainty == 2.0
    assert mean_of(np.full(10, 3.0), 0.4) == (3.0, 0.4)


def test_data_of_an_older_recipe_are_named():
    with pytest.raises(MissingResults, match="sensitivity: the stored data lack 'long'"):
        part(Given(sensitivity={}), "sensitivity", "long")
