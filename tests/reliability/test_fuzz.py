"""Calls that nobody should make, of every public function and command: refused, finite, or with a status."""

from __future__ import annotations

import json
import random
import subprocess
import sys
from pathlib import Path

import fuzz
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import snapbeam as sb
from snapbeam.model.state import checked_well
from snapbeam.util import validation as validate
from snapbeam.util.validation import InputError

CALLS = 2000


def test_new_functions_and_commands_are_included():
    """The list is made from what the package says is public, and from the program itself."""
    found = fuzz.public()
    for name in sb.__all__:
        value = getattr(sb, name)
        if callable(value) and not isinstance(value, type):
            assert f"snapbeam.{name}" in found
    assert {"map", "simulate", "threshold", "info", "plot"} <= set(fuzz.commands())


@pytest.mark.slow
def test_two_thousand_calls(tried, tmp_path):
    """In a process with little memory: none ends it, and every error is a refusal."""
    report = tmp_path / "report.json"
    subprocess.run([sys.executable, fuzz.__file__, str(CALLS), "1", str(report)], check=True)
    found = json.loads(report.read_text(encoding="utf-8"))
    wrong = {name: each for name, each in found["wrong"].items() if "over 10 s" not in name}
    tried("fuzzed calls", found["calls"])
    tried("fuzzed calls with a raw error", sum(each["times"] for each in wrong.values()))
    assert found["calls"] == CALLS
    assert wrong == {}


@pytest.mark.slow
def test_damaged_files_of_every_format(tried, tmp_path):
    """In a process of their own: none ends it, and every error is a refusal."""
    report = tmp_path / "report.json"
    script = Path(fuzz.__file__).with_name("damaged.py")
    subprocess.run([sys.executable, script, "100", "2", str(report)], check=True, stderr=subprocess.DEVNULL)
    found = json.loads(report.read_text(encoding="utf-8"))
    tried("damaged files", sum(found["files"].values()))
    assert sum(found["files"].values()) == 100 and len(found["files"]) >= 7
    assert found["wrong"] == {}


@pytest.mark.parametrize("wells", [0, 3, 1.5, np.zeros((2, 2, 3)), "2", None])
def test_class_handles_of_no_number_of_wells(wells):
    with pytest.raises(InputError, match="wells"):
        sb.plot.class_handles(wells=wells)


@pytest.mark.parametrize("well", [np.timedelta64(3, "s"), "9" * 5000, "1" * 10, True])
def test_a_start_in_no_well(well):
    with pytest.raises(InputError, match=r"well = .*must be 'lower', 'upper' or the index"):
        checked_well("well", well)


@pytest.mark.parametrize("datasets", [range(10**12), iter([1]), [None]])
def test_curves_that_are_none(datasets):
    with pytest.raises(InputError, match="datasets"):
        sb.plot.plot_bifurcation_curve(datasets)


NUMBERS = st.one_of(
    st.integers(), st.floats(), st.complex_numbers(), st.fractions(), st.booleans(), st.none(), st.text(max_size=5),
    st.binary(max_size=5), st.timedeltas(), st.decimals(), st.lists(st.floats(), max_size=3),
)  # fmt: skip
CHECKS = {
    "finite": lambda value: validate.finite("x", value),
    "positive": lambda value: validate.positive("x", value, "m"),
    "nonnegative": lambda value: validate.nonnegative("x", value),
    "within": lambda value: validate.within("x", value, 0.0, 1.0),
    "integer": lambda value: validate.integer("x", value, -5, 5),
    "flag": lambda value: validate.flag("x", value),
    "choice": lambda value: validate.choice("x", value, ("a", "b")),
    "finite_array": lambda value: validate.finite_array("x", value),
    "axis": lambda value: validate.axis("x", value, 0.0, 1.0),
    "file_path": lambda value: validate.file_path("x", value),
    "mapping": lambda value: validate.mapping("x", value),
}


@pytest.mark.slow
@pytest.mark.parametrize("check", list(CHECKS))
def test_every_check_refuses_or_returns(check):
    """Whatever is given: a value as promised, or a refusal that names the parameter."""

    @settings(max_examples=100, deadline=None, suppress_health_check=list(HealthCheck))
    @given(value=NUMBERS)
    def refused_or_not(value):
        try:
            CHECKS[check](value)
        except InputError as error:
            assert str(error).startswith("x")

    refused_or_not()


PARTS = (
    "Beam",
    "HertzContact",
    "Restitution",
    "Shaker",
    "Sine",
    "Integration",
    "Replicates",
    "State",
    "CheckpointOptions",
)


@pytest.mark.parametrize("name", PARTS)
def test_what_is_written_down_is_checked(name, tried):
    """The values that a system is made of, each with hostile values in turn: no raw error at all."""
    kind, draw = getattr(sb, name), random.Random(name)
    wrong = []
    for _ in range(120):
        given_ = fuzz.arguments(kind, draw)
        if said := fuzz.judged(kind, *given_):
            wrong.append((said, fuzz._short(given_)))
    tried("fuzzed calls", 120)
    assert wrong == []
