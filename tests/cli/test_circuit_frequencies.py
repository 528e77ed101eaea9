"""Frequencies with open and with shorted loads, against the poles with an extreme resistance."""

from __future__ import annotations

import json

import numpy as np
import pytest
from typer.testing import CliRunner

import snapbeam as sb
from snapbeam.cli.app import app

FILE = """
[beam]
length = 0.3
thickness = 0.4e-3
width = 0.02
density = 7850.0
young_modulus = 200e9
buckling_level = 0.7e-3
[model]
modes = 3
damping_ratio = 1e-6
[[harvester]]
type = "piezo"
moment_per_volt = -1.66e-4
capacitance = 7.665e-7
resistance = 1e4
[[harvester]]
type = "coil"
force_factor = 2.0
resistance = 100.0
inductance = 0.5
location = 0.3
"""


def test_they_are_the_poles_of_circuits_without_loss(tmp_path) -> None:
    file, found = tmp_path / "harvester.toml", tmp_path / "found.json"
    file.write_text(FILE)
    result = CliRunner().invoke(app, ["frequencies", "-c", str(file), "--count", "3", "--json", str(found)])
    assert result.exit_code == 0 and "shorted (Hz)" in result.output
    wells = json.loads(found.read_text())["circuits"]
    assert list(wells) == ["lower well", "upper well"]
    system = sb.System.load(file)
    for well, name in zip(("lower", "upper"), wells, strict=True):
        assert [wells[name][each] for each in ("open", "short")] == [
            pytest.approx(each) for each in system.circuit_frequencies(well)
        ]
        for kind, ohms in (("open", 1e8), ("short", 1e-6)):
            poles = system.replace(**{f"harvester{n}.resistance": ohms for n in ("", ".2")}).poles(well)
            moving = np.abs(poles[(poles.imag > 1.0) & (np.abs(poles.real) < 1e-2 * np.abs(poles))]) / (2.0 * np.pi)
            assert wells[name][kind] == pytest.approx(np.sort(moving), rel=1e-6)
    opened, short = system.circuit_frequencies()
    assert not np.allclose(opened, short, rtol=1e-4)


def test_no_table_without_a_harvester() -> None:
    result = CliRunner().invoke(app, ["frequencies", "--axial-load", "0"])
    assert result.exit_code == 0 and "shorted" not in result.output
