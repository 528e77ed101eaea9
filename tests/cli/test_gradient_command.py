"""``snapbeam gradient``: derivatives per unit as given, statements in place of numbers, files, a figure, refusals."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pandas as pd
import pytest
import xarray as xr
from typer.testing import CliRunner

import snapbeam as sb
from snapbeam.cli.app import app
from snapbeam.model.parameter_file import load_config
from snapbeam.util import diagnostics

SYSTEM = """
extends = "paper"
[model]
modes = 1
[drive]
frequency_hz = 60
velocity_m_s = "20 mm/s"
[contact]
location_m = "70 mm"
gap = "2 um"
[integration]
cycles = 3
"""
NAMES = ("velocity_m_s", "gap", "frequency_hz", "beam.thickness")
PAGE = Path(__file__).parents[2] / "docs" / "design.md"


@pytest.fixture
def run(tmp_path, monkeypatch):
    """Run the command on a file in an empty folder; returns its status and what it printed."""
    monkeypatch.chdir(tmp_path)
    Path("system.toml").write_text(SYSTEM, encoding="utf-8")

    def command(*words: str) -> tuple[int, str]:
        result = CliRunner().invoke(app, ["gradient", "system.toml", *words])
        return result.exit_code, result.output

    return command


def test_derivatives_are_per_unit_as_given(run) -> None:
    """Per mm/s and um of a text, per Hz of a number; else per SI unit: in the table and in every file."""
    words = ("--parameters", ",".join(NAMES), "--statistic", "peak_force,impacts,last_zero_crossing")
    code, said = run(*words, "--json", "told.json")
    assert code == 0, said
    system = load_config("system.toml").system
    si = sb.uncertainty.gradient(system, "peak_force", NAMES, integration=sb.Integration(cycles=3))
    wanted = si["derivative"].values * (1e-3, 1e-6, 1.0, 1.0)
    found = xr.load_dataset("gradient.nc")
    assert found["derivative"].sel(statistic="peak_force").values == pytest.approx(wanted)
    assert found["unit"].values.tolist() == ["mm/s", "um", "Hz", "m"]
    assert found["nominal_value"].values == pytest.approx([20.0, 2.0, 60.0, 4e-4])
    for name, slope, unit in zip(NAMES, wanted, found["unit"].values, strict=True):
        row = re.search(
            rf"^peak_force +\S*{re.escape(name)} +(\S+) +N per (\S+) +(\S+) +(\w+) +(\S+)$", said, re.MULTILINE
        )
        assert row is not None, said
        assert float(row[1]) == pytest.approx(slope, rel=1e-4) and row[2] == unit and row[4] == "exact"
        assert float(row[3]) < 1e-4 and float(row[5]) > 0.0
    assert "impacts: is a class or a count, which changes by jumps, so that it has no derivative" in said
    assert "last_zero_crossing: jumps where a crossing appears or vanishes" in said
    told = json.loads(Path("told.json").read_text(encoding="utf-8"))
    assert told["results"]["derivative"][0] == pytest.approx(wanted) and told["results"]["derivative"][1] == [None] * 4

    assert run(*words, "-o", "table.csv", "--plot", "figure.svg")[0] == 0
    table = pd.read_csv("table.csv", keep_default_na=False)
    first = table[table["statistic"] == "peak_force"]
    assert first["derivative"].astype(float).to_numpy() == pytest.approx(wanted)
    assert first["unit"].tolist() == ["mm/s", "um", "Hz", "m"] and set(first["statistic_unit"]) == {"N"}
    assert set(table.loc[table["statistic"] == "impacts", "no_derivative"]) == {found["no_derivative"].values[1]}
    assert run(*words, "-o", "table.csv")[0] == 0, "a table of the command is replaced"
    assert run(*words, "-o", "table.json")[0] == 0
    assert json.loads(Path("table.json").read_text(encoding="utf-8"))["unit"] == ["mm/s", "um", "Hz", "m"]
    Path("other.csv").write_text("time,gap\n0,1\n", encoding="utf-8")
    code, said = run(*words, "-o", "other.csv")
    assert code == 2 and "other.csv" in said and Path("other.csv").read_text(encoding="utf-8").startswith("time")


def test_options_override_the_file_and_the_unit_of_its_text(run) -> None:
    """A value of an option is in the unit of the parameter; those beside it keep the unit of the file."""
    words = ("--statistic", "impulse", "--parameters", "velocity_m_s,gap")
    assert run(*words, "--velocity-m-s", "0.025", "--cycles", "2")[0] == 0
    found = xr.load_dataset("gradient.nc")
    assert found["unit"].values.tolist() == ["m/s", "um"] and found["nominal_value"].values == pytest.approx(
        [0.025, 2.0]
    )


def test_the_figure_of_the_file_is_that_of_the_command(run) -> None:
    code, said = run(
        "--parameters", "gap,location", "--statistic", "peak_force,striker_work", "--plot", "one.png", "--cycles", "2"
    )
    assert code == 0 and Path("one.png").stat().st_size > 5_000, said
    for more in ([], ["--variable", "striker_work"]):
        result = CliRunner().invoke(app, ["plot", "gradient.nc", "-o", "two.png", *more])
        assert result.exit_code == 0, result.output
    refused = CliRunner().invoke(app, ["plot", "gradient.nc", "-o", "two.png", "--variable", "impacts"])
    assert refused.exit_code == 2 and "choose one of elasticity, peak_force, striker_work" in refused.output


@pytest.mark.filterwarnings("default")
def test_a_useless_derivative_has_a_warning(run) -> None:
    diagnostics._told.clear()
    chaotic = ("--frequency-ratio", "1.2", "--velocity-amplitude", "0.3", "--damping-ratio", "0.005", "--cycles", "60")
    code, said = run(
        *chaotic, "--parameters", "velocity_amplitude", "--statistic", "striker_work", "--json", "told.json"
    )
    assert code == 0 and "the motion is chaotic" in " ".join(said.split())
    assert "chaotic" in json.loads(Path("told.json").read_text(encoding="utf-8"))["notes"][0]
    growth = xr.load_dataset("gradient.nc")["growth"].item()
    assert growth > 1e3 and f"{growth:.3g}" in said


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ((), "parameters (--parameters): must name one or more of beam.length"),
        (
            ("--parameters", "gap", "--statistic", "impacts,response_class"),
            "quantity = response_class: is a class or a count",
        ),
        (("--parameters", "gap", "--statistic", "force"), "must be one of min_displacement"),
        (("--parameters", "gap", "--statistic", "peak_force,peak_force"), "must be different statistics"),
        (("--parameters", "drive.phase"), "drive.phase = 0: must not be 0"),
        (("--parameters", "model.modes"), "must be a number"),
        (("--parameters", "velocity_m_s,drive.velocity_m_s"), "must be different names"),
        (("--parameters", "gab"), "gab"),
        (("-o", "gradient.txt"), "must end in .nc or .csv or .json"),
    ],
)
def test_refusals(run, words: tuple[str, ...], message: str) -> None:
    code, said = run(*words)
    assert code == 2 and message in " ".join(said.split()), said
    assert sorted(path.name for path in Path().iterdir()) == ["system.toml"]


def test_the_page_shows_what_the_command_prints(run) -> None:
    """The file, the command and its output on the page on uncertainty."""
    text = PAGE.read_text(encoding="utf-8")
    file = re.search(r"```toml\n# struck\.toml\n(.*?)```", text, re.DOTALL)
    shown = re.search(r"```\nsnapbeam gradient (.*?)\n```\n\n```\n(.*?)```", text, re.DOTALL)
    assert file is not None and shown is not None
    Path("struck.toml").write_text(file[1], encoding="utf-8")
    result = CliRunner().invoke(app, ["gradient", *shown[1].replace("\\\n", " ").split()])
    assert result.exit_code == 0, result.output
    printed = [line for line in result.stdout.splitlines() if not line.startswith("Written:")]
    assert printed == shown[2].splitlines()


def test_commands_on_the_file_of_a_structure_of_matrices(tmp_path, monkeypatch) -> None:
    """The file is an argument or --config; messages name what a structure without a beam has."""
    monkeypatch.chdir(tmp_path)
    model = sb.ReducedModel.from_matrices(
        [[2e-3]], [[-800.0]], contact_shape=[1.0], base_shape=[1.0], nonlinear_stiffness=5e8, well_amplitude=[-1.26491106e-3],
        length_scale=1.26491106e-3, damping_ratio=0.02
    )  # fmt: skip
    shock = sb.BaseExcitation(motion=sb.Shock(acceleration_g=50.0, duration_ms=5.0))
    sb.System(model, base_excitation=shock).save("c.toml")

    def say(*words: str) -> tuple[int, str]:
        result = CliRunner().invoke(app, [*words])
        return result.exit_code, " ".join(result.output.split())

    code, said = say("gradient", "-c", "c.toml", "--cycles", "2", "--parameters", "acceleration_g")
    assert code == 0 and "b per g" in said, said
    code, said = say("gradient", "-c", "c.toml", "-o", "b.nc")
    assert code == 2 and "one or more of model.damping_ratio, base_excitation.acceleration_g" in said
    assert say("gradient", "c.toml", "-c", "c.toml") == (2, "error: FILE = 'c.toml' with --config: give one of the two")
    code, said = say("equilibria", "-c", "c.toml", "--over", "thickness=1:2")
    assert code == 2 and "it has none, since it has no beam" in said
    code, said = say("info", "c.toml")
    assert code == 2 and "is a parameter file, not a result" in said
