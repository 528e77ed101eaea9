"""Files that were damaged, or made to do damage: refused by name, at once, and nothing of them is run."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from small_map import swept
from typer.testing import CliRunner

import snapbeam as sb
from snapbeam.cli.app import app
from snapbeam.model import default_values
from snapbeam.util.netcdf import read_netcdf


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    folder = tmp_path_factory.mktemp("written")
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=1)
    system = sb.System(
        model, contacts=[sb.Contact(default_values.CONTACT, sb.Shaker(frequency_ratio=1.21, velocity_amplitude=0.1))]
    )
    sb.simulate(system, sb.Integration(cycles=2)).save(folder / "run.nc")
    swept(model, default_values.CONTACT, frequency_ratio=[1.0, 1.5], velocity_amplitude=[0.1, 0.2], cycles=5).to_netcdf(
        folder / "map.nc", engine="h5netcdf"
    )
    return folder


def test_a_damaged_netcdf_file_is_refused_or_read(written, tmp_path):
    """Forty bytes in other places each time: never an error of another kind."""
    rng, refused = np.random.default_rng(1), 0
    whole = (written / "run.nc").read_bytes()
    for number in range(40):
        spoiled = bytearray(whole)
        for at in rng.integers(0, len(spoiled), 40):
            spoiled[at] ^= 255
        path = tmp_path / f"{number}.nc"
        path.write_bytes(spoiled)
        try:
            sb.load(path)
        except sb.InputError as error:
            assert str(path) in str(error)
            refused += 1
    assert refused > 20


@pytest.mark.parametrize("command", [["info"], ["plot", "-o", "out.png"]])
def test_commands_say_it_in_a_line(written, tmp_path, monkeypatch, command):
    monkeypatch.chdir(tmp_path)
    whole = (written / "map.nc").read_bytes()
    (tmp_path / "half.nc").write_bytes(whole[: len(whole) // 2])
    said = CliRunner().invoke(app, [command[0], "half.nc", *command[1:]])
    assert said.exit_code == 2
    assert isinstance(said.exception, SystemExit)
    assert "half.nc" in said.output and "damaged" in said.output
    assert not (tmp_path / "out.png").exists()


@pytest.mark.sampled(2)
@pytest.mark.parametrize("text", ["[" * 100_000, '{"a": ' * 50_000, "nothing", "[1]"])
def test_a_description_that_is_none(written, tmp_path, text):
    with xr.open_dataset(written / "map.nc", engine="h5netcdf") as ds:
        ds.load().assign_attrs(system=text).to_netcdf(tmp_path / "m.nc", engine="h5netcdf")
    said = CliRunner().invoke(app, ["map", "--from", str(tmp_path / "m.nc")])
    assert said.exit_code == 2 and isinstance(said.exception, SystemExit)
    assert "its description is damaged" in " ".join(said.output.split())


def test_no_such_file(tmp_path):
    with pytest.raises(sb.InputError, match=r"drive = .*no such file"):
        read_netcdf(tmp_path / "none.nc", "drive")
