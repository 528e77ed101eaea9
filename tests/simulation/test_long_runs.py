"""Runs that may take over a minute say so before they begin."""

from __future__ import annotations

import subprocess
import sys
import warnings

import pytest

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.simulation.simulate import prepared
from snapbeam.solver.step_size import long_run
from snapbeam.util.diagnostics import DiagnosticWarning


def announced(
    stiffness=default_values.CONTACT.stiffness, damping_ratio=0.005, frequency_ratio=1.2, **integration
):
    """Warnings of a run that is prepared and not begun."""
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=1, damping_ratio=damping_ratio)
    shaker = sb.Shaker(frequency_ratio=frequency_ratio, velocity_amplitude=0.18)
    system = sb.System(model, contacts=[sb.Contact(sb.HertzContact(stiffness), shaker)])
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        run = prepared(system, sb.Integration(**integration), None)
    words = [str(each.message) for each in said if each.category is DiagnosticWarning]
    return [text for text in words if text.startswith("the run has")], run


@pytest.mark.parametrize(
    "given",
    [
        {"stiffness": 3e27, "cycles": 2},
        {"stiffness": 1e20, "cycles": 400},
        {"step": 1e-9, "cycles": 40},
        {"stiffness": 1e20, "frequency_ratio": 1e-3, "cycles": 1},
    ],
    ids=["stiff", "many cycles", "short steps", "slow drive"],
)
def test_a_long_run_is_announced(given):
    (text,), run = announced(**given)
    steps = float(run.ensemble.runs["end"][0]) / 2**20
    assert f"{steps:.3g} steps" in text and ("minutes" in text or "hours" in text)


def test_a_short_run_is_not_announced():
    assert announced(cycles=50)[0] == [] and announced(stiffness=1e20, cycles=2)[0] == []


def test_the_bound_grows_with_steps_and_modes():
    assert long_run(1, 1e-5, 1e6, "") == [] and long_run(500, 1e-5, 1e6, "") == []
    assert long_run(1, 1e-5, 3e8, "")[0].numbers["seconds"] > 60.0
    assert long_run(500, 1e-5, 3e6, "")[0].numbers["seconds"] > 60.0
    assert not long_run(1, 1e-5, 1e6, "") and long_run(1, 1e-5, float("inf"), "")


def test_the_command_says_it_before_the_run(tmp_path):
    words = ["simulate", "--modes", "1", "--cycles", "50000", "--contact-stiffness", "1e15", "-o", "a.nc"]
    with subprocess.Popen(
        [sys.executable, "-m", "snapbeam", *words], cwd=tmp_path, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stderr is not None
        try:
            lines = iter(process.stderr.readline, "")
            assert any("note: the run has" in line for line in lines), (
                "the run ended, or began, without a word"
            )
        finally:
            process.kill()
