"""The stored counts of how often intervals hold the truth: near 95 %, and what the page shows."""

from __future__ import annotations

import covering
import pytest


@pytest.mark.parametrize("name", covering.stored())
def test_intervals_cover_as_stored(name: str) -> None:
    """93 to 97 %, with two standard errors of counting."""
    one = covering.stored()[name]
    value = covering.Counted(one["trials"], one["shares"]).all
    error = 2.0 * (0.95 * 0.05 / (one["trials"] * len(one["shares"]))) ** 0.5
    assert 0.93 - error <= value <= 0.97 + error


def test_the_page_shows_what_is_stored() -> None:
    assert (covering.DATA / "coverage.md").read_text(encoding="utf-8") == covering.text()
    assert {"wilson", "given", "goals", "lifetimes"} <= set(covering.stored())
