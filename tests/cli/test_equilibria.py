"""``snapbeam equilibria``."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from snapbeam.cli.app import app


def run(*arguments: object):
    return CliRunner().invoke(app, [str(each) for each in arguments])


def test_every_equilibrium() -> None:
    answer = run("equilibria", "--midspan-amplitude", 1e-5, "--modes", 8)
    assert answer.exit_code == 0, answer.output
    assert answer.output.count("well ") >= 1
    assert "lower well:" in answer.output
    assert "barrier" in answer.output
    assert "monostable" in run("equilibria", "--midspan-amplitude", 2e-4, "--modes", 8).output


def test_what_explains_measured_wells() -> None:
    answer = run("equilibria", "--lower-frequency", 81.3, "--upper-frequency", 80.5, "--json", "-")
    assert answer.exit_code == 0, answer.output
    found = json.loads(answer.output)
    assert found["frequencies"][0][0] == pytest.approx(81.3, rel=1e-6)
    assert found["imperfection"]["midspan_amplitude"] == pytest.approx(-1.17e-6, abs=0.01e-6)
    refused = run("equilibria", "--lower-frequency", 81.3)
    assert refused.exit_code != 0
    assert "give both" in refused.output
