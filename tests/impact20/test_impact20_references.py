"""The problems of impact20: both codes agree, and published values are met."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[2]))

from impact20 import load, names
from impact20.references import references


@pytest.mark.parametrize("name", names())
def test_two_codes_agree_with_the_stored_reference(name):
    stored = load(name).references
    assert stored
    for quantity, row in references(name).items():
        assert row["error"] < 2e-11
        assert row["value"] == pytest.approx(stored[quantity]["value"], rel=1e-14)
        assert row["conditioning"] == pytest.approx(stored[quantity]["conditioning"], abs=1e-3)


def test_linear_stop_meets_the_published_values():
    rows = load("linear_stop").references
    assert rows["force"]["value"] == pytest.approx(9950.0, rel=1e-4)
    assert rows["duration"]["value"] == pytest.approx(0.03126, rel=1e-4)
    assert rows["second_peak"]["value"] == pytest.approx(0.361, abs=1e-4)
    assert rows["impulse"]["value"] == pytest.approx(198.05, rel=2e-4)


def test_unknown_name_is_refused():
    with pytest.raises(ValueError, match="must be one of"):
        load("no_such_problem")
