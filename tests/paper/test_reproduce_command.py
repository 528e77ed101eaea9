"""``snapbeam reproduce``: figures and claims from the command line."""

from __future__ import annotations

import pytest
import xarray as xr
from typer.testing import CliRunner

from snapbeam.cli.app import app
from snapbeam.paper.cli import _computed


@pytest.fixture
def cli(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return lambda *args: CliRunner().invoke(app, ("reproduce", *args), catch_exceptions=False)


def test_a_figure_with_its_data(cli, tmp_path):
    done = cli("figA9", "-o", "out")
    assert done.exit_code == 0 and "error of the natural frequencies" in done.stdout
    assert "figA9: quick sketch" in done.stdout
    assert sorted(file.name for file in (tmp_path / "out").iterdir()) == ["figA9.nc", "figA9.pdf", "figA9.png"]
    again = cli("figA9", "--data", "out", "-o", "again")
    assert again.exit_code == 0 and (tmp_path / "again/figA9.pdf").is_file()


@pytest.mark.parametrize(
    ("args", "words"),
    [
        (("fig1",), "figure = 'fig1': must be one of 'fig2'"),
        (("figA9", "--data", "none"), "read = 'none': must be an existing folder"),
        (("fig2", "--measurements", "a.csv"), "fig2 shows no measured responses"),
    ],
)
def test_refusals(cli, args, words):
    refused = cli(*args)
    assert refused.exit_code == 2
    assert words in " ".join(refused.output.split())


def test_a_sketch_states_the_modes_and_cycles_that_were_run():
    """Not those of the paper's figure."""
    found = {"a": xr.Dataset(attrs={"modes": 1, "cycles": 40}), "b": xr.Dataset(attrs={"modes": 4, "cycles": 40.0})}
    assert _computed({"fig6": found}, "fig6") == "N = 1 and 4, 40 cycles"
    assert _computed({"fig2": {"a": xr.Dataset()}}, "fig2") == "with a small grid"
