"""The table of claims at sketch size: whole, filled, with an uncertainty in every row; and its files."""

from __future__ import annotations

import csv
import json
import math
import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

from snapbeam import paper
from snapbeam.paper.claims import TOPICS, measure_claims, write_claims
from snapbeam.paper.claims.claim_result import VERDICTS
from snapbeam.paper.claims.prose import read_topic
from snapbeam.paper.claims.table import Claim, summary
from snapbeam.util.validation import InputError

pytestmark = pytest.mark.slow  # the studies at sketch size take 20 s

REPRODUCTION = Path(__file__).parents[2] / "docs" / "reproduction.md"


@cache
def rows() -> tuple[Claim, ...]:
    return tuple(measure_claims(paper.shared_results(), paper.Results()))


def test_every_row_is_measured_and_filled():
    assert [row.number for row in rows()] == [n for topic in TOPICS for n in read_topic(topic).entries]
    for row in rows():
        for name in ("measured", "uncertainty", "rule", "fails"):
            text = getattr(row, name)
            assert text and "nan" not in text and not re.search(r"<[a-z]", text), (row.number, name, text)
        assert (row.verdict == "open") == (row.topic == read_topic("questions").title)


def test_every_row_has_an_uncertainty_of_what_it_measured():
    for row in rows():
        assert row.quantities, row.number
        for name, quantity in row.quantities.items():
            assert quantity.uncertainty >= 0.0 or math.isnan(quantity.value), (row.number, name)
        # a row whose numbers are exact says so
        if all(quantity.uncertainty == 0.0 for quantity in row.quantities.values()):
            assert row.number in ("11b", "14"), row.number


def test_verdicts_that_do_not_depend_on_the_size():
    """1, 11, 13, 14, 18, 20, 21: closed forms and symmetry; 1c and 16: a misprint and a modulus no material has."""
    verdicts = {row.number: row.verdict for row in rows()}
    holding = ("1a", "1b", "1d", "11", "12a", "13", "14", "18", "20a", "20b", "20c", "20d", "21a", "21b", "9f", "10d")
    assert {number: verdicts[number] for number in holding} == dict.fromkeys(holding, "holds")
    assert {verdicts[number] for number in ("1c", "16", "26b")} == {"fails"}


def test_numbers_of_the_paper():
    """What the table measures of the beam is what the paper and the theory state."""
    value = {row.number: {name: q.value for name, q in row.quantities.items()} for row in rows()}
    assert value["1b"]["first"] == pytest.approx(81.8, rel=1e-3)
    assert value["1c"]["second"] == pytest.approx(194.6, rel=1e-3)
    assert value["11"]["error"] < 7e-4
    assert value["21b"]["crossing"] == pytest.approx(6.2 * 1e3 * paper.BEAM.radius_of_gyration, rel=0.01)
    assert value["12a"]["slope"] == pytest.approx(-1.0, abs=0.1)
    assert value["16"]["computed"] == pytest.approx(2.63e8, rel=0.01)
    assert value["8f"]["made"] > 0.5


def test_written_as_three_files(tmp_path):
    written, files = write_claims(tmp_path, paper.shared_results(), paper.Results())
    assert sorted(file.name for file in files) == ["claims.csv", "claims.json", "claims.md"]
    record = json.loads((tmp_path / "claims.json").read_text(encoding="utf-8"))
    assert record["snapbeam_version"] and record["summary"] == summary(written)
    for entry, row in zip(record["claims"], written, strict=True):
        assert entry["number"] == row.number and entry["verdict"] == row.verdict
        assert set(entry["quantities"]) == set(row.quantities)
        assert all(set(quantity) == {"value", "uncertainty"} for quantity in entry["quantities"].values())
    with (tmp_path / "claims.csv").open() as stream:
        for line, row in zip(csv.DictReader(stream), written, strict=True):
            first = next(iter(row.quantities.values()))
            assert float(line["value"]) == pytest.approx(first.value, nan_ok=True)
            assert float(line["value_uncertainty"]) == pytest.approx(first.uncertainty, nan_ok=True)


def test_markdown(tmp_path):
    """Questions apart, cells that are whole, links that lead somewhere, no column that is the same throughout."""
    write_claims(tmp_path, paper.shared_results(), paper.Results())
    text = (tmp_path / "claims.md").read_text(encoding="utf-8")
    assert text.startswith(f"**{summary(rows())}**")
    tables = re.split(r"^### ", text, flags=re.MULTILINE)[1:]
    assert [table.splitlines()[0] for table in tables] == [read_topic(topic).title for topic in TOPICS]
    assert "| question |" in tables[-1] and "| verdict |" not in tables[-1]
    for table in tables:
        lines = [line for line in table.splitlines() if line.startswith("|")]
        assert {line.replace("\\|", "").count("|") for line in lines} == {lines[0].count("|")}
    page = REPRODUCTION.read_text(encoding="utf-8")
    headings = {
        line.lstrip("# ").lower().replace(" ", "-").replace(".", "") for line in page.splitlines() if line[:1] == "#"
    }
    links = set(re.findall(r"\]\(#([^)]*)\)", text))
    assert links and links <= headings, links - headings
    titles = [read_topic(topic).title.lower().replace(" ", "-") for topic in TOPICS]
    assert not set(titles) & headings, "a topic and a figure share an anchor"


def row_of(**more):
    given = dict.fromkeys(("topic", "says", "paper", "source", "measured", "uncertainty", "rule", "fails"), "a")
    return Claim(**({"number": "1", "verdict": "holds", "close": False} | given | more))


def test_summary_counts():
    first = row_of()
    table = [first, replace(first, verdict="fails", close=True), replace(first, verdict="in part", size="quick"),
             replace(first, verdict="open", close=True)]  # fmt: skip
    assert summary(table) == (
        "Of 3 statements 1 hold, 1 hold in part and 1 fail; 1 of these verdicts (†) could change within the "
        "uncertainty. 1 properties that the paper does not specify are measured separately. 1 rows (*) are measured on sketches."
    )


def test_verdicts_are_a_closed_list():
    assert VERDICTS == ("holds", "in part", "fails", "open")
    with pytest.raises(InputError, match="verdict"):
        row_of(verdict="perhaps")


def test_a_sketch_stands_in_for_what_is_not_stored(tmp_path):
    stored = paper.Results("full", read=tmp_path, compute=False)
    with pytest.raises(InputError, match="fig6: is not among the stored data"):
        stored["fig6"]
    with pytest.raises(InputError, match="is not among the stored data"):
        measure_claims(stored)
    sizes = {row.number: row.size for row in measure_claims(stored, paper.shared_results())}
    assert sizes["1a"] == "full" and sizes["2a"] == "quick"
    with pytest.raises(InputError, match="must be an existing folder"):
        write_claims(tmp_path / "none", stored)
