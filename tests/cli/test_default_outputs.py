"""A default output replaces a result of the same parameters, and no other."""

from __future__ import annotations

from pathlib import Path

import pytest
import xarray as xr
from typer.testing import CliRunner

import snapbeam as sb
from snapbeam.cli.app import _COMMANDS, app

SMALL = ("--modes", "1", "--cycles", "2", "--frequency-ratio", "1:2:3", "--quiet")
MAP = ("map", *SMALL, "--velocity-amplitude", "0.1:0.3:2")
OTHER = ("map", *SMALL, "--velocity-amplitude", "0.1:0.3:3")
SYSTEM = """
extends = "paper"
[drive]
frequency_ratio = 0.02
[uncertainty]
"drive.velocity_amplitude" = {normal = 0.02, relative = true}
"""
COMMANDS = {
    "map.nc": "map",
    "threshold.nc": "threshold",
    "lifetimes.nc": "dynamics lifetimes",
    "bifurcation_diagram.nc": "dynamics bifurcation-diagram",
    "hysteresis.nc": "dynamics hysteresis",
    "backbone_curve.nc": "dynamics backbone-curve",
    "lyapunov_spectrum.nc": "dynamics lyapunov-spectrum",
    "poincare_section.nc": "dynamics poincare-section",
    "branch.nc": "dynamics branch",
    "bifurcation_curve.nc": "dynamics bifurcation-curve",
    "manifold.nc": "dynamics manifold",
    "basins.nc": "dynamics basins",
    "edge.nc": "dynamics edge",
    "design.nc": "design question.toml",
    "gradient.nc": "gradient",
    "probability.nc": "probability question.toml",
}
REFUSED = "exists, and its parameters are not those of this command"


@pytest.fixture
def run(tmp_path, monkeypatch):
    """Run a command in an empty folder; returns its status and what it printed."""
    monkeypatch.chdir(tmp_path)

    def command(*arguments):
        result = CliRunner().invoke(app, arguments)
        return result.exit_code, result.output

    return command


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_keeps_another_result(run, name):
    sb.write_netcdf(xr.Dataset({"gap": ("time", [0.0])}), name)
    Path("question.toml").write_text(SYSTEM, encoding="utf-8")
    code, said = run(*COMMANDS[name].split())
    assert code == 2 and REFUSED in said and "-o" in said and "--force" in said
    assert "gap" in xr.load_dataset(name)


def test_every_default_output_is_in_the_list():
    """The defaults of the commands of the core, found in them."""
    from typer.main import get_command

    def defaults(command):
        for each in getattr(command, "commands", {}).values():
            yield from defaults(each)
        for option in getattr(command, "params", ()):
            if option.name == "output" and isinstance(option.default, Path):
                yield option.default.name

    commands = get_command(app).commands
    assert {name for command in _COMMANDS for name in defaults(commands[command])} == set(COMMANDS)


@pytest.mark.slow
def test_a_result_of_the_same_parameters_is_replaced(run):
    """However they are given, and whatever is drawn; another file is named, or forced."""
    assert run(*MAP) == (0, "")
    assert run(*MAP, "--plot", "map.png", "--threads", "1")[0] == 0
    Path("system.toml").write_text(
        'extends = "paper"\n[model]\nmodes = 1\n[integration]\ncycles = 2\n', encoding="utf-8"
    )
    axes = MAP[5:]
    assert run("map", "--config", "system.toml", *axes)[0] == 0
    code, said = run(*OTHER)
    assert code == 2 and REFUSED in said
    assert xr.load_dataset("map.nc").sizes["velocity_amplitude"] == 2
    assert run(*OTHER, "-o", "other.nc")[0] == 0
    assert run(*OTHER, "-o", "map.nc")[0] == 0
    assert run(*MAP)[0] == 2
    assert run(*MAP, "--force")[0] == 0
    assert run(*MAP)[0] == 0


@pytest.mark.slow
def test_a_checkpoint_alone(run):
    """The parameters that are compared are those of the checkpoint: the command is the same for any."""
    assert run(*MAP, "--checkpoint", "part.store")[0] == 0
    assert run("map", "--checkpoint", "part.store", "--quiet")[0] == 0
    assert run(*OTHER, "--checkpoint", "other.store", "-o", "other.nc")[0] == 0
    code, said = run("map", "--checkpoint", "other.store", "--quiet")
    assert code == 2 and REFUSED in said
    assert xr.load_dataset("map.nc").sizes["velocity_amplitude"] == 2


def test_an_input_file_that_changed(run):
    """The command is the same, the content of its file is not."""
    command = ("dynamics", "backbone-curve", "--config", "a.toml", "--max-points", "3", "--quiet")
    Path("a.toml").write_text('extends = "paper"\n[model]\nmodes = 1\n', encoding="utf-8")
    assert run(*command)[0] == 0 and run(*command)[0] == 0
    Path("a.toml").write_text('extends = "paper"\n[model]\nmodes = 2\n', encoding="utf-8")
    code, said = run(*command)
    assert code == 2 and REFUSED in said
