"""``snapbeam dynamics``: every verb writes its file and its picture; bad input is refused first."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

import snapbeam as sb
from snapbeam.cli.app import app
from snapbeam.util import diagnostics

BEAM = ["--modes", "1", "--damping-ratio", "0.05", "--frequency-ratio", "1.6", "--velocity-amplitude", "0.03"]
CASES = {
    "lifetimes": (["--initial-conditions", "4", "--cycles", "120", "--settling-cycles", "20"], "lifetime"),
    "bifurcation-diagram": (["--values", "0.02:0.04:3", "--transient", "40", "--periods", "8"], "midspan_displacement"),
    "lyapunov-spectrum": (["--periods", "40", "--transient", "10"], "exponent"),
    "poincare-section": (["--at", "impact", "--periods", "20"], "drive_phase"),
    "branch": (["--bounds", "0.02:0.05", "--max-points", "6"], "multiplier_real"),
    "basins": (["--amplitudes=-1.4:1.4:6", "--velocities=-0.6:0.6:5", "--states", "12"], "basin"),
    "edge": (["--periods", "25", "--horizon", "30"], "orbit_state"),
}


@pytest.mark.parametrize("options", [["--velocity-amplitude", "0.15:0.2:4"], ["--sweep", "beam.thickness=3e-4:4e-4:2"]])
@pytest.mark.parametrize("verb", ["hysteresis", "bifurcation-diagram", "branch"])
def test_a_range_beside_the_values_is_refused(verb: str, options: list[str], tmp_path) -> None:
    """The parameter and its values are stated by options of their own; another range would not be used."""
    result = CliRunner().invoke(app, ["dynamics", verb, *options, "-o", str(tmp_path / "out.nc")])
    assert result.exit_code == 2 and not list(tmp_path.iterdir())


@pytest.mark.sampled(3)
@pytest.mark.parametrize("verb", CASES)
def test_verbs_write_files_and_pictures(verb: str, tmp_path) -> None:
    options, variable = CASES[verb]
    file, picture = tmp_path / f"{verb}.nc", tmp_path / f"{verb}.png"
    arguments = ["dynamics", verb, *BEAM, *options, "-o", str(file), "--plot", str(picture)]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 0, result.output
    with xr.open_dataset(file, engine="h5netcdf") as dataset:
        assert variable in dataset
    assert picture.stat().st_size > 5_000
    assert "Written" in result.output
    assert "<" not in result.output and ">" not in result.output, "representations lose their brackets"


def test_bad_input_is_refused_first(tmp_path) -> None:
    runner = CliRunner()
    result = runner.invoke(app, ["dynamics", "branch", *BEAM, "--bounds", "0.05:0.02"])
    assert result.exit_code != 0
    result = runner.invoke(app, ["dynamics", "bifurcation-diagram", *BEAM, "-o", str(tmp_path / "none" / "d.nc")])
    assert result.exit_code != 0


@pytest.mark.parametrize(
    ("name", "suggested"),
    [
        ("section", "poincare-section"),
        ("poincare_section", "poincare-section"),
        ("diagram", "bifurcation-diagram"),
        ("bifurcation", "bifurcation-diagram"),
        ("exponents", "lyapunov-spectrum"),
        ("lyapunov", "lyapunov-spectrum"),
        ("lifetime", "lifetimes"),
        ("brnch", "branch"),
        ("edge_tracking", "edge"),
    ],
)
def test_a_near_miss_suggests_the_command(name: str, suggested: str) -> None:
    result = CliRunner().invoke(app, ["dynamics", name])
    assert result.exit_code == 2 and f"Did you mean '{suggested}'" in result.output


def test_a_command_and_its_function_have_one_name() -> None:
    from snapbeam.cli.dynamics import dynamics

    names = {command.name for command in dynamics.registered_commands}
    for function in ("poincare_section", "bifurcation_diagram", "lyapunov_spectrum"):
        assert hasattr(sb.dynamics, function) and function.replace("_", "-") in names
    assert "Did you mean" not in CliRunner().invoke(app, ["dynamics", "xyz"]).output


@pytest.mark.filterwarnings("default")
def test_undecided_states_are_reported(tmp_path) -> None:
    """The entropy is that of the decided states, with bounds; the warning and the unseen share are on the screen."""
    diagnostics._told.clear()
    grid = ["--amplitudes=-1.4:1.4:12", "--velocities=-0.6:0.6:10", "--states", "12", "--periods", "10"]
    result = CliRunner().invoke(app, ["dynamics", "basins", *BEAM, *grid, "-o", str(tmp_path / "b.nc")])
    assert result.exit_code == 0, result.output
    assert "over the decided states" in result.output and "basin entropy over all states" in result.output
    assert "% of the sampled region, at 95 % (12 states)" in result.output
    assert "are undecided after 10 periods" in result.output and "stopped: 10 periods (as given)" in result.output


def test_a_section_of_the_command_leaves_out_the_transient(tmp_path) -> None:
    result = CliRunner().invoke(
        app, ["dynamics", "poincare-section", *BEAM, "--periods", "20", "-o", str(tmp_path / "s.nc")]
    )
    assert "16 time constants" in result.output, result.output
    with xr.open_dataset(tmp_path / "s.nc", engine="h5netcdf") as dataset:
        assert float(dataset["midspan_displacement"].max() - dataset["midspan_displacement"].min()) < 1e-4


@pytest.mark.slow
def test_the_example_of_the_edge_is_driven(tmp_path) -> None:
    """Its orbit strikes the tip: one impact a period, one multiplier outside, far from the hilltop."""
    options = ["--modes", "1", "--damping-ratio", "0.05", "--frequency-ratio", "0.7", "--velocity-amplitude", "0.14"]
    text = CliRunner().invoke(app, ["dynamics", "edge", "--help"]).output.replace("\n", " ")
    assert all(option in text for option in options)
    result = CliRunner().invoke(app, ["dynamics", "edge", *options, "-o", str(tmp_path / "e.nc")])
    assert "settled on an orbit of period 1" in result.output, result.output
    with xr.open_dataset(tmp_path / "e.nc", engine="h5netcdf") as dataset:
        assert float(dataset["orbit_state"][0, 0]) < -0.4
        assert int((np.hypot(dataset["multiplier_real"], dataset["multiplier_imag"]) > 1.0).sum()) == 1
