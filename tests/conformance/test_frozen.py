"""Three hundred runs of version 0.1, reproduced to the last bit; and where they may differ, why.

Two things may differ.  ``final_well_proven`` was told of runs whose striker still strikes; it may only have been taken
back.  And Newton's law of impact has another march: that of 0.1 located a hit on one cubic a step, which an
independent solution refutes from the second impact on (by up to 3e-4 of the impulse, see
:func:`test_newton_against_an_independent_solution`), and its extremes of the centre belonged to no shape of one mode.
"""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import frozen
import numpy as np
import pytest
from oracle import PaperBeam

import snapbeam as sb
from snapbeam.model import default_values

DATA = Path(__file__).parent / "data"
STORED: dict[str, Any] = json.loads((DATA / "frozen_0_1.json").read_text(encoding="utf-8"))
IMPULSES: dict[str, list[str]] = json.loads((DATA / "restitution_0_1.json").read_text(encoding="utf-8"))
"""The first three impulses of each of its runs under Newton's law."""
CASES = frozen.cases()
LOOSE = {"gross_work": 0.5, "contact_time_fraction": 0.05, "last_zero_crossing": 0.2}
"""Under Newton's law, relative; the rest of the numbers agrees within 5 %, but for counts one apart."""


def as_number(value: Any) -> float:
    return float.fromhex(value) if isinstance(value, str) else float(value)


@cache
def same_model(modes: int) -> bool:
    """Whether linear algebra rounds here as it did where the numbers were written down."""
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=modes)
    return frozen.model_hash(model) == STORED["models"][str(modes)]


@cache
def run_of(index: int) -> sb.Run:
    return frozen.answer(CASES[index])


QUICK = {kind: k for k, kind in enumerate([(case["kind"], case["modes"]) for case in CASES])}
"""The last case of each kind and number of modes; the others are slow."""
INDICES = [pytest.param(k, marks=() if k in QUICK.values() else pytest.mark.slow) for k in range(len(CASES))]


@pytest.mark.parametrize("index", INDICES)
def test_frozen(index: int) -> None:
    """One run with what version 0.1 gave."""
    case, stored = CASES[index], dict(STORED["runs"][index])
    run = run_of(index)
    found = frozen.numbers(run)
    was_final, is_final = stored.pop("final_well_proven"), found.pop("final_well_proven")
    if case["kind"] == "restitution":
        compare_newton(index, run, stored)
        return
    assert is_final <= was_final
    if is_final:
        check_end(case, run)
    if same_model(case["modes"]):
        assert found == stored
    else:
        compare_closely(run, found, stored)


def compare_closely(run: sb.Run, found: dict[str, Any], stored: dict[str, Any]) -> None:
    """Every statistic of a run that its conditioning lets compare; rounding decides the others."""
    cycles = round(float(run.dataset.attrs["cycles"]), 6)
    whole = int(cycles)
    apart = sb.perturbation_growth(run.system, sb.Integration(cycles=whole if whole else 1))
    if float(apart.separation[-1]) > 1e-9:
        return
    for name, value in stored.items():
        if name == "impact_table":
            continue
        assert as_number(found[name]) == pytest.approx(as_number(value), rel=1e-5, abs=1e-9, nan_ok=True), (
            name
        )


def check_end(case: dict[str, Any], run: sb.Run) -> None:
    """What is said to be final is what a far longer run ends in."""
    case = dict(case, cycles=case["cycles"] + 60, kind="plain" if case["kind"] == "early" else case["kind"])
    longer = frozen.answer(case).summary
    assert longer.status == sb.RunStatus.OK
    assert (longer.zero_crossings, longer.final_well) == (run.summary.zero_crossings, run.summary.final_well)
    if run.summary.response_class != sb.ResponseClass.CONTINUOUS:
        assert longer.response_class == run.summary.response_class


def compare_newton(index: int, run: sb.Run, stored: dict[str, Any]) -> None:
    """As far as the old march could be trusted: the class, the first impacts, the rest loosely."""
    outcome = run.summary
    assert outcome.status == sb.RunStatus.OK
    assert outcome.response_class == stored["response_class"]
    was = np.array([float.fromhex(text) for text in IMPULSES[str(index)]])
    now = run.impacts.impulse.values[: was.size]
    assert now[0] == pytest.approx(was[0], rel=1e-9), "the tip begins in touch: nothing to be located"
    np.testing.assert_allclose(now[1:], was[1:], rtol=1.5e-3)
    for name in ("impacts", "zero_crossings", "zero_crossings_last_quarter"):
        assert abs(outcome[name] - stored[name]) <= 1, name
    for name, value in stored.items():
        if isinstance(value, str) and name not in ("impact_table", "peak_force", "early_stop_time"):
            found = run.dataset.attrs[name] if name == "gross_work" else outcome[name]
            limit = LOOSE.get(name, 0.05)
            assert found == pytest.approx(as_number(value), rel=limit, abs=1e-9, nan_ok=True), name
    assert np.isnan(outcome.peak_force), "an impact that lasts no time has no force"


def test_every_kind_is_there() -> None:
    kinds = {(case["kind"], case["modes"]) for case in CASES}
    assert kinds == {(kind, modes) for kind in frozen.EACH for modes in (1, 5, 20, 32)} | {("restitution", 1)}
    assert len(CASES) == len(STORED["runs"]) == 300


@pytest.mark.slow
def test_what_was_said_to_be_final_and_is_not() -> None:
    """It was taken back where the striker still strikes, and only there."""
    taken, kernel_output = 0, 0
    for index, case in enumerate(CASES):
        if case["kind"] != "restitution" and STORED["runs"][index]["final_well_proven"]:
            final = run_of(index).summary.final_well_proven
            taken, kernel_output = taken + (not final), kernel_output + final
    assert taken > kernel_output > 0, (taken, kernel_output)


@pytest.mark.slow
def test_runs_of_another_processor_are_compared_closely() -> None:
    """A model whose numbers differ in their last digits: close where the problem is well-conditioned."""
    compared = 0
    for index, case in enumerate(CASES[:150]):
        if case["kind"] != "plain" or case["modes"] != 5:
            continue
        run = frozen.answer(dict(case, velocity_amplitude=case["velocity_amplitude"] * (1.0 + 4e-16)))
        assert frozen.numbers(run)["impact_table"] != STORED["runs"][index]["impact_table"]
        stored = {name: v for name, v in STORED["runs"][index].items() if name != "final_well_proven"}
        compare_closely(run, frozen.numbers(run), stored)
        compared += 1
    assert compared > 30


@pytest.mark.parametrize(
    "index", [pytest.param(i, marks=() if i == 296 else pytest.mark.slow) for i in range(260, 300, 4)]
)
def test_newton_against_an_independent_solution(index: int) -> None:
    """DOP853 with events on the equation as the paper writes it: the first impacts, measured to 1e-5 of the impulse."""
    case = CASES[index]
    impacts = run_of(index).impacts
    count = min(4, impacts.sizes["impact"])
    truth = PaperBeam(1).bounces(
        case["frequency_ratio"], case["velocity_amplitude"], case["coefficient"], case["location"], count
    )
    np.testing.assert_allclose(impacts.onset[:count], truth[:, 0], rtol=0.0, atol=1e-7)
    np.testing.assert_allclose(impacts.impulse[:count], truth[:, 1], rtol=3e-5)
