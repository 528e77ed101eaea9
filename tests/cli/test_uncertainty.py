"""``snapbeam probability`` and ``snapbeam design``: files and pictures from one parameter file, and refusals."""

from __future__ import annotations

import json
import re

import pytest
import xarray as xr
from typer.testing import CliRunner

from snapbeam.cli.app import app

SYSTEM = """
extends = "paper"
[model]
modes = 1
[drive]
frequency_ratio = 0.02
[contact]
location = 0.3
[integration]
cycles = 1
[uncertainty]
"drive.velocity_amplitude" = {normal = 0.02, relative = true}
"""
PROBABILITY = """
[sweep]
"drive.velocity_amplitude" = [0.01, 0.0131, 0.016]
[probability]
half_width = 0.2
initial_runs = 16
"""
DESIGN = """
[design]
objectives = "drive.velocity_amplitude"
variables = {"drive.velocity_amplitude" = [0.005, 0.03]}
constraints = [{quantity = "snap", lower = 0.8}]
settings = {generations = 6, population = 6, samples = 16, validation_samples = 60}
"""


def run(tmp_path, text: str, *arguments: str):
    file = tmp_path / "question.toml"
    file.write_text(text, encoding="utf-8")
    return CliRunner().invoke(app, [arguments[0], str(file), *arguments[1:]])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("section", "words"),
    [
        pytest.param('side = "above"\n', "upper well (contact on side 'above')", marks=pytest.mark.slow),
        ('side = "below"\n[initial_state]\ninitial_well = "upper"\n', "upper well (initial_well = 'upper')"),
    ],
)
def test_probability_names_the_initial_well(tmp_path, section: str, words: str) -> None:
    text = (SYSTEM + PROBABILITY).replace("[integration]", section + "[integration]")
    result = run(tmp_path, text, "probability", "-o", str(tmp_path / "p.nc"), "--yes")
    assert result.exit_code == 0, result.output
    assert f"Runs begin in the {words}." in result.output


@pytest.mark.slow
def test_probability(tmp_path) -> None:
    target, picture = tmp_path / "p.nc", tmp_path / "p.png"
    result = run(tmp_path, SYSTEM + PROBABILITY, "probability", "-o", str(target), "--plot", str(picture), "--yes")
    assert result.exit_code == 0, result.output
    with xr.open_dataset(target, engine="h5netcdf") as dataset:
        snap = dataset["probability"].sel(outcome="snap").values
    assert snap[0] == 0.0 and 0.0 < snap[1] < 1.0 and snap[2] == 1.0
    assert picture.stat().st_size > 5_000 and "runs at 3 points" in result.output
    assert re.search(r"V = \S+: 0 \(0 to 0\.\d+\)", result.output)
    assert re.search(rf"V = \S+: {snap[1]:.4g} \(0\.\d+ to 0\.\d+\)", result.output)


@pytest.mark.slow
def test_design(tmp_path) -> None:
    target, picture, told = tmp_path / "d.nc", tmp_path / "d.png", tmp_path / "d.json"
    result = run(
        tmp_path, SYSTEM + DESIGN, "design", "-o", str(target), "--plot", str(picture), "--json", str(told), "--yes"
    )
    assert result.exit_code == 0, result.output
    with xr.open_dataset(target, engine="h5netcdf") as dataset:
        assert 0.012 < float(dataset["velocity_amplitude"][0]) < 0.0145
    assert "Runs begin in the lower well (contact on side 'below')." in result.output
    assert "constraints on validation samples: " in result.output and picture.stat().st_size > 5_000
    found = json.loads(told.read_text(encoding="utf-8"))
    assert found["estimated_cost"]["runs"] > 0 and found["designs"]["satisfied_snap"]


@pytest.mark.parametrize(
    ("command", "text", "words"),
    [
        ("probability", PROBABILITY, "no section [uncertainty]"),
        ("probability", SYSTEM + "[probability]\nhalf = 0.1\n", "half"),
        ("probability", SYSTEM + "[probability]\nhalf_width = 0.9\n", "half_width"),
        ("design", SYSTEM, "objectives"),
        ("design", SYSTEM + '[design]\nobjectives = "speed"\n', "variables"),
        ("design", SYSTEM + DESIGN.replace("lower", "least"), "least"),
        (
            "design",
            SYSTEM
            + '[design]\nobjectives = {quantity = "peak_force", mean = true}\nvariables = {"drive.velocity_amplitude" = [0.005, 0.03]}',
            "mean of a statistic is",
        ),
        (
            "design",
            SYSTEM + DESIGN.replace("lower", "mean"),
            "quantity, lower, upper, probability; limits hold for a share",
        ),
        ("design", "not toml", "TOML"),
    ],
)
def test_refusals(tmp_path, command: str, text: str, words: str) -> None:
    result = run(tmp_path, text, command)
    assert result.exit_code == 2 and words in result.output.replace("\n", " ")


@pytest.mark.parametrize(
    ("section", "words"),
    [
        ('"contact.gap" = {normal = "10 kg"}', "uncertainty.contact.gap: the unit 'kg' does not fit; must be in m"),
        ('"contact.gap" = {uniform = [1e-5, 2e-5]}', "uncertainty.contact.gap: half_width"),
        ("[probability]\nruns = 4\naxes = 3", "probability.axes: unknown; must be one of"),
        ("[probability]\nruns = 4\nhalf_width = 0.2", "probability.runs = 4: give either runs or half_width"),
    ],
)
def test_a_wrong_tolerance_or_question_is_named(tmp_path, section: str, words: str) -> None:
    file = tmp_path / "wrong.toml"
    file.write_text(SYSTEM + section)
    result = CliRunner().invoke(app, ["probability", str(file), "-y"])
    assert result.exit_code == 2 and words in " ".join(result.output.split())


def test_tolerances_have_the_units_of_their_parameters() -> None:
    from snapbeam.uncertainty.distributions import uncertainty_from_mapping

    given = {
        "beam.thickness": {"normal": "5 um"}, "beam.width": {"uniform": "2 %", "relative": True},
        "contact.gap": {"range": ["10 um", "0.03 mm"]}, "contact.stiffness": {"lognormal": "20 %"},
    }  # fmt: skip
    of = uncertainty_from_mapping(given).of
    assert of["beam.thickness"].standard_deviation == 5e-6 and of["beam.width"].half_width == 0.02
    assert (of["contact.gap"].low, of["contact.gap"].high, of["contact.stiffness"].sigma) == (1e-5, 3e-5, 0.2)


@pytest.mark.slow
def test_a_structure_of_matrices_is_designed_and_has_probabilities(tmp_path) -> None:
    """Its constants, which are no parameters of the table, refused the result after the computation."""
    text = """
[model]
mass = [[0.002]]
stiffness = [[-800.0]]
contact_shape = [1.0]
base_shape = [1.0]
nonlinear_stiffness = 5e8
well_amplitude = [-0.00126491106]
length_scale = 0.00126491106
damping_ratio = 0.02
[base_excitation]
type = "shock"
acceleration_g = 100
duration_ms = 5
[integration]
cycles = 4
[uncertainty]
acceleration_g = {normal = 0.1, relative = true}
[probability]
runs = 8
[design]
objectives = {quantity = "peak_midspan_displacement"}
variables = {damping_ratio = [0.01, 0.1]}
settings = {population = 6, generations = 1, samples = 8, validation_samples = 20}
"""
    designs = tmp_path / "designs.nc"
    result = run(tmp_path, text, "design", "-y", "-o", str(designs))
    assert result.exit_code == 0 and designs.exists(), result.output
    assert run(tmp_path, text, "probability", "-y", "-o", str(tmp_path / "p.nc")).exit_code == 0
