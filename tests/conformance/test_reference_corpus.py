"""A refactoring changes no number: the recorded reference corpus, bitwise, and the recorded interface.

See ``reference_corpus.py`` for the contents of the corpus and for the way to record it again.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import reference_corpus as rc
from systems import SYSTEMS

ENTRIES = [*SYSTEMS, "analyses"]


@cache
def corpus() -> rc.Corpus:
    return rc.read()


@cache
def cases() -> tuple[rc.Case, ...]:
    return tuple(rc.cases())


def check(some: list[rc.Case]) -> None:
    """Compare cases; skip, with the reason, if numbers of this machine cannot be compared bitwise."""
    assert some
    results = [rc.compare_case(corpus(), case) for case in some]
    differences = [line for result in results for line in result.differences]
    assert not differences, "\n".join([*differences[:20], f"{len(differences)} differences"])
    skipped = [result.skipped for result in results if result.skipped]
    if skipped:
        pytest.skip(f"{len(skipped)} of {len(some)} cases not compared; the first: {skipped[0]}")


@pytest.mark.parametrize("entry", rc.QUICK)
def test_sample(entry: str) -> None:
    """Ensembles, recorded runs and advanced states of systems whose kernels other quick tests compile too."""
    check([case for case in cases() if case.quick and case.entry == entry])


@pytest.mark.slow
@pytest.mark.parametrize("entry", ENTRIES)
def test_every_case(entry: str) -> None:
    """All tables, both CPU layouts, both orders, with and without early termination."""
    check([case for case in cases() if case.entry == entry])


def test_fingerprint() -> None:
    """The solver's own fingerprint, which checks nine digits."""
    assert rc.solver_fingerprint() == corpus().fingerprint


def test_quick_interface() -> None:
    """Signatures, options and statistics; after an intended change: ``interface``, and read the difference."""
    changed = rc.interface_differences(rc.QUICK_PARTS)
    assert not changed, "\n".join(changed)


@pytest.mark.slow
def test_interface() -> None:
    """Dataset schemas and printed results too."""
    if rc.model_hash(rc.small_system()) != corpus().cases["analysis: sweep"]["model"]:
        pytest.skip(
            "printed results contain all digits, and the model's matrices differ from the recorded ones"
        )
    changed = rc.interface_differences()
    assert not changed, "\n".join(changed)


def test_coverage() -> None:
    """Every entry has ensembles, runs and states; both layouts and both orders; no recorded case is lost."""
    stored = corpus().cases
    names = {case.name for case in cases()}
    assert set(stored) <= names, "cases that are recorded and no longer computed"
    assert names <= set(stored) | set(corpus().refused)
    for table in ("ensembles", "runs", "states"):
        covered = {case.entry for case in cases() if case.table == table and case.name in stored}
        assert covered == set(SYSTEMS), table
    words = [set(name.split(", ")) for name in stored if name.startswith("ensemble")]
    for layout in rc.LAYOUTS:
        for order in rc.ACCURACY:
            assert any({layout, order} <= each for each in words), (layout, order)
    assert sum(case["rows"] for case in stored.values() if case["table"] == "ensembles") > 1500


def test_early_termination_and_snap_through_occur() -> None:
    """The recorded ensembles contain runs that ended early, and crossings, impacts and their absence."""
    table, names = corpus().tables["ensembles"], corpus().variables["ensembles"]
    crossings, impacts = (table[names.index(f"statistic.{name}")] for name in ("zero_crossings", "impacts"))
    ended_early = ~np.isnan(table[names.index("record.early_stop_time")].view(np.float64))
    assert 100 < ended_early.sum() < ended_early.size / 2
    assert 0.1 < (crossings > 0).mean() < 0.95
    assert (impacts > 0).mean() > 0.5


def test_a_difference_names_case_and_variable() -> None:
    """One changed bit of a recorded number is found."""
    case = next(each for each in cases() if each.quick)
    stored = corpus()
    if rc.compare_case(stored, case).skipped:
        pytest.skip("the model's matrices differ from the recorded ones")
    tables = dict(stored.tables)
    changed = tables[case.table].copy()
    names = stored.variables[case.table]
    changed[names.index("statistic.peak_force"), 2] ^= np.uint64(1)
    result = rc.compare_case(stored._replace(tables=tables | {case.table: changed}), case)
    assert len(result.differences) == 1
    assert result.differences[0].startswith(f"{case.name}, row 2, statistic.peak_force: ")


def test_other_matrices_are_skipped_with_a_reason() -> None:
    """A model of another processor is not compared."""
    case = next(each for each in cases() if each.quick)
    stored = corpus()
    other = stored.cases | {case.name: stored.cases[case.name] | {"model": "0" * 16}}
    result = rc.compare_case(stored._replace(cases=other), case)
    assert not result.differences
    assert "matrices of its model" in result.skipped


def test_words() -> None:
    """Zeros of both signs differ, NaN equals NaN, and a hash depends on shape and bits but not on integer size."""
    assert rc.word(0.0) != rc.word(-0.0)
    assert rc.word(np.nan) == rc.word(-np.nan) != rc.ABSENT
    assert rc.word(True) == rc.word(np.int8(1)) == 1
    assert rc.digest([1.0, 2.0]) != rc.digest([[1.0, 2.0]])
    assert rc.digest([1.0, 2.0]) != rc.digest([1.0, np.nextafter(2.0, 3.0)])
    assert rc.digest(np.arange(3, dtype=np.int8)) == rc.digest(np.arange(3, dtype=np.int64))
