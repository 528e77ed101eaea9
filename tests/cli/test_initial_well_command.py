"""The well that runs begin in: named by an option or a file, printed with every result and drawn in every figure."""

from __future__ import annotations

import json
import sys

import pytest
import xarray as xr
from typer.testing import CliRunner

from snapbeam.cli.app import app
from snapbeam.plot.style import caption

FILE = 'extends = "paper"\n[model]\nmodes = 1\n[integration]\ncycles = 8\n[contact]\nside = "{side}"\n'
COMMANDS = {
    "simulate": ("simulate", "-o", "out.nc"),
    "map": ("map", "--frequency-ratio", "0.7,1.3", "--velocity-amplitude", "0.1,0.3", "-o", "out.nc"),
    "threshold": ("threshold", "--frequency-ratio", "0.7", "--values", "0.1:0.4:4", "-o", "out.nc"),
}


@pytest.fixture
def cli(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def run(*args):
        monkeypatch.setattr(sys, "argv", ["snapbeam", *args])
        return CliRunner().invoke(app, args, catch_exceptions=False)

    return run


@pytest.mark.sampled(4)
@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize(
    ("side", "options", "well", "reason"),
    [
        ("below", (), "lower", "contact on side 'below'"),
        ("above", (), "upper", "contact on side 'above'"),
        ("below", ("--initial-well", "upper"), "upper", "initial_well = 'upper'"),
        ("above", ("--set", "initial_well=0"), "lower", "initial_well = 0"),
    ],
)
def test_commands_name_the_well(cli, tmp_path, command, side, options, well, reason):
    (tmp_path / "system.toml").write_text(FILE.format(side=side))
    name, *rest = COMMANDS[command]
    result = cli(name, "--config", "system.toml", *options, *rest)
    assert result.exit_code == 0, result.output
    assert f"in the {well} well ({reason})" in result.stdout
    with xr.open_dataset("out.nc") as dataset:
        assert (dataset.attrs["initial_well"], dataset.attrs["initial_well_reason"]) == (well, reason)
        assert f"from the {well} well" in caption(dataset)
        if command == "simulate":
            first = float(dataset["midspan_displacement"][0])
            assert (first > 0.0) == (well == "upper")


def test_a_point_of_a_map_begins_in_its_well(cli):
    assert cli(*COMMANDS["map"], "--modes", "1", "--cycles", "8", "--initial-well", "upper").exit_code == 0
    point = ("--from", "out.nc", "--point", "frequency_ratio=0.7,velocity_amplitude=0.1")
    assert cli("simulate", *point, "--json", "run.json").exit_code == 0
    with open("run.json", encoding="utf-8") as stream:
        assert json.load(stream)["summary"]["initial_well"] == "upper"


@pytest.mark.parametrize(
    ("args", "message"),
    [
        (("simulate", "--initial-well", "top"), "initial_well = 'top': must be 'lower', 'upper' or the index"),
        (("simulate", "--initial-well", "2"), "initial_well = 2: the system has 2 wells; must be 0, 1, 'lower'"),
        (("map", "--sweep", "initial_well=lower,upper"), "initial_well: cannot be an axis"),
    ],
)
def test_other_wells_are_refused(cli, args, message):
    result = cli(*args, "--modes", "1")
    assert result.exit_code == 2
    assert message in result.stderr
