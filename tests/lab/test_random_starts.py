"""A few of the records of ``random_starts``; the rates of hundreds are in the page on diagnostics."""

from __future__ import annotations

import random_starts


def test_starts_and_noise_of_many_kinds_are_no_high_pass():
    """Each kind of start twice; some of them were credited to a filter in one of four records."""
    found = [random_starts.judged(812, k, filtered=False) for k in range(2 * len(random_starts.STARTS))]
    assert not [start for codes, _, start, *_ in found if "high_pass" in codes]


def test_a_high_pass_is_told_where_the_noise_shows_it():
    found = [random_starts.judged(812, k, filtered=True) for k in range(12)]
    assert sum("high_pass" in codes for codes, *_ in found) >= 5
