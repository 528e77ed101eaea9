"""Classes from counts: the rules of section 4.2 of the paper."""

from __future__ import annotations

import math

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.simulation.summary import RunSummary
from snapbeam.solver.statistics import STATISTICS
from snapbeam.util.status_codes import ResponseClass, RunStatus, classify

INTRAWELL, FIRST, SECOND, CONTINUOUS = (
    ResponseClass.INTRAWELL,
    ResponseClass.TRANSIENT_1,
    ResponseClass.TRANSIENT_2,
    ResponseClass.CONTINUOUS,
)


@pytest.mark.parametrize(
    ("crossings", "last_quarter", "cycles", "side", "expected"),
    [
        (0, 0, 200, -1, INTRAWELL),
        (0, 0, 1, -1, INTRAWELL),
        (1, 0, 200, 1, SECOND),
        (2, 0, 200, -1, FIRST),
        # n = 50: more than 10 in the last quarter
        (10, 10, 200, -1, FIRST),
        (11, 10, 200, 1, SECOND),
        (11, 11, 200, 1, CONTINUOUS),
        (300, 11, 200, -1, CONTINUOUS),
        # n = 250: more than 50
        (51, 50, 1000, 1, SECOND),
        (51, 51, 1000, 1, CONTINUOUS),
        # n/5 that is no integer: 1.1 and 0.05
        (3, 1, 22, 1, SECOND),
        (3, 2, 22, 1, CONTINUOUS),
        (1, 1, 1, 1, CONTINUOUS),
        (1, 1, 20, 1, SECOND),
        (1, 1, 19, 1, CONTINUOUS),
    ],
)
def test_classify(crossings: int, last_quarter: int, cycles: int, side: int, expected: ResponseClass) -> None:
    result = classify(crossings, last_quarter, cycles, side)
    assert result.dtype == np.int8
    assert result == expected


def test_classify_broadcasts() -> None:
    result = classify([[0], [5]], 0, 200, [-1, 1])
    np.testing.assert_array_equal(result, [[INTRAWELL, INTRAWELL], [FIRST, SECOND]])
    assert sb.classify is classify


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ((1, 2, 200, 1), "crossings: must be at least zero_crossings_last_quarter"),
        ((-1, -1, 200, 1), "and both at least 0"),
        ((1, 1, 0, 1), "cycles = .*0.*: must be greater than 0"),
    ],
)
def test_classify_refuses(given: tuple[int, int, int, int], message: str) -> None:
    with pytest.raises(sb.InputError, match=message):
        classify(*given)


def test_codes() -> None:
    assert {c.name: int(c) for c in ResponseClass} == {
        "UNKNOWN": -1, "INTRAWELL": 0, "TRANSIENT_1": 1, "TRANSIENT_2": 2, "CONTINUOUS": 3,
    }  # fmt: skip
    assert len({c.label for c in ResponseClass}) == 5
    assert [c.is_interwell for c in ResponseClass] == [False, False, True, True, True]
    assert all(len(status.advice) > 10 for status in RunStatus)


def test_outcome_from_statistics() -> None:
    values = {
        name: np.array([0, 1]).astype(row.dtype) if row.dtype != "float64" else np.array([math.nan, 0.5])
        for name, row in STATISTICS.items()
    }
    outcome = RunSummary.from_statistics(values, 1)
    assert outcome.response_class is ResponseClass.TRANSIENT_1
    assert outcome.status is RunStatus.EARLY_STOP
    assert outcome.early_stop_time == 0.5
    assert outcome.final_well_proven is True
    assert type(outcome.zero_crossings) is int
    assert list(outcome) == list(STATISTICS)
    assert len(outcome) == len(STATISTICS)
    assert {name: outcome[name] for name in outcome} == {name: getattr(outcome, name) for name in outcome}
    assert set(STATISTICS) <= set(dir(outcome))


def test_outcome_says_what_it_is() -> None:
    values = {name: np.zeros(1, dtype=row.dtype) for name, row in STATISTICS.items()}
    outcome = RunSummary.from_statistics(values)
    assert repr(outcome) == "<RunSummary intrawell, 0 zero crossings, 0 impacts>"
    lines = outcome.to_text().splitlines()
    assert len(lines) == len(STATISTICS)
    assert lines[0].split() == ["response_class", "intrawell", "response", "class"]
    (force,) = [line for line in lines if line.startswith("peak_force")]
    assert force.split() == ["peak_force", "0", "N", "peak", "contact", "force"]
    with pytest.raises(
        AttributeError, match="RunSummary has no 'crossing'; it has response_class, status, zero_crossings"
    ):
        _ = outcome.crossing
    with pytest.raises(KeyError):
        outcome["crossing"]
