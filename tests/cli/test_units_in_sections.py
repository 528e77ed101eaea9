"""Units in pairs of a contact, in limits of a design; free motion of a driven system."""

from __future__ import annotations

import pytest
from typer.testing import CliRunner

import snapbeam as sb
from snapbeam.cli.app import app
from snapbeam.uncertainty import Constraint
from snapbeam.util.validation import InputError

FILE = """
[beam]
length = "120 mm"
thickness = "0.3 mm"
width = "10 mm"
density = "7.85 g/cm^3"
young_modulus = "200 GPa"
buckling_level = "0.6 mm"
[model]
modes = 2
damping_ratio = 0.02
[contact]
radius = "3 mm"
young_modulus = ["200 GPa", {second}]
poisson_ratio = [0.3, 0.3]
location = 0.5
gap = "0.3 mm"
[base_excitation]
type = "acceleration_sine"
frequency_hz = 40.0
amplitude_g = 1.0
"""


def test_moduli_of_a_pair_have_units(tmp_path) -> None:
    file = tmp_path / "stop.toml"
    file.write_text(FILE.format(second="70e9"))
    law = sb.HertzContact.from_materials(3e-3, (200e9, 70e9), (0.3, 0.3))
    assert sb.System.load(file).get("contact.stiffness") == pytest.approx(law.stiffness)
    file.write_text(FILE.format(second='"70 mm"'))
    with pytest.raises(InputError, match="70 mm"):
        sb.System.load(file)


def test_free_motion_of_a_driven_system(tmp_path) -> None:
    file = tmp_path / "stop.toml"
    file.write_text(FILE.format(second="70e9"))
    curve = tmp_path / "curve.nc"
    command = ["dynamics", "backbone-curve", "-c", str(file), "--max-points", "3", "-o", str(curve)]
    result = CliRunner().invoke(app, command)
    assert result.exit_code == 0, result.output
    assert "Free motion, without base_excitation, contact" in result.output


def test_limits_of_a_design_have_units() -> None:
    assert Constraint(quantity="peak_force", upper="5 mN").upper == pytest.approx(5e-3)
    for text in ("2 mm", "much"):
        with pytest.raises(InputError, match=r"of peak_force|finite number"):
            Constraint(quantity="peak_force", upper=text)
