"""Units in pairs of a contact, in limits of a design; free motion of a driven system."""

from __future__ import annotations

import pytest
import xarray as xr
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
buckling_level = "0.4 mm"
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


PROBLEM = """
extends = "stop.toml"
[integration]
cycles = 6
[uncertainty]
"model.damping_ratio" = {lognormal = 0.2}
[design]
objectives = "contact.gap"
variables = {"contact.gap" = ["0.1 mm", "0.6 mm"]}
constraints = [{quantity = "max_midspan_displacement", upper = %s}]
settings = {generations = 2, population = 6, samples = 8, validation_samples = 20}
"""


@pytest.mark.slow
def test_limits_of_a_statistic_over_the_buckling_level_have_units(tmp_path) -> None:
    (tmp_path / "stop.toml").write_text(FILE.format(second="70e9"))
    found = []
    for limit in ('"440 um"', "1.1"):  # b is 0.4 mm
        (tmp_path / "design.toml").write_text(PROBLEM % limit)
        out = tmp_path / "design.nc"
        result = CliRunner().invoke(app, ["design", str(tmp_path / "design.toml"), "-o", str(out), "--yes", "--force"])
        assert result.exit_code == 0, result.output
        with xr.open_dataset(out, engine="h5netcdf") as dataset:
            found.append(dataset[["tried_striker_gap", "tried_distance_max_midspan_displacement"]].load())
    assert found[0].tried_striker_gap.min() >= 1e-4 and found[0].tried_striker_gap.max() <= 6e-4
    assert found[0].equals(found[1])
    with pytest.raises(InputError, match="both of lower and upper a unit, or none"):
        Constraint(quantity="max_midspan_displacement", lower="0.1 mm", upper=1.0)


def test_a_figure_without_an_axis_is_refused_before_any_run(tmp_path) -> None:
    (tmp_path / "stop.toml").write_text(FILE.format(second="70e9"))
    (tmp_path / "p.toml").write_text('extends = "stop.toml"\n[uncertainty]\n"model.damping_ratio" = {lognormal = 0.2}')
    command = ["probability", str(tmp_path / "p.toml"), "-o", str(tmp_path / "p.nc"), "--plot", str(tmp_path / "p.png")]
    result = CliRunner().invoke(app, command)
    assert result.exit_code == 2 and "drawn over one or two axes" in result.output, result.output
    assert "runs" not in result.output


def test_curves_over_a_labelled_part_of_a_stored_map(tmp_path) -> None:
    file, stored = tmp_path / "stop.toml", tmp_path / "map.nc"
    file.write_text(FILE.format(second="70e9").replace("location = 0.5", 'location = 0.5\nlabel = "upper stop"'))
    command = ["map", "-c", str(file), "--cycles", "4", "--sweep", "contact.upper stop.gap=0.2mm,0.3mm,0.4mm"]
    result = CliRunner().invoke(app, [*command, "--sweep", "base_excitation.amplitude_g=1,2", "-o", str(stored)])
    assert result.exit_code == 0, result.output
    command = ["plot", str(stored), "--variable", "peak_force", "-o", str(tmp_path / "f.png"), "--over"]
    for name, status in (("contact.upper stop.gap", 0), ("contact.lower.gap", 2)):
        result = CliRunner().invoke(app, [*command, name])
        assert result.exit_code == status, result.output


def test_an_axis_is_named_by_its_last_part() -> None:
    """A drive has an acceleration too, but the axis of the file is that of the base."""
    import xarray as xr

    from snapbeam.cli.parameter_options import coordinate_on_axis

    own = {
        "frequency_ratio": "drive.frequency_ratio",
        "base_excitation_acceleration_g": "base_excitation.acceleration_g",
    }
    dataset = xr.Dataset(coords={name: (name, [1.0, 2.0], {"parameter": full}) for name, full in own.items()})
    assert coordinate_on_axis(dataset, "at", "acceleration_g=2g") == ("base_excitation_acceleration_g", 2.0)
