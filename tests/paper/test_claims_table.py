"""The table of claims: its rules on maps known point by point, and the table itself at sketch size."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest

import snapbeam as sb
from snapbeam import paper
from snapbeam.core.codes import ResponseClass
from snapbeam.core.validate import InputError
from snapbeam.paper.claims import VERDICTS, Claim, measure_claims, write_claims
from snapbeam.paper.studies.sensitivity import buckling_mode_damping
from snapbeam.sweeps.analysis import compare_maps, interwell_threshold, threshold_notch


def test_threshold_of_a_known_map(synthetic_map):
    x, step = synthetic_map.frequency_ratio.values, 0.64 / 24
    exact = 0.10 + 0.06 * x - 0.09 * np.exp(-(((x - 1.2) / 0.3) ** 2))
    found = interwell_threshold(synthetic_map)
    low = x > 0.8  # below it the formula has continuous responses above another line
    assert ((found - exact)[low] >= 0.0).all() and ((found - exact)[low] <= step * 1.0001).all()
    notch = threshold_notch(x, found, step, (0.8, 2.2))
    assert abs(notch.position - 1.2) <= 0.5 * (notch.high - notch.low) + 0.1
    assert notch.low <= 1.2 <= notch.high
    with pytest.raises(InputError, match="must hold a point"):
        threshold_notch(x, found, step, (7.0, 8.0))


def test_no_threshold_where_nothing_snaps(synthetic_map):
    calm = synthetic_map.copy(deep=True)
    calm.response[0] = ResponseClass.INTRAWELL
    assert np.isnan(interwell_threshold(calm)[0])


def test_comparing_maps(synthetic_map):
    same = compare_maps(synthetic_map, synthetic_map)
    assert (same.changed, same.snapped, same.share, same.threshold) == (0.0, 0.0, 0.0, 1.0)
    other = synthetic_map.copy(deep=True)
    other.response[5, 3] = ResponseClass.CONTINUOUS
    assert compare_maps(synthetic_map, other).changed == pytest.approx(1 / 1000)
    with pytest.raises(InputError, match="must share one grid"):
        compare_maps(synthetic_map, other.isel(frequency_ratio=slice(5)))


def test_damping_of_the_buckling_modes():
    """Its diagonal in the linear modes against the eigenvalues of the whole: light damping decouples."""
    model = sb.ReducedModel.from_beam(paper.BEAM, modes=8)
    projected, exact = buckling_mode_damping(model)
    np.testing.assert_allclose(projected, exact, rtol=1e-3)
    one = sb.ReducedModel.from_beam(paper.BEAM, modes=1)
    assert buckling_mode_damping(one)[0] == pytest.approx([0.005], rel=1e-12)


def test_claims_are_written_and_say_what_was_found(tmp_path):
    rows, files = write_claims(tmp_path, paper.shared_results())
    assert sorted(file.name for file in files) == ["claims.csv", "claims.json", "claims.md"]
    numbers = [row.number for row in rows]
    assert len(set(numbers)) == len(numbers)
    assert {number.rstrip("abcd") for number in numbers} == {*map(str, range(1, 17)), *"ABCDE"}
    record = json.loads((tmp_path / "claims.json").read_text())
    assert [entry["number"] for entry in record["claims"]] == numbers and record["snapbeam_version"]
    with (tmp_path / "claims.csv").open() as stream:
        assert [entry["verdict"] for entry in csv.DictReader(stream)] == [row.verdict for row in rows]
    table = [line for line in (tmp_path / "claims.md").read_text().splitlines() if line.startswith("|")]
    assert len(table) == len(rows) + 2
    assert all(line.replace("\\|", "").count("|") == 8 for line in table)
    for row in rows:
        assert row.measured and row.uncertainty and row.rule
        assert "nan" not in row.measured
    # what does not depend on the size
    verdicts = {row.number: row.verdict for row in rows}
    assert {verdicts[number] for number in ("1a", "1b", "10a", "11", "13", "14")} == {"holds"}
    assert {verdicts[number] for number in ("1c", "16")} == {"fails"}


def test_verdicts_are_a_closed_list():
    assert VERDICTS == ("holds", "in part", "fails", "open")
    with pytest.raises(InputError, match="verdict"):
        Claim("1", "a", "b", "c", "d", "perhaps", "e")


def test_a_sketch_stands_in_for_what_is_not_stored(tmp_path):
    stored = paper.Results("full", read=tmp_path, compute=False)
    with pytest.raises(InputError, match="fig6: is not among the stored data"):
        stored["fig6"]
    rows = measure_claims(stored, paper.shared_results())
    sizes = {row.number: row.size for row in rows}
    assert sizes["1a"] == "full" and sizes["2a"] == "quick"
