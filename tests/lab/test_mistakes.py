"""Ordinary mistakes of a laboratory: each comes out right, or flagged, or refused with a way out."""

import re

import numpy as np
import pytest
from mistakes import table
from mistakes.case import KINDS, looked
from mistakes.table import CASES

ENDS = ("right", "flagged", "refused")


QUICK = ("the beam moves in the first frame",)
"""Of the groups that are rendered and tracked, at some three seconds a case; the groups' others are slow."""
RENDERED = ("Jumps of the striker", "Half the exposure")
"""Groups beside those of the scenes that are rendered and tracked too."""
DEAR = (
    "a mode of 2600 Hz, sampled at 5000 Hz",
    "viscous and quadratic damping",
    "a softening mode of 3000 Hz, sampled at 5000 Hz",
    "a frequency that rises by 0.3 % in a second",
    "a drive made of the record",
    "four modes asked of a hammer's impact with six, after a rest of 37 ms",
    "ten percent more amplitude in the camera",
    "viscous damping and dry friction",
    "the record begins with the beam held away from its well",
    "hum of 100 Hz half as large as the decay",
    "the same, and its time constant is given",
    "tops cut at 0.05 of the amplitude",
    "a drift as large as the decay",
)
"""Other cases that take more than a second; all are slow."""


def shown(case):
    """A case as a parameter."""
    rendered = case.look.__module__.endswith("scenes") or case.group in RENDERED
    dear = case.mistake in DEAR or (rendered and case.mistake not in QUICK)
    marks = pytest.mark.slow if dear else ()
    return pytest.param(case, marks=marks, id=f"{case.group}: {case.mistake}")


@pytest.mark.sampled(4)
@pytest.mark.parametrize("case", [shown(case) for case in CASES])
def test_a_mistake_is_right_or_flagged_or_refused(case, tmp_path):
    outcome = looked(case, tmp_path)
    assert case.end in ENDS
    if case.end == "refused":
        assert outcome.refusal, f"not refused; {outcome.diagnostics}"
        assert re.search(case.words, outcome.refusal), outcome.refusal
        return
    assert not outcome.refusal, outcome.refusal
    codes = {diagnostic.code: diagnostic for diagnostic in outcome.diagnostics}
    if case.code:
        assert case.code in codes, f"{case.code} not told; {list(codes)}"
    if case.end == "flagged":
        assert codes[case.code].is_warning
    if case.end == "right":
        # a number within its standard errors, which five of them are sure to cover
        assert not outcome.ratio > 5.0
    # what is told fills its words with the numbers it carries, and its kind is listed
    for diagnostic in outcome.diagnostics:
        assert diagnostic.code in KINDS
        assert all(np.isfinite(value) for value in diagnostic.numbers.values())


def test_the_table_of_the_documentation_has_every_case():
    written = table.FILE.read_text(encoding="utf-8")
    for case in CASES:
        line = next(line for line in written.splitlines() if line.startswith(f"| {case.mistake} | {case.end} |"))
        assert f"`{case.code}`" in line or not case.code


@pytest.mark.slow
def test_the_table_of_the_documentation_is_what_comes_of_the_cases():
    numbers = re.compile(r"[-+]?\d+(\.\d+)?(e[-+]\d+)?")  # their last digits are the machine's own
    written = table.FILE.read_text(encoding="utf-8")
    assert numbers.sub("#", table.text(table.measured())) == numbers.sub("#", written)


def flags():
    """Every option of every command of the laboratory."""
    from typer.main import get_command

    from snapbeam.cli.app import app
    from snapbeam.lab.cli import COMMANDS

    commands = get_command(app).commands
    asked = (commands[name] for name in COMMANDS)
    return {flag for one in asked for option in one.params for flag in (*option.opts, *option.secondary_opts)}


@pytest.mark.parametrize("kind", KINDS.values(), ids=lambda kind: kind.code)
def test_a_diagnostic_names_its_way_out_by_options_that_exist(kind):
    named = set(re.findall(r"--[a-z]+(?:-[a-z]+)*", kind.says))
    assert named <= flags(), named - flags()
