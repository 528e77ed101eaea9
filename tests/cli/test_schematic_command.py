"""``snapbeam schematic``, and extended models in a parameter file."""

from __future__ import annotations

import pytest
from typer.testing import CliRunner

from snapbeam.cli.app import app
from snapbeam.model.parameter_file import config_from_mapping, load_config
from snapbeam.util.validation import InputError


def run(*arguments: object):
    return CliRunner().invoke(app, [str(each) for each in arguments])


def test_draws_what_was_asked_for(tmp_path) -> None:
    picture = tmp_path / "system.png"
    answer = run(
        "schematic", "-o", picture, "--modes", 3, "--hunt-crossley-restitution", 0.6, "--hunt-crossley-speed", 0.05,
        "--striker-mass", 0.02, "--striker-suspension-stiffness", 700, "--striker-suspension-damping", 0.7,
    )  # fmt: skip
    assert answer.exit_code == 0, answer.output
    assert picture.read_bytes()[:4] == b"\x89PNG"
    assert "hunt_crossley" in answer.output
    assert "mass = 0.02" in answer.output


def test_refused_by_name(tmp_path) -> None:
    answer = run("schematic", "-o", tmp_path / "a.png", "--striker-suspension-stiffness", 700)
    assert answer.exit_code != 0
    assert "give its mass" in " ".join(answer.output.split())


def test_extended_models_in_a_parameter_file(tmp_path) -> None:
    file = tmp_path / "world.toml"
    file.write_text(
        'extends = "paper"\n[contact]\ntype = "kelvin_voigt"\nlinear_stiffness = 2e6\nlinear_damping = 20.0\nmass = 0.02\n[drive]\ntype = "burst"\n'
        "frequency_ratio = 1.2\nvelocity_amplitude = 0.2\nduration_cycles = 5.0\n",
        encoding="utf-8",
    )
    system = load_config(file).system
    assert system.get("contact.linear_damping") == 20.0
    assert system.get("drive.duration_cycles") == 5.0
    assert system.replace(**{"drive.ramp_up_cycles": 2.0}).get("drive.ramp_up_cycles") == 2.0
    lossy = config_from_mapping({"extends": "paper", "contact": {"restitution": 0.5, "speed": 0.05}}).system
    assert lossy.contact_law.restitution(0.05) == pytest.approx(0.5, abs=1e-12)
    assert lossy.contact_law.stiffness == 4e8
    for wrong, words in (
        ({"restitution": 0.5}, "restitution and speed belong together"),
        ({"restitution": 0.5, "speed": 0.05, "damping_factor": 1.0}, "give no other"),
    ):
        with pytest.raises(InputError, match=words):
            config_from_mapping({"extends": "paper", "contact": wrong})
