"""``snapbeam dynamics``: every verb writes its file and its picture; bad input is refused first."""

from __future__ import annotations

import pytest
import xarray as xr
from typer.testing import CliRunner

from snapbeam.cli.app import app

BEAM = ["--modes", "1", "--damping-ratio", "0.05", "--frequency-ratio", "1.6", "--velocity-amplitude", "0.03"]
CASES = {
    "lifetimes": (["--initial-conditions", "4", "--cycles", "120", "--settling-cycles", "20"], "lifetime"),
    "diagram": (["--values", "0.02:0.04:3", "--transient", "40", "--periods", "8"], "midspan_displacement"),
    "exponents": (["--periods", "40", "--transient", "10"], "exponent"),
    "section": (["--at", "impact", "--periods", "20"], "drive_phase"),
    "branch": (["--bounds", "0.02:0.05", "--max-points", "6"], "multiplier_real"),
    "basins": (["--amplitudes=-1.4:1.4:6", "--velocities=-0.6:0.6:5", "--states", "12"], "basin"),
    "edge": (["--periods", "25", "--horizon", "30"], "orbit_state"),
}


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


def test_bad_input_is_refused_first(tmp_path) -> None:
    runner = CliRunner()
    result = runner.invoke(app, ["dynamics", "branch", *BEAM, "--bounds", "0.05:0.02"])
    assert result.exit_code != 0
    result = runner.invoke(app, ["dynamics", "diagram", *BEAM, "-o", str(tmp_path / "none" / "d.nc")])
    assert result.exit_code != 0
