"""The words of the claims: an entry for each function, every placeholder filled, no number left in braces."""

from __future__ import annotations

import re
from dataclasses import fields
from functools import partial
from pathlib import Path

import pytest

from snapbeam.paper.claims import TOPICS, measurements
from snapbeam.paper.claims.claim_result import Quantity, above, found
from snapbeam.paper.claims.prose import Entry, fill, read_topic

TOPIC_FILES = Path(__file__).parents[2] / "src" / "snapbeam" / "paper" / "claims" / "topics"


def test_every_topic_is_in_the_table():
    assert sorted(TOPICS) == sorted(file.stem for file in TOPIC_FILES.glob("*.toml"))
    assert sorted(TOPICS) == sorted(file.stem for file in TOPIC_FILES.glob("*.py") if file.stem != "__init__")


@pytest.mark.parametrize("topic", TOPICS)
def test_one_entry_a_function_and_one_function_an_entry(topic):
    entries, functions = read_topic(topic).entries, measurements(topic)
    assert sorted(entries) == sorted(functions)
    assert len({str(function) for function in functions.values()}) == len(functions)
    for number, function in functions.items():
        if not isinstance(function, partial):  # a rule of several rows
            assert (function.__doc__ or "").startswith(number), f"{function.__name__} says another number than {number}"


def test_numbers_are_told_once():
    numbers = [number for topic in TOPICS for number in read_topic(topic).entries]
    assert len(numbers) == len(set(numbers))


@pytest.mark.parametrize("topic", TOPICS)
def test_every_row_says_what_it_must(topic):
    for number, entry in read_topic(topic).entries.items():
        for name in ("says", "paper", "source", "measured", "uncertainty", "rule", "fails"):
            assert getattr(entry, name), f"{number}: {name}"
        assert "<" in entry.measured, f"{number}: nothing measured is told"
        for name in ("says", "paper", "source", "figure"):
            assert "<" not in getattr(entry, name), f"{number}: {name} is the paper's, no measurement"
        text = " ".join(getattr(entry, item.name) for item in fields(Entry))
        assert text.count("$") % 2 == 0, f"{number}: a formula that does not end"
        assert not re.search(r"\|(?![^<>]*>)", text), f"{number}: a bar would end the cell"


@pytest.fixture
def result():
    return found(
        above(1.0, 0.0), notch=Quantity(1.4859, 0.05), share=Quantity(0.9388, 0.02), tiny=3.2e-9, count=7,
        listed=(1.0, 2.5), rows=((1, 0.5), (32, 0.4166)), nothing=(), none=float("nan"), zero=0,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("text", "filled"),
    [
        ("$\\Omega$ = <notch:.2f> ± <notch.u:.2f>", "$\\Omega$ = 1.49 ± 0.05"),
        ("<share:.1%> (<share.u:.0%>)", "93.9 % (2 %)"),
        ("<tiny:e>", "$3.2 \\times 10^{-9}$"),
        ("<tiny:.2e> <zero:e>", "$3.20 \\times 10^{-9}$ 0"),
        ("<count> of <count:d>", "7 of 7"),
        ("at <listed:.1f>; <nothing:.1f>", "at 1.0, 2.5; none"),
        ("<rows:N = %d: %.2f>", "N = 1: 0.50, N = 32: 0.42"),
        ("<none:.2f>", "none"),
        ("<zero?yes|no> <count?yes|no>", "no yes"),
        ("$a < b$ and $x > 0$", "$a < b$ and $x > 0$"),
    ],
)
def test_placeholders(result, text, filled):
    assert fill(text, result) == filled


@pytest.mark.parametrize("text", ["<unknown>", "<count.u>"])
def test_what_was_not_measured_is_not_told(result, text):
    with pytest.raises(KeyError):
        fill(text, result)
