"""The command line: help, errors, results."""

from __future__ import annotations

import re
import sys

import pytest
import xarray as xr
from typer.testing import CliRunner

from snapbeam._version import __version__
from snapbeam.cli.app import app

MAP = ("map", "--modes", "1", "--cycles", "8", "--frequency-ratio", "0.3:1.5:4", "--velocity-amplitude", "0.05:0.6:3")


@pytest.fixture
def cli(tmp_path, monkeypatch):
    """Run the program in an empty folder."""
    monkeypatch.chdir(tmp_path)
    runner = CliRunner()

    def run(*args):
        monkeypatch.setattr(sys, "argv", ["/opt/env/bin/snapbeam", *args])
        return runner.invoke(app, args, catch_exceptions=False)

    return run


def test_version_and_help(cli):
    assert cli("--version").stdout == f"snapbeam {__version__}\n"
    commands = cli("--help").stdout
    for name in ("map", "simulate", "frequencies", "plot", "info"):
        assert name in commands
        text = cli(name, "--help")
        assert text.exit_code == 0
        assert "\\" not in text.stdout, "a formula's markup is no word for a terminal"
    assert "N/m^1.5" in re.sub(r"\s+", " ", cli("map", "--help-all").stdout)


REFUSALS = [
    (("map", "--modes", "0"), "modes = 0: must be an integer in [1, 256]"),
    (("map", "--cycles", "0"), "[integration] cycles = 0: must be an integer in [1, 10000000]"),
    (("map", "--frequency-ratio", "0.1:4"), "or start:stop:count, such as 0.1:4:64"),
    (("map", "--frequency-ratio", "-1:4:8"), "frequency_ratio"),
    (("map", "--location", "1.5"), "location"),
    (("map", "--thickness", "0.4"), "is it given in mm?"),
    (("map", "-o", "none/map.nc"), "cannot be written, 'none' is not an existing folder"),
    (("map", "-o", "map.txt"), "must end in .nc"),
    (("map", "-o", "map.csv"), "snapbeam info map.nc --export map.csv"),
    (("map", "--plot", "map.gif"), "must end in .png or .pdf or .svg"),
    (("map", "--plot", "map.png", "--location", "0.2:0.5:3"), "drawn over one or two axes, not 3"),
    (("map", "--measurements", "none.csv"), "none.csv': cannot be read"),
    (("map", "--config", "none.toml"), "cannot be read, No such file"),
    (("map", "--axial-load", "1.0"), "axial_load"),
    (("simulate", "--window", "3"), "window = '3': must be first:last"),
    (("simulate", "--side", "left"), "must be one of 'below', 'above'"),
    (("frequencies", "--buckling-level", "1e-4", "--axial-load", "30"), "give exactly one of the two"),
    (("info", "none.nc"), "no such file"),
    (("plot", "none.nc", "-o", "a.png"), "no such file"),
]


@pytest.mark.parametrize(("args", "message"), REFUSALS, ids=[" ".join(case[0]) for case in REFUSALS])
def test_refusals_come_before_computing(cli, tmp_path, args, message):
    result = cli(*args)
    assert result.exit_code == 2, result.output
    assert message in result.stderr
    said = [line for line in result.stderr.splitlines() if not line.startswith("note: ")]
    assert said[0].startswith("error: ")
    assert "Traceback" not in result.output
    assert not list(tmp_path.iterdir())


def test_text_where_a_number_belongs(cli):
    result = cli("map", "--length", "16 kg")
    assert result.exit_code == 2
    assert "'16 kg' is not a number" in " ".join(result.stderr.split())
    near = cli("map", "--lenght", "0.16")
    assert near.exit_code == 2 and "--length" in near.stderr


def test_unknown_key_of_a_file(cli, tmp_path):
    (tmp_path / "beam.toml").write_text("[beam]\nlenght = 0.161\n", encoding="utf-8")
    result = cli("map", "--config", "beam.toml")
    assert result.exit_code == 2
    assert result.stderr == "error: beam.toml: [beam] lenght: unknown key; did you mean 'length'?\n"


def test_map_writes_what_it_says(cli, tmp_path):
    result = cli(*MAP, "-o", str(tmp_path / "map.nc"), "--plot", "map.png", "--quasi-static-line")
    assert result.exit_code == 0, result.output
    assert sorted(file.name for file in tmp_path.iterdir()) == ["map.nc", "map.png"]
    dataset = xr.load_dataset(tmp_path / "map.nc", engine="h5netcdf")
    assert dataset["response_class"].dims == ("frequency_ratio", "velocity_amplitude")
    assert dataset["response_class"].shape == (4, 3)
    assert dataset["response_class"].dtype == "int8"
    assert dataset.attrs["modes"] == 1 and dataset.attrs["cycles"] == 8
    assert dataset.attrs["command"] == " ".join(
        ("snapbeam", *MAP, "-o", "map.nc", "--plot", "map.png", "--quasi-static-line")
    )
    assert not any(str(tmp_path) in str(value) for value in dataset.attrs.values())
    assert "12 runs of 1 mode over 8 cycles" in result.stdout
    counts = {int(k): int((dataset["response_class"] == k).sum()) for k in range(4)}
    assert re.search(rf"intrawell +{counts[0]} ", result.stdout)
    assert f"Written: {tmp_path / 'map.nc'} (" in result.stdout and "Written: map.png" in result.stdout
    assert "snapbeam simulate" in result.stdout
    assert "12 of 12 points" in result.stderr

    told = cli("info", "map.nc").stdout
    assert "frequency_ratio 4, velocity_amplitude 3" in told
    assert "contact_stiffness" in told and __version__ in told

    again = cli("plot", "map.nc", "-o", "map.pdf", "--quasi-static-line")
    assert again.exit_code == 0 and (tmp_path / "map.pdf").read_bytes().startswith(b"%PDF")
    other = cli(*MAP, "-o", "b.nc", "--plot", "b.png", "--variable", "peak_force")
    assert other.exit_code == 0, other.output
    assert (tmp_path / "b.png").read_bytes() != (tmp_path / "map.png").read_bytes()
    for wrong, words in (
        (("--plot", "c.png", "--variable", "peak_forc"), "variable = 'peak_forc': must be one of"),
        (("--variable", "peak_force"), "give --plot FILE"),
        (("--plot", "c.png", "--variable", "peak_force", "--quasi-static-line"), "leave them out"),
    ):
        refused = cli(*MAP, "-o", "c.nc", *wrong)
        assert refused.exit_code == 2 and words in " ".join(refused.stderr.split())
    refused = cli("plot", "map.nc", "-o", "b.png", "--location", "0.3")
    assert refused.exit_code == 2 and "location: is not an axis of this file" in refused.stderr


def test_file_and_options_together(cli, tmp_path):
    (tmp_path / "beam.toml").write_text(
        "extends = 'paper'\n[model]\nmodes = 2\n[integration]\ncycles = 4\n"
        "[sweep]\nfrequency_ratio = [0.5, 1.0]\n[drive]\nvelocity_amplitude = 0.3\n"
        "[contact]\nstiffness = 1e8\n",
        encoding="utf-8",
    )
    result = cli("map", "--config", "beam.toml", "--cycles", "6", "--location", "0.3,0.4")
    assert result.exit_code == 0, result.output
    dataset = xr.load_dataset(tmp_path / "map.nc", engine="h5netcdf")
    assert dict(dataset.sizes) == {"frequency_ratio": 2, "location": 2}
    assert (dataset.attrs["modes"], dataset.attrs["cycles"], dataset.attrs["contact_stiffness"]) == (2, 6, 1e8)


def test_simulate(cli, tmp_path):
    run = ("simulate", "--modes", "2", "--cycles", "5", "--frequency-ratio", "0.5", "--velocity-amplitude", "0.4")
    result = cli(*run, "-o", "run.nc", "--plot", "run.png", "--window", "0:5")
    assert result.exit_code == 0, result.output
    assert re.search(r"intrawell|interwell", result.stdout.splitlines()[0])
    assert "peak contact force" in result.stdout
    dataset = xr.load_dataset(tmp_path / "run.nc", engine="h5netcdf")
    assert dataset.sizes["mode"] == 2
    assert float(dataset["cycle"][-1]) == pytest.approx(5.0, rel=1e-3)
    assert (tmp_path / "run.png").stat().st_size > 20_000
    assert cli("plot", "run.nc", "-o", "again.svg", "--window", "0:2").exit_code == 0
    assert "contact_force" in cli("info", "run.nc").stdout


def test_a_threshold_and_options_of_other_figures(cli):
    """A file of a threshold has response classes too, but its figure is not that of a map."""
    args = ("threshold", "--modes", "1", "--cycles", "8", "--frequency-ratio", "1:2:2", "-o", "border.nc")
    assert cli(*args).exit_code == 0
    assert cli("plot", "border.nc", "-o", "border.png").exit_code == 0
    for options in (("--window", "0:2"), ("--quasi-static-line",), ("--velocity-amplitude", "0.2")):
        refused = cli("plot", "border.nc", "-o", "b.png", *options)
        assert refused.exit_code == 2 and "leave" in refused.output


def test_frequencies(cli):
    lines = cli("frequencies", "--count", "3").stdout.splitlines()
    assert lines[0].startswith("P = 37.19 N, P_cr = 24.37 N: buckled by b = 335 µm")
    numbers = [[float(word) for word in line.split()] for line in lines[2:]]
    assert numbers[0] == pytest.approx([1, 81.853, 81.852, 0.001, 80.32], abs=6e-3)
    assert numbers[1][1:3] == pytest.approx([159.268, 159.266], abs=1e-3)
    assert numbers[2][4] > 221.0
